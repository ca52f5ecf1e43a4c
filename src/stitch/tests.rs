//! Streamed stitching against the whole graph at once, on random graphs over a grid that is cut into tiles.

mod groups;

use super::open::OpenComponents;
use super::*;
use crate::config::method;
use crate::math::Quadric;
use crate::mesh::{TileId, VertexId};
use crate::partition::Scale;
use crate::refine::{Bend, Fit};
use glam::DVec3;
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// Vertices on a side of the grid.
const SIDE: u64 = 14;
/// Nothing is longer than its diagonals.
const SCALE: Scale = Scale { h: 1.0, k: 1.0 };

/// A candidate graph along the edges and diagonals of a grid, and who owns what of it.
#[derive(Clone, Debug)]
struct World {
    candidates: Vec<Candidate>,
    /// Paths, from the vertex whose owner hands them over.
    links: Vec<(Vec<u64>, f64)>,
    open_edges: Vec<OpenEdge>,
    owner: Vec<u32>,
    tiles: u32,
}

fn neighbours(v: u64) -> impl Iterator<Item = u64> {
    let (x, y) = (v % SIDE, v / SIDE);
    let around = |c: u64| c.saturating_sub(1)..(c + 2).min(SIDE);
    around(y).flat_map(move |b| around(x).map(move |a| b * SIDE + a)).filter(move |&u| u != v)
}

impl World {
    /// Everything flat and strong, without lines, in vertical strips.
    fn plain(tiles: u32) -> World {
        let candidate = |id: u64| Candidate {
            id: VertexId(id),
            position: DVec3::new((id % SIDE) as f64, (id / SIDE) as f64, 0.0),
            theta: 1.0,
            fit: Fit { angle: 1.0, bend: Bend::Convex, quadric: Quadric::default() },
            salience: 1.0,
            class: Class::Sharp,
            corner: false,
            stop: false,
            strong: true,
            rounds: 0,
        };
        let owner = |v: u64| ((v % SIDE) * u64::from(tiles) / SIDE) as u32;
        World {
            candidates: (0..SIDE * SIDE).map(candidate).collect(),
            links: Vec::new(),
            open_edges: Vec::new(),
            owner: (0..SIDE * SIDE).map(owner).collect(),
            tiles,
        }
    }

    /// Links from vertex to vertex, each handed over by the owner of its first.
    fn with_line(mut self, vertices: impl IntoIterator<Item = (u64, u64)>) -> World {
        let ids: Vec<u64> = vertices.into_iter().map(|(x, y)| y * SIDE + x).collect();
        self.links.extend(ids.windows(2).map(|e| (e.to_vec(), 1.0)));
        self
    }

    /// Tiles that own something within the reach of a link.
    fn owners_near(&self, v: u64) -> BTreeSet<TileId> {
        let mut near = BTreeSet::from([v]);
        for _ in 0..method::LINK_STEPS {
            near.extend(near.clone().into_iter().flat_map(neighbours));
        }
        near.into_iter().map(|u| TileId(self.owner[u as usize])).collect()
    }

    /// What `tile` finds.
    fn fragments(&self, tile: TileId) -> Fragments {
        let owns = |v: u64| self.owner[v as usize] == tile.0;
        let links: Vec<LinkPath> = self.links.iter().filter(|(path, _)| owns(path[0])).map(link).collect();
        let open = self.open_edges.iter().copied().filter(|e| owns(e.ends[0].0));
        self.named(links, open.collect(), |v| {
            let tiles: Vec<TileId> = self.owners_near(v.0).into_iter().filter(|t| *t != tile).collect();
            (!tiles.is_empty()).then_some(Seam { vertex: v, tiles })
        })
    }

    /// What one tile as large as the world finds.
    fn whole(&self) -> Fragments {
        self.named(self.links.iter().map(link).collect(), self.open_edges.clone(), |_| None)
    }

