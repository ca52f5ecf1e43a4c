//! A block of the city as a mesh.
//!
//! In: its plan; out: positions, triangles, true lines. Order of the vertices: the lower border, the left border, the rest
//! of the ground row by row, then storey by storey roof and walls. The place of a border vertex in this order does not
//! depend on what stands on the block, so that the neighbours can name it.

use super::super::noise::NoiseKind;
use super::super::random::Random;
use super::CityScan;
use super::chart::{Chart, KERB_FOOT, KERB_TOP};
use super::ground::ground;
use super::lattice::{Diagonal, Freedom, Table};
use super::lines;
use super::plan::{BlockPlan, Counts};
use super::storey::Storey;
use super::wall::{self, Column};
use glam::{DVec2, DVec3};

// Keep what is drawn for one thing apart from what is drawn for others.
const JITTER: u64 = 0x6a69_7474;
const ROOF: u64 = 0x726f_6f66;
const DIAGONAL: u64 = 0x6469_6167;
const WALL: u64 = 0x7761_6c6c;
const NOISE: u64 = 0x6e6f_6973;

/// A vertex of a block that belongs to a neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ghost {
    /// Columns to the east and rows to the north.
    pub step: [u64; 2],
    /// Its place in the order of that block.
    pub index: u32,
}

/// The mesh of a block.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// Positions of the vertices that the block owns, with noise.
    pub positions: Vec<DVec3>,
    /// Vertices of neighbours that faces name: `positions.len() + g` is ghost `g`.
    pub ghosts: Vec<Ghost>,
    /// Corners of the triangles, counter-clockwise seen from outside or above.
    pub faces: Vec<[u32; 3]>,
    /// True feature lines, without noise.
    pub lines: Vec<Vec<DVec3>>,
}

/// Lattice points of the ground or of a roof: which vertices they are, and where.
pub struct Surface {
    /// The vertex of each point.
    pub index: Table<u32>,
    /// Its position, without noise.
    pub position: Table<DVec3>,
}

/// Makes a block.
pub fn build(city: &CityScan, plan: &BlockPlan) -> Block {
    let mut block = Block::default();
    let land = land(city, plan, &mut block);
    let kerb = |[i, j]: [u32; 2]| {
        let far = plan.chart.side - 1;
        let ring = i.min(far - i);
        let on_mitre = ring == j.min(far - j) && (KERB_FOOT..KERB_TOP).contains(&ring);
        on_mitre.then(|| Diagonal::towards_middle([i, j], [far; 2]))
    };
    let random = |stream, surface| Random::at(city.seed, [stream, plan.place[0], plan.place[1], surface]);
    let houses: Vec<&Storey> = plan.storeys.iter().filter(|storey| storey.parent.is_none()).collect();
    let covered = |cell| houses.iter().any(|house| covers(house, [0, 0], cell));
    fill(&land, covered, kerb, &mut random(DIAGONAL, 0), &mut block.faces);
    lines::kerb(&plan.chart, &land, &mut block.lines);
    let mut roofs: Vec<(Surface, f64)> = Vec::new();
    for (number, storey) in plan.storeys.iter().enumerate() {
        let (below, offset, floor) = match storey.parent {
            None => (&land, storey.low, mean_foot(&land, storey)),
            Some(parent) => {
                let low = plan.storeys[parent].low;
                (&roofs[parent].0, [storey.low[0] - low[0], storey.low[1] - low[1]], roofs[parent].1)
            }
        };
        let eave = floor + f64::from(storey.rows);
        let roof = roof(city, plan, number, eave, &mut block.positions);
        let child = plan.child(number);
        let covered = |cell| child.is_some_and(|child| covers(child, storey.low, cell));
        let mut chance = random(DIAGONAL, number as u64 + 1);
        fill(&roof, covered, |cell| storey.forced(cell), &mut chance, &mut block.faces);
        let columns = columns(storey, below, offset, &roof);
        let mut jitter = random(WALL, number as u64);
        let raised = wall::build(&columns, &mut block.positions, &mut block.faces, &mut jitter);
        lines::storey(storey, &roof, &raised, &block.positions, &mut block.lines);
        roofs.push((roof, eave));
    }
    add_noise(city, plan, &mut block);
    block.resolve_ghosts();
    block
}

/// Marks ghosts while their number behind the vertices of the block is not known.
const GHOST: u32 = 1 << 31;
/// The point is inside a house.
const GONE: u32 = u32::MAX;

impl Block {
    /// How much there is of it.
    pub fn counts(&self) -> Counts {
        let points: usize = self.lines.iter().map(Vec::len).sum();
        Counts {
            vertices: self.positions.len() as u64,
            faces: self.faces.len() as u64,
            line_points: points as u64,
            line_edges: (points - self.lines.len()) as u64,
        }
    }

