//! The constants of the robust method, in one table.
//!
//! Lengths are in units of k h (h: median side, k = sigma / 3h), angles in degrees, so that this page can be held
//! beside section 1 of `docs/ALGORITHM.md`. Step counts appear twice in the program, in the loops that make the steps
//! and in the halo that must cover them; both read them here.

/// Standard sigma in median edge lengths: three rings, the smallest scale at which the noise of a scan averages out
/// while walls three edges apart are still told apart.
pub const SIGMA_EDGES: f64 = 3.0;
/// Below one edge the neighbourhood is empty; above thirty the rounds (they grow with the square) reach across any tile.
pub const SIGMA_EDGES_RANGE: (f64, f64) = (1.0, 30.0);

/// A face counts as degenerate when twice its area is at most this many h^2: far below any sliver a scanner or a CAD
/// kernel emits, far above the rounding of a cross product of coordinates near the origin.
pub const DEGENERATE_AREA: f64 = 1e-10;

/// Edge of a level cube. 27 of them hold some 2,000 vertices of a surface: enough for a quantile, small enough to follow
/// a change of noise or curvature.
pub const LEVEL_CUBE: f64 = 6.0;
/// Quantile of the edge chords that is the noise: the median ignores creases as long as they are the minority.
pub const NOISE_QUANTILE: f64 = 0.5;
/// Quantile of the fold angles that is the background: low, because in dense parts most vertices lie on features.
pub const BACKGROUND_QUANTILE: f64 = 0.3;

/// Refinement: most rounds a face takes part in.
pub const REFINE_ROUNDS: f64 = 40.0;
/// Refinement: rounds per radian of local noise. More rounds than the noise asks for would facet smooth surfaces.
pub const REFINE_SLOPE: f64 = 80.0;
/// Refinement: width of the range kernel in local noise levels; folds narrower than this are averaged linearly.
pub const RANGE_KAPPA: f64 = 4.0;
/// Refinement: narrowest range kernel, so that float noise on a plane is averaged at all.
pub const RANGE_MIN_DEG: f64 = 1.5;
/// Refinement: rounds after round 0 in which the kernel is narrow, which tells steep faces of dense features apart before
/// they are averaged. Kept narrow for longer it would facet curved surfaces.
pub const RANGE_EARLY_ROUNDS: u32 = 5;
/// Refinement: widest range kernel in those rounds.
pub const RANGE_EARLY_DEG: f64 = 30.0;
/// Refinement: widest range kernel later, so that a right angle survives any noise.
pub const RANGE_MAX_DEG: f64 = 45.0;

/// Tensors: votes after the first, for k = 1.
pub const REVOTES: f64 = 3.0;

/// Surroundings are calm where their threshold would be below this: nothing steep that a larger scale could blur.
pub const CALM_DEG: f64 = 6.0;
/// Tensors: votes more in calm surroundings, for each refinement round: averaged normals vary on a larger scale.
pub const FURTHER_PER_ROUND: f64 = 0.3;
/// Each of them raises the fold angle of noise, and so the threshold, by this share.
pub const FURTHER_BACKGROUND: f64 = 0.045;

/// Local threshold in background levels.
pub const THRESHOLD_BACKGROUND: f64 = 2.0;
/// Smallest local threshold: below this a fold is rounding.
pub const THRESHOLD_MIN_DEG: f64 = 0.6;
/// Largest local threshold: a fold of 20 degrees is a crease in any surrounding.
pub const THRESHOLD_MAX_DEG: f64 = 20.0;

/// Corner: smallest ball part as an angle.
pub const CORNER_MIN_DEG: f64 = 20.0;
/// Corner: smallest ratio of the ball part to the plate part.
pub const CORNER_RATIO: f64 = 0.4;
/// A weak edge becomes a sharp edge at this fold angle.
pub const SHARP_DEG: f64 = 30.0;

/// Contrast: vertices of a walk across the line, on a clean mesh.
pub const CONTRAST_STEPS: f64 = 3.0;
/// The same, more for each refinement round: averaging widens what is left of a crease.
pub const CONTRAST_STEPS_PER_ROUND: f64 = 0.2;
/// Contrast: how far that walk may lead, on a clean mesh. A fillet is wider and does not become a crease.
pub const CONTRAST_REACH: f64 = 3.0;
/// The same, more for each refinement round.
pub const CONTRAST_REACH_PER_ROUND: f64 = 0.15;

/// Walks along lines: rounds of smoothing of the positions they see, for each refinement round.
pub const SMOOTH_PER_ROUND: f64 = 0.1;
/// Walks along lines: neighbours within this distance are averaged. On a triangulation of scattered points some lie thirty
/// edges away, and a mean over them is no place on the surface.
pub const SMOOTH_REACH: f64 = 2.0;
/// Walks along lines: most rounds of smoothing. More would round the corners off.
pub const SMOOTH_ROUNDS: f64 = 3.0;

/// Trace: vertices followed on each side.
pub const TRACE_STEPS: usize = 5;
/// Trace: vertices below this share of the local threshold are not followed.
pub const TRACE_LOW: f64 = 0.5;
/// Trace: a supporter counts at most this many times the vertex's own fold, or the tip of a cone would be a star of lines.
pub const TRACE_LEND: f64 = 1.25;
/// All walks: cosine of the widest angle (60 degrees) between a step and the direction of travel.
pub const CONE_COS: f64 = 0.5;
/// Trace: cosine of the widest turn (45 degrees) between neighbouring line directions.
pub const TURN_COS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Support: share of the fold that must stand out against the surroundings.
pub const CREST_CONTRAST: f64 = 0.4;
/// The same for a strong vertex.
pub const STRONG_CONTRAST: f64 = 0.45;
/// No smooth surface folds this much within a ring: such a fold needs no contrast.
pub const SURE_DEG: f64 = 45.0;
/// A strong vertex exceeds its threshold by this factor.
pub const STRONG_MEASURE: f64 = 1.3;

