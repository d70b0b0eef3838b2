//! Spans of a line inside the solids of a scene, for mass, thickness and path length.
//!
//! Spans are exact. [`Solids`] are prepared once for any number of lines. Where two solids
//! overlap, both are listed. Shapes without an inside (polygons; open cylinders, cones and
//! implicit surfaces; meshes that are not closed) are counted and left out.

use super::csg::{TURNED, boundaries, passes_by};
use super::scratch::TraceScratch;
use crate::accel::{InstanceCrossings, MeshCrossingTrees, PreparedCsg};
use crate::geom::exact::{Line, Root, span};
use crate::geom::primitive::Boundaries;
use crate::math::unit;
use crate::scene::{
    CsgSolid, Instance, Instances, MaterialId, Scene, SceneError, Shape, ShapeId, Tables,
    check_closed, shape_bounds,
};
use glam::DVec3;
use std::ops::ControlFlow;

/// A point where a line enters or leaves a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// The f64 nearest to the exact t, in units of the direction's length.
    pub t: f64,
    /// Shape of the surface: for a CSG solid, the operand.
    pub shape: ShapeId,
    pub material: Option<MaterialId>,
    /// World space.
    pub point: DVec3,
    /// World space, unit, outward.
    pub normal: DVec3,
}

/// A span of a line inside a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Id of one of [`Instances`].
    pub instance: u64,
    /// The placed solid.
    pub shape: ShapeId,
    /// `None` if the line comes from infinity inside.
    pub enter: Option<End>,
    /// `None` if the line goes to infinity inside.
    pub exit: Option<End>,
}

impl Span {
    pub fn t_enter(&self) -> f64 {
        self.enter.map_or(f64::NEG_INFINITY, |end| end.t)
    }

    pub fn t_exit(&self) -> f64 {
        self.exit.map_or(f64::INFINITY, |end| end.t)
    }
}

/// All spans of a line.
#[derive(Clone, Debug, Default)]
pub struct Spans {
    /// Sorted by t_enter, t_exit and instance. A touching line has a span of one point in a
    /// primitive, and none in a CSG solid.
    pub rows: Vec<Span>,
    /// Number of instances of shapes without an inside, whether the line hits them or not.
    pub left_out: u64,
}

/// The solids of a scene, prepared for lines: each is unfolded once, and instances stand in a
/// tree.
pub struct Solids {
    scene: Scene,
    instances: Vec<Instance>,
    crossings: InstanceCrossings,
    /// By shape, of those that appear.
    prepared: Vec<PreparedSolid>,
    left_out: u64,
}

/// How the spans of a shape are found.
enum PreparedSolid {
    /// It has no inside, or does not appear.
    None,
    /// It has at most one span, from its exact predicate.
    Convex,
    Csg(Box<PreparedCsg>),
}

impl Solids {
    /// Prepares the solids of a scene. Returns an error if there are too many instances to
    /// enumerate.
    pub fn prepare(scene: &Scene, instances: &Instances) -> Result<Solids, SceneError> {
        instances.check_enumerable()?;
        let mut trees = MeshCrossingTrees::default();
        let counts = instances.of_shapes(scene);
        let ids = (0..scene.shapes.len() as u32).map(ShapeId);
        let prepared: Vec<PreparedSolid> = ids
            .zip(&counts)
            .map(|(id, count)| match count {
                0 => PreparedSolid::None,
                _ => PreparedSolid::new(scene, id, &mut trees),
            })
            .collect();
        let without = prepared.iter().zip(&counts);
        let without = without.filter(|(solid, _)| matches!(solid, PreparedSolid::None));
        Ok(Solids {
            scene: scene.clone(),
            instances: instances.iter(scene).collect(),
            crossings: InstanceCrossings::build(scene, instances),
            left_out: without.map(|(_, count)| count).sum(),
            prepared,
        })
    }

