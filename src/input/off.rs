//! OFF files, the object file format of Geomview, as text.
//!
//! In: the keyword `OFF`, with letters before it that say what vertices have beside a position (`C` colours, `N` normals,
//! `ST` textures), the numbers of vertices, faces and edges, then a line for each vertex and each face. Out: vertices and
//! polygons in this order. Normals, colours and textures are passed over; positions of other than three dimensions and the
//! binary form are refused. The keyword may be missing in a file that is named `.off`.

use super::convert::Gather;
use super::stream::Stream;
use super::text::{Lines, excerpt, integer, words};
use super::{InputError, InputPlace};

/// Reads the whole file; a line has at most `longest` bytes.
pub(super) fn read(stream: &mut Stream<'_>, longest: usize, out: &mut Gather) -> Result<(), InputError> {
    let mut lines = Lines::new(stream, 1, longest);
    let (vertices, faces) = counts(&mut lines, out)?;
    for done in 0..vertices {
        let Some((number, line)) = full(&mut lines)? else {
            return Err(lines.ended(format_args!("only {done} of {vertices} vertices were read")));
        };
        let mut words = words(line);
        let place = InputPlace::Line(number);
        match [words.next(), words.next(), words.next()] {
            [Some(x), Some(y), Some(z)] => out.printed_vertex(place, [x, y, z])?,
            _ => return Err(out.error(place, "a vertex has less than three coordinates".to_owned())),
        }
    }
    let mut corners = Vec::new();
    for done in 0..faces {
        let Some((number, line)) = full(&mut lines)? else {
            return Err(lines.ended(format_args!("only {done} of {faces} faces were read")));
        };
        face(number, line, &mut corners, out)?;
    }
    Ok(())
}

/// The next line that says something.
fn full<'l>(lines: &'l mut Lines<'_, '_>) -> Result<Option<(u64, &'l [u8])>, InputError> {
    while lines.next()?.is_some() {
        if words(lines.current()).next().is_some_and(|word| !word.starts_with(b"#")) {
            return Ok(Some((lines.number(), lines.current())));
        }
    }
    Ok(None)
}

/// The numbers of vertices and faces.
fn counts(lines: &mut Lines<'_, '_>, out: &Gather) -> Result<(u64, u64), InputError> {
    let mut keyword = false;
    while let Some((number, line)) = full(lines)? {
        let line = if number == 1 { line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line) } else { line };
        let place = InputPlace::Line(number);
        let mut words = words(line).take_while(|word| !word.starts_with(b"#")).peekable();
        if let Some(word) = words.next_if(|word| !keyword && word.ends_with(b"OFF")) {
            keyword = true;
            if word.contains(&b'4') || word.contains(&b'n') {
                let reason =
                    format!("{} has vertices of other than three dimensions; export three", excerpt(word));
                return Err(out.error(place, reason));
            }
            if words.peek() == Some(&&b"BINARY"[..]) {
                let reason =
                    "the file is binary OFF, and only its text form is read; re-save it as text, or as PLY";
                return Err(out.error(place, reason.to_owned()));
            }
        }
        let mut count = || words.next().map(|word| (integer(word).and_then(|n| u64::try_from(n).ok()), word));
        match [count(), count()] {
            [None, _] => {}
            [Some((Some(vertices), _)), Some((Some(faces), _))] => return Ok((vertices, faces)),
            [first, second] => {
                let wrong = [first, second].into_iter().flatten().find(|(n, _)| n.is_none());
                let what = wrong.map_or_else(|| "the end of the line".to_owned(), |(_, word)| excerpt(word));
                return Err(
                    out.error(place, format!("{what} where the numbers of vertices and faces should be"))
                );
            }
        }
    }
    Err(lines.ended("the numbers of vertices and faces are missing"))
}

fn face(number: u64, line: &[u8], corners: &mut Vec<u64>, out: &mut Gather) -> Result<(), InputError> {
    let place = InputPlace::Line(number);
    let mut words = words(line);
    let first = words.next().unwrap_or_default();
    let Some(count) = integer(first).and_then(|n| u64::try_from(n).ok()) else {
        return Err(out.error(place, format!("{} is no number of corners", excerpt(first))));
    };
    corners.clear();
    // What follows is the colour.
    for word in words.by_ref().take(usize::try_from(count).unwrap_or(usize::MAX)) {
        match integer(word).map(u64::try_from) {
            Some(Ok(corner)) => corners.push(corner),
            _ => return Err(out.error(place, format!("{} is no number of a vertex", excerpt(word)))),
        }
    }
    if (corners.len() as u64) < count {
        return Err(out.error(place, format!("a face of {count} corners names only {}", corners.len())));
    }
    out.polygon(place, corners)
}
