//! Nested trees: one over the edges of each shared node, and one over the roots.
//!
//! What many instances of few nodes are traced through: memory and build time
//! follow the nodes and edges. A node's boxes are in its own space; a ray enters
//! it by the composed matrix of its path. That only prunes: a leaf is met by the
//! world ray and the whole path's matrix, as in a flat world.
//!
//! Invariant: where a ray's hit in some shape counts, the ray passes, at the
//! hit's t, every box on the way there, padded as [`InstanceBvh::padded`] says. Boxes
//! hold what the *stored inverses* take into the boxes below, so the rounding of
//! an inverse is in the boxes; that of the rays is in the pad. Checked by
//! tests/structures/nested.rs: the same hits as a flat world, bit for bit.

use super::builders::{BuildQuality, build_boxes};
use super::wide_bvh::WideBvh;
use super::world::{FAR, center_of, world_bounds};
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{
    Edge, Instances, NodeId, Placement, Scene, ShapeId, Tables, Target, children_first, far_center,
    used_nodes,
};
use glam::DVec3;

/// An edge, and how many instances its node has before it.
#[derive(Clone, Copy, Debug)]
pub struct InstanceEdge {
    pub edge: Edge,
    pub before: u64,
}

/// The edges of one node that lead to something.
#[derive(Clone, Debug)]
pub struct InstanceBvh {
    /// Over `links`, in the node's space.
    pub tree: WideBvh,
    /// In the order of the tree's leaves. What is unbounded below does not count.
    pub links: Vec<InstanceEdge>,
    /// Those that lead to something unbounded.
    pub open: Vec<InstanceEdge>,
    /// Around all links.
    bounds: Aabb,
    /// How much further a distance below may reach in one direction than in
    /// another, seen from here: the product of the edges' condition numbers
    /// (2-norm) along the worst path.
    spread: f64,
    /// Edges of the longest path below.
    levels: f64,
    /// The largest shift on a path below, seen from here: it may cancel, but matrices are
    /// rounded as it is.
    shift: f64,
}

#[derive(Clone, Debug)]
pub struct InstanceBvhs {
    /// Over the rows of [`Tables::roots`].
    pub roots: InstanceBvh,
    /// By node; none where nothing appears, or the node does not.
    nodes: Vec<Option<InstanceBvh>>,
    /// By shape: its box in its own space (of a mesh about its centre).
    pub own: Vec<Aabb32>,
}

/// Boxes that a link's own is put together from, over all links and at most for
/// one: seen from further above, boxes of boxes of turned boxes are too large.
const PIECES: usize = 1 << 20;
const PIECES_OF_ONE: usize = 128;
/// Levels that are looked into for that.
const LOOK: usize = 8;

/// Roundings, relative to a shape's size, by which a hit may lie outside its box:
/// the pad of its slabs, 32, and the rounding of their interval and of the ray.
const OUTSIDE: f64 = 80.0;

impl InstanceBvhs {
    /// `own`: by shape.
    pub fn of(scene: &Scene, instances: &Instances, own: Vec<Aabb32>) -> InstanceBvhs {
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
                let links = rows.map(|row| InstanceEdge {
                    edge: scene.edges.row(row as usize),
                    before: instances.before_edge(row as usize),
                });
                builder.nodes[node as usize] = Some(builder.group(links));
            }
        }
        let roots = builder.group((0..scene.roots.len()).map(|row| InstanceEdge {
            edge: scene.roots.row(row),
            before: instances.before_root(row),
        }));
        let nodes = builder.nodes;
        InstanceBvhs { roots, nodes, own }
    }

    /// Of a node that a link leads to.
    #[inline(always)]
    pub fn node(&self, node: NodeId) -> Option<&InstanceBvh> {
        self.nodes[node.index()].as_ref()
    }

    /// World space, about `center`; holds the boxes of all instances that have one, as
    /// [`super::TlasEntry`] has them.
    pub fn bounds(&self, center: DVec3) -> Aabb32 {
        let bounds = &self.roots.bounds;
        if self.roots.is_wild() {
            return Aabb32::EVERYTHING;
        }
        if bounds.is_empty() {
            return Aabb32::EMPTY;
        }
        let about = Aabb::new(bounds.min - center, bounds.max - center);
        // Those are rounded to f32 once, and to f64 where they stand.
        let more =
            about.max_abs() * f64::from(f32::EPSILON) + bounds.max_abs() * (64.0 * f64::EPSILON);
        about.grown(DVec3::splat(more)).outward()
    }

    /// The largest coordinate of what is bounded, in world space.
    pub fn reach(&self) -> f64 {
        match &self.roots {
            wild if wild.is_wild() => f64::INFINITY,
            empty if empty.bounds.is_empty() => 0.0,
            roots => roots.bounds.max_abs(),
        }
    }

    /// World space: what the boxes of a world of these count from.
    pub fn center(&self) -> DVec3 {
        far_center(&self.roots.bounds, FAR)
    }

    pub fn bytes(&self) -> usize {
        let groups = self.nodes.iter().flatten().chain([&self.roots]);
        let links = |g: &InstanceBvh| (g.links.len() + g.open.len()) * size_of::<InstanceEdge>();
        groups.map(|g| g.tree.bytes() + links(g)).sum::<usize>()
            + self.nodes.len() * size_of::<Option<InstanceBvh>>()
            + self.own.len() * size_of::<Aabb32>()
    }
}

