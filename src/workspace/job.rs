//! What a run was asked for and what it decided before its first tile: all that results of tiles depend on.
//!
//! In: the parameters, the input, the plan. Out: a [`JobRecord`], and whether two runs are the same job; if not, the
//! name of what differs. Limits (memory, threads, the size of tiles) are not part of a job: they decide how the mesh was
//! cut, and the cells themselves are recorded.

use crate::config::{Method, Params, Sigma};
use crate::input::MeshSource;
use crate::partition::{Cell, Scan, SortedTable};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// What another run must have in common to go on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program: another may find other lines.
    pub version: String,
    /// What changes the result.
    pub params: Params,
    /// Whether the results hold the fields of all vertices.
    pub fields: bool,
    /// The mesh.
    pub input: InputMark,
}

/// What the input was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputMark {
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub faces: u64,
    /// Size and time of its file, if it is one.
    pub file: Option<FileMark>,
    /// [`crate::partition::content()`], as soon as that is known.
    pub content: Option<u128>,
}

/// What the system says of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileMark {
    /// Bytes.
    pub bytes: u64,
    /// When it was last written: seconds and nanoseconds since 1970.
    pub written: (u64, u32),
}

/// What tiles are loaded from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MeshRecord {
    /// The file as it is.
    File,
    /// The file with the positions beside its faces; not kept.
    Joined,
    /// The copy in spatial order that is kept.
    Sorted(SortedTable),
}

/// Everything that is fixed before the first tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Which job it is.
    pub identity: Identity,
    /// What the scan found, without the sample.
    pub scan: Scan,
    /// The cells, one for each tile.
    pub cells: Vec<Cell>,
    /// Refinement rounds that most places need at most.
    pub rounds: u32,
    /// What tiles are loaded from.
    pub mesh: MeshRecord,
}

/// The first thing in which two jobs differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its name.
    pub what: &'static str,
    /// What it was.
    pub before: String,
    /// What it is.
    pub now: String,
}

impl InputMark {
    /// Of `source`, whose content is not known yet.
    pub fn of(source: &dyn MeshSource) -> InputMark {
        // Many files together have a name, but no file of that name.
        let file = source.file().and_then(FileMark::of);
        InputMark { vertices: source.vertex_count(), faces: source.face_count(), file, content: None }
    }
}

impl FileMark {
    /// Of the file at `path`, if it is one.
    pub fn of(path: &Path) -> Option<FileMark> {
        fs::metadata(path).ok().filter(fs::Metadata::is_file).map(|found| {
            // A file system that knows no times has none that could differ.
            let written = found.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let since = written.duration_since(UNIX_EPOCH).unwrap_or_default();
            FileMark { bytes: found.len(), written: (since.as_secs(), since.subsec_nanos()) }
        })
    }
}

impl Identity {
    /// What this version of the program is called.
    pub fn this_version() -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }

    /// Of a run over `source`.
    pub fn of(source: &dyn MeshSource, params: &Params, fields: bool) -> Identity {
        let version = Identity::this_version();
        Identity { version, params: *params, fields, input: InputMark::of(source) }
    }

    /// In what `now` differs, if that matters. Results that hold fields do for a run that asks for none. Of the content
    /// nothing is said as long as one of them does not know it. The time of the file decides nothing: a copy of the file
    /// is the same mesh, and whether it is the content says.
    pub fn difference(&self, now: &Identity) -> Option<Difference> {
        let (a, b) = (&self.params, &now.params);
        let degrees = |x: f64| format!("{x} degrees");
        let written = |on| if on { "written" } else { "not written" }.to_owned();
        let given = |on| if on { "given" } else { "not given" }.to_owned();
        let file = |mark: &InputMark| mark.file.map_or(0, |file| file.bytes);
        let contents = self.input.content.zip(now.input.content);
        let both_files = self.input.file.is_some() && now.input.file.is_some();
        [
            (self.version != now.version, "the version of crease", self.version.clone(), now.version.clone()),
            (a.method != b.method, "--method", method(&a.method), method(&b.method)),
            (a.sigma != b.sigma, "--sigma", sigma(a.sigma), sigma(b.sigma)),
            (
                differ(a.min_angle_deg, b.min_angle_deg),
                "--min-angle",
                degrees(a.min_angle_deg),
                degrees(b.min_angle_deg),
            ),
            (
                differ(a.min_length_sigmas, b.min_length_sigmas),
                "--min-length",
                format!("{} sigmas", a.min_length_sigmas),
                format!("{} sigmas", b.min_length_sigmas),
            ),
            (a.boundaries != b.boundaries, "--boundaries", given(a.boundaries), given(b.boundaries)),
            (
                !self.fields && now.fields,
                "--annotate or --attributes",
                written(self.fields),
                written(now.fields),
            ),
            (
                self.input.vertices != now.input.vertices,
                "the number of vertices of the input",
                self.input.vertices.to_string(),
                now.input.vertices.to_string(),
            ),
            (
                self.input.faces != now.input.faces,
                "the number of faces of the input",
                self.input.faces.to_string(),
                now.input.faces.to_string(),
            ),
            (
                both_files && file(&self.input) != file(&now.input),
                "the size of the input in bytes",
                file(&self.input).to_string(),
                file(&now.input).to_string(),
            ),
            (
                contents.is_some_and(|(a, b)| a != b),
                "the fingerprint of the mesh in the input",
                self.input.fingerprint(),
                now.input.fingerprint(),
            ),
        ]
        .into_iter()
        .find(|row| row.0)
        .map(|(_, what, before, now)| Difference { what, before, now })
    }
}

