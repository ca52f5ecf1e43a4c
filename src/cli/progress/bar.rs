//! Progress as one line on a terminal: stage, share, count, speed, what is left, and memory.

use super::meter::{Memory, rate, remaining};
use super::resumed;
use crate::cli::colour;
use crate::cli::console::{say, show_bar};
use crate::cli::text::span;
use crate::pipeline::{Event, Observer, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// So often the clock moves on when nothing else does. More often the numbers flicker.
const TICK: Duration = Duration::from_millis(200);

/// One bar for one stage after the other. It is gone when the run is over, be it by an error.
pub struct Bar {
    memory: Memory,
    current: Mutex<Option<Shown>>,
}

/// The bar of a stage.
struct Shown {
    bar: ProgressBar,
    /// When it last moved, in milliseconds after its start.
    moved: Arc<AtomicU64>,
}

impl Bar {
    pub fn new(memory: Memory) -> Bar {
        Bar { memory, current: Mutex::new(None) }
    }
}

impl Observer for Bar {
    fn event(&self, event: Event) {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Resumed { done, total, .. } => say(&resumed(done, total)),
            Event::Started { stage, total } => {
                let shown = begin(stage, total, self.memory);
                show_bar(Some(shown.bar.clone()));
                *current = Some(shown);
            }
            Event::Advanced { by, .. } => {
                if let Some(Shown { bar, moved }) = &*current {
                    moved.store(bar.elapsed().as_millis() as u64, Ordering::Relaxed);
                    bar.inc(by);
                }
            }
            Event::Grown { by, .. } => {
                if let Some(Shown { bar, .. }) = &*current {
                    bar.inc_length(by);
                }
            }
            Event::Finished { .. } => {
                show_bar(None);
                *current = None;
            }
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        show_bar(None);
    }
}

/// Whether a stage says on its way how far it is. Stitching and writing do not, and a single tile is either done or not.
fn is_counted(stage: Stage, total: u64) -> bool {
    match stage {
        Stage::Stitch | Stage::Write => false,
        Stage::Survey | Stage::Tiles => total > 1,
        Stage::Convert | Stage::Order | Stage::Scan => true,
    }
}

fn begin(stage: Stage, total: u64, memory: Memory) -> Shown {
    let counted = is_counted(stage, total);
    let bar = if counted { ProgressBar::new(total) } else { ProgressBar::new_spinner() };
    bar.set_draw_target(ProgressDrawTarget::stderr());
    let count = match stage {
        Stage::Convert => "{bytes}/{total_bytes}",
        _ => "{human_pos}/{human_len} {unit}",
    };
    let (name, filled) = match colour::wanted(&std::io::stderr()) {
        true => ("{prefix:>7.bold}", "{wide_bar:.cyan}"),
        false => ("{prefix:>7}", "{wide_bar}"),
    };
    let template = match counted {
        true => format!("{name} {filled} {{percent:>3}} %  {count}{{rate}}{{left}}, {{memory}}"),
        false => format!("{name} {{spinner}} {{what}}{{clock}}, {{memory}}"),
    };
    let moved = Arc::new(AtomicU64::new(0));
    // The templates are fixed; one that were wrong would cost the looks and nothing else.
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(keys(style, stage, memory, Arc::clone(&moved)).progress_chars("━━ "));
    }
    let bar = bar.with_prefix(stage.name());
    bar.enable_steady_tick(TICK);
    Shown { bar, moved }
}

/// The parts of the line that are made here. That one cannot be drawn is no reason to stop.
fn keys(style: ProgressStyle, stage: Stage, memory: Memory, moved: Arc<AtomicU64>) -> ProgressStyle {
    let unit = stage.unit();
    // The speed is that up to the last move: the clock alone does not make it slower.
    let at = move || Duration::from_millis(moved.load(Ordering::Relaxed));
    let since = at.clone();
    let left = move |state: &ProgressState, out: &mut dyn Write| {
        let at = since();
        if let Some(left) = remaining(state.pos(), state.len().unwrap_or(0), at, state.elapsed()) {
            let _ = write!(out, ", {} left", span(left));
        }
    };
    style
        .with_key("unit", move |_: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(unit);
        })
        .with_key("what", move |_: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(if unit == "tiles" { "the whole mesh as one tile, " } else { "" });
        })
        .with_key("clock", |state: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(&span(state.elapsed()));
        })
        .with_key("rate", move |state: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(&rate(unit, state.pos(), at()));
        })
        .with_key("left", left)
        .with_key("memory", move |_: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(&memory.text());
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::memory::Allocations;
    use crate::config::NO_LIMIT;

    #[test]
    fn a_bar_follows_the_stages() {
        let allocations = Allocations { now: || 1, peak: || 1 };
        let bar = Bar::new(Memory { allocations, allowed: NO_LIMIT });
        use Stage::{Convert, Order, Scan, Stitch, Survey, Tiles, Write};
        let position = |bar: &Bar| {
            let current = bar.current.lock().expect("not poisoned");
            current.as_ref().map(|shown| shown.bar.position())
        };
        for stage in [Convert, Order, Scan, Survey, Tiles, Stitch, Write] {
            bar.event(Event::Started { stage, total: 3 });
            bar.event(Event::Advanced { stage, by: 2 });
            assert_eq!(position(&bar), Some(2));
            bar.event(Event::Finished { stage, wall: Duration::ZERO });
            assert_eq!(position(&bar), None);
        }
    }

    #[test]
    fn what_is_not_counted_has_no_share() {
        assert!(is_counted(Stage::Tiles, 2) && is_counted(Stage::Scan, 1));
        assert!(!is_counted(Stage::Tiles, 1) && !is_counted(Stage::Stitch, 100));
    }
}
