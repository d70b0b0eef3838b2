//! Pearson's chi-squared test of sampling routines against the densities they claim.
//!
//! A routine that maps the unit square to a domain is run on random points; the domain is
//! itself laid out as a unit square and cut into cells. The counts of the cells are compared
//! with the density's integrals over them. The density has to integrate to 1 as well. For
//! tests only.

use std::f64::consts::PI;

/// A generator of test inputs: Vigna's SplitMix64, with the state.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// Draws a number in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// Draws a point of the unit square.
    pub fn square(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }
}

/// Returns the place of a unit vector on the sphere's layout as a unit square: (1 + z)/2
/// first, then the azimuth in turns. Areas are solid angles/4π, so the density on the
/// square is 4π times that per solid angle.
pub fn place_of([x, y, z]: [f64; 3]) -> [f64; 2] {
    let turns = libm::atan2(y, x) / (2.0 * PI);
    [0.5 + 0.5 * z, turns - turns.floor()]
}

/// Returns the direction at a place of [`place_of`].
pub fn direction_of([height, turns]: [f64; 2]) -> [f64; 3] {
    let z = 2.0 * height - 1.0;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(2.0 * PI * turns);
    [radius * cos, radius * sin, z]
}

/// Fails unless `sample`, on `count` random points of the square, has `density` over a
/// layout of `rows` × `columns` cells, and unless the density integrates to the chance of a
/// sample within 1e-3. `sample` gives None where there is no sample. The level is 1 % over
/// `tests` tests together.
pub fn check(
    name: &str,
    [rows, columns]: [usize; 2],
    count: usize,
    tests: usize,
    mut sample: impl FnMut([f32; 2]) -> Option<[f64; 2]>,
    density: impl Fn([f64; 2]) -> f64,
) {
    let mut random = Random(rows as u64 * 31 + columns as u64);
    let mut observed = vec![0.0; rows * columns];
    let mut samples = 0.0;
    for _ in 0..count {
        if let Some(at) = sample(random.square()) {
            let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            assert!(at.iter().all(|x| (-1e-6..1.0 + 1e-6).contains(x)), "{at:?}");
            observed[cell(at[0], rows) * columns + cell(at[1], columns)] += 1.0;
            samples += 1.0;
        }
    }
    let expected = integrals([rows, columns], density);
    let total: f64 = expected.iter().sum();
    let share = samples / count as f64;
    let spread = (share * (1.0 - share) / count as f64).sqrt();
    assert!(
        (total - share).abs() < 1e-3 + 4.0 * spread,
        "{name}: the density integrates to {total}, {share} of the points give a sample"
    );
    let expected: Vec<f64> = expected.iter().map(|e| e / total * samples).collect();
    let p = p_value(&observed, &expected);
    let level = sidak(0.01, tests);
    assert!(p >= level, "{name}: p = {p:e} < {level:e}");
}

/// Integrates a density on the unit square over each of `rows` × `columns` cells.
pub fn integrals([rows, columns]: [usize; 2], density: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
    let size = [1.0 / rows as f64, 1.0 / columns as f64];
    let mut cells = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        for column in 0..columns {
            let from = [row as f64 * size[0], column as f64 * size[1]];
            let whole = gauss(from, size, &density);
            cells.push(refined(from, size, whole, DEPTH, &density));
        }
    }
    cells
}

/// How often a cell is quartered at most, which resolves edges to its 256th part.
const DEPTH: u32 = 8;

/// Integrates by quarters until they agree with the whole, or `depth` times. The first
/// two times they are not believed, for an edge may pass between all points.
fn refined(
    from: [f64; 2],
    size: [f64; 2],
    whole: f64,
    depth: u32,
    density: &impl Fn([f64; 2]) -> f64,
) -> f64 {
    let half = size.map(|s| 0.5 * s);
    let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
    let corners = corners.map(|(i, j)| [from[0] + i * half[0], from[1] + j * half[1]]);
    let quarters = corners.map(|corner| gauss(corner, half, density));
    let sum: f64 = quarters.iter().sum();
    if depth == 0 || depth + 2 <= DEPTH && (sum - whole).abs() <= 1e-6 * sum.abs() + 1e-12 {
        return sum;
    }
    let parts = corners.iter().zip(quarters);
    parts
        .map(|(corner, quarter)| refined(*corner, half, quarter, depth - 1, density))
        .sum()
}

