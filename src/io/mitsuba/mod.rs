//! Exporter of scenes to Mitsuba 3: one XML file, and meshes as PLY files beside it.
//!
//! Both renderers then estimate the same picture: box filter, linear Rec. 709, a path integrator
//! whose `max_depth` is one more than the number of bounces here, since it counts the edges of a
//! path. Every instance becomes a shape of its own.
//!
//! Exported exactly, but for rounding to f32: spheres, boxes, polygons, polyhedra, meshes, and
//! cylinders, where their transforms allow it; surfaces that only reflect diffusely; smooth and
//! rough dielectrics, thin ones, and mirrors; emission; point and directional lights, a constant
//! background, and environment maps; both cameras. [`Notes`] count what is only similar there,
//! and what is missing:
//!
//! - metallic-roughness materials with a highlight become `principled` (Disney's; another Fresnel
//!   term and another diffuse lobe), those of full metal `roughconductor` with the same GGX
//!   distribution, but Smith's masking as a product and no Schlick term;
//! - a half-space becomes a large square;
//! - a flat shape shines on one side only, that towards the middle of the scene;
//! - the ball of a point light, rectangles and discs of light can be seen; a spot light fades linearly with the angle; the disc
//!   of a directional light is a point;
//! - CSG solids, ellipsoids, cones, prisms, quadrics and implicit surfaces, and spheres and
//!   cylinders under transforms that deform them, are missing.

mod looks;
mod shapes;

use crate::math::Affine;
use crate::scene::{Camera, Instances, Material, Scene, coarse_corners};
use glam::DVec3;
use std::collections::BTreeMap;
use std::fmt::Write;
use thiserror::Error;

/// The most instances that are written, each a shape of the file.
const MOST_INSTANCES: u64 = 1 << 17;

/// The reasons why a scene cannot be exported.
#[derive(Debug, Error)]
pub enum MitsubaError {
    #[error(
        "{count} instances are too many for Mitsuba, which gets a shape for each; at most {limit} \
         are written"
    )]
    TooManyInstances { count: u64, limit: u64 },
    #[error("the scene, as Mitsuba is to have it, has a number beyond f32: {line}")]
    TooLarge { line: String },
    #[error("nothing of the scene can be written for Mitsuba: {left_out}")]
    Nothing { left_out: String },
}

/// What a file of the export says about the picture.
#[derive(Clone, Debug)]
pub struct MitsubaPicture {
    pub width: u32,
    pub height: u32,
    /// The maximum number of bounces along a path.
    pub max_depth: u32,
    /// What the names of files beside the XML file begin with.
    pub stem: String,
}

/// A scene for Mitsuba.
#[derive(Debug)]
pub struct MitsubaScene {
    pub xml: String,
    /// The files beside the XML file: names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// One line about what is similar or missing; `None` if all is exact.
    pub warning: Option<String>,
}

/// Counts of what is similar or missing in Mitsuba, by kind.
#[derive(Debug, Default)]
struct Notes {
    similar: BTreeMap<String, usize>,
    missing: BTreeMap<String, usize>,
}

impl Notes {
    fn similar(&mut self, what: &str) {
        *self.similar.entry(what.into()).or_default() += 1;
    }

    fn missing(&mut self, what: &str) {
        *self.missing.entry(what.into()).or_default() += 1;
    }

