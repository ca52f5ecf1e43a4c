//! Progress as lines for a log: one when a stage begins, one when it ends, and one every few seconds, later every minute.

use super::meter::{Memory, rate};
use super::resumed;
use super::tally::{Tallies, Tally};
use crate::cli::console::say;
use crate::cli::text::{grouped, span};
use crate::pipeline::{Event, Observer};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Time between two lines of a stage: five seconds while somebody may be waiting, and a twentieth of the time so far when
/// nobody is any more, but no more than a minute, so that a log tells a slow run from one that hangs.
fn interval(elapsed: Duration) -> Duration {
    (elapsed / 20).clamp(Duration::from_secs(5), Duration::from_secs(60))
}

/// Writes lines to standard error.
pub struct Plain {
    memory: Memory,
    tallies: Mutex<Tallies>,
}

impl Plain {
    pub fn new(memory: Memory) -> Plain {
        Plain { memory, tallies: Mutex::new(Tallies::new(interval)) }
    }
}

impl Observer for Plain {
    fn event(&self, event: Event) {
        let mut tallies = self.tallies.lock().unwrap_or_else(PoisonError::into_inner);
        if let Event::Resumed { done, total, .. } = event {
            say(&resumed(done, total));
        }
        if let Some(tally) = tallies.take(event) {
            // Still under the lock, so that lines come in the order of what they say.
            say(&line(event, &tally, tally.started.elapsed(), &self.memory.text()));
        }
    }
}

fn line(event: Event, tally: &Tally, elapsed: Duration, memory: &str) -> String {
    let (name, unit) = (tally.stage.name(), tally.stage.unit());
    match event {
        Event::Started { total, .. } if total > 0 => {
            format!("crease: {name} started, {unit}: {}", grouped(total))
        }
        Event::Started { .. } => format!("crease: {name} started"),
        Event::Finished { wall, .. } => format!("crease: {name} done, {}", span(wall)),
        Event::Resumed { done, total, .. } => resumed(done, total),
        Event::Advanced { .. } | Event::Grown { .. } => {
            let percent = 100.0 * tally.done as f64 / tally.total.max(1) as f64;
            let left =
                tally.remaining(elapsed).map_or(String::new(), |t| format!(", about {} left", span(t)));
            let (done, total) = (grouped(tally.done), grouped(tally.total));
            let rate = rate(unit, tally.done, tally.moved);
            // The stage of the tiles counts tiles; saying it twice would not make it clearer.
            let unit = if unit == name { String::new() } else { format!(" {unit}") };
            format!(
                "crease: {name} {done}/{total}{unit} ({percent:.0} %), {}{rate}{left}, {memory}",
                span(elapsed)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Stage;

    #[test]
    fn lines_say_where_the_run_is() {
        let mut tallies = Tallies::new(|_| Duration::ZERO);
        let elapsed = Duration::from_secs(18);
        let mut say = |event| {
            let mut tally = tallies.take(event).expect("a report");
            tally.moved = elapsed;
            line(event, &tally, elapsed, "30 MB of 1.0 GB")
        };
        let stage = Stage::Tiles;
        assert_eq!(say(Event::Started { stage, total: 40 }), "crease: tiles started, tiles: 40");
        assert_eq!(
            say(Event::Advanced { stage, by: 12 }),
            "crease: tiles 12/40 (30 %), 18.0 s, 1.50 s each, about 42.0 s left, 30 MB of 1.0 GB"
        );
        assert_eq!(
            say(Event::Finished { stage, wall: Duration::from_secs(61) }),
            "crease: tiles done, 1 min 01 s"
        );
        let stage = Stage::Scan;
        say(Event::Started { stage, total: 5000 });
        assert_eq!(
            say(Event::Advanced { stage, by: 5000 }),
            "crease: scan 5,000/5,000 faces (100 %), 18.0 s, 277.8 faces/s, 30 MB of 1.0 GB"
        );
    }

    #[test]
    fn lines_become_rare() {
        let after = |seconds| interval(Duration::from_secs(seconds)).as_secs();
        assert_eq!([0, 100, 600, 86_400].map(after), [5, 5, 30, 60]);
    }
}
