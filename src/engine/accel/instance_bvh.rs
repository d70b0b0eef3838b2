//! Instance BVHs: trees over the edges of each shared node, and over the roots.
//!
//! A node has one tree, or one for each [cluster](super::clusters) of what lies below it.
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
use super::clusters::clusters;
use super::wide_bvh::WideBvh;
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{
    Edge, Instances, NodeId, Placement, Scene, ShapeId, Tables, Target, children_first, far_center,
    shape_center, used_nodes,
};
use glam::DVec3;
use std::collections::HashSet;
use std::ops::Range;

/// An edge of the scene's graph, or that part of it which leads to one cluster of a node.
#[derive(Clone, Copy, Debug)]
pub struct InstanceEdge {
    pub edge: Edge,
    /// The number of instances below its node's earlier edges.
    pub before: u64,
    /// The row of [`InstanceBvhs::trees`] that it leads to; 0 if it leads to a shape.
    tree: u32,
}

/// The tree over those edges of one node that lead to shapes of one cluster.
#[derive(Clone, Debug)]
pub struct InstanceBvh {
    /// The tree over `edges`, in the node's space about `center`.
    pub tree: WideBvh,
    /// The point that the tree's boxes count from: zero unless the cluster lies far from the
    /// origin of the node's space.
    pub center: DVec3,
    /// Edges that lead to bounded shapes, in the order of the tree's leaves.
    pub edges: Vec<InstanceEdge>,
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

/// What leads from a node, or from the world to the roots.
#[derive(Clone, Debug, Default)]
pub struct NodeTrees {
    /// Its rows of [`InstanceBvhs::trees`], one for each cluster of the bounded shapes below.
    clusters: Range<u32>,
    /// Edges that lead to unbounded shapes.
    pub unbounded: Vec<InstanceEdge>,
}

/// All instance BVHs of a scene.
#[derive(Clone, Debug)]
pub struct InstanceBvhs {
    trees: Vec<InstanceBvh>,
    /// The trees over the rows of [`Tables::roots`].
    pub roots: NodeTrees,
    /// By node; without trees if the node is unused or has no shapes below.
    nodes: Vec<NodeTrees>,
    /// The box around all bounded shapes in world space; infinite if some placed box has no
    /// bound.
    bounds: Aabb,
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
            trees: Vec::new(),
            nodes: vec![NodeTrees::default(); scene.nodes.len()],
            own: &own,
            pieces: (PIECES / edges.max(1)).min(PIECES_OF_ONE),
        };
        for node in order {
            if used[node as usize] && instances.below(NodeId(node)) > 0 {
                let rows = scene.nodes.children[node as usize].clone();
                let edges = rows.map(|row| {
                    let before = instances.before_edge(row as usize);
                    (scene.edges.row(row as usize), before)
                });
                builder.nodes[node as usize] = builder.node_trees(edges);
            }
        }
        let rows = 0..scene.roots.len();
        let roots = rows.map(|row| (scene.roots.row(row), instances.before_root(row)));
        let roots = builder.node_trees(roots);
        let Builder { trees, nodes, .. } = builder;
        let of_roots = &trees[roots.clusters.start as usize..];
        let bounds = of_roots.iter().fold(Aabb::EMPTY, |all, tree| {
            let everything = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
            all.union(if tree.has_no_bound() {
                &everything
            } else {
                &tree.bounds
            })
        });
        InstanceBvhs {
            trees,
            roots,
            nodes,
            bounds,
            own,
        }
    }

    /// Returns the trees of a node.
    #[inline(always)]
    pub fn node(&self, node: NodeId) -> &NodeTrees {
        &self.nodes[node.index()]
    }

    /// Returns the tree that an edge to a node leads to.
    #[inline(always)]
    pub fn below(&self, edge: &InstanceEdge) -> &InstanceBvh {
        &self.trees[edge.tree as usize]
    }

    /// Returns the trees over the roots.
    #[inline(always)]
    pub fn root_trees(&self) -> &[InstanceBvh] {
        let Range { start, end } = self.roots.clusters;
        &self.trees[start as usize..end as usize]
    }

    /// Returns a box in world space, about `center`, that contains the boxes of all bounded
    /// instances as [`super::TlasEntry`] has them.
    pub fn bounds(&self, center: DVec3) -> Aabb32 {
        let bounds = &self.bounds;
        if !bounds.is_finite() && !bounds.is_empty() {
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
        match &self.bounds {
            bounds if bounds.is_empty() => 0.0,
            bounds => bounds.max_abs(),
        }
    }

    /// Returns the point in world space that the boxes of a nested world count from (X10).
    pub fn center(&self) -> DVec3 {
        far_center(&self.bounds, FAR)
    }

    pub fn bytes(&self) -> usize {
        let bounded = self.trees.iter().map(|t| t.edges.len());
        let unbounded = self.nodes.iter().chain([&self.roots]);
        let edges = bounded.sum::<usize>() + unbounded.map(|n| n.unbounded.len()).sum::<usize>();
        self.trees.iter().map(|t| t.tree.bytes()).sum::<usize>()
            + edges * size_of::<InstanceEdge>()
            + self.trees.len() * size_of::<InstanceBvh>()
            + self.nodes.len() * size_of::<NodeTrees>()
            + self.own.len() * size_of::<Aabb32>()
    }
}

