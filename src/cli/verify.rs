//! `lanecast verify`: lanes against scalar code against the reference.

use super::args::{VERIFY_SIZE, VerifyArgs};
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations};
use super::pipeline::{Prepared, prepare};
use super::progress::Drawing;
use crate::accel::World;
use crate::io::LoadError;
use crate::measure::verify::{Comparison, Counts, VerifyOptions, View, independent, replay};
use crate::measure::{PlanSummary, Stats, Watch};
use crate::plan::Precision;
use crate::reference::{self, Reference};
use crate::render::{Grid, Progress, RenderConfig, Rendered, render};
use crate::trace::{Outcome, TracedRay, decided};
use serde::Serialize;
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

/// Mismatches that are printed with all their numbers.
const LISTED: usize = 10;

const MAX_PIXELS: u64 = 1 << 22;

/// In `exact`, a relative error of t beyond this is no rounding: grazing hits
/// of the test scenes stay below 10^-10.
const MAX_T_ERROR: f64 = 1e-6;

/// What `--json` writes.
#[derive(Debug, Serialize)]
struct Report {
    pixels: u64,
    rays: u64,
    plan: PlanSummary,
    /// Rays whose answer at the plan's width differs in any bit from that at
    /// one lane.
    lanes_vs_scalar_bit_mismatches: u64,
    replay: Counts,
    independent: Counts,
    /// (Ray, primitive) pairs that bounds left to exact arithmetic, of one picture.
    escalated: u64,
    times: Vec<Time>,
}

#[derive(Debug, Serialize)]
struct Time {
    mode: &'static str,
    lanes: usize,
    /// Shading included, over all threads.
    ns_per_ray: f64,
}

pub fn run(args: &VerifyArgs) -> Result<(), CliError> {
    let mut config = args.common.config(VERIFY_SIZE)?;
    config.max_depth = args.depth.max_depth;
    config.build = args.build.quality;
    let pixels = u64::from(config.width) * u64::from(config.height);
    if pixels > MAX_PIXELS {
        return Err(CliError::Usage(format!(
            "verify keeps every ray of its {pixels} pixels; ask for a --size of at most {MAX_PIXELS}"
        )));
    }
    check_destinations(&[&args.scene], &[], args.common.sinks())?;
    let progress = interrupt::watch();
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let options = args.common.load_options();
    let prepared = prepare(Some(&args.scene), &options, &config, &mut watch, &mut stats)?;
    let too_many = |source| LoadError::of_scene(&args.scene, source);
    // The reference will not take more: say so before any work.
    prepared.appearances.check_enumerable().map_err(too_many)?;
    let world = prepared.world(&mut watch, &mut stats);

    let mut times = Vec::new();
    let precision = config.choices.precision.name();
    let mut trace = |lanes: usize| {
        let (traced, ns) = traced(&prepared, &world, &config, lanes, &progress)?;
        times.push(Time {
            mode: precision,
            lanes,
            ns_per_ray: ns,
        });
        Ok::<Rendered, CliError>(traced)
    };
    let before = decided();
    let fast = trace(prepared.plan.kernels.lanes)?;
    // Two pictures: one is recorded, one timed.
    let escalated = (decided() - before) / 2;
    let scalar = trace(1)?;
    let mismatches = bit_mismatches(&fast.record, &scalar.record);
    stats.stages.push(watch.stage("render"));

    let reference = Reference::new(&prepared.scene, &prepared.appearances).map_err(too_many)?;
    let options = VerifyOptions {
        sample: args.sample.unwrap_or(1).min(u64::from(u32::MAX)) as u32,
        list: LISTED,
    };
    let start = Instant::now();
    let replayed = drawn(&prepared, &progress, || {
        replay(&reference, &fast.record, &options, &progress)
    })?;
    times.push(Time {
        mode: "reference",
        lanes: 1,
        ns_per_ray: per_ray(start, replayed.counts.rays),
    });
    let view = View {
        camera: &prepared.camera,
        size: [config.width, config.height],
        grid: match config.grid {
            Grid::Centers => reference::Grid::Centers,
            Grid::Corners => reference::Grid::Corners,
        },
    };
    let own = drawn(&prepared, &progress, || {
        independent(&reference, &view, &fast.record, &options, &progress)
    })?;
    interrupt::check(&progress)?;
    stats.stages.push(watch.stage("verify"));
    stats.rays = fast.counts;
    stats.finish();

    let report = Report {
        pixels: u64::from(config.width) * u64::from(config.height),
        rays: fast.record.len() as u64,
        plan: stats.plan.clone(),
        lanes_vs_scalar_bit_mismatches: mismatches,
        replay: replayed.counts,
        independent: own.counts,
        escalated,
        times,
    };
    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    results.commit(&for_people(&report, &replayed, &own))?;
    judge(&report, args.allow_wrong, config.choices.precision)
}

