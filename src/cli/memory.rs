//! What the process uses, as the system counts it.
//!
//! In: `/proc` of Linux. Out: peak memory and processor time; nothing at all on other systems.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Keeps the largest amount of anonymous memory that was seen. What belongs to a mapped file is not counted: the system
/// takes that back when somebody needs the memory.
#[derive(Default)]
pub(super) struct MemoryMeter {
    largest: AtomicU64,
}

impl MemoryMeter {
    /// Looks once more. Costs some tens of microseconds.
    pub fn sample(&self) {
        if let Some(bytes) = status_field("RssAnon") {
            self.largest.fetch_max(bytes, Ordering::Relaxed);
        }
    }

    /// The most that was seen, in bytes.
    pub fn largest(&self) -> Option<u64> {
        Some(self.largest.load(Ordering::Relaxed)).filter(|&bytes| bytes > 0)
    }
}

/// The most physical memory this process ever had, in bytes, mapped files included.
pub(super) fn peak() -> Option<u64> {
    status_field("VmHWM")
}

/// Processor time of all threads up to now.
pub(super) fn cpu_time() -> Option<Duration> {
    cpu_ticks(&std::fs::read_to_string("/proc/self/stat").ok()?)
        .map(|ticks| Duration::from_millis(10 * ticks))
}

fn status_field(name: &str) -> Option<u64> {
    field_of(&std::fs::read_to_string("/proc/self/status").ok()?, name)
}

/// A line `Name:   123 kB`, in bytes.
fn field_of(status: &str, name: &str) -> Option<u64> {
    let value = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    value.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// User and system time: fields 14 and 15, in hundredths of a second. Field 2, the name of the program in brackets, may
/// contain anything, so counting starts behind its last bracket.
fn cpu_ticks(stat: &str) -> Option<u64> {
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(11);
    let user: u64 = fields.next()?.parse().ok()?;
    let system: u64 = fields.next()?.parse().ok()?;
    Some(user + system)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_by_their_whole_name() {
        let status = "Name:\tcrease\nVmHWMx:\t 1 kB\nVmHWM:\t   5120 kB\nRssAnon:\t     12 kB\n";
        assert_eq!(field_of(status, "VmHWM"), Some(5120 * 1024));
        assert_eq!(field_of(status, "RssAnon"), Some(12 * 1024));
        assert_eq!(field_of(status, "RssFile"), None);
    }

    #[test]
    fn times_are_found_behind_odd_names() {
        let stat = "42 (a) b (c)) S 1 2 3 4 5 6 7 8 9 10 150 25 0 0 20";
        assert_eq!(cpu_ticks(stat), Some(175));
        assert_eq!(cpu_ticks("42 (x"), None);
    }
}
