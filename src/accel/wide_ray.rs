//! One ray through a wide tree: all children of a node at once (Wald, Benthin,
//! Boulos: Getting Rid of Packets, 2008).

use super::frustum::WideStack;
use super::slabs::Slabs;
use super::wide::WideTree;
use crate::math::lanes::{Lanes, Mask, Register};

impl WideTree {
    /// Visits every leaf that the ray may meet between `t_min` and `limit`,
    /// nearest first. `leaf(first, count, limit)` returns the new limit; the
    /// walk ends where it is −∞. `slabs` are the constants of an f32 ray, whose
    /// pad has room for the rounding of an f64 one.
    #[inline(always)]
    pub fn walk_ray(
        &self,
        slabs: &Slabs<f32>,
        t_min: f32,
        mut limit: f32,
        stack: &mut WideStack,
        mut leaf: impl FnMut(usize, usize, f32) -> f32,
    ) {
        // By the direction's sign, a box is entered through its lower or its
        // upper plane: the same two numbers as the packets' min and max.
        let axes = slabs.axes(0).map(|(inv, low, high)| {
            let [low, high] = [low, high].map(Register::splat);
            let (near, far, side) = if inv >= 0.0 {
                (low, high, 0)
            } else {
                (high, low, 1)
            };
            (Register::splat(inv), near, far, side)
        });
        let t_min = Register::splat(t_min);
        let mut top = 0;
        let mut node = 0_usize;
        loop {
            let here = &self.nodes[node];
            let plane = |k: usize, far: bool| {
                let (inv, enter, exit, side) = axes[k];
                if far {
                    Register::load(&here.bounds[k][1 - side]).mul_add(inv, exit)
                } else {
                    Register::load(&here.bounds[k][side]).mul_add(inv, enter)
                }
            };
            let enter = plane(0, false)
                .max(plane(1, false))
                .max(plane(2, false))
                .max(t_min);
            let exit = plane(0, true)
                .min(plane(1, true))
                .min(plane(2, true))
                .min(Register::splat(limit));
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
                    stack.child[at] = here.child[place];
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
