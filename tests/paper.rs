//! The paper method against cases worked out by hand, and its neighbourhoods against a search through all faces.

mod support;

use crease::config::PaperThresholds;
use crease::glam::DVec3;
use crease::mesh::{Field, TileMesh};
use crease::partition::{PaperReach, Pass, Plan};
use crease::refine::{OmegaRange, Salience, Supporters};
use crease::stitch::Class;
use crease::voting::{Initial, Stop, Vote, Voters, omega};
use crease::{Method, Params, Sigma, Tiling};
use std::collections::BTreeSet;
use support::paper_steps::PaperTile;
use support::steps::plan;
use support::{Mesh, fixture, in_core, open, run};

const TOLERANCE: f64 = 1e-12;

fn paper(sigma: Sigma) -> Params {
    Params { method: Method::Paper(PaperThresholds::default()), sigma, ..Params::default() }
}

/// The whole mesh as one tile.
fn whole(mesh: &Mesh, sigma: Sigma) -> (Plan, PaperTile) {
    let source = mesh.source();
    let plan = plan(&source, &paper(sigma), Tiling::InCore);
    let reach = PaperReach::new(sigma, &plan.scale);
    let tile = PaperTile::load(&source, &plan, &reach, Pass::Links, &plan.cells[0]);
    (plan, tile)
}

/// The vote at vertex 0 of a fan around it, where only the one-ring votes.
fn fan(ring: &[DVec3], closed: bool) -> Vote {
    let mut mesh = Mesh { positions: vec![DVec3::ZERO], faces: Vec::new() };
    mesh.positions.extend(ring);
    let n = ring.len() as u32;
    mesh.faces.extend((1..n).map(|i| [0, i, i + 1]));
    if closed {
        mesh.faces.push([0, n, 1]);
    }
    let (plan, tile) = whole(&mesh, Sigma::Length(0.0));
    tile.votes(&plan, &paper(Sigma::Length(0.0))).get(0)
}

/// A ridge along y through vertex 0: both sides fall off, so that the normals are `degrees` apart.
fn roof(degrees: f64) -> Vote {
    let half = degrees.to_radians() / 2.0;
    let (x, z) = (libm::cos(half), -libm::sin(half));
    fan(&[DVec3::Y, DVec3::new(-x, 0.0, z), -DVec3::Y, DVec3::new(x, 0.0, z)], true)
}

#[track_caller]
fn assert_near(ours: [f64; 3], hand: [f64; 3]) {
    assert!(ours.iter().zip(hand).all(|(a, b)| (a - b).abs() < TOLERANCE), "{ours:?}, by hand {hand:?}");
}

fn initial(vote: &Vote) -> Initial {
    Initial::of(vote.eigenvalues, &PaperThresholds::default())
}

#[test]
fn a_plane_is_a_face() {
    let vote = fan(&[DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y], true);
    assert_near(vote.eigenvalues, [1.0, 0.0, 0.0]);
    assert_eq!((initial(&vote), omega(vote.eigenvalues)), (Initial::Face, 0.0));
}

#[test]
fn the_edge_of_a_box_has_two_equal_eigenvalues() {
    let vote = roof(90.0);
    let half = 0.5f64.sqrt();
    assert_near(vote.eigenvalues, [half, half, 0.0]);
    assert!((omega(vote.eigenvalues) - (half - 0.5)).abs() < TOLERANCE);
    assert_eq!(initial(&vote), Initial::SharpEdge);
    assert!((vote.t.dot(DVec3::Y).abs() - 1.0).abs() < TOLERANCE, "{}", vote.t);
    assert!((vote.b.dot(DVec3::X).abs() - 1.0).abs() < TOLERANCE, "{}", vote.b);
    assert!((vote.theta.to_degrees() - 90.0).abs() < 1e-6);
}

#[test]
fn the_corner_of_a_cube_has_three() {
    let vote = fan(&[DVec3::X, DVec3::Y, DVec3::Z], true);
    let third = (1.0f64 / 3.0).sqrt();
    assert_near(vote.eigenvalues, [third; 3]);
    assert!((omega(vote.eigenvalues) - (3.0f64.sqrt() - 1.0) / 2.0).abs() < TOLERANCE);
    assert_eq!(initial(&vote), Initial::Corner);
}

