//! What is known of components that wait, put on disk where it takes too much memory.
//!
//! In: parts of the candidate graph, as tiles hand them over. Out: the same, put together, when the component is whole.
//! Nothing is looked up in a part before that, so that a component that waits needs no memory but for its seams.

use super::component::Part;
use super::error::StitchError;
use crate::spill::{BlockReader, Extent, SMALLEST_BLOCK, ScratchPlace, SpillError, SpillWriter};
use glam::DVec3;
use std::path::Path;

/// Elements of a block: half a megabyte of candidates.
const BLOCK: usize = 1 << 12;

/// A component as far as it is known: a part in memory, and blocks on the shelf.
#[derive(Debug, Default)]
pub struct Content {
    part: Part,
    shelved: Vec<Extent>,
    /// Bytes of the parts that those hold.
    shelved_bytes: u64,
    /// Candidate vertices, one for each part that names it, and links; on the shelf or not.
    vertices: u64,
    links: u64,
    near: DVec3,
}

impl Content {
    /// Candidate vertices, counted once for each part that names them.
    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    /// Links.
    pub fn links(&self) -> u64 {
        self.links
    }

    /// The position of one of its vertices.
    pub fn near(&self) -> DVec3 {
        self.near
    }

    /// Bytes that it takes now.
    pub fn held_bytes(&self) -> u64 {
        self.part.bytes() + size_of_val(&self.shelved[..]) as u64
    }

    /// Bytes that it takes when all of it is in memory.
    pub fn whole_bytes(&self) -> u64 {
        self.part.bytes() + self.shelved_bytes
    }

    /// Adds another one.
    pub fn append(&mut self, other: Content) {
        self.part.append(other.part);
        self.shelved.extend(other.shelved);
        self.shelved_bytes += other.shelved_bytes;
        self.vertices += other.vertices;
        self.links += other.links;
    }

    /// Whether something of it is on the shelf.
    pub fn is_shelved(&self) -> bool {
        !self.shelved.is_empty()
    }

    /// What of it is in memory.
    pub fn into_part(self) -> Part {
        self.part
    }
}

impl From<Part> for Content {
    fn from(part: Part) -> Content {
        let (vertices, links) = (part.vertices.len() as u64, part.links.len() as u64);
        let near = part.vertices.first().map_or(DVec3::ZERO, |v| v.position);
        Content { part, vertices, links, near, ..Content::default() }
    }
}

/// Where parts lie; the file is made with the first of them.
#[derive(Debug)]
pub struct Shelf {
    scratch: ScratchPlace,
    writer: Option<SpillWriter>,
}

impl Shelf {
    /// An empty one.
    pub fn new(scratch: &ScratchPlace) -> Shelf {
        Shelf { scratch: scratch.clone(), writer: None }
    }

    /// Puts what `content` has in memory on the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn put(&mut self, content: &mut Content) -> Result<(), StitchError> {
        let writer = match &mut self.writer {
            Some(writer) => writer,
            // Blocks are written whole.
            none => none.insert(SpillWriter::create(&self.scratch.dir()?, "open", SMALLEST_BLOCK)),
        };
        let part = std::mem::take(&mut content.part);
        content.shelved_bytes += part.bytes();
        for chunk in part.pieces(BLOCK) {
            let bytes = postcard::to_allocvec(&chunk).map_err(|_| not_encoded(writer.path()))?;
            content.shelved.push(writer.write_block(&bytes)?);
        }
        Ok(())
    }

    /// Everything is on the shelf: now it may be read.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn finish(self) -> Result<ShelfReader, StitchError> {
        let blocks = self.writer.map(|writer| writer.finish()?.blocks()).transpose()?;
        Ok(ShelfReader { blocks })
    }
}

/// Only a type without a length of its own cannot be encoded, and a part is none.
fn not_encoded(path: &Path) -> SpillError {
    SpillError::Corrupt { path: path.to_owned(), offset: 0, reason: "a part of the lines cannot be encoded" }
}

/// Gives back what was put on the shelf.
#[derive(Debug)]
pub struct ShelfReader {
    blocks: Option<BlockReader>,
}

impl ShelfReader {
    /// All of a component.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn take(&self, content: Content) -> Result<Part, StitchError> {
        let mut whole = Part::default();
        self.pieces(content).try_for_each(|piece| piece.map(|piece| whole.append(piece)))?;
        Ok(whole)
    }

    /// The same piece by piece: none has more than some thousand elements. An error ends the iterator.
    pub fn pieces(&self, content: Content) -> impl Iterator<Item = Result<Part, StitchError>> + '_ {
        let Content { part, shelved, .. } = content;
        let shelved =
            shelved.into_iter().filter_map(|extent| self.blocks.as_ref().map(|blocks| read(blocks, extent)));
        part.pieces(BLOCK).into_iter().map(Ok).chain(shelved)
    }
}

fn read(blocks: &BlockReader, extent: Extent) -> Result<Part, StitchError> {
    let mut bytes = Vec::new();
    blocks.read(extent, &mut bytes)?;
    Ok(postcard::from_bytes(&bytes).map_err(|_| SpillError::Corrupt {
        path: blocks.file().path().to_owned(),
        offset: extent.offset,
        reason: "it is no part of a graph",
    })?)
}
