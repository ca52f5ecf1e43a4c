//! Symmetric 3x3 tensors and their eigensystem.
//!
//! Two ways, both made of + - * / sqrt only. Where the largest eigenvalue stands apart, as it does at all but corners and
//! right angles, it is found by Halley's method, its vector as a cross product, and the other two in the plane across, as
//! the roots of a 2x2 matrix: as precise as rotations, and several times as fast. Elsewhere cyclic Jacobi rotations:
//! backward stable, also at multiple eigenvalues. Closed forms through `acos` lose half the digits exactly where a flat
//! vertex is told from a weak crease.

use super::frame;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A symmetric 3x3 matrix by its six independent entries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sym3 {
    /// Diagonal: xx, yy, zz.
    pub diag: DVec3,
    /// Off the diagonal: yz, xz, xy.
    pub off: DVec3,
}

/// Eigenvalues in descending order, with unit eigenvectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen {
    /// Largest first; ties keep the order of the axes.
    pub values: [f64; 3],
    /// `vectors[i]` belongs to `values[i]`; its component of largest magnitude is positive.
    pub vectors: [DVec3; 3],
}

/// Rotations make the off-diagonal quadratically smaller; five sweeps do for any matrix, the rest is a safety margin
/// that keeps the loop finite whatever comes in.
const MAX_SWEEPS: usize = 12;
/// Off-diagonal entries below this share of the diagonal no longer change an f64 eigenvalue.
const CONVERGED: f64 = 1e-18;
/// Halley's method starts above the root and comes down: cubically when it is near, which it is from the start where
/// normals agree. Where it takes longer, rotations do as well.
const MAX_STEPS: usize = 8;
/// A step by this share of the trace is the last one: what is left is the third power of it, times a few, and far below
/// what the vector may lack.
const LAST_STEP: f64 = 1e-4;
/// The largest eigenvalue stands apart if the gap to the next is this share of it.
const APART: f64 = 0.05;
/// What the largest eigenvector may lack of being one, as a share of its eigenvalue: the square of it is below rounding, so
/// one step of perturbation theory corrects it.
const COUPLING: f64 = 1e-9;

impl Sym3 {
    /// `weight` times the outer product of `n` with itself.
    pub fn outer(n: DVec3, weight: f64) -> Sym3 {
        let w = n * weight;
        Sym3 { diag: w * n, off: DVec3::new(w.y * n.z, w.x * n.z, w.x * n.y) }
    }

    /// Adds `other`, entry by entry.
    pub fn add(&mut self, other: &Sym3) {
        self.diag += other.diag;
        self.off += other.off;
    }

    /// Every entry times `factor`.
    pub fn scaled(&self, factor: f64) -> Sym3 {
        Sym3 { diag: self.diag * factor, off: self.off * factor }
    }

    /// The matrix times `x`.
    pub fn times(&self, x: DVec3) -> DVec3 {
        let (d, o) = (self.diag, self.off);
        DVec3::new(
            d.x * x.x + o.z * x.y + o.y * x.z,
            o.z * x.x + d.y * x.y + o.x * x.z,
            o.y * x.x + o.x * x.y + d.z * x.z,
        )
    }

    /// Solves `self x = right` by Cholesky's method. The matrix must be positive definite.
    pub fn solve(&self, right: DVec3) -> DVec3 {
        let (d, o) = (self.diag, self.off);
        let l00 = d.x.sqrt();
        let (l10, l20) = (o.z / l00, o.y / l00);
        let l11 = (d.y - l10 * l10).sqrt();
        let l21 = (o.x - l20 * l10) / l11;
        let l22 = (d.z - l20 * l20 - l21 * l21).sqrt();
        let y0 = right.x / l00;
        let y1 = (right.y - l10 * y0) / l11;
        let y2 = (right.z - l20 * y0 - l21 * y1) / l22;
        let z = y2 / l22;
        let y = (y1 - l21 * z) / l11;
        DVec3::new((y0 - l10 * y - l20 * z) / l00, y, z)
    }

    /// The eigensystem.
    pub fn eigen(&self) -> Eigen {
        self.deflated().map_or_else(|| self.rotated(), |deflated| deflated.eigen())
    }

    /// The eigenvalues, in descending order: those of the eigensystem.
    pub fn eigenvalues(&self) -> [f64; 3] {
        self.deflated().map_or_else(|| self.rotated().values, |deflated| deflated.values)
    }

