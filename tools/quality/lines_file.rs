//! Reads lines from PLY files: those of the program (`docs/FORMATS.md`), and plain graphs of vertices and edges.
//!
//! In: a file; out: [`Lines`]. Lines of the classes boundary and non-manifold are left out: they are no creases.

use super::metric::Lines;
use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Class of a corner vertex.
const CORNER: f64 = 3.0;
/// Lowest class of lines that are no creases.
const BOUNDARY: f64 = 4.0;

/// Reads the creases of `path`.
///
/// # Errors
/// If the file is not a PLY file with vertices and edges, or its indices do not fit together.
pub fn read(path: &Path) -> Result<Lines> {
    read_elements(path).and_then(Elements::lines).with_context(|| path.display().to_string())
}

/// The numbers of one record that matter here, whatever element it belongs to.
#[derive(Default)]
struct Record {
    position: DVec3,
    ends: [f64; 2],
    line: Option<f64>,
    class: f64,
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Record::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let value = match value {
            Property::Char(value) => f64::from(value),
            Property::UChar(value) => f64::from(value),
            Property::Short(value) => f64::from(value),
            Property::UShort(value) => f64::from(value),
            Property::Int(value) => f64::from(value),
            Property::UInt(value) => f64::from(value),
            Property::Float(value) => f64::from(value),
            Property::Double(value) => value,
            _ => return PropertyAccessResult::Ignored,
        };
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "vertex1" => self.ends[0] = value,
            "vertex2" => self.ends[1] = value,
            "line" => self.line = Some(value),
            "class" => self.class = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// The elements of the file.
#[derive(Default)]
struct Elements {
    vertices: Vec<Record>,
    edges: Vec<Record>,
    lines: Vec<Record>,
}

fn read_elements(path: &Path) -> Result<Elements> {
    let mut reader = Reader::new(BufReader::new(File::open(path)?));
    let parser = Parser::<Record>::new();
    let header = parser.read_header(&mut reader)?;
    let mut elements = Elements::default();
    for (name, element) in &header.elements {
        let records = parser.read_payload_for_element(&mut reader, element, &header)?;
        match name.as_str() {
            "vertex" => elements.vertices = records,
            "edge" => elements.edges = records,
            "line" => elements.lines = records,
            _ => {}
        }
    }
    ensure!(
        header.elements.contains_key("vertex") && header.elements.contains_key("edge"),
        "no lines: elements `vertex` and `edge` are wanted"
    );
    Ok(elements)
}

impl Elements {
    fn lines(self) -> Result<Lines> {
        let mut chains: Vec<Vec<u32>> = Vec::new();
        // The line of the edge before, if there was one; edges without a line make chains as far as they join.
        let mut before: Option<Option<f64>> = None;
        for edge in &self.edges {
            let mut ends = [0_u32; 2];
            for (index, end) in ends.iter_mut().zip(edge.ends) {
                ensure!(
                    (0.0..self.vertices.len() as f64).contains(&end),
                    "an edge names vertex {end}, but there are {}",
                    self.vertices.len()
                );
                *index = end as u32;
            }
            if !self.is_crease(edge)? {
                continue;
            }
            let joins = chains.last().and_then(|chain| chain.last()) == Some(&ends[0]);
            match chains.last_mut().filter(|_| joins && before == Some(edge.line)) {
                Some(chain) => chain.push(ends[1]),
                None => chains.push(ends.to_vec()),
            }
            before = Some(edge.line);
        }
        Ok(Lines {
            marked: self.vertices.iter().map(|vertex| vertex.class == CORNER).collect(),
            points: self.vertices.into_iter().map(|vertex| vertex.position).collect(),
            chains,
        })
    }

    /// Whether the edge belongs to a crease, as everything does that belongs to no line.
    fn is_crease(&self, edge: &Record) -> Result<bool> {
        let Some(line) = edge.line.filter(|_| !self.lines.is_empty()) else { return Ok(true) };
        match self.lines.get(line as usize) {
            Some(line) => Ok(line.class < BOUNDARY),
            None => bail!("an edge names line {line}, but there are {}", self.lines.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(body: &str) -> Result<Lines> {
        let directory = tempfile::tempdir()?;
        let path = directory.path().join("lines.ply");
        std::fs::write(&path, format!("ply\nformat ascii 1.0\n{body}"))?;
        read(&path)
    }

    const POINTS: &str = "element vertex 5\nproperty double x\nproperty double y\nproperty double z\n";
    const VALUES: &str = "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n";

    #[test]
    fn edges_of_one_line_are_one_chain_and_borders_are_left_out() {
        let header = "element edge 4\nproperty uint vertex1\nproperty uint vertex2\nproperty uint line\n\
                      element line 3\nproperty uint id\nproperty uchar class\nend_header\n";
        let lines =
            read_text(&format!("{POINTS}{header}{VALUES}0 1 0\n1 2 0\n2 3 1\n3 4 2\n0 1\n1 2\n2 4\n"))
                .unwrap();
        assert_eq!(lines.chains, [vec![0, 1, 2], vec![2, 3]]);
        assert_eq!(lines.points[4], DVec3::X * 4.0);
    }

    #[test]
    fn plain_graphs_are_chains_as_far_as_edges_join() {
        let header = "element edge 3\nproperty int vertex1\nproperty int vertex2\nend_header\n";
        let lines = read_text(&format!("{POINTS}{header}{VALUES}0 1\n1 2\n3 4\n")).unwrap();
        assert_eq!(lines.chains, [vec![0, 1, 2], vec![3, 4]]);
        let error = read_text(&format!("{POINTS}{header}{VALUES}0 1\n1 2\n3 5\n")).unwrap_err();
        assert!(format!("{error:#}").contains("vertex 5"), "{error:#}");
    }

    #[test]
    fn corners_are_marked() {
        let lines = read_text(
            "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty uchar class\n\
             element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0 3\n1 0 0 2\n0 1\n",
        )
        .unwrap();
        assert_eq!(lines.marked, [true, false]);
    }
}
