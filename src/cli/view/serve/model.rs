//! The scene of all pages: loaded once, with the trees and solids that they have asked for.

use super::locked;
use super::look::{Base, Shot, name};
use crate::error::CliError;
use crate::pipeline::{self, counts_work, named, structure_of, thread_pool};
use crate::probe::{self, Report};
use glam::DVec3;
use lanecast_engine::accel::{BuildQuality, KdQuality, Structure, World};
use lanecast_engine::trace::{Solids, TraceScratch};
use lanecast_io::{self as io, Animated, LoadError, LoadOptions, Loaded, ReadLog};
use lanecast_measure::{Stats, Watch};
use lanecast_model::plan::{Choices, Kernels, Plan, PlanError, plan};
use lanecast_model::scene::{Instances, Pace, Scene, Timeline, framed_bounds};
use lanecast_picture::render::RenderConfig;
use rayon::ThreadPool;
use serde::Serialize;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

/// As `--frames A..B` has them unless `--fps` says otherwise.
const FRAMES_PER_SECOND: f64 = 24.0;

/// As of `--frames`.
const MOST_FRAMES: f64 = 100_000.0;

pub struct Model {
    pub scene: Scene,
    pub instances: Instances,
    pub about: About,
    /// The middle of the scene and its diagonal; the origin and 1 of one without bounds.
    pub extent: (DVec3, f64),
    /// The height of its lowest point, once a ground was asked for.
    pub lowest: OnceLock<f64>,
    plans: Mutex<Vec<(Choices, Plan)>>,
    worlds: Mutex<Vec<(Structure, Arc<World>)>>,
    solids: OnceLock<Result<Solids, String>>,
}

/// What pages tell of the scene.
#[derive(Serialize)]
pub struct About {
    pub name: String,
    /// Names of the cameras, or their numbers.
    pub cameras: Vec<String>,
    pub instances: u64,
    pub shapes: usize,
    pub triangles: usize,
    pub lights: usize,
    pub warning: Option<String>,
    /// Whether some camera blurs what moves.
    pub has_shutter: bool,
    /// Whether `--shutter` blurs what moves: not an animation of a glTF file, which is read at frames.
    pub blurs: bool,
    /// When the shutters of cameras open and close, as `--shutter` says it.
    pub shutters: Vec<String>,
    /// Frames of the scene's motion, 24 a second; 0 if nothing moves.
    pub frames: u32,
    /// Seconds that loading and the first trees took.
    pub seconds: f64,
}

/// Returns the animation of a glTF file with all its frames, which are read when the file is.
fn whole(name: &str) -> Animated {
    Animated {
        name: Some(name.into()),
        timeline: Timeline {
            pace: Pace::PerSecond(FRAMES_PER_SECOND),
            first: 0,
            end: MOST_FRAMES as u32,
            stride: 1,
        },
        margin: 1,
        blurs: false,
    }
}

/// Returns how many frames there are of a scene's motion.
fn frames(scene: &Scene) -> u32 {
    match scene.moves() {
        true => (scene.seconds.0 * FRAMES_PER_SECOND)
            .ceil()
            .clamp(1.0, MOST_FRAMES) as u32,
        false => 0,
    }
}