    fn summary(&self) -> Option<String> {
        let parts = [
            ("not exported", &self.missing),
            ("only similar in Mitsuba", &self.similar),
        ];
        let parts: Vec<String> = parts
            .into_iter()
            .filter(|(_, counts)| !counts.is_empty())
            .map(|(what, counts)| {
                let list: Vec<String> = counts.iter().map(|(k, n)| format!("{n} × {k}")).collect();
                format!("{what}: {}", list.join(", "))
            })
            .collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// The state of the export.
struct Writer<'s> {
    scene: &'s Scene,
    xml: String,
    files: Vec<(String, Vec<u8>)>,
    notes: Notes,
    stem: String,
    /// The middle of the scene's finite shapes, and the greatest distance of a corner of their
    /// box or of the camera from it.
    middle: DVec3,
    reach: f64,
    /// Rows of `files` by what they hold.
    meshes: BTreeMap<shapes::MeshKey, usize>,
}

/// Writes a complete scene, seen by `camera`. Fails if the scene has too many instances, or
/// numbers that Mitsuba's f32 does not hold, or nothing that Mitsuba has.
pub fn mitsuba_scene(
    scene: &Scene,
    instances: &Instances,
    camera: &Camera,
    picture: &MitsubaPicture,
) -> Result<MitsubaScene, MitsubaError> {
    let count = instances.count();
    if count > MOST_INSTANCES {
        return Err(MitsubaError::TooManyInstances {
            count,
            limit: MOST_INSTANCES,
        });
    }
    let corners = coarse_corners(scene);
    let (low, high) = corners
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(*p), high.max(*p))
        });
    let middle = match low.is_finite() && high.is_finite() {
        true => low * 0.5 + high * 0.5,
        false => DVec3::ZERO,
    };
    let far = corners.iter().map(|p| (*p - middle).length());
    let reach = far.fold((camera.eye - middle).length().max(1e-3), f64::max);
    let mut writer = Writer {
        scene,
        xml: String::from("<!-- Written by Lanecast. -->\n<scene version=\"3.0.0\">\n"),
        files: Vec::new(),
        notes: Notes::default(),
        stem: picture.stem.clone(),
        middle,
        reach,
        meshes: BTreeMap::new(),
    };
    writer.picture(picture, camera);
    writer.materials();
    writer.lights();
    let before = writer.xml.len();
    for instance in instances.iter(scene) {
        writer.instance(&instance);
    }
    if !writer.xml[before..].contains("<shape") {
        let left_out = writer.notes.summary().unwrap_or_default();
        return Err(MitsubaError::Nothing { left_out });
    }
    // Shapes without a material have one that is written only for them.
    if writer.xml[before..].contains(NO_MATERIAL) {
        let shapes = writer.xml.split_off(before);
        writer.material(NO_MATERIAL, &Material::default());
        writer.xml.push_str(&shapes);
    }
    writer.xml.push_str("</scene>\n");
    // Sums and products of finite numbers may be beyond f32.
    let mut lines = writer.xml.lines();
    match lines.find(|line| line.contains(BEYOND)) {
        Some(line) => Err(MitsubaError::TooLarge {
            line: line.trim().into(),
        }),
        None => Ok(MitsubaScene {
            warning: writer.notes.summary(),
            xml: writer.xml,
            files: writer.files,
        }),
    }
}

/// The material of shapes that have none.
const NO_MATERIAL: &str = "material_none";

/// What [`number`] writes for a number that f32 does not hold.
const BEYOND: &str = "beyond";

/// Writes a number with as many digits as identify the f64.
fn number(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if !(x.abs() < f64::from(f32::MAX)) {
        BEYOND.into()
    } else if (1e-5..1e15).contains(&x.abs()) {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|x| number(*x)).collect();
    numbers.join(", ")
}

fn rgb(color: [f32; 3]) -> String {
    list(&color.map(f64::from))
}

/// Writes a transform as `to_world`, whose matrix Mitsuba takes row by row.
fn to_world(map: &Affine) -> String {
    let [x, y, z] = *map.linear();
    let t = map.translation;
    let rows = [0, 1, 2].map(|k| [x[k], y[k], z[k], t[k]].map(number).join(" "));
    format!(
        "<transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/></transform>",
        rows.join(" ")
    )
}

/// Makes the transform whose columns are these.
fn frame(x: DVec3, y: DVec3, z: DVec3, origin: DVec3) -> Affine {
    Affine::new(
        [x.to_array(), y.to_array(), z.to_array()],
        origin.to_array(),
    )
}

impl Writer<'_> {
    /// Writes the integrator, and the camera with its film and sampler.
    fn picture(&mut self, picture: &MitsubaPicture, camera: &Camera) {
        let MitsubaPicture {
            width,
            height,
            max_depth,
            ..
        } = picture;
        let _ = writeln!(
            self.xml,
            "  <default name=\"spp\" value=\"64\"/>\n  <default name=\"seed\" value=\"0\"/>\n  \
             <default name=\"sampler\" value=\"independent\"/>\n  <integrator type=\"path\">\n    \
             <integer name=\"max_depth\" value=\"{}\"/>\n    \
             <integer name=\"rr_depth\" value=\"1000\"/>\n  </integrator>",
            max_depth + 1
        );
        self.camera(camera, f64::from(*width) / f64::from(*height));
        let _ = writeln!(
            self.xml,
            "    <sampler type=\"$sampler\"><integer name=\"sample_count\" value=\"$spp\"/>\
             <integer name=\"seed\" value=\"$seed\"/></sampler>\n    <film type=\"hdrfilm\">\n      \
             <integer name=\"width\" value=\"{width}\"/>\n      \
             <integer name=\"height\" value=\"{height}\"/>\n      \
             <string name=\"pixel_format\" value=\"rgb\"/>\n      \
             <string name=\"component_format\" value=\"float32\"/>\n      \
             <rfilter type=\"box\"/>\n    </film>\n  </sensor>"
        );
    }
}
