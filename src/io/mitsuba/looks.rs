//! Camera, materials and lights.

use super::{Writer, frame, list, number, rgb, to_world};
use crate::Picture;
use crate::math::Affine;
use crate::openexr::{self, Content};
use crate::scene::{
    Camera, Environment, Falloff, Light, Material, MaterialId, Model, Projection, Rgb,
};
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

/// A material's BSDF: its XML, and whether Mitsuba has it for the outside only.
struct Bsdf {
    xml: String,
    one_sided: bool,
}

impl Bsdf {
    /// Makes a BSDF that reflects on its outside only.
    fn outside(kind: &str, parameters: &str) -> Bsdf {
        Bsdf {
            xml: format!("<bsdf type=\"{kind}\">{parameters}</bsdf>"),
            one_sided: true,
        }
    }

    /// Makes a BSDF that has both sides.
    fn both(kind: &str, parameters: &str) -> Bsdf {
        Bsdf {
            one_sided: false,
            ..Bsdf::outside(kind, parameters)
        }
    }
}

fn color(name: &str, value: [f32; 3]) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", rgb(value))
}

fn float(name: &str, value: f32) -> String {
    format!(
        "<float name=\"{name}\" value=\"{}\"/>",
        number(f64::from(value))
    )
}

impl Writer<'_> {
    /// Opens the sensor; its frame is that of `look_at`, whose x axis points to the left.
    pub(super) fn camera(&mut self, camera: &Camera, aspect: f64) {
        let pose = |scale: f64| {
            let (left, up) = (camera.right * -scale, camera.up * scale);
            to_world(&frame(left, up, camera.forward, camera.eye))
        };
        // All of the scene, as seen from the eye; half-spaces are as large as they are drawn.
        let far = self.reach * 1e4;
        let clip = format!(
            "<float name=\"near_clip\" value=\"{}\"/><float name=\"far_clip\" value=\"{}\"/>",
            number(self.reach * 1e-4),
            number(far)
        );
        let lens = camera.lens.filter(|lens| lens.radius > 0.0);
        let (plain, opening) = match &lens {
            None => ("perspective", String::new()),
            Some(lens) => (
                "thinlens",
                format!(
                    "<float name=\"aperture_radius\" value=\"{}\"/>\
                     <float name=\"focus_distance\" value=\"{}\"/>",
                    number(lens.radius),
                    number(lens.focus)
                ),
            ),
        };
        if lens.is_some_and(|lens| lens.blades != 0 || lens.squeeze != 1.0) {
            self.notes.similar("round lens");
        }
        match camera.projection {
            Projection::Perspective { .. } => {}
            Projection::Orthographic { .. } if lens.is_none() => {}
            Projection::Orthographic { .. } => self.notes.missing("lens of parallel rays"),
            Projection::Calibrated(_) => {
                self.notes.similar("calibrated camera, by its height alone");
            }
            Projection::Panorama => self.notes.missing("panorama"),
            Projection::Fisheye { .. } => self.notes.missing("fisheye"),
        }
        let half_height = camera.projection.half_height();
        let _ = match camera.projection {
            // There x spans −1 to 1, and y as much as the pixels are square.
            Projection::Orthographic { .. } => writeln!(
                self.xml,
                "  <sensor type=\"orthographic\">\n    {clip}\n    {}",
                pose(half_height * aspect)
            ),
            _ => writeln!(
                self.xml,
                "  <sensor type=\"{plain}\">\n    <string name=\"fov_axis\" value=\"y\"/>\
                 <float name=\"fov\" value=\"{}\"/>{opening}{clip}\n    {}",
                number(2.0 * libm::atan(half_height).to_degrees()),
                pose(1.0)
            ),
        };
    }

    pub(super) fn materials(&mut self) {
        let rows = self.scene.materials.rows.clone();
        for (i, row) in rows.iter().enumerate() {
            self.material(&format!("material_{i}"), row);
            let varied = self.scene.textures.of(MaterialId(i as u32));
            if varied.is_some_and(|row| !row.refs.is_empty()) {
                self.notes.missing("texture");
            }
            if varied.is_some_and(|row| row.patterns().next().is_some()) {
                self.notes.similar("pattern, as its mean");
            }
        }
    }

    pub(super) fn material(&mut self, id: &str, material: &Material) {
        let mut bsdf = self.bsdf(material);
        let layers = &material.layers;
        for (what, is) in [
            ("unlit material", layers.unlit),
            ("clearcoat", layers.clearcoat > 0.0),
            ("sheen", layers.sheen_color != [0.0; 3]),
            ("thin film", layers.iridescence > 0.0),
            ("anisotropy", layers.anisotropy > 0.0),
            ("dispersion", layers.dispersion > 0.0),
            ("diffuse transmission", layers.diffuse_transmission > 0.0),
            ("rough diffuse base", layers.diffuse_roughness > 0.0),
            (
                "priority of a medium",
                material.transmission > 0.0 && !layers.thin_walled && layers.priority != 0,
            ),
            (
                "absorbing medium",
                material.transmission > 0.0
                    && layers.attenuation_distance.is_finite()
                    && layers.attenuation_color != [1.0; 3],
            ),
        ] {
            if is {
                self.notes.missing(what);
            }
        }
        if bsdf.one_sided {
            bsdf.xml = format!("<bsdf type=\"twosided\">{}</bsdf>", bsdf.xml);
        }
        if layers.opacity < 1.0 {
            let opacity = float("opacity", layers.opacity);
            bsdf.xml = format!("<bsdf type=\"mask\">{opacity}{}</bsdf>", bsdf.xml);
        }
        // The outermost element carries the id.
        let named = bsdf
            .xml
            .replacen("<bsdf ", &format!("<bsdf id=\"{id}\" "), 1);
        let _ = writeln!(self.xml, "  {named}");
    }

    fn bsdf(&mut self, material: &Material) -> Bsdf {
        match material.model {
            Model::Phong {
                diffuse,
                specular,
                mirror,
                ..
            } => {
                if specular != [0.0; 3] || material.transmission > 0.0 {
                    self.notes.missing("Phong highlight or transmission");
                }
                let lambert = Bsdf::outside("diffuse", &color("reflectance", diffuse));
                match (mirror == [0.0; 3], diffuse == [0.0; 3]) {
                    (true, _) => lambert,
                    (false, true) => mirrored(mirror),
                    (false, false) => {
                        self.notes.missing("mirror of a Phong material");
                        lambert
                    }
                }
            }
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => self.metallic_roughness(material, metallic, roughness),
        }
    }

    fn metallic_roughness(&mut self, material: &Material, metallic: f32, roughness: f32) -> Bsdf {
        let base = material.base_color;
        let alpha = roughness * roughness;
        let is_lambert = material.layers.specular == 0.0 || material.ior == 1.0;
        if metallic == 0.0 && material.transmission == 0.0 && is_lambert {
            return Bsdf::outside("diffuse", &color("reflectance", base));
        }
        if metallic == 0.0 && material.transmission == 1.0 {
            let mut parameters = float("int_ior", material.ior) + &float("ext_ior", 1.0);
            if base != [1.0; 3] {
                parameters += &color("specular_transmittance", base);
            }
            if material.layers.thin_walled {
                if alpha > 0.0 {
                    self.notes.similar("rough thin sheet, as smooth");
                }
                return Bsdf::both("thindielectric", &parameters);
            }
            if alpha == 0.0 {
                return Bsdf::both("dielectric", &parameters);
            }
            self.notes
                .similar("rough glass, without what facets scatter twice");
            parameters += "<string name=\"distribution\" value=\"ggx\"/>";
            parameters += &float("alpha", alpha);
            return Bsdf::both("roughdielectric", &parameters);
        }
        if metallic == 1.0 {
            if alpha == 0.0 {
                if base != [1.0; 3] {
                    self.notes.similar("smooth metal, without Schlick's term");
                }
                return mirrored(base);
            }
            self.notes.similar("rough metal, as roughconductor");
            let parameters = format!(
                "<string name=\"material\" value=\"none\"/>\
                 <string name=\"distribution\" value=\"ggx\"/>{}{}",
                float("alpha", alpha),
                color("specular_reflectance", base)
            );
            return Bsdf::outside("roughconductor", &parameters);
        }
        self.notes.similar("metallic-roughness, as principled");
        let parameters = color("base_color", base)
            + &float("metallic", metallic)
            + &float("roughness", roughness)
            + &float("spec_trans", material.transmission)
            + &float("eta", material.ior.max(1.0001));
        match material.transmission > 0.0 {
            true => Bsdf::both("principled", &parameters),
            false => Bsdf::outside("principled", &parameters),
        }
    }

    pub(super) fn lights(&mut self) {
        let scene = self.scene;
        let uniform = match &scene.environment {
            Some(map) => map.uniform_radiance(),
            None => (scene.background != [0.0; 3]).then_some(scene.background),
        };
        match (&scene.environment, uniform) {
            (_, Some(radiance)) => {
                let radiance = color("radiance", radiance);
                let _ = writeln!(
                    self.xml,
                    "  <emitter type=\"constant\">{radiance}</emitter>"
                );
            }
            (Some(map), None) => {
                let name = format!("{}_environment.exr", self.stem);
                let picture = Picture {
                    width: map.width,
                    height: 2 * map.height + 1,
                    color: rows_from_pole_to_pole(map),
                    ..Picture::default()
                };
                match openexr::encode(&picture, Content::ColorAndAovs, Path::new(&name)) {
                    Ok(bytes) => {
                        // There the middle of the map lies towards +z.
                        let turn = libm::sincos(map.rotation + PI);
                        let (sine, cosine) = turn;
                        let turned = Affine::new(
                            [[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]],
                            [0.0; 3],
                        );
                        let _ = writeln!(
                            self.xml,
                            "  <emitter type=\"envmap\"><string name=\"filename\" value=\"{}\"/>{}\
                             </emitter>",
                            escaped(&name),
                            to_world(&turned)
                        );
                        self.files.push((name, bytes));
                    }
                    Err(_) => self.notes.missing("environment map"),
                }
            }
            (None, None) => {}
        }
        for light in &scene.lights {
            self.light(light);
        }
    }

    fn light(&mut self, light: &Light) {
        let text = match light {
            Light::Point {
                falloff: Falloff::None,
                ..
            } => {
                self.notes.missing("light without falloff");
                return;
            }
            Light::Point {
                position,
                intensity,
                radius,
                ..
            } if *radius > 0.0 => {
                self.notes.similar("light with a ball, which can be seen");
                // The ball's radiance is I / πr².
                let factor = 1.0 / (PI * radius * radius);
                let radiance = intensity.map(|i| (f64::from(i) * factor) as f32);
                format!(
                    "<shape type=\"sphere\"><point name=\"center\" value=\"{}\"/>\
                     <float name=\"radius\" value=\"{}\"/><bsdf type=\"diffuse\">{}</bsdf>\
                     <emitter type=\"area\">{}</emitter></shape>",
                    list(&position.to_array()),
                    number(*radius),
                    color("reflectance", [0.0; 3]),
                    color("radiance", radiance)
                )
            }
            Light::Point {
                position,
                intensity,
                ..
            } => format!(
                "<emitter type=\"point\"><point name=\"position\" value=\"{}\"/>{}</emitter>",
                list(&position.to_array()),
                color("intensity", *intensity)
            ),
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                radius,
            } => {
                self.notes.similar("spot light, whose rim fades linearly");
                if *radius > 0.0 {
                    self.notes.missing("radius of a spot light");
                }
                let forward = direction.normalize();
                let (x, y) = forward.any_orthonormal_pair();
                format!(
                    "<emitter type=\"spot\">{}{}<float name=\"cutoff_angle\" value=\"{}\"/>\
                     <float name=\"beam_width\" value=\"{}\"/></emitter>",
                    to_world(&frame(x, y, forward, *position)),
                    color("intensity", *intensity),
                    number(outer.to_degrees()),
                    number(inner.to_degrees())
                )
            }
            Light::Directional {
                direction,
                irradiance,
                angle,
            } => {
                if *angle > 0.0 {
                    self.notes
                        .similar("directional light with a disc, as a point");
                }
                let unit = *direction / direction.abs().max_element();
                format!(
                    "<emitter type=\"directional\"><vector name=\"direction\" value=\"{}\"/>{}\
                     </emitter>",
                    list(&unit.to_array()),
                    color("irradiance", *irradiance)
                )
            }
            Light::Rectangle {
                center,
                edges: [u, v],
                radiance,
                two_sided,
            } => {
                let map = frame(*u / 2.0, *v / 2.0, u.cross(*v).normalize(), *center);
                self.area_light("rectangle", &map, *radiance, *two_sided)
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
                let map = frame(x * *radius, y * *radius, normal, *center);
                self.area_light("disk", &map, *radiance, *two_sided)
            }
        };
        let _ = writeln!(self.xml, "  {text}");
    }

    /// Returns a shape that shines along its normal.
    fn area_light(&mut self, kind: &str, map: &Affine, radiance: Rgb, two_sided: bool) -> String {
        self.notes.similar("flat light, which can be seen");
        if two_sided {
            self.notes.similar("flat light, which shines on one side");
        }
        format!(
            "<shape type=\"{kind}\">{}<bsdf type=\"diffuse\">{}</bsdf>\
             <emitter type=\"area\">{}</emitter></shape>",
            to_world(map),
            color("reflectance", [0.0; 3]),
            color("radiance", radiance)
        )
    }
}

