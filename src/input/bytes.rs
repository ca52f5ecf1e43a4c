//! A file as random-access bytes, and whether it still is the file that was opened.
//!
//! In: a path. Out: any range of the file, borrowed from a memory map or read into a buffer of the caller's. Every
//! range is checked against the length the file had when it was opened, so nothing is allocated for bytes that do
//! not exist, and shared use from several threads needs no lock, because reads carry their position.

use super::InputError;
use super::map::{map, release};
use memmap2::{Advice, Mmap};
use std::fs::{self, File, Metadata};
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bytes of a map that are touched before its pages are given up. They stay in the page cache as long as the system has
/// room, and come back for a microsecond each 64 KiB; but the process holds no more of the file than this, however large
/// the file is, and what is reported as resident is what it needs.
const RESIDENT: u64 = 64 << 20;
/// Bytes of a page.
const PAGE: u64 = 4096;
/// Bytes behind a range that is read from a map which are fetched with it: what comes next is mostly what is wanted next.
const AHEAD: u64 = 128 << 10;

/// How the bytes of a file are reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IoMode {
    /// Map the file; read it if the system refuses to map it.
    #[default]
    Auto,
    /// Map the file, which must not be changed or truncated during the run: a program that has not called
    /// [`exit_on_bus_error`](super::exit_on_bus_error) dies of it.
    Map,
    /// Read each range when it is needed.
    Read,
}

/// What tells a file from what it was, or from another one. Times are in seconds and nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Identity {
    device: u64,
    inode: u64,
    length: u64,
    modified: (i64, i64),
}

impl Identity {
    fn of(metadata: &Metadata) -> Identity {
        Identity {
            device: metadata.dev(),
            inode: metadata.ino(),
            length: metadata.len(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
        }
    }

    /// What makes `now` another state or another file, if anything does.
    fn change(&self, now: &Identity) -> Option<String> {
        if (self.device, self.inode) != (now.device, now.inode) {
            Some("another file has taken its place".to_owned())
        } else if self.length != now.length {
            Some(format!("it had {} bytes and has {}", self.length, now.length))
        } else {
            (self.modified != now.modified).then(|| "it was written to".to_owned())
        }
    }
}

/// A regular file, opened for random access.
#[derive(Debug)]
pub struct ByteSource {
    /// What it is called in messages.
    path: PathBuf,
    /// Where it is.
    place: PathBuf,
    len: u64,
    file: File,
    map: Option<Mmap>,
    /// Bytes of the map that were touched since its pages were given up, about: threads may lose some.
    touched: AtomicU64,
    /// When it was opened.
    identity: Identity,
}

impl ByteSource {
    /// Opens a regular file.
    ///
    /// # Errors
    /// [`InputError::NotAFile`] for a directory, pipe or device; [`InputError::Io`] if the system refuses.
    pub fn open(path: &Path, mode: IoMode) -> Result<Self, InputError> {
        let io_error = |source| InputError::Io { path: path.to_owned(), source };
        // Before opening, because opening a pipe blocks until somebody writes to it.
        if !fs::metadata(path).map_err(io_error)?.is_file() {
            return Err(InputError::NotAFile { path: path.to_owned() });
        }
        let file = File::open(path).map_err(io_error)?;
        let metadata = file.metadata().map_err(io_error)?;
        if !metadata.is_file() {
            return Err(InputError::NotAFile { path: path.to_owned() });
        }
        // An empty file has nothing to map, and some systems refuse to try.
        let mapped = match mode {
            IoMode::Read => None,
            _ if metadata.len() == 0 => None,
            IoMode::Map => Some(map(&file).map_err(io_error)?),
            IoMode::Auto => map(&file).ok(),
        };
        if let Some(map) = &mapped {
            // Tiles read many short ranges. A system that reads around each page that is missing, megabytes on some, would
            // read the file many times over where memory is too small to keep that; so nothing is read but what is
            // announced. A system that refuses may do so.
            let _ = map.advise(Advice::Random);
        }
        let len = mapped.as_ref().map_or(metadata.len(), |map| map.len() as u64);
        Ok(Self {
            path: path.to_owned(),
            place: path.to_owned(),
            len,
            file,
            map: mapped,
            touched: AtomicU64::new(0),
            identity: Identity::of(&metadata),
        })
    }

