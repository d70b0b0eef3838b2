//! Three-dimensional vectors with one vector per lane.

use super::axis_order::AxisOrder;
use super::lanes::{Lanes, unordered_sum};
use glam::DVec3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A vector whose components are lanes: one column per axis.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L> Vec3<L> {
    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Vec3<L> {
        Vec3 { x, y, z }
    }
}

impl<L: Lanes> Vec3<L> {
    /// Repeats one vector in all lanes.
    #[inline(always)]
    pub fn splat(v: [L::Scalar; 3]) -> Vec3<L> {
        Vec3::new(L::splat(v[0]), L::splat(v[1]), L::splat(v[2]))
    }

    /// Collects one vector per lane; `of(i)` is that of lane i.
    #[inline(always)]
    pub fn of_lanes(of: impl Fn(usize) -> [L::Scalar; 3]) -> Vec3<L> {
        let mut axes = [L::zero().to_array(); 3];
        for i in 0..L::COUNT {
            for (axis, x) in axes.iter_mut().zip(of(i)) {
                axis.as_mut()[i] = x;
            }
        }
        let [x, y, z] = axes.map(|axis| L::load(axis.as_ref()));
        Vec3::new(x, y, z)
    }

    /// Returns the component along axis k: 0 is x, 1 is y, any other z.
    #[inline(always)]
    pub fn axis(self, k: usize) -> L {
        match k {
            0 => self.x,
            1 => self.y,
            _ => self.z,
        }
    }

    /// Dot product: (x·x' + y·y') + z·z', without FMA.
    #[inline(always)]
    pub fn dot(self, o: Vec3<L>) -> L {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Permutes the components into a summation order.
    #[inline(always)]
    pub fn ordered(self, order: AxisOrder) -> Vec3<L> {
        let [x, y, z] = order.of_axes([self.x, self.y, self.z]);
        Vec3::new(x, y, z)
    }

    /// Dot product with the same bits under any permutation or reflection of the axes,
    /// without FMA. Values of t are made of it. Lemma A5, docs/numerics/transforms.md.
    #[inline(always)]
    pub fn unordered_dot(self, o: Vec3<L>) -> L {
        unordered_sum(self.x * o.x, self.y * o.y, self.z * o.z)
    }

    /// Cross product by differences of products, without FMA: exchanging the operands
    /// negates it exactly.
    #[inline(always)]
    pub fn cross(self, o: Vec3<L>) -> Vec3<L> {
        Vec3::new(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }

    /// Returns `self + d·t`, without FMA.
    #[inline(always)]
    pub fn along(self, d: Vec3<L>, t: L) -> Vec3<L> {
        self + d * t
    }

    #[inline(always)]
    pub fn length_squared(self) -> L {
        self.dot(self)
    }

    #[inline(always)]
    pub fn length(self) -> L {
        self.length_squared().sqrt()
    }

    /// Returns the magnitudes of the components.
    #[inline(always)]
    pub fn abs(self) -> Vec3<L> {
        Vec3::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    #[inline(always)]
    pub fn max_element(self) -> L {
        self.x.max(self.y).max(self.z)
    }

    /// Divides component by component.
    #[inline(always)]
    pub fn by(self, [x, y, z]: [L::Scalar; 3]) -> Vec3<L> {
        Vec3::new(
            self.x / L::splat(x),
            self.y / L::splat(y),
            self.z / L::splat(z),
        )
    }

    /// Returns the largest magnitude of a component.
    #[inline(always)]
    pub fn max_abs(self) -> L {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Vec3<L>, no: Vec3<L>) -> Vec3<L> {
        Vec3::new(
            L::select(mask, yes.x, no.x),
            L::select(mask, yes.y, no.y),
            L::select(mask, yes.z, no.z),
        )
    }
}

macro_rules! componentwise {
    ($op:ident, $f:ident) => {
        impl<L: Lanes> $op for Vec3<L> {
            type Output = Vec3<L>;
            #[inline(always)]
            fn $f(self, o: Vec3<L>) -> Vec3<L> {
                Vec3::new(self.x.$f(o.x), self.y.$f(o.y), self.z.$f(o.z))
            }
        }
    };
}

componentwise!(Add, add);
componentwise!(Sub, sub);

impl<L: Lanes> Mul<L> for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn mul(self, s: L) -> Vec3<L> {
        Vec3::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<L: Lanes> Div<L> for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn div(self, s: L) -> Vec3<L> {
        Vec3::new(self.x / s, self.y / s, self.z / s)
    }
}

impl From<DVec3> for Vec3<f64> {
    #[inline(always)]
    fn from(v: DVec3) -> Vec3<f64> {
        Vec3::new(v.x, v.y, v.z)
    }
}

impl From<Vec3<f64>> for DVec3 {
    #[inline(always)]
    fn from(v: Vec3<f64>) -> DVec3 {
        DVec3::new(v.x, v.y, v.z)
    }
}

impl<L: Lanes> Neg for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn neg(self) -> Vec3<L> {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

/// [`Vec3::unordered_dot`] of two f64 vectors.
#[inline]
pub fn unordered_dot(a: DVec3, b: DVec3) -> f64 {
    unordered_sum(a.x * b.x, a.y * b.y, a.z * b.z)
}
