//! Reports of a run.

use super::OUTPUT;
use crate::report::ReportFile;
use clap::Args;

/// The reports of `detect`.
#[derive(Debug, Args)]
pub(in crate::cli) struct ReportArgs {
    /// Also write a report of the run: what was run and on what, counts and histograms by class, defects, time and memory of
    /// each stage. `FILE.json` is for programs; `FILE.html` is one page for a browser, without network, with the lines in 3D
    /// over a thinned mesh, for which the mesh is read once more. Can be given several times. A report names times and
    /// versions, unlike other outputs.
    #[arg(long = "report", value_name = "FILE.json|FILE.html", help_heading = OUTPUT, value_parser = ReportFile::named)]
    pub reports: Vec<ReportFile>,
}
