//! Lines as DXF: a 3D polyline for each, on the layer of its class.
//!
//! The version is that of release 12 (AC1009): every program reads it, and its entities need no handles, which would have to be
//! counted and kept unique. A closed line is a closed polyline: its first point is not repeated.

use super::text::Text;
use crate::output::{OutputError, PartFile};
use crate::stitch::{Class, LineSource, StitchError};
use glam::DVec3;

/// The layers with their colours: red, blue, green, magenta.
const LAYERS: [(Class, &str, u8); 4] = [
    (Class::Sharp, "CREASE_SHARP", 1),
    (Class::Weak, "CREASE_WEAK", 5),
    (Class::Boundary, "CREASE_BOUNDARY", 3),
    (Class::NonManifold, "CREASE_NONMANIFOLD", 6),
];

/// Flags of polylines and their vertices.
const CLOSED: u8 = 1;
const POLYLINE_3D: u8 = 8;
const VERTEX_3D: u8 = 32;

pub(super) fn write(part: &PartFile, lines: &dyn LineSource) -> Result<(), OutputError> {
    let mut out = Text::over(part);
    header(&mut out, extent(lines)?)?;
    tables(&mut out)?;
    out.put(format_args!("0\nSECTION\n2\nBLOCKS\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"))?;
    for line in lines.lines() {
        let line = line?;
        let layer = layer(line.measures.class);
        let (flags, points) = match (line.measures.closed, line.points.split_last()) {
            (true, Some((_, others))) => (POLYLINE_3D | CLOSED, others),
            _ => (POLYLINE_3D, line.points.as_slice()),
        };
        // The point of a polyline itself is a dummy; `66` says that vertices follow.
        out.put(format_args!("0\nPOLYLINE\n8\n{layer}\n66\n1\n10\n0.0\n20\n0.0\n30\n0.0\n70\n{flags}\n"))?;
        for p in points {
            out.put(format_args!("0\nVERTEX\n8\n{layer}\n"))?;
            point(&mut out, *p)?;
            out.put(format_args!("70\n{VERTEX_3D}\n"))?;
        }
        out.put(format_args!("0\nSEQEND\n8\n{layer}\n"))?;
    }
    out.put(format_args!("0\nENDSEC\n0\nEOF\n"))?;
    out.finish()
}

/// The lowest and the highest coordinates of all lines, if there are any.
fn extent(lines: &dyn LineSource) -> Result<Option<[DVec3; 2]>, StitchError> {
    let mut extent: Option<[DVec3; 2]> = None;
    for vertex in lines.vertices() {
        let p = vertex?.point(lines.geometry());
        extent = Some(extent.map_or([p, p], |[low, high]| [low.min(p), high.max(p)]));
    }
    Ok(extent)
}

/// The version, and what a program shows first.
fn header(out: &mut Text<'_>, extent: Option<[DVec3; 2]>) -> Result<(), OutputError> {
    out.put(format_args!("0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n"))?;
    for (name, corner) in ["$EXTMIN", "$EXTMAX"].into_iter().zip(extent.into_iter().flatten()) {
        out.put(format_args!("9\n{name}\n"))?;
        point(out, corner)?;
    }
    out.put(format_args!("0\nENDSEC\n"))
}

/// A type of line that is drawn through, and the layers; `0` must be among them.
fn tables(out: &mut Text<'_>) -> Result<(), OutputError> {
    out.put(format_args!(
        "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLTYPE\n70\n1\n0\nLTYPE\n2\nCONTINUOUS\n70\n0\n3\nSolid line\n72\n65\n73\n0\n\
         40\n0.0\n0\nENDTAB\n0\nTABLE\n2\nLAYER\n70\n{}\n",
        1 + LAYERS.len()
    ))?;
    let layers = LAYERS.iter().map(|&(_, name, colour)| (name, colour));
    for (name, colour) in [("0", 7)].into_iter().chain(layers) {
        out.put(format_args!("0\nLAYER\n2\n{name}\n70\n0\n62\n{colour}\n6\nCONTINUOUS\n"))?;
    }
    out.put(format_args!("0\nENDTAB\n0\nENDSEC\n"))
}

fn point(out: &mut Text<'_>, p: DVec3) -> Result<(), OutputError> {
    out.put(format_args!("10\n{:?}\n20\n{:?}\n30\n{:?}\n", p.x, p.y, p.z))
}

fn layer(class: Class) -> &'static str {
    LAYERS.iter().find(|layer| layer.0 == class).map_or("0", |layer| layer.1)
}
