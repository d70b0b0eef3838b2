//! Best-first traversal of a bounding-volume hierarchy (Kay and Kajiya, Ray Tracing Complex
//! Scenes, 1986). A priority queue holds the volumes that the packet has met, and the nearest
//! is opened next. At one lane no order opens fewer nodes, but the queue costs time.
//!
//! The tree is a [`Bvh4`]. Its volumes are its boxes ([`Boxes`]) or spheres ([`Spheres`]).
//!
//! Invariant: a node's interval contains those that [`Slabs`] gives the boxes of all entries
//! below, so every entry is visited that a linear scan visits. For boxes this follows from
//! monotonicity (docs/numerics/boxes.md, X4); spheres have a pad that exceeds that of boxes
//! by more than their own roundings (X15). The traversal ends when the nearest volume lies
//! behind every lane's limit. index_tests.rs compares traversals with the linear scan, and
//! tests/structures/accel.rs compares pictures.

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

/// The bounding volumes of the children of a tree's nodes.
pub trait Volumes: Send + Sync {
    /// The constants of a packet for all volumes of the tree.
    type Constants<L: Lanes>: Copy;

    fn constants<L: Lanes>(slabs: &Slabs<L>) -> Self::Constants<L>;

    /// Returns the interval (enter, exit) in which a ray may meet a child. NaN must be
    /// conservative under `enter.max(t_min)` and `exit.min(limit)`.
    fn interval<L: Lanes>(
        &self,
        constants: &Self::Constants<L>,
        node: usize,
        of: &Node,
        child: usize,
    ) -> (L, L);

    fn bytes(&self) -> usize;
}

/// The boxes of the tree itself.
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

/// A tree with its volumes.
#[derive(Clone, Debug)]
pub struct Heap<V> {
    pub tree: Bvh4,
    volumes: V,
}

impl Heap<Boxes> {
    /// Builds a heap of boxes, and returns it with the order of the primitives in its leaves.
    pub fn of_boxes(primitives: &Primitives, quality: &Bvh4Quality) -> (Heap<Boxes>, Vec<u32>) {
        let (tree, order) = build(primitives.boxes, quality);
        let volumes = Boxes;
        (Heap { tree, volumes }, order)
    }
}

impl Heap<Spheres> {
    /// Builds a heap of spheres around the entries' boxes, and returns it with the order of
    /// the primitives in its leaves.
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
            // Take the nearest volume that some lane still reaches.
            index = loop {
                let Some((key, child, enter)) = queue.pop() else {
                    return limit;
                };
                active = enter.le(limit);
                if active.none() {
                    // All others are at least as far, for every lane.
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
