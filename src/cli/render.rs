//! `lanecast render`: renders a scene to one picture, or to many (`frames.rs`).

use super::args::RenderArgs;
use super::args::STDIN;
use super::bands::{self, Banded};
use super::denoise::{self, Denoiser};
use super::error::CliError;
use super::output::{Results, check_destinations, complain, printable_line};
use super::pipeline::{complete, load, losses, named, of_camera};
use super::progress::rate;
use super::scene::{pick_camera, viewed};
use super::tev::Display;
use super::{frames, ground, interrupt, metadata, motion, part, shutter, tile};
use lanecast_io::{AovSet, LoadError, picture_files};
use lanecast_measure::{PictureSize, Stats, Watch};
use lanecast_model::scene::Scene;
use lanecast_picture::render::{
    Backdrop, CacheCounts, FinishedTile, Integrator, LightCache, Reached, RenderConfig, Rendered,
    View, legend, render_blurred, render_keeping, window_key,
};
use std::path::{Path, PathBuf};

pub fn run(args: &RenderArgs) -> Result<(), CliError> {
    let config = args.config()?;
    let picture_path = output_path(args);
    if picture_path == Path::new("-") {
        return Err(CliError::Usage(
            "-o -: pictures are written to files, of --frames one each; name them, such as -o x.png"
                .into(),
        ));
    }
    let development = args.development.checked(&picture_path)?;
    let stats = Stats {
        picture: PictureSize {
            width: config.width,
            height: config.height,
            spp: config.spp,
            mean_spp: None,
        },
        ..Stats::default()
    };
    if let Some(samples) = &args.light.samples {
        return part::run(args, config, &picture_path, samples.0.clone(), stats);
    }
    tile::check(args, &picture_path)?;
    let config = tile::foreseen(args, config)?;
    let is_looked_at = args.outputs.denoise || args.outputs.display.is_some();
    bands::fitting(&config, development.bits, &picture_path, is_looked_at)?;
    metadata::check(args, &picture_path, config.aovs)?;
    check_alpha(config.backdrop == Backdrop::Transparent, &picture_path)?;
    if let Some(timeline) = args.sequence.timeline().map_err(CliError::Usage)? {
        return frames::run(args, &config, &picture_path, &development, timeline, stats);
    }
    let mut files = files(&picture_path, config.aovs)?;
    files.extend(args.outputs.denoise.then(|| denoise::beside(&picture_path)));
    let shown_files = files.len();
    files.extend(args.light.cache_file.clone());
    let inputs: Vec<&Path> = args.scene.as_deref().into_iter().collect();
    let outputs = check_destinations(&inputs, &files, args.common.sinks())?;
    let denoiser = Denoiser::load(args.outputs.denoise)?;
    let display = Display::connect(args.outputs.display.as_deref())?;

    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = stats;
    let path = args.scene.as_deref();
    let options = args.load_options(outputs);
    let scene = load(path, &options, &mut watch, &mut stats)?;
    let (scene, config) = composed(args, scene, config)?;
    for lost in losses(&scene, &config, args.common.import.hatch.is_some()) {
        complain(&format!("warning: {lost}"));
    }
    stats.picture.spp = config.spp;
    (stats.picture.width, stats.picture.height) = (config.width, config.height);
    let asked = config.aovs;
    let config = motion::rendered(config);
    let config = match &denoiser {
        Some(denoiser) => denoiser.rendered(config)?,
        None => config,
    };
    let rows = bands::fitting(&config, development.bits, &picture_path, is_looked_at)?;
    let (development, config) = (args.development).complete(development, &picture_path, config);
    let prepared = complete(scene, named(path), &config, &mut watch, &mut stats)?;
    let shown = display.map(|display| {
        let name = picture_path.display().to_string();
        let has_alpha = config.backdrop == Backdrop::Transparent;
        display.begin(&name, (config.width, config.height), has_alpha)
    });
    let on_tile = |tile: FinishedTile| {
        if let Some(shown) = &shown {
            shown.tile(&tile);
        }
    };
    let as_asked = |config: &RenderConfig| RenderConfig {
        aovs: asked,
        ..config.clone()
    };
    let cache_file = args.light.cache_file.as_deref();
    let mut light = LightCache::default();
    let render = |view: &View| -> Result<(Rendered, Option<Banded>, Option<u128>), CliError> {
        if let Some(file) = cache_file {
            light = LightCache::load(file, view, &config)?;
        }
        let row = prepared.camera_row;
        let asked = args.shutter.shutter_slices;
        let slices = shutter::slices(view, row, &config, asked, named(path))?;
        let moment = motion::Shown::of(&prepared, &config);
        let of_window = |config: &RenderConfig, light: &mut LightCache| {
            let mut rendered = match &slices {
                Some(slices) => render_blurred(view, slices, config, &progress, &on_tile)?,
                None => render_keeping(view, config, light, &progress, &on_tile)?,
            };
            moment.add_vectors(&mut rendered.picture, &as_asked(config), named(path))?;
            Ok::<Rendered, CliError>(rendered)
        };
        let (rendered, banded) = match rows {
            Some(rows) => {
                // Pictures in bands have no cache.
                let band = |config: &RenderConfig| of_window(config, &mut LightCache::default());
                let banded = bands::render(&config, rows, &picture_path, &progress, band)?;
                (banded.0, Some(banded.1))
            }
            None => (of_window(&config, &mut light)?, None),
        };
        let key = config.window.map(|_| window_key(view, &config));
        Ok((rendered, banded, key))
    };
    let rendered = prepared.traced(
        (&mut watch, &mut stats),
        (&progress, args.common.progress.style),
        render,
    )??;
    let (
        Rendered {
            mut picture,
            counts,
            reached,
            cache,
            readings,
            ..
        },
        banded,
        key,
    ) = rendered;
    if let Some(shown) = shown {
        shown.finish(&picture);
    }
    stats.rays = counts;
    stats.cache = cache;
    stats.picture.mean_spp = reached.map(|reached| reached.mean_samples);
    stats.stages.push(watch.stage("render"));
    let config = as_asked(&config);
    let errors = match &banded {
        Some(banded) => banded.errors(),
        None => metadata::SquaredErrors::of(&picture),
    };
    picture.metadata = metadata::of(
        tile::told(args.outputs.metadata, &config),
        (&config, &prepared.camera, path),
        (errors, reached.map(|reached| reached.mean_samples)),
        &stats,
    );

    let mut results = Results::default();
    if let Some(denoiser) = &denoiser {
        let (filtered, how) = denoiser.filter(&mut picture, &asked, config.threads)?;
        stats.stages.push(watch.stage("denoise"));
        stats.denoised = Some(how);
        let path = denoise::beside(&picture_path);
        filtered.save_into(&path, &development, &mut results.outputs)?;
    }
    let outputs = &mut results.outputs;
    match banded {
        Some(banded) => banded.save_into(picture, outputs)?,
        None => tile::save(
            picture,
            &picture_path,
            (&config, &development),
            key,
            outputs,
        )?,
    }
    if let Some(file) = cache_file {
        light.save_into(file, &mut results.outputs)?;
    }
    stats.stages.push(watch.stage("write"));
    stats.finish();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &stats)?;
    interrupt::check(&progress)?;
    if let Integrator::Inspect(what) = config.integrator {
        complain(&legend(what, &readings));
    }
    results.commit(&format!(
        "{}: {}x{}{}, {} rays in {:.3} s, {}\n",
        files[..shown_files]
            .iter()
            .map(|f| printable_line(&f.display().to_string()))
            .collect::<Vec<_>>()
            .join(", "),
        config.window().width,
        config.window().height,
        light_of(&config, reached, cache.as_ref(), cache_file),
        stats.rays.total(),
        stats.seconds("render"),
        rate(stats.rays_per_second)
    ))
}

