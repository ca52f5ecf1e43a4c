//! Scores feature lines against known ones.
//!
//! ```text
//!  sets ──> case ──────────> run ──────────> results ──> tables, markdown, targets ──> report
//!           generator, pairs │ program, lines_file    └─> compare                    └─> sheet
//!                            │ baselines
//!                            └ metric
//! ```
//!
//! In go meshes whose lines are known, out come scores by case and method. The same program and arguments give the same
//! results, byte for byte. This is the reusable part of the example `quality`; tests include it by path.

pub mod arguments;
pub mod baselines;
pub mod case;
pub mod compare;
#[path = "../gen/mod.rs"]
#[allow(dead_code, reason = "the generator also writes fixtures")]
pub mod generator;
pub mod groups;
pub mod lines_file;
pub mod markdown;
pub mod mesh;
pub mod methods;
pub mod metric;
pub mod pairs;
pub mod program;
pub mod report;
pub mod results;
pub mod run;
pub mod sets;
pub mod sheet;
pub mod tables;
pub mod targets;
