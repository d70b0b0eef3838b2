//! Tests of pixel filters: densities, means, and the weights of signed ones.

use super::*;
use crate::chi2::{Random, check};
use lanecast_numerics::math::lanes::{f32x4, f32x8, f32x16};

const KINDS: [Kind; 4] = [
    Kind::Box,
    Kind::Gaussian,
    Kind::Mitchell,
    Kind::BlackmanHarris,
];

/// Integrates over the profile by the midpoint rule.
fn integral(kind: Kind, f: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 1_000_000;
    let step = 2.0 * kind.radius() / f64::from(n);
    let x = |i: i32| (f64::from(i) + 0.5) * step - kind.radius();
    (0..n).map(|i| f(x(i), kind.profile(x(i)))).sum::<f64>() * step
}

#[test]
fn samples_have_the_density_of_the_filter() {
    for kind in KINDS {
        let filter = Filter::new(kind);
        let side = 2.0 * kind.radius();
        let outer = integral(kind, |_, f| (-f).max(0.0));
        let inner = integral(kind, |_, f| f.max(0.0));
        let of = |at: f64| kind.profile((at - 0.5) * side) * side;
        // Early, late and negative samples, and the integral of the parts that they sample.
        for (number, sign, total) in [
            (3, 1.0, inner * inner + outer * outer),
            (28, 1.0, inner * inner + outer * outer),
            (15, -1.0, 2.0 * inner * outer),
        ] {
            if sign < 0.0 && !kind.is_signed() {
                continue;
            }
            let sample = |u| {
                let (at, weight) = filter.sample(u, &[number]);
                assert_eq!(weight < 0.0, sign < 0.0);
                Some(at.map(|x| f64::from(x) / side + 0.5))
            };
            let density = |[x, y]: [f64; 2]| f64::max(sign * of(x) * of(y), 0.0) / total;
            check(
                &format!("{kind:?} {number}"),
                [40, 31],
                1_000_000,
                4,
                sample,
                density,
            );
        }
    }
}

/// Of all numbers of a period, with midpoints of a grid of the square, fine along x.
#[test]
fn means_are_those_of_the_filter() {
    for kind in KINDS {
        let filter = Filter::new(kind);
        let (across, down) = (1 << 15, 1 << 6);
        let at = |i: u32, of: u32| (i as f32 + 0.5) / of as f32;
        let mut sums = [0.0; 4];
        for number in 0..PERIOD {
            for i in 0..across * down {
                let u = [at(i % across, across), at(i / across, down)];
                let ([x, y], weight) = filter.sample(u, &[number]);
                let [x, y, weight] = [x, y, weight].map(f64::from);
                for (sum, term) in sums.iter_mut().zip([1.0, x, x * x, x * x * y * y]) {
                    *sum += weight * term / f64::from(PERIOD * across * down);
                }
            }
        }
        let net = integral(kind, |_, f| f);
        let square = integral(kind, |x, f| x * x * f) / net;
        assert!((sums[0] - 1.0).abs() < 1e-6, "{kind:?}: {sums:?}");
        // Corners of signed filters are few points of the grid.
        let [place, area] = match kind.is_signed() {
            true => [2e-4; 2],
            false => [1e-6, 2e-5],
        };
        assert!(sums[1].abs() < place, "{kind:?}: {sums:?}");
        let off = (sums[2] - square).abs();
        assert!(off < area, "{kind:?}: {sums:?} {square}");
        // The grid is coarse along y.
        let off = (sums[3] - square * square).abs();
        assert!(off < 2e-2 * square * square, "{kind:?}: {sums:?} {square}");
    }
}

#[test]
fn weights_of_whole_numbers_of_samples_add_up_to_these() {
    let random = &mut Random(3);
    for kind in KINDS {
        let filter = Filter::new(kind);
        let mut sum = 0.0;
        for number in 0..512 {
            sum += f64::from(filter.sample(random.square(), &[number]).1);
            let count = number + 1;
            let is_whole = kind.samples(count) == count;
            assert!(
                !is_whole || sum == f64::from(count),
                "{kind:?} {count}: {sum}"
            );
        }
    }
    let asked = [1, 2, 3, 5, 8, 9, 15, 16, 17, 32, 100, 1024];
    let taken = asked.map(|asked| Kind::Mitchell.samples(asked));
    assert_eq!(taken, [1, 2, 4, 8, 8, 16, 16, 16, 32, 32, 112, 1024]);
    assert_eq!(asked.map(|asked| Kind::Gaussian.samples(asked)), asked);
}

