//! Values of options. In: a word. Out: a value that is possible on its own, or what it must be.

use crate::config::method;

pub(super) fn number(text: &str) -> Result<f64, String> {
    text.parse::<f64>().map_err(|_| "not a number".to_owned())
}

pub(super) fn sigma(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if x >= 0.0 && x.is_finite() {
        Ok(x)
    } else {
        Err("it must be a length above 0, or 0 with --method paper".to_owned())
    }
}

/// A number from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if (0.0..=1.0).contains(&x) { Ok(x) } else { Err("it must lie between 0 and 1".to_owned()) }
}

pub(super) fn length(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if x >= 0.0 && x.is_finite() { Ok(x) } else { Err("it must be 0 or more".to_owned()) }
}

/// Anything that leaves room for the code that would say that it is too little.
const LEAST_MEMORY: u64 = 8 << 20;

pub(super) fn memory(text: &str) -> Result<u64, String> {
    let size: bytesize::ByteSize = text.parse()?;
    if size.as_u64() >= LEAST_MEMORY { Ok(size.as_u64()) } else { Err("it must be 8 MiB or more".to_owned()) }
}

pub(super) fn angle(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if (0.0..=180.0).contains(&x) { Ok(x) } else { Err("it must lie between 0 and 180 degrees".to_owned()) }
}

pub(super) fn edges(text: &str) -> Result<f64, String> {
    let (min, max) = method::SIGMA_EDGES_RANGE;
    let x = number(text)?;
    if (min..=max).contains(&x) || x == 0.0 {
        Ok(x)
    } else {
        Err(format!("it must lie between {min} and {max} median edge lengths, or be 0 with --method paper"))
    }
}
