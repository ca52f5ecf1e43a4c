//! The open components of all tiles that have come in, until each is whole.
//!
//! In: open parts, and word that a tile has handed over all it has. Out: components, as soon as the criterion of
//! [`super::close`] holds for them. What is held is what the seams between finished and unfinished tiles cut, wherever in
//! the mesh the tiles are; it does not grow with the mesh behind them. Which components come out, and when they come, does
//! depend on the order of the tiles; what is in them does not.

use super::close::OpenPart;
use super::component::Part;
use super::error::StitchError;
use super::fragments::Kind;
use crate::mesh::{TileId, VertexId};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Components that wait for tiles.
#[derive(Debug)]
pub struct OpenComponents {
    components: BTreeMap<u64, Component>,
    /// The component at each vertex of a seam.
    at: HashMap<(Kind, VertexId), u64>,
    /// The components that wait for each tile.
    waiting: BTreeMap<TileId, BTreeSet<u64>>,
    /// Tiles that have handed over everything.
    done: BTreeSet<TileId>,
    /// Number of the next component.
    next: u64,
    memory: u64,
    /// Now.
    held: Held,
    /// At most, each on its own.
    peak: Held,
}

/// How much is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Components.
    pub components: u64,
    /// Candidate vertices.
    pub vertices: u64,
    /// Links.
    pub links: u64,
    /// Bytes that they take.
    pub bytes: u64,
}

/// A component as far as it is known.
#[derive(Debug)]
struct Component {
    kind: Kind,
    part: Part,
    /// Vertices that other tiles may name.
    seams: Vec<VertexId>,
    /// Tiles that own something near them and have not handed over everything.
    awaits: BTreeSet<TileId>,
}

/// A seam vertex in two maps, and a tile that is waited for in two more: what they take, rounded up.
const SEAM_BYTES: u64 = 64;
const AWAITED_BYTES: u64 = 64;
/// What a component takes by itself.
const COMPONENT_BYTES: u64 = 256;
/// How much more memory finishing a component takes than the component: its graph, the search along it, the equations
/// of its lines, and the lines.
const FINISHING: u64 = 6;

impl Component {
    fn bytes(&self) -> u64 {
        let seams = SEAM_BYTES * self.seams.len() as u64 + AWAITED_BYTES * self.awaits.len() as u64;
        COMPONENT_BYTES + self.part.bytes() + seams
    }
}

impl Held {
    fn of(component: &Component) -> Held {
        Held {
            components: 1,
            vertices: component.part.vertices.len() as u64,
            links: component.part.links.len() as u64,
            bytes: component.bytes(),
        }
    }

    fn combine(self, other: Held, f: impl Fn(u64, u64) -> u64) -> Held {
        Held {
            components: f(self.components, other.components),
            vertices: f(self.vertices, other.vertices),
            links: f(self.links, other.links),
            bytes: f(self.bytes, other.bytes),
        }
    }
}

impl OpenComponents {
    /// Nothing yet; all of it together may take `memory` bytes.
    pub fn new(memory: u64) -> OpenComponents {
        OpenComponents {
            components: BTreeMap::new(),
            at: HashMap::new(),
            waiting: BTreeMap::new(),
            done: BTreeSet::new(),
            next: 0,
            memory,
            held: Held::default(),
            peak: Held::default(),
        }
    }

    /// How much is open now.
    pub fn held(&self) -> Held {
        self.held
    }

    /// The most that was open.
    pub fn peak(&self) -> Held {
        self.peak
    }

    /// Takes an open part of a tile and joins it with the components that it shares vertices with. Returns it if it waits
    /// for nothing any more: then it shares none, because what it shared them with would wait for this tile.
    ///
    /// # Errors
    /// If that takes more than the memory.
    pub fn add(&mut self, open: OpenPart) -> Result<Option<Part>, StitchError> {
        let OpenPart { kind, part, seams } = open;
        let awaits = seams.iter().flat_map(|seam| &seam.tiles).copied().filter(|t| !self.done.contains(t));
        let awaits = awaits.collect();
        let seams: Vec<VertexId> = seams.iter().map(|seam| seam.vertex).collect();
        let touched: BTreeSet<u64> = seams.iter().filter_map(|&v| self.at.get(&(kind, v)).copied()).collect();
        let mut joined = Component { kind, part, seams, awaits };
        let mut number = self.next;
        self.next += 1;
        for other in touched {
            let Some(component) = self.take(other) else { continue };
            // The smaller one moves.
            let (mut large, small) = match component.seams.len() > joined.seams.len() {
                true => {
                    number = other;
                    (component, joined)
                }
                false => (joined, component),
            };
            large.part.append(small.part);
            large.seams.extend(small.seams);
            large.awaits.extend(small.awaits);
            joined = large;
        }
        self.put(number, joined)
    }

    /// `tile` has handed over everything. Returns what is whole now.
    pub fn done(&mut self, tile: TileId) -> Vec<Part> {
        self.done.insert(tile);
        let mut whole = Vec::new();
        for number in self.waiting.remove(&tile).unwrap_or_default() {
            if let Some(component) = self.components.get_mut(&number) {
                component.awaits.remove(&tile);
                self.held.bytes -= AWAITED_BYTES;
                if component.awaits.is_empty() {
                    whole.extend(self.take(number).map(|component| component.part));
                }
            }
        }
        whole
    }

    /// Everything that is still there, whole or not.
    pub fn rest(&mut self) -> Vec<Part> {
        let numbers: Vec<u64> = self.components.keys().copied().collect();
        numbers.into_iter().filter_map(|number| self.take(number)).map(|component| component.part).collect()
    }

    fn put(&mut self, number: u64, mut component: Component) -> Result<Option<Part>, StitchError> {
        if component.awaits.is_empty() {
            return Ok(Some(component.part));
        }
        component.seams.sort_unstable();
        component.seams.dedup();
        component.seams.iter().for_each(|&v| _ = self.at.insert((component.kind, v), number));
        for &tile in &component.awaits {
            self.waiting.entry(tile).or_default().insert(number);
        }
        self.held = self.held.combine(Held::of(&component), |a, b| a + b);
        self.peak = self.peak.combine(self.held, u64::max);
        let needed = self.held.bytes.saturating_add(FINISHING.saturating_mul(component.part.bytes()));
        if needed > self.memory {
            return Err(too_large(&component, needed, self.memory));
        }
        self.components.insert(number, component);
        Ok(None)
    }

    fn take(&mut self, number: u64) -> Option<Component> {
        let component = self.components.remove(&number)?;
        component.seams.iter().for_each(|&v| _ = self.at.remove(&(component.kind, v)));
        for tile in &component.awaits {
            if let Some(waiting) = self.waiting.get_mut(tile) {
                waiting.remove(&number);
            }
        }
        self.held = self.held.combine(Held::of(&component), |a, b| a - b);
        Some(component)
    }
}

fn too_large(component: &Component, needed: u64, memory: u64) -> StitchError {
    let near = component.part.vertices.first().map_or(DVec3::ZERO, |v| v.position).to_array();
    StitchError::TooLarge { vertices: component.part.vertices.len() as u64, near, needed, memory }
}
