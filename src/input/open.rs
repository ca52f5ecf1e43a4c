//! From names to a mesh that can be read in place.
//!
//! In: files of any format, packed or not, one or many. Out: a [`PlySource`]. One binary little-endian PLY file is opened as
//! it is; if it is packed, it is unpacked into a temporary file; anything else is converted into one, within the memory it
//! is given. The temporary file goes with the input.

use super::convert::{self, Context, InputFile, Progress, Weld};
use super::files::InputFiles;
use super::format::Format;
use super::ply::{self, PlySource};
use super::stream::{Packing, Stream};
use super::{ByteSource, InputError, IoMode, MeshSource};
use crate::spill::{PlainFile, ScratchPlace};
use std::fs;
use std::path::{Path, PathBuf};

/// Memory for a conversion if there is no limit: more makes sorting somewhat faster.
const MEMORY: u64 = 512 << 20;
/// Share of the memory that a conversion uses; buffers and what the allocator loses are not counted.
const SHARE: u64 = 2;

/// How an input is opened.
pub struct OpenOptions<'a> {
    /// Where temporary files go.
    pub scratch: &'a ScratchPlace,
    /// Which vertices are one. If nothing is said, those with equal coordinates where there are several files or STL, and
    /// none elsewhere.
    pub weld: Option<Weld>,
    /// Bytes that may be allocated.
    pub memory: u64,
    /// How the bytes of the mesh are reached afterwards.
    pub io: IoMode,
    /// Who is told how far a conversion is.
    pub progress: &'a dyn Progress,
}

/// A mesh made of one file or many.
#[derive(Debug)]
pub struct Input {
    mesh: PlySource,
    files: Vec<InputFile>,
    // After the mesh, which must be closed before its file goes.
    temporary: Option<PlainFile>,
}

impl Input {
    /// The mesh.
    pub fn mesh(&self) -> &PlySource {
        &self.mesh
    }

    /// The files that it comes from.
    pub fn files(&self) -> &[InputFile] {
        &self.files
    }

    /// Whether the mesh lies in a temporary file.
    pub fn is_converted(&self) -> bool {
        self.temporary.is_some()
    }

    /// A mesh that was opened otherwise.
    pub fn of(mesh: PlySource) -> Input {
        Input { mesh, files: Vec::new(), temporary: None }
    }

    /// The mesh, if it is the file that was given; `None` if it lies in a temporary file, which stays behind as `path`, on the
    /// same disk.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn keep(self, path: &Path) -> Result<Option<PlySource>, InputError> {
        match self.temporary {
            None => Ok(Some(self.mesh)),
            Some(temporary) => Ok(temporary.keep(path).map(|()| None)?),
        }
    }

    /// Bytes of temporary files: that there are, and the most that there were at a time.
    pub fn temporary_bytes(&self) -> (u64, u64) {
        self.temporary.as_ref().map_or((0, 0), |file| (file.dir().bytes(), file.dir().peak_bytes()))
    }
}

/// How a file becomes a mesh that can be read in place.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// It is one.
    InPlace,
    /// It is one, but packed.
    Unpack,
    /// It is read once and written as one.
    Convert,
}

/// The way for `files`, which need to be read to say it.
fn way(files: &[PathBuf], weld: Option<Weld>, memory: u64) -> Result<Way, InputError> {
    let ([path], None | Some(Weld::None)) = (files, weld) else { return Ok(Way::Convert) };
    let mut stream = Stream::open(path, memory, &|_| ())?;
    if Format::of(&mut stream)? != Format::Ply || !ply::is_in_place(&mut stream)? {
        return Ok(Way::Convert);
    }
    Ok(if stream.packing() == Packing::Plain { Way::InPlace } else { Way::Unpack })
}

fn conversion_memory(memory: u64) -> u64 {
    (memory / SHARE).min(MEMORY)
}

/// How many bytes opening `files` will read and convert first; 0 if they can be read in place. `memory` is that of
/// [`OpenOptions`].
///
/// # Errors
/// If a file cannot be read, or is no mesh.
pub fn bytes_to_convert(files: &InputFiles, weld: Option<Weld>, memory: u64) -> Result<u64, InputError> {
    if way(&files.files, weld, conversion_memory(memory))? == Way::InPlace {
        return Ok(0);
    }
    let length = |path: &PathBuf| {
        let metadata = fs::metadata(path);
        metadata.map(|m| m.len()).map_err(|source| InputError::Io { path: path.clone(), source })
    };
    files.files.iter().map(length).sum()
}

/// Opens `files` as one mesh.
///
/// # Errors
/// If a file cannot be read or is no mesh, or temporary files fail.
pub fn open_input(files: &InputFiles, options: &OpenOptions<'_>) -> Result<Input, InputError> {
    let memory = conversion_memory(options.memory);
    let context = Context { scratch: options.scratch, memory, progress: options.progress };
    match (way(&files.files, options.weld, memory)?, files.files.as_slice()) {
        (Way::InPlace, [path]) => open_ply(path, Packing::Plain, None, options.io),
        (Way::Unpack, [path]) => {
            let progress = |bytes| options.progress.advanced(bytes);
            let stream = Stream::open(path, memory, &progress)?;
            let packing = stream.packing();
            let unpacked = convert::unpack(stream, &context)?;
            open_ply(path, packing, Some(unpacked), options.io)
        }
        (_, paths) => {
            let (temporary, files_found) = convert::convert(paths, options.weld, &context)?;
            let bytes = ByteSource::open(temporary.path(), options.io)?.called(&files.name());
            Ok(Input { mesh: PlySource::over(bytes)?, files: files_found, temporary: Some(temporary) })
        }
    }
}

/// Opens one PLY file, or what was unpacked from it.
fn open_ply(
    path: &Path,
    packing: Packing,
    temporary: Option<PlainFile>,
    io: IoMode,
) -> Result<Input, InputError> {
    let bytes = ByteSource::open(temporary.as_ref().map_or(path, PlainFile::path), io)?;
    let mesh = PlySource::over(bytes.called(path))?;
    let (vertices, polygons) = (mesh.vertex_count(), mesh.polygon_count());
    let file = InputFile { path: path.to_owned(), format: Format::Ply, packing, vertices, polygons };
    Ok(Input { mesh, files: vec![file], temporary })
}
