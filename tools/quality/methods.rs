//! What is compared: ways to run the program, and baselines. In: names; out: arguments.

use anyhow::{Result, bail};

/// A way to find lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// As in tables and files.
    pub name: &'static str,
    /// Arguments of `crease detect`.
    pub arguments: &'static [&'static str],
}

/// The ways to run the program.
pub const METHODS: [Method; 3] = [
    Method { name: "robust", arguments: &[] },
    // The published method, for comparison.
    Method { name: "paper", arguments: &["--method", "paper"] },
    // Lines moved off the vertices onto the crease that the surface implies.
    Method { name: "fitted", arguments: &["--geometry", "fitted"] },
];

/// Methods by their names, separated by commas.
///
/// # Errors
/// If there is none of a name.
pub fn parse(names: &str) -> Result<Vec<Method>> {
    let find = |name: &str| match METHODS.iter().find(|method| method.name == name.trim()) {
        Some(method) => Ok(*method),
        None => {
            let known: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
            bail!("no method {name}; there are {}", known.join(", "))
        }
    };
    names.split(',').map(find).collect()
}
