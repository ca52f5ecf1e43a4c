//! The halo of the paper method: too thin a one must be noticed in every pass, too wide a one must not change anything.
//!
//! The method and its reaches differ from those of `tests/halo.rs`; the idea is the same.

mod support;

use crease::config::PaperThresholds;
use crease::input::MeshSource;
use crease::mesh::VertexId;
use crease::partition::{PaperReach, Pass};
use crease::refine::{Extremes, Link};
use crease::{Error, Method, Params, Sigma, Tiling};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use support::paper_steps::{PaperSteps, PaperTile, extremes};
use support::steps::plan;
use support::{Mesh, first_difference, in_core, tiled, try_run};

/// Meshes and tile sizes with many seams.
const CUTS: [(&str, u64); 4] = [("bracket", 100), ("city", 100), ("folds20", 60), ("defects", 20)];

fn params(sigma_edges: f64) -> Params {
    let method = Method::Paper(PaperThresholds::default());
    Params { method, sigma: Sigma::Edges(sigma_edges), ..Params::default() }
}

/// How a run came out against the whole.
#[derive(Debug, PartialEq)]
enum Outcome {
    Equal,
    Different(String),
    /// A step read what the halo did not hold.
    Caught(String),
}

/// Asserts that something was noticed; with debug assertions, by the read of what was not loaded or not computed.
#[track_caller]
fn assert_noticed(what: &str, outcome: &Outcome) {
    let caught =
        matches!(outcome, Outcome::Caught(message) if message.contains("outside what the halo covers"));
    let noticed = if cfg!(debug_assertions) { caught } else { *outcome != Outcome::Equal };
    assert!(noticed, "{what}: {outcome:?}");
}

/// A tiled job with every reach times `factor` against one in core, which has no halo.
fn job(name: &str, faces: u64, sigma_edges: f64, factor: f64) -> Outcome {
    let (mesh, params) = (Mesh::of_fixture(name), params(sigma_edges));
    let whole = try_run(&mesh.source(), params, in_core(), 1.0).unwrap_or_else(|e| panic!("{name}: {e}"));
    match try_run(&mesh.source(), params, tiled(faces, 2), factor) {
        Ok(cut) => {
            assert!(cut.0.work.tiles > 4, "{name}: {} tiles are hardly a test", cut.0.work.tiles);
            first_difference(&whole, &cut).map_or(Outcome::Equal, Outcome::Different)
        }
        Err(Error::Internal { message, .. }) => Outcome::Caught(message),
        Err(other) => panic!("{name}: {other}"),
    }
}

#[test]
fn a_job_with_the_right_halo_or_a_wider_one_is_equal() {
    for (name, faces) in CUTS {
        for (sigma, factor) in [(0.0, 1.0), (3.0, 1.4), (6.0, 1.0)] {
            let outcome = job(name, faces, sigma, factor);
            assert_eq!(outcome, Outcome::Equal, "{name} in tiles of {faces}, sigma {sigma}, {factor}");
        }
    }
}

#[test]
fn a_job_with_a_thin_halo_is_noticed() {
    for (name, faces) in &CUTS[..3] {
        assert_noticed(name, &job(name, *faces, 3.0, 0.6));
    }
}

/// Runs `job`, which says what differs.
fn guarded(job: impl FnOnce() -> Option<String>) -> Outcome {
    match catch_unwind(AssertUnwindSafe(job)) {
        Ok(difference) => difference.map_or(Outcome::Equal, Outcome::Different),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            Outcome::Caught(
                text.or_else(|| panic.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default(),
            )
        }
    }
}

/// The whole mesh in one tile, and what there is to find.
struct Whole {
    tile: PaperTile,
    steps: PaperSteps,
    extremes: Extremes,
}

impl Whole {
    fn new(source: &dyn MeshSource, params: &Params) -> Whole {
        let plan = plan(source, params, Tiling::InCore);
        let reach = PaperReach::new(params.sigma, &plan.scale);
        let tile = PaperTile::load(source, &plan, &reach, Pass::Links, &plan.cells[0]);
        let extremes = extremes(&tile, &plan, params);
        let steps = PaperSteps::compute(&tile, &plan, params, &extremes);
        assert!(steps.links.len() > 50, "hardly any links");
        Whole { tile, steps, extremes }
    }

