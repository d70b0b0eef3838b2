//! Trees of high quality cost less and render the same picture; and the generated meshes that
//! measure them.

use super::check::{build, build_high};
use crate::common::{ALL_AOVS, hash};
use glam::DVec3;
use lanecast::internals::accel::{BuildQuality, Structure, World};
use lanecast::internals::measure::generate::{Generated, building, needles};
use lanecast::internals::plan::{Kernels, Precision};
use lanecast::internals::render::{Progress, RenderConfig, View, render};
use lanecast::internals::scene::{
    Camera, Edge, Falloff, Instances, Light, MeshData, Meshes, SceneBuilder,
};

fn generated(mesh: Generated, triangles: u64) -> MeshData {
    let set = mesh.mesh(triangles);
    MeshData {
        positions: set.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: set.triangles,
        ..MeshData::default()
    }
}

#[test]
fn subtrees_move_where_that_pays() {
    let mut meshes = Meshes::default();
    meshes.push(&generated(Generated::Building, 50_000));
    let [medium, high] = [build(&meshes), build_high(&meshes)];
    let [a, b] = [&medium, &high].map(|tree| tree.tree.sah);
    assert!(b < 0.99 * a, "{a} {b}");
    // Blocks are as full as before.
    let [a, b] = [&medium, &high].map(|tree| tree.blocks.len());
    assert!(b as f64 <= 1.01 * a as f64, "{a} {b}");
}

/// What is met, and every bit of it, does not depend on where subtrees stand.
#[test]
fn qualities_show_the_same_picture() {
    let mut scene = SceneBuilder::default();
    for (i, mesh) in Generated::ALL.into_iter().enumerate() {
        let mesh = scene.mesh("", &generated(mesh, 8000));
        for k in 0..8 {
            let map = glam::DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.3),
                glam::DQuat::from_rotation_x(f64::from(k)),
                DVec3::new(
                    i as f64 - 1.0,
                    f64::from(k % 3) * 0.6 - 0.6,
                    f64::from(k) * -0.2,
                ),
            );
            let transform = scene.transform(map.into());
            scene.instance("", Edge::shape(mesh).transform(transform));
        }
    }
    let eye = DVec3::new(0.2, 0.5, 4.0);
    let camera = Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 40.0);
    scene.camera("", camera);
    scene.light(Light::Point {
        position: DVec3::new(3.0, 4.0, 5.0),
        intensity: [60.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    let scene = scene.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    let of = |quality, structure| {
        let world = World::build_to(quality, &scene, &instances, structure);
        let view = View {
            world: &world,
            kernels: Kernels {
                precision: Precision::Exact,
                lanes: 1,
            },
            camera,
            lights: &scene.lights,
        };
        let config = RenderConfig {
            width: 160,
            height: 120,
            aovs: ALL_AOVS,
            ..RenderConfig::default()
        };
        let rendered = render(&view, &config, false, &Progress::default()).unwrap();
        assert!(rendered.counts.primary_hits > 3000);
        let meshes = world.accelerator.blas_figures();
        let cost: f64 = meshes.iter().map(|mesh| mesh.sah).sum();
        (hash(&rendered), cost)
    };
    let medium = of(BuildQuality::Medium, Structure::Bvh);
    for structure in [Structure::Bvh, Structure::Nested, Structure::ItemBuffer] {
        let high = of(BuildQuality::High, structure);
        assert_eq!(high.0, medium.0, "{structure:?}");
        // And it was another tree.
        assert!(high.1 < medium.1, "{structure:?}: {} {}", high.1, medium.1);
    }
}

#[test]
fn generated_meshes_are_as_large_as_was_asked_for() {
    for mesh in Generated::ALL {
        for asked in [20_000, 300_000] {
            let set = mesh.mesh(asked);
            let made = set.triangles.len() as f64;
            assert!((made / asked as f64 - 1.0).abs() < 0.05, "{mesh:?}: {made}");
            let inside = |p: &[f32; 3]| p.iter().all(|x| x.abs() < 1.2);
            assert!(set.positions.iter().all(inside), "{mesh:?}");
        }
    }
    // Never none, however few are asked for.
    assert!(!building(0).triangles.is_empty());
    assert_eq!(needles(5).triangles.len(), 5);
}
