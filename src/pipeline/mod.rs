//! The stages joined to threads: the only place that knows of both the mathematics and the machine.

mod census;
mod certify;
mod compute;
mod events;
mod paper;
mod run;
mod seams;

pub use events::{Event, Observer, Silent, Stage};
pub use run::{Detection, Job, Work};
