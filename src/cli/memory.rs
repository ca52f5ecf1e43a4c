//! What the process uses, as the system counts it.
//!
//! In: `/proc` of Linux. Out: peak memory and processor time; nothing at all on other systems.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Keeps the largest amount of anonymous memory that was seen. What belongs to a mapped file is not counted: the system
/// takes that back when somebody needs the memory, and it keeps no peak without it. So a thread looks, from time to time.
pub(super) struct MemoryMeter {
    seen: Arc<Seen>,
    watcher: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Seen {
    largest: AtomicU64,
    over: AtomicBool,
}

/// A look costs some tens of microseconds; the arrays of a tile live longer than this.
const INTERVAL: Duration = Duration::from_millis(20);

impl MemoryMeter {
    /// Begins to watch.
    pub fn start() -> MemoryMeter {
        let seen = Arc::new(Seen::default());
        let for_thread = Arc::clone(&seen);
        let watch = move || {
            while !for_thread.over.load(Ordering::Relaxed) {
                for_thread.look();
                std::thread::park_timeout(INTERVAL);
            }
        };
        // Without a thread there is one look, at the end: worth a wrong number in the summary, not a failed run.
        let watcher = std::thread::Builder::new().name("crease-memory".into()).spawn(watch).ok();
        MemoryMeter { seen, watcher }
    }

    /// The most that was seen, in bytes.
    pub fn largest(&self) -> Option<u64> {
        self.seen.look();
        Some(self.seen.largest.load(Ordering::Relaxed)).filter(|&bytes| bytes > 0)
    }
}

impl Seen {
    fn look(&self) {
        if let Some(bytes) = status_field("RssAnon") {
            self.largest.fetch_max(bytes, Ordering::Relaxed);
        }
    }
}

impl Drop for MemoryMeter {
    fn drop(&mut self) {
        self.seen.over.store(true, Ordering::Relaxed);
        if let Some(watcher) = self.watcher.take() {
            watcher.thread().unpark();
            // It ends by itself; that it panicked would be of no consequence here.
            let _ = watcher.join();
        }
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
