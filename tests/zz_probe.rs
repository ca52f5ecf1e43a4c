mod support;
use crease::input::IoMode;
use crease::{Limits, Params, Tiling};
#[test]
fn probe() {
    let name = std::env::var("PROBE").unwrap();
    let mesh = support::real_mesh(&format!("{name}.ply")).unwrap();
    for t in std::env::var("TILES").unwrap().split(',') {
        let tile: u64 = t.parse().unwrap();
        let start = std::time::Instant::now();
        let tiling = if tile == 0 { Tiling::InCore } else { Tiling::Faces(tile) };
        let (found, _) = support::run(
            &support::open(&mesh),
            Params::default(),
            Limits { tiling, threads: 2, io: IoMode::Map },
        );
        let w = &found.work;
        println!(
            "{name} {tile}: {:?} lines {} {:?} loaded/owned {:.3} regrown {} tiles {} {:?}",
            start.elapsed(),
            found.lines.lines.len(),
            found.defects,
            w.loaded_faces as f64 / w.owned_faces as f64,
            w.regrown,
            w.tiles,
            w.stages
        );
    }
}
