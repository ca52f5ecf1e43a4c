//! The input of a command, opened, with the progress of its conversion.
//!
//! In: files. Out: a mesh that can be read in place, and what was done to get it.

use super::args::BadFacesArgs;
use super::exit::Failure;
use super::progress::Progress;
use crate::config::Limits;
use crate::input::{self, Decided, InputError, InputFile, InputFiles, OpenOptions, PlySource, Sieve, Weld};
use crate::pipeline::{Event, Observer, Stage, Work};
use crate::spill::ScratchPlace;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A mesh, and how it was opened.
pub(super) struct Input {
    opened: input::Input,
    /// How long the conversion took, if there was one.
    conversion: Option<Duration>,
    /// What another process has decided about faces that cannot be used.
    decided: Option<Arc<Decided>>,
}

/// Hands the progress of a conversion to who shows it.
struct Conversion<'a>(&'a Progress);

impl input::Progress for Conversion<'_> {
    fn advanced(&self, by: u64) {
        self.0.event(Event::Advanced { stage: Stage::Convert, by });
    }

    fn grown(&self, by: u64) {
        self.0.event(Event::Grown { stage: Stage::Convert, by });
    }
}

/// Opens `files` as one mesh; temporary files go to `scratch`.
///
/// # Errors
/// If they are no mesh, or cannot be converted.
pub(super) fn open(
    files: &InputFiles,
    weld: Option<Weld>,
    scratch: &ScratchPlace,
    limits: &Limits,
    progress: &Progress,
) -> Result<Input, Failure> {
    let total = input::bytes_to_convert(files, weld, limits.memory)?;
    let conversion = Conversion(progress);
    let (memory, io) = (limits.memory, limits.io);
    let options = OpenOptions { scratch, weld, memory, io, progress: &conversion };
    if total == 0 {
        return Ok(Input { opened: input::open_input(files, &options)?, conversion: None, decided: None });
    }
    let started = Instant::now();
    progress.event(Event::Started { stage: Stage::Convert, total });
    let opened = input::open_input(files, &options)?;
    let wall = started.elapsed();
    progress.event(Event::Finished { stage: Stage::Convert, wall });
    Ok(Input { opened, conversion: Some(wall), decided: None })
}

impl Input {
    /// A mesh that was opened when the job was planned; `decided` is about faces that cannot be used.
    pub fn planned(mesh: PlySource, decided: Option<Decided>) -> Input {
        Input { opened: input::Input::of(mesh), conversion: None, decided: decided.map(Arc::new) }
    }

    /// The mesh without faces that cannot be used, if that was asked for.
    pub fn sieve(&self, bad: &BadFacesArgs) -> Result<Option<Sieve<'_>>, InputError> {
        match &self.decided {
            Some(decided) => Ok(Some(Sieve::again(self.mesh(), Arc::clone(decided)))),
            None => bad.sieve(self.mesh()),
        }
    }

    /// The mesh, if it is the file that was given; `None` if it was converted and is kept as `path`.
    pub fn keep(self, path: &Path) -> Result<Option<PlySource>, Failure> {
        Ok(self.opened.keep(path)?)
    }

    /// The mesh.
    pub fn mesh(&self) -> &PlySource {
        self.opened.mesh()
    }

    /// Whether the mesh is another file than the one that was given.
    pub fn is_converted(&self) -> bool {
        self.opened.is_converted()
    }

    /// Adds the conversion to what a run tells about its work.
    pub fn add_to(&self, work: &mut Work) {
        if let Some(wall) = self.conversion {
            work.stages.insert(0, (Stage::Convert, wall));
        }
        let (now, peak) = self.opened.temporary_bytes();
        work.temporary_bytes = peak.max(now + work.temporary_bytes);
    }

    /// The files that the mesh comes from.
    pub fn files(&self) -> &[InputFile] {
        self.opened.files()
    }

    /// How long the conversion took, if there was one.
    pub fn conversion(&self) -> Option<Duration> {
        self.conversion
    }
}
