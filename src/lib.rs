//! Feature lines (sharp edges, weak creases, corners) of triangle meshes that are too big for memory.
//!
//! ```text
//!  file ──> input ──> partition ──> voting ──> refine ──> stitch ──> output
//!           source    scan, plan,   normals,   support,   graph,     lines,
//!                     load, halo    tensors    ridge,     prune,     attributes
//!                                              links      polylines
//!           └──────────────── pipeline: stages, threads, tiles ────────────────┘
//! ```
//!
//! Data flows one way, and a module uses only those before it (`error`, which joins the errors of all layers, apart). `voting` and `refine` are pure functions of the mesh of one
//! tile; they cannot tell whether the tile is one of a thousand or the only one, which is why the result does not depend
//! on how the mesh was cut. `workspace` keeps what is done, so that a run that was killed goes on.
//!
//! # A mesh in memory
//!
//! ```
//! use crease::glam::DVec3;
//!
//! // A gable roof: two slopes of 45 degrees that meet in a ridge along y.
//! let (n, mut positions, mut faces) = (40, Vec::new(), Vec::new());
//! for y in 0..=n {
//!     for x in 0..=n {
//!         let height = f64::from(n / 2 - (x - n / 2 as i32).abs());
//!         positions.push(DVec3::new(x.into(), y.into(), height));
//!     }
//! }
//! let row = n as u32 + 1;
//! for y in 0..n as u32 {
//!     for x in 0..n as u32 {
//!         let a = y * row + x;
//!         faces.push([a, a + 1, a + row]);
//!         faces.push([a + 1, a + row + 1, a + row]);
//!     }
//! }
//!
//! let found = crease::detect_mesh(&positions, &faces, &crease::Params::default())?;
//! assert_eq!(found.lines.lines.len(), 1);
//! let ridge = &found.lines.lines[0];
//! assert_eq!(ridge.class, crease::stitch::Class::Sharp);
//! assert!((ridge.length - 40.0).abs() < 1e-9);
//! for &v in &ridge.vertices {
//!     assert_eq!(found.lines.vertices[v as usize].position.x, 20.0);
//! }
//! # Ok::<(), crease::Error>(())
//! ```
//!
//! # A file of any size
//!
//! ```no_run
//! use crease::input::{IoMode, PlySource};
//! use crease::{Limits, Params, Silent};
//!
//! let source = PlySource::open("scan.ply".as_ref(), IoMode::Auto)?;
//! let found = crease::detect(&source, Params::default(), Limits::default(), &Silent)?;
//! crease::output::write_ply("scan.creases.ply".as_ref(), &found.lines)?;
//! # Ok::<(), crease::Error>(())
//! ```

pub mod config;
pub mod error;
pub mod input;
pub mod math;
pub mod mesh;
pub mod output;
pub mod partition;
pub mod pipeline;
pub mod refine;
pub mod report;
pub mod spill;
pub mod stitch;
pub mod voting;
pub mod workspace;

#[doc(hidden)]
pub mod cli;

pub use config::{Limits, Method, Order, PaperThresholds, Params, Sigma, Tiling};
pub use error::Error;
pub use glam;
pub use pipeline::{Detection, Job, Observer, Silent};

use glam::DVec3;
use input::{MemorySource, MeshSource};

/// Detects the feature lines of `source`. Lengths are in the units of the mesh, angles in degrees where a name says so.
///
/// The result is a function of the source and `params` alone; `limits` decides how the work is cut up.
///
/// # Errors
/// If the input is bad, a parameter does not suit the mesh, or a tile does not fit.
pub fn detect(
    source: &dyn MeshSource,
    params: Params,
    limits: Limits,
    observer: &dyn Observer,
) -> Result<Detection, Error> {
    Job::new(source, params, limits, observer)?.run(None)
}

/// Detects the feature lines of a mesh in memory: positions in any unit, faces as indices into them.
///
/// # Errors
/// If a face names a vertex that does not exist, a coordinate is not finite, or a parameter does not suit the mesh.
pub fn detect_mesh(positions: &[DVec3], faces: &[[u32; 3]], params: &Params) -> Result<Detection, Error> {
    let source = MemorySource::new(positions, faces)?;
    detect(&source, *params, Limits { tiling: Tiling::InCore, ..Limits::default() }, &Silent)
}
