//! Whole components in groups, so that many tasks can finish them side by side.
//!
//! In: a [`Part`] that is made of whole components. Out: the same in parts that are made of whole components too. Which of them come together does not matter to anyone (`component.rs`), and depends on the part alone.

use super::component::Part;
use crate::mesh::VertexId;
use rayon::prelude::*;

/// Vertices of a group: enough to be worth a task.
const GROUP: usize = 2048;

/// Takes `whole` apart.
pub(super) fn apart(mut whole: Part) -> Vec<Part> {
    if whole.vertices.len() < 2 * GROUP {
        return vec![whole];
    }
    whole.vertices.par_sort_unstable_by_key(|v| v.id);
    whole.vertices.dedup_by_key(|v| v.id);
    let Part { vertices, links, open_edges } = &whole;
    let ids: Vec<VertexId> = vertices.par_iter().map(|v| v.id).collect();
    let place = |id: &VertexId| ids.partition_point(|other| other < id) as u32;
    let of_links: Vec<[u32; 4]> = links
        .par_iter()
        .map(|link| {
            let first = place(&link.ids()[0]);
            let mut places = [first; 4];
            places.iter_mut().zip(link.ids()).skip(1).for_each(|(slot, id)| *slot = place(id));
            places
        })
        .collect();
    let of_edges: Vec<[u32; 2]> = open_edges.par_iter().map(|edge| edge.ends.map(|id| place(&id))).collect();
    let mut roots = Roots::new(ids.len());
    of_links.iter().for_each(|places| roots.join(places));
    of_edges.iter().for_each(|places| roots.join(places));
    let groups = roots.groups();
    let count = groups.iter().copied().max().map_or(0, |last| last as usize + 1);
    if count == 1 {
        return vec![whole];
    }
    let of = |v: u32| groups[v as usize] as usize;
    let vertices_of = sorted(count, (0..ids.len() as u32).map(of));
    let links_of = sorted(count, of_links.iter().map(|places| of(places[0])));
    let edges_of = sorted(count, of_edges.iter().map(|places| of(places[0])));
    let group = |g: usize| Part {
        vertices: vertices_of[g].iter().map(|&i| vertices[i as usize]).collect(),
        links: links_of[g].iter().map(|&i| links[i as usize]).collect(),
        open_edges: edges_of[g].iter().map(|&i| open_edges[i as usize]).collect(),
    };
    (0..count).into_par_iter().map(group).collect()
}

/// The items of each of `count` groups, ascending.
fn sorted(count: usize, groups: impl Iterator<Item = usize>) -> Vec<Vec<u32>> {
    let mut items = vec![Vec::new(); count];
    (0..).zip(groups).for_each(|(item, group)| items[group].push(item));
    items
}

/// Union-find: the lowest vertex of a component is its root.
struct Roots {
    roots: Vec<u32>,
}

impl Roots {
    fn new(vertices: usize) -> Roots {
        Roots { roots: (0..vertices as u32).collect() }
    }

    fn find(&mut self, mut v: u32) -> u32 {
        while self.roots[v as usize] != v {
            let next = self.roots[self.roots[v as usize] as usize];
            self.roots[v as usize] = next;
            v = next;
        }
        v
    }

    fn join(&mut self, places: &[u32]) {
        for pair in places.windows(2) {
            let (a, b) = (self.find(pair[0]), self.find(pair[1]));
            self.roots[a.max(b) as usize] = a.min(b);
        }
    }

    /// The number of a group for each vertex, so that components stay together.
    fn groups(mut self) -> Vec<u32> {
        let mut sizes = vec![0usize; self.roots.len()];
        for v in 0..self.roots.len() {
            // Roots are lower than what they are roots of: theirs are final already.
            self.roots[v] = self.roots[self.roots[v] as usize];
            sizes[self.roots[v] as usize] += 1;
        }
        let (mut group, mut filled) = (0, 0);
        for v in 0..self.roots.len() {
            let root = self.roots[v] as usize;
            if root < v {
                self.roots[v] = self.roots[root];
                continue;
            }
            if filled >= GROUP {
                (group, filled) = (group + 1, 0);
            }
            filled += sizes[v];
            self.roots[v] = group;
        }
        self.roots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::VertexId;
    use crate::stitch::{Candidate, LinkPath, OpenEdge};

    #[test]
    fn components_stay_together_and_nothing_is_lost() {
        // Chains of ten vertices, and a boundary that holds every hundredth of them together.
        let count = 10 * GROUP as u64;
        let id = |v: u64| VertexId(3 * v + 1);
        let vertex = |v: u64| Candidate { id: id(v), ..Candidate::default() };
        let link = |v: u64| LinkPath::new([id(v), id(v + 1)].into_iter(), 1.0);
        let edge = |c: u64| OpenEdge { ends: [id(1000 * c), id(1000 * c + 1000)], crowded: false };
        let whole = Part {
            vertices: (0..count).map(vertex).collect(),
            links: (0..count).filter(|v| v % 10 < 9).map(link).collect(),
            open_edges: (0..count / 1000 - 1).map(edge).collect(),
        };
        let parts = apart(whole.clone());
        assert!(parts.len() > 4, "{}", parts.len());
        for part in &parts {
            let has = |id: &VertexId| part.vertices.binary_search_by_key(id, |v| v.id).is_ok();
            assert!(part.vertices.is_sorted_by_key(|v| v.id));
            assert!(part.links.iter().all(|link| link.ids().iter().all(has)));
            assert!(part.open_edges.iter().all(|edge| edge.ends.iter().all(has)));
        }
        let sum = |size: fn(&Part) -> usize| parts.iter().map(size).sum::<usize>();
        assert_eq!(sum(|p| p.vertices.len()), whole.vertices.len());
        assert_eq!(sum(|p| p.links.len()), whole.links.len());
        assert_eq!(sum(|p| p.open_edges.len()), whole.open_edges.len());
        let few = Part { vertices: whole.vertices[..9].to_vec(), ..Part::default() };
        assert_eq!(apart(few.clone()), [few]);
    }
}
