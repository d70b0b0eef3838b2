//! Primitives under affine maps. Where the map allows, its result is a primitive of the same
//! kind in the scene's own coordinates, so that CSG solids have few frames (docs/SPEC.md, S40).

use super::solids::Leaf;
use crate::geom::implicit::torus;
use crate::geom::{Cone, Cuboid, Cylinder, HalfSpace, Prism, Sphere};
use crate::math::{Aabb, Affine};
use crate::scene::{MeshData, SceneBuilder, ShapeId};
use glam::{DAffine3, DMat3, DVec3};

/// Lengths and right angles of a matrix whose entries have six digits are known to this part.
const SIX_DIGITS: f64 = 4e-6;

/// A primitive in the scene, and what places it if it is not in the scene's coordinates.
pub(super) struct Placed {
    pub shape: ShapeId,
    pub transform: Option<DAffine3>,
    /// A box in the scene's coordinates; `None` if it has no bounds.
    pub bounds: Option<Aabb>,
}

/// How far a map is from one that keeps a primitive's kind.
struct Kinds {
    /// Every axis becomes an axis.
    is_along_axes: bool,
    /// Circles about z stay circles, and z stays at right angles to them.
    keeps_turns: bool,
    /// Spheres stay spheres.
    keeps_spheres: bool,
}

fn kinds(m: &DMat3) -> Kinds {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    let [x, y, z] = columns.map(DVec3::length);
    let near = |a: f64, b: f64| (a - b).abs() <= SIX_DIGITS * a.max(b);
    let right = |a: DVec3, b: DVec3| a.dot(b).abs() <= SIX_DIGITS * a.length() * b.length();
    let is_right = right(columns[0], columns[1])
        && right(columns[1], columns[2])
        && right(columns[0], columns[2]);
    let keeps_turns = is_right && near(x, y);
    Kinds {
        is_along_axes: is_along_axes(m),
        keeps_turns,
        keeps_spheres: keeps_turns && near(x, z),
    }
}

/// Says whether every axis becomes an axis.
pub(super) fn is_along_axes(m: &DMat3) -> bool {
    let single = |v: DVec3| v.to_array().iter().filter(|x| **x != 0.0).count() == 1;
    [m.x_axis, m.y_axis, m.z_axis].into_iter().all(single)
}

/// Says whether a matrix keeps all lengths.
pub(super) fn is_turn(m: &DMat3) -> bool {
    kinds(m).keeps_spheres && (m.x_axis.length() - 1.0).abs() <= SIX_DIGITS
}

pub(super) fn affine(m: &DAffine3) -> Affine {
    Affine::from(*m)
}

