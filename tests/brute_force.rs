//! Refined normals, tensors, fold angles and thresholds against a naive computation.
//!
//! The computation in here is written from `docs/ALGORITHM.md`, sections 0, 1A and 1B, and from nothing else: plain
//! arrays, every neighbourhood found by looking at all faces, every level by counting all samples again, eigenvalues by
//! another library. It is slow and has no tiles, threads, local ids or caches that could be wrong.

mod support;

use crease::math::Sym3;
use crease::{Params, Sigma, Tiling};
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use support::Mesh;
use support::steps::{Steps, Tile, plan};

type Vector = [f64; 3];
type Cube = [i64; 3];

const DEGREE: f64 = PI / 180.0;

/// Normals, noise, tensors and thresholds agree this well, relative to their size.
const TOLERANCE: f64 = 1e-12;
/// Eigenvalues, divided by the largest, agree this well: the solvers differ.
const EIGEN_TOLERANCE: f64 = 1e-10;
/// The fold angle holds the root of l2: where l2 is smaller, the rounding of the solver shows.
const CONDITIONED: f64 = 1e-8;

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn times(a: Vector, s: f64) -> Vector {
    a.map(|x| x * s)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// A face that takes part.
struct Face {
    corners: [usize; 3],
    normal: Vector,
    area: f64,
    barycentre: Vector,
}

/// The mesh with its unit of length and its neighbourhoods.
struct Naive {
    points: Vec<Vector>,
    /// Faces by id, without those that name a corner twice or repeat an earlier face.
    faces: BTreeMap<usize, Face>,
    /// Faces around each vertex.
    around: Vec<BTreeSet<usize>>,
    /// One-ring of each vertex.
    ring: Vec<BTreeSet<usize>>,
    /// Ordered pairs of faces that run along a common edge in the same direction.
    opposed: BTreeSet<(usize, usize)>,
    /// Faces at each edge.
    edges: BTreeMap<(usize, usize), BTreeSet<usize>>,
    h: f64,
    k: f64,
}

impl Naive {
    fn new(mesh: &Mesh, sigma_edges: f64) -> Naive {
        let points: Vec<Vector> = mesh.positions.iter().map(|p| p.to_array()).collect();
        let corners: Vec<[usize; 3]> = mesh.faces.iter().map(|f| f.map(|v| v as usize)).collect();
        let h = median_side(&points, &corners);
        let mut faces = BTreeMap::new();
        let mut taken: BTreeSet<BTreeSet<usize>> = BTreeSet::new();
        for (id, &[a, b, c]) in corners.iter().enumerate() {
            let distinct = BTreeSet::from([a, b, c]);
            if distinct.len() < 3 || !taken.insert(distinct) {
                continue;
            }
            let [p, q, r] = [a, b, c].map(|v| points[v]);
            let twice = cross(minus(q, p), minus(r, p));
            let degenerate = norm(twice) <= 1e-10 * h * h;
            faces.insert(
                id,
                Face {
                    corners: [a, b, c],
                    normal: if degenerate { [0.0; 3] } else { times(twice, 1.0 / norm(twice)) },
                    area: if degenerate { 0.0 } else { norm(twice) / 2.0 },
                    barycentre: times(plus(plus(p, q), r), 1.0 / 3.0),
                },
            );
        }
        let around: Vec<BTreeSet<usize>> = (0..points.len())
            .map(|v| faces.iter().filter(|(_, f)| f.corners.contains(&v)).map(|(&id, _)| id).collect())
            .collect();
        let ring = around
            .iter()
            .enumerate()
            .map(|(v, fs)| fs.iter().flat_map(|f| faces[f].corners).filter(|&u| u != v).collect())
            .collect();
        let mut directed: BTreeMap<(usize, usize), BTreeSet<usize>> = BTreeMap::new();
        for (&id, face) in &faces {
            let [a, b, c] = face.corners;
            for edge in [(a, b), (b, c), (c, a)] {
                directed.entry(edge).or_default().insert(id);
            }
        }
        let (mut opposed, mut edges) = (BTreeSet::new(), BTreeMap::new());
        for (&(a, b), same) in &directed {
            opposed.extend(
                same.iter().flat_map(|&f| same.iter().filter(move |&&g| g != f).map(move |&g| (f, g))),
            );
            let edge: &mut BTreeSet<usize> = edges.entry((a.min(b), a.max(b))).or_default();
            edge.extend(same);
        }
        Naive { points, faces, around, ring, opposed, edges, h, k: sigma_edges / 3.0 }
    }

    /// The normal of `g` as it votes for `f`.
    fn seen(&self, f: usize, g: usize, normal_f: Vector, normal_g: Vector) -> Vector {
        if self.opposed.contains(&(f, g)) && dot(normal_f, normal_g) < 0.0 {
            times(normal_g, -1.0)
        } else {
            normal_g
        }
    }

    /// Minimum corner of the bounds of all vertices in use.
    fn corner(&self) -> Vector {
        let used = || self.points.iter().zip(&self.around).filter(|(_, around)| !around.is_empty());
        [0, 1, 2].map(|axis| used().map(|(p, _)| p[axis]).fold(f64::INFINITY, f64::min))
    }

    fn cube(&self, corner: Vector, p: Vector) -> Cube {
        let edge = 6.0 * self.k * self.h;
        [0, 1, 2].map(|axis| ((p[axis] - corner[axis]) / edge).floor() as i64)
    }

    /// level(x, q) at each of `at`.
    fn levels(&self, samples: &[(Vector, f64)], at: &[Vector], q: f64) -> Vec<f64> {
        let corner = self.corner();
        let samples: Vec<(Cube, Option<i64>)> =
            samples.iter().map(|&(p, x)| (self.cube(corner, p), bin(x))).collect();
        let mut known: BTreeMap<Cube, f64> = BTreeMap::new();
        let level = |centre: Cube| {
            let near = |cube: &Cube| (0..3).all(|axis| (cube[axis] - centre[axis]).abs() <= 1);
            let mut histogram: BTreeMap<Option<i64>, usize> = BTreeMap::new();
            samples.iter().filter(|(c, _)| near(c)).for_each(|(_, b)| *histogram.entry(*b).or_default() += 1);
            let n: usize = histogram.values().sum();
            if n == 0 {
                return 0.0;
            }
            let rank = (q * (n - 1) as f64).floor() as usize;
            let mut below = 0;
            for (bin, count) in histogram {
                below += count;
                if below > rank {
                    return bin.map_or(0.0, centre_of);
                }
            }
            unreachable!("the rank is below the count")
        };
        at.iter().map(|&p| *known.entry(self.cube(corner, p)).or_insert_with_key(|&c| level(c))).collect()
    }

    /// s0 at each of `at`.
    fn noise(&self, at: &[Vector]) -> Vec<f64> {
        let mut chords = Vec::new();
        for (&(a, b), faces) in self.edges.iter().filter(|(_, faces)| faces.len() == 2) {
            let (f, g) = (*faces.first().expect("a face"), *faces.last().expect("a face"));
            if self.faces[&f].area > 0.0 && self.faces[&g].area > 0.0 {
                let (nf, ng) = (self.faces[&f].normal, self.faces[&g].normal);
                let midpoint = times(plus(self.points[a], self.points[b]), 0.5);
                chords.push((midpoint, norm(minus(nf, self.seen(f, g, nf, ng)))));
            }
        }
        self.levels(&chords, at, 0.5)
    }

    /// K for a noise of s0.
    fn rounds(&self, s0: f64) -> u32 {
        let k2 = self.k * self.k;
        (80.0 * s0 * k2 + 0.5).floor().min((40.0 * k2).round()) as u32
    }

    /// Normals after all rounds. `s0` and `rounds` are by face.
    fn refined(&self, s0: &BTreeMap<usize, f64>) -> BTreeMap<usize, Vector> {
        let mut normals: BTreeMap<usize, Vector> =
            self.faces.iter().map(|(&f, face)| (f, face.normal)).collect();
        for round in 0..(40.0 * self.k * self.k).round() as u32 {
            let old = normals.clone();
            for (&f, face) in self.faces.iter().filter(|(f, _)| self.rounds(s0[f]) > round) {
                let s0 = s0[&f];
                let w = if round == 0 {
                    (1.5 * DEGREE).max(8.0 * s0)
                } else {
                    let widest = if round <= 5 { 30.0 } else { 45.0 };
                    (1.5 * DEGREE).max((4.0 * s0).min(widest * DEGREE))
                };
                let mut sum = [0.0; 3];
                for g in face.corners.iter().flat_map(|&v| &self.around[v]) {
                    let normal = self.seen(f, *g, old[&f], old[g]);
                    let d = norm(minus(old[&f], normal));
                    let kernel = (1.0 - (d / w) * (d / w)).max(0.0);
                    sum = plus(sum, times(normal, self.faces[g].area * kernel * kernel));
                }
                if norm(sum) > 0.0 {
                    normals.insert(f, times(sum, 1.0 / norm(sum)));
                }
            }
        }
        normals
    }

    /// T0 and the weighted sum of normals at each vertex.
    fn first_votes(&self, normals: &BTreeMap<usize, Vector>) -> Vec<(Matrix3<f64>, Vector)> {
        let vote = |v: usize| {
            let (mut tensor, mut normal) = (Matrix3::zeros(), [0.0; 3]);
            let largest = self.around[v].iter().map(|f| self.faces[f].area).fold(0.0, f64::max);
            for face in self.around[v].iter().filter(|f| self.faces[f].area > 0.0) {
                let n = normals[face];
                let face = &self.faces[face];
                let distance = norm(minus(face.barycentre, self.points[v]));
                let mu = face.area / largest * libm::exp(-distance / (self.k * self.h));
                tensor += Matrix3::from_fn(|i, j| mu * n[i] * n[j]);
                normal = plus(normal, times(n, mu));
            }
            (tensor, normal)
        };
        (0..self.points.len()).map(vote).collect()
    }

    /// T after the repeated votes.
    fn vote_again(&self, first: &[(Matrix3<f64>, Vector)]) -> Vec<Matrix3<f64>> {
        let mut tensors: Vec<Matrix3<f64>> = first.iter().map(|(tensor, _)| *tensor).collect();
        for _ in 0..(3.0 * self.k * self.k).round() as u32 {
            let old = tensors.clone();
            for (v, tensor) in tensors.iter_mut().enumerate() {
                *tensor = self.ring[v].iter().fold(old[v] * 2.0, |sum, &u| sum + old[u]);
            }
        }
        tensors
    }

    /// T after the votes of the calm, `further[v]` of them at each vertex.
    fn widen(&self, again: &[Matrix3<f64>], further: &[usize]) -> Vec<Matrix3<f64>> {
        let mut tensors = again.to_vec();
        for round in 0..further.iter().copied().max().unwrap_or(0) {
            let old = tensors.clone();
            for (v, tensor) in tensors.iter_mut().enumerate().filter(|(v, _)| further[*v] > round) {
                *tensor = self.ring[v].iter().fold(old[v] * 2.0, |sum, &u| sum + old[u]) / 8.0;
            }
        }
        tensors
    }
}

/// Bin of a value: its binary exponent and the top three bits of its mantissa; `None` below 2^-30.
fn bin(x: f64) -> Option<i64> {
    let exponent = (-30..10).rev().find(|&e| x >= libm::ldexp(1.0, e))?;
    Some(i64::from(exponent) * 8 + ((x / libm::ldexp(1.0, exponent) - 1.0) * 8.0).floor() as i64)
}

/// Centre of a bin.
fn centre_of(bin: i64) -> f64 {
    libm::ldexp(1.0 + (bin.rem_euclid(8) as f64 + 0.5) / 8.0, bin.div_euclid(8) as i32)
}

/// h: the median of the sides, rounded down to a 64th of an octave of the squared length.
fn median_side(points: &[Vector], corners: &[[usize; 3]]) -> f64 {
    let mut bins = Vec::new();
    for &[a, b, c] in corners {
        for (u, v) in [(a, b), (b, c), (c, a)] {
            let side = minus(points[u], points[v]);
            bins.push(dot(side, side).to_bits() >> 46);
        }
    }
    // A side without length is none.
    bins.retain(|&bin| bin > 0);
    bins.sort_unstable();
    f64::from_bits(bins[(bins.len() - 1) / 2] << 46).sqrt()
}

/// Eigenvalues over the largest, descending; zero for the zero tensor.
fn eigenvalues(tensor: &Matrix3<f64>) -> Vector {
    let mut values: Vec<f64> = SymmetricEigen::new(*tensor).eigenvalues.iter().map(|l| l.max(0.0)).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    if values[0] > 0.0 { [1.0, values[1] / values[0], values[2] / values[0]] } else { [0.0; 3] }
}

/// The line direction t, without a sign: the last eigenvector of the wide tensor made orthogonal to the mean normal;
/// `None` where either is not well defined.
fn direction(wide: &Matrix3<f64>, normal: Vector) -> Option<Vector> {
    let eigen = SymmetricEigen::new(*wide);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let apart = eigen.eigenvalues[order[1]] - eigen.eigenvalues[order[0]];
    let column = eigen.eigenvectors.column(order[0]);
    let along = [column[0], column[1], column[2]];
    let n = times(normal, 1.0 / norm(normal));
    let t = minus(along, times(n, dot(along, n)));
    (apart > 1e-4 * wide.trace() && norm(t) > 0.1).then(|| times(t, 1.0 / norm(t)))
}

fn matrix(t: &Sym3) -> Matrix3<f64> {
    Matrix3::new(t.diag.x, t.off.z, t.off.y, t.off.z, t.diag.y, t.off.x, t.off.y, t.off.x, t.diag.z)
}

/// How many of each quantity were compared.
#[derive(Default)]
struct Comparison(BTreeMap<&'static str, usize>);

impl Comparison {
    fn check(&mut self, what: &'static str, at: usize, ours: f64, naive: f64, tolerance: f64) {
        let off = (ours - naive).abs();
        assert!(off <= tolerance, "{what} at {at}: {ours:e}, naive {naive:e}, {off:e} apart");
        *self.0.entry(what).or_default() += 1;
    }

    fn count(&self, what: &str) -> usize {
        self.0.get(what).copied().unwrap_or(0)
    }
}

/// What a mesh must show for its comparison to mean something.
struct Expected {
    /// Its largest K lies in this range.
    rounds: std::ops::RangeInclusive<u32>,
    /// At least this share of the vertices has a well-conditioned fold angle.
    conditioned: f64,
}

fn compare(mesh: &Mesh, sigma_edges: f64, expected: &Expected) -> Comparison {
    let params = Params { sigma: Sigma::Edges(sigma_edges), ..Params::default() };
    let source = mesh.source();
    let plan = plan(&source, &params, Tiling::InCore);
    let tile = Tile::load(&source, &plan, &|_| (), &plan.cells[0]);
    let steps = Steps::compute(&tile, &plan);
    let naive = Naive::new(mesh, sigma_edges);
    assert_eq!(plan.scale.h.to_bits(), naive.h.to_bits(), "h is {}, naive {}", plan.scale.h, naive.h);

    let mut seen = Comparison::default();
    let ids: Vec<usize> = tile.mesh.face_ids.iter().map(|id| id.0 as usize).collect();
    assert_eq!(ids, naive.faces.keys().copied().collect::<Vec<_>>(), "other faces take part");
    let barycentres: Vec<Vector> = naive.faces.values().map(|f| f.barycentre).collect();
    let levels = naive.noise(&barycentres);
    let s0: BTreeMap<usize, f64> = ids.iter().copied().zip(levels).collect();
    let refined = naive.refined(&s0);
    for (local, f) in ids.iter().enumerate() {
        seen.check("s0 of a face", *f, tile.noise[local].expect("known in core"), s0[f], TOLERANCE * s0[f]);
        let rounds = tile.face_rounds[local].expect("known in core");
        assert_eq!(rounds, naive.rounds(s0[f]), "K of face {f}");
        // A face without area has no normal to speak of.
        if naive.faces[f].area > 0.0 {
            for (ours, theirs) in steps.normals[local].to_array().into_iter().zip(refined[f]) {
                seen.check("refined normal", *f, ours, theirs, TOLERANCE);
            }
        }
    }
    let most = tile.face_rounds.iter().flatten().max().expect("a face");
    assert!(expected.rounds.contains(most), "the largest K is {most}");

    let at_vertices = naive.noise(&naive.points);
    let first = naive.first_votes(&refined);
    let again = naive.vote_again(&first);
    let [narrow, wide]: [Vec<Vector>; 2] =
        [first.iter().map(|(t, _)| eigenvalues(t)).collect(), again.iter().map(eigenvalues).collect()];
    let theta: Vec<f64> =
        narrow.iter().zip(&wide).map(|(a, b)| libm::atan(a[1].sqrt()) + libm::atan(b[1].sqrt())).collect();
    let used: Vec<usize> = (0..naive.points.len()).filter(|&v| !naive.around[v].is_empty()).collect();
    let samples: Vec<(Vector, f64)> = used.iter().map(|&v| (naive.points[v], theta[v])).collect();
    let background = naive.levels(&samples, &naive.points, 0.3);
    let further: Vec<usize> = (0..naive.points.len())
        .map(|v| {
            let calm = 2.0 * background[v] < 6.0 * DEGREE;
            if calm { (0.3 * f64::from(naive.rounds(at_vertices[v]))).floor() as usize } else { 0 }
        })
        .collect();
    let widened = naive.widen(&again, &further);
    let locals: Vec<usize> = tile.mesh.vertex_ids.iter().map(|id| id.0 as usize).collect();
    assert_eq!(locals, used, "other vertices take part");
    for (local, &v) in locals.iter().enumerate() {
        let local = local as u32;
        assert_eq!(tile.vertex_rounds[local as usize], naive.rounds(at_vertices[v]), "K of vertex {v}");
        let token = steps.tokens.get(local);
        for (what, ours, theirs) in [
            ("T0", matrix(&token.tensor), first[v].0),
            ("T after the repeated votes", matrix(&steps.again.get(local)), again[v]),
        ] {
            let size = theirs.trace();
            ours.iter().zip(&theirs).for_each(|(a, b)| seen.check(what, v, *a, *b, TOLERANCE * size));
        }
        // Where windings disagree, the mean normal is only as good as the choice of a side.
        let opposed = |f: &usize| naive.opposed.range((*f, 0)..=(*f, usize::MAX)).next().is_some();
        if !naive.around[v].iter().any(opposed) {
            for (a, b) in token.normal.to_array().into_iter().zip(first[v].1) {
                seen.check("sum of the normals", v, a, b, TOLERANCE * first[v].0.trace());
            }
            if let Some(t) = direction(&again[v], first[v].1) {
                let cosine = dot(t, steps.votes.get(local).t.to_array()).abs();
                seen.check("cosine to the line direction", v, cosine, 1.0, EIGEN_TOLERANCE);
            }
        }
        let vote = steps.votes.get(local);
        let [l1, l2, l3] = vote.eigenvalues;
        assert_eq!(l1, narrow[v][0], "l1 of vertex {v}");
        seen.check("l2", v, l2, narrow[v][1], EIGEN_TOLERANCE);
        seen.check("l3", v, l3, narrow[v][2], EIGEN_TOLERANCE);
        if narrow[v][1] > CONDITIONED && wide[v][1] > CONDITIONED {
            seen.check("narrow theta", v, steps.narrow.get(local).theta, theta[v], EIGEN_TOLERANCE);
            let widest = eigenvalues(&widened[v])[1];
            let mean =
                if further[v] > 0 { (theta[v] + libm::atan(widest.sqrt())) * 2.0 / 3.0 } else { theta[v] };
            seen.check("theta", v, vote.theta, mean, EIGEN_TOLERANCE);
        }
        let raised = 2.0 * background[v] * (1.0 + 0.045 * further[v] as f64);
        let threshold = raised.clamp(0.6 * DEGREE, 20.0 * DEGREE);
        seen.check("threshold", v, steps.surroundings.get(local).threshold, threshold, TOLERANCE);
        if further[v] > 0 {
            seen.check(
                "further votes",
                v,
                steps.surroundings.get(local).further as f64,
                further[v] as f64,
                0.0,
            );
        }
    }
    assert!(
        seen.count("theta") as f64 >= expected.conditioned * used.len() as f64,
        "only {} of {} fold angles could be compared",
        seen.count("theta"),
        used.len()
    );
    assert!(seen.count("refined normal") >= 3 * 100 && seen.count("sum of the normals") > 0);
    seen
}

/// Most vertices of a mesh with noise have everything that can be compared.
fn compare_noisy(name: &str, rounds: std::ops::RangeInclusive<u32>) {
    let mesh = Mesh::of_fixture(name);
    let seen = compare(&mesh, 3.0, &Expected { rounds, conditioned: 0.99 });
    assert_eq!(seen.count("l2"), mesh.positions.len());
    assert_eq!(seen.count("refined normal"), 3 * mesh.faces.len());
    assert!(4 * seen.count("cosine to the line direction") > mesh.positions.len(), "{:?}", seen.0);
}

#[test]
fn bracket() {
    compare_noisy("bracket", 10..=20);
}

#[test]
fn folds() {
    compare_noisy("folds20", 10..=20);
}

#[test]
fn city() {
    compare_noisy("city", 3..=20);
}

/// Another sigma scales the level cubes, the rounds, the falloff of the votes and their number.
#[test]
fn bracket_at_a_wider_scale() {
    compare(&Mesh::of_fixture("bracket"), 4.5, &Expected { rounds: 21..=45, conditioned: 0.99 });
}

/// Flipped faces, a copy, a face without area, a third face at an edge, an unused vertex. The grid is flat otherwise, so
/// that few fold angles are more than rounding.
#[test]
fn defects() {
    let mesh = Mesh::of_fixture("defects");
    let seen = compare(&mesh, 3.0, &Expected { rounds: 0..=0, conditioned: 0.02 });
    assert!(seen.count("l2") < mesh.positions.len(), "every vertex is in use");
    assert!(seen.count("s0 of a face") < mesh.faces.len(), "every face takes part");
}

/// The same defects where there is noise to refine: each of them votes, or must not, in many rounds.
#[test]
fn defects_among_noise() {
    let mut mesh = Mesh::of_fixture("bracket");
    let centre = mesh.positions[0];
    for face in &mut mesh.faces {
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        if ((a + b + c) / 3.0 - centre).length() < 5.0 {
            face.swap(1, 2);
        }
    }
    let copied: Vec<[u32; 3]> = mesh.faces.iter().step_by(50).map(|&[a, b, c]| [b, a, c]).collect();
    let fins: Vec<[u32; 3]> =
        mesh.faces.iter().step_by(70).map(|&[a, b, _]| [a, b, (a + 1500) % 3000]).collect();
    let pointed: Vec<[u32; 3]> = mesh.faces.iter().step_by(90).map(|&[a, b, _]| [a, b, a]).collect();
    // Slivers without area: the third corner is the middle of an edge.
    let slit: Vec<[u32; 2]> = mesh.faces.iter().step_by(110).map(|&[a, b, _]| [a, b]).collect();
    for [a, b] in slit {
        let middle = (mesh.positions[a as usize] + mesh.positions[b as usize]) / 2.0;
        mesh.faces.push([a, b, mesh.positions.len() as u32]);
        mesh.positions.push(middle);
    }
    mesh.faces.extend(copied.iter().chain(&fins).chain(&pointed));
    let seen = compare(&mesh, 3.0, &Expected { rounds: 10..=20, conditioned: 0.9 });
    let excluded = copied.len() + pointed.len();
    assert_eq!(seen.count("s0 of a face"), mesh.faces.len() - excluded, "other faces take part");
    let normals = seen.count("sum of the normals") / 3;
    assert!(normals < mesh.positions.len() - 20, "no winding disagrees");
    assert!(seen.count("refined normal") < 3 * seen.count("s0 of a face"), "no face is without area");
}
