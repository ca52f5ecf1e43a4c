//! Rewrites the generated parts of a document. In: a document with markers, and what belongs between them; out: the
//! document, everything outside the markers as it was.

use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

/// Replaces what stands between `<!-- generated NAME -->` and `<!-- end -->` in the file by `content`.
///
/// # Errors
/// If the file cannot be read or written, or has no such part.
pub fn replace(path: &Path, name: &str, content: &str) -> Result<()> {
    let context = || path.display().to_string();
    let text = fs::read_to_string(path).with_context(context)?;
    fs::write(path, replaced(&text, name, content).with_context(context)?).with_context(context)
}

fn replaced(text: &str, name: &str, content: &str) -> Result<String> {
    const END: &str = "<!-- end -->";
    let start = format!("<!-- generated {name} -->\n");
    let from =
        text.find(&start).with_context(|| format!("the line `{}` is missing", start.trim()))? + start.len();
    let length = text[from..].find(END).with_context(|| format!("no `{END}` after `{}`", start.trim()))?;
    ensure!(
        !text[from..from + length].contains("<!-- generated"),
        "`{}` has no end of its own",
        start.trim()
    );
    Ok(format!("{}\n{}\n{}", &text[..from], content.trim_end(), &text[from + length..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_named_part_changes() {
        let text = "A\n<!-- generated x -->\nold\n<!-- end -->\nB\n<!-- generated y -->\n<!-- end -->\n";
        let new = replaced(text, "x", "new\n\n").unwrap();
        assert_eq!(
            new,
            "A\n<!-- generated x -->\n\nnew\n<!-- end -->\nB\n<!-- generated y -->\n<!-- end -->\n"
        );
        assert_eq!(replaced(&new, "x", "new").unwrap(), new);
        assert!(replaced(text, "z", "").is_err());
    }
}
