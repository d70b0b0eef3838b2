//! Export of camera, lights and materials.

use super::{comment, number, vector};
use crate::scene::{
    Camera, Falloff, FisheyeMapping, Light, Material, Model, Projection, Rgb, Scene, coarse_corners,
};
use glam::DVec3;
use std::f64::consts::PI;
use std::fmt::Write;

/// Writes background, camera, lights and the declarations of materials.
pub(super) fn write(text: &mut String, scene: &Scene, seen_from: &Camera) {
    let _ = writeln!(text, "background {{ rgb {} }}\n", color(scene.background));
    camera(text, seen_from);
    let corners = coarse_corners(scene);
    for row in &scene.lights {
        light(text, row, seen_from.eye, &corners);
    }
    text.push('\n');
    for (i, material) in scene.materials.rows.iter().enumerate() {
        let comment = comment(scene.materials.names.get(i as u32));
        let _ = writeln!(
            text,
            "#declare Texture_{i} = {}{comment}\n\
             #declare Material_{i} = material {{ texture {{ Texture_{i} }} interior {{ ior {} }} }}",
            texture(material),
            material.ior
        );
    }
    // POV-Ray gives the default texture to objects without material.
    let _ = writeln!(text, "#default {{ {} }}\n", texture(&Material::default()));
}

/// Writes the camera. In POV-Ray the direction of a pixel's ray is direction + u·right + v·up,
/// u and v from −½ to ½.
fn camera(text: &mut String, camera: &Camera) {
    let Camera { eye, forward, .. } = *camera;
    let half = camera.projection.half_height();
    let square = format!(
        "right {} * image_width / image_height",
        vector(camera.right * (2.0 * half))
    );
    let (kind, direction, right) = match camera.projection {
        Projection::Perspective { .. } => ("perspective", forward, square),
        Projection::Orthographic { .. } => ("orthographic", forward, square),
        Projection::Calibrated(k) => {
            // The middle of the picture, in OpenCV's pixels, need not be on the axis.
            let middle = [0, 1].map(|axis| {
                let pixel = 0.5 * f64::from(k.size[axis]) - 0.5;
                (pixel - k.center[axis]) / k.focal[axis]
            });
            let width = f64::from(k.size[0]) / k.focal[0];
            (
                "perspective",
                forward + camera.right * middle[0] - camera.up * middle[1],
                format!("right {}", vector(camera.right * width)),
            )
        }
        Projection::Panorama => ("spherical angle 360 180", forward, square),
        Projection::Fisheye { .. } => ("fisheye", forward, square),
    };
    let _ = writeln!(
        text,
        "camera {{ {kind}\n  location {}\n  direction {}\n  up {}\n  {right}",
        vector(eye),
        vector(direction),
        vector(camera.up * (2.0 * half)),
    );
    if let Projection::Fisheye { half_angle, .. } = camera.projection {
        let degrees = number(2.0 * half_angle.to_degrees());
        let _ = writeln!(text, "  angle {degrees}");
    }
    if let Some(lens) = camera.lens.filter(|lens| lens.radius > 0.0) {
        let _ = writeln!(
            text,
            "  aperture {} focal_point {} blur_samples 64 variance 1/4096",
            number(2.0 * lens.radius),
            vector(eye + forward * lens.focus)
        );
    }
    text.push_str("}\n");
}

