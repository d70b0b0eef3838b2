//! `lanecast render --frames`: renders a sequence of pictures over the scene's motion.
//!
//! Frame i of N is at time i / (N − 1); frame i of a range is i / fps seconds after the beginning,
//! whatever the range, so that it is the same in any. From one frame to the next the meshes' trees
//! are kept, the top-level tree is refitted or rebuilt, and camera rays start with
//! temporal bounds; no bit of a picture depends on any of it. The samples of a frame are a
//! function of its number, so that noise does not stand still. Records of indirect light are kept
//! where nothing moves but the camera (LIGHT, rule S116), and they alone show.

use super::args::RenderArgs;
use super::denoise::{self, Denoiser};
use super::error::CliError;
use super::output::{Results, check_destinations, complain, printable_line, with_name_end};
use super::pipeline::{Prepared, complete, load, losses, named, of_camera, structure_of};
use super::progress::{Drawing, rate};
use super::render::files;
use super::scene::{pick_camera, viewed};
use super::{ground, interrupt, metadata, motion, shutter, tile};
use lanecast_engine::accel::{KeptTrees, RefitOutcome, WORST_REFIT, World};
use lanecast_engine::trace::Reuse;
use lanecast_io::{Development, LoadError};
use lanecast_measure::{FrameStats, Stats, Watch};
use lanecast_model::plan::places_meshes;
use lanecast_model::scene::{Instances, Scene, Timeline};
use lanecast_picture::render::{
    FrameMemory, LightCache, RenderConfig, Rendered, View, render_after, render_blurred, window_key,
};
use std::path::{Path, PathBuf};

