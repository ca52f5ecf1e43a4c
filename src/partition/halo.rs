//! What a vertex depends on, and the certificate that a tile has loaded all of it.
//!
//! This is the one place that knows how far the steps of the robust method reach ([`super::paper`] knows it of the other).
//! Going backwards from the vertices a tile owns:
//!
//! | needed | where | because |
//! |---|---|---|
//! | links | owned vertices | the result |
//! | ridge, support, R | [`Reach::link_steps`] rings more | a path has so many steps |
//! | R | thinning radius around those, and their one-ring | a ridge vertex compares itself with them |
//! | theta, t | [`Reach::average_rounds`] rings around those | R is averaged along the line |
//! | theta, t, contrast | [`Reach::trace_steps`] rings around the supported ones | support is traced |
//! | smoothed positions | the same; positions [`Reach::smoothing_rounds`] rings around | walks see them |
//! | theta | [`Reach::contrast_steps`] rings around every contrast | walks across the line |
//! | repeated votes | [`Reach::further_votes`] rings around every theta | calm tensors vote further |
//! | narrow theta | the 27 level cubes around each of those | surroundings are told by a level; fitted patches lie inside |
//! | first tensors | [`Reach::revotes`] rings around every narrow theta | tensors vote again |
//! | refined normals | faces around those | |
//! | normals of earlier rounds | as many rings of faces as the local number of rounds K | [`round_demand`] |
//! | noise level | the 27 cubes around each such face | K and the kernel width |
//!
//! Rings are rings of the mesh and are certified: where a vertex whose surroundings are asked for lies outside the
//! loaded region, a [`Gap`] says so and the region grows. In: a tile mesh and its region. Out: lists of the vertices and
//! faces at which each step must be computed, or the gaps.

use super::cells::Cell;
use super::lattice::{Cube, CubeBox, Lattice};
use super::plan::{Plan, Scale};
use super::region::{Gap, Region};
use crate::config::method;
use crate::mesh::{TileMesh, concat};
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// The vertices of the patch that planes are fitted to lie nearer than the edge of a level cube, hence in the 27 cubes; all
/// refined normals around those are asked for already.
const _: () = assert!(method::FIT_FAR < method::LEVEL_CUBE);

/// How far each step reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Rings of a link path.
    pub link_steps: usize,
    /// Radius of thinning in mesh units.
    pub thin_radius: f64,
    /// Rings of the average along the line.
    pub average_rounds: usize,
    /// Rings of a support trace.
    pub trace_steps: usize,
    /// Rings of smoothing of the positions that walks along lines see.
    pub smoothing_rounds: usize,
    /// Rings of a contrast walk.
    pub contrast_steps: usize,
    /// Rings of the votes of calm tensors.
    pub further_votes: usize,
    /// Rings of the repeated tensor vote.
    pub revotes: usize,
    /// Share of the refinement rounds that is accounted for; 1 unless a test wants to see a thin halo caught.
    pub rounds: f64,
}

impl Reach {
    /// What the method reaches at this scale where no vertex has a larger K than `rounds`. All of it grows with K.
    pub fn new(scale: &Scale, rounds: u32) -> Reach {
        Reach {
            link_steps: method::LINK_STEPS,
            thin_radius: scale.length(method::THIN_RADIUS),
            average_rounds: Scale::average_rounds(rounds, true),
            trace_steps: method::TRACE_STEPS,
            smoothing_rounds: scale.smoothing_rounds(rounds),
            contrast_steps: scale.contrast_steps(rounds),
            further_votes: scale.further_votes(rounds),
            revotes: scale.rounds(method::REVOTES),
            rounds: 1.0,
        }
    }

    /// Every reach times `factor`, rounded down: for showing that a halo which is too thin does not go unnoticed.
    pub fn scaled(&self, factor: f64) -> Reach {
        let rings = |n: usize| (n as f64 * factor).floor() as usize;
        Reach {
            link_steps: rings(self.link_steps),
            thin_radius: self.thin_radius * factor,
            average_rounds: rings(self.average_rounds),
            trace_steps: rings(self.trace_steps),
            smoothing_rounds: rings(self.smoothing_rounds),
            contrast_steps: rings(self.contrast_steps),
            further_votes: rings(self.further_votes),
            revotes: rings(self.revotes),
            rounds: self.rounds * factor,
        }
    }