/// Completes a scene and the configuration of its picture by each other and by the arguments: its
/// camera, integrator, shutter and ground.
pub fn composed(
    args: &RenderArgs,
    scene: Scene,
    config: RenderConfig,
) -> Result<(Scene, RenderConfig), CliError> {
    let (scene, config) = arranged(args, scene, config, (0.0, 1.0))?;
    let path = named(args.scene.as_deref());
    let scene = exposed(scene, &config, args.light.ground, path)?;
    match args.light.ground {
        true => ground::stand(scene, path, config),
        false => Ok((scene, config)),
    }
}

/// Completes a scene and the configuration as [`composed`] does, of a frame at a time with the time to
/// the next, without a ground and at the scene's beginning.
pub fn arranged(
    args: &RenderArgs,
    scene: Scene,
    config: RenderConfig,
    frame: (f64, f64),
) -> Result<(Scene, RenderConfig), CliError> {
    let path = named(args.scene.as_deref());
    let (scene, config) = viewed(scene, config, &args.common.view, path)?;
    let row = pick_camera(&scene.cameras, config.camera.as_deref())?;
    let how = (config.grid, args.light.integrator.0);
    let shutter = args.shutter.exposure(&scene, row, how, frame)?;
    let config = RenderConfig {
        shutter,
        ..of_camera(config, &scene, args.common.size)?
    };
    let config = tile::windowed(args.outputs.tile, config)?;
    let config = args.light.complete(config, &scene)?;
    let config = args.outputs.complete(config)?;
    Ok((scene, config))
}

