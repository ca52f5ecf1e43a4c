//! Tiles stitched in groups by tasks, between `tile` and the last `stitch`: the bytes of `detect`, whichever groups are there,
//! and whatever became of them. `docs/CLUSTER.md` has the promises.

mod support;

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::Child;
use support::Mesh;
use support::command::{Ended, Place, names};
use support::tasks::{Case, obj, shuffled};

/// A planned job in groups.
struct Grouped {
    case: Case,
    count: u32,
}

impl Grouped {
    /// Of `case`, in groups of `size` tiles, whose tiles are done.
    fn done(case: Case, size: u32) -> Grouped {
        let grouped = Grouped::planned(case, size);
        grouped.case.all_tiles();
        grouped
    }

    fn planned(case: Case, size: u32) -> Grouped {
        case.place.does(&format!("plan {} -o lines.ply --workspace work --group-tiles {size}", case.words));
        let count = case.tiles.div_ceil(size);
        assert_eq!(case.json("work/plan.json")["groups"].as_array().expect("groups").len(), count as usize);
        Grouped { case, count }
    }

    fn run(&self, line: &str) -> Ended {
        self.case.place.run(line)
    }

    fn does(&self, line: &str) -> String {
        self.case.place.does(line)
    }

    fn group(&self, group: u32) {
        self.does(&format!("stitch work --quiet --group {group}"));
    }

    fn result(&self, group: u32) -> PathBuf {
        self.case.place.path(&format!("work/groups/{group:06}.result"))
    }

    /// The last step, which must say that it has used so many groups.
    #[track_caller]
    fn same_bytes_from(&self, groups: u32) {
        let said = self.does("stitch work");
        assert!(said.contains(&format!("stitched from {groups} of {} groups; ", self.count)), "{said}");
        self.case.same_bytes();
        fs::remove_file(self.case.place.path("lines.ply")).expect("remove");
    }

    fn missing(&self) -> String {
        self.run("status work --array --step group").out.trim().to_owned()
    }
}

/// A mesh whose lines run through all tiles, loops among them.
fn long_lines(words: &str) -> Case {
    let write = |place: &Place| _ = place.write("mesh.ply", &Mesh::roof(120).ply());
    let case = Case::new("mesh.ply", write, &format!("--tile-faces 2500 --boundaries {words}"));
    assert!(case.tiles >= 8, "{} tiles", case.tiles);
    case
}

#[test]
fn all_groups_or_some_in_any_order_write_the_bytes_of_detect() {
    let grouped = Grouped::done(Case::city("--boundaries"), 2);
    assert!(grouped.count >= 3);
    grouped.same_bytes_from(0);
    grouped.group(grouped.count - 1);
    grouped.same_bytes_from(1);
    assert_eq!(grouped.missing(), format!("0-{}", grouped.count - 2));
    // Each with the one after it again.
    for group in (0..grouped.count).rev() {
        let groups = format!("{group}-{}", (group + 1).min(grouped.count - 1));
        grouped.does(&format!("stitch work --groups {groups}"));
    }
    assert_eq!(
        (grouped.missing().as_str(), grouped.run("stitch work --group 0").out.as_str()),
        ("", "done before\n")
    );
    grouped.same_bytes_from(grouped.count);
    // Nobody needs the results of tiles any more, unless somebody wants them.
    fs::remove_file(grouped.case.result(0)).expect("remove");
    grouped.same_bytes_from(grouped.count);
    let status = grouped.run("status work");
    assert!(status.code == Some(6) && status.out.contains("to run: 0"), "{status:?}");
    grouped.does("clean work");
    assert!(!grouped.case.place.path("work").exists());
}

#[test]
fn groups_of_one_tile_and_one_group_of_all() {
    for size in [1, 1000] {
        let grouped = Grouped::done(Case::city("--boundaries"), size);
        assert_eq!(grouped.count, if size == 1 { grouped.case.tiles } else { 1 });
        grouped.does(&format!("stitch work --quiet --groups 0-{}", grouped.count - 1));
        grouped.same_bytes_from(grouped.count);
    }
}

