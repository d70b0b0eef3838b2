//! Rays in object space, and what a primitive says about one.

use super::approx::{Approx, Approx3, Verdict, add, exact3, scaled};
use crate::math::Affine;

/// Exact by definition: the rounded numbers *are* the ray.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub org: [f64; 3],
    /// Any length; t counts in it.
    pub dir: [f64; 3],
}

/// One place where a ray meets a primitive, or may meet it. Certain misses are
/// not listed.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    pub t: Approx,
    pub exists: Verdict,
    /// Triangle of a mesh; 0 otherwise.
    pub primitive: u32,
    /// Object space, outward, any length.
    pub normal: [f64; 3],
}

/// A ray started anew at its point nearest to a bounded shape, so that nothing
/// large cancels: t = `start` + t'. The shape's crossings have |t'| ≤ `reach`.
#[derive(Clone, Copy, Debug)]
pub struct NearRay {
    pub org: Approx3,
    pub dir: Approx3,
    pub start: f64,
    pub reach: f64,
}

impl Ray {
    /// The object ray: the matrix times the ray, in the order that defines it
    /// ((m₀x + m₁y) + m₂z) + t, without FMA.
    pub fn through(&self, m: &Affine) -> Ray {
        let row = |v: [f64; 3], r: usize| {
            m.linear[0][r] * v[0] + m.linear[1][r] * v[1] + m.linear[2][r] * v[2]
        };
        Ray {
            org: std::array::from_fn(|r| row(self.org, r) + m.translation[r]),
            dir: std::array::from_fn(|r| row(self.dir, r)),
        }
    }

    /// About another origin (a mesh's centre), by one rounded subtraction.
    pub fn about(&self, center: [f64; 3]) -> Ray {
        Ray {
            org: std::array::from_fn(|k| self.org[k] - center[k]),
            dir: self.dir,
        }
    }

    /// Started anew near a shape that lies within `radius` of `center`.
    pub fn near(&self, center: [f64; 3], radius: f64) -> NearRay {
        let to: [f64; 3] = std::array::from_fn(|k| center[k] - self.org[k]);
        let length = length(self.dir);
        let along = dot(to, self.dir.map(|x| x / length)) / length;
        // Any number will do: it is exact from here on.
        let start = if along.is_finite() { along } else { 0.0 };
        // The new start lies off the nearest point by a few roundings.
        let slack = 1e-12 * (self.org.iter().chain(&center).map(|x| x.abs()).sum::<f64>());
        let reach = (1.01 * radius + slack) / length;
        NearRay {
            org: add(
                exact3(self.org),
                scaled(exact3(self.dir), Approx::exact(start)),
            ),
            dir: exact3(self.dir),
            start,
            reach: if reach.is_finite() {
                reach
            } else {
                f64::INFINITY
            },
        }
    }
}

impl NearRay {
    pub fn at(&self, t: Approx) -> Approx3 {
        add(self.org, scaled(self.dir, t))
    }

    /// A crossing at t' of this ray, as one of the ray it was made from.
    pub fn crossing(&self, t: Approx, exists: Verdict, normal: [f64; 3]) -> Crossing {
        Crossing {
            t: Approx::exact(self.start) + t,
            exists,
            primitive: 0,
            normal,
        }
    }
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Scaled first: squares neither overflow nor vanish.
pub fn length(v: [f64; 3]) -> f64 {
    let size = v.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    let unit = v.map(|x| x / size);
    size * dot(unit, unit).sqrt()
}

/// Of length 1; zero stays zero.
pub fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = length(v);
    if length > 0.0 {
        v.map(|x| x / length)
    } else {
        v
    }
}
