//! The first steps of every command that traces: load → instances → camera and lights →
//! plan → build. The caller times and uses the parts.

use super::args::{Size, ViewArgs, has_lens};
use super::error::CliError;
use super::looks::beyond_direct;
use super::progress::{Drawing, Style};
use super::{interrupt, scene};
use lanecast_engine::accel::{BuildQuality, KdQuality, Structure, World};
use lanecast_io::{Animated, Curves, LoadError, LoadOptions, ZUp, clipped};
use lanecast_measure::{InstanceNames, PlanSummary, SceneCounts, Stats, Watch};
use lanecast_model::plan::{Plan, PlanError, plan};
use lanecast_model::scene::{Camera, Instances, Lighting, Material, Projection, Scene, builtin};
use lanecast_picture::render::{Grid, Inspection, Integrator, Progress, RenderConfig, View};
pub use lanecast_picture::tracer::structure;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::Path;
use std::sync::Arc;

/// A complete scene, and how it will be traced.
pub struct Prepared {
    pub scene: Scene,
    pub instances: Instances,
    pub camera: Camera,
    /// The camera's row of the scene's table, unless it was made.
    pub camera_row: Option<usize>,
    pub plan: Plan,
    pub build: BuildQuality,
    pub kd: KdQuality,
    /// Whether the structure has to count its work.
    pub counts: bool,
    pub pool: ThreadPool,
}

pub fn prepare(
    path: Option<&Path>,
    options: &LoadOptions,
    (config, seen): (&RenderConfig, &ViewArgs),
    watch: &mut Watch,
    stats: &mut Stats,
) -> Result<Prepared, CliError> {
    let scene = load(path, options, watch, stats)?;
    let (scene, config) = scene::viewed(scene, config.clone(), seen, named(path))?;
    complete(scene, named(path), &config, watch, stats)
}

/// Loads a scene, or makes the built-in one.
pub fn load(
    path: Option<&Path>,
    options: &LoadOptions,
    watch: &mut Watch,
    stats: &mut Stats,
) -> Result<Scene, CliError> {
    let scene = match path {
        Some(path) => scene::load(path, options)?,
        None => {
            refuse_of_files(options)?;
            let scene = builtin().map_err(|e| CliError::Usage(e.to_string()))?;
            clipped(scene, options, named(path), None)?.scene
        }
    };
    stats.stages.push(watch.stage("load"));
    Ok(scene)
}

/// Refuses options of reading files, where there is none.
fn refuse_of_files(options: &LoadOptions) -> Result<(), CliError> {
    let is_named = |animation: &Animated| animation.name.is_some();
    let given = [
        ("--format", options.given.is_some()),
        ("--variant", options.variant.is_some()),
        (
            "--animation",
            options.animation.as_ref().is_some_and(is_named),
        ),
        ("--point-radius", options.point_radius.is_some()),
        ("--z-up", options.z_up != ZUp::Never),
        ("--scad-curves", options.scad_curves != Curves::default()),
        ("--allow-outside", options.allow_outside),
    ];
    match given.iter().find(|(_, is)| *is) {
        Some((name, _)) => Err(CliError::Usage(format!(
            "{name} is of a file, and no scene is named; name one, or leave it out"
        ))),
        None => Ok(()),
    }
}

/// Returns what messages call a scene.
pub fn named(path: Option<&Path>) -> &Path {
    path.unwrap_or(Path::new("the built-in scene"))
}

/// Creates a command's thread pool; by default with all hardware threads.
pub fn thread_pool(threads: Option<u32>) -> Result<ThreadPool, CliError> {
    let threads = threads.unwrap_or(0) as usize;
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| CliError::Usage(format!("{threads} threads cannot be started: {e}")))
}

/// Gives a picture the size that its calibrated camera was measured for, if none is asked for.
pub fn of_camera(
    config: RenderConfig,
    scene: &Scene,
    asked: Option<Size>,
) -> Result<RenderConfig, CliError> {
    let row = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
    let camera = row.map(|row| scene.cameras.rows[row].projection);
    match (camera, asked) {
        (Some(Projection::Calibrated(k)), None) => Ok(RenderConfig {
            width: k.size[0],
            height: k.size[1],
            ..config
        }),
        _ => Ok(config),
    }
}

/// Prepares a scene that is already loaded; errors name the file `path`.
pub fn complete(
    scene: Scene,
    path: &Path,
    config: &RenderConfig,
    watch: &mut Watch,
    stats: &mut Stats,
) -> Result<Prepared, CliError> {
    let of_scene = |source| LoadError::of_scene(path, source);
    let scene = match config.solver {
        Some(solver) => scene.solved_by(solver).map_err(of_scene)?,
        None => scene,
    };
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let (scene, camera, row) = lit(scene, config, &instances)?;
    let plan = plan(&scene, &instances, &config.choices)
        .map_err(|e: PlanError| CliError::Usage(e.to_string()))?;
    let counts = counts_work(config, &instances)?;
    stats.stages.push(watch.stage("plan"));
    let pool = thread_pool(config.threads)?;
    stats.plan = PlanSummary {
        precision: config.choices.precision.name(),
        lanes: plan.kernels.lanes as u32,
        accel: plan.accel.name().into(),
        threads: pool.current_num_threads() as u32,
        isa: isa(),
        solvers: scene.implicits.chosen_solvers(),
    };
    stats.scene = SceneCounts {
        instances: instances.count(),
        shapes: scene.shapes.len() as u64,
        triangles: scene.meshes.triangles.len() as u64,
        lights: scene.lights.len() as u64,
    };
    stats.instance_names = InstanceNames::of(&scene, &instances);
    for (name, bytes) in scene.bytes() {
        stats.memory.insert(name.into(), bytes as u64);
    }
    Ok(Prepared {
        scene,
        instances,
        camera,
        camera_row: row,
        plan,
        build: config.build,
        kd: config.kd,
        counts,
        pool,
    })
}

