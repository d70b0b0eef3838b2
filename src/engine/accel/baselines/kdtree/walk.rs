//! Packets through a k-d tree: each lane has an interval of t in the cell, and
//! a plane splits it (the packet traversal of Wald, Slusallek, Benthin, Wagner:
//! Interactive Rendering with Coherent Ray Tracing, 2001, with padded planes).
//!
//! A plane has two t's, δ apart on each side (see [`Slabs`]): the part before it
//! ends at the later one and the part behind it begins at the earlier one, so
//! that a lane in doubt visits both children. A lane outside a cell has an empty
//! interval, and stays outside, since ends only move inward.

use super::{KdTree, Node};
use crate::accel::baselines::count::Count;
use crate::accel::baselines::index::Leaf;
use crate::accel::baselines::mailbox::Mailbox;
use crate::accel::slabs::Slabs;
use crate::math::lanes::{Lanes, Mask};

/// Room for one walk.
pub struct KdScratch<L: Lanes> {
    node: [u32; KdTree::MAX_DEPTH],
    near: [L; KdTree::MAX_DEPTH],
    far: [L; KdTree::MAX_DEPTH],
    mailbox: Mailbox,
}

impl<L: Lanes> Default for KdScratch<L> {
    fn default() -> KdScratch<L> {
        KdScratch {
            node: [0; KdTree::MAX_DEPTH],
            near: [L::zero(); KdTree::MAX_DEPTH],
            far: [L::zero(); KdTree::MAX_DEPTH],
            mailbox: Mailbox::default(),
        }
    }
}

/// How the packet crosses planes of one axis.
#[derive(Clone, Copy)]
struct Axis<L: Lanes> {
    inv: L,
    /// Added to position·inv: t where the nearer child ends, and where the
    /// farther one begins.
    end: L,
    begin: L,
    /// The upper child is the nearer one.
    down: bool,
    /// Lanes disagree: for these, the other child is the nearer one.
    others: Option<L::Mask>,
}

#[inline(always)]
pub(super) fn walk<L: Lanes>(
    tree: &KdTree,
    slabs: &Slabs<L>,
    t_min: L,
    mut limit: L,
    scratch: &mut KdScratch<L>,
    count: Count,
    leaf: &mut Leaf<L>,
) -> L {
    let (enter, exit) = slabs.interval(tree.bounds.min, tree.bounds.max);
    let mut near = enter.max(t_min);
    let mut far = exit.min(limit);
    let inside = near.le(far);
    if inside.none() || tree.references.is_empty() {
        return limit;
    }
    let lanes = inside.bits();
    let axes = slabs.planes().map(|(inv, low, high)| {
        let negative = inv.lt(L::zero());
        let bits = negative.bits() & lanes;
        let down = bits >> lanes.trailing_zeros() & 1 != 0;
        let (end, begin) = (
            L::select(negative, low, high),
            L::select(negative, high, low),
        );
        let others = if down { !negative } else { negative };
        Axis {
            inv,
            end,
            begin,
            down,
            others: (bits != 0 && bits != lanes).then_some(others),
        }
    });
    let KdScratch {
        node: nodes,
        near: nears,
        far: fars,
        mailbox,
    } = scratch;
    mailbox.begin(tree.len);
    let mut top = 0;
    let mut node = 0;
    loop {
        // Down to a leaf.
        let reached = loop {
            let here = tree.nodes[node];
            let k = here.axis();
            if k == Node::LEAF as usize {
                break true;
            }
            count.node(near.le(far));
            let Axis {
                inv,
                end,
                begin,
                down,
                others,
            } = axes[k];
            let position = L::from_f32(here.position());
            let mut first_far = position.mul_add(inv, end).min(far);
            let mut second_near = position.mul_add(inv, begin).max(near);
            let (mut first_near, mut second_far) = (near, far);
            if let Some(others) = others {
                // These lanes meet the second child first.
                let (ends, begins) = (first_far, second_near);
                first_near = L::select(others, begins, near);
                first_far = L::select(others, far, ends);
                second_near = L::select(others, near, begins);
                second_far = L::select(others, ends, far);
            }
            let (first, second) = if down {
                (here.high(), node + 1)
            } else {
                (node + 1, here.high())
            };
            let to_first = first_near.le(first_far).any();
            let to_second = second_near.le(second_far).any();
            if to_first {
                if to_second {
                    nodes[top] = second as u32;
                    nears[top] = second_near;
                    fars[top] = second_far;
                    top += 1;
                }
                (node, near, far) = (first, first_near, first_far);
            } else if to_second {
                (node, near, far) = (second, second_near, second_far);
            } else {
                break false;
            }
        };
        if reached {
            let references = &tree.references[tree.nodes[node].references()];
            if !references.is_empty() {
                count.leaf(near.le(far));
            }
            for entry in references {
                if !mailbox.first(*entry as usize) {
                    count.spared(1);
                    continue;
                }
                let alive = t_min.le(limit);
                limit = leaf(*entry as usize, 1, alive, limit);
            }
        }
        // The nearest cell that some lane can still use.
        loop {
            if top == 0 {
                return limit;
            }
            top -= 1;
            near = nears[top];
            far = fars[top].min(limit);
            if near.le(far).any() {
                node = nodes[top] as usize;
                break;
            }
        }
    }
}
