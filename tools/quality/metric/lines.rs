//! Polylines that share their points. In: polylines by coordinates, or mesh edges; out: points, chains of indices, and
//! what follows from how the chains hang together.
//!
//! Invariant: two chains meet where they share an index. Coordinates are compared once, bit for bit, when polylines are
//! joined; never by a tolerance.

use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Feature lines as a graph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lines {
    /// Positions, in mesh units.
    pub points: Vec<DVec3>,
    /// Polylines as indices into `points`, at least two each; a closed one ends on its first point.
    pub chains: Vec<Vec<u32>>,
    /// Whether a point was marked as a corner by whoever made the lines; as long as `points`.
    pub marked: Vec<bool>,
}

impl Lines {
    /// Joins polylines where their points are equal bit for bit. Polylines with fewer than two points are left out.
    pub fn of_polylines(polylines: &[Vec<DVec3>]) -> Lines {
        let mut known: BTreeMap<[u64; 3], u32> = BTreeMap::new();
        let mut lines = Lines::default();
        for polyline in polylines.iter().filter(|polyline| polyline.len() > 1) {
            let chain = polyline.iter().map(|&point| {
                *known.entry(place(point)).or_insert_with(|| {
                    lines.points.push(point);
                    (lines.points.len() - 1) as u32
                })
            });
            lines.chains.push(chain.collect());
        }
        lines.marked = vec![false; lines.points.len()];
        lines
    }

    /// Loose edges of a mesh with these points, each a line of its own. Points without an edge are left out.
    pub fn of_edges(positions: &[DVec3], edges: impl IntoIterator<Item = [u32; 2]>) -> Lines {
        let mut known: BTreeMap<u32, u32> = BTreeMap::new();
        let mut lines = Lines::default();
        for edge in edges {
            let ends = edge.map(|end| {
                *known.entry(end).or_insert_with(|| {
                    lines.points.push(positions[end as usize]);
                    (lines.points.len() - 1) as u32
                })
            });
            lines.chains.push(ends.to_vec());
        }
        lines.marked = vec![false; lines.points.len()];
        lines
    }

    /// The neighbours of each point along the lines, ascending, each once.
    pub fn neighbours(&self) -> Vec<BTreeSet<u32>> {
        let mut all = vec![BTreeSet::new(); self.points.len()];
        for step in self.chains.iter().flat_map(|chain| chain.windows(2)) {
            if step[0] != step[1] {
                all[step[0] as usize].insert(step[1]);
                all[step[1] as usize].insert(step[0]);
            }
        }
        all
    }

    /// For each chain the number of its connected component, counted from 0 in the order of the chains.
    pub fn components(&self) -> Vec<usize> {
        let mut parent: Vec<u32> = (0..self.points.len() as u32).collect();
        for chain in &self.chains {
            for step in chain.windows(2) {
                let (a, b) = (root(&mut parent, step[0]), root(&mut parent, step[1]));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut numbers: BTreeMap<u32, usize> = BTreeMap::new();
        let number = |chain: &Vec<u32>| {
            let next = numbers.len();
            *numbers.entry(root(&mut parent, chain[0])).or_insert(next)
        };
        self.chains.iter().map(number).collect()
    }

    /// Points that count as found corners: marked ones that a line runs through, and junctions of three or more lines.
    pub fn corner_points(&self) -> Vec<DVec3> {
        let neighbours = self.neighbours();
        let is_corner =
            |i: &usize| !neighbours[*i].is_empty() && (self.marked[*i] || neighbours[*i].len() > 2);
        (0..self.points.len()).filter(is_corner).map(|i| self.points[i]).collect()
    }

    /// The same graph cut into curves: chains that end at junctions, tips and the points for which `ends` holds, and
    /// loops without any of these.
    pub fn curves(&self, ends: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
        let neighbours = self.neighbours();
        let is_end = |v: u32| neighbours[v as usize].len() != 2 || ends(v);
        let mut done: BTreeSet<(u32, u32)> = BTreeSet::new();
        let mut all = Vec::new();
        let vertices = 0..self.points.len() as u32;
        // Loops come last: what is not done then has no end at all, and any of its points may be the first.
        let starts = vertices.clone().filter(|&v| is_end(v)).chain(vertices.filter(|&v| !is_end(v)));
        for v in starts {
            for &next in &neighbours[v as usize] {
                if done.contains(&(v.min(next), v.max(next))) {
                    continue;
                }
                let mut chain = vec![v, next];
                done.insert((v.min(next), v.max(next)));
                while let [.., from, at] = chain[..] {
                    let onward = neighbours[at as usize].iter().find(|&&u| u != from);
                    match onward.filter(|_| at != v && !is_end(at)) {
                        Some(&u) => {
                            done.insert((at.min(u), at.max(u)));
                            chain.push(u);
                        }
                        None => break,
                    }
                }
                all.push(chain);
            }
        }
        all
    }
}

/// The bits of a position; -0 is 0.
pub fn place(point: DVec3) -> [u64; 3] {
    (point + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The representative of `v`, paths halved on the way.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.0)
    }

    /// A cross whose arms meet in the origin, and a separate square.
    fn cross_and_square() -> Lines {
        Lines::of_polylines(&[
            vec![at(-1.0, 0.0), at(0.0, 0.0), at(1.0, 0.0)],
            vec![at(0.0, -1.0), at(0.0, -0.0), at(0.0, 1.0)],
            vec![at(5.0, 5.0), at(6.0, 5.0), at(6.0, 6.0), at(5.0, 6.0), at(5.0, 5.0)],
        ])
    }

    #[test]
    fn equal_points_are_one() {
        let lines = cross_and_square();
        assert_eq!(lines.points.len(), 5 + 4);
        assert_eq!(lines.components(), [0, 0, 1]);
        assert_eq!(lines.corner_points(), [at(0.0, 0.0)]);
    }

    #[test]
    fn curves_end_at_junctions_and_stated_points() {
        let lines = cross_and_square();
        let curves = lines.curves(|_| false);
        assert_eq!(curves.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 2, 2, 5]);
        // A loop with one corner starts and ends there; with two it is two curves.
        let corner = |x, y| lines.points.iter().position(|&p| p == at(x, y)).unwrap() as u32;
        let (a, b) = (corner(6.0, 5.0), corner(6.0, 6.0));
        let one = lines.curves(|v| v == a);
        assert_eq!((one.len(), one[one.len() - 1].first()), (5, Some(&a)));
        assert_eq!(lines.curves(|v| v == a || v == b).len(), 6);
    }

    #[test]
    fn marked_points_are_corners_if_a_line_runs_through() {
        let mut lines = cross_and_square();
        lines.points.push(at(9.0, 9.0));
        lines.marked.push(true);
        assert_eq!(lines.corner_points().len(), 1);
        lines.marked[0] = true;
        assert_eq!(lines.corner_points().len(), 2);
    }

    #[test]
    fn edges_share_the_vertices_of_the_mesh() {
        let positions: Vec<DVec3> = (0..6).map(|i| at(f64::from(i), 0.0)).collect();
        let lines = Lines::of_edges(&positions, [[1, 2], [2, 3], [5, 4]]);
        assert_eq!(lines.points.len(), 5);
        assert_eq!(lines.components(), [0, 0, 1]);
        assert_eq!(lines.curves(|_| false).len(), 2);
    }
}
