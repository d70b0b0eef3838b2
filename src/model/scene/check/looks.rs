//! Checks of materials, lights and cameras.

use super::numbers::{finite, finite3, require};
use crate::scene::error::{Entity, EntityKind, SceneError};
use crate::scene::{Light, Material, Model, Projection, Tables};
use glam::DVec3;

pub(super) fn materials(scene: &Tables) -> Result<(), SceneError> {
    for (i, m) in scene.materials.rows.iter().enumerate() {
        let row = i as u32;
        let label = || format!("material {}", scene.materials.names.label(row));
        let what = || Entity::new(EntityKind::Material, row, label());
        let colors = |field, c: &[f32]| {
            for v in c {
                finite(what, field, &[f64::from(*v)])?;
                require(*v >= 0.0, what, field, f64::from(*v), "0 or greater")?;
            }
            Ok(())
        };
        let fraction = |field, v: f32| {
            let ok = (0.0..=1.0).contains(&v);
            require(ok, what, field, f64::from(v), "between 0 and 1")
        };
        let Material {
            base_color,
            emission,
            transmission,
            ior,
            model,
        } = m;
        colors("base_color", base_color)?;
        colors("emission", emission)?;
        fraction("transmission", *transmission)?;
        let ok = *ior > 0.0 && ior.is_finite();
        require(
            ok,
            what,
            "ior",
            f64::from(*ior),
            "greater than 0 and finite",
        )?;
        match model {
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => {
                fraction("metallic", *metallic)?;
                fraction("roughness", *roughness)?;
            }
            Model::Phong {
                diffuse,
                specular,
                exponent,
                mirror,
            } => {
                colors("diffuse", diffuse)?;
                colors("specular", specular)?;
                colors("mirror", mirror)?;
                colors("exponent", &[*exponent])?;
            }
        }
    }
    for v in scene.background {
        let what = || Entity::new(EntityKind::Background, 0, "the background".into());
        finite(what, "colour", &[f64::from(v)])?;
        require(v >= 0.0, what, "colour", f64::from(v), "0 or greater")?;
    }
    Ok(())
}

pub(super) fn lights(scene: &Tables) -> Result<(), SceneError> {
    for (i, light) in scene.lights.iter().enumerate() {
        let what = || Entity::new(EntityKind::Light, i as u32, format!("light {i}"));
        let (name, power) = match light {
            Light::Point {
                position,
                intensity,
                ..
            } => {
                finite3(what, "position", *position)?;
                ("intensity", intensity)
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                finite3(what, "direction", *direction)?;
                if *direction == DVec3::ZERO {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: "its direction is (0, 0, 0)".into(),
                    });
                }
                ("irradiance", irradiance)
            }
        };
        for v in power {
            finite(what, name, &[f64::from(*v)])?;
            require(*v >= 0.0, what, name, f64::from(*v), "0 or greater")?;
        }
    }
    Ok(())
}

pub(super) fn cameras(scene: &Tables) -> Result<(), SceneError> {
    for (i, camera) in scene.cameras.rows.iter().enumerate() {
        let row = i as u32;
        let label = || format!("camera {}", scene.cameras.names.label(row));
        let what = || Entity::new(EntityKind::Camera, row, label());
        finite3(what, "eye", camera.eye)?;
        let axes = [camera.right, camera.up, camera.forward];
        if axes.iter().any(|a| !a.is_finite() || !a.is_normalized()) {
            return Err(SceneError::Degenerate {
                what: what(),
                why: "it looks nowhere: eye and look_at must be two different, finite points, \
                      less than 1.8e308 apart"
                    .into(),
            });
        }
        let (field, half_height, must) = match camera.projection {
            Projection::Perspective { half_height } => {
                ("fov_y", half_height, "between 0 and 180 degrees")
            }
            Projection::Orthographic { half_height } => (
                "orthographic height",
                half_height,
                "greater than 0 and finite",
            ),
        };
        let ok = half_height > 0.0 && half_height.is_finite();
        require(ok, what, field, half_height, must)?;
    }
    Ok(())
}
