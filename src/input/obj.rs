//! Wavefront OBJ files.
//!
//! In: the statements `v` and `f`, in any order, with all that may stand between them. Out: vertices and polygons in the
//! order of the file. A corner is `v`, `v/vt`, `v//vn` or `v/vt/vn`; a number below 0 counts back from the vertex that was
//! read last. Names, groups, normals, textures, lines, points and free forms say nothing about the surface and are passed
//! over, as is whatever follows the third coordinate of a vertex: weights and colours. A line that ends in a backslash goes
//! on with the next one.

use super::convert::Gather;
use super::stream::Stream;
use super::text::{Lines, excerpt, integer, words};
use super::{InputError, InputPlace};

/// Reads the whole file; a statement has at most `longest` bytes.
pub(super) fn read(stream: &mut Stream<'_>, longest: usize, out: &mut Gather) -> Result<(), InputError> {
    let mut lines = Lines::new(stream, 1, longest);
    let mut corners = Vec::new();
    // A statement of several lines, and the first of them.
    let mut joined: Option<(u64, Vec<u8>)> = None;
    while let Some((number, line)) = lines.next()? {
        let line = if number == 1 { line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line) } else { line };
        let continued = line.trim_ascii_end().strip_suffix(b"\\");
        match (&mut joined, continued) {
            (None, None) => statement(number, line, &mut corners, out)?,
            (None, Some(text)) => joined = Some((number, [text, b" "].concat())),
            (Some((first, all)), part) => {
                all.extend_from_slice(part.unwrap_or(line));
                all.push(b' ');
                if all.len() > longest {
                    let reason =
                        format!("the statement has more than {longest} bytes; allow more with --memory");
                    return Err(out.error(InputPlace::Line(*first), reason));
                }
                if part.is_none() {
                    statement(*first, all, &mut corners, out)?;
                    joined = None;
                }
            }
        }
    }
    joined.map_or(Ok(()), |(number, all)| statement(number, &all, &mut corners, out))
}

fn statement(number: u64, line: &[u8], corners: &mut Vec<u64>, out: &mut Gather) -> Result<(), InputError> {
    let mut words = words(line).take_while(|word| !word.starts_with(b"#"));
    let place = InputPlace::Line(number);
    match words.next() {
        Some(b"v") => match [words.next(), words.next(), words.next()] {
            [Some(x), Some(y), Some(z)] => out.printed_vertex(place, [x, y, z]),
            _ => Err(out.error(place, "a vertex has less than three coordinates".to_owned())),
        },
        // `fo` is what faces were called in early files.
        Some(b"f" | b"fo") => {
            corners.clear();
            for word in words {
                corners.push(corner(place, word, out)?);
            }
            out.polygon(place, corners)
        }
        _ => Ok(()),
    }
}

/// The vertex that a corner names, counted from 0.
fn corner(place: InputPlace, word: &[u8], out: &Gather) -> Result<u64, InputError> {
    let name = word.split(|&byte| byte == b'/').next().unwrap_or_default();
    let before = out.vertex_count();
    match integer(name) {
        None => Err(out.error(place, format!("{} is no corner of a face", excerpt(word)))),
        Some(0) => Err(out.error(place, "a face names vertex 0; vertices are counted from 1".to_owned())),
        Some(index @ 1..) => Ok(index.cast_unsigned() - 1),
        Some(index) => before.checked_sub(index.unsigned_abs()).ok_or_else(|| {
            let reason = format!("a face names vertex {index}, but only {before} vertices come before it");
            out.error(place, reason)
        }),
    }
}