    /// The eigenvalues, if the largest stands apart and none is below zero by more than rounding.
    #[inline]
    fn deflated(&self) -> Option<Deflated> {
        let (d, o) = (self.diag, self.off);
        let largest = self.largest()?;
        let first = null_vector(&Sym3 { diag: d - DVec3::splat(largest), off: o })?;
        let [x, y] = frame(first);
        let (ax, ay) = (self.times(x), self.times(y));
        let (xx, xy, yy) = (x.dot(ax), x.dot(ay), y.dot(ay));
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        let mean = 0.5 * (xx + yy);
        let values = [first.dot(self.times(first)), mean + root, mean - root];
        let coupled = [first.dot(ax), first.dot(ay)];
        let sure = values[0] - values[1] >= APART * values[0]
            && coupled[0].abs() + coupled[1].abs() <= COUPLING * values[0]
            && values[2] >= -CONVERGED.sqrt() * values[0];
        sure.then_some(Deflated { values, first, plane: [x, y], coupled, half, root, xy })
    }

    /// The largest eigenvalue, nearly.
    #[inline]
    fn largest(&self) -> Option<f64> {
        let (d, o) = (self.diag, self.off);
        let trace = d.x + d.y + d.z;
        // The characteristic polynomial is x^3 - trace x^2 + minors x - determinant. At the trace it is above all roots.
        let minors = d.x * d.y + d.y * d.z + d.z * d.x - o.dot(o);
        let determinant =
            d.x * (d.y * d.z - o.x * o.x) - o.z * (o.z * d.z - o.x * o.y) + o.y * (o.z * o.x - d.y * o.y);
        let mut largest = trace;
        for _ in 0..=MAX_STEPS {
            let value = ((largest - trace) * largest + minors) * largest - determinant;
            let slope = (3.0 * largest - 2.0 * trace) * largest + minors;
            let half_bend = 3.0 * largest - trace;
            let change = value * slope / (slope * slope - value * half_bend);
            largest -= change;
            if change.abs() <= LAST_STEP * trace {
                return Some(largest);
            }
        }
        // Not a number, too.
        None
    }

    /// The eigensystem by rotations.
    fn rotated(&self) -> Eigen {
        let mut a = [
            [self.diag.x, self.off.z, self.off.y],
            [self.off.z, self.diag.y, self.off.x],
            [self.off.y, self.off.x, self.diag.z],
        ];
        let mut u = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for _ in 0..MAX_SWEEPS {
            let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
            if off <= CONVERGED * (a[0][0].abs() + a[1][1].abs() + a[2][2].abs()) {
                break;
            }
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                rotate(&mut a, &mut u, p, q);
            }
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
        Eigen {
            values: order.map(|i| a[i][i]),
            vectors: order.map(|i| fix_sign(DVec3::new(u[0][i], u[1][i], u[2][i]))),
        }
    }
}

/// A matrix after its largest eigenvalue was taken off: what is left in the plane across.
struct Deflated {
    /// All three, in descending order.
    values: [f64; 3],
    /// The first vector, nearly.
    first: DVec3,
    /// Two more, at right angles.
    plane: [DVec3; 2],
    /// What the first vector lacks: entries of the matrix between it and the plane.
    coupled: [f64; 2],
    /// Half the difference of the diagonal entries in the plane, the same for eigenvalues, the entry off the diagonal.
    half: f64,
    root: f64,
    xy: f64,
}

impl Deflated {
    /// With the vectors.
    #[inline]
    fn eigen(&self) -> Eigen {
        let Deflated { values, first, plane: [x, y], coupled, half, root, xy } = *self;
        // Of two ways to write the vector, that without cancellation.
        let turned = if half >= 0.0 { (half + root, xy) } else { (xy, root - half) };
        let length = (turned.0 * turned.0 + turned.1 * turned.1).sqrt();
        let (c, s) = if length > 0.0 { (turned.0 / length, turned.1 / length) } else { (1.0, 0.0) };
        let (second, third) = (x * c + y * s, y * c - x * s);
        let p = (coupled[0] * c + coupled[1] * s) / (values[0] - values[1]);
        let q = (coupled[1] * c - coupled[0] * s) / (values[0] - values[2]);
        let vectors = [first + second * p + third * q, second - first * p, third - first * q];
        Eigen { values, vectors: vectors.map(fix_sign) }
    }
}

/// A unit vector that a singular matrix takes to zero: at right angles to its rows. None if these are all parallel, to
/// rounding.
fn null_vector(a: &Sym3) -> Option<DVec3> {
    let rows = [
        DVec3::new(a.diag.x, a.off.z, a.off.y),
        DVec3::new(a.off.z, a.diag.y, a.off.x),
        DVec3::new(a.off.y, a.off.x, a.diag.z),
    ];
    let candidates = [rows[1].cross(rows[2]), rows[2].cross(rows[0]), rows[0].cross(rows[1])];
    let squares = candidates.map(|v| v.dot(v));
    let most = if squares[0] >= squares[1] && squares[0] >= squares[2] {
        0
    } else if squares[1] >= squares[2] {
        1
    } else {
        2
    };
    (squares[most] > 0.0).then(|| candidates[most] * (1.0 / squares[most].sqrt()))
}

