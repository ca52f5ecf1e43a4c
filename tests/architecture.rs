//! The rules of the source tree that no compiler checks: layers, where text is printed, where memory is mapped.
//!
//! A module uses only the modules before it. What a file uses is read from its paths (`crate::`, `super::`, `std::`),
//! comments and strings left out, use trees spread out.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The layers, first to last, each with what is allowed beside the layers before it.
const LAYERS: [(&str, &[&str]); 15] = [
    ("math", &[]),
    ("mesh", &[]),
    ("spill", &[]),
    ("input", &[]),
    // The parameters say how the input is read, and every layer from here on reads the parameters.
    ("config", &[]),
    ("partition", &[]),
    ("voting", &[]),
    ("refine", &[]),
    ("stitch", &[]),
    // Keeps what the layers before it decided and found.
    ("workspace", &[]),
    // An attribute file is opened over a mesh source, so that its errors are those of both layers: the joint type.
    ("output", &["error"]),
    // Joins the errors of the layers before it.
    ("error", &[]),
    // Hands its results to what `output` calls a sink.
    ("pipeline", &[]),
    // What was found and how, as data and as a page; knows no terminal.
    ("report", &[]),
    ("cli", &[]),
];

/// Further limits: what a layer may use of those before it, if not everything.
const LIMITS: [(&str, &[&str]); 6] = [
    ("math", &[]),
    ("mesh", &[]),
    ("spill", &[]),
    ("input", &["mesh", "spill"]),
    ("config", &["input"]),
    // Knows what an error is, not what a mesh or a vote is.
    ("error", &["mesh", "spill", "input", "config", "partition", "stitch", "workspace", "output"]),
];

/// The only modules that name the joint error type; the layers have their own.
const JOINT_ERROR: [&str; 4] = ["output", "pipeline", "report", "cli"];

/// No file is longer: what does not fit is two things.
const MOST_LINES: usize = 600;

/// A source file.
struct Source {
    /// Below `src`, with `/`.
    path: String,
    text: String,
    /// The text without comments, strings and characters.
    code: String,
}

impl Source {
    fn new(path: &str, text: String) -> Source {
        Source { path: path.to_owned(), code: code_of(&text), text }
    }

    /// Module path: `voting/levels.rs` is `[voting, levels]`, `voting/mod.rs` is `[voting]`, `lib.rs` is empty.
    fn module(&self) -> Vec<&str> {
        let stem = self.path.trim_end_matches(".rs");
        let mut parts: Vec<&str> = stem.split('/').collect();
        if matches!(parts[parts.len() - 1], "mod" | "lib" | "main") {
            parts.pop();
        }
        parts
    }

    /// The top-level modules it uses, its own left out.
    fn uses(&self) -> BTreeSet<String> {
        let module = self.module();
        let mut found = BTreeSet::new();
        for path in paths(&self.code) {
            let ups = path.names.iter().take_while(|name| *name == "super").count();
            let depth = module.len() + path.depth;
            let from_root = match path.names[0].as_str() {
                "crate" | "crease" => &path.names[1..],
                "super" if ups == depth => &path.names[ups..],
                _ => continue,
            };
            found.extend(from_root.first().filter(|name| module.first() != Some(&name.as_str())).cloned());
        }
        found
    }

    fn mentions(&self, word: &str) -> bool {
        words(&self.code).any(|(_, w)| w == word)
    }

    /// Whether it calls a macro that prints.
    fn prints(&self) -> bool {
        words(&self.code).any(|(at, word)| {
            matches!(word, "print" | "println" | "eprint" | "eprintln" | "dbg")
                && self.code[at + word.len()..].trim_start().starts_with('!')
        })
    }
}

/// All files below `src`, by path.
fn sources() -> Vec<Source> {
    fn collect(directory: &Path, prefix: &str, found: &mut Vec<Source>) {
        for entry in fs::read_dir(directory).expect("a directory of sources") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().and_then(|name| name.to_str()).expect("a name in ASCII");
            if path.is_dir() {
                collect(&path, &format!("{prefix}{name}/"), found);
            } else if name.ends_with(".rs") {
                let text = fs::read_to_string(&path).expect("a source file");
                found.push(Source::new(&format!("{prefix}{name}"), text));
            }
        }
    }
    let mut found = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(found.len() > 50, "only {} files were found", found.len());
    found
}