    /// A margin, in cubes, that is usually enough for a mesh with up to `rounds` refinement rounds: two levels reach up to
    /// two cubes each, the rings come on top. A ring is taken for a median edge: longer ones are better fetched one by
    /// one than by a margin all around.
    pub fn margin(&self, rounds: u32) -> i64 {
        let folded = (self.trace_steps + self.contrast_steps).max(self.average_rounds + 2);
        let rings = self.link_steps + folded + self.further_votes + self.revotes + 1 + rounds as usize;
        2 + 2 + (rings as f64 / method::LEVEL_CUBE).ceil() as i64
    }
}

/// A set of vertices and the rings around it.
#[derive(Clone, Debug, Default)]
pub struct Rings {
    /// Ring after ring, each ascending.
    list: Arc<Vec<u32>>,
    /// Where ring i ends.
    ends: Vec<usize>,
    /// How many rings there are.
    around: usize,
}

impl Rings {
    /// All vertices up to ring `ring` (0 is the set itself).
    pub fn within(&self, ring: usize) -> &[u32] {
        &self.list[..self.ends[ring.min(self.ends.len() - 1)]]
    }

    /// All vertices.
    pub fn all(&self) -> &[u32] {
        &self.list
    }

    /// How many rings there are around the set. A set that is everything has as many as are asked for.
    pub fn rings(&self) -> usize {
        self.around
    }

    /// Grows `seeds` (ascending) by `rings` rings. Vertices at which the mesh was not loaded whole become gaps.
    pub(super) fn grow(tile: &Loaded, seeds: Vec<u32>, rings: usize, gaps: &mut HashSet<Gap>) -> Rings {
        let mesh = tile.mesh;
        let inside: Vec<AtomicBool> = marks(mesh.vertex_count(), &[&seeds]);
        let (mut ends, mut list) = (vec![seeds.len()], seeds);
        for ring in 0..rings {
            let from = if ring == 0 { 0 } else { ends[ring - 1] };
            // A ring that is known in part already tells where it leads: fewer loads than waiting for all of it.
            let of_chunk = |chunk: &[u32]| {
                let rows = chunk.iter().flat_map(|&v| mesh.ring.row(v)).copied();
                let is_new = |u: &u32| {
                    let inside = &inside[*u as usize];
                    !inside.load(Relaxed) && !inside.swap(true, Relaxed)
                };
                let unsure = chunk.iter().copied().filter(|&v| !mesh.complete[v as usize]);
                (rows.filter(is_new).collect(), unsure.collect())
            };
            let (next, unsure): (Vec<Vec<u32>>, Vec<Vec<u32>>) =
                list[from..].par_chunks(CHUNK).map(of_chunk).unzip();
            unsure.into_iter().flatten().for_each(|v| _ = tile.certified(v, rings - ring, gaps));
            let mut next = concat(&next);
            next.par_sort_unstable();
            list.extend(next);
            ends.push(list.len());
        }
        Rings { list: Arc::new(list), ends, around: rings }
    }

    /// A set (ascending) without any rings around it.
    pub(super) fn set(list: Arc<Vec<u32>>) -> Rings {
        Rings { ends: vec![list.len()], list, around: 0 }
    }

    /// The vertices in ascending order; there are `vertices` in all.
    pub(super) fn sorted(&self, vertices: usize) -> Vec<u32> {
        union(vertices, &[&self.list])
    }
}

/// Vertices or faces handled by one parallel task.
const CHUNK: usize = 4096;

/// Which of `vertices` vertices are in one of `lists`.
fn marks(vertices: usize, lists: &[&[u32]]) -> Vec<AtomicBool> {
    let marks: Vec<AtomicBool> = (0..vertices).into_par_iter().map(|_| AtomicBool::new(false)).collect();
    let all = lists.par_iter().flat_map(|list| list.par_iter());
    all.for_each(|&v| marks[v as usize].store(true, Relaxed));
    marks
}

