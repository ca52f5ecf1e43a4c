//! What the process uses.
//!
//! In: what the allocator has counted, and `/proc` of Linux. Out: peak memory and processor time; on other systems only
//! what was allocated.

use crate::pipeline::Stage;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the allocator of the process has handed out, in bytes.
#[derive(Clone, Copy, Debug)]
pub struct Allocations {
    /// Now.
    pub now: fn() -> usize,
    /// At the peak so far.
    pub peak: fn() -> usize,
}

/// What one stage of a run used.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageUse {
    /// Which stage.
    pub stage: Stage,
    /// Processor time of all threads.
    pub cpu: Option<Duration>,
    /// Bytes that came from the disk.
    pub read: Option<u64>,
    /// Bytes that were written.
    pub written: Option<u64>,
    /// The most that was seen allocated at a time.
    pub allocated: u64,
}

/// Watches what is allocated, and how much anonymous memory the process has. What belongs to a mapped file is not counted:
/// the system takes that back when somebody needs the memory. The system keeps no peak without it, and the allocator none
/// for a stage of the run. So a thread looks, from time to time.
pub(super) struct MemoryMeter {
    seen: Arc<Seen>,
    watcher: Option<JoinHandle<()>>,
}

struct Seen {
    allocations: Allocations,
    /// Largest anonymous memory.
    anonymous: AtomicU64,
    /// Most that was allocated in the stage that runs.
    allocated: AtomicU64,
    stages: Mutex<Vec<StageUse>>,
    over: AtomicBool,
}

/// Asking for what is allocated costs next to nothing, and some arrays of a tile do not live longer than this.
const INTERVAL: Duration = Duration::from_millis(2);
/// Asking the system costs some tens of microseconds: not each time.
const ASK_SYSTEM: u32 = 10;

impl MemoryMeter {
    /// Begins to watch.
    pub fn start(allocations: Allocations) -> MemoryMeter {
        let seen = Arc::new(Seen {
            allocations,
            anonymous: AtomicU64::new(0),
            allocated: AtomicU64::new(0),
            stages: Mutex::new(Vec::new()),
            over: AtomicBool::new(false),
        });
        let for_thread = Arc::clone(&seen);
        let watch = move || {
            let mut looks = 0u32;
            while !for_thread.over.load(Ordering::Relaxed) {
                for_thread.look(looks.is_multiple_of(ASK_SYSTEM));
                looks = looks.wrapping_add(1);
                std::thread::park_timeout(INTERVAL);
            }
        };
        // Without a thread there is one look, at the end: worth a wrong number in the summary, not a failed run.
        let watcher = std::thread::Builder::new().name("crease-memory".into()).spawn(watch).ok();
        MemoryMeter { seen, watcher }
    }

    /// The most anonymous memory that was seen, in bytes.
    pub fn anonymous(&self) -> Option<u64> {
        self.seen.look(true);
        Some(self.seen.anonymous.load(Ordering::Relaxed)).filter(|&bytes| bytes > 0)
    }

    /// The most that was ever allocated, in bytes; exact.
    pub fn allocated(&self) -> u64 {
        (self.seen.allocations.peak)() as u64
    }

    /// A stage begins.
    pub fn enter(&self, stage: Stage) {
        self.seen.allocated.store(0, Ordering::Relaxed);
        self.seen.look(false);
        // What was used up to now, for the difference at the end.
        let [read, written] = io_counts();
        let begun = StageUse { stage, cpu: cpu_time(), read, written, allocated: 0 };
        self.seen.stages.lock().unwrap_or_else(PoisonError::into_inner).push(begun);
    }

    /// The stage is over.
    pub fn leave(&self) {
        self.seen.look(false);
        let allocated = self.seen.allocated.load(Ordering::Relaxed);
        let [read, written] = io_counts();
        if let Some(last) = self.seen.stages.lock().unwrap_or_else(PoisonError::into_inner).last_mut() {
            let since = |now: Option<u64>, before: Option<u64>| Some(now?.saturating_sub(before?));
            *last = StageUse {
                cpu: cpu_time().and_then(|now| Some(now.saturating_sub(last.cpu?))),
                read: since(read, last.read),
                written: since(written, last.written),
                allocated,
                ..*last
            };
        }
    }

    /// What each stage used that is over.
    pub fn stages(&self) -> Vec<StageUse> {
        self.seen.stages.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Seen {
    fn look(&self, at_system: bool) {
        self.allocated.fetch_max((self.allocations.now)() as u64, Ordering::Relaxed);
        if at_system && let Some(bytes) = status_field("RssAnon") {
            self.anonymous.fetch_max(bytes, Ordering::Relaxed);
        }
    }
}

/// Bytes that this process fetched from disks and handed over to be written.
fn io_counts() -> [Option<u64>; 2] {
    let counts = std::fs::read_to_string("/proc/self/io").unwrap_or_default();
    ["read_bytes", "write_bytes"].map(|name| count_of(&counts, name))
}

/// A line `name: 123`.
fn count_of(counts: &str, name: &str) -> Option<u64> {
    value_of(counts, name)?.parse().ok()
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
pub(super) fn field_of(status: &str, name: &str) -> Option<u64> {
    value_of(status, name)?.strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// What stands behind `name:`.
fn value_of<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':')).map(str::trim)
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
    fn counts_are_found_by_their_whole_name() {
        let counts = "rchar: 5\nread_bytes: 4096\nwrite_bytes: 0\ncancelled_write_bytes: 9\n";
        assert_eq!(count_of(counts, "read_bytes"), Some(4096));
        assert_eq!((count_of(counts, "write_bytes"), count_of(counts, "bytes")), (Some(0), None));
    }

    #[test]
    fn times_are_found_behind_odd_names() {
        let stat = "42 (a) b (c)) S 1 2 3 4 5 6 7 8 9 10 150 25 0 0 20";
        assert_eq!(cpu_ticks(stat), Some(175));
        assert_eq!(cpu_ticks("42 (x"), None);
    }
}
