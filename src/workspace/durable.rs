//! A small file that is there as a whole or not at all, and that knows whether it is still what was written.
//!
//! Written under another name, synced, renamed; then the directory is synced, so that the name survives a power cut as
//! well. Before the bytes stand eight that say which file it is, their number and their checksum (XXH3, seeded with the
//! first eight).

use super::WorkspaceError;
use crate::spill::point;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// What a file is for: its first eight bytes.
pub type Purpose = [u8; 8];

/// Bytes before the payload.
const HEAD: usize = 24;

/// What is read back.
pub enum Found {
    /// There is no such file.
    Nothing,
    /// There is one, but it is not what was written.
    Damaged,
    /// The payload.
    Bytes(Vec<u8>),
}

fn head(purpose: Purpose, payload: &[u8]) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..8].copy_from_slice(&purpose);
    head[8..16].copy_from_slice(&(payload.len() as u64).to_le_bytes());
    head[16..].copy_from_slice(&xxh3_64_with_seed(payload, u64::from_le_bytes(purpose)).to_le_bytes());
    head
}

/// The name of `path` until it is whole.
pub fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".new");
    path.with_file_name(name)
}

/// Writes `payload` to `path`, replacing what is there.
///
/// # Errors
/// If the system refuses; what was there is there still.
pub fn write(path: &Path, purpose: Purpose, payload: &[u8]) -> Result<(), WorkspaceError> {
    write_all(path, &head(purpose, payload), payload)
}

/// The same for a file that others read: without a head of ours.
///
/// # Errors
/// If the system refuses; what was there is there still.
pub fn write_plain(path: &Path, payload: &[u8]) -> Result<(), WorkspaceError> {
    write_all(path, &[], payload)
}

fn write_all(path: &Path, head: &[u8], payload: &[u8]) -> Result<(), WorkspaceError> {
    let new = unfinished(path);
    let failed = WorkspaceError::io(path, "cannot write");
    let mut file = File::create(&new).map_err(&failed)?;
    file.write_all(head).map_err(&failed)?;
    point("file-begun");
    file.write_all(payload).map_err(&failed)?;
    file.sync_all().map_err(&failed)?;
    point("file-written");
    fs::rename(&new, path).map_err(&failed)?;
    point("file-renamed");
    sync_directory(path.parent().unwrap_or(path))
}

/// Has the names in `directory` survive a power cut.
///
/// # Errors
/// If the system refuses.
pub fn sync_directory(directory: &Path) -> Result<(), WorkspaceError> {
    File::open(directory)
        .and_then(|file| file.sync_all())
        .map_err(WorkspaceError::io(directory, "cannot sync the directory"))
}

/// Reads what was written to `path`.
///
/// # Errors
/// If the system refuses.
pub fn read(path: &Path, purpose: Purpose) -> Result<Found, WorkspaceError> {
    // As long as the file, whatever a number in it says.
    let mut bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(e) => return Err(WorkspaceError::io(path, "cannot read")(e)),
    };
    match bytes.get(HEAD..) {
        Some(payload) if bytes[..HEAD] == head(purpose, payload) => {
            bytes.drain(..HEAD);
            Ok(Found::Bytes(bytes))
        }
        _ => Ok(Found::Damaged),
    }
}