/// How rays are kept from a tree that they miss.
#[derive(Clone, Copy, Debug)]
pub enum Padded {
    /// By slabs in f32 that are made for these bounds.
    Slabs(Aabb32),
    /// By this box around the whole tree alone, which [`may_meet`] tests in f64: numbers here
    /// leave f32's range.
    Whole(Aabb),
}

/// Says whether a ray may be inside a box, padded as [`InstanceBvh::padded`] says, at a t
/// between `from` and `to`.
///
/// An end of the box's interval is off by two roundings 2⁻⁵³ of t, which the pad covers. A
/// side whose t is NaN culls nothing, nor does an axis whose t's are so small that denormal
/// numbers count beside the pad (X9).
pub fn may_meet(bounds: &Aabb, org: [f64; 3], dir: [f64; 3], [from, to]: [f64; 2]) -> bool {
    let (mut enter, mut exit) = (from, to);
    for k in 0..3 {
        let a = (bounds.min[k] - org[k]) / dir[k];
        let b = (bounds.max[k] - org[k]) / dir[k];
        if a.is_nan() || b.is_nan() || a.abs().max(b.abs()) < SMALL {
            continue;
        }
        enter = enter.max(a.min(b));
        exit = exit.min(a.max(b));
    }
    enter <= exit
}

/// 2⁻⁹⁶⁰: a pad of 2⁻²⁰ of it is far above the least denormal number.
const SMALL: f64 = 1.026_342_003_245_594e-289;

/// The extent of a set of rays in a node's space.
#[derive(Clone, Copy, Debug)]
pub struct RayExtent {
    /// The largest coordinate of any origin, in the node's space about the tree's centre.
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
    /// boxes; or, if that leaves f32's range and none of the tree's boxes can be trusted, the
    /// box around the tree with this pad (docs/numerics/boxes.md, X9).
    ///
    /// A hit lies in its shape's box padded in the shape's space, and that pad may look
    /// `condition` times as large here (40 roundings, times √3 from axes to lengths and
    /// back: the factor 4). Rays are transformed from the world in f64 by matrices with one
    /// rounding per level, and counted from the centre with one more, which is small, but relative to the world's coordinates on the
    /// ray's own way here: no farther than t = 4 size / |dir|, if the pad is no more than the
    /// size then. What lies farther off costs this node nothing.
    pub fn padded(&self, object_from_world: &Affine, rays: &RayExtent) -> Padded {
        let about = Aabb::new(self.bounds.min - self.center, self.bounds.max - self.center);
        let size = rays.org + about.max_abs();
        let shift = object_from_world.translation;
        let shift = shift.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
        let shifts = shift + self.shift + self.center.abs().max_element();
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
        if fits {
            return Padded::Slabs(about.grown(DVec3::splat(more)).outward());
        }
        Padded::Whole(about.grown(DVec3::splat(pad_of_one * all)))
    }
}

/// What an edge and all below it cost a pad in the space above the edge, as
/// [`InstanceBvh`] has it for its own space.
struct EdgeConditioning {
    condition: f64,
    levels: f64,
    shift: f64,
}

