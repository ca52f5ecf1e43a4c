//! The surface behind the lines, thinned until it fits into a page.
//!
//! In: a mesh of any size, read once. Out: a mesh of so many triangles at most. Vertices in the same cube of a grid become one, and
//! triangles with three different ones stay, after Lindstrom (2000, "Out-of-core simplification of large polygonal models"):
//! the one is where the planes of the faces meet, in the sense of least squares, within the cube. The grid begins so fine that
//! a small mesh stays as it is, and its cubes are doubled whenever too many triangles have come together, so that memory is
//! bounded by the result. The result depends on the mesh and the order of its file alone.
//!
//! A mesh whose faces lie in no spatial order, and that does not fit into memory, would cost a read at random for each corner. Of such a
//! one, vertices are taken instead, evenly by id.

use crate::input::{FaceBlock, InputError, MeshSource};
use crate::math::Quadric;
use crate::mesh::VertexId;
use crate::partition::Bounds;
use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

/// Cubes along the longest side in the beginning: as fine as the page stores places.
const FINEST: f64 = 65536.0;
/// Share of the planes' weight with which a vertex is held near the mean of its cube, where planes leave it open.
const HOLD: f64 = 1e-3;

/// What is behind the lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Vertices, relative to the lower corner of the bounds.
    pub positions: Vec<DVec3>,
    /// Triangles; none if the vertices are points.
    pub triangles: Vec<[u32; 3]>,
    /// Side of the cubes whose vertices became one, mesh units; 0 for points.
    pub cube: f64,
}

impl Surface {
    /// Thins `source`, which lies in `bounds`, to `room` triangles. `ended` is asked for each block.
    ///
    /// # Errors
    /// If the source cannot be read, or it shall end.
    pub fn thinned(
        source: &dyn MeshSource,
        bounds: &Bounds,
        room: usize,
        ended: impl Fn() -> bool,
    ) -> Result<Surface, InputError> {
        let mut clusters = Clusters::new(bounds, room);
        let (mut block, mut places) = (FaceBlock::default(), Vec::new());
        for index in 0..source.block_count() {
            if ended() {
                return Err(InputError::Stopped);
            }
            source.read_placed(index, &mut block, &mut places)?;
            places.iter().for_each(|face| clusters.add(face.map(|p| p - bounds.min)));
        }
        Ok(clusters.finish())
    }

    /// Every so-manieth vertex of `source`, `room` at most.
    ///
    /// # Errors
    /// If the source cannot be read.
    pub fn sampled(source: &dyn MeshSource, bounds: &Bounds, room: usize) -> Result<Surface, InputError> {
        let stride = source.vertex_count().div_ceil(room.max(1) as u64).max(1) as usize;
        let ids: Vec<VertexId> = (0..source.vertex_count()).step_by(stride).map(VertexId).collect();
        let mut positions = Vec::new();
        source.gather_positions(&ids, &mut positions)?;
        let inside = |p: &DVec3| p.cmpge(bounds.min).all() && p.cmple(bounds.max).all();
        let positions = positions.into_iter().filter(inside).map(|p| p - bounds.min).collect();
        Ok(Surface { positions, ..Surface::default() })
    }
}

/// What became one vertex.
#[derive(Clone, Copy)]
struct Cluster {
    cube: [u32; 3],
    corners: f64,
    sum: DVec3,
    quadric: Quadric,
}

struct Clusters {
    /// Cubes of the finest grid in a unit of length.
    per_unit: f64,
    /// How often cubes were doubled.
    doublings: u32,
    room: usize,
    clusters: Vec<Cluster>,
    by_cube: FxHashMap<[u32; 3], u32>,
    triangles: Vec<[u32; 3]>,
    seen: FxHashSet<[u32; 3]>,
}

impl Clusters {
    fn new(bounds: &Bounds, room: usize) -> Clusters {
        let extent = if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).max_element() };
        Clusters {
            per_unit: if extent > 0.0 { FINEST / extent } else { 1.0 },
            doublings: 0,
            // One cube holds no triangle, eight hold any mesh: doubling comes to an end.
            room: room.max(8),
            clusters: Vec::new(),
            by_cube: FxHashMap::default(),
            triangles: Vec::new(),
            seen: FxHashSet::default(),
        }
    }

    /// One more face, relative to the lower corner of the bounds.
    fn add(&mut self, face: [DVec3; 3]) {
        let [a, b, c] = face;
        let normal = (b - a).cross(c - a);
        let (area, mut plane) = (normal.length(), Quadric::default());
        if area > 0.0 {
            let normal = normal / area;
            // In fine cubes, so that the weights of small and large meshes are alike.
            plane.add_plane(normal, normal.dot(a), 1.0 / (area * self.per_unit * self.per_unit));
        }
        let corners = face
            .map(|p| self.cluster(Cluster { cube: self.cube_of(p), corners: 1.0, sum: p, quadric: plane }));
        self.keep(corners);
        while self.triangles.len() > self.room || self.clusters.len() > self.room {
            self.double();
        }
    }

    fn cube_of(&self, p: DVec3) -> [u32; 3] {
        // Saturates at 0.
        (p * self.per_unit).to_array().map(|x| x as u32 >> self.doublings)
    }

    /// Adds to the cluster of a cube; returns which it is.
    fn cluster(&mut self, more: Cluster) -> u32 {
        let next = self.clusters.len() as u32;
        let index = *self.by_cube.entry(more.cube).or_insert(next);
        match self.clusters.get_mut(index as usize) {
            Some(cluster) => {
                cluster.corners += more.corners;
                cluster.sum += more.sum;
                cluster.quadric.matrix.add(&more.quadric.matrix);
                cluster.quadric.vector += more.quadric.vector;
            }
            None => self.clusters.push(more),
        }
        index
    }

    /// Keeps a triangle, once, unless it has shrunk to an edge.
    fn keep(&mut self, [a, b, c]: [u32; 3]) {
        if a == b || b == c || c == a {
            return;
        }
        let least = a.min(b).min(c);
        let turned = if least == a {
            [a, b, c]
        } else if least == b {
            [b, c, a]
        } else {
            [c, a, b]
        };
        if self.seen.insert(turned) {
            self.triangles.push(turned);
        }
    }

    /// Makes cubes twice as wide.
    fn double(&mut self) {
        self.doublings += 1;
        self.by_cube.clear();
        self.seen.clear();
        let renamed: Vec<u32> = std::mem::take(&mut self.clusters)
            .into_iter()
            .map(|cluster| self.cluster(Cluster { cube: cluster.cube.map(|x| x >> 1), ..cluster }))
            .collect();
        for triangle in std::mem::take(&mut self.triangles) {
            self.keep(triangle.map(|corner| renamed[corner as usize]));
        }
    }

    fn finish(self) -> Surface {
        let cube = f64::from(2u32.pow(self.doublings.min(31))) / self.per_unit;
        let positions = self.clusters.iter().map(|cluster| cluster.place(cube)).collect();
        Surface { positions, triangles: self.triangles, cube }
    }
}

