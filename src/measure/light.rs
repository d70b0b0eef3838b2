//! Compares the path integrator's samples with those of the reference's own path tracer.
//!
//! Both trace each sample by the same random numbers. Where they differ by more than rounding,
//! the path is traced again alone and recorded, and the reference follows the record vertex
//! by vertex (`LightReference::follow`). Then the difference is explained if each recorded step
//! is what the reference does there up to rounding, and the two paths part where a decision
//! turned: rays that are rounded differently meet different primitives, one light ray is
//! blocked and the other is not, or a random number lies at the threshold of a choice. If all
//! decisions are the same, rounding has grown along the path, and the difference has to lie
//! within the bound that the reference derives for this path (`LightReference::spread`).

use lanecast_engine::trace::HitId;
use lanecast_light::filter::Kind;
use lanecast_model::scene::{Projection, Rgb, studio};
use lanecast_picture::render::{Block, PathProbe, Progress, RenderConfig, View};
use lanecast_picture::shade::path::PathVertex;
use lanecast_reference::Reference;
use lanecast_reference::light::{
    DIRECTION, LightRay, LightReference, ORIGIN, OTHER, Path, Profile, Settings, Spread, Unknown,
    Vertex, WEIGHT, chord_of, error, extent, ray_apart,
};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use thiserror::Error;

/// Side of the blocks of pixels that are compared at once.
const SIDE: u32 = 16;

/// Where rounding may turn rays by more than this chord, their bounds say nothing of radiance.
const CHAOTIC: f64 = 0.25;

/// Samples of less radiance than this are black up to rounding.
const BLACK: f64 = 1e-7;

/// Why light is not compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LightError {
    #[error("verify --light does not know {0}")]
    Unknown(&'static str),
    #[error("interrupted")]
    Interrupted,
}

impl From<Unknown> for LightError {
    fn from(Unknown(what): Unknown) -> LightError {
        LightError::Unknown(what)
    }
}

/// Numbers of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LightCounts {
    pub samples: u64,
    /// That differ by no more than rounding.
    pub same: u64,
    /// Explained: the paths meet different primitives.
    pub other_hit: u64,
    /// Explained: a light ray is blocked in one of them.
    pub other_shadow: u64,
    /// Explained: a random number lies at the threshold of a choice.
    pub other_choice: u64,
    /// Within the bound that is derived for the path: the same decisions, and rounding that
    /// has grown.
    pub grown: u64,
    /// The greatest part of its bound that a grown difference takes.
    pub grown_part: f64,
    pub unexplained: u64,
    /// The greatest relative difference of those that are the same.
    pub greatest: f64,
    /// Pixels with a sample that is explained or not.
    pub pixels: u64,
}

/// What the comparison found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LightComparison {
    pub counts: LightCounts,
    /// The first samples without an explanation, in the order of the pixels.
    pub unexplained: Vec<String>,
}

impl LightComparison {
    fn append(mut self, other: LightComparison) -> LightComparison {
        let (a, b) = (&mut self.counts, &other.counts);
        a.samples += b.samples;
        a.same += b.same;
        a.other_hit += b.other_hit;
        a.other_shadow += b.other_shadow;
        a.other_choice += b.other_choice;
        a.grown += b.grown;
        a.grown_part = a.grown_part.max(b.grown_part);
        a.unexplained += b.unexplained;
        a.greatest = a.greatest.max(b.greatest);
        a.pixels += b.pixels;
        self.unexplained.extend(other.unexplained);
        self
    }
}

