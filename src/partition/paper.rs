//! What a vertex depends on in the paper method, and the certificate that a tile has loaded all of it.
//!
//! The tiles are passed over three times, because two numbers of the whole mesh stand between the votes and the lines
//! ([`Pass`]). Going backwards from the vertices a tile owns, each pass needs what is below it:
//!
//! | needed | where | because | asked for by |
//! |---|---|---|---|
//! | links | owned vertices | the result | `Links` |
//! | ridge | [`PaperReach::link_steps`] rings more | a path has so many steps | `Links` |
//! | salience | thinning radius around those, and their one-ring | a ridge vertex compares itself with them | `Links` |
//! | salience | owned vertices | its maximum | `Salience` |
//! | tensor, class | [`PaperReach::trace_steps`] rings around every salience | a supporting walk has so many steps | `Salience`, `Links` |
//! | tensor, class | owned vertices | the range of Omega | `Omega` |
//! | faces | around every tensor, and all with their barycentre in the cube around it | they vote | every pass |
//!
//! The walks from face to face that collect the voters never leave the cube, so it is the cube that must be loaded, and
//! not the walks that must be followed: where all faces with their barycentre in it are there, so are all the edges they
//! share. A face reaches as far as its barycentre, so it was loaded if the cube lies in the region. As in
//! [`super::halo`], which this stands beside, what is missing becomes a [`Gap`].

use super::cells::Cell;
use super::halo::{Demand, Loaded, Rings, Thinning, balls};
use super::lattice::CubeBox;
use super::plan::{Plan, Scale};
use super::region::Gap;
use crate::config::{Sigma, method};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// A pass over all tiles, by what it wants to know of the vertices that they own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// The range of Omega over the vertices on sharp edges and corners.
    Omega,
    /// The largest salience, which takes the range of Omega.
    Salience,
    /// The links and the fields of vertices, which take both.
    Links,
}

/// How far each step reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperReach {
    /// Rings of a link path.
    pub link_steps: usize,
    /// Radius of thinning in mesh units.
    pub thin_radius: f64,
    /// Rings of a supporting walk.
    pub trace_steps: usize,
    /// Half the edge of the cube that faces vote from, in mesh units; none where only the one-ring votes.
    pub half_cube: Option<f64>,
}

/// Half the edge of the cube around a vertex whose faces vote, in mesh units; none for sigma = 0, the one-ring alone.
pub fn half_cube(sigma: Sigma, scale: &Scale) -> Option<f64> {
    (!sigma.is_zero()).then(|| 0.5 * scale.length(method::SIGMA_EDGES))
}

impl PaperReach {
    /// What the method reaches at this scale.
    pub fn new(sigma: Sigma, scale: &Scale) -> PaperReach {
        PaperReach {
            link_steps: method::LINK_STEPS,
            thin_radius: scale.length(method::THIN_RADIUS),
            trace_steps: method::TRACE_STEPS,
            half_cube: half_cube(sigma, scale),
        }
    }

    /// Every reach times `factor`, rounded down: for showing that a halo which is too thin does not go unnoticed.
    pub fn scaled(&self, factor: f64) -> PaperReach {
        let rings = |n: usize| (n as f64 * factor).floor() as usize;
        PaperReach {
            link_steps: rings(self.link_steps),
            thin_radius: self.thin_radius * factor,
            trace_steps: rings(self.trace_steps),
            half_cube: self.half_cube.map(|half| half * factor),
        }
    }

    /// A margin, in cubes of `edge` mesh units, that is usually enough for `pass`. A ring is taken for a median edge, as in
    /// [`super::Reach::margin`].
    pub fn margin(&self, pass: Pass, scale: &Scale, edge: f64) -> i64 {
        let rings = match pass {
            Pass::Omega => 1,
            Pass::Salience => 1 + self.trace_steps,
            Pass::Links => 1 + self.trace_steps + self.link_steps,
        };
        let thinning = if pass == Pass::Links { self.thin_radius } else { 0.0 };
        let reach = rings as f64 * scale.h + thinning + self.half_cube.unwrap_or(0.0);
        // A mesh without extent has cubes without edge; all of it is in one of them.
        if edge > 0.0 { (reach / edge).ceil() as i64 } else { 0 }
    }
}