impl Cluster {
    /// Where the planes meet within the cube; the mean of the corners where they do not.
    fn place(&self, cube: f64) -> DVec3 {
        let mean = self.sum / self.corners;
        let Quadric { mut matrix, vector } = self.quadric;
        let weight = matrix.diag.element_sum();
        if weight <= 0.0 {
            return mean;
        }
        let right = vector - matrix.times(mean);
        matrix.diag += DVec3::splat(HOLD * weight);
        let place = mean + matrix.solve(right);
        let low = DVec3::from_array(self.cube.map(f64::from)) * cube;
        // Rounding is no reason to leave the cube, nor to jump to the mean.
        let slack = 1e-6 * cube;
        let within = place.cmpge(low - slack).all() && place.cmple(low + cube + slack).all();
        if within { place } else { mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::MemorySource;

    /// A roof over a grid of squares.
    struct Roof {
        positions: Vec<DVec3>,
        faces: Vec<[u32; 3]>,
        bounds: Bounds,
    }

    impl Roof {
        fn new(n: u32) -> Roof {
            let (side, half) = (n + 1, f64::from(n) / 2.0);
            let place = |i: u32| {
                let (x, y) = (f64::from(i % side), f64::from(i / side));
                DVec3::new(x + 5e5, y + 5e6, half - (x - half).abs())
            };
            let positions: Vec<DVec3> = (0..side * side).map(place).collect();
            let squares = (0..n).flat_map(|y| (0..n).map(move |x| y * side + x));
            let faces =
                squares.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]).collect();
            let mut bounds = Bounds::EMPTY;
            positions.iter().for_each(|&p| bounds.add(p));
            Roof { positions, faces, bounds }
        }

        fn source(&self) -> MemorySource<'_> {
            MemorySource::new(&self.positions, &self.faces).expect("a mesh")
        }

        fn thinned(&self, room: usize) -> Surface {
            Surface::thinned(&self.source(), &self.bounds, room, || false).expect("a surface")
        }
    }

    #[test]
    fn a_small_mesh_stays_as_it_is() {
        let roof = Roof::new(10);
        let surface = roof.thinned(200);
        assert_eq!((surface.triangles.len(), surface.positions.len()), (200, 121));
        for &p in &roof.positions {
            let near = |q: &DVec3| (*q + roof.bounds.min - p).length() < 1e-6;
            assert!(surface.positions.iter().any(near), "{p}");
        }
    }

    #[test]
    fn a_large_mesh_keeps_its_shape() {
        let surface = Roof::new(200).thinned(5000);
        assert!((1000..=5000).contains(&surface.triangles.len()), "{}", surface.triangles.len());
        let tops = surface.positions.iter().filter(|p| (p.x - 100.0).abs() < surface.cube);
        // The ridge is no lower than it was: the planes meet there.
        assert!(tops.map(|p| p.z).fold(0.0, f64::max) > 99.9);
        for p in &surface.positions {
            assert!((100.0 - (p.x - 100.0).abs() - p.z).abs() < 0.75 * surface.cube, "{p}");
        }
        assert!(surface.triangles.iter().flatten().all(|&v| (v as usize) < surface.positions.len()));
    }

    #[test]
    fn whoever_ends_it_is_heard() {
        let roof = Roof::new(3);
        let ended = Surface::thinned(&roof.source(), &roof.bounds, 9, || true);
        assert!(matches!(ended, Err(InputError::Stopped)));
    }

    #[test]
    fn vertices_are_taken_evenly() {
        let roof = Roof::new(9);
        let sample = Surface::sampled(&roof.source(), &roof.bounds, 50).expect("a sample");
        assert_eq!((sample.positions.len(), sample.triangles.len()), (50, 0));
        assert_eq!(sample.positions[1], DVec3::new(2.0, 0.0, 2.0));
    }
}
