//! Where results go, checked before any work is done for them.
//!
//! In: the paths of the command line. Out: paths that can be written to without destroying anything: the input is not
//! among them, no two are the same, nothing is replaced unasked, and their directories accept a file.

use super::exit::{Exit, Failure};
use crate::input::InputFiles;
use crate::output::{LineFormat, PartFile, check_target, directory_of, part_of};
use std::path::{Path, PathBuf};

/// The name of the lines if none is given: that of the input, in the current directory.
pub(super) fn default_output(input: &InputFiles) -> PathBuf {
    let mut name = input.stem();
    name.push(".creases.ply");
    PathBuf::from(name)
}

/// Checks all outputs of a run over `inputs`. `may_replace` tells which may be replaced if they exist.
///
/// # Errors
/// If writing one of them is impossible or would destroy something.
pub(super) fn check(
    inputs: &[PathBuf],
    outputs: &[&Path],
    may_replace: impl Fn(&Path) -> bool,
) -> Result<(), Failure> {
    for (i, output) in outputs.iter().enumerate() {
        check_directory(output)?;
        if let Some(sacrifice) = inputs.iter().find_map(|input| clash(input, output)) {
            let reason = format!("is the input; writing {} would destroy it", output.display());
            return Err(Failure::about(Exit::Usage, &sacrifice, reason));
        }
        if outputs[..i].iter().any(|other| same_file(other, output)) {
            return Err(Failure::about(
                Exit::Usage,
                output,
                "is named for two outputs; give each its own name",
            ));
        }
        check_target(output, may_replace(output))?;
        if output.is_dir() {
            return Err(Failure::about(Exit::Usage, output, "is a directory, not a name for a file"));
        }
    }
    for output in outputs {
        // Hours may pass before the first byte is written; whether it can be is known now.
        drop(PartFile::create(output)?);
    }
    Ok(())
}

/// The format that a name asks for.
///
/// # Errors
/// If there is none.
pub(super) fn format(output: &Path) -> Result<LineFormat, Failure> {
    LineFormat::of(output).ok_or_else(|| {
        let kinds: Vec<String> =
            LineFormat::ALL.iter().map(|format| format!(".{}", format.extension())).collect();
        let reason = format!("its name does not say how to write it; it must end in {}", kinds.join(", "));
        Failure::about(Exit::Usage, output, reason)
    })
}

/// Checks the name of something that is a table of vertices: these are PLY only.
///
/// # Errors
/// If the name asks for something else.
pub(super) fn check_table(output: &Path) -> Result<(), Failure> {
    match LineFormat::of(output) {
        Some(LineFormat::Ply) => Ok(()),
        _ => {
            let reason = "vertices are written as PLY only; give a name that ends in .ply";
            Err(Failure::about(Exit::Usage, output, reason))
        }
    }
}

fn check_directory(output: &Path) -> Result<(), Failure> {
    let directory = directory_of(output);
    if directory.is_dir() {
        return Ok(());
    }
    let reason = format!("cannot be written: there is no directory {}; create it first", directory.display());
    Err(Failure::about(Exit::Resource, output, reason))
}

/// Whether `output`, or the part that it is until it is whole, is the input.
fn clash(input: &Path, output: &Path) -> Option<PathBuf> {
    (same_file(input, output) || same_file(input, &part_of(output))).then(|| input.to_owned())
}

/// Whether two names lead to the same file, be it there already or not.
fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) if a == b => true,
        _ => matches!((place(a), place(b)), (Some(a), Some(b)) if a == b),
    }
}

/// The name in its directory, without following it if it is a link.
pub(super) fn place(path: &Path) -> Option<PathBuf> {
    Some(directory_of(path).canonicalize().ok()?.join(path.file_name()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_default_name_is_that_of_the_input() {
        let named = |files: &[&str], folder: Option<&str>| {
            let files = files.iter().map(PathBuf::from).collect();
            default_output(&InputFiles { files, folder: folder.map(PathBuf::from) })
        };
        assert_eq!(named(&["a/b/scan.v2.ply"], None), Path::new("scan.v2.creases.ply"));
        assert_eq!(named(&["a/b/scan.v2.ply.gz"], None), Path::new("scan.v2.creases.ply"));
        assert_eq!(named(&["a/b/1.ply", "a/b/2.ply"], Some("/x/a/b")), Path::new("b.creases.ply"));
        assert_eq!(named(&["/1.ply", "/2.ply"], Some("/")), Path::new("mesh.creases.ply"));
    }

    #[test]
    fn the_ending_says_what_is_written() {
        assert_eq!(format("a/b.creases.PLY".as_ref()).ok(), Some(LineFormat::Ply));
        assert_eq!(format("b.geojson".as_ref()).ok(), Some(LineFormat::GeoJson));
        for name in ["out", "out.json", ".ply", "out.ply.gz"] {
            let failure = format(name.as_ref()).expect_err(name);
            assert_eq!(failure.exit, Exit::Usage);
            for kind in LineFormat::ALL {
                let ending = format!(".{}", kind.extension());
                assert!(failure.message.contains(&ending), "{ending} is not in {failure:?}");
            }
        }
        assert!(check_table("t.ply".as_ref()).is_ok() && check_table("t.obj".as_ref()).is_err());
    }

    #[test]
    fn nothing_is_destroyed() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let at = |name: &str| directory.path().join(name);
        let (input, fresh, other) = (at("in.ply"), at("out.ply"), at("other.ply"));
        fs::write(&input, "mesh").expect("write");
        fs::write(&other, "old").expect("write");
        fs::write(at("x.ply.part"), "mesh").expect("write");
        fs::create_dir(at("dir.ply")).expect("create");
        std::os::unix::fs::symlink(&input, at("link.ply")).expect("link");
        let exit = |input: &Path, outputs: &[&Path], force| {
            check(&[other.clone(), input.to_owned()][1..], outputs, |_| force)
                .map_or_else(|failure| failure.exit, |()| Exit::Done)
        };
        assert_eq!(exit(&input, &[&fresh], false), Exit::Done);
        assert!(!fresh.exists() && !at("out.ply.part").exists());
        assert_eq!(exit(&input, &[&other], false), Exit::Usage);
        assert_eq!(exit(&input, &[&other], true), Exit::Done);
        let detour = directory.path().join(".").join("in.ply");
        for clash in [&input, &detour, &at("link.ply"), &at("dir.ply")] {
            assert_eq!(exit(&input, &[clash], true), Exit::Usage, "{clash:?}");
        }
        assert_eq!(exit(&at("x.ply.part"), &[&at("x.ply")], true), Exit::Usage);
        let fresh_again = directory.path().join(".").join("out.ply");
        assert_eq!(exit(&input, &[&fresh, &fresh_again], true), Exit::Usage);
        assert_eq!(exit(&input, &[&at("missing/out.ply")], false), Exit::Resource);
        assert_eq!(fs::read(&input).expect("read"), b"mesh");
        assert_eq!(fs::read(at("x.ply.part")).expect("read"), b"mesh");
    }
}
