//! From fold angles to links and planes: steps B (contrast), C, D and F of the method.

use super::Group;
use super::town::Town;
use crease::refine::{Evidence, Fitter, Link, Linker, average_along, contrast, ridges, smooth, traceable};

/// Adds the steps of this part.
pub fn benches(group: &mut Group, town: &Town) {
    let (tile, steps, scale) = (&town.tile, &town.steps, &town.plan.scale);
    let (mesh, demand, rounds) = (&tile.mesh, &tile.demand, &tile.vertex_rounds[..]);
    group.bench_function("smooth", |b| b.iter(|| smooth(mesh, scale, rounds, &demand.smoothed)));
    group.bench_function("contrast", |b| {
        b.iter(|| {
            let traced = traceable(&steps.votes, &steps.surroundings, &demand.traced);
            contrast(mesh, scale, &steps.votes, rounds, &traced)
        });
    });
    group.bench_function("support", |b| {
        let evidence = Evidence {
            mesh,
            votes: &steps.votes,
            positions: &steps.positions,
            contrast: &steps.contrast,
            surroundings: &steps.surroundings,
            stops: &steps.stops,
            traced: &demand.traced,
        };
        b.iter(|| evidence.support(&demand.linked));
    });
    group.bench_function("thin", |b| {
        b.iter(|| {
            let r = average_along(mesh, &steps.votes, &steps.surroundings, rounds, &demand.thinned);
            ridges(mesh, scale, &steps.votes, &r, &steps.support, &steps.stops, rounds, &demand.linked)
        });
    });
    group.bench_function("link", |b| b.iter(|| links(town)));
}

/// The links from all ridges.
fn links(town: &Town) -> Vec<Link> {
    let Town { tile, steps, .. } = town;
    let linker = Linker {
        mesh: &tile.mesh,
        positions: &steps.positions,
        votes: &steps.votes,
        r: &steps.r,
        support: &steps.support,
        stops: &steps.stops,
        ridge: &steps.ridge,
    };
    let mut links = Vec::new();
    tile.demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
    links
}

/// Fits planes at the vertices of the town.
pub fn fitter(town: &Town) -> Fitter<'_> {
    let Town { tile, steps, plan, .. } = town;
    Fitter {
        mesh: &tile.mesh,
        faces: &tile.faces,
        normals: &steps.normals,
        scale: &plan.scale,
        known: &steps.known,
        votes: &steps.votes,
        stops: &steps.stops,
        rounds: &tile.vertex_rounds,
    }
}
