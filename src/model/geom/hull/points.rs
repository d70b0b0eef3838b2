//! Quickhull: a tetrahedron grows by the farthest outside point until none is left.
//!
//! Among equally far points the one farthest from the middle is taken: it certainly is a corner,
//! so three points on a line never become a triangle. Each plane is finally moved outward until
//! all points are inside, which makes up for rounding.

use super::support::Support;
use super::{FLATNESS, Hull, HullError, MAX_POINTS, MAX_SPREAD, TOLERANCE, spread};
use crate::geom::HalfSpace;
use crate::math::Aabb;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

struct Face {
    corners: [usize; 3],
    /// The face across the edge from corner k to corner k + 1.
    across: [usize; 3],
    normal: DVec3,
    area: f64,
    outside: Vec<usize>,
    dead: bool,
}

impl Face {
    fn new(points: &[DVec3], corners: [usize; 3]) -> Face {
        let [a, b, c] = corners.map(|i| points[i]);
        let cross = (b - a).cross(c - a);
        let area = cross.length();
        Face {
            corners,
            across: [usize::MAX; 3],
            // A face without area has no outside points.
            normal: if area > 0.0 {
                cross / area
            } else {
                DVec3::ZERO
            },
            area,
            outside: Vec::new(),
            dead: false,
        }
    }

    fn distance(&self, points: &[DVec3], p: usize) -> f64 {
        self.normal.dot(points[p] - points[self.corners[0]])
    }
}

/// Computes the hull of at least four points that do not lie in one plane.
pub fn of_points(given: &[DVec3]) -> Result<Hull, HullError> {
    if given.len() < 4 {
        return Err(HullError::TooFew(given.len()));
    }
    if given.len() > MAX_POINTS {
        return Err(HullError::TooMany {
            what: "points",
            count: given.len(),
            limit: MAX_POINTS,
        });
    }
    if let Some(i) = given.iter().position(|p| !p.is_finite()) {
        return Err(HullError::BadPoint(i));
    }
    // Relative to the middle and at unit size.
    let bounds = Aabb::of_points(given.iter().copied());
    let middle = bounds.center();
    let half = given.iter().map(|p| (*p - middle).abs().max_element());
    let size = half.fold(0.0, f64::max);
    if size == 0.0 || !size.is_finite() {
        return Err(HullError::Flat);
    }
    let points: Vec<DVec3> = given.iter().map(|p| (*p - middle) / size).collect();

    let mut faces = tetrahedron(&points)?;
    let mut waiting: Vec<usize> = (0..faces.len()).collect();
    while let Some(face) = waiting.pop() {
        if faces[face].dead || faces[face].outside.is_empty() {
            continue;
        }
        let distance = |p: usize| faces[face].distance(&points, p);
        let eye = farthest(&points, &faces[face].outside, distance);
        grow(&points, &mut faces, face, eye, &mut waiting)?;
    }
    faces.retain_mut(|f| !f.dead);
    finish(given, &points, &faces, size)
}

/// Returns, among the candidates that are farthest by `distance` within the tolerance, the one
/// farthest from the middle.
fn farthest(points: &[DVec3], among: &[usize], distance: impl Fn(usize) -> f64) -> usize {
    let most = among.iter().map(|p| distance(*p)).fold(0.0, f64::max);
    let near = among
        .iter()
        .copied()
        .filter(|p| distance(*p) >= most - TOLERANCE);
    near.fold(among[0], |best, p| {
        let better = points[p].length_squared() > points[best].length_squared();
        if better || distance(best) < most - TOLERANCE {
            p
        } else {
            best
        }
    })
}

