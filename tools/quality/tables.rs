//! Results as text. In: [`Results`]; out: a table of cases, and means by set, noise and method.

use super::groups::{Group, groups};
use super::metric::names::MEASURES;
use super::results::Results;
use std::fmt::Write;

/// One row for each case and method, means over the seeds.
pub fn cases(results: &Results) -> String {
    let groups = groups(results.records.iter(), |r| [&r.set, &r.mesh, &r.noise, &r.method]);
    table(&["set", "mesh", "noise", "method"], &groups)
}

/// One row for each set, noise and method, means over the meshes and seeds.
pub fn means(results: &Results) -> String {
    let groups = groups(results.records.iter(), |r| [&r.set, &r.noise, &r.method]);
    table(&["set", "noise", "method"], &groups)
}

fn table(heads: &[&str], groups: &[Group]) -> String {
    let names: Vec<&str> = heads.iter().copied().chain(MEASURES.iter().map(|measure| measure.name)).collect();
    let rows: Vec<Vec<String>> = groups
        .iter()
        .map(|group| group.labels.iter().map(|&label| label.to_owned()).chain(group.cells()).collect())
        .collect();
    let widths: Vec<usize> = (0..names.len())
        .map(|i| {
            // A refusal stands in one cell and is as long as it likes.
            let cells = rows.iter().filter(|row| row.len() == names.len() || i < heads.len());
            cells.map(|row| row[i].chars().count()).fold(names[i].len(), usize::max)
        })
        .collect();
    let mut text = String::new();
    for row in std::iter::once(names.iter().map(|&name| name.to_owned()).collect()).chain(rows) {
        let row: Vec<String> = row;
        for (i, cell) in row.iter().enumerate() {
            let gap = if i > 0 { "  " } else { "" };
            let width = if row.len() == names.len() || i < heads.len() { widths[i] } else { 0 };
            // Writing to a string cannot fail.
            let _ = if i < heads.len() {
                write!(text, "{gap}{cell:<width$}")
            } else {
                write!(text, "{gap}{cell:>width$}")
            };
        }
        text.push('\n');
    }
    text
}
