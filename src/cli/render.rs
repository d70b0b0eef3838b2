//! `lanecast render`: a scene in, a picture out.

use super::args::{RENDER_SIZE, RenderArgs};
use super::error::CliError;
use super::output::{Results, check_destinations};
use super::progress::{Drawing, rate};
use super::{interrupt, placeholder, scene};
use crate::io::picture_files;
use crate::measure::{PictureSize, Stats, Watch};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;

pub fn run(args: &RenderArgs) -> Result<(), CliError> {
    let config = args.common.config(RENDER_SIZE)?;
    let picture_path = output_path(args);
    let files: Vec<PathBuf> = picture_files(&picture_path, config.aovs)
        .map_err(|e| CliError::Usage(e.to_string()))?
        .into_iter()
        .map(|(path, _)| path)
        .collect();
    let inputs: Vec<&Path> = args.scene.as_deref().into_iter().collect();
    check_destinations(&inputs, &files, args.common.sinks())?;

    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = Stats {
        picture: PictureSize {
            width: config.width,
            height: config.height,
            spp: config.spp,
        },
        ..Stats::default()
    };

    // ==== PIPELINE: load → camera and lights → plan → build → render ====
    // Everything up to the next mark is to be replaced; what it must give is
    // `picture`, and in `stats`: scene, plan, stages, rays, memory.
    if let Some(path) = &args.scene {
        let scene = scene::load(path, &args.common.load_options())?;
        stats.stages.push(watch.stage("load"));
        let _camera = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
        for (name, bytes) in scene.bytes() {
            stats.memory.insert(name.into(), bytes as u64);
        }
    }
    interrupt::check(&progress)?;
    let drawing = Drawing::start(&progress);
    let picture = placeholder::gradient(&config, &progress);
    drop(drawing);
    let picture = picture.ok_or(CliError::Interrupted)?;
    stats.rays.primary = progress.rays.load(Relaxed);
    stats.stages.push(watch.stage("render"));
    // ==== end of PIPELINE ====

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
            .map(|f| f.display().to_string())
            .collect::<Vec<_>>()
            .join(", "),
        config.width,
        config.height,
        stats.rays.total(),
        stats.seconds("render"),
        rate(stats.rays_per_second)
    ))
}

/// `-o`, or the scene's name as a PNG in the current folder.
fn output_path(args: &RenderArgs) -> PathBuf {
    if let Some(path) = &args.output {
        return path.clone();
    }
    let stem = args.scene.as_deref().and_then(Path::file_stem);
    let mut name = stem.unwrap_or("lanecast".as_ref()).to_os_string();
    name.push(".png");
    name.into()
}
