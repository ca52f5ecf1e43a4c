//! What a conversion allocates does not grow with its input. Alone in its binary, because the allocator counts for all.

use cap::Cap;
use crease::input::{InputFiles, IoMode, OpenOptions, Progress, Weld, open_input};
use std::alloc::System;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

struct Nobody;

impl Progress for Nobody {
    fn advanced(&self, _: u64) {}
    fn grown(&self, _: u64) {}
}

/// A grid of `n` times `n` squares; the text of the first and the triangles of the second share no vertices.
fn write_meshes(directory: &Path, n: u32) {
    let create = |name: &str| BufWriter::new(File::create(directory.join(name)).expect("created"));
    let mut ply = create("mesh.ply");
    let vertices = (n + 1) * (n + 1);
    write!(
        ply,
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        n * n
    )
    .expect("written");
    for i in 0..vertices {
        writeln!(ply, "{} {} 0.5", i % (n + 1), i / (n + 1)).expect("written");
    }
    let mut stl = create("mesh.stl");
    stl.write_all(&[0; 80]).and_then(|()| stl.write_all(&(n * n).to_le_bytes())).expect("written");
    for i in 0..n * n {
        let (x, y) = (i % n, i / n);
        let a = y * (n + 1) + x;
        writeln!(ply, "4 {a} {} {} {}", a + 1, a + n + 2, a + n + 1).expect("written");
        stl.write_all(&[0; 12]).expect("written");
        for (x, y) in [(x, y), (x + 1, y), (x, y + 1)] {
            for c in [x as f32, y as f32, 1.0] {
                stl.write_all(&c.to_le_bytes()).expect("written");
            }
        }
        stl.write_all(&[0; 2]).expect("written");
    }
}

/// The most that was allocated beyond what there was, while the meshes were opened within `memory`.
fn peak(directory: &Path, names: &[&str], weld: Option<Weld>, memory: u64) -> usize {
    let names: Vec<_> = names.iter().map(|name| directory.join(name)).collect();
    let files = InputFiles::find(&names).expect("files");
    let options =
        OpenOptions { scratch: &directory.into(), weld, memory, io: IoMode::Read, progress: &Nobody };
    let before = ALLOCATOR.allocated();
    let input = open_input(&files, &options).unwrap_or_else(|e| panic!("{e}"));
    assert!(input.is_converted());
    drop(input);
    // Each peak of this test is larger than all before it, as long as sizes and memory grow.
    ALLOCATOR.max_allocated() - before
}

#[test]
fn a_conversion_keeps_within_its_memory() {
    const MEMORY: u64 = 8 << 20;
    let (small, large) =
        (tempfile::tempdir().expect("a directory"), tempfile::tempdir().expect("a directory"));
    write_meshes(small.path(), 100);
    write_meshes(large.path(), 400);
    // The counter keeps the largest of all runs, so the small ones come first.
    let peaks: Vec<usize> = [
        (small.path(), &["mesh.ply"][..], None),
        (large.path(), &["mesh.ply"], None),
        (small.path(), &["mesh.ply", "mesh.stl"], None),
        (large.path(), &["mesh.ply", "mesh.stl"], None),
        (large.path(), &["mesh.ply", "mesh.stl"], Some(Weld::Within(0.01))),
    ]
    .into_iter()
    .map(|(directory, names, weld)| peak(directory, names, weld, MEMORY))
    .collect();
    // Sixteen times the mesh; the vertices of both large ones with their polygons have 19 MB, and sorting makes it more.
    assert!(peaks[1] <= peaks[0] + peaks[0] / 4, "text: {peaks:?}");
    assert!(peaks.iter().all(|peak| *peak as u64 <= MEMORY), "{peaks:?} of {MEMORY}");
}
