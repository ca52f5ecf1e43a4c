//! The memory that a run may allocate, and who holds how much of it.
//!
//! In: a number of bytes, and a number of those who may share it. Out: permits. Whoever makes something large holds a permit for its bytes, from before it is made
//! until it is gone. Only the loader waits for permits, and those it waits for are given back without its help; so nobody
//! waits in a circle.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A number of bytes that is shared out.
#[derive(Debug)]
pub struct Budget {
    total: u64,
    /// Permits that may exist at a time.
    most: u64,
    held: Mutex<Held>,
    given_back: Condvar,
}

/// What is held.
#[derive(Debug, Default)]
struct Held {
    bytes: u64,
    permits: u64,
}

impl Budget {
    /// A budget of `total` bytes for at most `most` at a time.
    pub fn new(total: u64, most: u64) -> Budget {
        Budget { total, most, held: Mutex::default(), given_back: Condvar::new() }
    }

    /// All bytes there are, held or not.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Waits until `bytes` are free, or all there are if these are less, and takes them. Waits too as long as too many hold
    /// some already.
    pub fn reserve(&self, bytes: u64) -> Permit<'_> {
        let bytes = bytes.min(self.total);
        let mut held = self.lock();
        while bytes > self.total - held.bytes || held.permits >= self.most {
            held = self.given_back.wait(held).unwrap_or_else(PoisonError::into_inner);
        }
        held.bytes += bytes;
        held.permits += 1;
        Permit { budget: self, bytes }
    }

    fn lock(&self) -> MutexGuard<'_, Held> {
        // Numbers are whole at any time, whatever happened to the thread that last changed them.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bytes of a [`Budget`], given back when this is dropped.
#[derive(Debug)]
pub struct Permit<'b> {
    budget: &'b Budget,
    bytes: u64,
}

impl Permit<'_> {
    /// Keeps `bytes` of them, if it has more, and gives the rest back.
    pub fn keep(&mut self, bytes: u64) {
        let rest = self.bytes.saturating_sub(bytes);
        self.bytes -= rest;
        self.give_back(rest, 0);
    }

    fn give_back(&self, bytes: u64, permits: u64) {
        let mut held = self.budget.lock();
        held.bytes -= bytes;
        held.permits -= permits;
        self.budget.given_back.notify_all();
    }
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        self.give_back(self.bytes, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn what_is_given_back_can_be_taken_again() {
        let budget = Budget::new(10, 2);
        assert_eq!(budget.reserve(11).bytes, 10);
        let mut most = budget.reserve(8);
        most.keep(9);
        assert_eq!(most.bytes, 8);
        most.keep(3);
        let rest = budget.reserve(7);
        drop(most);
        assert_eq!(budget.lock().bytes, rest.bytes);
    }

    #[test]
    fn no_more_is_held_than_there_is() {
        let (budget, now) = (Budget::new(100, 9), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for thread in 0..4u64 {
                let (budget, now) = (&budget, &now);
                scope.spawn(move || {
                    for i in 0..500u64 {
                        let bytes = 1 + (i * 7 + thread * 13) % 60;
                        let permit = budget.reserve(bytes);
                        assert!(now.fetch_add(bytes, Ordering::SeqCst) + bytes <= 100);
                        now.fetch_sub(bytes, Ordering::SeqCst);
                        drop(permit);
                    }
                });
            }
        });
        assert_eq!(budget.lock().bytes, 0);
    }

    #[test]
    fn no_more_hold_some_than_may() {
        let (budget, now) = (Budget::new(100, 2), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        let permit = budget.reserve(1);
                        assert!(now.fetch_add(1, Ordering::SeqCst) < 2);
                        now.fetch_sub(1, Ordering::SeqCst);
                        drop(permit);
                    }
                });
            }
        });
        assert_eq!(budget.lock().permits, 0);
    }
}
