//! Checks of materials, lights and cameras.

use super::numbers::{decimal, finite, finite3, require};
use crate::scene::error::{Entity, EntityKind, SceneError};
use crate::scene::{
    Calibration, Lens, Light, Material, Model, Projection, Shutter, ShutterShape, Tables,
};
use glam::DVec3;

pub(super) fn materials(scene: &Tables) -> Result<(), SceneError> {
    for (i, m) in scene.materials.rows.iter().enumerate() {
        let row = i as u32;
        let label = || format!("material {}", scene.materials.names.label(row));
        let what = || Entity::new(EntityKind::Material, row, label());
        let colors = |field, c: &[f32]| {
            for v in c {
                finite(what, field, &[f64::from(*v)])?;
                require(*v >= 0.0, what, field, decimal(*v), "0 or greater")?;
            }
            Ok(())
        };
        let fraction = |field, v: f32| {
            let ok = (0.0..=1.0).contains(&v);
            require(ok, what, field, decimal(v), "between 0 and 1")
        };
        let Material {
            base_color,
            emission,
            transmission,
            ior,
            model,
            layers,
        } = m;
        colors("base_color", base_color)?;
        colors("emission", emission)?;
        fraction("transmission", *transmission)?;
        let ok = *ior > 0.0 && ior.is_finite();
        require(ok, what, "ior", decimal(*ior), "greater than 0 and finite")?;
        for (field, value) in [
            ("opacity", layers.opacity),
            ("diffuse_roughness", layers.diffuse_roughness),
            ("specular", layers.specular),
            ("anisotropy", layers.anisotropy),
            ("clearcoat", layers.clearcoat),
            ("clearcoat_roughness", layers.clearcoat_roughness),
            ("sheen_roughness", layers.sheen_roughness),
            ("diffuse_transmission", layers.diffuse_transmission),
            ("iridescence", layers.iridescence),
        ] {
            fraction(field, value)?;
        }
        colors("specular_color", &layers.specular_color)?;
        colors("sheen_color", &layers.sheen_color)?;
        colors(
            "diffuse_transmission_color",
            &layers.diffuse_transmission_color,
        )?;
        for share in layers.attenuation_color {
            fraction("attenuation.color", share)?;
        }
        colors("dispersion", &[layers.dispersion])?;
        // The indices of red and blue are as far from that of green.
        let spread = (*ior - 1.0).abs() * layers.dispersion * 0.025;
        require(
            spread < *ior,
            what,
            "dispersion",
            decimal(layers.dispersion),
            "less than 40 ior / |ior - 1|, so that no index of refraction is negative",
        )?;
        colors("iridescence_thickness", &[layers.iridescence_thickness])?;
        finite(
            what,
            "anisotropy_rotation",
            &[f64::from(layers.anisotropy_rotation)],
        )?;
        for (field, value) in [
            ("attenuation.distance", layers.attenuation_distance),
            ("iridescence_ior", layers.iridescence_ior),
        ] {
            require(value > 0.0, what, field, decimal(value), "greater than 0")?;
        }
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
    for row in scene.textures.iter() {
        let id = row.material.0;
        let label = || format!("material {}", scene.materials.names.label(id));
        let what = || Entity::new(EntityKind::Material, id, label());
        for pattern in row.patterns() {
            let count = scene.textures.patterns.len();
            let known = scene.textures.patterns.get(pattern.index());
            let dangling = || SceneError::DanglingId {
                what: what(),
                kind: "pattern",
                id: pattern.0,
                count,
            };
            known.ok_or_else(dangling)?.check(what)?;
        }
    }
    for v in scene.background {
        let what = || Entity::new(EntityKind::Background, 0, "the background".into());
        finite(what, "colour", &[f64::from(v)])?;
        require(v >= 0.0, what, "colour", decimal(v), "0 or greater")?;
    }
    Ok(())
}

pub(super) fn lights(scene: &Tables) -> Result<(), SceneError> {
    let motions = &scene.light_motions;
    for (row, of) in motions.of.iter().enumerate() {
        let what = || Entity::new(EntityKind::Light, of.0, format!("light {}", of.0));
        let range = &motions.ranges[row];
        let keys = &motions.keys[range.start as usize..range.end as usize];
        let mut last = 0.0;
        for (i, (at, light)) in keys.iter().enumerate() {
            let in_order = if i == 0 { *at == 0.0 } else { *at > last };
            let must = "above 0 and the key before, and at most 1";
            let field = "at of a motion's key";
            require(in_order && *at <= 1.0, what, field, *at, must)?;
            last = *at;
            one_light(of.index(), light)?;
        }
    }
    lights_at_time(scene)
}

/// Checks lights as they are at a time.
pub(in crate::scene) fn lights_at_time(scene: &Tables) -> Result<(), SceneError> {
    let mut rows = scene.lights.iter().enumerate();
    rows.try_for_each(|(i, light)| one_light(i, light))
}

fn one_light(i: usize, light: &Light) -> Result<(), SceneError> {
    let what = || Entity::new(EntityKind::Light, i as u32, format!("light {i}"));
    let directed = |direction: DVec3| {
        finite3(what, "direction", direction)?;
        if direction == DVec3::ZERO {
            return Err(SceneError::Degenerate {
                what: what(),
                why: "its direction is (0, 0, 0)".into(),
            });
        }
        Ok(())
    };
    let sized = |field, size: f64, most: f64, must| {
        require(size >= 0.0 && size <= most, what, field, size, must)
    };
    let radius = |radius| sized("radius", radius, f64::MAX, "0 or greater, and finite");
    let (name, power) = match light {
        Light::Point {
            position,
            intensity,
            radius: size,
            ..
        } => {
            finite3(what, "position", *position)?;
            radius(*size)?;
            ("intensity", intensity)
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
            radius: size,
        } => {
            finite3(what, "position", *position)?;
            directed(*direction)?;
            radius(*size)?;
            // Files give degrees.
            let (inner, outer) = (inner.to_degrees(), outer.to_degrees());
            sized("outer", outer, 90.0, "between 0 and 90 degrees")?;
            sized("inner", inner, outer, "between 0 and the outer angle")?;
            ("intensity", intensity)
        }
        Light::Directional {
            direction,
            irradiance,
            angle,
        } => {
            directed(*direction)?;
            let whole = 2.0 * angle.to_degrees();
            sized("angle", whole, 180.0, "between 0 and 180 degrees")?;
            ("irradiance", irradiance)
        }
        Light::Rectangle {
            center,
            edges: [u, v],
            radiance,
            ..
        } => {
            finite3(what, "center", *center)?;
            finite3(what, "edge_u", *u)?;
            finite3(what, "edge_v", *v)?;
            let (size, slant) = (u.length() * v.length(), u.dot(*v).abs());
            let wrong = match () {
                () if !(size > 0.0 && size.is_finite()) => "it has no area that f64 can tell",
                () if slant > 1e-6 * size => {
                    "its edges are not at right angles; make them so, or use a polygon of an \
                         emissive material"
                }
                () => "",
            };
            if !wrong.is_empty() {
                return Err(SceneError::Degenerate {
                    what: what(),
                    why: wrong.into(),
                });
            }
            ("radiance", radiance)
        }
        Light::Disc {
            center,
            normal,
            radius: size,
            radiance,
            ..
        } => {
            finite3(what, "center", *center)?;
            directed(*normal)?;
            radius(*size)?;
            ("radiance", radiance)
        }
    };
    for v in power {
        finite(what, name, &[f64::from(*v)])?;
        require(*v >= 0.0, what, name, f64::from(*v), "0 or greater")?;
    }
    Ok(())
}

pub(super) fn cameras(scene: &Tables) -> Result<(), SceneError> {
    for (i, camera) in scene.cameras.rows.iter().enumerate() {
        let what = || camera_entity(scene, i as u32);
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
            Projection::Calibrated(ref k) => {
                calibration(k, what)?;
                ("fy", camera.projection.half_height(), "finite")
            }
            Projection::Panorama => ("panorama", 1.0, ""),
            Projection::Fisheye { half_angle, .. } => (
                "fov",
                if half_angle <= std::f64::consts::PI {
                    half_angle
                } else {
                    f64::NAN
                },
                "greater than 0, up to 360 degrees",
            ),
        };
        let ok = half_height > 0.0 && half_height.is_finite();
        require(ok, what, field, half_height, must)?;
        if let Some(lens) = &camera.lens {
            opening(lens, &camera.projection, what)?;
        }
    }
    camera_motions(scene)?;
    shutters(scene)
}