/// The vertices that are in one of `lists`, ascending.
fn union(vertices: usize, lists: &[&[u32]]) -> Vec<u32> {
    let marks = marks(vertices, lists);
    (0..vertices as u32).into_par_iter().filter(|&v| marks[v as usize].load(Relaxed)).collect()
}

/// A loaded tile with the region that was loaded for it.
pub struct Loaded<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// What was loaded.
    pub region: &'a Region,
    /// The cubes of the region.
    pub lattice: &'a Lattice,
}

impl Loaded<'_> {
    fn cube(&self, v: u32) -> Cube {
        self.lattice.cube_of(self.mesh.position(v))
    }

    /// Whether everything around `v` was loaded; if not, notes a gap from which `rings` more may be asked for.
    pub(super) fn certified(&self, v: u32, rings: usize, gaps: &mut HashSet<Gap>) -> bool {
        let complete = self.mesh.complete[v as usize];
        if !complete {
            // Edges are as long as those around; the ones that are loaded tell.
            let ring = self.mesh.ring.row(v);
            let length = |&u: &u32| (self.mesh.position(u) - self.mesh.position(v)).length();
            let edge = ring.iter().map(length).sum::<f64>() / ring.len().max(1) as f64;
            gaps.insert(Gap { cube: self.cube(v), margin: self.cubes(rings, edge) });
        }
        complete
    }

    /// Notes the cubes that a level at `cube` needs and that were not loaded; `rings` more, of edges as long as `edge`, may
    /// be asked for from there.
    fn level_gaps(&self, cube: Cube, rings: usize, edge: f64, gaps: &mut HashSet<Gap>) {
        if !self.region.covers_level(cube) {
            let missing = CubeBox::around(cube).cubes().filter(|&c| !self.region.contains(c));
            let margin = self.cubes(rings, edge);
            gaps.extend(missing.map(|cube| Gap { cube, margin }));
        }
    }

    /// How many cubes so many rings of edges as long as `edge` may cross.
    fn cubes(&self, rings: usize, edge: f64) -> u32 {
        (rings as f64 * edge / self.lattice.edge).ceil() as u32
    }
}

/// Where each step has to be computed.
#[derive(Debug, Default)]
pub struct Demand {
    /// Vertices the tile owns, ascending.
    pub owned: Arc<Vec<u32>>,
    /// Where support, threshold, noise and ridges are asked for.
    pub linked: Arc<Vec<u32>>,
    /// Where contrast and stops are asked for.
    pub traced: Arc<Vec<u32>>,
    /// Where smoothed positions are asked for, with a ring for each round of smoothing.
    pub smoothed: Rings,
    /// Where R is asked for, with a ring for each averaging round.
    pub thinned: Rings,
    /// Where theta is asked for, with a ring for each further vote.
    pub folded: Rings,
    /// Where narrow theta is asked for, with a ring for each repeated vote.
    pub voted: Rings,
}

impl Demand {
    /// Everything everywhere: the tile is the whole mesh.
    pub(super) fn everything(vertices: usize, reach: &Reach) -> Demand {
        let all: Arc<Vec<u32>> = Arc::new((0..vertices as u32).into_par_iter().collect());
        // Every vertex is in the set itself, and in each of the rings around it.
        let everything = |rings| Rings { around: rings, ..Rings::set(all.clone()) };
        Demand {
            owned: all.clone(),
            linked: all.clone(),
            traced: all.clone(),
            smoothed: everything(reach.smoothing_rounds),
            thinned: everything(reach.average_rounds),
            folded: everything(reach.further_votes),
            voted: everything(reach.revotes),
        }
    }
}

