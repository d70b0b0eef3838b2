//! One ray through a wide tree: all children of a node at once (Wald, Benthin,
//! Boulos: Getting Rid of Packets, 2008).

use super::frustum::WideStack;
use super::prefetch::prefetch;
use super::slabs::Slabs;
use super::wide::WideTree;
use crate::math::lanes::{Lanes, Mask, Register, max, min};

impl WideTree {
    /// Visits every leaf that the ray may meet between `t_min` and `limit`,
    /// nearest first. `leaf(first, count, limit)` returns the new limit; the
    /// walk ends where it is −∞. `slabs` are the constants of an f32 ray, whose
    /// pad has room for the rounding of an f64 one.
    #[inline(always)]
    pub fn walk_ray<const FETCH: bool>(
        &self,
        slabs: &Slabs<f32>,
        t_min: f32,
        mut limit: f32,
        stack: &mut WideStack,
        expect: impl Fn(usize),
        mut leaf: impl FnMut(usize, usize, f32) -> f32,
    ) {
        // By the direction's sign, a box is entered through its lower or its
        // upper plane: the same two numbers as the packets' min and max.
        let axis = |k: usize| {
            let (inv, low, high) = slabs.axis(k);
            let (near, far, side) = if inv >= 0.0 {
                (low, high, 0)
            } else {
                (high, low, 1)
            };
            let splat = Register::splat;
            (splat(inv), splat(near), splat(far), side)
        };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let t_min = Register::splat(t_min);
        let mut top = 0;
        let mut node = 0_usize;
        loop {
            let here = &self.nodes[node];
            let enter = |k: usize, axis: &(Register, Register, Register, usize)| {
                Register::load(&here.bounds[k][axis.3]).mul_add(axis.0, axis.1)
            };
            let exit = |k: usize, axis: &(Register, Register, Register, usize)| {
                Register::load(&here.bounds[k][1 - axis.3]).mul_add(axis.0, axis.2)
            };
            let enter = max(max(enter(0, &x), enter(1, &y)), max(enter(2, &z), t_min));
            let exit = min(min(exit(0, &x), exit(1, &y)), exit(2, &z));
            let exit = min(exit, Register::splat(limit));
            let mut bits = enter.le(exit).bits() & ((1_u32 << here.count) - 1);
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
                        at -= 1;
                    }
                    let child = here.child[place];
                    if FETCH {
                        match child.leaf_range() {
                            Some(range) => expect(range.start),
                            None => prefetch(&self.nodes[child.index()]),
                        }
                    }
                    stack.child[at] = child;
                    stack.key[at] = key;
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
                if stack.key[top] > limit {
                    continue;
                }
                let child = stack.child[top];
                let Some(range) = child.leaf_range() else {
                    node = child.index();
                    break;
                };
                limit = leaf(range.start, range.len(), limit);
            }
        }
    }
}
