//! The summary of a run, for a person to read.
//!
//! In: the report of the run. Out: text in three parts: what was found, how the work went, what was written.

use super::text::{
    bytes, counted, decimals_for, entry, grouped, measure, percent, span, table, with_decimals,
};
use crate::input::LeftOut;
use crate::report::{Defects, Report, Stage, Thresholds, Waits, Work};
use std::fmt;
use std::time::Duration;

/// A report as text.
pub(super) struct Summary<'a>(pub &'a Report);

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

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.mesh(f)?;
        self.lines(f)?;
        self.defects(f)?;
        self.work(f)?;
        self.files(f)
    }
}

impl Summary<'_> {
    fn mesh(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Report { input, mesh, parameters, .. } = self.0;
        writeln!(f, "{}", input.name)?;
        let faces = counted(mesh.faces, "face", "faces");
        f.write_str(&entry("mesh", &format!("{faces}, {}", counted(mesh.vertices, "vertex", "vertices"))))?;
        f.write_str(&entry("median edge", &format!("{} mesh units", measure(mesh.median_edge))))?;
        let (sigma, edges) = (measure(parameters.sigma), parameters.sigma_edges);
        f.write_str(&entry("sigma", &format!("{sigma} mesh units ({edges:.2} median edges)")))?;
        if let Some(preset) = &parameters.preset {
            f.write_str(&entry("preset", preset))?;
        }
        match parameters.thresholds {
            None => Ok(()),
            Some(Thresholds { salience, edge_l2, corner_l3 }) => f.write_str(&entry(
                "method",
                &format!("paper, salience from {salience}, sharp edges from l2 {edge_l2}, corners from l3 {corner_l3}"),
            )),
        }
    }

    fn lines(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = &self.0.found;
        if found.lines == 0 {
            return write!(f, "\nfound no lines; for weaker, shorter or finer ones try\n{}", self.hints());
        }
        // One number of decimals for all, so that lengths can be compared at a glance.
        let decimals = decimals_for(found.length, 5);
        writeln!(
            f,
            "\nfound {}, {} mesh units in total; {}; {}",
            counted(found.lines, "line", "lines"),
            with_decimals(found.length, decimals),
            counted(found.closed, "closed loop", "closed loops"),
            counted(found.corners, "corner", "corners")
        )?;
        let head = ["class", "lines", "length", "share", "fold seen", "from", "to"].map(str::to_owned);
        let mut rows = vec![head.to_vec()];
        for class in &found.classes {
            let (name, share) = (class.class.to_owned(), percent(class.length, found.length));
            let mut row = vec![name, grouped(class.lines), with_decimals(class.length, decimals), share];
            let angles = [class.mean_angle, class.least_angle, class.most_angle];
            row.extend(angles.iter().flatten().map(|angle| format!("{angle:.1}°")));
            rows.push(row);
        }
        f.write_str(&table(2, &rows))
    }

    /// What to try when nothing was found.
    fn hints(&self) -> String {
        let parameters = &self.0.parameters;
        let mut hints = String::new();
        if let Some(thresholds) = &parameters.thresholds {
            hints.push_str(&format!("  --salience below {}\n", thresholds.salience));
            hints.push_str(&format!("  --edge-l2 below {}\n", thresholds.edge_l2));
        }
        if parameters.min_angle > 0.0 {
            hints.push_str(&format!("  --min-angle below {}\n", parameters.min_angle));
        }
        if parameters.min_length_sigmas > 0.0 {
            hints.push_str(&format!("  --min-length below {:.2}\n", parameters.min_length_sigmas));
        }
        let sigma = parameters.sigma;
        let fine =
            if sigma > 0.0 { format!("below {} for fine features, ", measure(sigma)) } else { String::new() };
        hints.push_str(&format!("  --sigma {fine}above {} for noisy surfaces\n", measure(sigma)));
        hints
    }

    fn defects(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows: Vec<(u64, &str)> = defect_rows(&self.0.defects)
            .into_iter()
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
        let Report { work, limits, .. } = self.0;
        f.write_str("\nhow it was done\n")?;
        let regrown = match work.regrown {
            0 => String::new(),
            n => format!(", {}", counted(n, "region regrown", "regions regrown")),
        };
        let (tiles, halo) = (counted(work.tiles, "tile", "tiles"), 100.0 * work.halo_overhead);
        f.write_str(&entry("tiles", &format!("{tiles}, halo overhead {halo:.1} %{regrown}")))?;
        if work.resumed_tiles > 0 {
            let all = counted(work.all_tiles, "tile", "tiles");
            let done = format!("{} of {all} were done before", grouped(work.resumed_tiles));
            f.write_str(&entry("resumed", &done))?;
        }
        if work.temporary_bytes > 0 {
            let did = |name| work.stages.iter().any(|stage| stage.stage == name);
            let reasons = [
                (did("convert"), "the input was converted"),
                (work.rewritten, "the mesh was rewritten in spatial order"),
                (did("order") && !work.rewritten, "positions were joined to faces"),
            ];
            let reasons = reasons.iter().filter(|(is_so, _)| *is_so).map(|(_, what)| format!("; {what}"));
            let most = bytes(work.temporary_bytes);
            f.write_str(&entry(
                "temporary files",
                &format!("at most {most} at a time{}", reasons.collect::<String>()),
            ))?;
        }
        self.waits(f)?;
        f.write_str(&entry("threads", &format!("{}, io {}", grouped(limits.threads), limits.io)))?;
        f.write_str(&entry("wall time", &seconds(work.wall_seconds)))?;
        f.write_str(&entry("CPU time", &work.cpu_seconds.map_or_else(not_available, seconds)))?;
        let allowed = limits.memory_bytes.map_or(String::new(), |memory| format!(" of {}", bytes(memory)));
        let peak = work.peak_resident_bytes.map_or_else(not_available, bytes);
        let own = work
            .peak_anonymous_bytes
            .map_or(String::new(), |n| format!(", {} without mapped files", bytes(n)));
        let allocated = bytes(work.peak_allocated_bytes);
        f.write_str(&entry("peak memory", &format!("{allocated}{allowed} allocated; resident {peak}{own}")))?;
        self.stages(f)
    }

    /// Who waited for whom; with one tile everybody does.
    fn waits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Work { waits, tiles, .. } = &self.0.work;
        if *tiles < 2 {
            return Ok(());
        }
        let (memory, workers) = (seconds(waits.for_memory_seconds), seconds(waits.for_workers_seconds));
        let (for_tiles, ready) = (seconds(waits.for_tiles_seconds), percent_of(waits));
        f.write_str(&entry(
            "waiting",
            &format!(
                "loading {memory} for memory, {workers} for workers; workers {for_tiles} for tiles, {ready} lay ready"
            ),
        ))
    }

    fn stages(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = ["stage", "wall", "CPU", "from disk", "written", "allocated"].map(str::to_owned);
        let amount = |n: Option<u64>| n.map_or_else(not_available, bytes);
        let row = |stage: &Stage| {
            vec![
                stage.stage.to_owned(),
                seconds(stage.wall_seconds),
                stage.cpu_seconds.map_or_else(not_available, seconds),
                amount(stage.read_bytes),
                amount(stage.written_bytes),
                amount(stage.allocated_bytes),
            ]
        };
        let rows: Vec<_> = [head.to_vec()].into_iter().chain(self.0.work.stages.iter().map(row)).collect();
        f.write_str("\n")?;
        f.write_str(&table(2, &rows))
    }

    fn files(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\nwritten\n")?;
        let row = |output: &crate::report::Output| {
            vec![output.path.clone(), output.bytes.map_or_else(not_available, bytes)]
        };
        f.write_str(&table(2, &self.0.outputs.iter().map(row).collect::<Vec<_>>()))
    }
}

