//! Patterns have the colours of their formulas, and means are those of many points.

use super::*;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, f64x4, f64x8};

const BLACK: Rgb = [0.0; 3];
const WHITE: Rgb = [1.0; 3];

fn spot(point: [f64; 3], normal: [f32; 3]) -> Spot {
    Spot {
        point,
        normal,
        scale: 1.0,
    }
}

fn checker() -> Pattern {
    Pattern::Checker {
        colors: [BLACK, WHITE],
        size: [0.5, 1.0, 2.0],
    }
}

#[test]
fn a_checkers_cells_count_from_the_origin() {
    for (point, expected) in [
        ([0.1, 0.1, 0.1], BLACK),
        ([0.6, 0.1, 0.1], WHITE),
        ([0.6, 1.1, 0.1], BLACK),
        ([0.6, 1.1, 2.1], WHITE),
        ([-0.1, 0.1, 0.1], WHITE),
        ([-0.1, -0.1, -0.1], WHITE),
        ([-0.6, -0.1, 0.1], WHITE),
        ([-0.6, -0.1, -0.1], BLACK),
    ] {
        let seen = color(&checker(), &spot(point, [0.0, 0.0, 1.0]), 0.0);
        assert_eq!(seen, expected, "{point:?}");
    }
}

/// Returns the mean of points over the box that a footprint on a face across z stands for.
fn mean_of_points(pattern: &Pattern, [x, y, z]: [f64; 3], width: f64) -> Rgb {
    const SIDE: u32 = 200;
    let mut sum = [0.0; 3];
    for i in 0..SIDE * SIDE {
        let off = |i: u32| ((f64::from(i) + 0.5) / f64::from(SIDE) - 0.5) * width;
        let at = [x + off(i % SIDE), y + off(i / SIDE), z];
        let seen = color(pattern, &spot(at, [0.0, 0.0, 1.0]), 0.0);
        sum = std::array::from_fn(|k| sum[k] + f64::from(seen[k]));
    }
    sum.map(|x| (x / f64::from(SIDE * SIDE)) as f32)
}

#[test]
fn means_over_footprints_are_those_of_points() {
    let gradient = |wrap| Pattern::Gradient {
        colors: vec![BLACK, [0.2, 1.0, 0.4], WHITE],
        from: [0.0; 3],
        to: [0.3, 0.4, 0.0],
        wrap,
    };
    let brick = Pattern::Brick {
        colors: [WHITE, BLACK],
        size: [1.0, 0.4, 0.5],
        joint: 0.1,
    };
    let patterns = [
        checker(),
        gradient(Wrap::Clamp),
        gradient(Wrap::Repeat),
        gradient(Wrap::Mirror),
        brick,
    ];
    for pattern in &patterns {
        // A gradient is filtered along its own direction, of which a square covers less or more.
        let is_slant = matches!(pattern, Pattern::Gradient { .. });
        for (i, width) in [0.05, 0.3, 0.9, 2.5].into_iter().enumerate() {
            let at = [0.31 + i as f64, -0.47, 0.2];
            let seen = color(pattern, &spot(at, [0.0, 0.0, 1.0]), width as f32);
            let expected = mean_of_points(pattern, at, width);
            let most = if is_slant { 0.12 } else { 0.011 };
            for k in 0..3 {
                let off = (seen[k] - expected[k]).abs();
                assert!(off < most, "{pattern:?} {width}: {seen:?} {expected:?}");
            }
        }
        // Of whole periods nothing is left but the mean.
        let far = color(pattern, &spot([0.3, 0.2, 0.1], [0.0, 0.0, 1.0]), 1e6);
        let is_endless = !matches!(
            pattern,
            Pattern::Gradient {
                wrap: Wrap::Clamp,
                ..
            }
        );
        for (seen, mean) in far.iter().zip(pattern.mean()) {
            assert!(
                !is_endless || (seen - mean).abs() < 1e-4,
                "{pattern:?} {far:?}"
            );
        }
    }
}

#[test]
fn a_gradients_mean_along_its_way_is_its_integral() {
    for (wrap, places) in [
        (Wrap::Clamp, [-0.2, 0.45, 1.1]),
        (Wrap::Repeat, [-0.95, 0.45, 3.9]),
        (Wrap::Mirror, [-1.1, 0.9, 3.3]),
    ] {
        let pattern = Pattern::Gradient {
            colors: vec![BLACK, [0.2, 1.0, 0.4], WHITE],
            from: [1.0, 0.0, 0.0],
            to: [3.0, 0.0, 0.0],
            wrap,
        };
        for (place, width) in places.into_iter().zip([0.2, 0.7, 3.3]) {
            let x = 1.0 + 2.0 * place;
            let seen = color(
                &pattern,
                &spot([x, 0.0, 0.0], [0.0, 0.0, 1.0]),
                width as f32,
            );
            let expected = mean_of_points(&pattern, [x, 0.0, 0.0], width);
            for k in 0..3 {
                let off = (seen[k] - expected[k]).abs();
                assert!(off < 5e-3, "{wrap:?} {place}: {seen:?} {expected:?}");
            }
        }
    }
}