pub fn run(
    args: &RenderArgs,
    config: &RenderConfig,
    output: &Path,
    development: &Development,
    timeline: Timeline,
    mut stats: Stats,
) -> Result<(), CliError> {
    let progress = interrupt::watch();
    // The name that was given is checked, not those that are made of it.
    files(output, config.aovs)?;
    let paths: Vec<PathBuf> = timeline.frames().map(|i| numbered(output, i)).collect();
    let files = paths.iter().map(|path| files(path, config.aovs));
    let mut files: Vec<PathBuf> = files.collect::<Result<Vec<_>, _>>()?.concat();
    if args.outputs.denoise {
        files.extend(paths.iter().map(|path| denoise::beside(path)));
    }
    let shown_files = files.len();
    let cache_file = args.light.cache_file.as_deref();
    files.extend(args.light.cache_file.clone());
    let inputs: Vec<&Path> = args.scene.as_deref().into_iter().collect();
    let outputs = check_destinations(&inputs, &files, args.common.sinks())?;
    let denoiser = Denoiser::load(args.outputs.denoise)?;
    interrupt::check(&progress)?;

    let mut watch = Watch::start();
    let options = args.load_options(outputs);
    let scene = args.scene.as_deref();
    let loaded = load(scene, &options, &mut watch, &mut stats)?;
    let (loaded, config) = viewed(loaded, config.clone(), &args.common.view, named(scene))?;
    let row = pick_camera(&loaded.cameras, config.camera.as_deref())?;
    let how = (config.grid, args.light.integrator.0);
    let seconds = loaded.seconds.0;
    let step = timeline.step(seconds);
    let exposure = |scene: &Scene, time| args.shutter.exposure(scene, row, how, (time, step));
    let config = RenderConfig {
        shutter: exposure(&loaded, timeline.time(timeline.first.into(), seconds))?,
        ..of_camera(config, &loaded, args.common.size)?
    };
    let config = tile::windowed(args.outputs.tile, config)?;
    let config = args.light.complete(config, &loaded)?;
    let config = args.outputs.complete(config)?;
    if args.light.ground && loaded.moves() {
        return Err(CliError::Usage(
            "--ground lies under things as they stand before one camera, and in this scene they or the \
             camera move; leave it out"
                .into(),
        ));
    }
    let (loaded, config) = match args.light.ground {
        true => ground::stand(loaded, named(scene), config)?,
        false => (loaded, config),
    };
    let keeps = keeps_light(args, &loaded, paths.len())?;
    for lost in losses(&loaded, &config, args.common.import.hatch.is_some()) {
        complain(&format!("warning: {lost}"));
    }
    stats.picture.spp = config.spp;
    let asked_aovs = config.aovs;
    let config = motion::rendered(config);
    let config = match &denoiser {
        Some(denoiser) => denoiser.rendered(config)?,
        None => config,
    };
    let (development, config) = args.development.complete(*development, output, config);
    let (development, config) = (&development, &config);
    let prepared = complete(loaded, named(scene), config, &mut watch, &mut stats)?;
    interrupt::check(&progress)?;
    let structure = structure_of(&prepared.plan, &prepared.kd, prepared.counts);
    let pays = places_meshes(&prepared.scene, &prepared.instances);
    let Prepared {
        mut scene,
        camera,
        camera_row,
        plan,
        build,
        pool,
        ..
    } = prepared;

    let mut results = Results::default();
    let scene_path = args.scene.as_deref();
    let reuse = args.reuse.0;
    let reuse = reuse.unwrap_or_else(|| Reuse::that_pays(pays));
    let mut memory = FrameMemory::new(reuse);
    let mut light: Option<LightCache> = None;
    let name = args.scene.clone().unwrap_or("the built-in scene".into());
    let mut kept: Option<KeptTrees> = None;
    match scene.moves() {
        true => warn_of_end(&timeline, seconds),
        false => complain(
            "warning: nothing in this scene moves, so the pictures of --frames differ in noise at most",
        ),
    }
    for ((number, frame), path) in (0..).zip(timeline.frames()).zip(&paths) {
        let first = stats.stages.len();
        let time = timeline.time(frame.into(), seconds);
        let of_scene = |source| LoadError::of_scene(&name, source);
        let shutter = match config.shutter {
            Some(_) => exposure(&scene, time)?,
            None => None,
        };
        let middle = shutter.map_or(time, |exposure| exposure.middle());
        scene = scene.at(middle).map_err(of_scene)?;
        let instances = Instances::of(&scene).map_err(of_scene)?;
        stats.stages.push(watch.stage("place"));
        let (world, outcome) = pool.install(|| match kept.take() {
            Some(kept) => World::next(kept, &scene, &instances, structure, WORST_REFIT),
            None => (
                World::build_to(build, &scene, &instances, structure),
                RefitOutcome::Built,
            ),
        });
        for (name, bytes) in world.bytes() {
            stats.memory.insert(name.into(), bytes as u64);
        }
        stats.stages.push(watch.stage("build"));
        interrupt::check(&progress)?;
        let view = View {
            world: &world,
            kernels: plan.kernels,
            camera: camera_row.map_or(camera, |row| scene.cameras.rows[row]),
            lights: &scene.lights,
        };
        let config = &RenderConfig {
            frame,
            shutter,
            ..config.clone()
        };
        let asked = args.shutter.shutter_slices;
        let drawing = Drawing::start_part(
            &progress,
            args.common.progress.style,
            (number, paths.len() as u32),
        );
        let mut of_frame = match (light.take(), cache_file) {
            (Some(light), _) if keeps => light,
            (_, Some(file)) => LightCache::load(file, &view, config)?,
            _ => LightCache::default(),
        };
        let render = || -> Result<Rendered, CliError> {
            let kept = (&mut memory, &mut of_frame);
            Ok(
                match shutter::slices(&view, camera_row, config, asked, &name)? {
                    Some(slices) => render_blurred(&view, &slices, config, &progress, &|_| ())?,
                    None => render_after(&view, config, kept, &progress)?,
                },
            )
        };
        let rendered = pool.install(render);
        drop(drawing);
        let mut rendered = rendered?;
        light = Some(of_frame);
        stats.rays.add(&rendered.counts);
        stats.stages.push(watch.stage("render"));
        let of_frame = Stats {
            plan: stats.plan.clone(),
            rays: rendered.counts,
            stages: stats.stages[first..].to_vec(),
            ..Stats::default()
        };
        let of_asked = RenderConfig {
            aovs: asked_aovs,
            ..config.clone()
        };
        let shown = motion::Shown {
            scene: &scene,
            instances: &instances,
            camera: view.camera,
            camera_row,
            time: middle,
            step,
        };
        shown.add_vectors(&mut rendered.picture, &of_asked, &name)?;
        rendered.picture.metadata = metadata::of(
            tile::told(args.outputs.metadata, &of_asked),
            (&of_asked, &view.camera, scene_path),
            (
                metadata::SquaredErrors::of(&rendered.picture),
                rendered.reached.map(|reached| reached.mean_samples),
            ),
            &of_frame,
        );
        if let Some(denoiser) = &denoiser {
            let picture = &mut rendered.picture;
            let (filtered, how) = denoiser.filter(picture, &asked_aovs, config.threads)?;
            stats.stages.push(watch.stage("denoise"));
            stats.denoised = Some(how);
            let path = denoise::beside(path);
            filtered.save_into(&path, development, &mut results.outputs)?;
        }
        let key = config.window.map(|_| window_key(&view, config));
        let (picture, of) = (rendered.picture, (config, development));
        tile::save(picture, path, of, key, &mut results.outputs)?;
        stats.stages.push(watch.stage("write"));
        stats.frames.push(FrameStats {
            frame,
            time,
            top_tree: outcome.name(),
            stages: stats.stages[first..].to_vec(),
            rays: rendered.counts,
            temporal_bounds: memory.counts(),
            cache: rendered.cache,
            mean_spp: rendered.reached.map(|reached| reached.mean_samples),
            noisy: rendered.reached.map(|reached| reached.noisy),
        });
        kept = Some(world.keep());
    }
    if let (Some(file), Some(light)) = (cache_file, &light) {
        light.save_into(file, &mut results.outputs)?;
    }
    stats.finish();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &stats)?;
    interrupt::check(&progress)?;
    let shown = |path: &PathBuf| printable_line(&path.display().to_string());
    results.commit(&format!(
        "{}: {} of {}x{}{}{}, {} rays in {:.3} s, {}\n",
        match &files[..shown_files] {
            [one] => shown(one),
            [first, .., last] => format!("{} … {}", shown(first), shown(last)),
            [] => String::new(),
        },
        match paths.len() {
            1 => "1 frame".to_owned(),
            count => format!("{count} frames"),
        },
        config.width,
        config.height,
        noise_of(&stats.frames, config),
        records_of(&stats.frames),
        stats.rays.total(),
        stats.seconds("render"),
        rate(stats.rays_per_second)
    ))
}

