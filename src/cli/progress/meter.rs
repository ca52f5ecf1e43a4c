//! What bars, lines and JSON say in common: what is left, how fast it goes, what is allocated.

use crate::cli::memory::Allocations;
use crate::cli::text::{bytes, measure, span};
use crate::config::NO_LIMIT;
use std::time::Duration;

/// Before that a speed says nothing.
const TOO_SOON: Duration = Duration::from_secs(1);

/// What is left after `done` of `total` units were done in the time `at`, when `elapsed` has passed: at the mean speed so
/// far, and counting down while the next unit is being worked on. `None` where that says nothing.
pub fn remaining(done: u64, total: u64, at: Duration, elapsed: Duration) -> Option<Duration> {
    if done == 0 || done >= total || elapsed < TOO_SOON {
        return None;
    }
    let whole = at.as_secs_f64() * total as f64 / done as f64;
    Duration::try_from_secs_f64(whole).ok().map(|whole| whole.saturating_sub(elapsed))
}

/// The mean speed of `done` units in the time `at`, in words: `, 3.2 MB/s`, `, 4.100 tiles/s`, `, 12.3 s each`.
pub fn rate(unit: &str, done: u64, at: Duration) -> String {
    if done == 0 || at < TOO_SOON {
        return String::new();
    }
    let seconds = at.as_secs_f64();
    let per_second = done as f64 / seconds;
    match unit {
        "bytes" => format!(", {}/s", bytes(per_second as u64)),
        _ if per_second >= 1e6 => format!(", {} million {unit}/s", measure(per_second / 1e6)),
        _ if per_second >= 1.0 => format!(", {} {unit}/s", measure(per_second)),
        _ => format!(", {} each", span(Duration::from_secs_f64(seconds / done as f64))),
    }
}

/// Memory, now.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    pub allocations: Allocations,
    /// Bytes that may be allocated.
    pub allowed: u64,
}

impl Memory {
    /// Bytes that are allocated.
    pub fn now(&self) -> u64 {
        (self.allocations.now)() as u64
    }

    /// `1.2 GB of 4.0 GB`.
    pub fn text(&self) -> String {
        match self.allowed {
            NO_LIMIT => bytes(self.now()),
            allowed => format!("{} of {}", bytes(self.now()), bytes(allowed)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_remains_is_proportional_and_counts_down() {
        let left = |done, at, elapsed| {
            remaining(done, 40, Duration::from_secs(at), Duration::from_secs(elapsed)).map(|t| t.as_secs())
        };
        assert_eq!(left(10, 20, 20), Some(60));
        assert_eq!(left(10, 20, 25), Some(55));
        assert_eq!(left(10, 20, 500), Some(0));
        assert_eq!([left(0, 0, 20), left(41, 20, 20), left(10, 0, 0)], [None; 3]);
    }

    #[test]
    fn speeds_have_fitting_units() {
        let at = Duration::from_secs(10);
        assert_eq!(rate("bytes", 32_000_000, at), ", 3.2 MB/s");
        assert_eq!(rate("faces", 32_000_000, at), ", 3.200 million faces/s");
        assert_eq!(rate("tiles", 41, at), ", 4.100 tiles/s");
        assert_eq!(rate("tiles", 4, at), ", 2.50 s each");
        assert_eq!(rate("tiles", 0, at), "");
    }

    #[test]
    fn memory_is_named_with_its_bound() {
        let allocations = Allocations { now: || 1_200_000_000, peak: || 2_000_000_000 };
        let text = |allowed| Memory { allocations, allowed }.text();
        assert_eq!([text(4_000_000_000), text(NO_LIMIT)], ["1.2 GB of 4.0 GB", "1.2 GB"]);
    }
}
