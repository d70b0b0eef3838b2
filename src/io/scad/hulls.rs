//! `hull`: of corners as a convex polyhedron, of equal balls and discs exactly round.
//!
//! The hull of equal balls is that of their centres, grown by the radius. With a face moved
//! outward by the radius, a cylinder about each edge and a ball about each corner it is a union of
//! the hull of all moved faces, the cylinders and the balls.

use super::curves;
use super::outlines::{OutlineId, Outlines, PlacedShape, Shape, corners};
use super::solids::{Leaf, Part, SolidId, Solids};
use crate::geom::hull::{self, HullError};
use crate::scene::Operator;
use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::collections::HashSet;

/// Lengths are equal to this part, of matrices whose entries have six digits.
const SIX_DIGITS: f64 = 4e-6;

/// The sides of a cylinder or cone in a hull that is not round.
pub(super) const SIDES: u32 = 128;

/// A hull, and the sides of a circle if curves in it have become facets.
pub(super) struct Hulled<T> {
    pub hull: Option<T>,
    pub sides: Option<u32>,
}

/// A primitive and its map.
type Placed = (Leaf, DAffine3);

/// Makes the hull of a solid. Fails where it is none of what is known.
pub(super) fn of_solid(
    solid: SolidId,
    line: u32,
    solids: &mut Solids,
) -> Result<Hulled<SolidId>, String> {
    let leaves = leaves(solids, solid)?;
    let round = |hull| Hulled {
        hull: Some(hull),
        sides: None,
    };
    if let [(Leaf::Sphere { .. } | Leaf::Frustum { .. } | Leaf::Cuboid { .. }, _)] = leaves[..] {
        return Ok(round(solid));
    }
    if let Some((centers, radius)) = equal_balls(&leaves) {
        return of_balls(centers, radius, line, solids).map(round);
    }
    if let Some((centers, (radius, height), map)) = equal_cylinders(&leaves) {
        let mut outlines = Outlines::default();
        let discs = centers.iter().map(|p| (*p, radius)).collect();
        let outline = of_discs(discs, line, &mut outlines);
        let hull = outlines.sweep(outline, (0.0, height), solids);
        return Ok(round(solids.placed(line, hull, map)));
    }
    let (points, has_facets) = corners_of(&leaves)?;
    let sides = has_facets.then_some(SIDES);
    let leaf = match hull::of_points(&points) {
        Ok(hull) => Leaf::Polyhedron {
            planes: hull.planes,
            points: hull.points,
        },
        Err(HullError::Flat | HullError::TooFew(_)) => {
            let hull = None;
            return Ok(Hulled { hull, sides });
        }
        Err(why) => return Err(format!("hull() cannot be drawn here: {why}")),
    };
    Ok(Hulled {
        hull: Some(solids.leaf(line, leaf)),
        sides,
    })
}

/// Lists the primitives of unions; other operators have corners that are not known.
fn leaves(solids: &Solids, solid: SolidId) -> Result<Vec<Placed>, String> {
    let mut waiting = vec![(solid, DAffine3::IDENTITY)];
    let mut leaves = Vec::new();
    while let Some((id, map)) = waiting.pop() {
        match &solids.parts[id as usize] {
            Part::Leaf(leaf) => leaves.push((leaf.clone(), map)),
            Part::Op(Operator::Union, operands) => {
                waiting.extend(operands.iter().rev().map(|of| (*of, map)));
            }
            Part::Op(..) => {
                let what = "hull() of a difference, intersection or rotate_extrude() is not drawn";
                return Err(what.into());
            }
            Part::Placed(of, by) => waiting.push((*of, map * *by)),
            Part::Colored(of, _) | Part::Plain(of) | Part::Marked(of) => waiting.push((*of, map)),
        }
    }
    Ok(leaves)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= SIX_DIGITS * a.abs().max(b.abs())
}

/// Returns by how much a map that keeps spheres scales; `None` if it keeps none.
fn scale_of(m: &DMat3) -> Option<f64> {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    let size = x.length();
    let is_right = [(x, y), (y, z), (x, z)]
        .iter()
        .all(|(a, b)| a.dot(*b).abs() <= SIX_DIGITS * size * size);
    let is = is_right && near(size, y.length()) && near(size, z.length());
    is.then_some(size)
}

