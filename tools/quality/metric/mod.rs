//! How well found lines match true ones, by length.
//!
//! In: found lines, the truth, and h, the median side of the mesh as the program defines it. Out: a [`Score`].
//! Precision, recall and F1 are those of `tools/reference/metric.py`; the rest tells what a single number hides: lines
//! where nothing is, broken lines, missed corners, lines beside the true place. Lengths in a score are in h.

pub mod corners;
pub mod lines;
pub mod names;
pub mod sample;
pub mod truth;

pub use lines::Lines;
pub use sample::Samples;
pub use truth::Truth;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::{GeomWithData, Line};
use serde::{Deserialize, Serialize};

/// Distance between samples, in h: small against the tolerances.
pub const STEP: f64 = 0.2;
/// The tolerances at which lines are compared, in h: a line that runs one edge beside the true one is good, two edges
/// is the same line found badly.
pub const TOLERANCES: [f64; 2] = [1.0, 2.0];
/// Beyond this distance from all true lines a line is false, in h; the larger of the tolerances.
pub const FALSE_BEYOND: f64 = TOLERANCES[1];
/// False lines from this length on are counted on their own, in h: the program drops whatever is shorter by itself.
pub const LONG_LINE: f64 = 8.0;

/// Precision, recall and their harmonic mean at one tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Match {
    /// Share of the found length that is near a true line; 1 if nothing was found and nothing is there.
    pub precision: f64,
    /// Share of the true length that is near a found line; 1 if nothing is there.
    pub recall: f64,
    /// Harmonic mean of the two.
    pub f1: f64,
}

/// How well found lines match the truth. Lengths in h.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Length of the true lines.
    pub true_length: f64,
    /// Length of the found lines.
    pub found_length: f64,
    /// Within 1 h.
    pub at_1h: Match,
    /// Within 2 h.
    pub at_2h: Match,
    /// Found length beyond 2 h of all true lines.
    pub false_length: f64,
    /// Connected components of the found lines with more than half of their length beyond 2 h.
    pub false_components: usize,
    /// Found lines longer than 8 h with more than half of their length beyond 2 h.
    pub long_false_lines: usize,
    /// Found lines.
    pub found_lines: usize,
    /// True curves: from corner, junction or tip to the next.
    pub true_curves: usize,
    /// Found lines for each true curve, over the curves that have any: 1 if none is broken. A found line belongs to the
    /// curve that most of its length is nearest to, and to none if it is false.
    pub lines_per_curve: Option<f64>,
    /// Points marked as corners, and junctions of three or more lines.
    pub found_corners: usize,
    /// True corners.
    pub true_corners: usize,
    /// Pairs of a true corner and a found one within 2 h, one to one.
    pub matched_corners: usize,
    /// Root of the mean squared distance to the nearest true line, over the found length within 2 h.
    pub rms_distance: Option<f64>,
}

impl Score {
    /// Found length over true length; `None` if nothing is there to be found.
    pub fn length_ratio(&self) -> Option<f64> {
        (self.true_length > 0.0).then(|| self.found_length / self.true_length)
    }

    /// Found corners that are no true ones.
    pub fn false_corners(&self) -> usize {
        self.found_corners - self.matched_corners
    }

    /// Share of the found corners that are true ones; `None` if none was found, or none is there: then false ones
    /// count.
    pub fn corner_precision(&self) -> Option<f64> {
        (self.found_corners > 0 && self.true_corners > 0)
            .then(|| self.matched_corners as f64 / self.found_corners as f64)
    }

    /// Share of the true corners that were found; `None` if there is none.
    pub fn corner_recall(&self) -> Option<f64> {
        (self.true_corners > 0).then(|| self.matched_corners as f64 / self.true_corners as f64)
    }
}

