//! The directory: who may use it, and what is in it.
//!
//! It is made when the first file goes there. From then on it is locked, and the lock ends with the process, however that
//! ends. Only files with our names are ever touched, so that any directory can be chosen.

use super::durable::{self, Found, Purpose};
use super::job::{Identity, InputMark, JobRecord};
use super::log::{Label, Log, Place};
use super::planned::{self, DoneOutput, PlanRecord};
use super::removal::{remove_all, remove_directory, remove_file, remove_unfinished};
use super::results::{self, Found::Whole, Look, Results};
use super::{WorkspaceError, marker};
use crate::spill::{Ground, ScratchPlace, SpillError, point};
use serde::Serialize;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_64;

/// The names of all files but the marker; `mod.rs` says what is in them.
pub(super) const OUTPUTS: &str = "crease-outputs";
pub(super) const JOB: &str = "crease-job";
pub(super) const TILES: &str = "crease-tiles";
pub(super) const SORTED: &str = "crease-sorted";
pub(super) const MESH: &str = "crease-mesh.ply";
pub(super) const PLAN: &str = "crease-plan";
pub(super) const PLAN_JSON: &str = "plan.json";
pub(super) const DONE: &str = "crease-done";

const JOB_PURPOSE: Purpose = *b"CREASEjb";
const OUTPUTS_PURPOSE: Purpose = *b"CREASEou";
const PLAN_PURPOSE: Purpose = *b"CREASEpl";
const DONE_PURPOSE: Purpose = *b"CREASEdo";

/// A directory for what a run keeps. Clones are the same workspace. Nothing is on the disk before it is needed.
#[derive(Clone, Debug)]
pub struct Workspace(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    path: PathBuf,
    /// Whether the directory has a name of ours, so that it is ours whoever made it.
    own: bool,
    /// What tells this process from others, if many tasks work there: then nobody holds a lock while they do, and each result
    /// has a file of its own.
    attempt: Option<String>,
    state: Mutex<State>,
    /// Whether the marker is locked by us: what can be asked while the committer writes.
    held: AtomicBool,
    /// Tiles that are done, and all.
    done: AtomicU64,
    total: AtomicU64,
}

#[derive(Debug, Default)]
struct State {
    /// Locked as long as it is open.
    marker: Option<File>,
    /// Whether the directory goes with the workspace.
    made: bool,
    /// What the frames of the job carry.
    job: Option<u64>,
    store: Option<Store>,
}

/// Where the results of tiles are.
#[derive(Debug)]
enum Store {
    /// One after the other in one file of one process.
    Log(Log),
    /// Each in a file of its own.
    Files(Results),
}

impl Workspace {
    /// In the directory `path`, which need not exist.
    pub fn at(path: &Path) -> Workspace {
        Workspace::new(path.to_owned(), false, None)
    }

    /// Of a job that is planned for many tasks, of which this process is one, or the one that plans.
    pub fn planned(path: &Path) -> Workspace {
        Workspace::new(path.to_owned(), false, Some(planned::attempt()))
    }

    /// Beside `output`, in a directory with its name and `.crease-work` for its extension.
    pub fn beside(output: &Path) -> Workspace {
        Workspace::new(output.with_extension("crease-work"), true, None)
    }

