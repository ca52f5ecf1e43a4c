//! How much memory a run may use when nobody says.
//!
//! In: the control groups of the process (version 1 and 2, its own and all above it) and the memory of the machine. Out: the
//! tightest of these limits. A limit that cannot be read is none.

use super::memory::field_of;
use std::fs;
use std::path::{Path, PathBuf};

/// Share of the tightest limit that is used: the rest is for the system, for mapped files and for what the allocator
/// cannot give back.
const SHARE: f64 = 0.75;

/// Bytes that a run may allocate when nothing is said.
pub(super) fn default_memory() -> u64 {
    tightest(Path::new("/")).map_or(crate::config::NO_LIMIT, |bytes| (bytes as f64 * SHARE) as u64)
}

/// The tightest limit below `root`, which is `/` unless a test has made up another one.
fn tightest(root: &Path) -> Option<u64> {
    let groups = fs::read_to_string(root.join("proc/self/cgroup")).unwrap_or_default();
    let files = groups.lines().flat_map(|line| limit_files(root, line));
    let of_groups = files.filter_map(|file| fs::read_to_string(file).ok()?.trim().parse::<u64>().ok());
    let machine =
        fs::read_to_string(root.join("proc/meminfo")).ok().and_then(|text| field_of(&text, "MemTotal"));
    // Where nothing was set, version 1 gives a number that is larger than any machine.
    of_groups.chain(machine).min()
}

/// Files that may hold a limit of the group in this line of `/proc/self/cgroup` or of one above it.
fn limit_files(root: &Path, line: &str) -> Vec<PathBuf> {
    let mut fields = line.splitn(3, ':').skip(1);
    let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { return Vec::new() };
    let (mounts, name): (&[&str], &str) = if controllers.is_empty() {
        (&["sys/fs/cgroup", "sys/fs/cgroup/unified"], "memory.max")
    } else if controllers.split(',').any(|c| c == "memory") {
        (&["sys/fs/cgroup/memory"], "memory.limit_in_bytes")
    } else {
        return Vec::new();
    };
    let groups = Path::new(path.trim_start_matches('/')).ancestors();
    groups.flat_map(|group| mounts.iter().map(move |mount| root.join(mount).join(group).join(name))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(files: &[(&str, &str)]) -> Option<u64> {
        let root = tempfile::tempdir().expect("a temporary directory");
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().expect("a directory")).expect("create");
            fs::write(path, text).expect("write");
        }
        tightest(root.path())
    }

    const MACHINE: (&str, &str) = ("proc/meminfo", "MemFree: 1 kB\nMemTotal:       1000 kB\n");

    #[test]
    fn without_groups_it_is_the_machine() {
        assert_eq!(machine(&[MACHINE]), Some(1_024_000));
        assert_eq!(machine(&[]), None);
    }

    #[test]
    fn the_tightest_group_counts_also_above_the_own_one() {
        let own = ("proc/self/cgroup", "0::/a/b/c\n");
        let unlimited = ("sys/fs/cgroup/a/b/c/memory.max", "max\n");
        let above = ("sys/fs/cgroup/a/memory.max", "5000\n");
        assert_eq!(machine(&[MACHINE, own, unlimited]), Some(1_024_000));
        assert_eq!(machine(&[MACHINE, own, unlimited, above]), Some(5000));
        let tighter = ("sys/fs/cgroup/a/b/c/memory.max", "4000\n");
        assert_eq!(machine(&[MACHINE, own, tighter, above]), Some(4000));
    }

    #[test]
    fn groups_of_version_1_count_too() {
        let own = ("proc/self/cgroup", "7:cpu,cpuacct:/x\n4:memory:/job/1\n0::/\n");
        let limit = ("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "6000\n");
        let none = ("sys/fs/cgroup/memory/job/1/memory.limit_in_bytes", "9223372036854771712\n");
        assert_eq!(machine(&[MACHINE, own, limit, none]), Some(6000));
    }

    #[test]
    fn in_a_namespace_of_its_own_the_root_counts() {
        // The path is that of the host, which is not mounted here.
        let own = ("proc/self/cgroup", "0::/../../host/path\n");
        let limit = ("sys/fs/cgroup/memory.max", "7000\n");
        assert_eq!(machine(&[MACHINE, own, limit]), Some(7000));
    }
}