    fn named(
        &self,
        links: Vec<LinkPath>,
        open_edges: Vec<OpenEdge>,
        seam: impl Fn(VertexId) -> Option<Seam>,
    ) -> Fragments {
        let ends = open_edges.iter().flat_map(|e| e.ends);
        let named: BTreeSet<VertexId> =
            links.iter().flat_map(|l| l.ids().iter().copied()).chain(ends).collect();
        let vertices: Vec<Candidate> = named.iter().map(|v| self.candidates[v.0 as usize]).collect();
        let largest_salience = vertices.iter().fold(0.0, |most: f64, v| most.max(v.salience));
        let seams = named.into_iter().filter_map(seam).collect();
        Fragments { vertices, links, open_edges, seams, largest_salience, defects: Defects::default() }
    }
}

fn link((path, weight): &(Vec<u64>, f64)) -> LinkPath {
    let mut ids: Vec<VertexId> = path.iter().map(|&v| VertexId(v)).collect();
    if ids[0] > ids[ids.len() - 1] {
        ids.reverse();
    }
    LinkPath::new(ids.into_iter(), *weight)
}

fn rules(shortest: f64, min_angle_deg: f64) -> Rules {
    Rules { scale: SCALE, shortest, min_angle_deg }
}

/// Stitches the tiles in this order. Both geometries, and how many links there were.
fn streamed(world: &World, order: &[u32], rules: Rules, lines: u64) -> ([LineSet; 2], u64) {
    within(world, order, rules, LineMemory { lines, ..LineMemory::UNBOUNDED })
}

/// The same with as much memory.
fn within(world: &World, order: &[u32], rules: Rules, memory: LineMemory) -> ([LineSet; 2], u64) {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let lines = memory.lines;
    let mut stitcher = Stitcher::new(rules, memory, &parent.path().into());
    for &tile in order {
        stitcher.take(close(world.fragments(TileId(tile)), &rules, &|_| ())).expect("room");
        stitcher.done(TileId(tile)).expect("room");
    }
    assert_eq!(stitcher.open(), Held::default(), "something is still open");
    let stitched = stitcher.finish().expect("room");
    assert!(lines > 0 || stitched.lines.spilled() || stitched.lines.counts().vertices < 2);
    let links = stitched.work.links;
    (both(stitched), links)
}

/// Both geometries, from one tile.
fn at_once(world: &World, rules: Rules) -> [LineSet; 2] {
    let mut stitcher = Stitcher::new(rules, LineMemory::UNBOUNDED, &Path::new("/nowhere").into());
    let share = close(world.whole(), &rules, &|_| ());
    assert!(share.open.is_empty());
    stitcher.take(share).expect("room");
    stitcher.done(TileId(0)).expect("room");
    both(stitcher.finish().expect("room"))
}

fn both(stitched: Stitched) -> [LineSet; 2] {
    let vertices = LineSet::collect(&stitched.lines).expect("readable");
    let fitted = stitched.lines.with_geometry(Geometry::Fitted);
    let fitted = LineSet::collect(&fitted).expect("readable");
    assert_eq!(vertices.clone().with_geometry(Geometry::Fitted), fitted);
    [vertices, fitted]
}

/// Vertices with all kinds of fits, strengths and stops.
fn candidates() -> impl Strategy<Value = Vec<Candidate>> {
    let one = (0u32..4, 0.0f64..2.0, -1.0f64..1.0, 0u32..10, 0u32..20);
    prop::collection::vec(one, (SIDE * SIDE) as usize).prop_map(|all| {
        let change = |(mut vertex, (salience, angle, tilt, luck, rounds)): (Candidate, _)| {
            let quadric = &mut vertex.fit.quadric;
            quadric.add_plane(DVec3::new(0.6, 0.8 * f64::signum(tilt), 0.0), 0.4 * tilt, 0.1);
            vertex.salience = f64::from(salience);
            vertex.fit.angle = angle;
            vertex.fit.bend = if tilt > 0.5 { Bend::Concave } else { Bend::Convex };
            vertex.corner = luck == 0;
            vertex.stop = luck < 2;
            vertex.strong = luck > 5;
            vertex.rounds = rounds;
            vertex
        };
        World::plain(1).candidates.into_iter().zip(all).map(change).collect()
    })
}

