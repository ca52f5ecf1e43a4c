//! A seeded generator of numbers. In: a seed and the name of a stream; out: the same numbers on every platform.

use std::f64::consts::TAU;

/// SplitMix64: small, fast, and good enough for jitter and noise.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// A generator of its own for each pair of seed and stream name, so that a new consumer of random numbers does
    /// not shift those of the others.
    pub fn new(seed: u64, stream: &str) -> Self {
        // FNV-1a over the name; the seed goes through the mixer once, so that neighbouring seeds do not stay close.
        let mut name = 0xcbf2_9ce4_8422_2325_u64;
        for byte in stream.bytes() {
            name = (name ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        let mut mixer = Self { state: seed };
        Self { state: mixer.next() ^ name }
    }

    /// A generator of its own for each place: what is drawn there does not depend on what is drawn elsewhere.
    pub fn at(seed: u64, place: [u64; 4]) -> Self {
        let mut mixer = Self { state: seed };
        for coordinate in place {
            mixer.state = mixer.next() ^ coordinate;
        }
        Self { state: mixer.next() }
    }

    /// The next 64 random bits.
    pub fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `0 .. 1`.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `low .. high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal (Box and Muller; the second value is not kept, so that the state stays one number).
    pub fn gaussian(&mut self) -> f64 {
        // `1 - unit` lies in `0 < .. <= 1`, where the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(TAU * self.unit())
    }

    /// Uniform in `0 .. bound`, for `bound > 0`.
    pub fn below(&mut self, bound: usize) -> usize {
        // Multiply and shift: the bias is below `bound / 2^64`.
        ((u128::from(self.next()) * bound as u128) >> 64) as usize
    }

    /// A random permutation of `0 .. count` (Fisher and Yates).
    pub fn permutation(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}
