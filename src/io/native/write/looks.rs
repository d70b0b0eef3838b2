//! Materials, lights and cameras.

use super::text::{Table, Value, numbers, short};
use crate::scene::{
    Camera, CameraKey, Falloff, FisheyeMapping, Layers, Lens, Light, Material, Model, Projection,
    Rgb, Shutter, ShutterShape,
};
use glam::DVec3;

pub(super) fn color(rgb: Rgb) -> Value {
    numbers(rgb.map(short))
}

pub(super) fn vector(v: DVec3) -> Value {
    numbers(v.to_array())
}

/// Writes what of a material differs from the default.
pub(super) fn material(row: &Material) -> Table {
    let usual = Material::default();
    let mut table: Table = vec![("base_color".into(), color(row.base_color))];
    let mut put = |key: &str, value: Value| table.push((key.into(), value));
    match row.model {
        Model::MetallicRoughness {
            metallic,
            roughness,
        } => {
            put("metallic", Value::Number(short(metallic)));
            put("roughness", Value::Number(short(roughness)));
        }
        Model::Phong {
            diffuse,
            specular,
            exponent,
            mirror,
        } => {
            let phong = vec![
                ("diffuse".into(), color(diffuse)),
                ("specular".into(), color(specular)),
                ("exponent".into(), Value::Number(short(exponent))),
                ("mirror".into(), color(mirror)),
            ];
            put("phong", Value::Table(phong));
        }
    }
    let mut number = |key: &str, x: f32, usual: f32| {
        if x != usual {
            put(key, Value::Number(short(x)));
        }
    };
    number("transmission", row.transmission, usual.transmission);
    number("ior", row.ior, usual.ior);
    let (of, no) = (&row.layers, Layers::default());
    number("opacity", of.opacity, no.opacity);
    number(
        "diffuse_roughness",
        of.diffuse_roughness,
        no.diffuse_roughness,
    );
    number("specular", of.specular, no.specular);
    number("anisotropy", of.anisotropy, no.anisotropy);
    number(
        "anisotropy_rotation",
        degrees_of(of.anisotropy_rotation),
        0.0,
    );
    number("clearcoat", of.clearcoat, no.clearcoat);
    number(
        "clearcoat_roughness",
        of.clearcoat_roughness,
        no.clearcoat_roughness,
    );
    number("sheen_roughness", of.sheen_roughness, no.sheen_roughness);
    number(
        "diffuse_transmission",
        of.diffuse_transmission,
        no.diffuse_transmission,
    );
    number("iridescence", of.iridescence, no.iridescence);
    number("iridescence_ior", of.iridescence_ior, no.iridescence_ior);
    number(
        "iridescence_thickness",
        of.iridescence_thickness,
        no.iridescence_thickness,
    );
    number("dispersion", of.dispersion, no.dispersion);
    let colors = [
        ("emission", row.emission, usual.emission),
        ("specular_color", of.specular_color, no.specular_color),
        ("sheen_color", of.sheen_color, no.sheen_color),
        (
            "diffuse_transmission_color",
            of.diffuse_transmission_color,
            no.diffuse_transmission_color,
        ),
    ];
    for (key, x, usual) in colors {
        if x != usual {
            put(key, color(x));
        }
    }
    for (key, is) in [("unlit", of.unlit), ("thin", of.thin_walled)] {
        if is {
            put(key, Value::Flag(true));
        }
    }
    if of.attenuation_distance != no.attenuation_distance {
        let attenuation = vec![
            ("color".into(), color(of.attenuation_color)),
            (
                "distance".into(),
                Value::Number(short(of.attenuation_distance)),
            ),
        ];
        put("attenuation", Value::Table(attenuation));
    }
    if of.priority != 0 {
        put("priority", Value::Whole(of.priority.into()));
    }
    table
}

/// Finds the f32 of degrees that reads back to these radians, or the nearest.
fn degrees_of(radians: f32) -> f32 {
    let near = radians.to_degrees();
    let others = [near, near.next_up(), near.next_down()];
    let same = others.into_iter().find(|x| x.to_radians() == radians);
    same.unwrap_or(near)
}

/// Finds the f64 near a guess that a reader takes to `wanted`, if there is one.
fn inverse(guess: f64, wanted: f64, read: impl Fn(f64) -> f64) -> Option<f64> {
    // As a person has written it, if that is what was read.
    let short = (guess * 1e9).round() / 1e9;
    if read(short) == wanted {
        return Some(short);
    }
    // Guesses are a few roundings off.
    const STEPS: usize = 8;
    let (mut up, mut down) = (guess, guess);
    for _ in 0..STEPS {
        if let Some(found) = [up, down].into_iter().find(|x| read(*x) == wanted) {
            return Some(found);
        }
        (up, down) = (up.next_up(), down.next_down());
    }
    None
}

/// Writes an angle that is given in radians, in degrees.
pub(super) fn angle(radians: f64) -> Value {
    let guess = radians.to_degrees();
    Value::Number(inverse(guess, radians, f64::to_radians).unwrap_or(guess))
}

/// Writes an angle whose half is given in radians, in degrees.
fn whole_angle(half: f64) -> Value {
    let guess = (half * 2.0).to_degrees();
    Value::Number(inverse(guess, half, |x| x.to_radians() * 0.5).unwrap_or(guess))
}

