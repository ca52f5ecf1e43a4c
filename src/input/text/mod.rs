//! Meshes as text: lines, and numbers in them.
//!
//! In: a [`Stream`](super::stream::Stream). Out: lines with their numbers, and what their words say. One line is in memory
//! at a time.

mod lines;
mod number;

pub use lines::{Lines, words};
pub use number::{integer, is_printed_float, real};

/// The start of a word, fit for a message.
pub fn excerpt(bytes: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(bytes).chars().take(40).collect();
    let dots = if text.len() < bytes.len() { "..." } else { "" };
    format!("`{}{dots}`", text.escape_debug())
}
