//! How lines are distributed over angle, length and strength.
//!
//! In: the measures of lines, one at a time. Out: counts in bins, by class. Memory does not depend on the number of lines.
//!
//! Angles have bins of 5 degrees: single vertices scatter by 2 to 5 degrees, and the limit between weak and sharp, 30, is the
//! end of a bin. Lengths span decades and follow the mesh, so their bins are half octaves that start from the median edge; only
//! those between the shortest and the longest line are reported. Strengths have twenty bins from 0 to 1.

use super::data::{CLASSES, Histogram, Histograms, Series, is_crease};
use crate::stitch::{Class, Measures};
use std::f64::consts::SQRT_2;

/// Width of a bin of angles, degrees.
const ANGLE_BIN: f64 = 5.0;
/// Bins of strengths.
const STRENGTH_BINS: usize = 20;
/// Half octaves of length below and above the median edge. What is beyond them is in the first or last.
const HALF_OCTAVES: [i32; 2] = [-40, 88];

/// Three histograms that grow.
pub struct Histogrammer {
    angle: Bins,
    length: Bins,
    strength: Bins,
}

impl Histogrammer {
    /// For lines of a mesh with this median edge.
    pub fn new(median_edge: f64) -> Histogrammer {
        let unit = if median_edge > 0.0 { median_edge } else { 1.0 };
        let octave =
            |k: i32| unit * libm::ldexp(1.0, k.div_euclid(2)) * [1.0, SQRT_2][k.rem_euclid(2) as usize];
        let equal = |n: usize, width: f64| (0..=n).map(|i| i as f64 * width).collect();
        Histogrammer {
            angle: Bins::new(equal((180.0 / ANGLE_BIN) as usize, ANGLE_BIN)),
            length: Bins::new((HALF_OCTAVES[0]..=HALF_OCTAVES[1]).map(octave).collect()),
            strength: Bins::new((0..=STRENGTH_BINS).map(|i| i as f64 / STRENGTH_BINS as f64).collect()),
        }
    }

    /// One more line.
    pub fn add(&mut self, line: &Measures) {
        self.length.add(line.length, line);
        if is_crease(line.class) {
            self.angle.add(line.angle, line);
            self.strength.add(line.strength, line);
        }
    }

    /// What was counted.
    pub fn finish(self) -> Histograms {
        Histograms {
            angle: self.angle.finish(),
            length: self.length.trimmed().finish(),
            strength: self.strength.finish(),
        }
    }
}

struct Bins {
    bounds: Vec<f64>,
    /// Lines and length in each bin, by number of the class.
    counts: Vec<[(u64, f64); Class::ALL.len()]>,
}

impl Bins {
    fn new(bounds: Vec<f64>) -> Bins {
        let counts = vec![Default::default(); bounds.len() - 1];
        Bins { bounds, counts }
    }

    fn add(&mut self, x: f64, line: &Measures) {
        let inner = &self.bounds[1..self.bounds.len() - 1];
        let slot = &mut self.counts[inner.partition_point(|&bound| bound <= x)][line.class as usize];
        slot.0 += 1;
        slot.1 += line.length;
    }

    /// Without the empty bins at both ends.
    fn trimmed(self) -> Bins {
        let used = |counts: &[(u64, f64); Class::ALL.len()]| counts.iter().any(|(lines, _)| *lines > 0);
        let first = self.counts.iter().position(used).unwrap_or(0);
        let end = self.counts.iter().rposition(used).map_or(first, |last| last + 1);
        Bins { bounds: self.bounds[first..=end].to_vec(), counts: self.counts[first..end].to_vec() }
    }

    fn finish(self) -> Histogram {
        let series = |class: Class| Series {
            class: class.name(),
            lines: self.counts.iter().map(|bin| bin[class as usize].0).collect(),
            length: self.counts.iter().map(|bin| bin[class as usize].1).collect(),
        };
        let classes = CLASSES.into_iter().map(series).filter(|s| s.lines.iter().any(|&n| n > 0)).collect();
        Histogram { bounds: self.bounds, classes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::Bend;

    fn line(class: Class, length: f64, strength: f64, angle: f64) -> Measures {
        Measures { class, closed: false, length, strength, angle, bend: Bend::Unknown }
    }

    #[test]
    fn every_line_is_in_its_bin() {
        let mut counted = Histogrammer::new(0.5);
        let lines = [
            line(Class::Weak, 4.0, 0.05, 29.999),
            line(Class::Sharp, 2.0, 0.1, 30.0),
            line(Class::Sharp, 1.0, 1.0, 180.0),
            line(Class::Boundary, 64.0, 0.0, 0.0),
        ];
        lines.iter().for_each(|line| counted.add(line));
        let Histograms { angle, length, strength } = counted.finish();
        let series = |h: &Histogram, name: &str| h.classes.iter().find(|s| s.class == name).cloned();
        let sharp = series(&angle, "sharp").expect("sharp lines");
        assert_eq!((angle.bounds.len(), sharp.lines[6], sharp.lines[35]), (37, 1, 1));
        assert_eq!((sharp.length[6], sharp.length[35]), (2.0, 1.0));
        assert_eq!(series(&angle, "weak").expect("weak lines").lines[5], 1);
        assert_eq!(series(&angle, "boundary"), None);
        assert_eq!(series(&strength, "weak").expect("weak lines").lines[1], 1);
        assert_eq!(series(&strength, "sharp").expect("sharp lines").lines[19], 1);
        // From 1 to 64 in half octaves of 0.5, ends included.
        assert_eq!((length.bounds[0], length.bounds.len()), (1.0, 14));
        assert_eq!(series(&length, "boundary").expect("boundaries").lines.last(), Some(&1));
        assert!(length.bounds.is_sorted());
    }

    #[test]
    fn lengths_beyond_all_bins_count() {
        let mut counted = Histogrammer::new(0.0);
        [0.0, 1e-300, 1e300].iter().for_each(|&l| counted.add(&line(Class::Weak, l, 0.5, 10.0)));
        let weak = &counted.finish().length.classes[0];
        assert_eq!((weak.lines[0], weak.lines.last()), (2, Some(&1)));
        assert_eq!(Histogrammer::new(1.0).finish().length.classes, []);
    }
}
