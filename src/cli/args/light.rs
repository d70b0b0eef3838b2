//! Options of how light is found: integrator, samples, pixel filter.

use super::values::one_of;
use crate::error::CliError;
use crate::looks::beyond_direct;
use crate::output::complain;
use clap::{Args, value_parser};
use lanecast_light::filter::Kind as FilterKind;
use lanecast_light::sampler::Kind as SamplerKind;
use lanecast_model::scene::{Camera, Tables};
use lanecast_picture::render::{
    Adaptive, Cost, Grid, IndirectCaching, Inspection, Integrator, RenderConfig,
};
use std::ops::Range;
use std::path::PathBuf;

const MOST_SAMPLES: u32 = RenderConfig::MOST_SAMPLES;

#[derive(Args)]
pub struct LightArgs {
    /// How light is found: direct (lights without extent, mirrors and glass), path (paths from
    /// all that shines, scattered everywhere), ao (how much of a white sky surfaces see), or
    /// auto, which is path where only it finds all light of the scene, or the scene has none; or what
    /// is shown in its place, by a ray through each pixel: normals, uv, ids, depth (along the view axis,
    /// white where the scene begins), albedo (colours of materials), edges (feature lines of a drawing), or heat (what the ray costs; heat:nodes, heat:tests or
    /// heat:escalations for a part of it)
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse_integrator)]
    pub integrator: IntegratorChoice,
    /// Stand the scene on a matte ground that goes over into the background; seen by paths
    #[arg(long)]
    pub ground: bool,
    /// Samples per pixel; paths are noisier by half at a fourth, and best at powers of two
    /// [default: 64 for paths and with a shutter, else 1]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=65_536))]
    pub spp: Option<u32>,
    /// Render only the samples A to B - 1 of each pixel of a picture of paths, and write their
    /// sums, which lanecast merge adds up
    #[arg(long, value_name = "A..B", allow_hyphen_values = true, value_parser = parse_samples, conflicts_with_all = ["spp", "noise", "frames", "aov", "cryptomatte_levels", "metadata", "view_transform", "exposure", "dither", "bits"])]
    pub samples: Option<Samples>,
    /// Sample until the noise is below this, about that of a mid-grey, as 0.01; only paths
    #[arg(long, value_name = "NOISE", value_parser = parse_noise, conflicts_with = "spp")]
    pub noise: Option<f32>,
    /// Most samples per pixel of --noise [default: 1024]
    #[arg(long, value_name = "N", requires = "noise", conflicts_with = "spp", value_parser = value_parser!(u32).range(1..=65_536))]
    pub max_spp: Option<u32>,
    /// Interpolate light that surfaces have reflected to matte ones between records of a cache:
    /// irradiance (quick, and off by a little), or unbiased (some paths go on, and make up for
    /// what the cache is off)
    #[arg(long, value_name = "USE", value_parser = parse_cache)]
    pub cache: Option<CacheKind>,
    /// About the part of the light that records of --cache may be wrong by, 0.02 to 1; smaller is
    /// finer, and takes longer [default: 0.2]
    #[arg(long, value_name = "ERROR", requires = "cache", value_parser = parse_cache_error)]
    pub cache_error: Option<f64>,
    /// Begin --cache with the records of this file if it exists, and write to it those that are added:
    /// of one scene and the same settings, from whatever view. Pictures depend on what it holds
    #[arg(long, value_name = "FILE", requires = "cache", conflicts_with = "samples", value_parser = parse_cache_file)]
    pub cache_file: Option<PathBuf>,
    /// Keep records of --cache from frame to frame of --frames where nothing moves but the camera: on,
    /// or off, with which a frame has the bits that it has alone [default: on]
    #[arg(long, value_name = "USE", requires_all = ["cache", "frames"], conflicts_with = "cache_file", value_parser = parse_cache_keep)]
    pub cache_keep: Option<bool>,
    /// Maximum number of reflections and refractions of a ray [default: 16 for paths, else 5]
    #[arg(long, alias = "max-depth", value_name = "N", value_parser = value_parser!(u32).range(0..=255))]
    pub max_bounces: Option<u32>,
    /// Random numbers of paths: sobol (Owen-scrambled), stratified or independent [default: sobol]
    #[arg(long, value_name = "NAME", value_parser = parse_sampler)]
    pub sampler: Option<SamplerKind>,
    /// Pixel filter of paths: blackman-harris, gaussian, mitchell or box [default: blackman-harris]
    #[arg(long, value_name = "NAME", value_parser = parse_filter)]
    pub filter: Option<FilterKind>,
}

