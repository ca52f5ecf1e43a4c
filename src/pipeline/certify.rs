//! One tile, first half: loading until everything is there that its vertices depend on.
//!
//! In: a cell of the plan. Out: a [`Certified`] tile. The region that is loaded starts as the cell and a margin; from the
//! mesh in it follows what the owned vertices depend on, and where that lies outside, the region grows. What comes out
//! does not depend on the guesses on the way, because only what is depended on is used.

use crate::input::MeshSource;
use crate::mesh::TileMesh;
use crate::partition::{
    Cell, Demand, Gap, LoadError, Loaded, Numbering, PaperReach, Pass, Plan, Reach, Region, load, merge,
    noise_demand, paper_demand, round_demand, vertex_demand,
};
use crate::voting::{FaceGeometry, Noise, rounds};
use glam::DVec3;
use rayon::prelude::*;

/// A tile with all that its vertices depend on.
pub struct Certified {
    /// What was loaded.
    pub mesh: TileMesh,
    /// The region it was loaded for.
    pub region: Region,
    /// What of it the tile owns.
    pub cell: Cell,
    /// Where each step has to be computed.
    pub demand: Demand,
    /// Normals, until they have been refined, and areas.
    pub faces: FaceGeometry,
    /// Noise level of each face, where it is known.
    pub noise: Vec<Option<f64>>,
    /// Refinement rounds to do for each face.
    pub needed: Vec<u32>,
    /// K of each vertex where it is known; 0 elsewhere.
    pub vertex_rounds: Vec<u32>,
    /// Largest K that was met.
    pub most_rounds: u32,
    /// How often the region had to grow.
    pub regrown: u32,
}

/// How far the steps reach that the tile is loaded for.
#[derive(Clone, Copy, Debug)]
pub enum Halo {
    /// Those of the robust method, times a factor: 1 unless a test wants to see a thin halo caught.
    Robust(f64),
    /// Those of one pass of the paper method.
    Paper(PaperReach, Pass),
}

impl Halo {
    /// A margin, in cubes, that is usually enough; `rounds` as in [`Reach::margin`].
    pub fn margin(&self, plan: &Plan, rounds: u32) -> i64 {
        match self {
            Halo::Robust(factor) => Reach::new(&plan.scale, rounds).scaled(*factor).margin(rounds),
            Halo::Paper(reach, pass) => reach.margin(*pass, &plan.scale, plan.lattice.edge),
        }
    }
}

/// Loads a tile with everything the vertices of `cell` depend on. The first attempt loads the cell and `margin` cubes
/// around it; that decides how often it is loaded, and nothing else.
///
/// `numbering` is how vertices and faces are numbered, which decides how fast the rest is.
///
/// # Errors
/// If the source fails or the region comes to hold more than `most` faces.
pub fn certify(
    source: &dyn MeshSource,
    plan: &Plan,
    halo: &Halo,
    cell: &Cell,
    margin: i64,
    most: u64,
    numbering: Numbering,
) -> Result<Certified, LoadError> {
    let mut region = plan.first_region(cell, margin);
    let (mut regrown, mut generosity) = (0, 1u32);
    loop {
        let mesh = load(source, plan, &region, most, numbering)?;
        let attempt = match halo {
            Halo::Robust(factor) => attempt(plan, *factor, cell, mesh, &region),
            Halo::Paper(reach, pass) => paper_attempt(plan, reach, *pass, cell, mesh, &region),
        };
        match attempt {
            Ok(mut tile) => {
                tile.regrown = regrown;
                return Ok(tile);
            }
            Err(gaps) => {
                tracing::debug!(?cell, gaps = gaps.len(), "the region grows");
                region.grow(&gaps, generosity);
                regrown += 1;
                // Where the guess was too low, the next one is twice as wide: a few loads, whatever the mesh is like.
                generosity = generosity.saturating_mul(2);
            }
        }
    }
}

/// Either the tile, or the gaps in the region.
type Attempt = Result<Certified, Vec<Gap>>;

