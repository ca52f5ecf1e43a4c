//! Height fields with breaklines. In: a smooth ground, and banks along straight or round paths, each with a cross
//! section and a height that may fade; out: an open sheet.
//!
//! The breaklines of a bank run along its path at the offsets where its section bends. They are edges of the mesh as
//! far as the bank goes. They are true lines as far as the surface bends there by at least [`SMALLEST_TRUE_ANGLE_DEG`]; a
//! true line ends at the last vertex where it does.

use super::border::ring;
use super::builder::Builder;
use super::patch::{Patch, Pin};
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};

/// Creases that fade are true lines down to this angle between the normals on both sides.
pub const SMALLEST_TRUE_ANGLE_DEG: f64 = 5.0;

/// Step of the differences that measure slopes: the ground bends little within it, and rounding is far below.
const STEP: f64 = 1e-4;

/// A rectangle of ground with banks. Banks must keep apart from each other.
pub struct Relief {
    /// Name of the stream of random numbers.
    pub name: &'static str,
    /// The ground is `0 .. size.x` times `0 .. size.y`.
    pub size: DVec2,
    /// Height of the ground, smooth.
    pub ground: fn(DVec2) -> f64,
    /// What is on it.
    pub banks: Vec<Bank>,
}

/// A bank or a ditch.
pub struct Bank {
    /// Where it runs.
    pub path: Path,
    /// Its cross section.
    pub section: Section,
    /// Where along its path, in parts of the length, it has reached its full height, and from where on it fades, to
    /// nothing at the end; `None`: full everywhere.
    pub fade: Option<Fade>,
}

/// How the height of a bank changes along its path, in parts of the length.
#[derive(Clone, Copy)]
pub struct Fade {
    /// The height grows from nothing at 0 to all of it here; not at all if 0.
    pub full_from: f64,
    /// From here it shrinks.
    pub full_to: f64,
    /// To nothing here.
    pub end: f64,
}

/// The middle of a bank. Offsets across it are positive to the left.
pub enum Path {
    /// Straight across the ground, from its lower side `y = 0` to its upper one.
    Line {
        /// On the lower side.
        from: DVec2,
        /// On the upper side.
        to: DVec2,
    },
    /// Part of a circle inside the ground, counter-clockwise; the bank fades at both ends.
    Arc {
        /// Its middle.
        center: DVec2,
        /// Its radius.
        radius: f64,
        /// Angle of its middle.
        middle: f64,
        /// Angle from its middle to either end.
        half: f64,
    },
}

/// Height across the path.
pub enum Section {
    /// Straight pieces between pairs of offset and height; constant beyond.
    Polyline(Vec<DVec2>),
    /// One crease in the middle, of this slope downwards on both sides, that levels out smoothly.
    Crease {
        /// At the crease; negative for a valley.
        slope: f64,
        /// Offset from which on there is nothing.
        reach: f64,
    },
}

/// A place relative to a path.
struct Along {
    /// Part of the length; below 0 or above 1 beyond the ends.
    part: f64,
    offset: f64,
}

impl Path {
    fn length(&self) -> f64 {
        match *self {
            Self::Line { from, to } => from.distance(to),
            Self::Arc { radius, half, .. } => 2.0 * radius * half,
        }
    }

    fn locate(&self, place: DVec2) -> Along {
        match *self {
            Self::Line { from, to } => {
                let along = (to - from).normalize();
                let arm = place - from;
                Along { part: arm.dot(along) / self.length(), offset: along.perp_dot(arm) }
            }
            Self::Arc { center, radius, middle, half } => {
                let arm = place - center;
                let (sine, cosine) = libm::sincos(middle);
                let axis = DVec2::new(cosine, sine);
                let angle = libm::atan2(axis.perp_dot(arm), axis.dot(arm));
                Along { part: 0.5 + 0.5 * angle / half, offset: radius - arm.length() }
            }
        }
    }

    /// The place at a part of the length and an offset. Direction of the path there, too.
    fn place(&self, part: f64, offset: f64) -> (DVec2, DVec2) {
        match *self {
            Self::Line { from, to } => {
                let along = (to - from).normalize();
                (from + (to - from) * part + along.perp() * offset, along)
            }
            Self::Arc { center, radius, middle, half } => {
                let (sine, cosine) = libm::sincos(middle + (2.0 * part - 1.0) * half);
                let arm = DVec2::new(cosine, sine);
                (center + arm * (radius - offset), arm.perp())
            }
        }
    }
}

impl Section {
    fn height(&self, offset: f64) -> f64 {
        match self {
            Self::Polyline(points) => {
                let after = points.partition_point(|point| point.x <= offset);
                match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
                    (Some(a), Some(b)) => a.y + (b.y - a.y) * (offset - a.x) / (b.x - a.x),
                    (None, Some(end)) => end.y,
                    (Some(end), None) => end.y,
                    (None, None) => 0.0,
                }
            }
            Self::Crease { slope, reach } => {
                let x = (offset.abs() / reach).min(1.0);
                let rest = 1.0 - x * x;
                -slope * reach * x * rest * rest
            }
        }
    }

    /// Offsets of the breaklines.
    fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Polyline(points) => points.iter().map(|point| point.x).collect(),
            Self::Crease { .. } => vec![0.0],
        }
    }
}

