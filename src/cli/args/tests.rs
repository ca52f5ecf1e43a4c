//! The command line, parsed: what becomes of words, and which are refused.

use super::{Cli, Command, DetectArgs};
use crate::config::{Limits, Method, PaperThresholds, Params, Sigma, Tiling, method};
use crate::input::IoMode;
use clap::CommandFactory;
use std::ffi::OsString;

fn detect(words: &str) -> Result<DetectArgs, clap::Error> {
    let all = ["crease", "detect", "in.ply"].into_iter().chain(words.split_whitespace());
    Cli::parse_words(all.map(OsString::from)).map(|cli| match cli.command {
        Command::Detect(args) => args,
        other => panic!("{other:?}"),
    })
}

#[test]
fn the_definition_is_sound() {
    Cli::command().debug_assert();
}

#[test]
fn nothing_said_is_the_default() {
    let args = detect("").expect("no options");
    assert_eq!(args.params(), Params::default());
    assert_eq!(args.work.limits().tiling, Limits::default().tiling);
    assert!(args.work.limits().threads > 0);
}

#[test]
fn the_help_names_the_defaults_that_are() {
    let help = Cli::command().find_subcommand_mut("detect").expect("detect").render_long_help().to_string();
    let default = Params::default();
    for text in [
        format!("Default: {}", method::SIGMA_EDGES),
        format!("from {} to {}", method::SIGMA_EDGES_RANGE.0, method::SIGMA_EDGES_RANGE.1),
        format!("Default: {:.2}", default.min_length_sigmas),
        format!("Default: {}", default.min_angle_deg),
        format!("than {}", crate::config::DEFAULT_TILE_FACES),
        format!("Default: {}", PaperThresholds::default().salience),
        format!("Default: {}", PaperThresholds::default().edge_l2),
        format!("Default: {}", PaperThresholds::default().corner_l3),
    ] {
        let flat = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(flat.contains(&text), "{text} is not in {flat}");
    }
}

#[test]
fn options_arrive() {
    let args =
        detect("--sigma 0.5 --min-angle 10 --min-length 0 --boundaries --in-core --io read").expect("parse");
    let expected = Params {
        method: Method::Robust,
        sigma: Sigma::Length(0.5),
        min_angle_deg: 10.0,
        min_length_sigmas: 0.0,
        boundaries: true,
    };
    assert_eq!(args.params(), expected);
    assert_eq!((args.work.limits().tiling, args.work.limits().io), (Tiling::InCore, IoMode::Read));
}

#[test]
fn impossible_values_are_refused() {
    for words in [
        "--sigma 0",
        "--sigma -1",
        "--sigma nan",
        "--sigma inf",
        "--sigma-edges 0.5",
        "--sigma-edges 31",
        "--sigma 1 --sigma-edges 3",
        "--min-angle 181",
        "--min-angle -1",
        "--min-length -1",
        "--tile-faces 0",
        "--tile-faces 5 --in-core",
        "--threads -1",
        "--threads 1025",
        "--io pipe",
        "--quiet --verbose",
        "--method both",
        "--method paper --salience 1.1",
        "--method paper --edge-l2 0",
        "--method paper --corner-l3 2",
        "--method paper --sigma -1",
        "--method paper --sigma-edges 0.5",
    ] {
        assert!(detect(words).is_err(), "{words}");
    }
}

#[test]
fn the_paper_method_has_its_own_options() {
    let published = PaperThresholds { corner_l3: 0.065, edge_l2: 0.02, salience: 0.1 };
    let args = detect("--method paper").expect("parse");
    assert_eq!(args.params(), Params { method: Method::Paper(published), ..Params::default() });
    let args =
        detect("--method paper --sigma 0 --salience 0.2 --edge-l2 0.03 --corner-l3 0.07").expect("parse");
    let thresholds = PaperThresholds { corner_l3: 0.07, edge_l2: 0.03, salience: 0.2 };
    let expected =
        Params { method: Method::Paper(thresholds), sigma: Sigma::Length(0.0), ..Params::default() };
    assert_eq!(args.params(), expected);
}

#[test]
fn options_of_the_other_method_are_refused_by_name() {
    for (words, message) in [
        ("--salience 0.2", "--salience needs --method paper"),
        ("--method robust --edge-l2 0.02", "--edge-l2 needs --method paper"),
        ("--corner-l3 0.1", "--corner-l3 needs --method paper"),
        ("--sigma 0", "a sigma of 0 needs --method paper"),
        ("--sigma-edges 0", "a sigma of 0 needs --method paper"),
        ("--method paper --min-angle 10", "--min-angle needs --method robust"),
        ("--method paper --min-angle 0", "--min-angle needs --method robust"),
    ] {
        let refusal = detect(words).expect_err(words).to_string();
        assert!(refusal.contains(message), "{words}: {refusal}");
    }
}
