//! One pass over the tiles: loader, workers and committer, joined by bounded channels, so that at most a handful of tiles
//! exist at any time.
//!
//! In: what to compute of a tile. Out: the results, in any order, each kept in the workspace before it is taken. What an
//! earlier run has kept comes first, and its tiles are not loaded.

use super::admit::{Admission, Admitted, Next};
use super::budget::{Budget, Permit};
use super::certify::Certified;
use super::events::{Event, Stage};
use super::ledger::Ledger;
use super::planned::Planned;
use super::run::Job;
use super::sizing::tiles_at_a_time;
use super::stop::{Stoppable, go_on};
use super::waits::{Clocks, Waits};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::TileId;
use crate::partition::Pass;
use crate::spill::point;
use crossbeam::channel::{Receiver, Sender, bounded};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, Ordering};

/// Tiles waiting between two stages. One keeps the workers busy while the loader reads on; more would only cost memory.
const WAITING_TILES: usize = 1;
/// Tiles worked on at a time: while one is in a serial part, the other has the pool.
const WORKERS: usize = 2;

/// What the committer takes.
pub(super) struct Taken<T> {
    /// The result.
    pub result: T,
    /// The cell that it is of.
    pub cell: TileId,
    /// The cell that has come to its end with it, if one has.
    pub whole: Option<TileId>,
    /// Whether it was kept by an earlier run.
    pub kept: bool,
}

/// How a pass went.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Passed {
    /// How often a region had to grow.
    pub regrown: u64,
    /// Who waited for whom.
    pub waits: Waits,
}

impl Job<'_> {
    /// `compute` makes something of each tile, which `take` gets, tiles in any order.
    pub(super) fn over_tiles<T: Send + Serialize + DeserializeOwned>(
        &self,
        (source, planned, ledger): (&dyn MeshSource, &Planned, &mut Ledger),
        stage: Stage,
        pass: Pass,
        compute: impl Fn(&mut Certified) -> T + Sync,
        mut take: impl FnMut(Taken<T>) -> Result<(), Error>,
    ) -> Result<Passed, Error> {
        ledger.replay(pass, |result, cell, last| {
            let whole = last.then_some(cell);
            go_on(self.stop)?;
            take(Taken { result, cell, whole, kept: true })?;
            if self.is_for_tasks() {
                // To put them together is what there is to do.
                self.observer.event(Event::Advanced { stage, by: u64::from(whole.is_some()) });
            }
            Ok(())
        })?;
        let source = Stoppable { source, stop: self.stop };
        let plan = &planned.plan;
        let halo = self.halo(&plan.scale, pass);
        let budget = Budget::new(planned.tile_memory, tiles_at_a_time(self.pool.current_num_threads()));
        let pieces: Vec<AtomicU32> = plan.cells.iter().map(|_| AtomicU32::new(1)).collect();
        let clocks = Clocks::default();
        let memory = (&budget, &clocks.memory);
        let admission = Admission::new(&source, plan, &halo, memory, &self.pool, &pieces, planned.rounds)
            .only(ledger.to_do(pass))
            .numbered(self.numbering());
        let (to_workers, from_loader) = bounded::<Box<Admitted>>(WAITING_TILES);
        let (to_committer, results) = bounded::<Outcome<T>>(WAITING_TILES);
        let mut regrown = 0;
        std::thread::scope(|scope| {
            let failed = to_committer.clone();
            scope.spawn(|| self.load_tiles(admission, stage, (to_workers, failed), &clocks));
            for _ in 0..WORKERS {
                let (from_loader, to_committer) = (from_loader.clone(), to_committer.clone());
                scope.spawn(|| self.work_on_tiles(&compute, from_loader, to_committer, &clocks));
            }
            // What is left here would keep the channels open when everybody else has gone.
            drop((from_loader, to_committer));
            let outcome: Result<(), Error> = results.iter().try_for_each(|result| {
                let done = result?;
                regrown += u64::from(done.regrown);
                let rest = pieces[done.id.0 as usize].fetch_sub(1, Ordering::Relaxed) - 1;
                point("tile-computed");
                ledger.keep(pass, done.id, rest == 0, &done.result)?;
                let whole = (rest == 0).then_some(done.id);
                take(Taken { result: done.result, cell: done.id, whole, kept: false })?;
                self.observer.event(Event::Advanced { stage, by: 1 });
                go_on(self.stop)
            });
            // Hanging up is how the other stages learn that it is over.
            drop(results);
            outcome
        })?;
        ledger.sync()?;
        Ok(Passed { regrown, waits: clocks.sum() })
    }

    fn load_tiles<'b, T>(
        &self,
        mut admission: Admission<'_, 'b>,
        stage: Stage,
        (to_workers, failed): (Sender<Box<Admitted<'b>>>, Sender<Outcome<'b, T>>),
        clocks: &Clocks,
    ) {
        loop {
            let next = guarded(admission.next_id(), || {
                go_on(self.stop)?;
                self.believed(stage, admission.next())
            });
            match next {
                Ok(None) => return,
                Ok(Some(Next::Cut)) => self.observer.event(Event::Grown { stage, by: 1 }),
                Ok(Some(Next::Tile(tile))) => {
                    if clocks.to_workers(&to_workers, tile).is_err() {
                        return;
                    }
                }
                Err(error) => {
                    // Nobody listening means that another error came first.
                    let _ = failed.send(Err(error));
                    return;
                }
            }
        }
    }

    fn work_on_tiles<'b, T: Send>(
        &self,
        compute: &(impl Fn(&mut Certified) -> T + Sync),
        from_loader: Receiver<Box<Admitted<'b>>>,
        to_committer: Sender<Outcome<'b, T>>,
        clocks: &Clocks,
    ) {
        for admitted in clocks.tiles(&from_loader) {
            let Admitted { id, mut tile, permit } = *admitted;
            let result = guarded(id, || {
                go_on(self.stop)?;
                Ok(self.pool.install(|| compute(&mut tile)))
            });
            let regrown = tile.regrown;
            drop(tile);
            let done = result.map(|result| Done { id, result, regrown, _permit: permit });
            if clocks.to_committer(&to_committer, done).is_err() {
                return;
            }
        }
    }
}

/// What became of a tile.
struct Done<'b, T> {
    /// The cell it is of.
    id: TileId,
    result: T,
    /// How often its region had to grow.
    regrown: u32,
    /// Until the result is taken.
    _permit: Permit<'b>,
}

type Outcome<'b, T> = Result<Done<'b, T>, Error>;

/// Turns a panic, which is a bug of ours, into an error that says where it happened.
fn guarded<T>(tile: TileId, job: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|panic| {
        let message = panic
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| panic.downcast_ref::<&str>().map(|s| s.to_string()))
            .unwrap_or_default();
        Err(Error::Internal { tile, message })
    })
}