/// Lists what the text does not say of a scene's looks, in the words of the scene format.
pub(super) fn losses(scene: &Scene, camera: &Camera) -> Vec<&'static str> {
    let some = |is: fn(&Material) -> bool| scene.materials.rows.iter().any(is);
    let lights = |is: fn(&Light) -> bool| scene.lights.iter().any(is);
    let lens = camera.lens.filter(|lens| lens.radius > 0.0);
    let fisheye = |at: FisheyeMapping| matches!(camera.projection, Projection::Fisheye { mapping, .. } if mapping == at);
    let distorted = matches!(camera.projection,
        Projection::Calibrated(k) if k.distortion != [0.0; 5]);
    let all = [
        ("environment", scene.environment.is_some()),
        (
            "radius of lights, which shine from their centres",
            lights(
                |light| matches!(*light, Light::Point { radius, .. } | Light::Spot { radius, .. } if radius > 0.0),
            ),
        ),
        (
            "angle of suns, whose shadows are hard",
            lights(|light| matches!(*light, Light::Directional { angle, .. } if angle > 0.0)),
        ),
        (
            "light of materials that shine, on others",
            some(|m| m.emission != [0.0; 3]),
        ),
        ("distortion", distorted),
        ("equisolid", fisheye(FisheyeMapping::Equisolid)),
        (
            "blades and squeeze of the lens",
            lens.is_some_and(|lens| lens.blades != 0 || lens.squeeze != 1.0),
        ),
        (
            "textures",
            scene.textures.iter().any(|row| !row.refs.is_empty()),
        ),
        (
            "patterns, of which the mean is written",
            !scene.textures.patterns.is_empty(),
        ),
        ("opacity", some(|m| m.layers.opacity < 1.0)),
        ("thin walls", some(|m| m.layers.thin_walled)),
        ("unlit", some(|m| m.layers.unlit)),
        (
            "absorption",
            some(|m| m.layers.attenuation_distance.is_finite()),
        ),
        ("dispersion", some(|m| m.layers.dispersion > 0.0)),
        (
            "diffuse transmission",
            some(|m| m.layers.diffuse_transmission > 0.0),
        ),
        ("clearcoat", some(|m| m.layers.clearcoat > 0.0)),
        ("sheen", some(|m| m.layers.sheen_color != [0.0; 3])),
        ("iridescence", some(|m| m.layers.iridescence > 0.0)),
        ("anisotropy", some(|m| m.layers.anisotropy > 0.0)),
    ];
    let lost = all.iter().filter(|(_, is)| *is);
    lost.map(|(name, _)| *name).collect()
}

/// Writes a light. In POV-Ray a surface of pigment p reflects p·L·cos θ of a light of colour
/// L; here it reflects p·E/π of the irradiance E. Hence the factor 1/π.
fn light(text: &mut String, light_row: &Light, eye: DVec3, corners: &[DVec3]) {
    match *light_row {
        Light::Point {
            position,
            intensity,
            falloff: Falloff::None,
            ..
        } => {
            let light = scaled(intensity, 1.0 / PI);
            let _ = writeln!(text, "light_source {{ {} rgb {light} }}", vector(position));
        }
        Light::Point {
            position,
            intensity,
            falloff: Falloff::InverseSquare,
            ..
        }
        | Light::Spot {
            position,
            intensity,
            ..
        } => {
            let away = (position - eye).length();
            let fade = if away > 0.0 { away * 1e-4 } else { 1e-4 };
            let light = scaled(intensity, 1.0 / (2.0 * PI * fade * fade));
            let _ = writeln!(
                text,
                "light_source {{ {} rgb {light} fade_distance {} fade_power 2{} }}",
                vector(position),
                number(fade),
                cone(light_row)
            );
        }
        Light::Directional {
            direction,
            irradiance,
            ..
        } => {
            // The light is placed far outside the bounds of the scene.
            let toward = direction / direction.abs().max_element();
            let reach = corners.iter().map(|p| (*p - eye).length());
            let reach = reach.fold(eye.length().max(1.0), f64::max);
            let position = eye - toward.normalize() * (reach * 100.0);
            let _ = writeln!(
                text,
                "light_source {{ {} rgb {} parallel point_at {} }}",
                vector(position),
                scaled(irradiance, 1.0 / PI),
                vector(eye)
            );
        }
        Light::Rectangle {
            center,
            edges: [u, v],
            radiance,
            two_sided,
        } => {
            let normal = u.cross(v).normalize();
            area_light(
                text,
                (center, normal, two_sided),
                radiance,
                light_row,
                [u, v],
                "",
            );
        }
        Light::Disc {
            center,
            normal,
            radius,
            radiance,
            two_sided,
        } => {
            let normal = normal.normalize();
            let (x, y) = normal.any_orthonormal_pair();
            let across = [x, y].map(|axis| axis * (2.0 * radius));
            let side = (center, normal, two_sided);
            area_light(text, side, radiance, light_row, across, " circular");
        }
    }
}

