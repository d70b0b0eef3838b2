//! The centre of a mesh, and how f32 vertices are kept about it.

use super::*;
use crate::common::property;
use proptest::prelude::*;

fn center_of(positions: Vec<[f64; 3]>) -> (Meshes, DVec3) {
    let mut meshes = Meshes::default();
    meshes.push(&MeshData {
        positions,
        ..MeshData::default()
    });
    let center = meshes.center[0];
    (meshes, center)
}

#[test]
fn the_centre_of_a_far_mesh() {
    // Far in x alone: the other axes stay about 0, where f32 is dense.
    let (meshes, center) = center_of(vec![
        [1000.0, f64::from(0.1_f32), f64::from(1e-30_f32)],
        [1001.0, f64::from(0.9_f32), f64::from(0.7_f32)],
    ]);
    assert!(
        center.x != 0.0 && center.y == 0.0 && center.z == 0.0,
        "{center}"
    );
    assert_eq!(meshes.rounded[0], 0);
    // f64 coordinates of a city: kept to a part in 2^24 of its size, not of its
    // distance.
    let (meshes, center) = center_of(vec![[4.5e6 + 0.123, 1.0, 2.0], [4.5e6 + 9.876, 3.0, 4.0]]);
    assert_eq!(meshes.rounded[0], 2);
    let x = f64::from(meshes.positions[0][0]) + center.x;
    assert!((x - (4.5e6 + 0.123)).abs() < 1e-6, "{x}");
    // Near: about 0.
    assert_eq!(
        center_of(vec![[7.0, 0.0, 0.0], [8.0, 0.0, 0.0]]).1,
        DVec3::ZERO
    );
    // One point, and a sheet whose size is nothing beside its distance.
    assert_eq!(center_of(vec![[9.0, 9.0, 9.0]]).1, DVec3::ZERO);
    let (meshes, center) = center_of(vec![[1e10, 0.0, 0.0], [1e10, 1e-300, 0.0]]);
    assert_eq!(f64::from(meshes.positions[0][0]) + center.x, 1e10);
}

proptest! {
    #![proptest_config(property(20_000))]

    /// What was f32 stays exact, wherever the mesh lies.
    #[test]
    fn f32_vertices_are_never_rounded(
        at in prop::array::uniform3(-1e9..1e9_f32),
        near in prop::array::uniform3(0..3_u8),
        size in -20..20_i32,
        corners in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), 1..6),
    ) {
        let size = f32::powi(2.0, size);
        let positions: Vec<[f64; 3]> = corners
            .iter()
            .map(|c| std::array::from_fn(|k| {
                f64::from(c[k] * size + if near[k] == 0 { 0.0 } else { at[k] / 1e3_f32.powi(near[k].into()) })
            }))
            .collect();
        let (meshes, center) = center_of(positions.clone());
        prop_assert_eq!(meshes.rounded[0], 0, "centre {}", center);
        for (kept, given) in meshes.positions.iter().zip(&positions) {
            let kept: [f64; 3] = std::array::from_fn(|k| f64::from(kept[k]) + center[k]);
            prop_assert_eq!(&kept, given);
        }
    }
}