/// What the owned vertices depend on, or the gaps that were found on the way.
pub fn vertex_demand(tile: &Loaded, cell: &Cell, reach: &Reach) -> (Demand, HashSet<Gap>) {
    let mesh = tile.mesh;
    let mut gaps = HashSet::new();
    if tile.region.is_everything() {
        return (Demand::everything(mesh.vertex_count(), reach), gaps);
    }
    let n = mesh.vertex_count();
    let owned: Vec<u32> = (0..n as u32).into_par_iter().filter(|&v| cell.owns(mesh.position(v))).collect();
    let linked = Rings::grow(tile, owned.clone(), reach.link_steps, &mut gaps).sorted(n);
    let thinning = Thinning {
        rings_from_owned: reach.link_steps,
        radius: reach.thin_radius,
        onward: reach.average_rounds,
    };
    let compared = balls(tile, cell, &linked, &thinning, &mut gaps);
    let thinned = Rings::grow(tile, compared, reach.average_rounds, &mut gaps);
    let traced = Rings::grow(tile, linked.clone(), reach.trace_steps, &mut gaps).sorted(n);
    let smoothed = Rings::grow(tile, traced.clone(), reach.smoothing_rounds, &mut gaps);
    let walked = Rings::grow(tile, traced.clone(), reach.contrast_steps, &mut gaps);
    let folded = union(n, &[walked.all(), thinned.all()]);
    let folded = Rings::grow(tile, folded, reach.further_votes, &mut gaps);
    let voted = in_level_cubes(tile, folded.all(), reach, &mut gaps);
    let voted = Rings::grow(tile, voted, reach.revotes, &mut gaps);
    // The first tensors of the outermost ring need all faces around them.
    let unsure: Vec<u32> = voted.all().par_iter().copied().filter(|&v| !mesh.complete[v as usize]).collect();
    unsure.into_iter().for_each(|v| _ = tile.certified(v, 1, &mut gaps));
    let [owned, linked, traced] = [owned, linked, traced].map(Arc::new);
    (Demand { owned, linked, traced, smoothed, thinned, folded, voted }, gaps)
}

/// What thinning looks at.
pub(super) struct Thinning {
    /// Rings of the seeds around the owned vertices.
    pub rings_from_owned: usize,
    /// Radius in mesh units.
    pub radius: f64,
    /// Rings that will be asked for from what is looked at: a guess for the margin of a gap.
    pub onward: usize,
}

/// `seeds` and every vertex that thinning at one of them looks at, ascending.
pub(super) fn balls(
    tile: &Loaded,
    cell: &Cell,
    seeds: &[u32],
    thinning: &Thinning,
    gaps: &mut HashSet<Gap>,
) -> Vec<u32> {
    // Deep inside the cell a ball holds owned vertices only, and the one-rings of those are among the seeds. A hundredth
    // more than the radius is far above the rounding of a distance.
    let margin = DVec3::splat(1.01 * thinning.radius);
    let deep = |p: DVec3| thinning.rings_from_owned > 0 && cell.owns(p - margin) && cell.owns(p + margin);
    let shallow: Vec<u32> = seeds.par_iter().copied().filter(|&v| !deep(tile.mesh.position(v))).collect();
    let found: Vec<(Vec<u32>, Vec<u32>)> =
        shallow.par_chunks(1024).map(|chunk| balls_of(tile.mesh, chunk, thinning.radius)).collect();
    let (looked_at, outside): (Vec<Vec<u32>>, Vec<Vec<u32>>) = found.into_iter().unzip();
    outside.into_iter().flatten().for_each(|u| _ = tile.certified(u, thinning.onward, gaps));
    union(tile.mesh.vertex_count(), &[seeds, &looked_at.concat()])
}

