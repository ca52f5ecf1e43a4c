//! What a file is: known by its content where that says it, and by its name elsewhere.
//!
//! In: the first bytes of a file, unpacked, and its name. Out: one of the formats that are read here, or an error that
//! says what to do instead. The content decides before the name, because files get renamed. An OBJ file and a binary STL
//! file have no mark of their own: the first is known by its statements, the second by a length that fits its count.

use super::InputError;
use super::stream::{Packing, Stream};
use super::text::words;
use std::path::Path;

/// A format that is read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The polygon file format, in any of its encodings.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Stereolithography, binary.
    StlBinary,
    /// Stereolithography, as text.
    StlAscii,
    /// The object file format of Geomview.
    Off,
}

impl Format {
    /// What the names of files end in that are looked for in a folder, packed or not.
    pub const EXTENSIONS: [&str; 4] = ["ply", "obj", "stl", "off"];

    /// The name of it.
    pub fn name(self) -> &'static str {
        match self {
            Format::Ply => "PLY",
            Format::Obj => "OBJ",
            Format::StlBinary => "binary STL",
            Format::StlAscii => "ASCII STL",
            Format::Off => "OFF",
        }
    }
}

/// Bytes that are looked at.
const HEAD: usize = 16 << 10;
/// Bytes before the triangles of a binary STL file, and of each triangle.
const STL_SIZES: (u64, u64) = (84, 50);

/// What begins otherwise: its first bytes, what it is, and what to do.
const OTHERS: [(&[u8], &str, &str); 18] = [
    (b"LASF", "a LAS or LAZ point cloud", RECONSTRUCT),
    (b"ASTM-E57", "an E57 point cloud", RECONSTRUCT),
    (b"# .PCD", "a PCD point cloud", RECONSTRUCT),
    (b"PK\x03\x04", "a ZIP archive", "unpack it and give the meshes in it"),
    (b"BZh", "packed by bzip2", "unpack it first, or pack it with gzip or zstd"),
    (b"\xfd7zXZ\x00", "packed by xz", "unpack it first, or pack it with gzip or zstd"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it and give the meshes in it"),
    (b"Rar!", "a RAR archive", "unpack it and give the meshes in it"),
    (b"\x04\x22\x4d\x18", "packed by lz4", "unpack it first, or pack it with gzip or zstd"),
    (b"glTF", "a glTF model", EXPORT),
    (b"DRACO", "a Draco model", EXPORT),
    (b"b3dm", "a 3D tile", EXPORT),
    (b"Kaydara FBX", "an FBX model", EXPORT),
    (b"#VRML", "a VRML model", EXPORT),
    (b"# vtk", "a VTK file", EXPORT),
    (b"<?xml", "an XML file", EXPORT),
    (b"{", "a JSON file", EXPORT),
    (b"\x89HDF", "an HDF5 file", EXPORT),
];
const EXPORT: &str = "export the mesh as PLY, OBJ, STL or OFF";
const RECONSTRUCT: &str =
    "reconstruct its surface, for instance by Poisson reconstruction in MeshLab or CloudCompare";

/// What to do about points without faces.
pub(super) fn no_faces() -> String {
    format!("there are no faces; if it is a point cloud, it must be meshed first: {RECONSTRUCT}")
}

impl Format {
    /// Finds out what `stream`, of which nothing has been consumed, contains.
    ///
    /// # Errors
    /// If the file cannot be read, is empty, or is something else.
    pub fn of(stream: &mut Stream<'_>) -> Result<Format, InputError> {
        let path = stream.path().to_owned();
        let length = stream.length();
        let head = stream.peek(HEAD)?;
        // What ends within the head is as long as what is there.
        let length = length.or((head.len() < HEAD).then_some(head.len() as u64));
        let head = &head[..head.len().min(HEAD)];
        match by_content(head, length).or_else(|| by_name(&path)) {
            Some(format) => Ok(format),
            None => Err(InputError::Format { path, reason: refusal(head) }),
        }
    }
}

fn by_content(head: &[u8], length: Option<u64>) -> Option<Format> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    if head.starts_with(b"ply") && head.get(3).is_none_or(u8::is_ascii_whitespace) {
        return Some(Format::Ply);
    }
    let stl = stl_triangles(head).and_then(|n| n.checked_mul(STL_SIZES.1)?.checked_add(STL_SIZES.0));
    if length.is_some() && stl == length {
        return Some(Format::StlBinary);
    }
    // Binary files that begin with `solid`, too, are in circulation; they have null bytes soon.
    let is_text = !text.contains(&0);
    if starts_with_word(text, b"solid") && (is_text || has_word(text, b"facet")) {
        return Some(Format::StlAscii);
    }
    let mut statements =
        text.split(|byte| matches!(byte, b'\n' | b'\r')).filter_map(|line| words(line).next());
    let first = statements.clone().find(|word| !word.starts_with(b"#"))?;
    if first.strip_suffix(b"OFF").is_some_and(|before| before.iter().all(|byte| b"STCN4n".contains(byte))) {
        return Some(Format::Off);
    }
    let vertex = statements.any(|word| word == b"v");
    let keyword = [&b"v"[..], b"vn", b"vt", b"o", b"g", b"s", b"mtllib", b"usemtl"].contains(&first);
    (is_text && vertex && keyword).then_some(Format::Obj)
}

