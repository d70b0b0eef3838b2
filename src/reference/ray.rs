//! Rays, in the world and in object spaces.

use crate::math::Affine;

/// Exact by definition: the rounded numbers *are* the ray.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub org: [f64; 3],
    /// Any length; t counts in it.
    pub dir: [f64; 3],
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

    /// A ray that is not finite meets nothing.
    pub fn is_finite(&self) -> bool {
        self.org.iter().chain(&self.dir).all(|x| x.is_finite())
    }

    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.org[k] + t * self.dir[k])
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