    /// Where `steps` of a tile first disagree with the whole, among *all* that the halo asked for: what lies in the outer
    /// parts of a halo seldom reaches a result, but was computed from too little all the same.
    fn disagreement(&self, tile: &PaperTile, steps: &PaperSteps) -> Option<String> {
        let (ours, demand) = (&self.steps, &tile.demand);
        let place = |v: u32| -> u32 {
            let ids = &self.tile.mesh.vertex_ids;
            ids.binary_search(&tile.mesh.id(v)).expect("a vertex of the whole mesh") as u32
        };
        let differs = |what: &str, at: &[u32], same: &dyn Fn(u32, u32) -> bool| {
            let v = at.iter().find(|&&v| !same(v, place(v)))?;
            Some(format!("{what} of {}", tile.mesh.id(*v)))
        };
        differs("vote", demand.voted.all(), &|v, w| steps.votes.get(v) == ours.votes.get(w))
            .or_else(|| differs("stop", &demand.traced, &|v, w| steps.stops.get(v) == ours.stops.get(w)))
            .or_else(|| {
                let same = |v, w| steps.salience.get(v) == ours.salience.get(w);
                differs("salience", demand.thinned.all(), &same)
            })
            .or_else(|| differs("ridge", &demand.linked, &|v, w| steps.ridge.get(v) == ours.ridge.get(w)))
    }
}

/// Links by global ids, with the bits of their weights.
fn named(tile: &PaperTile, steps: &PaperSteps) -> BTreeSet<(Vec<VertexId>, u64)> {
    let name = |l: &Link| (l.vertices().iter().map(|&v| tile.mesh.id(v)).collect(), l.weight.to_bits());
    steps.links.iter().map(name).collect()
}

/// The steps of all tiles, as each of the three passes takes them, with the halo that `change` makes of the right one,
/// against those of the whole mesh.
fn passes(name: &str, faces: u64, change: impl Fn(&mut PaperReach)) -> [Outcome; 3] {
    let (mesh, params) = (Mesh::of_fixture(name), params(3.0));
    let source = mesh.source();
    let whole = Whole::new(&source, &params);
    let cut = plan(&source, &params, Tiling::Faces(faces));
    assert!(cut.cells.len() > 4, "{name}: {} tiles are hardly a test", cut.cells.len());
    let mut reach = PaperReach::new(params.sigma, &cut.scale);
    change(&mut reach);
    [Pass::Omega, Pass::Salience, Pass::Links].map(|pass| {
        guarded(|| {
            let mut links = BTreeSet::new();
            for cell in &cut.cells {
                let tile = PaperTile::load(&source, &cut, &reach, pass, cell);
                let steps = PaperSteps::compute(&tile, &cut, &params, &whole.extremes);
                if let Some(what) = whole.disagreement(&tile, &steps) {
                    return Some(what);
                }
                links.extend(named(&tile, &steps));
            }
            (pass == Pass::Links && links != named(&whole.tile, &whole.steps)).then(|| "links".to_owned())
        })
    })
}

const EQUAL: [Outcome; 3] = [Outcome::Equal, Outcome::Equal, Outcome::Equal];

#[test]
fn passes_with_the_right_halo_or_a_wider_one_are_equal() {
    for (name, faces) in &CUTS[..3] {
        assert_eq!(passes(name, *faces, |_| ()), EQUAL, "{name}");
        assert_eq!(passes(name, *faces, |reach| *reach = reach.scaled(1.5)), EQUAL, "{name}");
    }
}

/// The cube is rounded to lattice cubes of twice its size, and the ball of thinning carries the one-ring of all its vertices
/// with it: these must be well short to leave something out.
#[test]
fn every_reach_that_is_too_short_is_noticed_in_every_pass_that_needs_it() {
    let cube = |reach: &mut PaperReach| reach.half_cube = reach.half_cube.map(|half| 0.3 * half);
    for (outcome, pass) in passes("bracket", 100, cube).iter().zip(["first", "second", "third"]) {
        assert_noticed(&format!("the cube of the {pass} pass"), outcome);
    }
    let [omega, salience, links] = passes("bracket", 100, |reach| reach.trace_steps -= 1);
    assert_eq!(omega, Outcome::Equal, "the first pass walks nowhere");
    assert_noticed("the walks of the second pass", &salience);
    assert_noticed("the walks of the third pass", &links);
    type Change = (&'static str, fn(&mut PaperReach));
    let of_links: [Change; 2] = [
        ("link steps", |reach| reach.link_steps -= 1),
        ("thinning radius", |reach| reach.thin_radius *= 0.5),
    ];
    for (what, change) in of_links {
        let [omega, salience, links] = passes("bracket", 100, change);
        assert_eq!([omega, salience], [Outcome::Equal, Outcome::Equal], "{what}: only the third pass links");
        assert_noticed(what, &links);
    }
}