/// How many triangles a binary STL file says it has.
fn stl_triangles(head: &[u8]) -> Option<u64> {
    let count = head.get(80..84)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

fn starts_with_word(text: &[u8], word: &[u8]) -> bool {
    words(text).next().is_some_and(|first| first.eq_ignore_ascii_case(word))
}

fn has_word(text: &[u8], wanted: &[u8]) -> bool {
    words(text).any(|word| word.eq_ignore_ascii_case(wanted))
}

/// By what the name ends in, that of a packed file without the last part.
fn by_name(path: &Path) -> Option<Format> {
    let extension = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
    let mut found = extension(path)?;
    if Packing::EXTENSIONS.contains(&found.as_str()) {
        found = extension(path.with_extension("").as_path())?;
    }
    match found.as_str() {
        "ply" => Some(Format::Ply),
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::StlBinary),
        "off" | "coff" | "noff" => Some(Format::Off),
        _ => None,
    }
}

fn refusal(head: &[u8]) -> String {
    if head.is_empty() {
        return "the file is empty; a mesh is expected".to_owned();
    }
    match OTHERS.iter().find(|(start, ..)| head.starts_with(start)) {
        Some((_, what, remedy)) => format!("it is {what}, which is not read here; {remedy}"),
        None => format!("it is no mesh that is read here, by its content nor by its name; {EXPORT}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, content: &[u8]) -> Result<Format, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, content).unwrap();
        let mut stream = Stream::open(&path, 1 << 20, &|_| ()).unwrap();
        Format::of(&mut stream).map_err(|e| e.to_string())
    }

    fn binary_stl(title: &[u8], triangles: u32) -> Vec<u8> {
        let mut bytes = title.to_vec();
        bytes.resize(80, 0);
        bytes.extend(triangles.to_le_bytes());
        bytes.resize(84 + 50 * triangles as usize, 0);
        bytes
    }

    #[test]
    fn content_decides() {
        for (content, format) in [
            (&b"ply\nformat ascii 1.0\n"[..], Format::Ply),
            (b"ply\r\n", Format::Ply),
            (b"OFF\n8 6 12\n", Format::Off),
            (b"# made by hand\n\nCOFF 8 6 12", Format::Off),
            (b"# made by hand\nmtllib a.mtl\nv 0 0 0\n", Format::Obj),
            (b"\xef\xbb\xbfv 0 0 0\nf 1 1 1\n", Format::Obj),
            (b"solid a\nfacet normal 0 0 1\n", Format::StlAscii),
            (b"SOLID\n  facet", Format::StlAscii),
            (&binary_stl(b"", 1), Format::StlBinary),
            (&binary_stl(b"solid by a modeller that should know better", 3), Format::StlBinary),
        ] {
            for name in ["mesh", "mesh.obj", "mesh.stl", "mesh.ply.gz"] {
                assert_eq!(of(name, content).unwrap(), format, "{name}");
            }
        }
    }

    #[test]
    fn names_decide_what_is_left() {
        for (name, format) in [
            ("a.ply", Format::Ply),
            ("a.PLY.gz", Format::Ply),
            ("a.obj", Format::Obj),
            ("a.obj.zst", Format::Obj),
            ("a.stl", Format::StlBinary),
            ("a.off", Format::Off),
        ] {
            assert_eq!(of(name, b"8 6 12\n").unwrap(), format, "{name}");
        }
    }

    #[test]
    fn what_is_not_read_is_named() {
        for (content, part) in [
            (&b""[..], "the file is empty"),
            (b"LASF\0\0", "Poisson reconstruction"),
            (b"PK\x03\x04", "ZIP archive"),
            (b"glTF\x02", "export the mesh as PLY"),
            (b"hello", "no mesh that is read here"),
        ] {
            let error = of("mesh.xyz", content).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
