//! `lanecast bench SCENE --frames N`: gains from the frame before.

use super::check_config;
use crate::args::{BenchArgs, RENDER_SIZE};
use crate::error::CliError;
use crate::interrupt;
use crate::output::{Results, check_destinations};
use crate::pipeline::prepare;
use crate::progress::Drawing;
use lanecast_engine::accel::{Structure, World};
use lanecast_io::LoadError;
use lanecast_measure::clock::Clock;
use lanecast_measure::frames::{FrameReport, Question, measure};
use lanecast_measure::ray_kinds::Kind;
use lanecast_measure::rays::{Source, direction_of, light_of, ray_sets};
use lanecast_measure::{Stats, Watch};
use lanecast_model::plan::{Choices, Precision, plan};
use std::path::Path;

pub fn run(args: &BenchArgs, frames: u32) -> Result<(), CliError> {
    let mut config = args.config(RENDER_SIZE)?;
    config.solver = args.solver.checked(args.common.precision)?;
    check_config(&mut config)?;
    let path = args.scene.as_deref().unwrap_or(Path::new(""));
    let outputs = check_destinations(&[path], &[], args.common.sinks())?;
    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = Stats::default();
    let options = args.common.load_options(outputs);
    let prepared = prepare(
        Some(path),
        &options,
        (&config, &args.common.view),
        &mut watch,
        &mut stats,
    )?;
    let planned = |precision| {
        let choices = Choices {
            precision,
            ..config.choices
        };
        plan(&prepared.scene, &prepared.instances, &choices)
            .map_err(|e| CliError::Usage(e.to_string()))
    };
    let (pool, camera) = (&prepared.pool, prepared.camera);
    let kernels = planned(Precision::Exact)?.kernels;
    // Camera rays do not depend on the world.
    let sets = pool.install(|| {
        let world = World::build(&prepared.scene, &prepared.instances, Structure::Bvh);
        let light = light_of(&world, &camera);
        let source = Source {
            world: &world,
            kernels,
            camera,
            grid: config.grid,
            size: [config.width, config.height],
            order: args.order.0[0],
            light,
            direction: direction_of(&world, light),
        };
        ray_sets(&source, &[Kind::Primary], &progress)
    });
    let sets = sets.ok_or(CliError::Interrupted)?;
    let precisions = match args.common.precision {
        Some(precision) => vec![precision],
        None => vec![Precision::Fast, Precision::Exact],
    };
    let mut report = FrameReport::default();
    for precision in precisions {
        let question = Question {
            rays: &sets[0],
            kernels: planned(precision)?.kernels,
            precision: precision.name(),
            frames,
            reps: args.reps,
            clock: Clock::for_threads(pool.current_num_threads()),
        };
        let scene = prepared.scene.clone();
        let _drawing = Drawing::start(&progress, args.common.progress.style);
        let measured = pool.install(|| measure(scene, &question, &progress));
        let measured = measured.map_err(|source| LoadError::of_scene(path, source))?;
        let measured = measured.ok_or(CliError::Interrupted)?;
        report.results.extend(measured.results);
        report.renewals.extend(measured.renewals);
    }
    stats.stages.push(watch.stage("bench"));
    stats.finish();
    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    interrupt::check(&progress)?;
    results.commit(&table(&report))
}

fn table(report: &FrameReport) -> String {
    let mut text = format!(
        "{:<8} {:<14} {:>8} {:>10} {:>10} {:>10} {:>10} {:>10}\n",
        "mode", "top tree", "refitted", "SAH", "trees, ms", "rays, ms", "both, ms", "mismatches"
    );
    for row in &report.renewals {
        let bound = match row.worst {
            None => "all rebuilt".into(),
            Some(0.0) => "rebuilt".into(),
            Some(f64::MAX) => "refitted".into(),
            Some(worst) => format!("refit to {worst}"),
        };
        text += &format!(
            "{:<8} {bound:<14} {:>8} {:>10.2} {:>10.3} {:>10.3} {:>10.3} {:>10}\n",
            row.precision,
            row.refitted,
            row.sah,
            row.renewal_ms,
            row.trace_ms,
            row.renewal_ms + row.trace_ms,
            row.mismatches,
        );
    }
    text += &format!(
        "\n{:<8} {:<6} {:>9} {:>8} {:>9} {:>9} {:>9} {:>10}\n",
        "mode", "reuse", "Mrays/s", "speedup", "bounded", "lost", "retraced", "mismatches"
    );
    for row in &report.results {
        let share =
            |count: u64| 100.0 * count as f64 / (row.rays * row.frames as u64).max(1) as f64;
        text += &format!(
            "{:<8} {:<6} {:>9.2} {:>7.2}x {:>8.1}% {:>8.2}% {:>8.2}% {:>10}\n",
            row.precision,
            row.reuse.name(),
            row.mrays_per_s,
            row.speedup,
            share(row.temporal_bounds.bounded),
            share(row.temporal_bounds.lost),
            share(row.temporal_bounds.retraced),
            row.mismatches,
        );
    }
    text
}