/// Compares all samples of a picture; lists at most `list` unexplained ones.
pub fn verify_light(
    view: &View,
    config: &RenderConfig,
    reference: &Reference,
    list: usize,
    progress: &Progress,
) -> Result<LightComparison, LightError> {
    let probe = PathProbe::new(view, config, progress);
    let probe = probe.ok_or(LightError::Unknown("integrators without paths"))?;
    if config.sampler != lanecast_light::sampler::Kind::Sobol || config.spp > 1 << 16 {
        return Err(LightError::Unknown("samplers but sobol"));
    }
    if view.camera.lens.is_some() {
        return Err(LightError::Unknown("lenses"));
    }
    let pinhole = matches!(
        view.camera.projection,
        Projection::Perspective { .. } | Projection::Orthographic { .. }
    );
    if !pinhole {
        return Err(LightError::Unknown(
            "cameras but perspective and orthographic",
        ));
    }
    let settings = Settings {
        camera: view.camera,
        size: [config.width, config.height],
        seed: config.seed,
        frame: 0,
        filter: match config.filter {
            Kind::Box => Profile::Box,
            Kind::Gaussian => Profile::Gaussian,
            Kind::Mitchell => Profile::Mitchell,
            Kind::BlackmanHarris => Profile::BlackmanHarris,
        },
        max_depth: config.max_depth,
        backdrop: probe.backdrop(),
        asks_solids: probe.asks_solids(),
        eye_inside: probe.eye_is_inside(),
    };
    let scene = &view.world.scene;
    let is_dark = scene.is_dark() && view.lights.is_empty();
    let made = is_dark.then(|| studio(&view.camera));
    let environment = scene.environment.as_ref().or(made.as_ref());
    let check = Check {
        probe: &probe,
        light: LightReference::new(reference, view.lights, environment, settings)?,
    };
    let (columns, rows) = (config.width.div_ceil(SIDE), config.height.div_ceil(SIDE));
    progress.start(columns * rows);
    let block = |number: u32| {
        let corner = (number % columns * SIDE, number / columns * SIDE);
        let size = (
            SIDE.min(config.width - corner.0),
            SIDE.min(config.height - corner.1),
        );
        if progress.is_cancelled() {
            return LightComparison::default();
        }
        let found = check.block(Block { corner, size }, config.spp);
        progress.add_tile(u64::from(size.0 * size.1 * config.spp));
        found
    };
    let all: Vec<_> = (0..columns * rows).into_par_iter().map(block).collect();
    if progress.is_cancelled() {
        return Err(LightError::Interrupted);
    }
    let all = all.into_iter();
    let mut found = all.fold(LightComparison::default(), LightComparison::append);
    found.unexplained.truncate(list);
    Ok(found)
}

struct Check<'a> {
    probe: &'a PathProbe<'a>,
    light: LightReference<'a>,
}

impl Check<'_> {
    /// Compares all samples of a block of pixels.
    fn block(&self, block: Block, spp: u32) -> LightComparison {
        let (width, height) = block.size;
        let samples = self.probe.samples(block);
        let mut found = LightComparison::default();
        for row in 0..width * height {
            let pixel = [block.corner.0 + row % width, block.corner.1 + row / width];
            let mut differs = false;
            for sample in 0..spp {
                let traced = samples[(sample * width * height + row) as usize];
                differs |= self.compare(pixel, sample, traced, &mut found);
            }
            found.counts.pixels += u64::from(differs);
        }
        found
    }

    /// Compares a sample, and says whether it differs.
    fn compare(
        &self,
        pixel: [u32; 2],
        sample: u32,
        traced: Rgb,
        found: &mut LightComparison,
    ) -> bool {
        let own = self.light.trace(pixel, sample);
        let counts = &mut found.counts;
        counts.samples += 1;
        let theirs = traced.map(f64::from);
        let apart = error(own.radiance, theirs);
        let is_black = |c: [f64; 3]| c.iter().all(|x| x.abs() <= BLACK);
        if apart <= WEIGHT || is_black(own.radiance) && is_black(theirs) {
            counts.same += 1;
            counts.greatest = counts
                .greatest
                .max(if apart <= WEIGHT { apart } else { 0.0 });
            return false;
        }
        let (alone, record) = self.probe.path((pixel[0], pixel[1]), sample);
        let record: Vec<Vertex> = record.iter().map(vertex).collect();
        let why = match alone.map(f32::to_bits) == traced.map(f32::to_bits) {
            true => self.explain((pixel, sample), theirs, &record, &own),
            false => Err(format!("traced alone it is {alone:?}")),
        };
        match why {
            Ok(Why::Hit) => counts.other_hit += 1,
            Ok(Why::Shadow) => counts.other_shadow += 1,
            Ok(Why::Choice) => counts.other_choice += 1,
            Ok(Why::Grown(part)) => {
                counts.grown += 1;
                counts.grown_part = counts.grown_part.max(part);
            }
            Err(why) => {
                counts.unexplained += 1;
                let [x, y] = pixel;
                let mut text = format!(
                    "pixel {x},{y}, sample {sample}: {traced:?}, the reference {:?}: {why}",
                    own.radiance
                );
                show(&mut text, &record, &own);
                found.unexplained.push(text);
            }
        }
        true
    }

    /// Finds why a recorded path brings other light than the reference's own.
    fn explain(
        &self,
        (pixel, sample): ([u32; 2], u32),
        theirs: [f64; 3],
        record: &[Vertex],
        own: &Path,
    ) -> Result<Why, String> {
        let followed = self.light.follow(pixel, sample, record);
        let followed =
            followed.map_err(|miss| format!("at depth {}: {}", miss.depth, miss.what))?;
        let within = |light: [f64; 3], spread: f64| {
            let size = light.into_iter().chain(theirs).fold(0.0, f64::max);
            let most = WEIGHT * size + BLACK + spread;
            let apart = error(light, theirs) * size;
            (
                apart / most,
                format!("{apart:.2e} from {light:?}, more than {most:.2e}"),
            )
        };
        let (part, text) = within(followed.radiance, 0.0);
        if part > 1.0 {
            let along = Path {
                radiance: followed.radiance,
                vertices: record.to_vec(),
            };
            let spread = self.light.spread((pixel, sample), &along, Some(record));
            if followed.turned > 0 || within(followed.radiance, spread.radiance).0 > 1.0 {
                return Err(format!("followed, it is {text}"));
            }
        }
        let spread = self.light.spread((pixel, sample), own, None);
        if let Some((depth, why)) = parting(record, own, &spread) {
            // Both decide rightly; so what they decide by has to be the same but for rounding.
            let (part, text) = rays_within(record, own, &spread, depth);
            return match part <= 1.0 {
                true => Ok(why),
                false => Err(text),
            };
        }
        if followed.turned > 0 {
            return Ok(Why::Choice);
        }
        let (part, text) = within(own.radiance, spread.radiance);
        if part <= 1.0 {
            return Ok(Why::Grown(part));
        }
        // What rays find may change faster than to first order. Each step of the record is right,
        // so it suffices that rounding explains the rays.
        let is_chaotic = |rays: &[f64; 2]| !(rays[1] <= CHAOTIC);
        if spread.rays.iter().any(is_chaotic) {
            return Err(format!("the same decisions, and {text}"));
        }
        let parts = (0..record.len()).map(|depth| rays_within(record, own, &spread, depth));
        let (most, far) = parts.fold((0.0, String::new()), |most, one| match one.0 > most.0 {
            true => one,
            false => most,
        });
        match most <= 1.0 {
            true => Ok(Why::Grown(most)),
            false => Err(format!("the same decisions, and {text}; {far}")),
        }
    }
}

