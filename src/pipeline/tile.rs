//! One tile from cell to fragments.
//!
//! [`certify`] loads a region, works out what the owned vertices depend on, and loads more until all of it is there.
//! [`compute`] is then a pure function of what was loaded: it does not know whether the tile is one of a thousand or the
//! only one.

use crate::config::Params;
use crate::input::MeshSource;
use crate::math::DEGREE;
use crate::mesh::{Field, TileId, TileMesh};
use crate::partition::{
    Cell, Demand, LoadError, Loaded, Plan, Reach, Region, load, merge, noise_demand, round_demand,
    vertex_demand,
};
use crate::refine::{Evidence, Linker, Support, average_along, contrast, ridges};
use crate::stitch::{Class, Defects, Fragments, LineVertex, LinkPath, OpenEdge, VertexFields};
use crate::voting::{
    FaceGeometry, Noise, Stop, Vote, first_votes, refine, stops, thresholds, vote_again, votes,
};
use glam::DVec3;

/// A tile with all that its vertices depend on.
pub struct Certified {
    /// Which tile.
    pub id: TileId,
    mesh: TileMesh,
    cell: Cell,
    demand: Demand,
    faces: FaceGeometry,
    /// Noise level of each face, where it is known.
    noise: Vec<Option<f64>>,
    /// Refinement rounds to do for each face.
    needed: Vec<u32>,
    /// K of each vertex, where it is asked for; 0 elsewhere.
    vertex_rounds: Vec<u32>,
    /// Largest K that was met.
    pub most_rounds: u32,
    /// How often the region had to grow.
    pub regrown: u32,
}

/// What one tile contributes.
pub struct TileResult {
    /// Its share of the line graph.
    pub fragments: Fragments,
    /// Fields of the vertices it owns, by ascending id; empty unless they were asked for.
    pub fields: Vec<VertexFields>,
    /// Faces that were loaded.
    pub loaded_faces: u64,
    /// Faces that the tile owns: those whose vertex of lowest id it owns.
    pub owned_faces: u64,
}

/// Loads `cell` with everything its vertices depend on. `rounds_hint` is the largest number of refinement rounds met so
/// far; it only decides how much is loaded at the first attempt.
///
/// # Errors
/// If the source fails or the region becomes larger than a tile can be.
pub fn certify(
    source: &dyn MeshSource,
    plan: &Plan,
    reach: &Reach,
    id: TileId,
    rounds_hint: u32,
) -> Result<Certified, LoadError> {
    let cell = plan.cells[id.0 as usize];
    let mut region = plan.first_region(&cell, reach.margin(rounds_hint));
    let (mut regrown, mut generosity) = (0, 1u32);
    loop {
        match attempt(source, plan, reach, id, &region)? {
            Ok(mut tile) => {
                tile.regrown = regrown;
                return Ok(tile);
            }
            Err(gaps) => {
                tracing::debug!(tile = id.0, gaps = gaps.len(), "the region grows");
                region.grow(&gaps, generosity);
                regrown += 1;
                // Where the guess was too low, the next one is twice as wide: a few loads, whatever the mesh is like.
                generosity = generosity.saturating_mul(2);
            }
        }
    }
}

/// Either the tile, or the gaps in the region.
type Attempt = Result<Certified, Vec<crate::partition::Gap>>;

fn attempt(
    source: &dyn MeshSource,
    plan: &Plan,
    reach: &Reach,
    id: TileId,
    region: &Region,
) -> Result<Attempt, LoadError> {
    let cell = plan.cells[id.0 as usize];
    let mesh = load(source, plan, region)?;
    let loaded = Loaded { mesh: &mesh, region, lattice: &plan.lattice };
    let (demand, mut gaps) = vertex_demand(&loaded, plan, &cell, reach);
    let faces = FaceGeometry::new(&mesh, &plan.scale);
    let noise = Noise::new(&mesh, &faces, &plan.lattice, region, plan.scale);
    let barycentres: Vec<DVec3> = (0..mesh.face_count() as u32).map(|f| mesh.barycentre(f)).collect();
    let face_noise = noise.levels_at(&barycentres);
    let face_rounds: Vec<Option<u32>> = face_noise.iter().map(|s0| s0.map(|s0| noise.rounds(s0))).collect();
    let (needed, more) = round_demand(&loaded, plan, &demand.voted, &face_rounds, reach);
    gaps.extend(more);
    let positions: Vec<DVec3> = demand.thinned.all().iter().map(|&v| mesh.position(v)).collect();
    let mut vertex_rounds: Vec<Option<u32>> = vec![None; mesh.vertex_count()];
    for (&v, s0) in demand.thinned.all().iter().zip(noise.levels_at(&positions)) {
        vertex_rounds[v as usize] = s0.map(|s0| noise.rounds(s0));
    }
    gaps.extend(noise_demand(&loaded, demand.thinned.all(), |v| vertex_rounds[v as usize].is_some()));
    if !gaps.is_empty() {
        return Ok(Err(merge(gaps)));
    }
    let most_rounds = needed.iter().copied().max().unwrap_or(0);
    let vertex_rounds = vertex_rounds.into_iter().map(|k| k.unwrap_or(0)).collect();
    Ok(Ok(Certified {
        id,
        cell,
        demand,
        faces,
        noise: face_noise,
        needed,
        vertex_rounds,
        most_rounds,
        regrown: 0,
        mesh,
    }))
}

