//! What the page draws: lines and surface as arrays of numbers.
//!
//! In: the chosen lines, the thinned surface. Out: one block of bytes, and a head that says where each array lies in it. Places are
//! relative to the centre of the mesh, subtracted in f64 before anything is rounded, so that coordinates of millions, as those
//! of a map, lose nothing: lines as f32, the surface as 16 bits along each side of its box.

use super::strongest::Chosen;
use super::surface::Surface;
use crate::error::Error;
use crate::input::MeshSource;
use crate::partition::{Bounds, Scan};
use crate::stitch::{LineSource, Measures, StitchError};
use glam::DVec3;
use serde::Serialize;

/// Bytes that choosing, thinning and packing take for each segment or triangle: clusters, tables and arrays of the surface,
/// 250; the heap of lines and their points, 60; and all of it once more while it is packed.
const BYTES_EACH: u64 = 400;
/// Share of the memory for them: the tiles are gone by then, what holds the lines is not.
const SHARE: u64 = 4;

/// How much a page shows at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Segments of lines.
    pub segments: u64,
    /// Triangles or points of the surface.
    pub surface: usize,
}

impl Detail {
    /// What a browser turns smoothly on a laptop without a graphics card, in a file of some megabytes.
    pub const MOST: u64 = 200_000;
    /// Without any of it.
    pub const NOTHING: Detail = Detail { segments: 0, surface: 0 };

    /// As much as fits into `memory` bytes.
    pub fn within(memory: u64) -> Detail {
        let each = (memory / SHARE / BYTES_EACH).clamp(1000, Detail::MOST);
        Detail { segments: each, surface: each as usize }
    }
}

/// An array within the bytes.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Array {
    name: &'static str,
    /// `f32`, `f64`, `u32`, `u16` or `u8`, little-endian.
    kind: &'static str,
    /// Where it begins, a multiple of the size of a number.
    offset: usize,
    /// Numbers in it.
    length: usize,
}

/// What is drawn, but for the numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Head {
    /// Subtracted from all coordinates.
    centre: [f64; 3],
    /// Extent of the mesh.
    size: [f64; 3],
    /// Segments that are drawn, and how many lines they belong to.
    segments: u64,
    lines: u64,
    /// All segments and lines.
    all_segments: u64,
    all_lines: u64,
    /// Lines that are drawn through some of their vertices only.
    thinned_lines: u64,
    /// `mesh`, `points` or `none`.
    surface: &'static str,
    /// Side of the cubes whose vertices became one.
    cube: f64,
    /// All faces and vertices of the mesh.
    all_faces: u64,
    all_vertices: u64,
    arrays: Vec<Array>,
}

/// What the page draws.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    head: Head,
    bytes: Vec<u8>,
}

/// The mesh behind the lines.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// The mesh.
    pub source: &'a dyn MeshSource,
    /// What is known of it.
    pub scan: &'a Scan,
    /// Whether its faces lie in no spatial order, so that their corners cost reads at random.
    pub scattered: bool,
}

impl Scene {
    /// Reads the chosen lines, and the mesh once. `ended` is asked from time to time.
    ///
    /// # Errors
    /// If one of them cannot be read, or it shall end.
    pub fn of(
        lines: &dyn LineSource,
        chosen: &Chosen,
        ground: &Ground,
        detail: Detail,
        ended: impl Fn() -> bool,
    ) -> Result<Scene, Error> {
        let Ground { source, scan, scattered } = *ground;
        let bounds = &scan.bounds;
        let centre = (bounds.min + bounds.max) / 2.0;
        let drawn = Drawn::read(lines, chosen, centre)?;
        let surface = match scattered {
            true => Surface::sampled(source, bounds, detail.surface)?,
            false => Surface::thinned(source, bounds, detail.surface, ended)?,
        };
        let mut packer = Packer::default();
        drawn.pack(&mut packer);
        let (size, kind) = (bounds.max - bounds.min, pack_surface(&surface, bounds, &mut packer));
        let counts = lines.counts();
        let head = Head {
            centre: centre.to_array(),
            size: size.to_array(),
            segments: drawn.counts.iter().map(|n| u64::from(*n) - 1).sum(),
            lines: drawn.counts.len() as u64,
            all_segments: counts.edges,
            all_lines: counts.lines,
            thinned_lines: drawn.thinned,
            surface: kind,
            cube: surface.cube,
            all_faces: scan.faces,
            all_vertices: scan.vertices,
            arrays: packer.arrays,
        };
        Ok(Scene { head, bytes: packer.bytes })
    }

    /// What is drawn, but for the numbers.
    pub fn head(&self) -> &impl Serialize {
        &self.head
    }

