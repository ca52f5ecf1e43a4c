//! From links to lines: steps E and F of the method, in one tile and across tiles; and a whole run for comparison.

use super::Group;
use super::finding::fitter;
use super::town::Town;
use anyhow::Result;
use crease::mesh::{TileId, VertexId};
use crease::spill::ScratchPlace;
use crease::stitch::{
    Candidate, Class, Fragments, LineMemory, LinkPath, Rules, Seam, Stitched, Stitcher, TileShare, close,
};
use crease::{Limits, Silent, Tiling, detect};
use criterion::BatchSize;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// Tiles that the lines are split among to be stitched.
const STRIPS: usize = 4;

/// Adds the steps of this part.
///
/// # Errors
/// If a temporary file cannot be written.
pub fn benches(group: &mut Group, town: &Town) -> Result<()> {
    let rules = Rules::new(&town.plan.scale, &town.params);
    let whole = fragments(town);
    let left = left_after_pruning(town, &whole, &rules);
    group.bench_function("fit", |b| b.iter(|| fitter(town).fits(&left)));
    let look_up = |candidates: &mut [&mut Candidate]| candidates.iter_mut().for_each(|c| known_fit(town, c));
    group.bench_function("close", |b| {
        b.iter_batched(
            || whole.clone(),
            |fragments| close(fragments, &rules, &look_up),
            BatchSize::PerIteration,
        );
    });
    let shares: Vec<TileShare> =
        strips(town, &whole).into_iter().map(|strip| close(strip, &rules, &look_up)).collect();
    let scratch = ScratchPlace::below(town.directory.path());
    let stitched = stitch(&rules, shares.clone(), &scratch)?;
    assert_eq!(stitched.work.links, whole.links.len() as u64, "each link is in one strip");
    group.bench_function("stitch", |b| {
        b.iter_batched(
            || shares.clone(),
            |shares| stitch(&rules, shares, &scratch).expect("lines of a small mesh stay in memory"),
            BatchSize::PerIteration,
        );
    });
    group.bench_function("whole run", |b| {
        let limits = Limits { threads: 1, tiling: Tiling::InCore, ..Limits::default() };
        b.iter(|| detect(&town.source, town.params, limits, &Silent).expect("the mesh was read before"));
    });
    Ok(())
}

/// Local index of a vertex.
fn local(town: &Town, id: VertexId) -> u32 {
    town.tile.mesh.local(id)
}

/// What the tile hands over, before planes are fitted.
fn fragments(town: &Town) -> Fragments {
    let Town { tile, steps, .. } = town;
    let mesh = &tile.mesh;
    let named: BTreeSet<u32> = steps.links.iter().flat_map(|link| link.vertices().iter().copied()).collect();
    let candidate = |v: u32| {
        let stop = steps.stops.get(v);
        Candidate {
            id: mesh.id(v),
            position: mesh.position(v),
            theta: steps.votes.get(v).theta,
            fit: Default::default(),
            salience: steps.support.get(v).salience,
            class: Class::default(),
            corner: stop.corner,
            stop: stop.any(),
            strong: steps.support.get(v).strong(),
            rounds: tile.vertex_rounds[v as usize],
        }
    };
    let path = |vertices: &[u32], weight| LinkPath::new(vertices.iter().map(|&v| mesh.id(v)), weight);
    Fragments {
        vertices: named.into_iter().map(candidate).collect(),
        links: steps.links.iter().map(|link| path(link.vertices(), link.weight)).collect(),
        largest_salience: steps.support.max_over(&tile.demand.owned, |s| s.salience),
        ..Fragments::default()
    }
}

/// The vertices at which planes are fitted: those that are left after pruning.
fn left_after_pruning(town: &Town, whole: &Fragments, rules: &Rules) -> Vec<u32> {
    let left = RefCell::new(Vec::new());
    close(whole.clone(), rules, &|candidates| {
        left.borrow_mut().extend(candidates.iter().map(|c| local(town, c.id)));
        candidates.iter_mut().for_each(|c| known_fit(town, c));
    });
    left.into_inner()
}

/// Completes a candidate by what was fitted before. Nothing in a component depends on the class.
fn known_fit(town: &Town, candidate: &mut Candidate) {
    candidate.fit = town.steps.fits.get(local(town, candidate.id));
}

/// The same links as of tiles that lie side by side along x. Which of them name a vertex is known here, since all are.
fn strips(town: &Town, whole: &Fragments) -> Vec<Fragments> {
    let xs = || whole.vertices.iter().map(|c| c.position.x);
    let (least, most) = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
    let strip_of = |id: VertexId| {
        let share = (town.tile.mesh.position(local(town, id)).x - least) / (most - least);
        ((share * STRIPS as f64) as usize).min(STRIPS - 1)
    };
    let mut strips = vec![Fragments::default(); STRIPS];
    let mut namers: BTreeMap<VertexId, BTreeSet<usize>> = BTreeMap::new();
    for link in &whole.links {
        let strip = strip_of(link.ids()[0]);
        strips[strip].links.push(*link);
        link.ids().iter().for_each(|&id| _ = namers.entry(id).or_default().insert(strip));
    }
    for candidate in &whole.vertices {
        for &strip in &namers[&candidate.id] {
            strips[strip].vertices.push(*candidate);
            let others = namers[&candidate.id].iter().filter(|&&other| other != strip);
            let tiles: Vec<TileId> = others.map(|&other| TileId(other as u32)).collect();
            if !tiles.is_empty() {
                strips[strip].seams.push(Seam { vertex: candidate.id, tiles });
            }
        }
    }
    strips
}

fn stitch(rules: &Rules, shares: Vec<TileShare>, scratch: &ScratchPlace) -> Result<Stitched> {
    let mut stitcher = Stitcher::new(*rules, LineMemory::UNBOUNDED, scratch);
    for (tile, share) in shares.into_iter().enumerate() {
        stitcher.take(share)?;
        stitcher.done(TileId(tile as u32))?;
    }
    Ok(stitcher.finish()?)
}
