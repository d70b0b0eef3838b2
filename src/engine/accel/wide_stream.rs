//! Stream traversal of a wide BVH by incoherent rays. The stack holds pairs of a child and a
//! set of rays, so that each node is fetched once for all rays that reach it (after Barringer
//! and Akenine-Möller: Dynamic Ray Stream Traversal, SIGGRAPH 2014).
//!
//! Each ray is tested against all children of a node at once, as a single ray would be. Rays
//! share the memory accesses: those that start near each other pass the same nodes near the
//! root and near the leaves, whatever their directions.

use super::baselines::bvh4::Child;
use super::builders::MAX_DEPTH;
use super::prefetch::prefetch;
use super::slabs::Slabs;
use super::wide_bvh::{WIDE, WideBvh};
use crate::math::lanes::{Lanes, Register, add_members, max, min};

/// The most rays of one stream: the bits of a set.
pub const STREAM: usize = 64;
const STACK: usize = MAX_DEPTH * (WIDE - 1) + 1;

/// The slab constants of a stream for the boxes of one tree, in columns.
#[derive(Clone, Debug)]
pub struct BoxRays {
    /// By axis: t = plane·`inv` + `enter` at the plane through which the ray enters a box, and
    /// plane·`inv` + `exit` at the one through which it leaves.
    inv: [[f32; STREAM]; 3],
    enter: [[f32; STREAM]; 3],
    exit: [[f32; STREAM]; 3],
    t_min: [f32; STREAM],
    /// The largest t that still matters; negative if the ray is done.
    pub limit: [f32; STREAM],
}

impl Default for BoxRays {
    fn default() -> BoxRays {
        let zero = [0.0; STREAM];
        BoxRays {
            inv: [zero; 3],
            enter: [zero; 3],
            exit: [zero; 3],
            t_min: zero,
            limit: [-1.0; STREAM],
        }
    }
}

impl BoxRays {
    /// Stores the constants of one packet, from ray `first` on. `slabs` are those of the rays
    /// in f32, whose pad covers the rounding of f64 rays.
    #[inline(always)]
    pub fn put<L: Lanes<Scalar = f32>>(&mut self, first: usize, slabs: &Slabs<L>, t_min: L) {
        for k in 0..3 {
            let (inv, low, high) = slabs.axis(k);
            let upward = inv.ge(L::zero());
            inv.store(&mut self.inv[k][first..]);
            L::select(upward, low, high).store(&mut self.enter[k][first..]);
            L::select(upward, high, low).store(&mut self.exit[k][first..]);
        }
        t_min.store(&mut self.t_min[first..]);
    }
}

/// The stack of one traversal.
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

impl WideBvh {
    /// Visits every leaf that some ray of the set `active` may meet, with the set of those
    /// rays; bit i is ray i. `leaf(rays, first, count, set)` sets new limits and returns the
    /// rays that are done. `expect(first)` is called when a leaf is put on the stack. Children
    /// come nearest first if `NEAREST`, else in the tree's order.
    #[inline(always)]
    pub fn walk_stream<const NEAREST: bool>(
        &self,
        rays: &mut BoxRays,
        mut active: u64,
        stack: &mut StreamStack,
        expect: impl Fn(usize),
        mut leaf: impl FnMut(&mut BoxRays, usize, usize, u64) -> u64,
    ) {
        if active == 0 {
            return;
        }
        let mut top = 0;
        let mut node = 0_usize;
        let mut set = active;
        loop {
            let here = &self.nodes[node];
            let zero = Register::zero();
            let mut nearest = Register::splat(f32::INFINITY);
            let all = (1_u32 << here.count) - 1;
            let mut words = [zero; 2];
            for (half, word) in words.iter_mut().enumerate() {
                let mut left = (set >> (32 * half)) as u32;
                while left != 0 {
                    let bit = left & left.wrapping_neg();
                    let i = (32 * half + left.trailing_zeros() as usize) % STREAM;
                    left ^= bit;
                    let plane = |k: usize, far: bool| {
                        let downward = rays.inv[k][i].to_bits() >> 31;
                        let side = (downward ^ u32::from(far)) as usize;
                        let add = if far { &rays.exit } else { &rays.enter };
                        let plane = Register::load(&here.bounds[k][side]);
                        let inv = Register::splat(rays.inv[k][i]);
                        plane.mul_add(inv, Register::splat(add[k][i]))
                    };
                    let enter = max(plane(0, false), plane(1, false));
                    let enter = max(enter, max(plane(2, false), Register::splat(rays.t_min[i])));
                    let exit = min(plane(0, true), plane(1, true));
                    let exit = min(exit, min(plane(2, true), Register::splat(rays.limit[i])));
                    let reached = Lanes::le(enter, exit);
                    if NEAREST {
                        let nearer = min(nearest, enter);
                        nearest = <Register as Lanes>::select(reached, nearer, nearest);
                    }
                    *word = add_members(reached, *word, bit);
                }
            }
            let words = words.map(|word| word.to_array());
            let sets: [u64; WIDE] = std::array::from_fn(|place| {
                let word = |half: usize| u64::from(f32::to_bits(words[half][place]));
                word(0) | word(1) << 32
            });
            let mut met = 0_u32;
            for (place, set) in sets.iter().enumerate() {
                met |= u32::from(*set != 0) << place;
            }
            met &= all;
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
