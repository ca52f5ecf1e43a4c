//! A job as many tasks: `plan`, `tile` in any order and any number of times, `stitch`, and the bytes of `detect` in the end.
//! `docs/CLUSTER.md` has the promises; `tools/cluster` runs the same under a scheduler.

mod support;

use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use support::Mesh;
use support::command::Place;
use support::tasks::{Case, obj, shuffled};

#[test]
fn tasks_in_any_order_write_the_bytes_of_detect() {
    let case = Case::city("--boundaries");
    assert_eq!(case.missing(), format!("0-{}", case.tiles - 1));
    case.all_tiles();
    let before = fs::metadata(case.result(0)).expect("a result").modified().expect("a time");
    assert_eq!(case.tile(0).out, "done before\n");
    assert_eq!(fs::metadata(case.result(0)).expect("a result").modified().expect("a time"), before);
    assert_eq!(case.missing(), "");
    let said = case.place.does("stitch work");
    assert!(said.contains("mesh.ply") && said.contains("lines.ply"), "{said}");
    case.same_bytes();
    case.place.does("status work");
    // Nothing is done twice, and nothing is replaced.
    assert_eq!(case.place.does("stitch work"), "stitched before\n");
    fs::write(case.place.path("lines.ply"), "mine").expect("write");
    case.place.run("stitch work").refused(2, &["lines.ply", "exists"]);
    assert!(!case.place.path("work/crease-outputs").exists());
    case.place.does("clean work");
    assert_eq!(case.place.names(), ["expected.ply", "lines.ply", "mesh.ply"]);
}

#[test]
fn a_mesh_without_order_is_put_in_order_once() {
    let write = |place: &Place| _ = place.write("mesh.ply", &shuffled(Mesh::of_fixture("folds20")).ply());
    let case = Case::new("mesh.ply", write, "--tile-faces 900 --order rewrite");
    assert!(case.tiles >= 4 && case.place.path("work/crease-sorted").exists());
    assert_eq!(case.json("work/plan.json")["input"]["reordered"], true);
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
    case.place.does("clean work");
    assert!(!case.place.path("work").exists());
}

#[test]
fn an_input_that_must_be_converted_is_converted_once() {
    let write = |place: &Place| _ = place.write("mesh.obj", obj(&Mesh::of_fixture("folds20")).as_bytes());
    let case = Case::new("mesh.obj", write, "--tile-faces 900");
    assert_eq!(case.json("work/plan.json")["input"]["mesh"], "crease-mesh.ply");
    // From here on nobody needs it.
    fs::remove_file(case.place.path("mesh.obj")).expect("remove");
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
}

#[test]
fn polygons_and_faces_that_are_left_out_are_known_to_every_task() {
    let case = Case::of_fixture("polygons", "--tile-faces 10");
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
    let mut mesh = Mesh::of_fixture("folds20");
    mesh.positions[77].z = f64::NAN;
    mesh.faces[4000][1] = u32::MAX >> 1;
    let write = |place: &Place| _ = place.write("mesh.ply", &mesh.ply());
    let case = Case::new("mesh.ply", write, "--tile-faces 900 --bad-faces skip");
    case.all_tiles();
    assert!(case.place.does("stitch work").contains("left out"));
    case.same_bytes();
    let words = case.words.replace(" --bad-faces skip", "");
    case.place.run(&format!("plan {words} --workspace work")).refused(5, &["--bad-faces"]);
}

#[test]
fn one_tile_is_a_plan_too() {
    let case = Case::of_fixture("bracket", "");
    assert_eq!(case.tiles, 1);
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
}

#[test]
fn results_carry_the_rows_of_the_table() {
    let case = Case::city("--attributes table.ply");
    let expected = case.place.read("table.ply");
    fs::remove_file(case.place.path("table.ply")).expect("remove");
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
    assert!(case.place.read("table.ply") == expected, "another table");
    // Other outputs in their place, from anywhere.
    let elsewhere = tempfile::tempdir().expect("a temporary directory");
    let work = case.place.path("work");
    let mut command = case.command("stitch --quiet -o other.ply");
    assert!(command.arg(&work).current_dir(elsewhere.path()).status().expect("it runs").success());
    assert!(fs::read(elsewhere.path().join("other.ply")).expect("lines") == case.place.read("expected.ply"));
    // A table needs rows.
    let case = Case::city("");
    case.all_tiles();
    case.place.run("stitch work --attributes table.ply").refused(5, &["--attributes", "not written"]);
}

