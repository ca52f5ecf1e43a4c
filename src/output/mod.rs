//! Results into files. Every file appears under its name only when it is whole.

mod attributes;
mod error;
mod lines;
mod part_file;

pub use attributes::AttributeFile;
pub use error::OutputError;
pub use lines::{stage_ply, write_ply};
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
