//! Vertices that are near each other as one.
//!
//! In: the vertices of all files, a distance. Out: for each the vertex that stays in its place.
//!
//! The rule: vertices are taken in the order of their distance along a fixed direction; among equal ones, by coordinates. A
//! vertex that lies within the distance of one that stays becomes that one: the nearest, among equally near ones the
//! earlier. Any other stays. So no vertex moves farther than the distance, those that stay are farther from each other
//! than that, chains of near vertices do not grow together, and all of it is a question of positions: the order of files
//! and vertices has no part in it.
//!
//! The direction is askew to all that people build, so that few vertices lie as far along it as the one that is looked at:
//! only they are in memory.

use super::gather::Gathered;
use super::weld::{Member, SORT_SHARE};
use crate::input::InputError;
use crate::spill::{Record, ScratchPlace, Sorted, Sorter};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::{HashMap, VecDeque};

/// Of unit length: with r^3 = r + 1, the powers -1, -2 and -4 of r. No small multiples of them add up to 0.
const DIRECTION: [f64; 3] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2, 0.324_717_957_244_746];
/// What rounding may do to a distance along the direction, in sizes of coordinates.
const ROUNDING: f64 = 1e-14;
/// Bytes for a vertex in the window: the vertex, its part of a list, its part of the table.
const VERTEX_BYTES: u64 = 160;

/// A vertex by how far along it lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Along {
    distance: f64,
    position: [f64; 3],
    id: u64,
}

impl Record for Along {
    fn order(&self, other: &Self) -> Ordering {
        let by_position = || {
            let axes = self.position.iter().zip(&other.position);
            axes.map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
        };
        self.distance.total_cmp(&other.distance).then_with(by_position).then_with(|| self.id.cmp(&other.id))
    }
}

/// Finds them, within `memory` bytes.
pub fn members(
    gathered: &Gathered,
    distance: f64,
    scratch: &ScratchPlace,
    memory: u64,
) -> Result<Sorted<Member>, InputError> {
    let mut along = Sorter::new("along", memory / SORT_SHARE, scratch);
    let (mut id, mut size) = (0, 0.0f64);
    gathered.for_each_vertex(|position| {
        let position = position.map(|x| x + 0.0);
        let [x, y, z] = [0, 1, 2].map(|axis| position[axis] * DIRECTION[axis]);
        size = size.max(position.iter().map(|x| x.abs()).fold(0.0, f64::max));
        along.push(Along { distance: (x + y) + z, position, id })?;
        id += 1;
        Ok(())
    })?;
    let along = along.finish()?;
    let mut members = Sorter::new("members", memory / SORT_SHARE, scratch);
    let mut window = Window {
        distance,
        width: distance + ROUNDING * size,
        most: memory / SORT_SHARE / VERTEX_BYTES,
        kept: VecDeque::new(),
        first: 0,
        cells: HashMap::new(),
    };
    let mut last: Option<(Along, u64)> = None;
    for vertex in along.iter()? {
        let vertex = vertex?;
        let kept = match last {
            Some((before, kept)) if before.position == vertex.position => kept,
            _ => window.take(vertex).ok_or_else(|| crowded(gathered, distance, vertex.position))?,
        };
        last = Some((vertex, kept));
        members.push(Member { kept, id: vertex.id })?;
    }
    Ok(members.finish()?)
}

fn crowded(gathered: &Gathered, distance: f64, [x, y, z]: [f64; 3]) -> InputError {
    let path = gathered.parts.first().map(|part| part.path.clone()).unwrap_or_default();
    let reason = format!(
        "too many vertices near ({x}, {y}, {z}) must be compared to weld within {distance}; weld within less, or allow more with --memory"
    );
    InputError::Format { path, reason }
}

/// Vertices that stay and may still be near one that comes.
struct Window {
    distance: f64,
    /// So far back they are kept.
    width: f64,
    /// Vertices that there is memory for.
    most: u64,
    kept: VecDeque<Along>,
    /// How many have left.
    first: usize,
    /// Which of them lie in a cube with the edge `distance`.
    cells: HashMap<[u64; 3], Vec<usize>>,
}

impl Window {
    /// The vertex that stays in the place of this one; `None` if there are too many.
    fn take(&mut self, vertex: Along) -> Option<u64> {
        while let Some(oldest) = self.kept.front()
            && vertex.distance - oldest.distance > self.width
        {
            let cell = key(self.cell(oldest.position));
            if let Some(list) = self.cells.get_mut(&cell) {
                list.retain(|index| *index != self.first);
                if list.is_empty() {
                    self.cells.remove(&cell);
                }
            }
            self.kept.pop_front();
            self.first += 1;
        }
        if let Some(near) = self.nearest(&vertex) {
            return Some(near);
        }
        if self.kept.len() as u64 >= self.most {
            return None;
        }
        let index = self.first + self.kept.len();
        self.cells.entry(key(self.cell(vertex.position))).or_default().push(index);
        self.kept.push_back(vertex);
        Some(vertex.id)
    }

    fn nearest(&self, vertex: &Along) -> Option<u64> {
        let middle = self.cell(vertex.position);
        let mut best: Option<(f64, usize)> = None;
        for code in 0..27 {
            let step = [code % 3, code / 3 % 3, code / 9].map(|step| f64::from(step - 1));
            let cell = [0, 1, 2].map(|axis| middle[axis] + step[axis]);
            for &index in self.cells.get(&key(cell)).into_iter().flatten() {
                let other = &self.kept[index - self.first];
                let [x, y, z] = [0, 1, 2].map(|axis| other.position[axis] - vertex.position[axis]);
                let square = x * x + y * y + z * z;
                let near = square <= self.distance * self.distance;
                if near && best.is_none_or(|(least, first)| (square, index) < (least, first)) {
                    best = Some((square, index));
                }
            }
        }
        best.map(|(_, index)| self.kept[index - self.first].id)
    }

    fn cell(&self, position: [f64; 3]) -> [f64; 3] {
        position.map(|x| (x / self.distance).floor())
    }
}

fn key(cell: [f64; 3]) -> [u64; 3] {
    cell.map(|x| (x + 0.0).to_bits())
}
