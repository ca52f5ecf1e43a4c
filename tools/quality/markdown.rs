//! Results as Markdown, for `docs/QUALITY.md`. In: the results of one set; out: its tables.

use super::baselines;
use super::groups::{Group, groups};
use super::metric::names::{DECISIVE, LENGTH_RATIO, MEASURES, Measure};
use super::results::{Record, Results, distinct};
use std::fmt::Write;

/// Methods that have a table by mesh: both geometries of the program's own.
const DRAWN: [&str; 2] = ["robust", "fitted"];

/// The tables of a set: F1 and length ratio by method, F1 of the program's own by mesh, all measures of all but the
/// baselines.
pub fn tables(results: &Results) -> String {
    if results.records.is_empty() {
        return "No case.\n".to_owned();
    }
    let noises = distinct(&results.records, |record: &Record| record.noise.as_str());
    let mut text = String::from("F1 at 1h by method and noise, means over meshes and seeds:\n\n");
    let by_method = groups(&results.records, |r| [&r.method, &r.noise]);
    matrix(&mut text, "method", &noises, &by_method, &MEASURES[DECISIVE]);
    text.push_str(
        "\nLength found over true length, likewise; bands of edges instead of lines have a large one:\n\n",
    );
    matrix(&mut text, "method", &noises, &by_method, &MEASURES[LENGTH_RATIO]);
    for method in DRAWN {
        let own: Vec<&Record> = results.records.iter().filter(|record| record.method == method).collect();
        if !own.is_empty() {
            let _ = write!(text, "\nF1 at 1h of {method} by mesh and noise, means over seeds:\n\n");
            matrix(&mut text, "mesh", &noises, &groups(own, |r| [&r.mesh, &r.noise]), &MEASURES[DECISIVE]);
        }
    }
    text.push_str("\nAll measures of the program's ways by noise:\n\n");
    let program = results.records.iter().filter(|record| !is_baseline(record));
    measures(&mut text, &groups(program, |r| [&r.method, &r.noise]));
    refusals(&mut text, results);
    text
}

/// One row for each first label, one column for each noise: the mean of a measure.
fn matrix(text: &mut String, head: &str, noises: &[&str], groups: &[Group], measure: &Measure) {
    let mut heads = vec![head];
    heads.extend(noises);
    row(text, heads.iter().map(|&head| head.to_owned()));
    row(text, heads.iter().map(|_| "---".to_owned()));
    for name in distinct(groups, |group: &Group| group.labels[0].to_owned()) {
        let cell = |noise: &&str| {
            let group = groups.iter().find(|group| group.labels == [name.as_str(), noise]);
            group.map_or(String::new(), |group| value(group, measure))
        };
        row(text, std::iter::once(name.clone()).chain(noises.iter().map(cell)));
    }
}

/// Whether a baseline made it: these have no lines, only loose edges.
fn is_baseline(record: &Record) -> bool {
    baselines::NAMES.contains(&record.method.as_str())
}

/// One row for each group that has scores, one column for each measure.
fn measures(text: &mut String, groups: &[Group]) {
    let names = || ["method", "noise"].into_iter().chain(MEASURES.iter().map(|measure| measure.name));
    row(text, names().map(str::to_owned));
    row(text, names().map(|_| "---".to_owned()));
    for group in groups.iter().filter(|group| group.refusal().is_none()) {
        let labels = group.labels.iter().map(|&label| label.to_owned());
        row(text, labels.chain(MEASURES.iter().map(|measure| value(group, measure))));
    }
}

fn value(group: &Group, measure: &Measure) -> String {
    match group.refusal() {
        Some(_) => "unsupported".to_owned(),
        None => measure.text(group.mean(measure)),
    }
}

/// What was said by methods that do not exist or not for these meshes.
fn refusals(text: &mut String, results: &Results) {
    for group in groups(&results.records, |r| [&r.method]) {
        if let Some(reason) = group.refusal() {
            let _ = write!(text, "\n`{}` is unsupported: `{reason}`.\n", group.labels[0]);
        }
    }
}

/// One row of a table.
pub fn row(text: &mut String, cells: impl Iterator<Item = String>) {
    let cells: Vec<String> = cells.collect();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::results::Outcome;
    use crate::quality::results::tests::{record, results};

    #[test]
    fn methods_are_rows_and_noises_are_columns() {
        let mut refused = record("a", "0", 1, "paper", 1.0);
        refused.outcome = Outcome::Refused("unexpected argument".to_owned());
        let text = tables(&results(vec![
            record("a", "0", 1, "robust", 20.0),
            record("a", "0", 2, "robust", 0.0),
            refused,
            record("a", "0", 1, "dihedral*", 20.0),
            record("a", "0.1", 1, "robust", 20.0),
        ]));
        for line in [
            "| method | 0 | 0.1 |",
            "| robust | 0.500 | 1.000 |",
            "| paper | unsupported |  |",
            "| dihedral* | 1.000 |  |",
            "| line | 0.500 | 1.000 |",
            "`paper` is unsupported: `unexpected argument`.",
        ] {
            assert!(text.lines().any(|other| other == line), "{line} is missing in\n{text}");
        }
        // Neither a baseline nor what was refused has lines to be measured.
        assert_eq!(text.lines().filter(|line| line.starts_with("| robust |")).count(), 2 + 2, "{text}");
        assert!(!text.contains("| dihedral* | 0 |") && !text.contains("| paper | 0 |"), "{text}");
    }
}
