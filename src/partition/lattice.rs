//! The lattice of cubes that everything metric is rounded to.
//!
//! Levels (noise, background) are histograms over cubes of edge 6kh; the region that a tile loads is a set of the same
//! cubes. Because the map from position to cube is monotone in each coordinate, "inside the region" is an exact integer
//! question: a face whose cube range misses the region has no point in it, whatever the rounding.

use glam::DVec3;

/// Integer coordinates of a cube.
pub type Cube = [i64; 3];

/// Farther cubes are merged: more than any mesh needs, and sums of such indices cannot overflow.
const FARTHEST: f64 = (1u64 << 40) as f64;

/// Cubes of equal edge, anchored at the minimum corner of the bounds of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Minimum corner of the bounds.
    pub origin: DVec3,
    /// Edge of a cube in mesh units.
    pub edge: f64,
}

impl Lattice {
    /// The cube that contains `p`. Monotone in each coordinate.
    #[inline]
    pub fn cube_of(&self, p: DVec3) -> Cube {
        let q = (p - self.origin) / self.edge;
        // `as` would saturate too, but not at a value that arithmetic on indices can live with. A lattice without
        // extent (edge 0, all points equal) divides zero by zero; NaN becomes cube 0.
        q.to_array().map(|x| {
            let x = x.clamp(-FARTHEST, FARTHEST);
            // The largest integer that is not larger; the function for that is a call on older processors.
            let towards_zero = x as i64;
            towards_zero - i64::from(towards_zero as f64 > x)
        })
    }
}

/// An inclusive range of cubes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CubeBox {
    /// Smallest index on each axis.
    pub min: Cube,
    /// Largest index on each axis.
    pub max: Cube,
}

impl CubeBox {
    /// All cubes there are.
    pub const EVERYTHING: CubeBox = CubeBox { min: [i64::MIN / 4; 3], max: [i64::MAX / 4; 3] };

    /// The box with `cubes` more on every side.
    pub fn grown(&self, cubes: i64) -> CubeBox {
        CubeBox { min: self.min.map(|x| x - cubes), max: self.max.map(|x| x + cubes) }
    }

    /// Whether `cube` lies in the box.
    #[inline]
    pub fn contains(&self, cube: Cube) -> bool {
        (0..3).all(|i| self.min[i] <= cube[i] && cube[i] <= self.max[i])
    }

    /// Whether all of `other` lies in the box.
    pub fn encloses(&self, other: &CubeBox) -> bool {
        (0..3).all(|i| self.min[i] <= other.min[i] && other.max[i] <= self.max[i])
    }

    /// Whether the two have a cube in common.
    #[inline]
    pub fn meets(&self, other: &CubeBox) -> bool {
        (0..3).all(|i| self.min[i] <= other.max[i] && other.min[i] <= self.max[i])
    }

    /// Which share of its cubes lies in `other`.
    pub fn share_in(&self, other: &CubeBox) -> f64 {
        let side = |min: i64, max: i64| (max - min + 1).max(0) as f64;
        (0..3).fold(1.0, |share, i| {
            let common = side(self.min[i].max(other.min[i]), self.max[i].min(other.max[i]));
            share * common / side(self.min[i], self.max[i]).max(1.0)
        })
    }

    /// Number of cubes, saturating.
    pub fn count(&self) -> u64 {
        (0..3).fold(1u64, |n, i| n.saturating_mul((self.max[i] - self.min[i] + 1).max(0) as u64))
    }

    /// All cubes of the box in lexicographic order.
    pub fn cubes(&self) -> impl Iterator<Item = Cube> + use<> {
        let CubeBox { min, max } = *self;
        (min[0]..=max[0])
            .flat_map(move |x| (min[1]..=max[1]).flat_map(move |y| (min[2]..=max[2]).map(move |z| [x, y, z])))
    }

    /// The 27 cubes around `cube`, itself included: the support of a level.
    pub fn around(cube: Cube) -> CubeBox {
        CubeBox { min: cube, max: cube }.grown(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubes_are_monotone_and_finite() {
        let lattice = Lattice { origin: DVec3::new(5e5, 5.8e6, -3.0), edge: 0.7 };
        let xs = [-1e75, 4.9e5, 5e5, 5e5 + 0.7, 5e5 + 1e-9, 1e75];
        let mut sorted = xs;
        sorted.sort_by(f64::total_cmp);
        let cubes: Vec<i64> = sorted.iter().map(|&x| lattice.cube_of(DVec3::splat(x))[0]).collect();
        assert!(cubes.is_sorted());
        assert_eq!(lattice.cube_of(lattice.origin), [0; 3]);
        let point = Lattice { origin: DVec3::ONE, edge: 0.0 };
        assert_eq!(point.cube_of(DVec3::ONE), [0; 3]);
    }

    #[test]
    fn boxes() {
        let b = CubeBox { min: [0, 0, 0], max: [1, 2, 0] };
        assert_eq!((b.count(), b.cubes().count()), (6, 6));
        assert!(b.meets(&b.grown(1)) && b.grown(1).encloses(&b) && !b.encloses(&b.grown(1)));
        assert_eq!(CubeBox::around([4, 4, 4]).count(), 27);
        assert_eq!(b.share_in(&CubeBox { min: [1, 1, -5], max: [9, 9, 5] }), 0.5 * 2.0 / 3.0);
        assert_eq!((b.share_in(&b.grown(7)), b.share_in(&CubeBox { min: [2; 3], max: [3; 3] })), (1.0, 0.0));
        assert!(CubeBox::EVERYTHING.grown(5).contains([1 << 40; 3]));
    }
}
