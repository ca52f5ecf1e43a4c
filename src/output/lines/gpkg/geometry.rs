//! Points as the geometry of a feature: the head of GeoPackage with a box, then ISO WKB of a LineString Z.

use glam::DVec3;

/// A box with its sides along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Box3 {
    low: DVec3,
    high: DVec3,
}

impl Box3 {
    /// The smallest around `points`, if there are any.
    pub fn of(points: &[DVec3]) -> Option<Box3> {
        let (first, rest) = points.split_first()?;
        let start = Box3 { low: *first, high: *first };
        Some(rest.iter().fold(start, |all, &p| all.join(Box3 { low: p, high: p })))
    }

    /// The smallest around both.
    pub fn join(self, other: Box3) -> Box3 {
        Box3 { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The lowest and the highest coordinates.
    pub fn corners(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }
}

/// Little-endian, with a box of x, y and z.
const FLAGS: u8 = 1 | 2 << 1;
/// LineString Z of ISO WKB.
const LINE_STRING_Z: u32 = 1002;

/// Replaces `out` by the geometry of a line through `points` in the system `srs`.
pub(super) fn blob(points: &[DVec3], bounds: &Box3, srs: i32, out: &mut Vec<u8>) {
    out.clear();
    out.extend(b"GP");
    out.extend([0, FLAGS]);
    out.extend(srs.to_le_bytes());
    for (low, high) in bounds.low.to_array().into_iter().zip(bounds.high.to_array()) {
        out.extend(low.to_le_bytes());
        out.extend(high.to_le_bytes());
    }
    out.push(1);
    out.extend(LINE_STRING_Z.to_le_bytes());
    out.extend((points.len() as u32).to_le_bytes());
    points.iter().flat_map(DVec3::to_array).for_each(|x| out.extend(x.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometry_is_what_the_specification_says() {
        let points = [DVec3::new(1.0, 5.0, -2.0), DVec3::new(0.5, 7.0, 3.0)];
        let bounds = Box3::of(&points).expect("there are points");
        let mut out = vec![9];
        blob(&points, &bounds, 28992, &mut out);
        let mut expected: Vec<u8> = b"GP\x00\x05\x40\x71\x00\x00".to_vec();
        let numbers = |all: &[f64]| all.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        expected.extend(numbers(&[0.5, 1.0, 5.0, 7.0, -2.0, 3.0]));
        expected.extend(b"\x01\xea\x03\x00\x00\x02\x00\x00\x00");
        expected.extend(numbers(&[1.0, 5.0, -2.0, 0.5, 7.0, 3.0]));
        assert_eq!(out, expected);
        assert_eq!(Box3::of(&[]), None);
    }
}
