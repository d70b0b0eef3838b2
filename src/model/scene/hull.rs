//! The hull of a scene, found without visiting its instances one by one.
//!
//! Shared nodes get boxes and balls, from the leaves up. Then the graph is unfolded from
//! its roots for a few levels, which makes the boxes tighter. The result is good enough for
//! a default view; trees have bounds of their own.

use super::Tables;
use super::graph_order::children_first;
use super::ids::ShapeId;
use super::nodes::{Edge, Target};
use super::primitives::shape_bounds;
use crate::math::{Aabb, Affine};
use glam::DVec3;

/// The bounded shapes below a node, to within rounding: they lie in the box, and in the
/// ball about its middle. Boxes alone would grow with every nested rotation.
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Aabb,
    radius: f64,
}

impl Extent {
    const EMPTY: Extent = Extent {
        bounds: Aabb::EMPTY,
        radius: 0.0,
    };

    fn of_box(bounds: Aabb) -> Extent {
        Extent {
            bounds,
            radius: bounds.diagonal() * 0.5,
        }
    }

    fn through(&self, map: &Affine) -> Extent {
        if self.bounds.is_empty() {
            return Extent::EMPTY;
        }
        let place = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
        let of_box = Aabb::of_points(self.bounds.corners().map(place));
        let (center, radius) = (place(self.bounds.center()), self.radius * map.stretch());
        Extent {
            bounds: Aabb {
                min: of_box.min.max(center - radius),
                max: of_box.max.min(center + radius),
            },
            radius,
        }
    }

    fn around(all: &[Extent]) -> Extent {
        let all = all.iter().filter(|e| !e.bounds.is_empty());
        let boxes = all.clone().map(|e| e.bounds);
        let bounds = boxes.fold(Aabb::EMPTY, |b, one| b.union(&one));
        let center = bounds.center();
        let reach = |e: &Extent| (e.bounds.center() - center).length() + e.radius;
        Extent {
            bounds,
            radius: all
                .map(reach)
                .fold(0.0, f64::max)
                .min(bounds.diagonal() * 0.5),
        }
    }
}

/// Returns the extent of every node in its own space.
fn node_extents(tables: &Tables, of_shape: &[Extent]) -> Vec<Extent> {
    let mut of_node = vec![Extent::EMPTY; tables.nodes.len()];
    let mut children = Vec::new();
    for node in children_first(tables).unwrap_or_default() {
        let edges = tables.nodes.children[node as usize].clone();
        children.clear();
        children.extend(edges.map(|row| {
            let edge = tables.edges.row(row as usize);
            let of_target = match edge.target {
                Target::Shape(shape) => of_shape[shape.index()],
                Target::Node(node) => of_node[node.index()],
            };
            of_target.through(&tables.transforms.local[edge.transform.index()])
        }));
        of_node[node as usize] = Extent::around(&children);
    }
    of_node
}

/// The most boxes that [`coarse_corners`] unfolds a scene into.
const COARSE: usize = 1 << 12;

/// Returns points whose hull contains all bounded instances, to within rounding. The graph
/// is unfolded from its roots breadth first, as far as `COARSE` boxes allow.
pub fn coarse_corners(tables: &Tables) -> Vec<DVec3> {
    let shapes = (0..tables.shapes.len() as u32).map(ShapeId);
    let of_shape: Vec<Extent> = shapes
        .map(|id| shape_bounds(tables, id).map_or(Extent::EMPTY, Extent::of_box))
        .collect();
    let of_node = node_extents(tables, &of_shape);
    let placed = |above: &Affine, edge: Edge| {
        let map = above.then_after(&tables.transforms.local[edge.transform.index()]);
        (map, edge.target)
    };
    let roots = (0..tables.roots.len()).map(|i| tables.roots.row(i));
    let mut front: Vec<(Affine, Target)> = roots.map(|e| placed(&Affine::IDENTITY, e)).collect();
    // Below longer chains, boxes hardly become tighter.
    for _ in 0..64 {
        let mut next = Vec::new();
        for (map, target) in &front {
            match target {
                Target::Shape(_) => next.push((*map, *target)),
                Target::Node(node) if of_node[node.index()].bounds.is_empty() => {}
                Target::Node(node) => {
                    let edges = tables.nodes.children[node.index()].clone();
                    next.extend(edges.map(|e| placed(map, tables.edges.row(e as usize))));
                }
            }
            if next.len() > COARSE {
                break;
            }
        }
        if next.len() > COARSE {
            break;
        }
        front = next;
    }
    let extents = front.iter().map(|(map, target)| match target {
        Target::Shape(shape) => of_shape[shape.index()].through(map),
        Target::Node(node) => of_node[node.index()].through(map),
    });
    let boxes = extents.map(|e| e.bounds).filter(|b| !b.is_empty());
    boxes.flat_map(|b| b.corners()).collect()
}
