//! The header of a PLY file.
//!
//! In: the head of the file, at most [`LIMIT`] bytes. Out: the encoding, the elements with their properties in file
//! order, and where the payload starts. The grammar is that of `ply-rs-bw`, but each line is put into its plainest
//! form first, because files in circulation carry blanks, tabs, CR LF, empty lines, comments that are not UTF-8 and
//! property names that are no identifiers. Lines keep their numbers, so that messages name the line of the file.

use super::scalar::ScalarType;
use crate::input::stream::Stream;
use crate::input::{ByteSource, InputError};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{self, DefaultElement, PropertyType};
use std::fmt;

/// Bytes in which the header must end.
pub const LIMIT: u64 = 1 << 20;

/// Bytes in which nearly all headers end.
const USUAL: usize = 64 << 10;

/// How the payload is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Decimal text.
    Ascii,
    /// Binary, most significant byte first.
    BinaryBigEndian,
    /// Binary, least significant byte first.
    BinaryLittleEndian,
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ascii => "ascii",
            Self::BinaryBigEndian => "binary_big_endian",
            Self::BinaryLittleEndian => "binary_little_endian",
        })
    }
}

/// What a property holds in each record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PropertyKind {
    /// One number.
    Scalar(ScalarType),
    /// A length, then that many items.
    List {
        /// Type of the length.
        count: ScalarType,
        /// Type of each item.
        item: ScalarType,
    },
}

impl fmt::Display for PropertyKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scalar(kind) => kind.fmt(f),
            Self::List { count, item } => write!(f, "list {count} {item}"),
        }
    }
}

/// One column of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Property {
    /// As in the file.
    pub name: String,
    /// What it holds.
    pub kind: PropertyKind,
}

/// One table of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// As in the file.
    pub name: String,
    /// Number of records the header announces.
    pub count: u64,
    /// In the order of the bytes of a record.
    pub properties: Vec<Property>,
}

/// What the header announces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// How the payload is written.
    pub encoding: Encoding,
    /// In the order of the payload.
    pub elements: Vec<Element>,
    /// Byte offset of the first record.
    pub payload: u64,
}

impl Header {
    /// Reads and parses the header of `source`.
    ///
    /// # Errors
    /// If the file is empty or not PLY, if the header does not end, or if a line of it is not understood.
    pub fn read(source: &ByteSource) -> Result<Self, InputError> {
        let mut scratch = Vec::new();
        let head = source.bytes(0, source.len().min(LIMIT), &mut scratch)?;
        let whole = source.len() <= LIMIT;
        parse(head, whole).map_err(|reason| InputError::Format { path: source.path().to_owned(), reason })
    }
}

impl Header {
    /// Parses the header at the start of `stream`, and leaves it there.
    ///
    /// # Errors
    /// As for [`Header::read`].
    pub(super) fn peek(stream: &mut Stream<'_>) -> Result<Self, InputError> {
        let limit = LIMIT as usize;
        let parse_head = |stream: &mut Stream<'_>, size: usize| {
            let head = stream.peek(size)?;
            let whole = head.len() < size;
            Ok::<_, InputError>((parse(&head[..head.len().min(limit)], whole), whole))
        };
        // Hardly any header is longer, and the window stays as small as it is.
        let (mut parsed, whole) = parse_head(stream, USUAL)?;
        if parsed.is_err() && !whole {
            (parsed, _) = parse_head(stream, limit + 1)?;
        }
        parsed.map_err(|reason| InputError::Format { path: stream.path().to_owned(), reason })
    }

    /// The same, and consumes it. Returns the number of its lines, too.
    ///
    /// # Errors
    /// As for [`Header::read`].
    pub(super) fn take(stream: &mut Stream<'_>) -> Result<(Self, u64), InputError> {
        let header = Self::peek(stream)?;
        let payload = header.payload as usize;
        let lines = stream.available()[..payload].iter().filter(|byte| **byte == b'\n').count();
        stream.consume(payload);
        Ok((header, lines as u64))
    }
}

