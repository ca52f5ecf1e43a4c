//! Squared distances to planes, summed: where several planes meet, in the sense of least squares.
//!
//! After Garland and Heckbert (1997), with the variance of each plane as its weight. Planes that all but coincide leave
//! directions open; a spring to the origin closes them, so that there always is one minimum near by.

use super::Sym3;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Sum of (n . x - o)^2 / variance over planes, without its constant. Dimensionless if lengths and offsets are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quadric {
    /// Sum of n n^T / variance.
    pub matrix: Sym3,
    /// Sum of n o / variance.
    pub vector: DVec3,
}

impl Quadric {
    /// Adds the plane `normal . x = offset`, whose offset has this variance.
    pub fn add_plane(&mut self, normal: DVec3, offset: f64, variance: f64) {
        self.matrix.add(&Sym3::outer(normal, 1.0 / variance));
        self.vector += normal * (offset / variance);
    }

    /// The matrix with a spring of standard deviation `slack` to the origin.
    pub fn with_slack(&self, slack: f64) -> Sym3 {
        let mut matrix = self.matrix;
        matrix.diag += DVec3::splat(1.0 / (slack * slack));
        matrix
    }

    /// Where the planes meet, with the same spring.
    pub fn minimum(&self, slack: f64) -> DVec3 {
        self.with_slack(slack).solve(self.vector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_meet_where_they_say() {
        let mut corner = Quadric::default();
        for (normal, offset) in [(DVec3::X, 0.3), (DVec3::Y, -0.2), (DVec3::new(0.0, 0.6, 0.8), 0.4)] {
            corner.add_plane(normal, offset, 1e-6);
        }
        let expected = DVec3::new(0.3, -0.2, (0.4 + 0.6 * 0.2) / 0.8);
        assert!((corner.minimum(1.0) - expected).length() < 1e-5);
    }

    #[test]
    fn what_planes_leave_open_stays() {
        let mut edge = Quadric::default();
        edge.add_plane(DVec3::X, 0.5, 1e-6);
        assert!((edge.minimum(0.5) - 0.5 * DVec3::X).length() < 1e-5);
        assert_eq!(Quadric::default().minimum(0.5), DVec3::ZERO);
    }
}
