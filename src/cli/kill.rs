//! A way to die at a given place, for tests.
//!
//! With `CREASE_KILL_AT=NAME:N` in the environment the process is killed, as by the system, when its work comes to the
//! point NAME for the N-th time. Nobody else has a use for it; `tests/resume.rs` kills a run at every point there is.

use crate::spill::at_points;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The name of a point and how often it may be passed.
static WHERE: OnceLock<(String, u64)> = OnceLock::new();
static PASSED: AtomicU64 = AtomicU64::new(0);

/// Does what the environment asks for.
pub(super) fn arm() {
    let asked = std::env::var("CREASE_KILL_AT").ok();
    let point = asked.as_deref().and_then(|text| text.split_once(':'));
    if let Some((name, Ok(times))) = point.map(|(name, times)| (name, times.parse())) {
        let _ = WHERE.set((name.to_owned(), times));
        at_points(die);
    }
}

fn die(name: &'static str) {
    if let Some((at, times)) = WHERE.get()
        && at == name
        && PASSED.fetch_add(1, Ordering::Relaxed) + 1 == *times
    {
        // If the system refuses to kill us, the test says so.
        let _ = signal_hook::low_level::raise(signal_hook::consts::SIGKILL);
    }
}
