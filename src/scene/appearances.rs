//! Appearances: every path through the DAG that ends in a shape.
//!
//! Derived from the tables, in the depth-first order of the file; the row
//! number *is* the mixed-radix index of the path, and the instance id of
//! pictures. Each has one `object_from_world`, the product of its edges'
//! inverses from root to leaf in fixed order without FMA: the object ray is that
//! matrix times the world ray, by definition.
//!
//! The DAG is laid out flat here, so sharing is bounded by [`MAX_APPEARANCES`];
//! each shared shape keeps one tree all the same.

use super::check::SceneError;
use super::ids::{MaterialId, ShapeId};
use super::nodes::Target;
use super::{Edges, Shape, Tables};
use crate::math::Affine;
use glam::DVec3;

/// More appearances than this are refused: a row takes 200 bytes.
pub const MAX_APPEARANCES: u64 = 1 << 24;

/// One shape at one place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    pub shape: ShapeId,
    /// From the nearest edge that sets one; overrides a mesh's own.
    pub material: Option<MaterialId>,
    pub object_from_world: Affine,
    pub world_from_object: Affine,
    /// Row of [`Tables::instances`] that this is part of.
    pub root: u32,
}

impl Appearance {
    /// Whether its object space differs from world space: by a transform, or by
    /// a mesh's centre.
    pub fn is_placed(&self, scene: &Tables) -> bool {
        let centered = match scene.shapes.row(self.shape) {
            Shape::Mesh(id) => scene.meshes.center[id.index()] == DVec3::ZERO,
            _ => true,
        };
        !(centered && self.object_from_world.is_identity())
    }
}

#[derive(Clone, Debug, Default)]
pub struct Appearances {
    pub rows: Vec<Appearance>,
}

impl Appearances {
    pub fn of(scene: &Tables) -> Result<Appearances, SceneError> {
        let count = count(scene);
        if count > MAX_APPEARANCES {
            return Err(SceneError::TooManyAppearances {
                count,
                limit: MAX_APPEARANCES,
            });
        }
        let mut rows = Vec::with_capacity(count as usize);
        // Depth first without recursion: the graph may be a million deep.
        let mut open: Vec<Frame> = Vec::new();
        for root in 0..scene.instances.len() {
            let above = Frame {
                next: 0,
                end: 0,
                object_from_world: Affine::IDENTITY,
                world_from_object: Affine::IDENTITY,
                material: None,
            };
            descend(
                scene,
                &scene.instances,
                root,
                &above,
                root as u32,
                &mut rows,
                &mut open,
            );
            while let Some(frame) = open.last_mut() {
                if frame.next == frame.end {
                    open.pop();
                    continue;
                }
                let edge = frame.next;
                frame.next += 1;
                let above = *frame;
                descend(
                    scene,
                    &scene.edges,
                    edge as usize,
                    &above,
                    root as u32,
                    &mut rows,
                    &mut open,
                );
            }
        }
        Ok(Appearances { rows })
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.rows.len() * size_of::<Appearance>()
    }
}

/// A node whose children are being visited.
#[derive(Clone, Copy)]
struct Frame {
    next: u32,
    end: u32,
    object_from_world: Affine,
    world_from_object: Affine,
    material: Option<MaterialId>,
}

fn descend(
    scene: &Tables,
    edges: &Edges,
    row: usize,
    above: &Frame,
    root: u32,
    rows: &mut Vec<Appearance>,
    open: &mut Vec<Frame>,
) {
    let edge = edges.row(row);
    let t = edge.transform.index();
    let below = Frame {
        next: 0,
        end: 0,
        // The check has refused rows without an inverse.
        object_from_world: scene.transforms.inverse[t]
            .unwrap_or(Affine::IDENTITY)
            .then_after(&above.object_from_world),
        world_from_object: above
            .world_from_object
            .then_after(&scene.transforms.local[t]),
        material: edge.material.or(above.material),
    };
    match edge.target {
        Target::Shape(shape) => rows.push(Appearance {
            shape,
            material: below.material,
            object_from_world: below.object_from_world,
            world_from_object: below.world_from_object,
            root,
        }),
        Target::Node(node) => {
            let children = &scene.nodes.children[node.index()];
            open.push(Frame {
                next: children.start,
                end: children.end,
                ..below
            });
        }
    }
}

/// Paths that end in a shape, saturating.
pub(super) fn count(scene: &Tables) -> u64 {
    let order = super::check::children_first(scene).unwrap_or_default();
    let mut below = vec![0_u64; scene.nodes.len()];
    let of = |target: Target, below: &[u64]| match target {
        Target::Shape(_) => 1,
        Target::Node(node) => below[node.index()],
    };
    for node in order {
        let children = scene.nodes.children[node as usize].clone();
        below[node as usize] = children
            .map(|e| of(scene.edges.target[e as usize], &below))
            .fold(0, u64::saturating_add);
    }
    scene
        .instances
        .target
        .iter()
        .map(|t| of(*t, &below))
        .fold(0, u64::saturating_add)
}
