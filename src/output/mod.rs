//! Results into files. Every file appears under its name only when it is whole.

mod annotation;
mod attributes;
mod crs;
mod error;
mod lines;
mod part_file;
mod rows;

pub use annotation::Annotation;
pub use attributes::AttributeFile;
pub use crs::{Crs, CrsError};
pub use error::OutputError;
pub use lines::{LineFormat, stage_lines, stage_ply, write_lines, write_ply};
pub use part_file::{PartFile, check_target, directory_of, part_of};

use crate::stitch::VertexFields;

/// Takes the fields of the vertices that tiles own. Every vertex of a face with three different corners comes exactly once,
/// tiles in any order; other vertices do not come.
pub trait FieldSink {
    /// Takes the fields of one tile, by ascending id.
    ///
    /// # Errors
    /// If they cannot be stored.
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError>;
}
