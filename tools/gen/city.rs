//! A block of houses on rolling ground. In: how many houses; out: an open surface, the houses without floors.

use super::border::{chain, reversed, ring};
use super::builder::Builder;
use super::patch::{Patch, Pin, Plane};
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};

/// From one house to the next.
const LOT: f64 = 30.0;
/// Ground beyond the grid of lots, so that the last houses do not stand at the border.
const STREET: f64 = 6.0;

/// `houses` houses in a grid as square as can be, some with flat roofs and some with gables.
pub fn city(houses: u32, sizing: Sizing, seed: u64) -> Result<Shape> {
    let mut random = Random::new(seed, "city");
    let columns = (1..).find(|side| side * side >= houses).unwrap_or(1);
    let rows = houses.div_ceil(columns);
    let mut builder = Builder::new(sizing);
    let far = DVec2::new(f64::from(columns), f64::from(rows)) * LOT + STREET;
    let outer = [DVec2::ZERO, DVec2::new(far.x, 0.0), far, DVec2::new(0.0, far.y)];
    let mut rings = vec![ground_ring(&sizing, &outer, &mut random)];
    for lot in 0..houses {
        let house = House::new(lot % columns, lot / columns, &mut random);
        rings.push(house.build(&mut builder, &sizing, &mut random)?);
    }
    let squeeze = sizing.squeeze().truncate();
    let pin = |at: &DVec3| Pin { uv: at.truncate() * squeeze, at: *at };
    let rings = rings.iter().map(|ring| ring.iter().map(pin).collect()).collect();
    builder.free_form(&Patch { rings, lines: Vec::new() }, |uv| on_ground(uv / squeeze))?;
    Ok(builder.finish())
}

/// The ground at a place: hills of some 1.6 edge lengths, smooth at the scale of the houses.
fn on_ground(place: DVec2) -> DVec3 {
    let DVec2 { x, y } = place;
    let height = 1.6 * libm::sin(x * 0.075) * libm::cos(y * 0.06) + 0.9 * libm::sin(0.11 * y + 0.05 * x);
    DVec3::new(x, y, height)
}

/// Cuts a side on the ground; the points between follow the ground.
fn ground_side(sizing: &Sizing, a: DVec2, b: DVec2, random: &mut Random) -> Vec<DVec3> {
    let flat = sizing.cut_always(a.extend(0.0), b.extend(0.0), random);
    flat.into_iter().map(|point| on_ground(point.truncate())).collect()
}

fn ground_ring(sizing: &Sizing, corners: &[DVec2; 4], random: &mut Random) -> Vec<DVec3> {
    let sides: Vec<Vec<DVec3>> =
        (0..4).map(|i| ground_side(sizing, corners[i], corners[(i + 1) % 4], random)).collect();
    ring(&[&sides[0], &sides[1], &sides[2], &sides[3]])
}

/// A house with its gables, if any, at the two sides along x.
struct House {
    /// Corners of the ground plan, counter-clockwise from the lowest.
    corners: [DVec2; 4],
    /// Height where walls end and the roof starts.
    eave: f64,
    /// How much the ridge is above the eave; `None` for a flat roof.
    rise: Option<f64>,
}

impl House {
    fn new(column: u32, row: u32, random: &mut Random) -> Self {
        let corner = DVec2::new(f64::from(column), f64::from(row)) * LOT
            + DVec2::new(random.between(9.0, 12.0), random.between(9.0, 12.0));
        let size = DVec2::new(random.between(13.0, 17.0), random.between(16.0, 19.0));
        let eave = random.between(9.0, 13.0);
        let rise = random.between(3.5, 5.5);
        Self {
            corners: [
                corner,
                corner + DVec2::new(size.x, 0.0),
                corner + size,
                corner + DVec2::new(0.0, size.y),
            ],
            eave,
            rise: ((column + row) % 3 != 1).then_some(rise),
        }
    }

    /// Corner `i`, at the eave.
    fn top(&self, i: usize) -> DVec3 {
        self.corners[i % 4].extend(self.eave)
    }

    /// The top of the gable over side `i`, if that side has one.
    fn apex(&self, i: usize) -> Option<DVec3> {
        let middle = (self.top(i) + self.top(i + 1)) * 0.5;
        self.rise.filter(|_| i.is_multiple_of(2)).map(|rise| middle + DVec3::Z * rise)
    }

    /// Adds walls, roof and lines. Returns the ring where the house stands on the ground.
    fn build(&self, builder: &mut Builder, sizing: &Sizing, random: &mut Random) -> Result<Vec<DVec3>> {
        let feet: Vec<Vec<DVec3>> =
            (0..4).map(|i| ground_side(sizing, self.corners[i], self.corners[(i + 1) % 4], random)).collect();
        let posts: Vec<Vec<DVec3>> =
            (0..4).map(|i| sizing.cut(on_ground(self.corners[i]), self.top(i), random)).collect();
        let eaves: Vec<Eave> = (0..4).map(|i| self.eave(i, sizing, random)).collect();
        for i in 0..4 {
            let (from, to) = (self.corners[i], self.corners[(i + 1) % 4]);
            let plane =
                Plane { origin: from.extend(0.0), u: (to - from).normalize().extend(0.0), v: DVec3::Z };
            let top = reversed(&eaves[i].whole());
            let wall = ring(&[&feet[i], &posts[(i + 1) % 4], &top, &reversed(&posts[i])]);
            builder.flat(plane, &[wall])?;
            builder.line(feet[i].clone());
            builder.line(posts[i].clone());
            builder.line(eaves[i].whole());
        }
        self.roof(builder, &eaves, sizing, random)?;
        Ok(ring(&[&feet[0], &feet[1], &feet[2], &feet[3]]))
    }

    /// Cuts the upper border of wall `i`.
    fn eave(&self, i: usize, sizing: &Sizing, random: &mut Random) -> Eave {
        let (from, to) = (self.top(i), self.top(i + 1));
        match self.apex(i) {
            Some(apex) => Eave { up: sizing.cut(from, apex, random), down: sizing.cut(apex, to, random) },
            None => Eave { up: sizing.cut(from, to, random), down: Vec::new() },
        }
    }

    fn roof(
        &self,
        builder: &mut Builder,
        eaves: &[Eave],
        sizing: &Sizing,
        random: &mut Random,
    ) -> Result<()> {
        let [south, east, north, west] = [0, 1, 2, 3].map(|i| &eaves[i]);
        let (Some(near), Some(far)) = (self.apex(0), self.apex(2)) else {
            let plane = Plane { origin: self.top(0), u: DVec3::X, v: DVec3::Y };
            let border = ring(&[&south.up, &east.up, &north.up, &west.up]);
            return builder.flat(plane, &[border]);
        };
        let ridge = sizing.cut(near, far, random);
        let right = Plane { origin: near, u: (self.top(1) - near).normalize(), v: DVec3::Y };
        builder.flat(right, &[ring(&[&south.down, &east.up, &north.up, &reversed(&ridge)])])?;
        let left = Plane { origin: near, u: (near - self.top(0)).normalize(), v: DVec3::Y };
        builder.flat(left, &[ring(&[&ridge, &north.down, &west.up, &south.up])])?;
        builder.line(ridge);
        Ok(())
    }
}

/// The upper border of a wall.
struct Eave {
    /// From the first corner to the apex, or all the way without gable.
    up: Vec<DVec3>,
    /// From the apex to the second corner; empty without gable.
    down: Vec<DVec3>,
}

impl Eave {
    fn whole(&self) -> Vec<DVec3> {
        chain(&[&self.up, &self.down])
    }
}
