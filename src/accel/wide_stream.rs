//! Many incoherent rays through a wide tree together: a stack of (child, set of
//! rays), so that each node is fetched once for all rays that reach it (after
//! the stream traversal of Barringer and Akenine-Möller: Dynamic Ray Stream
//! Traversal, SIGGRAPH 2014).
//!
//! Each ray meets all children of a node at once, as alone. What is shared is
//! memory: rays that start near each other pass the same nodes at first and at
//! last, whatever their directions.

use super::build::MAX_DEPTH;
use super::bvh::Child;
use super::prefetch::prefetch;
use super::slabs::Slabs;
use super::wide::{WIDE, WideTree};
use crate::math::lanes::{Lanes, Mask, Register, max, min};

/// Rays of one walk at most: bits of a set.
pub const STREAM: usize = 64;
const STACK: usize = MAX_DEPTH * (WIDE - 1) + 1;

/// One ray's constants for the boxes of one tree.
#[derive(Clone, Copy, Debug, Default)]
pub struct StreamRay {
    /// By axis: 1 / direction, and what is added to it times the plane that the
    /// ray enters through, and leaves through.
    inv: [f32; 3],
    enter: [f32; 3],
    exit: [f32; 3],
    /// By axis: 1 where the ray enters through the upper plane.
    side: [u8; 3],
    t_min: f32,
    /// Nothing beyond matters; negative where the ray is done.
    pub limit: f32,
}

impl StreamRay {
    /// `slabs`: of the ray in f32, whose pad has room for the rounding of an
    /// f64 one.
    #[inline(always)]
    pub fn new(slabs: &Slabs<f32>, t_min: f32, limit: f32) -> StreamRay {
        let mut ray = StreamRay {
            t_min,
            limit,
            ..StreamRay::default()
        };
        for k in 0..3 {
            let (inv, low, high) = slabs.axis(k);
            ray.inv[k] = inv;
            (ray.enter[k], ray.exit[k]) = if inv >= 0.0 { (low, high) } else { (high, low) };
            ray.side[k] = u8::from(inv < 0.0);
        }
        ray
    }
}

/// Room for one walk.
pub struct StreamStack {
    child: [Child; STACK],
    rays: [u64; STACK],
}

impl Default for StreamStack {
    fn default() -> StreamStack {
        StreamStack {
            child: [Child::node(0); STACK],
            rays: [0; STACK],
        }
    }
}

impl WideTree {
    /// Visits every leaf that some ray of the set `active` (bit i: `rays[i]`)
    /// may meet, with those that may. `leaf(rays, first, count, set)` sets new
    /// limits, and returns the rays that are done for good. Nearest first where
    /// `NEAREST`, else in the tree's order.
    #[inline(always)]
    pub fn walk_stream<const NEAREST: bool>(
        &self,
        rays: &mut [StreamRay; STREAM],
        mut active: u64,
        stack: &mut StreamStack,
        expect: impl Fn(usize),
        mut leaf: impl FnMut(&mut [StreamRay; STREAM], usize, usize, u64) -> u64,
    ) {
        if active == 0 {
            return;
        }
        let mut top = 0;
        let mut node = 0_usize;
        let mut set = active;
        loop {
            let here = &self.nodes[node];
            let mut sets = [0_u64; WIDE];
            let mut met = 0_u32;
            let mut nearest = Register::splat(f32::INFINITY);
            let all = (1_u32 << here.count) - 1;
            let mut left = set;
            while left != 0 {
                let i = left.trailing_zeros() as usize;
                left &= left - 1;
                let ray = &rays[i];
                let enter = |k: usize| {
                    let side = usize::from(ray.side[k] & 1);
                    let plane = Register::load(&here.bounds[k][side]);
                    plane.mul_add(Register::splat(ray.inv[k]), Register::splat(ray.enter[k]))
                };
                let exit = |k: usize| {
                    let side = usize::from(ray.side[k] & 1);
                    let plane = Register::load(&here.bounds[k][1 - side]);
                    plane.mul_add(Register::splat(ray.inv[k]), Register::splat(ray.exit[k]))
                };
                let t_in = max(max(enter(0), enter(1)), enter(2));
                let t_in = max(t_in, Register::splat(ray.t_min));
                let t_out = min(min(exit(0), exit(1)), exit(2));
                let reached = t_in.le(min(t_out, Register::splat(ray.limit)));
                let mut bits = reached.bits() & all;
                if NEAREST {
                    nearest = <Register as Lanes>::select(reached, min(nearest, t_in), nearest);
                }
                met |= bits;
                while bits != 0 {
                    let place = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    sets[place % WIDE] |= 1 << i;
                }
            }
            let base = top;
            let keys = nearest.to_array();
            let mut order = [0.0_f32; WIDE];
            while met != 0 {
                let place = met.trailing_zeros() as usize % WIDE;
                met &= met - 1;
                let child = here.child[place];
                match child.leaf_range() {
                    Some(range) => expect(range.start),
                    None => prefetch(&self.nodes[child.index()]),
                }
                let mut at = top;
                if NEAREST {
                    let key = keys[place];
                    while at > base && order[at - 1 - base] < key {
                        stack.child[at] = stack.child[at - 1];
                        stack.rays[at] = stack.rays[at - 1];
                        order[at - base] = order[at - 1 - base];
                        at -= 1;
                    }
                    order[at - base] = key;
                }
                stack.child[at] = child;
                stack.rays[at] = sets[place];
                top += 1;
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                set = stack.rays[top] & active;
                if set == 0 {
                    continue;
                }
                let child = stack.child[top];
                let Some(range) = child.leaf_range() else {
                    node = child.index();
                    break;
                };
                active &= !leaf(rays, range.start, range.len(), set);
                if active == 0 {
                    return;
                }
            }
        }
    }
}
