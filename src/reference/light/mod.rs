//! The reference's own light: a scalar path tracer in f64, of textbook formulas.
//!
//! It is the oracle of the path integrator and shares no line with it: hits are those of the
//! exact [`Reference`], random numbers those of the crate `sobol_burley`, BSDFs, emitters and
//! maps are written from the papers. Its maps from random numbers to decisions and directions
//! are mathematically those of the path integrator, so that both trace the same path up to
//! rounding, and samples can be compared one by one. [`LightReference::trace`] traces by
//! itself; [`LightReference::follow`] follows a recorded path and checks each step of it.
//!
//! What it does not know it refuses ([`Unknown`]).

pub mod bsdf;
pub mod emitters;
mod filter;
mod follow;
mod inside;
mod maps;
mod matter;
mod path;
mod rounding;
mod sampler;
mod scatter;
mod smooth;
mod surface;

pub use filter::Profile;
pub use follow::{DIRECTION, Followed, Miss, WEIGHT, error};
pub use rounding::{ORIGIN, OTHER, Spread, chord_of, extent, ray_apart};

use crate::Reference;
use crate::scene::{Camera, CsgSolid, Environment, Light, Shape};
use bsdf::Color;
use emitters::Emitters;
use filter::Filter;
use inside::Media;
use matter::Matter;
use sampler::Sobol;
use std::collections::HashMap;

/// What paths depend on beside the scene.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    pub camera: Camera,
    /// The picture's size in pixels.
    pub size: [u32; 2],
    pub seed: u64,
    pub frame: u32,
    pub filter: Profile,
    /// The maximum number of times that a path is scattered.
    pub max_depth: u32,
    /// What camera rays see where they meet nothing, in place of the sky.
    pub backdrop: Option<[f32; 3]>,
    /// Media touch or overlap, so that solids tell which are where (S75).
    pub asks_solids: bool,
    /// The eye lies in a medium.
    pub eye_inside: bool,
}

/// A feature of the scene that the reference does not know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown(pub &'static str);

/// A ray of a path, what it meets, and the ray from there to a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    /// The path's weight on the ray, before the medium on its way absorbs.
    pub weight: Color,
    /// Instance and primitive; none for the sky.
    pub met: Option<(u64, u32)>,
    pub light: Option<LightRay>,
}

/// A ray towards sampled light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRay {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_max: f64,
    /// What the pixel gets if it arrives.
    pub weight: Color,
    pub blocked: bool,
}

/// A traced path.
#[derive(Clone, Debug, Default)]
pub struct Path {
    pub radiance: Color,
    pub vertices: Vec<Vertex>,
}

/// The oracle of a scene's light.
pub struct LightReference<'a> {
    reference: &'a Reference<'a>,
    settings: Settings,
    /// By material, and last that of surfaces without one.
    matter: Vec<Matter>,
    emitters: Emitters,
    sobol: Sobol,
    filter: Filter,
    /// CSG solids that are placed, by row.
    solids: HashMap<u32, CsgSolid>,
    /// Instances whose surfaces bound media, where solids tell which media are where.
    bounding: Vec<u64>,
    around_eye: Media,
}

impl<'a> LightReference<'a> {
    /// Prepares the scene's materials and emitters; `lights` may replace those of the scene.
    pub fn new(
        reference: &'a Reference<'a>,
        lights: &[Light],
        environment: Option<&Environment>,
        settings: Settings,
    ) -> Result<LightReference<'a>, Unknown> {
        let scene = reference.scene();
        if !scene.textures.is_empty() {
            return Err(Unknown("textures, patterns and colours of vertices"));
        }
        let materials = &scene.materials.rows;
        let nothing = crate::scene::Material::default();
        let matter = materials.iter().chain([&nothing]).map(Matter::new);
        let mut solids = HashMap::new();
        for row in reference.rows.iter() {
            if let Shape::Csg(id) = scene.shapes.row(row.shape) {
                let unfold = || CsgSolid::of(scene, id);
                solids.entry(id.0).or_insert_with(unfold);
            }
        }
        let mut all = LightReference {
            reference,
            settings,
            matter: matter.collect::<Result<_, _>>().map_err(Unknown)?,
            emitters: Emitters::new(scene, &reference.rows, lights, environment)
                .map_err(Unknown)?,
            sobol: Sobol::new(settings.seed, settings.frame),
            filter: Filter::new(settings.filter),
            solids,
            bounding: Vec::new(),
            around_eye: Media::default(),
        };
        if settings.asks_solids || settings.eye_inside {
            all.bounding = all.media_bounds().map_err(Unknown)?;
            all.around_eye = all.media_at(settings.camera.eye);
        }
        Ok(all)
    }
}
