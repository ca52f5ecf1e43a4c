//! Rolling ground. In: seed and place; out: height and slope, by three octaves of value noise.

use super::super::random::Random;
use glam::DVec2;

/// Wavelength and amplitude of the octaves: together rarely steeper than 10 percent.
const OCTAVES: [(f64, f64); 3] = [(700.0, 14.0), (220.0, 4.0), (70.0, 0.8)];
/// Keeps what is drawn here apart from other streams.
const STREAM: u64 = 0x6772_6f75_6e64;

/// The ground at a place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ground {
    /// Height.
    pub height: f64,
    /// Height over length along x and along y.
    pub slope: DVec2,
}

/// The ground at `at`, which must not be far outside the first quadrant.
pub fn ground(seed: u64, at: DVec2) -> Ground {
    let mut sum = Ground::default();
    for (octave, (wavelength, amplitude)) in (0..).zip(OCTAVES) {
        // One wavelength aside, so that jitter at the border of the city stays in the quadrant.
        let scaled = at / wavelength + 1.0;
        let cell = scaled.floor();
        let [x, y] = cell.to_array().map(|coordinate| coordinate as u64);
        let corner = |dx, dy| 2.0 * Random::at(seed, [STREAM, octave, x + dx, y + dy]).unit() - 1.0;
        let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        let t = scaled - cell;
        // Quintic fade: slopes and curvatures are continuous, so that the ground has no creases of its own.
        let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let rate = 30.0 * t * t * (t * (t - 2.0) + 1.0);
        let twist = a - b - c + d;
        sum.height += amplitude * (a + fade.x * (b - a) + fade.y * (c - a) + fade.x * fade.y * twist);
        let slope = DVec2::new(b - a + twist * fade.y, c - a + twist * fade.x) * rate;
        sum.slope += slope * (amplitude / wavelength);
    }
    sum
}
