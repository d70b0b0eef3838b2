//! `lanecast tradeoff`: renders a scene in all ways that make a difference to it, and shows what each
//! takes and what it is off by.

mod ways;

use super::args::{TradeoffArgs, VERIFY_SIZE, needed_integrator};
use super::error::CliError;
use super::output::{Results, check_destinations, complain, printable_line};
use super::pipeline::{Prepared, complete, structure};
use super::progress::Drawing;
use super::{interrupt, scene, shutter};
use crate::accel::World;
use crate::io::{Channel, ChannelPicture, Encoding, LoadError};
use crate::measure::compare::{comparable, compare};
use crate::measure::plot::tradeoff_page;
use crate::measure::tradeoff::{Point, mark_front, median, within};
use crate::measure::verify::{VerifyOptions, replay};
use crate::measure::{Stats, Watch};
use crate::plan::{Plan, plan};
use crate::reference::Reference;
use crate::render::{
    Grid, Integrator, Picture, Progress, RenderConfig, Rendered, View, render, render_blurred,
};
use crate::scene::Scene;
use crate::trace::RayKind;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use ways::{Way, ways};

/// The seed of the converged picture, so that its noise is not that of the others.
const CONVERGED_SEED: u64 = 0x5eed;

/// Seconds that a way takes, all its pictures together, after which it is not rendered again: what
/// takes long is measured well enough.
const LONG: f64 = 2.0;

/// What `--json` gets.
#[derive(Serialize)]
struct Report<'a> {
    scene: String,
    size: [u32; 2],
    threads: usize,
    reps: u32,
    /// Samples per pixel of the converged picture.
    converged: u32,
    points: &'a [Point],
    /// The point that keeps the bounds of `--within`, by its number.
    #[serde(skip_serializing_if = "Option::is_none")]
    within: Option<usize>,
}

/// What was measured of a scene.
pub struct Trade {
    pub points: Vec<Point>,
    /// A picture of each point.
    pictures: Vec<Picture>,
    truth: Picture,
    size: [u32; 2],
    threads: usize,
    /// Samples per pixel of the converged picture.
    converged: u32,
}

pub fn run(args: &TradeoffArgs) -> Result<(), CliError> {
    let files: Vec<PathBuf> = args.html.iter().cloned().collect();
    let outputs = check_destinations(&[&args.scene], &files, args.json.iter())?;
    let progress = interrupt::watch();
    let loaded = scene::load(&args.scene, &args.import.load_options(outputs))?;
    let trade = trade(loaded, args, &progress)?;
    let points = &trade.points[..];
    let best = within(points, &args.within);
    let number = best.map(|best| {
        let same = |point: &&Point| std::ptr::eq(*point, best);
        points.iter().take_while(|point| !same(point)).count()
    });
    let report = Report {
        scene: args.scene.display().to_string(),
        size: trade.size,
        threads: trade.threads,
        reps: args.reps,
        converged: trade.converged,
        points,
        within: number.filter(|_| !args.within.is_empty()),
    };
    let mut results = Results::default();
    if let Some(path) = &args.html {
        let [width, height] = trade.size;
        let facts = vec![
            ("size", format!("{width}x{height}")),
            ("threads", report.threads.to_string()),
            ("pictures of each way", args.reps.to_string()),
            ("converged", format!("{} spp", trade.converged)),
        ];
        let shown = (points, &trade.pictures[..], &trade.truth);
        let html = tradeoff_page(&report.scene, facts, shown, path)?;
        results.outputs.add(path, html.into_bytes())?;
    }
    results.add(&args.json, &report)?;
    interrupt::check(&progress)?;
    if args.within.is_empty() {
        return results.commit(&table(points));
    }
    match best {
        Some(best) => results.commit(&format!("{}\n", best.options)),
        None => {
            results.commit("")?;
            Err(CliError::Short(
                "no way to render the scene keeps these bounds; --json and --html tell what there is"
                    .into(),
            ))
        }
    }
}

