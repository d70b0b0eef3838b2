//! Sections: a scene cut by planes, as technical drawings show what is inside.
//!
//! A solid that a plane cuts becomes its intersection with a half-space, so that the cut is as
//! exact as all solids are. The half-space goes down to the operands that add to a solid: the cut
//! then shows of which operand a place is. Surfaces of meshes without an inside are cut triangle by
//! triangle ([`super::section_mesh`]).

use super::hatching::{Hatch, Hatcher};
use super::primitives::shape_bounds;
use super::section_mesh::cut_mesh;
use super::watertight::check_closed;
use super::{
    CsgId, Edge, Instances, MaterialId, Operand, Scene, SceneBuilder, SceneError, Shape, ShapeId,
    TransformId,
};
use crate::csg::Operator;
use crate::geom::HalfSpace;
use crate::math::{Aabb, Affine};
use glam::DVec3;
use std::collections::HashMap;

/// What a section leaves as it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Uncut {
    /// Instances of surfaces that a plane goes through, which are no meshes.
    pub surfaces: u64,
}

impl Scene {
    /// Keeps what is in all of these half-spaces of the world, and may hatch the faces that they make.
    /// Instances are counted anew: those beyond a plane are left out. The scene must be at rest. Returns
    /// an error if there are too many instances to lay out.
    pub fn cut(
        self,
        kept: &[HalfSpace],
        hatch: Option<Hatch>,
    ) -> Result<(Scene, Uncut), SceneError> {
        if kept.is_empty() {
            return Ok((self, Uncut::default()));
        }
        let instances = Instances::of(&self)?;
        let rows = instances.laid_out(&self)?.into_owned();
        let names: Vec<String> = (0..self.roots.len() as u32)
            .map(|root| self.root_names.get(root).unwrap_or_default().to_owned())
            .collect();
        let mut section = Section::new(SceneBuilder::from(self), kept);
        let mut uncut = Uncut::default();
        if let Some(hatch) = hatch {
            let placed = rows.iter().map(|row| (row.shape, &row.world_from_object));
            let longest = section.longest(placed);
            section.hatcher = Some(Hatcher::new(hatch, longest));
        }
        for (number, row) in rows.into_iter().enumerate() {
            let sides = section.sides(row.shape, &row.world_from_object);
            let Some(planes) = sides else {
                continue;
            };
            let instance = Instance {
                number,
                world_from_object: row.world_from_object,
                planes: &planes,
            };
            let shape = match planes.is_empty() {
                true => Some(row.shape),
                false => section.cut(row.shape, row.material, &instance),
            };
            let transform = section.builder.transform(row.world_from_object);
            let edge = Edge::shape(shape.unwrap_or(row.shape)).transform(transform);
            let edge = match row.material.filter(|_| !section.is_hatched(shape, &planes)) {
                Some(material) => edge.material(material),
                None => edge,
            };
            uncut.surfaces += u64::from(shape.is_none());
            section.builder.instance(&names[row.root as usize], edge);
        }
        Ok((section.builder.finish()?, uncut))
    }
}

/// The most planes through one shape that are looked at together, which takes time as their number to the
/// power of four.
const MOST_TOGETHER: usize = 12;

struct Section {
    builder: SceneBuilder,
    kept: Vec<HalfSpace>,
    /// The shapes of the half-spaces, in world space.
    shapes: Vec<ShapeId>,
    /// Whether meshes are closed.
    closed: HashMap<u32, bool>,
    /// Makes the materials of the faces, if they are hatched.
    hatcher: Option<Hatcher>,
}

/// An instance that planes cut.
struct Instance<'a> {
    number: usize,
    world_from_object: Affine,
    /// The rows of the planes.
    planes: &'a [usize],
}

/// A CSG solid with its new row, the map from the world to its space, and the material that its
/// operands have if they have none of their own.
type Waiting = (CsgId, CsgId, Affine, Option<MaterialId>);

