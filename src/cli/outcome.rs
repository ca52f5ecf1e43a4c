//! What is known at the end of a run, put together as a report.
//!
//! In: what was asked for, what the pipeline found, what the machine was seen to use. Out: the [`Report`] that all reports and
//! the summary are made from.

use super::memory::StageUse;
use crate::config::{Limits, Method, NO_LIMIT, PaperThresholds, Params, Tiling, method};
use crate::input::LeftOut;
use crate::pipeline::Detection;
use crate::report::{
    CLASSES, ClassCount, Defects, Found, Histograms, InEffect, Input, InputFile, Mesh, Output, Parameters,
    Program, Report, SCHEMA, Stage, Thresholds, Waits, Work, is_crease,
};
use crate::stitch::{Class, Geometry, Statistics};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Everything that is known at the end of a run.
pub(super) struct Outcome<'a> {
    /// The command line.
    pub words: &'a [OsString],
    pub input: &'a Path,
    pub files: &'a [PathBuf],
    pub converted: bool,
    pub params: &'a Params,
    /// The preset and what it set, if one was chosen.
    pub preset: Option<String>,
    pub geometry: Geometry,
    pub limits: &'a Limits,
    pub io: &'static str,
    pub found: &'a Detection<Statistics>,
    pub histograms: &'a Histograms,
    /// Edges of all lines.
    pub edges: u64,
    /// Faces that were not used because they could not be.
    pub left_out: LeftOut,
    pub used: Used,
    pub outputs: Vec<Output>,
}

/// What the machine was seen to use.
pub(super) struct Used {
    /// Of the whole run.
    pub wall: Duration,
    pub cpu: Option<Duration>,
    /// Largest resident set, in bytes.
    pub peak: Option<u64>,
    /// The same without mapped files.
    pub anonymous: Option<u64>,
    /// Most that was allocated at a time, in bytes.
    pub allocated: u64,
    /// What each stage used.
    pub stages: Vec<StageUse>,
}

/// An output whose bytes lie at `written` for now.
pub(super) fn output(path: &Path, written: &Path) -> Output {
    Output { path: text(path), bytes: fs::metadata(written).map(|found| found.len()).ok() }
}

/// A name as text; what is not UTF-8 in it is replaced.
fn text(path: &Path) -> String {
    path.display().to_string()
}