/// Parses the header at the start of `head`; `whole` if nothing of the file comes after `head`.
fn parse(head: &[u8], whole: bool) -> Result<Header, String> {
    check_magic(head)?;
    let plain = PlainHeader::new(head, whole)?;
    let parsed = Parser::<DefaultElement>::new()
        .read_header(&mut Reader::new(plain.text.as_bytes()))
        .map_err(|error| refusal(head, &error))?;
    // The library keeps the order of the lines, and the names were collected in that order.
    let mut names = plain.names.into_iter();
    let mut elements = Vec::new();
    for definition in parsed.elements.values() {
        let name = names.next().unwrap_or_default();
        let properties = definition
            .properties
            .values()
            .map(|property| Property {
                name: names.next().unwrap_or_default(),
                kind: property_kind(&property.data_type),
            })
            .collect();
        elements.push(Element { name, count: definition.count as u64, properties });
    }
    let encoding = match parsed.encoding {
        ply::Encoding::Ascii => Encoding::Ascii,
        ply::Encoding::BinaryBigEndian => Encoding::BinaryBigEndian,
        ply::Encoding::BinaryLittleEndian => Encoding::BinaryLittleEndian,
    };
    Ok(Header { encoding, elements, payload: plain.payload })
}

fn check_magic(head: &[u8]) -> Result<(), String> {
    if head.is_empty() {
        return Err("the file is empty; a PLY mesh is expected".to_owned());
    }
    let first = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    if first.trim_ascii() == b"ply" {
        Ok(())
    } else if first.starts_with(b"ply\r") {
        Err("the header lines end in CR alone; re-save the file with LF or CR LF line ends".to_owned())
    } else {
        Err("not a PLY file: its first line is not `ply`; convert the mesh to binary_little_endian PLY"
            .to_owned())
    }
}

/// The header in the form the library understands.
struct PlainHeader {
    /// One plain line for each line of the file up to `end_header`.
    text: String,
    /// Names of elements and properties, in the order of their lines.
    names: Vec<String>,
    /// Where the line after `end_header` starts.
    payload: u64,
}

impl PlainHeader {
    fn new(head: &[u8], whole: bool) -> Result<Self, String> {
        let mut plain = Self { text: String::new(), names: Vec::new(), payload: 0 };
        let mut before_elements = true;
        for line in head.split_inclusive(|&byte| byte == b'\n') {
            plain.payload += line.len() as u64;
            if !line.ends_with(b"\n") && !whole {
                break;
            }
            let line = String::from_utf8_lossy(line);
            let tokens: Vec<&str> = line.split_ascii_whitespace().collect();
            match tokens.as_slice() {
                ["end_header"] => {
                    plain.text.push_str("end_header\n");
                    return Ok(plain);
                }
                [] | ["comment" | "obj_info", ..] => plain.text.push_str("comment"),
                ["element", name, count] => {
                    before_elements = false;
                    let stand_in = plain.stand_in(name);
                    plain.push(&["element", &stand_in, count]);
                }
                ["property", kind, name] => {
                    let stand_in = plain.stand_in(name);
                    plain.push(&["property", kind, &stand_in]);
                }
                ["property", "list", count, item, name] => {
                    let stand_in = plain.stand_in(name);
                    plain.push(&["property", "list", count, item, &stand_in]);
                }
                ["ply" | "format" | "element" | "property", ..] => plain.push(&tokens),
                // Some writers sign their files without the word `comment`. Before the first element such a line
                // cannot hide a column of the payload.
                _ if before_elements => plain.text.push_str("comment"),
                tokens => plain.push(tokens),
            }
            plain.text.push('\n');
        }
        Err(if whole {
            "the file ends inside the header: there is no `end_header` line; the file is cut off or not a mesh".to_owned()
        } else {
            format!(
                "there is no `end_header` line in the first {LIMIT} bytes; the file is damaged or not a mesh"
            )
        })
    }

    fn push(&mut self, tokens: &[&str]) {
        self.text.push_str(&tokens.join(" "));
    }

