//! Progress as a bar on a terminal: stage, share, speed and what is left.

use super::resumed;
use crate::cli::console::say;
use crate::pipeline::{Event, Observer, Stage};
use indicatif::{
    HumanDuration, ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle,
};
use std::fmt::Write;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// So often the clock moves on when nothing else does.
const TICK: Duration = Duration::from_millis(200);

/// One bar for one stage after the other. It is gone when the run is over, be it by an error.
pub struct Bar {
    current: Mutex<Option<ProgressBar>>,
}

impl Bar {
    pub fn new() -> Bar {
        Bar { current: Mutex::new(None) }
    }
}

impl Observer for Bar {
    fn event(&self, event: Event) {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Resumed { done, total, .. } => say(&resumed(done, total)),
            Event::Started { stage, total } => *current = Some(begin(stage, total)),
            Event::Advanced { by, .. } => {
                if let Some(bar) = &*current {
                    bar.inc(by);
                }
            }
            Event::Grown { by, .. } => {
                if let Some(bar) = &*current {
                    bar.inc_length(by);
                }
            }
            Event::Finished { .. } => *current = None,
        }
    }
}

fn begin(stage: Stage, total: u64) -> ProgressBar {
    let name = stage.name();
    let bar = match stage {
        // Stitching does not report on the way, and writing is over before a bar says much.
        Stage::Stitch | Stage::Write => ProgressBar::new_spinner(),
        Stage::Convert | Stage::Order | Stage::Scan | Stage::Survey | Stage::Tiles => ProgressBar::new(total),
    };
    bar.set_draw_target(ProgressDrawTarget::stderr());
    let template = match stage {
        Stage::Stitch | Stage::Write => "{prefix:>7} {spinner} {elapsed}",
        Stage::Convert => {
            "{prefix:>7} [{bar:30}] {percent:>3} %  {bytes}/{total_bytes}, {bytes_per_sec}{left}"
        }
        Stage::Order | Stage::Scan => {
            "{prefix:>7} [{bar:30}] {percent:>3} %  {human_pos}/{human_len} faces, {per_sec}{left}"
        }
        Stage::Survey | Stage::Tiles => {
            "{prefix:>7} [{bar:30}] {percent:>3} %  {human_pos}/{human_len}, {elapsed}{left}"
        }
    };
    // The templates are fixed; one that were wrong would cost the looks and nothing else.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> ").with_key("left", left));
    }
    let bar = bar.with_prefix(name).with_finish(ProgressFinish::AndClear);
    bar.enable_steady_tick(TICK);
    bar
}

/// What is left, as soon as there is something to reckon it from.
fn left(state: &ProgressState, out: &mut dyn Write) {
    if state.pos() > 0 {
        // A bar that cannot be drawn is no reason to stop.
        let _ = write!(out, ", {:#} left", HumanDuration(state.eta()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_follows_the_stages() {
        let bar = Bar::new();
        use Stage::{Convert, Order, Scan, Stitch, Survey, Tiles, Write};
        for stage in [Convert, Order, Scan, Survey, Tiles, Stitch, Write] {
            bar.event(Event::Started { stage, total: 3 });
            bar.event(Event::Advanced { stage, by: 2 });
            let position = bar.current.lock().expect("not poisoned").as_ref().map(ProgressBar::position);
            assert_eq!(position, Some(2));
            bar.event(Event::Finished { stage, wall: Duration::ZERO });
            assert!(bar.current.lock().expect("not poisoned").is_none());
        }
    }
}
