//! The memory that a run may allocate, and who holds how much of it.
//!
//! In: a number of bytes. Out: permits. Whoever makes something large holds a permit for its bytes, from before it is made
//! until it is gone. Only the loader waits for permits, and those it waits for are given back without its help; so nobody
//! waits in a circle.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A number of bytes that is shared out.
#[derive(Debug)]
pub struct Budget {
    total: u64,
    held: Mutex<u64>,
    given_back: Condvar,
}

impl Budget {
    /// A budget of `total` bytes.
    pub fn new(total: u64) -> Budget {
        Budget { total, held: Mutex::new(0), given_back: Condvar::new() }
    }

    /// All bytes there are, held or not.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Waits until `bytes` are free, or all there are if these are less, and takes them.
    pub fn reserve(&self, bytes: u64) -> Permit<'_> {
        let bytes = bytes.min(self.total);
        let mut held = self.lock();
        while bytes > self.total - *held {
            held = self.given_back.wait(held).unwrap_or_else(PoisonError::into_inner);
        }
        *held += bytes;
        Permit { budget: self, bytes }
    }

    fn lock(&self) -> MutexGuard<'_, u64> {
        // A number is whole at any time, whatever happened to the thread that last changed it.
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
        self.give_back(rest);
    }

    fn give_back(&self, bytes: u64) {
        *self.budget.lock() -= bytes;
        self.budget.given_back.notify_all();
    }
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        self.give_back(self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn what_is_given_back_can_be_taken_again() {
        let budget = Budget::new(10);
        assert_eq!(budget.reserve(11).bytes, 10);
        let mut most = budget.reserve(8);
        most.keep(9);
        assert_eq!(most.bytes, 8);
        most.keep(3);
        let rest = budget.reserve(7);
        drop(most);
        assert_eq!(*budget.lock(), rest.bytes);
    }

    #[test]
    fn no_more_is_held_than_there_is() {
        let (budget, now) = (Budget::new(100), AtomicU64::new(0));
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
        assert_eq!(*budget.lock(), 0);
    }
}