fn tetrahedron(points: &[DVec3]) -> Result<Vec<Face>, HullError> {
    let all: Vec<usize> = (0..points.len()).collect();
    let a = farthest(points, &all, |p| points[p].length());
    let b = farthest(points, &all, |p| points[p].distance(points[a]));
    let axis = (points[b] - points[a]).normalize_or_zero();
    let off_axis = |p: usize| axis.cross(points[p] - points[a]).length();
    let c = farthest(points, &all, off_axis);
    if off_axis(c) <= FLATNESS {
        return Err(HullError::Flat);
    }
    let base = Face::new(points, [a, b, c]);
    let d = farthest(points, &all, |p| base.distance(points, p).abs());
    let height = base.distance(points, d);
    if height.abs() <= FLATNESS {
        return Err(HullError::Flat);
    }
    let (b, c) = if height > 0.0 { (c, b) } else { (b, c) };
    // Counter-clockwise seen from outside; d lies behind (a, b, c).
    let corners = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]];
    let mut faces: Vec<Face> = corners.map(|c| Face::new(points, c)).into();
    faces[0].across = [1, 2, 3];
    faces[1].across = [3, 2, 0];
    faces[2].across = [1, 3, 0];
    faces[3].across = [2, 1, 0];
    hand_over(points, &mut faces, 0, &all);
    Ok(faces)
}

/// Gives each point to the first face, from `first` on, that it lies outside.
fn hand_over(points: &[DVec3], faces: &mut [Face], first: usize, orphans: &[usize]) {
    for p in orphans {
        let sees = |f: &&mut Face| f.distance(points, *p) > TOLERANCE;
        if let Some(face) = faces[first..].iter_mut().find(sees) {
            face.outside.push(*p);
        }
    }
}

/// Replaces the faces that `eye` sees by a fan from it to their horizon.
fn grow(
    points: &[DVec3],
    faces: &mut Vec<Face>,
    start: usize,
    eye: usize,
    waiting: &mut Vec<usize>,
) -> Result<(), HullError> {
    // 1. Find all visible faces, from neighbour to neighbour.
    let mut open = vec![start];
    let mut orphans = Vec::new();
    let mut horizon = Vec::new();
    faces[start].dead = true;
    while let Some(f) = open.pop() {
        orphans.append(&mut faces[f].outside);
        for k in 0..3 {
            let next = faces[f].across[k];
            if faces[next].dead {
                continue;
            }
            if faces[next].distance(points, eye) > TOLERANCE {
                faces[next].dead = true;
                open.push(next);
            } else {
                let (a, b) = (faces[f].corners[k], faces[f].corners[(k + 1) % 3]);
                horizon.push((a, b, next));
            }
        }
    }
    // 2. Drop horizon edges towards faces that were found visible later.
    horizon.retain(|(_, _, next)| !faces[*next].dead);

    // 3. Make one face per edge of the horizon, which must be one closed loop.
    let first = faces.len();
    let mut starting = HashMap::with_capacity(horizon.len());
    for (i, (a, b, _)) in horizon.iter().enumerate() {
        if starting.insert(*a, first + i).is_some() {
            return Err(HullError::Unsettled);
        }
        faces.push(Face::new(points, [*a, *b, eye]));
    }
    for (i, (a, b, next)) in horizon.iter().enumerate() {
        let after = *starting.get(b).ok_or(HullError::Unsettled)?;
        faces[first + i].across[0] = *next;
        faces[first + i].across[1] = after;
        faces[after].across[2] = first + i;
        let back = (0..3)
            .find(|k| faces[*next].corners[*k] == *b && faces[*next].corners[(*k + 1) % 3] == *a);
        faces[*next].across[back.ok_or(HullError::Unsettled)?] = first + i;
    }
    hand_over(points, faces, first, &orphans);
    waiting.extend(first..faces.len());
    Ok(())
}

