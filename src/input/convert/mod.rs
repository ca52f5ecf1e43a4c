//! Whatever is not one binary little-endian PLY file becomes one, once, in bounded memory.
//!
//! In: files in any of the formats, in canonical order. Out: a temporary PLY file that is read in place like any other.
//!
//! Readers go through a file once, from start to end, and hand over vertices and polygons (`gather`); these go to temporary
//! files. When all files were read it is known how wide coordinates must be and, if vertices are to be welded, which of
//! them are one (`weld`, `near`); then the mesh is written (`write`). Memory does not depend on the size of the files.
//!
//! The readers are our own: the crates for these formats hold the whole mesh, mostly with `f32` positions and `u32` indices,
//! and none of them says at which line it gave up.

mod gather;
mod names;
mod near;
mod polygons;
mod weld;
mod write;

#[cfg(test)]
mod tests;

pub use gather::{Faces, Gather};
pub use weld::Weld;

use super::InputError;
use super::format::{Format, no_faces};
use super::stream::{Packing, Stream};
use super::{obj, off, ply, stl};
use crate::spill::{PlainFile, PlainWriter, ScratchPlace};
use std::path::{Path, PathBuf};

/// Is told how far a conversion is. Called from one thread.
pub trait Progress {
    /// So many more bytes were worked on.
    fn advanced(&self, bytes: u64);

    /// So many bytes come on top of those of the files.
    fn grown(&self, bytes: u64);
}

/// What a conversion may use.
pub(super) struct Context<'a> {
    /// Where temporary files go.
    pub scratch: &'a ScratchPlace,
    /// Bytes that may be held.
    pub memory: u64,
    /// Who wants to know.
    pub progress: &'a dyn Progress,
}

/// A file of the input, as it was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Where it is.
    pub path: PathBuf,
    /// What it is.
    pub format: Format,
    /// How it is packed.
    pub packing: Packing,
    /// Vertices that it has.
    pub vertices: u64,
    /// Polygons that it has.
    pub polygons: u64,
}

/// Converts `files` into one.
pub(super) fn convert(
    files: &[PathBuf],
    weld: Option<Weld>,
    context: &Context<'_>,
) -> Result<(PlainFile, Vec<InputFile>), InputError> {
    let scratch = context.scratch.dir()?;
    let mut gather = Gather::new(&scratch, context.memory);
    let mut found = Vec::new();
    for path in files {
        found.push(read(path, &mut gather, files.len() > 1, context)?);
    }
    let gathered = gather.finish()?;
    if gathered.polygon_count() == 0 {
        return Err(InputError::Format {
            path: files.first().cloned().unwrap_or_default(),
            reason: no_faces(),
        });
    }
    let soup = gathered.parts.iter().any(|part| part.faces == Faces::Soup);
    let by_default = if soup || files.len() > 1 { Weld::Exact } else { Weld::None };
    let weld = weld.unwrap_or(by_default);
    context.progress.grown(write::reported_bytes(&gathered));
    let renumbered = match weld {
        Weld::None => None,
        rule => Some(weld::weld(&gathered, rule, context.scratch, context.memory)?),
    };
    let mesh = write::write(&gathered, renumbered, &scratch, context)?;
    Ok((mesh, found))
}

/// Reads one file. One that is empty is no harm among others.
fn read(
    path: &Path,
    gather: &mut Gather,
    others: bool,
    context: &Context<'_>,
) -> Result<InputFile, InputError> {
    let progress = |bytes| context.progress.advanced(bytes);
    let mut stream = Stream::open(path, context.memory / 2, &progress)?;
    let format = Format::of(&mut stream)?;
    let faces = match format {
        Format::StlBinary | Format::StlAscii => Faces::Soup,
        Format::Ply | Format::Obj | Format::Off => Faces::Listed,
    };
    gather.begin(path, faces);
    let longest = usize::try_from(context.memory / 8).unwrap_or(usize::MAX).max(64 << 10);
    match format {
        Format::Ply => ply::read(&mut stream, longest, gather)?,
        Format::Obj => obj::read(&mut stream, longest, gather)?,
        Format::StlBinary => stl::binary::read(&mut stream, gather)?,
        Format::StlAscii => stl::ascii::read(&mut stream, longest, gather)?,
        Format::Off => off::read(&mut stream, longest, gather)?,
    }
    gather.end()?;
    let (vertices, polygons) = gather.last().map_or((0, 0), |part| (part.vertices, part.polygons));
    if polygons == 0 && (vertices > 0 || !others) {
        return Err(InputError::Format { path: path.to_owned(), reason: no_faces() });
    }
    Ok(InputFile { path: path.to_owned(), format, packing: stream.packing(), vertices, polygons })
}

/// Unpacks a file as it is.
pub(super) fn unpack(mut stream: Stream<'_>, context: &Context<'_>) -> Result<PlainFile, InputError> {
    let mut out = PlainWriter::create(&context.scratch.dir()?, "mesh", 256 << 10)?;
    while !stream.at_end()? {
        out.write(stream.available())?;
        stream.consume(stream.available().len());
    }
    Ok(out.finish()?)
}