/// Checks the keys of cameras that move.
fn camera_motions(scene: &Tables) -> Result<(), SceneError> {
    let motions = &scene.cameras.motions;
    for (row, of) in motions.of.iter().enumerate() {
        let what = || camera_entity(scene, *of);
        let keys = motions.keys(row);
        let mut last = 0.0;
        for (i, key) in keys.iter().enumerate() {
            let in_order = if i == 0 { key.at == 0.0 } else { key.at > last };
            let must = "above 0 and the key before, and at most 1";
            require(
                in_order && key.at <= 1.0,
                what,
                "at of a motion's key",
                key.at,
                must,
            )?;
            last = key.at;
            finite3(what, "eye of a motion's key", key.eye)?;
            finite3(what, "look_at of a motion's key", key.look_at)?;
            finite3(what, "up of a motion's key", key.up)?;
        }
        let blind = |time| Err(SceneError::BlindCamera { what: what(), time });
        for pair in keys.windows(2) {
            let [a, b] = [0, 1].map(|i| pair[i].look_at - pair[i].eye);
            // Where the way from one direction to the other passes nearest to none at all.
            let along = b - a;
            let s = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let nearest = if s.is_finite() { a + along * s } else { a };
            // Beyond rounding: a frame made of less would tremble.
            if nearest.length() <= 1e-9 * a.length().max(b.length()) {
                return blind(pair[0].at + s * (pair[1].at - pair[0].at));
            }
        }
    }
    Ok(())
}