/// Merges coplanar triangles and keeps the corners where three faces meet.
fn finish(given: &[DVec3], points: &[DVec3], faces: &[Face], size: f64) -> Result<Hull, HullError> {
    let group_of = groups(points, faces)?;
    let count = group_of.iter().max().map_or(0, |m| m + 1);
    let mut normals = vec![DVec3::ZERO; count];
    let mut groups_at: HashMap<usize, Vec<usize>> = HashMap::new();
    let mut met = HashSet::new();
    for (face, group) in faces.iter().zip(&group_of) {
        // Weighted by area, so that slivers count little.
        normals[*group] += face.normal * face.area;
        for corner in face.corners {
            if met.insert((corner, *group)) {
                groups_at.entry(corner).or_default().push(*group);
            }
        }
    }
    let mut corners: Vec<usize> = groups_at.keys().copied().collect();
    corners.sort_unstable();
    let mut hull = Hull {
        planes: Vec::with_capacity(count),
        points: Vec::new(),
    };
    let support = Support::new(corners.iter().map(|c| given[*c]).collect());
    for normal in normals {
        let normal = normal.try_normalize().ok_or(HullError::Unsettled)?;
        // The plane is moved outward to the farthest corner.
        let offset = support.reach(normal);
        // The hull must not be flat along the normal. The first few corners show it.
        let mut range = (f64::MAX, f64::MIN);
        let is_thick = corners.iter().any(|c| {
            let x = normal.dot(points[*c]);
            range = (range.0.min(x), range.1.max(x));
            range.1 - range.0 > FLATNESS
        });
        if !(offset.is_finite() && is_thick && size > 0.0) {
            return Err(HullError::Unsettled);
        }
        hull.planes.push(HalfSpace { normal, offset });
    }
    corners.retain(|c| groups_at[c].len() >= 3);
    for corner in &corners {
        let around = groups_at[corner].iter().map(|g| hull.planes[*g].normal);
        if steepest(&around.collect::<Vec<_>>()) > MAX_SPREAD {
            return Err(HullError::Sharp);
        }
    }
    hull.points = corners.iter().map(|c| given[*c]).collect();
    if hull.planes.len() < 4 || hull.points.len() < 4 {
        return Err(HullError::Unsettled);
    }
    Ok(hull)
}

/// Returns the spread of three planes through a corner that differ much: nearly the least over all
/// triples, without trying all of them.
fn steepest(normals: &[DVec3]) -> f64 {
    let most = |by: &dyn Fn(DVec3) -> f64| {
        let normals = normals.iter().copied();
        normals
            .max_by(|x, y| by(*x).total_cmp(&by(*y)))
            .unwrap_or(DVec3::ZERO)
    };
    let a = normals[0];
    let b = most(&|n| a.cross(n).length());
    let c = most(&|n| a.cross(b).dot(n).abs());
    spread([a, b, c])
}

/// Returns the number of the flat face that each triangle belongs to. Faces grow from the largest
/// triangle outward, so that slivers join their large neighbours.
fn groups(points: &[DVec3], faces: &[Face]) -> Result<Vec<usize>, HullError> {
    let mut by_area: Vec<usize> = (0..faces.len()).collect();
    by_area.sort_by(|a, b| faces[*b].area.total_cmp(&faces[*a].area));
    let mut edges = HashMap::with_capacity(faces.len() * 3);
    for (i, face) in faces.iter().enumerate() {
        for k in 0..3 {
            edges.insert((face.corners[k], face.corners[(k + 1) % 3]), i);
        }
    }
    const NONE: usize = usize::MAX;
    let mut group_of = vec![NONE; faces.len()];
    let mut count = 0;
    for seed in by_area {
        if group_of[seed] != NONE {
            continue;
        }
        group_of[seed] = count;
        let mut open = vec![seed];
        while let Some(f) = open.pop() {
            for k in 0..3 {
                let edge = (faces[f].corners[(k + 1) % 3], faces[f].corners[k]);
                let next = *edges.get(&edge).ok_or(HullError::Unsettled)?;
                let flat = |c: &usize| faces[seed].distance(points, *c).abs() <= FLATNESS;
                if group_of[next] == NONE && faces[next].corners.iter().all(flat) {
                    group_of[next] = count;
                    open.push(next);
                }
            }
        }
        count += 1;
    }
    Ok(group_of)
}
