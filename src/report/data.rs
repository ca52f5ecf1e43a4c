//! The report of a run as data: one structure, from which the summary on the terminal, the JSON file and the page are made,
//! so that they cannot disagree.
//!
//! `docs/REPORT.md` describes every field, and a test compares the names. Unlike results, a report names versions, times and
//! sizes: two reports of the same job differ.

use crate::stitch::Class;
use serde::Serialize;

/// Version of the structure: it is counted up when a field changes its meaning or goes, not when one is added.
pub const SCHEMA: u32 = 1;

/// What was asked for, what was found, and how.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Who wrote it.
    pub program: Program,
    /// The words of the command line, the name of the program first.
    pub command: Vec<String>,
    /// What was read.
    pub input: Input,
    /// What changed the result.
    pub parameters: Parameters,
    /// What did not.
    pub limits: InEffect,
    /// What the scan found.
    pub mesh: Mesh,
    /// The lines in numbers.
    pub found: Found,
    /// How the lines are distributed.
    pub histograms: Histograms,
    /// What is wrong with the mesh.
    pub defects: Defects,
    /// How the work went.
    pub work: Work,
    /// Files that were written.
    pub outputs: Vec<Output>,
}

/// A program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Program {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
}

impl Program {
    /// This one.
    pub const THIS: Program = Program { name: env!("CARGO_PKG_NAME"), version: env!("CARGO_PKG_VERSION") };
}

/// What was read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Input {
    /// A file, or what several have in common.
    pub name: String,
    /// The files, in canonical order.
    pub files: Vec<InputFile>,
    /// Whether they were converted before they could be read in place.
    pub converted: bool,
}

/// A file of the input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputFile {
    /// As it was named or found.
    pub path: String,
    /// Its size.
    pub bytes: Option<u64>,
}

/// What changed the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// `robust` or `paper`.
    pub method: &'static str,
    /// Thresholds of the paper method.
    pub thresholds: Option<Thresholds>,
    /// Voting scale in mesh units; 0 where the one-ring alone votes.
    pub sigma: f64,
    /// The same in median edges.
    pub sigma_edges: f64,
    /// Weakest crease that is reported, degrees.
    pub min_angle: f64,
    /// Shortest line that is reported, in sigmas.
    pub min_length_sigmas: f64,
    /// Whether open borders and non-manifold edges are reported.
    pub boundaries: bool,
    /// The preset that was chosen, and what it set.
    pub preset: Option<String>,
    /// `vertices` or `fitted`.
    pub geometry: &'static str,
}

/// Thresholds of the paper method, all from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Thresholds {
    /// Of the salience of a feature.
    pub salience: f64,
    /// Of l2 of a sharp edge.
    pub edge_l2: f64,
    /// Of l3 of a corner.
    pub corner_l3: f64,
}

/// Limits in effect; none changes the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InEffect {
    /// Threads that computed.
    pub threads: u64,
    /// Bytes that might be allocated; nothing if there was no limit.
    pub memory_bytes: Option<u64>,
    /// `auto`, `in-core` or `faces`.
    pub tiling: &'static str,
    /// Faces of a tile that were asked for.
    pub tile_faces: Option<u64>,
    /// `auto`, `map` or `read`.
    pub io: &'static str,
}

/// What the scan found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mesh {
    /// Triangles, after polygons were cut into fans.
    pub faces: u64,
    /// Vertices, used or not.
    pub vertices: u64,
    /// Lowest coordinates of the vertices that faces use.
    pub min: [f64; 3],
    /// Highest coordinates.
    pub max: [f64; 3],
    /// Median side of a triangle, mesh units.
    pub median_edge: f64,
    /// Mean side.
    pub mean_edge: f64,
    /// Shortest side.
    pub shortest_edge: f64,
    /// Longest side.
    pub longest_edge: f64,
}

/// The lines in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Lines of all classes.
    pub lines: u64,
    /// Their length, mesh units.
    pub length: f64,
    /// Edges of all lines.
    pub edges: u64,
    /// Closed lines.
    pub closed: u64,
    /// Corners on lines.
    pub corners: u64,
    /// The classes that occur, in the order in which they interest.
    pub classes: Vec<ClassCount>,
}

/// The lines of a class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassCount {
    /// Its name.
    pub class: &'static str,
    /// Lines.
    pub lines: u64,
    /// Their length, mesh units.
    pub length: f64,
    /// Mean fold angle over the length, degrees; creases only.
    pub mean_angle: Option<f64>,
    /// Smallest mean angle of a line, degrees; creases only.
    pub least_angle: Option<f64>,
    /// Largest, degrees; creases only.
    pub most_angle: Option<f64>,
}

