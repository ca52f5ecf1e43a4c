//! Step A, second half: face normals vote for each other until the noise is gone and the creases are not.
//!
//! In: normals, areas, and how many rounds each face takes part in. Out: refined normals. Guy and Medioni (1997) let tokens
//! refine each other before they vote; the kernel is that of a bilateral filter, with two departures: its range is scaled
//! by the local noise, and a face stops after as many rounds as its noise asks for.
//!
//! Rounds are most of the work of a noisy mesh, so that each face keeps a list of its voters from the first round on.

use super::normals::{FaceGeometry, rounds, seen_from};
use crate::config::method;
use crate::math::{DEGREE, unit};
use crate::mesh::{Beyond, HUB, TileMesh};
use crate::partition::Scale;
use glam::DVec3;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::ops::Range;

/// Faces handled by one parallel task.
const CHUNK: usize = 4096;

/// What is refined. It is used up: the rounds take more memory than any other step.
#[derive(Clone, Debug, Default)]
pub struct Noisy {
    /// Normal of each face.
    pub normals: Vec<DVec3>,
    /// Noise level of each face, where it is known.
    pub s0: Vec<Option<f64>>,
    /// How many rounds each face takes part in, the first ones. Where that is not 0, the noise level must be known.
    pub needed: Vec<u32>,
}

/// Refines the normals.
pub fn refine(mesh: &TileMesh, faces: &FaceGeometry, scale: &Scale, noisy: Noisy) -> Vec<DVec3> {
    let Noisy { normals, s0, needed } = noisy;
    let both = normals.into_par_iter().zip(&faces.areas);
    let mut voters: Vec<Voter> = both.map(|(normal, &area)| Voter { normal, area }).collect();
    let mut chunks: Vec<Chunk> = (0..mesh.face_count() as u32)
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let end = (first as usize + CHUNK).min(mesh.face_count()) as u32;
            Chunk::new(mesh, first..end, &s0, &needed)
        })
        .collect();
    let rounds = needed.par_iter().copied().max().unwrap_or(0);
    // Only builds with debug assertions look at these again.
    let (s0, needed) = if cfg!(debug_assertions) { (s0, needed) } else { Default::default() };
    for round in 0..rounds {
        chunks.par_iter_mut().for_each(|chunk| {
            debug_assert!(
                chunk.is_ready(mesh, scale, &s0, &needed, round),
                "round {round}: a neighbour lies outside what the halo covers"
            );
            chunk.vote(&voters, faces, round);
        });
        voters.par_chunks_mut(CHUNK).zip(&chunks).for_each(|(voters, chunk)| chunk.write(voters));
    }
    drop(chunks);
    voters.into_par_iter().map(|voter| voter.normal).collect()
}

/// A face as its neighbours see it: what a round reads of it lies together.
#[derive(Clone, Copy)]
struct Voter {
    normal: DVec3,
    area: f64,
}

/// Faces that take part in rounds, of `CHUNK` that have consecutive numbers.
struct Chunk {
    first: u32,
    /// Those with most rounds come first: whose turn it is are the first ones.
    turns: Vec<Turn>,
    /// Voters of all of them.
    lists: Vec<u32>,
    /// Normals after this round, of those whose turn it was.
    next: Vec<DVec3>,
}

/// A face that takes part in a round.
struct Turn {
    s0: f64,
    face: u32,
    /// Rounds that it takes part in.
    rounds: u16,
    /// Votes of the face itself: its corners that are no hubs.
    own: u16,
    /// Its voters, behind those of the turn before: how many have two votes, and how many, behind these, have one.
    two: u16,
    one: u16,
}

/// No face takes part in more rounds, and none has more voters than hubs leave it.
const _: () = {
    let widest = method::SIGMA_EDGES_RANGE.1 / method::SIGMA_EDGES;
    assert!(method::REFINE_ROUNDS * widest * widest < u16::MAX as f64 && 3 * HUB < u16::MAX as usize);
};

impl Chunk {
    fn new(mesh: &TileMesh, faces: Range<u32>, s0: &[Option<f64>], needed: &[u32]) -> Chunk {
        let mut chunk = Chunk { first: faces.start, turns: Vec::new(), lists: Vec::new(), next: Vec::new() };
        let mut scratch = Vec::new();
        let mut faces: Vec<(u32, u32)> =
            faces.map(|face| (needed[face as usize], face)).filter(|(rounds, _)| *rounds > 0).collect();
        faces.sort_by_key(|(rounds, _)| Reverse(*rounds));
        chunk.turns.reserve_exact(faces.len());
        for (rounds, face) in faces {
            let list = chunk.lists.len();
            let (own, two) = voters_of(mesh, face, &mut chunk.lists, &mut scratch);
            chunk.turns.push(Turn {
                s0: s0[face as usize].unwrap_or(0.0),
                face,
                rounds: rounds as u16,
                own: own as u16,
                two: two as u16,
                one: (chunk.lists.len() - list - two) as u16,
            });
        }
        chunk.next.reserve_exact(chunk.turns.len());
        chunk.lists.shrink_to_fit();
        chunk
    }