/// The ratio of l2 and l1 of an even fold is tan^2 of half the fold: 16.0 degrees is just below 0.020, 16.2 just above.
#[test]
fn sharp_edges_begin_at_sixteen_degrees() {
    for (degrees, expected) in [(16.0, Initial::Face), (16.2, Initial::SharpEdge)] {
        let vote = roof(degrees);
        let tangent = libm::tan(degrees.to_radians() / 2.0);
        let ratio = tangent * tangent;
        let norm = (1.0 + ratio * ratio).sqrt();
        assert_near(vote.eigenvalues, [1.0 / norm, ratio / norm, 0.0]);
        assert_eq!(initial(&vote), expected, "{degrees} degrees: {:?}", vote.eigenvalues);
    }
}

#[test]
fn thresholds_divide_classes() {
    let published = PaperThresholds::default();
    for (l2, l3, expected) in [
        (0.0199, 0.0, Initial::Face),
        (0.02, 0.0, Initial::SharpEdge),
        (0.5, 0.0649, Initial::SharpEdge),
        (0.5, 0.065, Initial::Corner),
        (0.065, 0.065, Initial::Corner),
    ] {
        let l1 = (1.0f64 - l2 * l2 - l3 * l3).sqrt();
        assert_eq!(Initial::of([l1, l2, l3], &published), expected, "{l2} {l3}");
    }
    let own = PaperThresholds { corner_l3: 0.3, edge_l2: 0.1, ..published };
    assert_eq!(Initial::of([0.9, 0.2, 0.2], &own), Initial::SharpEdge);
    assert_eq!(Initial::of([0.9, 0.09, 0.05], &own), Initial::Face);
}

/// Two faces at right angles, one three times as large and farther away: mu = A / A_max exp(-|c| / the longest edge).
#[test]
fn votes_fade_with_distance_and_count_by_area() {
    let vote = fan(&[3.0 * DVec3::Z, DVec3::X, DVec3::Y], false);
    let far = libm::exp(-(1.0f64 / 9.0 + 1.0).sqrt() / 3.0);
    let near = 1.0 / 3.0 * libm::exp(-(2.0f64 / 9.0).sqrt() / 3.0);
    let norm = (far * far + near * near).sqrt();
    assert_near(vote.eigenvalues, [far / norm, near / norm, 0.0]);
    assert!((vote.t.dot(DVec3::X).abs() - 1.0).abs() < TOLERANCE, "{}", vote.t);
}

/// The same with a cube of edge sigma: votes fade over sigma / 3.
#[test]
fn votes_over_a_cube_fade_over_a_third_of_sigma() {
    let mesh = Mesh {
        positions: vec![DVec3::ZERO, 3.0 * DVec3::Z, DVec3::X, DVec3::Y],
        faces: vec![[0, 1, 2], [0, 2, 3]],
    };
    let sigma = 4.5;
    let (plan, tile) = whole(&mesh, Sigma::Length(sigma));
    let vote = tile.votes(&plan, &paper(Sigma::Length(sigma))).get(0);
    let far = libm::exp(-(1.0f64 / 9.0 + 1.0).sqrt() * 3.0 / sigma);
    let near = 1.0 / 3.0 * libm::exp(-(2.0f64 / 9.0).sqrt() * 3.0 / sigma);
    let norm = (far * far + near * near).sqrt();
    assert_near(vote.eigenvalues, [far / norm, near / norm, 0.0]);
}

/// N_T of one vertex by looking at all faces until none is added.
fn naive_voters(mesh: &TileMesh, v: u32, half: f64) -> Vec<u32> {
    let all = 0..mesh.face_count() as u32;
    let offset = |f: u32| {
        let [a, b, c] = mesh.corners[f as usize].map(|u| mesh.position(u) - mesh.position(v));
        (a + b + c) / 3.0
    };
    let inside: Vec<u32> = all.clone().filter(|&f| (0..3).all(|i| offset(f)[i].abs() <= half)).collect();
    let mut found: BTreeSet<u32> = all.filter(|&f| mesh.corners[f as usize].contains(&v)).collect();
    loop {
        let touches = |f: u32, g: u32| {
            let common = mesh.corners[f as usize].iter().filter(|u| mesh.corners[g as usize].contains(u));
            common.count() >= 2
        };
        let more: Vec<u32> = inside
            .iter()
            .copied()
            .filter(|f| !found.contains(f) && found.iter().any(|&g| touches(*f, g)))
            .collect();
        if more.is_empty() {
            return found.into_iter().collect();
        }
        found.extend(more);
    }
}