    fn new(path: PathBuf, own: bool, attempt: Option<String>) -> Workspace {
        let [done, total] = [0; 2].map(AtomicU64::new);
        let held = AtomicBool::new(false);
        Workspace(Arc::new(Inner { path, own, attempt, state: Mutex::default(), held, done, total }))
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// What tells this process from others, if the job is planned for many tasks.
    pub fn attempt(&self) -> Option<&str> {
        self.0.attempt.as_deref()
    }

    /// Where the input is kept if tiles cannot be loaded from it as it is.
    pub fn mesh(&self) -> PathBuf {
        self.file(MESH)
    }

    /// Where the mesh in spatial order is kept.
    pub fn sorted(&self) -> PathBuf {
        self.file(SORTED)
    }

    /// Temporary files, which come into a directory of their own here.
    pub fn scratch(&self) -> ScratchPlace {
        ScratchPlace::on(Arc::new(self.clone()))
    }

    /// Takes possession of the workspace if there is one already, and removes what nobody can use any more. Returns
    /// whether there is one.
    ///
    /// # Errors
    /// If another process works there, or it is of another version.
    pub fn enter(&self) -> Result<bool, WorkspaceError> {
        self.enter_in(&mut self.lock())
    }

    fn enter_in(&self, state: &mut State) -> Result<bool, WorkspaceError> {
        if state.marker.is_some() {
            return Ok(true);
        }
        if self.0.attempt.is_some() {
            let there = marker::is_planned(&self.0.path)?;
            self.0.held.store(there, Ordering::Relaxed);
            return Ok(there);
        }
        let Some((file, made)) = marker::open(&self.0.path)? else { return Ok(false) };
        remove_unfinished(&self.0.path)?;
        *state = State { marker: Some(file), made, ..State::default() };
        self.0.held.store(true, Ordering::Relaxed);
        Ok(true)
    }

    /// Makes the workspace, unless it is there.
    ///
    /// # Errors
    /// If another process works there, or the system refuses.
    pub fn begin(&self) -> Result<(), WorkspaceError> {
        let mut state = self.lock();
        if self.enter_in(&mut state)? {
            return Ok(());
        }
        self.make(&mut state)
    }

    /// Makes the workspace for a job that is planned now, or goes on where a process has stopped that planned there. It is
    /// locked until this process ends.
    ///
    /// # Errors
    /// If another process plans there, or the system refuses.
    pub fn begin_plan(&self) -> Result<(), WorkspaceError> {
        self.make(&mut self.lock())?;
        if self.file(PLAN).exists() {
            // Another process was faster.
            return Err(WorkspaceError::InUse { path: self.0.path.clone() });
        }
        // No task can work here yet: whatever was left behind is nobody's.
        remove_unfinished(&self.0.path)?;
        remove_file(&self.file(JOB))
    }

    fn make(&self, state: &mut State) -> Result<(), WorkspaceError> {
        let path = &self.0.path;
        let made = match fs::create_dir(path) {
            Ok(()) => {
                let parent = path.parent().filter(|parent| *parent != Path::new(""));
                durable::sync_directory(parent.unwrap_or(Path::new(".")))?;
                true
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => false,
            Err(e) => return Err(WorkspaceError::io(path, "cannot create the directory")(e)),
        };
        point("workspace-made");
        let (file, made) = match self.0.attempt {
            Some(_) => (marker::create_planned(path)?, made),
            None => marker::create(path, made)?,
        };
        *state = State { marker: Some(file), made, ..State::default() };
        self.0.held.store(true, Ordering::Relaxed);
        point("workspace-begun");
        Ok(())
    }

    /// The job that was begun here. A damaged one is none: without it nobody knows what the results are of.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn job(&self) -> Result<Option<JobRecord>, WorkspaceError> {
        let path = self.file(JOB);
        let bytes = match durable::read(&path, JOB_PURPOSE)? {
            Found::Nothing => return Ok(None),
            Found::Damaged => Vec::new(),
            Found::Bytes(bytes) => bytes,
        };
        let job: Option<JobRecord> = postcard::from_bytes(&bytes).ok();
        match &job {
            Some(job) => self.lock().job = Some(id_of(job, &path)?),
            None if self.0.attempt.is_some() => return Err(self.damaged(path)),
            None => tracing::warn!("{}: damaged; the run starts from its beginning", path.display()),
        }
        Ok(job)
    }

    /// Gives up what was found here, if anything was, and begins `job`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn begin_job(&self, job: &JobRecord) -> Result<(), WorkspaceError> {
        self.begin()?;
        let path = self.file(JOB);
        // In this order: a log is never beside a job that is not its own. Sorted faces are those of the new job already.
        remove_file(&path)?;
        remove_file(&self.file(TILES))?;
        durable::write(&path, JOB_PURPOSE, &encode(job, &path)?)?;
        let id = id_of(job, &path)?;
        let mut state = self.lock();
        (state.job, state.store) = (Some(id), None);
        drop(state);
        point("job-begun");
        Ok(())
    }