impl Section {
    fn new(mut builder: SceneBuilder, kept: &[HalfSpace]) -> Section {
        builder.clear_instances();
        let shapes = kept.iter().map(|plane| builder.half_space("", *plane));
        let shapes = shapes.collect();
        Section {
            builder,
            kept: kept.to_vec(),
            shapes,
            closed: HashMap::new(),
            hatcher: None,
        }
    }

    /// Returns the longest side of the box around all that planes cut.
    fn longest<'a>(&self, placed: impl Iterator<Item = (ShapeId, &'a Affine)>) -> f64 {
        let boxes = placed.filter_map(|(shape, world_from_object)| {
            self.sides(shape, world_from_object)
                .filter(|s| !s.is_empty())?;
            let bounds = shape_bounds(self.builder.tables(), shape)?;
            let corners = corners(&bounds, world_from_object);
            let least = corners.into_iter().reduce(DVec3::min)?;
            Some((least, corners.into_iter().reduce(DVec3::max)?))
        });
        let all = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        all.map_or(0.0, |(least, most)| (most - least).max_element())
    }

    /// Returns the planes that may cut a shape; `None` if it lies beyond one of them, or beyond all that
    /// several leave together.
    fn sides(&self, shape: ShapeId, world_from_object: &Affine) -> Option<Vec<usize>> {
        let all = || (0..self.kept.len()).collect();
        let Some(bounds) = shape_bounds(self.builder.tables(), shape) else {
            return Some(all());
        };
        let corners = corners(&bounds, world_from_object);
        let size = corners
            .iter()
            .fold(0.0, |m, p| f64::max(m, p.abs().max_element()));
        let mut cutting = Vec::new();
        for (number, plane) in self.kept.iter().enumerate() {
            let normal = plane.normal.normalize();
            let offset = plane.offset / plane.normal.length();
            let slack = 1e-9 * (size + offset.abs());
            let heights = corners.map(|p| p.dot(normal) - offset);
            if heights.iter().all(|h| *h > slack) {
                return None;
            }
            if heights.iter().any(|h| *h > -slack) {
                cutting.push(number);
            }
        }
        let planes = cutting.iter().map(|number| &self.kept[*number]);
        let planes: Vec<HalfSpace> = planes
            .map(|plane| in_object(plane, world_from_object))
            .collect();
        let is_tested = (2..=MOST_TOGETHER).contains(&planes.len());
        (!is_tested || leaves_some(&bounds, &planes)).then_some(cutting)
    }

    /// Returns an instance's shape cut by planes; `None` if it is a surface that cannot be.
    fn cut(
        &mut self,
        shape: ShapeId,
        material: Option<MaterialId>,
        instance: &Instance,
    ) -> Option<ShapeId> {
        let tables = self.builder.tables();
        let kind = tables.shapes.row(shape);
        if let Shape::Mesh(id) = kind
            && !tables.deformations.has(id)
        {
            let closed = self.closed.entry(id.0);
            let closed = *closed.or_insert_with(|| {
                tables.no_inside(kind).is_none() && check_closed(tables, id).is_ok()
            });
            if !closed {
                let planes: Vec<HalfSpace> = instance
                    .planes
                    .iter()
                    .map(|plane| in_object(&self.kept[*plane], &instance.world_from_object))
                    .collect();
                let name = tables
                    .shapes
                    .names
                    .get(shape.0)
                    .unwrap_or_default()
                    .to_owned();
                let data = cut_mesh(tables, id, &planes);
                return Some(self.builder.mesh(&name, &data));
            }
        } else if tables.no_inside(kind).is_some() {
            return None;
        }
        let object_from_world = instance.world_from_object.inverse()?;
        let shape = match material.filter(|_| self.hatcher.is_some()) {
            Some(material) => self.of_material(shape, material),
            None => shape,
        };
        Some(self.cut_solid(shape, object_from_world, instance))
    }

    /// Makes a solid all of whose surfaces have a material, as an instance's material does; that would
    /// hide hatches, too.
    fn of_material(&mut self, shape: ShapeId, material: MaterialId) -> ShapeId {
        let tables = self.builder.tables();
        let name = tables.shapes.names.get(shape.0).unwrap_or_default();
        let name = name.to_owned();
        let tolerance = match tables.shapes.row(shape) {
            Shape::Csg(id) => tables.csg.tolerance[id.index()],
            _ => 0.0,
        };
        let (solid, row) = self.builder.declare_csg(&name, Operator::Union);
        self.builder.set_operands(row, &[Operand::shape(shape)]);
        self.builder.set_csg_material(row, material);
        self.builder.set_tolerance(row, tolerance);
        solid
    }

    /// Says whether what planes have made of an instance's shape has hatched faces.
    fn is_hatched(&self, cut: Option<ShapeId>, planes: &[usize]) -> bool {
        let tables = self.builder.tables();
        let is_solid = |shape| matches!(tables.shapes.row(shape), Shape::Csg(_));
        self.hatcher.is_some() && !planes.is_empty() && cut.is_some_and(is_solid)
    }

    /// Cuts a solid, from its own operator down to the operands that add to it.
    fn cut_solid(
        &mut self,
        shape: ShapeId,
        object_from_world: Affine,
        instance: &Instance,
    ) -> ShapeId {
        let mut waiting: Vec<Waiting> = Vec::new();
        let cut = self.begin(shape, (object_from_world, None), instance, &mut waiting);
        while let Some((from, to, space, material)) = waiting.pop() {
            let table = &self.builder.tables().csg;
            let operator = table.operator[from.index()];
            let mut operands = table.operands(from).to_vec();
            let adds = match operator {
                Operator::Union | Operator::Xor => operands.len(),
                Operator::Intersection | Operator::Difference => 1,
                // What is not in the operand is the half-spaces without it.
                Operator::Complement => {
                    let whole = self.half_spaces(instance, &space, Face::of(None, material));
                    let whole = match whole[..] {
                        [one] => one,
                        _ => {
                            let both = self.builder.csg("", Operator::Intersection, &whole);
                            Operand::shape(both)
                        }
                    };
                    operands.insert(0, whole);
                    0
                }
            };
            for operand in &mut operands[..adds] {
                let inner = self.builder.tables().transforms.inverse[operand.transform.index()];
                // A scene that is checked has inverses.
                let inner = inner.unwrap_or(Affine::IDENTITY).then_after(&space);
                let material = operand.material.or(material);
                operand.shape =
                    self.begin(operand.shape, (inner, material), instance, &mut waiting);
            }
            self.builder.set_operands(to, &operands);
        }
        cut
    }

    /// Cuts what is no CSG solid; of a CSG solid makes the new row and has it wait.
    fn begin(
        &mut self,
        shape: ShapeId,
        (object_from_world, outer): (Affine, Option<MaterialId>),
        instance: &Instance,
        waiting: &mut Vec<Waiting>,
    ) -> ShapeId {
        let tables = self.builder.tables();
        let name = tables
            .shapes
            .names
            .get(shape.0)
            .unwrap_or_default()
            .to_owned();
        let (face, tolerance) = match tables.shapes.row(shape) {
            Shape::Csg(id) => {
                let (own, tolerance) = (
                    tables.csg.material[id.index()],
                    tables.csg.tolerance[id.index()],
                );
                // What has one material has one hatch, which the material of the cut would hide.
                if own.is_none() || self.hatcher.is_none() {
                    let operator = match tables.csg.operator[id.index()] {
                        Operator::Complement => Operator::Difference,
                        operator => operator,
                    };
                    let (cut, row) = self.builder.declare_csg(&name, operator);
                    if let Some(material) = own {
                        self.builder.set_csg_material(row, material);
                    }
                    self.builder.set_tolerance(row, tolerance);
                    waiting.push((id, row, object_from_world, outer));
                    return cut;
                }
                (Face::of(own, None), tolerance)
            }
            Shape::Mesh(id) => {
                let first = tables.meshes.row(id).parts.first();
                (Face::of(first.and_then(|part| part.1), outer), 0.0)
            }
            _ => (Face::of(None, outer), 0.0),
        };
        let mut operands = vec![Operand::shape(shape)];
        operands.extend(self.half_spaces(instance, &object_from_world, face));
        let (cut, row) = self.builder.declare_csg(&name, Operator::Intersection);
        self.builder.set_operands(row, &operands);
        self.builder.set_tolerance(row, tolerance);
        cut
    }

    /// Returns the half-spaces as operands of a solid in a space.
    fn half_spaces(
        &mut self,
        instance: &Instance,
        space_from_world: &Affine,
        face: Face,
    ) -> Vec<Operand> {
        let transform = match space_from_world.is_identity() {
            true => TransformId::IDENTITY,
            false => self.builder.transform(*space_from_world),
        };
        let operand = |plane: &usize| Operand {
            shape: self.shapes[*plane],
            transform,
            material: match &mut self.hatcher {
                Some(hatcher) => Some(hatcher.material(
                    &mut self.builder,
                    (instance.number, &instance.world_from_object),
                    (*plane, &self.kept[*plane]),
                    face.shown,
                )),
                None => face.own,
            },
        };
        instance.planes.iter().map(operand).collect()
    }
}