/// Integrates over a rectangle by Gauss's rule of 3 × 3 points.
fn gauss(from: [f64; 2], size: [f64; 2], density: &impl Fn([f64; 2]) -> f64) -> f64 {
    let offset = 0.5 * (0.6_f64).sqrt();
    let points = [
        (0.5 - offset, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.5 + offset, 5.0 / 18.0),
    ];
    let mut sum = 0.0;
    for (x, wx) in points {
        for (y, wy) in points {
            sum += wx * wy * density([from[0] + x * size[0], from[1] + y * size[1]]);
        }
    }
    sum * size[0] * size[1]
}

/// Returns the probability of counts at least as far from the expected ones by chance.
/// Cells are pooled from the least on until at least five are expected in each; a count
/// where none is expected gives 0.
pub fn p_value(observed: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len());
    let mut cells: Vec<(f64, f64)> = expected
        .iter()
        .copied()
        .zip(observed.iter().copied())
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = observed.iter().sum();
    let (mut pool, mut statistic, mut used) = ((0.0, 0.0), 0.0, 0);
    let mut add = |(expected, observed): (f64, f64)| {
        statistic += (observed - expected) * (observed - expected) / expected;
        used += 1;
    };
    for (e, o) in cells {
        // A few may cross into the cell by rounding.
        if e <= 0.0 && o > 1e-5 * total {
            return 0.0;
        }
        pool = (pool.0 + e, pool.1 + o);
        if pool.0 >= 5.0 {
            add(pool);
            pool = (0.0, 0.0);
        }
    }
    if pool.0 > 0.0 {
        add(pool);
    }
    assert!(used > 1, "one cell tells nothing");
    upper_gamma(0.5 * f64::from(used - 1), 0.5 * statistic)
}

/// Šidák's level of each of `tests` independent tests so that all of them together fail
/// with probability `level` when nothing is wrong.
pub fn sidak(level: f64, tests: usize) -> f64 {
    1.0 - libm::pow(1.0 - level, 1.0 / tests as f64)
}

/// Returns the regularised upper incomplete gamma function Q(a, x): by the series of P below
/// a + 1, and by Lentz's continued fraction above (Press et al., "Numerical Recipes", 6.2).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum, mut k) = (1.0 / a, 1.0 / a, a);
        while term > 1e-16 * sum {
            k += 1.0;
            term *= x / k;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let an = -i * (i - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

mod tests {
    use super::*;

    /// Quantiles of tables: P(χ² ≥ x).
    #[test]
    fn tails_are_those_of_tables() {
        for (freedom, x, p) in [
            (1.0, 3.841_459, 0.05),
            (10.0, 23.209_25, 0.01),
            (10.0, 3.940_299, 0.95),
            (100.0, 149.449_25, 0.001),
        ] {
            let got = upper_gamma(0.5 * freedom, 0.5 * x);
            assert!((got - p).abs() < 1e-6, "{freedom} {x}: {got} {p}");
        }
    }

    #[test]
    fn a_wrong_density_fails_and_a_right_one_does_not() {
        let p = |slope: f64| {
            let mut random = Random(3);
            let mut observed = vec![0.0; 64];
            for _ in 0..100_000 {
                let [x, y] = random.square().map(|x| (f64::from(x) * 8.0) as usize);
                observed[x * 8 + y] += 1.0;
            }
            let expected = integrals([8, 8], |[x, _]| 1.0 + slope * (x - 0.5));
            p_value(
                &observed,
                &expected.iter().map(|e| e * 1e5).collect::<Vec<_>>(),
            )
        };
        assert!(p(0.0) > 0.01 && p(0.1) < 1e-6, "{} {}", p(0.0), p(0.1));
    }

    #[test]
    fn densities_with_edges_and_peaks_are_integrated() {
        let inside = |[x, y]: [f64; 2]| f64::from(u8::from(x.hypot(y) <= 1.0));
        let disc: f64 = integrals([10, 10], inside).iter().sum();
        assert!((disc - PI / 4.0).abs() < 1e-4, "{disc}");
        let peak = |[x, y]: [f64; 2]| 2e4 / PI * libm::exp(-1e4 * (x * x + y * y)) * 2.0;
        let peak: f64 = integrals([10, 10], peak).iter().sum();
        assert!((peak - 1.0).abs() < 1e-4, "{peak}");
        for direction in [[0.6, -0.8, 0.0], [0.0, 0.6, 0.8], [-0.48, 0.6, -0.64]] {
            let back = direction_of(place_of(direction));
            for k in 0..3 {
                assert!((back[k] - direction[k]).abs() < 1e-12);
            }
        }
    }
}
