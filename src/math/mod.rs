//! Small exact-order numerics: everything here uses + - * / sqrt, and `libm` where that does not do, so that the bits
//! of a result depend on its operands alone and not on the machine.

mod banded;
mod quadric;
mod sym3;

pub use banded::Banded;
pub use quadric::Quadric;
pub use sym3::{Eigen, Sym3};

use glam::DVec3;

/// Radians in one degree.
pub const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// `v` scaled to unit length; a vector that is zero stays zero.
pub fn unit(v: DVec3) -> DVec3 {
    v * (1.0 / v.dot(v).sqrt().max(1e-300))
}

/// Two unit vectors at right angles to the unit vector `normal` and to each other. After Duff et al. (2017): the frame of z
/// turned the shortest way to the normal, or that of -z, whichever is nearer.
#[inline]
pub fn frame(normal: DVec3) -> [DVec3; 2] {
    let DVec3 { x, y, z } = normal;
    let sign = 1f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [DVec3::new(1.0 + sign * x * x * a, sign * b, -sign * x), DVec3::new(b, sign + y * y * a, -y)]
}

/// The angle whose tangent is the root of `ratio`: turns an eigenvalue ratio of an even plate tensor into half the fold
/// angle it came from.
pub fn half_fold(ratio: f64) -> f64 {
    libm::atan(ratio.sqrt())
}
