//! A file from its start to its end, unpacked on the way.
//!
//! In: a path. Out: its bytes in order, through a window that grows only as far as a reader asks to see bytes that are
//! there. What is packed by gzip or zstd is known by its first bytes, whatever its name is, and unpacked while it is read;
//! files of several members or frames are read as one. Memory: the window, and what unpacking takes: 64 KiB for gzip, for
//! zstd what its header asks for, but no more than the limit.

use super::InputError;
use flate2::bufread::MultiGzDecoder;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Bytes that the window has room for at first.
const WINDOW: usize = 256 << 10;

/// How a file is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// It is not.
    Plain,
    /// By gzip.
    Gzip,
    /// By zstd.
    Zstd,
}

impl Packing {
    /// By the first bytes of the file.
    fn of(head: &[u8]) -> Packing {
        match head {
            [0x1f, 0x8b, ..] => Packing::Gzip,
            // A frame, or a frame to be skipped, with which `pzstd` begins.
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Packing::Zstd,
            _ => Packing::Plain,
        }
    }

    /// What the name of a file ends in that is packed so.
    pub const EXTENSIONS: [&str; 2] = ["gz", "zst"];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Packing::Plain => "plain",
            Packing::Gzip => "gzip",
            Packing::Zstd => "zstd",
        }
    }
}

/// Reads a file and says how much of it was read.
struct Counted<'a> {
    file: File,
    progress: &'a dyn Fn(u64),
}

impl Read for Counted<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(out)?;
        (self.progress)(count as u64);
        Ok(count)
    }
}

/// A file that is read once, from its start to its end.
pub struct Stream<'a> {
    path: PathBuf,
    packing: Packing,
    /// Length of the file as it lies on the disk.
    length: u64,
    reader: Box<dyn Read + 'a>,
    buffer: Vec<u8>,
    /// What of the buffer is there and not consumed.
    start: usize,
    end: usize,
    consumed: u64,
    ended: bool,
}

impl<'a> Stream<'a> {
    /// Opens a regular file. `memory` bounds what unpacking may take; `progress` is told of bytes of the file as they are
    /// read.
    ///
    /// # Errors
    /// [`InputError::NotAFile`] for a directory, pipe or device; [`InputError::Io`] if the system refuses.
    pub fn open(path: &Path, memory: u64, progress: &'a dyn Fn(u64)) -> Result<Stream<'a>, InputError> {
        let io_error = |source| InputError::Io { path: path.to_owned(), source };
        // Before opening, because opening a pipe blocks until somebody writes to it.
        let metadata = fs::metadata(path).map_err(io_error)?;
        if !metadata.is_file() {
            return Err(InputError::NotAFile { path: path.to_owned() });
        }
        let file = File::open(path).map_err(io_error)?;
        let mut raw = BufReader::with_capacity(64 << 10, Counted { file, progress });
        let packing = Packing::of(raw.fill_buf().map_err(io_error)?);
        let reader: Box<dyn Read + 'a> = match packing {
            Packing::Plain => Box::new(raw),
            Packing::Gzip => Box::new(MultiGzDecoder::new(raw)),
            Packing::Zstd => {
                let mut decoder = zstd::stream::read::Decoder::with_buffer(raw).map_err(io_error)?;
                // 2^10 to 2^31 bytes are what the format and its library know.
                decoder.window_log_max(memory.max(1).ilog2().clamp(10, 31)).map_err(io_error)?;
                Box::new(decoder)
            }
        };
        let (path, length) = (path.to_owned(), metadata.len());
        let buffer = Vec::new();
        Ok(Stream { path, packing, length, reader, buffer, start: 0, end: 0, consumed: 0, ended: false })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How it is packed.
    pub fn packing(&self) -> Packing {
        self.packing
    }

    /// Number of bytes in all, which nobody knows of a packed file.
    pub fn length(&self) -> Option<u64> {
        (self.packing == Packing::Plain).then_some(self.length)
    }

    /// Bytes that were consumed, counted as unpacked.
    pub fn offset(&self) -> u64 {
        self.consumed
    }

    /// The bytes that are there already.
    #[inline]
    pub fn available(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// Takes `count` of the available bytes out.
    #[inline]
    pub fn consume(&mut self, count: usize) {
        debug_assert!(count <= self.end - self.start, "more is consumed than there is");
        self.start += count;
        self.consumed += count as u64;
    }

    /// Makes more bytes available; false if there are no more.
    ///
    /// # Errors
    /// If the file cannot be read, or is not what its packing promises.
    pub fn more(&mut self) -> Result<bool, InputError> {
        if self.ended {
            return Ok(false);
        }
        if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
        }
        if self.end == self.buffer.len() {
            // Grows only when it is full of bytes that exist.
            self.buffer.resize((2 * self.buffer.len()).max(WINDOW), 0);
        }
        let count = loop {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(self.failed(error)),
                Ok(count) => break count,
            }
        };
        self.end += count;
        self.ended = count == 0;
        Ok(count > 0)
    }

