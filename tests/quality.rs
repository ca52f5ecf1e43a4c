//! The lines that the program finds on generated shapes, scored with the metric of `tools/quality`, and the tests of that
//! metric.

#[path = "../tools/quality/baselines/mod.rs"]
#[allow(dead_code, reason = "the benchmark uses more of it")]
mod baselines;
#[path = "../tools/quality/lines_file.rs"]
mod lines_file;
#[path = "../tools/quality/mesh.rs"]
#[allow(dead_code, reason = "the benchmark uses more of it")]
mod mesh;
#[path = "../tools/quality/metric/mod.rs"]
#[allow(dead_code, reason = "the benchmark uses more of it")]
mod metric;
#[path = "../tools/quality/pairs.rs"]
#[allow(dead_code, reason = "the benchmark uses more of it")]
mod pairs;
