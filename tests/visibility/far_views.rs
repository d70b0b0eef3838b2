//! Narrow views from far: rays whose directions differ by less than f32 can tell, and hits whose
//! t f32 has no digits for. `.ci/far_views` makes a table of more of them.

use crate::common::{assets, load};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cone, Cuboid, Sphere};
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::render::{Grid, RayGenerator};
use lanecast::internals::scene::{
    Camera, Edge, Instances, MeshData, Operator, Scene, SceneBuilder,
};
use lanecast::internals::shade::Surface;
use lanecast::internals::trace::{HitId, TURNED};
use lanecast::{Hit, RayBatch, Tracer, TracerOptions};

const SIDE: u32 = 24;

/// Compares a view's hits and normals with the reference's. Returns how many hits there are.
fn compare(scene: &Scene, camera: Camera, what: &str) -> usize {
    let instances = Instances::of(scene).unwrap();
    let world = World::build(scene, &instances, Structure::Bvh);
    let reference = Reference::new(scene, &instances).unwrap();
    let generator = RayGenerator::new(camera, SIDE, SIDE, Grid::Centers);
    let mut rays = RayBatch::default();
    for pixel in 0..SIDE * SIDE {
        let (org, dir) = generator.ray(pixel % SIDE, pixel / SIDE, [0.5; 2]);
        rays.push(org, dir);
    }
    let hits = Tracer::new(scene, &TracerOptions::default())
        .unwrap()
        .closest(&rays);
    let mut count = 0;
    for row in 0..rays.len() {
        let (org, dir) = rays.ray(row);
        let (org, dir) = (org.to_array(), dir.to_array());
        let (ours, truth) = (hits.get(row), reference.nearest(org, dir, f64::INFINITY));
        // The engine's number of a surface says whether it is turned, too.
        let numbered = |hit: &Hit| match hit.turned {
            true => hit.primitive | TURNED,
            false => hit.primitive,
        };
        assert_eq!(
            ours.map(|hit| (hit.instance, numbered(&hit))),
            truth.as_ref().map(|hit| (hit.instance, hit.primitive)),
            "{what}, pixel {row}"
        );
        let (Some(ours), Some(truth)) = (ours, truth) else {
            continue;
        };
        count += 1;
        let id = HitId {
            instance: ours.instance,
            primitive: numbered(&ours),
        };
        for precision in [Precision::Guarded, Precision::Exact] {
            let surface = Surface::at(&world, precision, org, dir, ours.t, id);
            let truth = DVec3::from_array(truth.normal).normalize();
            let angle = surface.ng.cross(truth).length().asin().to_degrees();
            assert!(angle < 0.02, "{what}, pixel {row}: {angle} degrees off");
        }
    }
    count
}

fn shapes() -> [Scene; 5] {
    let sphere = |center, radius| Sphere { center, radius };
    let cuboid = Cuboid {
        min: DVec3::new(-0.6, -0.5, -0.6),
        max: DVec3::new(0.6, 0.5, 0.6),
    };
    [0, 1, 2, 3, 4].map(|kind| {
        let mut scene = SceneBuilder::default();
        let shape = match kind {
            0 => scene.sphere("", sphere(DVec3::ZERO, 1.0)),
            1 => scene.cuboid("", cuboid),
            2 => scene.cone(
                "",
                Cone {
                    base: DVec3::new(0.0, -0.8, 0.0),
                    top: DVec3::new(0.0, 0.9, 0.0),
                    base_radius: 0.8,
                    top_radius: 0.1,
                    open: false,
                },
            ),
            3 => {
                let whole = scene.cuboid("", cuboid);
                let bite = scene.sphere("", sphere(DVec3::splat(0.3), 0.5));
                scene.csg(
                    "",
                    Operator::Difference,
                    &[whole, bite].map(lanecast::internals::scene::Operand::shape),
                )
            }
            _ => {
                let corner =
                    |k: usize, side: f64| std::array::from_fn(|i| if i == k { side } else { 0.0 });
                let positions = (0..6).map(|i| corner(i / 2, [1.0, -1.0][i % 2])).collect();
                let triangles = vec![
                    [0, 2, 4],
                    [2, 1, 4],
                    [1, 3, 4],
                    [3, 0, 4],
                    [2, 0, 5],
                    [1, 2, 5],
                    [3, 1, 5],
                    [0, 3, 5],
                ];
                scene.mesh(
                    "",
                    &MeshData {
                        positions,
                        triangles,
                        ..MeshData::default()
                    },
                )
            }
        };
        scene.instance("", Edge::shape(shape));
        scene.finish().unwrap()
    })
}

#[test]
fn narrow_views_from_far_are_those_of_the_reference() {
    for (kind, scene) in shapes().iter().enumerate() {
        for exponent in [0, 3, 6, 8, 10, 12] {
            let distance = 3.0 * libm::exp10(f64::from(exponent));
            let eye = DVec3::new(0.48, 0.6, 0.64) * distance;
            let fov = 2.0 * libm::atan2(1.3, distance).to_degrees();
            let near = Camera::perspective(eye, DVec3::ZERO, DVec3::Y, fov);
            let level = Camera::orthographic(eye, DVec3::ZERO, DVec3::Y, 2.6);
            for (camera, lens) in [(near, "perspective"), (level, "orthographic")] {
                let what = format!("shape {kind} from 10^{exponent}, {lens}");
                let hits = compare(scene, camera, &what);
                assert!(hits > 80, "{what}: {hits} hits");
            }
        }
    }
}

#[test]
fn reported_views_from_far_are_those_of_the_reference() {
    let Some(assets) = assets() else { return };
    for file in [
        "26-mitsuba3-61-long-rays/s2.toml",
        "26-mitsuba3-61-long-rays/s6.toml",
        "27-mitsuba3-512-far-ortho/s6.toml",
        "27-mitsuba3-512-far-ortho/s7.toml",
    ] {
        let loaded = load(&assets.join("found").join(file), 1.0);
        let hits = compare(&loaded.scene, loaded.camera, file);
        assert!(hits > 80, "{file}: {hits} hits");
    }
}
