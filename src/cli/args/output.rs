//! What is written, and where.

use super::OUTPUT;
use crate::output::Crs;
use crate::stitch::Geometry;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// The outputs of `detect`.
#[derive(Debug, Args)]
pub(in crate::cli) struct OutputArgs {
    /// Where the lines run: `vertices`, the default, along edges of the mesh, from vertex to vertex; `fitted`, where the
    /// surfaces on both sides meet, smoothed along the line, as a person would draw them.
    #[arg(long, value_enum, value_name = "KIND", help_heading = OUTPUT, hide_possible_values = true)]
    pub geometry: Option<GeometryArg>,

    /// Where to write the lines; may be given several times. The ending says how: `.ply` (all there is to know), `.obj`, `.vtp`
    /// (ParaView), `.dxf` (CAD, a layer for each class), `.geojson`, `.gpkg` (GeoPackage), `.csv` (a row for each line, with its
    /// points as WKT). Default: the name of the input with `.creases.ply` for its extension, in the current directory.
    #[arg(short = 'o', long = "output", value_name = "FILE", help_heading = OUTPUT)]
    pub lines: Vec<PathBuf>,

    /// The system that the coordinates of the mesh are in, which GeoJSON and GeoPackage pass on; nothing is transformed. x is
    /// east or longitude. Other outputs have no place for it.
    #[arg(long, value_name = "EPSG:N", help_heading = OUTPUT, value_parser = Crs::parse)]
    pub crs: Option<Crs>,

    /// Also write a table of all vertices in the order of the input: position, eigenvalues of the voting tensor, omega,
    /// saliency, class. 65 bytes for each vertex.
    #[arg(long, value_name = "FILE.ply", help_heading = OUTPUT)]
    pub attributes: Option<PathBuf>,

    /// Also write the mesh itself, with all that its file holds, and for each vertex its saliency, its class, and the first
    /// line through it. If the input had to be converted, it is the converted mesh: positions and polygons.
    #[arg(long, value_name = "FILE.ply", help_heading = OUTPUT)]
    pub annotate: Option<PathBuf>,

    /// Replace outputs that exist already.
    #[arg(long, help_heading = OUTPUT)]
    pub force: bool,
}

impl OutputArgs {
    /// Whether an output needs the fields of all vertices.
    pub fn has_tables(&self) -> bool {
        self.attributes.is_some() || self.annotate.is_some()
    }
}

/// Where lines run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum GeometryArg {
    Vertices,
    Fitted,
}

impl GeometryArg {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            GeometryArg::Vertices => "vertices",
            GeometryArg::Fitted => "fitted",
        }
    }
}

impl From<GeometryArg> for Geometry {
    fn from(geometry: GeometryArg) -> Geometry {
        match geometry {
            GeometryArg::Vertices => Geometry::Vertices,
            GeometryArg::Fitted => Geometry::Fitted,
        }
    }
}
