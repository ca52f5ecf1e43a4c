//! A task at work: what it says of itself in a log of its own.
//!
//! In: what it is to do, and what becomes of that. Out: a file in `log/` (`docs/CLUSTER.md` has its fields).

use super::args::DetectArgs;
use super::exit::{Exit, Failure};
use super::memory::{Allocations, cpu_time, peak};
use super::planned::{PlannedJob, array};
use crate::workspace::{AttemptLog, WorkspaceError};
use serde_json::{Value, json};
use std::time::Instant;

/// This process at work.
pub(super) struct Attempt {
    log: AttemptLog,
    started: Instant,
    /// When the last thing was done.
    since: Instant,
}

impl Attempt {
    /// Begins to work on `numbers`, which are `what` ("tiles", "groups"); the name of the log starts with `name`.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn begin(
        planned: &PlannedJob,
        options: &DetectArgs,
        (name, what): (&str, &str),
        numbers: &[u32],
    ) -> Result<Attempt, Failure> {
        let attempt = planned.workspace.attempt().unwrap_or_default();
        let name = match numbers {
            [only] => format!("{name}-{only:06}"),
            [first, .., last] => format!("{name}-{first:06}-{last:06}"),
            [] => format!("{name}-none"),
        };
        let mut log = AttemptLog::begin(planned.workspace.path(), &name, attempt)?;
        let limits = options.work.limits();
        log.say(&json!({
            "event": "started", "attempt": attempt, "host": attempt.split('-').next(), "pid": std::process::id(),
            what: array(numbers.iter().copied()), "threads": limits.threads, "memory_bytes": limits.memory,
        }))?;
        let now = Instant::now();
        Ok(Attempt { log, started: now, since: now })
    }

    /// One of them is done; `more` is an object with what there is to say of it.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn done(&mut self, event: &str, number: u32, more: Value) -> Result<(), WorkspaceError> {
        let mut said =
            json!({ "event": event, event: number, "seconds": self.since.elapsed().as_secs_f64() });
        if let (Value::Object(said), Value::Object(more)) = (&mut said, more) {
            said.extend(more);
        }
        self.since = Instant::now();
        self.log.say(&said)
    }

    /// Says how it ended.
    ///
    /// # Errors
    /// If the log cannot be written; that hides no failure.
    pub fn end(mut self, outcome: &Result<Exit, Failure>, allocations: Allocations) -> Result<(), Failure> {
        let (exit, message) = match outcome {
            Ok(exit) => (*exit, None),
            Err(failure) => (failure.exit, Some(&failure.message)),
        };
        let ended = self.log.say(&json!({
            "event": "ended", "exit": exit.code(), "message": message, "seconds": self.started.elapsed().as_secs_f64(),
            "cpu_seconds": cpu_time().map(|time| time.as_secs_f64()),
            "peak_allocated_bytes": (allocations.peak)() as u64, "peak_resident_bytes": peak(),
        }));
        if outcome.is_ok() { Ok(ended?) } else { Ok(()) }
    }
}
