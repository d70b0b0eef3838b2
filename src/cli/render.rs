//! `lanecast render`: renders a scene to one picture, or to many (`frames.rs`).

use super::args::RenderArgs;
use super::error::CliError;
use super::output::{Results, check_destinations, printable_line};
use super::pipeline::prepare;
use super::progress::{Drawing, rate};
use super::{frames, interrupt, memory};
use crate::io::picture_files;
use crate::measure::{PictureSize, Stats, Watch};
use crate::render::{Rendered, View};
use std::path::{Path, PathBuf};

pub fn run(args: &RenderArgs) -> Result<(), CliError> {
    let config = args.config()?;
    let picture_path = output_path(args);
    memory::check(&config, &picture_path)?;
    let stats = Stats {
        picture: PictureSize {
            width: config.width,
            height: config.height,
            spp: config.spp,
        },
        ..Stats::default()
    };
    if let Some(frames) = args.frames {
        return frames::run(args, &config, &picture_path, frames, stats);
    }
    let files: Vec<PathBuf> = picture_files(&picture_path, config.aovs)
        .map_err(|e| CliError::Usage(e.to_string()))?
        .into_iter()
        .map(|(path, _)| path)
        .collect();
    let inputs: Vec<&Path> = args.scene.as_deref().into_iter().collect();
    let outputs = check_destinations(&inputs, &files, args.common.sinks())?;

    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = stats;
    let prepared = prepare(
        args.scene.as_deref(),
        &args.common.load_options(outputs),
        &config,
        &mut watch,
        &mut stats,
    )?;
    interrupt::check(&progress)?;
    let world = prepared.world(&mut watch, &mut stats);
    interrupt::check(&progress)?;
    let view = View {
        world: &world,
        kernels: prepared.plan.kernels,
        camera: prepared.camera,
        lights: &prepared.scene.lights,
    };
    let drawing = Drawing::start(&progress);
    let rendered = prepared
        .pool
        .install(|| crate::render::render(&view, &config, false, &progress));
    drop(drawing);
    let Rendered {
        picture, counts, ..
    } = rendered?;
    stats.rays = counts;
    stats.stages.push(watch.stage("render"));

    let mut results = Results::default();
    picture.save_into(&picture_path, &mut results.outputs)?;
    stats.stages.push(watch.stage("write"));
    stats.finish();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &stats)?;
    interrupt::check(&progress)?;
    results.commit(&format!(
        "{}: {}x{}, {} rays in {:.3} s, {}\n",
        files
            .iter()
            .map(|f| printable_line(&f.display().to_string()))
            .collect::<Vec<_>>()
            .join(", "),
        config.width,
        config.height,
        stats.rays.total(),
        stats.seconds("render"),
        rate(stats.rays_per_second)
    ))
}

/// Returns `-o`, or the scene's name as a PNG in the current folder.
fn output_path(args: &RenderArgs) -> PathBuf {
    if let Some(path) = &args.output {
        return path.clone();
    }
    let stem = args.scene.as_deref().and_then(Path::file_stem);
    let mut name = stem.unwrap_or("lanecast".as_ref()).to_os_string();
    name.push(".png");
    name.into()
}
