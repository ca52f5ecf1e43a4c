//! Step D, first part: a band of features becomes a ridge one vertex wide.
//!
//! In: support and votes. Out: R, the fold angle averaged along the line so that noise does not break the ridge up, and
//! the feature vertices whose R no vertex across the line exceeds.

use crate::config::method;
use crate::mesh::{Field, TileMesh};
use crate::partition::{Rings, Scale};
use crate::refine::Support;
use crate::voting::{Stop, Surroundings, Vote};

/// Averages theta along the line: at each vertex for as many rounds as its noise (`rounds`, K of each vertex) and its
/// surroundings ask for.
pub fn average_along(
    mesh: &TileMesh,
    votes: &Field<Vote>,
    surroundings: &Field<Surroundings>,
    rounds: &[u32],
    thinned: &Rings,
) -> Field<f64> {
    let n = mesh.vertex_count();
    let most = thinned.rings();
    let mut r = Field::compute(n, thinned.all(), |v| votes.get(v).theta);
    for round in 1..=most {
        r = Field::compute(n, thinned.within(most - round), |v| {
            let own = Scale::average_rounds(rounds[v as usize], surroundings.get(v).calm);
            debug_assert!(own <= most, "round {own} of R lies outside what the halo covers");
            if own >= round { average(mesh, votes, &r, v) } else { r.get(v) }
        });
    }
    r
}

/// One vertex, one round: neighbours along the line whose own lines run the same way count; perpendicular creases do
/// not leak into each other.
fn average(mesh: &TileMesh, votes: &Field<Vote>, r: &Field<f64>, v: u32) -> f64 {
    let t = votes.get(v).t;
    let (mut sum, mut weights) = (r.get(v), 1.0);
    for &u in mesh.ring_of(v) {
        let e = mesh.position(u) - mesh.position(v);
        let length2 = e.dot(e);
        if length2 > 0.0 {
            let along = e.dot(t);
            let same = t.dot(votes.get(u).t);
            let weight = (along * along / length2) * (along * along / length2) * same * same;
            sum += weight * r.get(u);
            weights += weight;
        }
    }
    sum / weights
}

/// Non-maximum suppression at the vertices of `at`; `rounds` is K of each vertex.
#[expect(clippy::too_many_arguments, reason = "all of it decides, and nothing else takes the same")]
pub fn ridges(
    mesh: &TileMesh,
    scale: &Scale,
    votes: &Field<Vote>,
    r: &Field<f64>,
    support: &Field<Support>,
    stops: &Field<Stop>,
    rounds: &[u32],
    at: &[u32],
) -> Field<bool> {
    let radius = scale.length(method::THIN_RADIUS);
    Field::compute(mesh.vertex_count(), at, |v| {
        let vote = votes.get(v);
        support.get(v).feature()
            && !stops.get(v).boundary
            && vote.near() >= scale.own_share(rounds[v as usize]) * vote.far
            && is_largest_across(mesh, radius, votes, r, v)
    })
}

/// Whether no vertex seen across the line, reached by one-ring steps within `radius` (the one-ring always) and through no
/// hub, has a larger R, or the same and a lower id.
fn is_largest_across(mesh: &TileMesh, radius: f64, votes: &Field<Vote>, r: &Field<f64>, v: u32) -> bool {
    let (vote, own, origin) = (votes.get(v), r.get(v), mesh.position(v));
    let hub = mesh.is_hub(v);
    // Not on the heap, where all threads would meet.
    let (mut ball, mut count) = ([v; method::THIN_MOST], 1);
    let mut next = 0;
    while next < count {
        let u = ball[next];
        next += 1;
        if u != v && mesh.is_hub(u) {
            continue;
        }
        for &w in mesh.ring_of(u) {
            let e = mesh.position(w) - origin;
            let inside = e.dot(e) <= radius * radius;
            // A ball is a dozen vertices; looking through it is cheaper than a set.
            if (!inside && u != v) || ball[..count].contains(&w) {
                continue;
            }
            // Around a hub, its neighbours are enough.
            if inside && !hub && count < method::THIN_MOST {
                ball[count] = w;
                count += 1;
            }
            let (across, along) = (e.dot(vote.b), e.dot(vote.t));
            if across * across >= method::THIN_SIDE * along * along
                && (r.get(w) > own || (r.get(w) == own && mesh.id(w) < mesh.id(v)))
            {
                return false;
            }
        }
    }
    true
}
