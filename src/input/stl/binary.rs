//! Binary STL: 80 bytes of anything, the number of triangles, then 50 bytes for each: normal, corners, two spare bytes.

use crate::input::convert::Gather;
use crate::input::stream::Stream;
use crate::input::{InputError, InputPlace};

/// Bytes before the first triangle.
const HEAD: u64 = 84;
/// Bytes of a triangle.
const TRIANGLE: u64 = 50;
/// Bytes of its normal.
const NORMAL: usize = 12;
/// Bytes behind its corners.
const SPARE: usize = 2;

/// Reads the whole file.
pub fn read(stream: &mut Stream<'_>, out: &mut Gather) -> Result<(), InputError> {
    let length = stream.length();
    let head = stream.peek(HEAD as usize)?;
    let Some(&[a, b, c, d]) = head.get(80..84) else {
        let reason = format!(
            "a binary STL file has 84 bytes before its triangles, this one ends after {}",
            head.len()
        );
        return Err(out.error(InputPlace::Byte(head.len() as u64), reason));
    };
    let announced = triangles(u32::from_le_bytes([a, b, c, d]), length);
    stream.consume(HEAD as usize);
    for triangle in 0..announced {
        let at = stream.offset();
        let bytes = stream.peek(TRIANGLE as usize)?;
        let Some(corners) = bytes.get(..TRIANGLE as usize).map(|all| &all[NORMAL..all.len() - SPARE]) else {
            let reason =
                format!("the file ends in triangle {triangle} of {announced}; it is cut off or damaged");
            return Err(out.error(InputPlace::Byte(at), reason));
        };
        let mut numbers = [0.0; 9];
        for (number, bytes) in numbers.iter_mut().zip(corners.chunks_exact(4)) {
            *number = f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        }
        stream.consume(TRIANGLE as usize);
        for corner in numbers.chunks_exact(3) {
            out.vertex(InputPlace::Byte(at), [corner[0], corner[1], corner[2]])?;
        }
    }
    Ok(())
}

/// How many triangles there are: what is announced, or what the length says if the counter, of 32 bits, has overflown.
fn triangles(announced: u32, length: Option<u64>) -> u64 {
    let fitting =
        length.filter(|n| *n > HEAD && (n - HEAD).is_multiple_of(TRIANGLE)).map(|n| (n - HEAD) / TRIANGLE);
    fitting.filter(|n| *n as u32 == announced).unwrap_or(announced.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_went_round_is_seen() {
        let all = (1u64 << 32) + 7;
        assert_eq!(triangles(7, Some(HEAD + TRIANGLE * all)), all);
        assert_eq!(triangles(7, Some(HEAD + TRIANGLE * 7)), 7);
        assert_eq!(triangles(7, Some(HEAD + TRIANGLE * 9)), 7);
        assert_eq!(triangles(7, None), 7);
    }
}
