//! The summary of a run, for a person to read.
//!
//! In: what was found and how. Out: text in three parts: what was found, how the work went, what was written.

use super::memory::StageUse;
use super::text::{
    bytes, counted, decimals_for, entry, grouped, measure, percent, span, table, with_decimals,
};
use crate::config::{Method, NO_LIMIT, PaperThresholds, Params, method};
use crate::input::LeftOut;
use crate::pipeline::{Detection, Stage};
use crate::stitch::{Class, ClassTotal, Statistics};
use std::fmt;
use std::path::Path;
use std::time::Duration;

/// Everything that is known at the end of a run.
pub(super) struct Outcome<'a> {
    pub input: &'a str,
    pub params: &'a Params,
    /// The preset and what it set, if one was chosen.
    pub preset: Option<String>,
    pub found: &'a Detection<Statistics>,
    /// Faces that were not used because they could not be.
    pub left_out: LeftOut,
    pub threads: usize,
    pub io: &'static str,
    /// Of the whole run.
    pub wall: Duration,
    pub cpu: Option<Duration>,
    /// Largest resident set, in bytes.
    pub peak: Option<u64>,
    /// The same without mapped files.
    pub anonymous: Option<u64>,
    /// Most that was allocated at a time, in bytes.
    pub allocated: u64,
    /// What may be allocated.
    pub memory: u64,
    /// What each stage used.
    pub stages: Vec<StageUse>,
    pub written: Vec<Written<'a>>,
}

/// An output.
pub(super) struct Written<'a> {
    pub path: &'a Path,
    pub bytes: Option<u64>,
}

/// Faces that were left out, each kind with its words for one and for many.
pub(super) fn left_out_rows(left_out: &LeftOut) -> [(u64, &'static str, &'static str); 3] {
    [
        (
            left_out.missing,
            "face left out: it names a vertex that does not exist",
            "faces left out: they name vertices that do not exist",
        ),
        (
            left_out.unusable,
            "face left out: it has coordinates that are not finite",
            "faces left out: they have coordinates that are not finite",
        ),
        (
            left_out.vertices,
            "vertex with coordinates that are not finite",
            "vertices with coordinates that are not finite",
        ),
    ]
}

/// Classes in the order in which they interest.
const CLASSES: [Class; 4] = [Class::Sharp, Class::Weak, Class::Boundary, Class::NonManifold];

impl fmt::Display for Outcome<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.mesh(f)?;
        self.lines(f)?;
        self.defects(f)?;
        self.work(f)?;
        self.files(f)
    }
}

