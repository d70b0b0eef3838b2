//! Axis-aligned bounding boxes: f64 for scenes, f32 rounded outward for trees.
//!
//! Invariant: converting to [`Aabb32`] never loses a point that f32 can reach; what it
//! cannot is cut off, and slabs are open there. An empty box has `min > max` on every axis
//! and is the identity of [`Aabb::union`].

use super::affine::Affine;
use glam::DVec3;

/// A box in f64, in whatever space its maker says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: DVec3,
    pub max: DVec3,
}

/// The same in f32, rounded outward: what tree nodes hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb32 {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Aabb {
    /// The box of no points.
    pub const EMPTY: Aabb = Aabb {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    pub fn new(min: DVec3, max: DVec3) -> Aabb {
        Aabb { min, max }
    }

    /// The smallest box around the points.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Aabb {
        points
            .into_iter()
            .fold(Aabb::EMPTY, |b, p| b.union(&Aabb { min: p, max: p }))
    }

    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Grown by `by` (≥ 0) on both sides of each axis.
    pub fn grown(&self, by: DVec3) -> Aabb {
        Aabb {
            min: self.min - by,
            max: self.max + by,
        }
    }

    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    pub fn center(&self) -> DVec3 {
        self.min * 0.5 + self.max * 0.5
    }

    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            self.extent().length()
        }
    }

    /// The largest coordinate in magnitude.
    pub fn max_abs(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// The box, in an outer space, of what lies in this one; `None` where that is anywhere.
    ///
    /// `inward` defines the space, and `outward` is only nearly its inverse: steps on the
    /// way may be strong and cancel. With E = inward·outward − I, a shift included, the
    /// point of b is outward·(b − e), where (I + E)·e = E·b: e is at most E over |b| + |e|,
    /// row by row, and |e| at most 2|E||b| where |E| ≤ 1/2. So the box grows by that; E is
    /// what it is found to be and the roundings of its own products.
    pub fn placed(&self, inward: &Affine, outward: &Affine) -> Option<Aabb> {
        if self.is_empty() {
            return Some(Aabb::EMPTY);
        }
        let around = inward.then_after(outward);
        // Magnitudes of what was summed up, for the rounding of each sum.
        let rounding = 16.0 * f64::EPSILON;
        let sum = |r: usize, of: [f64; 3]| -> f64 {
            (0..3).map(|k| inward.linear()[k][r].abs() * of[k]).sum()
        };
        let outer: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|c| outward.linear()[c][k].abs()).sum());
        let rows = DVec3::from_array(std::array::from_fn(|r| {
            let identity = Affine::IDENTITY.linear();
            let off = |c: usize| (around.linear()[c][r] - identity[c][r]).abs();
            (0..3).map(off).sum::<f64>() + rounding * sum(r, outer)
        }));
        let shift = DVec3::from_array(std::array::from_fn(|r| {
            let sums = sum(r, outward.translation.map(f64::abs)) + inward.translation[r].abs();
            around.translation[r].abs() + rounding * sums
        }));
        // As comparisons that NaN does not pass.
        if !(rows.cmple(DVec3::splat(0.5)).all() && shift.is_finite()) {
            return None;
        }
        let largest = self.max_abs();
        let off = 2.0 * (rows.max_element() * largest + shift.max_element());
        let grown = self.grown(rows * (largest + off) + shift);
        let corner = |p: DVec3| DVec3::from_array(outward.point(p.to_array()));
        let placed = Aabb::of_points(grown.corners().map(corner));
        placed.is_finite().then_some(placed)
    }

    /// The smallest f32 box that contains this one, or what of it f32 can reach: an
    /// infinite box would leave no structure anything to tell other boxes by.
    pub fn outward(&self) -> Aabb32 {
        if self.min.cmpgt(self.max).any() {
            return Aabb32::EMPTY;
        }
        let finite = |x: f32| x.clamp(-f32::MAX, f32::MAX);
        Aabb32 {
            min: self.min.to_array().map(|x| finite(round_down(x))),
            max: self.max.to_array().map(|x| finite(round_up(x))),
        }
    }
}

impl Aabb32 {
    pub const EMPTY: Aabb32 = Aabb32 {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// The box of what has no bounds.
    pub const EVERYTHING: Aabb32 = Aabb32 {
        min: [f32::NEG_INFINITY; 3],
        max: [f32::INFINITY; 3],
    };

    pub fn union(&self, other: &Aabb32) -> Aabb32 {
        let lower = |a: f32, b: f32| if a < b { a } else { b };
        let upper = |a: f32, b: f32| if a > b { a } else { b };
        Aabb32 {
            min: std::array::from_fn(|k| lower(self.min[k], other.min[k])),
            max: std::array::from_fn(|k| upper(self.max[k], other.max[k])),
        }
    }

    /// Half the surface area, the measure that SAH costs are proportional to.
    pub fn half_area(&self) -> f32 {
        let d: [f32; 3] = std::array::from_fn(|k| (self.max[k] - self.min[k]).clamp(0.0, f32::MAX));
        d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
    }

    /// Twice the centre: a sum instead of a mean, so that it cannot lose bits.
    pub fn center2(&self, axis: usize) -> f32 {
        self.min[axis] + self.max[axis]
    }

    pub fn widened(&self) -> Aabb {
        Aabb {
            min: DVec3::from_array(self.min.map(f64::from)),
            max: DVec3::from_array(self.max.map(f64::from)),
        }
    }
}

/// The largest f32 not above `x`.
pub fn round_down(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// The smallest f32 not below `x`.
pub fn round_up(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) < x { y.next_up() } else { y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn outward_rounding_keeps_every_point(bits in any::<u64>()) {
            let x = f64::from_bits(bits);
            prop_assume!(!x.is_nan());
            prop_assert!(f64::from(round_down(x)) <= x);
            prop_assert!(f64::from(round_up(x)) >= x);
            // And no further than one step.
            if f64::from(x as f32) == x {
                prop_assert_eq!(round_down(x), round_up(x));
            }
        }
    }

    #[test]
    fn the_empty_box_is_the_identity_of_union() {
        let b = Aabb::new(DVec3::ZERO, DVec3::ONE);
        assert_eq!(Aabb::EMPTY.union(&b), b);
        assert!(Aabb::EMPTY.is_empty() && !b.is_empty());
    }
}
