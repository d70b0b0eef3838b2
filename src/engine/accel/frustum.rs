//! The volume of a beam, and its traversal of a wide BVH.
//!
//! Rays that advance along one axis k with the same sign are lines x = a + u·z, y = b + v·z
//! over the depth z along k. The volume is the rectangle of their slopes, [u₀, u₁] × [v₀,
//! v₁], over the box of their origins. All children of a node are tested against it at once
//! (Wald, Ize, Kensler, Knoll, Parker 2006; Reshetov, Soupikov, Hurley 2005).
//!
//! The test is conservative (docs/numerics/beams.md, B16). The origins' box grows by the pad
//! of [`super::Slabs`] at the precision of f32, the least normal number included; slopes are
//! rounded outward; and the remaining roundings are relative to the distances that the pad
//! is relative to. So no box is left out that a ray of the beam meets at any precision.

use super::baselines::bvh4::Child;
use super::builders::MAX_DEPTH;
use super::prefetch::prefetch;
use super::slabs::SKEW;
use super::wide_bvh::{WIDE, WideBvh, WideNode};
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask, Register, max, min};

const STACK: usize = MAX_DEPTH * (WIDE - 1) + 1;

/// The volume of a beam, in the space of the tree that is walked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frustum {
    /// The axes (a, b, k); the rays advance along k.
    pub axes: [usize; 3],
    /// The sign of the directions along k. A depth is the coordinate times this.
    pub sign: f32,
    /// The padded box of the origins along (a, b, k); k is times the sign.
    low: [f32; 3],
    high: [f32; 3],
    /// The least depth, counted from the origins, at which a ray begins.
    floor: f32,
    /// The least and the greatest slope along a and along b.
    slopes: [[f32; 2]; 2],
}

impl Frustum {
    /// Makes the volume from the box `low`, `high` of the origins along (a, b, k), the slopes
    /// of the rays, and the tree's `bounds`. Slopes need not be rounded outward.
    #[inline(always)]
    pub fn new(
        axes: [usize; 3],
        sign: f32,
        (low, high): ([f32; 3], [f32; 3]),
        floor: f32,
        slopes: [[f32; 2]; 2],
        bounds: &Aabb32,
    ) -> Frustum {
        let reach: [f32; 3] = std::array::from_fn(|i| {
            let k = axes[i];
            let side = if i == 2 { sign } else { 1.0 };
            let ends = [bounds.min[k] * side, bounds.max[k] * side];
            [low[i], high[i]]
                .into_iter()
                .flat_map(|o| [(ends[0] - o).abs(), (ends[1] - o).abs(), o.abs()])
                .fold(0.0, f32::max)
        });
        let most = reach[0].max(reach[1]).max(reach[2]);
        let least = most * SKEW as f32 + f32::MIN_POSITIVE;
        // B16: twice the pad of X1.
        let pad = reach.map(|r| r * (32.0 * f32::EPSILON) + least);
        let padded: ([f32; 3], [f32; 3]) = (
            std::array::from_fn(|i| low[i] - pad[i]),
            std::array::from_fn(|i| high[i] + pad[i]),
        );
        let outward = |x: f32, by: f32| x + by * (x.abs() * (8.0 * f32::EPSILON) + 1e-30);
        Frustum {
            axes,
            sign,
            low: padded.0,
            high: padded.1,
            floor,
            slopes: slopes.map(|[least, most]| [outward(least, -1.0), outward(most, 1.0)]),
        }
    }
}

impl Frustum {
    /// Returns a box relative to the origins, grown by the pad: its intervals along a, along
    /// b, and of depths.
    #[inline(always)]
    pub fn relative(&self, min: [f32; 3], max: [f32; 3]) -> ([f32; 2], [f32; 2], [f32; 2]) {
        let [a, b, k] = self.axes;
        let (near, far) = if self.sign < 0.0 {
            (-max[k], -min[k])
        } else {
            (min[k], max[k])
        };
        (
            [min[a] - self.high[0], max[a] - self.low[0]],
            [min[b] - self.high[1], max[b] - self.low[1]],
            [near - self.high[2], far - self.low[2]],
        )
    }
}

impl Frustum {
    /// Returns the width of the volume along a (`i` = 0) or b (`i` = 1) at a depth.
    #[inline(always)]
    pub fn width(&self, i: usize, depth: f32) -> f32 {
        let [least, most] = self.slopes[i];
        self.high[i] - self.low[i] + (most - least) * depth
    }
}

/// The stack of one traversal.
pub struct WideStack {
    pub(super) child: [Child; STACK],
    pub(super) key: [f32; STACK],
    /// The parent and the slot of the child.
    from: [(u32, u32); STACK],
}