/// Writes a flat light: points in a grid, each a spot light whose intensity falls with the
/// cosine, as that of a Lambert emitter does.
fn area_light(
    text: &mut String,
    (center, normal, two_sided): (DVec3, DVec3, bool),
    radiance: Rgb,
    light: &Light,
    [u, v]: [DVec3; 2],
    shape: &str,
) {
    let fade = u.length().max(v.length()) * 1e-4;
    let light = scaled(radiance, light.area() / (2.0 * PI * fade * fade));
    for side in if two_sided { &[1.0, -1.0][..] } else { &[1.0] } {
        let _ = writeln!(
            text,
            "light_source {{ {} rgb {light} fade_distance {} fade_power 2 spotlight radius 90 \
             falloff 90 tightness 1 point_at {} area_light {}, {}, 9, 9{shape} adaptive 1 jitter }}",
            vector(center),
            number(fade),
            vector(center + normal * *side),
            vector(u),
            vector(v)
        );
    }
}

/// Returns the cone of a spot light, whose edges fade in POV-Ray by a formula of its own.
fn cone(light: &Light) -> String {
    let Light::Spot {
        position,
        direction,
        inner,
        outer,
        ..
    } = *light
    else {
        return String::new();
    };
    format!(
        " spotlight radius {} falloff {} tightness 0 point_at {}",
        number(inner.to_degrees()),
        number(outer.to_degrees()),
        vector(position + direction.normalize())
    )
}

/// Lower limit on the pigment, because POV-Ray multiplies the emission by it.
const DARKEST: f32 = 1e-6;

/// Writes a material as a texture of one pigment and one finish.
fn texture(material: &Material) -> String {
    let (pigment, finish) = match material.model {
        Model::MetallicRoughness {
            metallic,
            roughness,
        } => {
            let base = material.base_color;
            let diffuse = (1.0 - metallic) * (1.0 - material.transmission);
            // POV-Ray's roughness of a highlight is taken to be α of GGX.
            let alpha = (roughness * roughness).clamp(0.001, 1.0);
            let shine = metallic + (1.0 - metallic) * 0.04;
            let metal = if metallic > 0.5 { " metallic" } else { "" };
            let mirror = if roughness < 0.1 {
                format!(" reflection {{ {}{metal} }}", number(f64::from(shine)))
            } else {
                let strength = f64::from(shine * (1.0 - roughness));
                format!(
                    " specular {} roughness {}{metal}",
                    number(strength),
                    number(f64::from(alpha))
                )
            };
            (base, format!("diffuse {diffuse}{mirror}"))
        }
        Model::Phong {
            diffuse,
            specular,
            exponent,
            mirror,
        } => {
            let most = |c: Rgb| c[0].max(c[1]).max(c[2]);
            let finish = format!(
                "diffuse 1 phong {} phong_size {exponent} reflection {{ rgb {} }}",
                most(specular),
                color(mirror)
            );
            (diffuse, finish)
        }
    };
    let pigment = pigment.map(|c| c.max(DARKEST));
    let emission = if material.emission == [0.0; 3] {
        "0".into()
    } else {
        let of = |k: usize| material.emission[k] / pigment[k];
        format!("rgb {}", color([of(0), of(1), of(2)]))
    };
    let clear = match material.transmission {
        0.0 => String::new(),
        t => format!(" filter {t}"),
    };
    format!(
        "texture {{ pigment {{ rgb {}{clear} }} finish {{ ambient 0 emission {emission} {finish} }} }}",
        color(pigment)
    )
}

fn color(c: Rgb) -> String {
    scaled(c, 1.0)
}

fn scaled(c: Rgb, factor: f64) -> String {
    vector(c.map(|x| {
        // Without scaling, the shortest decimal of the f32 is kept.
        match factor {
            1.0 => format!("{x}").parse().unwrap_or(0.0),
            _ => f64::from(x) * factor,
        }
    }))
}