#[test]
fn two_attempts_at_one_tile_do_no_harm() {
    let case = Case::city("");
    let all = format!("tile work --quiet --tiles 0-{}", case.tiles - 1);
    let mut attempts: Vec<Child> = (0..3).map(|_| case.started(&all)).collect();
    attempts.iter_mut().for_each(|child| assert!(child.wait().expect("it ends").success()));
    assert!(case.results().iter().all(|name| name.ends_with(".result")), "{:?}", case.results());
    case.place.does("stitch work --quiet");
    case.same_bytes();
    // Each attempt that worked has said so in a file of its own.
    let logs = support::command::names(&case.place.path("work/log"));
    assert!(!logs.is_empty() && logs.len() <= 3, "{logs:?}");
    for name in &logs {
        let text = String::from_utf8(case.place.read(&format!("work/log/{name}"))).expect("text");
        let events: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        assert_eq!(events[0]["event"], "started");
        let last = &events[events.len() - 1];
        assert_eq!((&last["event"], &last["exit"]), (&"ended".into(), &0.into()));
        assert!(
            last["seconds"].as_f64() > Some(0.0) && last["peak_allocated_bytes"].as_u64() > Some(1 << 16)
        );
        let tiles: BTreeSet<u64> = events.iter().filter_map(|event| event["tile"].as_u64()).collect();
        assert_eq!(tiles.len() + 2, events.len());
    }
}

#[test]
fn what_is_missing_or_damaged_is_said_and_done_again() {
    let case = Case::city("");
    case.all_tiles();
    fs::remove_file(case.result(2)).expect("remove");
    let mut bytes = fs::read(case.result(4)).expect("a result");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(case.result(4), &bytes).expect("write");
    // One of another place is no result of this.
    fs::copy(case.result(0), case.result(5)).expect("copy");
    assert_eq!(case.missing(), "2,4-5");
    assert_eq!(case.place.run("status work --array --group 2").out, "1-2\n");
    let ended = case.place.run("status work --json");
    let status: Value = serde_json::from_str(&ended.out).expect("JSON");
    assert_eq!((ended.code, &status["complete"]), (Some(6), &false.into()));
    let step = &status["steps"][1];
    assert_eq!((&step["missing"], &step["damaged"]), (&"2,4-5".into(), &"4-5".into()));
    let said = case.place.run("status work").out;
    assert!(said.contains("to run: 2,4-5") && said.contains("waits for tiles"), "{said}");
    case.place.run("stitch work").refused(6, &["3 of ", "2,4-5", "crease tile"]);
    assert!(!case.place.path("lines.ply").exists());
    case.place.does("tile work --tiles 2,4-5");
    case.place.does("stitch work --quiet");
    case.same_bytes();
}

#[test]
fn another_job_is_refused_by_name() {
    let case = Case::city("");
    case.place.does("tile work --tile 1");
    for (option, name) in
        [("--boundaries", "--boundaries"), ("--sigma-edges 4", "--sigma"), ("--weld exact", "--weld")]
    {
        case.place.run(&format!("plan {} {option} --workspace work", case.words)).refused(5, &["work", name]);
    }
    // The same again does nothing again, and other outputs may be asked for.
    let plan = case.place.read("work/plan.json");
    assert!(case.plan().contains("planned before"));
    assert!(case.place.read("work/plan.json") == plan);
    case.place.does(&format!("plan {} --workspace work -o others.ply", case.words));
    assert_eq!(case.tile(1).out, "done before\n");
    case.place.run(&format!("tile work --tile {}", case.tiles)).refused(2, &["there is no tile"]);

    // Neither is it a workspace of detect, nor the other way round.
    case.place
        .run("detect mesh.ply -o x.ply --tile-faces 1500 --workspace work")
        .refused(5, &["work", "crease tile"]);
    case.place.run("tile alone --tile 0").refused(5, &["alone", "crease plan"]);
    fs::create_dir(case.place.path("mine")).expect("create");
    fs::write(case.place.path("mine/file"), "mine").expect("write");
    case.place.run("plan mesh.ply --workspace mine").refused(2, &["mine", "something else", "file"]);
    case.place.run("plan mesh.ply").refused(2, &["--workspace"]);
    case.place.run("plan mesh.ply --workspace new --method paper").refused(2, &["--method paper"]);

    // An input that was written to is another one.
    let file = fs::File::options().append(true).open(case.place.path("mesh.ply")).expect("open");
    file.set_modified(std::time::SystemTime::UNIX_EPOCH).expect("touched");
    case.place.run("tile work --tile 0").refused(3, &["mesh.ply", "planned for", "written to"]);
    case.place.run(&format!("plan {} --workspace work", case.words)).refused(5, &["the input"]);
    assert_eq!(case.results(), ["000001.result"]);
}