/// Checks the shutters of cameras.
fn shutters(scene: &Tables) -> Result<(), SceneError> {
    for (of, shutter) in &scene.cameras.shutters {
        let what = || camera_entity(scene, *of);
        let Shutter { open, close, shape } = *shutter;
        let finite = open.is_finite() && close.is_finite();
        require(finite, what, "shutter's open", open, "finite, as close")?;
        let must = "no less than open";
        require(close >= open, what, "shutter's close", close, must)?;
        if let ShutterShape::Trapezoid { rise, fall } = shape {
            let ok = rise >= 0.0 && fall >= 0.0 && rise + fall <= 1.0;
            let must = "0 or greater, as fall, and their sum at most 1";
            require(ok, what, "shutter's rise", rise, must)?;
        }
    }
    Ok(())
}

/// Checks the numbers of a calibrated camera.
fn calibration(k: &Calibration, what: impl Fn() -> Entity) -> Result<(), SceneError> {
    for (field, value) in ["fx", "fy"].into_iter().zip(k.focal) {
        let ok = value > 0.0 && value.is_finite();
        require(ok, &what, field, value, "greater than 0 and finite")?;
    }
    for (field, value) in ["cx", "cy"].into_iter().zip(k.center) {
        require(value.is_finite(), &what, field, value, "finite")?;
    }
    for (field, value) in ["width", "height"].into_iter().zip(k.size) {
        let ok = (1..=65_535).contains(&value);
        require(ok, &what, field, f64::from(value), "from 1 to 65535")?;
    }
    for (field, value) in ["k1", "k2", "p1", "p2", "k3"].into_iter().zip(k.distortion) {
        require(value.is_finite(), &what, field, value, "finite")?;
    }
    Ok(())
}

/// Checks the cameras of a moving scene at its time.
pub(in crate::scene) fn cameras_at_time(scene: &Tables, time: f64) -> Result<(), SceneError> {
    cameras(scene).map_err(|error| match error {
        SceneError::Degenerate { what, .. } => SceneError::BlindCamera { what, time },
        error => error,
    })
}

fn camera_entity(scene: &Tables, row: u32) -> Entity {
    let label = format!("camera {}", scene.cameras.names.label(row));
    Entity::new(EntityKind::Camera, row, label)
}

/// Checks a lens.
fn opening(
    lens: &Lens,
    projection: &Projection,
    what: impl Fn() -> Entity,
) -> Result<(), SceneError> {
    if !projection.has_plane() {
        return Err(SceneError::Degenerate {
            what: what(),
            why: "it has a lens, which panoramas and fisheyes cannot have; leave out the lens"
                .into(),
        });
    }
    let above = |x: f64| x > 0.0 && x.is_finite();
    let radius = lens.radius >= 0.0 && lens.radius.is_finite();
    let blades = lens.blades == 0 || (3..=64).contains(&lens.blades);
    let positive = "greater than 0 and finite";
    require(
        radius,
        &what,
        "lens radius",
        lens.radius,
        "0 or greater, and finite",
    )?;
    require(above(lens.focus), &what, "focus", lens.focus, positive)?;
    require(
        above(lens.squeeze),
        &what,
        "squeeze",
        lens.squeeze,
        positive,
    )?;
    let rotation = lens.rotation.is_finite();
    require(rotation, &what, "lens rotation", lens.rotation, "finite")?;
    let count = f64::from(lens.blades);
    require(
        blades,
        &what,
        "blades",
        count,
        "0 for a disc, or from 3 to 64",
    )
}