pub(super) fn light(row: &Light) -> (&'static str, Table) {
    let number = Value::Number;
    let mut table: Table = Vec::new();
    let mut put = |key: &str, value: Value| table.push((key.into(), value));
    let kind = match *row {
        Light::Point {
            position,
            intensity,
            falloff,
            radius,
        } => {
            put("position", vector(position));
            put("intensity", color(intensity));
            if falloff == Falloff::None {
                put("falloff", Value::Text("none".into()));
            }
            put("radius", number(radius));
            "point"
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
            radius,
        } => {
            put("position", vector(position));
            put("direction", vector(direction));
            put("intensity", color(intensity));
            put("inner", angle(inner));
            put("outer", angle(outer));
            put("radius", number(radius));
            "spot"
        }
        Light::Directional {
            direction,
            irradiance,
            angle,
        } => {
            put("direction", vector(direction));
            put("irradiance", color(irradiance));
            put("angle", whole_angle(angle));
            "directional"
        }
        Light::Rectangle {
            center,
            edges: [u, v],
            radiance,
            two_sided,
        } => {
            put("center", vector(center));
            put("edge_u", vector(u));
            put("edge_v", vector(v));
            put("radiance", color(radiance));
            put("two_sided", Value::Flag(two_sided));
            "rectangle"
        }
        Light::Disc {
            center,
            normal,
            radius,
            radiance,
            two_sided,
        } => {
            put("center", vector(center));
            put("normal", vector(normal));
            put("radius", number(radius));
            put("radiance", color(radiance));
            put("two_sided", Value::Flag(two_sided));
            "disc"
        }
    };
    // What is as if it were absent.
    table.retain(|(key, value)| match (&**key, value) {
        ("two_sided", Value::Flag(is)) => *is,
        ("radius" | "inner", Value::Number(x)) => *x != 0.0,
        ("angle", Value::Number(x)) => *x != 0.0,
        _ => true,
    });
    (kind, table)
}

/// Writes a camera, with its keys if it moves, and its shutter.
pub(super) fn camera(row: &Camera, keys: &[CameraKey], shutter: Option<Shutter>) -> Table {
    let mut table: Table = Vec::new();
    let mut put = |key: &str, value: Value| table.push((key.into(), value));
    match keys.first() {
        Some(first) => {
            put("eye", vector(first.eye));
            put("look_at", vector(first.look_at));
            put("up", vector(first.up));
        }
        None => {
            put("eye", vector(row.eye));
            let axes = [row.right, row.up, row.forward].map(vector);
            put("axes", Value::List(axes.into()));
        }
    }
    match row.projection {
        Projection::Perspective { half_height } => {
            let guess = (2.0 * libm::atan(half_height)).to_degrees();
            let read = |x: f64| libm::tan(x.to_radians() * 0.5);
            match inverse(guess, half_height, read) {
                Some(degrees) => put("fov_y", Value::Number(degrees)),
                None => put("half_height", Value::Number(half_height)),
            }
        }
        Projection::Orthographic { half_height } => {
            put("orthographic", Value::Number(half_height * 2.0));
        }
        Projection::Calibrated(k) => {
            let mut rows: Table = vec![
                ("fx".into(), Value::Number(k.focal[0])),
                ("fy".into(), Value::Number(k.focal[1])),
                ("cx".into(), Value::Number(k.center[0])),
                ("cy".into(), Value::Number(k.center[1])),
                ("width".into(), Value::Whole(k.size[0].into())),
                ("height".into(), Value::Whole(k.size[1].into())),
            ];
            if k.distortion != [0.0; 5] {
                rows.push(("distortion".into(), numbers(k.distortion)));
            }
            put("k", Value::Table(rows));
        }
        Projection::Panorama => put("panorama", Value::Text("equirectangular".into())),
        Projection::Fisheye {
            half_angle,
            mapping,
        } => {
            let mapping = match mapping {
                FisheyeMapping::Equidistant => "equidistant",
                FisheyeMapping::Equisolid => "equisolid",
            };
            let fisheye = vec![
                ("fov".into(), whole_angle(half_angle)),
                ("mapping".into(), Value::Text(mapping.into())),
            ];
            put("fisheye", Value::Table(fisheye));
        }
    }
    if let Some(found) = &row.lens {
        put("lens", Value::Table(lens(found)));
    }
    let later: Vec<Value> = keys.iter().skip(1).map(key).collect();
    if !later.is_empty() {
        put("motion", Value::List(later));
    }
    if let Some(shutter) = shutter {
        let mut rows: Table = vec![
            ("open".into(), Value::Number(shutter.open)),
            ("close".into(), Value::Number(shutter.close)),
        ];
        if let ShutterShape::Trapezoid { rise, fall } = shutter.shape {
            rows.push(("shape".into(), Value::Text("trapezoid".into())));
            rows.push(("rise".into(), Value::Number(rise)));
            rows.push(("fall".into(), Value::Number(fall)));
        }
        put("shutter", Value::Table(rows));
    }
    table
}

fn key(key: &CameraKey) -> Value {
    Value::Table(vec![
        ("at".into(), Value::Number(key.at)),
        ("eye".into(), vector(key.eye)),
        ("look_at".into(), vector(key.look_at)),
        ("up".into(), vector(key.up)),
    ])
}

fn lens(row: &Lens) -> Table {
    vec![
        ("radius".into(), Value::Number(row.radius)),
        ("focus".into(), Value::Number(row.focus)),
        ("blades".into(), Value::Whole(row.blades.into())),
        ("rotation".into(), Value::Number(row.rotation)),
        ("squeeze".into(), Value::Number(row.squeeze)),
    ]
}

/// Writes the environment of one radiance.
pub(super) fn uniform(radiance: Rgb) -> Table {
    vec![("color".into(), color(radiance))]
}
