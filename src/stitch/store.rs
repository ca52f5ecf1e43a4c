//! Finished lines, as many as there are, in memory or on disk.
//!
//! In: finished components in any order. Out: their vertices by ascending id, each once, and their lines in canonical order
//! with the places of their vertices in that list. All of it is sorting: vertices by id, lines by kind and ids. Then each
//! place on a line is joined with its vertex: places are sorted by id, run along the vertices, and are sorted back.
//!
//! Memory: each of the four sorts gets a quarter, and no more than four are in use at a time. What does not fit is in
//! temporary files, about 250 bytes for each vertex on a line.

use super::component::{Finished, FinishedLine};
use super::error::StitchError;
use super::fragments::Kind;
use super::group::{PutBlock, Section};
use super::lines::{Measures, length};
use super::set::{Geometry, LineVertex};
use super::source::{Counts, LineSource, Polyline, Stream};
use crate::mesh::VertexId;
use crate::spill::{KeptRun, Merge, Record, ScratchPlace, Sorted, Sorter, blocks_of_records};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Bytes of a block that is handed over to another store, which holds one of every run while it reads: small enough for
/// hundreds of runs, large enough for a disk.
const RUN_BLOCK: usize = 1 << 16;

/// Takes finished components.
#[derive(Debug)]
pub struct LineStore {
    scratch: ScratchPlace,
    memory: u64,
    vertices: Sorter<StoredVertex>,
    lines: Sorter<StoredLine>,
    peak: u64,
}

/// A vertex of one component. It comes once from each kind of line that runs through it; those on creases come first,
/// because only they know where a fitted line runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct StoredVertex {
    vertex: LineVertex,
    off_crease: bool,
}

impl Record for StoredVertex {
    fn order(&self, other: &Self) -> Ordering {
        (self.vertex.id.cmp(&other.vertex.id)).then(self.off_crease.cmp(&other.off_crease))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct StoredLine {
    kind: Kind,
    ids: Vec<VertexId>,
    measures: Measures,
}

impl Record for StoredLine {
    fn order(&self, other: &Self) -> Ordering {
        self.kind.cmp(&other.kind).then_with(|| self.ids.cmp(&other.ids))
    }

    fn heap(&self) -> usize {
        size_of_val(&self.ids[..])
    }
}

/// Where a line runs through a vertex, on the way to that vertex. Places count from the first line on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
struct Visit {
    id: VertexId,
    place: u64,
}

impl Record for Visit {
    fn order(&self, other: &Self) -> Ordering {
        self.cmp(other)
    }
}

/// The same on the way back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Place {
    place: u64,
    /// Of the vertex in the list of all.
    rank: u64,
    position: DVec3,
    fitted: DVec3,
}

impl Record for Place {
    fn order(&self, other: &Self) -> Ordering {
        self.place.cmp(&other.place)
    }
}

impl LineStore {
    /// An empty store that uses about `memory` bytes, and `scratch` for what does not fit.
    pub fn new(memory: u64, scratch: &ScratchPlace) -> LineStore {
        LineStore {
            scratch: scratch.clone(),
            memory,
            vertices: Sorter::new("vertices", memory / 4, scratch),
            lines: Sorter::new("lines", memory / 4, scratch),
            peak: 0,
        }
    }

    /// Takes finished components.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    pub fn put(&mut self, finished: Finished) -> Result<(), StitchError> {
        for (vertex, on_crease) in finished.vertices {
            self.vertices.push(StoredVertex { vertex, off_crease: !on_crease })?;
        }
        for FinishedLine { ids, measures } in finished.lines {
            self.lines.push(StoredLine { kind: measures.kind(), ids, measures })?;
        }
        self.peak = self.peak.max(self.bytes());
        Ok(())
    }

    /// Takes finished components that another store has put in order, and that lie where `vertices` and `lines` are.
    pub fn adopt(&mut self, vertices: KeptRun, lines: KeptRun) {
        self.vertices.adopt(vertices);
        self.lines.adopt(lines);
    }

    /// Bytes that are held.
    pub fn bytes(&self) -> u64 {
        self.vertices.bytes() + self.lines.bytes()
    }

    /// Puts vertices and lines in order, for a store that joins them with others: hands over blocks of both, for
    /// [`LineStore::adopt`]. Returns the most bytes that were held.
    ///
    /// # Errors
    /// If a temporary file cannot be written or read, or `put` refuses.
    pub fn hand_over<E: From<StitchError>>(self, put: PutBlock<'_, E>) -> Result<u64, E> {
        let held = self.peak.max(self.bytes());
        let vertices = self.vertices.finish().map_err(StitchError::from)?;
        let all = once(vertices.iter().map_err(StitchError::from)?).map(|vertex| Ok(vertex?));
        blocks_of_records(all, RUN_BLOCK, |bytes| put(Section::Vertices, bytes))?;
        drop(vertices);
        let lines = self.lines.finish().map_err(StitchError::from)?;
        let all = lines.iter().map_err(StitchError::from)?;
        let all = all.map(|line| Ok(line.map_err(StitchError::from)?));
        blocks_of_records(all, RUN_BLOCK, |bytes| put(Section::Lines, bytes))?;
        Ok(held)
    }

