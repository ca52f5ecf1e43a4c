//! Whether tiles are loaded from the file as it is, or from a copy in spatial order.
//!
//! In: the source, before and after its scan. Out: the source that tiles are loaded from, and the plan over its blocks. What
//! comes out of the run does not depend on any of it.

use super::events::{Event, Observer, Stage};
use crate::config::{Limits, Order, Tiling};
use crate::error::Error;
use crate::input::MeshSource;
use crate::partition::{
    Joined, Locality, Plan, Scan, SpatialStore, join, least_memory, sort, temporary_bytes, vertex_reads,
};
use crate::spill::{ScratchDir, ScratchPlace, check_room, is_in_memory};
use rayon::ThreadPool;

/// Where a job may keep temporary files, and how much memory it may use to sort them.
#[derive(Clone, Debug)]
pub(super) struct Room {
    pub scratch: ScratchPlace,
    /// Begin even if the disk seems too small.
    pub force: bool,
    /// Memory for sorting, in bytes.
    pub memory: u64,
}

/// Memory for sorting if nothing is said: a small part of what the tiles take, and enough for 10^9 faces.
pub(super) const ORDER_MEMORY: u64 = 256 << 20;

/// What tiles are loaded from.
pub(super) enum Mesh<'a> {
    /// The file as it is.
    File(&'a dyn MeshSource),
    /// Its blocks with positions.
    Joined(Joined<'a>),
    /// Other blocks, in spatial order.
    Sorted(SpatialStore<'a>),
}

impl Mesh<'_> {
    pub fn source(&self) -> &dyn MeshSource {
        match self {
            Mesh::File(source) => *source,
            Mesh::Joined(joined) => joined,
            Mesh::Sorted(store) => store,
        }
    }
}

/// Decides what to rewrite, and does it.
pub(super) struct Rewriter<'a, 'j> {
    pub source: &'a dyn MeshSource,
    pub limits: &'j Limits,
    pub room: &'j Room,
    pub pool: &'j ThreadPool,
    pub observer: &'j dyn Observer,
}

/// What is known of the order, and the temporary files once there are some.
pub(super) struct Rewrite {
    /// See [`vertex_reads`]; 0 if nobody asked.
    vertex_reads: f64,
    /// Whether corners have to meet their positions by sorting.
    joins: bool,
    scratch: Option<ScratchDir>,
}

impl Rewrite {
    /// The most bytes that were on the disk at a time.
    pub fn peak_bytes(&self) -> u64 {
        self.scratch.as_ref().map_or(0, ScratchDir::peak_bytes)
    }

    /// Whether [`Rewriter::join`] has something to do.
    pub fn joins(&self) -> bool {
        self.joins
    }
}

impl<'a> Rewriter<'a, '_> {
    /// Looks at the order of the vertices: if they are scattered and do not fit into memory, even the scan would have to
    /// read at random.
    pub fn look(&self) -> Result<Rewrite, Error> {
        let idle = Rewrite { vertex_reads: 0.0, joins: false, scratch: None };
        if self.limits.order == Order::Keep || self.limits.tiling == Tiling::InCore {
            return Ok(idle);
        }
        let vertex_reads = vertex_reads(self.source)?;
        let vertices = self.source.vertex_count().saturating_mul(3 * self.source.coordinate_bytes() as u64);
        let joins = Locality::is_scattered(vertex_reads) && vertices > self.memory();
        Ok(Rewrite { vertex_reads, joins, ..idle })
    }

    /// The blocks of the file with positions.
    pub fn join(&self, rewrite: &mut Rewrite) -> Result<Joined<'a>, Error> {
        let scratch = self.scratch(rewrite)?;
        let progress = self.begin();
        Ok(self.pool.install(|| join(self.source, &scratch, self.memory(), &progress))?)
    }

    /// Whether tiles should be loaded from a copy in spatial order.
    pub fn sorts(&self, rewrite: &Rewrite, scan: &Scan, plan: &Plan) -> bool {
        let locality = Locality::new(plan, scan, rewrite.vertex_reads);
        match self.limits.order {
            _ if plan.cells.len() == 1 => false,
            Order::Keep => false,
            Order::Rewrite => true,
            Order::Auto => locality.rewriting_pays(),
        }
    }

    /// The copy in spatial order. `joined` is used up.
    pub fn sort(
        &self,
        rewrite: &mut Rewrite,
        joined: Option<Joined<'a>>,
        scan: &Scan,
    ) -> Result<SpatialStore<'a>, Error> {
        let scratch = self.scratch(rewrite)?;
        let progress = self.begin();
        let from = (&scan.bounds, scan.sample.as_slice());
        Ok(self.pool.install(|| sort(self.source, joined, from, &scratch, self.memory(), &progress))?)
    }

    /// What a mesh of this size needs is more than what is asked for only if that is a few megabytes.
    fn memory(&self) -> u64 {
        self.room.memory.max(least_memory(self.source))
    }

    /// Both steps look at every face twice.
    fn begin(&self) -> impl Fn(u64) + Sync {
        self.observer.event(Event::Started { stage: Stage::Order, total: 2 * self.source.face_count() });
        |faces| self.observer.event(Event::Advanced { stage: Stage::Order, by: faces })
    }

    /// The directory for temporary files, made when it is first needed.
    fn scratch(&self, rewrite: &mut Rewrite) -> Result<ScratchDir, Error> {
        if let Some(scratch) = &rewrite.scratch {
            return Ok(scratch.clone());
        }
        let directory = &self.room.scratch.ground()?;
        if !self.room.force {
            check_room(directory, temporary_bytes(self.source, rewrite.joins))?;
        }
        if is_in_memory(directory) {
            tracing::warn!(
                "{}: temporary files lie in memory there; choose a directory on a disk with --workspace",
                directory.display()
            );
        }
        let scratch = self.room.scratch.beside().dir()?;
        rewrite.scratch = Some(scratch.clone());
        Ok(scratch)
    }
}