    /// At least `count` bytes, or all that are left.
    ///
    /// # Errors
    /// As for [`Stream::more`].
    #[inline]
    pub fn peek(&mut self, count: usize) -> Result<&[u8], InputError> {
        while self.end - self.start < count && self.more()? {}
        Ok(self.available())
    }

    /// Whether all bytes were consumed.
    ///
    /// # Errors
    /// As for [`Stream::more`].
    pub fn at_end(&mut self) -> Result<bool, InputError> {
        Ok(self.peek(1)?.is_empty())
    }

    fn failed(&self, source: io::Error) -> InputError {
        use io::ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
        let damaged = matches!(source.kind(), InvalidData | InvalidInput | Other | UnexpectedEof);
        if self.packing == Packing::Plain || !damaged {
            return InputError::Io { path: self.path.clone(), source };
        }
        let text = source.to_string();
        let remedy = match text.contains("memory") {
            true => "allow more with --memory, or unpack the file first",
            false => "it is cut off or damaged; get it again",
        };
        let reason = format!(
            "byte {} of its content cannot be unpacked ({}: {text}); {remedy}",
            self.consumed + (self.end - self.start) as u64,
            self.packing.name()
        );
        InputError::Format { path: self.path.clone(), reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::io::Write;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn zstd(bytes: &[u8]) -> Vec<u8> {
        zstd::encode_all(bytes, 3).unwrap()
    }

    /// All bytes through windows of different sizes, and the bytes of the file that were reported.
    fn all(bytes: &[u8], memory: u64) -> (Result<Vec<u8>, String>, u64) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        fs::write(&path, bytes).unwrap();
        let seen = Cell::new(0);
        let progress = |n| seen.set(seen.get() + n);
        let read = || -> Result<Vec<u8>, InputError> {
            let mut stream = Stream::open(&path, memory, &progress)?;
            let mut found = Vec::new();
            for step in (1..).map(|i| i * 7919 % 100_003) {
                let here = stream.peek(step)?;
                let count = here.len().min(step);
                found.extend_from_slice(&here[..count]);
                stream.consume(count);
                assert_eq!(stream.offset(), found.len() as u64);
                if stream.at_end()? {
                    break;
                }
            }
            Ok(found)
        };
        (read().map_err(|e| e.to_string()), seen.get())
    }

    #[test]
    fn packed_files_are_their_content() {
        let content: Vec<u8> = (0..900_000u32).flat_map(|i| (i / 7).wrapping_mul(i).to_le_bytes()).collect();
        let (half, rest) = content.split_at(content.len() / 3);
        let skipped = [0x50, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 1, 2, 3];
        for packed in [
            content.clone(),
            gzip(&content),
            zstd(&content),
            [gzip(half), gzip(rest)].concat(),
            [zstd(half), zstd(rest)].concat(),
            [skipped.to_vec(), zstd(half), zstd(rest)].concat(),
        ] {
            let (found, seen) = all(&packed, 64 << 20);
            assert!(found.unwrap() == content);
            assert_eq!(seen, packed.len() as u64);
        }
        assert_eq!(all(b"", 1 << 20).0.unwrap(), b"");
    }

    #[test]
    fn damaged_packing_is_an_error() {
        let content = vec![7; 1 << 20];
        for packed in [gzip(&content), zstd(&content)] {
            let (found, _) = all(&packed[..packed.len() - 3], 64 << 20);
            assert!(found.unwrap_err().contains("cannot be unpacked"));
            let mut flipped = packed.clone();
            let middle = packed.len() / 2;
            flipped[middle] ^= 0x55;
            let (found, _) = all(&flipped, 64 << 20);
            assert!(found.is_err() || found.unwrap() == content);
        }
        // A window of 8 MiB does not go into 2 MiB.
        let wide = zstd::encode_all(&vec![7; 20 << 20][..], 19).unwrap();
        assert!(all(&wide, 2 << 20).0.unwrap_err().contains("--memory"));
        assert_eq!(all(&wide, 16 << 20).0.unwrap().len(), 20 << 20);
    }
}
