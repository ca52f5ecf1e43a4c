//! Reports of a run, for a client, a colleague, or a program: what was run and on what, what was found, and how it went.
//!
//! ```text
//!  lines ── findings ──> statistics, histograms ──> data: Report ──> JSON
//!            └─ strongest ─┐                          └───────────┐
//!  mesh ──── surface ──────┴─> scene: arrays of numbers ──────────┴─> page: HTML
//! ```
//!
//! A report knows nothing of the terminal; the summary there is made from the same [`Report`]. Everything is of bounded size,
//! whatever the size of the mesh and of the result.

mod data;
mod findings;
mod histogram;
mod page;
mod scene;
mod strongest;
mod surface;

pub use data::{
    CLASSES, ClassCount, Defects, Found, Histogram, Histograms, InEffect, Input, InputFile, Mesh, Output,
    Parameters, Program, Report, SCHEMA, Series, Stage, Thresholds, Waits, Work, is_crease,
};
pub use findings::Findings;
pub use scene::{Detail, Ground, Scene};
pub use strongest::Chosen;

use crate::output::{OutputError, PartFile};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A report to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFile {
    /// Where.
    pub path: PathBuf,
    /// As what.
    pub kind: Kind,
}

/// What a report is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// For programs.
    Json,
    /// One page for a browser.
    Html,
}

impl ReportFile {
    /// The kind is that of the extension.
    ///
    /// # Errors
    /// If the extension is neither `json` nor `html`.
    pub fn named(name: &str) -> Result<ReportFile, String> {
        let path = PathBuf::from(name);
        let is = |wanted: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
        let kind = match (is("json"), is("html") || is("htm")) {
            (true, _) => Kind::Json,
            (_, true) => Kind::Html,
            _ => {
                return Err(
                    "a report is written as JSON or HTML; give a name that ends in .json or .html".to_owned()
                );
            }
        };
        Ok(ReportFile { path, kind })
    }
}

/// Writes `report` as JSON to the part that becomes `target` when it is committed.
///
/// # Errors
/// If the part cannot be written.
pub fn stage_json(target: &Path, report: &Report) -> Result<PartFile, OutputError> {
    stage(target, |out| {
        serde_json::to_writer_pretty(&mut *out, report)?;
        out.write_all(b"\n")
    })
}

/// Writes `report` and `scene` as a page to the part that becomes `target` when it is committed.
///
/// # Errors
/// If the part cannot be written.
pub fn stage_page(target: &Path, report: &Report, scene: &Scene) -> Result<PartFile, OutputError> {
    stage(target, |out| page::write_page(out, report, scene))
}

fn stage(
    target: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<PartFile, OutputError> {
    let part = PartFile::create(target)?;
    let mut out = BufWriter::with_capacity(1 << 18, part.file());
    write(&mut out).and_then(|()| out.flush()).map_err(|source| OutputError::Io {
        path: target.to_owned(),
        action: "cannot write",
        source,
    })?;
    drop(out);
    Ok(part)
}
