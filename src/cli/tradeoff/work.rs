//! The measurement of one scene from one view: all its ways in turns, beside a converged picture.

use super::ways::{Way, ways};
use crate::denoise::Denoiser;
use crate::error::CliError;
use crate::output::{complain, printable_line};
use crate::pipeline::{Prepared, complete, structure};
use crate::progress::{Drawing, Style};
use crate::{interrupt, shutter};
use lanecast_engine::accel::World;
use lanecast_engine::trace::{RayKind, TracedRay};
use lanecast_io::{Channel, ChannelPicture, Encoding, LoadError};
use lanecast_measure::adversarial::Aimed;
use lanecast_measure::compare::{comparable, compare};
use lanecast_measure::tradeoff::{Point, mark_front, median};
use lanecast_measure::verify::{Counts, VerifyOptions, nearest_hits, replay_aimed};
use lanecast_measure::{Stats, Watch};
use lanecast_model::plan::{Plan, plan};
use lanecast_model::scene::Scene;
use lanecast_picture::render::{
    Integrator, Picture, Progress, RenderConfig, Rendered, View, render, render_blurred,
};
use lanecast_reference::{Hit, Reference};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The seed of the converged picture, so that its noise is not that of the others.
const CONVERGED_SEED: u64 = 0x5eed;

/// Seconds that a way takes, all its pictures together, after which it is not rendered again: what
/// takes long is measured well enough.
const LONG: f64 = 2.0;

/// What is measured, and how often.
pub struct Task<'a> {
    /// What messages call the scene.
    pub path: &'a Path,
    /// Pictures of each way.
    pub reps: u32,
    /// Samples per pixel of the converged picture, if not the default.
    pub converged: Option<u32>,
    pub style: Style,
    /// What denoises pictures of paths, where they are compared, too.
    pub denoiser: Option<&'a Denoiser>,
    pub progress: &'a Arc<Progress>,
}

/// What was measured of a scene.
pub struct Trade {
    pub points: Vec<Point>,
    /// A picture of each point.
    pub pictures: Vec<Picture>,
    pub truth: Picture,
    pub size: [u32; 2],
    pub threads: usize,
    /// Samples per pixel of the converged picture.
    pub converged: u32,
}

/// Renders a scene in all its ways, of which `base` is the first, and compares their pictures with a
/// converged one.
pub fn trade((scene, base): (Scene, RenderConfig), task: &Task) -> Result<Trade, CliError> {
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let prepared = complete(scene, task.path, &base, &mut watch, &mut stats)?;
    let denoises = task.denoiser.is_some();
    let ways = ways((&prepared.scene, &prepared.instances), &base, denoises);
    let (spp, converged) = converged(&base, task.converged);
    let work = Work {
        prepared: &prepared,
        task,
    };
    complain(&format!(
        "{} ways to render {}, up to {} times each, and a picture of {spp} spp to compare with",
        ways.len(),
        printable_line(&task.path.display().to_string()),
        task.reps
    ));
    let truth = work.picture_alone(&converged)?;
    let (mut points, pictures) = work.points(&ways, &channels(&truth))?;
    mark_front(&mut points);
    Ok(Trade {
        points,
        pictures,
        truth,
        size: [base.width, base.height],
        threads: prepared.pool.current_num_threads(),
        converged: spp,
    })
}

/// Returns the configuration of the converged picture, and its samples.
fn converged(base: &RenderConfig, asked: Option<u32>) -> (u32, RenderConfig) {
    let spp = asked.unwrap_or(match base.integrator {
        Integrator::Direct if base.shutter.is_none() => 64,
        _ => 1024,
    });
    let config = RenderConfig {
        spp,
        seed: CONVERGED_SEED,
        ..base.clone()
    };
    (spp, config)
}

/// What the reference says of the camera rays.
struct RayTruth<'a> {
    reference: Reference<'a>,
    nearest: Vec<Option<Hit>>,
}

struct Work<'a> {
    prepared: &'a Prepared,
    task: &'a Task<'a>,
}

