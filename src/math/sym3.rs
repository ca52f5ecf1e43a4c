//! Symmetric 3x3 tensors and their eigensystem.
//!
//! Cyclic Jacobi rotations: backward stable, also at double eigenvalues (every plane is one), and made of + - * / sqrt
//! only. Closed forms through `acos` lose half the digits exactly where a flat vertex is told from a weak crease.

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
        let tv = DVec3::new(
            t.diag.x * v.x + t.off.z * v.y + t.off.y * v.z,
            t.off.z * v.x + t.diag.y * v.y + t.off.x * v.z,
            t.off.y * v.x + t.off.x * v.y + t.diag.z * v.z,
        );
        (tv - v * value).length()
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

    proptest! {
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
