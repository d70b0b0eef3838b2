//! Directional albedos of the GGX lobe, by the reference's own quadrature.
//!
//! E is the albedo with a Fresnel term of 1, B that with (1 − o·h)⁵. The model interpolates
//! bilinearly between the nodes of a table: E, and B − E (1 − μ)⁵, over x and y with
//! x² = μ(1 + 3α)/(μ + 3α) and y⁸ = α³, in 64 columns and 48 rows. That interpolation belongs
//! to the model's definition; the values at the nodes are found here by quadrature of
//! ∫ G₂/G₁ over the visible normals.

use super::ggx::{Ggx, schlick};
use glam::DVec3;

const COLUMNS: usize = 64;
const ROWS: usize = 48;

/// Points of the lattice by which the model defines the albedo of a stretched lobe, and its step.
const LATTICE: [u32; 2] = [144, 89];

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
