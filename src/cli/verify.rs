//! `lanecast verify`: compares packets with one lane, and both with the reference, in
//! every precision.

mod light;
mod report;

use super::args::VerifyArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations};
use super::pipeline::{Prepared, complete};
use super::progress::{Drawing, Style};
use super::scene;
use lanecast_engine::accel::World;
use lanecast_engine::trace::{ScratchPool, TracedRay};
use lanecast_io::LoadError;
use lanecast_measure::adversarial::{Aimed, adversarial_rays, trace_aimed};
use lanecast_measure::verify::{
    Comparison, Differences, Float, Interrupted, VerifyOptions, View, independent, nearest_hits,
    replay, replay_aimed,
};
use lanecast_measure::{Stats, Watch};
use lanecast_model::plan::{Choices, Kernels, LaneCount, Precision, plan};
use lanecast_picture::render::{Grid, Progress, RenderConfig, RenderError, Rendered, render};
use lanecast_reference::{self as reference, Reference};
use report::{Mode, Report, Time};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum number of mismatches printed with all their numbers per comparison: for one
/// mode, and for each of several.
const LISTED: usize = 10;
const LISTED_OF_EACH: usize = 2;

const MAX_PIXELS: u64 = 1 << 22;

/// Maximum number of aimed rays whose answers are held at once.
const AT_A_TIME: usize = 1 << 18;

/// Least and greatest number of timed runs of a picture, and the time after which none
/// begins.
const MIN_TIMED: u32 = 2;
const MAX_TIMED: u32 = 20;
const TIMED: Duration = Duration::from_millis(100);

pub fn run(args: &VerifyArgs) -> Result<(), CliError> {
    if args.light {
        return light::run(args);
    }
    let config = args.config()?;
    let pixels = u64::from(config.width) * u64::from(config.height);
    if pixels > MAX_PIXELS {
        return Err(CliError::Usage(format!(
            "verify keeps every ray of its {pixels} pixels; ask for a --size of at most {MAX_PIXELS}"
        )));
    }
    let outputs = check_destinations(&[&args.scene], &[], args.common.sinks())?;
    let progress = interrupt::watch();
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let prepared = prepared(args, outputs, &config, &mut watch, &mut stats)?;
    let too_many = |source| LoadError::of_scene(&args.scene, source);
    // The reference refuses larger scenes: report that before any work.
    prepared.instances.check_enumerable().map_err(too_many)?;
    let world = prepared.world(&mut watch, &mut stats);
    let reference = Reference::new(&prepared.scene, &prepared.instances).map_err(too_many)?;
    let rows = prepared.instances.laid_out(&prepared.scene);
    let aimed = adversarial_rays(
        &prepared.scene,
        &rows.map_err(too_many)?,
        &prepared.camera,
        args.adversarial.unwrap_or(0) as usize,
        args.seed,
    );
    stats.stages.push(watch.stage("reference"));

    let check = Check {
        prepared: &prepared,
        world: &world,
        reference: &reference,
        config: &config,
        aimed: &aimed,
        list: match args.common.precision {
            Some(_) => LISTED,
            None => LISTED_OF_EACH,
        },
        sample: args.sample.unwrap_or(1).min(u64::from(u32::MAX)) as u32,
        progress: &progress,
        style: args.common.progress.style,
    };
    let all = [Precision::Fast, Precision::Guarded, Precision::Exact];
    let asked = |mode: &Precision| args.common.precision.is_none_or(|only| only == *mode);
    let mut done = Vec::new();
    for precision in all.into_iter().filter(asked) {
        let (mode, counts) = check.mode(precision)?;
        if precision == config.choices.precision {
            stats.rays = counts;
        }
        done.push(mode);
    }
    if !aimed.is_empty() {
        check.adversarial(&mut done)?;
    }
    interrupt::check(&progress)?;
    stats.stages.push(watch.stage("verify"));
    stats.finish();

    let report = Report::new(pixels, stats.plan.clone(), done);
    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    results.commit(&report.text_report())?;
    report.check(args.allow_wrong)
}