impl Loaded<'_> {
    /// Notes the lattice cubes that must be loaded before [`Loaded::holds_cube`] is true.
    fn ask_for_cube(&self, p: DVec3, half: f64, gaps: &mut HashSet<Gap>) {
        let cube = self.cubes_around(p, half);
        if !self.region.covers(&cube) {
            let missing = cube.cubes().filter(|&c| !self.region.contains(c));
            gaps.extend(missing.map(|cube| Gap { cube, margin: 0 }));
        }
    }

    /// Whether all faces with their barycentre less than `half` away from `p` along each axis were loaded.
    pub fn holds_cube(&self, p: DVec3, half: f64) -> bool {
        self.region.covers(&self.cubes_around(p, half))
    }

    /// The lattice cubes that the cube of edge 2 `half` around `p` touches. Three corners that all lie beyond it, on the
    /// same side, have their mean there too; a hundredth more is far above the rounding of that mean.
    fn cubes_around(&self, p: DVec3, half: f64) -> CubeBox {
        let margin = DVec3::splat(1.01 * half);
        CubeBox { min: self.lattice.cube_of(p - margin), max: self.lattice.cube_of(p + margin) }
    }
}

/// What the owned vertices depend on in `pass`, or the gaps that were found on the way. In the [`Demand`], `voted` and
/// `traced` are where tensors are asked for, `thinned` where salience, `linked` where ridges.
pub fn paper_demand(
    tile: &Loaded,
    plan: &Plan,
    cell: &Cell,
    reach: &PaperReach,
    pass: Pass,
) -> (Demand, HashSet<Gap>) {
    let mesh = tile.mesh;
    let mut gaps = HashSet::new();
    if tile.region.is_everything() {
        return (Demand::everything(mesh.vertex_count(), &super::Reach::new(&plan.scale, 0)), gaps);
    }
    let n = mesh.vertex_count();
    let owned: Vec<u32> = (0..n as u32).into_par_iter().filter(|&v| cell.owns(mesh.position(v))).collect();
    let (linked, salient) = match pass {
        Pass::Omega => (Vec::new(), Vec::new()),
        Pass::Salience => (Vec::new(), owned.clone()),
        Pass::Links => {
            let linked = Rings::grow(tile, owned.clone(), reach.link_steps, &mut gaps).sorted(n);
            let thinning = Thinning {
                rings_from_owned: reach.link_steps,
                radius: reach.thin_radius,
                onward: reach.trace_steps,
            };
            let salient = balls(tile, cell, &linked, &thinning, &mut gaps);
            (linked, salient)
        }
    };
    let traced = match pass {
        Pass::Omega => owned.clone(),
        _ => Rings::grow(tile, salient.clone(), reach.trace_steps, &mut gaps).sorted(n),
    };
    for &v in &traced {
        tile.certified(v, 1, &mut gaps);
    }
    if let Some(half) = reach.half_cube {
        let found: Vec<HashSet<Gap>> = traced
            .par_chunks(4096)
            .map(|chunk| {
                let mut gaps = HashSet::new();
                chunk.iter().for_each(|&v| tile.ask_for_cube(mesh.position(v), half, &mut gaps));
                gaps
            })
            .collect();
        gaps.extend(found.into_iter().flatten());
    }
    let [owned, linked, salient, traced] = [owned, linked, salient, traced].map(Arc::new);
    let (smoothed, thinned, voted) =
        (Rings::set(linked.clone()), Rings::set(salient), Rings::set(traced.clone()));
    let folded = Rings::default();
    (Demand { owned, linked, traced, smoothed, thinned, folded, voted }, gaps)
}