    /// One round.
    fn vote(&mut self, voters: &[Voter], faces: &FaceGeometry, round: u32) {
        let Chunk { turns, lists, next, .. } = self;
        next.clear();
        let mut lists = lists.as_slice();
        for turn in turns.iter().take_while(|turn| u32::from(turn.rounds) > round) {
            let width = range_width(turn.s0, round);
            let (two, rest) = lists.split_at(usize::from(turn.two));
            let (one, rest) = rest.split_at(usize::from(turn.one));
            lists = rest;
            let own = voters[turn.face as usize];
            let opposed = faces.opposed_to(turn.face);
            let mut ballot = Ballot::new(own, f64::from(turn.own), width);
            // Where windings agree, which is almost everywhere, nobody is turned.
            if opposed.is_empty() {
                two.iter().for_each(|&g| ballot.cast(voters[g as usize], 2.0));
                one.iter().for_each(|&g| ballot.cast(voters[g as usize], 1.0));
            } else {
                let seen = |g: u32| {
                    let Voter { normal, area } = voters[g as usize];
                    Voter { normal: seen_from(own.normal, opposed, g, normal), area }
                };
                two.iter().for_each(|&g| ballot.cast(seen(g), 2.0));
                one.iter().for_each(|&g| ballot.cast(seen(g), 1.0));
            }
            next.push(ballot.result());
        }
    }

    /// Has the round seen by the next one; `voters` are those of this chunk.
    fn write(&self, voters: &mut [Voter]) {
        for (turn, &normal) in self.turns.iter().zip(&self.next) {
            voters[(turn.face - self.first) as usize].normal = normal;
        }
    }

    /// Whether all voters have done the rounds before `round` that they take part in: the halo is wide enough.
    fn is_ready(
        &self,
        mesh: &TileMesh,
        scale: &Scale,
        s0: &[Option<f64>],
        needed: &[u32],
        round: u32,
    ) -> bool {
        let ready = |&g: &u32| {
            let most = s0[g as usize].map_or(u32::MAX, |s0| rounds(scale, s0));
            needed[g as usize] >= most.min(round)
        };
        self.turns.iter().take_while(|turn| u32::from(turn.rounds) > round).all(|turn| {
            let corners = mesh.corners[turn.face as usize];
            let mut seen_through = corners.iter().filter(|&&v| !mesh.is_hub(v));
            seen_through.all(|&v| mesh.faces_of(v).iter().all(ready))
        })
    }
}

/// The faces around the corners of `f` vote on its normal, once for each corner: those that share two corners twice, `f`
/// itself three times; not around hubs. Adds those with two votes and then those with one to `list`, and returns how often
/// `f` votes and how many have two votes. Their order is one of ids and corners.
fn voters_of(mesh: &TileMesh, f: u32, list: &mut Vec<u32>, scratch: &mut Vec<u32>) -> (u32, usize) {
    let corners = mesh.corners[f as usize];
    let across = [0, 1, 2].map(|side| mesh.across.beyond(f, side));
    let first = list.len();
    if !across.contains(&Beyond::Several) && !corners.iter().any(|&v| mesh.is_hub(v)) {
        // Almost always: who shares two corners lies across an edge.
        let beside = across.map(|beyond| if let Beyond::One(g) = beyond { g } else { f });
        list.extend(beside.iter().filter(|&&g| g != f));
        let two = list.len() - first;
        let rows = corners.map(|v| mesh.faces_of(v));
        let mut end = list.len();
        list.resize(end + rows.iter().map(|row| row.len()).sum::<usize>(), 0);
        for (i, row) in rows.into_iter().enumerate() {
            let [after, before] = [beside[i], beside[(i + 2) % 3]];
            for &g in row {
                // Without a branch: which way it goes cannot be guessed.
                list[end] = g;
                end += usize::from((g != f) & (g != after) & (g != before));
            }
        }
        list.truncate(end);
        return (3, two);
    }
    scratch.clear();
    let seen_through = corners.iter().filter(|&&v| !mesh.is_hub(v));
    seen_through.clone().for_each(|&v| scratch.extend(mesh.faces_of(v)));
    scratch.retain(|&g| g != f);
    scratch.sort_unstable_by_key(|&g| mesh.face_ids[g as usize]);
    let votes = || scratch.chunk_by(|a, b| a == b);
    list.extend(votes().filter(|votes| votes.len() > 1).map(|votes| votes[0]));
    let two = list.len() - first;
    list.extend(votes().filter(|votes| votes.len() == 1).map(|votes| votes[0]));
    (seen_through.count() as u32, two)
}

/// Votes on one normal: each voter has its area, and counts by how well it agrees.
struct Ballot {
    own: Voter,
    inverse2: f64,
    sum: DVec3,
}

impl Ballot {
    /// With the votes of the face itself.
    fn new(own: Voter, votes: f64, width: f64) -> Ballot {
        Ballot { own, inverse2: 1.0 / (width * width), sum: own.normal * (votes * own.area) }
    }

    #[inline]
    fn cast(&mut self, voter: Voter, votes: f64) {
        let d = self.own.normal - voter.normal;
        let t = 1.0 - d.dot(d) * self.inverse2;
        let t = if t > 0.0 { t } else { 0.0 };
        self.sum += voter.normal * (t * t * (votes * voter.area));
    }

    fn result(&self) -> DVec3 {
        if self.sum.dot(self.sum) > 0.0 { unit(self.sum) } else { self.own.normal }
    }
}

/// Width of the range kernel as a chord: wide in the first round, where single normals are worst.
fn range_width(s0: f64, round: u32) -> f64 {
    let width = if round == 0 {
        2.0 * method::RANGE_KAPPA * s0
    } else {
        let early = round <= method::RANGE_EARLY_ROUNDS;
        let widest = if early { method::RANGE_EARLY_DEG } else { method::RANGE_MAX_DEG };
        (method::RANGE_KAPPA * s0).min(widest * DEGREE)
    };
    width.max(method::RANGE_MIN_DEG * DEGREE)
}
