//! From the file to a certified tile.

use super::Group;
use super::town::Town;
use crease::config::NO_LIMIT;
use crease::glam::DVec3;
use crease::input::{FaceBlock, MeshSource};
use crease::mesh::{FaceId, TileMesh, VertexId};
use crease::partition::{
    MOST_FACES, Numbering, Reach, load, noise_demand, round_demand, scan, vertex_demand,
};
use crease::voting::{FaceGeometry, Noise};
use criterion::BatchSize;
use std::hint::black_box;

/// Adds the steps of this part.
pub fn benches(group: &mut Group, town: &Town) {
    group.bench_function("decode", |b| b.iter(|| decode(town)));
    group.bench_function("scan", |b| b.iter(|| scan(&town.source, NO_LIMIT, &|_| ())));
    group.bench_function("load", |b| {
        b.iter(|| load(&town.source, &town.plan, &town.region, MOST_FACES, Numbering::WhereItPays))
    });
    group.bench_function("adjacency", |b| {
        b.iter_batched(|| clone_of(&town.tile.mesh), adjacency, BatchSize::PerIteration);
    });
    let (mesh, scale) = (&town.tile.mesh, &town.plan.scale);
    group.bench_function("geometry", |b| b.iter(|| FaceGeometry::new(mesh, scale)));
    group.bench_function("noise", |b| b.iter(|| noise(town)));
    group.bench_function("demand", |b| b.iter(|| demand(town)));
}

/// All faces, all positions.
fn decode(town: &Town) -> u64 {
    let source = &town.source;
    let (mut block, mut sum) = (FaceBlock::default(), 0);
    for index in 0..source.block_count() {
        source.read_block(index, &mut block).expect("the mesh was read before");
        sum += block.corners.last().map_or(0, |face| face[2].0);
    }
    let mut positions = Vec::new();
    let all = source.vertex_count() as usize;
    source.read_positions(VertexId(0), all, &mut positions).expect("the mesh was read before");
    black_box(positions);
    sum
}

/// Vertices and faces without what is made of them.
struct Bare {
    vertex_ids: Vec<VertexId>,
    positions: Vec<DVec3>,
    face_ids: Vec<FaceId>,
    corners: Vec<[u32; 3]>,
    complete: Vec<bool>,
}

fn clone_of(mesh: &TileMesh) -> Bare {
    Bare {
        vertex_ids: mesh.vertex_ids.clone(),
        positions: mesh.positions.clone(),
        face_ids: mesh.face_ids.clone(),
        corners: mesh.corners.clone(),
        complete: mesh.complete.clone(),
    }
}

fn adjacency(bare: Bare) -> TileMesh {
    TileMesh::new(bare.vertex_ids, bare.positions, bare.face_ids, bare.corners, bare.complete)
}

/// s0 at each vertex and at each face, and the rounds it asks for.
fn noise(town: &Town) -> (Vec<Option<u32>>, Vec<Option<u32>>) {
    let mesh = &town.tile.mesh;
    let noise = Noise::new(mesh, &town.tile.faces, &town.plan.lattice, &town.region);
    let barycentres: Vec<DVec3> = (0..mesh.face_count() as u32).map(|f| mesh.barycentre(f)).collect();
    (town.rounds(&noise.levels_at(&mesh.positions)), town.rounds(&noise.levels_at(&barycentres)))
}

/// What the tile depends on: here all of it, and nothing is missing.
fn demand(town: &Town) -> usize {
    let (loaded, tile) = (town.loaded(), &town.tile);
    let most = tile.vertex_rounds.iter().copied().max().unwrap_or(0);
    let reach = Reach::new(&town.plan.scale, most);
    let (demand, mut gaps) = vertex_demand(&loaded, &town.cell, &reach);
    let (needed, more) = round_demand(&loaded, &town.plan, &demand.voted, &tile.face_rounds, &reach);
    gaps.extend(more);
    gaps.extend(noise_demand(&loaded, &demand, |_| true));
    assert!(gaps.is_empty(), "the mesh is there as a whole");
    needed.len()
}
