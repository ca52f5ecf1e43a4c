//! The open components of all tiles that have come in, until each is whole.
//!
//! In: open parts, and word that a tile has handed over all it has. Out: components, as soon as the criterion of
//! [`super::close`] holds for them. What is held is what the seams between finished and unfinished tiles cut, wherever in
//! the mesh the tiles are; it does not grow with the mesh behind them. Which components come out, and when they come, does
//! depend on the order of the tiles; what is in them does not.
//!
//! A network of lines that runs through the whole mesh grows all the same: what is known of such components goes to the
//! disk, and they are finished when no tile is in memory any more.

use super::close::OpenPart;
use super::error::StitchError;
use super::fragments::{Kind, Seam};
use super::shelf::{Content, Shelf, ShelfReader};
use crate::mesh::{TileId, VertexId};
use crate::spill::ScratchPlace;
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
    shelf: Shelf,
    /// Whole ones that take too much memory to be finished now.
    aside: Vec<Content>,
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
    /// Bytes that they take in memory.
    pub bytes: u64,
}

/// A component as far as it is known.
#[derive(Debug)]
struct Component {
    kind: Kind,
    content: Content,
    /// Vertices that other tiles may name, each once for every tile that may.
    seams: Vec<(VertexId, TileId)>,
    /// Tiles that own something near them and have not handed over everything.
    awaits: BTreeSet<TileId>,
}

/// What waits for tiles that are not done.
#[derive(Debug)]
pub struct Waiting {
    /// Of which graph.
    pub kind: Kind,
    /// All that is known of it.
    pub content: Content,
    /// Those of its vertices that tiles may name that are not done, with these tiles; at least one.
    pub seams: Vec<Seam>,
}

/// A seam vertex with a tile in two maps, and a tile that is waited for in two more: what they take, rounded up.
const SEAM_BYTES: u64 = 80;
const AWAITED_BYTES: u64 = 64;
/// What a component takes by itself.
const COMPONENT_BYTES: u64 = 256;
/// How much more memory finishing a component takes than the component: its graph, the search along it, the equations
/// of its lines, and the lines.
pub(super) const FINISHING: u64 = 6;

impl Component {
    fn bytes(&self) -> u64 {
        let seams = SEAM_BYTES * self.seams.len() as u64 + AWAITED_BYTES * self.awaits.len() as u64;
        COMPONENT_BYTES + self.content.held_bytes() + seams
    }
}

impl Component {
    /// What is left of it to tiles that are not `done`.
    fn waiting(self, done: &BTreeSet<TileId>) -> Waiting {
        let Component { kind, content, mut seams, .. } = self;
        seams.retain(|(_, tile)| !done.contains(tile));
        let same = seams.chunk_by(|a, b| a.0 == b.0);
        let seams = same
            .map(|pairs| Seam { vertex: pairs[0].0, tiles: pairs.iter().map(|pair| pair.1).collect() })
            .collect();
        Waiting { kind, content, seams }
    }
}

