//! From planes to corners: a cube far larger than the solid is cut by one plane
//! after the other.
//!
//! A corner is always computed from three planes, never from other corners, so
//! nothing of the cube's size remains in it. A plane that cuts nothing off
//! within the tolerance is redundant. If a face of the cube is left at the end,
//! the planes do not close.

use super::{Hull, HullError, MAX_PLANES, TOLERANCE};
use crate::geom::HalfSpace;
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// Half the first cube, where the farthest plane is at distance 1: corners
/// beyond count as unbounded.
const FAR: f64 = 1e6;

struct Face {
    plane: usize,
    /// Counter-clockwise seen from outside.
    corners: Vec<usize>,
}

/// Planes at unit size, and the corners made so far.
struct Solid {
    planes: Vec<HalfSpace>,
    corners: Vec<DVec3>,
    faces: Vec<Face>,
}

/// The bounded solid inside all planes.
pub fn of_planes(given: &[HalfSpace]) -> Result<Hull, HullError> {
    if given.len() > MAX_PLANES {
        return Err(HullError::TooMany {
            what: "planes",
            count: given.len(),
            limit: MAX_PLANES,
        });
    }
    let mut planes = Vec::with_capacity(given.len());
    for (i, plane) in given.iter().enumerate() {
        planes.push(unit(plane).ok_or(HullError::BadPlane(i))?);
    }
    let size = planes.iter().map(|p| p.offset.abs()).fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { 1.0 };
    let scaled = planes.iter().map(|p| HalfSpace {
        normal: p.normal,
        offset: p.offset / size,
    });
    let mut solid = cube(scaled.collect());
    for plane in 0..given.len() {
        cut(&mut solid, plane)?;
    }
    if solid.faces.iter().any(|f| f.plane >= given.len()) {
        return Err(HullError::Unbounded);
    }
    let mut used: Vec<usize> = solid.faces.iter().flat_map(|f| f.corners.clone()).collect();
    used.sort_unstable();
    used.dedup();
    let points: Vec<DVec3> = used.iter().map(|c| solid.corners[*c]).collect();
    // What was computed is what was asked for, or nothing is.
    for p in &points {
        let over = |h: &HalfSpace| h.normal.dot(*p) - h.offset;
        let reach = 1.0 + p.abs().max_element();
        if solid.planes[..given.len()]
            .iter()
            .any(|h| over(h) > 16.0 * TOLERANCE * reach)
        {
            return Err(HullError::Unsettled);
        }
    }
    if points.len() < 4 || solid.faces.len() < 4 {
        return Err(HullError::Unsettled);
    }
    Ok(Hull {
        planes: solid.faces.iter().map(|f| planes[f.plane]).collect(),
        points: points.iter().map(|p| *p * size).collect(),
    })
}

fn unit(plane: &HalfSpace) -> Option<HalfSpace> {
    // Scaled before it is squared: normals may have any length.
    let scale = plane.normal.abs().max_element();
    if !(scale > 0.0 && scale.is_finite() && plane.normal.is_finite()) {
        return None;
    }
    let normal = plane.normal / scale;
    let length = normal.length();
    let offset = plane.offset / scale / length;
    offset.is_finite().then_some(HalfSpace {
        normal: normal / length,
        offset,
    })
}

/// The first solid; its planes follow the given ones.
fn cube(mut planes: Vec<HalfSpace>) -> Solid {
    let first = planes.len();
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for normal in [axis, -axis] {
            let offset = FAR;
            planes.push(HalfSpace { normal, offset });
        }
    }
    let corners = crate::math::Aabb::new(DVec3::splat(-FAR), DVec3::splat(FAR)).corners();
    let loops = [
        [1, 3, 7, 5],
        [0, 4, 6, 2],
        [2, 6, 7, 3],
        [0, 1, 5, 4],
        [4, 5, 7, 6],
        [0, 2, 3, 1],
    ];
    let faces = loops.iter().enumerate().map(|(i, corners)| Face {
        plane: first + i,
        corners: corners.to_vec(),
    });
    Solid {
        planes,
        corners: corners.to_vec(),
        faces: faces.collect(),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    In,
    On,
    Out,
}

