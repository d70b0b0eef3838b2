//! A small scene, and the rows that a tracer without a fault records of it.

use glam::DVec3;
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::measure::verify::View;
use lanecast::internals::reference::{Grid, Reference, camera_ray, shadow};
use lanecast::internals::scene::*;
use lanecast::internals::trace::{Outcome, RayKind, TracedRay};

pub const SIZE: [u32; 2] = [48, 32];

/// A ball over a box, a square of two triangles behind them, and two lights.
pub fn scene() -> Scene {
    let mut b = SceneBuilder::default();
    let shapes = [
        b.sphere(
            "",
            Sphere {
                center: DVec3::new(0.0, 1.5, 0.0),
                radius: 1.0,
            },
        ),
        b.cuboid(
            "",
            Cuboid {
                min: DVec3::new(-2.0, -1.0, -2.0),
                max: DVec3::new(2.0, 0.0, 2.0),
            },
        ),
        b.mesh(
            "",
            &MeshData {
                positions: vec![
                    [-6.0, -3.0, -4.0],
                    [6.0, -3.0, -4.0],
                    [6.0, 3.0, -4.0],
                    [-6.0, 3.0, -4.0],
                ],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..MeshData::default()
            },
        ),
    ];
    for shape in shapes {
        b.instance("", Edge::shape(shape));
    }
    b.light(Light::Point {
        position: DVec3::new(3.0, 5.0, 4.0),
        intensity: [10.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    b.light(Light::Directional {
        direction: DVec3::new(1.0, -1.0, -0.5),
        irradiance: [1.0; 3],
        angle: 0.0,
    });
    b.camera(
        "",
        Camera::perspective(DVec3::new(0.7, 2.0, 9.0), DVec3::Y, DVec3::Y, 45.0),
    );
    b.finish().expect("the test's own scene is sound")
}

pub fn view(scene: &Scene) -> View<'_> {
    View {
        camera: &scene.cameras.rows[0],
        size: SIZE,
        grid: Grid::Centers,
    }
}

/// The rows of a fast path without a fault: camera rays and shadow rays, answered by the
/// reference.
pub fn rows(reference: &Reference) -> Vec<TracedRay> {
    let scene = reference.scene();
    let mut rows = Vec::new();
    for pixel in 0..SIZE[0] * SIZE[1] {
        let at = [pixel % SIZE[0], pixel / SIZE[0]];
        let ray = camera_ray(&scene.cameras.rows[0], SIZE, Grid::Centers, at);
        let dir = ray.dir.map(f64::from);
        let hit = reference.nearest(ray.org, dir, f64::INFINITY);
        let row = TracedRay {
            kind: RayKind::Primary,
            pixel,
            sample: 0,
            depth: 0,
            org: ray.org,
            dir: ray.dir,
            t_max: f32::INFINITY,
            outcome: hit.map_or(Outcome::Miss, |h| Outcome::Hit {
                t: h.t,
                instance: h.instance,
                primitive: h.primitive,
                normal: h.normal,
            }),
        };
        rows.push(row);
        let Some(hit) = hit else { continue };
        for (light, l) in scene.lights.iter().enumerate() {
            let own = shadow(reference, ray.org, dir, &hit, l);
            // From the light's side, as some fast paths do; the start is just
            // off the surface.
            let p = DVec3::from_array(ray.org) + DVec3::from_array(dir) * hit.t;
            let n = DVec3::from_array(hit.normal);
            let p = p + n * 1e-9 * -n.dot(DVec3::from_array(dir)).signum();
            let (to, t_max) = match l {
                Light::Point { position, .. }
                | Light::Spot { position, .. }
                | Light::Rectangle {
                    center: position, ..
                }
                | Light::Disc {
                    center: position, ..
                } => (*position - p, 1.0),
                Light::Directional { direction, .. } => (-*direction, f32::INFINITY),
            };
            rows.push(TracedRay {
                kind: RayKind::Shadow {
                    light: light as u32,
                },
                org: p.to_array(),
                dir: to.to_array(),
                t_max,
                outcome: if own.blocked {
                    Outcome::Blocked
                } else {
                    Outcome::Clear
                },
                ..row
            });
        }
    }
    rows
}

/// Runs `test` with the reference of the scene and its rows.
pub fn with<T>(test: impl FnOnce(&Reference, Vec<TracedRay>) -> T) -> T {
    let scene = scene();
    let instances = Instances::of(&scene).expect("small");
    let reference = Reference::new(&scene, &instances).unwrap();
    let rows = rows(&reference);
    test(&reference, rows)
}
