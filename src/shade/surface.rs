//! The canonical evaluation of a hit: one scalar f64 function for every kernel,
//! width and structure, so that they all shade the same numbers.
//!
//! Given the ray, t and the primitive it gives the point, the normals and how
//! far a ray that leaves must start from the point. No epsilon: that distance is
//! what the point is measured to lie off the surface, and a multiple of the
//! rounding of the numbers that made it. Where hits are decided exactly, t is
//! refined in f64 first (see [`super::height`]): the point is then as good as f64,
//! also of lanes in f32.

use super::height::refined;
use crate::accel::{Combined, World};
use crate::math::bounds::{LEAVING, LEAVING_CURVED};
use crate::math::lanes::Scalar;
use crate::math::{Affine, length, unit};
use crate::plan::Arithmetic;
use crate::scene::{CsgOperand, MaterialId, Mesh, Shape, outward_normal, shape_bounds};
use crate::trace::{HitId, TURNED};
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

/// Unit roundoffs.
const SINGLE: f64 = <f32 as Scalar>::UNIT_ROUNDOFF as f64;
const DOUBLE: f64 = <f64 as Scalar>::UNIT_ROUNDOFF;

impl Surface {
    pub fn at(
        world: &World,
        arithmetic: Arithmetic,
        org: [f64; 3],
        dir: [f32; 3],
        t: f64,
        id: HitId,
    ) -> Surface {
        let appearance = world.appearances.get(world.scene, id.instance);
        let entry = world.entry_of(id.instance);
        let world_org = DVec3::from_array(org);
        let world_dir = DVec3::from_array(dir.map(f64::from));
        let placed = entry.placed.then_some(&appearance.object_from_world);
        let (object_org, object_dir) = match placed {
            None => (world_org, world_dir),
            Some(map) => {
                let center = match entry.shape {
                    Shape::Mesh(mesh) => world.scene.meshes.center[mesh.index()],
                    _ => DVec3::ZERO,
                };
                let org = DVec3::from_array(map.point(org)) - center;
                let dir = DVec3::from_array(map.vector(world_dir.to_array()));
                (org, dir)
            }
        };
        // Of a combination the surface is an operand's, in that one's space.
        let part = match entry.shape {
            Shape::Combination(row) => {
                let at = object_org + object_dir * t;
                Some(Part::of(world.combined(row), at, id.primitive))
            }
            _ => None,
        };
        let shape = part.map_or(entry.shape, |part| part.operand.shape);
        let primitive = part.map_or(id.primitive, |part| part.triangle);
        let whole = placed;
        let through = part.and_then(|part| part.map);
        let composed = match (whole, through) {
            (Some(whole), Some(part)) => Some(part.then_after(whole)),
            (whole, part) => part.or(whole).copied(),
        };
        let placed = composed.as_ref();
        let (object_org, object_dir) = match through {
            None => (object_org, object_dir),
            Some(map) => (
                DVec3::from_array(map.point(object_org.to_array())),
                DVec3::from_array(map.vector(object_dir.to_array())),
            ),
        };
        let mut t = t;
        let (mut left, mut roundoff, mut blurred) = (0.0, SINGLE, 0.0);
        if arithmetic != Arithmetic::F32 {
            let ray = (object_org, object_dir);
            let (refined, height) = refined(world, (shape, primitive), ray, t);
            t = refined;
            // What the point is off by in object space, in world space.
            let rise = to_world_rise(placed, height.normal);
            left = height.above.abs() / rise;
            left = if left.is_finite() { left } else { 0.0 };
            // A triangle is met from where the ray starts, by lanes of any type: they
            // had better be certain that it lies behind. Solids are met in f64 first.
            let flat = matches!(entry.shape, Shape::Mesh(_) | Shape::Polygon(_));
            if arithmetic == Arithmetic::F64 || !flat {
                roundoff = DOUBLE;
            }
            // So are operands of combinations, at their size, but one by one, and but
            // for meshes and quadrics; and no better than they are placed.
            let other = matches!(shape, Shape::Mesh(_) | Shape::Quadric(_));
            if let (false, Some(part)) = (other, part) {
                let bounds = shape_bounds(world.scene, part.operand.id);
                let roundoff = match arithmetic {
                    Arithmetic::F64 => (DOUBLE * part.wider).min(SINGLE),
                    _ => SINGLE,
                };
                let times = match shape {
                    Shape::Cuboid(_) | Shape::Polyhedron(_) | Shape::HalfSpace(_) => 1.0,
                    _ => LEAVING_CURVED,
                };
                let size = bounds.map_or(0.0, |own| own.extent().max_element());
                blurred = times * roundoff * size;
            }
        }
        let point = world_org + world_dir * t;
        let at = object_org + object_dir * t;
        let (mut ng, mut smooth, own_material) = normals(world, shape, at, primitive);
        if part.is_some_and(|part| part.turned) {
            (ng, smooth) = (-ng, smooth.map(|n| -n));
        }
        let own_material = part.and_then(|part| part.operand.material).or(own_material);

        let ng = to_world(placed, ng);
        let front = world_dir.dot(ng) <= 0.0;
        let facing = if front { ng } else { -ng };
        let ns = match smooth {
            None => facing,
            // An interpolated normal may come out on the other side, or as none.
            // Of a triangle wound against its normals, as scans have some, it is
            // right if it faces the viewer: turned away it would make a dark dot.
            Some(n) => {
                let n = to_world(placed, n);
                match n.dot(facing) {
                    c if c > 0.0 => n,
                    c if c < 0.0 && front && n.dot(world_dir) < 0.0 => n,
                    c if c < 0.0 => -n,
                    _ => facing,
                }
            }
        };

        // The magnitudes whose rounding the hit carries, in world units.
        // Boxes are f32: of a shape beyond its range the box says nothing.
        let own_size = if entry.size.is_finite() {
            entry.size
        } else {
            let bounds = shape_bounds(world.scene, appearance.shape);
            bounds.map_or(0.0, |own| own.max_abs())
        };
        // In object space as the kernel rounds them; world rays are f64.
        let object_size = own_size.max(object_org.abs().max_element());
        let object_size = object_size.max(blur_of(world, shape, at));
        let world_size = world_org.abs().max(point.abs()).max_element();
        let stretch = entry.stretch * part.map_or(1.0, |part| part.stretch);
        let rounded = stretch * (roundoff * object_size + blurred) + DOUBLE * world_size;
        Surface {
            point,
            ng,
            ns,
            front,
            offset: LEAVING * rounded.min(f64::MAX / LEAVING) + left,
            material: appearance.material.or(own_material),
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

/// Which operand of a combination a surface belongs to.
#[derive(Clone, Copy)]
struct Part<'a> {
    operand: &'a CsgOperand,
    /// Of a mesh.
    triangle: u32,
    /// Where the operand's space is not the combination's.
    map: Option<&'a Affine>,
    /// By how much roundings there count more.
    stretch: f64,
    /// By how much lanes of f64 widen their bounds, for the placement of operands.
    wider: f64,
    turned: bool,
}

impl Part<'_> {
    /// `at`: the hit, in the combination's space.
    fn of(combined: &Combined, at: DVec3, primitive: u32) -> Part<'_> {
        let solid = &combined.solid;
        let (number, triangle) = solid.operand_of(primitive & !TURNED);
        let operand = &solid.operands[number as usize];
        let frame = &solid.frames[operand.frame as usize];
        let norms = [&frame.operand_from_solid, &frame.solid_from_operand].map(Affine::norm);
        Part {
            operand,
            triangle,
            map: (operand.frame != 0).then_some(&frame.operand_from_solid),
            stretch: norms[0] * norms[1],
            wider: 1.0 + combined.widening(at.abs().max_element(), DOUBLE),
            turned: primitive & TURNED != 0,
        }
    }
}

/// Of a quadric, what its terms are at a point, over the slope there: as large are
/// the coordinates whose roundings it is met by. Elsewhere these are the point's own.
fn blur_of(world: &World, shape: Shape, at: DVec3) -> f64 {
    let Shape::Quadric(id) = shape else {
        return 0.0;
    };
    let (_, gradient, size) = world.scene.quadrics.row(id).value_at(at);
    let size = size / length(gradient);
    if size.is_finite() { size } else { 0.0 }
}

/// Normals go to world space by the inverse transpose.
fn to_world(object_from_world: Option<&Affine>, n: DVec3) -> DVec3 {
    unit(match object_from_world {
        None => n,
        Some(map) => DVec3::from_array(map.transposed_vector(n.to_array())),
    })
}

/// By how much the height above a surface grows along the world's normal.
fn to_world_rise(object_from_world: Option<&Affine>, normal: DVec3) -> f64 {
    match object_from_world {
        None => 1.0,
        Some(map) => length(DVec3::from_array(map.transposed_vector(normal.to_array()))),
    }
}

/// Object space: the outward normal, a smooth one where the shape has them, and
/// a mesh's own material.
fn normals(
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