/// Says whether records of indirect light are kept from frame to frame, which shows. Refuses a file of
/// records of a scene that moves.
fn keeps_light(args: &RenderArgs, scene: &Scene, frames: usize) -> Result<bool, CliError> {
    if args.light.cache.is_none() {
        return Ok(false);
    }
    let has_file = args.light.cache_file.is_some();
    let moves = !scene.transforms.motions.is_empty()
        || !scene.deformations.is_empty()
        || !scene.light_motions.is_empty();
    // The studio stands as the camera does.
    let turns = scene.is_dark() && !scene.cameras.motions.is_empty();
    match (moves, args.light.cache_keep) {
        (false, keep) if turns && (has_file || keep == Some(true)) => Err(CliError::Usage(
            "records of light are kept where the light stays, and the studio of this scene, which has no \
             light, turns with the camera; give the scene a light, or leave out --cache-file and \
             --cache-keep"
                .into(),
        )),
        (false, None) if turns => Ok(false),
        (true, None) if has_file => Err(CliError::Usage(
            "--cache-file is of a scene at rest, and in this one more moves than the camera; leave it out"
                .into(),
        )),
        (true, Some(true)) => Err(CliError::Usage(
            "--cache-keep on is for scenes at rest, and in this one more moves than the camera; leave it \
             out"
                .into(),
        )),
        (true, _) | (false, Some(false)) => Ok(false),
        (false, keep) => {
            if keep.is_none() && frames > 1 && !has_file {
                complain(
                    "note: records of --cache are kept from frame to frame, so a frame that is rendered \
                     alone has other bits; with --cache-keep off it has the same",
                );
            }
            Ok(true)
        }
    }
}

/// Tells of the frame that is the noisiest, where noise was asked for.
fn noise_of(frames: &[FrameStats], config: &RenderConfig) -> String {
    let noisy = frames.iter().filter_map(|of| Some((of.noisy?, of.frame)));
    let worst = noisy.max_by(|(a, _), (b, _)| a.total_cmp(b));
    match (worst, config.adaptive) {
        (Some((0.0, _)), Some(adaptive)) => format!(", noise below {}", adaptive.noise),
        (Some((share, frame)), Some(adaptive)) => format!(
            ", noise above {} in up to {:.1} % of a picture (frame {frame}) at --max-spp {}",
            adaptive.noise,
            share * 100.0,
            adaptive.most()
        ),
        _ => String::new(),
    }
}

/// Says how many records of indirect light frames have added, and how many were there.
fn records_of(frames: &[FrameStats]) -> String {
    let caches = || frames.iter().filter_map(|frame| frame.cache.as_ref());
    let Some(first) = caches().next() else {
        return String::new();
    };
    let added: usize = caches().map(|cache| cache.added).sum();
    let seconds: f64 = caches().map(|cache| cache.seconds).sum();
    let read = match first.from_file {
        0 => String::new(),
        read => format!(" to {read} of the file"),
    };
    format!(", {added} records added{read} in {seconds:.3} s")
}

/// Says which frames come after the end of the motion.
fn warn_of_end(timeline: &Timeline, seconds: f64) {
    // The last picture may be just after the last key.
    let late = |frame: &u32| timeline.time(i64::from(*frame) - 1, seconds) >= 1.0;
    if let Some(first) = timeline.frames().find(late) {
        complain(&format!(
            "warning: the motion takes {seconds} seconds, and from frame {first} on nothing moves"
        ));
    }
}

/// Inserts the frame's number: `name.png` becomes `name_0007.png`.
fn numbered(path: &Path, frame: u32) -> PathBuf {
    with_name_end(path, &format!("_{frame:04}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_names() {
        let name = |path: &str, frame| numbered(path.as_ref(), frame);
        assert_eq!(name("a/b.c.png", 7), PathBuf::from("a/b.c_0007.png"));
        assert_eq!(name("x.exr", 12345), PathBuf::from("x_12345.exr"));
        assert_eq!(name("x", 0), PathBuf::from("x_0000"));
    }
}