fn cut(solid: &mut Solid, plane: usize) -> Result<(), HullError> {
    let HalfSpace { normal, offset } = solid.planes[plane];
    let side = |p: &DVec3| {
        let over = normal.dot(*p) - offset;
        let tolerance = TOLERANCE * (1.0 + p.abs().max_element());
        if over > tolerance {
            Side::Out
        } else if over < -tolerance {
            Side::In
        } else {
            Side::On
        }
    };
    let sides: Vec<Side> = solid.corners.iter().map(side).collect();
    let any = |s: Side| {
        solid
            .faces
            .iter()
            .any(|f| f.corners.iter().any(|c| sides[*c] == s))
    };
    if !any(Side::Out) {
        return Ok(());
    }
    if !any(Side::In) {
        return Err(HullError::Empty);
    }
    // The faces on the two sides of each edge that may be cut.
    let mut face_of = HashMap::new();
    for (i, face) in solid.faces.iter().enumerate() {
        for (a, b) in edges(&face.corners) {
            if sides[a] == Side::Out || sides[b] == Side::Out {
                face_of.insert((a, b), i);
            }
        }
    }
    let mut made: HashMap<(usize, usize), usize> = HashMap::new();
    let mut rim: HashMap<usize, usize> = HashMap::new();
    let mut kept = Vec::with_capacity(solid.faces.len() + 1);
    for (i, face) in solid.faces.iter().enumerate() {
        if face.corners.iter().all(|c| sides[*c] != Side::Out) {
            kept.push(Face {
                plane: face.plane,
                corners: face.corners.clone(),
            });
            continue;
        }
        let mut corners = Vec::with_capacity(face.corners.len() + 1);
        let (mut leaves, mut returns) = (None, None);
        for (a, b) in edges(&face.corners) {
            if sides[a] != Side::Out {
                corners.push(a);
            }
            let crossing = match (sides[a], sides[b]) {
                (Side::In, Side::Out) | (Side::Out, Side::In) => {
                    let key = (a.min(b), a.max(b));
                    let other = *face_of.get(&(b, a)).ok_or(HullError::Unsettled)?;
                    let through = [face.plane, solid.faces[other].plane, plane];
                    let id = match made.get(&key) {
                        Some(id) => *id,
                        None => {
                            let at = meet(through.map(|p| solid.planes[p]))?;
                            solid.corners.push(at);
                            made.insert(key, solid.corners.len() - 1);
                            solid.corners.len() - 1
                        }
                    };
                    corners.push(id);
                    Some(id)
                }
                (Side::On, Side::Out) => Some(a),
                (Side::Out, Side::On) => Some(b),
                _ => None,
            };
            match (crossing, sides[b]) {
                (Some(id), Side::Out) => leaves = Some(id),
                (Some(id), _) => returns = Some(id),
                _ => {}
            }
        }
        // The cut edge, which the new face goes the other way.
        if let (Some(from), Some(to)) = (leaves, returns)
            && from != to
            && rim.insert(to, from).is_some()
        {
            return Err(HullError::Unsettled);
        }
        if corners.len() >= 3 {
            kept.push(Face {
                plane: solid.faces[i].plane,
                corners,
            });
        }
    }
    let corners = closed_loop(&rim)?;
    kept.push(Face { plane, corners });
    solid.faces = kept;
    Ok(())
}

fn edges(corners: &[usize]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let n = corners.len();
    (0..n).map(move |i| (corners[i], corners[(i + 1) % n]))
}

/// Where three planes meet, by Cramer's rule.
fn meet([a, b, c]: [HalfSpace; 3]) -> Result<DVec3, HullError> {
    let (bc, ca, ab) = (
        b.normal.cross(c.normal),
        c.normal.cross(a.normal),
        a.normal.cross(b.normal),
    );
    let determinant = DMat3::from_cols(a.normal, b.normal, c.normal).determinant();
    let p = (bc * a.offset + ca * b.offset + ab * c.offset) / determinant;
    if p.is_finite() {
        Ok(p)
    } else {
        Err(HullError::Unsettled)
    }
}

fn closed_loop(next: &HashMap<usize, usize>) -> Result<Vec<usize>, HullError> {
    let start = *next.keys().min().ok_or(HullError::Unsettled)?;
    let mut corners = vec![start];
    let mut at = next[&start];
    while at != start {
        if corners.len() >= next.len() {
            return Err(HullError::Unsettled);
        }
        corners.push(at);
        at = *next.get(&at).ok_or(HullError::Unsettled)?;
    }
    if corners.len() < 3 || corners.len() != next.len() {
        return Err(HullError::Unsettled);
    }
    Ok(corners)
}