/// Adds a primitive under a map to the scene.
pub(super) fn place(leaf: Leaf, map: &DAffine3, name: &str, scene: &mut SceneBuilder) -> Placed {
    let linear = &map.matrix3;
    let kinds = kinds(linear);
    let shift = map.translation;
    let is_shift = *linear == DMat3::IDENTITY;
    let boxed = |corners: &[DVec3], map: &DAffine3| {
        Some(Aabb::of_points(
            corners.iter().map(|p| map.transform_point3(*p)),
        ))
    };
    let here = |shape, bounds| Placed {
        shape,
        transform: None,
        bounds,
    };
    let there = |shape, transform, corners: &[DVec3]| Placed {
        shape,
        transform: Some(transform),
        bounds: boxed(corners, &transform),
    };
    match leaf {
        Leaf::Cuboid { min, max } => {
            let corners = Aabb::new(min, max).corners();
            if kinds.is_along_axes {
                let bounds = Aabb::of_points([min, max].map(|p| map.transform_point3(p)));
                let (min, max) = (bounds.min, bounds.max);
                return here(scene.cuboid(name, Cuboid { min, max }), Some(bounds));
            }
            // Turned boxes share a frame where only their places, and names of axes, differ.
            let (frame, axes) = with_axes_in_order(linear);
            let inner = DAffine3 {
                matrix3: axes,
                translation: frame.inverse() * shift,
            };
            let inner = Aabb::of_points(corners.map(|p| inner.transform_point3(p)));
            let (min, max) = (inner.min, inner.max);
            let shape = scene.cuboid(name, Cuboid { min, max });
            there(shape, DAffine3::from_mat3(frame), &inner.corners())
        }
        Leaf::Sphere { center, radius } => {
            if kinds.keeps_spheres {
                let center = map.transform_point3(center);
                let radius = radius * scale_of(linear);
                let bounds = Aabb::new(center - radius, center + radius);
                return here(scene.sphere(name, Sphere { center, radius }), Some(bounds));
            }
            let corners = Aabb::new(center - radius, center + radius).corners();
            there(
                scene.sphere(name, Sphere { center, radius }),
                *map,
                &corners,
            )
        }
        Leaf::Frustum {
            base,
            top,
            base_radius,
            top_radius,
        } => {
            let r = base_radius.max(top_radius);
            let wide = DVec3::new(r, r, 0.0);
            let corners = Aabb::of_points([base - wide, base + wide, top - wide, top + wide]);
            let bounds = boxed(&corners.corners(), map);
            let (ends, factor, transform) = match kinds.keeps_turns {
                true => {
                    let ends = [base, top].map(|p| map.transform_point3(p));
                    let across = (linear.x_axis.length() * linear.y_axis.length()).sqrt();
                    (ends, across, None)
                }
                false => ([base, top], 1.0, Some(*map)),
            };
            let radii = [base_radius, top_radius].map(|r| r * factor);
            Placed {
                shape: frustum(ends, radii, name, scene),
                transform,
                bounds,
            }
        }
        Leaf::Prism { mut rings, height } => {
            // Only its height may stay in the map.
            let inner = linear.inverse() * shift;
            for p in rings.iter_mut().flatten() {
                *p += inner.truncate();
            }
            let map = DAffine3 {
                matrix3: *linear,
                translation: linear.z_axis * inner.z,
            };
            let points = rings.iter().flatten();
            let flat = Aabb::of_points(points.map(|p| p.extend(0.0)));
            let bounds = Aabb::of_points([flat.min, flat.max.with_z(height)]);
            let outline = match rings.is_empty() {
                true => Vec::new(),
                false => rings.remove(0),
            };
            let prism = Prism {
                outline,
                holes: rings,
                height,
            };
            there(scene.prism(name, prism), map, &bounds.corners())
        }
        Leaf::Torus { major, minor } => {
            // The scene's tori are about y.
            let turn = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
            let map = *map * DAffine3::from_mat3(turn);
            let size = DVec3::new(major + minor, minor, major + minor);
            let tape = torus::tape_of(major, minor);
            let shape = scene.implicit(name, tape, false, None);
            there(shape, map, &Aabb::new(-size, size).corners())
        }
        Leaf::HalfSpace { normal, offset } => {
            let normal = linear.inverse().transpose() * normal;
            let offset = offset + normal.dot(shift);
            here(scene.half_space(name, HalfSpace { normal, offset }), None)
        }
        Leaf::Polyhedron { planes, points } => {
            let inner = linear.inverse() * shift;
            let planes: Vec<HalfSpace> = planes
                .into_iter()
                .map(|plane| HalfSpace {
                    offset: plane.offset + plane.normal.dot(inner),
                    ..plane
                })
                .collect();
            let points: Vec<DVec3> = points.into_iter().map(|p| p + inner).collect();
            let shape = scene.polyhedron(name, &planes, &points);
            match is_shift {
                true => here(shape, Some(Aabb::of_points(points))),
                false => there(shape, DAffine3::from_mat3(*linear), &points),
            }
        }
        Leaf::Mesh {
            positions,
            mut triangles,
        } => {
            let positions: Vec<DVec3> = positions
                .into_iter()
                .map(|p| map.transform_point3(p))
                .collect();
            if linear.determinant() < 0.0 {
                triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            let data = MeshData {
                positions: positions.iter().map(|p| p.to_array()).collect(),
                triangles,
                ..MeshData::default()
            };
            here(scene.mesh(name, &data), Some(Aabb::of_points(positions)))
        }
    }
}

/// Splits a matrix into one whose columns are in order and one that only renames and turns axes.
fn with_axes_in_order(m: &DMat3) -> (DMat3, DMat3) {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    let largest = |v: &DVec3| v.abs().max_position();
    let mut order = [0, 1, 2];
    order.sort_by_key(|i| largest(&columns[*i]));
    let mut axes = [DVec3::ZERO; 3];
    let mut ordered = [DVec3::ZERO; 3];
    for (place, from) in order.into_iter().enumerate() {
        let column = columns[from];
        let sign = column[largest(&column)].signum();
        ordered[place] = column * sign;
        axes[from][place] = sign;
    }
    let [[a, b, c], [d, e, f]] = [ordered, axes];
    (DMat3::from_cols(a, b, c), DMat3::from_cols(d, e, f))
}

/// Returns by how much a map that keeps spheres scales.
fn scale_of(m: &DMat3) -> f64 {
    let exact = m.x_axis.length();
    match [m.y_axis, m.z_axis].iter().all(|v| v.length() == exact) {
        true => exact,
        false => libm::cbrt(m.determinant().abs()),
    }
}

fn frustum(ends: [DVec3; 2], radii: [f64; 2], name: &str, scene: &mut SceneBuilder) -> ShapeId {
    let ([base, top], [base_radius, top_radius]) = (ends, radii);
    if base_radius == top_radius {
        let cylinder = Cylinder {
            base,
            top,
            radius: base_radius,
            open: false,
        };
        return scene.cylinder(name, cylinder);
    }
    let cone = Cone {
        base,
        top,
        base_radius,
        top_radius,
        open: false,
    };
    scene.cone(name, cone)
}