#[test]
fn lines_that_close_across_groups_do() {
    // One ridge and one border around all; nothing of them can be finished in a group.
    let grouped = Grouped::done(long_lines(""), 3);
    for group in [1, 0, grouped.count - 1] {
        grouped.group(group);
        grouped.same_bytes_from(
            [1, 0, grouped.count - 1].iter().position(|g| *g == group).expect("one") as u32 + 1,
        );
    }
    grouped.does(&format!("stitch work --quiet --groups 0-{}", grouped.count - 1));
    grouped.same_bytes_from(grouped.count);
}

#[test]
fn little_memory_and_no_order() {
    // The memory is that of a group and of the last step, too.
    let write =
        |place: &Place| _ = place.write("mesh.obj", obj(&shuffled(Mesh::of_fixture("folds20"))).as_bytes());
    let case = Case::new("mesh.obj", write, "--tile-faces 900 --order rewrite --memory 24MiB");
    let grouped = Grouped::done(case, 2);
    grouped.does(&format!("stitch work --quiet --groups 0-{} --threads 1", grouped.count - 1));
    grouped.same_bytes_from(grouped.count);
    for log in names(&grouped.case.place.path("work/log")).iter().filter(|name| name.starts_with("stitch-")) {
        let text = String::from_utf8(grouped.case.place.read(&format!("work/log/{log}"))).expect("text");
        let last: serde_json::Value =
            serde_json::from_str(text.lines().last().expect("a line")).expect("JSON");
        assert!(last["peak_allocated_bytes"].as_u64() < Some(24 << 20), "{last}");
    }
}

#[test]
fn fields_come_from_the_tiles() {
    let grouped = Grouped::done(Case::city("--attributes table.ply --annotate mesh2.ply"), 2);
    let expected = ["table.ply", "mesh2.ply"].map(|name| grouped.case.place.read(name));
    for name in ["table.ply", "mesh2.ply"] {
        fs::remove_file(grouped.case.place.path(name)).expect("remove");
    }
    grouped.does("stitch work --quiet --groups 0-1");
    grouped.same_bytes_from(2);
    assert!(["table.ply", "mesh2.ply"].map(|name| grouped.case.place.read(name)) == expected, "other tables");
    // Where fields are wanted, tiles are needed, whatever groups there are.
    fs::remove_file(grouped.case.result(1)).expect("remove");
    let words = "stitch work --attributes again.ply -o again.lines.ply";
    grouped.run(words).refused(6, &["1 of ", "missing", ": 1;"]);
    grouped.does("stitch work --quiet -o lines.ply");
    grouped.case.same_bytes();
}

#[test]
fn damaged_and_foreign_groups_are_not_used() {
    let grouped = Grouped::done(Case::city(""), 2);
    grouped.does("stitch work --quiet --groups 0-2");
    let bytes = fs::read(grouped.result(1)).expect("a result");
    for place in [40, bytes.len() / 2, bytes.len() - 1] {
        let mut other = bytes.clone();
        other[place] ^= 4;
        fs::write(grouped.result(1), &other).expect("write");
        let ended = grouped.run("stitch work --quiet");
        assert!(ended.code == Some(0) && ended.err.contains("group 1 is damaged"), "{ended:?}");
        grouped.case.same_bytes();
        fs::remove_file(grouped.case.place.path("lines.ply")).expect("remove");
    }
    let status: serde_json::Value =
        serde_json::from_str(&grouped.run("status work --json").out).expect("JSON");
    let step = &status["steps"][2];
    assert_eq!(
        (&step["name"], &step["damaged"], &step["group_tiles"]),
        (&"group".into(), &"1".into(), &2.into())
    );
    // One of another place, and cut off.
    fs::copy(grouped.result(0), grouped.result(1)).expect("copy");
    grouped.same_bytes_from(2);
    fs::write(grouped.result(1), &bytes[..bytes.len() / 2]).expect("write");
    grouped.same_bytes_from(2);
    grouped.group(1);
    assert!(fs::read(grouped.result(1)).expect("a result") == bytes, "the group is another one");
    grouped.same_bytes_from(3);
    // Planned again in other groups, those of before are none; in the same groups, they are.
    let plan = |size| {
        grouped
            .does(&format!("plan {} -o lines.ply --workspace work --group-tiles {size}", grouped.case.words))
    };
    plan(3);
    assert!(grouped.does("stitch work").contains("stitched from 0 of "));
    grouped.case.same_bytes();
    fs::remove_file(grouped.case.place.path("lines.ply")).expect("remove");
    plan(2);
    grouped.same_bytes_from(3);
}

