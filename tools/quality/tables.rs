//! Results as text. In: [`Results`]; out: a table of cases, means by set, noise and method, and the same as Markdown.

use super::metric::Score;
use super::metric::names::{MEASURES, Measure};
use super::results::{Outcome, Record, Results, distinct};
use std::fmt::Write;

/// Records that are averaged together: all seeds of a case, or all cases of a set at one noise.
struct Group<'a> {
    labels: Vec<String>,
    records: Vec<&'a Record>,
}

impl Group<'_> {
    fn scores(&self) -> impl Iterator<Item = &Score> {
        self.records.iter().filter_map(|record| record.score())
    }

    /// The mean of each measure, or why there is none.
    fn cells(&self) -> Vec<String> {
        let refusal = self.records.iter().find_map(|record| match &record.outcome {
            Outcome::Refused(reason) => Some(reason),
            Outcome::Scored(_) => None,
        });
        match refusal.filter(|_| self.scores().next().is_none()) {
            Some(reason) => vec![format!("unsupported: {reason}")],
            None => MEASURES.iter().map(|measure| measure.text(measure.mean(self.scores()))).collect(),
        }
    }
}

/// Groups by a list of labels, in the order in which they first appear.
fn groups<'a, const N: usize>(
    records: &'a [Record],
    labels: impl Fn(&'a Record) -> [&'a str; N],
) -> Vec<Group<'a>> {
    distinct(records, &labels)
        .into_iter()
        .map(|key| Group {
            records: records.iter().filter(|record| labels(record) == key).collect(),
            labels: key.map(str::to_owned).to_vec(),
        })
        .collect()
}

/// One row for each case and method, means over the seeds.
pub fn cases(results: &Results) -> String {
    let groups = groups(&results.records, |r| [&r.set, &r.mesh, &r.noise, &r.method]);
    table(&["set", "mesh", "noise", "method"], &groups)
}

/// One row for each set, noise and method, means over the meshes and seeds.
pub fn means(results: &Results) -> String {
    let groups = groups(&results.records, |r| [&r.set, &r.noise, &r.method]);
    table(&["set", "noise", "method"], &groups)
}

fn table(heads: &[&str], groups: &[Group]) -> String {
    let names: Vec<&str> = heads.iter().copied().chain(MEASURES.iter().map(|measure| measure.name)).collect();
    let rows: Vec<Vec<String>> =
        groups.iter().map(|group| group.labels.iter().cloned().chain(group.cells()).collect()).collect();
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

/// A measure by its name.
pub fn measure(name: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.name == name)
}
