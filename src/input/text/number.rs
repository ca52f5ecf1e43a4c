//! Numbers from words.
//!
//! A text does not say how wide its numbers were before they were printed. Mostly they were `f32`, and then the numbers to
//! work with are those `f32` again, so that a mesh gives the same lines as text and as binary file; but coordinates of
//! cities have more digits than an `f32` holds, and must keep them. [`is_printed_float`] tells the two apart.

/// The number that `word` says, to the nearest `f64`.
pub fn real(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    match text.parse() {
        Ok(number) => Some(number),
        // What the run time library of one vendor used to print.
        Err(_) if text.contains("#INF") => Some(f64::INFINITY),
        Err(_) if text.contains("#IND") || text.contains("#QNAN") => Some(f64::NAN),
        Err(_) => None,
    }
}

/// The integer that `word` says.
pub fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Digits of which every `f32` that is neither huge nor tiny keeps all.
const SURE_DIGITS: u32 = 6;
/// Powers of ten that are exact in `f64`.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Whether `word`, which says `value`, is what one gets when the nearest `f32` is printed with as many digits: whether
/// that `f32` differs by no more than half a unit of the last digit.
pub fn is_printed_float(word: &[u8], value: f64) -> bool {
    let narrow = f64::from(value as f32);
    if narrow == value {
        return true;
    }
    let (mut digits, mut decimals, mut in_fraction) = (0u32, 0i32, false);
    let mut rest = word;
    let mut exponent = 0;
    while let [byte, tail @ ..] = rest {
        match byte {
            b'0' if digits == 0 => decimals += i32::from(in_fraction),
            b'0'..=b'9' => {
                digits += 1;
                decimals += i32::from(in_fraction);
            }
            b'.' => in_fraction = true,
            b'e' | b'E' => {
                exponent = integer(tail).and_then(|e| i32::try_from(e).ok()).unwrap_or(i32::MIN / 2);
                break;
            }
            _ => {}
        }
        rest = tail;
    }
    let normal = narrow.is_finite() && narrow.abs() >= f64::from(f32::MIN_POSITIVE);
    if normal && digits <= SURE_DIGITS {
        return true;
    }
    // The last digit stands for ten to that power. Beyond the table nobody prints a float.
    let last = exponent.saturating_sub(decimals);
    let half = match POWERS.get(last.unsigned_abs() as usize) {
        Some(power) if last >= 0 => 0.5 * power,
        Some(power) => 0.5 / power,
        None => return false,
    };
    normal && (value - narrow).abs() <= half
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(word: &str) -> bool {
        is_printed_float(word.as_bytes(), real(word.as_bytes()).unwrap())
    }

    #[test]
    fn floats_are_known_by_their_digits_however_they_were_printed() {
        let mut x = 0.000_123_4f32;
        for i in 0..2000 {
            x *= if i % 3 == 0 { 1.0173 } else { 0.9967 };
            for word in [
                format!("{x}"),
                format!("{x:e}"),
                format!("{x:.4}"),
                format!("{x:.6}"),
                format!("{x:.8e}"),
                format!("{x:.12}"),
                format!("{}", f64::from(x)),
                format!("-{:.6E}", x),
            ] {
                assert!(printed(&word) || x.abs() < 1e-3 && word.starts_with("0.000"), "{word} of {x}");
            }
            assert_eq!(real(format!("{x}").as_bytes()).unwrap() as f32, x);
        }
    }

    #[test]
    fn more_digits_than_a_float_holds_are_seen() {
        for word in [
            "500123.45",
            "5812345.678",
            "0.123456789012",
            "1.00000001",
            "123456789.5",
            "1e-40",
            "1e39",
            "4.9e-324",
        ] {
            assert!(!printed(word), "{word}");
        }
        for word in
            ["0", "-0.0", "0.1", "1.5", "+3.25", "16777216", "84123.46", "1e10", "6.0221e23", "0.33333334"]
        {
            assert!(printed(word), "{word}");
        }
    }

    #[test]
    fn words_that_are_no_numbers_are_none() {
        for word in ["", "x", "1,5", "1.2.3", "0x10", "--1", "\u{663}"] {
            assert_eq!(real(word.as_bytes()), None, "{word}");
            assert_eq!(integer(word.as_bytes()), None, "{word}");
        }
        assert_eq!(real(b"\xff"), None);
        assert_eq!(integer(b"99999999999999999999"), None);
        assert_eq!((integer(b"-7"), integer(b"+8"), integer(b"1.0")), (Some(-7), Some(8), None));
        assert!(real(b"-1.#IND").unwrap().is_nan() && real(b"1.#QNAN0").unwrap().is_nan());
        assert!(real(b"1.#INF").unwrap().is_infinite() && real(b"-inf").unwrap().is_infinite());
    }
}
