//! One command, measured from outside.
//!
//! In: a command and a directory for its temporary files; out: wall and processor time, peaks of memory, bytes moved. Peaks
//! are looked for every few hundredths of a second; the largest resident set is kept by the kernel and exact.

use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Between two looks.
const INTERVAL: Duration = Duration::from_millis(20);
/// Looks at the process for each look at the directory, which takes longer.
const LOOKS: u32 = 10;
/// Of the kernel, as everywhere: processor time is counted in hundredths of a second.
const TICKS: f64 = 100.0;

/// What a command took.
#[derive(Clone, Debug)]
pub struct Measured {
    /// How it ended.
    pub status: ExitStatus,
    /// What it printed.
    pub output: String,
    /// What it said went wrong.
    pub complaint: String,
    /// Seconds from start to end.
    pub wall: f64,
    /// Seconds of all its threads, those of the system included.
    pub cpu: f64,
    /// Peaks.
    pub memory: Memory,
    /// Most bytes of temporary files at a time.
    pub temporary: u64,
    /// Bytes moved to and from disk, and by calls to read; mapped files count as reads from disk only.
    pub moved: Moved,
}

/// Peaks of memory in bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    /// Of the resident set.
    pub resident: u64,
    /// Of what is not a file.
    pub anonymous: u64,
    /// Of mapped files.
    pub mapped: u64,
}

/// Bytes that a process moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moved {
    /// From disk.
    pub from_disk: u64,
    /// To disk.
    pub to_disk: u64,
    /// By calls to read, from the cache or not.
    pub read: u64,
}

/// Runs a command to its end.
///
/// # Errors
/// If it cannot be started.
pub fn run(mut command: Command, temporary: &Path) -> Result<Measured> {
    let before = children_seconds();
    let started = Instant::now();
    let complaints = temporary.with_extension("stderr");
    let out = temporary.with_extension("stdout");
    let file =
        |path: &Path| fs::File::create(path).with_context(|| format!("cannot write {}", path.display()));
    let mut child = command
        .stdin(Stdio::null())
        .stdout(file(&out)?)
        .stderr(file(&complaints)?)
        .spawn()
        .with_context(|| format!("cannot run {command:?}"))?;
    let (mut memory, mut moved, mut most) = (Memory::default(), Moved::default(), 0);
    let mut looks = 0;
    let status = loop {
        if let Some(status) = child.try_wait().context("cannot wait for the command")? {
            break status;
        }
        look(&child, &mut memory, &mut moved);
        if looks % LOOKS == 0 {
            most = most.max(bytes_below(temporary) + deleted_bytes(child.id()));
        }
        looks += 1;
        thread::sleep(INTERVAL);
    };
    let wall = started.elapsed().as_secs_f64();
    let take = |path: &Path| {
        let text = fs::read_to_string(path).unwrap_or_default();
        fs::remove_file(path).with_context(|| format!("cannot remove {}", path.display())).map(|()| text)
    };
    let (output, complaint) = (take(&out)?, take(&complaints)?);
    let cpu = children_seconds() - before;
    Ok(Measured { status, output, complaint, wall, cpu, memory, temporary: most, moved })
}

fn look(child: &Child, memory: &mut Memory, moved: &mut Moved) {
    let proc = format!("/proc/{}", child.id());
    if let Ok(status) = fs::read_to_string(format!("{proc}/status")) {
        let of = |name| field(&status, name).unwrap_or(0) * 1024;
        memory.resident = memory.resident.max(of("VmHWM"));
        memory.anonymous = memory.anonymous.max(of("RssAnon"));
        memory.mapped = memory.mapped.max(of("RssFile"));
    }
    if let Ok(io) = fs::read_to_string(format!("{proc}/io")) {
        let of = |name, kept: u64| field(&io, name).unwrap_or(0).max(kept);
        moved.from_disk = of("read_bytes", moved.from_disk);
        moved.to_disk = of("write_bytes", moved.to_disk);
        moved.read = of("rchar", moved.read);
    }
}

/// The number in a line `Name: 12 kB`.
fn field(text: &str, name: &str) -> Option<u64> {
    let value = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    value.split_ascii_whitespace().next()?.parse().ok()
}

/// Bytes of the files below a directory; those that vanish meanwhile do not count.
fn bytes_below(directory: &Path) -> u64 {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    let size = |entry: fs::DirEntry| match entry.metadata() {
        Ok(data) if data.is_dir() => bytes_below(&entry.path()),
        Ok(data) => data.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}

/// Bytes of files that a process has open and that have no name any more.
fn deleted_bytes(process: u32) -> u64 {
    let open = fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
    let nameless = |entry: fs::DirEntry| {
        let target = fs::read_link(entry.path()).ok()?;
        let on_disk = target.to_str()?.ends_with(" (deleted)");
        on_disk.then(|| fs::metadata(entry.path()).map_or(0, |data| data.len()))
    };
    open.filter_map(nameless).sum()
}

/// Processor time of all children that have ended, fields 16 and 17 behind the name in brackets.
fn children_seconds() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let behind_name = stat.rsplit_once(')').map_or("", |(_, fields)| fields);
    let ticks = behind_name.split_ascii_whitespace().skip(13).take(2);
    ticks.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / TICKS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_measured() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("scratch");
        fs::create_dir(&place).unwrap();
        let mut command = Command::new("/bin/sh");
        let script = "head -c 200000 /dev/zero > \"$0/part\"; i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done; sleep 1; echo done; echo bad >&2";
        command.arg("-c").arg(script).arg(&place);
        let measured = run(command, &place).unwrap();
        assert!(measured.status.success());
        assert_eq!((measured.output.as_str(), measured.complaint.as_str()), ("done\n", "bad\n"));
        assert!(measured.wall > 0.0 && measured.cpu > 0.0, "{measured:?}");
        assert_eq!(measured.temporary, 200_000);
        assert!(measured.memory.resident > 0, "{measured:?}");
    }
}
