//! The committed test files. In: nothing; out: path and bytes of each file under `fixtures/`, and the list of them.

use super::handmade;
use super::ply::{Scalar, line_bytes, mesh_bytes};
use super::shape::Shape;
use super::shapes::ShapeName;
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// The command that writes all of them.
pub const COMMAND: &str = "cargo run --release --example gen -- fixtures fixtures";

/// A generated shape that is kept as a file.
#[derive(Clone, Copy, Debug)]
pub struct Generated {
    /// Name of the file, without extension.
    pub stem: &'static str,
    /// What to generate.
    pub name: ShapeName,
    /// Seed of the shape and of the noise.
    pub seed: u64,
    /// Standard deviation of the noise, in mean edge lengths.
    pub noise: f64,
}

/// The generated shapes.
pub const GENERATED: [Generated; 5] = [
    Generated { stem: "city", name: ShapeName::City { houses: 2 }, seed: 1, noise: 0.03 },
    Generated { stem: "bracket", name: ShapeName::Bracket, seed: 1, noise: 0.1 },
    Generated { stem: "bracket_clean", name: ShapeName::Bracket, seed: 1, noise: 0.0 },
    Generated { stem: "folds20", name: ShapeName::Folds { angle_deg: 20.0 }, seed: 1, noise: 0.1 },
    Generated { stem: "folds10", name: ShapeName::Folds { angle_deg: 10.0 }, seed: 1, noise: 0.1 },
];

/// One file.
#[derive(Clone, Debug)]
pub struct Fixture {
    /// Below the directory of the fixtures, with `/`.
    pub path: String,
    /// How it is made.
    pub made: String,
    /// What it carries.
    pub carries: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl Generated {
    /// The shape with its noise.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn shape(&self) -> Result<Shape> {
        let mut shape = self.name.build(self.seed)?;
        shape.add_noise(self.noise, self.seed);
        Ok(shape)
    }

    /// The mesh and the lines beside it.
    fn files(&self) -> Result<[Fixture; 2]> {
        let shape = self.shape()?;
        let path = format!("meshes/{}.ply", self.stem);
        let truth = format!("meshes/{}.truth.ply", self.stem);
        let command = format!(
            "`gen shape {} --seed {} --noise {} -o {path} --truth {truth}`",
            self.name, self.seed, self.noise
        );
        let carries = format!("{} triangles, {} vertices", shape.faces.len(), shape.vertices.len());
        let lines = format!("{} true feature lines of `{}.ply`", shape.lines.len(), self.stem);
        let made = format!("with `{}.ply`", self.stem);
        Ok([
            Fixture { path, made: command, carries, bytes: mesh_bytes(&shape, Scalar::Float)? },
            Fixture { path: truth, made, carries: lines, bytes: line_bytes(&shape.lines)? },
        ])
    }
}

/// All files, the list `SOURCES.md` last.
///
/// # Errors
/// If one cannot be made.
pub fn all() -> Result<Vec<Fixture>> {
    let mut fixtures = Vec::new();
    for generated in GENERATED {
        fixtures.extend(generated.files()?);
    }
    fixtures.extend(by_hand()?);
    fixtures.push(Fixture {
        path: ".gitattributes".into(),
        made: "by hand".into(),
        carries: "keeps git from changing line ends".into(),
        bytes: b"* -text\n".to_vec(),
    });
    let list = sources(&fixtures);
    fixtures.push(Fixture {
        path: "SOURCES.md".into(),
        made: "from the list".into(),
        carries: "this list".into(),
        bytes: list.into_bytes(),
    });
    Ok(fixtures)
}

fn by_hand() -> Result<Vec<Fixture>> {
    let file = |path: &str, carries: &str, bytes: Vec<u8>| Fixture {
        path: path.into(),
        made: "by hand".into(),
        carries: carries.into(),
        bytes,
    };
    let defects = mesh_bytes(&handmade::defects(), Scalar::Float)?;
    Ok(vec![
        file(
            "meshes/defects.ply",
            "an open grid of 8 x 8 cells with two triangles each, of which 3 x 2 cells have flipped winding (faces \
             72-77 and 88-93); then face 128: copy of face 0; 129: repeated index; 130: no area; 131: third face at \
             the edge of vertices 28 and 29; 132: isolated triangle; vertex 82 is not referenced",
            defects,
        ),
        file(
            "meshes/polygons.ply",
            "a prism over a pentagon: 2 pentagons and 5 quads (16 triangles as fans), closed; double coordinates, \
             list counts in 16 bits, further properties before, between and behind, one of them a list",
            handmade::polygons()?,
        ),
        file("meshes/ascii.ply", "a cube of 12 triangles as text", handmade::ascii()),
        file("broken/truncated.ply", "a cube; the last 50 bytes are missing", handmade::truncated()?),
        file(
            "broken/index_out_of_range.ply",
            "a cube of 8 vertices whose face 7 names vertex 8",
            handmade::index_out_of_range()?,
        ),
        file("broken/nan_vertex.ply", "a cube whose vertex 3 has NaN as y", handmade::nan_vertex()?),
        file("broken/empty.ply", "a valid header that announces 0 vertices and 0 faces", handmade::empty()?),
        file("broken/no_faces.ply", "8 points; there is no element `face`", handmade::no_faces()?),
        file("broken/text.txt", "a sentence, not a mesh", handmade::text()),
    ])
}

/// Writes all files below `directory`.
///
/// # Errors
/// If one cannot be made or written.
pub fn write(directory: &Path) -> Result<()> {
    for fixture in all()? {
        let path = directory.join(&fixture.path);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).with_context(|| format!("cannot create {}", parent.display()))?;
        }
        fs::write(&path, &fixture.bytes).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// The list of files.
fn sources(fixtures: &[Fixture]) -> String {
    let mut text = format!(
        "# Where the test files come from\n\n\
         All files but `golden/`, this one too, are written by\n\n```\n{COMMAND}\n```\n\n\
         and `tests/fixtures.rs` compares them byte by byte with what the generator in `tools/gen/` makes. `gen` below \
         stands for `cargo run --release --example gen --`. Lengths are in units of the target edge length, noise is \
         in mean edge lengths along the vertex normals. `*.truth.ply` are the feature lines of the surface without \
         noise, as vertices and edges; borders of open meshes are not among them.\n\n\
         | file | bytes | made | carries |\n| --- | ---: | --- | --- |\n"
    );
    for Fixture { path, made, carries, bytes } in fixtures {
        let _ = writeln!(text, "| `{path}` | {} | {made} | {carries} |", bytes.len());
    }
    text.push_str(
        "\n`golden/` is not written by the generator: it holds three noisy shapes and what the executable specification \
         finds on them, written by `tools/reference/run golden`; `tests/reference.rs` compares.\n",
    );
    text
}
