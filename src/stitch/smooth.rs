//! Step F, last part: lines are drawn through the places where the surfaces beside them meet, as smoothly as the planes
//! allow.
//!
//! In: the line graph, its chains, and the fit of each vertex. Out: the fitted point of each vertex. Each chain is one problem of
//! least squares: how far its points lie from the planes of their vertices (over the standard error of each plane), how
//! far from the vertices (over the slack), and how much the chain bends. Straight lines do not bend, so nothing shrinks;
//! planes that are sure hold a line against its stiffness, where they are not it runs straight on.
//!
//! Corners and junctions stand still, at the points where their own planes meet, so that all lines of one end in one point.
//! Tips are free. What a point depends on is its chain: this step sees complete lines, however the mesh was cut.

use super::fragments::Candidate;
use super::graph::Graph;
use super::lines::ChainLine;
use crate::config::method;
use crate::math::{Banded, Sym3};
use crate::partition::Scale;
use crate::refine::{noise_share, slack};
use glam::DVec3;

/// The fitted point of each of `vertices`; those that none of the creases `lines` runs through keep their positions.
pub fn fit_lines(graph: &Graph, vertices: &[Candidate], lines: &[ChainLine], scale: &Scale) -> Vec<DVec3> {
    let unit = scale.length(1.0);
    let mut fitted: Vec<DVec3> = vertices.iter().map(|v| v.position).collect();
    for line in lines {
        let first = line.nodes[0];
        let fixed = |v: u32| vertices[v as usize].corner || graph.degree(v) > 2;
        // A loop without an end has one vertex twice; any other chain has ends that stand still or hang free.
        let round = line.measures.closed && !fixed(first);
        let nodes = if round { &line.nodes[1..] } else { &line.nodes[..] };
        let chain = Chain::new(nodes.iter().map(|&v| (&vertices[v as usize], fixed(v))), scale, round);
        for (&v, moved) in nodes.iter().zip(chain.smooth()) {
            fitted[v as usize] = vertices[v as usize].position + moved * unit;
        }
    }
    fitted
}

/// One node of a chain. Lengths in kh.
struct Node {
    /// Position of the vertex, relative to the first of the chain.
    position: DVec3,
    /// The quadric of its planes, with the spring to the vertex.
    matrix: Sym3,
    vector: DVec3,
    /// From the vertex to the minimum of its own quadric.
    own: DVec3,
    /// Stays at this minimum.
    fixed: bool,
}

/// A chain of nodes.
struct Chain {
    nodes: Vec<Node>,
    /// Whether the last node is followed by the first.
    round: bool,
}

impl Chain {
    fn new<'a>(vertices: impl Iterator<Item = (&'a Candidate, bool)>, scale: &Scale, round: bool) -> Chain {
        let mut origin = None;
        let nodes = vertices.map(|(vertex, fixed)| {
            let slack = slack(noise_share(scale, vertex.rounds));
            let quadric = &vertex.fit.quadric;
            Node {
                position: (vertex.position - *origin.get_or_insert(vertex.position)) / scale.length(1.0),
                matrix: quadric.with_slack(slack),
                vector: quadric.vector,
                own: within_reach(quadric.minimum(slack)),
                fixed,
            }
        });
        Chain { nodes: nodes.collect(), round }
    }

    /// How far each node moves.
    fn smooth(&self) -> Vec<DVec3> {
        let n = self.nodes.len();
        let place = self.places();
        // A bend couples a node with the next but one; in a loop that is folded flat, these are four places apart.
        let mut system = Banded::new(3 * n, if self.round { 14 } else { 8 });
        let mut right = vec![0.0; 3 * n];
        for (node, &at) in self.nodes.iter().zip(&place) {
            let (matrix, vector) = match node.fixed {
                true => (Sym3 { diag: DVec3::ONE, off: DVec3::ZERO }, node.own),
                false => (node.matrix, node.vector),
            };
            let Sym3 { diag, off } = matrix;
            let entries =
                [(0, 0, diag.x), (1, 1, diag.y), (2, 2, diag.z), (2, 1, off.x), (2, 0, off.y), (1, 0, off.z)];
            entries.iter().for_each(|&(i, j, x)| system.add(3 * at + i, 3 * at + j, x));
            add(&mut right, at, vector);
        }
        for bend in self.bends() {
            // Where the nodes would be if none moved: what is to be straightened. Fixed nodes are known: they go to the
            // right side too.
            let start = bend.iter().fold(DVec3::ZERO, |sum, &(i, share)| {
                let node = &self.nodes[i];
                sum + (node.position + if node.fixed { node.own } else { DVec3::ZERO }) * share
            });
            for &(i, share) in bend.iter().filter(|(i, _)| !self.nodes[*i].fixed) {
                add(&mut right, place[i], -share * start);
                for &(j, other) in bend.iter().filter(|(j, _)| !self.nodes[*j].fixed) {
                    for axis in 0..3 {
                        system.add(3 * place[i] + axis, 3 * place[j] + axis, share * other);
                    }
                }
            }
        }
        system.solve(&mut right);
        place.iter().map(|&at| within_reach(DVec3::from_slice(&right[3 * at..]))).collect()
    }

    /// The change of direction at each node but free ends, as a sum over three nodes with these factors; its square is the
    /// energy.
    fn bends(&self) -> Vec<[(usize, f64); 3]> {
        let n = self.nodes.len();
        let inner = match (self.round, n) {
            // With two nodes there is no shape to smooth.
            (_, ..=2) => 0..0,
            (true, _) => 0..n,
            (false, _) => 1..n - 1,
        };
        let length = |i: usize, j: usize| {
            let [a, b] = [i, j].map(|i| self.nodes[i].position + self.nodes[i].own);
            (b - a).dot(b - a).sqrt().max(method::LINE_SHORTEST)
        };
        inner
            .map(|i| {
                let (before, after) = ((i + n - 1) % n, (i + 1) % n);
                let (a, b) = (length(before, i), length(i, after));
                // The square of a curvature, times the length it holds for.
                let stiff = (2.0 * method::LINE_STIFFNESS / (a + b)).sqrt();
                [(before, stiff / a), (i, -stiff / a - stiff / b), (after, stiff / b)]
            })
            .collect()
    }

    /// The place of each node in the system. A loop is folded flat: from its first node both ways in turns.
    fn places(&self) -> Vec<usize> {
        let n = self.nodes.len();
        let folded = |i: usize| if 2 * i < n { 2 * i } else { 2 * (n - i) - 1 };
        (0..n).map(|i| if self.round { folded(i) } else { i }).collect()
    }
}

