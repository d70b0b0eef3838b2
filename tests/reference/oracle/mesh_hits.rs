//! Published hits of 128 rays on each of 15 meshes (assets/README.md), found by others by
//! brute force in f64.
//!
//! The files are plain GLBs (one JSON chunk, one BIN chunk, float positions, short or long
//! indices), so this file reads them itself, without the importer.

use super::*;
use crate::common::assets;
use serde_json::Value;

/// All primitives of the first mesh, one after the other.
fn mesh_of(glb: &[u8]) -> MeshData {
    let long = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&glb[20..20 + long(12)]).unwrap();
    let bin = &glb[20 + long(12) + 8..];
    let bytes = |accessor: &Value| {
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let part = |of: &Value, key: &str| of[key].as_u64().unwrap_or(0) as usize;
        let first = part(view, "byteOffset") + part(accessor, "byteOffset");
        (
            &bin[first..first + part(view, "byteLength")],
            part(accessor, "componentType"),
            part(accessor, "count"),
        )
    };
    let mut data = MeshData::default();
    for primitive in json["meshes"][0]["primitives"].as_array().unwrap() {
        let base = data.positions.len() as u32;
        let (positions, _, count) = bytes(&primitive["attributes"]["POSITION"]);
        let float = |i: usize| {
            f64::from(f32::from_le_bytes(
                positions[4 * i..4 * i + 4].try_into().unwrap(),
            ))
        };
        data.positions
            .extend((0..count).map(|i| [float(3 * i), float(3 * i + 1), float(3 * i + 2)]));
        let (indices, kind, count) = bytes(&primitive["indices"]);
        let index = |i: usize| {
            base + match kind {
                5123 => u32::from(u16::from_le_bytes(
                    indices[2 * i..2 * i + 2].try_into().unwrap(),
                )),
                _ => u32::from_le_bytes(indices[4 * i..4 * i + 4].try_into().unwrap()),
            }
        };
        data.triangles
            .extend((0..count / 3).map(|i| [index(3 * i), index(3 * i + 1), index(3 * i + 2)]));
    }
    data
}

#[test]
fn published_mesh_hits() {
    let Some(assets) = assets() else { return };
    let hits = std::fs::read(assets.join("meshes_ray_hits.json")).unwrap();
    let hits: Value = serde_json::from_slice(&hits).unwrap();
    let numbers = |v: &Value| -> [f64; 3] { std::array::from_fn(|k| v[k].as_f64().unwrap()) };
    let (mut rays, mut met, mut tied, mut worst) = (0, 0, 0, 0.0);
    for (file, rows) in hits["rays"].as_object().unwrap() {
        let glb = std::fs::read(assets.join("meshes").join(file)).unwrap();
        let data = mesh_of(&glb);
        let (scene, all) = scene_of(|b| place(b, |b| b.mesh("", &data)));
        assert_eq!(scene.meshes.rounded[0], 0, "{file}: vertices are f32");
        let tree = Reference::new(&scene, &all).unwrap();
        let brute = Reference::brute_force(&scene, &all).unwrap();
        for (i, row) in rows.as_array().unwrap().iter().enumerate() {
            let (org, dir) = (numbers(&row["o"]), numbers(&row["d"]));
            let answer = tree.nearest(org, dir, INF);
            // Brute force takes its time: a sample is enough.
            if i % 8 == 0 {
                assert_eq!(answer, brute.nearest(org, dir, INF), "{file} {i}");
            }
            if row["near_edge_count"] != 0 {
                continue;
            }
            rays += 1;
            let Some(hit) = answer else {
                assert_eq!(row["hits"], 0, "{file} {i}");
                continue;
            };
            met += 1;
            if row["tri"] != hit.primitive {
                // Faces that coincide (the Cornell box's floor, the subdivided
                // cube): exactly a tie, which the published hits decided by
                // rounding and we by the lower id.
                tied += 1;
                let published = row["tri"].as_u64().unwrap() as u32;
                let other = tree.crossings(org, dir, 0, published)[0];
                let normals = DVec3::from_array(other.normal).normalize();
                let parallel = normals.dot(DVec3::from_array(hit.normal)).abs();
                assert!(
                    published > hit.primitive && parallel > 1.0 - 1e-12,
                    "{file} {i}"
                );
            }
            let t = row["t"].as_f64().unwrap();
            let error = (hit.t - t).abs();
            worst = f64::max(worst, error / t);
            assert!(error <= 1e-12 * t, "{file} {i}: {t} {hit:?}");
            let length = DVec3::from_array(dir).length();
            let cos = -DVec3::from_array(hit.normal).dot(DVec3::from_array(dir)) / length;
            assert!(
                (cos.abs() - row["cos"].as_f64().unwrap().abs()).abs() < 1e-6,
                "{file} {i}"
            );
        }
    }
    println!("{rays} rays, {met} hits, {tied} ties; worst relative t error {worst:.2e}");
    assert!(rays == 15 * 128 && met > rays / 3 && tied < rays / 10);
}
