//! A plane through a part of a patch, by least squares, with how sure it is.
//!
//! Refined normals are smooth but blurred across weak folds; positions are noisy but never blurred. So the plane is fitted
//! to positions, and refined normals say only which faces belong to it, and which way it tilts where positions are too few
//! to tell.

use super::patch::{Moments, Patch, Side};
use crate::config::method;
use crate::math::{Sym3, frame, unit};
use glam::DVec3;

/// A plane `normal . x = offset` in units of kh, relative to the vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// Distance from the vertex along the normal.
    pub offset: f64,
    /// Variance of the offset.
    pub variance: f64,
}

/// How well two normals agree whose difference has this square: 1 if they are equal, 0 from a chord of `FIT_WIDTH` on.
#[inline]
fn agreement_at(chord2: f64) -> f64 {
    let t = 1.0 - chord2 * (1.0 / (method::FIT_WIDTH * method::FIT_WIDTH));
    let t = if t > 0.0 { t } else { 0.0 };
    t * t
}

/// How well two normals agree.
pub(super) fn agreement(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    agreement_at(d.dot(d))
}

/// The same of `normal` with normal `i` of many: a loop over these is made in lanes.
#[inline]
pub(super) fn agreement_with([x, y, z]: [&[f64]; 3], i: usize, normal: DVec3) -> f64 {
    let (dx, dy, dz) = (x[i] - normal.x, y[i] - normal.y, z[i] - normal.z);
    agreement_at(dx * dx + dy * dy + dz * dz)
}

/// The weighted mean of the normals of a side, of unit length.
pub(super) fn mean_normal(patch: &Patch, side: &Side) -> DVec3 {
    let weighted = |&i: &u32| patch.normal(i as usize) * side.weights[i as usize];
    unit(side.faces().iter().map(weighted).fold(DVec3::ZERO, |sum, n| sum + n))
}

/// The plane through the corners of the faces of a side (at least one), written as heights over the plane of `normal`:
/// z = a + b x + c y. What is summed are moments in the axes of the mesh, as the patch has them; only the sums are turned
/// into the frame of the normal.
pub(super) fn fit_plane(patch: &Patch, side: &Side, normal: DVec3) -> Plane {
    let moments = patch.moments();
    let (mut sums, mut squares): (Moments, f64) = Default::default();
    for &i in side.faces() {
        let (of_face, weight) = (&moments[i as usize], side.weights[i as usize]);
        squares += weight * weight;
        for (sum, moment) in sums.iter_mut().zip(of_face) {
            *sum += moment * weight;
        }
    }
    let [total, fx, fy, fz, xx, yy, zz, yz, xz, xy] = sums;
    let first = DVec3::new(fx, fy, fz);
    let second = Sym3 { diag: DVec3::new(xx, yy, zz), off: DVec3::new(yz, xz, xy) };
    let [x, y] = frame(normal);
    let (sx, sy, sz) = (second.times(x), second.times(y), second.times(normal));
    let pull = total * method::FIT_PULL * method::FIT_PULL;
    let matrix = Sym3 {
        diag: DVec3::new(total, x.dot(sx) + pull, y.dot(sy) + pull),
        off: DVec3::new(x.dot(sy), first.dot(y), first.dot(x)),
    };
    let right = DVec3::new(first.dot(normal), x.dot(sz), y.dot(sz));
    let heights = normal.dot(sz);
    let solution = matrix.solve(right);
    let spread = (heights - solution.dot(right)).max(0.0) / total;
    // A vertex has two faces; one degree of freedom more keeps a single face from being sure of itself.
    let vertices = 0.5 * total * total / squares + 1.0;
    // How much less sure the offset at the vertex is than that at the middle of the faces.
    let lever = matrix.solve(DVec3::X).x * total;
    let tilted = normal - x * solution.y - y * solution.z;
    let length = tilted.dot(tilted).sqrt();
    Plane {
        normal: tilted / length,
        offset: solution.x / length,
        variance: spread * lever / vertices + method::FIT_FLOOR * method::FIT_FLOOR,
    }
}