    /// Replaces the record of the job by one that tells of another copy of the mesh; the results stay.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn update_job(&self, job: &JobRecord) -> Result<(), WorkspaceError> {
        let path = self.file(JOB);
        durable::write(&path, JOB_PURPOSE, &encode(job, &path)?)
    }

    /// Opens the results of the job and returns the places of those of all cells that are done; where each has a file of its
    /// own, of those among `cells`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn results(&self, cells: &[u32]) -> Result<Vec<Place>, WorkspaceError> {
        if self.0.attempt.is_some() {
            let found = self.files()?.look_at_all(cells, Look::Heads)?;
            let whole = |found| if let Whole(places) = found { places } else { Vec::new() };
            self.write_files()?;
            return Ok(found.into_iter().flat_map(whole).collect());
        }
        let mut state = self.lock();
        let path = self.file(TILES);
        let (log, contents) = Log::open(&path, state.job.unwrap_or(0))?;
        if contents.damaged > 0 {
            let n = contents.damaged;
            tracing::warn!("{}: {n} damaged: their tiles are done again", path.display());
        }
        // The name of the log survives a power cut as what is in it does.
        durable::sync_directory(&self.0.path)?;
        state.store = Some(Store::Log(log));
        Ok(contents.places)
    }

    /// Has results kept in files, without a look at those that are there.
    ///
    /// # Errors
    /// If there is no job.
    pub fn write_files(&self) -> Result<(), WorkspaceError> {
        let files = self.files()?;
        self.lock().store = Some(Store::Files(files));
        Ok(())
    }

    /// The results of a job that is planned for many tasks.
    ///
    /// # Errors
    /// If there is no job.
    pub fn files(&self) -> Result<Results, WorkspaceError> {
        let (Some(attempt), Some(job)) = (self.attempt(), self.lock().job) else {
            return Err(self.not_planned());
        };
        Ok(Results::open(&self.0.path, job, attempt))
    }

    /// Keeps the result of a tile. Without [`Workspace::results`] there is nothing to keep it in, and nothing happens.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn keep(&self, label: Label, result: &impl Serialize) -> Result<(), WorkspaceError> {
        let bytes = encode(result, &self.0.path)?;
        match &mut self.lock().store {
            Some(Store::Log(log)) => log.append(label, &bytes),
            Some(Store::Files(files)) => files.append(label, &bytes),
            None => Ok(()),
        }
    }

    /// A result, as bytes that `out` is replaced by.
    ///
    /// # Errors
    /// If it is not any more what [`Workspace::results`] saw.
    pub fn result<T: serde::de::DeserializeOwned>(&self, place: &Place) -> Result<T, WorkspaceError> {
        let mut bytes = Vec::new();
        let (whole, path) = match &self.lock().store {
            Some(Store::Log(log)) => (log.read(place, &mut bytes)?, self.file(TILES)),
            Some(Store::Files(files)) => (files.read(place, &mut bytes)?, files.path(place.label.cell)),
            None => (false, self.file(TILES)),
        };
        whole.then(|| postcard::from_bytes(&bytes).ok()).flatten().ok_or_else(|| WorkspaceError::Damaged {
            directory: self.0.path.clone(),
            path,
            reason: format!("the result at byte {} is not what it was when the run began", place.offset),
        })
    }

    /// Has all results survive a power cut.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&self) -> Result<(), WorkspaceError> {
        self.lock().sync()
    }

    /// Syncs what is kept, if the committer lets go of it within `patience`, and lets nobody write any more: the process
    /// ends now. What is being written when patience ends is cut off by the next run.
    pub fn freeze(&self, patience: Duration) {
        let started = Instant::now();
        loop {
            match self.0.state.try_lock() {
                Ok(mut state) => {
                    // The process ends whatever happens, and results that are not synced are lost to power cuts only.
                    let _ = state.sync();
                    std::mem::forget(state);
                    return;
                }
                Err(TryLockError::WouldBlock) if started.elapsed() < patience => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(_) => return,
            }
        }
    }

    /// Says how many tiles are done, of how many.
    pub fn count(&self, done: u64, total: u64) {
        self.0.done.store(done, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
    }

    /// One more tile is done.
    pub fn count_one(&self) {
        self.0.done.fetch_add(1, Ordering::Relaxed);
    }

    /// How many tiles are done, of how many; `None` if nothing is kept.
    pub fn counted(&self) -> Option<(u64, u64)> {
        let total = self.0.total.load(Ordering::Relaxed);
        (total > 0).then(|| (self.0.done.load(Ordering::Relaxed), total))
    }

    /// Notes that `outputs` get their names now: if the process dies in between, another run may replace them. Nothing
    /// happens if nothing was begun.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn announce(&self, outputs: &[PathBuf]) -> Result<(), WorkspaceError> {
        if self.lock().marker.is_none() && self.0.attempt.is_none() {
            return Ok(());
        }
        let path = self.file(OUTPUTS);
        // Bytes, because a path need not be text.
        let names: Vec<&[u8]> = outputs.iter().map(|output| output.as_os_str().as_encoded_bytes()).collect();
        durable::write(&path, OUTPUTS_PURPOSE, &encode(&names, &path)?)?;
        point("outputs-announced");
        Ok(())
    }

    /// Whether `output` was announced. Looks without taking possession.
    pub fn has_announced(&self, output: &Path) -> bool {
        let Ok(Found::Bytes(bytes)) = durable::read(&self.file(OUTPUTS), OUTPUTS_PURPOSE) else {
            return false;
        };
        let names: Vec<Vec<u8>> = postcard::from_bytes(&bytes).unwrap_or_default();
        names.iter().any(|name| name == output.as_os_str().as_encoded_bytes())
    }

    /// Forgets the outputs: they are all there, and nobody may replace them unasked.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn conclude(&self) -> Result<(), WorkspaceError> {
        match self.lock().marker.is_some() || self.0.attempt.is_some() {
            true => remove_file(&self.file(OUTPUTS)),
            false => Ok(()),
        }
    }

    /// Whether there is something that another run could go on with. Waits for nobody.
    pub fn is_worth_keeping(&self) -> bool {
        let any = |name| fs::metadata(self.file(name)).is_ok_and(|found| found.len() > 0);
        let kept = match self.0.attempt {
            Some(_) => any(PLAN),
            None => any(TILES) || any(SORTED),
        };
        self.0.held.load(Ordering::Relaxed) && any(JOB) && kept
    }

    /// Removes the workspace, if there is one: our files, and the directory if it was made for them and nothing else is in
    /// it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn remove(&self) -> Result<(), WorkspaceError> {
        let mut state = self.lock();
        if state.marker.is_none() {
            return Ok(());
        }
        remove_all(&self.0.path)?;
        if state.made || self.0.own {
            remove_directory(&self.0.path)?;
        }
        // The lock goes last.
        self.0.held.store(false, Ordering::Relaxed);
        *state = State::default();
        Ok(())
    }

    /// Writes down what the tasks of the job must know: from now on it is planned. `json` says it to their scheduler.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn plan(&self, record: &PlanRecord, json: &[u8]) -> Result<(), WorkspaceError> {
        let directory = self.file(results::DIRECTORY);
        fs::create_dir_all(&directory)
            .map_err(WorkspaceError::io(&directory, "cannot create the directory"))?;
        let path = self.file(PLAN);
        // Others may be asked for now.
        remove_file(&self.file(DONE))?;
        durable::write(&path, PLAN_PURPOSE, &encode(record, &path)?)?;
        point("planned");
        durable::write_plain(&self.file(PLAN_JSON), json)
    }

    /// What was planned; `None` if that was not finished.
    ///
    /// # Errors
    /// If it is damaged, was planned by another version of the program, or the system refuses.
    pub fn plan_record(&self) -> Result<Option<PlanRecord>, WorkspaceError> {
        let path = self.file(PLAN);
        let bytes = match durable::read(&path, PLAN_PURPOSE)? {
            Found::Nothing => return Ok(None),
            Found::Damaged => return Err(self.damaged(path)),
            Found::Bytes(bytes) => bytes,
        };
        let (version, now) = (postcard::take_from_bytes::<String>(&bytes), Identity::this_version());
        match version {
            Ok((version, _)) if version != now => Err(WorkspaceError::OtherJob {
                path: self.0.path.clone(),
                what: "the version of crease",
                before: version,
                now,
            }),
            _ => postcard::from_bytes(&bytes).map(Some).map_err(|_| self.damaged(path)),
        }
    }

    /// What the results of the job carry to be known.
    pub fn job_id(&self) -> u64 {
        self.lock().job.unwrap_or(0)
    }

    /// Notes that the job is done: `outputs`, as they are reached from here, with their lengths and checksums.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn note_done(&self, outputs: &[DoneOutput]) -> Result<(), WorkspaceError> {
        let path = self.file(DONE);
        durable::write(&path, DONE_PURPOSE, &encode(outputs, &path)?)
    }

    /// The outputs of a job that is done. A damaged note is none.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn done(&self) -> Result<Option<Vec<DoneOutput>>, WorkspaceError> {
        match durable::read(&self.file(DONE), DONE_PURPOSE)? {
            Found::Bytes(bytes) => Ok(postcard::from_bytes(&bytes).ok()),
            Found::Nothing | Found::Damaged => Ok(None),
        }
    }

    /// That nothing is planned here.
    pub fn not_planned(&self) -> WorkspaceError {
        WorkspaceError::NotPlanned { path: self.0.path.clone(), what: "there is no finished plan" }
    }

    fn damaged(&self, path: PathBuf) -> WorkspaceError {
        WorkspaceError::Damaged { directory: self.0.path.clone(), path, reason: "damaged".to_owned() }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path.join(name)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Every method leaves it whole, whoever panicked elsewhere.
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn sync(&mut self) -> Result<(), WorkspaceError> {
        match &mut self.store {
            Some(Store::Log(log)) => log.sync(),
            // Each was synced before it got its name.
            Some(Store::Files(_)) | None => Ok(()),
        }
    }
}

impl Ground for Workspace {
    fn ground(&self) -> Result<PathBuf, SpillError> {
        match self.begin() {
            Ok(()) => Ok(self.0.path.clone()),
            Err(WorkspaceError::Io { path, action, source }) => Err(SpillError::Io { path, action, source }),
            Err(other) => Err(SpillError::Io {
                path: self.0.path.clone(),
                action: "cannot be used",
                source: io::Error::other(other),
            }),
        }
    }
}

/// What the frames of a job carry: a checksum of all that its results depend on. Which copy of the mesh they were computed
/// from is not part of it, nor is the file: the fingerprint says what was in it.
fn id_of(job: &JobRecord, path: &Path) -> Result<u64, WorkspaceError> {
    let input = InputMark { file: None, ..job.identity.input };
    let identity = Identity { input, ..job.identity.clone() };
    Ok(xxh3_64(&encode(&(&identity, &job.cells), path)?))
}

fn encode(value: &(impl Serialize + ?Sized), path: &Path) -> Result<Vec<u8>, WorkspaceError> {
    let failed = WorkspaceError::io(path, "cannot encode");
    postcard::to_allocvec(value).map_err(|e| failed(io::Error::other(e)))
}
