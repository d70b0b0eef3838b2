//! Barycentric coordinates of hits.

use crate::accel::World;
use crate::scene::Shape;
use crate::trace::HitId;
use glam::DVec3;

/// Computes the barycentric coordinates of a triangle's second and third corner where a ray
/// meets it, from the edge functions e₁/D and e₂/D (docs/SPEC.md, S15) in f64. Returns `None`
/// for a shape that is no mesh.
pub fn barycentrics(world: &World, org: DVec3, dir: DVec3, id: HitId) -> Option<[f64; 2]> {
    let entry = world.entry_of(id.instance);
    let Shape::Mesh(mesh) = entry.shape else {
        return None;
    };
    let map = world.object_from_world(id.instance);
    let center = world.scene.meshes.center[mesh.index()];
    let org = DVec3::from_array(map.point(org.to_array())) - center;
    let dir = DVec3::from_array(map.vector(dir.to_array()));
    let corners = world.scene.meshes.row(mesh).corners(id.primitive as usize);
    let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)) - org);
    let edges = [b.cross(c), c.cross(a), a.cross(b)].map(|n| dir.dot(n));
    let sum: f64 = edges.iter().sum();
    match sum {
        0.0 => Some([0.0; 2]),
        _ => Some([edges[1] / sum, edges[2] / sum]),
    }
}
