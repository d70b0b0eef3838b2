//! Directional albedos of the GGX lobe, by the reference's own quadrature.
//!
//! E is the albedo with a Fresnel term of 1, B that with (1 − o·h)⁵. The model interpolates
//! bilinearly between the nodes of a table: E, and B − E (1 − μ)⁵, over x and y with
//! x² = μ(1 + 3α)/(μ + 3α) and y⁸ = α³, in 64 columns and 48 rows. That interpolation belongs
//! to the model's definition; the values at the nodes are found here by quadrature of
//! ∫ G₂/G₁ over the visible normals.

use super::ggx::{Ggx, fresnel, schlick};
use glam::DVec3;

const COLUMNS: usize = 64;
const ROWS: usize = 48;

/// Points of the lattice by which the model defines the albedo of a stretched lobe, and its step.
const LATTICE: [u32; 2] = [144, 89];

/// The lattice by which it defines that of rough glass, and the nodes of α, η and μ between which it
/// interpolates that of a round lobe.
const GLASS_LATTICE: [u32; 2] = [377, 233];
const GLASS_NODES: [usize; 3] = [16, 65, 24];

/// Points of the quadrature along each axis.
const POINTS: usize = 160;

/// E and B of some roughnesses, for all angles.
#[derive(Clone, Debug)]
pub struct Albedo {
    /// Rows of the table from `first` on.
    rows: Vec<Vec<[f64; 2]>>,
    first: usize,
}

impl Albedo {
    /// Integrates the nodes around an α; α = 0 is a perfect mirror.
    pub fn new(alpha: f64) -> Albedo {
        let first = (place(alpha) as usize).min(ROWS - 2);
        let row = |row: usize| (0..COLUMNS).map(|column| at_node(row, column)).collect();
        Albedo {
            rows: match alpha == 0.0 {
                true => Vec::new(),
                false => (first..=first + 1).map(row).collect(),
            },
            first,
        }
    }

    /// Returns E and B of an α at a cosine.
    pub fn at(&self, mu: f64, alpha: f64) -> [f64; 2] {
        if self.rows.is_empty() {
            return [1.0, schlick(mu)];
        }
        let y = place(alpha) - self.first as f64;
        let row = (y.max(0.0) as usize).min(self.rows.len() - 2);
        let t = y - row as f64;
        let (mu, wide) = (mu.min(1.0), 3.0 * alpha);
        let x = (mu * (1.0 + wide) / (mu + wide)).sqrt().min(1.0) * (COLUMNS - 1) as f64;
        let column = (x as usize).min(COLUMNS - 2);
        let s = x - column as f64;
        let between = |a: [f64; 2], b: [f64; 2], t: f64| [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
        let [low, high] = [column, column + 1]
            .map(|column| between(self.rows[row][column], self.rows[row + 1][column], t));
        let [e, rest] = between(low, high, s);
        [e, (e * schlick(mu) + rest).max(0.0)]
    }
}

/// Returns E and B of a stretched lobe, as the model defines them: sums over the visible normals of
/// a rank-1 lattice (i + ½, 89 i + ½ mod 144)/144 whose first number is r = 1 − √(1 − u).
pub fn of_stretched(ggx: &Ggx, out: DVec3) -> [f64; 2] {
    let [points, step] = LATTICE;
    let mut sums = [0.0; 2];
    for i in 0..points {
        let [r, v] = [i, i * step % points].map(|k| (f64::from(k) + 0.5) / f64::from(points));
        let u = 1.0 - (1.0 - r).powi(2);
        let h = ggx.sample(out, [u, v]);
        let into = h * (2.0 * out.dot(h)) - out;
        if into.z > 0.0 {
            let part = 2.0 * (1.0 - r) * ggx.masking_shadowing(out, into) / ggx.masking(out);
            sums[0] += part;
            sums[1] += part * schlick(out.dot(h));
        }
    }
    let [e, b] = sums.map(|sum| sum / f64::from(points));
    [e.min(1.0), b]
}

/// What clear glass of a round lobe reflects and transmits together, at all angles and indices.
#[derive(Clone, Debug)]
pub struct RoundGlass {
    /// Nodes of the two α around the glass's, by η and μ.
    rows: [Vec<f64>; 2],
    /// The place between them.
    part: f64,
}

impl RoundGlass {
    /// Computes the nodes of the model's table around an α.
    pub fn new(alpha: f64) -> RoundGlass {
        let [alphas, etas, mus] = GLASS_NODES;
        let place = alpha.powf(0.375).min(1.0) * (alphas - 1) as f64;
        let first = (place as usize).min(alphas - 2);
        let share = |i: usize, count: usize| i as f64 / (count - 1) as f64;
        let row = |row: usize| {
            let alpha = share(row, alphas).powf(8.0 / 3.0).max(1e-4);
            let (ggx, wide) = (Ggx::new(alpha), 3.0 * alpha);
            let node = |i: usize| {
                let z = 2.0 * share(i / mus, etas) - 1.0;
                let bend = z * z.abs();
                let eta = ((1.0 + bend) / (1.0 - bend).max(1e-9)).clamp(1e-3, 1e3);
                let t = share(i % mus, mus).powi(2);
                let mu = (wide * t / (1.0 + wide - t)).clamp(alpha * 1e-4, 1.0);
                let out = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
                of_glass(&ggx, out, eta, 0.5)
            };
            (0..etas * mus).map(node).collect()
        };
        RoundGlass {
            rows: [row(first), row(first + 1)],
            part: place - first as f64,
        }
    }

