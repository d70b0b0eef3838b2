//! Directional albedos of the GGX lobe, by which lost energy is given back and layers are
//! weighed.
//!
//! E(μ, α) is the reflectance of the single-scattering lobe with a Fresnel term of 1, and
//! B(μ, α) that with (1 − v·h)⁵, so that Schlick's term F₀ + (F₉₀ − F₀)(1 − v·h)⁵ has the albedo
//! F₀ E + (F₉₀ − F₀) B. Both are tabulated over coordinates in which they are smooth: the
//! features near the horizon have the width α, and the table follows them with
//! x² = μ(1 + 3α)/(μ + 3α) and y⁸ = α³, both from 0 to 1. In place of B the table holds
//! B − E (1 − μ)⁵, which vanishes for a mirror.

use super::albedo_table::{ALBEDO, COLUMNS, ROWS};
use super::fresnel::schlick;
use super::microfacet::{Ggx, mirror, mirrored_pdf, visibility};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::sin_cos_turns;
use lanecast_numerics::math::lanes::{Lanes, max, min};
use std::sync::LazyLock;

/// The factor of α in the first coordinate.
const WIDTH: f32 = 3.0;

/// Points of the lattice over which the albedo of a stretched lobe is summed, and its step: two
/// numbers of Fibonacci's.
const LATTICE: [u32; 2] = [144, 89];

/// The lattice's points: a number for the height, the sine and cosine of the turn, and the weight.
static POINTS: LazyLock<[[f32; 4]; LATTICE[0] as usize]> = LazyLock::new(|| lattice(LATTICE, 1.0));

/// Makes the points of a lattice that reaches this far around.
pub fn lattice<const N: usize>([points, step]: [u32; 2], turns: f32) -> [[f32; 4]; N] {
    std::array::from_fn(|i| {
        let r = 1.0 - (i as f32 + 0.5) / points as f32;
        let v = ((i as u32 * step % points) as f32 + 0.5) / points as f32;
        let (sin, cos) = sin_cos_turns(v * turns);
        [1.0 - r * r, sin, cos, 2.0 * r / points as f32]
    })
}

/// The share of what a stretched lobe loses that is given back: the lattice's error is at most
/// 0.8 % of the albedo, and with this no surface gains light.
pub const STRETCHED_RETURN: f32 = 0.97;

/// E and B of a lobe seen at one angle.
#[derive(Clone, Copy, Debug)]
pub struct Albedo<L> {
    pub white: L,
    pub schlick: L,
}

/// Looks up the albedos at the cosine `mu` > 0 by bilinear interpolation; the error is at most
/// 1e-3 of E and 6e-4 of B, and a tenth of that in the mean.
#[inline(always)]
pub fn albedo<L: Lanes<Scalar = f32>>(mu: L, alpha: L) -> Albedo<L> {
    let mu = min(mu, L::splat(1.0));
    let (column, s) = split(column_of(mu, alpha));
    let (row, t) = split(row_of(alpha));
    let at = |i: usize, down: usize, right: usize| {
        let row = (row.as_ref()[i] as usize).min(ROWS - 2) + down;
        let column = (column.as_ref()[i] as usize).min(COLUMNS - 2) + right;
        ALBEDO[row][column]
    };
    let low = between(s, |i| at(i, 0, 0), |i| at(i, 0, 1));
    let high = between(s, |i| at(i, 1, 0), |i| at(i, 1, 1));
    let [white, rest] = [0, 1].map(|k| low[k] + t * (high[k] - low[k]));
    of_table(mu, white, rest)
}

/// The table's row of one α, for a material whose roughness is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub struct AlbedoRow {
    alpha: f32,
    /// The last entry stands twice.
    entries: [[f32; 2]; COLUMNS + 1],
}

impl AlbedoRow {
    pub fn new(alpha: f32) -> AlbedoRow {
        let (row, t) = split(row_of(alpha));
        let row = (row[0] as usize).min(ROWS - 2);
        AlbedoRow {
            alpha,
            entries: std::array::from_fn(|i| {
                let column = i.min(COLUMNS - 1);
                let (low, high) = (ALBEDO[row][column], ALBEDO[row + 1][column]);
                [0, 1].map(|k| low[k] + t * (high[k] - low[k]))
            }),
        }
    }

