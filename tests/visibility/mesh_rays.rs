//! Published hits of 128 rays on each of 15 meshes, found by others by brute force in f64
//! (assets/README.md), through the importer and packets.

use crate::common::{Loaded, RayColumns, assets, load};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::plan::{Kernels, Precision};
use lanecast::internals::trace::HitId;
use serde_json::Value;

struct Row {
    org: DVec3,
    dir: [f32; 3],
    /// t and triangle.
    hit: Option<(f64, u32)>,
}

/// The rays that come near no edge. Their numbers are f32's; the parser may be
/// off by a bit of f64.
fn rows(of_mesh: &Value) -> Vec<Row> {
    let numbers = |v: &Value| -> [f32; 3] {
        std::array::from_fn(|k| {
            let number = v[k].as_f64().unwrap();
            assert!((f64::from(number as f32) - number).abs() <= 1e-15 * number.abs());
            number as f32
        })
    };
    let rows = of_mesh.as_array().unwrap().iter();
    rows.filter(|row| row["near_edge_count"] == 0)
        .map(|row| Row {
            org: DVec3::from_array(numbers(&row["o"]).map(f64::from)),
            dir: numbers(&row["d"]),
            hit: row["t"]
                .as_f64()
                .map(|t| (t, row["tri"].as_u64().unwrap() as u32)),
        })
        .collect()
}

/// Two triangles in one plane: which of them is nearer is left to rounding, in
/// the published answers as in ours.
fn coplanar(loaded: &Loaded, row: &Row, ours: u32, theirs: u32) -> bool {
    let mesh = loaded
        .scene
        .meshes
        .row(lanecast::internals::scene::MeshId(0));
    let corners = |i: u32| {
        mesh.corners(i as usize)
            .map(|c| DVec3::from_array(c.map(f64::from)))
    };
    let ([a, b, c], [d, e, f]) = (corners(ours), corners(theirs));
    let normal = (b - a).cross(c - a).normalize();
    let size = (b - a).length() + row.org.length();
    [d, e, f]
        .iter()
        .all(|p| (*p - a).dot(normal).abs() <= 1e-15 * size)
}

#[test]
fn published_mesh_hits_through_packets() {
    let Some(assets) = assets() else { return };
    let text = std::fs::read(assets.join("meshes_ray_hits.json")).unwrap();
    let published: Value = serde_json::from_slice(&text).unwrap();
    let (mut rays, mut hits, mut wrong_fast) = (0, 0, 0);
    let (mut ties, mut later) = (0, 0);
    // Largest relative errors of t: [vertices as in the file, rounded ones].
    let (mut worst, mut worst_fast) = ([0.0, 0.0], 0.0_f64);
    let mut meshes = [0, 0];
    for (file, of_mesh) in published["rays"].as_object().unwrap() {
        let rows = rows(of_mesh);
        let loaded = load(&assets.join("meshes").join(file), 1.0);
        // One mesh, in place: its triangles are the file's.
        assert_eq!(loaded.instances.count(), 1, "{file}");
        assert!(loaded.instances.rows[0].object_from_world.is_identity());
        let table = &loaded.scene.meshes;
        let moved = table.rounded[0] != 0 || table.center[0] != DVec3::ZERO;
        meshes[usize::from(moved)] += 1;
        let mut columns = RayColumns::default();
        for row in &rows {
            columns.push(row.org, row.dir);
        }
        let trace = |world: &World, kernels: Kernels| columns.closest(world, &kernels);
        let worlds = [Structure::Bvh, Structure::Linear].map(|s| loaded.world(s));
        let exact = loaded.kernels(Precision::Exact);
        let answers = trace(&worlds[0], exact);
        let single = Kernels { lanes: 1, ..exact };
        for other in [
            trace(&worlds[1], exact),
            trace(&worlds[0], single),
            trace(&worlds[1], single),
        ] {
            assert_eq!(met(&answers), met(&other), "{file}");
        }
        for (i, (row, (t, id))) in rows.iter().zip(&answers).enumerate() {
            rays += 1;
            let Some((expected, triangle)) = row.hit else {
                assert_eq!(*id, HitId::NONE, "{file} {i}");
                continue;
            };
            hits += 1;
            let error = (t - expected).abs() / expected;
            worst[usize::from(moved)] = f64::max(worst[usize::from(moved)], error);
            assert!(
                error <= if moved { 1e-6 } else { 1e-12 },
                "{file} {i}: {t} {expected}"
            );
            if id.primitive != triangle {
                assert!(
                    coplanar(&loaded, row, id.primitive, triangle),
                    "{file} {i}: {id:?}, expected {triangle}"
                );
                ties += 1;
                later += u32::from(id.primitive > triangle);
            }
        }
        let fast = trace(&worlds[0], loaded.kernels(Precision::Fast));
        for ((t, id), (fast_t, fast_id)) in answers.iter().zip(&fast) {
            wrong_fast += u32::from(id != fast_id);
            if id == fast_id && *id != HitId::NONE {
                worst_fast = worst_fast.max((fast_t - t).abs() / t);
            }
        }
    }
    println!(
        "{rays} rays, {hits} hits, {ties} name another of two coplanar triangles \
         ({later} the later one); \
         worst relative error of t: {:.2e} ({} meshes as in the file), {:.2e} ({} rounded)",
        worst[0], meshes[0], worst[1], meshes[1]
    );
    println!("fast: {wrong_fast} other triangles, worst relative error of t {worst_fast:.2e}");
    assert!(rays == 15 * 128 && hits > rays / 3 && ties < rays / 10);
}

/// Answers without the t of rays that meet nothing.
fn met(answers: &[(f64, HitId)]) -> Vec<Option<(f64, HitId)>> {
    let hit = |a: &(f64, HitId)| (a.1 != HitId::NONE).then_some(*a);
    answers.iter().map(hit).collect()
}