#[test]
fn neighbourhoods_are_those_of_a_search_through_all_faces() {
    for (name, sigmas, every) in [
        ("bracket", [1.0, 3.0, 6.0], 17),
        ("city", [1.0, 3.0, 6.0], 37),
        ("defects", [1.0, 2.0, 5.0], 1),
        ("polygons", [1.0, 2.0, 3.0], 1),
    ] {
        let mesh = Mesh::of_fixture(name);
        for edges in sigmas {
            let (plan, tile) = whole(&mesh, Sigma::Edges(edges));
            let loaded = tile.loaded(&plan);
            let half = edges * plan.scale.h / 2.0;
            let voters = Voters::new(&loaded, Some(half));
            let (mut larger, mut cut_off) = (0, 0);
            for v in (0..tile.mesh.vertex_count() as u32).step_by(every) {
                let naive = naive_voters(&tile.mesh, v, half);
                assert_eq!(voters.of(v), naive, "{name}, sigma {edges}, {}", tile.mesh.id(v));
                larger += usize::from(naive.len() > tile.mesh.faces_of(v).len());
                let inside = (0..tile.mesh.face_count() as u32).filter(|&f| {
                    let d = tile.mesh.barycentre(f) - tile.mesh.position(v);
                    d.abs().max_element() < half && naive.binary_search(&f).is_err()
                });
                cut_off += usize::from(inside.count() > 0);
            }
            assert!(edges < 3.0 || larger > 5, "{name}, sigma {edges}: nothing but one-rings");
            assert!(name != "bracket" || edges < 6.0 || cut_off > 0, "no cube reaches through a wall");
        }
    }
}

/// A straight line of eleven vertices along x with one vertex on either side of each step; votes are made up.
struct Strip {
    plan: Plan,
    tile: PaperTile,
    votes: Vec<Vote>,
    stops: Vec<Stop>,
}

const LINE: u32 = 11;

impl Strip {
    fn new() -> Strip {
        let mut mesh = Mesh { positions: Vec::new(), faces: Vec::new() };
        mesh.positions.extend((0..LINE).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)));
        for side in [-1.0, 1.0] {
            let start = mesh.positions.len() as u32;
            mesh.positions.extend((0..LINE).map(|i| DVec3::new(f64::from(i), side, 0.0)));
            for i in 0..LINE - 1 {
                mesh.faces.extend([[i, i + 1, start + i], [i + 1, start + i + 1, start + i]]);
            }
        }
        let (plan, tile) = whole(&mesh, Sigma::Edges(3.0));
        // An even fold of 90 degrees on the line, nothing beside it.
        let half = 0.5f64.sqrt();
        let mut votes = vec![Vote { eigenvalues: [1.0, 0.0, 0.0], ..Vote::default() }; 3 * LINE as usize];
        for vote in &mut votes[..LINE as usize] {
            *vote = Vote { eigenvalues: [half, half, 0.0], t: DVec3::X, b: DVec3::Y, ..Vote::default() };
        }
        Strip { plan, tile, votes, stops: vec![Stop::default(); 3 * LINE as usize] }
    }

    /// Turns the lines at `from` and beyond by so many degrees.
    fn turned(mut self, from: u32, degrees: f64) -> Strip {
        let angle = degrees.to_radians();
        for v in from..LINE {
            self.votes[v as usize].t = DVec3::new(libm::cos(angle), libm::sin(angle), 0.0);
        }
        self
    }

    fn eigenvalues(mut self, v: u32, eigenvalues: [f64; 3]) -> Strip {
        self.votes[v as usize].eigenvalues = eigenvalues;
        self
    }

    fn stop(mut self, v: u32, stop: Stop) -> Strip {
        self.stops[v as usize] = stop;
        self
    }

    /// Salience of `v` where Omega of the line is this share of the largest and the smallest is 0.
    fn salience(&self, v: u32, share: f64) -> Salience {
        let mesh = &self.tile.mesh;
        let all: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
        let (votes, stops) = (
            Field::compute(all.len(), &all, |v| self.votes[v as usize]),
            Field::compute(all.len(), &all, |v| self.stops[v as usize]),
        );
        let half = 0.5f64.sqrt();
        let range = OmegaRange { min: 0.0, max: omega([half, half, 0.0]) / share };
        let supporters = Supporters {
            mesh,
            votes: &votes,
            stops: &stops,
            thresholds: &PaperThresholds::default(),
            range,
            scale: &self.plan.scale,
        };
        supporters.salience(&[v]).get(v)
    }

    /// The weight of a supporter so many steps away: a step is one unit.
    fn weight(&self, steps: u32) -> f64 {
        let (d, width) = (f64::from(steps), 1.5 * self.plan.scale.h);
        libm::exp(-d * d / (2.0 * width * width))
    }

    /// The weights of a vertex with so many supporters on either side.
    fn weights(&self, sides: [u32; 2]) -> f64 {
        1.0 + sides.iter().flat_map(|&n| 1..=n).map(|k| self.weight(k)).sum::<f64>()
    }
}