/// A path over the grid: where it starts, and which neighbour it goes to.
fn paths(most: usize) -> impl Strategy<Value = Vec<(Vec<u64>, f64)>> {
    let walk = (0..SIDE * SIDE, prop::collection::vec(0usize..8, 1..4), 1u32..4);
    let path = walk.prop_map(|(start, steps, weight)| {
        let mut path = vec![start];
        for step in steps {
            let at = path[path.len() - 1];
            let ways: Vec<u64> = neighbours(at).filter(|u| !path.contains(u)).collect();
            path.extend(ways.get(step % ways.len().max(1)));
        }
        (path, f64::from(weight))
    });
    prop::collection::vec(path, 0..most)
}

/// Lines that are drawn across the grid, as runs of short links.
fn strokes() -> impl Strategy<Value = Vec<(Vec<u64>, f64)>> {
    let stroke = (any::<bool>(), 0..SIDE, 0..SIDE, 0..SIDE, any::<bool>());
    prop::collection::vec(stroke, 0..8).prop_map(|all| {
        let mut links = Vec::new();
        for (upright, at, a, b, backwards) in all {
            let vertex = |i: u64| if upright { i * SIDE + at } else { at * SIDE + i };
            for i in a.min(b)..a.max(b) {
                let (from, to) = (vertex(i), vertex(i + 1));
                links.push((if backwards { vec![to, from] } else { vec![from, to] }, 2.0));
            }
        }
        links
    })
}

fn open_edges() -> impl Strategy<Value = Vec<OpenEdge>> {
    let edge = (0..SIDE * SIDE, 0usize..8, any::<bool>()).prop_map(|(a, way, crowded)| {
        let ways: Vec<u64> = neighbours(a).collect();
        let b = ways[way % ways.len()];
        OpenEdge { ends: [a.min(b), a.max(b)].map(VertexId), crowded }
    });
    prop::collection::vec(edge, 0..60)
}

fn worlds() -> impl Strategy<Value = World> {
    // Strips, or a patchwork without any sense.
    let owners = (1u32..7, any::<bool>()).prop_flat_map(|(tiles, strips)| {
        let patchwork = prop::collection::vec(0..tiles, (SIDE * SIDE) as usize);
        patchwork.prop_map(move |owner| (tiles, if strips { World::plain(tiles).owner } else { owner }))
    });
    let links = (paths(60), strokes());
    (candidates(), links, open_edges(), owners).prop_map(
        |(candidates, (mut links, strokes), open_edges, (tiles, owner))| {
            links.extend(strokes);
            World { candidates, links, open_edges, owner, tiles }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]
    #[test]
    fn streams_give_what_the_whole_gives(
        (world, order) in worlds().prop_flat_map(|world| {
            let order: Vec<u32> = (0..world.tiles).collect();
            (Just(world), Just(order).prop_shuffle())
        }),
        shortest in 0.0f64..8.0,
        min_angle in prop::sample::select(vec![0.0, 40.0, 60.0]),
        lines in prop::sample::select(vec![0, 1 << 14, u64::MAX]),
        open in prop::sample::select(vec![1 << 17, u64::MAX]),
    ) {
        let rules = rules(shortest, min_angle);
        let (stitched, _) = within(&world, &order, rules, LineMemory { open, lines, last: u64::MAX });
        prop_assert_eq!(stitched, at_once(&world, rules));
    }
}

#[test]
fn random_worlds_have_lines_of_all_kinds() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut kinds, mut closed, mut dropped) = (BTreeSet::new(), 0, 0);
    for _ in 0..40 {
        let world = worlds().new_tree(&mut runner).expect("a world").current();
        let [all, _] = at_once(&world, rules(2.0, 0.0));
        kinds.extend(all.lines.iter().map(|line| line.class));
        closed += all.lines.iter().filter(|line| line.closed).count();
        let [strong, _] = at_once(&world, rules(2.0, 60.0));
        dropped += usize::from(strong.lines.len() < all.lines.len());
    }
    assert!(kinds.len() == 4 && closed > 0 && dropped > 10, "{kinds:?}, {closed} closed, {dropped} dropped");
}