/// Defects, each with its words for one and for many.
fn defect_rows(defects: &Defects) -> Vec<(u64, &'static str, &'static str)> {
    let left_out = LeftOut {
        missing: defects.left_out_missing,
        unusable: defects.left_out_unusable,
        vertices: defects.unusable_vertices,
    };
    let seen = [
        (defects.degenerate_faces, "face without area", "faces without area"),
        (defects.repeated_corner, "face that names a vertex twice", "faces that name a vertex twice"),
        (defects.duplicate_faces, "duplicate of another face", "duplicates of other faces"),
        (defects.boundary_edges, "boundary edge, with one face only", "boundary edges, with one face only"),
        (
            defects.nonmanifold_edges,
            "non-manifold edge, with three or more faces",
            "non-manifold edges, with three or more faces",
        ),
        (
            defects.opposed_edges,
            "edge between faces of opposite winding",
            "edges between faces of opposite winding",
        ),
        (defects.unreferenced_vertices, "vertex that no face uses", "vertices that no face uses"),
    ];
    left_out_rows(&left_out).into_iter().chain(seen).collect()
}

fn seconds(seconds: f64) -> String {
    span(Duration::from_secs_f64(seconds))
}

/// How many of the tiles that workers took lay ready when they came.
fn percent_of(waits: &Waits) -> String {
    format!("{:.0} %", 100.0 * waits.ready_tiles as f64 / waits.taken_tiles.max(1) as f64)
}

fn not_available() -> String {
    "not available".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::memory::StageUse;
    use crate::cli::outcome::{Outcome, Used};
    use crate::config::{Limits, Method, PaperThresholds, Params};
    use crate::partition::{Bounds, Scan};
    use crate::pipeline::{Detection, Stage, Waits, Work};
    use crate::refine::Bend;
    use crate::report::{Histogram, Histograms, Output};
    use crate::stitch::{Class, Defects, Geometry, Measures, Statistics, StitchWork};

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
            waits: Waits {
                for_memory: Duration::from_secs(1),
                for_workers: Duration::from_secs(2),
                for_tiles: Duration::from_millis(500),
                for_committer: Duration::ZERO,
                taken: 4,
                ready: 3,
            },
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
        let none = Histogram { bounds: vec![0.0], classes: Vec::new() };
        let report = Outcome {
            words: &["crease".into()],
            input: "scan.ply".as_ref(),
            files: &[],
            converted: false,
            params,
            preset: None,
            geometry: Geometry::Vertices,
            limits: &Limits { threads: 2, memory: 1_000_000_000, ..Limits::default() },
            io: "auto",
            found,
            histograms: &Histograms { angle: none.clone(), length: none.clone(), strength: none },
            edges: 9,
            left_out: LeftOut::default(),
            used: Used {
                wall: Duration::from_secs(2),
                cpu: None,
                peak: None,
                anonymous: None,
                allocated: 30_000_000,
                stages: vec![StageUse {
                    stage: Stage::Scan,
                    cpu: Some(Duration::from_secs(3)),
                    read: Some(4096),
                    written: None,
                    allocated: 20_000_000,
                }],
            },
            outputs: vec![Output { path: "scan.creases.ply".to_owned(), bytes: Some(2500) }],
        }
        .report();
        Summary(&report).to_string()
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
  waiting           loading 1.00 s for memory, 2.00 s for workers; workers 0.50 s for tiles, 75 % lay ready
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
