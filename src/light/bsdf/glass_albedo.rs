//! The directional albedo of rough glass, by which what its facets lose is given back.
//!
//! G(μ, α, η) is the share of light that clear glass of a round lobe reflects and transmits, in
//! single scattering, from the side on which the index of refraction is 1 to that on which it is η:
//! from 0.3 to 1. It is interpolated between the nodes of a table over x² = μ(1 + 3α)/(μ + 3α),
//! y⁸ = α³ and z |z| = (η − 1)/(η + 1), which the first rough glass of a program makes in some
//! 10 ms. G of a stretched lobe is summed at every hit.

use super::albedo::{STRETCHED_RETURN, lattice};
use super::fresnel::dielectric;
use super::glass::is_matched;
use super::microfacet::{Ggx, mirror, mirrored_pdf, visibility};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, f32x8, max, min};
use std::sync::LazyLock;

/// Nodes of the table: of α, of η and of μ.
const NODES: [usize; 3] = [16, 65, 24];

/// G at the nodes.
static TABLE: LazyLock<Vec<[[f32; NODES[2]]; NODES[1]]>> =
    LazyLock::new(|| (0..NODES[0]).map(table_row).collect());

/// The lattice over which G is summed.
const LATTICE: [u32; 2] = [377, 233];

/// Its points around all azimuths, and on the half of them that the other half mirrors where the
/// lobe is round.
static POINTS: LazyLock<[[[f32; 4]; LATTICE[0] as usize]; 2]> =
    LazyLock::new(|| [1.0, 0.5].map(|turns| lattice(LATTICE, turns)));

/// The share of what a round lobe loses that is given back: G is within 2 % (near the horizon, 0.2 %
/// in the mean), and with this no glass makes light.
const ROUND_RETURN: f32 = 0.98;

/// Makes the tables that [`glass_gain`] reads, so that no path waits for them or allocates.
pub fn make_tables(is_round: bool) {
    if is_round {
        LazyLock::force(&TABLE);
    } else {
        LazyLock::force(&POINTS);
    }
}

/// Computes the factor of rough glass as seen from `out` that gives back what its facets lose by
/// scattering only once, 1/G; 1 where the indices match. `eta` is the index of the far side over
/// that of the near one, `round_alpha` the α of a round lobe.
#[inline(always)]
pub fn glass_gain<L: Lanes<Scalar = f32>>(
    ggx: &Ggx<L>,
    out: Vec3<L>,
    round_alpha: Option<L>,
    eta: L,
) -> L {
    let one = L::splat(1.0);
    let (kept, share) = match round_alpha {
        Some(alpha) => (interpolated(out.z, alpha, eta), ROUND_RETURN),
        None => (summed(ggx, out, eta, 0), STRETCHED_RETURN),
    };
    let gain = one + L::splat(share) * (one - kept) / kept;
    L::select(is_matched(eta), one, gain)
}

/// Sums what clear glass reflects and transmits, between 1e-3 and 1.
#[inline(never)]
fn summed<L: Lanes<Scalar = f32>>(ggx: &Ggx<L>, out: Vec3<L>, eta: L, points: usize) -> L {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let seen = (out.z, ggx.stretch(out));
    let scale = one / mirrored_pdf(seen);
    let inverse = one / eta;
    let mut kept = zero;
    for &[u, sin, cos, weight] in &POINTS[points] {
        let turn = (L::splat(sin), L::splat(cos));
        let normal = ggx.sample_about(out, seen.1, L::splat(u), turn);
        let cos = out.dot(normal);
        let facet = dielectric(cos, eta);
        let up = mirror(out, normal);
        let down = out * inverse - normal * (cos * inverse - facet.cos);
        let [up, down] = [up, down].map(|into| {
            let part = into.z * visibility(seen, (into.z, ggx.stretch(into)));
            L::select(into.z.gt(zero), part, zero)
        });
        kept = kept + L::splat(weight) * scale * (down + facet.reflectance * (up - down));
    }
    max(min(kept, one), L::splat(1e-3))
}

/// Computes the nodes of one α.
fn table_row(row: usize) -> [[f32; NODES[2]]; NODES[1]] {
    type L = f32x8;
    let part = |i: usize, count: usize| i as f64 / (count - 1) as f64;
    let alpha = libm::pow(part(row, NODES[0]), 8.0 / 3.0).max(1e-4);
    let wide = 3.0 * alpha;
    let mus: [f32; NODES[2]] = std::array::from_fn(|column| {
        let t = part(column, NODES[2]).powi(2);
        (wide * t / (1.0 + wide - t)).clamp(alpha * 1e-4, 1.0) as f32
    });
    let ggx = Ggx::new(L::splat(alpha as f32));
    std::array::from_fn(|k| {
        let z = 2.0 * part(k, NODES[1]) - 1.0;
        let eta = ((1.0 + z * z.abs()) / (1.0 - z * z.abs()).max(1e-9)).clamp(1e-3, 1e3);
        let mut kept = [0.0; NODES[2]];
        for (mu, kept) in mus.chunks(L::COUNT).zip(kept.chunks_mut(L::COUNT)) {
            let mu = L::load(mu);
            let level = max(L::splat(1.0) - mu * mu, L::zero()).sqrt();
            let out = Vec3::new(level, L::zero(), mu);
            summed(&ggx, out, L::splat(eta as f32), 1).store(kept);
        }
        kept
    })
}

