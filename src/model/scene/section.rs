//! Sections: a scene cut by planes, as technical drawings show what is inside.
//!
//! A solid that a plane cuts becomes its intersection with a half-space, so that the cut is as
//! exact as all solids are. The half-space goes down to the operands that add to a solid: the cut
//! then shows of which operand a place is. Surfaces of meshes without an inside are cut triangle by
//! triangle ([`super::section_mesh`]).

use super::primitives::shape_bounds;
use super::section_mesh::cut_mesh;
use super::watertight::check_closed;
use super::{
    CsgId, Edge, Instances, Operand, Scene, SceneBuilder, SceneError, Shape, ShapeId, TransformId,
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
    /// Keeps what is in all of these half-spaces of the world. Instances are counted anew: those
    /// beyond a plane are left out. The scene must be at rest. Returns an error if there are too
    /// many instances to lay out.
    pub fn cut(self, kept: &[HalfSpace]) -> Result<(Scene, Uncut), SceneError> {
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
        for row in rows {
            let sides = section.sides(row.shape, &row.world_from_object);
            let Some(planes) = sides else {
                continue;
            };
            let shape = match planes.is_empty() {
                true => Some(row.shape),
                false => section.cut(row.shape, &row.world_from_object, &planes),
            };
            let transform = section.builder.transform(row.world_from_object);
            let edge = Edge::shape(shape.unwrap_or(row.shape)).transform(transform);
            let edge = match row.material {
                Some(material) => edge.material(material),
                None => edge,
            };
            uncut.surfaces += u64::from(shape.is_none());
            section.builder.instance(&names[row.root as usize], edge);
        }
        Ok((section.builder.finish()?, uncut))
    }
}