    /// Looks up the albedos at the cosine `mu` > 0, with the errors of [`albedo()`].
    #[inline(always)]
    pub fn at<L: Lanes<Scalar = f32>>(&self, mu: L) -> Albedo<L> {
        let mu = min(mu, L::splat(1.0));
        let (column, s) = split(column_of(mu, L::splat(self.alpha)));
        // Columns are a power of two, so that no index needs a test.
        let place = |i: usize| column.as_ref()[i] as usize % COLUMNS;
        let [white, rest] = between(
            s,
            |i| self.entries[place(i)],
            |i| self.entries[place(i) + 1],
        );
        of_table(mu, white, rest)
    }
}

/// Computes the albedos of a lobe with two α as seen from `out`: G₂/G₁ summed over visible
/// normals, which a lattice of the unit square chooses, dense towards the horizon by u = 1 − r².
/// E is within 0.8 % and 0.13 % in the root of the mean square.
#[inline(never)]
pub fn stretched_albedo<L: Lanes<Scalar = f32>>(ggx: &Ggx<L>, out: Vec3<L>) -> Albedo<L> {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let seen = (out.z, ggx.stretch(out));
    let scale = one / mirrored_pdf(seen);
    let (mut white, mut weighed) = (zero, zero);
    for &[u, sin, cos, weight] in POINTS.iter() {
        let turn = (L::splat(sin), L::splat(cos));
        let normal = ggx.sample_about(out, seen.1, L::splat(u), turn);
        let into = mirror(out, normal);
        let weight = L::splat(weight);
        let part = weight * into.z * scale * visibility(seen, (into.z, ggx.stretch(into)));
        let part = L::select(into.z.gt(zero), part, zero);
        white = white + part;
        weighed = weighed + part * schlick(min(out.dot(normal), one));
    }
    Albedo {
        white: min(white, one),
        schlick: weighed,
    }
}

/// Returns the place of μ ≤ 1 among the columns.
#[inline(always)]
fn column_of<L: Lanes<Scalar = f32>>(mu: L, alpha: L) -> L {
    let one = L::splat(1.0);
    let wide = L::splat(WIDTH) * max(alpha, L::splat(1e-20));
    let x = (mu * (one + wide) / (mu + wide)).sqrt();
    min(x, one) * L::splat((COLUMNS - 1) as f32)
}

/// Returns the place of α among the rows.
#[inline(always)]
fn row_of<L: Lanes<Scalar = f32>>(alpha: L) -> L {
    let root = alpha.sqrt().sqrt();
    let y = root * root.sqrt();
    max(min(y, L::splat(1.0)), L::zero()) * L::splat((ROWS - 1) as f32)
}

/// Splits a place into the index before it and the distance from there, 0 to 1; between two
/// intervals it may be at the end of the first.
#[inline(always)]
fn split<L: Lanes<Scalar = f32>>(place: L) -> (L::Ids, L) {
    // In the binade of this number the unit in the last place is 1: its low bits are the index.
    let large = L::splat(8_388_608.0);
    let shifted = max(place - L::splat(0.5), L::zero()) + large;
    let mut index = L::ids(0);
    let lanes = shifted.to_array();
    for (i, x) in index.as_mut().iter_mut().zip(lanes.as_ref()) {
        *i = x.to_bits() & 0xff;
    }
    (index, place - (shifted - large))
}

/// Interpolates between two entries in each lane.
#[inline(always)]
fn between<L: Lanes<Scalar = f32>>(
    s: L,
    low: impl Fn(usize) -> [f32; 2],
    high: impl Fn(usize) -> [f32; 2],
) -> [L; 2] {
    let mut ends = [[L::zero().to_array(); 2]; 2];
    for i in 0..L::COUNT {
        let (low, high) = (low(i), high(i));
        for k in 0..2 {
            ends[k][0].as_mut()[i] = low[k];
            ends[k][1].as_mut()[i] = high[k];
        }
    }
    ends.map(|[low, high]| {
        let (low, high) = (L::load(low.as_ref()), L::load(high.as_ref()));
        low + s * (high - low)
    })
}