/// Returns a map whose first and last rows lie at the poles, as in Mitsuba, where here they lie
/// half a row from them: every row, and before, between and after them the means of their
/// neighbours. Interpolation between rows gives the same.
fn rows_from_pole_to_pole(map: &Environment) -> Vec<Rgb> {
    let width = map.width as usize;
    let last = map.height as usize - 1;
    let pixel = |row: usize, column: usize| map.pixels[row * width + column];
    let mut pixels = Vec::with_capacity((2 * last + 3) * width);
    for row in 0..2 * last + 3 {
        let (above, below) = (row.saturating_sub(1) / 2, (row / 2).min(last));
        pixels.extend((0..width).map(|column| {
            let (a, b) = (pixel(above, column), pixel(below, column));
            [0, 1, 2].map(|k| (a[k] * 0.5 + b[k] * 0.5) * map.scale[k])
        }));
    }
    pixels
}

/// Makes a perfect mirror of this reflectance.
fn mirrored(reflectance: [f32; 3]) -> Bsdf {
    let parameters = format!(
        "<string name=\"material\" value=\"none\"/>{}",
        color("specular_reflectance", reflectance)
    );
    Bsdf::outside("conductor", &parameters)
}

/// Escapes a text for an attribute's value.
pub(super) fn escaped(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => shown.push_str("&amp;"),
            '<' => shown.push_str("&lt;"),
            '"' => shown.push_str("&quot;"),
            // Mitsuba would take the name after it for a parameter.
            '$' => shown.push_str("&#36;"),
            _ => shown.push(c),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn environment_maps_reach_from_pole_to_pole() {
        let map = Environment {
            width: 1,
            height: 2,
            pixels: vec![[1.0, 0.0, 0.0], [3.0, 0.0, 8.0]].into(),
            rotation: 0.0,
            scale: [1.0, 1.0, 0.5],
        };
        let rows = rows_from_pole_to_pole(&map);
        let red_and_blue = [[1.0, 0.0], [1.0, 0.0], [2.0, 2.0], [3.0, 4.0], [3.0, 4.0]];
        assert_eq!(rows, red_and_blue.map(|[r, b]| [r, 0.0, b]));
    }
}