#[test]
fn a_line_through_all_tiles_is_one() {
    let world = World::plain(7).with_line((0..SIDE).map(|x| (x, 5)));
    for order in [[0, 1, 2, 3, 4, 5, 6], [6, 2, 4, 0, 5, 1, 3]] {
        let ([lines, _], links) = streamed(&world, &order, rules(2.0, 0.0), 0);
        assert_eq!(links, SIDE - 1);
        assert_eq!(lines.lines.len(), 1);
        assert_eq!(lines.lines[0].vertices, (0..SIDE as u32).collect::<Vec<_>>());
        assert_eq!(lines.lines[0].length, (SIDE - 1) as f64);
    }
}

#[test]
fn a_loop_across_seams_is_closed() {
    let (low, high) = (2, SIDE - 3);
    let sides = (low..high).map(|x| (x, low)).chain((low..high).map(|y| (high, y)));
    let back = (low..high).map(|i| (high + low - i, high)).chain((low..=high).map(|i| (low, high + low - i)));
    let world = World::plain(4).with_line(sides.chain(back));
    let ([lines, _], _) = streamed(&world, &[3, 0, 2, 1], rules(2.0, 0.0), 0);
    assert_eq!((lines.lines.len(), lines.lines[0].closed), (1, true));
    assert_eq!(lines.lines[0].length, 4.0 * (high - low) as f64);
}

#[test]
fn what_no_other_tile_can_name_is_finished_in_the_tile() {
    // Two strips of 7 columns. Column 3 is the last from which the other one is 4 steps away.
    let world = World::plain(2).with_line((0..9).map(|y| (3, y))).with_line((0..9).map(|y| (4, y)));
    let share = close(world.fragments(TileId(0)), &rules(2.0, 0.0), &|_| ());
    assert_eq!(share.finished.lines.len(), 1);
    assert!(share.finished.vertices.iter().all(|(v, on_crease)| v.position.x == 3.0 && *on_crease));
    assert_eq!(share.open.len(), 1);
    assert_eq!((share.open[0].kind, share.open[0].part.links.len()), (Kind::Crease, 8));
    assert!(share.open[0].seams.iter().all(|seam| seam.tiles == [TileId(1)]));
    // Joined by one link, they wait together.
    let world = world.with_line([(3, 8), (4, 8)]);
    let share = close(world.fragments(TileId(0)), &rules(2.0, 0.0), &|_| ());
    assert!(share.finished.lines.is_empty() && share.open.len() == 1);
    assert_eq!(share.open[0].part.links.len(), 17);
    // Kinds close on their own.
    let mut world = World::plain(2).with_line((0..9).map(|y| (4, y)));
    world.open_edges =
        [(2, 3), (3, 17)].map(|(a, b)| OpenEdge { ends: [VertexId(a), VertexId(b)], crowded: true }).to_vec();
    let share = close(world.fragments(TileId(0)), &rules(2.0, 0.0), &|_| ());
    assert_eq!((share.finished.lines.len(), share.open.len()), (1, 1));
    assert_eq!(share.finished.lines[0].measures.class, Class::NonManifold);
}

/// An open part with one vertex that `tiles` may name.
fn open_part(vertices: std::ops::Range<u64>, seam: u64, tiles: &[u32]) -> OpenPart {
    let world = World::plain(1).with_line(vertices.map(|v| (v, 0)));
    let Fragments { vertices, links, .. } = world.whole();
    let tiles = tiles.iter().copied().map(TileId).collect();
    let seams = vec![Seam { vertex: VertexId(seam), tiles }];
    OpenPart { kind: Kind::Crease, part: Part { vertices, links, ..Part::default() }, seams }
}