    /// Sees to it that the file, and the one that now has its name, are what was opened: same length, same time of the
    /// last change. Costs two calls of the system.
    ///
    /// # Errors
    /// [`InputError::Changed`] if they are not, [`InputError::Io`] if the system does not tell.
    pub fn unchanged(&self) -> Result<(), InputError> {
        let io_error = |source| InputError::Io { path: self.path.clone(), source };
        let opened = self.file.metadata().map_err(io_error)?;
        let named = match fs::metadata(&self.place) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(self.changed("it was removed"));
            }
            named => named.map_err(io_error)?,
        };
        let change = [opened, named].iter().find_map(|now| self.identity.change(&Identity::of(now)));
        change.map_or(Ok(()), |reason| Err(self.changed(reason)))
    }

    fn changed(&self, reason: impl Into<String>) -> InputError {
        InputError::Changed { path: self.path.clone(), reason: reason.into() }
    }

    /// The same, called `path` in messages: for a temporary file, what it was made from.
    pub(super) fn called(self, path: &Path) -> Self {
        Self { path: path.to_owned(), ..self }
    }

    /// What the file is called: its path, or that of what it was made from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Length in bytes when the file was opened.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// When the file was last written before it was opened: seconds and nanoseconds since 1970.
    pub fn modified(&self) -> (i64, i64) {
        self.identity.modified
    }

    /// Whether the file has no bytes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// All bytes, if the file is mapped. Who reads many of them says so before, by [`ByteSource::will_read`].
    pub fn mapped(&self) -> Option<&[u8]> {
        self.map.as_deref()
    }

    /// About `bytes` of the map are read.
    fn touched(&self, bytes: u64) {
        let Some(map) = &self.map else { return };
        let touched = self.touched.load(Relaxed) + bytes;
        if touched < RESIDENT {
            self.touched.store(touched, Relaxed);
        } else {
            self.touched.store(0, Relaxed);
            release(map);
        }
    }

    /// The `len` bytes from `offset` on will be read from the map. Those beyond the file are left out.
    pub fn will_read(&self, offset: u64, len: u64) {
        let Some(map) = &self.map else { return };
        self.touched(len);
        let end = offset.saturating_add(len).saturating_add(AHEAD).min(self.len);
        if offset < end {
            // They lie inside the map, whose length is a usize. A system that refuses reads page by page.
            let _ = map.advise_range(Advice::WillNeed, offset as usize, (end - offset) as usize);
        }
    }

    /// Records of `stride` bytes at places that ascend will be read from the map.
    pub fn will_read_records(&self, places: impl Iterator<Item = u64>, stride: u64) {
        let mut run: Option<(u64, u64)> = None;
        for place in places {
            match &mut run {
                // What is fetched ahead bridges a gap.
                Some((_, end)) if place <= *end + AHEAD => *end = place + stride,
                _ => {
                    if let Some((start, end)) = run.replace((place, place + stride)) {
                        self.will_read(start, end - start);
                    }
                }
            }
        }
        if let Some((start, end)) = run {
            self.will_read(start, end - start);
        }
    }

    /// The `len` bytes from `offset` on: borrowed from the map, or read into `scratch`, whose content is replaced.
    ///
    /// # Errors
    /// If the range is not inside the file, or the system cannot read it.
    pub fn bytes<'a>(
        &'a self,
        offset: u64,
        len: u64,
        scratch: &'a mut Vec<u8>,
    ) -> Result<&'a [u8], InputError> {
        match &self.map {
            Some(map) => {
                let range = self.range(offset, len)?;
                // Single records are announced by whoever reads many of them.
                if len >= PAGE {
                    self.will_read(offset, len);
                }
                // The range lies inside the map, whose length is a usize.
                Ok(&map[range.start as usize..range.end as usize])
            }
            None => {
                self.read_into(offset, len, scratch)?;
                Ok(scratch)
            }
        }
    }

    /// Replaces `out` by the `len` bytes from `offset` on.
    ///
    /// # Errors
    /// If the range is not inside the file, or the system cannot read it.
    pub fn read_into(&self, offset: u64, len: u64, out: &mut Vec<u8>) -> Result<(), InputError> {
        let range = self.range(offset, len)?;
        match &self.map {
            Some(map) => {
                self.will_read(offset, len);
                out.clear();
                out.extend_from_slice(&map[range.start as usize..range.end as usize]);
            }
            None => {
                let len = usize::try_from(len).map_err(|_| {
                    self.io_error(io::ErrorKind::OutOfMemory, "more bytes than fit into memory")
                })?;
                // Whatever is in the buffer is overwritten, so only growth needs to be zeroed.
                out.resize(len, 0);
                self.file.read_exact_at(out, offset).map_err(|source| match source.kind() {
                    // They were there when the file was opened.
                    io::ErrorKind::UnexpectedEof => self.changed(format!(
                        "it ends before byte {}, but it had {} bytes",
                        offset + len as u64,
                        self.len
                    )),
                    _ => InputError::Io { path: self.path.clone(), source },
                })?;
            }
        }
        Ok(())
    }

    fn range(&self, offset: u64, len: u64) -> Result<std::ops::Range<u64>, InputError> {
        match offset.checked_add(len) {
            Some(end) if end <= self.len => Ok(offset..end),
            _ => Err(self.io_error(
                io::ErrorKind::UnexpectedEof,
                format!("{len} bytes were asked for at offset {offset}, but the file has {}", self.len),
            )),
        }
    }

    fn io_error(&self, kind: io::ErrorKind, what: impl Into<String>) -> InputError {
        InputError::Io { path: self.path.clone(), source: io::Error::new(kind, what.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODES: [IoMode; 3] = [IoMode::Auto, IoMode::Map, IoMode::Read];

    #[test]
    fn every_mode_hands_out_the_same_ranges() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        let content: Vec<u8> = (0..=255).collect();
        fs::write(&path, &content).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            assert_eq!(source.len(), 256);
            assert_eq!(source.path(), path);
            assert_eq!(source.mapped().is_some(), mode != IoMode::Read);
            let mut scratch = vec![9; 3];
            for (offset, len) in [(0, 256), (0, 0), (256, 0), (7, 9), (255, 1)] {
                let expected = &content[offset as usize..(offset + len) as usize];
                assert_eq!(source.bytes(offset, len, &mut scratch).unwrap(), expected);
                source.read_into(offset, len, &mut scratch).unwrap();
                assert_eq!(scratch, expected);
            }
        }
    }

    #[test]
    fn ranges_outside_the_file_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        fs::write(&path, [1, 2, 3]).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            let mut scratch = Vec::new();
            for (offset, len) in [(0, 4), (3, 1), (4, 0), (u64::MAX, 1), (1, u64::MAX), (0, u64::MAX)] {
                assert!(matches!(source.bytes(offset, len, &mut scratch), Err(InputError::Io { .. })));
                assert!(matches!(source.read_into(offset, len, &mut scratch), Err(InputError::Io { .. })));
            }
            assert!(scratch.capacity() < 1024, "nothing may be allocated for bytes that do not exist");
        }
    }

    #[test]
    fn an_empty_file_opens_in_every_mode() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("empty");
        fs::write(&path, []).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            assert!(source.is_empty());
            assert_eq!(source.bytes(0, 0, &mut Vec::new()).unwrap(), b"");
        }
    }

    #[test]
    fn a_file_that_changes_is_told_from_one_that_does_not() {
        type Change = fn(&Path);
        let append: Change = |path| {
            let mut file = File::options().append(true).open(path).unwrap();
            std::io::Write::write_all(&mut file, b"more").unwrap();
        };
        let rewrite: Change = |path| {
            let file = File::options().write(true).open(path).unwrap();
            file.write_all_at(b"X", 0).unwrap();
            // A clock that ticks slowly must not hide the change.
            file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
        };
        let replace: Change = |path| {
            let other = path.with_extension("new");
            fs::write(&other, vec![0; 256]).unwrap();
            fs::rename(other, path).unwrap();
        };
        let cases: [(Change, &str); 5] = [
            (append, "had 256 bytes and has 260"),
            (rewrite, "written to"),
            (replace, "another file has taken its place"),
            (|path| fs::remove_file(path).unwrap(), "was removed"),
            (|path| File::options().write(true).open(path).unwrap().set_len(100).unwrap(), "has 100"),
        ];
        for mode in MODES {
            for (change, reason) in cases {
                let dir = tempfile::tempdir().unwrap();
                let path = dir.path().join("bytes");
                fs::write(&path, vec![0; 256]).unwrap();
                let source = ByteSource::open(&path, mode).unwrap();
                source.unchanged().unwrap();
                change(&path);
                let error = source.unchanged().unwrap_err();
                assert!(matches!(error, InputError::Changed { .. }), "{error}");
                assert!(error.to_string().contains(reason), "{error}");
            }
        }
    }

    #[test]
    fn reading_what_was_cut_off_is_an_error_that_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        fs::write(&path, vec![0; 256]).unwrap();
        let source = ByteSource::open(&path, IoMode::Read).unwrap();
        File::options().write(true).open(&path).unwrap().set_len(100).unwrap();
        let mut scratch = Vec::new();
        source.bytes(0, 100, &mut scratch).unwrap();
        let error = source.bytes(90, 20, &mut scratch).unwrap_err();
        assert!(error.to_string().contains("it ends before byte 110, but it had 256 bytes"), "{error}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn pages_that_were_read_are_given_up() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        let length = 5 * RESIDENT;
        File::create(&path).unwrap().set_len(length).unwrap();
        let source = ByteSource::open(&path, IoMode::Map).unwrap();
        let resident = || {
            let status = fs::read_to_string("/proc/self/smaps").unwrap();
            let name = path.to_str().unwrap();
            let mut lines = status.lines().skip_while(|line| !line.ends_with(name)).skip(1);
            let rss = lines.find(|line| line.starts_with("Rss:")).unwrap();
            rss.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() << 10
        };
        let (mut sum, mut most) = (0, 0);
        for chunk in 0..length >> 20 {
            let bytes = source.bytes(chunk << 20, 1 << 20, &mut Vec::new()).map(<[u8]>::to_vec).unwrap();
            sum += bytes.iter().step_by(PAGE as usize).filter(|&&byte| byte == 0).count() as u64;
            most = most.max(resident());
        }
        assert_eq!(sum, length / PAGE);
        assert!((RESIDENT / 2..=2 * RESIDENT).contains(&most), "{most} bytes were resident");
    }

    #[test]
    fn what_is_not_a_regular_file_is_told_from_what_is_missing() {
        let dir = tempfile::tempdir().unwrap();
        for mode in MODES {
            let missing = ByteSource::open(&dir.path().join("missing"), mode);
            assert!(matches!(missing, Err(InputError::Io { .. })));
            for other in [dir.path(), Path::new("/dev/null")] {
                assert!(matches!(ByteSource::open(other, mode), Err(InputError::NotAFile { .. })));
            }
        }
    }
}
