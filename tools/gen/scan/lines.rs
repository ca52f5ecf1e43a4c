//! The true lines of a block. In: its surfaces without noise; out: polylines along the creases, broken at corners.

use super::block::Surface;
use super::chart::{Chart, KERB_FOOT, KERB_TOP};
use super::storey::Storey;
use glam::DVec3;

/// Adds both rings of the kerb, and the mitres between them at its corners.
pub fn kerb(chart: &Chart, land: &Surface, lines: &mut Vec<Vec<DVec3>>) {
    let corners = |ring: u32| {
        let far = chart.side - ring;
        [[ring, ring], [far, ring], [far, far], [ring, far]]
    };
    for ring in [KERB_FOOT, KERB_TOP] {
        let corners = corners(ring);
        lines.extend((0..4).map(|k| land.position.along([corners[k], corners[(k + 1) % 4]])));
    }
    lines.extend((0..4).map(|k| land.position.along([corners(KERB_FOOT)[k], corners(KERB_TOP)[k]])));
}

/// Adds foot, eave, posts and the creases of the roof. `raised` are the vertices of each column from foot to top.
pub fn storey(
    storey: &Storey,
    roof: &Surface,
    raised: &[Vec<u32>],
    positions: &[DVec3],
    lines: &mut Vec<Vec<DVec3>>,
) {
    let [w, d] = storey.size;
    let corners = [0, w, w + d, w + d + w, storey.perimeter()].map(|k| k as usize);
    for side in corners.windows(2) {
        let columns = || (side[0]..=side[1]).map(|k| &raised[k % raised.len()]);
        lines.push(columns().map(|column| positions[column[0] as usize]).collect());
        lines
            .push(columns().filter_map(|column| column.last()).map(|&top| positions[top as usize]).collect());
        lines.push(raised[side[0]].iter().map(|&vertex| positions[vertex as usize]).collect());
    }
    lines.extend(storey.creases().into_iter().map(|crease| roof.position.along(crease)));
}
