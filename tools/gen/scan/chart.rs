//! Where the lattice of a block lies in the plane. In: a point of the lattice, whole or jittered; out: its place.
//!
//! The lattice is one of rings: ring r is what lies r cells inside the border of the block. Streets are the rings up to
//! [`KERB_FOOT`], then the kerb rises up to [`KERB_TOP`]. It is steep, so that its rings lie closer in the plane; rings
//! inside it have cells of side 1, those of the street are shorter by a few hundredths.

use glam::DVec2;

/// Ring where the kerb begins: the half width of a street.
pub const KERB_FOOT: u32 = 5;
/// Ring where it ends.
pub const KERB_TOP: u32 = 7;
/// Height of the kerb.
pub const KERB_HEIGHT: f64 = 1.8;
/// Width of the kerb, seen from above: with the height above 66 degrees steep, and two cells of side 1 along the slope.
const KERB_WIDTH: f64 = 0.8;
/// How much the kerb is narrower than its cells.
const SAVED: f64 = (KERB_TOP - KERB_FOOT) as f64 - KERB_WIDTH;

/// The plane map of blocks of one size.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Cells along a side.
    pub side: u32,
}

impl Chart {
    /// For blocks of `side` cells.
    pub fn new(side: u32) -> Self {
        Self { side }
    }

    /// From one block to the next.
    pub fn pitch(&self) -> f64 {
        f64::from(self.side) - 2.0 * SAVED
    }

    /// Ring of a point: the distance to the border in cells; negative just outside.
    pub fn ring(&self, at: DVec2) -> f64 {
        let side = f64::from(self.side);
        at.min(DVec2::splat(side) - at).min_element()
    }

    /// Place relative to the lower left corner of the block.
    pub fn place(&self, at: DVec2) -> DVec2 {
        let side = f64::from(self.side);
        let ring = self.ring(at);
        let (near, cells) = (distance(ring), side - 2.0 * ring);
        if cells <= 0.0 {
            // The very middle is a ring without length, where the end of a ridge may lie.
            return DVec2::splat(near);
        }
        // Both coordinates run linearly along the ring; for the one across, this gives the distance of the ring.
        near + (at - ring) * ((self.pitch() - 2.0 * near) / cells)
    }

    /// How high a ring lies above the street.
    pub fn height(ring: f64) -> f64 {
        let [foot, top] = [KERB_FOOT, KERB_TOP].map(f64::from);
        KERB_HEIGHT * ((ring - foot) / (top - foot)).clamp(0.0, 1.0)
    }
}

/// Distance of a ring from the border of the block.
fn distance(ring: f64) -> f64 {
    let [foot, top] = [KERB_FOOT, KERB_TOP].map(f64::from);
    let squeezed = (ring.min(top) - foot).max(0.0) * (SAVED / (top - foot));
    ring - squeezed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_block_has_a_place() {
        let chart = Chart::new(80);
        let middle = chart.place(DVec2::splat(40.0));
        assert!((middle - 0.5 * chart.pitch()).length() < 1e-12, "{middle}");
        let beside = chart.place(DVec2::new(40.0, 40.0 + 1e-9));
        assert!((middle - beside).length() < 1e-8, "{beside}");
    }
}
