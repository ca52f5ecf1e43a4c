//! How long the tiles will take, before any of them is begun.
//!
//! In: a plan. Out: the processor time for a face, measured on pieces of the very mesh by the very machine: what a face costs
//! depends on the noise, whose rounds of refinement make up a factor of four between a clean city and a rough scan. Each
//! piece is worked on as if it were a mesh of its own; what it finds is thrown away.

use super::events::Silent;
use super::planned::Planned;
use super::run::Job;
use super::sizing::faces_in;
use crate::config::{Limits, NO_LIMIT, Params, Sigma, Tiling, method};
use crate::error::Error;
use crate::input::{MemorySource, MeshSource};
use crate::partition::{CubeBox, LoadError, Plan, Region, load};
use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// Pieces that are worked on. What is rough in one place of a scan is smooth in another.
const PIECES: usize = 6;
/// Faces that a piece should have. At the rim of a piece, some ten edges wide, less is done; of so many faces on a surface
/// it is a fifth.
const PIECE_FACES: u64 = 12_000;
/// No piece has more.
const MOST_FACES: u64 = 4 * PIECE_FACES;
/// A mesh of no more faces is worked on as a whole: the pieces have as many, since blocks of faces tell only roughly how many
/// there are in a place.
const WHOLE: u64 = 120_000;
/// Widest piece, in cubes of the lattice on each side of its middle: in a place with next to nothing the whole mesh would be
/// one piece.
const WIDEST: i64 = 64;
/// Share of the time for which the threads are busy: 0.79 to 0.90 on two threads (`docs/BENCHMARKS.md`, section 3).
const BUSY: f64 = 0.85;
/// What a face in a halo costs, compared with one that its tile owns: work is cut back ring by ring, and lines are built by the
/// owner alone. Measured, with halos of two to seven times the mesh: 0.33 on a city, 0.53 on a part, 0.55 on an airborne scan.
const HALO_COST: f64 = 0.5;

/// What working on some pieces of the mesh took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Pieces.
    pub pieces: u64,
    /// Their faces.
    pub faces: u64,
    /// Processor time of all threads.
    pub cpu: Duration,
}

impl Calibration {
    /// Processor time for a face that a tile owns, in seconds.
    pub fn cpu_per_face(&self) -> f64 {
        self.cpu.as_secs_f64() / self.faces.max(1) as f64
    }

    /// About how long a mesh of so many faces takes, of which tiles load `loaded`, on so many threads that nobody else wants.
    pub fn wall(&self, faces: u64, loaded: u64, threads: usize) -> Duration {
        let work = faces as f64 + HALO_COST * loaded.saturating_sub(faces) as f64;
        let seconds = self.cpu_per_face() * work / (threads.max(1) as f64 * BUSY);
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}

impl Job<'_> {
    /// Works on some pieces of the mesh to see how long they take. `None` if there is no piece to work on.
    ///
    /// # Errors
    /// If the source fails.
    pub fn calibrate(&self, planned: &Planned) -> Result<Option<Calibration>, Error> {
        let plan = &planned.plan;
        let (regions, most) = regions(planned);
        let most = most.min(faces_in(planned.tile_memory));
        let params = Params { sigma: Sigma::Length(plan.scale.length(method::SIGMA_EDGES)), ..self.params };
        let (mut pieces, mut faces, mut cpu) = (0, 0, Duration::ZERO);
        for region in regions {
            let loaded = self.pool.install(|| load(self.source, plan, &region, most, self.numbering()));
            let mesh = match loaded {
                Ok(mesh) => mesh,
                // A pile; it says nothing about other places.
                Err(LoadError::TooManyFaces { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            let source = MemorySource::new(&mesh.positions, &mesh.corners)?;
            if let Some(time) = timed(&source, params, self.limits.threads) {
                (pieces, faces, cpu) = (pieces + 1, faces + source.face_count(), cpu + time);
            }
        }
        Ok((faces > 0).then_some(Calibration { pieces, faces, cpu }))
    }
}

/// Processor time for `source` as a mesh of its own; `None` if it is none, or sigma does not suit it.
fn timed(source: &MemorySource<'_>, params: Params, threads: usize) -> Option<Duration> {
    let limits = Limits { threads, tiling: Tiling::InCore, memory: NO_LIMIT, ..Limits::default() };
    let job = Job::new(source, params, limits, &Silent).ok()?;
    let before = cpu_time();
    job.run_stored(None).ok()?;
    Some(cpu_time().saturating_sub(before))
}

/// Processor time of all threads of this process up to now, in nanoseconds as far as the system counts them.
fn cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.try_into().unwrap_or(0), time.tv_nsec.try_into().unwrap_or(0))
}

/// Places spread over the faces of the mesh, each as wide as it takes; all of a small mesh. With the most faces that each may
/// have.
fn regions(planned: &Planned) -> (Vec<Region>, u64) {
    let (plan, scan) = (&planned.plan, &planned.scan);
    if scan.faces <= WHOLE {
        return (vec![Region::new(CubeBox::EVERYTHING)], WHOLE);
    }
    let step = (scan.sample.len() / PIECES).max(1);
    let middles = scan.sample.iter().skip(step / 2).step_by(step).take(PIECES);
    let pieces = middles.map(|&p| Region::new(wide_enough(plan, &CubeBox::around(plan.lattice.cube_of(p)))));
    (pieces.collect(), MOST_FACES)
}

fn wide_enough(plan: &Plan, middle: &CubeBox) -> CubeBox {
    let enough = |range: &CubeBox| plan.faces_near(range) >= PIECE_FACES;
    (1..WIDEST).map(|cubes| middle.grown(cubes)).find(enough).unwrap_or_else(|| middle.grown(WIDEST))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_rate_becomes_a_time() {
        let calibration = Calibration { pieces: 2, faces: 1000, cpu: Duration::from_millis(3) };
        assert!((calibration.cpu_per_face() - 3e-6).abs() < 1e-12);
        let wall = |faces, loaded| calibration.wall(faces, loaded, 2).as_secs_f64();
        assert!((wall(1_700_000, 1_700_000) - 3.0).abs() < 1e-6);
        assert!((wall(1_000_000, 2_400_000) - 3.0).abs() < 1e-6);
        let never = Calibration { faces: 1, cpu: Duration::MAX, ..calibration };
        assert_eq!(never.wall(u64::MAX, u64::MAX, 0), Duration::MAX);
    }

    #[test]
    fn a_mesh_is_worked_on_for_a_moment() {
        let side = 40u32;
        let points: Vec<DVec3> =
            (0..side * side).map(|i| DVec3::new(f64::from(i % side), f64::from(i / side), 0.0)).collect();
        let faces: Vec<[u32; 3]> = (0..side - 1)
            .flat_map(|y| (0..side - 1).map(move |x| y * side + x))
            .flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]])
            .collect();
        let source = MemorySource::new(&points, &faces).expect("a grid");
        let job = Job::new(&source, Params::default(), Limits::default(), &Silent).expect("a job");
        let planned = job.plan().expect("a plan");
        let calibration = job.calibrate(&planned).expect("faces").expect("a piece");
        assert_eq!((calibration.pieces, calibration.faces), (1, faces.len() as u64));
        assert!(calibration.cpu > Duration::ZERO);
    }
}