impl Outcome<'_> {
    fn mesh(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scan = &self.found.scan;
        let sigma = self.found.work.sigma;
        writeln!(f, "{}", self.input)?;
        let faces = counted(scan.faces, "face", "faces");
        f.write_str(&entry("mesh", &format!("{faces}, {}", counted(scan.vertices, "vertex", "vertices"))))?;
        f.write_str(&entry("median edge", &format!("{} mesh units", measure(scan.median_side))))?;
        let edges = if scan.median_side > 0.0 { sigma / scan.median_side } else { method::SIGMA_EDGES };
        f.write_str(&entry("sigma", &format!("{} mesh units ({edges:.2} median edges)", measure(sigma))))?;
        if let Some(preset) = &self.preset {
            f.write_str(&entry("preset", preset))?;
        }
        match &self.params.method {
            Method::Robust => Ok(()),
            Method::Paper(PaperThresholds { salience, edge_l2, corner_l3 }) => f.write_str(&entry(
                "method",
                &format!("paper, salience from {salience}, sharp edges from l2 {edge_l2}, corners from l3 {corner_l3}"),
            )),
        }
    }

    fn lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Statistics { all, classes, closed, corners, .. } = self.found.lines.clone();
        let ClassTotal { lines: count, length, .. } = all;
        if count == 0 {
            return write!(f, "\nfound no lines; for weaker, shorter or finer ones try\n{}", self.hints());
        }
        // One number of decimals for all, so that lengths can be compared at a glance.
        let decimals = decimals_for(length, 5);
        writeln!(
            f,
            "\nfound {}, {} mesh units in total; {}; {}",
            counted(count, "line", "lines"),
            with_decimals(length, decimals),
            counted(closed, "closed loop", "closed loops"),
            counted(corners, "corner", "corners")
        )?;
        let head = ["class", "lines", "length", "share", "fold seen", "from", "to"].map(str::to_owned);
        let mut rows = vec![head.to_vec()];
        for class in CLASSES {
            let total = &classes[class as usize];
            if total.lines > 0 {
                let (name, share) = (class.name().to_owned(), percent(total.length, length));
                let mut row = vec![name, grouped(total.lines), with_decimals(total.length, decimals), share];
                if matches!(class, Class::Weak | Class::Sharp) {
                    let [least, most] = total.angles;
                    row.extend([total.mean_angle(), least, most].map(|angle| format!("{angle:.1}°")));
                }
                rows.push(row);
            }
        }
        f.write_str(&table(2, &rows))
    }

    /// What to try when nothing was found.
    fn hints(&self) -> String {
        let mut hints = String::new();
        if let Method::Paper(thresholds) = &self.params.method {
            hints.push_str(&format!("  --salience below {}\n", thresholds.salience));
            hints.push_str(&format!("  --edge-l2 below {}\n", thresholds.edge_l2));
        }
        if self.params.min_angle_deg > 0.0 {
            hints.push_str(&format!("  --min-angle below {}\n", self.params.min_angle_deg));
        }
        if self.params.min_length_sigmas > 0.0 {
            hints.push_str(&format!("  --min-length below {:.2}\n", self.params.min_length_sigmas));
        }
        let sigma = self.found.work.sigma;
        let fine =
            if sigma > 0.0 { format!("below {} for fine features, ", measure(sigma)) } else { String::new() };
        hints.push_str(&format!("  --sigma {fine}above {} for noisy surfaces\n", measure(sigma)));
        hints
    }

    fn defects(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seen, scan) = (&self.found.defects, &self.found.scan);
        let left_out = left_out_rows(&self.left_out);
        let all = [
            (seen.degenerate_faces, "face without area", "faces without area"),
            (scan.repeated_corner, "face that names a vertex twice", "faces that name a vertex twice"),
            (seen.duplicate_faces, "duplicate of another face", "duplicates of other faces"),
            (seen.boundary_edges, "boundary edge, with one face only", "boundary edges, with one face only"),
            (
                seen.nonmanifold_edges,
                "non-manifold edge, with three or more faces",
                "non-manifold edges, with three or more faces",
            ),
            (
                seen.opposed_edges,
                "edge between faces of opposite winding",
                "edges between faces of opposite winding",
            ),
            (scan.unreferenced, "vertex that no face uses", "vertices that no face uses"),
        ];
        let rows: Vec<(u64, &str)> = left_out
            .into_iter()
            .chain(all)
            .filter(|(n, ..)| *n > 0)
            .map(|(n, one, many)| (n, if n == 1 { one } else { many }))
            .collect();
        if rows.is_empty() {
            return f.write_str("\ndefects seen: none\n");
        }
        let width = rows.iter().map(|(n, _)| grouped(*n).len()).max().unwrap_or(0);
        f.write_str("\ndefects seen\n")?;
        rows.iter().try_for_each(|(n, what)| writeln!(f, "  {:>width$}  {what}", grouped(*n)))
    }

    fn work(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let work = &self.found.work;
        f.write_str("\nhow it was done\n")?;
        let regrown = match work.regrown {
            0 => String::new(),
            n => format!(", {}", counted(n, "region regrown", "regions regrown")),
        };
        let halo = match work.owned_faces {
            0 => 0.0,
            owned => 100.0 * (work.loaded_faces as f64 / owned as f64 - 1.0).max(0.0),
        };
        let tiles = counted(work.tiles, "tile", "tiles");
        f.write_str(&entry("tiles", &format!("{tiles}, halo overhead {halo:.1} %{regrown}")))?;
        if work.resumed.0 > 0 {
            let (done, all) = work.resumed;
            let done = format!("{} of {} were done before", grouped(done), counted(all, "tile", "tiles"));
            f.write_str(&entry("resumed", &done))?;
        }
        if work.temporary_bytes > 0 {
            let did = |stage| work.stages.iter().any(|(done, _)| *done == stage);
            let reasons = [
                (did(Stage::Convert), "the input was converted"),
                (work.rewritten, "the mesh was rewritten in spatial order"),
                (did(Stage::Order) && !work.rewritten, "positions were joined to faces"),
            ];
            let reasons = reasons.iter().filter(|(is_so, _)| *is_so).map(|(_, what)| format!("; {what}"));
            let most = bytes(work.temporary_bytes);
            f.write_str(&entry(
                "temporary files",
                &format!("at most {most} at a time{}", reasons.collect::<String>()),
            ))?;
        }
        f.write_str(&entry("threads", &format!("{}, io {}", grouped(self.threads as u64), self.io)))?;
        f.write_str(&entry("wall time", &span(self.wall)))?;
        f.write_str(&entry("CPU time", &self.cpu.map_or_else(not_available, span)))?;
        let allowed = match self.memory {
            NO_LIMIT => String::new(),
            memory => format!(" of {}", bytes(memory)),
        };
        let peak = self.peak.map_or_else(not_available, bytes);
        let own = self.anonymous.map_or(String::new(), |n| format!(", {} without mapped files", bytes(n)));
        let allocated = bytes(self.allocated);
        f.write_str(&entry("peak memory", &format!("{allocated}{allowed} allocated; resident {peak}{own}")))?;
        self.stages(f)
    }

    fn stages(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = ["stage", "wall", "CPU", "from disk", "written", "allocated"].map(str::to_owned);
        let mut rows = vec![head.to_vec()];
        for (i, (stage, wall)) in self.found.work.stages.iter().enumerate() {
            // By place: a stage can come twice.
            let used = self.stages.get(i).filter(|used| used.stage == *stage);
            let amount =
                |of: fn(&StageUse) -> Option<u64>| used.and_then(of).map_or_else(not_available, bytes);
            rows.push(vec![
                stage.name().to_owned(),
                span(*wall),
                used.and_then(|used| used.cpu).map_or_else(not_available, span),
                amount(|used| used.read),
                amount(|used| used.written),
                amount(|used| Some(used.allocated)),
            ]);
        }
        f.write_str("\n")?;
        f.write_str(&table(2, &rows))
    }

    fn files(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\nwritten\n")?;
        let row = |written: &Written| {
            let size = written.bytes.map_or_else(not_available, bytes);
            vec![written.path.display().to_string(), size]
        };
        f.write_str(&table(2, &self.written.iter().map(row).collect::<Vec<_>>()))
    }
}

