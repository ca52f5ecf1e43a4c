//! Which files an input is made of.
//!
//! In: names of files, folders and patterns. Out: files, each once, in an order that does not depend on the order of the
//! names: that of their full paths, byte for byte. Of a folder, these are the files right in it whose names end like those
//! of meshes; what this program wrote (`*.creases.ply`) and hidden files are left out. A name that no file has is taken for
//! a pattern if it contains `*`, `?` or `[`.

use super::InputError;
use super::format::Format;
use super::stream::Packing;
use glob::MatchOptions;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

/// The files of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFiles {
    /// As they were named or found, in canonical order.
    pub files: Vec<PathBuf>,
    /// Where they lie, if there is more than one or a folder was named: the innermost folder that holds them all.
    pub folder: Option<PathBuf>,
}

/// What the names of results end in.
const RESULT: &str = ".creases.ply";

impl InputFiles {
    /// Finds the files.
    ///
    /// # Errors
    /// If a name leads to nothing, a folder or pattern to no mesh, or the system refuses.
    pub fn find(names: &[PathBuf]) -> Result<InputFiles, InputError> {
        let mut files = Vec::new();
        for name in names {
            if name.is_dir() {
                files.extend(meshes_in(name)?);
            } else if name.exists() || !is_pattern(name) {
                files.push(name.clone());
            } else {
                files.extend(matches(name)?);
            }
        }
        let mut keyed = Vec::with_capacity(files.len());
        for file in files {
            let io_error = |source| InputError::Io { path: file.clone(), source };
            keyed.push((file.canonicalize().map_err(io_error)?, file.clone()));
        }
        keyed.sort();
        keyed.dedup_by(|a, b| a.0 == b.0);
        let alone = matches!(names, [name] if !name.is_dir()) && keyed.len() == 1;
        let folder = (!alone).then(|| common_folder(&keyed));
        Ok(InputFiles { files: keyed.into_iter().map(|(_, file)| file).collect(), folder })
    }

    /// What to call it in messages.
    pub fn name(&self) -> PathBuf {
        match (&self.folder, self.files.as_slice()) {
            (None, [file]) => file.clone(),
            (folder, files) => {
                let folder = folder.as_deref().unwrap_or(Path::new("")).display();
                let files =
                    if files.len() == 1 { "1 file".to_owned() } else { format!("{} files", files.len()) };
                PathBuf::from(format!("{folder} ({files})"))
            }
        }
    }

    /// What to name results after: the file without its extensions, or the folder.
    pub fn stem(&self) -> OsString {
        let stem = match (&self.folder, self.files.as_slice()) {
            (None, [file]) => {
                let packed = file
                    .extension()
                    .is_some_and(|e| Packing::EXTENSIONS.iter().any(|x| e.eq_ignore_ascii_case(x)));
                let inner = if packed { file.with_extension("") } else { file.clone() };
                inner.file_stem().map(OsStr::to_owned)
            }
            (folder, _) => folder.as_deref().and_then(Path::file_name).map(OsStr::to_owned),
        };
        stem.unwrap_or_else(|| OsString::from("mesh"))
    }
}

fn is_pattern(name: &Path) -> bool {
    name.to_str().is_some_and(|name| name.contains(['*', '?', '[']))
}