/// Scores `found` against `truth`. `h` is the unit of length, above 0.
pub fn score(found: &Lines, truth: &Truth, h: f64) -> Score {
    let of_found = Samples::of_lines(found, STEP * h);
    let of_truth = Samples::of_chains(&truth.points, &truth.curves, STEP * h);
    let to_truth = of_found.distances_to(&of_truth);
    let to_found = of_truth.distances_to(&of_found);
    let at = |tolerance: f64| {
        let near =
            |distances: &[f64], samples: &Samples| samples.length_where(|i| distances[i] <= tolerance * h);
        compare(
            [near(&to_truth, &of_found), of_found.total()],
            [near(&to_found, &of_truth), of_truth.total()],
        )
    };
    let false_line = shares_beyond(&of_found, &to_truth, FALSE_BEYOND * h, found.chains.len(), |chain| chain);
    let components = found.components();
    let count = components.iter().max().map_or(0, |last| last + 1);
    let false_component =
        shares_beyond(&of_found, &to_truth, FALSE_BEYOND * h, count, |chain| components[chain]);
    let near = Nearness::new(&of_found, truth, &false_line, h);
    let found_corners = found.corner_points();
    let true_corners = truth.corner_points();
    Score {
        true_length: of_truth.total() / h,
        found_length: of_found.total() / h,
        at_1h: at(TOLERANCES[0]),
        at_2h: at(TOLERANCES[1]),
        false_length: of_found.length_where(|i| to_truth[i] > FALSE_BEYOND * h) / h,
        false_components: false_component.iter().filter(|part| part.is_false()).count(),
        long_false_lines: false_line
            .iter()
            .filter(|part| part.is_false() && part.length > LONG_LINE * h)
            .count(),
        found_lines: found.chains.len(),
        true_curves: truth.curves.len(),
        lines_per_curve: near.lines_per_curve,
        found_corners: found_corners.len(),
        true_corners: true_corners.len(),
        matched_corners: corners::matched(&found_corners, &true_corners, FALSE_BEYOND * h),
        rms_distance: near.rms.map(|rms| rms / h),
    }
}

/// Precision, recall and F1 from near and total lengths of the found lines and of the true ones.
pub fn compare([near_found, found]: [f64; 2], [near_truth, truth]: [f64; 2]) -> Match {
    let precision = if found > 0.0 { near_found / found } else { f64::from(truth <= 0.0) };
    let recall = if truth > 0.0 { near_truth / truth } else { 1.0 };
    let sum = precision + recall;
    Match { precision, recall, f1: if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 } }
}

/// Length of a line or component, and how much of it is far from the truth.
#[derive(Clone, Copy, Default)]
struct Share {
    length: f64,
    beyond: f64,
}

impl Share {
    fn is_false(&self) -> bool {
        self.beyond > 0.5 * self.length
    }
}

/// Adds the samples up by the group that `group` makes of their chain.
fn shares_beyond(
    samples: &Samples,
    distances: &[f64],
    limit: f64,
    groups: usize,
    group: impl Fn(usize) -> usize,
) -> Vec<Share> {
    let mut shares = vec![Share::default(); groups];
    for (i, distance) in distances.iter().enumerate() {
        let share = &mut shares[group(samples.chains[i])];
        share.length += samples.lengths[i];
        share.beyond += if *distance > limit { samples.lengths[i] } else { 0.0 };
    }
    shares
}

/// What the exact distances to the true segments tell; between samples of both, a distance below the step means
/// nothing.
struct Nearness {
    /// In mesh units.
    rms: Option<f64>,
    lines_per_curve: Option<f64>,
}

impl Nearness {
    fn new(found: &Samples, truth: &Truth, lines: &[Share], h: f64) -> Nearness {
        let segment = |(curve, from, to): (usize, DVec3, DVec3)| {
            GeomWithData::new(Line::new(from.to_array(), to.to_array()), curve)
        };
        // A segment without length has no direction to project on; its ends lie on its neighbours.
        let tree = RTree::bulk_load(truth.segments().filter(|(_, a, b)| a != b).map(segment).collect());
        // Length of each line by nearest curve.
        let mut by_curve: Vec<Vec<(usize, f64)>> = vec![Vec::new(); lines.len()];
        let (mut sum, mut length) = (0.0, 0.0);
        for (i, point) in found.points.iter().enumerate() {
            let Some((nearest, squared)) = tree.nearest_neighbor_with_distance_2(point.to_array()) else {
                break;
            };
            if squared.sqrt() <= FALSE_BEYOND * h {
                sum += found.lengths[i] * squared;
                length += found.lengths[i];
            }
            let lengths = &mut by_curve[found.chains[i]];
            match lengths.iter_mut().find(|(curve, _)| *curve == nearest.data) {
                Some((_, length)) => *length += found.lengths[i],
                None => lengths.push((nearest.data, found.lengths[i])),
            }
        }
        let mut lines_of = vec![0_usize; truth.curves.len()];
        for (_, lengths) in lines.iter().zip(by_curve).filter(|(line, _)| !line.is_false()) {
            // Of equal lengths the curve that was met first.
            let longest = lengths.into_iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
            if let Some((curve, _)) = longest {
                lines_of[curve] += 1;
            }
        }
        let met = lines_of.iter().filter(|&&lines| lines > 0).count();
        Nearness {
            rms: (length > 0.0).then(|| (sum / length).sqrt()),
            lines_per_curve: (met > 0).then(|| lines_of.iter().sum::<usize>() as f64 / met as f64),
        }
    }
}

#[cfg(test)]
mod tests;
