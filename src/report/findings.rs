//! One look at all lines: their numbers, how they are distributed, and which of them a page shows.
//!
//! In: lines as a stream. Out: numbers of a size that does not depend on how many lines there are.

use super::data::Histograms;
use super::histogram::Histogrammer;
use super::strongest::{Chosen, Strongest};
use crate::stitch::{LineSource, Statistics, StitchError};

/// What is said of all lines.
pub struct Findings {
    /// Numbers by class.
    pub statistics: Statistics,
    /// Distributions.
    pub histograms: Histograms,
    /// Edges of all lines.
    pub edges: u64,
    /// The lines that a page shows.
    pub chosen: Chosen,
}

impl Findings {
    /// Over all of `source`, lines of a mesh with this median edge. At most `segments` edges are chosen for a page.
    ///
    /// # Errors
    /// If the lines cannot be read.
    pub fn of(source: &dyn LineSource, median_edge: f64, segments: u64) -> Result<Findings, StitchError> {
        let largest_salience = source.largest_salience();
        let mut statistics = Statistics { largest_salience, ..Statistics::default() };
        let (mut counted, mut strongest) = (Histogrammer::new(median_edge), Strongest::new(segments));
        for (id, line) in (0u64..).zip(source.measures()) {
            let (measures, edges) = line?;
            statistics.add_line(&measures);
            counted.add(&measures);
            strongest.offer(id, edges, &measures);
        }
        statistics.corners = source.counts().corners;
        let (histograms, chosen) = (counted.finish(), strongest.finish());
        Ok(Findings { statistics, histograms, edges: source.counts().edges, chosen })
    }
}