/// The vertices looked at from `seeds`, and those among them whose surroundings were not loaded whole.
fn balls_of(mesh: &TileMesh, seeds: &[u32], radius: f64) -> (Vec<u32>, Vec<u32>) {
    let (mut looked_at, mut outside) = (Vec::new(), Vec::new());
    let mut ball = Vec::new();
    for &v in seeds {
        let hub = mesh.is_hub(v);
        ball.clear();
        ball.push(v);
        let mut next = 0;
        while next < ball.len() {
            let u = ball[next];
            next += 1;
            if !mesh.complete[u as usize] {
                outside.push(u);
            }
            if u != v && mesh.is_hub(u) {
                continue;
            }
            for &w in mesh.ring.row(u) {
                looked_at.push(w);
                let d = mesh.position(w) - mesh.position(v);
                let more = !hub && ball.len() < method::THIN_MOST;
                if more && d.dot(d) <= radius * radius && !ball.contains(&w) {
                    ball.push(w);
                }
            }
        }
    }
    looked_at.sort_unstable();
    looked_at.dedup();
    (looked_at, outside)
}

/// The vertices whose theta enters the level at one of `seeds`.
fn in_level_cubes(tile: &Loaded, seeds: &[u32], reach: &Reach, gaps: &mut HashSet<Gap>) -> Vec<u32> {
    let mut centres: Vec<Cube> = seeds.par_iter().map(|&v| tile.cube(v)).collect();
    centres.par_sort_unstable();
    centres.dedup();
    let mut support: FxHashSet<Cube> = FxHashSet::default();
    // The lattice is made of median edges.
    let ring = tile.lattice.edge / method::LEVEL_CUBE;
    for &cube in &centres {
        tile.level_gaps(cube, reach.revotes + 1, ring, gaps);
        support.extend(CubeBox::around(cube).cubes());
    }
    (0..tile.mesh.vertex_count() as u32)
        .into_par_iter()
        .filter(|&v| support.contains(&tile.cube(v)))
        .collect()
}

/// Gaps at the vertices where K is asked for, but the noise level is not known because the region is too small.
pub fn noise_demand(tile: &Loaded, demand: &Demand, known: impl Fn(u32) -> bool + Sync) -> HashSet<Gap> {
    let mut gaps = HashSet::new();
    for rings in [&demand.folded, &demand.smoothed] {
        let unknown: Vec<u32> = rings.all().par_iter().copied().filter(|&v| !known(v)).collect();
        unknown.into_iter().for_each(|v| tile.level_gaps(tile.cube(v), 0, 0.0, &mut gaps));
    }
    gaps
}

/// How many refinement rounds of each face are needed, from the rounds `rounds` that each face takes part in (`None`
/// where its noise level is not known) and the vertices whose surrounding faces are needed in their final state.
///
/// A face that needs its n-th round needs what its neighbours were after round n - 1. Also returns the gaps.
pub fn round_demand(
    tile: &Loaded,
    plan: &Plan,
    voted: &Rings,
    rounds: &[Option<u32>],
    reach: &Reach,
) -> (Vec<u32>, HashSet<Gap>) {
    let mesh = tile.mesh;
    if tile.region.is_everything() {
        return (rounds.par_iter().map(|k| k.unwrap_or(0)).collect(), HashSet::new());
    }
    // More rounds than a face takes part in there are not, however wide the halo.
    let counted = |k: u32| k.min((f64::from(k) * reach.rounds).floor() as u32);
    let most: Vec<Option<u32>> = rounds.iter().map(|k| k.map(counted)).collect();
    let mut asking = Asking {
        tile,
        most: &most,
        limit: plan.scale.rounds(method::REFINE_ROUNDS) as u32,
        settled: marks(mesh.vertex_count(), &[voted.all()]),
        needed: Vec::new(),
        seen: Vec::new(),
        queue: Vec::new(),
        gaps: HashSet::new(),
    };
    asking.begin();
    asking.spread();
    (asking.needed, asking.gaps)
}

/// The search of [`round_demand`].
struct Asking<'a> {
    tile: &'a Loaded<'a>,
    /// Rounds that each face takes part in, where that is known.
    most: &'a [Option<u32>],
    /// Most rounds of any face.
    limit: u32,
    /// All faces around a settled vertex are asked for in their final state.
    settled: Vec<AtomicBool>,
    needed: Vec<u32>,
    seen: Vec<bool>,
    /// Faces by the number of rounds they need, to be asked what they need in turn.
    queue: Vec<Vec<u32>>,
    gaps: HashSet<Gap>,
}

