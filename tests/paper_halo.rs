//! The halo of the paper method: too thin a one must be noticed in every pass, too wide a one must not change anything.
//!
//! The method and its reaches differ from those of `tests/halo.rs`; the idea is the same.

mod support;

use crease::config::PaperThresholds;
use crease::mesh::VertexId;
use crease::partition::{PaperReach, Pass, Plan};
use crease::refine::{Extremes, Link, OmegaRange};
use crease::{Error, Method, Params, Sigma, Tiling};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use support::paper_steps::PaperTile;
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
        for sigma in [0.0, 3.0, 9.0] {
            for factor in [1.0, 1.4] {
                let outcome = job(name, faces, sigma, factor);
                assert_eq!(outcome, Outcome::Equal, "{name} in tiles of {faces}, sigma {sigma}, {factor}");
            }
        }
    }
}

#[test]
fn a_job_with_a_thin_halo_is_noticed() {
    for (name, faces) in &CUTS[..3] {
        assert_noticed(name, &job(name, *faces, 3.0, 0.9));
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

/// What the three passes over the tiles find, with the halo that `change` makes of the right one, against the whole mesh.
fn passes(name: &str, faces: u64, change: impl Fn(&mut PaperReach)) -> [Outcome; 3] {
    let (mesh, params) = (Mesh::of_fixture(name), params(3.0));
    let source = mesh.source();
    let [whole, cut] = [Tiling::InCore, Tiling::Faces(faces)].map(|tiling| plan(&source, &params, tiling));
    assert!(cut.cells.len() > 4, "{name}: {} tiles are hardly a test", cut.cells.len());
    let right = PaperReach::new(params.sigma, &cut.scale);
    let mut reach = right;
    change(&mut reach);
    let all = PaperTile::load(&source, &whole, &right, Pass::Links, &whole.cells[0]);
    let omega = all.omega_range(&whole, &params);
    let salience = all.largest_salience(&whole, &params, omega);
    let extremes = Extremes { omega, salience };
    let named = |tile: &PaperTile, plan: &Plan| -> Vec<(Vec<VertexId>, u64)> {
        let links = tile.links(plan, &params, &extremes);
        let name = |l: &Link| (l.vertices.iter().map(|&v| tile.mesh.id(v)).collect(), l.weight.to_bits());
        links.iter().map(name).collect()
    };
    let tiles = |pass| cut.cells.iter().map(move |cell| (pass, cell));
    let load = |(pass, cell)| PaperTile::load(&source, &cut, &reach, pass, cell);
    [
        guarded(|| {
            let ranges = tiles(Pass::Omega).map(|t| load(t).omega_range(&cut, &params));
            (ranges.fold(OmegaRange::default(), OmegaRange::join) != omega).then(|| "Omega".to_owned())
        }),
        guarded(|| {
            let each = tiles(Pass::Salience).map(|t| load(t).largest_salience(&cut, &params, omega));
            (each.fold(0.0, f64::max) != salience).then(|| "salience".to_owned())
        }),
        guarded(|| {
            let expected: BTreeSet<_> = named(&all, &whole).into_iter().collect();
            assert!(expected.len() > 50, "hardly any links");
            let found: BTreeSet<_> = tiles(Pass::Links).flat_map(|t| named(&load(t), &cut)).collect();
            (found != expected).then(|| "links".to_owned())
        }),
    ]
}

const EQUAL: [Outcome; 3] = [Outcome::Equal, Outcome::Equal, Outcome::Equal];

#[test]
fn passes_with_the_right_halo_or_a_wider_one_are_equal() {
    for (name, faces) in &CUTS[..3] {
        assert_eq!(passes(name, *faces, |_| ()), EQUAL, "{name}");
        assert_eq!(passes(name, *faces, |reach| *reach = reach.scaled(1.5)), EQUAL, "{name}");
    }
}

/// The cube is rounded to lattice cubes twice its size, so that it must be well short to leave one out.
#[test]
fn every_reach_that_is_too_short_is_noticed_in_every_pass_that_needs_it() {
    let [omega, salience, links] =
        passes("bracket", 100, |reach| reach.half_cube = reach.half_cube.map(|x| 0.3 * x));
    // Of the largest and smallest Omega and the largest salience a part of the mesh may know enough by chance; the debug
    // assertions do not rely on chance.
    if cfg!(debug_assertions) {
        assert_noticed("the cube of the first pass", &omega);
        assert_noticed("the cube of the second pass", &salience);
    }
    assert_noticed("the cube of the third pass", &links);
    let [omega, salience, links] = passes("bracket", 100, |reach| reach.trace_steps -= 1);
    assert_eq!(omega, Outcome::Equal, "the first pass walks nowhere");
    if cfg!(debug_assertions) {
        assert_noticed("the walks of the second pass", &salience);
    }
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
