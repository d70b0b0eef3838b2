//! Solids placed in the world, and the spans of lines inside them.

use crate::accel::{MeshCrossingTrees, PreparedCsg};
use crate::geom::exact::{Line, Root, span};
use crate::geom::primitive::Boundaries;
use crate::math::bounds::{ErrorBounded, UNIT};
use crate::math::{Aabb, Affine};
use crate::scene::{Scene, Shape, ShapeId, check_closed, shape_bounds};
use crate::trace::{TraceScratch, boundaries};
use glam::DVec3;
use std::ops::ControlFlow;

/// A solid, placed in the world.
pub struct Placed<'a> {
    scene: &'a Scene,
    shape: Shape,
    /// The CSG solid, or a shape that a line may enter many times.
    csg: Option<PreparedCsg>,
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
            shape,
            csg,
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
        let line = Line {
            org: self.object_from_world.point(org.to_array()),
            dir: self.object_from_world.vector(dir.to_array()),
        };
        // The accuracy that sums of chords need; NaN counts as unknown.
        let room = self.unit * 1e-9;
        let place = |root: &Root| match root.t {
            ErrorBounded { value, error } if error <= room => ErrorBounded {
                value,
                error: error + value.abs() * UNIT,
            },
            _ => ErrorBounded {
                value: root.rounded(),
                error: root.rounded().abs() * UNIT,
            },
        };
        let mut part = |enter: ErrorBounded, exit: ErrorBounded| {
            part(enter.value, exit.value, enter.error + exit.error);
        };
        let Some(csg) = &self.csg else {
            let solid = self.scene.solid(self.shape);
            for ends in solid.iter().flat_map(|solid| span(solid, &line).spans()) {
                if let [Some(enter), Some(exit)] = ends {
                    part(place(&enter), place(&exit));
                }
            }
            return;
        };
        let mut since = None;
        let whole = (&line, f64::NEG_INFINITY);
        boundaries(csg, self.scene, whole, scratch, |change| {
            let t = place(&change.root);
            if change.enters {
                since = Some(t);
            } else if let Some(enter) = since.take() {
                part(enter, t);
            }
            ControlFlow::Continue(())
        });
    }
}
