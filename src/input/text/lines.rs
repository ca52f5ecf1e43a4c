//! The lines of a stream, with their numbers.
//!
//! A line ends in LF, CR LF or CR. Numbers count from 1, as editors do.

use crate::input::stream::Stream;
use crate::input::{InputError, InputPlace};
use memchr::memchr2;

/// Hands out one line after the other.
pub struct Lines<'s, 'a> {
    stream: &'s mut Stream<'a>,
    /// Number of the line that was handed out last.
    number: u64,
    /// Bytes that a line may have.
    longest: usize,
    /// Bytes of the line that was handed out, to be consumed before the next one.
    taken: usize,
    /// Bytes of it without its end.
    length: usize,
}

impl<'s, 'a> Lines<'s, 'a> {
    /// The lines from where the stream is, the first of which has the number `first`. None may be longer than `longest`
    /// bytes, so that a file without line ends does not fill the memory.
    pub fn new(stream: &'s mut Stream<'a>, first: u64, longest: usize) -> Lines<'s, 'a> {
        Lines { stream, number: first - 1, longest, taken: 0, length: 0 }
    }

    /// The next line without its end, and its number.
    ///
    /// # Errors
    /// If the file cannot be read, or the line is too long.
    pub fn next(&mut self) -> Result<Option<(u64, &[u8])>, InputError> {
        self.stream.consume(std::mem::take(&mut self.taken));
        self.length = 0;
        let mut seen = 0;
        loop {
            let bytes = self.stream.available();
            if let Some(at) = memchr2(b'\n', b'\r', &bytes[seen..]) {
                let end = seen + at;
                // Whether it is CR or CR LF shows in the byte behind.
                if bytes[end] == b'\r' && end + 1 == bytes.len() && self.stream.more()? {
                    seen = end;
                    continue;
                }
                let bytes = self.stream.available();
                let pair = bytes[end] == b'\r' && bytes.get(end + 1) == Some(&b'\n');
                return Ok(Some(self.hand_out(end, end + 1 + usize::from(pair))));
            }
            seen = bytes.len();
            if seen > self.longest {
                let reason = format!(
                    "the line has more than {} bytes: the file is damaged or no text; if it is right, allow more with --memory",
                    self.longest
                );
                let place = InputPlace::Line(self.number + 1);
                return Err(InputError::Damaged { path: self.stream.path().to_owned(), place, reason });
            }
            if !self.stream.more()? {
                return Ok((seen > 0).then(|| self.hand_out(seen, seen)));
            }
        }
    }

    fn hand_out(&mut self, end: usize, taken: usize) -> (u64, &[u8]) {
        (self.taken, self.length) = (taken, end);
        self.number += 1;
        (self.number, self.current())
    }

    /// Number of the line that was handed out last.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The line that was handed out last, without its end.
    pub fn current(&self) -> &[u8] {
        &self.stream.available()[..self.length]
    }

    /// An error about the line that was handed out last.
    pub fn error(&self, reason: impl Into<String>) -> InputError {
        let place = InputPlace::Line(self.number);
        InputError::Damaged { path: self.stream.path().to_owned(), place, reason: reason.into() }
    }

    /// An error because the file ends too early.
    pub fn ended(&self, missing: impl std::fmt::Display) -> InputError {
        self.error(format!("the file ends here, but {missing}; it is cut off or damaged"))
    }
}

/// The words of a line.
#[inline]
pub fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    // Null bytes pad the lines of some writers.
    line.split(|byte| byte.is_ascii_whitespace() || *byte == 0).filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8], longest: usize) -> Result<Vec<(u64, String)>, InputError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("text");
        std::fs::write(&path, text).unwrap();
        let mut stream = Stream::open(&path, 1 << 20, &|_| ()).unwrap();
        let mut lines = Lines::new(&mut stream, 1, longest);
        let mut found = Vec::new();
        while let Some((number, line)) = lines.next()? {
            found.push((number, String::from_utf8(line.to_vec()).unwrap()));
        }
        Ok(found)
    }

    #[test]
    fn every_line_end_is_known() {
        let expected = [(1, "a b"), (2, ""), (3, "c"), (4, "d")].map(|(n, line)| (n, line.to_owned()));
        for text in ["a b\n\nc\nd", "a b\r\n\r\nc\r\nd\r\n", "a b\r\rc\rd\r", "a b\n\r\nc\rd\n"] {
            assert_eq!(lines(text.as_bytes(), 100).unwrap(), expected, "{text:?}");
        }
        assert_eq!(lines(b"", 100).unwrap(), []);
        assert_eq!(words(b" 1\t2\0 three ").collect::<Vec<_>>(), [&b"1"[..], b"2", b"three"]);
    }

    #[test]
    fn lines_across_the_window_are_whole_and_long_ones_an_error() {
        let text: String = (0..200_000).map(|i| format!("v {i} {i}\r\n")).collect();
        let found = lines(text.as_bytes(), 100).unwrap();
        assert_eq!(found.len(), 200_000);
        assert!(
            found
                .iter()
                .enumerate()
                .all(|(i, (n, line))| *n == i as u64 + 1 && *line == format!("v {i} {i}"))
        );
        let text = [b"short\n".to_vec(), vec![b'x'; 3 << 20]].concat();
        let error = lines(&text, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("line 2: the line has more than 1048576 bytes"), "{error}");
    }
}
