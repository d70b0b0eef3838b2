//! `lanecast render --ground`: puts a plane under the scene's box, on which its things stand.

use super::error::CliError;
use super::scene::pick_camera;
use glam::DVec3;
use lanecast_io::LoadError;
use lanecast_model::geom::HalfSpace;
use lanecast_model::scene::{
    Edge, Instances, Lighting, Material, Model, Scene, SceneBuilder, Shape, ShapeId, framed_bounds,
    shape_bounds,
};
use lanecast_numerics::math::Aabb;
use lanecast_picture::render::{Backdrop, Ground, Integrator, RenderConfig, ground_albedo};
use lanecast_picture::tracer::{RayBatch, Tracer, TracerOptions};
use std::path::Path;
use std::sync::OnceLock;

/// Rays along each side of the box that look for the lowest points of curved things.
const PROBES: u32 = 512;

/// The ground lies lower than the lowest point by this part of the box's size, so that no face
/// lies in it.
const GAP: f64 = 1.0 / 65_536.0;

/// Returns the scene on its ground, and the configuration that knows of it.
pub fn stand(
    scene: Scene,
    path: &Path,
    config: RenderConfig,
) -> Result<(Scene, RenderConfig), CliError> {
    stand_at(scene, path, config, &OnceLock::new())
}