    /// Returns the share at the cosine `mu`; `alpha` is that of [`RoundGlass::new`].
    pub fn at(&self, mu: f64, alpha: f64, eta: f64) -> f64 {
        let [_, etas, mus] = GLASS_NODES;
        let wide = 3.0 * alpha;
        let x = (mu.min(1.0) * (1.0 + wide) / (mu.min(1.0) + wide)).sqrt();
        let bend = (eta - 1.0) / (eta + 1.0);
        let z = 0.5 * (1.0 + bend.abs().sqrt().copysign(bend));
        let split = |place: f64, count: usize| {
            let place = place.clamp(0.0, 1.0) * (count - 1) as f64;
            let node = (place as usize).min(count - 2);
            (node, place - node as f64)
        };
        let ((j, s), (k, t)) = (split(z, etas), split(x, mus));
        let between = |low: f64, high: f64, part: f64| low + part * (high - low);
        let [low, high] = [0, 1].map(|row: usize| {
            let along = |j: usize| {
                let at = j * mus + k;
                between(self.rows[row][at], self.rows[row][at + 1], t)
            };
            between(along(j), along(j + 1), s)
        });
        between(low, high, self.part)
    }
}

/// Returns what clear rough glass reflects and transmits together, by a sum as that of
/// [`of_stretched`] that reaches this many turns around.
pub fn of_glass(ggx: &Ggx, out: DVec3, eta: f64, turns: f64) -> f64 {
    let [points, step] = GLASS_LATTICE;
    let mut sum = 0.0;
    for i in 0..points {
        let [r, v] = [i, i * step % points].map(|k| (f64::from(k) + 0.5) / f64::from(points));
        let h = ggx.sample(out, [1.0 - (1.0 - r).powi(2), turns * v]);
        let o_h = out.dot(h);
        let facet = fresnel(o_h, eta);
        let up = h * (2.0 * o_h) - out;
        let down = h * (o_h / eta - facet.cos) - out / eta;
        let mut kept = 0.0;
        if up.z > 0.0 {
            kept += facet.reflectance * ggx.masking_shadowing(out, up);
        }
        if down.z < 0.0 {
            kept += (1.0 - facet.reflectance) * ggx.masking_shadowing(out, down);
        }
        sum += 2.0 * (1.0 - r) * kept / ggx.masking(out);
    }
    (sum / f64::from(points)).clamp(1e-3, 1.0)
}

/// Returns the place of α among the rows.
fn place(alpha: f64) -> f64 {
    alpha.powf(0.375).min(1.0) * (ROWS - 1) as f64
}

/// E and B − E (1 − μ)⁵ at a node of the table.
fn at_node(row: usize, column: usize) -> [f64; 2] {
    let alpha = (row as f64 / (ROWS - 1) as f64).powf(8.0 / 3.0).max(1e-6);
    let x = column as f64 / (COLUMNS - 1) as f64;
    let (t, wide) = (x * x, 3.0 * alpha);
    let mu = match column + 1 == COLUMNS {
        true => 1.0,
        false => (wide * t / (1.0 + wide - t)).clamp(alpha * 1e-8, 1.0),
    };
    let [e, b] = integrated(mu, alpha);
    [e, b - e * schlick(mu)]
}

/// Integrates over the square by which visible normals are sampled, of which the half with
/// positive y mirrors the other. The cube root puts more points near the horizon.
fn integrated(mu: f64, alpha: f64) -> [f64; 2] {
    let ggx = Ggx::new(alpha);
    let out = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let mut sums = [0.0; 2];
    for i in 0..POINTS {
        let rest = (i as f64 + 0.5) / POINTS as f64;
        let (u, jacobian) = (1.0 - rest.powi(3), 3.0 * rest * rest);
        for j in 0..POINTS {
            let v = 0.5 * (j as f64 + 0.5) / POINTS as f64;
            let h = ggx.sample(out, [u, v]);
            let into = h * (2.0 * out.dot(h)) - out;
            if into.z > 0.0 {
                let part = jacobian * ggx.masking_shadowing(out, into) / ggx.masking(out);
                sums[0] += part;
                sums[1] += part * schlick(out.dot(h));
            }
        }
    }
    sums.map(|sum| sum / (POINTS * POINTS) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At normal incidence and α = 1 the albedo is 1 − ln 2.
    #[test]
    fn the_albedo_has_its_closed_form() {
        let [e, _] = Albedo::new(1.0).at(1.0, 1.0);
        assert!((e - (1.0 - std::f64::consts::LN_2)).abs() < 1e-4, "{e}");
    }
}
