//! The whole job: scan, plan, tiles, stitch; for the paper method, a survey of the tiles before the tiles.
//!
//! A loader, some workers and a committer are joined by bounded channels, so that at most a handful of tiles exist at any
//! time. All heavy work runs on one thread pool, which is what `--threads` sizes; the stage threads mostly wait.

use super::admit::{Admission, Admitted, Next};
use super::budget::{Budget, Permit};
use super::certify::Halo;
use super::compute::{TileResult, compute};
use super::events::{Event, Observer, Stage};
use super::order::{Mesh, ORDER_MEMORY, Rewriter, Workspace};
use super::paper::PaperMethod;
use super::planned::Planned;
use crate::config::{Limits, Method, NO_LIMIT, PaperThresholds, Params};
use crate::error::Error;
use crate::input::{InputError, MeshSource};
use crate::mesh::TileId;
use crate::output::FieldSink;
use crate::partition::{PaperReach, Pass, Scale, Scan, scan};
use crate::refine::{Extremes, OmegaRange};
use crate::stitch::{Defects, LineMemory, LineSet, Rules, StitchWork, Stitched, Stitcher, StoredLines};
use crossbeam::channel::{Receiver, Sender, bounded};
use rayon::ThreadPool;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
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
    /// Faces owned by tiles.
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
    /// Wall time of each stage.
    pub stages: Vec<(Stage, Duration)>,
}

/// A job over a source. Built once, run once.
pub struct Job<'a> {
    source: &'a dyn MeshSource,
    params: Params,
    limits: Limits,
    observer: &'a dyn Observer,
    pool: ThreadPool,
    reach_factor: f64,
    workspace: Workspace,
    line_memory: LineMemory,
}

