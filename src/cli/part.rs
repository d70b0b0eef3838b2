//! `lanecast render --samples A..B`: renders a range of the samples of a picture, to be merged.

use super::args::RenderArgs;
use super::error::CliError;
use super::output::{Results, check_destinations, printable_line};
use super::pipeline::{complete, load, named, of_camera};
use super::progress::rate;
use super::render::exposed;
use super::scene::{pick_camera, viewed};
use super::{ground, interrupt, memory, shutter};
use lanecast_light::filter::{Kind as FilterKind, PERIOD};
use lanecast_light::sampler::Kind;
use lanecast_measure::{Stats, Watch};
use lanecast_picture::render::{
    Backdrop, Grid, Integrator, RenderConfig, View, is_part, parts_of, render_part,
};
use std::ops::Range;
use std::path::Path;

pub fn run(
    args: &RenderArgs,
    config: RenderConfig,
    output: &Path,
    samples: Range<u32>,
    mut stats: Stats,
) -> Result<(), CliError> {
    check(
        &config,
        (
            args.light.sampler.unwrap_or(config.sampler),
            args.light.filter.unwrap_or(config.filter),
        ),
        output,
        &samples,
    )?;
    memory::check_part(&config)?;
    let inputs: Vec<&Path> = args.scene.as_deref().into_iter().collect();
    let outputs = check_destinations(&inputs, &[output.into()], args.common.sinks())?;
    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let path = args.scene.as_deref();
    let options = args.load_options(outputs);
    let scene = load(path, &options, &mut watch, &mut stats)?;
    let (scene, config) = viewed(scene, config, &args.common.view, named(path))?;
    let row = pick_camera(&scene.cameras, config.camera.as_deref())?;
    let how = (config.grid, args.light.integrator.0);
    let exposure = args.shutter.exposure(&scene, row, how, (0.0, 1.0))?;
    let config = RenderConfig {
        shutter: exposure,
        ..of_camera(config, &scene, args.common.size)?
    };
    let mut config = args.light.complete(config, &scene)?;
    let scene = exposed(scene, &config, args.light.ground, named(path))?;
    if !matches!(config.integrator, Integrator::Path | Integrator::Ao) {
        return Err(CliError::Usage(
            "--samples divides pictures of paths, and this one would be direct; ask for \
             --integrator path, or leave out --samples"
                .into(),
        ));
    }
    if matches!(config.backdrop, Backdrop::Color(_)) {
        return Err(CliError::Usage(
            "--samples keeps sums of light, which no colour can be laid under; leave out \
             --background, or ask for --background transparent"
                .into(),
        ));
    }
    config.spp = samples.end;
    let (scene, config) = match args.light.ground {
        true => ground::stand(scene, named(path), config)?,
        false => (scene, config),
    };
    stats.picture.spp = samples.end - samples.start;
    let prepared = complete(scene, named(path), &config, &mut watch, &mut stats)?;
    let render = |view: &View| -> Result<_, CliError> {
        let row = prepared.camera_row;
        let asked = args.shutter.shutter_slices;
        let slices = shutter::slices(view, row, &config, asked, named(path))?;
        let view = (view, slices.as_ref());
        Ok(render_part(view, &config, samples.clone(), &progress)?)
    };
    let (part, counts) = prepared.traced(
        (&mut watch, &mut stats),
        (&progress, args.common.progress.style),
        render,
    )??;
    stats.rays = counts;
    stats.stages.push(watch.stage("render"));
    let mut results = Results::default();
    part.save_into(output, &mut results.outputs)?;
    stats.stages.push(watch.stage("write"));
    stats.finish();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &stats)?;
    interrupt::check(&progress)?;
    results.commit(&format!(
        "{}: {}x{}, samples {}..{}, {} rays in {:.3} s, {}\n",
        printable_line(&output.display().to_string()),
        config.width,
        config.height,
        samples.start,
        samples.end,
        stats.rays.total(),
        stats.seconds("render"),
        rate(stats.rays_per_second)
    ))
}

/// Refuses what could not be merged with other parts.
fn check(
    config: &RenderConfig,
    (sampler, filter): (Kind, FilterKind),
    output: &Path,
    samples: &Range<u32>,
) -> Result<(), CliError> {
    let refused = |message: String| Err(CliError::Usage(message));
    if !is_part(samples) {
        let parts = parts_of(samples.clone());
        let parts: Vec<String> = parts
            .iter()
            .map(|part| format!("{}..{}", part.start, part.end))
            .collect();
        return refused(format!(
            "--samples {}..{}: a part has 2^k samples from a multiple of 2^k on, so that parts add \
             up to the bits of the whole; render {} and merge them",
            samples.start,
            samples.end,
            parts.join(", ")
        ));
    }
    let period = PERIOD;
    if filter.is_signed() && samples.start > 0 && (samples.len() as u32) < period {
        return refused(format!(
            "--samples {}..{}: one of each {period} samples is in the negative parts of --filter \
             mitchell, so parts begin at 0 or have {period} samples or more; take another filter, or \
             {}..{}",
            samples.start,
            samples.end,
            samples.start / period * period,
            samples.start / period * period + period,
        ));
    }
    if sampler == Kind::Stratified {
        return refused(
            "--sampler stratified has to know the number of all samples, which --samples does not \
             tell; take sobol or independent"
                .into(),
        );
    }
    if config.grid == Grid::Corners {
        return refused(
            "--grid corners traces one ray through each corner; leave out --samples".into(),
        );
    }
    let is_sums = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("sums");
    if !output.extension().is_some_and(is_sums) {
        return refused(format!(
            "{}: --samples writes a part of a picture; name a .sums file, and merge the parts with \
             lanecast merge",
            output.display()
        ));
    }
    Ok(())
}
