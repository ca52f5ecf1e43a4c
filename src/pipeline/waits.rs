//! How long the stages of a pass wait for each other: what tells whether the disk, the memory or the cores are too small.
//!
//! In: moments at which a stage stands still. Out: sums. Nothing of it changes what is done, or when.

use crossbeam::channel::{Receiver, SendError, Sender};
use std::ops::AddAssign;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// How long stages waited in all passes over the tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waits {
    /// The loader, for tiles to give memory back.
    pub for_memory: Duration,
    /// The loader, for somebody to take the tile it had loaded.
    pub for_workers: Duration,
    /// The workers, together, for a tile.
    pub for_tiles: Duration,
    /// The workers, together, for the committer.
    pub for_committer: Duration,
    /// Tiles that workers took.
    pub taken: u64,
    /// Those of them that lay in the queue when the worker came.
    pub ready: u64,
}

impl AddAssign for Waits {
    fn add_assign(&mut self, other: Waits) {
        self.for_memory += other.for_memory;
        self.for_workers += other.for_workers;
        self.for_tiles += other.for_tiles;
        self.for_committer += other.for_committer;
        self.taken += other.taken;
        self.ready += other.ready;
    }
}

/// Time that threads add up, in nanoseconds.
#[derive(Debug, Default)]
pub(super) struct Clock(AtomicU64);

impl Clock {
    /// Does `what` and counts how long it takes.
    pub fn over<T>(&self, what: impl FnOnce() -> T) -> T {
        let started = Instant::now();
        let result = what();
        self.0.fetch_add(started.elapsed().as_nanos() as u64, Relaxed);
        result
    }

    fn sum(&self) -> Duration {
        Duration::from_nanos(self.0.load(Relaxed))
    }
}

/// The clocks of one pass.
#[derive(Debug, Default)]
pub(super) struct Clocks {
    /// Of the loader, for memory.
    pub memory: Clock,
    workers: Clock,
    tiles: Clock,
    committer: Clock,
    taken: AtomicU64,
    ready: AtomicU64,
}

impl Clocks {
    /// Hands a loaded tile to the workers.
    pub fn to_workers<T>(&self, to: &Sender<T>, tile: T) -> Result<(), SendError<T>> {
        self.workers.over(|| to.send(tile))
    }

    /// Hands a result to the committer.
    pub fn to_committer<T>(&self, to: &Sender<T>, result: T) -> Result<(), SendError<T>> {
        self.committer.over(|| to.send(result))
    }

    /// The tiles that come, until no more do.
    pub fn tiles<'a, T>(&'a self, from: &'a Receiver<T>) -> impl Iterator<Item = T> + 'a {
        std::iter::from_fn(move || {
            let ready = !from.is_empty();
            let tile = self.tiles.over(|| from.recv().ok())?;
            self.taken.fetch_add(1, Relaxed);
            self.ready.fetch_add(u64::from(ready), Relaxed);
            Some(tile)
        })
    }

    /// What it comes to.
    pub fn sum(&self) -> Waits {
        Waits {
            for_memory: self.memory.sum(),
            for_workers: self.workers.sum(),
            for_tiles: self.tiles.sum(),
            for_committer: self.committer.sum(),
            taken: self.taken.load(Relaxed),
            ready: self.ready.load(Relaxed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crossbeam::channel::bounded;

    #[test]
    fn who_waits_is_counted_where_it_waits() {
        let clocks = Clocks::default();
        let (to, from) = bounded(1);
        let nap = Duration::from_millis(20);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(nap);
                for tile in 0..3 {
                    clocks.to_workers(&to, tile).expect("somebody takes it");
                }
                drop(to);
            });
            let mut tiles = clocks.tiles(&from);
            assert_eq!(tiles.next(), Some(0));
            std::thread::sleep(3 * nap);
            assert_eq!((tiles.next(), tiles.next(), tiles.next()), (Some(1), Some(2), None));
        });
        let waits = clocks.sum();
        assert_eq!(waits.taken, 3);
        assert!(waits.ready >= 1 && waits.ready < 3, "{waits:?}");
        assert!(waits.for_tiles >= nap / 2 && waits.for_workers >= nap / 2, "{waits:?}");
        assert_eq!((waits.for_memory, waits.for_committer), Default::default());
    }
}
