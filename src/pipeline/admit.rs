//! Which tile is loaded next, and when.
//!
//! In: the cells of the plan, and the memory for tiles. Out: certified tiles, each with a permit for the bytes that it will
//! need while it is worked on. The permit is there before the first face is read. What a tile loads is not known before,
//! only expected; where it turns out to be more than the permit is for, the tile is loaded again when no other is there,
//! and if it is still too much, its cell is cut in two. Where a cell has become so small that this is of no use, the run
//! ends: so many faces in one place cannot be worked on in this memory. None of this can be seen in the result.

use super::budget::{Budget, Permit};
use super::certify::{Certified, Halo, certify};
use super::sizing::{expected_faces, faces_in, tile_bytes};
use super::waits::Clock;
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::TileId;
use crate::partition::{Cell, LoadError, Numbering, Plan};
use rayon::ThreadPool;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};

/// A tile that may be worked on.
pub struct Admitted<'b> {
    /// The cell of the plan that it is of, whole or a piece of it.
    pub id: TileId,
    /// The tile.
    pub tile: Certified,
    /// For its bytes, until nothing of it is left.
    pub permit: Permit<'b>,
}

/// Loads tiles one after the other.
pub struct Admission<'a, 'b> {
    source: &'a dyn MeshSource,
    plan: &'a Plan,
    halo: &'a Halo,
    budget: &'b Budget,
    /// How long it was waited for.
    waiting_for_memory: &'a Clock,
    /// Where the work of loading is done. Waiting is not: a thread of the pool that waited for a tile to be done might be the
    /// one that has taken up loading in the middle of that very tile.
    pool: &'a ThreadPool,
    /// Cells whose tiles are still to be loaded, pieces of cells among them.
    waiting: VecDeque<(TileId, Cell)>,
    /// How many pieces of each cell of the plan are not done: one, unless it was cut.
    pieces: &'a [AtomicU32],
    /// Refinement rounds that the last tile needed. Noise is much the same everywhere in a scan: the best guess for the next.
    rounds: u32,
    /// How tiles are numbered.
    numbering: Numbering,
}

/// What became of the first of the waiting cells.
pub enum Next<'b> {
    /// Its tile is loaded.
    Tile(Box<Admitted<'b>>),
    /// It was cut in two.
    Cut,
}

impl<'a, 'b> Admission<'a, 'b> {
    /// Of all cells of `plan`, most of which need about `rounds` refinement rounds.
    pub fn new(
        source: &'a dyn MeshSource,
        plan: &'a Plan,
        halo: &'a Halo,
        (budget, waiting_for_memory): (&'b Budget, &'a Clock),
        pool: &'a ThreadPool,
        pieces: &'a [AtomicU32],
        rounds: u32,
    ) -> Admission<'a, 'b> {
        let waiting = (0..).map(TileId).zip(plan.cells.iter().copied()).collect();
        Admission {
            source,
            plan,
            halo,
            budget,
            waiting_for_memory,
            pool,
            waiting,
            pieces,
            rounds,
            numbering: Numbering::default(),
        }
    }

    /// The same, but only those of which `to_do` says so.
    pub fn only(mut self, to_do: impl Fn(TileId) -> bool) -> Admission<'a, 'b> {
        self.waiting.retain(|(id, _)| to_do(*id));
        self
    }

    /// The same with tiles numbered in another way.
    pub fn numbered(mut self, numbering: Numbering) -> Admission<'a, 'b> {
        self.numbering = numbering;
        self
    }

    /// Of which cell the next tile will be.
    pub fn next_id(&self) -> TileId {
        self.waiting.front().map_or(TileId(0), |(id, _)| *id)
    }

    /// Loads the next tile as soon as there is memory for it. `None` if there is none left.
    ///
    /// # Errors
    /// If the source fails, or the faces around one place are too many for the memory.
    pub fn next(&mut self) -> Result<Option<Next<'b>>, Error> {
        let Some((id, cell)) = self.waiting.pop_front() else { return Ok(None) };
        let expected = expected_faces(self.plan, &cell, self.halo.margin(self.plan, self.rounds));
        let total = self.budget.total();
        // Estimates are some percent off; whoever is much too low comes back for all there is.
        let first = tile_bytes(expected + expected / 8).min(total);
        let mut faces = 0;
        for bytes in [first, total] {
            match self.load(id, &cell, bytes) {
                Ok(admitted) => return Ok(Some(Next::Tile(Box::new(admitted)))),
                Err(Error::Load(LoadError::TooManyFaces { faces: found, .. })) => faces = found,
                Err(error) => return Err(error),
            }
        }
        let bounds = &self.plan.bounds;
        let Some([a, b]) = cell.halves(bounds.min, bounds.max, self.plan.lattice.edge) else {
            return Err(Error::NoRoom {
                at: cell.min.max(bounds.min),
                faces,
                bytes: tile_bytes(faces),
                memory: total,
            });
        };
        tracing::debug!(?cell, faces, "cut in two: too many faces for the memory");
        self.pieces[id.0 as usize].fetch_add(1, Ordering::Relaxed);
        self.waiting.push_front((id, b));
        self.waiting.push_front((id, a));
        Ok(Some(Next::Cut))
    }

    fn load(&mut self, id: TileId, cell: &Cell, bytes: u64) -> Result<Admitted<'b>, Error> {
        let mut permit = self.waiting_for_memory.over(|| self.budget.reserve(bytes));
        let margin = self.halo.margin(self.plan, self.rounds);
        let Admission { source, plan, halo, numbering, .. } = *self;
        let most = faces_in(bytes);
        let tile = self.pool.install(|| certify(source, plan, halo, cell, margin, most, numbering))?;
        self.rounds = tile.most_rounds;
        permit.keep(tile_bytes(tile.mesh.face_count() as u64));
        Ok(Admitted { id, tile, permit })
    }
}
