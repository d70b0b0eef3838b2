//! Corners from planes: a cube far larger than the solid is cut by one plane after the other.
//!
//! A corner is always computed from three planes, never from other corners, so the cube's size
//! does not affect it. It carries its own error bound, which grows as planes meet at smaller
//! angles; if more than three planes meet, the three with the smallest bound count. A plane that
//! cuts off nothing beyond the tolerance is redundant. If a face of the cube remains at the end,
//! the planes do not bound a solid.

use super::{Hull, HullError, MAX_PLANES, MAX_SPREAD, TOLERANCE, spread};
use crate::geom::HalfSpace;
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// The half width of the first cube relative to the distance of the farthest plane; a solid that
/// reaches beyond it counts as unbounded.
const FAR: f64 = 1e6;

struct Face {
    plane: usize,
    /// Counter-clockwise seen from outside.
    corners: Vec<usize>,
}

struct Corner {
    at: DVec3,
    /// The error bound of `at`.
    error: f64,
    /// All planes that are known to pass through it.
    planes: Vec<usize>,
}

/// Planes at unit size, and the corners made so far.
struct Solid {
    planes: Vec<HalfSpace>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
}

/// Computes the bounded solid inside all planes.
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
    let corners: Vec<&Corner> = used.iter().map(|c| &solid.corners[*c]).collect();
    // The result is checked against the given planes.
    for corner in &corners {
        // In a thin column the cube's face may have lost all its corners.
        if corner.planes.iter().any(|plane| *plane >= given.len()) {
            return Err(HullError::Unbounded);
        }
        let limit = 16.0 * f64::EPSILON * MAX_SPREAD * (1.0 + corner.at.abs().max_element());
        if corner.error > limit {
            return Err(HullError::Sharp);
        }
        let over = |h: &HalfSpace| h.normal.dot(corner.at) - h.offset;
        let tolerance = 16.0 * corner.tolerance();
        if solid.planes[..given.len()]
            .iter()
            .any(|h| over(h) > tolerance)
        {
            return Err(HullError::Unsettled);
        }
    }
    if corners.len() < 4 || solid.faces.len() < 4 {
        return Err(HullError::Unsettled);
    }
    Ok(Hull {
        planes: solid.faces.iter().map(|f| planes[f.plane]).collect(),
        points: corners.iter().map(|c| c.at * size).collect(),
    })
}

fn unit(plane: &HalfSpace) -> Option<HalfSpace> {
    // Scaled before it is squared, because normals may have any length.
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

/// Makes the first cube; its planes follow the given ones.
fn cube(mut planes: Vec<HalfSpace>) -> Solid {
    let first = planes.len();
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for normal in [axis, -axis] {
            let offset = FAR;
            planes.push(HalfSpace { normal, offset });
        }
    }
    let corners = crate::math::Aabb::new(DVec3::splat(-FAR), DVec3::splat(FAR)).corners();
    let corner = |at: DVec3| Corner {
        at,
        error: 0.0,
        planes: (0..3)
            .map(|k| first + 2 * k + usize::from(at[k] < 0.0))
            .collect(),
    };
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
        corners: corners.map(corner).into(),
        faces: faces.collect(),
    }
}

impl Corner {
    fn tolerance(&self) -> f64 {
        f64::max(TOLERANCE * (1.0 + self.at.abs().max_element()), self.error)
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
    let side = |corner: &Corner| {
        let over = normal.dot(corner.at) - offset;
        let tolerance = corner.tolerance();
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
                            solid.corners.push(meet(&solid.planes, through)?);
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
        // The new face has the cut edge in the opposite direction.
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
    for corner in corners.iter().filter(|c| **c < sides.len()) {
        refine(&solid.planes, &mut solid.corners[*corner], plane);
    }
    kept.push(Face { plane, corners });
    solid.faces = kept;
    Ok(())
}

fn edges(corners: &[usize]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let n = corners.len();
    (0..n).map(move |i| (corners[i], corners[(i + 1) % n]))
}

/// Computes the point where three planes meet, by Cramer's rule (P7, docs/numerics/planes.md).
fn meet(planes: &[HalfSpace], through: [usize; 3]) -> Result<Corner, HullError> {
    let [a, b, c] = through.map(|p| planes[p]);
    let (bc, ca, ab) = (
        b.normal.cross(c.normal),
        c.normal.cross(a.normal),
        a.normal.cross(b.normal),
    );
    let determinant = DMat3::from_cols(a.normal, b.normal, c.normal).determinant();
    let at = (bc * a.offset + ca * b.offset + ab * c.offset) / determinant;
    // Normals and offsets are rounded, and so is every operation above (P7,
    // docs/numerics/planes.md).
    let spread = spread([a.normal, b.normal, c.normal]);
    let error = 16.0 * f64::EPSILON * spread * (1.0 + at.abs().max_element());
    if at.is_finite() && error.is_finite() {
        let planes = through.to_vec();
        return Ok(Corner { at, error, planes });
    }
    Err(HullError::Unsettled)
}

/// Recomputes a corner with one more plane through it, if that has a smaller error bound.
fn refine(planes: &[HalfSpace], corner: &mut Corner, plane: usize) {
    let known = corner.planes.clone();
    for (i, a) in known.iter().enumerate() {
        for b in &known[..i] {
            if let Ok(other) = meet(planes, [*a, *b, plane])
                && other.error < corner.error
            {
                (corner.at, corner.error) = (other.at, other.error);
            }
        }
    }
    corner.planes.push(plane);
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
