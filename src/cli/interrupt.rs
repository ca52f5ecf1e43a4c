//! What happens when somebody wants the run to end: INT (Ctrl-C) and TERM.
//!
//! The first one sets a flag, which the run looks at between tiles and between blocks; it then ends in good order. Where that
//! takes too long, in the middle of a large tile or of a sort, the process leaves without it. That is safe at any instant,
//! as a kill is: what is kept was kept before, and all else is under names that nobody takes for a result. The committer
//! is given a moment to let go of the disk first. A second signal ends the process at once.

use super::console::{say, show_bar};
use super::exit::Exit;
use crate::workspace::Workspace;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::{Handle, Signals};
use signal_hook::low_level;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long the run may take to end in good order. Two seconds are promised for all.
const GRACE: Duration = Duration::from_millis(1200);
/// How long the committer may take to let go of the disk.
const LAST_WRITE: Duration = Duration::from_millis(300);
/// How long removing what is of no use may take.
const LAST_REMOVAL: Duration = Duration::from_millis(300);

/// Watches for signals as long as it exists.
pub(super) struct Interrupts {
    shared: Arc<Shared>,
    handle: Handle,
}

struct Shared {
    stop: AtomicBool,
    /// Whether somebody has begun to end the process.
    ending: AtomicBool,
    workspace: Workspace,
    /// What is of no use to anybody when the process ends.
    parts: Vec<PathBuf>,
    /// How to go on, for a shell.
    command: String,
}

impl Interrupts {
    /// Begins to watch over a run that keeps its work in `workspace`, writes `parts`, and was started by `words`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn watch(workspace: &Workspace, parts: Vec<PathBuf>, words: &[OsString]) -> io::Result<Interrupts> {
        let shared = Arc::new(Shared {
            stop: AtomicBool::new(false),
            ending: AtomicBool::new(false),
            workspace: workspace.clone(),
            parts,
            command: command_line(words),
        });
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let handle = signals.handle();
        let for_thread = Arc::clone(&shared);
        let watch = move || {
            for _ in signals.forever() {
                if for_thread.stop.swap(true, Ordering::Relaxed) {
                    end_process();
                }
                let shared = Arc::clone(&for_thread);
                let last = std::thread::Builder::new().name("crease-last".into()).spawn(move || {
                    std::thread::sleep(GRACE);
                    shared.leave();
                });
                if last.is_err() {
                    for_thread.leave();
                }
            }
        };
        std::thread::Builder::new().name("crease-signals".into()).spawn(watch)?;
        Ok(Interrupts { shared, handle })
    }

    /// The flag that is set by the first signal.
    pub fn flag(&self) -> &AtomicBool {
        &self.shared.stop
    }

    /// From now on the process ends in its own way. Does not return if it is being ended already.
    pub fn claim_end(&self) {
        while self.shared.ending.swap(true, Ordering::Relaxed) {
            std::thread::park();
        }
    }

    /// Says what was kept, and how to go on.
    pub fn report(&self) -> Exit {
        self.shared.report();
        Exit::Interrupted
    }
}

impl Drop for Interrupts {
    fn drop(&mut self) {
        self.handle.close();
    }
}

impl Shared {
    /// Ends the process without the run, unless that has ended by itself.
    fn leave(&self) {
        if self.ending.swap(true, Ordering::Relaxed) {
            return;
        }
        let kept = self.workspace.is_worth_keeping();
        self.report();
        if kept {
            // First, so that no part is made after it was removed.
            self.workspace.freeze(LAST_WRITE);
        }
        for part in &self.parts {
            // Most of them are not there.
            let _ = fs::remove_file(part);
        }
        if !kept {
            let workspace = self.workspace.clone();
            // What is not removed in time, the next run or `crease clean` removes.
            let removal = std::thread::Builder::new().spawn(move || workspace.remove());
            let started = Instant::now();
            while removal.as_ref().is_ok_and(|r| !r.is_finished()) && started.elapsed() < LAST_REMOVAL {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        end_process();
    }

    fn report(&self) {
        // Nobody else takes it off the terminal any more.
        show_bar(None);
        let (command, path) = (&self.command, self.workspace.path().display());
        match self.workspace.counted().filter(|_| self.workspace.is_worth_keeping()) {
            Some((done, total)) => {
                say(&format!("crease: interrupted; {done} of {total} tiles are done and kept in {path}"));
                say(&format!("crease: to go on: {command}"));
            }
            None => {
                say("crease: interrupted; nothing was kept");
                say(&format!("crease: to start again: {command}"));
            }
        }
    }
}

/// At once, whatever the other threads are doing. Nothing of ours is to be run at the end of the process.
fn end_process() -> ! {
    low_level::exit(Exit::Interrupted.code().into())
}

/// `words` as a shell understands them.
fn command_line(words: &[OsString]) -> String {
    let quoted = |word: &OsStr| {
        let text = word.to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+,:@%".contains(c);
        match text.chars().all(plain) && !text.is_empty() {
            true => text.into_owned(),
            false => format!("'{}'", text.replace('\'', r"'\''")),
        }
    };
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_pasted() {
        let words = ["crease", "detect", "my scan.ply", "--sigma-edges=3", "it's", ""].map(OsString::from);
        assert_eq!(command_line(&words), r"crease detect 'my scan.ply' --sigma-edges=3 'it'\''s' ''");
    }
}