    fn resolve_ghosts(&mut self) {
        let own = self.positions.len() as u32;
        for corner in self.faces.iter_mut().flatten() {
            if *corner & GHOST != 0 {
                *corner = own + (*corner & !GHOST);
            }
        }
    }
}

/// The ground of the block, up to the borders of its neighbours.
fn land(city: &CityScan, plan: &BlockPlan, block: &mut Block) -> Surface {
    let chart = &plan.chart;
    let size = [chart.side; 2];
    let mut freedom = Table::new(size, |point| kerb_freedom(chart, point));
    for storey in plan.storeys.iter().filter(|storey| storey.parent.is_none()) {
        freedom.cut_out(storey.low, storey.size);
    }
    let owned = plan.owned();
    let mut index = Table::new(size, |_| GONE);
    let mut position = Table::new(size, |_| DVec3::ZERO);
    let mut visit = |point: [u32; 2], block: &mut Block| {
        let freedom = freedom.at(point);
        if freedom == Freedom::Gone {
            return;
        }
        let at = ground_point(city, plan, point, freedom);
        let vertex = match ghost(city, plan, point) {
            None => {
                block.positions.push(at);
                block.positions.len() - 1
            }
            Some(ghost) => {
                block.ghosts.push(ghost);
                (block.ghosts.len() - 1) | GHOST as usize
            }
        };
        index.set(point, vertex as u32);
        position.set(point, at);
    };
    (0..owned[0]).for_each(|i| visit([i, 0], block));
    (1..owned[1]).for_each(|j| visit([0, j], block));
    for j in 0..=chart.side {
        for i in 0..=chart.side {
            let seen = (j == 0 && i < owned[0]) || (i == 0 && j < owned[1]);
            if !seen {
                visit([i, j], block);
            }
        }
    }
    Surface { index, position }
}

/// What points of the ground may do where there is no house: those on the kerb stay on its lines.
fn kerb_freedom(chart: &Chart, [i, j]: [u32; 2]) -> Freedom {
    let (x, y) = (i.min(chart.side - i), j.min(chart.side - j));
    let ring = x.min(y);
    match ring {
        _ if !(KERB_FOOT..=KERB_TOP).contains(&ring) => Freedom::Free,
        _ if x == y && (ring == KERB_FOOT || ring == KERB_TOP) => Freedom::Fixed,
        _ if x == y => Diagonal::towards_middle([i, j], [chart.side; 2]).freedom(),
        KERB_FOOT | KERB_TOP if x < y => Freedom::AlongY,
        KERB_FOOT | KERB_TOP => Freedom::AlongX,
        _ => Freedom::Free,
    }
}

/// Whose the point is, if it is a neighbour's.
fn ghost(city: &CityScan, plan: &BlockPlan, [i, j]: [u32; 2]) -> Option<Ghost> {
    let owned = plan.owned();
    let step = [i >= owned[0], j >= owned[1]].map(u64::from);
    if step == [0, 0] {
        return None;
    }
    let i = if step[0] == 1 { 0 } else { i };
    let j = if step[1] == 1 { 0 } else { j };
    // A neighbour to the east may be the last one, and own its right border.
    let last = plan.place[0] + step[0] + 1 == city.columns;
    let index = if j == 0 { i } else { plan.chart.side + u32::from(last) - 1 + j };
    Some(Ghost { step, index })
}

/// Place of a point of the ground, the same for all blocks that share it.
fn ground_point(city: &CityScan, plan: &BlockPlan, [i, j]: [u32; 2], freedom: Freedom) -> DVec3 {
    let owned = plan.owned();
    // A point on the far border is one on the near border of the neighbour.
    let (east, north) = (i >= owned[0], j >= owned[1]);
    let place = [plan.place[0] + u64::from(east), plan.place[1] + u64::from(north)];
    let (i, j) = (if east { 0 } else { i }, if north { 0 } else { j });
    let mut random = Random::at(city.seed, [JITTER, place[0], place[1], u64::from(i) << 32 | u64::from(j)]);
    let on_lattice = DVec2::new(f64::from(i), f64::from(j)) + freedom.jitter(&mut random);
    let corner = DVec2::new(place[0] as f64, place[1] as f64) * plan.chart.pitch();
    let at = corner + plan.chart.place(on_lattice);
    let height = ground(city.seed, at).height + Chart::height(plan.chart.ring(on_lattice));
    at.extend(height)
}

/// Mean height of the ground under the corners of a house.
fn mean_foot(land: &Surface, storey: &Storey) -> f64 {
    let ([x, y], [w, d]) = (storey.low, storey.size);
    let height = |i, j| land.position.at([x + i, y + j]).z;
    0.25 * (height(0, 0) + height(w, 0) + height(0, d) + height(w, d))
}