impl Held {
    fn of(component: &Component) -> Held {
        Held {
            components: 1,
            vertices: component.content.vertices(),
            links: component.content.links(),
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
    /// Nothing yet; all of it together may take `memory` bytes. What is more goes to `scratch`.
    pub fn new(memory: u64, scratch: &ScratchPlace) -> OpenComponents {
        OpenComponents {
            components: BTreeMap::new(),
            at: HashMap::new(),
            waiting: BTreeMap::new(),
            done: BTreeSet::new(),
            next: 0,
            memory,
            shelf: Shelf::new(scratch),
            aside: Vec::new(),
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
    /// If a temporary file cannot be written, or the seams alone take more than the memory.
    pub fn add(&mut self, open: OpenPart) -> Result<Option<Content>, StitchError> {
        let OpenPart { kind, part, seams } = open;
        let touched: BTreeSet<u64> =
            seams.iter().filter_map(|seam| self.at.get(&(kind, seam.vertex)).copied()).collect();
        let pairs = seams.iter().flat_map(|seam| seam.tiles.iter().map(|&tile| (seam.vertex, tile)));
        // A vertex that only tiles may name that are done is named by nobody any more.
        let seams: Vec<(VertexId, TileId)> = pairs.filter(|(_, tile)| !self.done.contains(tile)).collect();
        let awaits = seams.iter().map(|(_, tile)| *tile).collect();
        let mut joined = Component { kind, content: part.into(), seams, awaits };
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
            large.content.append(small.content);
            large.seams.extend(small.seams);
            large.awaits.extend(small.awaits);
            joined = large;
        }
        self.put(number, joined)
    }

    /// `tile` has handed over everything. Returns what is whole now.
    pub fn done(&mut self, tile: TileId) -> Vec<Content> {
        self.done.insert(tile);
        let mut whole = Vec::new();
        for number in self.waiting.remove(&tile).unwrap_or_default() {
            if let Some(component) = self.components.get_mut(&number) {
                component.awaits.remove(&tile);
                self.held.bytes -= AWAITED_BYTES;
                if component.awaits.is_empty() {
                    whole.extend(self.take(number).map(|component| component.content));
                }
            }
        }
        whole
    }

    /// Keeps a whole component until the end.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    pub fn put_aside(&mut self, mut content: Content) -> Result<(), StitchError> {
        self.shelf.put(&mut content)?;
        self.aside.push(content);
        Ok(())
    }

    /// Everything that is still there: what is whole and was put aside, what waits for tiles that are not done, and where to
    /// read it.
    ///
    /// # Errors
    /// If a temporary file cannot be read.
    pub fn rest(self) -> Result<(Vec<Content>, Vec<Waiting>, ShelfReader), StitchError> {
        let OpenComponents { components, done, aside, shelf, .. } = self;
        let waiting = components.into_values().map(|component| component.waiting(&done)).collect();
        Ok((aside, waiting, shelf.finish()?))
    }

    fn put(&mut self, number: u64, mut component: Component) -> Result<Option<Content>, StitchError> {
        if component.awaits.is_empty() {
            return Ok(Some(component.content));
        }
        component.seams.sort_unstable();
        component.seams.dedup();
        component.seams.iter().for_each(|&(v, _)| _ = self.at.insert((component.kind, v), number));
        for &tile in &component.awaits {
            self.waiting.entry(tile).or_default().insert(number);
        }
        self.held = self.held.combine(Held::of(&component), |a, b| a + b);
        self.components.insert(number, component);
        self.peak = self.peak.combine(self.held, u64::max);
        if self.held.bytes > self.memory {
            self.shelve(number)?;
        }
        Ok(None)
    }

    /// Puts the largest components on the shelf, until half of the memory is free: not every one that comes then finds it
    /// full again. `last` is the component that was too much.
    fn shelve(&mut self, last: u64) -> Result<(), StitchError> {
        let size = |(&number, component): (&u64, &Component)| (component.content.held_bytes(), number);
        let mut by_size: Vec<(u64, u64)> = self.components.iter().map(size).collect();
        by_size.sort_unstable();
        while self.held.bytes > self.memory / 2
            && let Some((_, number)) = by_size.pop()
        {
            if let Some(component) = self.components.get_mut(&number) {
                self.held.bytes -= component.bytes();
                self.shelf.put(&mut component.content)?;
                self.held.bytes += component.bytes();
            }
        }
        match self.components.get(&last) {
            Some(component) if self.held.bytes > self.memory => {
                Err(too_large(&component.content, self.held.bytes, self.memory))
            }
            _ => Ok(()),
        }
    }

    fn take(&mut self, number: u64) -> Option<Component> {
        let component = self.components.remove(&number)?;
        component.seams.iter().for_each(|&(v, _)| _ = self.at.remove(&(component.kind, v)));
        for tile in &component.awaits {
            if let Some(waiting) = self.waiting.get_mut(tile) {
                waiting.remove(&number);
            }
        }
        self.held = self.held.combine(Held::of(&component), |a, b| a - b);
        Some(component)
    }
}

pub(super) fn too_large(content: &Content, needed: u64, memory: u64) -> StitchError {
    StitchError::TooLarge { vertices: content.vertices(), near: content.near().to_array(), needed, memory }
}
