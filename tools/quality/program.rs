//! Runs the program that is being judged. In: a mesh file; out: the file of its lines, or that it refused.

use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Exit code for an option that the program does not know, or that does not suit the mesh.
const USAGE: i32 = 2;

/// The program `crease`.
#[derive(Clone, Debug)]
pub struct Program {
    path: PathBuf,
    /// What it says of itself.
    pub version: String,
    /// Arguments for every run, besides those of the method.
    pub extra: Vec<String>,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The lines are where they were wanted.
    Done,
    /// The program does not know the arguments, or they do not suit the mesh. It says why in one line.
    Refused(String),
}

impl Program {
    /// The program at `path`, or the one that was built beside this one.
    ///
    /// # Errors
    /// If there is none, or it cannot be run.
    pub fn find(path: Option<&Path>, extra: &str) -> Result<Program> {
        let path = match path {
            Some(path) => path.to_owned(),
            None => beside_this_one()?,
        };
        let output = Command::new(&path).arg("--version").output().with_context(|| {
            format!("cannot run {}; build it, or name another with --crease", path.display())
        })?;
        ensure!(output.status.success(), "{} --version fails", path.display());
        let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        Ok(Program { path, version, extra: extra.split_whitespace().map(str::to_owned).collect() })
    }

    /// Detects the lines of `mesh` with the arguments of a method, on one thread.
    ///
    /// # Errors
    /// If the program fails for another reason than its arguments.
    pub fn detect(&self, mesh: &Path, lines: &Path, arguments: &[&str]) -> Result<Answer> {
        let mut command = Command::new(&self.path);
        // The cases run side by side.
        command.arg("detect").arg(mesh).arg("-o").arg(lines).args(["--force", "--quiet", "--threads", "1"]);
        let output = command.args(arguments).args(&self.extra).output()?;
        if output.status.success() {
            return Ok(Answer::Done);
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let first = said.lines().next().unwrap_or("it does not say why").trim();
        // What is wrong, without what to do about it.
        let short = first.trim_start_matches("crease: error: ").split(';').next().unwrap_or(first);
        if output.status.code() == Some(USAGE) {
            return Ok(Answer::Refused(short.to_owned()));
        }
        bail!("crease failed on {} ({}): {first}", mesh.display(), output.status)
    }
}

/// `target/PROFILE/crease` for this program at `target/PROFILE/examples/quality`.
fn beside_this_one() -> Result<PathBuf> {
    let this = std::env::current_exe()?;
    let profile = this.parent().and_then(Path::parent).context("this program lies in no directory")?;
    let path = profile.join(format!("crease{}", std::env::consts::EXE_SUFFIX));
    ensure!(
        path.exists(),
        "{} does not exist; build it with `cargo build --release`, or name another with --crease",
        path.display()
    );
    Ok(path)
}
