//! Step E, second part: what is too short or too faint to be a line is taken out of the graph.
//!
//! In: the line graph. Out: the same graph without short dangling branches at junctions, and without components that are
//! short or have too little of their length between strong vertices (hysteresis).

use super::fragments::Candidate;
use super::graph::Graph;
use crate::config::method;
use smallvec::{SmallVec, smallvec};
use std::collections::BTreeMap;

/// A dangling branch: from its tip to the junction it hangs on.
struct Branch {
    length: f64,
    nodes: SmallVec<[u32; 8]>,
}

/// Removes dangling branches shorter than `shortest` (mesh units). In rounds: each junction drops its shortest one (tie:
/// the lower tip), until there is none; what is left of a junction may be no junction any more. Tips on stops stay.
pub fn prune_branches(graph: &mut Graph, vertices: &[Candidate], shortest: f64) {
    let mut tips: Vec<u32> = (0..graph.nodes()).collect();
    loop {
        tips.retain(|&v| graph.degree(v) == 1 && !vertices[v as usize].stop);
        let mut drop: BTreeMap<u32, Branch> = BTreeMap::new();
        for branch in tips.iter().filter_map(|&tip| dangling(graph, tip, shortest)) {
            // Tips ascend, so at equal length the lower one is there first.
            let junction = branch.nodes[branch.nodes.len() - 1];
            if drop.get(&junction).is_none_or(|other| branch.length < other.length) {
                drop.insert(junction, branch);
            }
        }
        if drop.is_empty() {
            return;
        }
        // Taking a branch off can make its junction a tip.
        for (junction, branch) in drop {
            branch.nodes.windows(2).for_each(|e| graph.remove(e[0], e[1]));
            tips.push(junction);
        }
        tips.sort_unstable();
        tips.dedup();
    }
}

/// The branch from `tip` to a junction, if it is shorter than `shortest`.
fn dangling(graph: &Graph, tip: u32, shortest: f64) -> Option<Branch> {
    let &(next, length) = graph.neighbours(tip).first()?;
    let mut branch = Branch { length, nodes: smallvec![tip, next] };
    loop {
        let at = branch.nodes[branch.nodes.len() - 1];
        if branch.length >= shortest {
            return None;
        }
        match graph.degree(at) {
            2 => {
                let (onward, length) = graph.onward(branch.nodes[branch.nodes.len() - 2], at)?;
                branch.length += length;
                branch.nodes.push(onward);
            }
            1 => return None,
            _ => return Some(branch),
        }
    }
}

/// Removes components shorter than `shortest` (mesh units) or with too little strong length.
pub fn prune_components(graph: &mut Graph, vertices: &[Candidate], shortest: f64) {
    for component in components(graph) {
        let (mut total, mut strong) = (0.0, 0.0);
        for &a in &component {
            for &(b, length) in graph.neighbours(a).iter().filter(|(b, _)| *b > a) {
                total += length;
                if vertices[a as usize].strong && vertices[b as usize].strong {
                    strong += length;
                }
            }
        }
        if total < shortest || strong < method::STRONG_SHARE * total {
            component.into_iter().for_each(|a| graph.isolate(a));
        }
    }
}

/// Connected components with at least one edge, nodes ascending, ordered by their lowest node.
fn components(graph: &Graph) -> Vec<Vec<u32>> {
    let mut seen = vec![false; graph.nodes() as usize];
    let mut all = Vec::new();
    for start in 0..graph.nodes() {
        if seen[start as usize] || graph.degree(start) == 0 {
            continue;
        }
        seen[start as usize] = true;
        let mut component = vec![start];
        let mut next = 0;
        while next < component.len() {
            for &(b, _) in graph.neighbours(component[next]) {
                if !std::mem::replace(&mut seen[b as usize], true) {
                    component.push(b);
                }
            }
            next += 1;
        }
        component.sort_unstable();
        all.push(component);
    }
    all
}
