//! ASCII STL: `solid`, then `facet`, `outer loop`, three times `vertex`, `endloop`, `endfacet` for each triangle, `endsolid`;
//! several solids may follow each other.

use crate::input::convert::Gather;
use crate::input::stream::Stream;
use crate::input::text::{Lines, excerpt, words};
use crate::input::{InputError, InputPlace};

/// Reads the whole file; a line has at most `longest` bytes.
pub fn read(stream: &mut Stream<'_>, longest: usize, out: &mut Gather) -> Result<(), InputError> {
    let mut lines = Lines::new(stream, 1, longest);
    // Corners of the loop that is open.
    let mut corners: Option<u32> = None;
    while let Some((number, line)) = lines.next()? {
        let place = InputPlace::Line(number);
        let line = if number == 1 { line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line) } else { line };
        let mut words = words(line);
        let Some(first) = words.next() else { continue };
        let is = |keyword: &[u8]| first.eq_ignore_ascii_case(keyword);
        match &mut corners {
            Some(count) if is(b"vertex") => {
                *count += 1;
                match [words.next(), words.next(), words.next()] {
                    [Some(x), Some(y), Some(z)] if *count <= 3 => out.printed_vertex(place, [x, y, z])?,
                    [_, _, Some(_)] => return Err(out.error(place, "a facet has a fourth corner".to_owned())),
                    _ => return Err(out.error(place, "a vertex has less than three coordinates".to_owned())),
                }
            }
            Some(3) if is(b"endloop") => corners = None,
            Some(count) if is(b"endloop") => {
                let reason = format!("a facet ends after {count} corners instead of three");
                return Err(out.error(place, reason));
            }
            None if is(b"outer") => corners = Some(0),
            // A name may be anything, and so may normals: they are not used.
            None if [&b"solid"[..], b"endsolid", b"facet", b"endfacet"].iter().any(|k| is(k)) => {}
            _ => return Err(out.error(place, format!("{} is not expected here", excerpt(first)))),
        }
    }
    match corners {
        None => Ok(()),
        Some(_) => Err(lines.ended("a facet is not complete")),
    }
}