/// How far rays of a set reach in a node's space.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// The largest coordinate of an origin, in the node's space.
    pub org: f64,
    /// The largest coordinate of a direction, over the rays the least and the most.
    pub dir: [f64; 2],
    /// The largest coordinate that the rays have in world space where they meet
    /// anything, origins included.
    pub world: f64,
}

impl InstanceBvh {
    /// Something below is anywhere.
    fn is_wild(&self) -> bool {
        self.spread == f64::INFINITY
    }

    /// The bounds that slabs must be made for, so that their pad (32 roundings of
    /// the largest distance from bounds or origin) has room for whatever may
    /// move a hit below out of its boxes; `None` where f32 is not up to it, and
    /// no box can be trusted.
    ///
    /// A hit lies in its shape's box padded in the shape's space, and that pad
    /// may look `spread` times as large from here (40 roundings, times √3 for
    /// axes to lengths and back). Rays are brought into each space from the
    /// world, in f64, by matrices with a rounding for each level: small, but
    /// relative to the world's coordinates.
    pub fn padded(&self, object_from_world: &Affine, rays: &Reach) -> Option<Aabb32> {
        let size = rays.org + self.bounds.max_abs();
        let moved = object_from_world.norm() * 2.0 * rays.world;
        let shift = object_from_world.translation;
        let shift = shift.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
        let shifts = shift + self.shift;
        let rounding = (self.levels + 1.0) * 64.0 * f64::EPSILON * (moved + shifts);
        let pad_of_one = 32.0 * 0.5 * f64::from(f32::EPSILON);
        let more = self.spread * (4.0 * size + rounding / pad_of_one);
        // Far from where f32 ends, reciprocals of small components included.
        let all = size + more;
        let [slowest, fastest] = rays.dir;
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
    /// Those that are done.
    nodes: Vec<Option<InstanceBvh>>,
    own: &'a [Aabb32],
    pieces: usize,
}

impl Builder<'_> {
    fn node(&self, node: NodeId) -> Option<&InstanceBvh> {
        self.nodes[node.index()].as_ref()
    }

    fn group(&self, all: impl Iterator<Item = InstanceEdge>) -> InstanceBvh {
        let mut boxes = Vec::new();
        let (mut bounded, mut open) = (Vec::new(), Vec::new());
        let mut bounds = Aabb::EMPTY;
        let (mut spread, mut levels, mut shift) = (1.0, 1.0, 0.0);
        for link in all {
            let is_open = match link.edge.target {
                Target::Shape(shape) => self.own[shape.index()] == Aabb32::EVERYTHING,
                Target::Node(node) => self.node(node).is_some_and(|g| !g.open.is_empty()),
            };
            if is_open {
                open.push(link);
            }
            let around = self.around(link.edge);
            if around.is_some_and(|b| b.is_empty()) {
                continue;
            }
            // Where no box holds it, none is trusted.
            let wild = if around.is_none() { f64::INFINITY } else { 1.0 };
            let around = around.unwrap_or(Aabb::of_points([DVec3::ZERO]));
            bounds = bounds.union(&around);
            boxes.push(around.outward());
            bounded.push(link);
            let place = Placement::WORLD.through(self.scene, link.edge);
            let condition = place.object_from_world.stretch() * place.world_from_object.stretch();
            let (spread_below, levels_below, shift_below) = match link.edge.target {
                Target::Node(node) => self
                    .node(node)
                    .map_or((1.0, 0.0, 0.0), |g| (g.spread, g.levels, g.shift)),
                Target::Shape(_) => (1.0, 0.0, 0.0),
            };
            spread = f64::max(spread, condition.max(wild) * spread_below);
            levels = f64::max(levels, 1.0 + levels_below);
            let own = DVec3::from_array(place.world_from_object.translation);
            let below = shift_below * place.world_from_object.norm();
            shift = f64::max(shift, own.abs().max_element() + below);
        }
        let (tree, order) = build_boxes(&boxes, BuildQuality::default());
        InstanceBvh {
            tree,
            links: order.iter().map(|i| bounded[*i as usize]).collect(),
            open,
            bounds,
            spread,
            levels,
            shift,
        }
    }

    /// What is bounded behind an edge, in the space before it; `None` where that is
    /// anywhere.
    fn around(&self, edge: Edge) -> Option<Aabb> {
        let scene = self.scene;
        let mut front = vec![(Placement::WORLD.through(scene, edge), edge.target)];
        for _ in 0..LOOK {
            let mut next = Vec::new();
            for (place, target) in &front {
                match target {
                    Target::Shape(_) => next.push((*place, *target)),
                    Target::Node(node) => {
                        let links = self.node(*node).map_or(&[][..], |g| &g.links);
                        let below = links.iter().map(|link| link.edge);
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
                let bounds = self.node(*node).map_or(Aabb::EMPTY, |g| g.bounds);
                world_bounds(&bounds, place, DVec3::ZERO)
            }
        });
        boxes.try_fold(Aabb::EMPTY, |all, b| Some(all.union(&b?)))
    }

    fn around_shape(&self, shape: ShapeId, place: &Placement) -> Option<Aabb> {
        let own = self.own[shape.index()];
        if own == Aabb32::EVERYTHING || own == Aabb32::EMPTY {
            return Some(Aabb::EMPTY);
        }
        let own = own.widened();
        let outside = own.max_abs() * (OUTSIDE * 0.5 * f64::from(f32::EPSILON));
        let center = center_of(self.scene, self.scene.shapes.row(shape));
        world_bounds(&own.grown(DVec3::splat(outside)), place, center)
    }
}
