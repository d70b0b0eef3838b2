//! The picture of one task, as `lanecast render` makes it, from a scene that several tasks share.
//!
//! Trees of meshes are built for the first task of a scene. A world that is not in use serves tasks
//! with other views; another time, or a task beside, gets a top-level tree of its own over the same
//! trees. No bit shows it (docs/ARCHITECTURE.md, Trees).

use super::dataset::{self, Sample};
use crate::args::RenderArgs;
use crate::args::Told;
use crate::denoise::{self, Denoiser};
use crate::error::CliError;
use crate::metadata;
use crate::output::complain;
use crate::pipeline::{Prepared, complete, losses, named, of_camera, structure_of};
use crate::render::{check_alpha, exposed, files as picture_files};
use crate::scene::{pick_camera, viewed};
use crate::{ground, interrupt, memory, motion, shutter, tile};
use lanecast_engine::accel::{Structure, World};
use lanecast_io::{LoadError, Outputs};
use lanecast_measure::{Stats, Watch};
use lanecast_model::scene::{Instances, Scene, Tables};
use lanecast_picture::render::{
    Backdrop, Progress, RenderConfig, View, render_blurred, window_key,
};
use rayon::ThreadPool;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A scene that was loaded, and the worlds over it.
pub struct Loaded {
    pub scene: Scene,
    /// What was left out.
    pub warning: Option<String>,
    worlds: Mutex<Vec<Kept>>,
}

/// A world that tasks use, or may use next.
struct Kept {
    structure: Structure,
    /// The time of what moves.
    time: Option<u64>,
    world: Arc<World>,
}

impl Loaded {
    pub fn new(scene: Scene, warning: Option<String>) -> Loaded {
        Loaded {
            scene,
            warning,
            worlds: Mutex::default(),
        }
    }

    /// Returns the bytes of the scene's tables and trees. Worlds share the largest of them, trees of
    /// meshes; of what each has of its own the first is counted. Trees that are being built are none yet.
    pub fn bytes(&self) -> u64 {
        let worlds = self.worlds.try_lock().ok();
        let first = worlds.as_ref().and_then(|worlds| worlds.first());
        let trees = first.map(|kept| kept.world.bytes());
        let tables = self.scene.bytes().into_iter();
        let all = tables.chain(trees.into_iter().flatten());
        all.map(|(_, bytes)| bytes as u64).sum()
    }

    /// Returns the world of a task at a time, and whether it is the scene's first. The first of each
    /// structure is built on `pool` while others wait.
    fn world(
        &self,
        prepared: &Prepared,
        (pool, time): (&ThreadPool, f64),
        (watch, stats): (&mut Watch, &mut Stats),
    ) -> (Arc<World>, bool) {
        let time = prepared.scene.moves().then_some(time.to_bits());
        let structure = structure_of(&prepared.plan, &prepared.kd, prepared.counts);
        let kept = |world: &Arc<World>| Kept {
            structure,
            time,
            world: Arc::clone(world),
        };
        let mut worlds = self.worlds.lock().unwrap_or_else(PoisonError::into_inner);
        let alike = |kept: &&Kept| kept.structure == structure;
        if !worlds.iter().any(|kept| alike(&kept)) {
            let is_first = worlds.is_empty();
            let world = Arc::new(prepared.world_on(pool, (watch, stats)));
            worlds.push(kept(&world));
            return (world, is_first);
        }
        let asked: &Tables = &prepared.scene;
        let is_same = |kept: &&Kept| {
            let tables: &Tables = &kept.world.scene;
            std::ptr::eq(tables, asked)
        };
        if let Some(kept) = worlds.iter().filter(alike).find(is_same) {
            return (Arc::clone(&kept.world), false);
        }
        // Views and lights are no part of a tree: a world that nobody uses gets those of the task.
        let of_time = |kept: &&mut Kept| kept.structure == structure && kept.time == time;
        for kept in worlds.iter_mut().filter(of_time) {
            if let Some(world) = Arc::get_mut(&mut kept.world) {
                world.scene = prepared.scene.clone();
                world.instances = prepared.instances.clone();
                return (Arc::clone(&kept.world), false);
            }
        }
        let source = worlds
            .iter()
            .find(alike)
            .map(|kept| Arc::clone(&kept.world));
        drop(worlds);
        let world = Arc::new(match source.as_deref() {
            Some(source) if structure == Structure::Bvh => {
                let world = || source.at_time(&prepared.scene, &prepared.instances);
                let world = prepared.pool.install(world);
                stats.stages.push(watch.stage("build"));
                world
            }
            _ => prepared.world(watch, stats),
        });
        drop(source);
        let mut worlds = self.worlds.lock().unwrap_or_else(PoisonError::into_inner);
        // Times go on; as many worlds stay as are in use, and one that others are made from.
        let in_use = |kept: &Kept| {
            kept.structure != structure || kept.time == time || Arc::strong_count(&kept.world) > 1
        };
        worlds.retain(in_use);
        worlds.push(kept(&world));
        (world, false)
    }
}

/// Refuses options that no scene would make right.
pub fn check(args: &RenderArgs, output: &Path) -> Result<(), CliError> {
    let config = args.config()?;
    args.development.checked(output)?;
    metadata::check(args, output, config.aovs)?;
    check_alpha(config.backdrop == Backdrop::Transparent, output)?;
    picture_files(output, config.aovs)?;
    if let Some(path) = args.output.as_deref() {
        tile::check(args, path)?;
    }
    tile::foreseen(args, config)?;
    args.sequence.timeline().map_err(CliError::Usage)?;
    Denoiser::load(args.outputs.denoise)?;
    Ok(())
}