impl Outcome<'_> {
    /// The report of the run.
    pub fn report(self) -> Report {
        Report {
            schema: SCHEMA,
            program: Program::THIS,
            command: self.words.iter().map(|word| word.to_string_lossy().into_owned()).collect(),
            input: self.input(),
            parameters: self.parameters(),
            limits: self.limits(),
            mesh: self.mesh(),
            found: self.found(),
            histograms: self.histograms.clone(),
            defects: self.defects(),
            work: self.work(),
            outputs: self.outputs,
        }
    }

    fn input(&self) -> Input {
        let file = |path: &PathBuf| {
            let Output { path, bytes } = output(path, path);
            InputFile { path, bytes }
        };
        let files = self.files.iter().map(file).collect();
        Input { name: text(self.input), files, converted: self.converted }
    }

    fn parameters(&self) -> Parameters {
        let (sigma, edge) = (self.found.work.sigma, self.found.scan.median_side);
        let thresholds = match self.params.method {
            Method::Robust => None,
            Method::Paper(PaperThresholds { salience, edge_l2, corner_l3 }) => {
                Some(Thresholds { salience, edge_l2, corner_l3 })
            }
        };
        Parameters {
            method: if thresholds.is_some() { "paper" } else { "robust" },
            thresholds,
            sigma,
            sigma_edges: if edge > 0.0 { sigma / edge } else { method::SIGMA_EDGES },
            min_angle: self.params.min_angle_deg,
            min_length_sigmas: self.params.min_length_sigmas,
            boundaries: self.params.boundaries,
            preset: self.preset.clone(),
            geometry: match self.geometry {
                Geometry::Vertices => "vertices",
                Geometry::Fitted => "fitted",
            },
        }
    }

    fn limits(&self) -> InEffect {
        let Limits { threads, tiling, memory, .. } = *self.limits;
        let (tiling, tile_faces) = match tiling {
            Tiling::Auto => ("auto", None),
            Tiling::InCore => ("in-core", None),
            Tiling::Faces(faces) => ("faces", Some(faces)),
        };
        let memory_bytes = (memory != NO_LIMIT).then_some(memory);
        InEffect { threads: threads as u64, memory_bytes, tiling, tile_faces, io: self.io }
    }

    fn mesh(&self) -> Mesh {
        let scan = &self.found.scan;
        Mesh {
            faces: scan.faces,
            vertices: scan.vertices,
            min: scan.bounds.min.to_array(),
            max: scan.bounds.max.to_array(),
            median_edge: scan.median_side,
            mean_edge: scan.mean_side,
            shortest_edge: scan.side_range.0,
            longest_edge: scan.side_range.1,
        }
    }

    fn found(&self) -> Found {
        let Statistics { all, classes, closed, corners, .. } = &self.found.lines;
        let count = |class: Class| {
            let total = &classes[class as usize];
            let angle = |angle: f64| is_crease(class).then_some(angle);
            let [least, most] = total.angles.map(angle);
            let mean_angle = angle(total.mean_angle());
            let (class, lines, length) = (class.name(), total.lines, total.length);
            ClassCount { class, lines, length, mean_angle, least_angle: least, most_angle: most }
        };
        Found {
            lines: all.lines,
            length: all.length,
            edges: self.edges,
            closed: *closed,
            corners: *corners,
            classes: CLASSES.into_iter().map(count).filter(|class| class.lines > 0).collect(),
        }
    }

    fn defects(&self) -> Defects {
        let (seen, scan, left_out) = (&self.found.defects, &self.found.scan, &self.left_out);
        Defects {
            left_out_missing: left_out.missing,
            left_out_unusable: left_out.unusable,
            unusable_vertices: left_out.vertices,
            degenerate_faces: seen.degenerate_faces,
            repeated_corner: scan.repeated_corner,
            duplicate_faces: seen.duplicate_faces,
            boundary_edges: seen.boundary_edges,
            nonmanifold_edges: seen.nonmanifold_edges,
            opposed_edges: seen.opposed_edges,
            unreferenced_vertices: scan.unreferenced,
        }
    }

    fn work(&self) -> Work {
        let (work, used) = (&self.found.work, &self.used);
        let seconds = |time: Duration| time.as_secs_f64();
        let stage = |(i, (stage, wall)): (usize, &(crate::pipeline::Stage, Duration))| {
            // By place: a stage can come twice.
            let used = used.stages.get(i).filter(|used| used.stage == *stage);
            Stage {
                stage: stage.name(),
                wall_seconds: wall.as_secs_f64(),
                cpu_seconds: used.and_then(|used| used.cpu).map(seconds),
                read_bytes: used.and_then(|used| used.read),
                written_bytes: used.and_then(|used| used.written),
                allocated_bytes: used.map(|used| used.allocated),
            }
        };
        let halo_overhead = match work.owned_faces {
            0 => 0.0,
            owned => (work.loaded_faces as f64 / owned as f64 - 1.0).max(0.0),
        };
        let (resumed_tiles, all_tiles) = work.resumed;
        Work {
            tiles: work.tiles,
            resumed_tiles,
            all_tiles,
            owned_faces: work.owned_faces,
            loaded_faces: work.loaded_faces,
            halo_overhead,
            regrown: work.regrown,
            rewritten: work.rewritten,
            temporary_bytes: work.temporary_bytes,
            waits: Waits {
                for_memory_seconds: seconds(work.waits.for_memory),
                for_workers_seconds: seconds(work.waits.for_workers),
                for_tiles_seconds: seconds(work.waits.for_tiles),
                for_committer_seconds: seconds(work.waits.for_committer),
                taken_tiles: work.waits.taken,
                ready_tiles: work.waits.ready,
            },
            wall_seconds: seconds(used.wall),
            cpu_seconds: used.cpu.map(seconds),
            peak_allocated_bytes: used.allocated,
            peak_resident_bytes: used.peak,
            peak_anonymous_bytes: used.anonymous,
            stages: work.stages.iter().enumerate().map(stage).collect(),
        }
    }
}
