//! The canonical evaluation of a hit: one scalar f64 function for every kernel,
//! width and structure, so that they all shade the same numbers.
//!
//! Given the ray, t and the primitive it gives the point, the normals and how
//! far a ray that leaves must start from the point. No epsilon: that distance is
//! what the point is measured to lie off the surface, and a multiple of the
//! rounding of the numbers that made it. Where hits are decided exactly, t is
//! refined in f64 first (see [`super::height`]): the point is then as good as f64,
//! also of lanes in f32.

use super::site::Site;
use crate::accel::World;
use crate::math::{Affine, length, unit};
use crate::plan::Arithmetic;
use crate::scene::{MaterialId, Mesh, Shape, outward_normal};
use crate::trace::HitId;
use glam::DVec3;

/// A hit in world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub point: DVec3,
    /// Geometric normal, unit, on the outer side of the shape.
    pub ng: DVec3,
    /// Shading normal, unit, on the side that the ray came from.
    pub ns: DVec3,
    /// The ray came from the outer side.
    pub front: bool,
    /// How far along ±ng a leaving ray starts.
    pub offset: f64,
    pub material: Option<MaterialId>,
}

impl Surface {
    /// Of one hit; where several are of one primitive, see [`Site`].
    pub fn at(
        world: &World,
        arithmetic: Arithmetic,
        org: [f64; 3],
        dir: [f32; 3],
        t: f64,
        id: HitId,
    ) -> Surface {
        Site::of(world, arithmetic, id).surface((org, dir), t, id.primitive)
    }

    /// Where a ray leaving towards `dir` starts.
    #[inline]
    pub fn leave(&self, dir: DVec3) -> DVec3 {
        let side = if dir.dot(self.ng) >= 0.0 { 1.0 } else { -1.0 };
        self.point + self.ng * (side * self.offset)
    }

    /// The geometric normal on the side that the ray came from.
    #[inline]
    pub fn facing(&self) -> DVec3 {
        if self.front { self.ng } else { -self.ng }
    }
}

/// Of a quadric, what its terms are at a point, over the slope there: as large are
/// the coordinates whose roundings it is met by. Elsewhere these are the point's own.
pub(super) fn blur_of(world: &World, shape: Shape, at: DVec3) -> f64 {
    let Shape::Quadric(id) = shape else {
        return 0.0;
    };
    let (_, gradient, size) = world.scene.quadrics.row(id).value_at(at);
    let size = size / length(gradient);
    if size.is_finite() { size } else { 0.0 }
}

/// An interpolated normal may come out on the other side, or as none. Of a triangle
/// wound against its normals, as scans have some, it is right if it faces the viewer:
/// turned away it would make a dark dot.
pub(super) fn shading_normal(n: DVec3, facing: DVec3, front: bool, dir: DVec3) -> DVec3 {
    match n.dot(facing) {
        c if c > 0.0 => n,
        c if c < 0.0 && front && n.dot(dir) < 0.0 => n,
        c if c < 0.0 => -n,
        _ => facing,
    }
}

/// Normals go to world space by the inverse transpose.
pub(super) fn to_world(object_from_world: Option<&Affine>, n: DVec3) -> DVec3 {
    unit(match object_from_world {
        None => n,
        Some(map) => DVec3::from_array(map.transposed_vector(n.to_array())),
    })
}

/// By how much the height above a surface grows along the world's normal.
pub(super) fn to_world_rise(object_from_world: Option<&Affine>, normal: DVec3) -> f64 {
    match object_from_world {
        None => 1.0,
        Some(map) => length(DVec3::from_array(map.transposed_vector(normal.to_array()))),
    }
}

/// Object space: the outward normal, a smooth one where the shape has them, and
/// a mesh's own material.
pub(super) fn normals(
    world: &World,
    shape: Shape,
    at: DVec3,
    primitive: u32,
) -> (DVec3, Option<DVec3>, Option<MaterialId>) {
    let scene = world.scene;
    match shape {
        Shape::Polygon(id) => {
            let polygon = scene.polygons.row(id);
            let smooth = scene
                .polygons
                .normals(id)
                .map(|normals| fan_normal(polygon.points, normals, polygon.normal, at));
            (polygon.normal, smooth, None)
        }
        Shape::Mesh(id) => mesh_normals(&scene.meshes.row(id), at, primitive),
        solid => (outward_normal(scene, solid, at), None, None),
    }
}

fn mesh_normals(
    mesh: &Mesh,
    at: DVec3,
    triangle: u32,
) -> (DVec3, Option<DVec3>, Option<MaterialId>) {
    let [a, b, c] = mesh
        .corners(triangle as usize)
        .map(|p| DVec3::from_array(p.map(f64::from)));
    let ng = (b - a).cross(c - a);
    let smooth = mesh.normals.map(|normals| {
        let corner = |i: usize| {
            let vertex = mesh.triangles[triangle as usize][i] as usize;
            DVec3::from_array(normals[vertex].map(f64::from))
        };
        let [u, v, w] = weights([a, b, c], ng, at);
        corner(0) * u + corner(1) * v + corner(2) * w
    });
    (ng, smooth, mesh.material(triangle))
}

/// Barycentric coordinates of the point of the plane, not clamped; unnormalised
/// sums are fine for normals.
fn weights([a, b, c]: [DVec3; 3], n: DVec3, at: DVec3) -> [f64; 3] {
    let area = |p: DVec3, q: DVec3| (p - at).cross(q - at).dot(n);
    [area(b, c), area(c, a), area(a, b)]
}

/// Normals of a polygon: of the triangle of its fan that the point lies in.
fn fan_normal(points: &[DVec3], normals: &[DVec3], plane: DVec3, at: DVec3) -> DVec3 {
    let least = |w: &[f64; 3]| w[0].min(w[1]).min(w[2]);
    let mut best = (f64::NEG_INFINITY, plane);
    for i in 1..points.len() - 1 {
        let w = weights([points[0], points[i], points[i + 1]], plane, at);
        let sum = normals[0] * w[0] + normals[i] * w[1] + normals[i + 1] * w[2];
        if least(&w) > best.0 {
            best = (least(&w), sum);
        }
    }
    best.1
}
