//! The payload of an ASCII PLY file: a line for each record, its values in the order of the properties.
//!
//! A line with fewer values than the header declares is an error. Surplus values at its end are passed over: a widespread
//! program writes colours there that it does not declare. So are empty lines. Coordinates that are declared `float` may have more digits than an `f32` holds, and keep
//! them; see [`is_printed_float`](crate::input::text::is_printed_float).

use super::header::{Element, PropertyKind};
use super::scalar::ScalarType;
use super::stream::Role;
use crate::input::convert::Gather;
use crate::input::stream::Stream;
use crate::input::text::{Lines, excerpt, integer, words};
use crate::input::{InputError, InputPlace};

/// Reads `elements`, the first record of which is in line `first`; a line has at most `longest` bytes.
pub fn read(
    stream: &mut Stream<'_>,
    first: u64,
    longest: usize,
    elements: &[(&Element, Role)],
    out: &mut Gather,
) -> Result<(), InputError> {
    let mut lines = Lines::new(stream, first, longest);
    let mut corners = Vec::new();
    for (element, role) in elements.iter().filter(|(element, _)| !element.properties.is_empty()) {
        let mut done = 0;
        while done < element.count {
            let Some((number, line)) = lines.next()? else {
                let missing = format_args!(
                    "only {done} of {} records of element `{}` were read",
                    element.count, element.name
                );
                return Err(lines.ended(missing));
            };
            let mut words = words(line);
            let place = InputPlace::Line(number);
            match role {
                _ if line.trim_ascii().is_empty() => continue,
                Role::Vertex(coordinates) => vertex(place, element, coordinates, &mut words, out)?,
                Role::Face(indices) => {
                    corners.clear();
                    record(place, element, &mut words, out, |property, word| match property == *indices {
                        true => corner(word).map(|corner| corners.push(corner)),
                        false => Some(()),
                    })?;
                    out.polygon(place, &corners)?;
                }
                Role::Other => record(place, element, &mut words, out, |_, _| Some(()))?,
            }
            done += 1;
        }
    }
    Ok(())
}

fn corner(word: &[u8]) -> Option<u64> {
    integer(word).and_then(|index| u64::try_from(index).ok())
}

fn vertex<'l>(
    place: InputPlace,
    element: &Element,
    coordinates: &[usize; 3],
    words: &mut impl Iterator<Item = &'l [u8]>,
    out: &mut Gather,
) -> Result<(), InputError> {
    let mut found: [&[u8]; 3] = [b""; 3];
    record(place, element, words, out, |property, word| {
        if let Some(axis) = coordinates.iter().position(|coordinate| *coordinate == property) {
            found[axis] = word;
        }
        Some(())
    })?;
    let float = |index: &usize| element.properties[*index].kind == PropertyKind::Scalar(ScalarType::F32);
    if coordinates.iter().any(float) {
        out.printed_vertex(place, found)
    } else {
        let position = out.reals(place, found)?;
        out.vertex(place, position)
    }
}

/// Goes through the values of a record, with `visit(property, value)`, which refuses what it cannot use.
fn record<'l>(
    place: InputPlace,
    element: &Element,
    words: &mut impl Iterator<Item = &'l [u8]>,
    out: &Gather,
    mut visit: impl FnMut(usize, &'l [u8]) -> Option<()>,
) -> Result<(), InputError> {
    for (index, property) in element.properties.iter().enumerate() {
        let name = &property.name;
        let mut value = || {
            let missing = || {
                format!(
                    "the line ends before the value of `{name}`, a property of element `{}`",
                    element.name
                )
            };
            words.next().ok_or_else(|| out.error(place, missing()))
        };
        let bad = |word: &[u8]| out.error(place, format!("{} is no value for `{name}`", excerpt(word)));
        let count = match property.kind {
            PropertyKind::Scalar(_) => 1,
            PropertyKind::List { .. } => {
                let word = value()?;
                corner(word).ok_or_else(|| bad(word))?
            }
        };
        for _ in 0..count {
            let word = value()?;
            visit(index, word).ok_or_else(|| bad(word))?;
        }
    }
    Ok(())
}
