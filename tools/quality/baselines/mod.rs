//! What simpler methods find on the same mesh. In: a mesh with its truth; out: lines, each a loose edge.
//!
//! All but the first choose their parameters by looking at the truth, for each mesh anew: no user can do that, so
//! they are bounds of what such a method could reach, not competitors. Edges are drawn where they are in the mesh,
//! also if their angles were measured after smoothing.

mod bilateral;
mod sweep;
mod taubin;
#[cfg(test)]
mod tests;

use super::mesh::{Mesh, fold_angle_deg};
use super::metric::{Lines, Truth};
use bilateral::Bilateral;
use glam::DVec3;
use sweep::{Choice, Sweep};
use taubin::Taubin;

/// Names of the baselines, in the order of [`all`].
pub const NAMES: [&str; 4] = ["dihedral 30", "dihedral*", "Taubin*", "bilateral*"];

/// A usual fixed threshold, degrees.
const FIXED_DEG: f64 = 30.0;
/// Numbers of iterations that are tried: from hardly any to far too many, each about half as many again.
const TAUBIN_ITERATIONS: [usize; 11] = [1, 2, 3, 4, 6, 9, 13, 20, 30, 50, 80];
/// The paper uses up to 50, with a narrow kernel.
const BILATERAL_ITERATIONS: [usize; 9] = [1, 2, 3, 5, 8, 12, 20, 30, 50];
/// Widths sigma_s that are tried, as chords; the paper's range is 0.2 to 0.6.
const BILATERAL_RANGES: [f64; 6] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];

/// What a baseline found.
#[derive(Clone, Debug)]
pub struct Found {
    /// One of [`NAMES`].
    pub name: &'static str,
    /// Loose edges.
    pub lines: Lines,
    /// The parameters that were chosen.
    pub chosen: String,
}

/// All baselines on one mesh. `h` is its median side.
pub fn all(mesh: &Mesh, truth: &Truth, h: f64) -> Vec<Found> {
    let sweep = Sweep::new(mesh, truth, h);
    let plain = angles(&sweep, &mesh.face_normals());
    let best = sweep.best(&plain);
    let (taubin, after) = best_taubin(mesh, &sweep);
    let (bilateral, filtered) = best_bilateral(mesh, &sweep);
    let found = |name: usize, angles: &[f64], threshold: f64, how: String| Found {
        name: NAMES[name],
        lines: sweep.lines(mesh, angles, threshold),
        chosen: format!("{how}threshold {threshold:.2} deg"),
    };
    vec![
        found(0, &plain, FIXED_DEG, String::new()),
        found(1, &plain, best.threshold_deg, String::new()),
        found(2, &taubin.angles, taubin.choice.threshold_deg, format!("{after} iterations, ")),
        found(
            3,
            &bilateral.angles,
            bilateral.choice.threshold_deg,
            format!("sigma_s {}, {} iterations, ", filtered.0, filtered.1),
        ),
    ]
}

/// The best threshold of some smoothed version of a mesh.
struct Tuned {
    angles: Vec<f64>,
    choice: Choice,
}

/// The angle at each edge, degrees.
fn angles(sweep: &Sweep, normals: &[DVec3]) -> Vec<f64> {
    sweep
        .hinges
        .iter()
        .map(|h| fold_angle_deg(normals[h.faces[0] as usize], normals[h.faces[1] as usize]))
        .collect()
}

/// Keeps the better one; of equals the first.
fn keep<P>(best: &mut Option<(Tuned, P)>, sweep: &Sweep, normals: &[DVec3], parameters: P) {
    let angles = angles(sweep, normals);
    let choice = sweep.best(&angles);
    if best.as_ref().is_none_or(|(tuned, _)| choice.quality.f1 > tuned.choice.quality.f1) {
        *best = Some((Tuned { angles, choice }, parameters));
    }
}

/// The best number of iterations.
fn best_taubin(mesh: &Mesh, sweep: &Sweep) -> (Tuned, usize) {
    let mut best = None;
    let mut taubin = Taubin::new(mesh);
    let mut done = 0;
    for wanted in TAUBIN_ITERATIONS {
        while done < wanted {
            taubin.iterate();
            done += 1;
        }
        let smooth = Mesh { positions: taubin.positions.clone(), faces: mesh.faces.clone() };
        keep(&mut best, sweep, &smooth.face_normals(), wanted);
    }
    best.expect("the list of iterations is not empty")
}

/// The best width and number of iterations.
fn best_bilateral(mesh: &Mesh, sweep: &Sweep) -> (Tuned, (f64, usize)) {
    let mut best = None;
    let start = Bilateral::new(mesh);
    for range in BILATERAL_RANGES {
        let mut bilateral = start.clone();
        let mut done = 0;
        for wanted in BILATERAL_ITERATIONS {
            while done < wanted {
                bilateral.iterate(range);
                done += 1;
            }
            keep(&mut best, sweep, &bilateral.normals, (range, wanted));
        }
    }
    best.expect("the lists of parameters are not empty")
}
