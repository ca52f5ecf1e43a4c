//! What a change of the program changes. In: two files of results; out: differences by case and their means.
//!
//! Only cases and methods that both files have are compared; the others are counted, not forgotten.

use super::metric::Score;
use super::metric::names::MEASURES;
use super::results::{Record, Results, distinct};
use std::fmt::Write;

/// Differences of F1 below this are not shown by case: it is what a vertex more or less makes.
const SHOWN: f64 = 0.0005;

/// A case in both files.
struct Pair<'a> {
    before: &'a Record,
    scores: [&'a Score; 2],
}

/// Text that says how `after` differs from `before`.
pub fn differences(before: &Results, after: &Results) -> String {
    let mut text = String::new();
    let mut pairs = Vec::new();
    for a in &before.records {
        let other = after.records.iter().find(|b| key(a) == key(b));
        if let (Some(x), Some(y)) = (a.score(), other.and_then(Record::score)) {
            pairs.push(Pair { before: a, scores: [x, y] });
        }
    }
    by_case(&mut text, &pairs);
    text.push('\n');
    means(&mut text, &pairs);
    let lone = [before, after].map(|results| results.records.len() - pairs.len());
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "\n{} compared, {} only in the first, {} only in the second (or refused)",
        pairs.len(),
        lone[0],
        lone[1]
    );
    text
}

fn key(record: &Record) -> (&str, &str, &str, Option<u64>, &str) {
    (&record.set, &record.mesh, &record.noise, record.seed, &record.method)
}

/// Cases, means over seeds, whose F1 or number of false lines changed.
fn by_case(text: &mut String, pairs: &[Pair]) {
    let case = |pair: &Pair| {
        [&pair.before.set, &pair.before.mesh, &pair.before.noise, &pair.before.method].map(String::clone)
    };
    for key in distinct(pairs, case) {
        let group: Vec<&Pair> = pairs.iter().filter(|pair| case(pair) == key).collect();
        let changes = changes(&group);
        let shown = |name: &str| changes.iter().any(|c| c.name == name && c.step().abs() >= SHOWN);
        if shown("F1") || shown("false") || shown("long") {
            row(text, &key, &changes, &["F1", "F2", "P1", "R1", "false", "long", "l/curve", "cornR"]);
        }
    }
}

/// Means by set, noise and method, and over everything.
fn means(text: &mut String, pairs: &[Pair]) {
    let all: Vec<&str> = MEASURES.iter().map(|measure| measure.name).collect();
    let place = |pair: &Pair| [&pair.before.set, &pair.before.noise, &pair.before.method].map(String::clone);
    for key in distinct(pairs, place) {
        let group: Vec<&Pair> = pairs.iter().filter(|pair| place(pair) == key).collect();
        row(text, &key, &changes(&group), &all);
    }
    for method in distinct(pairs, |pair| pair.before.method.clone()) {
        let group: Vec<&Pair> = pairs.iter().filter(|pair| pair.before.method == method).collect();
        row(text, &["mean of all".to_owned(), method], &changes(&group), &all);
    }
}

/// A measure before and after.
struct Change {
    name: &'static str,
    digits: usize,
    before: f64,
    after: f64,
}

impl Change {
    fn step(&self) -> f64 {
        self.after - self.before
    }
}

/// The means of all measures over the pairs in which both sides have a value.
fn changes(pairs: &[&Pair]) -> Vec<Change> {
    let mean = |values: Vec<[f64; 2]>| {
        let count = values.len() as f64;
        [0, 1].map(|side| values.iter().map(|pair| pair[side]).sum::<f64>() / count)
    };
    MEASURES
        .iter()
        .filter_map(|measure| {
            let both = |pair: &&Pair| Some([measure.value(pair.scores[0])?, measure.value(pair.scores[1])?]);
            let values: Vec<[f64; 2]> = pairs.iter().filter_map(both).collect();
            let any = !values.is_empty();
            let [before, after] = mean(values);
            any.then_some(Change { name: measure.name, digits: measure.digits, before, after })
        })
        .collect()
}

fn row(text: &mut String, labels: &[String], changes: &[Change], names: &[&str]) {
    let _ = write!(text, "{:<44}", labels.join("  "));
    for change in changes.iter().filter(|change| names.contains(&change.name)) {
        let Change { name, digits, before, after } = change;
        let _ = write!(text, "  {name} {before:.digits$}{:+.digits$}={after:.digits$}", change.step());
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::results::tests::{record, results};

    #[test]
    fn only_what_changed_is_listed_and_all_is_averaged() {
        let before = results(vec![
            record("a", "0", 1, "robust", 10.0),
            record("a", "0", 2, "robust", 10.0),
            record("a", "0.1", 1, "robust", 20.0),
            record("a", "0.2", 1, "robust", 20.0),
        ]);
        let after = results(vec![
            record("a", "0", 1, "robust", 20.0),
            record("a", "0", 2, "robust", 10.0),
            record("a", "0.1", 1, "robust", 20.0),
            record("b", "0.2", 1, "robust", 20.0),
        ]);
        let text = differences(&before, &after);
        let (cases, means) = text.split_once("\n\n").unwrap();
        // Recall of a half, and 1h more, becomes 1 for one of two seeds.
        assert_eq!(cases.lines().count(), 1, "{text}");
        assert!(cases.starts_with("a  line  0  robust") && cases.contains("R1 0.505+0.247=0.753"), "{text}");
        assert_eq!(means.lines().filter(|line| line.starts_with("a  0")).count(), 2, "{text}");
        assert!(
            text.ends_with("3 compared, 1 only in the first, 1 only in the second (or refused)\n"),
            "{text}"
        );
    }
}
