//! A memory cgroup for one command, made and removed by whoever runs it.
//!
//! In: a limit; out: a group below that of this process, by version 1 or 2, a way to start a command in it, and what the
//! kernel counted. Version 1 needs a hierarchy that may be written; in version 2, a group that holds processes cannot
//! hand its controllers down, so that the nearest ancestor that does is taken. Where neither is possible, making one is
//! an error that says so, and callers go on without.

use anyhow::{Context, Result, anyhow, bail};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// The interface of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    One,
    Two,
}

/// A group that is removed when it is dropped.
#[derive(Debug)]
pub struct Cgroup {
    path: PathBuf,
    version: Version,
}

/// Groups made by this process: each gets a name of its own.
static MADE: AtomicU64 = AtomicU64::new(0);
/// A group can be removed some milliseconds after its last process has ended.
const REMOVALS: u32 = 100;

impl Cgroup {
    /// Makes a group whose processes together get `limit` bytes, or as much as there is.
    ///
    /// # Errors
    /// If no memory cgroup can be made here, with what was tried.
    pub fn create(limit: Option<u64>) -> Result<Cgroup> {
        let groups = fs::read_to_string("/proc/self/cgroup").context("there are no cgroups here")?;
        let mounts = fs::read_to_string("/proc/self/mountinfo").context("mounts are not known")?;
        let mut refused = Vec::new();
        for (version, parent) in candidates(&groups, &mounts) {
            remove_stale(&parent);
            let number = MADE.fetch_add(1, Ordering::Relaxed);
            let path = parent.join(format!("crease-{}-{number}", std::process::id()));
            match Cgroup::make(version, path, limit) {
                Ok(cgroup) => return Ok(cgroup),
                Err(error) => refused.push(format!("{}: {error:#}", parent.display())),
            }
        }
        let tried = if refused.is_empty() { "none is mounted".to_owned() } else { refused.join("; ") };
        Err(anyhow!("no memory cgroup can be made: {tried}"))
    }

    fn make(version: Version, path: PathBuf, limit: Option<u64>) -> Result<Cgroup> {
        fs::create_dir(&path)?;
        // From here on the directory is removed if something fails.
        let cgroup = Cgroup { path, version };
        let (limit_file, swap_file) = match version {
            Version::One => ("memory.limit_in_bytes", "memory.memsw.limit_in_bytes"),
            Version::Two => ("memory.max", "memory.swap.max"),
        };
        if !cgroup.path.join(limit_file).exists() {
            bail!("the memory controller is not handed down");
        }
        if let Some(limit) = limit {
            fs::write(cgroup.path.join(limit_file), limit.to_string()).context("the limit is refused")?;
            // Version 1 counts memory and swap together, version 2 apart. Kernels without accounting of swap have no file.
            let swap = if version == Version::One { limit } else { 0 };
            let swap_file = cgroup.path.join(swap_file);
            if swap_file.exists() {
                fs::write(swap_file, swap.to_string()).context("the limit of swap is refused")?;
            }
        }
        Ok(cgroup)
    }

    /// A command that runs `program` in the group, from its first instruction on.
    pub fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let mut command = Command::new("/bin/sh");
        command.arg("-c").arg("echo $$ > \"$0\" && exec \"$@\"");
        command.arg(self.path.join("cgroup.procs")).arg(program);
        command
    }

    /// The most that was charged to the group at a time, page cache included; `None` if the kernel does not say.
    pub fn peak(&self) -> Option<u64> {
        self.number(match self.version {
            Version::One => "memory.max_usage_in_bytes",
            Version::Two => "memory.peak",
        })
    }

    /// How many processes the kernel killed for want of memory.
    pub fn kills(&self) -> Option<u64> {
        let file = match self.version {
            Version::One => "memory.oom_control",
            Version::Two => "memory.events",
        };
        let text = fs::read_to_string(self.path.join(file)).ok()?;
        text.lines().find_map(|line| line.strip_prefix("oom_kill ")?.parse().ok())
    }

    fn number(&self, file: &str) -> Option<u64> {
        fs::read_to_string(self.path.join(file)).ok()?.trim().parse().ok()
    }
}

