//! What grows with the noise: step counts and lengths as functions of the local number of refinement rounds K.
//!
//! Averaging widens what is left of a crease, so walks across it must lead farther, and tensors must look farther around.
//! The steps that make use of these numbers and the halo that must cover them both ask here. In: K as it is counted at
//! this scale. Where a number belongs to steps of a walk rather than to rounds, K is divided by k^2 first.

use super::plan::Scale;
use crate::config::method;

impl Scale {
    /// K as it would be at the standard scale.
    fn standard_rounds(&self, rounds: u32) -> f64 {
        f64::from(rounds) / (self.k * self.k)
    }

    /// Most vertices of a contrast walk.
    pub fn contrast_steps(&self, rounds: u32) -> usize {
        let more = (method::CONTRAST_STEPS_PER_ROUND * self.standard_rounds(rounds)).floor();
        (method::CONTRAST_STEPS + more) as usize
    }

    /// How far a contrast walk may lead, in mesh units.
    pub fn contrast_reach(&self, rounds: u32) -> f64 {
        self.length(method::CONTRAST_REACH + method::CONTRAST_REACH_PER_ROUND * self.standard_rounds(rounds))
    }

    /// Further tensor votes, where the surroundings are calm.
    pub fn further_votes(&self, rounds: u32) -> usize {
        (method::FURTHER_PER_ROUND * f64::from(rounds)).floor() as usize
    }

    /// Rounds of smoothing of the positions that walks along lines see.
    pub fn smoothing_rounds(&self, rounds: u32) -> usize {
        (method::SMOOTH_PER_ROUND * self.standard_rounds(rounds)).floor().min(method::SMOOTH_ROUNDS) as usize
    }

    /// Share of the wide fold that a ridge vertex must show itself.
    pub fn own_share(&self, rounds: u32) -> f64 {
        method::OWN_SHARE * (1.0 - self.standard_rounds(rounds) / method::OWN_ROUNDS).max(0.0)
    }

    /// Rounds of averaging along the line.
    pub fn average_rounds(rounds: u32, calm: bool) -> usize {
        let most = if calm { method::AVERAGE_ROUNDS_CALM } else { method::AVERAGE_ROUNDS };
        rounds.min(most) as usize
    }
}
