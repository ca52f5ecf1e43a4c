//! Records that are averaged together. In: records and what they are grouped by; out: groups and their means.

use super::metric::Score;
use super::metric::names::{MEASURES, Measure};
use super::results::{Outcome, Record, distinct};

/// Records that agree in some labels: all seeds of a case, or all cases of a set at one noise.
pub struct Group<'a> {
    /// What they agree in.
    pub labels: Vec<&'a str>,
    /// At least one.
    pub records: Vec<&'a Record>,
}

impl Group<'_> {
    fn scores(&self) -> impl Iterator<Item = &Score> {
        self.records.iter().filter_map(|record| record.score())
    }

    /// Mean of one measure.
    pub fn mean(&self, measure: &Measure) -> Option<f64> {
        measure.mean(self.scores())
    }

    /// What was said by the first that refused, if none has a score.
    pub fn refusal(&self) -> Option<&str> {
        let mut refusals = self.records.iter().filter_map(|record| match &record.outcome {
            Outcome::Refused(reason) => Some(reason.as_str()),
            Outcome::Scored(_) => None,
        });
        refusals.next().filter(|_| self.scores().next().is_none())
    }

    /// The mean of each measure, or why there is none.
    pub fn cells(&self) -> Vec<String> {
        match self.refusal() {
            Some(reason) => vec![format!("unsupported: {reason}")],
            None => MEASURES.iter().map(|measure| measure.text(self.mean(measure))).collect(),
        }
    }
}

/// Groups by a list of labels, in the order in which they first appear.
pub fn groups<'a, const N: usize>(
    records: impl IntoIterator<Item = &'a Record>,
    labels: impl Fn(&'a Record) -> [&'a str; N],
) -> Vec<Group<'a>> {
    let all: Vec<&Record> = records.into_iter().collect();
    distinct(all.iter().copied(), &labels)
        .into_iter()
        .map(|key| Group {
            records: all.iter().copied().filter(|record| labels(record) == key).collect(),
            labels: key.to_vec(),
        })
        .collect()
}