/// Makes albedos of interpolated entries.
#[inline(always)]
fn of_table<L: Lanes<Scalar = f32>>(mu: L, white: L, rest: L) -> Albedo<L> {
    Albedo {
        white,
        schlick: max(white * schlick(mu) + rest, L::zero()),
    }
}

/// Returns the albedos of a perfect mirror.
#[inline(always)]
pub fn mirror_albedo<L: Lanes<Scalar = f32>>(mu: L) -> Albedo<L> {
    Albedo {
        white: L::splat(1.0),
        schlick: schlick(mu),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Integrates E and B by the midpoint rule over the square by which visible normals are
    /// sampled, stretched towards the horizon, where the lobe is cut off.
    fn integrate(mu: f64, alpha: f64, n: usize) -> [f64; 2] {
        let across = (1.0 - mu * mu).max(0.0).sqrt();
        let stretch = |z: f64| (alpha * alpha * (1.0 - z * z) + z * z).max(0.0).sqrt();
        let (wx, wz) = (alpha * across / stretch(mu), mu / stretch(mu));
        let mut sums = [0.0; 2];
        for j in 0..n {
            let (sin, cos) = ((j as f64 + 0.5) / n as f64 * std::f64::consts::PI).sin_cos();
            for i in 0..n {
                let rest = 1.0 - (i as f64 + 0.5) / n as f64;
                let weight = 3.0 * rest * rest;
                let z = rest.powi(3) * (1.0 + wz) - wz;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (x, y) = (alpha * (r * cos + wx), alpha * r * sin);
                let h = (z + wz).max(0.0);
                let length = (x * x + y * y + h * h).sqrt();
                let v_h = (across * x + mu * h) / length;
                let l = 2.0 * v_h * h / length - mu;
                if l > 0.0 {
                    let value =
                        weight * l * (mu + stretch(mu)) / (l * stretch(mu) + mu * stretch(l));
                    sums[0] += value;
                    sums[1] += value * (1.0 - v_h.min(1.0)).powi(5);
                }
            }
        }
        sums.map(|sum| sum / (n * n) as f64)
    }

    /// The lattice against the table, which round lobes have.
    #[test]
    fn a_round_lobe_has_the_albedo_of_the_table() {
        for alpha in [0.01_f32, 0.1, 0.4, 0.8, 1.0] {
            for mu in [1.0_f32, 0.8, 0.5, 0.2, 0.05] {
                let out = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                let found = stretched_albedo(&Ggx::stretched(alpha, alpha), out);
                let expected = albedo(mu, alpha);
                let off = [
                    found.white / expected.white - 1.0,
                    found.schlick - expected.schlick,
                ];
                assert!(off.iter().all(|x| x.abs() < 1e-2), "{alpha} {mu}: {off:?}");
            }
        }
    }

    /// Integrates over the normals of a lobe with two α that are visible from an azimuth in turns, by
    /// the midpoint rule. `f` gets the direction to the viewer, a normal, and what gives a direction's
    /// share of light that is not shadowed, G₂/G₁.
    pub fn over_visible_normals(
        [mu, turn]: [f64; 2],
        [ax, ay]: [f64; 2],
        n: usize,
        f: impl Fn([f64; 3], [f64; 3], &dyn Fn([f64; 3]) -> f64) -> f64,
    ) -> f64 {
        let across = (1.0 - mu * mu).max(0.0).sqrt();
        let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
        let out = [across * cos, across * sin, mu];
        let stretch = |w: [f64; 3]| libm::hypot(libm::hypot(ax * w[0], ay * w[1]), w[2]);
        let size = stretch(out);
        let seen = [ax * out[0] / size, ay * out[1] / size, mu / size];
        let shadowed = |w: [f64; 3]| match w[2] > 0.0 {
            true => w[2] * (mu + size) / (w[2] * size + mu * stretch(w)),
            false => 0.0,
        };
        let mut sum = 0.0;
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let (sin, cos) = ((j as f64 + 0.5) / n as f64 * std::f64::consts::TAU).sin_cos();
            let rest = 1.0 - (i as f64 + 0.5) / n as f64;
            let z = rest.powi(3) * (1.0 + seen[2]) - seen[2];
            let r = (1.0 - z * z).max(0.0).sqrt();
            let h = [
                ax * (r * cos + seen[0]),
                ay * (r * sin + seen[1]),
                z + seen[2],
            ];
            let length = libm::hypot(libm::hypot(h[0], h[1]), h[2]);
            sum += 3.0 * rest * rest * f(out, h.map(|c| c / length), &shadowed);
        }
        sum / (n * n) as f64
    }

    /// Integrates E of a lobe with two α.
    fn integrate_stretched(mu: f64, turn: f64, alphas: [f64; 2], n: usize) -> f64 {
        over_visible_normals([mu, turn], alphas, n, |out, h, shadowed| {
            let o_h = out[0] * h[0] + out[1] * h[1] + out[2] * h[2];
            shadowed([0, 1, 2].map(|k| 2.0 * o_h * h[k] - out[k]))
        })
    }

    /// What a white stretched metal reflects in a white furnace: with what is given back.
    #[test]
    fn brushed_surfaces_make_no_light() {
        let (mut least, mut most, mut sum, mut count) = (2.0_f64, 0.0_f64, 0.0, 0.0);
        for roughness in [0.0, 0.1, 0.2, 0.4, 0.6, 0.8] {
            for anisotropy in [0.1, 0.3, 0.6, 0.8, 1.0] {
                let across = f64::max(roughness * roughness, 1e-4);
                let alphas = [across + (1.0 - across) * anisotropy * anisotropy, across];
                for mu in [1.0, 0.8, 0.5, 0.2, 0.05] {
                    for turn in [0.0, 0.08, 0.17, 0.25] {
                        let exact = integrate_stretched(mu, turn, alphas, 160);
                        let level = (1.0 - mu * mu).sqrt();
                        let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
                        let [x, y, z] = [level * cos, level * sin, mu].map(|c| c as f32);
                        let ggx = Ggx::stretched(alphas[0] as f32, alphas[1] as f32);
                        let told = stretched_albedo(&ggx, Vec3::new(x, y, z)).white;
                        let lost = f64::from((1.0 - told) / told * STRETCHED_RETURN);
                        let found = exact * (1.0 + lost);
                        assert!(
                            found > 0.97 && found < 1.001,
                            "{roughness} {anisotropy} {mu} {turn}: {found}"
                        );
                        (least, most) = (least.min(found), most.max(found));
                        (sum, count) = (sum + found, count + 1.0);
                    }
                }
            }
        }
        println!("{least:.4} to {most:.4}, mean {:.4}", sum / count);
    }

    fn place(row: usize, column: usize) -> (f64, f64) {
        let y = row as f64 / (ROWS - 1) as f64;
        // The first row is the limit of smooth surfaces, where E depends on μ/α alone.
        let alpha = y.powf(8.0 / 3.0).max(1e-6);
        let x = column as f64 / (COLUMNS - 1) as f64;
        let (t, wide) = (x * x, f64::from(WIDTH) * alpha);
        let mu = if column + 1 == COLUMNS {
            1.0
        } else {
            wide * t / (1.0 + wide - t)
        };
        (mu.clamp(alpha * 1e-8, 1.0), alpha)
    }

    /// Prints albedo_table.rs anew.
    #[test]
    #[ignore = "makes albedo_table.rs, in a minute"]
    fn print_the_table() {
        println!("//! E and B − E (1 − μ)⁵ of the GGX lobe; see albedo.rs. Made by its test");
        println!("//! `print_the_table`.\n");
        println!("pub const ROWS: usize = {ROWS};");
        println!("pub const COLUMNS: usize = {COLUMNS};\n");
        println!("/// By α and μ. Values are rounded to 1e-6.\n#[rustfmt::skip]");
        println!("pub static ALBEDO: [[[f32; 2]; COLUMNS]; ROWS] = [");
        for row in 0..ROWS {
            println!("    [");
            for column in 0..COLUMNS {
                let (mu, alpha) = place(row, column);
                let [e, b] = integrate(mu, alpha, 600);
                let separator = if column % 4 == 3 { "\n" } else { " " };
                let start = if column % 4 == 0 { "        " } else { "" };
                let rest = b - e * (1.0 - mu).powi(5);
                print!("{start}[{e:.6}, {rest:.6}],{separator}");
            }
            println!("    ],");
        }
        println!("];");
    }

    #[test]
    fn the_table_holds_what_quadrature_gives() {
        for row in [0, 7, 20, 33, ROWS - 1] {
            for column in [0, 1, 13, 40, COLUMNS - 1] {
                let (mu, alpha) = place(row, column);
                let [e, b] = integrate(mu, alpha, 300);
                let [white, rest] = ALBEDO[row][column];
                let found = [f64::from(white), f64::from(rest) + e * (1.0 - mu).powi(5)];
                assert!(
                    (found[0] - e).abs() < 3e-5,
                    "E({mu}, {alpha}): {found:?} {e}"
                );
                assert!(
                    (found[1] - b).abs() < 3e-5,
                    "B({mu}, {alpha}): {found:?} {b}"
                );
            }
        }
    }

    /// Directional albedos by quadrature over directions with 2000² points, F = 1.
    #[test]
    fn the_albedo_agrees_with_quadrature_over_directions() {
        let expected = [
            (0.0625, [0.99569, 0.99434, 0.98832, 0.94627, 0.89411]),
            (0.25, [0.91581, 0.89727, 0.85726, 0.84816, 0.93313]),
            (0.5625, [0.62689, 0.63026, 0.66318, 0.77199, 0.90493]),
            (1.0, [0.30685, 0.35126, 0.45069, 0.64165, 0.84777]),
        ];
        for (alpha, row) in expected {
            for (mu, expected) in [1.0_f32, 0.8, 0.5, 0.2, 0.05].into_iter().zip(row) {
                let quadrature = integrate(f64::from(mu), f64::from(alpha), 600)[0];
                assert!(
                    (quadrature - f64::from(expected)).abs() < 3e-5,
                    "{mu} {alpha}"
                );
                let found = albedo(mu, alpha).white;
                assert!(
                    (found - expected).abs() < 4e-4,
                    "{mu} {alpha}: {found} {expected}"
                );
            }
        }
        let head_on = 1.0 - std::f64::consts::LN_2;
        assert!((f64::from(albedo(1.0_f32, 1.0).white) - head_on).abs() < 1e-5);
    }

    #[test]
    fn a_row_is_the_table_at_its_alpha() {
        for i in 0..100 {
            let alpha = (i as f32 / 99.0).powi(3);
            let row = AlbedoRow::new(alpha);
            for j in 1..100 {
                let mu = (j as f32 / 99.0).powi(2);
                let (found, expected) = (row.at(mu), albedo(mu, alpha));
                assert!((found.white - expected.white).abs() < 1e-6);
                assert!((found.schlick - expected.schlick).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn interpolation_keeps_its_bounds() {
        let (mut worst, mut sum, mut count) = ([0.0_f64; 2], [0.0; 2], 0.0);
        for i in 1..40 {
            for j in 1..40 {
                let (mu, alpha) = ((f64::from(i) / 39.0).powi(2), (f64::from(j) / 39.0).powi(3));
                let exact = integrate(mu, alpha, 200);
                let found = albedo(mu as f32, alpha as f32);
                for (k, x) in [found.white, found.schlick].into_iter().enumerate() {
                    let scale = if k == 0 { exact[0] } else { 1.0 };
                    let error = (f64::from(x) - exact[k]).abs() / scale;
                    worst[k] = worst[k].max(error);
                    sum[k] += error;
                }
                count += 1.0;
            }
        }
        assert!(worst[0] < 1e-3 && worst[1] < 6e-4, "{worst:?}");
        assert!(sum[0] / count < 1e-4 && sum[1] / count < 1e-4, "{sum:?}");
    }
}