fn add(right: &mut [f64], at: usize, x: DVec3) {
    for (slot, x) in right[3 * at..].iter_mut().zip(x.to_array()) {
        *slot += x;
    }
}

/// No point leaves its vertex by more than [`method::FIT_MOVE`].
fn within_reach(moved: DVec3) -> DVec3 {
    let length = moved.dot(moved).sqrt();
    if length > method::FIT_MOVE { moved * (method::FIT_MOVE / length) } else { moved }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain through `positions`, without planes, its ends fixed unless it is round.
    fn chain(positions: &[DVec3], round: bool) -> Chain {
        let last = positions.len() - 1;
        let node = |(i, &position): (usize, &DVec3)| Node {
            position,
            matrix: Sym3 { diag: DVec3::splat(4.0), off: DVec3::ZERO },
            vector: DVec3::ZERO,
            own: DVec3::ZERO,
            fixed: !round && (i == 0 || i == last),
        };
        Chain { nodes: positions.iter().enumerate().map(node).collect(), round }
    }

    fn moved(chain: &Chain) -> Vec<DVec3> {
        chain.nodes.iter().zip(chain.smooth()).map(|(node, moved)| node.position + moved).collect()
    }

    fn circle(n: u32, radius: f64) -> Vec<DVec3> {
        let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        (0..n).map(|i| radius * DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.0)).collect()
    }

    #[test]
    fn places_of_a_loop_are_a_permutation_with_near_neighbours() {
        for n in 3..40 {
            let places = chain(&circle(n as u32, 5.0), true).places();
            let mut sorted = places.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..n).collect::<Vec<_>>());
            for i in 0..n {
                assert!(places[i].abs_diff(places[(i + 2) % n]) <= 4, "{n}: {places:?}");
            }
        }
    }

    #[test]
    fn a_straight_line_stays_and_a_zigzag_becomes_straight() {
        let straight: Vec<DVec3> = (0..20).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        let unmoved = moved(&chain(&straight, false));
        assert!(unmoved.iter().zip(&straight).all(|(a, b)| (a - b).length() < 1e-12));
        let zigzag: Vec<DVec3> =
            (0..20).map(|i| DVec3::new(f64::from(i), if i % 2 == 0 { 0.4 } else { -0.4 }, 0.0)).collect();
        let smoothed = moved(&chain(&zigzag, false));
        assert_eq!((smoothed[0], smoothed[19]), (zigzag[0], zigzag[19]));
        let widest = smoothed[5..15].iter().fold(0.0, |most: f64, p| most.max(p.y.abs()));
        assert!(widest < 0.1, "{widest}");
    }

    #[test]
    fn a_loop_has_no_seam() {
        let positions = circle(60, 9.5);
        let radii: Vec<f64> = moved(&chain(&positions, true)).iter().map(|p| p.length()).collect();
        let (least, most) = radii.iter().fold((f64::MAX, 0.0), |(a, b): (f64, f64), &r| (a.min(r), b.max(r)));
        // The weakest springs there are draw it in a little, everywhere alike.
        assert!(most - least < 1e-9 && least > 9.3, "{least} to {most}");
    }

    #[test]
    fn planes_hold_a_line_where_they_meet() {
        let mut bowed = chain(&circle(40, 6.0)[..12], false);
        for node in &mut bowed.nodes {
            // Two planes that meet at the node, sure to a twentieth.
            node.matrix = Sym3 { diag: DVec3::splat(400.0), off: DVec3::ZERO };
        }
        let largest = bowed.smooth().iter().fold(0.0, |most: f64, d| most.max(d.length()));
        assert!(largest < 0.1, "{largest}");
    }
}
