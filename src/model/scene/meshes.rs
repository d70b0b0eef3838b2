//! Triangle meshes: index and vertex columns, with one range of each per mesh.
//!
//! Vertices are f32 about an f64 centre (docs/SPEC.md, S8). They are rounded once, when the
//! mesh is added, and the rounded ones are counted. The centre is 0 on each axis unless the
//! mesh lies far out along it; then it is a coarse multiple of a power of two, so that
//! coordinates that were f32 to begin with stay exact (docs/numerics/transforms.md, A8).

use super::ids::{MaterialId, MeshId};
use super::vertex_attributes::VertexAttributes;
use crate::math::Aabb;
use glam::DVec3;
use std::ops::Range;

/// The vertices and triangles that a mesh is made from, as an importer or a user gives
/// them.
#[derive(Clone, Debug, Default)]
pub struct MeshData {
    /// Vertices in object space.
    pub positions: Vec<[f64; 3]>,
    /// Normals, one per vertex and of any length > 0, or none at all.
    pub normals: Vec<[f32; 3]>,
    /// Triangles as rows of `positions`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Runs of triangles with a material of their own: the first triangle of each, rising.
    /// Triangles before the first run have no material.
    pub parts: Vec<(u32, Option<MaterialId>)>,
    /// Whether the mesh is a surface without an inside, whatever its topology.
    pub open: bool,
    /// Sets of texture coordinates, each one per vertex.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear colours and alpha in units of 1/65535, one per vertex, or none at all.
    pub colors: Vec<[u16; 4]>,
    /// Tangents of the corners of triangles, three per triangle, and the sign of the bitangent,
    /// in units of 1/32767, or none at all.
    pub tangents: Vec<[i16; 4]>,
}

#[derive(Clone, Debug, Default)]
pub struct Meshes {
    /// Vertices of all meshes, each about its mesh's centre.
    pub positions: Vec<[f32; 3]>,
    /// Vertex normals of the meshes that have them.
    pub normals: Vec<[f32; 3]>,
    /// Triangles of all meshes; indices count from the mesh's first vertex.
    pub triangles: Vec<[u32; 3]>,
    /// The first triangle (counted within the mesh) and the material of each part.
    pub parts: Vec<(u32, Option<MaterialId>)>,

    /// Per mesh: rows of `positions`.
    pub vertices_of: Vec<Range<u32>>,
    /// Per mesh: first row of `normals`.
    pub normals_of: Vec<Option<u32>>,
    /// Per mesh: rows of `triangles`.
    pub triangles_of: Vec<Range<u32>>,
    /// Per mesh: rows of `parts`.
    pub parts_of: Vec<Range<u32>>,
    /// Per mesh: the centre that was subtracted from its vertices.
    pub center: Vec<DVec3>,
    /// Per mesh: the number of vertices that f32 rounded.
    pub rounded: Vec<u32>,
    pub open: Vec<bool>,
    pub attributes: VertexAttributes,
}

/// The columns of one mesh.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Vertices about `center`.
    pub positions: &'a [[f32; 3]],
    pub normals: Option<&'a [[f32; 3]]>,
    pub triangles: &'a [[u32; 3]],
    pub parts: &'a [(u32, Option<MaterialId>)],
    pub center: DVec3,
    pub open: bool,
}

impl Meshes {
    pub fn push(&mut self, data: &MeshData) -> MeshId {
        let bounds = Aabb::of_points(data.positions.iter().map(|p| DVec3::from_array(*p)));
        let center = far_center(&bounds, 8.0);
        let first_vertex = self.positions.len() as u32;
        let mut rounded = 0;
        self.positions.extend(data.positions.iter().map(|p| {
            let about = DVec3::from_array(*p) - center;
            let vertex = about.to_array().map(|x| x as f32);
            let kept = DVec3::from_array(vertex.map(f64::from)) + center;
            rounded += u32::from(kept.to_array() != *p);
            vertex
        }));
        let normals_of = (!data.normals.is_empty()).then_some(self.normals.len() as u32);
        self.normals.extend_from_slice(&data.normals);
        let first_triangle = self.triangles.len() as u32;
        self.triangles.extend_from_slice(&data.triangles);
        let first_part = self.parts.len() as u32;
        self.parts.extend_from_slice(&data.parts);

        self.vertices_of
            .push(first_vertex..self.positions.len() as u32);
        self.normals_of.push(normals_of);
        self.triangles_of
            .push(first_triangle..self.triangles.len() as u32);
        self.parts_of.push(first_part..self.parts.len() as u32);
        self.center.push(center);
        self.rounded.push(rounded);
        self.open.push(data.open);
        let id = MeshId(self.center.len() as u32 - 1);
        self.attributes.push(id, data);
        id
    }