impl Asking<'_> {
    /// Asks for all faces around settled vertices.
    fn begin(&mut self) {
        let Asking { tile: Loaded { mesh, .. }, most, limit, .. } = *self;
        let settled = |v: &u32| self.settled[*v as usize].load(Relaxed);
        let seen: Vec<bool> = mesh.corners.par_iter().map(|corners| corners.iter().any(settled)).collect();
        let rounds = |(seen, most): (&bool, &Option<u32>)| if *seen { most.unwrap_or(limit) } else { 0 };
        let needed = seen.par_iter().zip(most).map(rounds).collect();
        let faces = || (0..mesh.face_count() as u32).into_par_iter().filter(|&f| seen[f as usize]);
        let unknown: Vec<u32> = faces().filter(|&f| most[f as usize].is_none()).collect();
        // Around the others there is nobody who was not asked already.
        let at_rim: Vec<u32> = faces().filter(|&f| !mesh.corners[f as usize].iter().all(settled)).collect();
        (self.seen, self.needed) = (seen, needed);
        unknown.into_iter().for_each(|f| self.note_unknown(f, limit));
        at_rim.into_iter().for_each(|f| self.enqueue(f));
    }

    /// Face `f` is needed as it is after `n` rounds, or after its last one.
    fn ask(&mut self, f: u32, n: u32) {
        let first = !std::mem::replace(&mut self.seen[f as usize], true);
        // A face whose noise is not known may need as many rounds as any: fewer loads than waiting until it is.
        let n = n.min(self.most[f as usize].unwrap_or(self.limit));
        if first && self.most[f as usize].is_none() {
            self.note_unknown(f, n);
        }
        if n > self.needed[f as usize] {
            self.needed[f as usize] = n;
            self.enqueue(f);
        }
    }

    /// The noise of face `f`, of which `n` rounds are needed, is not known: notes what is missing.
    fn note_unknown(&mut self, f: u32, n: u32) {
        let mesh = self.tile.mesh;
        let [a, b, c] = mesh.corners[f as usize].map(|v| mesh.position(v));
        let edge = ((a - b).length() + (b - c).length() + (c - a).length()) / 3.0;
        let cube = self.tile.lattice.cube_of(mesh.barycentre(f));
        self.tile.level_gaps(cube, n as usize, edge, &mut self.gaps);
    }

    fn enqueue(&mut self, f: u32) {
        let n = self.needed[f as usize] as usize;
        if self.queue.len() <= n {
            self.queue.resize(n + 1, Vec::new());
        }
        self.queue[n].push(f);
    }

    /// Asks the neighbours of each face for one round less, most rounds first.
    fn spread(&mut self) {
        let tile = self.tile;
        for n in (1..self.queue.len()).rev() {
            for f in std::mem::take(&mut self.queue[n]) {
                if self.needed[f as usize] > n as u32 {
                    continue; // was asked for more rounds since, and dealt with then
                }
                let corners = tile.mesh.corners[f as usize];
                for v in corners {
                    // Around a hub nobody votes.
                    if self.settled[v as usize].load(Relaxed) || tile.mesh.is_hub(v) {
                        continue;
                    }
                    tile.certified(v, n, &mut self.gaps);
                    tile.mesh.faces_around.row(v).iter().for_each(|&g| self.ask(g, n as u32 - 1));
                }
            }
        }
    }
}

/// The largest margin for each cube: what the region grows by.
pub fn merge(gaps: HashSet<Gap>) -> Vec<Gap> {
    let mut most: HashMap<Cube, u32> = HashMap::new();
    #[expect(clippy::iter_over_hash_type, reason = "a maximum for each cube does not depend on the order")]
    for gap in gaps {
        let margin = most.entry(gap.cube).or_default();
        *margin = gap.margin.max(*margin);
    }
    let mut merged: Vec<Gap> = most.into_iter().map(|(cube, margin)| Gap { cube, margin }).collect();
    merged.sort_unstable();
    merged
}
