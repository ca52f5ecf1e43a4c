//! The only unsafe call of the crate: mapping a file into memory.
//!
//! In: an open regular file. Out: its bytes. The promise that makes this sound is the user's: the file is neither
//! changed nor truncated while the run goes on. A truncated file would end the run with a bus error, a changed one
//! would hand out other bytes than those that were checked. Whoever cannot promise that uses
//! [`IoMode::Read`](super::IoMode::Read), which reports both as ordinary read errors.
#![allow(unsafe_code)]

use memmap2::Mmap;
use std::fs::File;
use std::io;

/// Maps the whole file, read only.
pub(super) fn map(file: &File) -> io::Result<Mmap> {
    // SAFETY: the mapping is read only and private to this process; that nobody changes or truncates the file
    // underneath it is the documented condition for `IoMode::Map` and `IoMode::Auto`.
    unsafe { Mmap::map(file) }
}
