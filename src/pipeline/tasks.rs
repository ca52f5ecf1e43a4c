//! The job as many tasks, each a process of its own, perhaps on machines of their own.
//!
//! ```text
//!  lay_out ──> workspace ──> run_tiles, any number of processes ──> workspace ──> run_stored
//!  prepare     plan, mesh    prepare, pass                          results       prepare, pass without tiles, stitch
//! ```
//!
//! Between the last two, `run_group` may stitch some of the tiles for `run_stored` ([`super::groups`]).
//!
//! In: a workspace that is planned for tasks ([`Workspace::planned`](crate::workspace::Workspace::planned)). Out: results of tiles
//! in it, and in the end what [`Job::run_stored`] makes of them. Each task goes through the same steps as a run that goes on, so
//! there is no second way to do anything; what differs is that no task reads the whole mesh.

use super::certify::Certified;
use super::compute::{Asked, TileResult, compute};
use super::events::Stage;
use super::outlook::{Laid, outlooks};
use super::pass::Taken;
use super::prepare::Prepared;
use super::run::{Job, Part, Work};
use super::stop::Stoppable;
use crate::config::Method;
use crate::error::Error;
use crate::mesh::TileId;
use crate::partition::Pass;
use crate::refine::Extremes;
use crate::workspace::WorkspaceError;
use std::collections::{BTreeMap, BTreeSet};

/// What a tile was that is done.
#[derive(Clone, Copy, Debug)]
pub struct TileDone {
    /// Which one.
    pub id: TileId,
    /// Faces that were loaded for it, halo included; for all its pieces, if it was cut.
    pub loaded_faces: u64,
    /// Faces that it owns.
    pub owned_faces: u64,
}

impl Job<'_> {
    /// Whether the job is planned for tasks.
    pub(super) fn is_for_tasks(&self) -> bool {
        self.workspace.as_ref().is_some_and(|workspace| workspace.attempt().is_some())
    }

    /// Refuses what tasks cannot do.
    pub(super) fn suits_tasks(&self) -> Result<(), Error> {
        match self.params.method {
            Method::Paper(_) if self.is_for_tasks() => Err(WorkspaceError::OneProcess.into()),
            _ => Ok(()),
        }
    }

    /// Scans and plans, puts the mesh in order if it needs that, and records the job in the workspace, without doing any of its
    /// tiles. Results will hold the fields of all vertices if `fields`.
    ///
    /// # Errors
    /// As for [`Job::run_stored`].
    pub fn lay_out(&self, fields: bool) -> Result<Laid, Error> {
        let mut work = Work::default();
        let source = Stoppable { source: self.source, stop: self.stop };
        let Prepared { planned, .. } = self.prepare(&source, fields, &mut work)?;
        let tiles = self.pool.install(|| outlooks(&planned, &self.halo(&planned.plan.scale, Pass::Links)));
        Ok(Laid { planned, tiles, work })
    }

    /// Does the tiles of `wanted`, and keeps their results in the workspace. `done` is told of each that is there then.
    ///
    /// # Errors
    /// If the input is bad or not the one that was planned for, a resource runs out, or `done` refuses.
    pub fn run_tiles(
        mut self,
        wanted: BTreeSet<TileId>,
        mut done: impl FnMut(TileDone) -> Result<(), Error>,
    ) -> Result<Work, Error> {
        let total = wanted.len() as u64;
        self.part = Part::Tiles(wanted);
        let mut work = Work::default();
        let source = Stoppable { source: self.source, stop: self.stop };
        let Prepared { mesh, planned, mut ledger, fields } = self.prepare(&source, false, &mut work)?;
        let started = self.started(Stage::Tiles, 0, total);
        let (plan, extremes) = (&planned.plan, Extremes::default());
        let asked = Asked { fields, shortcuts: self.limits.shortcuts };
        let compute = |tile: &mut Certified| compute(tile, plan, &self.params, &extremes, asked);
        // Of a cell that is cut, pieces come in one by one, and others in between.
        let mut faces: BTreeMap<TileId, (u64, u64)> = BTreeMap::new();
        let mesh = (mesh.source(), &planned, &mut ledger);
        let taken = |Taken { result, cell, whole, .. }: Taken<TileResult>| {
            work.add(&result);
            let (loaded, owned) = faces.entry(cell).or_default();
            *loaded += result.loaded_faces;
            *owned += result.owned_faces;
            let tile = TileDone { id: cell, loaded_faces: *loaded, owned_faces: *owned };
            whole.map_or(Ok(()), |_| done(tile))
        };
        let pass = self.over_tiles(mesh, Stage::Tiles, Pass::Links, compute, taken);
        work.add_pass(self.believed(Stage::Tiles, pass)?);
        self.finished(Stage::Tiles, started, &mut work);
        Ok(work)
    }
}