/// Does the same with the height of the lowest point, which is found if it is not known.
pub fn stand_at(
    scene: Scene,
    path: &Path,
    config: RenderConfig,
    known: &OnceLock<f64>,
) -> Result<(Scene, RenderConfig), CliError> {
    let refused = |why: &str| Err(CliError::Usage(format!("--ground {why}")));
    if !matches!(config.integrator, Integrator::Path | Integrator::Ao) {
        return refused("is seen by the light of paths; ask for --integrator path or ao");
    }
    if config.backdrop == Backdrop::Transparent {
        return refused(
            "would hide what a transparent picture is laid over; leave out --background \
             transparent, or --ground",
        );
    }
    let of_scene = |source| LoadError::of_scene(path, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let counts = instances.of_shapes(&scene);
    let unbounded = |(row, count): (u32, &u64)| {
        let id = ShapeId(row);
        (*count > 0 && shape_bounds(&scene, id).is_none()).then(|| scene.shapes.names.label(row))
    };
    if let Some(name) = (0..).zip(&counts).find_map(unbounded) {
        return refused(&format!(
            "lies under the box of all things, and shape {name} has no bounds; leave out --ground"
        ));
    }
    let bounds = match framed_bounds(&scene, &instances) {
        Some(bounds) if bounds.max_abs() < 1e100 && bounds.diagonal() > 0.0 => bounds,
        _ => return refused("needs a scene with an extent"),
    };
    let only_meshes = (scene.shapes.rows.iter().zip(&counts))
        .all(|(shape, count)| *count == 0 || matches!(shape, Shape::Mesh(_)));
    let lowest = match (known.get(), only_meshes) {
        (Some(height), _) => *height,
        (None, true) => bounds.min.y,
        (None, false) => lowest_point(&scene, &bounds)?,
    };
    let lowest = *known.get_or_init(|| lowest);
    let row = pick_camera(&scene.cameras, config.camera.as_deref())?;
    let lighting = Lighting::Studio;
    let (completed, camera) =
        (scene.clone()).completed_in(lighting, row, &instances, config.aspect());
    let albedo = ground_albedo(&completed, &camera, config.backdrop);
    let mut builder = SceneBuilder::from(scene);
    let material = builder.material("", matte(albedo));
    let plane = HalfSpace {
        normal: DVec3::Y,
        offset: lowest - bounds.diagonal() * GAP,
    };
    let plane = builder.half_space("", plane);
    builder.instance("ground", Edge::shape(plane).material(material));
    let ground = Ground {
        material,
        center: bounds.center(),
        radius: bounds.diagonal() / 2.0,
    };
    Ok((
        builder.finish().map_err(of_scene)?,
        RenderConfig {
            ground: Some(ground),
            ..config
        },
    ))
}

/// Finds the height of the lowest point by rays from below: boxes of turned and combined solids
/// are wider than these. What the rays miss sinks in.
fn lowest_point(scene: &Scene, bounds: &Aabb) -> Result<f64, CliError> {
    let tracer = Tracer::new(scene, &TracerOptions::default())
        .map_err(|e| CliError::Usage(e.to_string()))?;
    let (from, size) = (bounds.min.y - bounds.diagonal(), bounds.max - bounds.min);
    let mut rays = RayBatch::default();
    for i in 0..PROBES * PROBES {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(PROBES);
        let (x, z) = (at(i % PROBES), at(i / PROBES));
        let org = DVec3::new(bounds.min.x + size.x * x, from, bounds.min.z + size.z * z);
        rays.push(org, DVec3::Y);
    }
    let hits = tracer.closest(&rays);
    let heights = (0..rays.len()).filter_map(|row| hits.get(row).map(|hit| from + hit.t));
    let lowest = heights.fold(f64::INFINITY, f64::min);
    Ok(match lowest.is_finite() {
        true => lowest.max(bounds.min.y),
        false => bounds.min.y,
    })
}

/// The material of the ground, of Lambert's law.
fn matte(albedo: [f32; 3]) -> Material {
    Material {
        base_color: albedo,
        model: Model::Phong {
            diffuse: albedo,
            specular: [0.0; 3],
            exponent: 1.0,
            mirror: [0.0; 3],
        },
        ..Material::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use lanecast_model::geom::{Cuboid, Sphere};
    use lanecast_model::scene::Camera;
    use lanecast_numerics::math::Affine;

    /// A box on one of its corners, which its own box does not show, and a camera near the
    /// ground, so that the horizon is in the picture.
    fn scene() -> Scene {
        let mut scene = SceneBuilder::default();
        let cuboid = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::splat(-1.0),
                max: DVec3::splat(1.0),
            },
        );
        let ball = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.0,
            },
        );
        let turned: Affine = DAffine3::from_rotation_z(0.7).into();
        let turned = scene.transform(turned);
        let aside = scene.transform(DAffine3::from_translation(DVec3::new(0.0, 1.0, -9.0)).into());
        scene.instance("", Edge::shape(ball).transform(turned));
        scene.instance("", Edge::shape(cuboid).transform(aside));
        scene.camera(
            "",
            Camera::perspective(DVec3::new(0.0, 0.2, 6.0), DVec3::ZERO, DVec3::Y, 40.0),
        );
        scene.finish().unwrap()
    }

    fn config() -> RenderConfig {
        RenderConfig {
            width: 48,
            height: 32,
            spp: 64,
            integrator: Integrator::Path,
            max_depth: 4,
            ..RenderConfig::default()
        }
    }

    fn on_ground(scene: Scene, config: RenderConfig) -> Result<(Scene, RenderConfig), String> {
        stand(scene, Path::new("x"), config).map_err(|e| e.to_string())
    }

    #[test]
    fn things_stand_on_the_ground() {
        let (scene, _) = on_ground(scene(), config()).unwrap();
        let plane = scene.half_spaces.row(lanecast_model::scene::HalfSpaceId(0));
        assert_eq!(plane.normal, DVec3::Y);
        // The ball's own box, turned, would end at -1.41.
        assert!((plane.offset + 1.0).abs() < 1e-3, "{}", plane.offset);
        assert!(plane.offset < -1.0);
        // The same scene again is refused, for the ground has no bounds.
        let said = on_ground(scene, config()).unwrap_err();
        assert!(said.contains("has no bounds"), "{said}");
    }

    #[test]
    fn the_studio_shows_no_horizon_and_things_throw_shadows() {
        let (scene, config) = on_ground(scene(), config()).unwrap();
        let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
        let picture = tracer.render(&config, &Default::default(), &|_| ());
        let color = picture.unwrap().color;
        // The left edge of the picture, from the backdrop above to the ground below.
        let edge: Vec<f32> = (0..32).map(|y| color[y * 48][0]).collect();
        assert_eq!(edge[0], color[47][0]);
        for (y, shown) in edge.iter().enumerate() {
            assert!((shown / edge[0] - 1.0).abs() < 0.08, "{y}: {edge:?}");
        }
        // Where the ball touches the ground.
        let under = color[23 * 48 + 24][0];
        assert!(under < 0.85 * edge[0], "{under} {}", edge[0]);
    }

    #[test]
    fn what_would_show_no_ground_is_refused() {
        for (config, says) in [
            (
                RenderConfig {
                    integrator: Integrator::Direct,
                    ..config()
                },
                "ask for --integrator path",
            ),
            (
                RenderConfig {
                    backdrop: Backdrop::Transparent,
                    ..config()
                },
                "leave out --background transparent",
            ),
        ] {
            let said = on_ground(scene(), config).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
    }
}
