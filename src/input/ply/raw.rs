//! The file as its writer left it, for whoever writes it again with more properties.
//!
//! In: the layout of the vertices. Out: the header with further properties of the vertices, the records one after the other, and
//! the bytes before and behind them, none of them looked into.

use super::layout::{AHEAD, Records};
use super::record::Window;
use super::{Element, PlySource};
use crate::input::InputError;

impl PlySource {
    /// The element of the vertices.
    pub fn vertex_element(&self) -> Option<&Element> {
        self.header.elements.iter().find(|element| element.name == self.vertices.element)
    }

    /// The bytes of the header, with the lines `more` behind the properties of the vertices, ended as the lines there are.
    /// Comments and everything else stay as they are.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn header_with(&self, more: &[&str]) -> Result<Vec<u8>, InputError> {
        let mut header = Vec::new();
        self.source.read_into(0, self.header.payload, &mut header)?;
        Ok(with_lines(&header, &self.vertices.element, more))
    }

    /// Stands before the first record of the vertices.
    pub fn raw(&self) -> RawVertices<'_> {
        let start = match &self.vertices.layout.records {
            Records::Fixed { start, .. } => *start,
            // Without a vertex there is no place either.
            Records::Walked { offsets, .. } => offsets.first().copied().unwrap_or(self.header.payload),
        };
        let window = Window::new(&self.source, u64::MAX, AHEAD);
        RawVertices { mesh: self, window, anchors: Vec::new(), start, at: start, record: 0 }
    }
}

/// `header` with `more` behind the last property of `element`.
fn with_lines(header: &[u8], element: &str, more: &[&str]) -> Vec<u8> {
    let (mut at, mut inside, mut behind) = (0, false, 0);
    let mut end = "\n";
    for line in header.split_inclusive(|&byte| byte == b'\n') {
        at += line.len();
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("element") => inside = words.next() == Some(element),
            Some("property") if inside => {
                behind = at;
                end = if line.ends_with(b"\r\n") { "\r\n" } else { "\n" };
            }
            _ => {}
        }
    }
    let (before, rest) = header.split_at(behind);
    let mut out = before.to_vec();
    more.iter().for_each(|line| out.extend(format!("{line}{end}").bytes()));
    out.extend(rest);
    out
}

/// A place between two records of the vertices.
pub struct RawVertices<'a> {
    mesh: &'a PlySource,
    window: Window<'a>,
    anchors: Vec<u64>,
    start: u64,
    at: u64,
    record: u64,
}

impl RawVertices<'_> {
    /// Hands the bytes between the header and the first record to `take`, in pieces.
    ///
    /// # Errors
    /// If they cannot be read, or `take` refuses.
    pub fn before<E: From<InputError>>(&mut self, take: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        self.copy(self.mesh.header.payload, self.start, take)
    }

    /// Hands the next record to `take`, in pieces if it is long, and stands behind it.
    ///
    /// # Errors
    /// If it cannot be read, or `take` refuses.
    pub fn record<E: From<InputError>>(&mut self, take: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let (at, layout) = (self.at, &self.mesh.vertices.layout);
        let end = match &layout.records {
            Records::Fixed { stride, .. } => at + stride,
            Records::Walked { .. } => {
                let end = layout.shape.walk(at, &mut self.window, &mut self.anchors);
                end.map_err(|fault| {
                    fault.at(&self.mesh.source, &self.mesh.vertices.element, self.record, at)
                })?
            }
        };
        self.copy(at, end, take)?;
        (self.at, self.record) = (end, self.record + 1);
        Ok(())
    }

    /// Hands all bytes from where it stands to the end of the file to `take`, in pieces.
    ///
    /// # Errors
    /// If they cannot be read, or `take` refuses.
    pub fn behind<E: From<InputError>>(&mut self, take: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        self.copy(self.at, self.mesh.file_len(), take)
    }

    fn copy<E: From<InputError>>(
        &mut self,
        mut from: u64,
        to: u64,
        mut take: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        while from < to {
            let length = (to - from).min(AHEAD);
            take(self.window.at(from, length)?)?;
            from += length;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_behind_the_properties_of_the_vertices() {
        let header = "ply\nformat binary_little_endian 1.0\ncomment one\nelement face 1\nproperty list uchar int vertex_indices\n\
            element vertex 3\nproperty float x\ncomment two\nproperty float y\r\ncomment three\nelement edge 0\n\
            property int vertex1\nend_header\n";
        let more = with_lines(header.as_bytes(), "vertex", &["property int line", "property char c"]);
        let at = header.find("comment three").expect("it is there");
        let expected = format!("{}property int line\r\nproperty char c\r\n{}", &header[..at], &header[at..]);
        assert_eq!(String::from_utf8(more).expect("text"), expected);
    }
}
