//! How a run ends, and which failure ends it how.
//!
//! In: an error of any layer. Out: an exit code that a script can branch on, and one line that names the file.

use crate::error::Error;
use crate::input::InputError;
use crate::output::OutputError;
use crate::spill::SpillError;
use crate::stitch::StitchError;
use crate::workspace::WorkspaceError;
use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

/// How a run ends. What each number means is part of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done; for `diff`, the files are identical.
    Done,
    /// `diff` found a difference.
    Different,
    /// A bug of this program.
    Internal,
    /// The command line asks for something that makes no sense or would destroy something.
    Usage,
    /// The input cannot be read or is not a mesh.
    BadInput,
    /// The disk, the memory or the threads do not suffice, or an output cannot be written.
    Resource,
    /// The workspace is damaged or belongs to another job.
    Workspace,
    /// Something is missing that other tasks have to do first.
    Incomplete,
    /// Stopped from outside.
    Interrupted,
}

impl Exit {
    /// The number the system sees.
    pub fn code(self) -> u8 {
        match self {
            Exit::Done => 0,
            // As in `cmp` and `diff`, a difference is 1. The two meanings do not mix: an internal error has a message.
            Exit::Different | Exit::Internal => 1,
            Exit::Usage => 2,
            Exit::BadInput => 3,
            Exit::Resource => 4,
            Exit::Workspace => 5,
            Exit::Incomplete => 6,
            // What shells report for a process that an interrupt has ended.
            Exit::Interrupted => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit.code())
    }
}

/// Why a command did not succeed.
#[derive(Debug)]
pub(super) struct Failure {
    /// How the process ends.
    pub exit: Exit,
    /// What to say, without the name of the program.
    pub message: String,
}

impl Failure {
    pub fn new(exit: Exit, message: impl Into<String>) -> Failure {
        Failure { exit, message: message.into() }
    }

    /// A failure that concerns `path`.
    pub fn about(exit: Exit, path: &Path, reason: impl Display) -> Failure {
        Failure::new(exit, format!("{}: {reason}", path.display()))
    }

    /// The same with another remark.
    pub fn and(self, remark: &str) -> Failure {
        Failure { message: format!("{}; {remark}", self.message), ..self }
    }