/// Renders a scene in all its ways, and compares their pictures with a converged one.
pub fn trade(
    loaded: Scene,
    args: &TradeoffArgs,
    progress: &Arc<Progress>,
) -> Result<Trade, CliError> {
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let size = args.size.unwrap_or(VERIFY_SIZE);
    let config = RenderConfig {
        width: size.width,
        height: size.height,
        threads: args.threads,
        camera: args.view.camera.clone(),
        ..RenderConfig::default()
    };
    let (loaded, config) = scene::viewed(loaded, config, &args.view, &args.scene)?;
    let (loaded, base) = own_way(loaded, config, args)?;
    let prepared = complete(loaded, &args.scene, &base, &mut watch, &mut stats)?;
    let ways = ways(&prepared.scene, &prepared.instances, &base);
    let (spp, converged) = converged(&base, args.converged);
    let work = Work {
        prepared: &prepared,
        args,
        progress,
    };
    complain(&format!(
        "{} ways to render {}, up to {} times each, and a picture of {spp} spp to compare with",
        ways.len(),
        printable_line(&args.scene.display().to_string()),
        args.reps
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

/// Returns the scene in the middle of its shutter, and how `render` would render it.
fn own_way(
    scene: Scene,
    config: RenderConfig,
    args: &TradeoffArgs,
) -> Result<(Scene, RenderConfig), CliError> {
    let row = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
    let exposure = args
        .shutter
        .exposure(&scene, row, (Grid::Centers, None), (0.0, 1.0))?;
    let integrator = needed_integrator(&scene, row, Grid::Centers).0;
    let (spp, max_depth) = match integrator {
        Integrator::Direct if exposure.is_some() => (64, 5),
        Integrator::Direct => (1, 5),
        _ => (64, 16),
    };
    let config = RenderConfig {
        integrator,
        spp,
        max_depth,
        shutter: exposure,
        ..config
    };
    let scene = match exposure {
        Some(exposure) => scene
            .at(exposure.middle())
            .map_err(|source| LoadError::of_scene(&args.scene, source))?,
        None => scene,
    };
    Ok((scene, config))
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

struct Work<'a> {
    prepared: &'a Prepared,
    args: &'a TradeoffArgs,
    progress: &'a Arc<Progress>,
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
                .map_err(|source| LoadError::of_scene(&self.args.scene, source))?,
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
        interrupt::check(self.progress)?;
        let view = View {
            world,
            kernels: plan.kernels,
            camera: self.prepared.camera,
            lights: &world.scene.lights,
        };
        let _drawing = Drawing::start(self.progress, self.args.progress.style);
        let row = self.prepared.camera_row;
        self.prepared.pool.install(|| {
            let slices = shutter::slices(&view, row, config, None, &self.args.scene)?;
            Ok(match &slices {
                Some(slices) => render_blurred(&view, slices, config, self.progress, &|_| ())?,
                None => render(&view, config, recording, self.progress)?,
            })
        })
    }

    fn picture_alone(&self, config: &RenderConfig) -> Result<Picture, CliError> {
        let plan = self.plan(config)?;
        let (world, _) = self.world(config, &plan)?;
        Ok(self.render((&world, &plan), config, false)?.picture)
    }

    /// Counts the pixels whose camera ray, through the middle, meets something else than the
    /// reference says; `None` where the reference refuses the scene.
    fn wrong_pixels(&self, config: &RenderConfig) -> Result<Option<u64>, CliError> {
        let prepared = self.prepared;
        let Ok(reference) = Reference::new(&prepared.scene, &prepared.instances) else {
            return Ok(None);
        };
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
        let options = VerifyOptions::default();
        let compared = prepared.pool.install(|| {
            replay(&reference, &rays, &options, self.progress).map_err(|_| CliError::Interrupted)
        })?;
        Ok(Some(compared.counts.wrong()))
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
        for turn in 0..self.args.reps {
            for (i, way) in ways.iter().enumerate() {
                if times[i].iter().sum::<f64>() > LONG {
                    continue;
                }
                let plan = self.plan(&way.config)?;
                let (world, build) = self.world(&way.config, &plan)?;
                let begin = Instant::now();
                let rendered = self.render((&world, &plan), &way.config, false)?;
                times[i].push(begin.elapsed().as_secs_f64());
                builds[i].push(build);
                if turn == 0 {
                    pictures.push(rendered.picture);
                }
            }
        }
        let own_wrong = self.wrong_pixels(&ways[0].config)?;
        let mut points = Vec::new();
        for (i, way) in ways.iter().enumerate() {
            let picture = channels(&pictures[i]);
            let names = comparable((&picture, truth), None).unwrap_or_default();
            let found = compare((&picture, truth), &names, 0.0);
            let (seconds, spread) = median(std::mem::take(&mut times[i]));
            points.push(Point {
                choice: way.choice,
                options: way.options.clone(),
                seconds,
                spread,
                build_seconds: median(std::mem::take(&mut builds[i])).0,
                wrong_pixels: match way.changes_rays {
                    true => self.wrong_pixels(&way.config)?,
                    false => own_wrong,
                },
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

/// Lists the points, nearest first; those that nothing beats have a star.
fn table(points: &[Point]) -> String {
    let mut rows: Vec<&Point> = points.iter().collect();
    rows.sort_by(|a, b| {
        a.rmse
            .total_cmp(&b.rmse)
            .then(a.seconds.total_cmp(&b.seconds))
    });
    let mut text = String::from("   seconds      RMSE      FLIP  wrong pixels  options\n");
    for point in rows {
        let wrong = point.wrong_pixels.map_or("?".into(), |n| n.to_string());
        let options = match &point.options[..] {
            "" => "(the scene's own way)",
            options => options,
        };
        let star = if point.pareto { '*' } else { ' ' };
        let _ = writeln!(
            text,
            "{star} {:8.4} {:9.6} {:9.6} {wrong:>13}  {options}",
            point.seconds, point.rmse, point.flip
        );
    }
    text
}
