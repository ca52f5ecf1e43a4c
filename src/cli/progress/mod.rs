//! Progress on standard error, in the form that suits whoever watches.
//!
//! In: the events of a run, from several threads. Out: a bar, lines for a log file, or JSON for a program; and the memory
//! that was in use meanwhile.

mod bar;
mod json;
mod meter;
mod plain;
mod tally;

use super::args::ProgressKind;
use super::bus_error;
use super::memory::{Allocations, MemoryMeter, StageUse};
use super::text::{counted, grouped};
use crate::pipeline::{Event, Observer, Silent};
use meter::Memory;
use std::io::IsTerminal;

/// Shows progress and watches the memory.
pub(super) struct Progress {
    shown: Box<dyn Observer>,
    memory: MemoryMeter,
}

impl Progress {
    /// In the form of `kind`, of a run that may allocate so many bytes.
    pub fn new(kind: ProgressKind, allocations: Allocations, allowed: u64) -> Progress {
        let memory = Memory { allocations, allowed };
        Progress { shown: observer(kind, memory), memory: MemoryMeter::start(allocations) }
    }

    /// The most anonymous memory that was seen, in bytes.
    pub fn anonymous(&self) -> Option<u64> {
        self.memory.anonymous()
    }

    /// The most that was allocated, in bytes.
    pub fn allocated(&self) -> u64 {
        self.memory.allocated()
    }

    /// What each stage used that is over.
    pub fn stages(&self) -> Vec<StageUse> {
        self.memory.stages()
    }
}

impl Observer for Progress {
    fn event(&self, event: Event) {
        match event {
            Event::Started { stage, .. } => {
                self.memory.enter(stage);
                bus_error::enter(stage);
            }
            Event::Finished { .. } => self.memory.leave(),
            Event::Resumed { .. } | Event::Advanced { .. } | Event::Grown { .. } => {}
        }
        self.shown.event(event);
    }
}

/// That some tiles were done by an earlier run.
fn resumed(done: u64, total: u64) -> String {
    format!("crease: resumed: {} of {} were done", grouped(done), counted(total, "tile", "tiles"))
}

fn observer(kind: ProgressKind, memory: Memory) -> Box<dyn Observer> {
    match kind {
        ProgressKind::None => Box::new(Silent),
        ProgressKind::Json => Box::new(json::Json::new(memory)),
        ProgressKind::Bar => Box::new(bar::Bar::new(memory)),
        ProgressKind::Auto if std::io::stderr().is_terminal() => Box::new(bar::Bar::new(memory)),
        ProgressKind::Auto | ProgressKind::Plain => Box::new(plain::Plain::new(memory)),
    }
}