/// Renders with every ray recorded, in the order of the pixels.
fn traced(
    prepared: &Prepared,
    world: &World,
    config: &RenderConfig,
    lanes: usize,
    progress: &Arc<Progress>,
) -> Result<(Rendered, f64), CliError> {
    let mut kernels = prepared.plan.kernels;
    kernels.lanes = lanes;
    let view = crate::render::View {
        world,
        kernels,
        camera: prepared.camera,
        lights: &prepared.scene.lights,
    };
    let go = |recording| {
        let render = || render(&view, config, recording, progress);
        drawn(prepared, progress, render)
    };
    let recorded = go(true)?;
    // Timed by itself: a record costs more than its ray.
    let start = Instant::now();
    let rendered = go(false)?;
    let ns = per_ray(start, rendered.counts.total());
    Ok((recorded, ns))
}

/// A stage on the pool, with its progress on the terminal.
fn drawn<T: Send>(
    prepared: &Prepared,
    progress: &Arc<Progress>,
    stage: impl FnOnce() -> T + Send,
) -> T {
    let _drawing = Drawing::start(progress);
    prepared.pool.install(stage)
}

fn per_ray(start: Instant, rays: u64) -> f64 {
    start.elapsed().as_secs_f64() * 1e9 / rays.max(1) as f64
}

/// Rays that differ in any bit, or that only one of the two traced.
fn bit_mismatches(a: &[TracedRay], b: &[TracedRay]) -> u64 {
    let bits = |ray: &TracedRay| {
        let outcome = match ray.outcome {
            Outcome::Hit {
                t,
                instance,
                primitive,
                normal,
            } => (
                3,
                t.to_bits(),
                instance,
                primitive,
                normal.map(f64::to_bits),
            ),
            Outcome::Miss => (0, 0, 0, 0, [0; 3]),
            Outcome::Clear => (1, 0, 0, 0, [0; 3]),
            Outcome::Blocked => (2, 0, 0, 0, [0; 3]),
        };
        (
            ray.org.map(f64::to_bits),
            ray.dir.map(f32::to_bits),
            ray.t_max.to_bits(),
            outcome,
        )
    };
    let differing = a.iter().zip(b).filter(|(a, b)| bits(a) != bits(b)).count();
    (differing + a.len().abs_diff(b.len())) as u64
}

fn for_people(report: &Report, replayed: &Comparison, own: &Comparison) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} pixels, {} rays; {} precision, {} lanes against 1: {} differ in a bit\n",
        report.pixels,
        report.rays,
        report.plan.precision,
        report.plan.lanes,
        report.lanes_vs_scalar_bit_mismatches
    );
    if report.plan.precision != Precision::Fast.name() {
        let share = report.escalated as f64 / report.rays.max(1) as f64;
        let _ = writeln!(
            text,
            "{} pairs of a ray and a primitive decided exactly, {share:.4} per ray\n",
            report.escalated,
        );
    }
    let _ = writeln!(
        text,
        "{:<12} {:>9} {:>9} {:>9} {:>12} {:>9} {:>12} {:>14}",
        "reference",
        "rays",
        "wrong hit",
        "wrong id",
        "wrong shadow",
        "undecided",
        "max rel t",
        "max normal deg"
    );
    for (name, c) in [
        ("replay", &report.replay),
        ("independent", &report.independent),
    ] {
        let _ = writeln!(
            text,
            "{name:<12} {:>9} {:>9} {:>9} {:>12} {:>9} {:>12.1e} {:>14.1e}",
            c.rays,
            c.wrong_hit,
            c.wrong_id,
            c.wrong_shadow,
            c.undecided,
            c.max_rel_t_error,
            c.max_normal_error_deg
        );
    }
    let _ = writeln!(text);
    for time in &report.times {
        let _ = writeln!(
            text,
            "{:>9.1} ns a ray: {} at {} {}",
            time.ns_per_ray,
            time.mode,
            time.lanes,
            if time.lanes == 1 { "lane" } else { "lanes" }
        );
    }
    for (name, comparison) in [("replay", replayed), ("independent", own)] {
        for mismatch in &comparison.mismatches {
            let _ = write!(text, "\n{name}: {mismatch}\n");
        }
    }
    text
}

/// `fast` may be wrong as long as nobody sets a limit; no mode may differ
/// between widths.
fn judge(report: &Report, allowed: Option<u64>, precision: Precision) -> Result<(), CliError> {
    if report.lanes_vs_scalar_bit_mismatches > 0 {
        return Err(CliError::Short(format!(
            "{} rays differ between packets and one lane",
            report.lanes_vs_scalar_bit_mismatches
        )));
    }
    let allowed = match (allowed, precision) {
        (Some(allowed), _) => allowed,
        (None, Precision::Fast) => return Ok(()),
        (None, Precision::Guarded | Precision::Exact) => 0,
    };
    let wrong = report.replay.wrong();
    let error = report.replay.max_rel_t_error;
    if precision == Precision::Exact && (error.is_nan() || error > MAX_T_ERROR) {
        return Err(CliError::Short(format!(
            "a t is off by {error:.1e} of itself; {MAX_T_ERROR:.0e} is allowed"
        )));
    }
    if wrong > allowed {
        return Err(CliError::Short(format!(
            "{wrong} replayed rays are wrong; {allowed} are allowed"
        )));
    }
    Ok(())
}
