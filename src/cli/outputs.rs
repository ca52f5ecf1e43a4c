//! What a run writes, from the words of the command line to files that all appear or none.
//!
//! In: names, whose endings say what is to be written to them. Out: tables that are filled while tiles come in, and in the end a
//! part for every output, which get their names together.

use super::args::OutputArgs;
use super::exit::{Exit, Failure};
use super::targets;
use crate::error::Error;
use crate::input::{InputFiles, MeshSource, PlySource};
use crate::output::{
    Annotation, AttributeFile, Crs, FieldSink, LineFormat, OutputError, PartFile, stage_lines,
};
use crate::spill::ScratchPlace;
use crate::stitch::{LineSource, VertexFields};
use crate::workspace::Workspace;
use std::fs;
use std::path::{Path, PathBuf};

/// Share of the memory that a table may use for rows that are not in place, and bounds of it.
const TABLE_SHARE: u64 = 32;
const TABLE_MEMORY: (u64, u64) = (256 << 10, 32 << 20);

/// What a run writes.
pub(super) struct Outputs {
    /// The lines, in as many formats as were asked for; one at least.
    lines: Vec<(PathBuf, LineFormat)>,
    attributes: Option<PathBuf>,
    annotated: Option<PathBuf>,
    crs: Option<Crs>,
}

impl Outputs {
    /// What `args` ask for, for a run over `input`.
    ///
    /// # Errors
    /// If a name does not say how to write to it, or a system of coordinates is given that no output can hold.
    pub fn new(args: &OutputArgs, input: &InputFiles) -> Result<Outputs, Failure> {
        let names = match args.lines.as_slice() {
            [] => vec![targets::default_output(input)],
            names => names.to_vec(),
        };
        let format = |name: PathBuf| targets::format(&name).map(|format| (name, format));
        let lines = names.into_iter().map(format).collect::<Result<Vec<_>, _>>()?;
        let (attributes, annotated) = (args.attributes.clone(), args.annotate.clone());
        [&attributes, &annotated].into_iter().flatten().try_for_each(|name| targets::check_table(name))?;
        let outputs = Outputs { lines, attributes, annotated, crs: args.crs };
        let holds = |format: LineFormat| outputs.formats().any(|there| there == format);
        if outputs.crs.is_some() && !outputs.formats().any(LineFormat::holds_crs) {
            return Err(Failure::new(
                Exit::Usage,
                "--crs: no output can hold it; also write one whose name ends in .geojson or .gpkg",
            ));
        }
        if outputs.crs.is_none() && holds(LineFormat::GeoJson) {
            tracing::warn!(
                "programs take the coordinates of GeoJSON for longitude and latitude, unless --crs says what they are"
            );
        }
        Ok(outputs)
    }

    fn formats(&self) -> impl Iterator<Item = LineFormat> {
        self.lines.iter().map(|(_, format)| *format)
    }

    /// All names, those of the lines first.
    pub fn paths(&self) -> Vec<&Path> {
        let lines = self.lines.iter().map(|(path, _)| path.as_path());
        let tables = [&self.attributes, &self.annotated].into_iter().flatten().map(PathBuf::as_path);
        lines.chain(tables).collect()
    }

    /// The first of the lines, which the workspace is named after.
    pub fn main(&self) -> &Path {
        &self.lines[0].0
    }

    /// How many bytes of `memory` the tables use while tiles are worked on.
    pub fn memory(&self, memory: u64) -> u64 {
        let tables = [&self.attributes, &self.annotated].into_iter().flatten().count() as u64;
        tables * table_memory(memory)
    }

