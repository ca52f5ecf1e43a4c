//! Scores computed by hand.

use super::*;

fn at(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, 0.0)
}

/// A straight line along x at height `y`, in steps of 1.
fn along(from: f64, to: f64, y: f64) -> Vec<DVec3> {
    let steps = (to - from).round() as usize;
    (0..=steps).map(|i| at(from + i as f64, y)).collect()
}

fn truth(polylines: &[Vec<DVec3>]) -> Truth {
    Truth::of_lines(Lines::of_polylines(polylines))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn the_truth_scores_full_marks() {
    let lines = vec![along(0.0, 20.0, 0.0), along(0.0, 20.0, 5.0)];
    let score = score(&Lines::of_polylines(&lines), &truth(&lines), 1.0);
    assert_eq!(score.at_1h, Match { precision: 1.0, recall: 1.0, f1: 1.0 });
    assert_eq!((score.false_components, score.long_false_lines, score.false_length), (0, 0, 0.0));
    assert_eq!(
        (score.length_ratio(), score.lines_per_curve, score.rms_distance),
        (Some(1.0), Some(1.0), Some(0.0))
    );
    assert_eq!((score.found_corners, score.corner_precision(), score.corner_recall()), (0, None, None));
}

#[test]
fn precision_and_recall_are_shares_of_length() {
    // Half of the true line is found; the found line goes on into nowhere for as long again.
    let found = Lines::of_polylines(&[along(10.0, 30.0, 0.0)]);
    let score = score(&found, &truth(&[along(0.0, 20.0, 0.0)]), 1.0);
    // Nearest samples are those at 19.9 and 10.1: 20.9 is the last at distance 1 of the found ones, 9.1 of the true
    // ones.
    assert!(close(score.at_1h.precision, 11.0 / 20.0), "{score:?}");
    assert!(close(score.at_1h.recall, 11.0 / 20.0), "{score:?}");
    assert!(close(score.at_2h.precision, 12.0 / 20.0), "{score:?}");
    assert!(close(score.at_2h.f1, 12.0 / 20.0), "{score:?}");
    assert!(close(score.false_length, 8.0));
    // Less than half of it is beyond 2 h.
    assert_eq!((score.false_components, score.long_false_lines), (0, 0));
}

#[test]
fn lengths_are_in_h() {
    let scaled = |h: f64| {
        let scale = |lines: &[Vec<DVec3>]| -> Vec<Vec<DVec3>> {
            lines.iter().map(|line| line.iter().map(|&p| p * h).collect()).collect()
        };
        let found = Lines::of_polylines(&scale(&[along(0.0, 8.0, 0.5), along(0.0, 9.0, 40.0)]));
        score(&found, &truth(&scale(&[along(0.0, 20.0, 0.0)])), h)
    };
    let (one, quarter) = (scaled(1.0), scaled(0.25));
    assert_eq!(one, quarter);
    assert!(close(one.true_length, 20.0) && close(one.found_length, 17.0));
    assert_eq!(one.rms_distance, Some(0.5));
}

#[test]
fn false_lines_are_counted_by_line_and_by_component() {
    let found = Lines::of_polylines(&[
        along(0.0, 20.0, 0.0),
        // Two lines far from the truth that hang together, one of them longer than 8 h.
        along(0.0, 9.0, 10.0),
        along(9.0, 13.0, 10.0),
        // One on its own.
        along(0.0, 3.0, 30.0),
        // A branch of the true line: false by itself, not as a component.
        vec![at(20.0, 0.0), at(20.0, 9.0)],
    ]);
    let score = score(&found, &truth(&[along(0.0, 20.0, 0.0)]), 1.0);
    assert_eq!((score.false_components, score.long_false_lines, score.found_lines), (2, 2, 5));
    assert_eq!(score.lines_per_curve, Some(1.0));
}

#[test]
fn broken_lines_are_counted_for_each_curve() {
    let found = Lines::of_polylines(&[
        along(0.0, 5.0, 0.0),
        along(6.0, 10.0, 0.0),
        along(12.0, 20.0, 0.0),
        along(0.0, 20.0, 7.0),
    ]);
    let score =
        score(&found, &truth(&[along(0.0, 20.0, 0.0), along(0.0, 20.0, 7.0), along(0.0, 20.0, 14.0)]), 1.0);
    // Three pieces of the first, one of the second; the third was not found and is a matter of recall.
    assert_eq!(score.lines_per_curve, Some(2.0));
}

#[test]
fn corners_are_junctions_and_marked_points() {
    let cross = vec![along(-5.0, 5.0, 0.0), (-5..=5).map(|i| at(0.0, f64::from(i))).collect()];
    let mut found = Lines::of_polylines(&cross);
    let exact = score(&found, &truth(&cross), 1.0);
    assert_eq!((exact.true_corners, exact.found_corners, exact.matched_corners), (1, 1, 1));
    // A second corner right beside the junction is one too many.
    found.marked[1] = true;
    let near = score(&found, &truth(&cross), 1.0);
    assert_eq!((near.corner_precision(), near.corner_recall()), (Some(0.5), Some(1.0)));
}

#[test]
fn the_distance_is_that_to_the_line_not_to_its_samples() {
    // Samples of the two lines do not stand opposite each other.
    let found = Lines::of_polylines(&[vec![at(0.05, 0.3), at(19.95, 0.3)]]);
    let score = score(&found, &truth(&[along(0.0, 20.0, 0.0)]), 1.0);
    assert!(close(score.rms_distance.unwrap(), 0.3));
}

#[test]
fn nothing_found_and_nothing_there() {
    let some = [along(0.0, 20.0, 0.0)];
    let neither = score(&Lines::default(), &Truth::default(), 1.0);
    assert_eq!((neither.at_1h.f1, neither.length_ratio(), neither.rms_distance), (1.0, None, None));
    let missed = score(&Lines::default(), &truth(&some), 1.0);
    assert_eq!((missed.at_1h.precision, missed.at_1h.recall, missed.at_1h.f1), (0.0, 0.0, 0.0));
    let invented = score(&Lines::of_polylines(&some), &Truth::default(), 1.0);
    assert_eq!((invented.at_1h.precision, invented.at_1h.recall, invented.at_1h.f1), (0.0, 1.0, 0.0));
    assert_eq!((invented.false_components, invented.long_false_lines), (1, 1));
}
