//! The stages joined to threads: the only place that knows of both the mathematics and the machine.

mod events;
mod run;
mod tile;

pub use events::{Event, Observer, Silent, Stage};
pub use run::{Detection, Job, Work};
