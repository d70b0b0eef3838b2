//! Tests of outlines of every kind: area, corners, and the time that intricate ones take.

use super::*;
use std::time::{Duration, Instant};

/// Splits an outline in the plane z = 0, and checks that every edge between two triangles
/// is run along both ways. Returns the triangles.
fn split(outline: &[[f64; 2]]) -> (Vec<[u32; 3]>, Triangulator) {
    let points: Vec<DVec3> = outline
        .iter()
        .map(|p| DVec3::new(p[0], p[1], 0.0))
        .collect();
    let (mut triangles, mut made) = (Vec::new(), Triangulator::new());
    made.split(&points, |t| triangles.push(t));
    assert_eq!(triangles.len(), outline.len() - 2);
    let mut edges = std::collections::HashMap::new();
    for [a, b, c] in &triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_insert(0) +=
                if from < to { 1 } else { -1 };
        }
    }
    let count = outline.len() as u32;
    for ((from, to), sum) in edges {
        let is_outline = from + 1 == *to || *from == 0 && *to == count - 1;
        assert!(is_outline || sum == 0, "{from} {to}: {sum}");
    }
    (triangles, made)
}

/// The sum of the triangles' areas, none of which may be negative, against the shoelace
/// formula.
fn assert_covers(outline: &[[f64; 2]]) {
    let area = |[a, b, c]: [[f64; 2]; 3]| {
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
    };
    for turned in [false, true] {
        let mut outline = outline.to_vec();
        if turned {
            outline.reverse();
        }
        for first in 0..outline.len().min(64) {
            outline.rotate_left(first);
            let (triangles, made) = split(&outline);
            let areas: Vec<f64> = triangles
                .iter()
                .map(|t| area(t.map(|i| outline[i as usize])))
                .collect();
            let last = outline.len() - 1;
            let whole: f64 = (1..last)
                .map(|i| area([outline[0], outline[i], outline[i + 1]]))
                .sum();
            assert!(areas.iter().all(|a| a * whole >= 0.0), "{areas:?}");
            let sum: f64 = areas.iter().sum();
            assert!((sum / whole - 1.0).abs() < 1e-12, "{sum} {whole}");
            assert_eq!((made.crossing, made.fans), (0, 0), "{outline:?}");
        }
    }
}

#[test]
fn convex_polygons_stay_fans() {
    let (square, _) = split(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(square, [[0, 1, 2], [0, 2, 3]]);
    // A corner between collinear edges, and edges without length.
    let (flat, _) = split(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0], [1.0, 1.0]]);
    assert_eq!(flat, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    // No area at all.
    let (line, made) = split(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
    assert_eq!((line.len(), made.crossing), (2, 0));
}

#[test]
fn notches_stay_open() {
    assert_covers(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]]);
    let l = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    assert_covers(&l);
    // Corners between collinear edges, which no triangle may drop.
    let mut fine = Vec::new();
    for (i, [x, y]) in l.iter().enumerate() {
        let [p, q] = l[(i + 1) % l.len()];
        fine.extend([[*x, *y], [(x + p) / 2.0, (y + q) / 2.0]]);
    }
    assert_covers(&fine);
    let comb: Vec<[f64; 2]> = (0..41)
        .map(|i| [f64::from(i), if i % 2 == 0 { 9.0 } else { 0.1 }])
        .chain([[40.0, -1.0], [0.0, -1.0]])
        .collect();
    assert_covers(&comb);
}

#[test]
fn a_hole_that_a_bridge_joins_stays_open() {
    let ring = [
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 3.0],
        [0.0, 3.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [2.0, 2.0],
        [2.0, 1.0],
        [1.0, 1.0],
    ];
    assert_covers(&ring);
}

#[test]
fn turns_are_exact() {
    // A corner one step of f64 inside the edge, far from the origin.
    let far = 1e9;
    let step = far * f64::EPSILON;
    assert_covers(&[
        [far, 0.0],
        [far + 2.0, 0.0],
        [far + 2.0, 1.0],
        [far + 1.0, 1.0 - step],
        [far, 1.0],
    ]);
    assert_eq!(
        turn([[0.0, 0.0], [1e-200, 1e-200], [2e-200, 2e-200]]),
        Ordering::Equal
    );
    assert_eq!(
        turn([[0.0, 0.0], [1e300, 0.0], [0.0, 1e300]]),
        Ordering::Greater
    );
}

#[test]
fn crossing_outlines_end_and_are_told() {
    let (_, made) = split(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.5]]);
    assert_eq!(made.crossing, 1);
    let mut random = 1_u64;
    for count in 4..60 {
        let outline: Vec<[f64; 2]> = (0..count)
            .map(|_| {
                [0, 1].map(|_| {
                    random = random
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    (random >> 60) as f64
                })
            })
            .collect();
        split(&outline);
    }
    // Numbers that are none.
    let mut none = Triangulator::new();
    let mut count = 0;
    none.split(&[DVec3::NAN; 7], |_| count += 1);
    assert_eq!(count, 5);
}

#[test]
fn intricate_outlines_end_soon() {
    let start = Instant::now();
    let spiral: Vec<[f64; 2]> = (0..200_000)
        .map(|i| {
            let i = f64::from(if i < 100_000 { i } else { 200_000 - i });
            let out = i + if i > 0.0 { 0.3 } else { 0.0 };
            [libm::cos(i * 0.01) * out, libm::sin(i * 0.01) * out]
        })
        .collect();
    let points: Vec<DVec3> = spiral.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect();
    let mut made = Triangulator::new();
    let mut count = 0;
    made.split(&points, |_| count += 1);
    assert_eq!(count, spiral.len() - 2);
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
    );
}
