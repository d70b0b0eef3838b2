//! Solids with flat faces: as convex polyhedra, which are exact, or as closed meshes.

use super::solids::Leaf;
use crate::ImportReport;
use crate::geom::hull;
use crate::shared::triangulate::Triangulator;
use glam::{DVec2, DVec3};

/// The most faces of a polyhedron; a mesh of more is traced sooner.
const MOST_FACES: usize = 48;

/// Makes a convex solid of rings of corners, the highest first. A ring of one corner is an apex;
/// all others have equally many.
pub(super) fn of_rings(rings: &[Vec<DVec3>]) -> Result<Leaf, String> {
    let sides = rings.iter().map(Vec::len).max().unwrap_or(0);
    let points: Vec<DVec3> = rings.iter().flatten().copied().collect();
    if sides * rings.len().saturating_sub(1) + 2 <= MOST_FACES
        && let Ok(hull) = hull::of_points(&points)
    {
        let (planes, points) = (hull.planes, hull.points);
        return Ok(Leaf::Polyhedron { planes, points });
    }
    Ok(mesh_of_rings(rings))
}

/// Makes a closed mesh of rings of corners, with a lid at both ends.
fn mesh_of_rings(rings: &[Vec<DVec3>]) -> Leaf {
    let mut triangles = Vec::new();
    let mut first = 0_u32;
    for pair in rings.windows(2) {
        let [high, low] = [pair[0].len() as u32, pair[1].len() as u32];
        let next = first + high;
        for i in 0..high.max(low) {
            let j = (i + 1) % high.max(low);
            let [a, b] = [i, j].map(|i| first + i % high);
            let [c, d] = [i, j].map(|i| next + i % low);
            if a != b {
                triangles.push([a, c, b]);
            }
            if c != d {
                triangles.push([b, c, d]);
            }
        }
        first = next;
    }
    let count = rings.iter().map(Vec::len).sum::<usize>() as u32;
    let mut lid = |ring: &[DVec3], first: u32, is_high: bool| {
        for i in 1..(ring.len() as u32).saturating_sub(1) {
            let [b, c] = if is_high { [i, i + 1] } else { [i + 1, i] };
            triangles.push([first, first + b, first + c]);
        }
    };
    if let (Some(high), Some(low)) = (rings.first(), rings.last()) {
        lid(high, 0, true);
        lid(low, count - low.len() as u32, false);
    }
    Leaf::Mesh {
        positions: rings.iter().flatten().copied().collect(),
        triangles,
    }
}

/// Makes the solid of a `polyhedron`: exact if it is convex, else a mesh. `None` if it has no faces.
pub(super) fn of_faces(
    points: Vec<DVec3>,
    faces: &[Vec<u32>],
    report: &mut ImportReport,
) -> Result<Option<Leaf>, String> {
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut triangulator = Triangulator::new();
    for face in faces {
        let corners: Vec<DVec3> = face.iter().map(|row| points[*row as usize]).collect();
        triangulator.split(&corners, |t| triangles.push(t.map(|i| face[i as usize])));
    }
    triangulator.tell(report);
    // OpenSCAD's faces are clockwise seen from outside.
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    if triangles.is_empty() {
        return Ok(None);
    }
    let points = only_named(points, &mut triangles);
    if faces.len() <= MOST_FACES
        && let Ok(hull) = hull::of_points(&points)
        && is_convex(&points, &triangles, &hull)
    {
        let (planes, points) = (hull.planes, hull.points);
        return Ok(Some(Leaf::Polyhedron { planes, points }));
    }
    Ok(Some(Leaf::Mesh {
        positions: points,
        triangles,
    }))
}

/// Returns the points that are corners of triangles, which then name them by their new rows.
pub(super) fn only_named(points: Vec<DVec3>, triangles: &mut [[u32; 3]]) -> Vec<DVec3> {
    let mut rows: Vec<Option<u32>> = vec![None; points.len()];
    let mut named = Vec::new();
    for row in triangles.iter_mut().flatten() {
        let old = *row as usize;
        *row = *rows[old].get_or_insert_with(|| {
            named.push(points[old]);
            named.len() as u32 - 1
        });
    }
    named
}

/// Says whether triangles are the surface of the hull: all lie in its planes, and their area is its
/// own, by the volume under them.
fn is_convex(points: &[DVec3], triangles: &[[u32; 3]], hull: &hull::Hull) -> bool {
    let size = points
        .iter()
        .fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
    let middle = hull.points.iter().sum::<DVec3>() / hull.points.len() as f64;
    let mut volume = 0.0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|row| points[row as usize]);
        let is_on = |plane: &crate::geom::HalfSpace| {
            let off = [a, b, c].map(|p| (plane.normal.dot(p) - plane.offset).abs());
            off.iter().all(|x| *x <= size * 1e-9)
        };
        if !hull.planes.iter().any(is_on) {
            return false;
        }
        volume += (a - middle).dot((b - middle).cross(c - middle)).abs();
    }
    let surface = hull_volume(hull, middle);
    (volume - surface).abs() <= surface * 1e-9
}