/// Returns the scene in the middle of its exposure, if it has one. Refuses a ground under what
/// moves.
pub fn exposed(
    scene: Scene,
    config: &RenderConfig,
    ground: bool,
    path: &Path,
) -> Result<Scene, CliError> {
    let Some(exposure) = &config.shutter else {
        return Ok(scene);
    };
    if ground {
        return Err(CliError::Usage(
            "--ground lies under things as they stand, and with a shutter they move; leave it \
             out, or ask for --shutter 0"
                .into(),
        ));
    }
    let there = scene.at(exposure.middle());
    Ok(there.map_err(|source| LoadError::of_scene(path, source))?)
}

/// Refuses a picture with alpha in a format that has none.
pub fn check_alpha(has_alpha: bool, path: &Path) -> Result<(), CliError> {
    let has_none = |e: &std::ffi::OsStr| {
        let e = e.to_ascii_lowercase();
        e == "jpg" || e == "jpeg" || e == "hdr"
    };
    match has_alpha && path.extension().is_some_and(has_none) {
        true => Err(CliError::Usage(format!(
            "{}: the format has no alpha, and the picture is transparent; name a .png or .exr, or \
             render with another --background",
            path.display()
        ))),
        false => Ok(()),
    }
}

/// Names the integrator that was chosen, unless it is the plain one.
fn light_of(
    config: &RenderConfig,
    reached: Option<Reached>,
    cache: Option<&CacheCounts>,
    file: Option<&Path>,
) -> String {
    let name = match config.integrator {
        Integrator::Direct => return String::new(),
        Integrator::Path => "paths",
        Integrator::Ao => "ambient occlusion",
        Integrator::Inspect(_) => return String::new(),
    };
    let cache = cache.map_or(String::new(), |counts| {
        let origin = file.map_or(String::new(), |file| {
            let file = printable_line(&file.display().to_string());
            let (read, added, seconds) = (counts.from_file, counts.added, counts.seconds);
            format!(" ({read} from {file}, {added} added in {seconds:.3} s)")
        });
        format!(", {} records in the cache{origin}", counts.records())
    });
    let (Some(reached), Some(adaptive)) = (reached, config.adaptive) else {
        return format!(", {name} of {} spp{cache}", config.spp);
    };
    let noise = adaptive.noise;
    let quality = match reached.noisy {
        0.0 => format!("noise below {noise}"),
        noisy => format!(
            "noise above {noise} in {:.1} % of the picture at --max-spp {}",
            noisy * 100.0,
            adaptive.most()
        ),
    };
    format!(
        ", {name} of {:.1} spp in the mean, {quality}{cache}",
        reached.mean_samples
    )
}

/// Lists the files of a picture with these outputs, or of a tile.
pub fn files(path: &Path, aovs: AovSet) -> Result<Vec<PathBuf>, CliError> {
    if tile::is_tile(path) {
        return Ok(vec![path.into()]);
    }
    let files = picture_files(path, aovs.any()).map_err(|e| CliError::Usage(e.to_string()))?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// Returns `-o`, or the scene's name as a PNG, or as a part of a picture, in the current folder.
fn output_path(args: &RenderArgs) -> PathBuf {
    if let Some(path) = &args.output {
        return path.clone();
    }
    let named = args
        .scene
        .as_deref()
        .filter(|path| *path != Path::new(STDIN));
    let stem = named.and_then(Path::file_stem);
    let mut name = stem.unwrap_or("lanecast".as_ref()).to_os_string();
    name.push(match (&args.light.samples, args.outputs.tile) {
        (None, None) => ".png".into(),
        (Some(_), _) => ".sums".into(),
        (None, Some(tile)) => format!("_{:02}.tile", tile.number),
    });
    name.into()
}
