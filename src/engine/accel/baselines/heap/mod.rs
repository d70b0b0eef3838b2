//! Best-first traversal of a bounding-volume hierarchy (Kay and Kajiya, Ray
//! Tracing Complex Scenes, 1986): a priority queue holds the volumes that the
//! packet has met, and the nearest is opened next. At one lane no order opens
//! fewer nodes; the price is the queue.
//!
//! The tree is [`Bvh4`], four-wide by the surface area heuristic. Its volumes
//! are its boxes ([`Boxes`]) or spheres ([`Spheres`]).
//!
//! Invariant: a node's interval contains those that [`Slabs`] gives the boxes of
//! all entries below, so no entry is missed that a linear scan meets. A box's
//! does by monotonicity; a sphere's does since its pad exceeds that of boxes by
//! more than its own roundings. The walk ends when the nearest volume lies
//! behind every lane's limit. suite.rs holds walks against the linear scan,
//! tests/structures/accel.rs pictures.

mod queue;
mod spheres;

pub use queue::Queue;
pub use spheres::Spheres;

use crate::accel::baselines::bvh4::{Bvh4, Node, WIDTH};
use crate::accel::baselines::bvh4_build::{Bvh4Quality, build};
use crate::accel::baselines::count::Count;
use crate::accel::baselines::index::{Figures, Index, Leaf, Primitives};
use crate::accel::slabs::Slabs;
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// What bounds the children of a tree's nodes.
pub trait Volumes: Send + Sync {
    /// A packet's, for all volumes of the tree.
    type Constants<L: Lanes>: Copy;

    fn constants<L: Lanes>(slabs: &Slabs<L>) -> Self::Constants<L>;

    /// From where to where a child may be met: (enter, exit). Both are NaN-free
    /// or conservative under `enter.max(t_min)` and `exit.min(limit)`.
    fn interval<L: Lanes>(
        &self,
        constants: &Self::Constants<L>,
        node: usize,
        of: &Node,
        child: usize,
    ) -> (L, L);

    fn bytes(&self) -> usize;
}

/// The tree's own boxes.
#[derive(Clone, Copy, Debug)]
pub struct Boxes;

impl Volumes for Boxes {
    type Constants<L: Lanes> = Slabs<L>;

    #[inline(always)]
    fn constants<L: Lanes>(slabs: &Slabs<L>) -> Slabs<L> {
        *slabs
    }

    #[inline(always)]
    fn interval<L: Lanes>(&self, slabs: &Slabs<L>, _: usize, of: &Node, child: usize) -> (L, L) {
        let at = |b: &[[f32; WIDTH]; 3]| [b[0][child], b[1][child], b[2][child]];
        slabs.interval(at(&of.min), at(&of.max))
    }

    fn bytes(&self) -> usize {
        0
    }
}

/// A tree and its volumes.
#[derive(Clone, Debug)]
pub struct Heap<V> {
    pub tree: Bvh4,
    volumes: V,
}

impl Heap<Boxes> {
    /// The heap, and for each of its entries the primitive that it came from.
    pub fn of_boxes(primitives: &Primitives, quality: &Bvh4Quality) -> (Heap<Boxes>, Vec<u32>) {
        let (tree, order) = build(primitives.boxes, quality);
        let volumes = Boxes;
        (Heap { tree, volumes }, order)
    }
}

impl Heap<Spheres> {
    /// The same with spheres around what the boxes are around.
    pub fn of_spheres(primitives: &Primitives, quality: &Bvh4Quality) -> (Heap<Spheres>, Vec<u32>) {
        let (tree, order) = build(primitives.boxes, quality);
        let volumes = Spheres::around(&tree, |entry| primitives.boxes[order[entry] as usize]);
        (Heap { tree, volumes }, order)
    }
}

impl<V: Volumes> Index for Heap<V> {
    type Scratch<L: Lanes> = Queue<L>;

    fn bounds(&self) -> Aabb32 {
        self.tree.bounds
    }

    fn bytes(&self) -> usize {
        Index::bytes(&self.tree) + self.volumes.bytes()
    }

    fn figures(&self) -> Figures {
        self.tree.figures()
    }

    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        self.tree.group(order, key);
    }

    #[inline(never)]
    fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        mut limit: L,
        queue: &mut Queue<L>,
        counter: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        let mut active = t_min.le(limit);
        if self.tree.nodes.is_empty() {
            counter.leaf(active);
            return leaf(0, self.tree.len, active, limit);
        }
        let constants = V::constants(slabs);
        let infinity = L::splat(L::Scalar::INFINITY);
        queue.clear();
        let mut index = 0;
        loop {
            counter.node(active);
            let node = &self.tree.nodes[index];
            for child in 0..node.count as usize {
                let (enter, exit) = self.volumes.interval(&constants, index, node, child);
                let enter = enter.max(t_min);
                let reached = enter.le(exit.min(limit));
                if reached.any() {
                    let enter = L::select(reached, enter, infinity);
                    queue.push(enter.least(), node.child[child], enter);
                }
            }
            // The nearest of all that some lane can still use.
            index = loop {
                let Some((key, child, enter)) = queue.pop() else {
                    return limit;
                };
                active = enter.le(limit);
                if active.none() {
                    // What follows is no nearer, for no lane.
                    if key > limit.greatest() {
                        return limit;
                    }
                    continue;
                }
                match child.leaf_range() {
                    None => break child.index(),
                    Some(entries) => {
                        counter.leaf(active);
                        limit = leaf(entries.start, entries.len(), active, limit);
                    }
                }
            };
        }
    }
}