/// Share of the memory that lines may use, and what is open between tiles.
pub(super) const LINE_SHARE: u64 = 6;
/// Share of the memory that sorting the mesh may use: what was planned is there at the same time.
const ORDER_SHARE: u64 = 2;
/// Tiles waiting between two stages. One keeps the workers busy while the loader reads on; more would only cost memory.
const WAITING_TILES: usize = 1;
/// Tiles worked on at a time: while one is in a serial part, the other has the pool.
const WORKERS: usize = 2;

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
        let workspace = Workspace {
            directory: PathBuf::from("."),
            force: false,
            memory: ORDER_MEMORY.min(limits.memory / ORDER_SHARE),
        };
        let line_memory = match limits.memory {
            NO_LIMIT => LineMemory::UNBOUNDED,
            memory => LineMemory::halves(memory / LINE_SHARE),
        };
        Ok(Job { source, params, limits, observer, pool, reach_factor: 1.0, workspace, line_memory })
    }

    /// Chooses where temporary files go, if some are needed; `force` begins even if the disk seems too small. The default
    /// is the current directory.
    pub fn with_workspace(mut self, directory: &Path, force: bool) -> Self {
        self.workspace.directory = directory.to_owned();
        self.workspace.force = force;
        self
    }

    /// Chooses how many bytes of memory sorting the mesh may use; 256 MiB, or half of what is allowed, if nothing is said.
    pub fn with_order_memory(mut self, bytes: u64) -> Self {
        self.workspace.memory = bytes;
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
    fn believed<T>(&self, stage: Stage, result: Result<T, Error>) -> Result<T, Error> {
        match self.source.unchanged() {
            Ok(()) => result,
            Err(error @ InputError::Changed { .. }) => Err(Error::Changed { stage: stage.name(), error }),
            // That the look itself failed hides no other error.
            Err(error) => result.and(Err(error.into())),
        }
    }

    fn plan_of(&self, source: &dyn MeshSource) -> Result<Planned, Error> {
        self.observer.event(Event::Started { stage: Stage::Scan, total: self.source.face_count() });
        let progress = |faces| self.observer.event(Event::Advanced { stage: Stage::Scan, by: faces });
        self.pool.install(|| {
            let scan = scan(source, self.limits.memory, &progress)?;
            let halo = |scale: &Scale| self.halo(scale, Pass::Links);
            Planned::new(source, scan, &self.params, &self.limits, halo)
        })
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
        let (mesh, planned) = self.prepare(&mut work)?;
        let (source, plan) = (mesh.source(), &planned.plan);
        work.sigma = match self.params.sigma.is_zero() {
            true => 0.0,
            false => plan.scale.length(crate::config::method::SIGMA_EDGES),
        };
        let tiles = plan.cells.len() as u64;
        let extremes = match &self.params.method {
            Method::Robust => Extremes::default(),
            Method::Paper(thresholds) => {
                self.observer.event(Event::Started { stage: Stage::Survey, total: 2 * tiles });
                let started = Instant::now();
                let extremes = self.survey(source, &planned, thresholds, &mut work);
                let extremes = self.believed(Stage::Survey, extremes)?;
                self.finished(Stage::Survey, started, &mut work);
                extremes
            }
        };
        self.observer.event(Event::Started { stage: Stage::Tiles, total: tiles });
        let started = Instant::now();
        let stitcher = self.tiles(source, &planned, &extremes, fields, &mut work);
        let stitcher = self.believed(Stage::Tiles, stitcher)?;
        self.finished(Stage::Tiles, started, &mut work);
        // Temporary files go before the results come.
        drop(mesh);
        self.observer.event(Event::Started { stage: Stage::Stitch, total: stitcher.links() });
        let Stitched { lines, defects, work: stitch } =
            self.timed(Stage::Stitch, &mut work, || Ok::<_, Error>(stitcher.finish()?))?;
        tracing::debug!(?stitch, "stitched");
        work.stitch = stitch;
        Ok(Detection { lines, scan: planned.scan, defects, work })
    }

    /// Scan, plan, and the mesh in an order that tiles can be loaded from.
    fn prepare(&self, work: &mut Work) -> Result<(Mesh<'a>, Planned), Error> {
        let rewriter = Rewriter {
            source: self.source,
            limits: &self.limits,
            workspace: &self.workspace,
            pool: &self.pool,
            observer: self.observer,
        };
        let mut rewrite = rewriter.look()?;
        let joined = match rewrite.joins() {
            true => Some(self.timed(Stage::Order, work, || rewriter.join(&mut rewrite))?),
            false => None,
        };
        let source = joined.as_ref().map_or(self.source, |joined| joined as &dyn MeshSource);
        let mut planned = self.timed(Stage::Scan, work, || self.plan_of(source))?;
        work.rewritten = rewriter.sorts(&rewrite, &planned.scan, &planned.plan);
        let mesh = match (work.rewritten, joined) {
            (true, joined) => {
                let store =
                    self.timed(Stage::Order, work, || rewriter.sort(&mut rewrite, joined, &planned.scan))?;
                planned.plan = planned.plan.over(store.summaries());
                Mesh::Sorted(store)
            }
            (false, Some(joined)) => Mesh::Joined(joined),
            (false, None) => Mesh::File(self.source),
        };
        // Of no use any more.
        planned.scan.sample = Vec::new();
        work.temporary_bytes = rewrite.peak_bytes();
        Ok((mesh, planned))
    }

    fn timed<T>(
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

    fn finished(&self, stage: Stage, started: Instant, work: &mut Work) {
        let wall = started.elapsed();
        work.stages.push((stage, wall));
        self.observer.event(Event::Finished { stage, wall });
    }

    /// The numbers of the whole mesh that the paper method needs, in two passes.
    fn survey(
        &self,
        source: &dyn MeshSource,
        planned: &Planned,
        thresholds: &PaperThresholds,
        work: &mut Work,
    ) -> Result<Extremes, Error> {
        let stage = Stage::Survey;
        let method = PaperMethod { plan: &planned.plan, sigma: self.params.sigma, thresholds };
        let mut omega = OmegaRange::default();
        let range = |tile: &Admitted| method.omega_range(&tile.tile);
        work.regrown += self.over_tiles((source, planned), stage, Pass::Omega, range, |range, _| {
            omega = omega.join(range);
            Ok(())
        })?;
        let mut salience = 0.0f64;
        let largest = |tile: &Admitted| method.largest_salience(&tile.tile, omega);
        work.regrown +=
            self.over_tiles((source, planned), stage, Pass::Salience, largest, |largest, _| {
                salience = salience.max(largest);
                Ok(())
            })?;
        Ok(Extremes { omega, salience })
    }

    /// All tiles, stitched as they come in.
    fn tiles(
        &self,
        source: &dyn MeshSource,
        planned: &Planned,
        extremes: &Extremes,
        mut fields: Option<&mut dyn FieldSink>,
        work: &mut Work,
    ) -> Result<Stitcher, Error> {
        let with_fields = fields.is_some();
        let plan = &planned.plan;
        let rules = Rules::new(&plan.scale, &self.params);
        let mut stitcher = Stitcher::new(rules, self.line_memory, &self.workspace.directory);
        let compute = |tile: &Admitted| compute(&tile.tile, plan, &self.params, extremes, with_fields);
        let mesh = (source, planned);
        let regrown =
            self.over_tiles(mesh, Stage::Tiles, Pass::Links, compute, |tile: TileResult, whole| {
                work.tiles += 1;
                work.loaded_faces += tile.loaded_faces;
                work.owned_faces += tile.owned_faces;
                if let Some(fields) = &mut fields {
                    fields.take(&tile.fields)?;
                }
                stitcher.take(tile.share)?;
                Ok(whole.map_or(Ok(()), |cell| stitcher.done(cell))?)
            })?;
        work.regrown += regrown;
        Ok(stitcher)
    }

    /// What a tile must hold for the pass; the robust method has one pass only.
    fn halo(&self, scale: &Scale, pass: Pass) -> Halo {
        match self.params.method {
            Method::Robust => Halo::Robust(self.reach_factor),
            Method::Paper(_) => {
                let reach = PaperReach::new(self.params.sigma, scale);
                Halo::Paper(reach.scaled(self.reach_factor), pass)
            }
        }
    }

    /// One pass: loader, workers and committer. `compute` makes something of each tile, which `take` gets, tiles in any
    /// order, with the cell that has come to its end with it, if one has. Returns how often a region had to grow.
    fn over_tiles<T: Send>(
        &self,
        (source, planned): (&dyn MeshSource, &Planned),
        stage: Stage,
        pass: Pass,
        compute: impl Fn(&Admitted) -> T + Sync,
        mut take: impl FnMut(T, Option<TileId>) -> Result<(), Error>,
    ) -> Result<u64, Error> {
        let plan = &planned.plan;
        let halo = self.halo(&plan.scale, pass);
        let budget = Budget::new(planned.tile_memory);
        let pieces: Vec<AtomicU32> = plan.cells.iter().map(|_| AtomicU32::new(1)).collect();
        let admission = Admission::new(source, plan, &halo, &budget, &self.pool, &pieces, planned.rounds);
        let (to_workers, from_loader) = bounded::<Box<Admitted>>(WAITING_TILES);
        let (to_committer, results) = bounded::<Outcome<T>>(WAITING_TILES);
        let mut regrown = 0;
        std::thread::scope(|scope| {
            let failed = to_committer.clone();
            scope.spawn(|| self.load_tiles(admission, stage, to_workers, failed));
            for _ in 0..WORKERS {
                let (from_loader, to_committer) = (from_loader.clone(), to_committer.clone());
                scope.spawn(|| self.work_on_tiles(&compute, from_loader, to_committer));
            }
            // What is left here would keep the channels open when everybody else has gone.
            drop((from_loader, to_committer));
            let outcome: Result<(), Error> = results.iter().try_for_each(|result| {
                let done = result?;
                regrown += u64::from(done.regrown);
                let rest = pieces[done.id.0 as usize].fetch_sub(1, Ordering::Relaxed) - 1;
                take(done.result, (rest == 0).then_some(done.id))?;
                self.observer.event(Event::Advanced { stage, by: 1 });
                Ok(())
            });
            // Hanging up is how the other stages learn that it is over.
            drop(results);
            outcome
        })?;
        Ok(regrown)
    }

    fn load_tiles<'b, T>(
        &self,
        mut admission: Admission<'_, 'b>,
        stage: Stage,
        to_workers: Sender<Box<Admitted<'b>>>,
        failed: Sender<Outcome<'b, T>>,
    ) {
        loop {
            match guarded(admission.next_id(), || self.believed(stage, admission.next())) {
                Ok(None) => return,
                Ok(Some(Next::Cut)) => self.observer.event(Event::Grown { stage, by: 1 }),
                Ok(Some(Next::Tile(tile))) => {
                    if to_workers.send(tile).is_err() {
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
        compute: &(impl Fn(&Admitted) -> T + Sync),
        from_loader: Receiver<Box<Admitted<'b>>>,
        to_committer: Sender<Outcome<'b, T>>,
    ) {
        for admitted in from_loader {
            let result = guarded(admitted.id, || Ok(self.pool.install(|| compute(&admitted))));
            let Admitted { id, tile, permit } = *admitted;
            let regrown = tile.regrown;
            drop(tile);
            let done = result.map(|result| Done { id, result, regrown, _permit: permit });
            if to_committer.send(done).is_err() {
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
