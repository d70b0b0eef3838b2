//! The stable interface: a scene that is ready to be asked, and what it answers.
//!
//! A [`Tracer`] owns trees over a scene. It answers rays, lists spans through solids and
//! renders pictures. It holds no other state, so any number of tracers may be asked at once
//! from any number of threads; each answer is what one ray alone in one thread would get
//! (tests/visibility/tracer.rs). Work is distributed over the rayon pool that the caller runs
//! in.

mod batch;
mod error;
mod surfaces;

pub use batch::{ColumnError, Hit, Hits, RayBatch};
pub use error::Error;
pub use surfaces::{SurfaceError, Surfaces};

use crate::accel::{BuildQuality, Density, KdQuality, Structure, World};
use crate::plan::{Accel, Choices, Kernels, Plan, plan};
use crate::render::{
    Exposure, FinishedTile, Integrator, Picture, Progress, RenderConfig, Slices, View,
    instance_name, material_name, render_blurred, render_with,
};
use crate::scene::{Camera, Instances, Light, MaterialId, Scene, default_camera, default_lights};
use crate::shade::barycentrics;
use crate::trace::{
    self, Caching, Depths, HitIds, Ids, ScratchPool, ShadowCache, Spans, TraceScratch, any, closest,
};
use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// Rays that a thread takes at a time.
const CHUNK: usize = 1 << 14;

/// What a [`Tracer`] is built for.
#[derive(Clone, Copy, Debug, Default)]
pub struct TracerOptions {
    /// The precision of its answers, the lanes and the structure.
    pub choices: Choices,
    /// How much time is spent on the trees. It changes no answer.
    pub build: BuildQuality,
}

/// A scene's solids, ready to be asked which parts of lines lie inside them.
pub struct Solids {
    prepared: trace::Solids,
}

impl Solids {
    /// Lists the spans of a line, front to back, behind its origin as well; `dir` has any length
    /// but 0.
    pub fn spans(&self, org: DVec3, dir: DVec3) -> Spans {
        self.prepared.spans(org, dir, &mut TraceScratch::default())
    }

    /// Lists the spans of many lines.
    pub fn spans_of(&self, rays: &RayBatch) -> Vec<Spans> {
        let rows = (0..rays.len()).into_par_iter();
        let one = |scratch: &mut TraceScratch, row: usize| {
            let (org, dir) = rays.ray(row);
            self.prepared.spans(org, dir, scratch)
        };
        rows.map_init(TraceScratch::default, one).collect()
    }
}

/// A scene with its trees, ready to be asked.
pub struct Tracer {
    world: World,
    kernels: Kernels,
}

impl Tracer {
    /// Builds the trees of a scene. Returns an error if the scene has more instances than
    /// can be numbered, or if this build has no kernels for what `options` asks.
    pub fn new(scene: &Scene, options: &TracerOptions) -> Result<Tracer, Error> {
        let instances = Instances::of(scene)?;
        let plan = plan(scene, &instances, &options.choices)?;
        let structure = structure(&plan, &KdQuality::default());
        Ok(Tracer {
            world: World::build_to(options.build, scene, &instances, structure),
            kernels: plan.kernels,
        })
    }

    pub fn scene(&self) -> &Scene {
        &self.world.scene
    }

    /// Finds the closest hit of every ray.
    pub fn closest(&self, rays: &RayBatch) -> Hits {
        let (mut t, mut ids) = (vec![0.0; rays.padded()], HitIds::none(rays.padded()));
        let columns = t
            .par_chunks_mut(CHUNK)
            .zip(ids.instance.par_chunks_mut(CHUNK))
            .zip(ids.primitive.par_chunks_mut(CHUNK));
        let pool = ScratchPool::<TraceScratch>::default();
        columns
            .enumerate()
            .for_each(|(i, ((t, instance), primitive))| {
                let rows = i * CHUNK..i * CHUNK + t.len();
                let mut hits = trace::Hits {
                    t: Depths::Double(t),
                    id: Ids {
                        instance,
                        primitive,
                    },
                };
                let end = &mut RayBatch::default();
                let (kernels, rays) = (&self.kernels, rays.rows(rows, end));
                pool.with(|scratch| closest(&self.world, kernels, &rays, &mut hits, scratch));
            });
        Hits::new(rays.len(), t, ids, |row, id| {
            let (org, dir) = rays.ray(row);
            barycentrics(&self.world, org, dir, id).unwrap_or_default()
        })
    }

    /// Finds the closest hit of one ray beyond its origin.
    pub fn closest_one(&self, org: DVec3, dir: DVec3) -> Option<Hit> {
        let mut ray = RayBatch::default();
        ray.push(org, dir);
        self.closest(&ray).get(0)
    }

