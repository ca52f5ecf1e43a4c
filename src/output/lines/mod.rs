//! Feature lines in the formats that other programs open; `docs/FORMATS.md` says what each field means.
//!
//! In: a source of lines. Out: a part that becomes a file when it is committed. Every writer goes through the source from start
//! to end, once or a few times, and holds one vertex or one line; so the memory does not grow with the number of lines. Numbers
//! in text have as many digits as it takes to read the same f64 back. Lines are in the same order everywhere, which gives them
//! their ids, and a closed line ends on its first point unless the format has another way to say that it is closed.

mod csv;
mod dxf;
mod geojson;
mod gpkg;
mod obj;
mod ply;
mod text;
mod vtp;

use super::{Crs, OutputError, PartFile};
use crate::stitch::LineSource;
use std::path::Path;

/// A format for lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineFormat {
    /// Vertices, edges and lines as binary PLY.
    Ply,
    /// Vertices and `l` elements as Wavefront OBJ.
    Obj,
    /// ParaView's PolyData: XML with binary arrays.
    Vtp,
    /// 3D polylines on a layer for each class.
    Dxf,
    /// Features with a LineString each.
    GeoJson,
    /// A database of features, with a spatial index.
    GeoPackage,
    /// A row for each line, with its geometry as text (WKT).
    Csv,
}

impl LineFormat {
    /// All of them.
    pub const ALL: [LineFormat; 7] = [
        LineFormat::Ply,
        LineFormat::Obj,
        LineFormat::Vtp,
        LineFormat::Dxf,
        LineFormat::GeoJson,
        LineFormat::GeoPackage,
        LineFormat::Csv,
    ];

    /// What names of its files end in, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            LineFormat::Ply => "ply",
            LineFormat::Obj => "obj",
            LineFormat::Vtp => "vtp",
            LineFormat::Dxf => "dxf",
            LineFormat::GeoJson => "geojson",
            LineFormat::GeoPackage => "gpkg",
            LineFormat::Csv => "csv",
        }
    }

    /// The format of a file of that name.
    pub fn of(path: &Path) -> Option<LineFormat> {
        let extension = path.extension()?;
        LineFormat::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }

    /// Whether a file of this format can say which system its coordinates are in.
    pub fn holds_crs(self) -> bool {
        matches!(self, LineFormat::GeoJson | LineFormat::GeoPackage)
    }
}

/// Writes `lines` to `target`, whose coordinates are in the system `crs` if the format can say so.
///
/// # Errors
/// If the file cannot be written, the lines cannot be read, or there are more of them than the format can hold.
pub fn write_lines(
    target: &Path,
    format: LineFormat,
    lines: &dyn LineSource,
    crs: Option<Crs>,
) -> Result<(), OutputError> {
    stage_lines(target, format, lines, crs)?.commit()
}

/// Writes `lines` to the part that becomes `target` when it is committed: for outputs that must appear together.
///
/// # Errors
/// As for [`write_lines`].
pub fn stage_lines(
    target: &Path,
    format: LineFormat,
    lines: &dyn LineSource,
    crs: Option<Crs>,
) -> Result<PartFile, OutputError> {
    let part = PartFile::create(target)?;
    match format {
        LineFormat::Ply => ply::write(&part, lines)?,
        LineFormat::Obj => obj::write(&part, lines)?,
        LineFormat::Vtp => vtp::write(&part, lines)?,
        LineFormat::Dxf => dxf::write(&part, lines)?,
        LineFormat::GeoJson => geojson::write(&part, lines, crs)?,
        LineFormat::GeoPackage => gpkg::write(&part, lines, crs)?,
        LineFormat::Csv => csv::write(&part, lines)?,
    }
    Ok(part)
}

/// Writes `lines` to `target` as PLY.
///
/// # Errors
/// If the file cannot be written, the lines cannot be read, or there are more elements than 32 bits can index.
pub fn write_ply(target: &Path, lines: &dyn LineSource) -> Result<(), OutputError> {
    write_lines(target, LineFormat::Ply, lines, None)
}

/// The same to the part that becomes `target` when it is committed.
///
/// # Errors
/// As for [`write_ply`].
pub fn stage_ply(target: &Path, lines: &dyn LineSource) -> Result<PartFile, OutputError> {
    stage_lines(target, LineFormat::Ply, lines, None)
}
