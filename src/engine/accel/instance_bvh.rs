//! Instance BVHs: one tree over the edges of each shared node, and one over the roots.
//!
//! Scenes of very many instances but few nodes are traced through them; memory and build
//! time follow the nodes and edges. A node's boxes are in its own space, and rays enter it
//! by the composed matrix of their path. That only prunes: at a leaf the world ray and the
//! matrix of the whole path are used, as in a flat world.
//!
//! Invariant: at the t of a hit that counts, the ray is inside every box on the path to the
//! shape, padded as [`InstanceBvh::padded`] says (docs/numerics/boxes.md, X9). A box contains
//! all points that the *stored inverses* map into the boxes below, so the rounding of an
//! inverse is in the box, and the rounding of the rays is in the pad. Checked by
//! tests/structures/nested.rs: the hits are those of a flat world, bit for bit.

use super::bounds::{FAR, world_bounds};
use super::builders::{BuildQuality, build_boxes};
use super::wide_bvh::WideBvh;
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{
    Edge, Instances, NodeId, Placement, Scene, ShapeId, Tables, Target, children_first, far_center,
    shape_center, used_nodes,
};
use glam::DVec3;

/// An edge of the scene's graph, with the number of instances below its node's earlier
/// edges.
#[derive(Clone, Copy, Debug)]
pub struct InstanceEdge {
    pub edge: Edge,
    pub before: u64,
}

/// The tree over those edges of one node that lead to shapes.
#[derive(Clone, Debug)]
pub struct InstanceBvh {
    /// The tree over `edges`, in the node's space.
    pub tree: WideBvh,
    /// Edges that lead to bounded shapes, in the order of the tree's leaves.
    pub edges: Vec<InstanceEdge>,
    /// Edges that lead to unbounded shapes.
    pub unbounded: Vec<InstanceEdge>,
    /// The box around all bounded shapes.
    bounds: Aabb,
    /// The largest product of the edges' condition numbers (2-norm) along a path below: how
    /// many times a pad in a shape's space may look larger here. Infinite if a placed box
    /// has no bound.
    condition: f64,
    /// The number of edges on the longest path below.
    levels: f64,
    /// The largest translation on a path below, in this space. Translations may cancel, but
    /// the composed matrices carry roundings of their size.
    shift: f64,
}

/// All instance BVHs of a scene.
#[derive(Clone, Debug)]
pub struct InstanceBvhs {
    /// The tree over the rows of [`Tables::roots`].
    pub roots: InstanceBvh,
    /// By node; `None` if the node is unused or has no shapes below.
    nodes: Vec<Option<InstanceBvh>>,
    /// By shape: its box in its own space; a mesh's box is about the mesh's centre.
    pub own: Vec<Aabb32>,
}

/// The most boxes, over all edges, that boxes of edges are made from. The box of an edge
/// unites placed boxes from several levels below, because boxes of boxes of rotated boxes
/// grow too large.
const PIECES: usize = 1 << 20;
/// The most boxes that the box of one edge is made from.
const PIECES_OF_ONE: usize = 128;
/// The most levels below an edge from which these boxes come.
const PIECE_LEVELS: usize = 8;

/// How far a hit may lie outside its shape's box, in roundings of the shape's size: the pad
/// of 32, and the roundings of the interval and of the ray (docs/numerics/boxes.md, X9).
const OUTSIDE: f64 = 80.0;

impl InstanceBvhs {
    /// Builds the trees of all used nodes. `own` holds each shape's box in its own space.
    pub fn build(scene: &Scene, instances: &Instances, own: Vec<Aabb32>) -> InstanceBvhs {
        let order = children_first(scene).unwrap_or_default();
        let used = used_nodes(scene, &order);
        let edges = scene.edges.len() + scene.roots.len();
        let mut builder = Builder {
            scene,
            nodes: vec![None; scene.nodes.len()],
            own: &own,
            pieces: (PIECES / edges.max(1)).min(PIECES_OF_ONE),
        };
        for node in order {
            if used[node as usize] && instances.below(NodeId(node)) > 0 {
                let rows = scene.nodes.children[node as usize].clone();
                let edges = rows.map(|row| InstanceEdge {
                    edge: scene.edges.row(row as usize),
                    before: instances.before_edge(row as usize),
                });
                builder.nodes[node as usize] = Some(builder.tree(edges));
            }
        }
        let roots = builder.tree((0..scene.roots.len()).map(|row| InstanceEdge {
            edge: scene.roots.row(row),
            before: instances.before_root(row),
        }));
        let nodes = builder.nodes;
        InstanceBvhs { roots, nodes, own }
    }

