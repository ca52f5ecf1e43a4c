//! Any bytes as a file of any format, packed or not: a mesh or an error, within the memory that is allowed.
#![no_main]

mod place;

use arbitrary::Arbitrary;
use crease::input::{FaceBlock, InputFiles, IoMode, MeshSource, OpenOptions, Progress, Weld, open_input};
use crease::mesh::VertexId;
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Case<'a> {
    name: u8,
    weld: u8,
    bytes: &'a [u8],
}

struct Nobody;

impl Progress for Nobody {
    fn advanced(&self, _: u64) {}
    fn grown(&self, _: u64) {}
}

fuzz_target!(|case: Case| {
    let endings = ["ply", "obj", "stl", "off", "ply.gz", "obj.zst"];
    let path =
        place::written(&format!("mesh.{}", endings[usize::from(case.name) % endings.len()]), case.bytes);
    let weld =
        [None, Some(Weld::Exact), Some(Weld::None), Some(Weld::Within(0.25))][usize::from(case.weld) % 4];
    let scratch = place::DIRECTORY.as_path().into();
    let options =
        OpenOptions { scratch: &scratch, weld, memory: 16 << 20, io: IoMode::Read, progress: &Nobody };
    let opened = InputFiles::find(&[path.clone()]).and_then(|files| open_input(&files, &options));
    if let Ok(input) = opened {
        let mesh = input.mesh();
        let mut faces = FaceBlock::default();
        for block in 0..mesh.block_count() {
            if mesh.read_block(block, &mut faces).is_ok() {
                let known = |id: &VertexId| id.0 < mesh.vertex_count();
                assert!(
                    faces.corners.iter().flatten().all(known),
                    "a face names a vertex that does not exist"
                );
            }
        }
        let mut positions = Vec::new();
        let some = mesh.vertex_count().min(1 << 16) as usize;
        mesh.read_positions(VertexId(0), some, &mut positions)
            .expect("positions that were counted are there");
        assert_eq!(positions.len(), some);
    }
    let _ = std::fs::remove_file(path);
});
