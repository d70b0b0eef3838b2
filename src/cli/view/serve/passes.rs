//! A picture in passes: coarse, then finer, then with more samples, at last the bytes of the file
//! that `render` writes.

use super::json;
use super::look::Shot;
use super::model::Model;
use super::outbox::Outbox;
use crate::error::CliError;
use crate::shutter;
use lanecast_io::{Development, Picture, png_bytes};
use lanecast_light::sampler::Kind as SamplerKind;
use lanecast_model::scene::Camera;
use lanecast_picture::render::{
    Backdrop, FinishedTile, Integrator, Merge, Progress, RenderConfig, Slices, View, legend,
    parts_of, render_blurred, render_samples, render_showing,
};
use rayon::ThreadPool;
use serde::Serialize;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

/// Seconds that a coarse picture may take: an input is answered within a tenth of a second.
const COARSE: f64 = 0.05;

/// The coarsest picture has a pixel for so many by so many.
const COARSEST: u32 = 16;

/// Pictures of fewer samples are rendered at once: their textures are filtered, those of parts of a
/// picture are not.
const LEAST_PARTED: u32 = 8;

/// How long a pixel took of late, by which the coarse picture is sized.
#[derive(Default)]
pub struct Pace {
    seconds_per_pixel: Option<f64>,
}

/// What a page is told beside a picture.
#[derive(Serialize)]
struct Header<'a> {
    kind: &'static str,
    id: u64,
    /// Whether these are the bytes of `render`.
    is_final: bool,
    width: u32,
    height: u32,
    samples: u32,
    of_samples: u32,
    rays: u64,
    /// Since the look was taken up.
    seconds: f64,
    legend: Option<&'a str>,
}

/// A complete picture before it is developed.
pub struct Finished {
    config: RenderConfig,
    camera: Camera,
    picture: Picture,
    samples: u32,
    rays: u64,
    legend: Option<String>,
}

impl Finished {
    /// Says whether a shot shows the same light.
    pub fn is_of(&self, shot: &Shot) -> bool {
        self.config == shot.config && self.camera == shot.camera
    }

    /// Sends the picture as the shot develops it.
    pub fn send(
        &self,
        (_, shot, id): (&Model, &Shot, u64),
        out: &Outbox,
        progress: &Progress,
    ) -> Result<(), CliError> {
        let start = Instant::now();
        let to = (id, out, progress, start);
        let done = (self.samples, self.rays);
        send(&self.picture, shot, to, done, self.legend.as_deref(), true)
    }
}

impl Pace {
    /// Returns by how much a picture has to be coarser to be done in time.
    fn divisor(&self, config: &RenderConfig) -> u32 {
        let pixels = f64::from(config.width) * f64::from(config.height);
        let Some(pace) = self.seconds_per_pixel else {
            return COARSEST.min(config.width).min(config.height).max(1);
        };
        let mut divisor = 1;
        while divisor < COARSEST && pixels * pace / f64::from(divisor * divisor) > COARSE {
            divisor *= 2;
        }
        divisor
    }
}

/// Renders a shot in passes, each of which is sent. Ends early if `progress` is cancelled.
pub fn draw(
    (model, shot, id): (&Model, &Shot, u64),
    out: &Outbox,
    pool: &ThreadPool,
    progress: &Progress,
    pace: &mut Pace,
) -> Result<Finished, CliError> {
    let (world, kernels) = model.shown(shot, pool)?;
    let job = Job {
        view: View {
            world: &world,
            kernels,
            camera: shot.camera,
            lights: &shot.scene.lights,
        },
        shot,
        id,
        out,
        progress,
        start: Instant::now(),
    };
    pool.install(|| job.draw(pace))
}

struct Job<'a> {
    view: View<'a>,
    shot: &'a Shot,
    id: u64,
    out: &'a Outbox,
    progress: &'a Progress,
    start: Instant,
}

