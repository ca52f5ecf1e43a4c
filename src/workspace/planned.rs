//! A job that was planned for many tasks: what they must know besides the record of the job itself.
//!
//! In: the command line, the files, and what is known of the mesh, from the process that plans. Out: the same in every task, on any
//! machine that sees the workspace. All paths are relative to the workspace, so that it does not matter where a machine
//! has mounted the file system. The record is written last: what has one is planned.

use super::job::Difference;
use super::{FileMark, WorkspaceError};
use crate::input::ply::KnownPly;
use crate::input::{Decided, InputFiles};
use serde::{Deserialize, Serialize};
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Read};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Component, Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// What the tasks of a job must know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanRecord {
    /// Version of the program. First, so that any later version can read it.
    pub version: String,
    /// The command line.
    pub words: Vec<AnyPath>,
    /// Where it was given.
    pub directory: AnyPath,
    /// The files of the input, and what the system said of them.
    pub inputs: Vec<(AnyPath, FileMark)>,
    /// Where they lie, if there is more than one.
    pub folder: Option<AnyPath>,
    /// What the input is called.
    pub name: AnyPath,
    /// The file that tiles are loaded from: the input, or what was made of it.
    pub mesh: AnyPath,
    /// What is known of it.
    pub known: KnownPly,
    /// Which faces are left out, if any may be.
    pub sieve: Option<Decided>,
    /// How many tiles are a group that a task of its own stitches; 0 if there are no groups.
    pub group_tiles: u32,
}

/// An output that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DoneOutput {
    /// Where it is.
    pub path: AnyPath,
    /// Bytes.
    pub bytes: u64,
    /// XXH3 of all of them.
    pub sum: u128,
}

impl DoneOutput {
    /// Of the file at `path`, to be reached from `workspace`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of(workspace: &Path, path: &Path) -> Result<DoneOutput, WorkspaceError> {
        let (bytes, sum) = digest(path).map_err(WorkspaceError::io(path, "cannot read"))?;
        Ok(DoneOutput { path: relative_place(workspace, path)?, bytes, sum })
    }

    /// Whether the file is there and has its length.
    pub fn is_there(&self, workspace: &Path) -> bool {
        fs::metadata(workspace.join(self.path.path())).is_ok_and(|found| found.len() == self.bytes)
    }

    /// Whether the file is what was written. Reads all of it.
    pub fn is_whole(&self, workspace: &Path) -> bool {
        self.is_there(workspace)
            && digest(&workspace.join(self.path.path())).is_ok_and(|found| found == (self.bytes, self.sum))
    }
}

/// Length and checksum of a file.
fn digest(path: &Path) -> io::Result<(u64, u128)> {
    let (mut file, mut buffer) = (File::open(path)?, vec![0; 1 << 20]);
    let (mut digest, mut length) = (Xxh3::new(), 0);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((length, digest.digest128())),
            n => {
                digest.update(&buffer[..n]);
                length += n as u64;
            }
        }
    }
}

/// A path or word, which need not be text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnyPath(Vec<u8>);

impl AnyPath {
    /// Of a path or word.
    pub fn new(path: impl AsRef<OsStr>) -> AnyPath {
        AnyPath(path.as_ref().as_bytes().to_vec())
    }

    /// The path.
    pub fn path(&self) -> PathBuf {
        self.word().into()
    }

    /// The word.
    pub fn word(&self) -> OsString {
        OsString::from_vec(self.0.clone())
    }
}

impl PlanRecord {
    /// The files of the input, as they lie from `workspace`.
    pub fn files(&self, workspace: &Path) -> InputFiles {
        let from = |path: &AnyPath| workspace.join(path.path());
        InputFiles {
            files: self.inputs.iter().map(|(path, _)| from(path)).collect(),
            folder: self.folder.as_ref().map(from),
        }
    }

    /// In what the input differs that a job would be planned for `now`, if it does.
    pub fn other_input(&self, now: &[(AnyPath, FileMark)]) -> Option<Difference> {
        let what = "the input";
        if self.inputs.len() != now.len() {
            let [before, now] = [self.inputs.len(), now.len()].map(|n| format!("{n} files"));
            return Some(Difference { what, before, now });
        }
        let said = |(path, mark): &(AnyPath, FileMark)| {
            let (seconds, nanoseconds) = mark.written;
            let path = path.path();
            format!(
                "{} ({} bytes, written {seconds}.{nanoseconds:09} s after 1970)",
                path.display(),
                mark.bytes
            )
        };
        let mut pairs = self.inputs.iter().zip(now);
        pairs.find(|(a, b)| a != b).map(|(a, b)| Difference { what, before: said(a), now: said(b) })
    }
}

/// `target` as it is reached from the directory `base`. Both exist.
///
/// # Errors
/// If the system refuses.
pub fn relative(base: &Path, target: &Path) -> Result<AnyPath, WorkspaceError> {
    let full =
        |path: &Path| fs::canonicalize(path).map_err(WorkspaceError::io(path, "cannot find out where it is"));
    Ok(AnyPath::new(between(&full(base)?, &full(target)?)))
}

/// The same for a file that need not be there, in a directory that is.
///
/// # Errors
/// If the system refuses.
pub fn relative_place(base: &Path, target: &Path) -> Result<AnyPath, WorkspaceError> {
    let directory = target.parent().filter(|parent| *parent != Path::new("")).unwrap_or(Path::new("."));
    let place = relative(base, directory)?.path().join(target.file_name().unwrap_or_default());
    Ok(AnyPath::new(place.strip_prefix(".").unwrap_or(&place)))
}

/// From one full path to another.
fn between(base: &Path, target: &Path) -> PathBuf {
    let common = base.components().zip(target.components()).take_while(|(a, b)| a == b).count();
    let up = base.components().skip(common).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(target.components().skip(common)).collect();
    if path == Path::new("") { PathBuf::from(".") } else { path }
}

/// What tells this process from all others that may work in a workspace, on whatever machine and at whatever time: the name
/// of the machine, the number of the process, and a number that nobody else draws.
pub fn attempt() -> String {
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let host: String = host.chars().map(plain).take(40).collect();
    let nonce = RandomState::new().hash_one(std::process::id());
    format!("{host}-{}-{nonce:016x}", std::process::id())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_one_place_to_another() {
        for (base, target, expected) in [
            ("/a/b", "/a/b/c.ply", "c.ply"),
            ("/a/b", "/a/c.ply", "../c.ply"),
            ("/a/b", "/d/e", "../../d/e"),
            ("/a/b", "/a/b", "."),
            ("/", "/a", "a"),
        ] {
            assert_eq!(between(Path::new(base), Path::new(target)), Path::new(expected), "{base} {target}");
        }
    }

    #[test]
    fn no_two_attempts_are_one() {
        let (a, b) = (attempt(), attempt());
        assert_ne!(a, b);
        assert!(a.bytes().all(|c| c.is_ascii_alphanumeric() || b"-_".contains(&c)), "{a}");
    }
}