#[test]
fn a_killed_task_leaves_nothing_half() {
    let case = Case::city("");
    for (tile, point) in ["tile-computed:1", "result-begun:1", "result-written:1"].into_iter().enumerate() {
        let mut command = case.command(&format!("tile work --tile {tile}"));
        let status = command.env("CREASE_KILL_AT", point).status().expect("it runs");
        assert_eq!(status.signal(), Some(9), "{point}");
        assert!(!case.result(tile as u32).exists(), "{point}");
    }
    let mut command = case.command("tile work --tile 3");
    let status = command.env("CREASE_KILL_AT", "result-renamed:1").status().expect("it runs");
    assert_eq!((status.signal(), case.tile(3).out.as_str()), (Some(9), "done before\n"));
    assert_eq!(case.missing(), format!("0-2,4-{}", case.tiles - 1));
    case.all_tiles();
    for point in ["stitching:1", "outputs-announced:1", "output-renamed:1"] {
        let status =
            case.command("stitch work --quiet").env("CREASE_KILL_AT", point).status().expect("it runs");
        assert_eq!(status.signal(), Some(9), "{point}");
        case.place.does("stitch work --quiet");
        case.same_bytes();
        fs::remove_file(case.place.path("lines.ply")).expect("remove");
    }
    assert_eq!(case.place.run("status work").code, Some(6));
    // What they were writing goes with the workspace.
    case.place.does("clean work");
    assert!(!case.place.path("work").exists());
}

#[test]
fn a_plan_that_was_killed_is_made_again() {
    let write =
        |place: &Place| _ = place.write("mesh.obj", obj(&shuffled(Mesh::of_fixture("folds20"))).as_bytes());
    let case = Case::new("mesh.obj", write, "--tile-faces 900 --order rewrite");
    let plan = case.place.read("work/plan.json");
    let words = format!("plan {} -o lines.ply --workspace work --quiet", case.words);
    for point in
        ["workspace-made:1", "workspace-begun:1", "scanned:1", "sorted-kept:1", "job-begun:1", "planned:1"]
    {
        case.place.does("clean work");
        let status = case.command(&words).env("CREASE_KILL_AT", point).status().expect("it runs");
        assert_eq!(status.signal(), Some(9), "{point}");
        assert!(!case.place.path("work/plan.json").exists());
        if point != "planned:1" {
            let exit = case.place.run("tile work --tile 0").code;
            assert_eq!(exit, Some(5), "{point}");
        }
        case.place.does(&words);
    }
    assert_eq!(
        case.json("work/plan.json")["tiles"],
        serde_json::from_slice::<Value>(&plan).expect("JSON")["tiles"]
    );
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
}

#[test]
fn a_signal_ends_a_task_in_good_order() {
    let case = Case::new(
        "mesh.ply",
        |place| _ = place.write("mesh.ply", &Mesh::roof(300).ply()),
        "--tile-faces 20000",
    );
    let mut child = case.started(&format!("tile work --quiet --tiles 0-{}", case.tiles - 1));
    let started = Instant::now();
    while case.results().is_empty() {
        assert!(started.elapsed() < Duration::from_secs(120), "no tile comes");
        std::thread::sleep(Duration::from_millis(5));
    }
    let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let code = child.wait().expect("it ends").code();
    // If it was at its end already, the signal came too late.
    assert!(code == Some(130) || (code == Some(0) && case.missing().is_empty()), "{code:?}");
    assert!(case.results().iter().all(|name| name.ends_with(".result")), "{:?}", case.results());
    case.all_tiles();
    case.place.does("stitch work --quiet");
    case.same_bytes();
}

