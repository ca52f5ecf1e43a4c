//! Where in a part of the candidate graph its links and edges lie, and what hangs together by them.
//!
//! In: a [`Part`] whose vertices ascend by id. Out: its links and edges with indices instead of ids, and sets of vertices
//! that grow together.

use super::component::Part;
use crate::mesh::VertexId;
use rayon::prelude::*;

/// Indices of the vertices of a part.
pub(super) struct Places {
    /// Ids by index: looking through these touches a tenth of the memory that looking through the vertices would.
    ids: Vec<VertexId>,
    /// Vertices of each link; short ones repeat their first vertex.
    pub links: Vec<[u32; 4]>,
    /// Ends of each edge.
    pub open_edges: Vec<[u32; 2]>,
}

impl Places {
    /// Those of `part`, in parallel.
    pub fn new(part: &Part) -> Places {
        let ids: Vec<VertexId> = part.vertices.par_iter().map(|v| v.id).collect();
        let mut places = Places { ids, links: Vec::new(), open_edges: Vec::new() };
        let of_link = |ids: &[VertexId]| {
            let mut indices = [places.of(ids[0]); 4];
            indices.iter_mut().zip(ids).skip(1).for_each(|(index, id)| *index = places.of(*id));
            indices
        };
        let links = part.links.par_iter().map(|link| of_link(link.ids())).collect();
        let open_edges = part.open_edges.par_iter().map(|edge| edge.ends.map(|id| places.of(id))).collect();
        (places.links, places.open_edges) = (links, open_edges);
        places
    }

    /// Index of a vertex, which must be there.
    pub fn of(&self, id: VertexId) -> u32 {
        self.ids.partition_point(|&other| other < id) as u32
    }

    /// Number of vertices.
    pub fn count(&self) -> usize {
        self.ids.len()
    }
}

/// Sets of vertices that grow together. The lowest vertex of a set is its root.
pub(super) struct Sets {
    root: Vec<u32>,
}

impl Sets {
    /// Each of `vertices` vertices by itself.
    pub fn new(vertices: usize) -> Sets {
        Sets { root: (0..vertices as u32).collect() }
    }

    /// Makes one set of those that hold `vertices`.
    pub fn join(&mut self, vertices: &[u32]) {
        for pair in vertices.windows(2) {
            let (a, b) = (self.find(pair[0]), self.find(pair[1]));
            self.root[a.max(b) as usize] = a.min(b);
        }
    }

    fn find(&mut self, mut v: u32) -> u32 {
        while self.root[v as usize] != v {
            let next = self.root[self.root[v as usize] as usize];
            self.root[v as usize] = next;
            v = next;
        }
        v
    }

    /// The root of each vertex.
    pub fn roots(mut self) -> Vec<u32> {
        for v in 0..self.root.len() {
            // Roots are lower than what they are roots of: theirs are final already.
            self.root[v] = self.root[self.root[v] as usize];
        }
        self.root
    }
}