/// Looks whether `mesh`, which was loaded for `region`, is enough.
fn attempt(plan: &Plan, factor: f64, cell: &Cell, mesh: TileMesh, region: &Region) -> Attempt {
    let loaded = Loaded { mesh: &mesh, region, lattice: &plan.lattice };
    let faces = FaceGeometry::new(&mesh, &plan.scale);
    let levels = Noise::new(&mesh, &faces, &plan.lattice, region);
    let vertex_rounds = rounds_at_vertices(&mesh, plan, &levels);
    let reach =
        Reach::new(&plan.scale, vertex_rounds.iter().flatten().copied().max().unwrap_or(0)).scaled(factor);
    let (demand, mut gaps) = vertex_demand(&loaded, cell, &reach);
    let faces_in_order = (0..mesh.face_count() as u32).into_par_iter();
    let barycentres: Vec<DVec3> = faces_in_order.map(|f| mesh.barycentre(f)).collect();
    let noise = levels.levels_at(&barycentres);
    let face_rounds: Vec<Option<u32>> =
        noise.par_iter().map(|s0| s0.map(|s0| rounds(&plan.scale, s0))).collect();
    let (needed, more) = round_demand(&loaded, plan, &demand.voted, &face_rounds, &reach);
    gaps.extend(more);
    gaps.extend(noise_demand(&loaded, &demand, |v| vertex_rounds[v as usize].is_some()));
    if !gaps.is_empty() {
        return Err(merge(gaps));
    }
    let most_rounds = needed.iter().copied().max().unwrap_or(0);
    let vertex_rounds = vertex_rounds.into_par_iter().map(|k| k.unwrap_or(0)).collect();
    let region = region.clone();
    Ok(Certified {
        mesh,
        region,
        cell: *cell,
        demand,
        faces,
        noise,
        needed,
        vertex_rounds,
        most_rounds,
        regrown: 0,
    })
}

/// The same for one pass of the paper method, which refines nothing: there is no noise to know, and no round to do.
fn paper_attempt(
    plan: &Plan,
    reach: &PaperReach,
    pass: Pass,
    cell: &Cell,
    mesh: TileMesh,
    region: &Region,
) -> Attempt {
    let loaded = Loaded { mesh: &mesh, region, lattice: &plan.lattice };
    let (demand, gaps) = paper_demand(&loaded, plan, cell, reach, pass);
    if !gaps.is_empty() {
        return Err(merge(gaps));
    }
    let faces = FaceGeometry::new(&mesh, &plan.scale);
    Ok(Certified {
        region: region.clone(),
        cell: *cell,
        demand,
        faces,
        noise: vec![None; mesh.face_count()],
        needed: vec![0; mesh.face_count()],
        vertex_rounds: vec![0; mesh.vertex_count()],
        most_rounds: 0,
        regrown: 0,
        mesh,
    })
}

/// K at each vertex where it is known. Whatever uses K certifies that it is, so that the largest known one is at least as
/// large as any that is used.
fn rounds_at_vertices(mesh: &TileMesh, plan: &Plan, levels: &Noise) -> Vec<Option<u32>> {
    let levels = levels.levels_at(&mesh.positions).into_par_iter();
    levels.map(|s0| s0.map(|s0| rounds(&plan.scale, s0))).collect()
}

impl Certified {
    /// Whether the tile owns vertex `v`.
    pub fn owns(&self, v: u32) -> bool {
        self.cell.owns(self.mesh.position(v))
    }

    /// Whether the tile owns a face with these corners: whoever owns the corner of lowest id does.
    pub fn owns_face(&self, corners: &[u32; 3]) -> bool {
        self.owns(self.mesh.lowest(corners))
    }

    /// How many faces the tile owns.
    pub fn owned_faces(&self) -> u64 {
        if self.cell.is_everything() {
            return self.mesh.face_count() as u64;
        }
        self.mesh.corners.par_iter().filter(|corners| self.owns_face(corners)).count() as u64
    }
}
