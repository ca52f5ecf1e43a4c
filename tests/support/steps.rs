//! The steps of one tile through the public interfaces of the library, as the pipeline takes them: for tests that look
//! between the steps, or that ask for a halo the pipeline would never ask for.

use crease::config::NO_LIMIT;
use crease::glam::DVec3;
use crease::input::MeshSource;
use crease::math::Sym3;
use crease::mesh::{Field, TileMesh};
use crease::partition::{
    Cell, Demand, Gap, Loaded, MOST_FACES, Numbering, Plan, Reach, load, merge, noise_demand, round_demand,
    scan, vertex_demand,
};
use crease::refine::{
    Evidence, Fit, Fitter, Link, Linker, Support, average_along, contrast, ridges, smooth, traceable,
};
use crease::voting::{
    FaceGeometry, Noise, Noisy, Stop, Surroundings, Token, Vote, first_votes, refine, rounds, stops,
    surroundings, vote_again, votes, widen,
};
use crease::{Params, Tiling};

/// Scans and plans.
pub fn plan(source: &dyn MeshSource, params: &Params, tiling: Tiling) -> Plan {
    let mut found = scan(source, NO_LIMIT, &|_| ()).unwrap_or_else(|e| panic!("{e}"));
    let mut plan = Plan::new(&found, params).unwrap_or_else(|e| panic!("{e}"));
    if let Tiling::Faces(target) = tiling {
        plan.cut(&mut found, &|_, cell| cell.faces <= target);
    }
    plan
}

/// A tile with all that its vertices depend on, as far as `reach` knows.
pub struct Tile {
    pub mesh: TileMesh,
    pub demand: Demand,
    pub faces: FaceGeometry,
    /// s0 of each face, where it is known.
    pub noise: Vec<Option<f64>>,
    /// K of each face, where it is known.
    pub face_rounds: Vec<Option<u32>>,
    /// Refinement rounds to do for each face.
    pub needed: Vec<u32>,
    /// K of each vertex where it is known; 0 elsewhere.
    pub vertex_rounds: Vec<u32>,
}

impl Tile {
    /// What is refined.
    fn noisy(&self) -> Noisy {
        let normals = self.faces.normals.clone();
        Noisy { normals, s0: self.noise.clone(), needed: self.needed.clone() }
    }

    /// Loads `cell`, and more until nothing is missing. The first region is as small as can be and grows by the cubes that
    /// are missing alone, without their margins: what is loaded beyond the cell is what was asked for and no more, so that
    /// whatever was not asked for is not there by chance. `change` may spoil the reach.
    pub fn load(source: &dyn MeshSource, plan: &Plan, change: &dyn Fn(&mut Reach), cell: &Cell) -> Tile {
        let mut region = plan.first_region(cell, 0);
        loop {
            let mesh = load(source, plan, &region, MOST_FACES, Numbering::AsTheyCome)
                .unwrap_or_else(|e| panic!("{e}"));
            let loaded = Loaded { mesh: &mesh, region: &region, lattice: &plan.lattice };
            let faces = FaceGeometry::new(&mesh, &plan.scale);
            let noise = Noise::new(&mesh, &faces, &plan.lattice, &region);
            let positions: Vec<DVec3> = (0..mesh.vertex_count() as u32).map(|v| mesh.position(v)).collect();
            let at_vertices = noise.levels_at(&positions);
            let vertex_rounds: Vec<Option<u32>> =
                at_vertices.into_iter().map(|s0| s0.map(|s0| rounds(&plan.scale, s0))).collect();
            let most = vertex_rounds.iter().flatten().copied().max().unwrap_or(0);
            let mut reach = Reach::new(&plan.scale, most);
            change(&mut reach);
            let (demand, mut gaps) = vertex_demand(&loaded, cell, &reach);
            let barycentres: Vec<DVec3> = (0..mesh.face_count() as u32).map(|f| mesh.barycentre(f)).collect();
            let levels = noise.levels_at(&barycentres);
            let face_rounds: Vec<Option<u32>> =
                levels.iter().map(|s0| s0.map(|s0| rounds(&plan.scale, s0))).collect();
            let (needed, more) = round_demand(&loaded, plan, &demand.voted, &face_rounds, &reach);
            gaps.extend(more);
            gaps.extend(noise_demand(&loaded, &demand, |v| vertex_rounds[v as usize].is_some()));
            if gaps.is_empty() {
                let vertex_rounds = vertex_rounds.into_iter().map(|k| k.unwrap_or(0)).collect();
                return Tile { demand, faces, noise: levels, face_rounds, needed, vertex_rounds, mesh };
            }
            let bare: Vec<Gap> = merge(gaps).into_iter().map(|gap| Gap { margin: 0, ..gap }).collect();
            region.grow(&bare, 1);
        }
    }
}

