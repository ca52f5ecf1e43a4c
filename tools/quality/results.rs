//! Results of a run as a file. In: scores by case and method; out: JSON, and the groups that tables are made of.

use super::metric::Score;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// All results of a run. The same program and arguments give the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// What the program says of itself.
    pub program: String,
    /// Arguments that were added to every run.
    pub extra: Vec<String>,
    /// By case, then by method, in the order of the sets.
    pub records: Vec<Record>,
}

/// One method on one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The set of the case.
    pub set: String,
    /// The mesh.
    pub mesh: String,
    /// The noise.
    pub noise: String,
    /// The seed, if the mesh is generated.
    pub seed: Option<u64>,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Faces of the mesh.
    pub faces: usize,
    /// h, mesh units.
    pub median_side: f64,
    /// The method.
    pub method: String,
    /// Parameters that the method chose with the truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<String>,
    /// What came of it.
    pub outcome: Outcome,
}

/// What came of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It found these lines.
    Scored(Score),
    /// It does not exist, or not for this mesh; this is what was said.
    Refused(String),
}

impl Record {
    /// The score, if there is one.
    pub fn score(&self) -> Option<&Score> {
        match &self.outcome {
            Outcome::Scored(score) => Some(score),
            Outcome::Refused(_) => None,
        }
    }
}

impl Results {
    /// Reads results that [`Results::write`] has written.
    ///
    /// # Errors
    /// If the file is not one of results.
    pub fn read(path: &Path) -> Result<Results> {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| {
            format!("{} is not a file of results; `quality run --json` writes some", path.display())
        })
    }

    /// The same results, one set each.
    pub fn by_set(&self) -> Vec<Results> {
        let of_set = |set: &str| Results {
            records: self.records.iter().filter(|record| record.set == set).cloned().collect(),
            ..self.clone()
        };
        distinct(&self.records, |record| record.set.as_str()).into_iter().map(of_set).collect()
    }

    /// Results of the same program, one after the other; none of none.
    pub fn joined(parts: Vec<Results>) -> Option<Results> {
        parts.into_iter().reduce(|mut all, part| {
            all.records.extend(part.records);
            all
        })
    }

    /// Writes JSON, one line for each record, so that two files can be compared by eye too.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut text = format!(
            "{{\"program\":{},\"extra\":{},\"records\":[\n",
            serde_json::to_string(&self.program)?,
            serde_json::to_string(&self.extra)?
        );
        for (i, record) in self.records.iter().enumerate() {
            text.push_str(if i > 0 { ",\n" } else { "" });
            text.push_str(&serde_json::to_string(record)?);
        }
        text.push_str("\n]}\n");
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}

/// The distinct values of a key, in the order in which they first appear.
pub fn distinct<T, K: PartialEq>(items: impl IntoIterator<Item = T>, key: impl Fn(T) -> K) -> Vec<K> {
    let mut found: Vec<K> = Vec::new();
    for item in items {
        let value = key(item);
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::quality::metric::{Lines, Truth, score};
    use glam::DVec3;

    /// A record of a line of 20 of which `found` were found.
    pub fn record(set: &str, noise: &str, seed: u64, method: &str, found: f64) -> Record {
        let line = |length: f64| vec![vec![DVec3::ZERO, DVec3::X * length]];
        let lines = if found > 0.0 { Lines::of_polylines(&line(found)) } else { Lines::default() };
        let score = score(&lines, &Truth::of_lines(Lines::of_polylines(&line(20.0))), 0.1);
        Record {
            set: set.to_owned(),
            mesh: "line".to_owned(),
            noise: noise.to_owned(),
            seed: Some(seed),
            vertices: 3,
            faces: 1,
            median_side: 0.1,
            method: method.to_owned(),
            chosen: None,
            outcome: Outcome::Scored(score),
        }
    }

    /// Results of no program in particular.
    pub fn results(records: Vec<Record>) -> Results {
        Results { program: "crease 0".to_owned(), extra: Vec::new(), records }
    }

    #[test]
    fn what_was_written_can_be_read() {
        let mut refused = record("a", "0", 1, "paper", 1.0);
        refused.outcome = Outcome::Refused("no \"paper\"".to_owned());
        let mut chosen = record("b", "0.1", 2, "robust", 19.123_456_789_012_3);
        chosen.chosen = Some("threshold 12".to_owned());
        let all = results(vec![record("a", "0", 1, "robust", 0.0), refused, chosen]);
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("results.json");
        all.write(&path).unwrap();
        assert_eq!(Results::read(&path).unwrap(), all);
        assert_eq!(all.by_set().iter().map(|set| set.records.len()).collect::<Vec<_>>(), [2, 1]);
        assert_eq!(Results::joined(all.by_set()), Some(all));
        std::fs::write(&path, "{}").unwrap();
        assert!(format!("{:#}", Results::read(&path).unwrap_err()).contains("not a file of results"));
    }
}
