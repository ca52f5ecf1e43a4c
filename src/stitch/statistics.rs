//! What can be said of many lines in a few numbers, gathered while they stream by.

use super::error::StitchError;
use super::fragments::Class;
use super::lines::Measures;
use super::source::LineSource;

/// Numbers over all lines of a class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassTotal {
    /// Lines.
    pub lines: u64,
    /// Together, in mesh units.
    pub length: f64,
    /// Sum of angle times length: degrees times mesh units.
    turned: f64,
    /// Smallest and largest angle of a line, degrees.
    pub angles: [f64; 2],
}

impl Default for ClassTotal {
    fn default() -> Self {
        ClassTotal { lines: 0, length: 0.0, turned: 0.0, angles: [f64::INFINITY, 0.0] }
    }
}

impl ClassTotal {
    /// Mean angle over the length, degrees.
    pub fn mean_angle(&self) -> f64 {
        self.turned / self.length.max(f64::MIN_POSITIVE)
    }

    fn add(&mut self, line: &Measures) {
        self.lines += 1;
        self.length += line.length;
        self.turned += line.angle * line.length;
        self.angles = [self.angles[0].min(line.angle), self.angles[1].max(line.angle)];
    }
}

/// Numbers over all lines. Sums run in canonical order, so they are the same however the lines were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Of all lines.
    pub all: ClassTotal,
    /// By number of the class.
    pub classes: [ClassTotal; Class::ALL.len()],
    /// Closed lines.
    pub closed: u64,
    /// Corners on lines.
    pub corners: u64,
    /// Largest S of the mesh.
    pub largest_salience: f64,
}

impl Statistics {
    /// Over all of `source`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of(source: &dyn LineSource) -> Result<Statistics, StitchError> {
        let mut all = Statistics { largest_salience: source.largest_salience(), ..Statistics::default() };
        source.measures().try_for_each(|line| line.map(|(measures, _)| all.add_line(&measures)))?;
        all.corners = source.counts().corners;
        Ok(all)
    }

    /// One more line.
    pub fn add_line(&mut self, line: &Measures) {
        self.all.add(line);
        self.classes[line.class as usize].add(line);
        self.closed += u64::from(line.closed);
    }
}