/// Returns six times the volume of a hull, by the corners of each plane in turn about it.
fn hull_volume(hull: &hull::Hull, middle: DVec3) -> f64 {
    let size = hull
        .points
        .iter()
        .fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
    let mut volume = 0.0;
    for plane in &hull.planes {
        let mut corners: Vec<DVec3> = hull
            .points
            .iter()
            .copied()
            .filter(|p| (plane.normal.dot(*p) - plane.offset).abs() <= size * 1e-9)
            .collect();
        if corners.len() < 3 {
            continue;
        }
        let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let u = (corners[0] - center).normalize_or_zero();
        let v = plane.normal.cross(u);
        let angle = |p: &DVec3| libm::atan2((*p - center).dot(v), (*p - center).dot(u));
        corners.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            volume += (*a - middle).dot((b - middle).cross(center - middle)).abs();
        }
    }
    volume
}

/// Makes what a ring sweeps from z = `from` up, scaled by a factor on the way.
pub(super) fn of_tapered(ring: &[DVec2], (from, height): (f64, f64), scale: f64) -> Leaf {
    let (to, ring) = (from + height, &counter_clockwise(ring)[..]);
    let lower = ring.iter().map(|p| p.extend(from));
    let upper = ring.iter().map(|p| (*p * scale).extend(to));
    let positions: Vec<DVec3> = lower.chain(upper).collect();
    if ring.len() + 2 <= MOST_FACES
        && is_ring_convex(ring)
        && let Ok(hull) = hull::of_points(&positions)
    {
        let (planes, points) = (hull.planes, hull.points);
        return Leaf::Polyhedron { planes, points };
    }
    let count = ring.len() as u32;
    let mut triangles = Vec::new();
    join(&mut triangles, count, [0, count]);
    let lid = filled(ring);
    triangles.extend(lid.iter().map(|[a, b, c]| [*a, *c, *b]));
    triangles.extend(lid.iter().map(|t| t.map(|row| row + count)));
    Leaf::Mesh {
        positions,
        triangles,
    }
}

/// Makes what a ring sweeps that is turned about its y axis by an angle in degrees, in so many steps
/// to a whole turn. As OpenSCAD does: a whole turn begins at −x, another one at +x, and a part of a
/// step is none.
pub(super) fn of_turned(ring: &[DVec2], (sides, angle): (u32, f64), is_mirrored: bool) -> Leaf {
    let is_whole = angle.abs() >= 360.0;
    let (steps, count) = (steps(sides, angle), ring.len() as u32);
    let ring = counter_clockwise(ring);
    let start = if is_whole != is_mirrored { 180.0 } else { 0.0 };
    let layers = if is_whole { steps } else { steps + 1 };
    let mut positions = Vec::new();
    for i in 0..layers {
        let turn = f64::from(i) / f64::from(steps) * angle + start;
        let (sin, cos) = libm::sincos(turn.to_radians());
        positions.extend(ring.iter().map(|p| DVec3::new(p.x * cos, p.x * sin, p.y)));
    }
    let mut triangles = Vec::new();
    for i in 0..steps {
        join(
            &mut triangles,
            count,
            [(i + 1) % layers, i].map(|k| k * count),
        );
    }
    if !is_whole {
        // The ring is clockwise seen from where it turns to, so the first lid is as it is.
        let (lid, last) = (filled(&ring), steps * count);
        triangles.extend(&lid);
        triangles.extend(lid.iter().map(|[a, b, c]| [a + last, c + last, b + last]));
    }
    if angle < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Leaf::Mesh {
        positions,
        triangles,
    }
}

/// Returns in how many steps a turn by an angle in degrees is made.
pub(super) fn steps(sides: u32, angle: f64) -> u32 {
    let part = (angle.abs() / 360.0).min(1.0);
    (f64::from(sides) * part).max(1.0) as u32
}

/// Returns a ring so that its inside is to the left of its edges; those of holes are not.
fn counter_clockwise(ring: &[DVec2]) -> Vec<DVec2> {
    let next = ring.iter().skip(1).chain(ring.first());
    let area: f64 = ring.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    match area < 0.0 {
        true => ring.iter().rev().copied().collect(),
        false => ring.to_vec(),
    }
}

/// Joins two copies of a ring, which begin at these rows, by two triangles for each edge.
fn join(triangles: &mut Vec<[u32; 3]>, count: u32, [low, high]: [u32; 2]) {
    for a in 0..count {
        let b = (a + 1) % count;
        triangles.push([low + a, low + b, high + b]);
        triangles.push([low + a, high + b, high + a]);
    }
}

/// Fills a ring with triangles.
fn filled(ring: &[DVec2]) -> Vec<[u32; 3]> {
    let points: Vec<DVec3> = ring.iter().map(|p| p.extend(0.0)).collect();
    let mut triangles = Vec::new();
    Triangulator::new().split(&points, |t| triangles.push(t));
    triangles
}

fn is_ring_convex(ring: &[DVec2]) -> bool {
    let count = ring.len();
    let turn = |i: usize| {
        let [a, b, c] = [i, i + 1, i + 2].map(|k| ring[k % count]);
        (b - a).perp_dot(c - b)
    };
    let is_left = (0..count).all(|i| turn(i) >= 0.0);
    let is_right = (0..count).all(|i| turn(i) <= 0.0);
    is_left || is_right
}
