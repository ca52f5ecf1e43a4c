//! Lines as GeoJSON: a feature with a LineString for each, one on each line of the file.
//!
//! RFC 7946 knows longitude and latitude only. A mesh is seldom in those, so its system is named in the member `crs` of the
//! specification of 2008, which GDAL and all that is built on it understand, and others pass over.

use super::text::{Text, bend_word};
use crate::output::{Crs, OutputError, PartFile};
use crate::stitch::{LineSource, Measures};

pub(super) fn write(part: &PartFile, lines: &dyn LineSource, crs: Option<Crs>) -> Result<(), OutputError> {
    let mut out = Text::over(part);
    out.put(format_args!("{{\"type\":\"FeatureCollection\",\n"))?;
    if let Some(crs) = crs {
        let urn = crs.urn();
        out.put(format_args!("\"crs\":{{\"type\":\"name\",\"properties\":{{\"name\":\"{urn}\"}}}},\n"))?;
    }
    out.put(format_args!("\"features\":["))?;
    for (id, line) in (0u64..).zip(lines.lines()) {
        let line = line?;
        let Measures { class, closed, length, strength, angle, bend } = line.measures;
        let gap = if id > 0 { ",\n" } else { "\n" };
        // No word here has anything that JSON would want escaped.
        let bend = bend_word(bend).map_or("null".to_owned(), |word| format!("\"{word}\""));
        out.put(format_args!(
            "{gap}{{\"type\":\"Feature\",\"id\":{id},\"properties\":{{\"id\":{id},\"class\":\"{}\",\"length\":{length:?},\
             \"strength\":{strength:?},\"angle\":{angle:?},\"bend\":{bend},\"closed\":{closed}}},\
             \"geometry\":{{\"type\":\"LineString\",\"coordinates\":[",
            class.name()
        ))?;
        for (i, p) in line.points.iter().enumerate() {
            let gap = if i > 0 { "," } else { "" };
            out.put(format_args!("{gap}[{:?},{:?},{:?}]", p.x, p.y, p.z))?;
        }
        out.put(format_args!("]}}}}"))?;
    }
    out.put(format_args!("\n]}}\n"))?;
    out.finish()
}
