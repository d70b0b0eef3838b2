//! Target points of primitives, with two tangent directions each.

use super::implicits::in_implicit;
use super::level_sets::in_level_set;
use super::{Random, Target};
use glam::{DMat3, DVec3};
use lanecast_model::geom::{Cone, Quadric};
use lanecast_model::scene::{Scene, Shape};
use lanecast_numerics::math::Affine;

/// Returns a random target on the shape, in object space.
pub(super) fn in_object(scene: &Scene, shape: Shape, random: &mut Random) -> Target {
    match shape {
        Shape::Mesh(id) => {
            let mesh = scene.meshes.row(id);
            let triangle = random.below(mesh.triangles.len().max(1));
            if mesh.triangles.is_empty() {
                return random.anywhere();
            }
            let corners = mesh
                .corners(triangle)
                .map(|p| DVec3::from_array(p.map(f64::from)));
            let [a, b, c] = corners.map(|p| p + mesh.center);
            let (s, t) = (random.part(), random.part());
            Target {
                point: a
                    .lerp(b, s)
                    .lerp(c, if random.below(3) == 0 { t } else { 0.0 }),
                along: [b - a, c - a],
            }
        }
        Shape::Polyhedron(id) => {
            let points = scene.polyhedra.points(id);
            let [a, b, c] = std::array::from_fn(|_| *random.one_of(points));
            Target {
                point: a.lerp(b, random.part()),
                along: [b - a, c - a],
            }
        }
        Shape::Cuboid(id) => {
            let row = scene.cuboids.row(id);
            let part = DVec3::new(random.part(), random.part(), random.part());
            Target {
                point: row.min + (row.max - row.min) * part,
                along: [random.axis(), random.axis()],
            }
        }
        Shape::Sphere(id) => {
            let row = scene.spheres.row(id);
            ball(row.center, DVec3::splat(row.radius), random)
        }
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            ball(row.center, row.radii, random)
        }
        Shape::Quadric(id) => quadric(&scene.quadrics.row(id), random),
        Shape::Cone(id) => side(&scene.cones.row(id), random),
        Shape::Cylinder(id) => side(&scene.cylinders.row(id).as_cone(), random),
        Shape::Implicit(id) => in_implicit(&scene.implicits.row(id), random),
        Shape::LevelSet(id) => in_level_set(&scene.level_sets.row(id), random),
        Shape::Csg(_) => in_operand(scene, shape, random),
        Shape::HalfSpace(id) => {
            let row = scene.half_spaces.row(id);
            let (n, size) = (row.normal, row.normal.length());
            let (u, v) = (n / size).any_orthonormal_pair();
            let foot = n / size * (row.offset / size);
            let reach = foot.length() + 1.0;
            Target {
                point: foot + (u * random.signed() + v * random.signed()) * reach,
                along: [u, v],
            }
        }
        _ => match scene.outlines(shape) {
            rings if rings.is_empty() => random.anywhere(),
            rings => {
                let ring: &Vec<DVec3> = random.one_of(&rings);
                outline(ring, random)
            }
        },
    }
}

/// Returns a target on a random operand of a CSG solid, at any depth.
fn in_operand(scene: &Scene, mut shape: Shape, random: &mut Random) -> Target {
    let mut map = Affine::IDENTITY;
    while let Shape::Csg(id) = shape {
        let operand = random.one_of(scene.csg.operands(id));
        map = map.then_after(&scene.transforms.local[operand.transform.index()]);
        shape = scene.shapes.row(operand.shape);
    }
    let Target { point, along } = in_object(scene, shape, random);
    Target {
        point: map.point(point.to_array()).into(),
        along: along.map(|v| map.vector(v.to_array()).into()),
    }
}

fn outline(points: &[DVec3], random: &mut Random) -> Target {
    let i = random.below(points.len());
    let [a, b, c] = [0, 1, 2].map(|k| points[(i + k) % points.len()]);
    Target {
        point: a.lerp(b, random.part()),
        along: [b - a, c - b],
    }
}

fn ball(center: DVec3, radii: DVec3, random: &mut Random) -> Target {
    let out = random.direction();
    let (u, v) = out.any_orthonormal_pair();
    Target {
        point: center + radii * out,
        along: [radii * u, radii * v],
    }
}

/// Returns the centre or apex, or a point where a line near it meets the surface, with
/// tangents there. The first tangent lies in the surface if the surface has such a
/// line.
fn quadric(row: &Quadric, random: &mut Random) -> Target {
    let slope = |p: DVec3| row.normal_at(p);
    let origin = slope(DVec3::ZERO);
    let bend = DMat3::from_cols_array_2d(&DVec3::AXES.map(|axis| {
        let column = slope(axis) - origin;
        column.to_array()
    }));
    let center = bend.inverse() * -origin;
    let center = if center.is_finite() {
        center
    } else {
        DVec3::ZERO
    };
    let (value, gradient, _) = row.value_at(center);
    let most = bend
        .to_cols_array()
        .iter()
        .fold(0.0, |m, x| f64::max(m, x.abs()));
    let reach = (value.abs() / most).sqrt().max(gradient.length() / most);
    let reach = if reach.is_normal() { reach } else { 1.0 };
    let mut point = center;
    for _ in 0..random.below(8) {
        let from = center + random.direction() * (2.0 * reach * random.unit());
        let dir = random.direction();
        // The quadric along the line: c + b t + a t².
        let (c, gradient, _) = row.value_at(from);
        let (a, b) = (dir.dot(bend * dir) * 0.5, gradient.dot(dir));
        let root = (b * b - 4.0 * a * c).sqrt();
        let q = -0.5 * (b + if b < 0.0 { -root } else { root });
        let t = if random.below(2) == 0 { c / q } else { q / a };
        if t.is_finite() {
            point = from + dir * t;
        }
    }
    let out = slope(point);
    let (u, v) = out
        .try_normalize()
        .unwrap_or(DVec3::Y)
        .any_orthonormal_pair();
    // u + x v lies in the surface where the quadratic form vanishes.
    let (uu, uv, vv) = (u.dot(bend * u), u.dot(bend * v), v.dot(bend * v));
    let x = (-uv + (uv * uv - uu * vv).sqrt()) / vv;
    Target {
        point,
        along: [if x.is_finite() { u + v * x } else { u }, v],
    }
}

/// Returns a point of the lateral surface, of the rims at its ends, or the apex; the
/// tangents run along the generator and around the axis.
fn side(cone: &Cone, random: &mut Random) -> Target {
    let axis = cone.top - cone.base;
    let (u, v) = axis.normalize_or_zero().any_orthonormal_pair();
    let [x, y] = match random.below(3) {
        0 => [1.0, 0.0],
        1 => [0.0, -1.0],
        _ => [random.signed(), random.signed()],
    };
    let out = (u * x + v * y).normalize_or_zero();
    let (h, widening) = (random.part(), cone.top_radius - cone.base_radius);
    Target {
        point: cone.base + axis * h + out * (cone.base_radius + widening * h),
        along: [axis + out * widening, axis.cross(out)],
    }
}
