//! Rays in world space and in object spaces.

use crate::math::Affine;

/// A ray of which the rounded numbers are exact by definition (docs/SPEC.md, S2 and S6).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// The origin.
    pub org: [f64; 3],
    /// The direction, of any length; t counts in lengths of it.
    pub dir: [f64; 3],
    /// How far level sets are shifted, in units of the error bound of their values. 0,
    /// except to find out how certain an answer is.
    pub level: f64,
}

impl Ray {
    /// Returns the object ray: the matrix times the ray without FMA, with its sums in the
    /// order of S6. The product that is added last is that of the column whose largest
    /// entry is the largest of the three; if two columns' are equal, of the remaining
    /// column; if all three are, of the last (S7).
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

    /// Returns the ray about another origin (a mesh's centre), with one rounded subtraction
    /// per axis (S8).
    pub fn about(&self, center: [f64; 3]) -> Ray {
        Ray {
            org: std::array::from_fn(|k| self.org[k] - center[k]),
            ..*self
        }
    }

    /// Says whether all coordinates are finite. Other rays meet nothing (S4).
    pub fn is_finite(&self) -> bool {
        self.org.iter().chain(&self.dir).all(|x| x.is_finite())
    }

    /// Returns the point at t, in f64.
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.org[k] + t * self.dir[k])
    }
}

/// Returns a · b in f64.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the length of a vector, scaled first so that squares neither overflow nor
/// vanish.
pub fn length(v: [f64; 3]) -> f64 {
    let size = v.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    let unit = v.map(|x| x / size);
    size * dot(unit, unit).sqrt()
}

/// Scales a vector to length 1; zero stays zero.
pub fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = length(v);
    if length > 0.0 {
        v.map(|x| x / length)
    } else {
        v
    }
}
