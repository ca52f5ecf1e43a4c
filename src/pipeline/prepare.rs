//! Everything before the first tile: scan, plan, spatial order, and what an earlier run has kept of them.
//!
//! In: the source, and the workspace if there is one. Out: what tiles are loaded from, the plan, and the results that are
//! there already. A job that was begun keeps its cells, whatever the limits are now, because its results are those of its
//! cells. Its mesh is read once, from start to end, to see that it is the same mesh.

use super::events::{Event, Stage};
use super::ledger::Ledger;
use super::order::{Mesh, Rewriter};
use super::planned::Planned;
use super::run::{Job, Part, Work};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::TileId;
use crate::partition::{Pass, Plan, Scale, SpatialStore, content, scan};
use crate::spill::point;
use crate::workspace::{Identity, JobRecord, MeshRecord, Workspace, WorkspaceError};

/// What the passes over the tiles start from.
pub(super) struct Prepared<'s> {
    /// What tiles are loaded from.
    pub mesh: Mesh<'s>,
    /// The plan.
    pub planned: Planned,
    /// Results.
    pub ledger: Ledger,
    /// Whether results hold the fields of vertices.
    pub fields: bool,
}

impl Job<'_> {
    /// Scan and plan.
    pub(super) fn plan_of(&self, source: &dyn MeshSource) -> Result<Planned, Error> {
        let progress = self.looks_at_faces(source);
        self.pool.install(|| {
            let scan = scan(source, self.limits.memory, &progress)?;
            let halo = |scale: &Scale| self.halo(scale, Pass::Links);
            Planned::new(source, scan, &self.params, &self.limits, halo)
        })
    }

    fn looks_at_faces(&self, source: &dyn MeshSource) -> impl Fn(u64) + Sync {
        self.observer.event(Event::Started { stage: Stage::Scan, total: source.face_count() });
        |faces| self.observer.event(Event::Advanced { stage: Stage::Scan, by: faces })
    }

    /// From the beginning, or from where an earlier run has stopped.
    pub(super) fn prepare<'s>(
        &self,
        source: &'s dyn MeshSource,
        fields: bool,
        work: &mut Work,
    ) -> Result<Prepared<'s>, Error> {
        let mut now = Identity::of(source, &self.params, fields);
        let recorded = match &self.workspace {
            Some(workspace) if workspace.enter()? => workspace.job()?,
            _ => None,
        };
        self.suits_tasks()?;
        if let Some(job) = &recorded {
            self.same_job(&job.identity, &now)?;
            // Tiles to come are recorded as those that are there.
            now.fields = job.identity.fields;
        }
        match recorded {
            Some(job) if job.mesh != MeshRecord::Joined => self.reopen(source, job, now, work),
            begun => self.begin(source, begun, now, work),
        }
    }

    /// Refuses to go on with another job.
    fn same_job(&self, before: &Identity, now: &Identity) -> Result<(), WorkspaceError> {
        match (before.difference(now), &self.workspace) {
            (Some(difference), Some(workspace)) => {
                let (path, what) = (workspace.path().to_owned(), difference.what);
                Err(WorkspaceError::OtherJob { path, what, before: difference.before, now: difference.now })
            }
            _ => Ok(()),
        }
    }

    /// Goes on with `job`: neither scanned nor put in order again.
    fn reopen<'s>(
        &self,
        source: &'s dyn MeshSource,
        mut job: JobRecord,
        mut now: Identity,
        work: &mut Work,
    ) -> Result<Prepared<'s>, Error> {
        let tasks = self.is_for_tasks();
        if !tasks {
            // Where there are many tasks, none reads the whole mesh: length and time of the file were compared when it was
            // opened, and blocks in spatial order are checked one by one.
            now.input.content = Some(self.timed(Stage::Scan, work, || {
                let progress = self.looks_at_faces(source);
                Ok(self.pool.install(|| content(source, &progress))?)
            })?);
            self.same_job(&job.identity, &now)?;
        }
        let mesh = match (std::mem::replace(&mut job.mesh, MeshRecord::File), &self.workspace) {
            (MeshRecord::Sorted(table), Some(workspace)) if tasks => {
                Mesh::Sorted(SpatialStore::reopen_unread(source, &workspace.sorted(), table)?)
            }
            (MeshRecord::Sorted(table), Some(workspace)) => {
                match self.pool.install(|| SpatialStore::reopen(source, &workspace.sorted(), table)) {
                    Ok(store) => Mesh::Sorted(store),
                    Err(error) => {
                        tracing::warn!("{error}: the mesh is put in order again");
                        return self.begin(source, Some(job), now, work);
                    }
                }
            }
            _ => Mesh::File(source),
        };
        let mut plan = Plan::new(&job.scan, &self.params)?;
        if let Mesh::Sorted(store) = &mesh {
            work.rewritten = true;
            plan = plan.over(store.summaries());
        }
        plan.cells = job.cells;
        let halo = self.halo(&plan.scale, Pass::Links);
        let planned = self.pool.install(|| Planned::again(job.scan, plan, job.rounds, &self.limits, halo))?;
        let ledger = self.ledger(self.workspace.as_ref(), &planned)?;
        Ok(Prepared { mesh, planned, ledger, fields: now.fields })
    }

    /// Scan, plan, and the mesh in an order that tiles can be loaded from. `begun` is a job of which all that is lost; its
    /// cells and results are good.
    fn begin<'s>(
        &self,
        source: &'s dyn MeshSource,
        begun: Option<JobRecord>,
        mut now: Identity,
        work: &mut Work,
    ) -> Result<Prepared<'s>, Error> {
        let rewriter = Rewriter {
            source,
            limits: &self.limits,
            room: &self.room,
            pool: &self.pool,
            observer: self.observer,
        };
        let mut rewrite = rewriter.look()?;
        let joined = match rewrite.joins() {
            true => Some(self.timed(Stage::Order, work, || rewriter.join(&mut rewrite))?),
            false => None,
        };
        point("joined");
        let from = joined.as_ref().map_or(source, |joined| joined as &dyn MeshSource);
        let mut planned = self.timed(Stage::Scan, work, || self.plan_of(from))?;
        point("scanned");
        now.input.content = Some(planned.scan.content);
        if let Some(job) = &begun {
            self.same_job(&job.identity, &now)?;
            planned.plan.cells.clone_from(&job.cells);
            planned.rounds = job.rounds;
        }
        // A joined mesh is not kept; other tasks can use a sorted one only.
        work.rewritten = rewriter.sorts(&rewrite, &planned.scan, &planned.plan)
            || (self.is_for_tasks() && joined.is_some());
        // A single tile is either done or not: there is nothing to go on with, unless another process is to do it.
        let workspace =
            self.workspace.as_ref().filter(|_| planned.plan.cells.len() > 1 || self.is_for_tasks());
        let (mesh, record) = match (work.rewritten, joined) {
            (true, joined) => {
                let mut store =
                    self.timed(Stage::Order, work, || rewriter.sort(&mut rewrite, joined, &planned.scan))?;
                point("sorted");
                planned.plan = planned.plan.over(store.summaries());
                let record = match workspace {
                    Some(workspace) => MeshRecord::Sorted(store.keep(&workspace.sorted())?),
                    None => MeshRecord::Joined,
                };
                point("sorted-kept");
                (Mesh::Sorted(store), record)
            }
            (false, Some(joined)) => (Mesh::Joined(joined), MeshRecord::Joined),
            (false, None) => (Mesh::File(source), MeshRecord::File),
        };
        // Of no use any more.
        planned.scan.sample = Vec::new();
        work.temporary_bytes = rewrite.peak_bytes();
        let fields = now.fields;
        if let Some(workspace) = workspace {
            record_job(workspace, begun.map(|job| job.identity), now, &mut planned, record)?;
        }
        let ledger = self.ledger(workspace, &planned)?;
        Ok(Prepared { mesh, planned, ledger, fields })
    }

    /// What there is of the tiles that this process is for.
    fn ledger(&self, workspace: Option<&Workspace>, planned: &Planned) -> Result<Ledger, Error> {
        let open = |cells: Vec<u32>| self.pool.install(|| Ledger::open(workspace, &cells));
        match (workspace, &self.part) {
            (Some(workspace), Part::Tiles(wanted)) => Ledger::of(workspace, wanted),
            (_, Part::Group(tiles)) => {
                Ok(open(tiles.clone().collect())?.only(tiles.clone().map(TileId).collect()))
            }
            _ => open((0..).take(planned.plan.cells.len()).collect()),
        }
    }
}

/// Writes down what was decided. If the job was begun already, `before` is what it is known by.
fn record_job(
    workspace: &Workspace,
    before: Option<Identity>,
    now: Identity,
    planned: &mut Planned,
    mesh: MeshRecord,
) -> Result<(), Error> {
    let begun = before.is_some();
    // The cells are lent; they may be many.
    let job = JobRecord {
        identity: before.unwrap_or(now),
        scan: planned.scan.clone(),
        cells: std::mem::take(&mut planned.plan.cells),
        rounds: planned.rounds,
        mesh,
    };
    let written = if begun { workspace.update_job(&job) } else { workspace.begin_job(&job) };
    planned.plan.cells = job.cells;
    Ok(written?)
}
