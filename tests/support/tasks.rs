//! A job that is planned, for tests that run its steps one by one.

use super::command::{Ended, Place, names};
use super::{Mesh, fixture};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// A job in a directory of its own, planned, and what `detect` makes of the same.
pub struct Case {
    pub place: Place,
    /// What is detected, and in which tiles.
    pub words: String,
    pub tiles: u32,
}

impl Case {
    /// Of `input` in a place where there is one; `words` are for `detect` and `plan` alike.
    pub fn new(input: &str, write: impl FnOnce(&Place), words: &str) -> Case {
        let place = Place::new();
        write(&place);
        let words = format!("{input} --threads 2 {words}");
        let mut case = Case { place, words, tiles: 0 };
        case.plan();
        case.place.does(&format!("detect {} -o expected.ply --quiet --workspace alone", case.words));
        case.tiles = case.json("work/plan.json")["tiles"].as_array().expect("tiles").len() as u32;
        case
    }

    pub fn of_fixture(name: &str, words: &str) -> Case {
        let file = fixture(&format!("meshes/{name}.ply"));
        Case::new("mesh.ply", |place| _ = fs::copy(file, place.path("mesh.ply")).expect("copy"), words)
    }

    /// The city in at least six tiles.
    pub fn city(words: &str) -> Case {
        let case = Case::of_fixture("city", &format!("--tile-faces 1500 {words}"));
        assert!(case.tiles >= 6, "{} tiles are not enough to go wrong", case.tiles);
        case
    }

    pub fn plan(&self) -> String {
        self.place.does(&format!("plan {} -o lines.ply --workspace work", self.words))
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.place.read(name)).expect("JSON")
    }

    pub fn tile(&self, tile: u32) -> Ended {
        self.place.run(&format!("tile work --tile {tile}"))
    }

    /// All tiles, the last first, each with its neighbour in the numbering again.
    pub fn all_tiles(&self) {
        for tile in (0..self.tiles).rev() {
            let tiles = format!("{tile}-{}", (tile + 1).min(self.tiles - 1));
            self.place.does(&format!("tile work --tiles {tiles}"));
        }
    }

    #[track_caller]
    pub fn same_bytes(&self) {
        let lines = self.place.read("lines.ply");
        assert!(lines == self.place.read("expected.ply"), "other lines");
    }

    pub fn missing(&self) -> String {
        let ended = self.place.run("status work --array");
        assert_eq!(ended.code, Some(6), "{ended:?}");
        ended.out.trim().to_owned()
    }

    pub fn result(&self, tile: u32) -> PathBuf {
        self.place.path(&format!("work/tiles/{tile:06}.result"))
    }

    /// Names in the directory of results.
    pub fn results(&self) -> Vec<String> {
        names(&self.place.path("work/tiles"))
    }

    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command.args(line.split_whitespace()).current_dir(self.place.path("")).env_remove("RUST_LOG");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    pub fn started(&self, line: &str) -> Child {
        self.command(line).spawn().expect("the program starts")
    }
}

/// The faces of a mesh in no order.
pub fn shuffled(mut mesh: Mesh) -> Mesh {
    let mut seed = 5u64;
    for i in (1..mesh.faces.len()).rev() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        mesh.faces.swap(i, (seed >> 33) as usize % (i + 1));
    }
    mesh
}

/// As OBJ, which must be converted.
pub fn obj(mesh: &Mesh) -> String {
    let mut out = String::new();
    mesh.positions.iter().for_each(|p| out.push_str(&format!("v {} {} {}\n", p.x, p.y, p.z)));
    mesh.faces.iter().for_each(|f| out.push_str(&format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1)));
    out
}
