//! Agreement with the executable specification in `tools/reference`, whose results are kept in `fixtures/golden`.

mod support;

use crease::glam::DVec3;
use crease::refine::Bend;
use crease::stitch::Class;
use crease::{Detection, Params};
use std::collections::BTreeSet;
use support::{Fields, fixture, in_core, open, read_vertices, run};

/// Per vertex values agree this well; the two use different eigensolvers and summation orders.
const TOLERANCE: f64 = 1e-9;

fn detect(name: &str) -> (Detection, Fields) {
    run(&open(&fixture(&format!("golden/{name}.ply"))), Params::default(), in_core())
}

fn compare(name: &str) {
    let (found, fields) = detect(name);
    let golden = read_vertices(&fixture(&format!("golden/{name}.attributes.ply")));
    assert_eq!(fields.0.len(), golden["x"].len());
    let mut saliency_off = Vec::new();
    for (&i, f) in &fields.0 {
        let i = i as usize;
        let [l1, l2, l3] = f.eigenvalues;
        for (name, ours) in [("l1", l1), ("l2", l2), ("l3", l3), ("omega", f.omega)] {
            let theirs = golden[name][i];
            assert!((ours - theirs).abs() <= TOLERANCE, "vertex {i}: {name} is {ours}, golden {theirs}");
        }
        assert_eq!(f64::from(f.class as u8), golden["class"][i], "vertex {i}: class");
        let saliency = f.salience / found.lines.largest_salience;
        if (saliency - golden["saliency"][i]).abs() > TOLERANCE {
            saliency_off.push((i, saliency, golden["saliency"][i]));
        }
    }
    // The fold angle contains the root of l2. Where l2 is rounding (1e-17), its root is 1e-8 of either solver's making.
    assert!(
        saliency_off.iter().all(|(_, a, b)| (a - b).abs() < 1e-7)
            && saliency_off.len() * 100 <= fields.0.len(),
        "{saliency_off:?}"
    );
    assert_eq!(edges(&found), golden_edges(name), "the lines run along other edges");
    assert_eq!(found.lines.lines.len(), golden_chains(name).len());
    compare_fits(name, &found);
}

/// Dihedral angles and fitted points of all line vertices. The planes are least squares of least squares, and the golden
/// numbers are rounded: points agree to a millionth of an edge, angles to a thousandth of a degree.
fn compare_fits(name: &str, found: &Detection) {
    let chains: Vec<Vec<u64>> = golden(name, "chains");
    let points: Vec<Vec<[f64; 3]>> = golden(name, "fitted");
    let angles: Vec<Vec<f64>> = golden(name, "angles");
    let mut compared = 0;
    for (chain, (points, angles)) in chains.iter().zip(points.iter().zip(&angles)) {
        for (&id, (&point, &angle)) in chain.iter().zip(points.iter().zip(angles)) {
            let place = found.lines.vertices.binary_search_by_key(&id, |v| v.id.0).expect("a line vertex");
            let ours = &found.lines.vertices[place];
            let signed = if ours.bend == Bend::Concave { -ours.angle } else { ours.angle };
            assert!((signed.to_degrees() - angle).abs() < 1e-3, "{id}: {signed} rad, golden {angle} deg");
            let apart = (ours.fitted - DVec3::from(point)).length();
            assert!(apart < 1e-6, "{id}: {} is {apart} from the golden {point:?}", ours.fitted);
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared} vertices are hardly a comparison");
}

#[test]
fn bracket() {
    compare("bracket");
}

#[test]
fn fold10() {
    compare("fold10");
}

#[test]
fn cone() {
    compare("cone");
}

/// Mesh edges under the crease lines.
fn edges(found: &Detection) -> BTreeSet<(u64, u64)> {
    let id = |v: u32| found.lines.vertices[v as usize].id.0;
    let creases = found.lines.lines.iter().filter(|l| matches!(l.class, Class::Weak | Class::Sharp));
    creases
        .flat_map(|l| l.vertices.windows(2).map(|e| (id(e[0]), id(e[1]))).map(|(a, b)| (a.min(b), a.max(b))))
        .collect()
}

fn golden_chains(name: &str) -> Vec<Vec<u64>> {
    golden(name, "chains")
}

/// One of the lists in the golden lines.
fn golden<T: serde::de::DeserializeOwned>(name: &str, list: &str) -> T {
    let text = std::fs::read_to_string(fixture(&format!("golden/{name}.lines.json"))).expect("golden lines");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    serde_json::from_value(json[list].clone()).unwrap_or_else(|e| panic!("{list} of {name}: {e}"))
}

fn golden_edges(name: &str) -> BTreeSet<(u64, u64)> {
    let chains = golden_chains(name);
    chains.iter().flat_map(|c| c.windows(2).map(|e| (e[0].min(e[1]), e[0].max(e[1])))).collect()
}
