//! The whole job: scan, plan, tiles, stitch; for the paper method, a survey of the tiles before the tiles.
//!
//! All heavy work runs on one thread pool, which is what `--threads` sizes; the stage threads mostly wait ([`super::pass`]).
//! With a workspace, what is done is kept, and a run that stopped is gone on with ([`super::prepare`]).

use super::certify::Certified;
use super::certify::Halo;
use super::compute::{Asked, TileResult, compute};
use super::events::{Event, Observer, Stage};
use super::groups::StitchedGroup;
use super::ledger::Ledger;
use super::order::{ORDER_MEMORY, Room};
use super::paper::PaperMethod;
use super::pass::{Passed, Taken};
use super::planned::Planned;
use super::prepare::Prepared;
use super::stop::{NEVER, Stoppable};
use super::waits::Waits;
use crate::config::{Limits, Method, NO_LIMIT, PaperThresholds, Params};
use crate::error::Error;
use crate::input::{InputError, MeshSource};
use crate::mesh::TileId;
use crate::output::FieldSink;
use crate::partition::{Numbering, PaperReach, Pass, Scale, Scan};
use crate::refine::{Extremes, OmegaRange};
use crate::spill::{ScratchPlace, point};
use crate::stitch::{Defects, LineMemory, LineSet, Rules, StitchWork, Stitched, Stitcher, StoredLines};
use crate::workspace::Workspace;
use rayon::ThreadPool;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Feature lines, and how they were found.
#[derive(Clone, Debug)]
pub struct Detection<Lines = LineSet> {
    /// The lines.
    pub lines: Lines,
    /// What the scan found.
    pub scan: Scan,
    /// Defects that adjacency shows.
    pub defects: Defects,
    /// How the work went.
    pub work: Work,
}

impl<Lines> Detection<Lines> {
    /// The same with something else in the place of the lines.
    ///
    /// # Errors
    /// If `f` fails.
    pub fn try_map<Other, E>(self, f: impl FnOnce(Lines) -> Result<Other, E>) -> Result<Detection<Other>, E> {
        let Detection { lines, scan, defects, work } = self;
        Ok(Detection { lines: f(lines)?, scan, defects, work })
    }
}

/// How the work went. None of it is part of the result.
#[derive(Clone, Debug, Default)]
pub struct Work {
    /// Voting scale in mesh units; 0 where the one-ring votes alone.
    pub sigma: f64,
    /// Tiles that were worked on.
    pub tiles: u64,
    /// Cells that an earlier run had done, and all cells.
    pub resumed: (u64, u64),
    /// Faces owned by the tiles that were worked on.
    pub owned_faces: u64,
    /// Faces loaded for them, halos included; those of a survey do not count.
    pub loaded_faces: u64,
    /// How often a region had to grow because the mesh reached farther than expected.
    pub regrown: u64,
    /// Whether tiles were loaded from a copy of the mesh in spatial order.
    pub rewritten: bool,
    /// The most bytes of temporary files at a time.
    pub temporary_bytes: u64,
    /// How the stitching went.
    pub stitch: StitchWork,
    /// How long loading, computing and committing waited for each other.
    pub waits: Waits,
    /// Wall time of each stage.
    pub stages: Vec<(Stage, Duration)>,
}

impl Work {
    /// A pass is over.
    pub(super) fn add_pass(&mut self, pass: Passed) {
        self.regrown += pass.regrown;
        self.waits += pass.waits;
    }

    /// A tile was worked on.
    pub(super) fn add(&mut self, tile: &TileResult) {
        self.tiles += 1;
        self.loaded_faces += tile.loaded_faces;
        self.owned_faces += tile.owned_faces;
    }
}

