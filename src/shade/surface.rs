//! The canonical evaluation of a hit: one function in f64 for every kernel, width and
//! structure, so that they all shade the same numbers. It takes hits of one site in
//! lanes ([`Site::surfaces`]), and its bits are the same at any width.
//!
//! Given the ray, t and the primitive it gives the point, the normals and how
//! far a ray that leaves must start from the point. No epsilon: that distance is
//! what the point is measured to lie off the surface, and a multiple of the
//! rounding of the numbers that made it. Where hits are decided exactly, t is
//! refined in f64 first (see [`super::height`]): the point is then as good as f64,
//! also of lanes in f32.

use super::site::Site;
use crate::accel::World;
use crate::geom::primitive::Height;
use crate::geom::{formula, implicit};
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Affine, Vec3, units};
use crate::plan::Precision;
use crate::scene::{MaterialId, Mesh, Shape, Tables};
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

/// Hits in world space: a [`Surface`] in each lane, but for their materials.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<D: Lanes> {
    pub point: Vec3<D>,
    pub ng: Vec3<D>,
    pub ns: Vec3<D>,
    pub front: D::Mask,
    pub offset: D,
}

impl Surface {
    /// Of one hit; where several are of one primitive, see [`Site`].
    pub fn at(
        world: &World,
        precision: Precision,
        org: [f64; 3],
        dir: [f32; 3],
        t: f64,
        id: HitId,
    ) -> Surface {
        let site = Site::of(world, precision, id);
        let [org, dir] = [org, dir.map(f64::from)].map(|v| Vec3::<f64>::from(DVec3::from(v)));
        let one = site.surfaces((org, dir), t, &[id.primitive]);
        Surface {
            point: one.point.into(),
            ng: one.ng.into(),
            ns: one.ns.into(),
            front: one.front.any(),
            offset: one.offset,
            material: site.material(id.primitive),
        }
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

/// Of a polynomial, or another function, where it has hardly a slope, as that of a
/// square has: from a little nearer to the ray's origin, by `back`; against the ray where
/// there is none either.
#[inline(always)]
pub(super) fn normal_before<D: Lanes<Scalar = f64>>(
    (scene, shape): (&Tables, Shape),
    at: Vec3<D>,
    dir: Vec3<D>,
    back: D,
) -> Vec3<D> {
    let ahead = units(dir);
    let before = at - ahead * back;
    let gradient = match shape {
        Shape::Implicit(id) => implicit::values_of(&scene.implicits.row(id), before).1,
        Shape::LevelSet(id) => formula::values_at(&scene.level_sets.formula[id.index()], before).1,
        _ => -ahead,
    };
    let normal = units(gradient);
    let known = normal.length_squared().gt(D::splat(0.5));
    Vec3::select(known, normal, -ahead)
}

/// An interpolated normal may come out on the other side, or as none. Of a triangle
/// wound against its normals, as scans have some, it is right if it faces the viewer:
/// turned away it would make a dark dot.
#[inline(always)]
pub(super) fn shading_normal<D: Lanes<Scalar = f64>>(
    n: Vec3<D>,
    facing: Vec3<D>,
    front: D::Mask,
    dir: Vec3<D>,
) -> Vec3<D> {
    let (cos, zero) = (n.dot(facing), D::zero());
    let (with, against) = (cos.gt(zero), cos.lt(zero));
    let right = with | against & front & n.dot(dir).lt(zero);
    let other = Vec3::select(against, -n, facing);
    Vec3::select(right, n, other)
}

/// Normals go to world space by the inverse transpose.
#[inline(always)]
pub(super) fn to_world<D: Lanes<Scalar = f64>>(
    object_from_world: Option<&Affine>,
    n: Vec3<D>,
) -> Vec3<D> {
    units(match object_from_world {
        None => n,
        Some(map) => map.transposed_vectors(n),
    })
}

/// How far a point of that height lies from the surface in world space, to first order.
#[inline(always)]
pub(super) fn to_world_height<D: Lanes<Scalar = f64>>(
    object_from_world: Option<&Affine>,
    height: &Height<D>,
) -> D {
    match object_from_world {
        None => height.above,
        Some(map) => height.above / map.transposed_vectors(height.normal).length(),
    }
}

/// Object space: the outward normals, and smooth ones where the shape has them, of a
/// primitive in each lane. `known`: the outward ones, unit, of what was
/// [refined](super::height::refined).
#[inline(always)]
pub(super) fn normals<D: Lanes<Scalar = f64>>(
    world: &World,
    shape: Shape,
    (at, primitives): (Vec3<D>, &[u32]),
    known: Option<Vec3<D>>,
) -> (Vec3<D>, Option<Vec3<D>>) {
    let scene = &world.scene;
    match shape {
        Shape::Polygon(id) => {
            let polygon = scene.polygons.row(id);
            let smooth = scene
                .polygons
                .normals(id)
                .map(|normals| fan_normal(polygon.points, normals, polygon.normal, at));
            let plane = || Vec3::splat(polygon.normal.to_array());
            (known.unwrap_or_else(plane), smooth)
        }
        Shape::Mesh(id) => mesh_normals(&scene.meshes.row(id), (at, primitives), known),
        solid => {
            let normals = known.unwrap_or_else(|| scene.normals(solid, at));
            (normals, None)
        }
    }
}

/// The corners of a triangle in each lane.
#[inline(always)]
pub(super) fn facets<D: Lanes<Scalar = f64>>(mesh: &Mesh, triangles: &[u32]) -> [Vec3<D>; 3] {
    let corners = |k: usize| {
        Vec3::of_lanes(|i| {
            let vertex = mesh.triangles[triangles[i] as usize][k];
            mesh.positions[vertex as usize].map(f64::from)
        })
    };
    [corners(0), corners(1), corners(2)]
}

#[inline(always)]
fn mesh_normals<D: Lanes<Scalar = f64>>(
    mesh: &Mesh,
    (at, triangles): (Vec3<D>, &[u32]),
    known: Option<Vec3<D>>,
) -> (Vec3<D>, Option<Vec3<D>>) {
    if let (Some(known), None) = (known, mesh.normals) {
        return (known, None);
    }
    let [a, b, c] = facets(mesh, triangles);
    let ng = known.unwrap_or_else(|| (b - a).cross(c - a));
    let smooth = mesh.normals.map(|normals| {
        let corner = |k: usize| {
            Vec3::of_lanes(|i| {
                let vertex = mesh.triangles[triangles[i] as usize][k];
                normals[vertex as usize].map(f64::from)
            })
        };
        let [u, v, w] = weights([a, b, c], ng, at);
        corner(0) * u + corner(1) * v + corner(2) * w
    });
    (ng, smooth)
}

/// Barycentric coordinates of the point of the plane, not clamped; unnormalised
/// sums are fine for normals.
#[inline(always)]
fn weights<D: Lanes>([a, b, c]: [Vec3<D>; 3], n: Vec3<D>, at: Vec3<D>) -> [D; 3] {
    let area = |p: Vec3<D>, q: Vec3<D>| (p - at).cross(q - at).dot(n);
    [area(b, c), area(c, a), area(a, b)]
}

/// Normals of a polygon: of the triangle of its fan that the point lies in.
#[inline(always)]
fn fan_normal<D: Lanes<Scalar = f64>>(
    points: &[DVec3],
    normals: &[DVec3],
    plane: DVec3,
    at: Vec3<D>,
) -> Vec3<D> {
    let splat = |v: DVec3| Vec3::<D>::splat(v.to_array());
    let mut best = (D::splat(f64::NEG_INFINITY), splat(plane));
    for i in 1..points.len() - 1 {
        let corners = [points[0], points[i], points[i + 1]].map(splat);
        let [u, v, w] = weights(corners, splat(plane), at);
        let sum = splat(normals[0]) * u + splat(normals[i]) * v + splat(normals[i + 1]) * w;
        let least = u.min(v).min(w);
        let inner = least.gt(best.0);
        best.0 = D::select(inner, least, best.0);
        best.1 = Vec3::select(inner, sum, best.1);
    }
    best.1
}
