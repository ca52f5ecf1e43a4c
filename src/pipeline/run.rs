//! The whole job: scan, plan, tiles, stitch; for the paper method, a survey of the tiles before the tiles.
//!
//! A loader, some workers and a committer are joined by bounded channels, so that at most a handful of tiles exist at any
//! time. All heavy work runs on one thread pool, which is what `--threads` sizes; the stage threads mostly wait.

use super::certify::{Certified, Halo, certify};
use super::compute::{TileResult, compute};
use super::events::{Event, Observer, Stage};
use super::paper::PaperMethod;
use crate::config::{Limits, Method, PaperThresholds, Params};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::TileId;
use crate::output::FieldSink;
use crate::partition::{PaperReach, Pass, Plan, Scan, scan};
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
    /// Tiles of the plan.
    pub tiles: u64,
    /// Faces owned by tiles.
    pub owned_faces: u64,
    /// Faces loaded for them, halos included; those of a survey do not count.
    pub loaded_faces: u64,
    /// How often a region had to grow because the mesh reached farther than expected.
    pub regrown: u64,
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
    line_memory: LineMemory,
    scratch: PathBuf,
}

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
        let (line_memory, scratch) = (LineMemory::UNBOUNDED, std::env::temp_dir());
        Ok(Job { source, params, limits, observer, pool, reach_factor: 1.0, line_memory, scratch })
    }

    /// Bounds the memory for the lines and for what is open between tiles. Lines that do not fit go to temporary files in a
    /// directory below `scratch`. Unless this is called, everything stays in memory.
    pub fn with_line_memory(mut self, memory: LineMemory, scratch: &Path) -> Self {
        self.line_memory = memory;
        self.scratch = scratch.to_owned();
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
    /// If the input is bad or a parameter does not suit it.
    pub fn plan(&self) -> Result<(Scan, Plan), Error> {
        self.observer.event(Event::Started { stage: Stage::Scan, total: self.source.face_count() });
        let progress = |faces| self.observer.event(Event::Advanced { stage: Stage::Scan, by: faces });
        let mut found = self.pool.install(|| scan(self.source, &progress))?;
        let plan = self.pool.install(|| Plan::new(&mut found, &self.params, self.limits.tiling))?;
        Ok((found, plan))
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
        let (scan, plan) = self.timed(Stage::Scan, &mut work, || self.plan())?;
        work.sigma = match self.params.sigma.is_zero() {
            true => 0.0,
            false => plan.scale.length(crate::config::method::SIGMA_EDGES),
        };
        work.tiles = plan.cells.len() as u64;
        let extremes = match &self.params.method {
            Method::Robust => Extremes::default(),
            Method::Paper(thresholds) => {
                self.observer.event(Event::Started { stage: Stage::Survey, total: 2 * work.tiles });
                let started = Instant::now();
                let extremes = self.survey(&plan, thresholds, &mut work)?;
                self.finished(Stage::Survey, started, &mut work);
                extremes
            }
        };
        self.observer.event(Event::Started { stage: Stage::Tiles, total: work.tiles });
        let started = Instant::now();
        let stitcher = self.tiles(&plan, &extremes, fields, &mut work)?;
        self.finished(Stage::Tiles, started, &mut work);
        self.observer.event(Event::Started { stage: Stage::Stitch, total: stitcher.links() });
        let Stitched { lines, defects, work: stitch } =
            self.timed(Stage::Stitch, &mut work, || Ok::<_, Error>(stitcher.finish()?))?;
        tracing::debug!(?stitch, "stitched");
        work.stitch = stitch;
        Ok(Detection { lines, scan, defects, work })
    }

    fn timed<T>(
        &self,
        stage: Stage,
        work: &mut Work,
        job: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let started = Instant::now();
        let done = job()?;
        self.finished(stage, started, work);
        Ok(done)
    }

    fn finished(&self, stage: Stage, started: Instant, work: &mut Work) {
        let wall = started.elapsed();
        work.stages.push((stage, wall));
        self.observer.event(Event::Finished { stage, wall });
    }

    /// The numbers of the whole mesh that the paper method needs, in two passes.
    fn survey(&self, plan: &Plan, thresholds: &PaperThresholds, work: &mut Work) -> Result<Extremes, Error> {
        let stage = Stage::Survey;
        let method = PaperMethod { plan, sigma: self.params.sigma, thresholds };
        let mut omega = OmegaRange::default();
        let range = |tile: &Certified| method.omega_range(tile);
        work.regrown += self.over_tiles(plan, stage, Pass::Omega, range, |range| {
            omega = omega.join(range);
            Ok(())
        })?;
        let mut salience = 0.0f64;
        let largest = |tile: &Certified| method.largest_salience(tile, omega);
        work.regrown += self.over_tiles(plan, stage, Pass::Salience, largest, |largest| {
            salience = salience.max(largest);
            Ok(())
        })?;
        Ok(Extremes { omega, salience })
    }

    /// All tiles, stitched as they come in.
    fn tiles(
        &self,
        plan: &Plan,
        extremes: &Extremes,
        mut fields: Option<&mut dyn FieldSink>,
        work: &mut Work,
    ) -> Result<Stitcher, Error> {
        let with_fields = fields.is_some();
        let rules = Rules::new(&plan.scale, &self.params);
        let mut stitcher = Stitcher::new(rules, self.line_memory, &self.scratch);
        let compute = |tile: &Certified| compute(tile, plan, &self.params, extremes, with_fields);
        let regrown = self.over_tiles(plan, Stage::Tiles, Pass::Links, compute, |tile: TileResult| {
            work.loaded_faces += tile.loaded_faces;
            work.owned_faces += tile.owned_faces;
            if let Some(fields) = &mut fields {
                fields.take(&tile.fields)?;
            }
            stitcher.take(tile.share)?;
            Ok(stitcher.done(tile.id)?)
        })?;
        work.regrown += regrown;
        Ok(stitcher)
    }

    /// What a tile must hold for the pass; the robust method has one pass only.
    fn halo(&self, plan: &Plan, pass: Pass) -> Halo {
        match self.params.method {
            Method::Robust => Halo::Robust(self.reach_factor),
            Method::Paper(_) => {
                let reach = PaperReach::new(self.params.sigma, &plan.scale);
                Halo::Paper(reach.scaled(self.reach_factor), pass)
            }
        }
    }

    /// One pass: loader, workers and committer. `compute` makes something of each tile, which `take` gets, tiles in any
    /// order. Returns how often a region had to grow.
    fn over_tiles<T: Send>(
        &self,
        plan: &Plan,
        stage: Stage,
        pass: Pass,
        compute: impl Fn(&Certified) -> T + Sync,
        mut take: impl FnMut(T) -> Result<(), Error>,
    ) -> Result<u64, Error> {
        let halo = self.halo(plan, pass);
        let (to_workers, from_loader) = bounded::<Certified>(WAITING_TILES);
        let (to_committer, results) = bounded::<Result<T, Error>>(WAITING_TILES);
        let regrown = AtomicU32::new(0);
        std::thread::scope(|scope| {
            let failed = to_committer.clone();
            scope.spawn(|| self.load_tiles(plan, &halo, to_workers, failed, &regrown));
            for _ in 0..WORKERS {
                let (from_loader, to_committer) = (from_loader.clone(), to_committer.clone());
                scope.spawn(|| self.work_on_tiles(&compute, from_loader, to_committer));
            }
            // What is left here would keep the channels open when everybody else has gone.
            drop((from_loader, to_committer));
            let outcome: Result<(), Error> = results.iter().try_for_each(|result| {
                take(result?)?;
                self.observer.event(Event::Advanced { stage, by: 1 });
                Ok(())
            });
            // Hanging up is how the other stages learn that it is over.
            drop(results);
            outcome
        })?;
        Ok(u64::from(regrown.into_inner()))
    }

    fn load_tiles<T>(
        &self,
        plan: &Plan,
        halo: &Halo,
        to_workers: Sender<Certified>,
        failed: Sender<Result<T, Error>>,
        regrown: &AtomicU32,
    ) {
        // Noise is much the same everywhere in a scan: what one tile needed is the best guess for the next.
        let mut rounds_hint = 0;
        for id in (0..plan.cells.len() as u32).map(TileId) {
            let loaded = guarded(id, || {
                self.pool
                    .install(|| certify(self.source, plan, halo, id, halo.margin(plan, rounds_hint)))
                    .map_err(Error::from)
            });
            match loaded {
                Ok(tile) => {
                    rounds_hint = tile.most_rounds;
                    regrown.fetch_add(tile.regrown, Ordering::Relaxed);
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

    fn work_on_tiles<T: Send>(
        &self,
        compute: &(impl Fn(&Certified) -> T + Sync),
        from_loader: Receiver<Certified>,
        to_committer: Sender<Result<T, Error>>,
    ) {
        for tile in from_loader {
            let result = guarded(tile.id, || Ok(self.pool.install(|| compute(&tile))));
            drop(tile);
            if to_committer.send(result).is_err() {
                return;
            }
        }
    }
}

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