fn equal_balls(leaves: &[Placed]) -> Option<(Vec<DVec3>, f64)> {
    let mut centers = Vec::new();
    let mut radii = Vec::new();
    for (leaf, map) in leaves {
        let Leaf::Sphere { center, radius } = leaf else {
            return None;
        };
        centers.push(map.transform_point3(*center));
        radii.push(radius * scale_of(&map.matrix3)?);
    }
    let first = *radii.first()?;
    let is = radii.iter().all(|r| near(*r, first));
    is.then_some((centers, first))
}

/// Finds upright cylinders of one radius and height, of which maps differ by shifts in the plane:
/// their centres in the first one's plane, radius and height, and the map of that plane.
fn equal_cylinders(leaves: &[Placed]) -> Option<(Vec<DVec2>, (f64, f64), DAffine3)> {
    let (mut centers, mut first) = (Vec::new(), None);
    for (leaf, map) in leaves {
        let Leaf::Frustum {
            base,
            top,
            base_radius,
            top_radius,
        } = leaf
        else {
            return None;
        };
        let (height, size) = (top.z - base.z, *base_radius);
        let here = *map * DAffine3::from_translation(*base);
        let (frame, first_size, first_height) = *first.get_or_insert((here, size, height));
        let most = |m: DMat3| {
            m.to_cols_array()
                .iter()
                .fold(0.0, |a: f64, x| a.max(x.abs()))
        };
        let is_turned = most(frame.matrix3 - here.matrix3) > most(frame.matrix3) * 1e-6;
        let off = frame.inverse().transform_point3(here.translation);
        let is_off = off.z.abs() > height * 1e-5;
        let is_other = !near(size, first_size) || !near(height, first_height);
        if is_turned || is_off || is_other || !near(size, *top_radius) {
            return None;
        }
        centers.push(off.truncate());
    }
    let (frame, size, height) = first?;
    Some((centers, (size, height), frame))
}

/// Lists corners; cylinders and cones get sides.
fn corners_of(leaves: &[Placed]) -> Result<(Vec<DVec3>, bool), String> {
    let (mut points, mut has_facets) = (Vec::new(), false);
    for (leaf, map) in leaves {
        let mut add = |p: DVec3| points.push(map.transform_point3(p));
        match leaf {
            Leaf::Cuboid { min, max } => {
                let corners = crate::math::Aabb::new(*min, *max).corners();
                corners.into_iter().for_each(add);
            }
            Leaf::Polyhedron { points, .. } => points.iter().for_each(|p| add(*p)),
            // Faces name all of them: `facets` leaves the others out.
            Leaf::Mesh { positions, .. } => positions.iter().for_each(|p| add(*p)),
            Leaf::Prism { rings, height } => {
                for p in rings.iter().flatten() {
                    add(p.extend(0.0));
                    add(p.extend(*height));
                }
            }
            Leaf::Frustum {
                base,
                top,
                base_radius,
                top_radius,
            } => {
                has_facets = true;
                for (center, radius) in [(base, base_radius), (top, top_radius)] {
                    for p in curves::circle(*radius, SIDES) {
                        add(*center + p.extend(0.0));
                    }
                }
            }
            Leaf::Sphere { .. } => {
                return Err(
                    "hull() of balls of several sizes, or of balls and others, is not \
                            drawn"
                        .into(),
                );
            }
            Leaf::Torus { .. } | Leaf::HalfSpace { .. } => {
                return Err("hull() of rotate_extrude() is not drawn".into());
            }
        }
    }
    Ok((points, has_facets))
}

