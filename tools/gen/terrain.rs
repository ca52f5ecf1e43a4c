//! Two reliefs: ground with embankments and ditches, and a body panel with creases that fade.

use super::relief::{Bank, Fade, Path, Relief, Section};
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, PI};

/// Rolling ground with an embankment (30 degrees at each of its four edges), a ditch that fades at both ends (15
/// degrees at its sides, 30 in the middle), and a scarp that fades from 40 degrees to nothing.
pub fn terrain(sizing: Sizing, seed: u64) -> Result<Shape> {
    let tan = |degrees: f64| libm::tan(degrees.to_radians());
    let polyline =
        |points: &[(f64, f64)]| Section::Polyline(points.iter().copied().map(DVec2::from).collect());
    let crest = 6.0 * tan(30.0);
    let embankment = Bank {
        path: Path::Line { from: DVec2::new(18.0, 0.0), to: DVec2::new(24.0, 70.0) },
        section: polyline(&[(-9.0, 0.0), (-3.0, crest), (3.0, crest), (9.0, 0.0)]),
        fade: None,
    };
    let ditch = Bank {
        path: Path::Arc { center: DVec2::new(95.0, 35.0), radius: 50.0, middle: PI, half: 0.66 },
        section: polyline(&[(-6.0, 0.0), (0.0, -6.0 * tan(15.0)), (6.0, 0.0)]),
        fade: Some(Fade { full_from: 0.25, full_to: 0.75, end: 1.0 }),
    };
    let scarp = Bank {
        path: Path::Line { from: DVec2::new(76.0, 0.0), to: DVec2::new(72.0, 70.0) },
        section: polyline(&[(-3.0, 6.0 * tan(40.0)), (3.0, 0.0)]),
        fade: Some(Fade { full_from: 0.0, full_to: 0.1, end: 0.9 }),
    };
    let ground = |DVec2 { x, y }: DVec2| {
        1.8 * libm::sin(0.06 * x + 0.3) * libm::cos(0.05 * y) + 0.9 * libm::sin(0.09 * y + 0.04 * x)
    };
    let banks = vec![embankment, ditch, scarp];
    Relief { name: "terrain", size: DVec2::new(90.0, 70.0), ground, banks }.build(sizing, seed)
}

/// A vaulted panel with two curved creases: a ridge that fades from 40 degrees to nothing along nearly all of its
/// length, and a valley of 30 degrees that fades at both ends.
pub fn fading(sizing: Sizing, seed: u64) -> Result<Shape> {
    let crease = |degrees: f64| Section::Crease { slope: libm::tan(0.5 * degrees.to_radians()), reach: 12.0 };
    let ridge = Bank {
        path: Path::Arc { center: DVec2::new(36.0, -40.0), radius: 60.0, middle: FRAC_PI_2, half: 0.48 },
        section: crease(40.0),
        fade: Some(Fade { full_from: 0.12, full_to: 0.12, end: 1.0 }),
    };
    let valley = Bank {
        path: Path::Arc { center: DVec2::new(36.0, 91.0), radius: 45.0, middle: -FRAC_PI_2, half: 0.56 },
        section: crease(-30.0),
        fade: Some(Fade { full_from: 0.4, full_to: 0.6, end: 1.0 }),
    };
    let ground = |place: DVec2| {
        let DVec2 { x, y } = place - DVec2::new(36.0, 33.0);
        -x * x / 170.0 - y * y / 230.0
    };
    let banks = vec![ridge, valley];
    Relief { name: "fading", size: DVec2::new(72.0, 66.0), ground, banks }.build(sizing, seed)
}
