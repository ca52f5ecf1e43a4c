//! Tiles joined in groups, groups joined with tiles: the same lines.

use super::*;
use crate::spill::KeptRun;

/// What a group has left, in memory.
#[derive(Default)]
struct Left {
    sections: [Vec<Vec<u8>>; 4],
}

impl Left {
    fn share(&self) -> GroupShare {
        let [vertices, lines, open, counts] = self.sections.clone().map(KeptRun::in_memory);
        GroupShare { vertices, lines, open, counts }
    }
}

/// The tiles of `tiles` as a group.
fn group(world: &World, tiles: &[u32], rules: Rules, memory: LineMemory) -> Left {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let mut stitcher = Stitcher::new(rules, memory, &parent.path().into());
    for &tile in tiles {
        stitcher.take(close(world.fragments(TileId(tile)), &rules, &|_| ())).expect("room");
        stitcher.done(TileId(tile)).expect("room");
    }
    let mut left = Left::default();
    let mut last = Section::Vertices;
    let put = &mut |section: Section, bytes: &[u8]| {
        assert!(last <= section, "{section:?} comes after {last:?}");
        last = section;
        left.sections[section as usize].push(bytes.to_vec());
        Ok::<_, StitchError>(())
    };
    stitcher.leave(TileId(tiles[0]), put).expect("room");
    left
}

/// Who is stitched in one go.
enum Member {
    Tile(u32),
    Group(Vec<u32>, Left),
}

/// What groups and tiles become, in this order. Both geometries, and links.
fn joined(world: &World, members: &[Member], rules: Rules, memory: LineMemory) -> ([LineSet; 2], u64) {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let mut stitcher = Stitcher::new(rules, memory, &parent.path().into());
    for member in members {
        let tiles = match member {
            Member::Tile(tile) => {
                stitcher.take(close(world.fragments(TileId(*tile)), &rules, &|_| ())).expect("room");
                vec![*tile]
            }
            Member::Group(tiles, left) => {
                stitcher.take_group(left.share()).expect("room");
                tiles.clone()
            }
        };
        tiles.into_iter().for_each(|tile| stitcher.done(TileId(tile)).expect("room"));
    }
    assert_eq!(stitcher.open(), Held::default(), "something is still open");
    let stitched = stitcher.finish().expect("room");
    let links = stitched.work.links;
    (both(stitched), links)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]
    #[test]
    fn groups_give_what_the_whole_gives(
        (world, order, sizes) in worlds().prop_flat_map(|world| {
            let order: Vec<u32> = (0..world.tiles).collect();
            (Just(world), Just(order).prop_shuffle(), prop::collection::vec(0usize..4, 7))
        }),
        shortest in 0.0f64..8.0,
        lines in prop::sample::select(vec![0, 1 << 14, u64::MAX]),
        open in prop::sample::select(vec![1 << 17, u64::MAX]),
    ) {
        let rules = rules(shortest, 0.0);
        let memory = LineMemory { open, lines, last: u64::MAX };
        // Groups of one to three tiles, not even of neighbours; and single tiles.
        let (mut members, mut rest) = (Vec::new(), order.as_slice());
        for size in sizes {
            let Some(first) = rest.first() else { break };
            let (now, later) = rest.split_at(size.clamp(1, rest.len()));
            members.push(match size {
                0 => Member::Tile(*first),
                _ => Member::Group(now.to_vec(), group(&world, now, rules, memory)),
            });
            rest = later;
        }
        let (found, links) = joined(&world, &members, rules, memory);
        prop_assert_eq!((found, links), (at_once(&world, rules), world.links.len() as u64));
    }
}

#[test]
fn a_line_through_several_groups_is_one() {
    let world = World::plain(7).with_line((0..SIDE).map(|x| (x, 5))).with_line((0..SIDE).map(|x| (x, 9)));
    let rules = rules(2.0, 0.0);
    // In memory, and where hardly a part fits: then each comes in several pieces.
    for memory in [LineMemory::UNBOUNDED, LineMemory { open: 6000, last: u64::MAX, lines: 0 }] {
        let parts = [vec![0, 1, 2], vec![3, 4], vec![5, 6]];
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let members = order.map(|i: usize| {
                let left = group(&world, &parts[i], rules, memory);
                assert!(left.sections[Section::Lines as usize].is_empty(), "a line is finished too early");
                assert!(!left.sections[Section::Open as usize].is_empty());
                Member::Group(parts[i].clone(), left)
            });
            let ([lines, _], _) = joined(&world, &members, rules, memory);
            assert_eq!(
                lines.lines.iter().map(|line| line.length).collect::<Vec<_>>(),
                [(SIDE - 1) as f64; 2]
            );
        }
    }
}

#[test]
fn what_no_tile_outside_can_name_is_finished_in_the_group() {
    // Four strips; a line over the first two, which are a group.
    let world = World::plain(4).with_line((0..4).map(|x| (x, 5)));
    let left = group(&world, &[1, 0], rules(2.0, 0.0), LineMemory::UNBOUNDED);
    assert_eq!(left.sections.map(|blocks| blocks.len()), [1, 1, 0, 1]);
    // And one that the third can name: it waits for that one, and not for the second any more.
    let world = World::plain(4).with_line((0..5).map(|x| (x, 5)));
    let left = group(&world, &[1, 0], rules(2.0, 0.0), LineMemory::UNBOUNDED);
    let open = left.share().open;
    let part = open.records::<OpenPart>().read().expect("readable").expect("an open part");
    assert_eq!(part.part.links.len(), 4);
    let waits: BTreeSet<TileId> = part.seams.iter().flat_map(|seam| seam.tiles.iter().copied()).collect();
    // The group itself is there so that no piece of it is taken for whole.
    assert_eq!(waits, BTreeSet::from([TileId(1), TileId(2)]));
}
