//! Lines as points that each stand for a length. In: lines and a step; out: samples in the middle of equal pieces, as
//! in `tools/reference/metric.py`.

use super::lines::Lines;
use glam::DVec3;
use rstar::RTree;

/// Points on lines.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Positions, in mesh units.
    pub points: Vec<DVec3>,
    /// The length that each stands for, in mesh units.
    pub lengths: Vec<f64>,
    /// The chain that each lies on.
    pub chains: Vec<usize>,
}

impl Samples {
    /// Cuts each segment of the chains into equal pieces not longer than `step`; a sample is the middle of a piece.
    pub fn of_chains(points: &[DVec3], chains: &[Vec<u32>], step: f64) -> Samples {
        let mut samples = Samples::default();
        for (number, chain) in chains.iter().enumerate() {
            for segment in chain.windows(2) {
                let [from, to] = [segment[0], segment[1]].map(|v| points[v as usize]);
                samples.add(number, from, to, step);
            }
        }
        samples
    }

    /// Samples of all chains of `lines`.
    pub fn of_lines(lines: &Lines, step: f64) -> Samples {
        Samples::of_chains(&lines.points, &lines.chains, step)
    }

    fn add(&mut self, chain: usize, from: DVec3, to: DVec3, step: f64) {
        let length = from.distance(to);
        if length <= 0.0 {
            return;
        }
        let pieces = (length / step).ceil().max(1.0);
        for i in 0..pieces as usize {
            self.points.push(from + (to - from) * ((i as f64 + 0.5) / pieces));
            self.lengths.push(length / pieces);
            self.chains.push(chain);
        }
    }

    /// The length of all lines, in mesh units.
    pub fn total(&self) -> f64 {
        self.length_where(|_| true)
    }

    /// The length of the samples for which `counts` holds of their index, in mesh units.
    pub fn length_where(&self, counts: impl Fn(usize) -> bool) -> f64 {
        // Not `sum`: that of nothing is -0.
        (0..self.points.len()).filter(|&i| counts(i)).fold(0.0, |sum, i| sum + self.lengths[i])
    }

    /// For each sample the distance to the nearest sample of `others`; infinite if there is none.
    pub fn distances_to(&self, others: &Samples) -> Vec<f64> {
        let tree = RTree::bulk_load(others.points.iter().map(DVec3::to_array).collect());
        let distance = |point: &DVec3| {
            tree.nearest_neighbor_with_distance_2(point.to_array())
                .map_or(f64::INFINITY, |(_, squared)| squared.sqrt())
        };
        self.points.iter().map(distance).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_the_middles_of_equal_pieces() {
        let line = vec![DVec3::ZERO, DVec3::X, DVec3::X, DVec3::new(1.0, 0.5, 0.0)];
        let samples = Samples::of_lines(&Lines::of_polylines(&[line]), 0.3);
        // 1 in four pieces of 0.25, nothing for the point that stands twice, 0.5 in two pieces of 0.25.
        let x: Vec<f64> = samples.points.iter().map(|p| p.x).collect();
        assert_eq!(x, [0.125, 0.375, 0.625, 0.875, 1.0, 1.0]);
        assert_eq!(samples.lengths, [0.25; 6]);
        assert_eq!(samples.total(), 1.5);
        assert_eq!(samples.length_where(|i| samples.points[i].y > 0.2), 0.25);
    }

    #[test]
    fn distances_are_those_to_the_nearest_sample() {
        let one = |points: Vec<DVec3>| Samples {
            lengths: vec![1.0; points.len()],
            chains: vec![0; points.len()],
            points,
        };
        let near = one(vec![DVec3::ZERO, DVec3::X * 10.0]);
        let far = one(vec![DVec3::X * 3.0, DVec3::new(10.0, 4.0, 0.0)]);
        assert_eq!(near.distances_to(&far), [3.0, 4.0]);
        assert_eq!(near.distances_to(&Samples::default()), [f64::INFINITY; 2]);
    }
}