#[track_caller]
fn assert_salience(found: Salience, plain: f64, factor: f64) {
    assert!((found.plain - plain).abs() < TOLERANCE, "{found:?}, by hand {plain}");
    assert!((found.enhanced - plain * factor).abs() < TOLERANCE, "{found:?}, by hand {plain} times {factor}");
}

#[test]
fn a_vertex_is_supported_by_five_on_either_side() {
    let strip = Strip::new();
    assert!((strip.plan.scale.h - 1.0).abs() < 0.02, "the unit is about a step");
    // Omega 0.6 is not weak.
    assert_salience(strip.salience(5, 0.6), 0.6 * strip.weights([5, 5]), 1.0);
    // At the end of the line there is one side.
    assert_salience(strip.salience(0, 0.6), 0.6 * strip.weights([0, 5]), 1.0);
    // Beside the line there is nothing to support.
    assert_salience(strip.salience(LINE, 0.6), 0.0, 1.0);
}

#[test]
fn a_walk_goes_on_while_lines_turn_by_at_most_fifteen_degrees() {
    for (degrees, reached) in [(14.9, 5), (15.1, 2)] {
        let strip = Strip::new().turned(8, degrees);
        assert_salience(strip.salience(5, 0.6), 0.6 * strip.weights([reached, 5]), 1.0);
    }
    // Directions have no sign.
    let strip = Strip::new().turned(8, 180.0);
    assert_salience(strip.salience(5, 0.6), 0.6 * strip.weights([5, 5]), 1.0);
}

#[test]
fn a_walk_ends_at_a_face_and_on_a_stop() {
    let strip = Strip::new().eigenvalues(8, [1.0, 0.0, 0.0]);
    assert_salience(strip.salience(5, 0.6), 0.6 * strip.weights([2, 5]), 1.0);
    // A stop supports as the last of its side.
    let strip = Strip::new().stop(8, Stop { boundary: true, corner: false, hub: false });
    assert_salience(strip.salience(5, 0.6), 0.6 * strip.weights([3, 5]), 1.0);
    // A corner has a larger Omega and no direction to turn away from.
    let third = (1.0f64 / 3.0).sqrt();
    let strip = Strip::new()
        .turned(8, 80.0)
        .eigenvalues(8, [third; 3])
        .stop(8, Stop { corner: true, boundary: false, hub: false });
    let half = 0.5f64.sqrt();
    let ratio = omega([third; 3]) / omega([half, half, 0.0]);
    let expected = 0.5 * (strip.weights([2, 5]) + ratio * strip.weight(3));
    assert_salience(strip.salience(5, 0.5), expected, 1.0);
}

#[test]
fn weak_features_with_more_than_three_supporters_are_enhanced() {
    let strip = Strip::new();
    for share in [0.1, 0.449] {
        let factor = 5.0 * libm::exp(-share);
        assert_salience(strip.salience(5, share), share * strip.weights([5, 5]), factor);
    }
    assert_salience(strip.salience(5, 0.451), 0.451 * strip.weights([5, 5]), 1.0);
    // A line of four has three supporters for each of them, a line of five has four.
    let four = Strip::new().eigenvalues(4, [1.0, 0.0, 0.0]);
    assert_salience(four.salience(1, 0.2), 0.2 * four.weights([1, 2]), 1.0);
    let five = Strip::new().eigenvalues(5, [1.0, 0.0, 0.0]);
    assert_salience(five.salience(1, 0.2), 0.2 * five.weights([1, 3]), 5.0 * libm::exp(-0.2));
}

