//! How far a stage is: events in, sums out, no more often than somebody wants to read them.

use super::meter::remaining;
use crate::pipeline::{Event, Stage};
use std::time::{Duration, Instant};

/// The stage that runs now.
#[derive(Clone, Copy, Debug)]
pub struct Tally {
    /// Which one.
    pub stage: Stage,
    /// Units that are done.
    pub done: u64,
    /// Units there are; 0 if they are not counted.
    pub total: u64,
    /// When it began.
    pub started: Instant,
    /// When it last moved, after its start.
    pub moved: Duration,
    reported: Instant,
}

/// Sums events up.
pub struct Tallies {
    /// Time between two reports of a stage that has run so long.
    interval: fn(Duration) -> Duration,
    current: Option<Tally>,
}

impl Tallies {
    pub fn new(interval: fn(Duration) -> Duration) -> Tallies {
        Tallies { interval, current: None }
    }

    /// Takes `event` and returns how far its stage is, if that should be reported now. Starts and ends always are.
    pub fn take(&mut self, event: Event) -> Option<Tally> {
        let now = Instant::now();
        match event {
            Event::Started { stage, total } => {
                self.current =
                    Some(Tally { stage, done: 0, total, started: now, moved: Duration::ZERO, reported: now });
                self.current
            }
            // Comes before the stage does.
            Event::Resumed { .. } => None,
            Event::Advanced { stage, by } => {
                let tally = self.current.as_mut().filter(|tally| tally.stage == stage)?;
                tally.done += by;
                tally.moved = now.duration_since(tally.started);
                if now.duration_since(tally.reported) < (self.interval)(tally.moved) {
                    return None;
                }
                tally.reported = now;
                Some(*tally)
            }
            Event::Grown { stage, by } => {
                let tally = self.current.as_mut().filter(|tally| tally.stage == stage)?;
                tally.total += by;
                None
            }
            Event::Finished { stage, .. } => self.current.take().filter(|tally| tally.stage == stage),
        }
    }
}

impl Tally {
    /// What is left after `elapsed`, where that says anything.
    pub fn remaining(&self, elapsed: Duration) -> Option<Duration> {
        remaining(self.done, self.total, self.moved, elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_reported_at_intervals() {
        let stage = Stage::Tiles;
        let mut rare = Tallies::new(|_| Duration::from_secs(3600));
        assert!(rare.take(Event::Advanced { stage, by: 1 }).is_none());
        assert_eq!(rare.take(Event::Started { stage, total: 9 }).expect("a start").done, 0);
        assert!(rare.take(Event::Advanced { stage, by: 2 }).is_none());
        assert!(rare.take(Event::Advanced { stage: Stage::Scan, by: 2 }).is_none());
        let end = rare.take(Event::Finished { stage, wall: Duration::ZERO }).expect("an end");
        assert_eq!((end.done, end.total), (2, 9));
        let mut often = Tallies::new(|_| Duration::ZERO);
        often.take(Event::Started { stage, total: 9 });
        assert_eq!(often.take(Event::Advanced { stage, by: 3 }).expect("a report").done, 3);
    }
}