    /// What went wrong in a run over `input`, which the errors that concern no single file do not name.
    pub fn of_run(input: &Path, error: Error) -> Failure {
        match error {
            Error::Input(error) => error.into(),
            error @ Error::Changed { .. } => Failure::new(Exit::BadInput, error.to_string()),
            Error::Output(error) => error.into(),
            Error::Spill(error) => error.into(),
            Error::Workspace(error) => error.into(),
            error @ Error::Stopped => Failure::about(Exit::Interrupted, input, error),
            Error::Param(error) => Failure::about(Exit::Usage, input, error),
            Error::Load(error) => Failure::about(Exit::Resource, input, error),
            Error::Stitch(error) => Failure::about(Exit::Resource, input, error),
            error @ (Error::Threads(_) | Error::NoRoom { .. } | Error::NoMemory { .. }) => {
                Failure::about(Exit::Resource, input, error)
            }
            error @ Error::Internal { .. } => Failure::about(Exit::Internal, input, error),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Failure {
        match error {
            // The input is good; what it is converted into has no room.
            InputError::Spill(error) => error.into(),
            _ => Failure::new(Exit::BadInput, error.to_string()),
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Failure {
        match error {
            OutputError::Lines(StitchError::Spill(error)) => error.into(),
            OutputError::Exists { .. } | OutputError::PropertyExists { .. } => {
                Failure::new(Exit::Usage, error.to_string())
            }
            OutputError::InUse { .. } => Failure::new(Exit::Workspace, error.to_string()),
            _ if error.is_out_of_space() => Failure::new(
                Exit::Resource,
                format!("{error}; make room or write to another disk, then run again"),
            ),
            _ => Failure::new(Exit::Resource, error.to_string()),
        }
    }
}

impl From<WorkspaceError> for Failure {
    fn from(error: WorkspaceError) -> Failure {
        match &error {
            _ if error.is_out_of_space() => Failure::new(
                Exit::Resource,
                format!("{error}; make room and give the same command again: it goes on where it stopped"),
            ),
            WorkspaceError::Io { .. } => Failure::new(Exit::Resource, error.to_string()),
            WorkspaceError::Foreign { .. } | WorkspaceError::OneProcess => {
                Failure::new(Exit::Usage, error.to_string())
            }
            _ => Failure::new(Exit::Workspace, error.to_string()),
        }
    }
}

impl From<SpillError> for Failure {
    fn from(error: SpillError) -> Failure {
        let remedy =
            if error.is_out_of_space() { "; make room or choose another disk with --workspace" } else { "" };
        Failure::new(Exit::Resource, format!("{error}{remedy}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Params, Sigma};
    use crate::mesh::TileId;
    use std::io;

    fn of(error: impl Into<Error>) -> Failure {
        Failure::of_run(Path::new("scan.ply"), error.into())
    }

    #[test]
    fn numbers_do_not_change() {
        let exits = [Exit::Done, Exit::Different, Exit::Internal, Exit::Usage, Exit::BadInput];
        assert_eq!(exits.map(Exit::code), [0, 1, 1, 2, 3]);
        assert_eq!([Exit::Resource, Exit::Workspace, Exit::Incomplete].map(Exit::code), [4, 5, 6]);
        assert_eq!(Exit::Interrupted.code(), 130);
    }

    #[test]
    fn bad_input_is_3_and_names_the_file() {
        let failure = of(InputError::NotAFile { path: "scan.ply".into() });
        assert_eq!(
            (failure.exit, failure.message.as_str()),
            (Exit::BadInput, "scan.ply: not a regular file")
        );
    }

    #[test]
    fn an_input_that_changes_is_3_and_names_file_and_stage() {
        let error = InputError::Changed { path: "scan.ply".into(), reason: "it was removed".to_owned() };
        let failure = of(Error::Changed { stage: "tiles", error });
        assert_eq!(failure.exit, Exit::BadInput);
        for part in ["scan.ply: ", "it was removed", "run again", "stage `tiles`"] {
            assert!(failure.message.contains(part), "{part} is not in {failure:?}");
        }
    }

    #[test]
    fn parameters_are_2_and_name_the_file() {
        let params = Params { sigma: Sigma::Length(1.0), ..Params::default() };
        let failure = of(params.scale(10.0).expect_err("a tenth of an edge is too small"));
        assert_eq!(failure.exit, Exit::Usage);
        assert!(failure.message.starts_with("scan.ply: sigma is 0.100 median edge lengths"), "{failure:?}");
    }

    #[test]
    fn lines_that_do_not_fit_are_4_and_say_where() {
        let failure =
            of(StitchError::TooLarge { vertices: 7, near: [1.0, 2.5, -3.0], needed: 2000, memory: 1000 });
        assert_eq!(failure.exit, Exit::Resource);
        for part in ["scan.ply: 2000 bytes", "1000 are there", "near (1, 2.5, -3)", "give more memory"] {
            assert!(failure.message.contains(part), "{part} is not in {failure:?}");
        }
        let full = SpillError::Io {
            path: "t".into(),
            action: "cannot write",
            source: io::ErrorKind::StorageFull.into(),
        };
        let failure = of(OutputError::Lines(full.into()));
        assert!(failure.exit == Exit::Resource && failure.message.contains("--workspace"), "{failure:?}");
    }

    #[test]
    fn outputs_are_2_if_they_exist_and_4_otherwise() {
        assert_eq!(of(OutputError::Exists { path: "o.ply".into() }).exit, Exit::Usage);
        let failed = |kind: io::ErrorKind| {
            of(OutputError::Io { path: "o.ply".into(), action: "cannot write", source: kind.into() })
        };
        let denied = failed(io::ErrorKind::PermissionDenied);
        assert_eq!(denied.exit, Exit::Resource);
        let full = failed(io::ErrorKind::StorageFull);
        assert_eq!(full.exit, Exit::Resource);
        assert!(full.message.contains("make room") && !denied.message.contains("make room"));
    }

    #[test]
    fn temporary_files_are_4() {
        let failed = |kind: io::ErrorKind| {
            of(SpillError::Io { path: "t".into(), action: "cannot write", source: kind.into() })
        };
        assert_eq!(failed(io::ErrorKind::PermissionDenied).exit, Exit::Resource);
        let full = failed(io::ErrorKind::StorageFull);
        assert!(full.exit == Exit::Resource && full.message.contains("make room"), "{full:?}");
        let torn = of(SpillError::Corrupt { path: "t".into(), offset: 7, reason: "its checksum differs" });
        assert!(torn.exit == Exit::Resource && torn.message.contains("byte 7 is damaged"), "{torn:?}");
    }

    #[test]
    fn threads_are_4_and_bugs_are_1() {
        assert_eq!(of(Error::Threads("no".to_owned())).exit, Exit::Resource);
        let bug = of(Error::Internal { tile: TileId(7), message: "why".to_owned() });
        assert_eq!(bug.exit, Exit::Internal);
        assert_eq!(bug.message, "scan.ply: internal error in tile 7: why");
    }
}
