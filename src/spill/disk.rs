//! What there is to know about the disk before it is filled.

use super::SpillError;
use std::path::Path;

/// Bytes that a process of this user may still write below `directory`.
///
/// # Errors
/// If the system does not say.
pub fn free_bytes(directory: &Path) -> Result<u64, SpillError> {
    let found = rustix::fs::statvfs(directory)
        .map_err(|e| SpillError::io(directory, "cannot ask for the free space")(e.into()))?;
    Ok(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Whether files in `directory` are kept in memory, so that spilling to it saves nothing. False where nothing is known.
pub fn is_in_memory(directory: &Path) -> bool {
    #[cfg(target_os = "linux")]
    #[allow(clippy::unnecessary_cast, reason = "the type of the field differs between processors")]
    {
        const TMPFS: i64 = 0x0102_1994;
        const RAMFS: i64 = 0x8584_58f6;
        rustix::fs::statfs(directory).is_ok_and(|found| [TMPFS, RAMFS].contains(&(found.f_type as i64)))
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = directory;
        false
    }
}

/// Refuses a directory with less room than `needed` bytes.
///
/// # Errors
/// If there is not enough room, or the system does not say how much there is.
pub fn check_room(directory: &Path, needed: u64) -> Result<(), SpillError> {
    let free = free_bytes(directory)?;
    match free < needed {
        true => Err(SpillError::NoRoom { path: directory.to_owned(), needed, free }),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_checked() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        assert!(free_bytes(directory.path()).expect("a number") > 0);
        assert!(check_room(directory.path(), 1).is_ok());
        let error = check_room(directory.path(), u64::MAX).expect_err("nobody has that much");
        assert!(matches!(error, SpillError::NoRoom { needed: u64::MAX, .. }), "{error}");
        assert!(check_room(&directory.path().join("missing"), 1).is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_is_told_from_disks() {
        assert!(!is_in_memory("/proc".as_ref()));
        let shared = Path::new("/dev/shm");
        if std::fs::read_to_string("/proc/mounts").is_ok_and(|m| m.contains(" /dev/shm tmpfs ")) {
            assert!(is_in_memory(shared));
        }
    }
}
