//! Results as one table. In: a row for each run; out: markdown for people, JSON for programs.

use serde::Serialize;
use std::fmt::Write as _;
use std::fs;

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// `coherent` or `shuffled`.
    pub order: &'static str,
    /// Bytes of the mesh.
    pub input_bytes: u64,
    /// What `--memory` was, if it was given.
    pub memory: Option<String>,
    /// Limit of the cgroup in bytes; `None` without one.
    pub limit_bytes: Option<u64>,
    /// Seconds.
    pub wall_seconds: f64,
    /// Seconds of all threads.
    pub cpu_seconds: f64,
    /// Millions of triangles in a second of processor time.
    pub mtri_per_cpu_second: f64,
    /// Most that was allocated at a time, as the program says; `None` if it does not.
    pub allocated_bytes: Option<u64>,
    /// Peaks of memory as the system counts them.
    pub resident_bytes: u64,
    /// Without mapped files.
    pub anonymous_bytes: u64,
    /// Mapped files alone.
    pub mapped_bytes: u64,
    /// Most bytes of temporary files at a time.
    pub temporary_bytes: u64,
    /// From disk.
    pub disk_read_bytes: u64,
    /// To disk.
    pub disk_written_bytes: u64,
    /// Peak of the cgroup, page cache included.
    pub cgroup_peak_bytes: Option<u64>,
    /// How the run ended: `done`, or what went wrong.
    pub outcome: String,
}

/// Where it was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: String,
    /// Threads that may be used.
    pub threads: usize,
    /// Bytes of memory.
    pub memory_bytes: u64,
    /// Version of the kernel.
    pub kernel: String,
}

impl Machine {
    /// This one; what it does not say is left empty.
    pub fn this() -> Machine {
        let text = |path| fs::read_to_string(path).unwrap_or_default();
        let value = |text: &str, name: &str| {
            let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_default();
            line.split_once(':').map_or(String::new(), |(_, value)| value.trim().to_owned())
        };
        let memory = value(&text("/proc/meminfo"), "MemTotal");
        let kib: u64 = memory.split(' ').next().and_then(|word| word.parse().ok()).unwrap_or(0);
        Machine {
            processor: value(&text("/proc/cpuinfo"), "model name"),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: kib * 1024,
            kernel: text("/proc/sys/kernel/osrelease").trim().to_owned(),
        }
    }
}

/// All rows with the machine as JSON.
pub fn json(machine: &Machine, rows: &[Row]) -> serde_json::Result<String> {
    #[derive(Serialize)]
    struct All<'a> {
        machine: &'a Machine,
        runs: &'a [Row],
    }
    serde_json::to_string_pretty(&All { machine, runs: rows })
}

/// All rows with the machine as markdown.
pub fn markdown(machine: &Machine, rows: &[Row]) -> String {
    let mut text = format!(
        "{}, {} threads, {} of memory, Linux {}\n\n",
        machine.processor,
        machine.threads,
        size(machine.memory_bytes),
        machine.kernel
    );
    let head = [
        "triangles",
        "order",
        "input",
        "--memory",
        "cgroup limit",
        "wall s",
        "CPU s",
        "Mtri / CPU s",
        "allocated",
        "RSS",
        "anonymous",
        "mapped",
        "temporary",
        "disk read",
        "disk written",
        "cgroup peak",
        "outcome",
    ];
    let _ = writeln!(text, "| {} |\n|{}", head.join(" | "), " ---: |".repeat(head.len()));
    let known = |bytes: Option<u64>| bytes.map_or("-".to_owned(), size);
    for row in rows {
        let cells = [
            row.triangles.to_string(),
            row.order.to_owned(),
            size(row.input_bytes),
            row.memory.clone().unwrap_or_else(|| "-".to_owned()),
            known(row.limit_bytes),
            format!("{:.1}", row.wall_seconds),
            format!("{:.1}", row.cpu_seconds),
            format!("{:.3}", row.mtri_per_cpu_second),
            known(row.allocated_bytes),
            size(row.resident_bytes),
            size(row.anonymous_bytes),
            size(row.mapped_bytes),
            size(row.temporary_bytes),
            size(row.disk_read_bytes),
            size(row.disk_written_bytes),
            known(row.cgroup_peak_bytes),
            row.outcome.clone(),
        ];
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text
}

/// Bytes in the largest unit of 1024 that leaves a number of at least 1.
fn size(bytes: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let unit = (0..units.len()).rev().find(|unit| bytes >> (10 * unit) > 0).unwrap_or(0);
    let number = bytes as f64 / (1u64 << (10 * unit)) as f64;
    if unit == 0 { format!("{bytes} B") } else { format!("{number:.1} {}", units[unit]) }
}

/// A number of bytes with or without unit: `512MiB`, `1.5 GB`, `4096`.
pub fn parse_bytes(text: &str) -> Option<u64> {
    let text = text.trim();
    let end = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let number: f64 = text[..end].replace(',', "").trim().parse().ok()?;
    let unit = match &text[end..] {
        "" | "B" => 1.0,
        "kB" => 1e3,
        "MB" => 1e6,
        "GB" => 1e9,
        "TB" => 1e12,
        "KiB" | "K" => 1024.0,
        "MiB" | "M" => 1024.0 * 1024.0,
        "GiB" | "G" => 1024.0 * 1024.0 * 1024.0,
        _ => return None,
    };
    (number >= 0.0 && number * unit < 9e15).then_some((number * unit) as u64)
}

/// What the summary of a run says was allocated: `peak memory  130 MB of 134 MB allocated; resident ...`.
pub fn allocated(summary: &str) -> Option<u64> {
    let line = summary.lines().find_map(|line| line.trim_start().strip_prefix("peak memory"))?;
    let (before, _) = line.split_once(" allocated")?;
    parse_bytes(before.split(" of ").next()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_written() {
        assert_eq!(parse_bytes("512MiB"), Some(512 << 20));
        assert_eq!(parse_bytes("1.5 GB"), Some(1_500_000_000));
        assert_eq!(parse_bytes("4096"), Some(4096));
        assert_eq!(parse_bytes("12 parsecs"), None);
        assert_eq!(parse_bytes("MiB"), None);
        assert_eq!((size(17).as_str(), size(512 << 20).as_str()), ("17 B", "512.0 MiB"));
    }

    #[test]
    fn the_summary_says_what_was_allocated() {
        let text = "tiles  1 tile\n  peak memory       130.5 MB of 134 MB allocated; resident 160 MB\n";
        assert_eq!(allocated(text), Some(130_500_000));
        assert_eq!(allocated("  peak memory       130 MB allocated; resident 160 MB"), Some(130_000_000));
        assert_eq!(allocated("  peak memory       61 MB; without mapped files 53 MB"), None);
    }
}
