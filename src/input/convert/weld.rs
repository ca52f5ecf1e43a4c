//! Which vertices are one, and how they are numbered then.
//!
//! In: the vertices of all files. Out: for each of them, in order, the number of the vertex that it becomes. Vertices are
//! sorted by position to find those that are one, then by the place of the one that stays, which numbers them, and back;
//! all of it on disk where it does not fit. Vertices that stay keep their order, and nothing depends on the memory.

use super::gather::Gathered;
use super::near;
use crate::input::InputError;
use crate::spill::{Record, ScratchPlace, Sorted, Sorter};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Which vertices become one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weld {
    /// None: faces that share no vertex are no neighbours.
    None,
    /// Those with equal coordinates; 0 and -0 are equal.
    Exact,
    /// Those that are not farther from each other than that, by the rule of the module `near`.
    Within(f64),
}

/// A vertex, and the one that stays in its place, both by their places among all vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Member {
    pub kept: u64,
    pub id: u64,
}

impl Record for Member {
    fn order(&self, other: &Self) -> Ordering {
        (self.kept, self.id).cmp(&(other.kept, other.id))
    }
}

/// A vertex and its new number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Renamed {
    /// Its place among all vertices.
    pub id: u64,
    /// Its place among those that stay.
    pub new: u64,
    /// Whether it is one of those.
    pub stays: bool,
}

impl Record for Renamed {
    fn order(&self, other: &Self) -> Ordering {
        self.id.cmp(&other.id)
    }
}

/// All vertices by their places, with their new numbers.
pub struct Renumbered {
    /// In the order of the files.
    pub names: Sorted<Renamed>,
    /// How many stay.
    pub vertices: u64,
}

/// A vertex by its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct At {
    position: [u64; 3],
    id: u64,
}

impl Record for At {
    fn order(&self, other: &Self) -> Ordering {
        (self.position, self.id).cmp(&(other.position, other.id))
    }
}

/// Share of the memory for each of the two sorts that are there at a time.
pub(super) const SORT_SHARE: u64 = 3;

/// Finds out which vertices are one, within `memory` bytes.
pub fn weld(
    gathered: &Gathered,
    rule: Weld,
    scratch: &ScratchPlace,
    memory: u64,
) -> Result<Renumbered, InputError> {
    let members = match rule {
        Weld::Within(distance) if distance > 0.0 => near::members(gathered, distance, scratch, memory)?,
        _ => equal(gathered, scratch, memory)?,
    };
    let mut names = Sorter::new("names", memory / SORT_SHARE, scratch);
    let (mut vertices, mut last) = (0, None);
    for member in members.iter()? {
        let Member { kept, id } = member?;
        vertices += u64::from(last != Some(kept));
        last = Some(kept);
        names.push(Renamed { id, new: vertices - 1, stays: id == kept })?;
    }
    drop(members);
    Ok(Renumbered { names: names.finish()?, vertices })
}

/// The first vertex at each position stays.
fn equal(gathered: &Gathered, scratch: &ScratchPlace, memory: u64) -> Result<Sorted<Member>, InputError> {
    let mut places = Sorter::new("places", memory / SORT_SHARE, scratch);
    let mut id = 0;
    gathered.for_each_vertex(|position| {
        // Adding 0 makes 0 of -0 and changes nothing else.
        places.push(At { position: position.map(|x| (x + 0.0).to_bits()), id })?;
        id += 1;
        Ok(())
    })?;
    let places = places.finish()?;
    let mut members = Sorter::new("members", memory / SORT_SHARE, scratch);
    let mut first: Option<At> = None;
    for at in places.iter()? {
        let at = at?;
        let kept = match first {
            Some(first) if first.position == at.position => first.id,
            _ => first.insert(at).id,
        };
        members.push(Member { kept, id: at.id })?;
    }
    Ok(members.finish()?)
}