    /// Tells of every ray whether it hits anything.
    pub fn occluded(&self, rays: &RayBatch) -> Vec<bool> {
        let mut blocked = vec![false; rays.padded()];
        let chunks = blocked.par_chunks_mut(CHUNK).enumerate();
        let pool = ScratchPool::<TraceScratch>::default();
        chunks.for_each(|(i, blocked)| {
            let rows = i * CHUNK..i * CHUNK + blocked.len();
            let cache = &mut ShadowCache::new(Caching::default());
            let end = &mut RayBatch::default();
            let (kernels, rays) = (&self.kernels, rays.rows(rows, end));
            pool.with(|scratch| any(&self.world, kernels, &rays, cache, blocked, scratch));
        });
        blocked.truncate(rays.len());
        blocked
    }

    /// Evaluates the surfaces at the closest hits of rays. Returns an error if there are not as many
    /// hits as rays, or if one is on nothing that the scene has.
    pub fn surfaces(&self, rays: &RayBatch, hits: &Hits) -> Result<Surfaces, Error> {
        let world = (&self.world, self.kernels.precision);
        Ok(Surfaces::of(world, rays, hits)?)
    }

    /// Names an instance by its path, as `row.3/pawn.0`: names and numbers of what the file or the
    /// program has placed, where it names them. `None` if the scene has no instance of this number.
    pub fn instance_name(&self, instance: u64) -> Option<String> {
        let World {
            scene, instances, ..
        } = &self.world;
        (instance < instances.count()).then(|| instance_name(scene, instances, instance))
    }

    /// Returns a material's name, or its number as `material.7` if it has none. `None` if the
    /// scene has no material of this number.
    pub fn material_name(&self, material: MaterialId) -> Option<String> {
        let materials = &self.world.scene.materials;
        (material.index() < materials.len()).then(|| material_name(&self.world.scene, material))
    }

    /// Prepares the scene's solids for [spans](Solids::spans) of any number of lines. Returns an
    /// error if there are too many instances to look at each.
    pub fn solids(&self) -> Result<Solids, Error> {
        Ok(Solids {
            prepared: trace::Solids::prepare(&self.world.scene, &self.world.instances)?,
        })
    }

    /// Renders a picture, and calls `on_tile` with each tile once it is finished, from any
    /// thread and in any order. Cameras and lights that the scene lacks are default ones.
    /// With a shutter in `config` what moves is blurred, and tiles are finished late. Returns an
    /// error if a value of `config` is out of its range, if there is no camera of the configured
    /// name, too little memory, or if `progress` is cancelled. Only what `config` says of pictures
    /// counts; precision and structure are the tracer's.
    pub fn render(
        &self,
        config: &RenderConfig,
        progress: &Progress,
        on_tile: &(dyn Fn(FinishedTile) + Sync),
    ) -> Result<Picture, Error> {
        config.check()?;
        if let Some(exposure) = &config.shutter {
            return self.render_blurred(exposure, config, progress, on_tile);
        }
        let (camera, _, lights) = self.seen(&self.world, config)?;
        let view = View {
            world: &self.world,
            kernels: self.kernels,
            camera,
            lights: &lights,
        };
        Ok(render_with(&view, config, progress, on_tile)?)
    }

    /// Renders a picture with an open shutter.
    fn render_blurred(
        &self,
        exposure: &Exposure,
        config: &RenderConfig,
        progress: &Progress,
        on_tile: &(dyn Fn(FinishedTile) + Sync),
    ) -> Result<Picture, Error> {
        let scene = self.scene().clone().at(exposure.middle())?;
        let world = self.world.at_time(&scene, &Instances::of(&scene)?);
        let (camera, row, lights) = self.seen(&world, config)?;
        let view = View {
            world: &world,
            kernels: self.kernels,
            camera,
            lights: &lights,
        };
        let slices = Slices::build(&world, (&camera, row), exposure)?;
        Ok(render_blurred(&view, &slices, config, progress, on_tile)?.picture)
    }

    /// Returns a picture's camera, its row of the scene's table unless it is made, and the
    /// lights.
    fn seen<'w>(&self, world: &'w World, config: &RenderConfig) -> Result<Seen<'w>, Error> {
        let scene = &world.scene;
        let row = scene.cameras.pick(config.camera.as_deref())?;
        let camera = match row {
            Some(row) => scene.cameras.rows[row],
            None => default_camera(scene, &world.instances, config.aspect()),
        };
        let lights = match &*scene.lights {
            [] if config.integrator == Integrator::Direct => default_lights(&camera).into(),
            lights => lights.into(),
        };
        Ok((camera, row, lights))
    }
}

/// A picture's camera, its row of the scene's table unless it is made, and the lights.
type Seen<'w> = (Camera, Option<usize>, Cow<'w, [Light]>);

/// Returns the structure that the plan chose; `kd` holds the parameters of a k-d tree.
pub fn structure(plan: &Plan, kd: &KdQuality) -> Structure {
    match plan.accel {
        Accel::Bvh => Structure::Bvh,
        Accel::Kd => Structure::Kd(*kd),
        Accel::Grid => Structure::Grid(Density::default()),
        Accel::Heap => Structure::Heap,
        Accel::HeapSpheres => Structure::HeapSpheres,
        Accel::Linear => Structure::Linear,
        Accel::ItemBuffer => Structure::ItemBuffer,
    }
}