impl InputMark {
    /// For a person who wonders what has changed.
    fn fingerprint(&self) -> String {
        let written = self.file.map_or(String::new(), |file| {
            let (seconds, nanoseconds) = file.written;
            format!(" (file written {seconds}.{nanoseconds:09} s after 1970)")
        });
        format!("{:032x}{written}", self.content.unwrap_or(0))
    }
}

/// Bit for bit: what is not a number equals itself.
fn differ(a: f64, b: f64) -> bool {
    a.to_bits() != b.to_bits()
}

fn sigma(sigma: Sigma) -> String {
    match sigma {
        Sigma::Edges(edges) => format!("{edges} median edges"),
        Sigma::Length(length) => format!("{length} mesh units"),
    }
}

fn method(method: &Method) -> String {
    match method {
        Method::Robust => "robust".to_owned(),
        Method::Paper(t) => {
            format!("paper (salience {}, edge-l2 {}, corner-l3 {})", t.salience, t.edge_l2, t.corner_l3)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PaperThresholds;

    fn identity() -> Identity {
        let file = Some(FileMark { bytes: 100, written: (5, 6) });
        let input = InputMark { vertices: 4, faces: 2, file, content: Some(77) };
        Identity { version: "1.0.0".to_owned(), params: Params::default(), fields: false, input }
    }

    #[test]
    fn what_differs_is_named() {
        let base = identity();
        let changed = |change: &dyn Fn(&mut Identity)| {
            let mut now = base.clone();
            change(&mut now);
            base.difference(&now).map(|difference| difference.what)
        };
        assert_eq!(changed(&|_| {}), None);
        let paper = Method::Paper(PaperThresholds::default());
        assert_eq!(changed(&|now| now.version = "1.0.1".to_owned()), Some("the version of crease"));
        assert_eq!(changed(&|now| now.params.method = paper), Some("--method"));
        assert_eq!(changed(&|now| now.params.sigma = Sigma::Length(3.0)), Some("--sigma"));
        assert_eq!(changed(&|now| now.params.min_angle_deg = 1e-300), Some("--min-angle"));
        assert_eq!(changed(&|now| now.params.min_length_sigmas = 0.0), Some("--min-length"));
        assert_eq!(changed(&|now| now.params.boundaries = true), Some("--boundaries"));
        assert_eq!(changed(&|now| now.fields = true), Some("--annotate or --attributes"));
        assert_eq!(changed(&|now| now.input.vertices = 5), Some("the number of vertices of the input"));
        assert_eq!(changed(&|now| now.input.faces = 5), Some("the number of faces of the input"));
        let mark = |bytes, seconds| Some(FileMark { bytes, written: (seconds, 6) });
        assert_eq!(changed(&|now| now.input.file = mark(99, 5)), Some("the size of the input in bytes"));
        assert_eq!(changed(&|now| now.input.file = mark(100, 9)), None);
        let content = Some("the fingerprint of the mesh in the input");
        assert_eq!(changed(&|now| now.input.content = Some(78)), content);
        assert_eq!(changed(&|now| now.input.content = None), None);
        let mut with_fields = base.clone();
        with_fields.fields = true;
        assert_eq!(with_fields.difference(&base), None);
    }

    #[test]
    fn numbers_are_said_as_they_were_given() {
        let mut now = identity();
        now.params.sigma = Sigma::Edges(4.5);
        let difference = identity().difference(&now).expect("another sigma");
        assert_eq!([difference.before, difference.now], ["3 median edges", "4.5 median edges"]);
    }
}