    #[inline]
    pub fn row(&self, id: MeshId) -> Mesh<'_> {
        let i = id.index();
        let range = |r: &Range<u32>| r.start as usize..r.end as usize;
        let vertices = range(&self.vertices_of[i]);
        Mesh {
            positions: &self.positions[vertices.clone()],
            normals: self.normals_of[i]
                .map(|first| &self.normals[first as usize..first as usize + vertices.len()]),
            triangles: &self.triangles[range(&self.triangles_of[i])],
            parts: &self.parts[range(&self.parts_of[i])],
            center: self.center[i],
            open: self.open[i],
        }
    }

    /// Says whether all triangles of a mesh have the same material, or none.
    pub fn has_one_material(&self, id: MeshId) -> bool {
        // Triangles before the first run have none.
        match self.row(id).parts {
            [] => true,
            [(first, _)] => *first == 0,
            _ => false,
        }
    }

    /// Returns a mesh's vertices and its normals, none if it has none, to write to.
    pub(super) fn vertices_mut(&mut self, id: MeshId) -> (&mut [[f32; 3]], &mut [[f32; 3]]) {
        let Range { start, end } = self.vertices_of[id.index()];
        let normals = match self.normals_of[id.index()] {
            Some(first) => first as usize..(first + end - start) as usize,
            None => 0..0,
        };
        (
            &mut self.positions[start as usize..end as usize],
            &mut self.normals[normals],
        )
    }

    pub fn len(&self) -> usize {
        self.center.len()
    }

    pub fn is_empty(&self) -> bool {
        self.center.is_empty()
    }

    pub fn bytes(&self) -> usize {
        (self.positions.len() + self.normals.len() + self.triangles.len()) * 12
            + self.parts.len() * size_of::<(u32, Option<MaterialId>)>()
            + self.len() * (4 * size_of::<Range<u32>>() + size_of::<DVec3>() + 8)
            + self.attributes.bytes()
    }
}

impl Mesh<'_> {
    /// Returns the three corners of a triangle, about the mesh's centre.
    #[inline(always)]
    pub fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        // Spelled out, because `map` passes the corners through memory.
        let [a, b, c] = self.triangles[triangle];
        let at = |v: u32| self.positions[v as usize];
        [at(a), at(b), at(c)]
    }

    /// Returns the material that the mesh itself gives to a triangle.
    pub fn material(&self, triangle: u32) -> Option<MaterialId> {
        let after = self.parts.partition_point(|(first, _)| *first <= triangle);
        after.checked_sub(1).and_then(|i| self.parts[i].1)
    }

    /// Returns the box in object space, with the centre added.
    pub fn bounds(&self) -> Aabb {
        let about = Aabb::of_points(
            self.positions
                .iter()
                .map(|p| DVec3::from_array(p.map(f64::from))),
        );
        Aabb::new(about.min + self.center, about.max + self.center)
    }
}

/// Returns the centre to subtract from the contents of a box: zero on each axis where the
/// box lies no farther from the origin than `times` its size, otherwise near its middle
/// (A8).
pub fn far_center(bounds: &Aabb, times: f64) -> DVec3 {
    let size = bounds.extent().max_element();
    if !(size.is_finite() && size > 0.0) {
        return DVec3::ZERO;
    }
    // A multiple of the power of two at or below the size is coarser than any step between
    // f32 coordinates that far out, so for these the subtraction is exact. Axes nearer to
    // the origin have finer steps and keep the centre 0.
    let step = f64::from_bits(size.to_bits() & 0x7ff0_0000_0000_0000);
    let along = |middle: f64| {
        if middle.abs() <= times * size {
            return 0.0;
        }
        let steps = (middle / step).round();
        // Beyond 1/(2v) sizes, of a sheet across this axis, f64 itself has no finer step
        // (A8).
        if steps.abs() < 1.0 / f64::EPSILON {
            steps * step
        } else {
            middle
        }
    };
    let middle = bounds.center();
    DVec3::new(along(middle.x), along(middle.y), along(middle.z))
}