/// Lists the files of a task.
pub fn files(args: &RenderArgs, output: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut files = picture_files(output, args.outputs.most())?;
    files.extend(args.outputs.denoise.then(|| denoise::beside(output)));
    Ok(files)
}

/// Renders a task, and returns its files, which the caller commits, and the names of those that its
/// data set has, if it is of one.
pub fn rendered(
    args: &RenderArgs,
    output: &Path,
    (loaded, sample): (&Loaded, Option<&Sample>),
    (pool, progress): (&ThreadPool, &Progress),
    (watch, stats): (&mut Watch, &mut Stats),
) -> Result<(Outputs, Vec<PathBuf>), CliError> {
    let config = args.config()?;
    let development = args.development.checked(output)?;
    let denoiser = Denoiser::load(args.outputs.denoise)?;
    let path = args.scene.as_deref();
    let of_scene = |source| LoadError::of_scene(named(path), source);
    let timeline = args.sequence.timeline().map_err(CliError::Usage)?;

    let scene = loaded.scene.clone();
    let (scene, config) = viewed(scene, config, &args.common.view, named(path))?;
    let row = pick_camera(&scene.cameras, config.camera.as_deref())?;
    let how = (config.grid, args.light.integrator.0);
    let seconds = scene.seconds.0;
    let (time, step) = match &timeline {
        Some(timeline) => (
            timeline.time(timeline.first.into(), seconds),
            timeline.step(seconds),
        ),
        None => (0.0, 1.0),
    };
    let shutter = args.shutter.exposure(&scene, row, how, (time, step))?;
    let config = RenderConfig {
        shutter,
        frame: timeline.map_or(0, |timeline| timeline.first),
        ..of_camera(config, &scene, args.common.size)?
    };
    let config = tile::windowed(args.outputs.tile, config)?;
    let config = args.light.complete(config, &scene)?;
    let config = args.outputs.complete(config)?;
    let scene = match timeline {
        None => exposed(scene, &config, args.light.ground, named(path))?,
        Some(_) if args.light.ground && scene.moves() => {
            return Err(CliError::Usage(
                "--ground lies under things as they stand, and in this scene they move; leave it \
                 out"
                .into(),
            ));
        }
        Some(_) => scene,
    };
    let (scene, config) = match args.light.ground {
        true => ground::stand(scene, named(path), config)?,
        false => (scene, config),
    };
    let asked = config.aovs;
    let config = motion::rendered(config);
    let config = match sample {
        Some(_) => dataset::rendered(config),
        None => config,
    };
    let config = match &denoiser {
        Some(denoiser) => denoiser.rendered(config)?,
        None => config,
    };
    memory::check(&config, development.bits, output)?;
    let (development, config) = (args.development).complete(development, output, config);
    let mut prepared = complete(scene, named(path), &config, watch, stats)?;
    let middle = config.shutter.map_or(time, |exposure| exposure.middle());
    if timeline.is_some() {
        prepared.scene = prepared.scene.at(middle).map_err(of_scene)?;
        prepared.instances = Instances::of(&prepared.scene).map_err(of_scene)?;
    }
    let (world, is_first) = loaded.world(&prepared, (pool, middle), (&mut *watch, &mut *stats));
    interrupt::check(progress)?;
    if is_first {
        // Of many scenes each is named.
        for lost in losses(&prepared.scene, &config, args.common.import.hatch.is_some()) {
            complain(&format!("warning: {}: {lost}", named(path).display()));
        }
    }
    let row = prepared.camera_row;
    let view = View {
        world: &world,
        kernels: prepared.plan.kernels,
        camera: row.map_or(prepared.camera, |row| prepared.scene.cameras.rows[row]),
        lights: &prepared.scene.lights,
    };
    let render = || -> Result<_, CliError> {
        let slices = args.shutter.shutter_slices;
        Ok(
            match shutter::slices(&view, row, &config, slices, named(path))? {
                Some(slices) => render_blurred(&view, &slices, &config, progress, &|_| ())?,
                None => lanecast_picture::render::render(&view, &config, false, progress)?,
            },
        )
    };
    let rendered = prepared.pool.install(render)?;
    let mut picture = rendered.picture;
    stats.rays = rendered.counts;
    stats.stages.push(watch.stage("render"));

    let config = RenderConfig {
        aovs: asked,
        ..config
    };
    let mut outputs = Outputs::default();
    let files = sample.map(|sample| {
        let add = || sample.add(&mut picture, &config, &view, progress, &mut outputs);
        let files = prepared.pool.install(add);
        stats.stages.push(watch.stage("dataset"));
        files
    });
    let files = files.transpose()?.unwrap_or_default();
    let shown = motion::Shown {
        scene: &prepared.scene,
        instances: &prepared.instances,
        camera: view.camera,
        camera_row: row,
        time: if timeline.is_some() || config.shutter.is_some() {
            middle
        } else {
            0.0
        },
        step,
    };
    shown.add_vectors(&mut picture, &config, named(path))?;
    // Files of one task are equal, whoever makes them: times are in the records.
    let told = match args.outputs.metadata {
        Told::Auto if asked.any_of_layers() => Told::Fixed,
        told => told,
    };
    let mean = rendered.reached.map(|reached| reached.mean_samples);
    let errors = metadata::SquaredErrors::of(&picture);
    picture.metadata = metadata::of(told, (&config, &view.camera, path), (errors, mean), stats);
    if let Some(denoiser) = &denoiser {
        let (filtered, _) = denoiser.filter(&mut picture, &asked, config.threads)?;
        filtered.save_into(&denoise::beside(output), &development, &mut outputs)?;
        stats.stages.push(watch.stage("denoise"));
    }
    let key = config.window.map(|_| window_key(&view, &config));
    tile::save(picture, output, (&config, &development), key, &mut outputs)?;
    Ok((outputs, files))
}