impl Work<'_> {
    fn plan(&self, config: &RenderConfig) -> Result<Plan, CliError> {
        let prepared = self.prepared;
        plan(&prepared.scene, &prepared.instances, &config.choices)
            .map_err(|e| CliError::Usage(e.to_string()))
    }

    /// Builds a world; returns the seconds that it took.
    fn world(&self, config: &RenderConfig, plan: &Plan) -> Result<(World, f64), CliError> {
        let scene = match config.solver {
            Some(solver) => (self.prepared.scene.clone().solved_by(solver))
                .map_err(|source| LoadError::of_scene(self.task.path, source))?,
            None => self.prepared.scene.clone(),
        };
        let begin = Instant::now();
        let structure = structure(plan, &config.kd);
        let instances = &self.prepared.instances;
        let build = || World::build_to(config.build, &scene, instances, structure);
        let world = self.prepared.pool.install(build);
        Ok((world, begin.elapsed().as_secs_f64()))
    }

    fn render(
        &self,
        (world, plan): (&World, &Plan),
        config: &RenderConfig,
        recording: bool,
    ) -> Result<Rendered, CliError> {
        interrupt::check(self.task.progress)?;
        let view = View {
            world,
            kernels: plan.kernels,
            camera: self.prepared.camera,
            lights: &world.scene.lights,
        };
        let _drawing = Drawing::start(self.task.progress, self.task.style);
        let row = self.prepared.camera_row;
        self.prepared.pool.install(|| {
            let slices = shutter::slices(&view, row, config, None, self.task.path)?;
            Ok(match &slices {
                Some(slices) => render_blurred(&view, slices, config, self.task.progress, &|_| ())?,
                None => render(&view, config, recording, self.task.progress)?,
            })
        })
    }

    fn picture_alone(&self, config: &RenderConfig) -> Result<Picture, CliError> {
        let plan = self.plan(config)?;
        let (world, _) = self.world(config, &plan)?;
        Ok(self.render((&world, &plan), config, false)?.picture)
    }

    /// Traces each pixel's camera ray, through the middle.
    fn camera_rays(&self, config: &RenderConfig) -> Result<Vec<TracedRay>, CliError> {
        let config = RenderConfig {
            integrator: Integrator::Direct,
            spp: 1,
            max_depth: 0,
            adaptive: None,
            caching: None,
            shutter: None,
            ..config.clone()
        };
        let plan = self.plan(&config)?;
        let (world, _) = self.world(&config, &plan)?;
        let mut rays = self.render((&world, &plan), &config, true)?.record;
        rays.retain(|ray| ray.kind == RayKind::Primary && ray.depth == 0);
        Ok(rays)
    }

    /// Asks the reference about the camera rays of a way, which are those of all; `None` where it
    /// refuses the scene.
    fn truth(&self, config: &RenderConfig) -> Result<Option<RayTruth<'_>>, CliError> {
        let prepared = self.prepared;
        let Ok(reference) = Reference::new(&prepared.scene, &prepared.instances) else {
            return Ok(None);
        };
        let aimed = |ray: &TracedRay| Aimed {
            org: ray.org,
            dir: ray.dir,
            t_max: ray.t_max,
        };
        let rays: Vec<Aimed> = self.camera_rays(config)?.iter().map(aimed).collect();
        let nearest = prepared.pool.install(|| {
            nearest_hits(&reference, &rays, self.task.progress).map_err(|_| CliError::Interrupted)
        })?;
        Ok(Some(RayTruth { reference, nearest }))
    }

    /// Compares the camera rays of a way with what the reference says of them.
    fn compared(&self, config: &RenderConfig, truth: &RayTruth) -> Result<Counts, CliError> {
        let rays = self.camera_rays(config)?;
        let options = VerifyOptions::default();
        let RayTruth { reference, nearest } = truth;
        let compared = self.prepared.pool.install(|| {
            replay_aimed(reference, nearest, &rays, &options, self.task.progress)
                .map_err(|_| CliError::Interrupted)
        })?;
        Ok(compared.counts)
    }

    /// Renders a way's picture; returns the seconds that it took.
    fn timed(&self, way: &Way, (world, plan): (&World, &Plan)) -> Result<(Picture, f64), CliError> {
        let denoiser = self.task.denoiser.filter(|_| way.is_denoised);
        let config = match denoiser {
            Some(denoiser) => denoiser.rendered(way.config.clone())?,
            None => way.config.clone(),
        };
        let begin = Instant::now();
        let mut picture = self.render((world, plan), &config, false)?.picture;
        if let Some(denoiser) = denoiser {
            picture = denoiser
                .filter(&mut picture, &way.config.aovs, config.threads)?
                .0;
        }
        Ok((picture, begin.elapsed().as_secs_f64()))
    }

    /// Renders all ways in turns, and compares their pictures with the converged one.
    fn points(
        &self,
        ways: &[Way],
        truth: &ChannelPicture,
    ) -> Result<(Vec<Point>, Vec<Picture>), CliError> {
        let mut times = vec![Vec::new(); ways.len()];
        let mut builds = vec![Vec::new(); ways.len()];
        let mut pictures = Vec::new();
        for turn in 0..self.task.reps {
            for (i, way) in ways.iter().enumerate() {
                if times[i].iter().sum::<f64>() > LONG {
                    continue;
                }
                let plan = self.plan(&way.config)?;
                let (world, build) = self.world(&way.config, &plan)?;
                let (picture, seconds) = self.timed(way, (&world, &plan))?;
                times[i].push(seconds);
                builds[i].push(build);
                if turn == 0 {
                    pictures.push(picture);
                }
            }
        }
        let rays = self.truth(&ways[0].config)?;
        let counts = |way: &Way| {
            rays.as_ref()
                .map(|rays| self.compared(&way.config, rays))
                .transpose()
        };
        let own = counts(&ways[0])?;
        let mut points = Vec::new();
        for (i, way) in ways.iter().enumerate() {
            let picture = channels(&pictures[i]);
            let names = comparable((&picture, truth), None).unwrap_or_default();
            let found = compare((&picture, truth), &names, 0.0);
            let (seconds, spread) = median(std::mem::take(&mut times[i]));
            let rays = match way.changes_rays {
                true => counts(way)?,
                false => own,
            };
            points.push(Point {
                choice: way.choice,
                options: way.options.clone(),
                seconds,
                spread,
                build_seconds: median(std::mem::take(&mut builds[i])).0,
                wrong_pixels: rays.map(|rays| rays.wrong()),
                t_error: rays.map(|rays| rays.max_rel_t_error),
                normal_error: rays.map(|rays| rays.max_normal_error_deg),
                rmse: found.error.rmse,
                relmse: found.error.relmse,
                flip: found.flip.unwrap_or(f64::NAN),
                pareto: false,
            });
        }
        Ok((points, pictures))
    }
}

/// Returns a picture's colour as columns.
fn channels(picture: &Picture) -> ChannelPicture {
    let column = |k: usize| Channel::Numbers(picture.color.iter().map(|c| c[k]).collect());
    let channels = ["R", "G", "B"].map(String::from).into_iter().zip([0, 1, 2]);
    ChannelPicture {
        width: picture.width,
        height: picture.height,
        encoding: Encoding::Linear,
        channels: BTreeMap::from_iter(channels.map(|(name, k)| (name, column(k)))),
    }
}