#[test]
fn bricks_lie_in_shifted_courses_and_faces_show_no_joint_they_lie_in() {
    let brick = Pattern::Brick {
        colors: [WHITE, BLACK],
        size: [1.0, 0.4, 0.5],
        joint: 0.1,
    };
    let front = [0.0, 0.0, 1.0];
    for (point, normal, expected) in [
        // The first course from y = 0, its first brick from x = 0: joints are half on each side.
        ([0.5, 0.2, 0.0], front, WHITE),
        ([0.04, 0.2, 0.0], front, BLACK),
        ([0.06, 0.2, 0.0], front, WHITE),
        ([0.5, 0.04, 0.0], front, BLACK),
        ([0.5, 0.36, 0.0], front, BLACK),
        // The second is shifted by half a brick.
        ([0.5, 0.6, 0.0], front, BLACK),
        ([0.0, 0.6, 0.0], front, WHITE),
        // In the middle of a joint of another axis.
        ([0.0, 0.2, 0.25], [1.0, 0.0, 0.0], WHITE),
        ([0.0, 0.2, 0.0], [1.0, 0.0, 0.0], BLACK),
        ([0.5, 0.01, 0.25], [0.0, 1.0, 0.0], WHITE),
        ([0.5, 0.41, 0.0], [0.0, -1.0, 0.0], BLACK),
    ] {
        let seen = color(&brick, &spot(point, normal), 0.0);
        assert_eq!(seen, expected, "{point:?} {normal:?}");
    }
}

#[test]
fn noise_is_0_on_its_lattice_and_the_same_at_every_width() {
    let of = |p: [f64; 3]| noise::<f64>(Vec3::splat(p), 7);
    for i in -3..3 {
        assert_eq!(of([f64::from(i), f64::from(2 * i), f64::from(-i)]), 0.0);
    }
    let point = |i: usize| {
        let x = i as f64 * 0.37;
        [x - 100.0, 3.1 - 2.0 * x, 0.2 * x]
    };
    for first in (0..4000).step_by(8) {
        let wide = noise(Vec3::<f64x8>::of_lanes(|i| point(first + i)), 7);
        let half = noise(Vec3::<f64x4>::of_lanes(|i| point(first + i)), 7);
        for i in 0..8 {
            let one = of(point(first + i)).to_bits();
            assert_eq!(one, wide.lane(i).to_bits());
            assert!(i >= 4 || one == half.lane(i).to_bits());
        }
    }
}

#[test]
fn noise_is_smooth_centred_and_fills_its_range() {
    let (mut sum, mut squares, mut most, mut beyond) = (0.0, 0.0, 0.0_f64, 0);
    let count = 200_000;
    for i in 0..count {
        // A lattice of its own, of golden ratios.
        let p = [0.618_034, 0.754_878, 0.569_840].map(|g| f64::from(i) * g * 0.731);
        let n = noise::<f64>(Vec3::splat(p), 3);
        let ahead = noise::<f64>(Vec3::splat([p[0] + 1e-4, p[1], p[2]]), 3);
        assert!((ahead - n).abs() < 1e-3, "{p:?}");
        (sum, squares, most) = (sum + n, squares + n * n, most.max(n.abs()));
        beyond += u32::from(n.abs() > 0.5);
    }
    let count = f64::from(count);
    let deviation = (squares / count).sqrt();
    assert!((sum / count).abs() < 5e-3, "{}", sum / count);
    assert!((0.12..0.25).contains(&deviation), "{deviation}");
    assert!(
        most > 0.4 && f64::from(beyond) < 0.01 * count,
        "{most} {beyond}"
    );
}

#[test]
fn noise_fades_to_its_mean() {
    let pattern = Pattern::Noise {
        colors: vec![BLACK, WHITE, [1.0, 0.0, 0.0]],
        size: [0.5; 3],
        octaves: 4,
        seed: 1,
    };
    let (mut unlike_mean, mut unlike_fine) = (0, 0);
    for i in 0..50 {
        let [x, y] = [0.37, 0.23].map(|step| step * f64::from(i));
        let at = spot([x, y, 0.2], [0.0, 0.0, 1.0]);
        let of = |width: f32| color(&pattern, &at, width);
        assert_eq!(of(0.5), pattern.mean());
        assert_eq!(of(f32::INFINITY), pattern.mean());
        // The finest octave is 1/16 wide: it is whole up to half of that.
        assert_eq!(of(0.03), of(0.0));
        unlike_mean += u32::from(of(0.3) != pattern.mean());
        unlike_fine += u32::from(of(0.05) != of(0.0));
    }
    assert!(
        unlike_mean > 40 && unlike_fine > 30,
        "{unlike_mean} {unlike_fine}"
    );
}
