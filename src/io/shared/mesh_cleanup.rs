//! Cleanup of imported meshes: unused vertices and unusable normals.
//!
//! Importers remove vertices that no triangle uses, which would widen the bounds and move
//! the centre, and replace normals that shading cannot use. Triangles keep their number and
//! order: a triangle's id is its index in the file.

use crate::scene::MeshData;
use glam::DVec3;

/// Removes the vertices that no triangle uses; the others keep their order.
/// Every corner must be a valid index into `positions`.
pub fn compact(mesh: &mut MeshData) {
    let mut used = vec![false; mesh.positions.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    if used.iter().all(|u| *u) {
        return;
    }
    let mut row = vec![0_u32; used.len()];
    let mut next = 0;
    for (row, used) in row.iter_mut().zip(&used) {
        *row = next;
        next += u32::from(*used);
    }
    let mut keep = used.iter();
    mesh.positions.retain(|_| *keep.next().unwrap_or(&true));
    let mut keep = used.iter();
    mesh.normals.retain(|_| *keep.next().unwrap_or(&true));
    for set in &mut mesh.uvs {
        let mut keep = used.iter();
        set.retain(|_| *keep.next().unwrap_or(&true));
    }
    let mut keep = used.iter();
    mesh.colors.retain(|_| *keep.next().unwrap_or(&true));
    for v in mesh.triangles.iter_mut().flatten() {
        *v = row[*v as usize];
    }
}

/// Replaces each normal that is not finite, or whose largest component is outside
/// 1e-15…1e15, by the area-weighted normal of the triangles around the vertex. Returns how
/// many were replaced.
pub fn repair_normals(mesh: &mut MeshData) -> usize {
    // Outside these limits the squared length can leave f32's range.
    let usable = |n: &[f32; 3]| {
        let size = n.iter().fold(0.0_f32, |a, x| a.max(x.abs()));
        n.iter().all(|x| x.is_finite()) && (1e-15..1e15).contains(&size)
    };
    let wrong: Vec<bool> = mesh.normals.iter().map(|n| !usable(n)).collect();
    let count = wrong.iter().filter(|w| **w).count();
    if count == 0 {
        return 0;
    }
    let mut around = vec![DVec3::ZERO; mesh.normals.len()];
    for corners in &mesh.triangles {
        if corners.iter().any(|v| wrong[*v as usize]) {
            let [a, b, c] = corners.map(|v| DVec3::from_array(mesh.positions[v as usize]));
            let area = (b - a).cross(c - a);
            if area.is_finite() {
                for v in corners {
                    around[*v as usize] += area;
                }
            }
        }
    }
    for ((normal, wrong), around) in mesh.normals.iter_mut().zip(&wrong).zip(&around) {
        if *wrong {
            // No triangle around this vertex has area, so no ray hits one: any unit vector
            // will do.
            *normal = unit(*around).unwrap_or(DVec3::Z).as_vec3().to_array();
        }
    }
    count
}

/// Normalises `v` without overflow or underflow; `None` if it is zero or not finite.
pub fn unit(v: DVec3) -> Option<DVec3> {
    let size = v.abs().max_element();
    (size > 0.0 && size.is_finite()).then(|| (v / size).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_vertices_go_and_order_stays() {
        let mut mesh = MeshData {
            positions: (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            normals: (0..6).map(|i| [i as f32, 1.0, 0.0]).collect(),
            triangles: vec![[5, 1, 3], [3, 1, 5]],
            ..MeshData::default()
        };
        compact(&mut mesh);
        assert_eq!(
            mesh.positions.iter().map(|p| p[0]).collect::<Vec<_>>(),
            [1.0, 3.0, 5.0]
        );
        assert_eq!(
            mesh.normals.iter().map(|n| n[0]).collect::<Vec<_>>(),
            [1.0, 3.0, 5.0]
        );
        assert_eq!(mesh.triangles, [[2, 0, 1], [1, 0, 2]]);
    }

    #[test]
    fn unusable_normals_are_made_from_the_triangles_around() {
        let mut mesh = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [9.0; 3]],
            normals: vec![[0.0; 3], [f32::NAN, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0; 3]],
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        };
        assert_eq!(repair_normals(&mut mesh), 3);
        let z = [0.0, 0.0, 1.0];
        assert_eq!(mesh.normals, [z, z, [0.0, 3.0, 0.0], z]);
    }
}