    /// Begins the tables of a run that may use `memory` bytes: `mesh` is the file that is annotated, `source` what of it is
    /// worked on.
    ///
    /// # Errors
    /// If one cannot be written, or the mesh has such properties already.
    pub fn begin<'a>(
        &self,
        mesh: &'a PlySource,
        source: &dyn MeshSource,
        scratch: &ScratchPlace,
        memory: u64,
    ) -> Result<Tables<'a>, Error> {
        let memory = table_memory(memory);
        let annotation = match &self.annotated {
            Some(path) => Some(Annotation::create(path, mesh, scratch.clone())?.with_memory(memory)),
            None => None,
        };
        let attributes = match &self.attributes {
            Some(path) => {
                Some(AttributeFile::create(path, source)?.with_scratch(scratch.clone()).with_memory(memory))
            }
            None => None,
        };
        Ok(Tables { attributes, annotation })
    }

    /// Writes everything to parts, those of the lines first.
    ///
    /// # Errors
    /// If something cannot be read or written.
    pub fn stage(&self, lines: &dyn LineSource, tables: Tables<'_>) -> Result<Vec<PartFile>, Error> {
        let mut parts = Vec::new();
        for (path, format) in &self.lines {
            parts.push(stage_lines(path, *format, lines, self.crs)?);
        }
        if let Some(attributes) = tables.attributes {
            parts.push(attributes.stage(lines.largest_salience())?);
        }
        if let Some(annotation) = tables.annotation {
            parts.push(annotation.stage(lines)?);
        }
        Ok(parts)
    }
}

fn table_memory(memory: u64) -> u64 {
    (memory / TABLE_SHARE).clamp(TABLE_MEMORY.0, TABLE_MEMORY.1)
}

/// What is filled while tiles come in.
#[derive(Default)]
pub(super) struct Tables<'a> {
    attributes: Option<AttributeFile>,
    annotation: Option<Annotation<'a>>,
}

impl Tables<'_> {
    /// Whoever takes the fields of vertices, if anybody does.
    pub fn sink(&mut self) -> Option<&mut dyn FieldSink> {
        match (&self.attributes, &self.annotation) {
            (None, None) => None,
            _ => Some(self),
        }
    }
}

impl FieldSink for Tables<'_> {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        self.attributes.as_mut().map_or(Ok(()), |table| table.take(fields))?;
        self.annotation.as_mut().map_or(Ok(()), |table| table.take(fields))
    }
}

/// Gives all parts their names, when all are written, because a full disk shows while writing. Several files cannot appear in
/// one instant: if one does not get its name, the others are taken away again; and if the process dies in between, the
/// workspace says that they may be replaced. The first, the lines, comes last.
///
/// # Errors
/// If one does not get its name.
pub(super) fn commit(parts: Vec<PartFile>, outputs: &[&Path], workspace: &Workspace) -> Result<(), Error> {
    let places: Vec<PathBuf> = outputs.iter().filter_map(|output| targets::place(output)).collect();
    workspace.announce(&places)?;
    let mut committed: Vec<PathBuf> = Vec::new();
    for part in parts.into_iter().rev() {
        let target = part.target().to_owned();
        if let Err(error) = part.commit() {
            // The error to report is the one that brought us here.
            committed.iter().for_each(|target| _ = fs::remove_file(target));
            return Err(error.into());
        }
        committed.push(target);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Limits, Params};
    use crate::input::MemorySource;
    use crate::pipeline::{Job, Silent};
    use glam::DVec3;

    #[test]
    fn all_files_appear_or_none() {
        let source = MemorySource::new(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]).expect("a triangle");
        let job = Job::new(&source, Params::default(), Limits::default(), &Silent).expect("a job");
        let found = job.run_stored(None).expect("a result").lines;
        let directory = tempfile::tempdir().expect("a temporary directory");
        let at = |name: &str| directory.path().join(name);
        let formats = LineFormat::ALL.map(|format| (at(&format!("lines.{}", format.extension())), format));
        let outputs = Outputs {
            lines: formats.to_vec(),
            attributes: Some(at("table.ply")),
            annotated: None,
            crs: None,
        };
        let workspace = Workspace::at(&at("work"));
        let write = || {
            let attributes = AttributeFile::create(&at("table.ply"), &source).ok();
            let parts = outputs.stage(&found, Tables { attributes, annotation: None })?;
            commit(parts, &outputs.paths(), &workspace)
        };
        // A directory that turned up meanwhile keeps one from getting its name, the first or one in the middle.
        for name in ["lines.ply", "lines.dxf", "table.ply"] {
            fs::create_dir(at(name)).expect("create");
            write().expect_err("there is a directory in the way");
            assert_eq!(fs::read_dir(directory.path()).expect("list").count(), 1, "{name}");
            fs::remove_dir(at(name)).expect("remove");
        }
        write().expect("nothing is in the way");
        assert_eq!(fs::read_dir(directory.path()).expect("list").count(), LineFormat::ALL.len() + 1);
    }
}
