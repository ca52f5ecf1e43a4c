//! Meshes that nobody would make: soups over a few vertices, grids with holes, points in one place, coordinates of any size.
//! None of them may make a run panic, and the result is the same bytes however the mesh is cut up.

mod support;

use crease::glam::DVec3;
use crease::output::write_ply;
use crease::stitch::LineSource;
use crease::{Params, Sigma};
use proptest::prelude::*;
use support::{Fields, Mesh, first_difference, in_core, run, tiled};

/// Vertices on a small lattice, so that many coincide and many faces have no area; or anywhere in a cube.
fn positions(count: usize) -> impl Strategy<Value = Vec<DVec3>> {
    let lattice = (0..4i32, 0..4i32, 0..3i32).prop_map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()));
    let anywhere = (0.0..8.0, 0.0..8.0, 0.0..3.0).prop_map(|(x, y, z)| DVec3::new(x, y, z));
    prop_oneof![prop::collection::vec(lattice.boxed(), count), prop::collection::vec(anywhere.boxed(), count),]
}

/// Faces over any three vertices, also the same ones.
fn soup() -> impl Strategy<Value = Mesh> {
    (3usize..40).prop_flat_map(|n| {
        let corner = 0..n as u32;
        let face = [corner.clone(), corner.clone(), corner];
        (positions(n), prop::collection::vec(face, 1..80))
            .prop_map(|(positions, faces)| Mesh { positions, faces })
    })
}

/// A roof of which faces are missing, doubled, turned over or moved to other vertices, with bumps.
fn torn_roof() -> impl Strategy<Value = Mesh> {
    let change = (any::<prop::sample::Index>(), 0..5u8, any::<prop::sample::Index>());
    let bump = (any::<prop::sample::Index>(), -2.0..2.0f64);
    (4u32..14, prop::collection::vec(change, 0..30), prop::collection::vec(bump, 0..20)).prop_map(
        |(n, changes, bumps)| {
            let mut mesh = Mesh::roof(n);
            for (face, kind, other) in changes {
                let (at, other) = (face.index(mesh.faces.len()), other.index(mesh.positions.len()) as u32);
                match kind {
                    0 => mesh.faces[at].swap(0, 1),
                    1 => mesh.faces.push(mesh.faces[at]),
                    2 => mesh.faces[at][0] = other,
                    3 => mesh.positions[mesh.faces[at][0] as usize] = mesh.positions[other as usize],
                    _ => {
                        mesh.faces.swap_remove(at);
                    }
                }
            }
            bumps.into_iter().for_each(|(v, z)| {
                let v = v.index(mesh.positions.len());
                mesh.positions[v].z += z;
            });
            mesh
        },
    )
}

/// Any of them in any unit, anywhere, with vertices that nobody uses.
fn any_mesh() -> impl Strategy<Value = Mesh> {
    let unit = prop::sample::select(vec![1.0, 1.0, 1e-3, 1e-30, 1e-160, 1e6, 1e30, 1e70]);
    let shift = prop::sample::select(vec![0.0, 0.0, -3.5, 5e6, 1e15, -1e74]);
    (prop_oneof![soup().boxed(), torn_roof().boxed()], unit, shift, 0..3usize).prop_map(
        |(mut mesh, unit, shift, unused)| {
            mesh.positions.iter_mut().for_each(|p| *p = *p * unit + DVec3::new(shift, shift / 3.0, -shift));
            mesh.positions.extend(vec![DVec3::splat(unit); unused]);
            mesh
        },
    )
}

/// The file that is written of the lines.
fn bytes(lines: &impl LineSource) -> Vec<u8> {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("lines.ply");
    write_ply(&path, lines).unwrap_or_else(|e| panic!("{e}"));
    std::fs::read(path).expect("it was written")
}

fn finite(fields: &Fields) -> bool {
    fields.0.values().all(|f| f.eigenvalues.iter().chain([&f.omega, &f.salience]).all(|x| x.is_finite()))
}

proptest! {
    // More of them: the environment variable PROPTEST_CASES.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn any_mesh_gives_the_same_bytes_in_tiles(
        mesh in any_mesh(),
        tile in 1u64..60,
        threads in 1usize..4,
        edges in prop::sample::select(vec![1.0, 3.0, 3.0, 8.0]),
    ) {
        let source = mesh.source();
        let params = Params { boundaries: true, sigma: Sigma::Edges(edges), ..Params::default() };
        let whole = run(&source, params, in_core());
        let tiles = run(&source, params, tiled(tile, threads));
        prop_assert_eq!(first_difference(&whole, &tiles), None);
        prop_assert!(bytes(&whole.0.lines) == bytes(&tiles.0.lines), "the files differ");
        prop_assert!(finite(&whole.1), "a field is not finite");
        // Every vertex that a face uses is handed over once, and no other.
        let mut used: Vec<u64> = mesh.faces.iter().filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0])
            .flatten().map(|&v| v.into()).collect();
        used.sort_unstable();
        used.dedup();
        prop_assert_eq!(whole.1.0.keys().copied().collect::<Vec<_>>(), used);
        for line in &whole.0.lines.lines {
            prop_assert!(line.vertices.len() >= 2 && line.length.is_finite() && line.length >= 0.0, "{:?}", line);
        }
    }
}
