//! Axis-aligned bounding boxes: f64 for scenes, f32 rounded outward for trees.
//!
//! Invariants: [`Aabb::outward`] keeps every point whose coordinates are in the range of
//! f32. It clamps coordinates beyond ±`f32::MAX`, and slab tests treat such sides as
//! open. An empty box has `min > max` on every axis and is the identity of
//! [`Aabb::union`].

use super::affine::Affine;
use glam::DVec3;

/// A box in f64. The owner states its space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: DVec3,
    pub max: DVec3,
}

/// A box in f32, rounded outward, as tree nodes store it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb32 {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Aabb {
    /// The box without points: `min` is +∞ and `max` is −∞ on every axis.
    pub const EMPTY: Aabb = Aabb {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    pub fn new(min: DVec3, max: DVec3) -> Aabb {
        Aabb { min, max }
    }

    /// Returns the smallest box around the points; [`Aabb::EMPTY`] if there are none.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Aabb {
        points
            .into_iter()
            .fold(Aabb::EMPTY, |b, p| b.union(&Aabb { min: p, max: p }))
    }

    /// Returns the smallest box around both boxes.
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Moves both sides of each axis outward by `by` (≥ 0).
    pub fn grown(&self, by: DVec3) -> Aabb {
        Aabb {
            min: self.min - by,
            max: self.max + by,
        }
    }

    /// Whether `min > max`, or an end is NaN, on any axis.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// The centre, as a sum of halves, which does not overflow.
    pub fn center(&self) -> DVec3 {
        self.min * 0.5 + self.max * 0.5
    }

    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the length of the diagonal; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            self.extent().length()
        }
    }

    /// Returns the largest coordinate in magnitude.
    pub fn max_abs(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// The eight corners; bits 0, 1 and 2 of the index choose `max` on x, y and z.
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

    /// Returns a box, in the outer space, around everything in this box; `None` if no
    /// finite box is certain.
    ///
    /// `inward` (outer to inner) defines the space, and `outward` is only nearly its
    /// inverse: maps on the way may be large and cancel. Let E = inward·outward − I,
    /// translation included. The outer position of a point b is outward·(b − e) with
    /// (I + E)·e = E·b. So |e| ≤ |E|(|b| + |e|) row by row, and |e| ≤ 2|E||b| where |E| ≤ 1/2.
    /// The box grows by that bound before its corners are mapped. E is the computed
    /// difference plus the roundings of its own products (lemma X8,
    /// docs/numerics/boxes.md).
    pub fn placed(&self, inward: &Affine, outward: &Affine) -> Option<Aabb> {
        if self.is_empty() {
            return Some(Aabb::EMPTY);
        }
        let around = inward.then_after(outward);
        // Roundings of each sum, relative to the magnitudes of its terms. Lemma X8,
        // docs/numerics/boxes.md.
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
        // The comparisons are false for NaN.
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

    /// Returns the smallest f32 box that contains this box, clamped to ±`f32::MAX`:
    /// infinite boxes cannot be told apart by a tree's build.
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

    /// The box of primitives without bounds.
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

    /// Returns half the surface area, to which SAH costs are proportional.
    pub fn half_area(&self) -> f32 {
        let d: [f32; 3] = std::array::from_fn(|k| (self.max[k] - self.min[k]).clamp(0.0, f32::MAX));
        d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
    }

    /// Returns twice the centre on one axis: a sum instead of a mean, so that no bit is
    /// lost by halving.
    pub fn center2(&self, axis: usize) -> f32 {
        self.min[axis] + self.max[axis]
    }

    /// Converts to f64, exactly.
    pub fn widened(&self) -> Aabb {
        Aabb {
            min: DVec3::from_array(self.min.map(f64::from)),
            max: DVec3::from_array(self.max.map(f64::from)),
        }
    }
}

/// Returns the largest f32 not above `x`.
pub fn round_down(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// Returns the smallest f32 not below `x`.
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
            // A number that f32 represents is not moved.
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