/// Makes the hull of balls of one radius.
fn of_balls(
    mut centers: Vec<DVec3>,
    radius: f64,
    line: u32,
    solids: &mut Solids,
) -> Result<SolidId, String> {
    centers.dedup();
    let skeleton = Skeleton::of(&centers)?;
    let ball = |center: &DVec3| Leaf::Sphere {
        center: *center,
        radius,
    };
    let mut parts: Vec<SolidId> = skeleton
        .corners
        .iter()
        .map(|center| solids.leaf(line, ball(center)))
        .collect();
    for [a, b] in &skeleton.edges {
        // A frustum is about z: its own space is turned so.
        let along = *b - *a;
        let axis = along.normalize();
        let side = axis.any_orthonormal_vector();
        let turn = DMat3::from_cols(side, axis.cross(side), axis);
        let map = DAffine3 {
            matrix3: turn,
            translation: *a,
        };
        let rod = solids.leaf(
            line,
            Leaf::Frustum {
                base: DVec3::ZERO,
                top: DVec3::new(0.0, 0.0, along.length()),
                base_radius: radius,
                top_radius: radius,
            },
        );
        parts.push(solids.placed(line, rod, map));
    }
    let moved: Vec<DVec3> = skeleton
        .faces
        .iter()
        .flat_map(|(normal, corners)| corners.iter().map(|p| *p + *normal * radius))
        .collect();
    if !moved.is_empty() {
        let hull = hull::of_points(&moved).map_err(|e| format!("hull() cannot be drawn: {e}"))?;
        let (planes, points) = (hull.planes, hull.points);
        parts.push(solids.leaf(line, Leaf::Polyhedron { planes, points }));
    }
    Ok(solids.op(line, Operator::Union, parts))
}

/// The corners, edges and faces of a hull, which may be flat, a line or a point.
struct Skeleton {
    corners: Vec<DVec3>,
    edges: Vec<[DVec3; 2]>,
    /// Outward normals, and corners.
    faces: Vec<(DVec3, Vec<DVec3>)>,
}

impl Skeleton {
    fn of(points: &[DVec3]) -> Result<Skeleton, String> {
        match hull::of_points(points) {
            Ok(hull) => {
                let size = points
                    .iter()
                    .fold(0.0, |most: f64, p| most.max(p.distance(points[0])));
                let faces = hull.planes.iter().map(|plane| {
                    let is_on =
                        |p: &&DVec3| (plane.normal.dot(**p) - plane.offset).abs() <= size * 1e-9;
                    let corners = hull.points.iter().filter(is_on).copied().collect();
                    (plane.normal, in_turn(corners, plane.normal))
                });
                Ok(Skeleton::of_faces(faces.collect()))
            }
            Err(HullError::Flat | HullError::TooFew(_)) => Ok(Skeleton::flat(points)),
            Err(why) => Err(format!("hull() cannot be drawn here: {why}")),
        }
    }

    fn of_faces(faces: Vec<(DVec3, Vec<DVec3>)>) -> Skeleton {
        let key = |p: &DVec3| p.to_array().map(f64::to_bits);
        let (mut known, mut corners, mut edges) = (HashSet::new(), Vec::new(), Vec::new());
        let mut joined = HashSet::new();
        for (_, ring) in &faces {
            let next = ring.iter().skip(1).chain(ring.first());
            for (a, b) in ring.iter().zip(next) {
                if known.insert(key(a)) {
                    corners.push(*a);
                }
                if !joined.contains(&(key(b), key(a))) && joined.insert((key(a), key(b))) {
                    edges.push([*a, *b]);
                }
            }
        }
        Skeleton {
            corners,
            edges,
            faces,
        }
    }

    /// Points in one plane, on a line, or at one place.
    fn flat(points: &[DVec3]) -> Skeleton {
        let none = |corners: Vec<DVec3>, edges| Skeleton {
            corners,
            edges,
            faces: Vec::new(),
        };
        let origin = points[0];
        let far = |from: DVec3| {
            let farther = |a: DVec3, b: &DVec3| match from.distance(*b) > from.distance(a) {
                true => *b,
                false => a,
            };
            points.iter().fold(from, farther)
        };
        let a = far(origin);
        let b = far(a);
        let axis = (b - a).normalize_or_zero();
        if axis == DVec3::ZERO {
            return none(vec![a], Vec::new());
        }
        let off = |p: &DVec3| (*p - a).reject_from_normalized(axis);
        let widest =
            points.iter().map(off).fold(
                DVec3::ZERO,
                |w, p| if p.length() > w.length() { p } else { w },
            );
        if widest.length() <= 1e-9 * a.distance(b) {
            return none(vec![a, b], vec![[a, b]]);
        }
        let side = widest.normalize();
        let flat: Vec<DVec2> = points
            .iter()
            .map(|p| DVec2::new((*p - a).dot(axis), (*p - a).dot(side)))
            .collect();
        let ring: Vec<DVec3> = convex(flat)
            .into_iter()
            .map(|p| a + axis * p.x + side * p.y)
            .collect();
        let normal = axis.cross(side);
        let mirrored = ring.iter().rev().copied().collect();
        Skeleton::of_faces(vec![(normal, ring), (-normal, mirrored)])
    }
}