/// One Jacobi rotation that makes `a[p][q]` zero; `u` collects the rotations, eigenvectors in its columns.
fn rotate(a: &mut [[f64; 3]; 3], u: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let apq = a[p][q];
    if apq == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    a[p][p] -= t * apq;
    a[q][q] += t * apq;
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    let r = 3 - p - q;
    let (arp, arq) = (a[r][p], a[r][q]);
    a[r][p] = c * arp - s * arq;
    a[r][q] = s * arp + c * arq;
    a[p][r] = a[r][p];
    a[q][r] = a[r][q];
    for row in u {
        let (up, uq) = (row[p], row[q]);
        row[p] = c * up - s * uq;
        row[q] = s * up + c * uq;
    }
}

/// An eigenvector is a direction without a sign; the component of largest magnitude (the first of equals) is made
/// positive, so that equal tensors give equal bits.
fn fix_sign(v: DVec3) -> DVec3 {
    let m = v.abs();
    let lead = if m.x >= m.y && m.x >= m.z {
        v.x
    } else if m.y >= m.z {
        v.y
    } else {
        v.z
    };
    if lead < 0.0 { -v } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn residual(t: &Sym3, value: f64, v: DVec3) -> f64 {
        (t.times(v) - v * value).length()
    }

    #[test]
    fn a_plane_has_one_direction() {
        let n = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let e = Sym3::outer(n, 5.0).eigen();
        assert!((e.values[0] - 5.0).abs() < 1e-14);
        assert!(e.values[1].abs() < 1e-15 && e.values[2].abs() < 1e-15);
        assert!((e.vectors[0].dot(n).abs() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_fast_way_is_taken_where_normals_agree() {
        assert!(tensor(&[(0.1, 0.0), (-0.1, 0.05), (0.3, 0.0)]).deflated().is_some());
        assert!(tensor(&[(0.0, 0.0)]).deflated().is_some());
        // A right angle with equal sides.
        assert!(tensor(&[(1.0, 0.0), (-1.0, 0.0)]).deflated().is_none());
    }

    #[test]
    fn the_zero_tensor_and_not_a_number_end() {
        assert_eq!(Sym3::default().eigen().values, [0.0; 3]);
        let nan = Sym3 { diag: DVec3::NAN, off: DVec3::NAN };
        assert!(nan.eigen().values[0].is_nan());
    }

    #[test]
    fn systems_are_solved() {
        let t = Sym3 { diag: DVec3::new(4.0, 5.0, 6.0), off: DVec3::new(1.0, -2.0, 0.5) };
        let x = DVec3::new(0.3, -0.7, 2.0);
        let right = DVec3::new(
            t.diag.x * x.x + t.off.z * x.y + t.off.y * x.z,
            t.off.z * x.x + t.diag.y * x.y + t.off.x * x.z,
            t.off.y * x.x + t.off.x * x.y + t.diag.z * x.z,
        );
        assert!((t.solve(right) - x).length() < 1e-14);
    }

    /// Tensors of normals that agree more or less: what vertices have.
    fn tensor(normals: &[(f64, f64)]) -> Sym3 {
        let mut t = Sym3::default();
        for &(a, b) in normals {
            let n = DVec3::new(a, b, 1.0) / (a * a + b * b + 1.0).sqrt();
            t.add(&Sym3::outer(n, 0.7));
        }
        t
    }

    proptest! {
        #[test]
        fn both_ways_agree(spread in 0.0..3.0f64, normals in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 1..9)) {
            let spread = libm::pow(10.0, -3.0 * spread);
            let normals: Vec<(f64, f64)> = normals.iter().map(|&(a, b)| (spread * a, spread * b)).collect();
            let t = tensor(&normals);
            let (e, slow) = (t.eigen(), t.rotated());
            let rounding = 2e-15 * slow.values[0];
            for i in 0..3 {
                prop_assert!((e.values[i] - slow.values[i]).abs() < rounding, "{e:?} {slow:?}");
                prop_assert!(residual(&t, e.values[i], e.vectors[i]) < rounding, "{e:?} {slow:?}");
            }
        }

        #[test]
        fn agrees_with_nalgebra(d in prop::array::uniform3(-1.0..1.0f64), o in prop::array::uniform3(-1.0..1.0f64)) {
            let t = Sym3 { diag: d.into(), off: o.into() };
            let e = t.eigen();
            let m = nalgebra::Matrix3::new(d[0], o[2], o[1], o[2], d[1], o[0], o[1], o[0], d[2]);
            let mut other: Vec<f64> = m.symmetric_eigenvalues().iter().copied().collect();
            other.sort_by(|a, b| b.total_cmp(a));
            for (value, (theirs, vector)) in e.values.iter().zip(other.iter().zip(e.vectors)) {
                prop_assert!((value - theirs).abs() < 1e-10);
                prop_assert!(residual(&t, *value, vector) < 1e-14);
                prop_assert!((vector.length() - 1.0).abs() < 1e-14);
            }
        }
    }
}