/// Makes the points of a roof.
fn roof(city: &CityScan, plan: &BlockPlan, number: usize, eave: f64, positions: &mut Vec<DVec3>) -> Surface {
    let storey = &plan.storeys[number];
    let mut freedom = Table::new(storey.size, |point| storey.freedom(point));
    if let Some(child) = plan.child(number) {
        freedom.cut_out([child.low[0] - storey.low[0], child.low[1] - storey.low[1]], child.size);
    }
    let [x, y] = plan.place;
    let corner = DVec2::new(x as f64, y as f64) * plan.chart.pitch();
    let low = DVec2::new(f64::from(storey.low[0]), f64::from(storey.low[1]));
    let mut random = Random::at(city.seed, [ROOF, x, y, number as u64]);
    let position = Table::new(storey.size, |point| {
        let freedom = freedom.at(point);
        let at = DVec2::new(f64::from(point[0]), f64::from(point[1])) + freedom.jitter(&mut random);
        (corner + plan.chart.place(low + at)).extend(eave + storey.rise(at))
    });
    let index = Table::new(storey.size, |point| {
        if freedom.at(point) == Freedom::Gone {
            return GONE;
        }
        positions.push(position.at(point));
        positions.len() as u32 - 1
    });
    Surface { index, position }
}

/// Whether a storey stands on a cell of the lattice that begins at `origin`.
fn covers(storey: &Storey, origin: [u32; 2], cell: [u32; 2]) -> bool {
    (0..2).all(|axis| {
        let low = storey.low[axis] - origin[axis];
        (low..low + storey.size[axis]).contains(&cell[axis])
    })
}

/// Adds the triangles of all cells that are not covered.
fn fill(
    surface: &Surface,
    covered: impl Fn([u32; 2]) -> bool,
    forced: impl Fn([u32; 2]) -> Option<Diagonal>,
    chance: &mut Random,
    faces: &mut Vec<[u32; 3]>,
) {
    let [columns, rows] = surface.index.size();
    for j in 0..rows {
        for i in 0..columns {
            if covered([i, j]) {
                continue;
            }
            let places = surface.position.corners([i, j]).map(DVec3::truncate);
            let diagonal =
                forced([i, j]).unwrap_or_else(|| Diagonal::choose(places, || chance.next() & 1 == 0));
            faces.extend(diagonal.cut(surface.index.corners([i, j])));
        }
    }
}

/// The columns of the walls of a storey; `offset` is its corner on the lattice of what is below.
fn columns(storey: &Storey, below: &Surface, offset: [u32; 2], roof: &Surface) -> Vec<Column> {
    let column = |point: [u32; 2]| {
        let foot = [offset[0] + point[0], offset[1] + point[1]];
        let (x, y) = (point[0].is_multiple_of(storey.size[0]), point[1].is_multiple_of(storey.size[1]));
        let tangent = match (x, y) {
            (true, true) => DVec3::ZERO,
            (true, false) => DVec3::Y,
            _ => DVec3::X,
        };
        Column {
            foot: (below.index.at(foot), below.position.at(foot)),
            top: (roof.index.at(point), roof.position.at(point)),
            segments: storey.segments(point),
            tangent,
        }
    };
    storey.ring().map(column).collect()
}

/// Moves the vertices as a scanner would.
fn add_noise(city: &CityScan, plan: &BlockPlan, block: &mut Block) {
    let Some((kind, deviation)) = city.noise else { return };
    let normals = if kind == NoiseKind::Normal { normals(city, plan, block) } else { Vec::new() };
    let [x, y] = plan.place;
    for (vertex, position) in block.positions.iter_mut().enumerate() {
        let mut random = Random::at(city.seed, [NOISE, x, y, vertex as u64]);
        *position += deviation
            * match normals.get(vertex) {
                Some(&normal) => normal * random.gaussian(),
                None => DVec3::new(random.gaussian(), random.gaussian(), random.gaussian()),
            };
    }
}

/// Unit normals of the vertices of the block: those of the faces around, weighted by area. On the borders, where faces
/// are the neighbours', that of the ground.
fn normals(city: &CityScan, plan: &BlockPlan, block: &Block) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; block.positions.len()];
    for face in &block.faces {
        // Faces with a ghost are at borders.
        if face.iter().any(|corner| corner & GHOST != 0) {
            continue;
        }
        let [a, b, c] = face.map(|corner| block.positions[corner as usize]);
        let normal = (b - a).cross(c - a);
        face.iter().for_each(|&corner| normals[corner as usize] += normal);
    }
    let [columns, rows] = plan.owned();
    let border = normals.iter_mut().zip(&block.positions).take((columns + rows - 1) as usize);
    for (normal, position) in border {
        *normal = (-ground(city.seed, position.truncate()).slope).extend(1.0);
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}