/// Thinning: most rounds of averaging along the line.
pub const AVERAGE_ROUNDS: u32 = 8;
/// The same in calm surroundings, where no other line is near to leak in.
pub const AVERAGE_ROUNDS_CALM: u32 = 16;
/// Thinning: a ridge vertex folds itself: its own tensor shows this share of what the repeated vote shows. Beside a clean
/// edge only the repeated vote shows a fold.
pub const OWN_SHARE: f64 = 0.25;
/// That share falls to 0 at so many refinement rounds, where averaging has levelled the difference.
pub const OWN_ROUNDS: f64 = 30.0;
/// Thinning: radius of the non-maximum suppression.
pub const THIN_RADIUS: f64 = 1.6;
/// Thinning: so many vertices are gone on from at most. There are a dozen on a scan; on the rim of a finely cut lid whose
/// sides are long there would be all of them, and work would grow with the third power of their number.
pub const THIN_MOST: usize = 256;
/// Thinning: a neighbour lies across the line when (e.b)^2 is at least this many (e.t)^2.
pub const THIN_SIDE: f64 = 2.5;

/// Linking: steps of a path.
pub const LINK_STEPS: usize = 3;
/// Linking: vertices on the way need this share of the threshold.
pub const LINK_MEASURE: f64 = 0.6;
/// Linking: vertices on the way need this share of the crest contrast.
pub const LINK_CONTRAST: f64 = 0.7;

/// Graph: a path whose ends are already this close along the graph would only double a line.
pub const LOOP_LENGTH: f64 = 6.0;
/// The same, more for each refinement round at the ends: noise blurs the line.
pub const LOOP_PER_ROUND: f64 = 0.1;
/// Graph: shorter dangling branches are pruned.
pub const PRUNE_LENGTH: f64 = 6.0;
/// Graph: shorter components are dropped.
pub const MIN_LENGTH: f64 = 8.0;
/// Graph: least share of a component's length that must lie between strong vertices.
pub const STRONG_SHARE: f64 = 0.25;

/// Fit: radius of the patch where there is no noise. Two rings: a plane through fewer vertices would be the vertices.
pub const FIT_NEAR: f64 = 2.5;
/// Fit: with so many refinement rounds (noise from .2 on) a patch is as wide as it gets.
pub const FIT_NOISY_ROUNDS: f64 = 20.0;
/// Fit: radius of the patch there. The slope of a plane through a patch is the surer the wider it
/// is, with the square of the radius. Less than a level cube, which the halo makes use of.
pub const FIT_FAR: f64 = 5.5;
/// Fit: a patch has faces around so many vertices at most, for the same reason. There are a hundred on a scan.
pub const FIT_MOST: usize = 1024;
/// Fit: a face belongs to a plane if the chord between the normals is below this (29 degrees): wide enough for what noise
/// is left in refined normals, narrower than half of a right angle, so that no plane lies between two others.
pub const FIT_WIDTH: f64 = 0.5;
/// Fit: what a face must agree better with one side than the other, in chords squared, to outweigh one kh of distance
/// across. Two sides of a right angle are told apart by normals alone, those of ten degrees by place alone.
pub const FIT_NORMAL: f64 = 5.0;
/// Fit: over this length the weight of a face rises from 0 at the crease to 1: faces there may belong to either side.
pub const FIT_RAMP: f64 = 0.5;
/// Fit: rounds of telling the sides apart by normals and place. They settle in two or three.
pub const SPLIT_ROUNDS: usize = 4;
/// Fit: rounds of fitting planes to the sides and dividing the faces anew at the line where they meet.
pub const FIT_ROUNDS: usize = 3;
/// Fit: slopes are drawn to the refined normal as if the patch were wider by this: next to nothing for a wide patch, a
/// great deal for three vertices in a row, whose slope across them is anybody's guess.
pub const FIT_PULL: f64 = 0.3;
/// Fit: standard error below which no plane is taken to be: surfaces are not flat to a fiftieth of an edge.
pub const FIT_FLOOR: f64 = 0.02;
/// Fit: how far a line vertex lies from its line, as a standard deviation: half an edge where there is no noise, twice
/// that with much noise (measured: 0.3 to 0.7).
pub const FIT_SLACK: f64 = 0.5;
/// Fit: the crease is looked for so far from the vertex.
pub const FIT_SHIFT: f64 = 1.0;
/// Fit: planes that are looked for beyond two. A corner of five planes is enough for what is built.
pub const MORE_PLANES: usize = 3;
/// Fit: smallest share of the faces around the one-ring for a further plane.
pub const MORE_SHARE: f64 = 0.1;
/// Fit: a further plane counts the less the farther from the vertex it passes, from here on not at all: else it would draw
/// the vertices before a corner into it. At a corner twice as far.
pub const MORE_CLOSE: f64 = 1.0;
/// Fit: no point is moved farther than this.
pub const FIT_MOVE: f64 = 1.5;

/// Smoothing: stiffness of a line against bending. A line whose planes are sure to a tenth of kh follows them within two
/// edges; one whose planes hardly tell where they meet is drawn straight over ten.
pub const LINE_STIFFNESS: f64 = 200.0;
/// Smoothing: edges between fitted points count as at least so long: points may fall together.
pub const LINE_SHORTEST: f64 = 0.25;