/// Length of the literal or comment at the start of `text`, if there is one.
fn opaque(text: &str) -> Option<usize> {
    let up_to =
        |from: usize, end: &str| text[from..].find(end).map_or(text.len(), |at| from + at + end.len());
    if text.starts_with("//") {
        return Some(text.find('\n').unwrap_or(text.len()));
    }
    if text.starts_with("/*") {
        let (mut depth, mut at) = (1, 2);
        while depth > 0 && at < text.len() {
            match text.get(at..at + 2) {
                Some("/*") => (depth, at) = (depth + 1, at + 2),
                Some("*/") => (depth, at) = (depth - 1, at + 2),
                _ => at += 1,
            }
        }
        return Some(at);
    }
    if let Some(rest) = text.strip_prefix('r') {
        let hashes = rest.len() - rest.trim_start_matches('#').len();
        if rest[hashes..].starts_with('"') {
            return Some(up_to(hashes + 2, &format!("\"{}", "#".repeat(hashes))));
        }
    }
    let quote = text.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    // A quote that no second one follows after one character is that of a lifetime.
    let mut rest = text.char_indices().skip(1);
    if quote == '\'' && !text[1..].starts_with('\\') && text.chars().nth(2) != Some('\'') {
        return None;
    }
    while let Some((at, c)) = rest.next() {
        match c {
            '\\' => _ = rest.next(),
            c if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    Some(text.len())
}

/// `text` with comments, strings and characters replaced by a space.
fn code_of(text: &str) -> String {
    let (mut code, mut at) = (String::with_capacity(text.len()), 0);
    while let Some(c) = text[at..].chars().next() {
        // An `r` starts a raw string only where a word starts.
        let in_word = code.ends_with(|c: char| c.is_alphanumeric() || c == '_') && c == 'r';
        match opaque(&text[at..]).filter(|_| !in_word) {
            Some(length) => {
                code.push(' ');
                at += length;
            }
            None => {
                code.push(c);
                at += c.len_utf8();
            }
        }
    }
    code
}

/// The words of `code` with their positions.
fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        at += code[at..].find(is_word)?;
        let length = code[at..].find(|c| !is_word(c)).unwrap_or(code.len() - at);
        at += length;
        Some((at - length, &code[at - length..at]))
    })
}

/// A path in the code.
struct CodePath {
    names: Vec<String>,
    /// In how many inline modules it stands.
    depth: usize,
}

/// All paths that start at `crate`, `crease`, `super` or `std`; use trees are spread out.
fn paths(code: &str) -> Vec<CodePath> {
    let mut found = Vec::new();
    // Braces at which inline modules were opened, and how many braces are open.
    let (mut modules, mut open, mut seen, mut last): (Vec<usize>, usize, usize, [&str; 2]) =
        Default::default();
    for (at, word) in words(code) {
        for c in code[seen..at].chars() {
            match c {
                '{' => {
                    open += 1;
                    if last[0] == "mod" {
                        modules.push(open);
                    }
                    last = [""; 2];
                }
                '}' => {
                    modules.retain(|&m| m != open);
                    open = open.saturating_sub(1);
                }
                ';' => last = [""; 2],
                _ => {}
            }
        }
        seen = at;
        last = [last[1], word];
        let starts = !code[..at].trim_end().ends_with("::");
        if starts && matches!(word, "crate" | "crease" | "super" | "std") {
            let depth = modules.len();
            let mut all = Vec::new();
            spread(&code[at..], &mut Vec::new(), &mut all);
            found.extend(
                all.into_iter().filter(|names| names.len() > 1).map(|names| CodePath { names, depth }),
            );
        }
    }
    found
}

/// Spreads the path or use tree at the start of `code` out; returns how much of it that was.
fn spread(code: &str, prefix: &mut Vec<String>, found: &mut Vec<Vec<String>>) -> usize {
    let space = |at: usize| at + code[at..].len() - code[at..].trim_start().len();
    let (own, mut at) = (prefix.len(), space(0));
    loop {
        if code[at..].starts_with('{') {
            at += 1;
            loop {
                at = space(at);
                match code[at..].chars().next() {
                    Some('}') | None => break,
                    Some(',') => at += 1,
                    _ => {
                        at += spread(&code[at..], prefix, found);
                        // What follows up to the next branch (`as name`) is not part of the path.
                        at += code[at..].find([',', '}']).unwrap_or(code.len() - at);
                    }
                }
            }
            at = (at + 1).min(code.len());
            break;
        }
        let Some(word) = words(&code[at..]).next().filter(|(start, _)| *start == 0).map(|(_, w)| w) else {
            found.push(prefix.clone());
            break;
        };
        prefix.push(word.to_owned());
        at += word.len();
        if code[space(at)..].starts_with("::") {
            at = space(space(at) + 2);
        } else {
            found.push(prefix.clone());
            break;
        }
    }
    prefix.truncate(own);
    at
}

/// What `source` uses against the order of the layers.
fn violations(source: &Source) -> Vec<String> {
    // The root joins the layers, the program calls one function.
    let module = source.module();
    let Some(layer) = module.first() else { return Vec::new() };
    let place = |name: &str| LAYERS.iter().position(|(layer, _)| *layer == name);
    let Some(own) = place(layer) else { return vec![format!("{}: {layer} is not a layer", source.path)] };
    let limit = LIMITS.iter().find(|(name, _)| name == layer).map(|(_, allowed)| allowed);
    let complaint = |used: &String| {
        let before = place(used).is_some_and(|at| at < own);
        let within = limit.is_none_or(|allowed| allowed.contains(&used.as_str()));
        let besides = LAYERS[own].1.contains(&used.as_str());
        let joint = used != "error" || JOINT_ERROR.contains(layer);
        let fine = (besides || (before && within)) && joint;
        (!fine).then(|| format!("{} uses crate::{used}", source.path))
    };
    source.uses().iter().filter_map(complaint).collect()
}

