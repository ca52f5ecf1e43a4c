//! Lines as CSV: a row for each, with its points as WKT in a column that GDAL and QGIS take for the geometry.

use super::text::{Text, bend_word};
use crate::output::{OutputError, PartFile};
use crate::stitch::{LineSource, Measures};

pub(super) fn write(part: &PartFile, lines: &dyn LineSource) -> Result<(), OutputError> {
    let mut out = Text::over(part);
    out.put(format_args!("WKT,id,class,length,strength,angle,bend,closed\n"))?;
    for (id, line) in (0u64..).zip(lines.lines()) {
        let line = line?;
        out.put(format_args!("\"LINESTRING Z ("))?;
        for (i, p) in line.points.iter().enumerate() {
            let gap = if i > 0 { "," } else { "" };
            out.put(format_args!("{gap}{:?} {:?} {:?}", p.x, p.y, p.z))?;
        }
        let Measures { class, closed, length, strength, angle, bend } = line.measures;
        let (class, bend, closed) = (class.name(), bend_word(bend).unwrap_or_default(), u8::from(closed));
        out.put(format_args!(")\",{id},{class},{length:?},{strength:?},{angle:?},{bend},{closed}\n"))?;
    }
    out.finish()
}