impl Default for WideStack {
    fn default() -> WideStack {
        WideStack {
            child: [Child::node(0); STACK],
            key: [0.0; STACK],
            from: [(0, 0); STACK],
        }
    }
}

impl WideNode {
    /// Returns the box of a child as (min, max).
    #[inline(always)]
    pub fn child_box(&self, place: usize) -> ([f32; 3], [f32; 3]) {
        let side = |s: usize| std::array::from_fn(|k| self.bounds[k][s][place]);
        (side(0), side(1))
    }
}

impl WideBvh {
    /// Visits every leaf that some ray of the beam may meet before `limit`, the largest depth
    /// that still matters, roughly nearest first. `leaf(node, slot, (first, count), limit)`
    /// returns the new limit; a negative one ends the walk. `expect(first)` is called when a
    /// leaf is put on the stack, so that its blocks can be prefetched.
    #[inline(always)]
    pub fn walk_frustum(
        &self,
        frustum: &Frustum,
        mut limit: f32,
        stack: &mut WideStack,
        expect: impl Fn(usize),
        mut leaf: impl FnMut(&WideNode, usize, (usize, usize), f32) -> f32,
    ) {
        let [a, b, k] = frustum.axes;
        let splat = |x: f32| Register::splat(x);
        let (low, high) = (frustum.low.map(splat), frustum.high.map(splat));
        let [[u0, u1], [v0, v1]] = frustum.slopes;
        let (nu0, pu1, nv0, pv1) = (splat(-u0), splat(u1), splat(-v0), splat(v1));
        let (floor, sign) = (splat(frustum.floor), splat(frustum.sign));
        let near_side = usize::from(frustum.sign < 0.0);
        // If all slopes along an axis agree in sign, the box's near side on that axis bounds
        // the depth as well.
        let toward = |[least, most]: [f32; 2]| {
            if least > 0.0 {
                (splat(1.0 / most), 0)
            } else if most < 0.0 {
                (splat(1.0 / least), 1)
            } else {
                (splat(0.0), 0)
            }
        };
        let (inv_u, side_u) = toward(frustum.slopes[0]);
        let (inv_v, side_v) = toward(frustum.slopes[1]);
        // B16.
        let slack = 1.0 + 8.0 * f32::EPSILON;
        let zero = Register::zero();

        let mut top = 0;
        let mut node = 0_u32;
        loop {
            let here = &self.nodes[node as usize];
            let bounds = |axis: usize, side: usize| Register::load(&here.bounds[axis][side]);
            let x_low = bounds(a, 0) - high[0];
            let x_high = bounds(a, 1) - low[0];
            let y_low = bounds(b, 0) - high[1];
            let y_high = bounds(b, 1) - low[1];
            let near = max(bounds(k, near_side) * sign - high[2], floor);
            let far = bounds(k, 1 - near_side) * sign - low[2];
            let right = max(nu0.mul_add(near, x_high), nu0.mul_add(far, x_high));
            let left = max(pu1.mul_add(near, -x_low), pu1.mul_add(far, -x_low));
            let above = max(nv0.mul_add(near, y_high), nv0.mul_add(far, y_high));
            let below = max(pv1.mul_add(near, -y_low), pv1.mul_add(far, -y_low));
            let x_near = if side_u == 0 { x_low } else { x_high };
            let y_near = if side_v == 0 { y_low } else { y_high };
            let enter = max(max(near, x_near * inv_u), y_near * inv_v);
            let inside = min(min(right, left), min(above, below));
            let reached = inside.ge(zero) & far.ge(floor) & enter.le(splat(limit * slack));
            let mut bits = reached.bits() & ((1_u32 << here.count) - 1);
            if bits != 0 {
                let keys = enter.to_array();
                let base = top;
                loop {
                    let place = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let key = keys[place];
                    let mut at = top;
                    while at > base && stack.key[at - 1] < key {
                        stack.child[at] = stack.child[at - 1];
                        stack.key[at] = stack.key[at - 1];
                        stack.from[at] = stack.from[at - 1];
                        at -= 1;
                    }
                    let child = here.child[place];
                    match child.leaf_range() {
                        Some(range) => expect(range.start),
                        None => prefetch(&self.nodes[child.index()]),
                    }
                    stack.child[at] = child;
                    stack.key[at] = key;
                    stack.from[at] = (node, place as u32);
                    top += 1;
                    if bits == 0 {
                        break;
                    }
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if stack.key[top] > limit * slack {
                    continue;
                }
                let child = stack.child[top];
                let Some(range) = child.leaf_range() else {
                    node = child.index() as u32;
                    break;
                };
                let (parent, place) = stack.from[top];
                let range = (range.start, range.len());
                limit = leaf(&self.nodes[parent as usize], place as usize, range, limit);
                if limit < 0.0 {
                    return;
                }
            }
        }
    }
}