#[test]
fn mitchell_is_continuous_of_unit_mass_and_changes_sign_once() {
    let kind = Kind::Mitchell;
    assert!((integral(kind, |_, f| f) - 1.0).abs() < 1e-9);
    assert!((kind.profile(0.0) - 8.0 / 9.0).abs() < 1e-15);
    assert!((kind.profile(1.0 - 1e-12) - kind.profile(1.0)).abs() < 1e-11);
    assert!(kind.profile(2.0).abs() < 1e-14);
    for i in 0..2000 {
        let x = (f64::from(i) + 0.5) / 1000.0;
        assert_eq!(kind.profile(x) > 0.0, x < kind.lobe(), "{x}");
    }
}

#[test]
fn offsets_grow_with_the_number_and_stay_inside() {
    let last = 1.0 - 0.5 * f32::EPSILON;
    let mut numbers: Vec<f32> = (0..100_000).map(|i| i as f32 / 100_000.0).collect();
    numbers.extend([1e-30, 1e-7, last, 0.499_999_97, 0.500_000_06]);
    numbers.sort_by(f32::total_cmp);
    for kind in KINDS {
        let filter = Filter::new(kind);
        let radius = kind.radius() as f32;
        for number in [0, 15] {
            let inside = |u: f32| {
                let (at, _) = filter.sample([u, 0.3], &[number]);
                at.iter().all(|x| x.abs() <= radius)
            };
            assert!(numbers.iter().all(|u| inside(*u)), "{kind:?}");
        }
        let offsets: Vec<f32> = numbers.iter().map(|u| filter.offset(*u)).collect();
        assert!(offsets.iter().all(|x| x.abs() <= radius), "{kind:?}");
        let grow = offsets.windows(2).all(|x| x[0] <= x[1] + 1e-6);
        assert!(grow, "{kind:?}");
        assert!(filter.offset(0.5_f32).abs() < 1e-6, "{kind:?}");
    }
}

fn agrees<L: Lanes<Scalar = f32>>() {
    let mut random = Random(1);
    for kind in KINDS {
        let filter = Filter::new(kind);
        for _ in 0..1000 {
            let mut numbers = || -> Vec<f32> { (0..L::COUNT).map(|_| random.unit()).collect() };
            let [u, v] = [numbers(), numbers()];
            let samples: Vec<u32> = (0..L::COUNT as u32).map(|i| 11 * i + 4).collect();
            let (at, weight) = filter.sample([L::load(&u), L::load(&v)], &samples);
            for i in 0..L::COUNT {
                let (one, its_weight) = filter.sample([u[i], v[i]], &samples[i..]);
                for k in 0..2 {
                    assert_eq!(at[k].lane(i).to_bits(), one[k].to_bits());
                }
                assert_eq!(weight.lane(i).to_bits(), its_weight.to_bits());
            }
        }
    }
}

#[test]
fn every_width_has_the_bits_of_one_lane() {
    agrees::<f32x4>();
    agrees::<f32x8>();
    agrees::<f32x16>();
}

/// `cargo test --release -p lanecast-light -- --ignored --nocapture time_of_an_offset`
#[test]
#[ignore = "prints times"]
fn time_of_an_offset() {
    let mut random = Random(1);
    let numbers: Vec<[f32; 2]> = (0..2400).map(|_| random.square()).collect();
    let column =
        |at: &[[f32; 2]], k: usize| f32x8::load(&std::array::from_fn::<_, 8, _>(|i| at[i][k]));
    let squares: Vec<[f32x8; 2]> = numbers
        .chunks(8)
        .map(|at| [column(at, 0), column(at, 1)])
        .collect();
    for kind in KINDS {
        let filter = Filter::new(kind);
        let mut best = f64::INFINITY;
        for _ in 0..3000 {
            let start = std::time::Instant::now();
            for u in &squares {
                std::hint::black_box(filter.sample(*u, &[7; 8]));
            }
            let time = start.elapsed().as_secs_f64() * 1e9;
            best = best.min(time / squares.len() as f64);
        }
        println!("{kind:?}: {best:.1} ns for x and y of eight lanes");
    }
}
