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
use super::{Edge, Shape, Tables};
use crate::math::Affine;
use glam::DVec3;

/// More appearances than this are refused: a row takes 200 bytes.
pub const MAX_APPEARANCES: u64 = 1 << 24;

/// More placements than this on the ways to them are refused: few appearances
/// may lie behind long chains of nodes, each walked anew.
const MAX_STEPS: u64 = 1 << 27;

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
        let (below, all) = sizes(scene);
        if all.appearances > MAX_APPEARANCES {
            return Err(SceneError::TooManyAppearances {
                count: all.appearances,
                limit: MAX_APPEARANCES,
            });
        }
        if all.steps > MAX_STEPS {
            return Err(SceneError::TooManyNodes {
                count: all.steps,
                limit: MAX_STEPS,
            });
        }
        let mut rows = Vec::with_capacity(all.appearances as usize);
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
                &below,
                scene.instances.row(root),
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
                    &below,
                    scene.edges.row(edge as usize),
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
    below_nodes: &[Size],
    edge: Edge,
    above: &Frame,
    root: u32,
    rows: &mut Vec<Appearance>,
    open: &mut Vec<Frame>,
) {
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
        // What holds no shape may unfold without end.
        Target::Node(node) if below_nodes[node.index()].appearances == 0 => {}
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

/// What unfolds below a node, saturating.
#[derive(Clone, Copy, Default)]
struct Size {
    /// Paths that end in a shape.
    appearances: u64,
    /// Edges walked to lay them out.
    steps: u64,
}

/// Of each node, and of the whole scene.
fn sizes(scene: &Tables) -> (Vec<Size>, Size) {
    let mut below = vec![Size::default(); scene.nodes.len()];
    let sum = |edges: &mut dyn Iterator<Item = Target>, below: &[Size]| {
        edges.fold(Size::default(), |sum, target| {
            let one = match target {
                Target::Shape(_) => Size {
                    appearances: 1,
                    steps: 0,
                },
                Target::Node(node) => below[node.index()],
            };
            if one.appearances == 0 {
                return sum;
            }
            Size {
                appearances: sum.appearances.saturating_add(one.appearances),
                steps: sum.steps.saturating_add(one.steps).saturating_add(1),
            }
        })
    };
    for node in super::check::children_first(scene).unwrap_or_default() {
        let mut children = scene.nodes.children[node as usize]
            .clone()
            .map(|e| scene.edges.target[e as usize]);
        below[node as usize] = sum(&mut children, &below);
    }
    let all = sum(&mut scene.instances.target.iter().copied(), &below);
    (below, all)
}
