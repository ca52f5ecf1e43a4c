//! Whole components in groups, so that many tasks can finish them side by side.
//!
//! In: a [`Part`] that is made of whole components. Out: the same in parts that are made of whole components too. Which of them come together does not matter to anyone (`component.rs`), and depends on the part alone.

use super::component::Part;
use super::places::{Places, Sets};
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
    let places = Places::new(&whole);
    let mut sets = Sets::new(vertices.len());
    places.links.iter().for_each(|link| sets.join(link));
    places.open_edges.iter().for_each(|edge| sets.join(edge));
    let groups = groups(sets.roots());
    let count = groups.iter().copied().max().map_or(0, |last| last as usize + 1);
    if count == 1 {
        return vec![whole];
    }
    let of = |v: u32| groups[v as usize] as usize;
    let vertices_of = sorted(count, (0..vertices.len() as u32).map(of));
    let links_of = sorted(count, places.links.iter().map(|link| of(link[0])));
    let edges_of = sorted(count, places.open_edges.iter().map(|edge| of(edge[0])));
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

/// The number of a group for each vertex, from its root: what has the same root is in the same group.
fn groups(mut roots: Vec<u32>) -> Vec<u32> {
    let mut sizes = vec![0usize; roots.len()];
    roots.iter().for_each(|&root| sizes[root as usize] += 1);
    let (mut group, mut filled) = (0, 0);
    for v in 0..roots.len() {
        let root = roots[v] as usize;
        if root < v {
            // It was met before, and is a number already.
            roots[v] = roots[root];
            continue;
        }
        if filled >= GROUP {
            (group, filled) = (group + 1, 0);
        }
        filled += sizes[v];
        roots[v] = group;
    }
    roots
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