#[test]
fn a_group_waits_for_its_tiles_and_for_no_others() {
    let grouped = Grouped::planned(Case::city(""), 3);
    grouped.does("tile work --tiles 3-4 --quiet");
    grouped.run("stitch work --group 1").refused(6, &["1 of 3 tiles", ": 5;", "crease tile"]);
    assert!(!grouped.result(1).exists());
    grouped.does("tile work --tile 5 --quiet");
    grouped.group(1);
    grouped.run("stitch work").refused(6, &["missing", "0-2"]);
    // A result that is made again, or twice, is the same one.
    fs::remove_file(grouped.case.result(4)).expect("remove");
    grouped.case.all_tiles();
    grouped.same_bytes_from(1);

    grouped.run(&format!("stitch work --group {}", grouped.count)).refused(2, &["there is no group"]);
    assert_eq!(grouped.run("stitch work --group 0 -o other.ply").code, Some(2));
    let none = Case::city("");
    none.place.run("stitch work --group 0").refused(2, &["without groups", "--group-tiles"]);
    // More files than a process may have open.
    none.place.write("fine.ply", &Mesh::roof(120).ply());
    let words = "plan fine.ply --workspace fine --tile-faces 40 --group-tiles 1";
    none.place.run(words).refused(2, &["--group-tiles 1", "500", "3 tiles or more"]);
    assert!(!none.place.path("fine").exists());
}

#[test]
fn two_attempts_at_one_group_do_no_harm() {
    let grouped = Grouped::done(Case::city(""), 2);
    let all = format!("stitch work --quiet --groups 0-{}", grouped.count - 1);
    let mut attempts: Vec<Child> = (0..3).map(|_| grouped.case.started(&all)).collect();
    attempts.iter_mut().for_each(|child| assert!(child.wait().expect("it ends").success()));
    let there = names(&grouped.case.place.path("work/groups"));
    assert!(
        there.len() == grouped.count as usize && there.iter().all(|name| name.ends_with(".result")),
        "{there:?}"
    );
    grouped.same_bytes_from(grouped.count);
}

#[test]
fn a_killed_group_leaves_nothing_half() {
    let grouped = Grouped::done(Case::city(""), 2);
    for point in ["stitching:1", "result-begun:2", "result-written:1"] {
        let mut command = grouped.case.command("stitch work --group 1");
        let status = command.env("CREASE_KILL_AT", point).status().expect("it runs");
        assert_eq!(status.signal(), Some(9), "{point}");
        assert!(!grouped.result(1).exists(), "{point}");
    }
    let mut command = grouped.case.command("stitch work --group 1");
    let status = command.env("CREASE_KILL_AT", "result-renamed:1").status().expect("it runs");
    assert_eq!(status.signal(), Some(9));
    assert_eq!(grouped.run("stitch work --group 1").out, "done before\n");
    grouped.same_bytes_from(1);
    grouped.does("clean work");
    assert!(!grouped.case.place.path("work").exists());
}