impl Drop for Cgroup {
    fn drop(&mut self) {
        for _ in 0..REMOVALS {
            if fs::remove_dir(&self.path).is_ok() {
                return;
            }
            thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Removes groups that were made by processes that are no more: one that was killed could not.
fn remove_stale(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let maker = name.to_str().and_then(|name| name.strip_prefix("crease-")?.split('-').next());
        if maker.is_some_and(|maker| !Path::new("/proc").join(maker).exists()) {
            // One that still has processes stays.
            let _ = fs::remove_dir(entry.path());
        }
    }
}

/// Groups below which one might be made, best first: from `/proc/self/cgroup` and `/proc/self/mountinfo`.
fn candidates(groups: &str, mounts: &str) -> Vec<(Version, PathBuf)> {
    let mut found = Vec::new();
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(number), Some(controllers), Some(path)) = (fields.next(), fields.next(), fields.next())
        else {
            continue;
        };
        if controllers.split(',').any(|controller| controller == "memory") {
            let own = mounted(mounts, path, "cgroup", "memory");
            found.extend(own.map(|(_, own)| (Version::One, own)));
        } else if number == "0"
            && let Some((root, own)) = mounted(mounts, path, "cgroup2", "")
        {
            let upwards = own.ancestors().take_while(|above| above.starts_with(&root));
            found.extend(upwards.map(|above| (Version::Two, above.to_owned())));
        }
    }
    // Version 1 first: where both are mounted, it is the one that has the controller.
    found.sort_by_key(|(version, _)| *version == Version::Two);
    found
}

/// Mount point of a hierarchy of type `kind` with the option `option`, and the directory of the group `path` in it.
fn mounted(mounts: &str, path: &str, kind: &str, option: &str) -> Option<(PathBuf, PathBuf)> {
    mounts.lines().find_map(|line| {
        let (place, system) = line.split_once(" - ")?;
        let mut place = place.split(' ').skip(3);
        let (root, point) = (place.next()?, Path::new(place.next()?));
        let mut system = system.split(' ');
        let right_kind = system.next()? == kind;
        let options = system.nth(1)?;
        if !right_kind || !(option.is_empty() || options.split(',').any(|o| o == option)) {
            return None;
        }
        // In a container, the hierarchy is mounted from the group of the container on.
        let below = Path::new(path).strip_prefix(root).or_else(|_| Path::new(path).strip_prefix("/")).ok()?;
        Some((point.to_owned(), point.join(below)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOUNTS: &str = "\
        30 25 0:26 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw,nsdelegate\n\
        31 25 0:27 /box /sys/fs/cgroup/memory rw,nosuid - cgroup cgroup rw,memory\n\
        32 25 0:28 / /sys/fs/cgroup/cpu rw,nosuid - cgroup cgroup rw,cpu\n";

    #[test]
    fn a_group_holds_a_command_and_goes() {
        let group = match Cgroup::create(Some(64 << 20)) {
            Ok(group) => group,
            Err(error) => return println!("skipped: {error:#}"),
        };
        let path = group.path.clone();
        let output = group.command("/bin/cat").arg("/proc/self/cgroup").output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let name = path.file_name().and_then(|name| name.to_str()).unwrap();
        assert!(String::from_utf8_lossy(&output.stdout).contains(name), "{output:?}");
        assert!(group.peak().is_none_or(|peak| (1..=64 << 20).contains(&peak)), "{:?}", group.peak());
        assert_eq!(group.kills().unwrap_or(0), 0);
        drop(group);
        assert!(!path.exists());
    }

    #[test]
    fn the_group_of_the_process_is_found() {
        let found = candidates("4:memory:/box/job\n3:cpu:/\n0::/user/me\n", MOUNTS);
        let expected = [
            (Version::One, "/sys/fs/cgroup/memory/job"),
            (Version::Two, "/sys/fs/cgroup/unified/user/me"),
            (Version::Two, "/sys/fs/cgroup/unified/user"),
            (Version::Two, "/sys/fs/cgroup/unified"),
        ];
        assert_eq!(found, expected.map(|(version, path)| (version, PathBuf::from(path))));
        assert!(candidates("3:cpu:/\n", MOUNTS).is_empty());
    }
}
