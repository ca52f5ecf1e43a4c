//! How noisy the mesh is, before anything is planned.
//!
//! In: places spread over the mesh. Out: the number of refinement rounds that the noisiest of them needs, for a guess how
//! wide the halos will be. A wrong guess costs time: regions that have to grow, or tiles that are smaller than need be.

use crate::error::Error;
use crate::input::MeshSource;
use crate::partition::{CubeBox, Gap, LoadError, Numbering, Plan, Region, Scan, load};
use crate::voting::{FaceGeometry, Noise, rounds};
use glam::DVec3;

/// Places that are looked at. Each takes the 27 cubes of a level, some two thousand faces.
const PLACES: usize = 16;

/// The most rounds that any of some places of the mesh needs, loading no more than `most` faces; 0 where that is not enough
/// to see anything.
pub fn typical_rounds(source: &dyn MeshSource, plan: &Plan, scan: &Scan, most: u64) -> Result<u32, Error> {
    let step = (scan.sample.len() / PLACES).max(1);
    let places: Vec<DVec3> = scan.sample.iter().skip(step / 2).step_by(step).copied().collect();
    let Some(&first) = places.first() else { return Ok(0) };
    let mut region = Region::new(CubeBox::around(plan.lattice.cube_of(first)));
    let gaps: Vec<Gap> = places.iter().map(|&p| Gap { cube: plan.lattice.cube_of(p), margin: 1 }).collect();
    region.grow(&gaps, 1);
    let mesh = match load(source, plan, &region, most, Numbering::default()) {
        Ok(mesh) => mesh,
        // A pile of faces; whoever comes to work on it will say so.
        Err(LoadError::TooManyFaces { .. }) => return Ok(0),
        Err(error) => return Err(error.into()),
    };
    let faces = FaceGeometry::new(&mesh, &plan.scale);
    let levels = Noise::new(&mesh, &faces, &plan.lattice, &region).levels_at(&places);
    Ok(levels.into_iter().flatten().map(|s0| rounds(&plan.scale, s0)).max().unwrap_or(0))
}