impl Bank {
    fn height(&self, place: DVec2) -> f64 {
        let Along { part, offset } = self.path.locate(place);
        let amplitude = self.fade.map_or(1.0, |Fade { full_from, full_to, end }| {
            let grown = if full_from > 0.0 { smooth_step(part / full_from) } else { 1.0 };
            grown * smooth_step((end - part) / (end - full_to))
        });
        if amplitude == 0.0 { 0.0 } else { amplitude * self.section.height(offset) }
    }

    /// The parts of the path between which a breakline runs.
    fn ends(&self, offset: f64, ground: DVec2) -> [f64; 2] {
        let end = self.fade.map_or(1.0, |fade| fade.end);
        match self.path {
            Path::Arc { .. } => [0.0, end],
            Path::Line { from, to } => {
                // Beside the path the sides of the ground come earlier or later.
                let side = (to - from).normalize().perp() * offset;
                let part_at = |y: f64| (y - from.y - side.y) / (to.y - from.y);
                [part_at(0.0), if end < 1.0 { end } else { part_at(ground.y) }]
            }
        }
    }
}

/// From 0 at 0 to 1 at 1, level at both.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A breakline: its points, and whether each is part of a true line.
struct Breakline {
    points: Vec<DVec3>,
    is_true: Vec<bool>,
}

impl Relief {
    /// Makes the sheet.
    ///
    /// # Errors
    /// If banks cross.
    pub fn build(&self, sizing: Sizing, seed: u64) -> Result<Shape> {
        let mut random = Random::new(seed, self.name);
        let mut breaklines = Vec::new();
        for bank in &self.banks {
            for offset in bank.section.breaks() {
                breaklines.push(self.breakline(bank, offset, &sizing, &mut random));
            }
        }
        let border = self.border(&breaklines, &sizing, &mut random);
        let squeeze = sizing.squeeze().truncate();
        let pin = |at: &DVec3| Pin { uv: at.truncate() * squeeze, at: *at };
        let patch = Patch {
            rings: vec![border.iter().map(pin).collect()],
            lines: breaklines.iter().map(|line| line.points.iter().map(pin).collect()).collect(),
        };
        let mut builder = Builder::new(sizing);
        builder.free_form(&patch, |uv| self.surface(uv / squeeze))?;
        for line in &breaklines {
            let mut start = 0;
            for run in line.is_true.chunk_by(|a, b| a == b) {
                if run[0] && run.len() > 1 {
                    builder.line(line.points[start..start + run.len()].to_vec());
                }
                start += run.len();
            }
        }
        Ok(builder.finish())
    }

    fn surface(&self, place: DVec2) -> DVec3 {
        let banks: f64 = self.banks.iter().map(|bank| bank.height(place)).sum();
        place.extend((self.ground)(place) + banks)
    }

    fn breakline(&self, bank: &Bank, offset: f64, sizing: &Sizing, random: &mut Random) -> Breakline {
        let [first, last] = bank.ends(offset, self.size);
        let at = |t: f64| bank.path.place(first + (last - first) * t, offset);
        let mut line = Breakline { points: Vec::new(), is_true: Vec::new() };
        for t in sizing.places(|t| self.surface(at(t).0), Some(random)) {
            let (mut place, along) = at(t);
            // Rounding must not move a point off the border.
            for side in [0.0, self.size.y] {
                if (place.y - side).abs() < 1e-9 {
                    place.y = side;
                }
            }
            line.points.push(self.surface(place));
            line.is_true.push(self.angle_deg(place, along) >= SMALLEST_TRUE_ANGLE_DEG);
        }
        line
    }

    /// The angle between the normals on both sides of a line that runs in direction `along`.
    fn angle_deg(&self, place: DVec2, along: DVec2) -> f64 {
        let at = |step: DVec2| self.surface(place + step);
        let tangent = at(along * STEP) - at(along * -STEP);
        let across = along.perp() * STEP;
        let middle = at(DVec2::ZERO);
        let left = tangent.cross(at(across) - middle);
        let right = tangent.cross(middle - at(-across));
        libm::atan2(left.cross(right).length(), left.dot(right)).to_degrees()
    }

    /// The border, counter-clockwise from the origin, with the ends of the breaklines.
    fn border(&self, breaklines: &[Breakline], sizing: &Sizing, random: &mut Random) -> Vec<DVec3> {
        let ends: Vec<DVec3> =
            breaklines.iter().flat_map(|line| [line.points[0], line.points[line.points.len() - 1]]).collect();
        let side = |y: f64| {
            let mut stops: Vec<DVec3> = ends.iter().copied().filter(|end| end.y == y).collect();
            stops.extend([0.0, self.size.x].map(|x| self.surface(DVec2::new(x, y))));
            stops.sort_by(|a, b| a.x.total_cmp(&b.x));
            stops
        };
        let (lower, mut upper) = (side(0.0), side(self.size.y));
        upper.reverse();
        let stops: Vec<DVec3> = lower.into_iter().chain(upper).collect();
        let mut parts: Vec<Vec<DVec3>> = Vec::new();
        for (i, from) in stops.iter().enumerate() {
            let to = stops[(i + 1) % stops.len()];
            let mut part: Vec<DVec3> = sizing
                .cut_always(from.with_z(0.0), to.with_z(0.0), random)
                .iter()
                .map(|point| self.surface(point.truncate()))
                .collect();
            part[0] = *from;
            part.pop();
            part.push(to);
            parts.push(part);
        }
        ring(&parts.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }
}
