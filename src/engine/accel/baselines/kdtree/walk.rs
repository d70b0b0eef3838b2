//! The traversal of a k-d tree by packets. Each lane has an interval of t in the cell, and a
//! plane splits it (Wald, Slusallek, Benthin, Wagner: Interactive Rendering with Coherent Ray
//! Tracing, 2001; here planes are padded).
//!
//! A plane has two t's, δ apart on each side (see [`Slabs`]). The part before the plane ends
//! at the later t, and the part behind it begins at the earlier one, so that a lane within the
//! pad visits both children. A lane outside a cell has an empty interval, and stays outside,
//! because ends only move inward.

use super::{KdTree, Node};
use crate::accel::baselines::count::Count;
use crate::accel::baselines::index::Leaf;
use crate::accel::baselines::mailbox::Mailbox;
use crate::accel::slabs::Slabs;
use crate::math::lanes::{Lanes, Mask};

/// The stack and the mailbox of one traversal.
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

/// The constants with which a packet crosses the planes of one axis.
#[derive(Clone, Copy)]
struct Axis<L: Lanes> {
    inv: L,
    /// position·inv + `end` is the t at which the nearer child ends, and position·inv +
    /// `begin` the t at which the farther one begins.
    end: L,
    begin: L,
    /// Whether the upper child is the nearer one.
    down: bool,
    /// The lanes for which the other child is the nearer one, if lanes disagree.
    others: Option<L::Mask>,
}

/// Walks a packet through the tree; see [`Index::walk`](super::Index::walk).
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
        // Go down to a leaf.
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
                // These lanes enter the second child first.
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
        // Take the nearest cell that some lane still reaches.
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