/// How a cache of indirect light is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CacheKind {
    Irradiance,
    Unbiased,
}

/// A range of a pixel's samples.
#[derive(Clone, Debug)]
pub struct Samples(pub Range<u32>);

/// The integrator of `--integrator`; `None` is the one that the scene needs.
#[derive(Clone, Copy, Debug)]
pub struct IntegratorChoice(pub Option<Integrator>);

impl LightArgs {
    /// Refuses options that the integrator would not heed.
    pub fn check(&self) -> Result<(), CliError> {
        let Some(Integrator::Inspect(_)) = self.integrator.0 else {
            return Ok(());
        };
        let given = [
            ("--spp", self.spp.is_some()),
            ("--samples", self.samples.is_some()),
            ("--noise", self.noise.is_some()),
            ("--max-bounces", self.max_bounces.is_some()),
            ("--sampler", self.sampler.is_some()),
            ("--filter", self.filter.is_some()),
        ];
        match given.iter().find(|(_, is)| *is) {
            Some((name, _)) => Err(CliError::Usage(format!(
                "this integrator shows what one ray through each pixel meets; leave out {name}"
            ))),
            None => Ok(()),
        }
    }

    /// Completes a configuration for a scene; refuses options that its integrator would not heed.
    pub fn complete(&self, config: RenderConfig, scene: &Tables) -> Result<RenderConfig, CliError> {
        let camera = scene.cameras.pick(config.camera.as_deref());
        let camera = camera.map_err(|e| CliError::Usage(e.to_string()))?;
        let needed = || match self.ground {
            true => Integrator::Path,
            false => needed_integrator(scene, camera, config.grid).0,
        };
        let integrator = self.integrator.0.unwrap_or_else(needed);
        let paths = matches!(integrator, Integrator::Path | Integrator::Ao);
        let of_paths = [
            ("--noise", self.noise.is_some()),
            ("--sampler", self.sampler.is_some()),
            ("--filter", self.filter.is_some()),
        ];
        if let (false, Some((name, _))) = (paths, of_paths.iter().find(|(_, is)| *is)) {
            return Err(CliError::Usage(format!(
                "{name} is for pictures of paths, and this one is not; leave it out, or ask for \
                 --integrator path"
            )));
        }
        let (spp, max_depth) = match integrator {
            Integrator::Direct if config.shutter.is_some() => (64, 5),
            Integrator::Direct => (config.spp, 5),
            Integrator::Path => (64, 16),
            Integrator::Ao => (64, 1),
            Integrator::Inspect(_) => (1, 0),
        };
        let spp = match config.grid {
            Grid::Centers => self.spp.unwrap_or(spp),
            Grid::Corners => 1,
        };
        if self.cache.is_some() && self.max_bounces.is_some_and(|depth| depth < 2) {
            return Err(CliError::Usage(
                "--cache is of light that is reflected twice; leave it out, or ask for --max-bounces \
                 2 or more"
                    .into(),
            ));
        }
        if self.cache.is_some() && config.shutter.is_some() {
            return Err(CliError::Usage(
                "--cache is for still pictures; leave it out, or ask for --shutter 0".into(),
            ));
        }
        if self.cache.is_some() && integrator != Integrator::Path {
            return Err(CliError::Usage(
                "--cache is for --integrator path; leave it out, or ask for that".into(),
            ));
        }
        if integrator == Integrator::Ao && self.max_bounces.is_some() {
            return Err(CliError::Usage(
                "--max-bounces is of light, which --integrator ao does not follow; leave it out"
                    .into(),
            ));
        }
        let adaptive = self.noise.map(|noise| Adaptive {
            noise,
            most: self.max_spp.unwrap_or(1024),
        });
        if let (Some(adaptive), Some(asked)) = (&adaptive, self.max_spp)
            && adaptive.most() != asked
        {
            complain(&format!(
                "note: passes end at powers of two: --max-spp {asked} is {}",
                adaptive.most()
            ));
        }
        let filter = self.filter.unwrap_or(config.filter);
        let asked = adaptive.map_or(spp, |adaptive| adaptive.most());
        let spp = filter.samples(asked);
        if spp != asked {
            complain(&format!(
                "note: --filter mitchell takes 1, 2, 4, 8 or a multiple of 16 samples, of which 1 in \
                 16 is negative: {asked} is {spp}"
            ));
        }
        Ok(RenderConfig {
            integrator,
            adaptive,
            caching: self.cache.map(|kind| IndirectCaching {
                is_unbiased: kind == CacheKind::Unbiased,
                error: self.cache_error.unwrap_or(0.2),
            }),
            spp,
            max_depth: self.max_bounces.unwrap_or(max_depth),
            sampler: self.sampler.unwrap_or(config.sampler),
            filter,
            ..config
        })
    }
}

