//! One result among others in a file that only grows.
//!
//! A frame is a head of [`HEAD`] bytes and the payload, little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`], to find the next frame behind a damaged one |
//! | 8 | the job it is of: a checksum of its record |
//! | 16 | the label: cell (4), session (4), piece (4), pass (1), whether it is the last piece (1), zeros (2) |
//! | 8 | bytes of the payload |
//! | 8 | XXH3 of the payload |
//! | 8 | XXH3 of the head up to here, seeded with the offset of the frame |
//!
//! The head has a checksum of its own, so that its length can be believed before anything is allocated for it; the seed
//! makes a frame in the wrong place a wrong frame.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// Bytes before the payload.
pub const HEAD: usize = 56;
/// What a frame starts with. Not a word that mesh data are likely to hold; if they do, the checksum of the head tells.
pub const MAGIC: [u8; 8] = *b"\x89cRs\x1a\r\n\x07";
/// Bytes that are searched at a time.
const WINDOW: usize = 1 << 16;

/// Whose result it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// Which pass over the tiles.
    pub pass: u8,
    /// Cell of the plan.
    pub cell: u32,
    /// The run that it was found in, counted from 0.
    pub session: u32,
    /// A cell that was cut has several results; which of them this is, counted from 0.
    pub piece: u32,
    /// Whether it is the last of them.
    pub last: bool,
}

/// A frame whose head is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Whose it is.
    pub label: Label,
    /// Where it starts.
    pub offset: u64,
    /// Bytes of the payload.
    pub length: u64,
    /// Checksum of the payload.
    sum: u64,
}

impl Frame {
    /// Where the next frame starts.
    pub fn end(&self) -> u64 {
        self.offset + HEAD as u64 + self.length
    }
}

/// The head of a frame of `job` that starts at `offset`.
pub fn head(job: u64, label: &Label, offset: u64, payload: &[u8]) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    let mut at = 0;
    let mut put = |bytes: &[u8]| {
        head[at..at + bytes.len()].copy_from_slice(bytes);
        at += bytes.len();
    };
    put(&MAGIC);
    put(&job.to_le_bytes());
    [label.cell, label.session, label.piece].iter().for_each(|x| put(&x.to_le_bytes()));
    put(&[label.pass, u8::from(label.last), 0, 0]);
    put(&(payload.len() as u64).to_le_bytes());
    put(&xxh3_64(payload).to_le_bytes());
    let sum = xxh3_64_with_seed(&head[..HEAD - 8], offset);
    head[HEAD - 8..].copy_from_slice(&sum.to_le_bytes());
    head
}

/// The frame of `job` at `offset`, if there is one that lies within the `length` bytes of the file.
///
/// # Errors
/// If the file cannot be read.
pub fn at(file: &File, job: u64, offset: u64, length: u64) -> io::Result<Option<Frame>> {
    if length.saturating_sub(offset) < HEAD as u64 {
        return Ok(None);
    }
    let mut head = [0; HEAD];
    file.read_exact_at(&mut head, offset)?;
    let u64_at = |i: usize| {
        let mut raw = [0; 8];
        raw.copy_from_slice(&head[i..i + 8]);
        u64::from_le_bytes(raw)
    };
    let u32_at = |i: usize| u64_at(i) as u32;
    let whole = u64_at(HEAD - 8) == xxh3_64_with_seed(&head[..HEAD - 8], offset);
    if !whole || head[..8] != MAGIC || u64_at(8) != job {
        return Ok(None);
    }
    let (pass, last) = (head[28], head[29] != 0);
    let label = Label { pass, cell: u32_at(16), session: u32_at(20), piece: u32_at(24), last };
    let frame = Frame { label, offset, length: u64_at(32), sum: u64_at(40) };
    let fits = frame.length <= length - offset - HEAD as u64;
    Ok(fits.then_some(frame))
}

/// Replaces `out` by the payload; `false` if it is not what was written.
///
/// # Errors
/// If the file cannot be read.
pub fn payload(file: &File, frame: &Frame, out: &mut Vec<u8>) -> io::Result<bool> {
    out.clear();
    // The head was checked, and so many bytes were there.
    let length = usize::try_from(frame.length).map_err(|_| io::ErrorKind::OutOfMemory)?;
    out.try_reserve_exact(length).map_err(|_| io::ErrorKind::OutOfMemory)?;
    out.resize(length, 0);
    file.read_exact_at(out, frame.offset + HEAD as u64)?;
    Ok(xxh3_64(out) == frame.sum)
}

/// Where the next frame may start, from `from` on: the next [`MAGIC`].
///
/// # Errors
/// If the file cannot be read.
pub fn next(file: &File, from: u64, length: u64) -> io::Result<Option<u64>> {
    let (mut at, mut window) = (from, Vec::new());
    while length.saturating_sub(at) >= HEAD as u64 {
        window.resize((length - at).min(WINDOW as u64) as usize, 0);
        file.read_exact_at(&mut window, at)?;
        if let Some(found) = window.windows(MAGIC.len()).position(|bytes| bytes == MAGIC) {
            return Ok(Some(at + found as u64));
        }
        // One that the window cuts is seen in the next.
        at += (window.len() - MAGIC.len() + 1) as u64;
    }
    Ok(None)
}
