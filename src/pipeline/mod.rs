//! The stages joined to threads: the only place that knows of both the mathematics and the machine.

mod admit;
mod budget;
mod census;
mod certify;
mod compute;
mod events;
mod groups;
mod guess;
mod ledger;
mod order;
mod outlook;
mod paper;
mod pass;
mod planned;
mod prepare;
mod probe;
mod run;
mod seams;
mod sizing;
mod stop;
mod tasks;
mod waits;

pub use events::{Event, Observer, Silent, Stage};
pub use groups::StitchedGroup;
pub use guess::Calibration;
pub use outlook::{Laid, MOST_GROUPS, STITCH_SECONDS_PER_FACE, TileOutlook, group_tiles};
pub use planned::Planned;
pub use run::{Detection, Job, Work};
pub use tasks::TileDone;
pub use waits::Waits;