/// Gives a scene the camera and the lights that it lacks, by the integrator. Returns the camera, and
/// its row unless it was made.
pub fn lit(
    scene: Scene,
    config: &RenderConfig,
    instances: &Instances,
) -> Result<(Scene, Camera, Option<usize>), CliError> {
    let row = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
    let lighting = match config.integrator {
        Integrator::Direct => Lighting::Headlight,
        _ => Lighting::Studio,
    };
    let (scene, camera) = scene.completed_in(lighting, row, instances, config.aspect());
    Ok((scene, camera, row))
}

/// Says whether a picture needs a structure that counts its work.
pub fn counts_work(config: &RenderConfig, instances: &Instances) -> Result<bool, CliError> {
    let counts = matches!(config.integrator, Integrator::Inspect(Inspection::Heat(_)));
    if counts && !instances.are_laid_out() {
        return Err(CliError::Usage(
            "--integrator heat counts in trees over all instances, of which the scene has too many; \
             ask for ids or normals"
                .into(),
        ));
    }
    Ok(counts)
}

/// Returns the structure of a plan, or the one in its place that counts its work.
pub fn structure_of(plan: &Plan, kd: &KdQuality, counts: bool) -> Structure {
    match structure(plan, kd) {
        Structure::Bvh | Structure::ItemBuffer if counts => Structure::Narrow,
        structure => structure,
    }
}

/// Says what the integrator does not show, a line each: of direct light layers of materials, and the extent of
/// lights; of drawings by edges the hatching of cuts.
pub fn losses(scene: &Scene, config: &RenderConfig, hatches: bool) -> Vec<String> {
    let mut lost: Vec<String> = Vec::new();
    if hatches && config.integrator == Integrator::Inspect(Inspection::Edges) {
        lost.push(
            "--integrator edges draws no hatching; --integrator direct or path shows that of \
             --hatch"
                .into(),
        );
    }
    let mut layers = beyond_direct(scene);
    // Of corners another warning tells these.
    if config.grid == Grid::Centers {
        let shines = |m: &Material| m.emission != [0.0; 3];
        let is_lit = scene.materials.rows.iter().any(shines);
        let more = [
            ("the environment", scene.environment.is_some()),
            ("the light of things that shine", is_lit),
        ];
        layers.extend(more.iter().filter(|(_, is)| *is).map(|(what, _)| *what));
    }
    if config.integrator == Integrator::Direct && !layers.is_empty() {
        lost.push(format!(
            "direct light does not show {}; --integrator path does",
            layers.join(", ")
        ));
    }
    let areas = scene.lights.iter().filter(|light| light.area() > 0.0);
    let count = areas.count();
    if config.integrator == Integrator::Direct && count > 0 {
        lost.push(format!(
            "direct light takes {count} × rectangle or disc for points of their power in \
             their middles; --integrator path shows them"
        ));
    }
    let row = config.camera.as_deref();
    let row = scene::pick_camera(&scene.cameras, row).ok().flatten();
    if config.integrator == Integrator::Direct
        && row.is_some_and(|row| has_lens(&scene.cameras.rows[row]))
    {
        lost.push("direct light goes through a pinhole; --integrator path shows the lens".into());
    }
    if config.grid == Grid::Corners && (scene.is_dark() || scene.has_soft_light()) {
        lost.push(
            "--grid corners shoots one ray through each corner, for direct light alone: \
             the studio, skies and things that shine are left out; --grid centers shows them"
                .into(),
        );
    }
    lost
}

impl Prepared {
    /// Builds the trees, and traces rays through the view on the pool, while progress is drawn.
    pub fn traced<T: Send>(
        &self,
        (watch, stats): (&mut Watch, &mut Stats),
        (progress, style): (&Arc<Progress>, Style),
        trace: impl FnOnce(&View) -> T + Send,
    ) -> Result<T, CliError> {
        interrupt::check(progress)?;
        let world = self.world(watch, stats);
        interrupt::check(progress)?;
        let view = View {
            world: &world,
            kernels: self.plan.kernels,
            camera: self.camera,
            lights: &self.scene.lights,
        };
        let _drawing = Drawing::start(progress, style);
        Ok(self.pool.install(|| trace(&view)))
    }

    /// Builds the trees on the pool.
    pub fn world(&self, watch: &mut Watch, stats: &mut Stats) -> World {
        self.world_on(&self.pool, (watch, stats))
    }

    /// Builds the trees on another pool.
    pub fn world_on(&self, pool: &ThreadPool, (watch, stats): (&mut Watch, &mut Stats)) -> World {
        let structure = structure_of(&self.plan, &self.kd, self.counts);
        let build = || World::build_to(self.build, &self.scene, &self.instances, structure);
        let world = pool.install(build);
        for (name, bytes) in world.bytes() {
            stats.memory.insert(name.into(), bytes as u64);
        }
        stats.stages.push(watch.stage("build"));
        world
    }
}

/// Returns the widest instruction set that the lanes were compiled for.
pub fn isa() -> &'static str {
    if cfg!(target_feature = "avx512f") {
        "avx512"
    } else if cfg!(all(target_feature = "avx2", target_feature = "fma")) {
        "avx2+fma"
    } else if cfg!(target_feature = "avx") {
        "avx"
    } else if cfg!(target_arch = "x86_64") {
        "sse2"
    } else if cfg!(target_arch = "aarch64") {
        "neon"
    } else {
        "scalar"
    }
}