impl Job<'_> {
    fn draw(&self, pace: &mut Pace) -> Result<Finished, CliError> {
        let config = &self.shot.config;
        let mut divisor = pace.divisor(config);
        while divisor > 1 {
            self.coarse(divisor, pace)?;
            // A pass that is a fourth as fine costs a sixteenth of the next.
            divisor = pace.divisor(config).min(divisor / 4);
        }
        let path = Path::new("the scene");
        let slices = shutter::slices(&self.view, self.shot.row, config, self.shot.slices, path)?;
        let finished = match is_parted(config) {
            true => self.parted(slices.as_ref())?,
            false => self.whole(config, slices.as_ref())?,
        };
        let done = (finished.samples, finished.rays);
        let to = (self.id, self.out, self.progress, self.start);
        send(
            &finished.picture,
            self.shot,
            to,
            done,
            finished.legend.as_deref(),
            true,
        )?;
        Ok(finished)
    }

    /// Renders one sample of each pixel of a smaller picture.
    fn coarse(&self, divisor: u32, pace: &mut Pace) -> Result<(), CliError> {
        let config = RenderConfig {
            width: self.shot.config.width.div_ceil(divisor),
            height: self.shot.config.height.div_ceil(divisor),
            ..single(&self.shot.config)
        };
        let start = Instant::now();
        let rendered = render_showing(&self.view, &config, self.progress, &|_| ())?;
        let pixels = f64::from(config.width) * f64::from(config.height);
        pace.seconds_per_pixel = Some(start.elapsed().as_secs_f64() / pixels);
        self.show(&rendered.picture, (1, rendered.counts.total()))
    }

    /// Renders a picture at once, and sends its tiles as they are finished.
    fn whole(&self, config: &RenderConfig, slices: Option<&Slices>) -> Result<Finished, CliError> {
        let development: &Development = &self.shot.development;
        let on_tile = |tile: FinishedTile| self.out.tile(self.id, &tile, development);
        let rendered = match slices {
            Some(slices) => render_blurred(&self.view, slices, config, self.progress, &on_tile)?,
            None => render_showing(&self.view, config, self.progress, &on_tile)?,
        };
        let samples = rendered
            .reached
            .map_or(config.samples(), |r| r.mean_samples as u32);
        let legend = match config.integrator {
            Integrator::Inspect(what) => Some(legend(what, &rendered.readings)),
            _ => None,
        };
        Ok(Finished {
            config: config.clone(),
            camera: self.view.camera,
            picture: rendered.picture,
            samples,
            rays: rendered.counts.total(),
            legend,
        })
    }

    /// Renders a picture by twice as many samples at a time, whose sums have the bits of the whole.
    fn parted(&self, slices: Option<&Slices>) -> Result<Finished, CliError> {
        let config = &self.shot.config;
        self.whole(&single(config), slices)?;
        let (mut merge, mut rays) = (Merge::default(), 0);
        let size = (config.width, config.height);
        let has_alpha = config.backdrop == Backdrop::Transparent;
        for part in doubling(config.samples()) {
            let (len, end) = (part.len() as u32, part.end);
            let view = (&self.view, slices);
            let (sums, counts) = render_samples(view, config, part, self.progress)?;
            merge.add_sums(len, sums);
            rays += counts.total();
            if end < config.samples() {
                self.show(&merge.clone().mean(size, has_alpha)?, (end, rays))?;
            }
        }
        Ok(Finished {
            config: config.clone(),
            camera: self.view.camera,
            picture: merge.mean(size, has_alpha)?,
            samples: config.samples(),
            rays,
            legend: None,
        })
    }

    fn show(&self, picture: &Picture, done: (u32, u64)) -> Result<(), CliError> {
        let to = (self.id, self.out, self.progress, self.start);
        send(picture, self.shot, to, done, None, false)
    }
}

/// Sends a picture with its numbers of samples and rays, unless it is not waited for any more.
fn send(
    picture: &Picture,
    shot: &Shot,
    (id, out, progress, start): (u64, &Outbox, &Progress, Instant),
    (samples, rays): (u32, u64),
    legend: Option<&str>,
    is_final: bool,
) -> Result<(), CliError> {
    let png = png_bytes(picture, &shot.development, Path::new("view.png"))?;
    // It would be shown in place of the next.
    if progress.is_cancelled() {
        return Err(CliError::Interrupted);
    }
    let header = Header {
        kind: "picture",
        id,
        is_final,
        width: picture.width,
        height: picture.height,
        samples,
        of_samples: shot.config.samples(),
        rays,
        seconds: start.elapsed().as_secs_f64(),
        legend,
    };
    out.picture(&json(&header), &png);
    Ok(())
}

/// Says whether samples of a picture can be taken some at a time without a change of its bits.
fn is_parted(config: &RenderConfig) -> bool {
    matches!(config.integrator, Integrator::Path | Integrator::Ao)
        && config.samples() >= LEAST_PARTED
        && config.adaptive.is_none()
        && config.caching.is_none()
        && config.sampler != SamplerKind::Stratified
        && !matches!(config.backdrop, Backdrop::Color(_))
}

/// Returns the configuration of a picture of one sample.
fn single(config: &RenderConfig) -> RenderConfig {
    RenderConfig {
        spp: 1,
        adaptive: None,
        caching: None,
        ..config.clone()
    }
}

/// Divides samples into parts, each of as many as all before.
fn doubling(samples: u32) -> Vec<Range<u32>> {
    let mut parts = Vec::new();
    let mut next = 0..2;
    while next.end <= samples {
        parts.push(next.clone());
        next = next.end..2 * next.end;
    }
    parts.extend(parts_of(next.start..samples));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_picture::render::is_part;

    #[test]
    fn parts_double_and_cover_all_samples() {
        assert_eq!(doubling(16), [0..2, 2..4, 4..8, 8..16]);
        for samples in 1..200 {
            let parts = doubling(samples);
            assert!(parts.iter().all(is_part), "{parts:?}");
            let mut end = 0;
            for part in parts {
                assert_eq!(part.start, end);
                end = part.end;
            }
            assert_eq!(end, samples);
        }
    }

    #[test]
    fn slow_pictures_begin_coarse() {
        let config = RenderConfig::default();
        let at = |seconds_per_pixel| Pace { seconds_per_pixel }.divisor(&config);
        assert_eq!(at(None), 16);
        assert_eq!(at(Some(1e-9)), 1);
        assert_eq!(at(Some(1e-7)), 2);
        assert_eq!(at(Some(1.0)), 16);
    }
}
