//! A halo that is too thin must be noticed, and one that is too wide must not change anything.
//!
//! The equivalence of tiled and in-core runs is only worth something if a tile that lacks a part of what its vertices
//! depend on would show. So each reach in turn is made smaller than the step it stands for. Builds with debug assertions
//! then panic at the first read of a value that was never computed; without them the result has to differ.

mod support;

use crease::input::MeshSource;
use crease::partition::{Plan, Reach};
use crease::pipeline::Certified;
use crease::{Error, Params, Tiling};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use support::steps::{Steps, plan, tile};
use support::{Mesh, first_difference, in_core, tiled, try_run};

/// Meshes and tile sizes with many seams.
const CUTS: [(&str, u64); 3] = [("bracket", 500), ("city", 500), ("folds20", 300)];

/// How a run came out against the whole.
#[derive(Debug, PartialEq)]
enum Outcome {
    Equal,
    Different(String),
    /// A step read what the halo did not hold.
    Caught(String),
}

/// A tiled job with every reach times `factor` against one in core with `factor_in_core`.
fn job(name: &str, faces: u64, factor: f64, factor_in_core: f64) -> Outcome {
    let mesh = Mesh::of_fixture(name);
    let whole = try_run(&mesh.source(), Params::default(), in_core(), factor_in_core);
    let whole = whole.unwrap_or_else(|e| panic!("{name} in core: {e}"));
    assert!(!whole.0.lines.lines.is_empty(), "{name}: no lines");
    match try_run(&mesh.source(), Params::default(), tiled(faces, 2), factor) {
        Ok(cut) => {
            assert!(cut.0.work.tiles > 4, "{name}: {} tiles are hardly a test", cut.0.work.tiles);
            first_difference(&whole, &cut).map_or(Outcome::Equal, Outcome::Different)
        }
        Err(Error::Internal { message, .. }) => Outcome::Caught(message),
        Err(other) => panic!("{name}: {other}"),
    }
}

#[test]
fn a_job_with_the_right_halo_is_equal() {
    for (name, faces) in CUTS {
        assert_eq!(job(name, faces, 1.0, 1.0), Outcome::Equal, "{name} in tiles of {faces} faces");
    }
}

/// Asserts that something was noticed; with debug assertions, by the read of an unknown value.
fn assert_noticed(what: &str, outcome: &Outcome) {
    let caught =
        matches!(outcome, Outcome::Caught(message) if message.contains("outside what the halo covers"));
    let noticed = if cfg!(debug_assertions) { caught } else { *outcome != Outcome::Equal };
    assert!(noticed, "{what}: {outcome:?}");
}

#[test]
fn a_job_with_a_thin_halo_is_noticed() {
    for (name, faces) in CUTS {
        assert_noticed(name, &job(name, faces, 0.9, 1.0));
    }
    // The factor also takes refinement rounds away, in core as well as in tiles, and the result differs for that alone.
    // What the halo lacks shows against the job in core with as many rounds.
    assert_noticed("bracket with as many rounds", &job("bracket", 500, 0.9, 0.9));
}

/// What one tile says of a vertex it owns: theta, eigenvalues, directions, threshold, S, SC, R, ridge, stops.
type Owned = BTreeMap<u64, Vec<u64>>;

/// What all tiles together say.
#[derive(Default)]
struct Findings {
    owned: Owned,
    /// Vertices and weight of each link.
    links: BTreeSet<(Vec<u64>, u64)>,
    /// Vertices on links, as each tile that has such a link sees them.
    linked: BTreeSet<(u64, Vec<u64>)>,
}

impl Findings {
    fn add(&mut self, tile: &Certified, steps: &Steps) {
        let id = |v: u32| tile.mesh.id(v).0;
        for &v in &tile.demand.owned {
            let (vote, support, stop) = (steps.votes.get(v), steps.support.get(v), steps.stops.get(v));
            let mut values = vec![vote.theta, vote.phi, steps.threshold.get(v), steps.r.get(v)];
            values.extend(vote.eigenvalues);
            values.extend(vote.t.to_array().into_iter().chain(vote.b.to_array()));
            values.extend([support.salience, support.contrast, support.measure]);
            let mut bits: Vec<u64> = values.into_iter().map(f64::to_bits).collect();
            bits.extend([steps.ridge.get(v), stop.corner, stop.boundary].map(u64::from));
            bits.push(tile.vertex_rounds[v as usize].into());
            assert!(self.owned.insert(id(v), bits).is_none(), "vertex {} has two owners", id(v));
        }
        for link in &steps.links {
            self.links.insert((link.vertices.iter().map(|&v| id(v)).collect(), link.weight.to_bits()));
            for &v in &link.vertices {
                let (vote, support, stop) = (steps.votes.get(v), steps.support.get(v), steps.stops.get(v));
                let facts = [stop.corner, stop.boundary, support.strong(), support.feature()].map(u64::from);
                let mut bits = vec![vote.theta.to_bits(), support.salience.to_bits()];
                bits.extend(facts.into_iter().chain([tile.vertex_rounds[v as usize].into()]));
                self.linked.insert((id(v), bits));
            }
        }
    }