/// Loads the scene, scales and translates it, and plans the requested mode.
fn prepared(
    args: &VerifyArgs,
    outputs: Vec<PathBuf>,
    config: &RenderConfig,
    watch: &mut Watch,
    stats: &mut Stats,
) -> Result<Prepared, CliError> {
    let scene = scene::load(&args.scene, &args.common.load_options(outputs))?;
    let scene = scene.moved(args.scale, args.offset).map_err(|e| {
        let [x, y, z] = args.offset.to_array();
        CliError::Usage(format!(
            "--scale {:?} --offset {x:?},{y:?},{z:?} take the scene out of range: {e}",
            args.scale
        ))
    })?;
    stats.stages.push(watch.stage("load"));
    let seen = &args.common.view;
    let (scene, config) = scene::viewed(scene, config.clone(), seen, &args.scene)?;
    complete(scene, &args.scene, &config, watch, stats)
}

/// The data shared by all modes.
struct Check<'a> {
    prepared: &'a Prepared,
    world: &'a World,
    reference: &'a Reference<'a>,
    config: &'a RenderConfig,
    aimed: &'a [Aimed],
    sample: u32,
    list: usize,
    progress: &'a Arc<Progress>,
    style: Style,
}

impl Check<'_> {
    /// Compares one precision's picture, at its width and at one lane, with the
    /// reference.
    fn mode(
        &self,
        precision: Precision,
    ) -> Result<(Mode, lanecast_picture::shade::RayCounts), CliError> {
        let kernels = self.kernels(precision)?;
        let options = self.options(kernels, self.sample);
        let fast = self.recorded(kernels)?;
        let escalated = fast.decided;
        let fast_ns = self.timed(kernels)?;
        let one = Kernels {
            lanes: 1,
            ..kernels
        };
        let scalar = self.recorded(one)?;
        let scalar_ns = self.timed(one)?;
        let mut widths = Differences::default();
        widths.add(&fast.record, &scalar.record);
        drop(scalar);

        let start = Instant::now();
        let replayed = self.replay(&fast.record, &options)?;
        let reference_ns = per_ray(start, replayed.counts.rays);
        let own = self.independent(&fast.record, &options)?;
        let time = |mode, lanes, ns_per_ray| Time {
            mode,
            lanes,
            ns_per_ray,
        };
        let name = precision.name();
        let mode = Mode {
            precision,
            rays: fast.record.len() as u64,
            lanes: kernels.lanes,
            widths,
            replayed,
            own,
            adversarial: None,
            escalated,
            times: [
                time(name, kernels.lanes, fast_ns),
                time(name, 1, scalar_ns),
                time("reference", 1, reference_ns),
            ],
        };
        Ok((mode, fast.counts))
    }

    /// Returns the options that compare every `sample`-th pixel.
    fn options(&self, kernels: Kernels, sample: u32) -> VerifyOptions {
        VerifyOptions {
            sample,
            list: self.list,
            float: match kernels.precision {
                Precision::Exact => Float::Double,
                _ => Float::Single,
            },
        }
    }

    /// Plans a precision; one other than the requested falls back to a width that this
    /// build has.
    fn kernels(&self, precision: Precision) -> Result<Kernels, CliError> {
        let prepared = self.prepared;
        let of = |lanes| {
            let choices = Choices {
                precision,
                lanes,
                ..self.config.choices
            };
            plan(&prepared.scene, &prepared.instances, &choices)
        };
        let asked = of(self.config.choices.lanes);
        let plan = match asked {
            Err(_) if precision != self.config.choices.precision => of(LaneCount::Auto),
            asked => asked,
        };
        let plan = plan.map_err(|e| CliError::Usage(e.to_string()))?;
        Ok(plan.kernels)
    }

    /// Renders the picture with every ray recorded, in pixel order.
    fn recorded(&self, kernels: Kernels) -> Result<Rendered, CliError> {
        Ok(self.rendered(kernels, true)?)
    }

    /// Returns the nanoseconds per ray of the picture, without a record, which costs more
    /// than its ray. The least of several runs counts: the first warms the processor up.
    fn timed(&self, kernels: Kernels) -> Result<f64, CliError> {
        let mut least = f64::INFINITY;
        let begun = Instant::now();
        for run in 0..MAX_TIMED {
            if run >= MIN_TIMED && begun.elapsed() > TIMED {
                break;
            }
            let start = Instant::now();
            let rendered = self.rendered(kernels, false)?;
            least = least.min(per_ray(start, rendered.counts.total()));
        }
        Ok(least)
    }

    fn rendered(&self, kernels: Kernels, recording: bool) -> Result<Rendered, RenderError> {
        let view = lanecast_picture::render::View {
            world: self.world,
            kernels,
            camera: self.prepared.camera,
            lights: &self.prepared.scene.lights,
        };
        self.drawn(|| render(&view, self.config, recording, self.progress))
    }

    fn replay(
        &self,
        rays: &[TracedRay],
        options: &VerifyOptions,
    ) -> Result<Comparison, Interrupted> {
        self.drawn(|| replay(self.reference, rays, options, self.progress))
    }

    fn independent(
        &self,
        rays: &[TracedRay],
        options: &VerifyOptions,
    ) -> Result<Comparison, Interrupted> {
        let view = View {
            camera: &self.prepared.camera,
            size: [self.config.width, self.config.height],
            grid: match self.config.grid {
                Grid::Centers => reference::Grid::Centers,
                Grid::Corners => reference::Grid::Corners,
            },
        };
        self.drawn(|| independent(self.reference, &view, rays, options, self.progress))
    }

    /// Traces the aimed rays in each mode at its width and at one lane. The reference
    /// is asked about each ray once.
    fn adversarial(&self, modes: &mut [Mode]) -> Result<(), CliError> {
        for (part, aimed) in self.aimed.chunks(AT_A_TIME).enumerate() {
            let first = (part * AT_A_TIME) as u32;
            let nearest = self.drawn(|| nearest_hits(self.reference, aimed, self.progress))?;
            for mode in &mut *modes {
                let kernels = self.kernels(mode.precision)?;
                let traced = |kernels: Kernels| {
                    let (scratch, progress) = (ScratchPool::default(), self.progress);
                    let go = || trace_aimed(self.world, &kernels, aimed, first, &scratch, progress);
                    let rays = self.drawn(go).ok_or(CliError::Interrupted)?;
                    Ok::<_, CliError>((rays, scratch.decided()))
                };
                let start = Instant::now();
                let (packets, escalated) = traced(kernels)?;
                let took = start.elapsed();
                let one = Kernels {
                    lanes: 1,
                    ..kernels
                };
                mode.widths.add(&packets, &traced(one)?.0);
                // All aimed rays are compared, whatever pixels are sampled.
                let options = self.options(kernels, 1);
                let replay = || {
                    let (reference, progress) = (self.reference, self.progress);
                    replay_aimed(reference, &nearest, &packets, &options, progress)
                };
                let all = mode.adversarial.get_or_insert_default();
                all.compared.append(self.drawn(replay)?);
                all.compared.shorten(options.list);
                all.escalated += escalated;
                all.took += took;
            }
        }
        Ok(())
    }

    /// Runs a stage on the pool, with its progress on the terminal.
    fn drawn<T: Send>(&self, stage: impl FnOnce() -> T + Send) -> T {
        let _drawing = Drawing::start(self.progress, self.style);
        self.prepared.pool.install(stage)
    }
}

fn per_ray(start: Instant, rays: u64) -> f64 {
    start.elapsed().as_secs_f64() * 1e9 / rays.max(1) as f64
}