impl Model {
    /// Loads the scene, and builds the trees that its first picture needs. `asked` gets the files
    /// that it names.
    pub fn load(base: &Base, asked: &ReadLog) -> Result<Model, CliError> {
        let start = Instant::now();
        let args = base.plain()?;
        let path = named(base.scene.as_deref());
        let options = LoadOptions {
            reads: asked.clone(),
            animation: args.common.import.animation.as_deref().map(whole),
            ..args.load_options(Vec::new())
        };
        let Loaded { scene, warning } = match &base.scene {
            Some(path) => io::load(path, &options)?,
            None => Loaded {
                scene: pipeline::load(None, &options, &mut Watch::start(), &mut Stats::default())?,
                warning: None,
            },
        };
        let of_scene = |source| LoadError::of_scene(path, source);
        let config = args.config()?;
        let scene = match config.solver {
            Some(solver) => scene.solved_by(solver).map_err(of_scene)?,
            None => scene,
        };
        let instances = Instances::of(&scene).map_err(of_scene)?;
        let bounds = framed_bounds(&scene, &instances);
        let extent = bounds.map(|bounds| (bounds.center(), bounds.diagonal()));
        let cameras = &scene.cameras;
        let rows = 0..cameras.rows.len() as u32;
        let label = |row: u32| match cameras
            .names
            .get(row)
            .or_else(|| cameras.node_names.get(row))
        {
            Some(name) => name.to_owned(),
            None => row.to_string(),
        };
        let mut model = Model {
            about: About {
                name: name(base),
                cameras: rows.clone().map(label).collect(),
                instances: instances.count(),
                shapes: scene.shapes.len(),
                triangles: scene.meshes.triangles.len(),
                lights: scene.lights.len(),
                warning,
                frames: frames(&scene),
                has_shutter: scene.moves() && !cameras.shutters.is_empty(),
                blurs: scene.moves() && args.common.import.animation.is_none(),
                shutters: rows
                    .filter_map(|row| cameras.shutter(row as usize))
                    .map(|shutter| format!("{}..{}", shutter.open, shutter.close))
                    .collect(),
                seconds: 0.0,
            },
            extent: extent
                .filter(|(_, size)| *size > 0.0)
                .unwrap_or((DVec3::ZERO, 1.0)),
            scene,
            instances,
            lowest: OnceLock::new(),
            plans: Mutex::default(),
            worlds: Mutex::default(),
            solids: OnceLock::new(),
        };
        model.traced(&config, &thread_pool(base.threads)?)?;
        model.about.seconds = start.elapsed().as_secs_f64();
        Ok(model)
    }

    /// Returns the trees and kernels of a picture; builds on `pool` what is not there.
    pub fn traced(
        &self,
        config: &RenderConfig,
        pool: &ThreadPool,
    ) -> Result<(Arc<World>, Kernels), CliError> {
        let (structure, kernels) = self.planned(config)?;
        let mut worlds = locked(&self.worlds);
        if let Some((_, world)) = worlds.iter().find(|(of, _)| *of == structure) {
            return Ok((Arc::clone(world), kernels));
        }
        let quality: BuildQuality = config.build;
        let build = || World::build_to(quality, &self.scene, &self.instances, structure);
        let world = Arc::new(pool.install(build));
        worlds.push((structure, Arc::clone(&world)));
        Ok((world, kernels))
    }

    /// Returns the trees and kernels of a shot.
    pub fn shown(&self, shot: &Shot, pool: &ThreadPool) -> Result<(Arc<World>, Kernels), CliError> {
        let (world, kernels) = self.traced(&shot.config, pool)?;
        // A ground is one more thing, of a kind that the scene may lack.
        let kernels = match (&shot.placed, shot.config.ground) {
            (Some(instances), Some(_)) => {
                plan(&shot.scene, instances, &shot.config.choices)
                    .map_err(|e: PlanError| CliError::Usage(e.to_string()))?
                    .kernels
            }
            _ => kernels,
        };
        Ok(match &shot.placed {
            Some(instances) => {
                let world = pool.install(|| world.at_time(&shot.scene, instances));
                (Arc::new(world), kernels)
            }
            None => (world, kernels),
        })
    }

    fn planned(&self, config: &RenderConfig) -> Result<(Structure, Kernels), CliError> {
        let counts = counts_work(config, &self.instances)?;
        let kd: &KdQuality = &config.kd;
        let mut plans = locked(&self.plans);
        if let Some((_, plan)) = plans.iter().find(|(of, _)| *of == config.choices) {
            return Ok((structure_of(plan, kd, counts), plan.kernels));
        }
        let made = plan(&self.scene, &self.instances, &config.choices)
            .map_err(|e: PlanError| CliError::Usage(e.to_string()))?;
        let found = (structure_of(&made, kd, counts), made.kernels);
        plans.push((config.choices, made));
        Ok(found)
    }

    /// Lists the spans of a ray through the solids, as `probe` does.
    pub fn probe(&self, org: DVec3, dir: DVec3) -> Result<Report, String> {
        let prepare = || Solids::prepare(&self.scene, &self.instances).map_err(|e| e.to_string());
        let solids = self
            .solids
            .get_or_init(prepare)
            .as_ref()
            .map_err(String::clone)?;
        let found = solids.spans(org, dir, &mut TraceScratch::default());
        Ok(probe::report(&self.scene, &found, org, dir))
    }
}
