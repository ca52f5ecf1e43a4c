//! Results into files. Every file appears under its name only when it is whole.

mod attributes;
mod error;
mod lines;
mod part_file;

pub use attributes::AttributeFile;
pub use error::OutputError;
pub use lines::write_ply;
pub use part_file::{PartFile, check_target};
