//! Rays, in the world and in object spaces.

use crate::math::Affine;

/// Exact by definition: the rounded numbers *are* the ray.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub org: [f64; 3],
    /// Any length; t counts in it.
    pub dir: [f64; 3],
    /// By how much functions that are no polynomials are shifted, in what their values may
    /// be off by: 0 but where it is asked how certain an answer is.
    pub level: f64,
}

impl Ray {
    /// The object ray: the matrix times the ray, in the order that defines it, without
    /// FMA. The product with one column is added last, then t: that of the column whose
    /// largest entry is the largest, or of the third, if those of two are equal.
    pub fn through(&self, m: &Affine) -> Ray {
        let size = |c: usize| m.linear()[c].iter().fold(0.0, |s, x| f64::max(s, x.abs()));
        let stands_out = |c: usize| {
            let (own, one, other) = (size(c), size((c + 1) % 3), size((c + 2) % 3));
            (one == other && own != one) || (one != other && own > one && own > other)
        };
        let last = (0..3).find(|c| stands_out(*c)).unwrap_or(2);
        let row = |v: [f64; 3], r: usize| {
            let product = |c: usize| m.linear()[c % 3][r] * v[c % 3];
            (product(last + 1) + product(last + 2)) + product(last)
        };
        Ray {
            org: std::array::from_fn(|r| row(self.org, r) + m.translation[r]),
            dir: std::array::from_fn(|r| row(self.dir, r)),
            level: self.level,
        }
    }

    /// About another origin (a mesh's centre), by one rounded subtraction.
    pub fn about(&self, center: [f64; 3]) -> Ray {
        Ray {
            org: std::array::from_fn(|k| self.org[k] - center[k]),
            ..*self
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
