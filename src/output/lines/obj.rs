//! Lines as Wavefront OBJ: `v` for each vertex, `l` for each line, `g` where the class changes.
//!
//! Long lines are continued by a backslash, because readers hold a line of text in a buffer of fixed size.

use super::text::{Text, geometry_word};
use crate::output::{OutputError, PartFile};
use crate::stitch::LineSource;

/// Numbers in a line of text: 32 of the longest are less than 700 bytes, and 1024 is the smallest buffer that is known.
const PER_ROW: usize = 32;

pub(super) fn write(part: &PartFile, lines: &dyn LineSource) -> Result<(), OutputError> {
    let mut out = Text::over(part);
    let geometry = lines.geometry();
    out.put(format_args!("# feature lines found by crease\n# geometry {}\n", geometry_word(geometry)))?;
    for vertex in lines.vertices() {
        let p = vertex?.point(geometry);
        out.put(format_args!("v {:?} {:?} {:?}\n", p.x, p.y, p.z))?;
    }
    let mut class = None;
    for line in lines.lines() {
        let line = line?;
        if class.replace(line.measures.class) != Some(line.measures.class) {
            out.put(format_args!("g {}\n", line.measures.class.name()))?;
        }
        out.put(format_args!("l"))?;
        for (i, vertex) in line.vertices.iter().enumerate() {
            let gap = if i > 0 && i % PER_ROW == 0 { " \\\n" } else { "" };
            out.put(format_args!("{gap} {}", vertex + 1))?;
        }
        out.put(format_args!("\n"))?;
    }
    out.finish()
}