    fn first_difference(&self, other: &Findings) -> Option<String> {
        if self.owned.keys().ne(other.owned.keys()) {
            return Some("the vertices that are owned".to_owned());
        }
        let differs = |(v, bits): &(&u64, &Vec<u64>)| other.owned[v] != **bits;
        if let Some((v, bits)) = self.owned.iter().find(differs) {
            let value = bits.iter().zip(&other.owned[v]).position(|(a, b)| a != b);
            return Some(format!("value {value:?} of vertex {v}"));
        }
        if let Some((link, _)) = self.links.symmetric_difference(&other.links).next() {
            return Some(format!("the link {link:?}"));
        }
        let vertex = self.linked.symmetric_difference(&other.linked).next();
        vertex.map(|(v, _)| format!("vertex {v}, seen from the tiles whose links reach it"))
    }
}

/// All tiles with the halo that `change` makes of the right one.
fn findings(source: &dyn MeshSource, plan: &Plan, change: impl Fn(&mut Reach)) -> Findings {
    let mut reach = Reach::new(&plan.scale);
    change(&mut reach);
    let mut all = Findings::default();
    for index in 0..plan.cells.len() {
        let tile = tile(source, plan, &reach, index);
        all.add(&tile, &Steps::compute(&tile, plan, &Params::default()));
    }
    all
}

/// Runs the steps of all tiles with a changed halo, against those of the whole mesh with the right one.
fn steps(name: &str, faces: u64, change: impl Fn(&mut Reach)) -> Outcome {
    let mesh = Mesh::of_fixture(name);
    let source = mesh.source();
    let [whole, cut] =
        [Tiling::InCore, Tiling::Faces(faces)].map(|tiling| plan(&source, &Params::default(), tiling));
    assert!(cut.cells.len() > 4, "{name}: {} tiles are hardly a test", cut.cells.len());
    let whole = findings(&source, &whole, |_| ());
    assert!(whole.links.len() > 50, "{name}: hardly any links");
    let cut = catch_unwind(AssertUnwindSafe(|| findings(&source, &cut, change)));
    match cut {
        Ok(cut) => whole.first_difference(&cut).map_or(Outcome::Equal, Outcome::Different),
        Err(panic) => {
            let message = panic.downcast_ref::<String>().cloned();
            Outcome::Caught(
                message.or_else(|| panic.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default(),
            )
        }
    }
}

/// One reach of the halo and a change to it.
type Change = (&'static str, fn(&mut Reach));

#[test]
fn steps_with_the_right_halo_are_equal() {
    for (name, faces) in CUTS {
        assert_eq!(steps(name, faces, |_| ()), Outcome::Equal, "{name} in tiles of {faces} faces");
    }
}

/// Each reach is as large as it has to be: with one step less, a read of an unknown value is caught. The ball of thinning
/// carries the one-ring of all its vertices with it, so that a radius must be well short to leave out a vertex.
#[cfg(debug_assertions)]
#[test]
fn every_reach_that_is_a_step_too_short_is_caught() {
    let changes: [Change; 5] = [
        ("link steps", |reach| reach.link_steps -= 1),
        ("thinning radius", |reach| reach.thin_radius *= 0.5),
        ("average rounds", |reach| reach.average_rounds -= 1),
        ("trace steps", |reach| reach.trace_steps -= 1),
        ("revotes", |reach| reach.revotes -= 1),
    ];
    for (what, change) in changes {
        assert_noticed(what, &steps("bracket", 500, change));
    }
}

/// Without debug assertions, a step less seldom shows: the level cubes around a tile reach farther than most of what is
/// computed inside. A reach that is missing altogether does show. (That of thinning does not: the vertices that would miss
/// it lie three rings away from the tile, and only links that end there could tell.)
#[test]
fn every_reach_that_is_missing_is_noticed() {
    let changes: [Change; 5] = [
        ("link steps", |reach| reach.link_steps = 0),
        ("average rounds", |reach| reach.average_rounds = 0),
        ("trace steps", |reach| reach.trace_steps = 0),
        ("revotes", |reach| reach.revotes = 0),
        ("refinement rounds", |reach| reach.rounds = 0.9),
    ];
    for (what, change) in changes {
        assert_ne!(steps("city", 300, change), Outcome::Equal, "{what}");
    }
}

#[test]
fn a_halo_that_is_too_wide_changes_nothing() {
    let changes: [Change; 6] = [
        ("link steps", |reach| reach.link_steps += 1),
        ("thinning radius", |reach| reach.thin_radius *= 1.5),
        ("average rounds", |reach| reach.average_rounds += 3),
        ("trace steps", |reach| reach.trace_steps += 2),
        ("revotes", |reach| reach.revotes += 1),
        ("all but the rounds", |reach| *reach = Reach { rounds: 1.0, ..reach.scaled(1.4) }),
    ];
    for (what, change) in changes {
        assert_eq!(steps("bracket", 500, change), Outcome::Equal, "{what}");
    }
}
