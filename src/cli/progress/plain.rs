//! Progress as lines for a log: one when a stage begins, one when it ends, and one every few seconds.

use super::resumed;
use super::tally::{Tallies, Tally};
use crate::cli::console::say;
use crate::cli::text::{grouped, span};
use crate::pipeline::{Event, Observer};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Rare enough not to fill a log in a run of hours.
const INTERVAL: Duration = Duration::from_secs(5);

/// Writes lines to standard error.
pub struct Plain {
    tallies: Mutex<Tallies>,
}

impl Plain {
    pub fn new() -> Plain {
        Plain { tallies: Mutex::new(Tallies::new(INTERVAL)) }
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
            say(&line(event, &tally, tally.started.elapsed()));
        }
    }
}

fn line(event: Event, tally: &Tally, elapsed: Duration) -> String {
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
            // The stage of the tiles counts tiles; saying it twice would not make it clearer.
            let unit = if unit == name { String::new() } else { format!(" {unit}") };
            format!("crease: {name} {done}/{total}{unit} ({percent:.0} %), {}{left}", span(elapsed))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Stage;

    #[test]
    fn lines_say_where_the_run_is() {
        let mut tallies = Tallies::new(Duration::ZERO);
        let mut say = |event| {
            let tally = tallies.take(event).expect("a report");
            line(event, &tally, Duration::from_secs(18))
        };
        let stage = Stage::Tiles;
        assert_eq!(say(Event::Started { stage, total: 40 }), "crease: tiles started, tiles: 40");
        assert_eq!(
            say(Event::Advanced { stage, by: 12 }),
            "crease: tiles 12/40 (30 %), 18.0 s, about 42.0 s left"
        );
        assert_eq!(
            say(Event::Finished { stage, wall: Duration::from_secs(61) }),
            "crease: tiles done, 1 min 01 s"
        );
        let stage = Stage::Scan;
        say(Event::Started { stage, total: 5000 });
        assert_eq!(
            say(Event::Advanced { stage, by: 5000 }),
            "crease: scan 5,000/5,000 faces (100 %), 18.0 s"
        );
    }
}