/// Interpolates in the table at the cosine `mu` > 0.
#[inline(never)]
fn interpolated<L: Lanes<Scalar = f32>>(mu: L, alpha: L, eta: L) -> L {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let mu = min(mu, one);
    let root = alpha.sqrt().sqrt();
    let y = root * root.sqrt();
    let wide = L::splat(3.0) * max(alpha, L::splat(1e-20));
    let x = (mu * (one + wide) / (mu + wide)).sqrt();
    let bend = (eta - one) / (eta + one);
    let z = bend.abs().sqrt();
    let z = (one + L::select(bend.lt(zero), -z, z)) * L::splat(0.5);
    let places = [y, z, x].map(|place| max(min(place, one), zero).to_array());
    let table = &*TABLE;
    let mut kept = zero.to_array();
    for (lane, kept) in kept.as_mut().iter_mut().enumerate() {
        let split = |axis: usize| {
            let last = NODES[axis] - 1;
            let place = places[axis].as_ref()[lane] * last as f32;
            let node = (place as usize).min(last - 1);
            (node, place - node as f32)
        };
        let [(i, r), (j, s), (k, t)] = [split(0), split(1), split(2)];
        let between = |low: f32, high: f32, part: f32| low + part * (high - low);
        let along = |row: &[f32; NODES[2]]| between(row[k], row[k + 1], t);
        let across = |i: usize| between(along(&table[i][j]), along(&table[i][j + 1]), s);
        *kept = between(across(i), across(i + 1), r);
    }
    L::load(kept.as_ref())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::albedo::tests::over_visible_normals;

    /// Integrates what clear glass reflects and transmits, as seen from an azimuth in turns.
    fn integrate_glass(seen: [f64; 2], alphas: [f64; 2], eta: f64, n: usize) -> f64 {
        over_visible_normals(seen, alphas, n, |out, h, shadowed| {
            let o_h = out[0] * h[0] + out[1] * h[1] + out[2] * h[2];
            let up = shadowed([0, 1, 2].map(|k| 2.0 * o_h * h[k] - out[k]));
            let sine = (1.0 - o_h * o_h) / (eta * eta);
            if sine >= 1.0 {
                return up;
            }
            let inner = (1.0 - sine).sqrt();
            let s = (o_h - eta * inner) / (o_h + eta * inner);
            let p = (eta * o_h - inner) / (eta * o_h + inner);
            let reflectance = 0.5 * (s * s + p * p);
            let down = shadowed([0, 1, 2].map(|k| out[k] / eta - h[k] * (o_h / eta - inner)));
            reflectance * up + (1.0 - reflectance) * down
        })
    }

    /// What clear frosted glass makes of a white furnace, from outside and from inside.
    #[test]
    fn frosted_glass_makes_no_light() {
        let (mut least, mut most, mut sum, mut count) = (2.0_f64, 0.0_f64, 0.0, 0.0);
        for roughness in [0.1_f64, 0.3, 0.5, 0.7, 0.85, 1.0] {
            for anisotropy in [0.0, 0.7] {
                let across = roughness * roughness;
                let alphas = [across + (1.0 - across) * anisotropy * anisotropy, across];
                for eta in [1.0 / 2.4, 1.0 / 1.5, 0.9, 1.01, 1.33, 1.5, 2.4] {
                    for mu in [1.0, 0.8, 0.5, 0.2, 0.05] {
                        for turn in [0.0, 0.12, 0.25] {
                            let kept = integrate_glass([mu, turn], alphas, eta, 80);
                            let level = (1.0 - mu * mu).sqrt();
                            let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
                            let [x, y, z] = [level * cos, level * sin, mu].map(|c| c as f32);
                            let ggx = Ggx::stretched(alphas[0] as f32, alphas[1] as f32);
                            let round_alpha = (anisotropy == 0.0).then_some(alphas[0] as f32);
                            let gain =
                                glass_gain(&ggx, Vec3::new(x, y, z), round_alpha, eta as f32);
                            let found = kept * f64::from(gain);
                            let limit = if anisotropy == 0.0 { 1.001 } else { 1.002 };
                            assert!(
                                found > 0.96 && found < limit,
                                "{roughness} {anisotropy} {eta} {mu} {turn}: {found}"
                            );
                            (least, most) = (least.min(found), most.max(found));
                            (sum, count) = (sum + found, count + 1.0);
                        }
                    }
                }
            }
        }
        println!("{least:.4} to {most:.4}, mean {:.4}", sum / count);
    }
}
