//! What a run is asked for.
//!
//! [`Params`] change the result and are what two runs must share to be comparable; [`Limits`] say how the work is cut
//! up and never change a byte of it. The constants of the methods, which are not for users to set, are in
//! [`method`] and [`paper`].

pub mod method;
pub mod paper;

pub use paper::PaperThresholds;

use crate::input::IoMode;
use serde::{Deserialize, Serialize};

/// The scale of the voting neighbourhood.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sigma {
    /// In median edge lengths of the mesh; 3 unless told otherwise.
    Edges(f64),
    /// In the units of the mesh.
    Length(f64),
}

impl Sigma {
    /// Whether it is 0, which to the paper method means that the one-ring votes and nothing else.
    pub fn is_zero(self) -> bool {
        matches!(self, Sigma::Edges(x) | Sigma::Length(x) if x == 0.0)
    }
}

/// Which method decides what a feature is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Method {
    /// Refined normals, fold angles, thresholds that follow noise and background: section 1 of `docs/ALGORITHM.md`.
    #[default]
    Robust,
    /// The published method with its global thresholds, for comparison and for clean CAD: section 6.
    Paper(PaperThresholds),
}

/// Parameters that change the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Which method, with its thresholds.
    pub method: Method,
    /// Scale of the voting neighbourhood.
    pub sigma: Sigma,
    /// The weakest crease to report: lines whose mean dihedral angle is smaller are dropped, and vertices with a smaller
    /// one are class face. In degrees, 0 to 180; 0 leaves the decision to the local threshold. The paper method fits no
    /// planes and takes only 0.
    pub min_angle_deg: f64,
    /// The shortest line to report, in sigmas. Applies to connected components of crease lines.
    pub min_length_sigmas: f64,
    /// Report open and non-manifold mesh edges too, as classes of their own.
    pub boundaries: bool,
}

impl Default for Params {
    fn default() -> Self {
        Params {
            method: Method::Robust,
            sigma: Sigma::Edges(method::SIGMA_EDGES),
            min_angle_deg: 0.0,
            min_length_sigmas: method::MIN_LENGTH / method::SIGMA_EDGES,
            boundaries: false,
        }
    }
}

/// A parameter outside the range the method is defined for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// The voting scale is unusable.
    #[error(
        "sigma is {edges:.3} median edge lengths; it must lie between {min} and {max} (the median edge of this mesh is {h} units long)"
    )]
    Sigma {
        /// What was asked for, in median edge lengths.
        edges: f64,
        /// Median edge length of the mesh.
        h: f64,
        /// Smallest scale that still reaches past the one-ring.
        min: f64,
        /// Largest scale: the work grows with its square.
        max: f64,
    },
    /// An angle that no fold has.
    #[error("the smallest angle is {0} degrees; it must lie between 0 (flat) and 180 (folded back)")]
    MinAngle(f64),
    /// A negative or non-finite length.
    #[error("the smallest length is {0} sigmas; it must be finite and not negative")]
    MinLength(f64),
    /// The paper method measures salience, not angles.
    #[error(
        "the paper method has no smallest angle ({0} degrees were asked for); choose the salience instead"
    )]
    MinAngleOfPaper(f64),
    /// A threshold that all vertices exceed or none can.
    #[error("the threshold of {name} is {value}; it must be above 0 and at most 1")]
    Eigenvalue {
        /// Of which eigenvalue.
        name: &'static str,
        /// What was asked for.
        value: f64,
    },
    /// Salience is divided by its largest value.
    #[error("the threshold of the salience is {0}; it must lie between 0 and 1")]
    Salience(f64),
}

impl Params {
    /// The ratio k between the asked-for sigma and the standard one of three median edge lengths `h`. 1 where the paper
    /// method votes over the one-ring alone (sigma = 0), which is a neighbourhood of about the standard size.
    ///
    /// # Errors
    /// If any parameter is outside the range the method is defined for.
    pub fn scale(&self, h: f64) -> Result<f64, ParamError> {
        self.check_method()?;
        let edges = match self.sigma {
            sigma if sigma.is_zero() && matches!(self.method, Method::Paper(_)) => method::SIGMA_EDGES,
            Sigma::Edges(edges) => edges,
            // A mesh without any extent has no edge to compare with; any scale gives the same empty result.
            Sigma::Length(length) if h > 0.0 => length / h,
            Sigma::Length(_) => method::SIGMA_EDGES,
        };
        let (min, max) = method::SIGMA_EDGES_RANGE;
        if !(min..=max).contains(&edges) {
            return Err(ParamError::Sigma { edges, h, min, max });
        }
        if !(0.0..=180.0).contains(&self.min_angle_deg) {
            return Err(ParamError::MinAngle(self.min_angle_deg));
        }
        if !(self.min_length_sigmas >= 0.0 && self.min_length_sigmas.is_finite()) {
            return Err(ParamError::MinLength(self.min_length_sigmas));
        }
        Ok(edges / method::SIGMA_EDGES)
    }

