//! What formats of text have in common: a buffered part whose errors name the file, and words for what is a number in PLY.

use crate::output::{OutputError, PartFile};
use crate::refine::Bend;
use crate::stitch::Geometry;
use std::fmt::Arguments;
use std::fs::File;
use std::io::{BufWriter, Write};

/// Bytes that are written at a time.
const BUFFER: usize = 1 << 20;

/// A part that is written from its start to its end.
pub(super) struct Text<'a> {
    part: &'a PartFile,
    out: BufWriter<&'a File>,
}

impl<'a> Text<'a> {
    pub fn over(part: &'a PartFile) -> Text<'a> {
        Text { part, out: BufWriter::with_capacity(BUFFER, part.file()) }
    }

    /// Appends what `format_args!` makes.
    pub fn put(&mut self, text: Arguments<'_>) -> Result<(), OutputError> {
        self.out.write_fmt(text).map_err(OutputError::io(self.part.target(), "cannot write"))
    }

    /// Hands all that is buffered to the system.
    pub fn finish(mut self) -> Result<(), OutputError> {
        self.out.flush().map_err(OutputError::io(self.part.target(), "cannot write"))
    }
}

/// Convex or concave, if it was told.
pub(super) fn bend_word(bend: Bend) -> Option<&'static str> {
    match bend {
        Bend::Unknown => None,
        Bend::Convex => Some("convex"),
        Bend::Concave => Some("concave"),
    }
}

/// The word for where lines run.
pub(super) fn geometry_word(geometry: Geometry) -> &'static str {
    match geometry {
        Geometry::Vertices => "vertices",
        Geometry::Fitted => "fitted",
    }
}
