//! Colours: whether there are any, and which.
//!
//! In: `--color`, NO_COLOR and its like, and whether a stream is a terminal. Out: styled texts, or plain ones for all who are
//! not a person. Texts are made with their styles and lose them on the way out ([`plain`]), so that there is one text.

use anstream::adapter::strip_str;
use anstream::stream::RawStream;
use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use clap::ValueEnum;
use std::ffi::OsString;

/// Headings, and the names of what is measured.
pub(super) const HEADING: Style = Style::new().bold();
/// The word `error`.
pub(super) const ERROR: Style = AnsiColor::Red.on_default().bold();
/// The word `warning`.
pub(super) const WARNING: Style = AnsiColor::Yellow.on_default().bold();

/// Decides for the whole process, from the words of the command line: what is wrong with them is said in colours, too.
pub(super) fn choose(words: &[OsString]) {
    let choice = match asked_for(words) {
        Some(clap::ColorChoice::Always) => ColorChoice::Always,
        Some(clap::ColorChoice::Never) => ColorChoice::Never,
        Some(clap::ColorChoice::Auto) | None => ColorChoice::Auto,
    };
    choice.write_global();
}

/// The last `--color WHEN` or `--color=WHEN`; anything else after the option is refused later, without colours.
fn asked_for(words: &[OsString]) -> Option<clap::ColorChoice> {
    let words: Vec<&str> = words.iter().map_while(|word| word.to_str().filter(|w| *w != "--")).collect();
    let value = |(i, word): (usize, &&str)| match word.strip_prefix("--color")? {
        "" => words.get(i + 1).copied().map(str::to_owned),
        rest => rest.strip_prefix('=').map(str::to_owned),
    };
    let last = words.iter().enumerate().filter_map(value).next_back()?;
    clap::ColorChoice::from_str(&last, false).ok()
}

/// Whether `stream` gets colours.
pub(super) fn wanted(stream: &impl RawStream) -> bool {
    AutoStream::choice(stream) != ColorChoice::Never
}

/// `text` with a style.
pub(super) fn styled(style: Style, text: &str) -> String {
    format!("{style}{text}{style:#}")
}

/// `text` without its styles.
pub(super) fn plain(text: &str) -> String {
    strip_str(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_word_counts() {
        let of = |line: &str| asked_for(&line.split(' ').map(OsString::from).collect::<Vec<_>>());
        assert_eq!(of("crease info a.ply"), None);
        assert_eq!(of("crease --color always info a.ply --color=never"), Some(clap::ColorChoice::Never));
        assert_eq!(of("crease info -- --color never"), None);
        assert_eq!(of("crease info --color"), None);
        assert_eq!(of("crease info --color sometimes"), None);
    }

    #[test]
    fn styles_come_off() {
        let text = format!("{} größer", styled(ERROR, "error"));
        assert!(text.contains('\u{1b}'));
        assert_eq!(plain(&text), "error größer");
    }
}