/// How the lines are distributed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Histograms {
    /// Mean fold angle of creases, degrees.
    pub angle: Histogram,
    /// Length of lines of all classes, mesh units.
    pub length: Histogram,
    /// Mean saliency of creases, 0 to 1.
    pub strength: Histogram,
}

/// Counts in bins. Bin i holds what is at least `bounds[i]` and below `bounds[i + 1]`; the last also what is equal to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Histogram {
    /// One more than there are bins, ascending.
    pub bounds: Vec<f64>,
    /// One series for each class that occurs.
    pub classes: Vec<Series>,
}

/// The bins of a class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// Its name.
    pub class: &'static str,
    /// Lines in each bin.
    pub lines: Vec<u64>,
    /// Their length in each bin, mesh units.
    pub length: Vec<f64>,
}

/// What is wrong with the mesh, counted.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Defects {
    /// Faces left out because they name a vertex that does not exist.
    pub left_out_missing: u64,
    /// Faces left out because of coordinates that are not finite.
    pub left_out_unusable: u64,
    /// Vertices with such coordinates.
    pub unusable_vertices: u64,
    /// Faces without area.
    pub degenerate_faces: u64,
    /// Faces that name a vertex twice.
    pub repeated_corner: u64,
    /// Duplicates of other faces.
    pub duplicate_faces: u64,
    /// Edges with one face.
    pub boundary_edges: u64,
    /// Edges with three or more.
    pub nonmanifold_edges: u64,
    /// Edges between faces of opposite winding.
    pub opposed_edges: u64,
    /// Vertices that no face uses.
    pub unreferenced_vertices: u64,
}

/// How the work went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Work {
    /// Tiles that were worked on.
    pub tiles: u64,
    /// Tiles that an earlier run had done.
    pub resumed_tiles: u64,
    /// All tiles.
    pub all_tiles: u64,
    /// Faces owned by the tiles that were worked on.
    pub owned_faces: u64,
    /// Faces loaded for them, halos included.
    pub loaded_faces: u64,
    /// Faces loaded beyond those owned, as a share of these.
    pub halo_overhead: f64,
    /// How often a region had to grow.
    pub regrown: u64,
    /// Whether the mesh was rewritten in spatial order.
    pub rewritten: bool,
    /// The most bytes of temporary files at a time.
    pub temporary_bytes: u64,
    /// How long loading, computing and committing waited for each other.
    pub waits: Waits,
    /// Wall time until the outputs were ready to get their names.
    pub wall_seconds: f64,
    /// Processor time of all threads.
    pub cpu_seconds: Option<f64>,
    /// Most that was allocated at a time.
    pub peak_allocated_bytes: u64,
    /// Largest resident set, mapped files included.
    pub peak_resident_bytes: Option<u64>,
    /// The same without mapped files.
    pub peak_anonymous_bytes: Option<u64>,
    /// Stages in the order in which they began; one can come twice.
    pub stages: Vec<Stage>,
}

/// How long the parts of a pass over the tiles waited for each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Waits {
    /// The loader, for tiles to give memory back.
    pub for_memory_seconds: f64,
    /// The loader, for somebody to take the tile it had loaded.
    pub for_workers_seconds: f64,
    /// The workers, together, for a tile.
    pub for_tiles_seconds: f64,
    /// The workers, together, for the committer.
    pub for_committer_seconds: f64,
    /// Tiles that workers took.
    pub taken_tiles: u64,
    /// Those of them that lay ready when the worker came.
    pub ready_tiles: u64,
}

/// What a stage used.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// Its name.
    pub stage: &'static str,
    /// Wall time.
    pub wall_seconds: f64,
    /// Processor time of all threads.
    pub cpu_seconds: Option<f64>,
    /// Bytes that came from the disk.
    pub read_bytes: Option<u64>,
    /// Bytes handed over to be written.
    pub written_bytes: Option<u64>,
    /// Most that was seen allocated at a time.
    pub allocated_bytes: Option<u64>,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Output {
    /// Its name.
    pub path: String,
    /// Its size; a report does not know that of the reports.
    pub bytes: Option<u64>,
}

/// Classes of lines in the order in which they interest.
pub const CLASSES: [Class; 4] = [Class::Sharp, Class::Weak, Class::Boundary, Class::NonManifold];

/// Whether lines of the class have an angle and a strength.
pub fn is_crease(class: Class) -> bool {
    matches!(class, Class::Sharp | Class::Weak)
}