    /// Returns the tree of a node that an edge leads to.
    #[inline(always)]
    pub fn node(&self, node: NodeId) -> Option<&InstanceBvh> {
        self.nodes[node.index()].as_ref()
    }

    /// Returns a box in world space, about `center`, that contains the boxes of all bounded
    /// instances as [`super::TlasEntry`] has them.
    pub fn bounds(&self, center: DVec3) -> Aabb32 {
        let bounds = &self.roots.bounds;
        if self.roots.has_no_bound() {
            return Aabb32::EVERYTHING;
        }
        if bounds.is_empty() {
            return Aabb32::EMPTY;
        }
        let about = Aabb::new(bounds.min - center, bounds.max - center);
        // Entries' boxes are rounded to f32 once, and to f64 where they are placed (X9).
        let more =
            about.max_abs() * f64::from(f32::EPSILON) + bounds.max_abs() * (64.0 * f64::EPSILON);
        about.grown(DVec3::splat(more)).outward()
    }

    /// Returns the largest coordinate of the bounded instances, in world space.
    pub fn extent(&self) -> f64 {
        match &self.roots {
            roots if roots.has_no_bound() => f64::INFINITY,
            roots if roots.bounds.is_empty() => 0.0,
            roots => roots.bounds.max_abs(),
        }
    }

    /// Returns the point in world space that the boxes of a nested world count from (X10).
    pub fn center(&self) -> DVec3 {
        far_center(&self.roots.bounds, FAR)
    }

    pub fn bytes(&self) -> usize {
        let trees = self.nodes.iter().flatten().chain([&self.roots]);
        let edges =
            |t: &InstanceBvh| (t.edges.len() + t.unbounded.len()) * size_of::<InstanceEdge>();
        trees.map(|t| t.tree.bytes() + edges(t)).sum::<usize>()
            + self.nodes.len() * size_of::<Option<InstanceBvh>>()
            + self.own.len() * size_of::<Aabb32>()
    }
}

/// The extent of a set of rays in a node's space.
#[derive(Clone, Copy, Debug)]
pub struct RayExtent {
    /// The largest coordinate of any origin, in the node's space.
    pub org: f64,
    /// The least and the greatest ∞-norm of the directions, in the node's space.
    pub dir: [f64; 2],
    /// The largest coordinate in world space of any origin.
    pub world_org: f64,
    /// The greatest ∞-norm of the directions in world space.
    pub world_dir: f64,
    /// The largest coordinate in world space of any origin and of any point where a ray may
    /// hit.
    pub world: f64,
}

impl InstanceBvh {
    /// Returns whether a placed box below has no bound.
    fn has_no_bound(&self) -> bool {
        self.condition == f64::INFINITY
    }

    /// Returns the bounds to make slabs for, so that their pad (32 roundings of the largest
    /// distance from bounds or origin) covers all that may move a hit below out of its
    /// boxes; `None` if that leaves f32's range and no box can be trusted
    /// (docs/numerics/boxes.md, X9).
    ///
    /// A hit lies in its shape's box padded in the shape's space, and that pad may look
    /// `condition` times as large here (40 roundings, times √3 from axes to lengths and
    /// back: the factor 4). Rays are transformed from the world in f64 by matrices with one
    /// rounding per level, which is small, but relative to the world's coordinates on the
    /// ray's own way here: no farther than t = 4 size / |dir|, if the pad is no more than the
    /// size then. What lies farther off costs this node nothing.
    pub fn padded(&self, object_from_world: &Affine, rays: &RayExtent) -> Option<Aabb32> {
        let size = rays.org + self.bounds.max_abs();
        let shift = object_from_world.translation;
        let shift = shift.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
        let shifts = shift + self.shift;
        let norm = object_from_world.norm();
        let pad_of_one = 32.0 * 0.5 * f64::from(f32::EPSILON);
        let [slowest, fastest] = rays.dir;
        let pad = |world: f64| {
            let moved = norm * 2.0 * world;
            let rounding = (self.levels + 1.0) * 64.0 * f64::EPSILON * (moved + shifts);
            self.condition * (4.0 * size + rounding / pad_of_one)
        };
        let way = rays.world_org + rays.world_dir * (4.0 * size / slowest);
        let near = pad(way.min(rays.world));
        // The pads of slabs are this part of what they are given.
        let more = if near * pad_of_one <= size {
            near
        } else {
            pad(rays.world)
        };
        // The numbers stay far from the ends of f32, and so do reciprocals of small
        // components.
        let all = size + more;
        let fits = all > 2_f64.powi(-80)
            && all < 2_f64.powi(80)
            && fastest < 2_f64.powi(60)
            && slowest > 2_f64.powi(-60)
            && all < slowest * 2_f64.powi(60);
        fits.then(|| self.bounds.grown(DVec3::splat(more)).outward())
    }
}