/// The materials of a face that a plane makes.
#[derive(Clone, Copy)]
struct Face {
    /// That of its half-space, if the one around does not count.
    own: Option<MaterialId>,
    /// The one that it shows.
    shown: Option<MaterialId>,
}

impl Face {
    /// Of a solid's own material and the one around, which counts first.
    fn of(own: Option<MaterialId>, outer: Option<MaterialId>) -> Face {
        Face {
            own: own.filter(|_| outer.is_none()),
            shown: outer.or(own),
        }
    }
}

/// Returns a half-space of the world in a shape's own space.
fn in_object(plane: &HalfSpace, world_from_object: &Affine) -> HalfSpace {
    let normal = plane.normal.to_array();
    let origin = DVec3::from_array(world_from_object.point([0.0; 3]));
    HalfSpace {
        normal: DVec3::from_array(world_from_object.transposed_vector(normal)),
        offset: plane.offset - origin.dot(plane.normal),
    }
}

/// Says whether half-spaces may leave something of a box: whether a corner of what they leave, where three
/// of their planes and the box's own meet, is in all of them.
fn leaves_some(bounds: &Aabb, kept: &[HalfSpace]) -> bool {
    let of_box = DVec3::AXES.into_iter().flat_map(|axis| {
        let [most, least] = [(axis, bounds.max), (-axis, bounds.min)];
        [most, least].map(|(normal, corner)| (normal, normal.dot(corner)))
    });
    let kept = kept.iter().map(|plane| {
        let length = plane.normal.length();
        (plane.normal / length, plane.offset / length)
    });
    let planes: Vec<(DVec3, f64)> = of_box.chain(kept).collect();
    let size = bounds.max_abs() + bounds.diagonal();
    let is_left = |p: DVec3, slack: f64| planes.iter().all(|(n, d)| n.dot(p) - d <= slack);
    let count = planes.len();
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    let mut triples = pairs.flat_map(|(i, j)| (j + 1..count).map(move |k| [i, j, k]));
    triples.any(|triple| {
        let [(a, of_a), (b, of_b), (c, of_c)] = triple.map(|plane| planes[plane]);
        let volume = a.dot(b.cross(c));
        // Planes that are parallel, up to rounding, have no corner.
        if volume.abs() < 1e-9 {
            return false;
        }
        let corner = (b.cross(c) * of_a + c.cross(a) * of_b + a.cross(b) * of_c) / volume;
        is_left(corner, 1e-9 * size / volume.abs())
    })
}

fn corners(bounds: &Aabb, place: &Affine) -> [DVec3; 8] {
    let corners = bounds.corners();
    corners.map(|p| DVec3::from_array(place.point(p.to_array())))
}

#[cfg(test)]
#[path = "section_tests.rs"]
mod tests;
