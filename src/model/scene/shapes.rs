//! Shapes: whatever can be placed, one row each, pointing into its own table.

use super::ids::*;
use super::names::Names;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    HalfSpace(HalfSpaceId),
    Sphere(SphereId),
    Ellipsoid(EllipsoidId),
    Cylinder(CylinderId),
    Cone(ConeId),
    Cuboid(CuboidId),
    Polyhedron(PolyhedronId),
    Polygon(PolygonId),
    Quadric(QuadricId),
    Implicit(ImplicitId),
    LevelSet(LevelSetId),
    Mesh(MeshId),
    /// Made of others.
    Combination(CombinationId),
}

impl Shape {
    /// As messages and reports call it.
    pub fn kind_name(self) -> &'static str {
        match self {
            Shape::HalfSpace(_) => "half-space",
            Shape::Sphere(_) => "sphere",
            Shape::Ellipsoid(_) => "ellipsoid",
            Shape::Cylinder(_) => "cylinder",
            Shape::Cone(_) => "cone",
            Shape::Cuboid(_) => "box",
            Shape::Polyhedron(_) => "polyhedron",
            Shape::Polygon(_) => "polygon",
            Shape::Quadric(_) => "quadric",
            // To people it is one: only what it is written as differs.
            Shape::Implicit(_) | Shape::LevelSet(_) => "implicit",
            Shape::Mesh(_) => "mesh",
            Shape::Combination(_) => "combination",
        }
    }

    /// A number per kind: what runs of equal kinds are sorted by.
    pub fn kind(self) -> u8 {
        match self {
            Shape::HalfSpace(_) => 0,
            Shape::Sphere(_) => 1,
            Shape::Ellipsoid(_) => 2,
            Shape::Cylinder(_) => 3,
            Shape::Cone(_) => 4,
            Shape::Cuboid(_) => 5,
            Shape::Polyhedron(_) => 6,
            Shape::Polygon(_) => 7,
            Shape::Mesh(_) => 8,
            Shape::Combination(_) => 9,
            Shape::Quadric(_) => 10,
            Shape::Implicit(_) => 11,
            Shape::LevelSet(_) => 12,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Shapes {
    pub rows: Vec<Shape>,
    pub names: Names,
}

impl Shapes {
    pub fn push(&mut self, name: &str, shape: Shape) -> ShapeId {
        self.names.set(self.rows.len() as u32, name);
        self.rows.push(shape);
        ShapeId(self.rows.len() as u32 - 1)
    }

    #[inline(always)]
    pub fn row(&self, id: ShapeId) -> Shape {
        self.rows[id.index()]
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.rows.len() * size_of::<Shape>() + self.names.bytes()
    }
}