struct Builder<'a> {
    scene: &'a Tables,
    /// The trees built so far; children come first.
    nodes: Vec<Option<InstanceBvh>>,
    own: &'a [Aabb32],
    /// The most boxes that the box of one edge is made from.
    pieces: usize,
}

impl Builder<'_> {
    fn node(&self, node: NodeId) -> Option<&InstanceBvh> {
        self.nodes[node.index()].as_ref()
    }

    /// Builds the tree over the edges of one node.
    fn tree(&self, all: impl Iterator<Item = InstanceEdge>) -> InstanceBvh {
        let mut boxes = Vec::new();
        let (mut bounded, mut unbounded) = (Vec::new(), Vec::new());
        let mut bounds = Aabb::EMPTY;
        let (mut condition, mut levels, mut shift) = (1.0, 1.0, 0.0);
        for row in all {
            let is_unbounded = match row.edge.target {
                Target::Shape(shape) => self.own[shape.index()] == Aabb32::EVERYTHING,
                Target::Node(node) => self.node(node).is_some_and(|t| !t.unbounded.is_empty()),
            };
            if is_unbounded {
                unbounded.push(row);
            }
            let around = self.around(row.edge);
            if around.is_some_and(|b| b.is_empty()) {
                continue;
            }
            // Where a placed box has no bound, no box of this tree is trusted.
            let least = if around.is_none() { f64::INFINITY } else { 1.0 };
            let around = around.unwrap_or(Aabb::of_points([DVec3::ZERO]));
            bounds = bounds.union(&around);
            boxes.push(around.outward());
            bounded.push(row);
            let place = Placement::WORLD.through(self.scene, row.edge);
            let of_edge = place.object_from_world.stretch() * place.world_from_object.stretch();
            let (condition_below, levels_below, shift_below) = match row.edge.target {
                Target::Node(node) => self
                    .node(node)
                    .map_or((1.0, 0.0, 0.0), |t| (t.condition, t.levels, t.shift)),
                Target::Shape(_) => (1.0, 0.0, 0.0),
            };
            condition = f64::max(condition, of_edge.max(least) * condition_below);
            levels = f64::max(levels, 1.0 + levels_below);
            let own = DVec3::from_array(place.world_from_object.translation);
            let below = shift_below * place.world_from_object.norm();
            shift = f64::max(shift, own.abs().max_element() + below);
        }
        let (tree, order) = build_boxes(&boxes, BuildQuality::default());
        InstanceBvh {
            tree,
            edges: order.iter().map(|i| bounded[*i as usize]).collect(),
            unbounded,
            bounds,
            condition,
            levels,
            shift,
        }
    }

    /// Returns the box around all bounded shapes below an edge, in the space above the edge;
    /// `None` if a placed box has no bound.
    fn around(&self, edge: Edge) -> Option<Aabb> {
        let scene = self.scene;
        let mut front = vec![(Placement::WORLD.through(scene, edge), edge.target)];
        for _ in 0..PIECE_LEVELS {
            let mut next = Vec::new();
            for (place, target) in &front {
                match target {
                    Target::Shape(_) => next.push((*place, *target)),
                    Target::Node(node) => {
                        let edges = self.node(*node).map_or(&[][..], |t| &t.edges);
                        let below = edges.iter().map(|row| row.edge);
                        next.extend(below.map(|e| (place.through(scene, e), e.target)));
                    }
                }
                if next.len() > self.pieces {
                    break;
                }
            }
            if next.len() > self.pieces {
                break;
            }
            front = next;
        }
        let mut boxes = front.iter().map(|(place, target)| match target {
            Target::Shape(shape) => self.around_shape(*shape, place),
            Target::Node(node) => {
                let bounds = self.node(*node).map_or(Aabb::EMPTY, |t| t.bounds);
                world_bounds(&bounds, place, DVec3::ZERO)
            }
        });
        boxes.try_fold(Aabb::EMPTY, |all, b| Some(all.union(&b?)))
    }

    /// Returns the box of one placed shape, grown by [`OUTSIDE`]; empty if the shape is
    /// unbounded.
    fn around_shape(&self, shape: ShapeId, place: &Placement) -> Option<Aabb> {
        let own = self.own[shape.index()];
        if own == Aabb32::EVERYTHING || own == Aabb32::EMPTY {
            return Some(Aabb::EMPTY);
        }
        let own = own.widened();
        let outside = own.max_abs() * (OUTSIDE * 0.5 * f64::from(f32::EPSILON));
        let center = shape_center(self.scene, self.scene.shapes.row(shape));
        world_bounds(&own.grown(DVec3::splat(outside)), place, center)
    }
}
