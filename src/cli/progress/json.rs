//! Progress for programs: one JSON object on each line.
//!
//! `event` is `resumed`, `started`, `advanced` or `finished`, `stage` one of `convert`, `order`, `scan`, `survey`, `tiles`,
//! `stitch`, `write`. `done` and `total` count what `unit` says, since the start of the stage; a `total` of 0 means that it is
//! not known. `seconds` is the time since the stage began, `remaining_seconds` what is left of it, or null, `allocated_bytes`
//! what is allocated now and `allowed_bytes` what may be, or null. `resumed` comes before `started` if some tiles were done by
//! an earlier run. Advances are summed up, so that there are at most ten lines a second.

use super::meter::Memory;
use super::tally::Tallies;
use crate::cli::console::say;
use crate::config::NO_LIMIT;
use crate::pipeline::{Event, Observer, Stage};
use serde::Serialize;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

const INTERVAL: Duration = Duration::from_millis(100);

/// Writes objects to standard error.
pub struct Json {
    memory: Memory,
    tallies: Mutex<Tallies>,
}

#[derive(Serialize)]
struct Report {
    event: &'static str,
    stage: Stage,
    unit: &'static str,
    done: u64,
    total: u64,
    seconds: f64,
    remaining_seconds: Option<f64>,
    allocated_bytes: u64,
    allowed_bytes: Option<u64>,
}

impl Json {
    pub fn new(memory: Memory) -> Json {
        Json { memory, tallies: Mutex::new(Tallies::new(|_| INTERVAL)) }
    }

    fn report(&self, event: &'static str, stage: Stage, (done, total): (u64, u64)) -> Report {
        Report {
            event,
            stage,
            unit: stage.unit(),
            done,
            total,
            seconds: 0.0,
            remaining_seconds: None,
            allocated_bytes: self.memory.now(),
            allowed_bytes: Some(self.memory.allowed).filter(|bytes| *bytes != NO_LIMIT),
        }
    }
}

/// Under the lock, so that lines come in the order of what they say.
fn report(report: &Report) {
    if let Ok(line) = serde_json::to_string(report) {
        say(&line);
    }
}

impl Observer for Json {
    fn event(&self, event: Event) {
        let mut tallies = self.tallies.lock().unwrap_or_else(PoisonError::into_inner);
        if let Event::Resumed { stage, done, total } = event {
            report(&self.report("resumed", stage, (done, total)));
        }
        let Some(tally) = tallies.take(event) else { return };
        let (event, elapsed) = match event {
            Event::Resumed { .. } => return,
            Event::Started { .. } => ("started", Duration::ZERO),
            Event::Advanced { .. } | Event::Grown { .. } => ("advanced", tally.started.elapsed()),
            Event::Finished { wall, .. } => ("finished", wall),
        };
        report(&Report {
            seconds: elapsed.as_secs_f64(),
            remaining_seconds: tally.remaining(elapsed).map(|left| left.as_secs_f64()),
            ..self.report(event, tally.stage, (tally.done, tally.total))
        });
    }
}