    /// Puts everything in order. `largest_salience` is that of the mesh.
    ///
    /// # Errors
    /// If a temporary file cannot be written or read.
    pub fn finish(self, largest_salience: f64) -> Result<StoredLines, StitchError> {
        let LineStore { scratch, memory, vertices, lines, mut peak } = self;
        let (vertices, lines) = (vertices.finish()?, lines.finish()?);
        let held = vertices.bytes() + lines.bytes();
        let mut counts = Counts::default();

        let mut visits = Sorter::new("visits", memory / 4, &scratch);
        let mut place = 0;
        for line in lines.iter()? {
            let line = line?;
            counts.lines += 1;
            counts.edges += line.ids.len() as u64 - 1;
            for id in line.ids {
                visits.push(Visit { id, place })?;
                place += 1;
            }
        }
        let visits = visits.finish()?;

        let mut places = Sorter::new("places", memory / 4, &scratch);
        let mut visits_left = visits.iter()?.peekable();
        for vertex in unique(vertices.iter()?) {
            let LineVertex { id, position, fitted, corner, .. } = vertex?;
            while let Some(visit) = visits_left.next_if(|v| v.as_ref().map_or(true, |v| v.id == id)) {
                places.push(Place { place: visit?.place, rank: counts.vertices, position, fitted })?;
            }
            counts.vertices += 1;
            counts.corners += u64::from(corner);
            counts.largest_id = Some(id);
        }
        debug_assert!(visits_left.next().is_none(), "a line runs through a vertex that is not there");
        peak = peak.max(held + visits.bytes() + places.bytes());
        let places = places.finish()?;
        let geometry = Geometry::Vertices;
        Ok(StoredLines { vertices, lines, places, counts, largest_salience, geometry, peak })
    }
}

/// Each vertex once: as creases know it, if one runs through it.
fn once(vertices: Merge<'_, StoredVertex>) -> impl Iterator<Item = Result<StoredVertex, StitchError>> {
    let mut last = None;
    vertices.filter_map(move |stored| match stored {
        Ok(stored) => (last.replace(stored.vertex.id) != Some(stored.vertex.id)).then_some(Ok(stored)),
        Err(error) => Some(Err(error.into())),
    })
}

/// The same without what only sorting asks for.
fn unique(vertices: Merge<'_, StoredVertex>) -> impl Iterator<Item = Result<LineVertex, StitchError>> {
    once(vertices).map(|stored| stored.map(|stored| stored.vertex))
}

/// Lines in canonical order, to be read as often as one likes. Temporary files go with it.
#[derive(Debug)]
pub struct StoredLines {
    vertices: Sorted<StoredVertex>,
    lines: Sorted<StoredLine>,
    places: Sorted<Place>,
    counts: Counts,
    largest_salience: f64,
    geometry: Geometry,
    peak: u64,
}

impl StoredLines {
    /// The same lines, with the points and lengths of `geometry`.
    pub fn with_geometry(self, geometry: Geometry) -> StoredLines {
        StoredLines { geometry, ..self }
    }

    /// Bytes that are held, and that reading takes.
    pub fn bytes(&self) -> u64 {
        self.vertices.bytes() + self.lines.bytes() + self.places.bytes()
    }

    /// The most bytes that were held on the way here.
    pub fn peak_bytes(&self) -> u64 {
        self.peak.max(self.bytes())
    }

    /// Whether temporary files were needed.
    pub fn spilled(&self) -> bool {
        self.vertices.spilled() || self.lines.spilled() || self.places.spilled()
    }

    /// What is said of a line, its strength divided.
    fn with_strength(&self, line: &StoredLine) -> Measures {
        let mut measures = line.measures;
        if line.kind == Kind::Crease {
            measures.strength /= self.largest_salience.max(f64::MIN_POSITIVE);
        }
        measures
    }

    /// A stored line with what is known at the end only.
    fn polyline(&self, line: StoredLine, places: &[Place]) -> Polyline {
        let point = |place: &Place| match self.geometry {
            Geometry::Vertices => place.position,
            Geometry::Fitted => place.fitted,
        };
        let points: Vec<DVec3> = places.iter().map(point).collect();
        let mut measures = self.with_strength(&line);
        if self.geometry == Geometry::Fitted {
            measures.length = length(points.iter().copied());
        }
        Polyline { vertices: places.iter().map(|place| place.rank).collect(), points, measures }
    }
}

/// What cannot be opened is an iterator of one error.
fn opened<'a, T: 'a>(
    stream: Result<impl Iterator<Item = Result<T, StitchError>> + 'a, StitchError>,
) -> Stream<'a, T> {
    match stream {
        Ok(stream) => Box::new(stream),
        Err(error) => Box::new(std::iter::once(Err(error))),
    }
}

impl LineSource for StoredLines {
    fn geometry(&self) -> Geometry {
        self.geometry
    }

    fn largest_salience(&self) -> f64 {
        self.largest_salience
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn vertices(&self) -> Stream<'_, LineVertex> {
        opened(self.vertices.iter().map(unique).map_err(StitchError::from))
    }

    fn lines(&self) -> Stream<'_, Polyline> {
        let stream = || {
            let mut places = self.places.iter()?;
            let line = move |line: Result<StoredLine, _>| {
                let line: StoredLine = line?;
                let places = places.by_ref().take(line.ids.len()).collect::<Result<Vec<_>, _>>()?;
                Ok(self.polyline(line, &places))
            };
            Ok(self.lines.iter()?.map(line))
        };
        opened(stream())
    }

    fn measures(&self) -> Stream<'_, (Measures, u64)> {
        let measures = |line: Polyline| (line.measures, line.vertices.len() as u64 - 1);
        match self.geometry {
            // Only places know how long a fitted line is.
            Geometry::Fitted => Box::new(self.lines().map(move |line| line.map(measures))),
            Geometry::Vertices => opened(self.lines.iter().map_err(StitchError::from).map(|lines| {
                lines.map(|line| {
                    let line = line?;
                    Ok((self.with_strength(&line), line.ids.len() as u64 - 1))
                })
            })),
        }
    }
}
