//! From normals to fold angles: steps A and B of the method.

use super::Group;
use super::town::Town;
use crease::voting::{Noisy, first_votes, refine, stops, surroundings, vote_again, votes, widen};
use criterion::BatchSize;
use std::hint::black_box;

/// Adds the steps of this part.
pub fn benches(group: &mut Group, town: &Town) {
    let (tile, steps, scale) = (&town.tile, &town.steps, &town.plan.scale);
    let (mesh, demand) = (&tile.mesh, &tile.demand);
    let noisy = |needed: &[u32]| {
        let normals = tile.faces.normals.clone();
        Noisy { normals, s0: tile.noise.clone(), needed: needed.to_vec() }
    };
    let refined = |noisy: Noisy| refine(mesh, &tile.faces, scale, noisy);
    group.bench_function("refine", |b| {
        b.iter_batched(|| noisy(&tile.needed), refined, BatchSize::PerIteration);
    });
    // The difference of these two is one round of all faces.
    for rounds in [1, 2] {
        let needed = vec![rounds; mesh.face_count()];
        group.bench_function(format!("refine {rounds}"), |b| {
            b.iter_batched(|| noisy(&needed), refined, BatchSize::PerIteration);
        });
    }
    group.bench_function("tensors", |b| {
        b.iter(|| first_votes(mesh, &tile.faces, &steps.normals, scale, &demand.voted));
    });
    group.bench_function("vote again", |b| b.iter(|| vote_again(mesh, &steps.tokens, scale, &demand.voted)));
    group.bench_function("eigen", |b| b.iter(|| eigensystems(town)));
    group.bench_function("votes", |b| b.iter(|| votes(mesh, &steps.tokens, &steps.again, &demand.voted)));
    group.bench_function("surroundings", |b| {
        let at = demand.folded.all();
        b.iter(|| surroundings(mesh, &town.plan, &steps.narrow, &demand.voted, &tile.vertex_rounds, at));
    });
    group.bench_function("widen", |b| {
        b.iter_batched(
            || (steps.narrow.clone(), steps.again.clone()),
            |(mut votes, again)| {
                widen(mesh, &mut votes, again, &steps.surroundings, &demand.folded);
                votes
            },
            BatchSize::PerIteration,
        );
    });
    group.bench_function("stops", |b| b.iter(|| stops(mesh, &steps.votes, &demand.traced)));
}

/// Both tensors of each vertex, as `votes` takes them apart.
fn eigensystems(town: &Town) {
    for &v in town.tile.demand.voted.within(0) {
        black_box(black_box(town.steps.tokens.get(v).tensor).eigenvalues());
        black_box(black_box(town.steps.again.get(v)).eigen());
    }
}
