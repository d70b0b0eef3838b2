//! The canonical evaluation of a hit: one function in f64 for every kernel, width and
//! structure, so that all of them shade the same numbers. It evaluates hits of one interaction
//! in lanes ([`InteractionPart::surfaces`]), with the same bits at any width.
//!
//! From the ray, t and the primitive it computes the point, the normals and the
//! distance from the point at which a leaving ray must start. That distance is no fixed
//! epsilon: it is the measured distance of the point from the surface, plus a multiple
//! of the rounding of the numbers that made it. In `guarded` and `exact`, t is first
//! refined in f64 (see [`super::projection`]), so the point has f64 accuracy even after f32
//! lanes.

use super::interaction::InteractionPart;
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
    /// True if the ray came from the outer side.
    pub front: bool,
    /// Distance along ±ng at which a leaving ray starts.
    pub offset: f64,
    pub material: Option<MaterialId>,
}

/// Hits in world space: a [`Surface`] in each lane, without its material.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<D: Lanes> {
    pub point: Vec3<D>,
    pub ng: Vec3<D>,
    pub ns: Vec3<D>,
    pub front: D::Mask,
    pub offset: D,
    /// As [`offset`](Self::offset), so that f32 lanes are certain to have left the surface:
    /// shadow rays are many, and a shift across a gap of roundings of f32 does not show.
    pub shadow_offset: D,
}

impl Surface {
    /// Evaluates one hit; for several hits of one primitive use [`InteractionPart`].
    pub fn at(
        world: &World,
        precision: Precision,
        org: [f64; 3],
        dir: [f64; 3],
        t: f64,
        id: HitId,
    ) -> Surface {
        let interaction = InteractionPart::of(world, precision, id);
        interaction.surface((org.into(), dir.into()), t, id.primitive)
    }

    /// Returns the origin of a ray that leaves towards `dir`.
    #[inline]
    pub fn leave(&self, dir: DVec3) -> DVec3 {
        let side = if dir.dot(self.ng) >= 0.0 { 1.0 } else { -1.0 };
        self.point + self.ng * (side * self.offset)
    }

    /// Returns the geometric normal on the side that the ray came from.
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

/// Corrects an interpolated normal that is on the other side, or zero. On a triangle
/// wound against its vertex normals, as some scans have, the normal is right if it
/// faces the viewer; turning it would make a dark dot.
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

/// Transforms normals to world space by the inverse transpose.
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

/// Returns the world-space distance from the surface, to first order, of a point at
/// this height in object space.
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

/// Returns the outward normals in object space, and smooth normals if the shape has
/// them, of one primitive per lane. `known` holds unit outward normals from
/// [`refined`](super::projection::refined).
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

/// Returns the corners of one triangle per lane.
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

/// The least cosine between a facet and the normals at its corners for which these describe a
/// surface near it. Scanned meshes have folds whose normals do not: lifted points would lie below
/// neighbouring facets.
const AGREEING: f64 = 0.7;

/// Returns the vectors that lift points of smooth triangles onto the surface which their
/// vertices' normals suggest, in object space: the mean of the vertices' tangent planes, where
/// these lie above the point (Hanika, "Hacking the Shadow Terminator", 2021). `side` is -1 where
/// the surface is seen from inside. Zero without vertex normals.
#[inline(always)]
pub(super) fn lift_onto_smooth<D: Lanes<Scalar = f64>>(
    mesh: &Mesh,
    (at, triangles): (Vec3<D>, &[u32]),
    side: D,
) -> Vec3<D> {
    let Some(normals) = mesh.normals else {
        return Vec3::splat([0.0; 3]);
    };
    let corners = facets::<D>(mesh, triangles);
    let [a, b, c] = corners;
    let across = (b - a).cross(c - a);
    let weights = weights(corners, across, at);
    let sum = weights[0] + weights[1] + weights[2];
    let mut lift = Vec3::splat([0.0; 3]);
    let facing = units(across) * side;
    let mut agree = D::Mask::splat(true);
    for k in 0..3 {
        let normal = units(Vec3::<D>::of_lanes(|i| {
            let vertex = mesh.triangles[triangles[i] as usize][k];
            normals[vertex as usize].map(f64::from)
        }));
        let normal = normal * side;
        agree = agree & normal.dot(facing).gt(D::splat(AGREEING));
        let below = (at - corners[k]).dot(normal).min(D::zero());
        let share = (weights[k] / sum).max(D::zero()).min(D::splat(1.0));
        lift = lift - normal * (share * below);
    }
    let known = agree & sum.abs().gt(D::zero()) & lift.max_abs().lt(D::splat(f64::MAX));
    Vec3::select(known, lift, Vec3::splat([0.0; 3]))
}

/// Unnormalised barycentric coordinates of a point in the plane, not clamped; the sums
/// serve for normals, which are normalised later.
#[inline(always)]
pub(super) fn weights<D: Lanes>([a, b, c]: [Vec3<D>; 3], n: Vec3<D>, at: Vec3<D>) -> [D; 3] {
    let area = |p: Vec3<D>, q: Vec3<D>| (p - at).cross(q - at).dot(n);
    [area(b, c), area(c, a), area(a, b)]
}

/// Interpolates a polygon's normals in the fan triangle that contains the point.
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
