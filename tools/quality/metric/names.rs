//! The measures of a score by name, in the order of tables. In: a [`Score`]; out: numbers that can be averaged and
//! compared.

use super::Score;

/// One measure.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Short name, as in the heads of tables and in comparisons.
    pub name: &'static str,
    /// Its value, if the case has one.
    pub of: fn(&Score) -> Option<f64>,
    /// Digits after the point that mean anything.
    pub digits: usize,
    /// Whether only cases with true lines have it. Precision and recall of a case without would be 0 or 1 by definition
    /// and hide in a mean; false lines count there.
    pub needs_truth: bool,
}

/// All measures.
pub const MEASURES: [Measure; 15] = [
    quality("F1", |s| Some(s.at_1h.f1)),
    quality("P1", |s| Some(s.at_1h.precision)),
    quality("R1", |s| Some(s.at_1h.recall)),
    quality("F2", |s| Some(s.at_2h.f1)),
    quality("P2", |s| Some(s.at_2h.precision)),
    quality("R2", |s| Some(s.at_2h.recall)),
    quality("ratio", Score::length_ratio),
    amount("false", |s| Some(s.false_components as f64)),
    amount("long", |s| Some(s.long_false_lines as f64)),
    amount("falselen", |s| Some(s.false_length)),
    quality("l/curve", |s| s.lines_per_curve),
    quality("cornP", Score::corner_precision),
    quality("cornR", Score::corner_recall),
    amount("fcorn", |s| Some(s.false_corners() as f64)),
    quality("rms", |s| s.rms_distance),
];

/// Index of F1 at 1h in [`MEASURES`], the measure that decides.
pub const DECISIVE: usize = 0;

/// Index of the length ratio in [`MEASURES`].
pub const LENGTH_RATIO: usize = 6;

const fn quality(name: &'static str, of: fn(&Score) -> Option<f64>) -> Measure {
    Measure { name, of, digits: 3, needs_truth: true }
}

const fn amount(name: &'static str, of: fn(&Score) -> Option<f64>) -> Measure {
    Measure { name, of, digits: 1, needs_truth: false }
}

impl Measure {
    /// The value, unless the case has none.
    pub fn value(&self, score: &Score) -> Option<f64> {
        (self.of)(score).filter(|_| !self.needs_truth || score.true_length > 0.0)
    }

    /// Mean over the scores that have a value.
    pub fn mean<'a>(&self, scores: impl IntoIterator<Item = &'a Score>) -> Option<f64> {
        let values: Vec<f64> = scores.into_iter().filter_map(|score| self.value(score)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// A value as text; a dash if there is none.
    pub fn text(&self, value: Option<f64>) -> String {
        value.map_or("-".to_owned(), |value| format!("{value:.*}", self.digits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_indices_are_those_of_the_names() {
        assert_eq!((MEASURES[DECISIVE].name, MEASURES[LENGTH_RATIO].name), ("F1", "ratio"));
    }
}
