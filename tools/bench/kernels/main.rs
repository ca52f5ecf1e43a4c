//! What each step of the work on one tile takes, in nanoseconds of processor time for each face.
//!
//! In: nothing; the mesh is a city of the generator, the same in every run. Out: what `criterion` prints and keeps, and a
//! table of all steps beside what a bare implementation of each takes. All of it runs on one thread, and is measured by
//! the clock of the process: other work on the machine costs cache, not time.
//!
//! `cargo bench --bench kernels` runs everything, `cargo bench --bench kernels -- refine` what has that in its name.

mod clock;
mod finding;
#[allow(dead_code, unused_imports, reason = "the generator serves the example `gen`, too")]
#[path = "../../gen/mod.rs"]
mod generator;
mod joining;
mod reading;
#[allow(dead_code, reason = "tests look at more of it")]
#[path = "../../../tests/support/steps.rs"]
mod steps;
mod table;
mod town;
mod voting;

use anyhow::{Context, Result};
use clock::ProcessTime;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput};
use std::path::PathBuf;
use std::time::{Duration, SystemTime};
use town::Town;

/// Where benches are added.
type Group<'a> = BenchmarkGroup<'a, ProcessTime>;

/// A step takes from a millisecond to a quarter of a second for the whole mesh; medians of so many differ by a hundredth.
const SAMPLES: usize = 10;
/// For each step.
const MEASURED: Duration = Duration::from_secs(2);
const WARM_UP: Duration = Duration::from_millis(500);

fn main() -> Result<()> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("cannot start a thread")?;
    // Parallel loops run in the pool they are called in.
    one.install(run)
}

fn run() -> Result<()> {
    let started = SystemTime::now();
    let results = results()?;
    let mut criterion = Criterion::<WallTime>::default()
        .with_measurement(ProcessTime::new())
        .output_directory(&results)
        .sample_size(SAMPLES)
        .warm_up_time(WARM_UP)
        .measurement_time(MEASURED)
        .configure_from_args();
    let town = Town::build()?;
    let mut group = criterion.benchmark_group(table::GROUP);
    group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(town.faces()));
    reading::benches(&mut group, &town);
    voting::benches(&mut group, &town);
    finding::benches(&mut group, &town);
    joining::benches(&mut group, &town)?;
    group.finish();
    criterion.final_summary();
    print!("{}", table::markdown(&results, started, &town)?);
    Ok(())
}

/// `criterion` below the directory that this program was built in.
fn results() -> Result<PathBuf> {
    let this = std::env::current_exe().context("this program does not know where it is")?;
    // target/release/deps/kernels
    let target = this.ancestors().nth(3).context("this program is not in a build directory")?;
    Ok(target.join("criterion"))
}