/// Orders the corners of a convex face, counter-clockwise about its normal.
fn in_turn(mut corners: Vec<DVec3>, normal: DVec3) -> Vec<DVec3> {
    let center = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let angle = |p: &DVec3| libm::atan2((*p - center).dot(v), (*p - center).dot(u));
    corners.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
    corners
}

/// Returns the convex hull of points, counter-clockwise (Andrew 1979).
pub(super) fn convex(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(*p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        chain.pop();
        chain
    };
    let mut ring = half(&mut points.iter());
    ring.extend(half(&mut points.iter().rev()));
    ring
}

/// Makes the hull of discs of equal radius, or of points, as discs of radius 0.
fn of_discs(discs: Vec<(DVec2, f64)>, line: u32, outlines: &mut Outlines) -> OutlineId {
    let radius = discs.first().map_or(0.0, |(_, r)| *r);
    let ring = convex(discs.into_iter().map(|(center, _)| center).collect());
    if radius == 0.0 {
        return outlines.push(line, Shape::Rings(vec![ring]));
    }
    let mut parts = Vec::new();
    let mut moved = Vec::new();
    let next = ring.iter().skip(1).chain(ring.first());
    for (a, b) in ring.iter().zip(next) {
        let disc = outlines.push(line, Shape::Disc(radius));
        let by = glam::DAffine2::from_translation(*a);
        parts.push(outlines.push(line, Shape::Placed(disc, by)));
        let out = -(*b - *a).perp().normalize_or_zero() * radius;
        moved.extend([*a + out, *b + out]);
    }
    let middle = convex(moved);
    if middle.len() > 2 {
        parts.push(outlines.push(line, Shape::Rings(vec![middle])));
    }
    outlines.op(line, Operator::Union, parts)
}

/// Makes the hull of an outline.
pub(super) fn of_outline(
    outline: OutlineId,
    line: u32,
    outlines: &mut Outlines,
) -> Result<Hulled<OutlineId>, String> {
    let mut discs: Vec<(DVec2, f64)> = Vec::new();
    let mut points: Vec<DVec2> = Vec::new();
    let mut is_exact = true;
    for PlacedShape { id, map } in outlines.visit(outline) {
        let mut add = |ring: &[DVec2]| {
            points.extend(ring.iter().map(|p| map.transform_point2(*p)));
        };
        match &outlines.shapes[id as usize] {
            Shape::Box { min, max } => add(&corners(*min, *max)),
            Shape::Rings(rings) => rings.iter().for_each(|ring| add(ring)),
            Shape::Disc(radius) => {
                is_exact &= super::turn::is_round(&map);
                discs.push((map.translation, radius * map.matrix2.x_axis.length()));
            }
            Shape::Op(Operator::Union, _) => {}
            Shape::Op(..) => is_exact = false,
            Shape::Placed(..) | Shape::Colored(..) | Shape::Marked(_) => {}
        }
    }
    is_exact &= points.is_empty() || discs.is_empty();
    is_exact &= discs.iter().all(|(_, r)| near(*r, discs[0].1));
    if is_exact {
        let points = points.into_iter().map(|p| (p, 0.0));
        let all: Vec<(DVec2, f64)> = discs.into_iter().chain(points).collect();
        let is_there = all.first().is_some_and(|(_, r)| *r > 0.0) || all.len() > 2;
        return Ok(Hulled {
            hull: is_there.then(|| of_discs(all, line, outlines)),
            sides: None,
        });
    }
    let rings = outlines.rings(outline, curves::FINE_SIDES)?;
    let ring = convex(rings.into_iter().flatten().collect());
    let is_there = ring.len() > 2;
    Ok(Hulled {
        hull: is_there.then(|| outlines.push(line, Shape::Rings(vec![ring]))),
        sides: (!discs.is_empty()).then_some(curves::FINE_SIDES),
    })
}
