//! Solids placed in the world, and the spans of lines inside them.

use glam::DVec3;
use lanecast_engine::accel::{MeshCrossingTrees, PreparedCsg};
use lanecast_engine::trace::{TURNED, TraceScratch, boundaries};
use lanecast_model::geom::exact::{Line, Root, span};
use lanecast_model::geom::primitive::Boundaries;
use lanecast_model::scene::{MeshId, Scene, Shape, ShapeId, check_closed, shape_bounds};
use lanecast_numerics::math::bounds::{ErrorBounded, UNIT};
use lanecast_numerics::math::{Aabb, Affine};
use std::ops::ControlFlow;

/// A solid, placed in the world.
pub struct Placed<'a> {
    pub(super) scene: &'a Scene,
    pub(super) id: ShapeId,
    shape: Shape,
    /// The CSG solid, or a shape that a line may enter many times.
    csg: Option<PreparedCsg>,
    pub(super) world_from_object: Affine,
    object_from_world: Affine,
    /// World-space bounding box.
    pub(super) bounds: Aabb,
    /// Unit of lengths: a power of two, no less than the box's largest extent.
    pub(super) unit: f64,
}

/// The reason why a shape has no volume to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoVolume {
    /// A surface, not a solid.
    Surface,
    /// A mesh that is not closed.
    Mesh,
    Unbounded,
}

impl<'a> Placed<'a> {
    pub fn new(
        scene: &'a Scene,
        id: ShapeId,
        world_from_object: &Affine,
        object_from_world: &Affine,
    ) -> Result<Placed<'a>, NoVolume> {
        let shape = scene.shapes.row(id);
        let csg = match shape {
            Shape::Mesh(row) => {
                if scene.meshes.open[row.index()] || check_closed(scene, row).is_err() {
                    return Err(NoVolume::Mesh);
                }
                Some(PreparedCsg::prepare_single(scene, id))
            }
            _ if scene.no_inside(shape).is_some() => return Err(NoVolume::Surface),
            _ if shape.boundaries() == Boundaries::Span => None,
            Shape::Csg(row) => Some(PreparedCsg::prepare(
                scene,
                id,
                row,
                &mut MeshCrossingTrees::default(),
            )),
            _ => Some(PreparedCsg::prepare_single(scene, id)),
        };
        let own = shape_bounds(scene, id).ok_or(NoVolume::Unbounded)?;
        let corner = |p: DVec3| DVec3::from_array(world_from_object.point(p.to_array()));
        let bounds = Aabb::of_points(own.corners().map(corner));
        let room = bounds.max_abs() * (64.0 * f64::EPSILON);
        let bounds = bounds.grown(DVec3::splat(room));
        let size = bounds.extent().max_element();
        let size = size.clamp(f64::MIN_POSITIVE, f64::MAX);
        Ok(Placed {
            scene,
            id,
            shape,
            csg,
            world_from_object: *world_from_object,
            object_from_world: *object_from_world,
            bounds,
            unit: libm::scalbn(1.0, libm::ilogb(size) + 1),
        })
    }

    /// Calls `part` with enter and exit of every span of a world line inside the solid,
    /// and a bound on the error of the span's length. Every end is a boundary.
    pub(super) fn spans(
        &self,
        org: DVec3,
        dir: DVec3,
        scratch: &mut TraceScratch,
        mut part: impl FnMut(f64, f64, f64),
    ) {
        let mut since = None;
        self.ends(org, dir, scratch, |end| {
            let t = self.position(&end.root);
            if end.enters {
                since = Some(t);
            } else if let Some(enter) = since.take() {
                part(enter.value, t.value, enter.error + t.error);
            }
        });
    }

    /// Returns t of a boundary, with the accuracy that sums of chords need.
    pub(super) fn position(&self, root: &Root) -> ErrorBounded {
        // NaN counts as unknown.
        match root.t {
            ErrorBounded { value, error } if error <= self.unit * 1e-9 => ErrorBounded {
                value,
                error: error + value.abs() * UNIT,
            },
            _ => ErrorBounded {
                value: root.rounded(),
                error: root.rounded().abs() * UNIT,
            },
        }
    }

    /// Calls `visit` at both ends of every span of a world line inside the solid, in order.
    pub(super) fn ends<'s>(
        &'s self,
        org: DVec3,
        dir: DVec3,
        scratch: &mut TraceScratch,
        mut visit: impl FnMut(&End<'s>),
    ) {
        let line = Line {
            org: self.object_from_world.point(org.to_array()),
            dir: self.object_from_world.vector(dir.to_array()),
        };
        let Some(csg) = &self.csg else {
            let Some(solid) = self.scene.solid(self.shape) else {
                return;
            };
            for ends in span(&solid, &line).spans() {
                let [Some(enter), Some(exit)] = ends else {
                    continue;
                };
                for (root, enters) in [(enter, true), (exit, false)] {
                    visit(&End {
                        root,
                        enters,
                        is_turned: false,
                        operand: 0,
                    });
                }
            }
            return;
        };
        let mut is_inside = false;
        let whole = (&line, f64::NEG_INFINITY);
        boundaries(csg, self.scene, whole, scratch, |change| {
            if change.enters || is_inside {
                visit(&End {
                    root: change.root,
                    enters: change.enters,
                    is_turned: change.primitive & TURNED != 0,
                    operand: csg.solid.operand_of(change.primitive & !TURNED).0,
                });
            }
            is_inside = change.enters;
            ControlFlow::Continue(())
        });
    }

    /// Returns the normal at a boundary, in world space, of any length and either way.
    pub(super) fn normal(&self, end: &End, t: f64) -> DVec3 {
        let own = end.root.normal_at(t).to_array();
        let normal = match &self.csg {
            None => own,
            Some(csg) => {
                let solid = &csg.solid;
                let frame = solid.operands[end.operand as usize].frame;
                let frame = &solid.frames[frame as usize];
                frame.operand_from_solid.transposed_vector(own)
            }
        };
        DVec3::from_array(self.object_from_world.transposed_vector(normal))
    }

    /// Returns the boxes of operands in world space.
    pub(super) fn operand_boxes(&self) -> Vec<Aabb> {
        let Some(csg) = &self.csg else {
            return Vec::new();
        };
        let own = csg.solid.operands.iter().filter_map(|o| o.bounds);
        let placed = own.map(|b| {
            let corner = |p: DVec3| DVec3::from_array(self.world_from_object.point(p.to_array()));
            Aabb::of_points(b.corners().map(corner))
        });
        placed.collect()
    }

    /// Whether its boundaries have faces by the thousand.
    pub(super) fn has_meshes(&self) -> bool {
        let mesh = |solid: &PreparedCsg| solid.solid.has_meshes();
        self.csg.as_ref().is_some_and(mesh)
    }

    pub(super) fn mesh(&self) -> Option<MeshId> {
        match self.shape {
            Shape::Mesh(id) => Some(id),
            _ => None,
        }
    }
}

/// A boundary of a solid on a line.
pub(super) struct End<'a> {
    pub root: Root<'a>,
    /// The line comes into the solid.
    pub enters: bool,
    /// The face's normal points into the solid.
    pub is_turned: bool,
    /// The operand whose face it is.
    pub operand: u32,
}