/// Steps A to D on a certified tile. `with_fields` asks for the fields of every owned vertex.
pub fn compute(tile: &Certified, plan: &Plan, params: &Params, with_fields: bool) -> TileResult {
    let Certified { mesh, demand, faces, .. } = tile;
    let scale = &plan.scale;
    let normals = refine(mesh, faces, &tile.noise, &tile.needed);
    let tokens = first_votes(mesh, faces, &normals, scale, &demand.voted);
    let again = vote_again(mesh, &tokens, scale, &demand.voted);
    let votes = votes(mesh, &tokens, &again, &demand.voted);
    drop((tokens, again, normals));
    let contrast = contrast(mesh, scale, &votes, &demand.traced);
    let threshold = thresholds(mesh, &plan.lattice, &votes, &demand.voted, &demand.traced);
    let stops = stops(mesh, &votes, &demand.traced);
    let evidence = Evidence {
        mesh,
        votes: &votes,
        contrast: &contrast,
        threshold: &threshold,
        stops: &stops,
        min_angle: params.min_angle_deg * DEGREE,
    };
    let support = evidence.support(&demand.linked);
    let r = average_along(mesh, &votes, &tile.vertex_rounds, &demand.thinned);
    let ridge = ridges(mesh, scale, &votes, &r, &support, &stops, &demand.linked);
    let linker = Linker { mesh, votes: &votes, r: &r, support: &support, stops: &stops, ridge: &ridge };
    let mut links = Vec::new();
    demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
    let finding = Finding { votes: &votes, support: &support, stops: &stops };
    let (open_edges, defects) = tile.census();
    let open_edges = if params.boundaries { open_edges } else { Vec::new() };
    let mut named: Vec<u32> = links.iter().flat_map(|l| l.vertices.iter().copied()).collect();
    named.extend(open_edges.iter().flat_map(|e| e.ends));
    named.sort_unstable();
    named.dedup();
    let fragments = Fragments {
        vertices: named.iter().map(|&v| finding.line_vertex(tile, v)).collect(),
        links: links
            .iter()
            .map(|l| LinkPath::new(l.vertices.iter().map(|&v| mesh.id(v)), l.weight))
            .collect(),
        open_edges: open_edges
            .iter()
            .map(|e| OpenEdge { ends: e.ends.map(|v| mesh.id(v)), crowded: e.crowded })
            .collect(),
        largest_salience: support.max_over(&demand.owned, |s| s.salience),
        defects,
    };
    let fields = if with_fields {
        demand.owned.iter().map(|&v| finding.fields(tile, v)).collect()
    } else {
        Vec::new()
    };
    let owned_faces = mesh.corners.iter().filter(|c| tile.owns_least(c)).count() as u64;
    TileResult { fragments, fields, loaded_faces: mesh.face_count() as u64, owned_faces }
}

/// What was found out about single vertices.
struct Finding<'a> {
    votes: &'a Field<Vote>,
    support: &'a Field<Support>,
    stops: &'a Field<Stop>,
}

impl Finding<'_> {
    fn class(&self, v: u32) -> Class {
        let stop = self.stops.get(v);
        if stop.boundary {
            Class::Boundary
        } else if stop.corner {
            Class::Corner
        } else if !self.support.get(v).feature() {
            Class::Face
        } else if self.votes.get(v).theta >= crate::config::method::SHARP_DEG * DEGREE {
            Class::Sharp
        } else {
            Class::Weak
        }
    }

    fn line_vertex(&self, tile: &Certified, v: u32) -> LineVertex {
        let stop = self.stops.get(v);
        LineVertex {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            theta: self.votes.get(v).theta,
            salience: self.support.get(v).salience,
            class: self.class(v),
            corner: stop.corner,
            stop: stop.any(),
            strong: self.support.get(v).strong(),
            rounds: tile.vertex_rounds[v as usize],
        }
    }

    fn fields(&self, tile: &Certified, v: u32) -> VertexFields {
        let vote = self.votes.get(v);
        VertexFields {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            eigenvalues: vote.eigenvalues,
            omega: vote.omega(),
            salience: self.support.get(v).salience,
            class: self.class(v),
        }
    }
}

/// An open edge under local indices.
struct LocalEdge {
    ends: [u32; 2],
    crowded: bool,
}

impl Certified {
    fn owns(&self, v: u32) -> bool {
        self.cell.owns(self.mesh.position(v))
    }

    fn owns_least(&self, corners: &[u32; 3]) -> bool {
        self.owns(corners[0].min(corners[1]).min(corners[2]))
    }

    /// The open edges whose lower end is owned, and the defects this tile has to count.
    fn census(&self) -> (Vec<LocalEdge>, Defects) {
        let mesh = &self.mesh;
        let degenerate = mesh
            .corners
            .iter()
            .zip(&self.faces.areas)
            .filter(|(c, area)| **area == 0.0 && self.owns_least(c));
        let mut defects = Defects {
            degenerate_faces: degenerate.count() as u64,
            duplicate_faces: mesh.duplicates.iter().filter(|&&v| self.owns(v)).count() as u64,
            ..Defects::default()
        };
        let (mut open, mut uses) = (Vec::new(), Vec::new());
        for &v in &self.demand.owned {
            mesh.edge_uses(v, &mut uses);
            for edge in uses.chunk_by(|a, b| a.other == b.other).filter(|e| e[0].other > v) {
                let opposed = edge.len() == 2 && edge[0].outward == edge[1].outward;
                defects.opposed_edges += u64::from(opposed);
                defects.boundary_edges += u64::from(edge.len() == 1);
                defects.nonmanifold_edges += u64::from(edge.len() > 2);
                if edge.len() != 2 {
                    open.push(LocalEdge { ends: [v, edge[0].other], crowded: edge.len() > 2 });
                }
            }
        }
        (open, defects)
    }
}