    /// Finds the spans of a line in world space; `dir` has any length but 0.
    pub fn spans(&self, org: DVec3, dir: DVec3, scratch: &mut TraceScratch) -> Spans {
        let scene = &*self.scene;
        let mut rows = Vec::new();
        let mut crossed = Vec::new();
        self.crossings.along(org, dir, |id| crossed.push(id));
        crossed.sort_unstable();
        for id in crossed {
            let instance = self.instances[id as usize];
            let solid = &self.prepared[instance.shape.index()];
            if matches!(solid, PreparedSolid::None) {
                continue;
            }
            let ray = Ray::new(scene, (id, instance), (org, dir));
            let shape = scene.shapes.row(instance.shape);
            let is_beside = || {
                let bounds = shape_bounds(scene, instance.shape);
                bounds.is_some_and(|bounds| passes_by(&bounds, &ray.line, 1.0))
            };
            if !matches!(shape, Shape::Mesh(_)) && is_beside() {
                continue;
            }
            match solid {
                PreparedSolid::None => {}
                PreparedSolid::Convex => ray.push_primitive_spans(shape, &mut rows),
                PreparedSolid::Csg(csg) => ray.push_csg_spans(csg, &mut rows, scratch),
            }
        }
        let by_t = |a: &Span, b: &Span| {
            let exit = || a.t_exit().total_cmp(&b.t_exit());
            a.t_enter().total_cmp(&b.t_enter()).then_with(exit)
        };
        // The sort is stable: equal spans stay in the order of instances.
        rows.sort_by(by_t);
        Spans {
            rows,
            left_out: self.left_out,
        }
    }

    /// Calls `visit` for each solid that contains a point in world space, with the material of
    /// the surface through which a vertical line from there leaves it, or has entered it. A point
    /// on a surface is inside if the line upwards from it is. Allocates nothing that `scratch`
    /// does not keep.
    pub fn around(
        &self,
        point: DVec3,
        scratch: &mut TraceScratch,
        mut visit: impl FnMut(Option<MaterialId>),
    ) {
        let scene = &*self.scene;
        let up = DVec3::Y;
        self.crossings.along(point, up, |id| {
            let instance = self.instances[id as usize];
            let solid = &self.prepared[instance.shape.index()];
            if matches!(solid, PreparedSolid::None) {
                return;
            }
            let ray = Ray::new(scene, (id, instance), (point, up));
            let at = DVec3::from_array(ray.line.org);
            let bounds = shape_bounds(scene, instance.shape);
            if bounds.is_some_and(|own| !(at.cmpge(own.min) & at.cmple(own.max)).all()) {
                return;
            }
            let inside = match solid {
                PreparedSolid::None => None,
                PreparedSolid::Convex => ray.is_inside_primitive(scene.shapes.row(instance.shape)),
                PreparedSolid::Csg(csg) => ray.inside_csg(csg, scratch),
            };
            if let Some(material) = inside {
                visit(instance.material.or(material));
            }
        });
    }
}

impl PreparedSolid {
    fn new(scene: &Tables, id: ShapeId, trees: &mut MeshCrossingTrees) -> PreparedSolid {
        let single = || PreparedSolid::Csg(Box::new(PreparedCsg::prepare_single(scene, id)));
        match scene.shapes.row(id) {
            Shape::Mesh(row) if scene.meshes.open[row.index()] => PreparedSolid::None,
            Shape::Mesh(row) if check_closed(scene, row).is_err() => PreparedSolid::None,
            Shape::Mesh(_) => single(),
            shape if scene.no_inside(shape).is_some() => PreparedSolid::None,
            Shape::Csg(row) => {
                PreparedSolid::Csg(Box::new(PreparedCsg::prepare(scene, id, row, trees)))
            }
            // The line may enter and leave several times.
            shape if shape.boundaries() != Boundaries::Span => single(),
            _ => PreparedSolid::Convex,
        }
    }
}

/// A line and one instance.
struct Ray<'s> {
    scene: &'s Tables,
    instance: Instance,
    id: u64,
    org: DVec3,
    dir: DVec3,
    /// Object space.
    line: Line,
}