    /// The numbers.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Lines that are drawn.
struct Drawn {
    points: Vec<f32>,
    /// Points of each line.
    counts: Vec<u32>,
    ids: Vec<u64>,
    measures: Vec<Measures>,
    thinned: u64,
}

impl Drawn {
    fn read(lines: &dyn LineSource, chosen: &Chosen, centre: DVec3) -> Result<Drawn, StitchError> {
        let mut drawn = Drawn {
            points: Vec::new(),
            counts: Vec::new(),
            ids: Vec::new(),
            measures: Vec::new(),
            thinned: 0,
        };
        let mut wanted = chosen.ids.iter().copied().peekable();
        for (id, line) in (0u64..).zip(lines.lines()) {
            if wanted.peek().is_none() {
                break;
            }
            let line = line?;
            if wanted.next_if_eq(&id).is_some() {
                let last = line.points.len() - 1;
                let step = (last as u64).div_ceil(chosen.most_edges.max(1)).max(1) as usize;
                let inner = line.points[..last].iter().step_by(step);
                let before = drawn.points.len();
                for &p in inner.chain(&line.points[last..]) {
                    drawn.points.extend((p - centre).to_array().map(|x| x as f32));
                }
                drawn.thinned += u64::from(step > 1);
                drawn.counts.push(((drawn.points.len() - before) / 3) as u32);
                drawn.ids.push(id);
                drawn.measures.push(line.measures);
            }
        }
        Ok(drawn)
    }

    fn pack(&self, packer: &mut Packer) {
        let measures = &self.measures;
        packer.add("id", "f64", self.ids.iter().map(|&id| (id as f64).to_le_bytes()));
        packer.add("length", "f64", measures.iter().map(|m| m.length.to_le_bytes()));
        packer.add("angle", "f32", measures.iter().map(|m| (m.angle as f32).to_le_bytes()));
        packer.add("strength", "f32", measures.iter().map(|m| (m.strength as f32).to_le_bytes()));
        packer.add("points", "u32", self.counts.iter().map(|n| n.to_le_bytes()));
        packer.add("place", "f32", self.points.iter().map(|x| x.to_le_bytes()));
        packer.add("class", "u8", measures.iter().map(|m| [m.class as u8]));
        packer.add("closed", "u8", measures.iter().map(|m| [u8::from(m.closed)]));
        packer.add("bend", "u8", measures.iter().map(|m| [m.bend as u8]));
    }
}

/// Packs the surface; returns what it is.
fn pack_surface(surface: &Surface, bounds: &Bounds, packer: &mut Packer) -> &'static str {
    let size = bounds.max - bounds.min;
    let scale =
        DVec3::from_array(size.to_array().map(|x| if x > 0.0 { f64::from(u16::MAX) / x } else { 0.0 }));
    packer.add("corner", "u32", surface.triangles.iter().flatten().map(|v| v.to_le_bytes()));
    let places = surface.positions.iter().flat_map(|p| (*p * scale).to_array());
    packer.add("ground", "u16", places.map(|x| (x.round() as u16).to_le_bytes()));
    match (surface.positions.is_empty(), surface.triangles.is_empty()) {
        (true, _) => "none",
        (_, true) => "points",
        _ => "mesh",
    }
}

#[derive(Default)]
struct Packer {
    arrays: Vec<Array>,
    bytes: Vec<u8>,
}

impl Packer {
    fn add<const SIZE: usize>(
        &mut self,
        name: &'static str,
        kind: &'static str,
        numbers: impl Iterator<Item = [u8; SIZE]>,
    ) {
        let offset = self.bytes.len().next_multiple_of(SIZE);
        self.bytes.resize(offset, 0);
        numbers.for_each(|number| self.bytes.extend(number));
        self.arrays.push(Array { name, kind, offset, length: (self.bytes.len() - offset) / SIZE });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_lie_where_the_head_says() {
        let mut packer = Packer::default();
        packer.add("a", "u8", [[7u8], [8], [9]].into_iter());
        packer.add("b", "u32", [1u32.to_le_bytes()].into_iter());
        assert_eq!(packer.bytes, [7, 8, 9, 0, 1, 0, 0, 0]);
        let place = |i: usize| (packer.arrays[i].offset, packer.arrays[i].length);
        assert_eq!((place(0), place(1)), ((0, 3), (4, 1)));
    }

    #[test]
    fn detail_follows_the_memory() {
        assert_eq!(Detail::within(u64::MAX).segments, Detail::MOST);
        assert_eq!(Detail::within(64 << 20).surface, 41_943);
        assert_eq!(Detail::within(0).surface, 1000);
    }
}