/// Returns the part of their bounds that the rays of a depth lie apart, and says so.
fn rays_within(record: &[Vertex], own: &Path, spread: &Spread, depth: usize) -> (f64, String) {
    let far = ray_apart(&record[depth], &own.vertices[depth]);
    let more = spread.rays[depth];
    let most = [ORIGIN * extent(record) + more[0], DIRECTION + more[1]];
    let parts = [far[0] / most[0], far[1] / most[1]];
    let known = most[0].is_finite() && most[1].is_finite() && !parts[0].is_nan();
    let part = match known && !parts[1].is_nan() {
        true => f64::max(parts[0], parts[1]),
        false => f64::INFINITY,
    };
    let text = format!("rays of depth {depth} lie {far:?} apart, of {most:?}");
    (part, text)
}

/// Why a sample differs.
enum Why {
    Hit,
    Shadow,
    Choice,
    /// By this part of what rounding may do.
    Grown(f64),
}

/// Finds the depth at which two paths part first, and why. Where a ray's direction is another
/// one than rounding makes of it, another lobe was chosen before, or another emitter.
fn parting(record: &[Vertex], own: &Path, spread: &Spread) -> Option<(usize, Why)> {
    for (depth, (a, b)) in record.iter().zip(&own.vertices).enumerate() {
        let [_, chord] = ray_apart(a, b);
        if depth > 0 && chord > OTHER.max(DIRECTION + spread.rays[depth][1]) {
            return Some((depth - 1, Why::Choice));
        }
        if a.met != b.met {
            return Some((depth, Why::Hit));
        }
        match (a.light, b.light) {
            (Some(a), Some(b)) if a.blocked != b.blocked => return Some((depth, Why::Shadow)),
            (Some(a), Some(b)) if chord_of(a.dir, b.dir) > OTHER => {
                return Some((depth, Why::Choice));
            }
            (a, b) if a.is_some() != b.is_some() => return Some((depth, Why::Choice)),
            _ => {}
        }
    }
    let shorter = record.len().min(own.vertices.len());
    (record.len() != own.vertices.len()).then(|| (shorter - 1, Why::Choice))
}

fn vertex(v: &PathVertex) -> Vertex {
    Vertex {
        org: v.org,
        dir: v.dir,
        weight: v.weight.map(f64::from),
        met: (v.met != HitId::NONE).then_some((v.met.instance, v.met.primitive)),
        light: v.light.map(|light| LightRay {
            org: light.org,
            dir: light.dir,
            t_max: f64::from(light.t_max),
            weight: light.weight.map(f64::from),
            blocked: light.blocked,
        }),
    }
}

/// Prints two paths beside each other.
fn show(text: &mut String, record: &[Vertex], own: &Path) {
    for (name, vertices) in [("traced", record), ("reference", &own.vertices)] {
        for (depth, v) in vertices.iter().enumerate() {
            let _ = write!(
                text,
                "\n  {name} {depth}: from {:?} to {:?} meets {:?}, weight {:?}",
                v.org, v.dir, v.met, v.weight
            );
            if let Some(light) = &v.light {
                let blocked = if light.blocked { "blocked" } else { "clear" };
                let _ = write!(
                    text,
                    "\n    light {:?}, {blocked}, weight {:?}",
                    light.dir, light.weight
                );
            }
        }
    }
}
