//! Spans of a line inside the solids of a scene, for mass, thickness and path length.
//!
//! Spans are exact. One line is intersected with every instance in turn; no structure is
//! built. Where two solids overlap, both are listed. Shapes without an inside (polygons; open
//! cylinders, cones and implicit surfaces; meshes that are not closed) are counted and left
//! out.

use super::csg::{TURNED, boundaries, passes_by};
use super::scratch::TraceScratch;
use crate::accel::{MeshCrossingTrees, PreparedCsg};
use crate::geom::exact::{Line, Root, span};
use crate::geom::primitive::Boundaries;
use crate::math::unit;
use crate::scene::{
    Instance, Instances, MaterialId, SceneError, Shape, ShapeId, Tables, check_closed, shape_bounds,
};
use glam::DVec3;
use std::collections::HashMap;
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

/// Finds the spans of a line in world space; `dir` has any length but 0. Fails if there are
/// too many instances to enumerate.
pub fn spans(
    scene: &Tables,
    instances: &Instances,
    org: DVec3,
    dir: DVec3,
) -> Result<Spans, SceneError> {
    instances.check_enumerable()?;
    let (mut spans, mut scratch) = (Spans::default(), TraceScratch::default());
    let mut unfolded: HashMap<ShapeId, Option<PreparedCsg>> = HashMap::new();
    let mut trees = MeshCrossingTrees::default();
    for (id, instance) in (0..).zip(instances.iter(scene)) {
        let ray = Ray {
            scene,
            instance,
            id,
            org,
            dir,
            line: Line {
                org: instance.object_from_world.point(org.to_array()),
                dir: instance.object_from_world.vector(dir.to_array()),
            },
        };
        match scene.shapes.row(instance.shape) {
            Shape::Mesh(row) => {
                let one = || PreparedCsg::prepare_single(scene, instance.shape);
                let is_solid =
                    || !scene.meshes.open[row.index()] && check_closed(scene, row).is_ok();
                let solid = unfolded.entry(instance.shape);
                match solid.or_insert_with(|| is_solid().then(one)) {
                    Some(solid) => ray.push_csg_spans(solid, &mut spans.rows, &mut scratch),
                    None => spans.left_out += 1,
                }
            }
            shape if scene.no_inside(shape).is_some() => spans.left_out += 1,
            shape => {
                let bounds = shape_bounds(scene, instance.shape);
                if bounds.is_some_and(|bounds| passes_by(&bounds, &ray.line, 1.0)) {
                    continue;
                }
                match shape {
                    Shape::Csg(row) => {
                        let mut of =
                            || PreparedCsg::prepare(scene, instance.shape, row, &mut trees);
                        let solid = unfolded.entry(instance.shape);
                        if let Some(solid) = solid.or_insert_with(|| Some(of())) {
                            ray.push_csg_spans(solid, &mut spans.rows, &mut scratch);
                        }
                    }
                    // The line may enter and leave several times.
                    shape if shape.boundaries() != Boundaries::Span => {
                        let one = || Some(PreparedCsg::prepare_single(scene, instance.shape));
                        let solid = unfolded.entry(instance.shape);
                        if let Some(solid) = solid.or_insert_with(one) {
                            ray.push_csg_spans(solid, &mut spans.rows, &mut scratch);
                        }
                    }
                    _ => ray.push_primitive_spans(shape, &mut spans.rows),
                }
            }
        }
    }
    let by_t = |a: &Span, b: &Span| {
        let exit = || a.t_exit().total_cmp(&b.t_exit());
        a.t_enter().total_cmp(&b.t_enter()).then_with(exit)
    };
    // The sort is stable: equal spans stay in the order of instances.
    spans.rows.sort_by(by_t);
    Ok(spans)
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

impl Ray<'_> {
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
                let (number, triangle) = solid.operand_of(crossing.primitive & !TURNED);
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
                let material = || match operand.shape {
                    Shape::Mesh(id) => self.scene.meshes.row(id).material(triangle),
                    _ => None,
                };
                let material = operand.material.or_else(material);
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
