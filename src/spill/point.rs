//! Named points between two steps that change the disk, so that a test can end the process at any of them.
//!
//! Nothing happens at a point unless the process asked for it once, before it began to work: then a function is called
//! with its name. What the files look like after a death between two steps is a promise, and promises are tested.

use std::sync::OnceLock;

static HOOK: OnceLock<fn(&'static str)> = OnceLock::new();

/// Has `hook` called at every point from now on. Only the first call counts.
pub fn at_points(hook: fn(&'static str)) {
    let _ = HOOK.set(hook);
}

/// The work has come to the point of this name.
#[inline]
pub fn point(name: &'static str) {
    if let Some(hook) = HOOK.get() {
        hook(name);
    }
}
