//! Builds cases, runs the methods on them, scores the lines. In: cases; out: [`Results`] in the order of the cases,
//! whatever order they were worked on.

use super::baselines;
use super::case::{Case, Problem, write};
use super::generator::ply;
use super::lines_file;
use super::methods::Method;
use super::metric::{Lines, score};
use super::program::{Answer, Program};
use super::results::{Outcome, Record, Results};
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is run on every case.
pub struct Bench<'a> {
    /// The program.
    pub program: &'a Program,
    /// The ways to run it.
    pub methods: &'a [Method],
    /// Whether to run the baselines too. They take longer than the program.
    pub baselines: bool,
    /// How many cases are worked on at the same time.
    pub jobs: usize,
    /// Where meshes, truth and lines are kept as files; without it they are removed as soon as they are scored.
    pub keep: Option<&'a Path>,
}

/// Where a thread puts what came of a case.
type Slot = Mutex<Option<Result<Vec<Record>>>>;

impl Bench<'_> {
    /// Works on all cases; `progress` hears of each that is done.
    ///
    /// # Errors
    /// The first error in the order of the cases.
    pub fn run(&self, cases: &[Case], progress: &(dyn Fn(usize, &Case) + Sync)) -> Result<Results> {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let queue: Vec<(&Case, Slot)> = cases.iter().map(|case| (case, Mutex::new(None))).collect();
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.clamp(1, cases.len().max(1)) {
                scope.spawn(|| {
                    while let Some((case, slot)) = queue.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = self.case(case).with_context(|| case.stem());
                        if let Ok(mut slot) = slot.lock() {
                            *slot = Some(result);
                        }
                        progress(done.fetch_add(1, Ordering::Relaxed) + 1, case);
                    }
                });
            }
        });
        let mut records = Vec::new();
        for (case, slot) in queue {
            let result =
                slot.into_inner().ok().flatten().with_context(|| format!("{} was lost", case.stem()))?;
            records.extend(result?);
        }
        Ok(Results { program: self.program.version.clone(), extra: self.program.extra.clone(), records })
    }

    fn case(&self, case: &Case) -> Result<Vec<Record>> {
        let scratch = tempfile::tempdir()?;
        let directory = self.keep.unwrap_or(scratch.path());
        let problem = case.build(directory)?;
        if self.keep.is_some() {
            if !problem.path.starts_with(directory) {
                let copy = directory.join(format!("{}.ply", case.stem()));
                fs::copy(&problem.path, &copy).with_context(|| format!("cannot write {}", copy.display()))?;
            }
            let curve = |curve: &Vec<u32>| curve.iter().map(|&v| problem.truth.points[v as usize]).collect();
            let curves: Vec<Vec<_>> = problem.truth.curves.iter().map(curve).collect();
            write(&case.truth_path(directory), |out| ply::write_lines(out, &curves))?;
        }
        let record = |method: &str, chosen, outcome| Record {
            set: case.set.clone(),
            mesh: case.mesh.clone(),
            noise: case.noise.clone(),
            seed: case.seed,
            vertices: problem.mesh.positions.len(),
            faces: problem.mesh.faces.len(),
            median_side: problem.h,
            method: method.to_owned(),
            chosen,
            outcome,
        };
        let mut records = Vec::new();
        for method in self.methods {
            let lines = case.lines_path(directory, method.name);
            let outcome = match self.detect(&problem, &lines, method)? {
                Ok(lines) => Outcome::Scored(score(&lines, &problem.truth, problem.h)),
                Err(refusal) => Outcome::Refused(refusal),
            };
            records.push(record(method.name, None, outcome));
        }
        if self.baselines {
            for found in baselines::all(&problem.mesh, &problem.truth, problem.h) {
                let score = score(&found.lines, &problem.truth, problem.h);
                records.push(record(found.name, Some(found.chosen), Outcome::Scored(score)));
            }
        }
        Ok(records)
    }

    /// The lines, or what the program said when it refused.
    fn detect(&self, problem: &Problem, lines: &Path, method: &Method) -> Result<Result<Lines, String>> {
        match self.program.detect(&problem.path, lines, method.arguments)? {
            Answer::Refused(reason) => Ok(Err(reason)),
            Answer::Done => {
                let found = lines_file::read(lines)?;
                if self.keep.is_none() {
                    fs::remove_file(lines)?;
                }
                Ok(Ok(found))
            }
        }
    }
}