/// All names of fields in a JSON value.
fn names(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => fields.iter().for_each(|(name, value)| {
            found.insert(name.clone());
            names(value, found);
        }),
        Value::Array(items) => items.iter().for_each(|item| names(item, found)),
        _ => {}
    }
}

#[test]
fn the_plan_says_what_the_documents_say() {
    let case = Case::city("");
    let plan = case.json("work/plan.json");
    let tiles = plan["tiles"].as_array().expect("tiles");
    let mut faces = 0;
    for (id, tile) in tiles.iter().enumerate() {
        assert_eq!(tile["id"], id);
        assert_eq!(tile["result"], format!("tiles/{id:06}.result"));
        faces += tile["faces"].as_u64().expect("faces");
        assert!(tile["loaded_faces"].as_u64() >= Some(1) && tile["cpu_seconds"].as_f64() >= Some(0.0));
        assert!(tile["memory_bytes"].as_u64() > Some(1 << 20));
        for other in tile["neighbours"].as_array().expect("neighbours") {
            let other = &tiles[other.as_u64().expect("a tile") as usize];
            assert!(other["neighbours"].as_array().expect("neighbours").contains(&id.into()), "{id} {other}");
        }
    }
    // Each sample stands for as many faces as the stride, so the sum is near the number of faces.
    let all = plan["input"]["faces"].as_u64().expect("faces");
    assert!(faces.abs_diff(all) < all / 50, "{faces} of {all}");
    let steps: Vec<&str> =
        plan["steps"].as_array().expect("steps").iter().filter_map(|s| s["name"].as_str()).collect();
    assert_eq!(steps, ["plan", "tile", "stitch"]);
    assert_eq!(
        (&plan["steps"][1]["tasks"], &plan["steps"][1]["count"]),
        (&"each".into(), &case.tiles.into())
    );

    // The same plan again, byte for byte, in another place and without memory of the first.
    let other = Case::city("");
    assert!(other.place.read("work/plan.json") == case.place.read("work/plan.json"));

    let mut fields = BTreeSet::new();
    names(&plan, &mut fields);
    let status: Value = serde_json::from_str(&case.place.run("status work --json").out).expect("JSON");
    names(&status, &mut fields);
    // The same in groups.
    case.place.does(&format!("plan {} -o lines.ply --workspace work --group-tiles 2", case.words));
    names(&case.json("work/plan.json"), &mut fields);
    let status: Value = serde_json::from_str(&case.place.run("status work --json").out).expect("JSON");
    names(&status, &mut fields);
    case.place.does("tile work --tiles 0-1 --quiet");
    case.place.does("stitch work --group 0 --quiet");
    for log in support::command::names(&case.place.path("work/log")) {
        let text = String::from_utf8(case.place.read(&format!("work/log/{log}"))).expect("text");
        text.lines().for_each(|line| names(&serde_json::from_str(line).expect("JSON"), &mut fields));
    }
    assert!(fields.contains("links") && fields.contains("first_tile"), "{fields:?}");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/CLUSTER.md");
    let page = fs::read_to_string(page).expect("the page");
    let unsaid: Vec<&String> = fields.iter().filter(|name| !page.contains(&format!("`{name}`"))).collect();
    assert!(unsaid.is_empty(), "docs/CLUSTER.md does not say what these are: {unsaid:?}");
}

/// A task with less memory than was planned cuts its tile, and the result is the same.
#[test]
fn a_machine_with_less_memory_makes_the_same_bytes() {
    let case = Case::new(
        "mesh.ply",
        |place| _ = place.write("mesh.ply", &Mesh::roof(300).ply()),
        "--tile-faces 90000",
    );
    case.place.does(&format!("tile work --memory 32MiB --threads 1 --tiles 0-{}", case.tiles - 1));
    // A result has the head of a frame for each piece of its cell.
    let pieces = |tile| {
        let bytes = fs::read(case.result(tile)).expect("a result");
        bytes.windows(8).filter(|bytes| bytes == b"\x89cRs\x1a\r\n\x07").count()
    };
    assert!((0..case.tiles).any(|tile| pieces(tile) > 1), "nothing was cut");
    case.place.does("stitch work --quiet");
    case.same_bytes();
}