fn not_available() -> String {
    "not available".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::{Bounds, Scan};
    use crate::pipeline::Work;
    use crate::refine::Bend;
    use crate::stitch::{Defects, Measures, StitchWork};

    fn detection(lines: Vec<Measures>) -> Detection<Statistics> {
        let scan = Scan {
            mean_side: 0.6,
            vertices: 1,
            faces: 1234,
            bounds: Bounds::EMPTY,
            median_side: 0.5,
            side_range: (0.1, 2.0),
            repeated_corner: 1,
            unreferenced: 0,
            blocks: Vec::new(),
            sample: Vec::new(),
            sample_stride: 1,
            content: 0,
        };
        let defects = Defects { boundary_edges: 1200, ..Defects::default() };
        let work = Work {
            sigma: 1.5,
            tiles: 4,
            resumed: (0, 4),
            owned_faces: 1000,
            loaded_faces: 1250,
            regrown: 1,
            rewritten: false,
            temporary_bytes: 0,
            stitch: StitchWork::default(),
            stages: vec![(Stage::Scan, Duration::from_secs(1))],
        };
        let mut statistics = Statistics::default();
        lines.iter().for_each(|line| statistics.add_line(line));
        Detection { lines: statistics, scan, defects, work }
    }

    fn text(found: &Detection<Statistics>) -> String {
        text_of(found, &Params { min_angle_deg: 5.0, ..Params::default() })
    }

    fn text_of(found: &Detection<Statistics>, params: &Params) -> String {
        Outcome {
            input: "scan.ply",
            params,
            preset: None,
            found,
            left_out: LeftOut::default(),
            threads: 2,
            io: "auto",
            wall: Duration::from_secs(2),
            cpu: None,
            peak: None,
            anonymous: None,
            allocated: 30_000_000,
            memory: 1_000_000_000,
            stages: vec![StageUse {
                stage: Stage::Scan,
                cpu: Some(Duration::from_secs(3)),
                read: Some(4096),
                written: None,
                allocated: 20_000_000,
            }],
            written: vec![Written { path: "scan.creases.ply".as_ref(), bytes: Some(2500) }],
        }
        .to_string()
    }

    fn line(class: Class, length: f64, angle: f64) -> Measures {
        let closed = class == Class::Weak;
        let bend = Bend::Unknown;
        Measures { class, closed, length, strength: 0.5, angle, bend }
    }

    #[test]
    fn classes_are_summed_up() {
        let lines = vec![
            line(Class::Sharp, 30.0, 90.0),
            line(Class::Sharp, 10.0, 50.0),
            line(Class::Weak, 10.0, 20.0),
            line(Class::Boundary, 50.0, 0.0),
        ];
        let expected = "\
scan.ply
  mesh              1,234 faces, 1 vertex
  median edge       0.5000 mesh units
  sigma             1.500 mesh units (3.00 median edges)

found 4 lines, 100.00 mesh units in total; 1 closed loop; 0 corners
  class     lines  length   share  fold seen   from     to
  sharp         2   40.00  40.0 %      80.0°  50.0°  90.0°
  weak          1   10.00  10.0 %      20.0°  20.0°  20.0°
  boundary      1   50.00  50.0 %

defects seen
      1  face that names a vertex twice
  1,200  boundary edges, with one face only

how it was done
  tiles             4 tiles, halo overhead 25.0 %, 1 region regrown
  threads           2, io auto
  wall time         2.00 s
  CPU time          not available
  peak memory       30 MB of 1.0 GB allocated; resident not available

  stage    wall     CPU  from disk        written  allocated
  scan   1.00 s  3.00 s     4.1 kB  not available      20 MB

written
  scan.creases.ply  2.5 kB
";
        assert_eq!(text(&detection(lines)), expected);
    }

    #[test]
    fn finding_nothing_is_said_with_a_hint() {
        let text = text(&detection(Vec::new()));
        assert!(text.contains("\nfound no lines; "), "{text}");
        for hint in [
            "--min-angle below 5",
            "--min-length below 2.67",
            "--sigma below 1.500 for fine",
            "above 1.500 for noisy",
        ] {
            assert!(text.contains(hint), "{hint} is not in {text}");
        }
    }

    #[test]
    fn the_paper_method_is_named_with_its_thresholds() {
        let params = Params { method: Method::Paper(PaperThresholds::default()), ..Params::default() };
        let mut found = detection(Vec::new());
        found.work.sigma = 0.0;
        let text = text_of(&found, &params);
        for part in [
            "sigma             0 mesh units (0.00 median edges)",
            "method            paper, salience from 0.1, sharp edges from l2 0.02, corners from l3 0.065",
            "  --salience below 0.1\n",
            "  --sigma above 0 for noisy surfaces",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
    }
}