struct Builder<'a> {
    scene: &'a Tables,
    /// The trees built so far; children come first.
    trees: Vec<InstanceBvh>,
    /// By node, as far as they are built.
    nodes: Vec<NodeTrees>,
    own: &'a [Aabb32],
    /// The most boxes that the box of one edge is made from.
    pieces: usize,
}

impl Builder<'_> {
    /// Builds the trees over the edges of one node, with the instances before each.
    fn node_trees(&mut self, all: impl Iterator<Item = (Edge, u64)>) -> NodeTrees {
        let mut unbounded = Vec::new();
        // Placed boxes, and edges whose placed boxes have no bound: these stand apart, for
        // no box of their tree is trusted.
        let (mut boxes, mut bounded, mut boundless) = (Vec::new(), Vec::new(), Vec::new());
        // What stands where a sibling with lower ids stands, to the bit, never comes first:
        // its hits have the same t. Left out, it does not double a ray's way level by level.
        let mut placed = HashSet::new();
        for (edge, before) in all {
            if !placed.insert(self.place_key(edge)) {
                continue;
            }
            let (is_unbounded, trees) = match edge.target {
                Target::Shape(shape) => (self.own[shape.index()] == Aabb32::EVERYTHING, 0..1),
                Target::Node(node) => {
                    let below = &self.nodes[node.index()];
                    (!below.unbounded.is_empty(), below.clusters.clone())
                }
            };
            let row = |tree: u32| InstanceEdge { edge, before, tree };
            if is_unbounded {
                unbounded.push(row(0));
            }
            for row in trees.map(row) {
                match self.around(&row) {
                    Some(around) if around.is_empty() => {}
                    Some(around) if self.conditioning(&row).condition.is_finite() => {
                        boxes.push(around);
                        bounded.push(row);
                    }
                    _ => boundless.push(row),
                }
            }
        }
        let first = self.trees.len() as u32;
        if !boxes.is_empty() {
            for rows in clusters(&boxes) {
                let of = |row: usize| (bounded[row], boxes[row]);
                let tree = self.tree(&rows.into_iter().map(of).collect::<Vec<_>>());
                self.trees.push(tree);
            }
        }
        if !boundless.is_empty() {
            let anywhere = Aabb::of_points([DVec3::ZERO]);
            let rows: Vec<_> = boundless.iter().map(|row| (*row, anywhere)).collect();
            let mut tree = self.tree(&rows);
            tree.condition = f64::INFINITY;
            self.trees.push(tree);
        }
        NodeTrees {
            clusters: first..self.trees.len() as u32,
            unbounded,
        }
    }

    /// Returns a key that is the same for edges of one node only if they have the same target
    /// and the same matrices.
    fn place_key(&self, edge: Edge) -> (Target, [u64; 12]) {
        let local = &self.scene.transforms.local[edge.transform.index()];
        let numbers = local.linear().iter().flatten().chain(&local.translation);
        let mut bits = numbers.map(|x| x.to_bits());
        (
            edge.target,
            std::array::from_fn(|_| bits.next().unwrap_or_default()),
        )
    }

    /// Builds the tree over edges with their boxes.
    fn tree(&self, rows: &[(InstanceEdge, Aabb)]) -> InstanceBvh {
        let (mut condition, mut levels, mut shift) = (1.0, 1.0, 0.0);
        for (row, _) in rows {
            let of_edge = self.conditioning(row);
            condition = f64::max(condition, of_edge.condition);
            levels = f64::max(levels, of_edge.levels);
            shift = f64::max(shift, of_edge.shift);
        }
        let around = rows.iter().map(|(_, around)| around);
        let bounds = around.fold(Aabb::EMPTY, |all, b| all.union(b));
        let center = far_center(&bounds, FAR);
        let about = |b: &Aabb| Aabb::new(b.min - center, b.max - center).outward();
        let boxes: Vec<Aabb32> = rows.iter().map(|(_, around)| about(around)).collect();
        let (tree, order) = build_boxes(&boxes, BuildQuality::default());
        InstanceBvh {
            tree,
            center,
            edges: order.iter().map(|i| rows[*i as usize].0).collect(),
            bounds,
            condition,
            levels,
            shift,
        }
    }

    /// Returns what an edge and the tree that it leads to cost a pad above.
    fn conditioning(&self, row: &InstanceEdge) -> EdgeConditioning {
        let place = Placement::WORLD.through(self.scene, row.edge);
        let of_edge = place.object_from_world.stretch() * place.world_from_object.stretch();
        let (condition, levels, shift) = match row.edge.target {
            Target::Node(_) => {
                let below = &self.trees[row.tree as usize];
                (below.condition, below.levels, below.shift)
            }
            Target::Shape(_) => (1.0, 0.0, 0.0),
        };
        let own = DVec3::from_array(place.world_from_object.translation);
        EdgeConditioning {
            condition: of_edge.max(1.0) * condition,
            levels: 1.0 + levels,
            shift: own.abs().max_element() + shift * place.world_from_object.norm(),
        }
    }

    /// Returns the box around the bounded shapes below an edge, in the space above the edge;
    /// `None` if a placed box has no bound.
    fn around(&self, row: &InstanceEdge) -> Option<Aabb> {
        let scene = self.scene;
        let mut front = vec![(Placement::WORLD.through(scene, row.edge), *row)];
        for _ in 0..PIECE_LEVELS {
            let mut next = Vec::new();
            for (place, row) in &front {
                match row.edge.target {
                    Target::Shape(_) => next.push((*place, *row)),
                    Target::Node(_) => {
                        let below = self.trees[row.tree as usize].edges.iter();
                        next.extend(below.map(|row| (place.through(scene, row.edge), *row)));
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
        let mut boxes = front.iter().map(|(place, row)| match row.edge.target {
            Target::Shape(shape) => self.around_shape(shape, place),
            Target::Node(_) => {
                let bounds = &self.trees[row.tree as usize].bounds;
                world_bounds(bounds, place, DVec3::ZERO)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn random(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A ray through a point of a box meets it, at any size, and one that ends before it does
    /// not.
    #[test]
    fn what_passes_through_a_box_may_meet_it() {
        let state = &mut 1;
        for exponent in -300..=300_i32 {
            for way in [-5, -1, 0, 1, 5_i32] {
                let unit = libm::exp10(f64::from(exponent));
                let mut vector = || DVec3::new(random(state), random(state), random(state));
                let (center, inside) = (vector() * unit, vector() * 0.9);
                let mut dir = vector();
                dir[(exponent.unsigned_abs() % 3) as usize] *=
                    [0.0, 1.0][way.unsigned_abs() as usize % 2];
                let half = DVec3::splat(0.1 * unit);
                let bounds = Aabb::new(center - half, center + half);
                let t = unit * libm::exp10(f64::from(way));
                let org = center + half * inside - dir * t;
                if !(org.is_finite() && t > 0.0 && unit * 1e-15 > 0.0) {
                    continue;
                }
                let (org, dir) = (org.to_array(), dir.to_array());
                // Farther off than the pad covers, the ray's own rounding counts.
                if way < 5 {
                    assert!(
                        may_meet(&bounds, org, dir, [0.0, f64::INFINITY]),
                        "1e{exponent}"
                    );
                }
                let before = t - 0.3 * unit / dir.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
                if way == 1 && t > 1e-280 {
                    assert!(!may_meet(&bounds, org, dir, [0.0, before]), "1e{exponent}");
                }
            }
        }
    }

    #[test]
    fn rays_beside_a_box_miss_it() {
        for unit in [1e-200, 1.0, 1e70, 1e300] {
            let one = Aabb::new(DVec3::splat(-unit), DVec3::splat(unit));
            let org = [0.0, 2.0 * unit, -5.0 * unit];
            let any = [0.0, f64::INFINITY];
            assert!(!may_meet(&one, org, [0.0, 0.0, 1.0], any));
            assert!(!may_meet(&one, org, [0.0, 0.1, 1.0], any));
            assert!(may_meet(&one, org, [0.0, -0.4, 1.0], any));
            assert!(!may_meet(&one, org, [0.0, -0.4, -1.0], any));
            // In the plane of a side, 0/0 says nothing.
            assert!(may_meet(
                &one,
                [0.0, unit, -5.0 * unit],
                [0.0, 0.0, 1.0],
                any
            ));
        }
    }
}
