//! A plane through a part of a patch, by least squares, with how sure it is.
//!
//! Refined normals are smooth but blurred across weak folds; positions are noisy but never blurred. So the plane is fitted
//! to positions, and refined normals say only which faces belong to it, and which way it tilts where positions are too few
//! to tell.

use super::patch::{Connected, Patch};
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

/// How well two normals agree: 1 if equal, 0 from a chord of `FIT_WIDTH` on.
pub(super) fn agreement(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    let t = (1.0 - d.dot(d) / (method::FIT_WIDTH * method::FIT_WIDTH)).max(0.0);
    t * t
}

/// The weighted mean of the normals of connected faces, of unit length.
pub(super) fn mean_normal(patch: &Patch, connected: &Connected) -> DVec3 {
    let weighted = |&i: &u32| patch.faces[i as usize].normal * connected.weights[i as usize];
    unit(connected.faces.iter().map(weighted).fold(DVec3::ZERO, |sum, n| sum + n))
}

/// The plane through the corners of connected faces (at least one), written as heights over the plane of `normal`:
/// z = a + b x + c y. What is summed are moments in the axes of the mesh, as the patch has them; only the sums are turned
/// into the frame of the normal.
pub(super) fn fit_plane(patch: &Patch, connected: &Connected, normal: DVec3) -> Plane {
    let (mut total, mut squares) = (0.0, 0.0);
    let (mut first, mut second) = (DVec3::ZERO, Sym3::default());
    for &i in &connected.faces {
        let (face, weight) = (&patch.faces[i as usize], connected.weights[i as usize]);
        total += weight;
        squares += weight * weight;
        first += face.centre * weight;
        second.add(&face.spread.scaled(weight));
    }
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