struct Section {
    builder: SceneBuilder,
    kept: Vec<HalfSpace>,
    /// The shapes of the half-spaces, in world space.
    shapes: Vec<ShapeId>,
    /// Whether meshes are closed.
    closed: HashMap<u32, bool>,
}

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
        }
    }

    /// Returns the planes that may cut a shape; `None` if it lies beyond one of them.
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
        Some(cutting)
    }

    /// Returns a shape cut by some planes; `None` if it is a surface that cannot be.
    fn cut(
        &mut self,
        shape: ShapeId,
        world_from_object: &Affine,
        planes: &[usize],
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
                let planes: Vec<HalfSpace> = planes
                    .iter()
                    .map(|plane| in_object(&self.kept[*plane], world_from_object))
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
        let object_from_world = world_from_object.inverse()?;
        Some(self.cut_solid(shape, object_from_world, planes))
    }

    /// Cuts a solid, from its own operator down to the operands that add to it.
    fn cut_solid(
        &mut self,
        shape: ShapeId,
        object_from_world: Affine,
        planes: &[usize],
    ) -> ShapeId {
        // Solids with their new rows, and the map from the world to their space.
        let mut waiting: Vec<(CsgId, CsgId, Affine)> = Vec::new();
        let cut = self.begin(shape, object_from_world, planes, &mut waiting);
        while let Some((from, to, space)) = waiting.pop() {
            let table = &self.builder.tables().csg;
            let operator = table.operator[from.index()];
            let mut operands = table.operands(from).to_vec();
            let adds = match operator {
                Operator::Union | Operator::Xor => operands.len(),
                Operator::Intersection | Operator::Difference => 1,
                // What is not in the operand is the half-spaces without it.
                Operator::Complement => {
                    let whole = self.half_spaces(planes, &space, None);
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
                operand.shape = self.begin(operand.shape, inner, planes, &mut waiting);
            }
            self.builder.set_operands(to, &operands);
        }
        cut
    }

    /// Cuts what is no CSG solid; of a CSG solid makes the new row and has it wait.
    fn begin(
        &mut self,
        shape: ShapeId,
        object_from_world: Affine,
        planes: &[usize],
        waiting: &mut Vec<(CsgId, CsgId, Affine)>,
    ) -> ShapeId {
        let tables = self.builder.tables();
        let name = tables
            .shapes
            .names
            .get(shape.0)
            .unwrap_or_default()
            .to_owned();
        let Shape::Csg(id) = tables.shapes.row(shape) else {
            let material = match tables.shapes.row(shape) {
                Shape::Mesh(id) => tables.meshes.row(id).parts.first().and_then(|part| part.1),
                _ => None,
            };
            let mut operands = vec![Operand::shape(shape)];
            operands.extend(self.half_spaces(planes, &object_from_world, material));
            return self.builder.csg(&name, Operator::Intersection, &operands);
        };
        let (material, tolerance) = (
            tables.csg.material[id.index()],
            tables.csg.tolerance[id.index()],
        );
        let operator = match tables.csg.operator[id.index()] {
            Operator::Complement => Operator::Difference,
            operator => operator,
        };
        let (cut, row) = self.builder.declare_csg(&name, operator);
        if let Some(material) = material {
            self.builder.set_csg_material(row, material);
        }
        self.builder.set_tolerance(row, tolerance);
        waiting.push((id, row, object_from_world));
        cut
    }

    /// Returns the half-spaces as operands of a solid in a space.
    fn half_spaces(
        &mut self,
        planes: &[usize],
        space_from_world: &Affine,
        material: Option<super::MaterialId>,
    ) -> Vec<Operand> {
        let transform = match space_from_world.is_identity() {
            true => TransformId::IDENTITY,
            false => self.builder.transform(*space_from_world),
        };
        let operand = |plane: &usize| Operand {
            shape: self.shapes[*plane],
            transform,
            material,
        };
        planes.iter().map(operand).collect()
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

fn corners(bounds: &Aabb, place: &Affine) -> [DVec3; 8] {
    let corners = bounds.corners();
    corners.map(|p| DVec3::from_array(place.point(p.to_array())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cuboid, Sphere};
    use crate::scene::{Material, MeshData, Target};
    use glam::DAffine3;

    fn keep_below(offset: f64) -> HalfSpace {
        HalfSpace {
            normal: DVec3::Y,
            offset,
        }
    }

    fn cube(builder: &mut SceneBuilder) -> ShapeId {
        builder.cuboid(
            "cube",
            Cuboid {
                min: DVec3::splat(-1.0),
                max: DVec3::splat(1.0),
            },
        )
    }

    #[test]
    fn what_is_beyond_goes_and_what_is_before_stays() {
        let mut builder = SceneBuilder::default();
        let cube = cube(&mut builder);
        for y in [-5.0, 0.0, 5.0] {
            let there = builder.transform(DAffine3::from_translation(DVec3::Y * y).into());
            builder.instance("", Edge::shape(cube).transform(there));
        }
        let (cut, uncut) = builder.finish().unwrap().cut(&[keep_below(0.25)]).unwrap();
        assert_eq!(uncut, Uncut::default());
        assert_eq!(cut.roots.len(), 2);
        assert_eq!(cut.roots.target[0], Target::Shape(cube));
        let Target::Shape(shape) = cut.roots.target[1] else {
            panic!("a shape");
        };
        assert!(matches!(cut.shapes.row(shape), Shape::Csg(_)));
    }

    #[test]
    fn operands_that_add_are_cut_and_others_stay() {
        let mut builder = SceneBuilder::default();
        let red = builder.material("red", Material::default());
        let cube = cube(&mut builder);
        let ball = builder.sphere(
            "ball",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.2,
            },
        );
        let both = [Operand::shape(cube).material(red), Operand::shape(ball)];
        let union = builder.csg("union", Operator::Union, &both);
        let part = [Operand::shape(union), Operand::shape(ball)];
        let part = builder.csg("part", Operator::Difference, &part);
        builder.instance("", Edge::shape(part));
        let (cut, _) = builder.finish().unwrap().cut(&[keep_below(0.25)]).unwrap();
        let Target::Shape(shape) = cut.roots.target[0] else {
            panic!("a shape");
        };
        let operands = |shape: ShapeId| match cut.shapes.row(shape) {
            Shape::Csg(id) => (cut.csg.operator[id.index()], cut.csg.operands(id)),
            _ => panic!("a solid"),
        };
        let (operator, [adds, takes]) = operands(shape) else {
            panic!("two operands");
        };
        assert_eq!((operator, takes.shape), (Operator::Difference, ball));
        let (operator, [first, second]) = operands(adds.shape) else {
            panic!("two operands");
        };
        assert_eq!(operator, Operator::Union);
        assert_eq!((first.material, second.material), (Some(red), None));
        for operand in [first, second] {
            assert_eq!(operands(operand.shape).0, Operator::Intersection);
        }
    }

    #[test]
    fn open_meshes_are_cut_triangle_by_triangle() {
        let mut builder = SceneBuilder::default();
        let wall = MeshData {
            positions: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            uvs: vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
            ..MeshData::default()
        };
        let wall = builder.mesh("wall", &wall);
        builder.instance("", Edge::shape(wall));
        let (cut, _) = builder.finish().unwrap().cut(&[keep_below(1.0)]).unwrap();
        let Target::Shape(shape) = cut.roots.target[0] else {
            panic!("a shape");
        };
        let Shape::Mesh(id) = cut.shapes.row(shape) else {
            panic!("a mesh");
        };
        let mesh = cut.meshes.row(id);
        let area: f64 = mesh
            .triangles
            .iter()
            .map(|corners| {
                let [a, b, c] =
                    corners.map(|v| DVec3::from_array(mesh.positions[v as usize].map(f64::from)));
                (b - a).cross(c - a).z * 0.5
            })
            .sum();
        assert!((area - 3.5).abs() < 1e-6, "{area}");
        let row = cut.meshes.attributes.of(id).unwrap();
        let first = cut.meshes.attributes.rows[row as usize].uvs;
        for (p, uv) in mesh
            .positions
            .iter()
            .zip(&cut.meshes.attributes.uvs[first..])
        {
            assert_eq!([p[0] / 4.0, p[1] / 4.0], *uv);
        }
    }
}