/// A job over a source. Built once, run once.
pub struct Job<'a> {
    pub(super) source: &'a dyn MeshSource,
    pub(super) params: Params,
    pub(super) limits: Limits,
    pub(super) observer: &'a dyn Observer,
    pub(super) pool: ThreadPool,
    pub(super) stop: &'a AtomicBool,
    pub(super) room: Room,
    pub(super) workspace: Option<Workspace>,
    pub(super) part: Part,
    /// Groups of tiles that are stitched already.
    pub(super) groups: Vec<StitchedGroup>,
    reach_factor: f64,
    pub(super) line_memory: LineMemory,
}

/// What of the job this process is for, if it is one task of many.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// All that is to be done.
    All,
    /// Results of these tiles.
    Tiles(BTreeSet<TileId>),
    /// What these tiles leave together.
    Group(Range<u32>),
}

/// Share of the memory that lines may use, and what is open between tiles.
pub(super) const LINE_SHARE: u64 = 6;
/// Share of the memory that sorting the mesh may use: what was planned is there at the same time.
const ORDER_SHARE: u64 = 2;

impl<'a> Job<'a> {
    /// Prepares a job.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn new(
        source: &'a dyn MeshSource,
        params: Params,
        limits: Limits,
        observer: &'a dyn Observer,
    ) -> Result<Job<'a>, Error> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(limits.threads)
            .thread_name(|i| format!("crease-{i}"))
            .build()
            .map_err(|e| Error::Threads(e.to_string()))?;
        let room = Room {
            scratch: ScratchPlace::below(Path::new(".")),
            force: false,
            memory: ORDER_MEMORY.min(limits.memory / ORDER_SHARE),
        };
        let line_memory = match limits.memory {
            NO_LIMIT => LineMemory::UNBOUNDED,
            memory => LineMemory {
                open: memory / LINE_SHARE / 2,
                lines: memory / LINE_SHARE / 2,
                // By then there are no tiles, and the plan is small.
                last: memory / 4 * 3,
            },
        };
        let (stop, workspace, part, groups, reach_factor) = (&NEVER, None, Part::All, Vec::new(), 1.0);
        Ok(Job {
            source,
            params,
            limits,
            observer,
            pool,
            stop,
            room,
            workspace,
            part,
            groups,
            reach_factor,
            line_memory,
        })
    }

    /// Chooses where temporary files go, if some are needed; `force` begins even if the disk seems too small. The default
    /// is the current directory.
    pub fn with_scratch(mut self, directory: &Path, force: bool) -> Self {
        self.room.scratch = ScratchPlace::below(directory);
        self.room.force = force;
        self
    }

    /// Has what is done kept in `workspace`, and goes on with what is kept there. Temporary files go there too. A mesh of
    /// one tile keeps nothing. The workspace stays when the run is over: whoever has written its result removes it
    /// ([`Workspace::remove`]).
    pub fn with_workspace(mut self, workspace: &Workspace, force: bool) -> Self {
        self.room.scratch = workspace.scratch();
        self.room.force = force;
        self.workspace = Some(workspace.clone());
        self
    }

    /// Has the run end with [`Error::Stopped`] soon after `stop` is set. Tiles that are being worked on are finished first,
    /// and lost.
    pub fn with_stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Chooses how many bytes of memory sorting the mesh may use; 256 MiB, or half of what is allowed, if nothing is said.
    pub fn with_order_memory(mut self, bytes: u64) -> Self {
        self.room.memory = bytes;
        self
    }

    /// Bounds the memory for the lines and for what is open between tiles. Lines that do not fit go to temporary files. If
    /// nothing is said, it is a part of [`Limits::memory`].
    pub fn with_line_memory(mut self, memory: LineMemory) -> Self {
        self.line_memory = memory;
        self
    }

    /// Makes the halo too thin or too wide by `factor`. Only a test has a use for a wrong one.
    #[doc(hidden)]
    pub fn with_reach_factor(mut self, factor: f64) -> Self {
        self.reach_factor = factor;
        self
    }

    /// Scans and plans, without doing any of the work.
    ///
    /// # Errors
    /// If the input is bad, a parameter does not suit it, or there is not even memory for the plan.
    pub fn plan(&self) -> Result<Planned, Error> {
        self.believed(Stage::Scan, self.plan_of(self.source))
    }

    /// What a stage has made of the input, or its error, unless the input changed meanwhile: then neither can be believed.
    pub(super) fn believed<T>(&self, stage: Stage, result: Result<T, Error>) -> Result<T, Error> {
        match self.source.unchanged() {
            Ok(()) => result,
            Err(error @ InputError::Changed { .. }) => Err(Error::Changed { stage: stage.name(), error }),
            // That the look itself failed hides no other error.
            Err(error) => result.and(Err(error.into())),
        }
    }

    /// Does the whole job, with all lines in memory at its end. The fields of all vertices go to `fields`, if there is a
    /// taker.
    ///
    /// # Errors
    /// If the input is bad, a resource runs out, or `fields` refuses.
    pub fn run(&self, fields: Option<&mut dyn FieldSink>) -> Result<Detection, Error> {
        Ok(self.run_stored(fields)?.try_map(|lines| LineSet::collect(&lines))?)
    }

    /// The same with lines that need not fit into memory.
    ///
    /// # Errors
    /// As for [`Job::run`].
    pub fn run_stored(&self, fields: Option<&mut dyn FieldSink>) -> Result<Detection<StoredLines>, Error> {
        let mut work = Work::default();
        let source = Stoppable { source: self.source, stop: self.stop };
        let prepared = self.prepare(&source, fields.is_some(), &mut work)?;
        let Prepared { mesh, planned, mut ledger, fields: with_fields } = prepared;
        let plan = &planned.plan;
        work.sigma = match self.params.sigma.is_zero() {
            true => 0.0,
            false => plan.scale.length(crate::config::method::SIGMA_EDGES),
        };
        let tiles = plan.cells.len() as u64;
        ledger.cover(self.covered(), fields.is_some());
        ledger.count(tiles);
        let extremes = match &self.params.method {
            Method::Robust => Extremes::default(),
            Method::Paper(thresholds) => {
                let done = ledger.done(Pass::Omega).len() + ledger.done(Pass::Salience).len();
                let started = self.started(Stage::Survey, done as u64, 2 * tiles);
                let extremes = self.survey((mesh.source(), &planned, &mut ledger), thresholds, &mut work);
                let extremes = self.believed(Stage::Survey, extremes)?;
                self.finished(Stage::Survey, started, &mut work);
                extremes
            }
        };
        work.resumed = (ledger.done(Pass::Links).len() as u64, tiles);
        let started = match self.is_for_tasks() {
            // Results of tasks are no more than what they were made for.
            true => self.started(Stage::Tiles, 0, tiles),
            false => self.started(Stage::Tiles, work.resumed.0, tiles),
        };
        let source = (mesh.source(), &planned, &mut ledger);
        let stitcher = self.tiles(source, &extremes, (fields, with_fields), &mut work);
        let stitcher = self.believed(Stage::Tiles, stitcher)?;
        self.finished(Stage::Tiles, started, &mut work);
        // Temporary files go before the results come.
        drop(mesh);
        self.observer.event(Event::Started { stage: Stage::Stitch, total: stitcher.links() });
        point("stitching");
        let Stitched { lines, defects, work: stitch } =
            self.timed(Stage::Stitch, &mut work, || Ok(self.pool.install(|| stitcher.finish())?))?;
        tracing::debug!(?stitch, "stitched");
        work.stitch = stitch;
        Ok(Detection { lines, scan: planned.scan, defects, work })
    }

    /// A stage begins of whose `total` tiles some are done.
    pub(super) fn started(&self, stage: Stage, done: u64, total: u64) -> Instant {
        if done > 0 {
            self.observer.event(Event::Resumed { stage, done, total });
        }
        self.observer.event(Event::Started { stage, total: total - done });
        Instant::now()
    }

    pub(super) fn timed<T>(
        &self,
        stage: Stage,
        work: &mut Work,
        job: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let started = Instant::now();
        let done = self.believed(stage, job())?;
        self.finished(stage, started, work);
        Ok(done)
    }

    pub(super) fn finished(&self, stage: Stage, started: Instant, work: &mut Work) {
        let wall = started.elapsed();
        work.stages.push((stage, wall));
        self.observer.event(Event::Finished { stage, wall });
    }

    /// The numbers of the whole mesh that the paper method needs, in two passes.
    fn survey(
        &self,
        (source, planned, ledger): (&dyn MeshSource, &Planned, &mut Ledger),
        thresholds: &PaperThresholds,
        work: &mut Work,
    ) -> Result<Extremes, Error> {
        let stage = Stage::Survey;
        let method = PaperMethod { plan: &planned.plan, sigma: self.params.sigma, thresholds };
        let mut omega = OmegaRange::default();
        let range = |tile: &mut Certified| method.omega_range(tile);
        let mesh = (source, planned, &mut *ledger);
        work.add_pass(self.over_tiles(mesh, stage, Pass::Omega, range, |taken: Taken<OmegaRange>| {
            omega = omega.join(taken.result);
            Ok(())
        })?);
        let mut salience = 0.0f64;
        let largest = |tile: &mut Certified| method.largest_salience(tile, omega);
        let mesh = (source, planned, ledger);
        work.add_pass(self.over_tiles(mesh, stage, Pass::Salience, largest, |taken: Taken<f64>| {
            salience = salience.max(taken.result);
            Ok(())
        })?);
        Ok(Extremes { omega, salience })
    }

    /// All tiles, stitched as they come in. Results hold fields if `with_fields`; `fields` wants them, if it is there.
    pub(super) fn tiles(
        &self,
        mesh: (&dyn MeshSource, &Planned, &mut Ledger),
        extremes: &Extremes,
        (mut fields, with_fields): (Option<&mut dyn FieldSink>, bool),
        work: &mut Work,
    ) -> Result<Stitcher, Error> {
        let plan = &mesh.1.plan;
        let rules = Rules::new(&plan.scale, &self.params);
        let memory = self.line_memory_for(mesh.2, plan.cells.len());
        let mut stitcher = Stitcher::new(rules, memory, &self.room.scratch.beside());
        self.take_groups(&mut stitcher)?;
        let covered = self.covered();
        let asked = Asked { fields: with_fields, shortcuts: self.limits.shortcuts };
        let compute = |tile: &mut Certified| compute(tile, plan, &self.params, extremes, asked);
        let pass =
            self.over_tiles(mesh, Stage::Tiles, Pass::Links, compute, |taken: Taken<TileResult>| {
                let Taken { result: tile, whole, kept, cell } = taken;
                if !kept {
                    work.add(&tile);
                }
                if let Some(fields) = &mut fields {
                    fields.take(&tile.fields)?;
                }
                if covered.contains(&cell) {
                    return Ok(());
                }
                stitcher.take(tile.share)?;
                Ok(whole.map_or(Ok(()), |cell| stitcher.done(cell))?)
            })?;
        work.add_pass(pass);
        Ok(stitcher)
    }

    /// How tiles are numbered.
    pub(super) fn numbering(&self) -> Numbering {
        if self.limits.shortcuts { Numbering::WhereItPays } else { Numbering::AsTheyCome }
    }

    /// What a tile must hold for the pass; the robust method has one pass only.
    pub(super) fn halo(&self, scale: &Scale, pass: Pass) -> Halo {
        match self.params.method {
            Method::Robust => Halo::Robust(self.reach_factor),
            Method::Paper(_) => {
                let reach = PaperReach::new(self.params.sigma, scale);
                Halo::Paper(reach.scaled(self.reach_factor), pass)
            }
        }
    }
}