#[test]
fn a_component_is_whole_when_all_it_waits_for_are_done() {
    let mut open = OpenComponents::new(u64::MAX, &Path::new("/nowhere").into());
    open.add(open_part(0..4, 3, &[1, 2])).expect("room");
    assert!(open.done(TileId(0)).is_empty());
    // Tile 1 adds to it at the seam, and waits for tile 3 as well.
    let mut more = open_part(3..6, 3, &[0, 2]);
    more.seams.push(Seam { vertex: VertexId(5), tiles: vec![TileId(3)] });
    open.add(more).expect("room");
    assert_eq!((open.held().components, open.held().links), (1, 5));
    assert!(open.done(TileId(1)).is_empty() && open.done(TileId(3)).is_empty());
    // A stranger at another place neither keeps it nor goes with it.
    open.add(open_part(8..11, 9, &[5])).expect("room");
    // What comes after all that it waits for is whole when it comes.
    let late = open.add(open_part(11..13, 12, &[0, 1])).expect("room").expect("whole");
    assert_eq!(late.links(), 1);
    let whole = open.done(TileId(2));
    assert_eq!((whole.len(), whole[0].links(), whole[0].vertices()), (1, 5, 7));
    assert_eq!(open.held().components, 1);
    assert_eq!(open.done(TileId(5)).len(), 1);
    assert_eq!((open.held(), open.peak().links), (Held::default(), 7));
}

#[test]
fn parts_of_one_tile_wait_for_the_tile() {
    // Where a cell was cut again, its halves wait for each other under the same number.
    let mut open = OpenComponents::new(u64::MAX, &Path::new("/nowhere").into());
    open.add(open_part(0..4, 3, &[7])).expect("room");
    open.add(open_part(3..6, 3, &[7])).expect("room");
    assert_eq!(open.held().components, 1);
    assert_eq!(open.done(TileId(7)).len(), 1);
}

#[test]
fn what_outgrows_the_memory_waits_on_disk() {
    let line = World::plain(7).with_line((0..SIDE).map(|x| (x, 5)));
    let order = [0, 3, 1, 6, 2, 5, 4];
    let memory = |last| LineMemory { open: 3000, last, lines: u64::MAX };
    let (stitched, _) = within(&line, &order, rules(2.0, 0.0), memory(u64::MAX));
    assert_eq!(stitched, at_once(&line, rules(2.0, 0.0)));

    let parent = tempfile::tempdir().expect("a temporary directory");
    let mut stitcher = Stitcher::new(rules(2.0, 0.0), memory(1 << 16), &parent.path().into());
    for tile in order {
        stitcher.take(close(line.fragments(TileId(tile)), &rules(2.0, 0.0), &|_| ())).expect("room");
        assert!(stitcher.open().bytes <= 3000);
        stitcher.done(TileId(tile)).expect("room");
    }
    let files = || parent.path().read_dir().expect("list").count();
    assert_eq!(files(), 1, "nothing went to the disk");
    stitcher.finish().expect("it fits when it is alone");
    assert_eq!(files(), 0, "something was left behind");
}

#[test]
fn what_does_not_fit_alone_is_an_error_that_says_where() {
    let line = World::plain(2).with_line((0..SIDE).map(|x| (x, 5)));
    let parent = tempfile::tempdir().expect("a temporary directory");
    let memory = LineMemory { open: 3000, last: 4000, lines: u64::MAX };
    let mut stitcher = Stitcher::new(rules(2.0, 0.0), memory, &parent.path().into());
    for tile in 0..2 {
        stitcher.take(close(line.fragments(TileId(tile)), &rules(2.0, 0.0), &|_| ())).expect("room");
        stitcher.done(TileId(tile)).expect("room");
    }
    let error = stitcher.finish().expect_err("that is too much");
    assert!(matches!(error, StitchError::TooLarge { memory: 4000, .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("near (") && text.contains("give more memory"), "{text}");
}

#[test]
fn seams_that_outgrow_the_memory_are_an_error() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let mut open = OpenComponents::new(600, &parent.path().into());
    open.add(open_part(0..4, 3, &[1])).expect("room for a component without its content");
    let error = open.add(open_part(8..12, 9, &[2])).expect_err("that is too much");
    assert!(matches!(error, StitchError::TooLarge { memory: 600, .. }), "{error}");
}