    fn check_method(&self) -> Result<(), ParamError> {
        match &self.method {
            Method::Robust => Ok(()),
            Method::Paper(_) if self.min_angle_deg != 0.0 => {
                Err(ParamError::MinAngleOfPaper(self.min_angle_deg))
            }
            Method::Paper(thresholds) => thresholds.check(),
        }
    }
}

/// How the mesh is cut into tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tiling {
    /// As the memory allows, and no larger than [`DEFAULT_TILE_FACES`].
    Auto,
    /// One tile as large as the world.
    InCore,
    /// Tiles of about so many faces, halo not counted; less where the memory does not allow so many.
    Faces(u64),
}

/// What is done about a file whose faces lie in no spatial order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Rewrite it if that costs less than reading it over and over.
    #[default]
    Auto,
    /// Work on the file as it is.
    Keep,
    /// Rewrite it.
    Rewrite,
}

/// How the work is done; none of this changes the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Threads that compute; 0 means one per processor.
    pub threads: usize,
    /// Size of the tiles.
    pub tiling: Tiling,
    /// How the input is read.
    pub io: IoMode,
    /// Bytes that may be allocated at a time, at the peak. Mapped files are not counted: the system takes their memory
    /// back when somebody needs it.
    pub memory: u64,
    /// What is done about a file without spatial order.
    pub order: Order,
    /// Whether work is left out that nothing in the result depends on. To do it all the same is of use to those only who
    /// want to see that.
    pub shortcuts: bool,
}

impl Default for Limits {
    fn default() -> Self {
        let (tiling, io, order) = (Tiling::Auto, IoMode::Auto, Order::Auto);
        Limits { threads: 0, tiling, io, memory: NO_LIMIT, order, shortcuts: true }
    }
}

/// Faces of a tile where memory allows any number. Smaller tiles spend more on their halos: an ordinary scan needs about
/// 120 edges on every side that is not the border of the mesh, a seventh more faces at this size, and half as many again
/// at a tenth of it. Larger ones lose more when a run is interrupted.
pub const DEFAULT_TILE_FACES: u64 = 16_000_000;

/// [`Limits::memory`] where nobody counts.
pub const NO_LIMIT: u64 = u64::MAX;

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(thresholds: PaperThresholds, sigma: Sigma) -> Params {
        Params { method: Method::Paper(thresholds), sigma, ..Params::default() }
    }

    #[test]
    fn a_sigma_of_zero_is_for_the_paper_method() {
        let robust = Params { sigma: Sigma::Edges(0.0), ..Params::default() };
        assert!(matches!(robust.scale(2.0), Err(ParamError::Sigma { edges: 0.0, .. })));
        for sigma in [Sigma::Edges(0.0), Sigma::Length(0.0)] {
            assert_eq!(paper(PaperThresholds::default(), sigma).scale(2.0), Ok(1.0));
        }
        assert_eq!(paper(PaperThresholds::default(), Sigma::Length(12.0)).scale(2.0), Ok(2.0));
        let small = paper(PaperThresholds::default(), Sigma::Length(1.0)).scale(2.0);
        assert!(matches!(small, Err(ParamError::Sigma { .. })), "{small:?}");
    }

    #[test]
    fn thresholds_that_divide_nothing_are_refused() {
        let published = PaperThresholds::default();
        let refused = |thresholds| paper(thresholds, Sigma::Edges(3.0)).scale(1.0).expect_err("refused");
        for salience in [-0.1, 1.1, f64::NAN] {
            assert!(matches!(refused(PaperThresholds { salience, ..published }), ParamError::Salience(_)));
        }
        for x in [0.0, 1.1, f64::NAN] {
            for thresholds in
                [PaperThresholds { edge_l2: x, ..published }, PaperThresholds { corner_l3: x, ..published }]
            {
                assert!(matches!(refused(thresholds), ParamError::Eigenvalue { .. }), "{thresholds:?}");
            }
        }
        let floor = Params { min_angle_deg: 5.0, ..paper(published, Sigma::Edges(3.0)) };
        assert_eq!(floor.scale(1.0), Err(ParamError::MinAngleOfPaper(5.0)));
    }
}