/// Files right in `folder` that are meshes by their names.
fn meshes_in(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let io_error = |source| InputError::Io { path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(io_error)? {
        let path = entry.map_err(io_error)?.path();
        if is_mesh_name(&path) && path.is_file() {
            found.push(path);
        }
    }
    if found.is_empty() {
        let reason = "there is no mesh in this folder: no file whose name ends in .ply, .obj, .stl or .off, be it packed \
                      as .gz or .zst; give the files by name";
        return Err(InputError::Format { path: folder.to_owned(), reason: reason.to_owned() });
    }
    Ok(found)
}

/// Files that a pattern stands for.
fn matches(pattern: &Path) -> Result<Vec<PathBuf>, InputError> {
    let refused = |reason: String| InputError::Format { path: pattern.to_owned(), reason };
    // As in a shell, hidden files are meant only by a dot.
    let options = MatchOptions { require_literal_leading_dot: true, ..MatchOptions::new() };
    let paths = glob::glob_with(&pattern.to_string_lossy(), options)
        .map_err(|e| refused(format!("no pattern: {e}")))?;
    let mut found = Vec::new();
    for path in paths {
        let path = path.map_err(|e| InputError::Io { path: e.path().to_owned(), source: e.into() })?;
        if path.is_file() && !is_result(&path) {
            found.push(path);
        }
    }
    if found.is_empty() {
        return Err(refused("there is no such file, nor one that fits if it is a pattern".to_owned()));
    }
    Ok(found)
}

fn is_mesh_name(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(OsStr::to_str).map(str::to_ascii_lowercase) else {
        return false;
    };
    let ends_in = |name: &str, extensions: &[&str]| {
        name.rsplit_once('.').is_some_and(|(stem, end)| !stem.is_empty() && extensions.contains(&end))
    };
    let inner = match name.rsplit_once('.') {
        Some((inner, _)) if ends_in(&name, &Packing::EXTENSIONS) => inner,
        _ => name.as_str(),
    };
    ends_in(inner, &Format::EXTENSIONS) && !name.starts_with('.') && !is_result(path)
}

fn is_result(path: &Path) -> bool {
    path.file_name().and_then(OsStr::to_str).is_some_and(|name| name.ends_with(RESULT))
}

/// The innermost folder of all files, which are given with their full paths.
fn common_folder(files: &[(PathBuf, PathBuf)]) -> PathBuf {
    let parent = |path: &Path| path.parent().map_or_else(PathBuf::new, Path::to_owned);
    let mut common = files.first().map_or_else(PathBuf::new, |(full, _)| parent(full));
    for (full, _) in files {
        while !full.starts_with(&common) {
            common = parent(&common);
        }
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(names: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for name in names {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        dir
    }

    fn names(found: &InputFiles) -> Vec<String> {
        found.files.iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn folders_and_patterns_are_the_meshes_in_them() {
        let dir = place(&[
            "t/b.ply",
            "t/a.obj",
            "t/c.STL.gz",
            "t/d.off.zst",
            "t/t.creases.ply",
            "t/.e.ply",
            "t/notes.txt",
            "t/f.gz",
            "t/g.ply/h.ply",
        ]);
        let at = |name: &str| dir.path().join(name);
        let all = InputFiles::find(&[at("t")]).unwrap();
        assert_eq!(names(&all), ["a.obj", "b.ply", "c.STL.gz", "d.off.zst"]);
        assert_eq!(all.stem(), "t");
        assert!(all.name().display().to_string().ends_with("t (4 files)"), "{:?}", all.name());
        // In any order, and each file once.
        let again = [at("t/d.off.zst"), at("t"), at("t/../t/a.obj"), at("t/*.ply")];
        let mut found = InputFiles::find(&again).unwrap();
        found.files.iter_mut().for_each(|file| *file = file.canonicalize().unwrap());
        assert_eq!(names(&found), names(&all));
        assert_eq!(names(&InputFiles::find(&[at("t/[ab].*")]).unwrap()), ["a.obj", "b.ply"]);
        assert_eq!(InputFiles::find(&[at("t/g.ply"), at("t/b.ply")]).unwrap().stem(), "t");
    }

    #[test]
    fn one_file_gives_its_name() {
        let dir = place(&["x/scan.v2.ply.gz", "x/scan.obj", "y/scan.obj"]);
        let at = |name: &str| dir.path().join(name);
        let one = InputFiles::find(&[at("x/scan.v2.ply.gz")]).unwrap();
        assert_eq!((one.stem(), one.name()), ("scan.v2".into(), at("x/scan.v2.ply.gz")));
        assert_eq!(InputFiles::find(&[at("y")]).unwrap().stem(), "y");
        let both = InputFiles::find(&[at("y/scan.obj"), at("x/scan.obj")]).unwrap();
        assert_eq!(both.stem(), dir.path().file_name().unwrap());
    }

    #[test]
    fn what_leads_nowhere_is_an_error() {
        let dir = place(&["empty/notes.txt"]);
        let error = |name: &str| InputFiles::find(&[dir.path().join(name)]).unwrap_err().to_string();
        assert!(error("empty").contains("no mesh in this folder"));
        assert!(error("*.ply").contains("nor one that fits"));
        assert!(error("missing.ply").contains("No such file"));
    }
}