/// What each step found.
pub struct Steps {
    /// Refined normals.
    pub normals: Vec<DVec3>,
    /// T0 and the sum of weighted normals.
    pub tokens: Field<Token>,
    /// T after the repeated votes.
    pub again: Field<Sym3>,
    /// Votes at two scales.
    pub narrow: Field<Vote>,
    pub surroundings: Field<Surroundings>,
    /// Votes at all scales.
    pub votes: Field<Vote>,
    pub positions: Field<DVec3>,
    pub traced: Vec<u32>,
    pub contrast: Field<f64>,
    pub stops: Field<Stop>,
    pub support: Field<Support>,
    pub r: Field<f64>,
    pub ridge: Field<bool>,
    /// Paths from the ridge vertices that the tile owns.
    pub links: Vec<Link>,
    /// Where all refined normals around a vertex are known.
    pub known: Field<bool>,
    /// Wherever a line vertex may be.
    pub fits: Field<Fit>,
}

impl Steps {
    /// Steps A to D, and F as far as it is local.
    pub fn compute(tile: &Tile, plan: &Plan) -> Steps {
        let Tile { mesh, demand, vertex_rounds, .. } = tile;
        let scale = &plan.scale;
        let normals = refine(mesh, &tile.faces, &plan.scale, tile.noisy());
        let tokens = first_votes(mesh, &tile.faces, &normals, scale, &demand.voted);
        let again = vote_again(mesh, &tokens, scale, &demand.voted);
        let mut votes = votes(mesh, &tokens, &again, &demand.voted);
        let surroundings =
            surroundings(mesh, plan, &votes, &demand.voted, vertex_rounds, demand.folded.all());
        let narrow = votes.clone();
        widen(mesh, &mut votes, again.clone(), &surroundings, &demand.folded);
        let positions = smooth(mesh, scale, vertex_rounds, &demand.smoothed);
        let traced = traceable(&votes, &surroundings, &demand.traced);
        let contrast = contrast(mesh, scale, &votes, vertex_rounds, &traced);
        let stops = stops(mesh, &votes, &demand.traced);
        let evidence = Evidence {
            mesh,
            votes: &votes,
            positions: &positions,
            contrast: &contrast,
            surroundings: &surroundings,
            stops: &stops,
            traced: &demand.traced,
        };
        let support = evidence.support(&demand.linked);
        let r = average_along(mesh, &votes, &surroundings, vertex_rounds, &demand.thinned);
        let ridge = ridges(mesh, scale, &votes, &r, &support, &stops, vertex_rounds, &demand.linked);
        let linker = Linker {
            mesh,
            positions: &positions,
            votes: &votes,
            r: &r,
            support: &support,
            stops: &stops,
            ridge: &ridge,
        };
        let mut links = Vec::new();
        demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
        let (faces, rounds) = (&tile.faces, &tile.vertex_rounds);
        let known = Field::compute(mesh.vertex_count(), demand.voted.within(0), |_| true);
        let fitter = Fitter {
            mesh,
            faces,
            normals: &normals,
            scale,
            known: &known,
            votes: &votes,
            stops: &stops,
            rounds,
        };
        let found = fitter.fits(&demand.linked);
        let fits = Field::compute(mesh.vertex_count(), &demand.linked, |v| {
            found[demand.linked.partition_point(|&other| other < v)]
        });
        Steps {
            normals,
            tokens,
            again,
            narrow,
            surroundings,
            votes,
            positions,
            traced,
            contrast,
            stops,
            support,
            r,
            ridge,
            links,
            fits,
            known,
        }
    }
}
