//! Which files are read, and what is done about what is wrong with them.
//!
//! In: words of the command line. Out: names, and the choices that [`crate::input`] takes.

use super::WHAT;
use super::values::number;
use crate::input::{InputError, MeshSource, Sieve, Weld};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What is worked on.
#[derive(Debug, Args)]
pub(in crate::cli) struct InputArgs {
    /// The mesh: a file of any size, several files, folders, or patterns in quotes. PLY, OBJ, STL and OFF are read, packed by
    /// gzip or zstd, too. Several files are one mesh in one system of coordinates, as the tiles of a city; of a folder, all
    /// meshes right in it. The order makes no difference. What is not one binary little-endian PLY file is converted first,
    /// in `--workspace`.
    #[arg(required = true, value_name = "INPUT")]
    pub names: Vec<PathBuf>,

    /// Which vertices become one, so that the faces at them are neighbours: `exact`, those with equal coordinates; `none`; or
    /// a length in mesh units: each vertex within that length of one that stays becomes that one. Default: `exact` for several
    /// files and for STL, whose triangles share no vertices; `none` for one file that names vertices by number.
    #[arg(long, value_name = "exact|none|LENGTH", help_heading = WHAT, value_parser = weld, allow_negative_numbers = true)]
    pub weld: Option<Weld>,
}

/// What is done about faces that cannot be used.
#[derive(Debug, Args)]
pub(in crate::cli) struct BadFacesArgs {
    /// What to do about faces that name vertices that do not exist or have coordinates that are not finite: `error`, the
    /// default, stops at the first; `skip` leaves them out and counts them.
    #[arg(long, value_enum, value_name = "WHAT", help_heading = WHAT, default_value = "error",
          hide_default_value = true, hide_possible_values = true)]
    bad_faces: BadFaces,
}

impl BadFacesArgs {
    /// The source that leaves them out, if that was asked for.
    pub fn sieve<'a>(&self, source: &'a dyn MeshSource) -> Result<Option<Sieve<'a>>, InputError> {
        match self.bad_faces {
            BadFaces::Error => Ok(None),
            BadFaces::Skip => Sieve::new(source).map(Some),
        }
    }
}

/// What is done about faces that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BadFaces {
    Error,
    Skip,
}

fn weld(text: &str) -> Result<Weld, String> {
    match text {
        "exact" => Ok(Weld::Exact),
        "none" => Ok(Weld::None),
        _ => match number(text) {
            Ok(0.0) => Ok(Weld::Exact),
            Ok(x) if x > 0.0 && x.is_finite() => Ok(Weld::Within(x)),
            _ => Err("it must be `exact`, `none`, or a length above 0".to_owned()),
        },
    }
}