    /// Keeps `name` and gives back what to call it meanwhile: the library reads identifiers only, and it would
    /// silently merge two properties of one name, which would shift everything behind them.
    fn stand_in(&mut self, name: &str) -> String {
        self.names.push(name.to_owned());
        format!("n{}", self.names.len())
    }
}

fn property_kind(kind: &PropertyType) -> PropertyKind {
    match kind {
        PropertyType::Scalar(kind) => PropertyKind::Scalar(scalar_type(kind)),
        PropertyType::List(count, item) => {
            PropertyKind::List { count: scalar_type(count), item: scalar_type(item) }
        }
    }
}

fn scalar_type(kind: &ply::ScalarType) -> ScalarType {
    match kind {
        ply::ScalarType::Char => ScalarType::I8,
        ply::ScalarType::UChar => ScalarType::U8,
        ply::ScalarType::Short => ScalarType::I16,
        ply::ScalarType::UShort => ScalarType::U16,
        ply::ScalarType::Int => ScalarType::I32,
        ply::ScalarType::UInt => ScalarType::U32,
        ply::ScalarType::Float => ScalarType::F32,
        ply::ScalarType::Double => ScalarType::F64,
    }
}

/// The library's objection on one line, with the line as it is in the file.
fn refusal(head: &[u8], error: &ply_rs_bw::parser::ParseError) -> String {
    let message = error.to_string();
    let message = message.lines().next().unwrap_or_default();
    let message = message.split_once(": ").map_or(message, |(_, rest)| rest).trim_end_matches('.');
    let Some(number) = error.line() else {
        return format!("the header is not understood: {message}; re-save the file");
    };
    let line = head.split(|&byte| byte == b'\n').nth(number.saturating_sub(1)).unwrap_or_default();
    let line: String = String::from_utf8_lossy(line.trim_ascii()).chars().take(80).collect();
    format!(
        "line {number} of the header is not understood: `{}` ({message}); re-save the file",
        line.escape_debug()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use ScalarType::*;

    fn scalar(name: &str, kind: ScalarType) -> Property {
        Property { name: name.to_owned(), kind: PropertyKind::Scalar(kind) }
    }

    #[test]
    fn elements_and_properties_keep_their_order() {
        let text = b"ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement vertex 8\nproperty float x\n\
            property uint8 y\nproperty float64 z\nelement face 6\nproperty list uchar int vertex_indices\n\
            property ushort flags\nelement edge 0\nend_header\n\n\n";
        let header = parse(text, true).unwrap();
        assert_eq!(header.encoding, Encoding::BinaryLittleEndian);
        assert_eq!(header.payload, text.len() as u64 - 2);
        assert_eq!(header.elements.len(), 3);
        assert_eq!(header.elements[0].properties, [scalar("x", F32), scalar("y", U8), scalar("z", F64)]);
        assert_eq!(header.elements[1].count, 6);
        let list =
            Property { name: "vertex_indices".to_owned(), kind: PropertyKind::List { count: U8, item: I32 } };
        assert_eq!(header.elements[1].properties, [list, scalar("flags", U16)]);
        assert_eq!(header.elements[2], Element { name: "edge".to_owned(), count: 0, properties: vec![] });
        assert_eq!(header.elements[1].properties[0].kind.to_string(), "list uchar int");
    }

    #[test]
    fn every_spelling_of_every_type_is_known() {
        let spellings = [
            ("char", I8),
            ("int8", I8),
            ("uchar", U8),
            ("uint8", U8),
            ("short", I16),
            ("int16", I16),
            ("ushort", U16),
            ("uint16", U16),
            ("int", I32),
            ("int32", I32),
            ("uint", U32),
            ("uint32", U32),
            ("float", F32),
            ("float32", F32),
            ("double", F64),
            ("float64", F64),
        ];
        for (spelling, kind) in spellings {
            let text = format!(
                "ply\nformat ascii 1.0\nelement e 1\nproperty {spelling} p\nproperty list {spelling} uchar q\nend_header\n"
            );
            let header = parse(text.as_bytes(), true).unwrap();
            let properties = &header.elements[0].properties;
            assert_eq!(properties[0].kind, PropertyKind::Scalar(kind));
            assert_eq!(properties[1].kind, PropertyKind::List { count: kind, item: U8 });
        }
    }

    #[test]
    fn odd_headers_are_read_like_plain_ones() {
        let plain = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nend_header\n";
        let expected = parse(plain.as_bytes(), true).unwrap();
        let odd: [&[u8]; 6] = [
            b"ply\r\nformat binary_big_endian 1.0\r\nelement vertex 3\r\nproperty float x\r\nend_header\r\n",
            b"ply \n\tformat  binary_big_endian\t1.0\t\n element\tvertex   3 \n\tproperty \t float x\n end_header \n",
            b"ply\n\nformat binary_big_endian 1.0\n  \nelement vertex 3\nproperty float x\n\nend_header\n",
            b"ply\nformat binary_big_endian 1.0\ncomment\ncomment caf\xe9 end_header\nobj_info x\nelement vertex 3\n\
              obj_info\nproperty float x\nend_header\n",
            b"ply\nformat binary_big_endian 1.0\nCreated by a modeller\nelement vertex 3\nproperty float x\nend_header\n",
            b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nend_header",
        ];
        for text in odd {
            let header = parse(text, true).unwrap();
            assert_eq!(header.elements, expected.elements);
            assert_eq!(header.encoding, expected.encoding);
            assert_eq!(header.payload, text.len() as u64);
        }
    }

    #[test]
    fn the_payload_starts_right_after_the_line_end() {
        let text = b"ply\nformat ascii 1.0\nend_header\n\r\n\n\x03";
        assert_eq!(parse(text, true).unwrap().payload, text.len() as u64 - 4);
    }

    #[test]
    fn names_need_not_be_identifiers_or_differ() {
        let text = b"ply\nformat ascii 1.0\nelement 3d.points 1\nproperty float C2C_(m)\nproperty float x\n\
            property int x\nend_header\n";
        let header = parse(text, true).unwrap();
        assert_eq!(header.elements[0].name, "3d.points");
        let expected = [scalar("C2C_(m)", F32), scalar("x", F32), scalar("x", I32)];
        assert_eq!(header.elements[0].properties, expected);
    }

    #[test]
    fn refusals_name_the_reason() {
        let cases: [(&[u8], &str); 12] = [
            (b"", "empty"),
            (b"solid cube\n", "not a PLY file"),
            (b"\x00\x01", "not a PLY file"),
            (b"ply\rformat ascii 1.0\rend_header\r", "CR alone"),
            (b"ply\nformat ascii 1.0\nelement vertex 3\n", "ends inside the header"),
            (b"ply\nelement vertex 3\nend_header\n", "No format line"),
            (b"ply\nformat binary_middle_endian 1.0\nend_header\n", "line 2 of the header"),
            (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "line 3 of the header"),
            (
                b"ply\nformat ascii 1.0\nelement vertex 99999999999999999999\nend_header\n",
                "line 3 of the header",
            ),
            (b"ply\nformat ascii 1.0\nelement v 3\nproprety float x\nend_header\n", "`proprety float x`"),
            (b"ply\nformat ascii 1.0\nelement v 3\nproperty half x\nend_header\n", "`property half x`"),
            (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3 of the header"),
        ];
        for (text, expected) in cases {
            let reason = parse(text, true).unwrap_err();
            assert!(reason.contains(expected), "{reason:?} does not say {expected:?}");
            assert!(!reason.contains('\n'), "{reason:?}");
        }
    }

    #[test]
    fn the_header_must_end_within_the_limit() {
        let mut text = b"ply\nformat ascii 1.0\n".to_vec();
        while text.len() < LIMIT as usize {
            text.extend_from_slice(b"comment and so on\n");
        }
        text.truncate(LIMIT as usize);
        let reason = parse(&text, false).unwrap_err();
        assert!(reason.contains("first 1048576 bytes"), "{reason}");
    }
}