#[test]
fn every_module_uses_only_those_before_it() {
    let sources = sources();
    let found: Vec<String> = sources.iter().flat_map(violations).collect();
    assert!(found.is_empty(), "against the order of the layers:\n{}", found.join("\n"));
    // The order is that of the tree, and the reader sees what is there to be seen.
    let layers: BTreeSet<&str> = sources.iter().filter_map(|s| s.module().first().copied()).collect();
    assert_eq!(layers, LAYERS.iter().map(|(name, _)| *name).collect());
    let uses = |path: &str| sources.iter().find(|s| s.path == path).expect(path).uses();
    assert_eq!(
        uses("refine/thin.rs").into_iter().collect::<Vec<_>>(),
        ["config", "mesh", "partition", "voting"]
    );
    assert!(uses("pipeline/compute.rs").contains("refine"));
}

#[test]
fn exceptions_are_still_needed() {
    let sources = sources();
    for (layer, besides) in LAYERS {
        let used: BTreeSet<String> =
            sources.iter().filter(|s| s.module().first() == Some(&layer)).flat_map(Source::uses).collect();
        let limits = LIMITS.iter().find(|(name, _)| *name == layer).map_or(&[][..], |(_, allowed)| allowed);
        for name in besides.iter().chain(limits) {
            assert!(used.contains(*name), "{layer} does not use {name}: take it off the list");
        }
    }
}

#[test]
fn only_the_command_line_prints() {
    let sources = sources();
    let printing: Vec<&str> = sources.iter().filter(|s| s.prints()).map(|s| s.path.as_str()).collect();
    let stray: Vec<_> =
        printing.iter().filter(|path| !path.starts_with("cli/") && **path != "main.rs").collect();
    assert!(stray.is_empty(), "{stray:?}");
}

#[test]
fn only_the_mapping_of_files_is_unsafe() {
    let sources = sources();
    let unsafe_files: Vec<&str> =
        sources.iter().filter(|s| s.mentions("unsafe")).map(|s| s.path.as_str()).collect();
    assert_eq!(unsafe_files, ["input/map.rs"]);
}

#[test]
fn files_are_short_and_say_what_they_are_for() {
    for source in sources() {
        let lines = source.text.lines().count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines", source.path);
        assert!(source.text.starts_with("//! "), "{} does not start with what it is for", source.path);
    }
}

/// The mathematics of a tile must not see the machine: files, clocks, threads.
#[test]
fn the_mathematics_knows_nothing_of_the_machine() {
    let pure = ["math", "mesh", "voting", "refine", "stitch"];
    let mut checked = 0;
    for source in sources().iter().filter(|s| s.module().first().is_some_and(|m| pure.contains(m))) {
        for path in paths(&source.code) {
            let machine = ["fs", "time", "thread", "io", "env", "process"].contains(&path.names[1].as_str());
            assert!(path.names[0] != "std" || !machine, "{} uses {}", source.path, path.names.join("::"));
        }
        for word in ["ThreadPool", "ThreadPoolBuilder", "Instant", "SystemTime", "current_num_threads"] {
            assert!(!source.mentions(word), "{} mentions {word}", source.path);
        }
        checked += 1;
    }
    assert!(checked > 15, "only {checked} files were checked");
}

#[test]
fn violations_are_seen() {
    let text = r####"//! See [`crate::cli`].
        use crate::{mesh::{Csr, Field as F, *}, pipeline as p, config::method};
        use super::super::stitch::Line; // not crate::output
        /* nor /* here */ crate::output */
        fn f<'a>(x: &'a str) -> char { let _ = ("crate::output \" println!()", r#"" unsafe "#); '"' }
        fn g() -> crate::cli::Exit { super::normals::h(); std::time::Instant::now(); 'b' }
        mod tests {
            use super::super::super::input;
            use super::super::levels;
            fn k() { if true { super::g() } }
        }
        use super::levels;
        "####;
    let source = Source::new("voting/sample.rs", text.to_owned());
    let uses: Vec<String> = source.uses().into_iter().collect();
    assert_eq!(uses, ["cli", "config", "input", "mesh", "pipeline", "stitch"]);
    assert_eq!(
        violations(&source),
        ["cli", "pipeline", "stitch"].map(|name| format!("voting/sample.rs uses crate::{name}"))
    );
    assert!(!source.prints() && !source.mentions("unsafe") && source.mentions("Instant"));
    let std: Vec<String> =
        paths(&source.code).iter().filter(|p| p.names[0] == "std").map(|p| p.names.join("::")).collect();
    assert_eq!(std, ["std::time::Instant::now"]);
    assert!(Source::new("math/sample.rs", "fn f() { eprintln!(\"x\") }".to_owned()).prints());
    assert!(Source::new("math/sample.rs", "unsafe fn f() {}".to_owned()).mentions("unsafe"));
}