impl<'s> Ray<'s> {
    fn new(
        scene: &'s Tables,
        (id, instance): (u64, Instance),
        (org, dir): (DVec3, DVec3),
    ) -> Ray<'s> {
        Ray {
            scene,
            instance,
            id,
            org,
            dir,
            line: Line {
                org: instance.object_from_world.point(org.to_array()),
                dir: instance.object_from_world.vector(dir.to_array()),
            },
        }
    }

    /// Says whether the line's origin lies in a primitive: `Some` of no material if it does.
    fn is_inside_primitive(&self, shape: Shape) -> Option<Option<MaterialId>> {
        let solid = self.scene.solid(shape)?;
        let parts = span(&solid, &self.line);
        let around = |[enter, exit]: [Option<Root>; 2]| {
            enter.is_none_or(|root| root.order_with(0.0).is_le())
                && exit.is_none_or(|root| root.order_with(0.0).is_gt())
        };
        parts.spans().any(around).then_some(None)
    }

    /// Says whether the line's origin lies in a CSG solid, and returns the material of the
    /// surface through which the line leaves it, or has entered it.
    fn inside_csg(
        &self,
        csg: &PreparedCsg,
        scratch: &mut TraceScratch,
    ) -> Option<Option<MaterialId>> {
        let solid = &csg.solid;
        // Whether the line is inside before the first boundary is known after all of them.
        let (mut entered, mut next) = (None, None);
        let from_inside = boundaries(csg, self.scene, (&self.line, 0.0), scratch, |crossing| {
            let material = self.material_at(solid, crossing.primitive);
            if crossing.root.order_with(0.0).is_gt() {
                next = Some((!crossing.enters, material));
                return ControlFlow::Break(());
            }
            entered = Some((crossing.enters, material));
            ControlFlow::Continue(())
        });
        match (next, entered) {
            (Some((leaves, material)), _) => leaves.then_some(material),
            (None, Some((enters, material))) => enters.then_some(material),
            (None, None) => from_inside.then_some(None),
        }
    }

    /// Returns the material of an operand's surface.
    fn material_at(&self, solid: &CsgSolid, primitive: u32) -> Option<MaterialId> {
        let (number, triangle) = solid.operand_of(primitive & !TURNED);
        let operand = &solid.operands[number as usize];
        let of_mesh = || match operand.shape {
            Shape::Mesh(id) => self.scene.meshes.row(id).material(triangle),
            _ => None,
        };
        operand.material.or_else(of_mesh)
    }

    fn push_primitive_spans(&self, shape: Shape, spans: &mut Vec<Span>) {
        let Some(solid) = self.scene.solid(shape) else {
            return;
        };
        let end = |root: Root| {
            let t = root.rounded();
            let normal = root.normal_at(t);
            self.end(t, self.instance.shape, None, normal)
        };
        let parts = span(&solid, &self.line);
        spans.extend(
            parts
                .spans()
                .map(|[enter, exit]| self.span(enter.map(end), exit.map(end))),
        );
    }

    fn push_csg_spans(&self, csg: &PreparedCsg, spans: &mut Vec<Span>, scratch: &mut TraceScratch) {
        let solid = &csg.solid;
        let first = spans.len();
        let mut open = None;
        let always = boundaries(
            csg,
            self.scene,
            (&self.line, f64::NEG_INFINITY),
            scratch,
            |crossing| {
                let (number, _) = solid.operand_of(crossing.primitive & !TURNED);
                let operand = &solid.operands[number as usize];
                let frame = &solid.frames[operand.frame as usize];
                let t = crossing.root.rounded();
                let normal = crossing.root.normal_at(t).to_array();
                let normal = frame.operand_from_solid.transposed_vector(normal);
                let side = if crossing.primitive & TURNED != 0 {
                    -1.0
                } else {
                    1.0
                };
                let normal = DVec3::from_array(normal) * side;
                let material = self.material_at(solid, crossing.primitive);
                let end = self.end(t, operand.id, material, normal);
                if crossing.enters {
                    open = Some(end);
                } else {
                    spans.push(self.span(open.take(), Some(end)));
                }
                ControlFlow::Continue(())
            },
        );
        // A solid that the line does not leave.
        if open.is_some() || (always && spans.len() == first) {
            spans.push(self.span(open, None));
        }
    }

    fn span(&self, enter: Option<End>, exit: Option<End>) -> Span {
        Span {
            instance: self.id,
            shape: self.instance.shape,
            enter,
            exit,
        }
    }

    /// Builds an end. `normal`: object space, of any length.
    fn end(&self, t: f64, shape: ShapeId, material: Option<MaterialId>, normal: DVec3) -> End {
        let map = &self.instance.object_from_world;
        let normal = unit(DVec3::from_array(map.transposed_vector(normal.to_array())));
        End {
            t,
            shape,
            material: self.instance.material.or(material),
            point: self.org + self.dir * t,
            // Adding 0 turns −0 into 0 for output.
            normal: normal + DVec3::ZERO,
        }
    }
}