/// Returns the integrator that a scene needs, and why.
pub fn needed_integrator(
    scene: &Tables,
    camera: Option<usize>,
    grid: Grid,
) -> (Integrator, &'static str) {
    if grid == Grid::Corners {
        // One ray through each corner is no estimate of anything.
        return (Integrator::Direct, "one ray through each corner");
    }
    if scene.is_dark() {
        return (
            Integrator::Path,
            "the scene brings no light, and gets a studio",
        );
    }
    if scene.has_soft_light() {
        let why = "only paths find light of things with an extent";
        return (Integrator::Path, why);
    }
    if camera.is_some_and(|row| has_lens(&scene.cameras.rows[row])) {
        return (Integrator::Path, "only paths go through a lens");
    }
    match beyond_direct(scene).is_empty() {
        false => (
            Integrator::Path,
            "only paths show what the materials have beside colour, metal and glass",
        ),
        true => (Integrator::Direct, "no light of the scene has an extent"),
    }
}

/// Says whether a camera's lens blurs anything.
pub fn has_lens(camera: &Camera) -> bool {
    camera.lens.is_some_and(|lens| lens.radius > 0.0)
}

fn parse_integrator(text: &str) -> Result<IntegratorChoice, String> {
    let choice = |integrator| IntegratorChoice(Some(integrator));
    let inspect = |what| choice(Integrator::Inspect(what));
    one_of(
        text,
        &[
            ("auto", IntegratorChoice(None)),
            ("direct", choice(Integrator::Direct)),
            ("path", choice(Integrator::Path)),
            ("ao", choice(Integrator::Ao)),
            ("normals", inspect(Inspection::Normals)),
            ("uv", inspect(Inspection::Uv)),
            ("ids", inspect(Inspection::Ids)),
            ("depth", inspect(Inspection::Depth)),
            ("albedo", inspect(Inspection::Albedo)),
            ("edges", inspect(Inspection::Edges)),
            ("heat", inspect(Inspection::Heat(Cost::All))),
            ("heat:nodes", inspect(Inspection::Heat(Cost::Nodes))),
            ("heat:tests", inspect(Inspection::Heat(Cost::Tests))),
            (
                "heat:escalations",
                inspect(Inspection::Heat(Cost::Escalations)),
            ),
        ],
    )
}

fn parse_samples(text: &str) -> Result<Samples, String> {
    let number = |text: &str| text.trim().parse::<u32>().ok();
    let ends = text.split_once("..").map(|(a, b)| (number(a), number(b)));
    match ends {
        Some((Some(start), Some(end))) if start < end && end <= MOST_SAMPLES => {
            Ok(Samples(start..end))
        }
        _ => Err(format!(
            "write the first sample and the one after the last, at most {MOST_SAMPLES}, such as \
             64..128"
        )),
    }
}

fn parse_noise(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(x) if (1e-4..=1.0).contains(&x) => Ok(x),
        _ => Err("write a number from 0.0001 to 1, such as 0.01".into()),
    }
}

fn parse_cache(text: &str) -> Result<CacheKind, String> {
    let known = [
        ("irradiance", CacheKind::Irradiance),
        ("unbiased", CacheKind::Unbiased),
    ];
    one_of(text, &known)
}

fn parse_cache_error(text: &str) -> Result<f64, String> {
    let error = text.parse().ok().filter(|e| (0.02..=1.0).contains(e));
    error.ok_or_else(|| "write a number from 0.02 to 1, such as 0.2".into())
}

fn parse_cache_file(text: &str) -> Result<PathBuf, String> {
    match text {
        "" | "-" => Err("name a file, which is read and written".into()),
        file => Ok(file.into()),
    }
}

fn parse_cache_keep(text: &str) -> Result<bool, String> {
    one_of(text, &[("on", true), ("off", false)])
}

fn parse_sampler(text: &str) -> Result<SamplerKind, String> {
    one_of(
        text,
        &[
            ("sobol", SamplerKind::Sobol),
            ("stratified", SamplerKind::Stratified),
            ("independent", SamplerKind::Independent),
        ],
    )
}

fn parse_filter(text: &str) -> Result<FilterKind, String> {
    one_of(
        text,
        &[
            ("blackman-harris", FilterKind::BlackmanHarris),
            ("gaussian", FilterKind::Gaussian),
            ("mitchell", FilterKind::Mitchell),
            ("box", FilterKind::Box),
        ],
    )
}