/// Weak itself, but supported by corners at both ends of a line of five: not weak on average.
#[test]
fn weak_features_among_strong_ones_are_not_enhanced() {
    let third = (1.0f64 / 3.0).sqrt();
    let corner = Stop { corner: true, boundary: false, hub: false };
    let strip = |end: [f64; 3]| {
        let ends = Strip::new().eigenvalues(3, end).eigenvalues(7, end);
        ends.stop(3, corner).stop(7, corner)
    };
    let half = 0.5f64.sqrt();
    let ratio = omega([third; 3]) / omega([half, half, 0.0]);
    // Four supporters with the Omegas share, share, and twice ratio times share: on average (1 + ratio) / 2 of it.
    let limit = 0.45 / (0.5 * (1.0 + ratio));
    for (share, factor) in [(0.99 * limit, 5.0 * libm::exp(-0.99 * limit)), (1.01 * limit, 1.0)] {
        let strip = strip([third; 3]);
        let expected = share * (strip.weights([1, 1]) + 2.0 * ratio * strip.weight(2));
        assert_salience(strip.salience(5, share), expected, factor);
    }
}

#[test]
fn omega_is_stretched_to_the_range_unless_all_are_alike() {
    let range = OmegaRange { min: 0.1, max: 0.3 };
    assert_eq!([0.1, 0.3].map(|x| range.normalised(x)), [0.0, 1.0]);
    assert!((range.normalised(0.2) - 0.5).abs() < TOLERANCE);
    let alike = OmegaRange { min: 0.2, max: 0.2 * (1.0 + 1e-9) };
    assert_eq!(alike.normalised(0.2), 1.0);
    assert_eq!(OmegaRange { min: 0.2, max: 0.2 }.normalised(0.2), 1.0);
    let joint = range.join(OmegaRange { min: 0.05, max: 0.2 }).join(OmegaRange::default());
    assert_eq!(joint, OmegaRange { min: 0.05, max: 0.3 });
}

/// What the method is good for: the lines of a clean part, exactly.
#[test]
fn a_clean_part_has_its_lines_found() {
    let source = open(&fixture("meshes/bracket_clean.ply"));
    let (found, _) = run(&source, paper(Sigma::Edges(0.0)), in_core());
    let truth = truth_length("bracket_clean");
    let length: f64 = found.lines.lines.iter().map(|line| line.length).sum();
    assert!((length - truth).abs() < 1e-6 * truth, "{length} of {truth}");
    assert_eq!(found.lines.vertices.iter().filter(|v| v.class == Class::Corner).count(), 12);
    assert_eq!(found.lines.lines.iter().filter(|line| line.closed).count(), 2);
    assert!(found.lines.lines.iter().all(|line| line.class == Class::Sharp));
}

/// Length of the true lines of a fixture: vertices of three doubles, then edges of two 32-bit integers.
fn truth_length(name: &str) -> f64 {
    let bytes = std::fs::read(fixture(&format!("meshes/{name}.truth.ply"))).expect("the true lines");
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]);
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|line| line.strip_prefix(element)).expect("an element");
        line.trim().parse().expect("a count")
    };
    let (vertices, edges) = bytes[start..].split_at(24 * count("element vertex"));
    assert_eq!(edges.len(), 8 * count("element edge"));
    let number = |i: usize| f64::from_le_bytes(vertices[8 * i..8 * i + 8].try_into().expect("8 bytes"));
    let position = |v: usize| DVec3::new(number(3 * v), number(3 * v + 1), number(3 * v + 2));
    let ends = |edge: &[u8]| {
        let id = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().expect("4 bytes")) as usize;
        (position(id(&edge[..4])) - position(id(&edge[4..]))).length()
    };
    edges.chunks_exact(8).map(ends).sum()
}

#[test]
fn the_salience_threshold_thins_out() {
    let source = open(&fixture("meshes/bracket.ply"));
    let mut before = usize::MAX;
    for salience in [0.0, 0.1, 0.5, 1.0] {
        let thresholds = PaperThresholds { salience, ..PaperThresholds::default() };
        let params = Params { method: Method::Paper(thresholds), ..Params::default() };
        let (_, fields) = run(&source, params, in_core());
        let features = fields.0.values().filter(|f| matches!(f.class, Class::Weak | Class::Sharp)).count();
        assert!(features < before, "{salience}: {features} features, {before} before");
        before = features;
    }
    assert!(before >= 1, "the most salient vertex is a feature at any threshold");
}
