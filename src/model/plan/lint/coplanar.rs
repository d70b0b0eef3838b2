//! Lint for plane faces of different operands that lie in one plane: exactly in one frame,
//! to within the roundings of their maps in different frames.

use super::solids::{label, overlap};
use crate::math::Aabb;
use crate::scene::{CsgSolid, Face, FaceKey, Frame, Tables, faces_of};
use glam::DVec3;

/// Planes of different frames count as one if they differ by at most 32 roundings 2⁻⁵² of
/// the largest coordinate. Only the lint depends on it, and no answer
/// (docs/numerics/csg.md, K10 has the bound of answers).
const ROUNDINGS: f64 = 32.0 * f64::EPSILON;

/// A plane face in the solid's space.
struct Plane {
    operand: u32,
    frame: u32,
    key: FaceKey,
    /// The unit normal, with its first large component positive, so that opposite normals
    /// are one.
    normal: DVec3,
    offset: f64,
    /// The sort key: nearly equal for nearly equal planes.
    order: f64,
}

/// Returns the unit normal and the offset of a face in the solid's space, if the face is
/// plane.
fn plane(face: &Face, frame: &Frame) -> Option<(DVec3, f64)> {
    let (normal, offset) = match *face {
        Face::Across { axis, at } => (DVec3::AXES[axis], at),
        Face::Plane { normal, offset } => (normal, offset),
        Face::Cap { at, to } => (to - at, (to - at).dot(at)),
        _ => return None,
    };
    let map = &frame.operand_from_solid;
    let offset = offset - normal.dot(DVec3::from_array(map.translation));
    let normal = DVec3::from_array(map.transposed_vector(normal.to_array()));
    let length = normal.length();
    let first = normal
        .to_array()
        .into_iter()
        .find(|x| x.abs() > 0.3 * length)?;
    let scale = length.copysign(first);
    Some((normal / scale, offset / scale))
}

/// Reports faces of different operands that lie in one plane and whose operands' boxes
/// overlap.
pub(super) fn coplanar(tables: &Tables, solid: &CsgSolid) -> Option<String> {
    let mut planes: Vec<Plane> = Vec::new();
    let bounds = |operand: u32| solid.operands[operand as usize].bounds;
    let coordinate = |b: Aabb| b.max_abs();
    let mut largest = solid.frames.iter().map(|f| f.reach).fold(0.0, f64::max);
    for (number, operand) in (0..).zip(&solid.operands) {
        let frame = &solid.frames[operand.frame as usize];
        largest = largest.max(operand.bounds.map_or(0.0, coordinate));
        for face in faces_of(tables, operand.shape).into_iter().flatten() {
            let Some((normal, offset)) = plane(&face, frame) else {
                continue;
            };
            planes.push(Plane {
                operand: number,
                frame: operand.frame,
                key: face.key(),
                normal,
                offset,
                order: 0.0,
            });
        }
    }
    let farthest = planes
        .iter()
        .map(|p| p.offset.abs())
        .fold(largest, f64::max);
    let off = farthest * ROUNDINGS;
    // Any direction without a special position serves as the sort key's.
    let across = DVec3::new(0.527, 0.611, 0.439);
    for plane in &mut planes {
        plane.order = plane.offset + farthest * across.dot(plane.normal);
    }
    planes.sort_by(|a, b| a.order.total_cmp(&b.order));
    let size = |p: &Plane| {
        let reach = solid.frames[p.frame as usize].reach;
        bounds(p.operand)
            .map_or(0.0, coordinate)
            .max(p.offset.abs())
            .max(reach)
    };
    let same = |a: &Plane, b: &Plane| match a.frame == b.frame {
        true => a.key == b.key,
        false => {
            (a.offset - b.offset).abs() <= size(a).max(size(b)) * ROUNDINGS
                && (a.normal - b.normal).abs().max_element() <= ROUNDINGS
        }
    };
    let extent = |p: &Plane| bounds(p.operand).map_or(f64::INFINITY, |b| b.diagonal());
    let mut grouped = vec![false; planes.len()];
    let (mut count, mut found): (usize, Option<(&Plane, &Plane)>) = (0, None);
    for start in 0..planes.len() {
        if grouped[start] {
            continue;
        }
        let group: Vec<usize> = (start..planes.len())
            .take_while(|i| planes[*i].order - planes[start].order <= 4.0 * off)
            .filter(|i| *i == start || same(&planes[start], &planes[*i]))
            .collect();
        // Each plane of a group is compared with that of the largest extent only, which
        // takes linear time and is the pair that users ask about.
        let mut largest = &planes[start];
        for i in &group {
            grouped[*i] = true;
            if extent(&planes[*i]) > extent(largest) {
                largest = &planes[*i];
            }
        }
        for other in group.into_iter().map(|i| &planes[i]) {
            let both = [bounds(largest.operand), bounds(other.operand)];
            let apart = matches!(both, [Some(a), Some(b)] if !overlap(&a, &b));
            if largest.operand == other.operand || apart || !same(largest, other) {
                continue;
            }
            count += 1;
            let key = |(a, b): (&Plane, &Plane)| {
                let axis = a.normal.abs().max_position();
                (a.operand.min(b.operand), a.operand.max(b.operand), axis)
            };
            let pair = (largest, other);
            if found.is_none_or(|best| key(pair) < key(best)) {
                found = Some(pair);
            }
        }
    }
    let (a, b) = found?;
    let plane = described(a);
    let [first, second] = [a.operand.min(b.operand), a.operand.max(b.operand)]
        .map(|n| label(tables, solid.operands[n as usize].id));
    Some(match count {
        1 => format!(
            "{first} and {second} have faces in one plane, {plane}; they count as one boundary"
        ),
        _ => format!(
            "{count} pairs of faces lie in one plane, such as one of {first} and one of {second} \
             ({plane}); each counts as one boundary"
        ),
    })
}

/// Describes a plane by its equation, or by its normal, in the solid's space.
fn described(plane: &Plane) -> String {
    let axis = plane.normal.abs().max_position();
    let others = plane.normal.abs().element_sum() - plane.normal[axis].abs();
    if others <= ROUNDINGS {
        return format!("{} = {}", ["x", "y", "z"][axis], plane.offset + 0.0);
    }
    let [x, y, z] = plane.normal.to_array().map(|x| format!("{:.4}", x + 0.0));
    format!("with normal [{x}, {y}, {z}]")
}
