//! Places along a space-filling curve (Morton order): neighbours on the curve are neighbours in space.

use super::scan::Bounds;
use glam::DVec3;

/// Bits of each coordinate. A single point that lies a million times the size of the mesh away leaves 22 for the mesh.
const BITS: u32 = 42;

/// Turns positions into keys.
#[derive(Clone, Copy, Debug)]
pub struct Curve {
    origin: DVec3,
    /// Steps of the finest grid for each mesh unit.
    scale: f64,
}

impl Curve {
    /// A curve through `bounds`, in cubes. Positions outside get the key of the nearest place on its border.
    pub fn new(bounds: &Bounds) -> Curve {
        let origin = if bounds.is_empty() { DVec3::ZERO } else { bounds.min };
        let extent = (bounds.max - origin).max_element();
        let steps = ((1u64 << BITS) - 1) as f64;
        Curve { origin, scale: if extent > 0.0 { steps / extent } else { 0.0 } }
    }

    /// The place of `p` on the curve.
    pub fn key(&self, p: DVec3) -> u128 {
        let [x, y, z] = ((p - self.origin) * self.scale).to_array().map(|x| {
            // A cast saturates and takes NaN (an extent so small that the scale is infinite) to 0.
            spread((x as u64).min((1 << BITS) - 1))
        });
        x | (y << 1) | (z << 2)
    }

    /// The first half of its bits, two million steps for each coordinate: enough to tell what is near.
    pub fn coarse_key(&self, p: DVec3) -> u64 {
        (self.key(p) >> (3 * (BITS / 2))) as u64
    }
}

/// Bit i to bit 3 i.
fn spread(x: u64) -> u128 {
    let half = |x: u64| {
        let mut x = x & 0x1f_ffff;
        x = (x | (x << 32)) & 0x001f_0000_0000_ffff;
        x = (x | (x << 16)) & 0x001f_0000_ff00_00ff;
        x = (x | (x << 8)) & 0x100f_00f0_0f00_f00f;
        x = (x | (x << 4)) & 0x10c3_0c30_c30c_30c3;
        (x | (x << 2)) & 0x1249_2492_4924_9249
    };
    u128::from(half(x)) | (u128::from(half(x >> 21)) << 63)
}

/// Where to cut the curve so that `parts` pieces hold about as many of `keys`, ascending. A key that fills a piece on its
/// own is cut off from what follows. Sorts the keys.
pub fn cuts(keys: &mut [u128], parts: usize) -> Vec<u128> {
    keys.sort_unstable();
    if keys.is_empty() {
        return Vec::new();
    }
    let mut cuts = Vec::with_capacity(parts);
    for part in 1..parts {
        let key = keys[part * keys.len() / parts];
        match cuts.last() {
            // A second piece full of the same key.
            Some(&last) if last == key => cuts.push(key + 1),
            Some(&last) if last > key => {}
            _ => cuts.push(key),
        }
    }
    cuts
}

/// The piece that `key` falls into: those before the first cut are in piece 0.
#[inline]
pub fn piece(cuts: &[u128], key: u128) -> usize {
    cuts.partition_point(|&cut| cut <= key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_interleaved() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1u128 << (3 * bit), "{bit}");
        }
        assert_eq!(spread((1 << BITS) - 1).count_ones(), BITS);
    }

    #[test]
    fn near_is_near() {
        let curve = Curve::new(&Bounds { min: DVec3::splat(-4.0), max: DVec3::new(1e6, 0.0, 4.0) });
        let octant = |p: DVec3| curve.key(p) >> (3 * (BITS - 1));
        assert_eq!(octant(DVec3::splat(-4.0)), 0);
        assert_eq!(octant(DVec3::new(9e5, -4.0, -4.0)), 1);
        assert!(curve.key(DVec3::new(1.0, 0.0, 0.0)) != curve.key(DVec3::new(1.0, 1e-3, 0.0)));
        assert_eq!(curve.key(DVec3::splat(-1e9)), 0);
        let point = Curve::new(&Bounds { min: DVec3::ONE, max: DVec3::ONE });
        assert_eq!(point.key(DVec3::ONE), 0);
        assert_eq!(Curve::new(&Bounds::EMPTY).key(DVec3::ONE), 0);
    }

    #[test]
    fn a_pile_has_a_piece_of_its_own() {
        let mut keys: Vec<u128> =
            (0..100).map(|i| if (20..80).contains(&i) { 20 } else { i }).rev().collect();
        let cuts = cuts(&mut keys, 10);
        assert_eq!(cuts, [10, 20, 21, 80, 90]);
        assert_eq!([0, 10, 19, 20, 21, 95].map(|key| piece(&cuts, key)), [0, 1, 1, 2, 3, 5]);
        assert!(super::cuts(&mut [], 4).is_empty() && super::cuts(&mut [7; 9], 1).is_empty());
    }
}
