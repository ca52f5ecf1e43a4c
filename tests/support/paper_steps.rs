//! The steps of the paper method on one tile through the public interfaces of the library, as the pipeline takes them, for
//! tests that look between the steps or ask for a halo the pipeline would never ask for.

use crease::config::PaperThresholds;
use crease::input::MeshSource;
use crease::mesh::{Field, TileMesh};
use crease::partition::{
    Cell, Demand, Gap, Loaded, MOST_FACES, Numbering, PaperReach, Pass, Plan, Region, half_cube, load, merge,
    paper_demand,
};
use crease::refine::{Extremes, Link, Linker, OmegaRange, Salience, Supporters, ridges, smooth};
use crease::voting::{FaceGeometry, Stop, Vote, Voters, paper_stops, paper_votes};
use crease::{Method, Params};

/// A tile with all that its vertices depend on in one pass, as far as `reach` knows.
pub struct PaperTile {
    pub mesh: TileMesh,
    pub region: Region,
    pub demand: Demand,
    pub faces: FaceGeometry,
}

impl PaperTile {
    /// Loads `cell`, and more until nothing is missing; by the missing cubes alone, so that what was not asked for is not
    /// there by chance.
    pub fn load(
        source: &dyn MeshSource,
        plan: &Plan,
        reach: &PaperReach,
        pass: Pass,
        cell: &Cell,
    ) -> PaperTile {
        let mut region = plan.first_region(cell, 0);
        loop {
            let mesh = load(source, plan, &region, MOST_FACES, Numbering::AsTheyCome)
                .unwrap_or_else(|e| panic!("{e}"));
            let loaded = Loaded { mesh: &mesh, region: &region, lattice: &plan.lattice };
            let (demand, gaps) = paper_demand(&loaded, plan, cell, reach, pass);
            if gaps.is_empty() {
                let faces = FaceGeometry::new(&mesh, &plan.scale);
                return PaperTile { mesh, region, demand, faces };
            }
            let bare: Vec<Gap> = merge(gaps).into_iter().map(|gap| Gap { margin: 0, ..gap }).collect();
            region.grow(&bare, 1);
        }
    }

    /// The tile as the voters see it.
    pub fn loaded<'a>(&'a self, plan: &'a Plan) -> Loaded<'a> {
        Loaded { mesh: &self.mesh, region: &self.region, lattice: &plan.lattice }
    }

    /// The first stage.
    pub fn votes(&self, plan: &Plan, params: &Params) -> Field<Vote> {
        let loaded = self.loaded(plan);
        let voters = Voters::new(&loaded, half_cube(params.sigma, &plan.scale));
        paper_votes(&voters, &self.faces, &plan.scale, self.demand.voted.all())
    }
}

/// The thresholds in `params`, which must be those of the paper method.
fn thresholds(params: &Params) -> &PaperThresholds {
    match &params.method {
        Method::Paper(thresholds) => thresholds,
        Method::Robust => panic!("the paper method is tested here"),
    }
}

/// What each step found, as far as the pass asks for it.
pub struct PaperSteps {
    pub votes: Field<Vote>,
    pub stops: Field<Stop>,
    pub salience: Field<Salience>,
    pub ridge: Field<bool>,
    /// Paths from the ridge vertices that the tile owns; none unless it was loaded for links.
    pub links: Vec<Link>,
}

impl PaperSteps {
    /// The steps at all vertices that the demand of the pass names.
    pub fn compute(tile: &PaperTile, plan: &Plan, params: &Params, extremes: &Extremes) -> PaperSteps {
        let PaperTile { mesh, demand, .. } = tile;
        let (votes, at) = (tile.votes(plan, params), demand.thinned.all());
        let thresholds = thresholds(params);
        let stops = paper_stops(mesh, &votes, thresholds, &demand.traced);
        let (range, scale) = (extremes.omega, &plan.scale);
        let supporters = Supporters { mesh, votes: &votes, stops: &stops, thresholds, range, scale };
        let salience = supporters.salience(at);
        let support = supporters.support(&salience, extremes.salience, at);
        let r = Field::compute(mesh.vertex_count(), at, |v| salience.get(v).plain);
        let rounds = vec![0; mesh.vertex_count()];
        let ridge = ridges(mesh, scale, &votes, &r, &support, &stops, &rounds, &demand.linked);
        let positions = smooth(mesh, scale, &rounds, &demand.smoothed);
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
        if !demand.linked.is_empty() {
            demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
        }
        PaperSteps { votes, stops, salience, ridge, links }
    }
}

/// The extremes of a mesh that was loaded as one tile.
pub fn extremes(whole: &PaperTile, plan: &Plan, params: &Params) -> Extremes {
    let owned = &whole.demand.owned;
    let omega = OmegaRange::over(&whole.votes(plan, params), thresholds(params), owned);
    let steps = PaperSteps::compute(whole, plan, params, &Extremes { omega, salience: 1.0 });
    Extremes { omega, salience: steps.salience.max_over(owned, |s| s.enhanced) }
}
