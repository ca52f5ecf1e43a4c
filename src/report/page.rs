//! The report as one page for a browser, without network.
//!
//! In: a report, a scene. Out: the template of `tools/viewer` with the data in the place of its marks. The report is JSON in which
//! no character opens a tag or ends the element; the numbers are packed by gzip and written in base64. What is in the data, names of files
//! above all, gets onto the page as text, by the script.

use super::data::Report;
use super::scene::Scene;
use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use std::io::{self, Write};

/// Built by `tools/viewer/build`; `tests/report.rs` sees to it that it is that of the sources.
const TEMPLATE: &str = include_str!("viewer.html");
/// Where the data goes.
const MARKS: [&str; 3] = ["@@REPORT@@", "@@SCENE@@", "@@NUMBERS@@"];

/// Writes the page.
///
/// # Errors
/// If `out` refuses.
pub fn write_page(out: &mut impl Write, report: &Report, scene: &Scene) -> io::Result<()> {
    let mut rest = TEMPLATE;
    for (i, mark) in MARKS.into_iter().enumerate() {
        // The tests see that each mark is there once, in this order.
        let (before, behind) = rest.split_once(mark).unwrap_or((rest, ""));
        out.write_all(before.as_bytes())?;
        match i {
            0 => out.write_all(harmless(report)?.as_bytes())?,
            1 => out.write_all(harmless(scene.head())?.as_bytes())?,
            _ => write_packed(out, scene.bytes())?,
        }
        rest = behind;
    }
    out.write_all(rest.as_bytes())
}

/// JSON that ends no script element, whatever is in it.
fn harmless(data: &impl Serialize) -> io::Result<String> {
    let json = serde_json::to_string(data)?;
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            // They occur in strings only, where they may be written like this.
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => out.push(c),
        }
    }
    Ok(out)
}

fn write_packed(out: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    let base64 = EncoderWriter::new(out, &STANDARD);
    let mut packer = GzEncoder::new(base64, Compression::default());
    packer.write_all(bytes)?;
    packer.finish()?.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_has_each_mark_once_and_in_order() {
        let places = MARKS.map(|mark| {
            assert_eq!(TEMPLATE.matches(mark).count(), 1, "{mark}");
            TEMPLATE.find(mark)
        });
        assert!(places.is_sorted());
    }

    #[test]
    fn names_cannot_end_the_script() {
        let name = "a</script><img src=x onerror=alert(1)>&\"'\u{2028}.ply";
        let json = harmless(&name).expect("JSON");
        assert!(!json.contains(['<', '>', '&', '\u{2028}']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).expect("JSON"), name);
    }
}
