//! The measurement of one scene: structures, modes, ray sets and a baseline.

use crate::args::BenchArgs;
use crate::error::CliError;
use crate::interrupt;
use crate::pipeline::{Prepared, isa, structure};
use crate::progress::{Drawing, Style};
use crate::triangles::triangles;
use lanecast_engine::accel::{Accelerator, BuildQuality, World};
use lanecast_engine::trace::{Caching, HitId};
use lanecast_measure::Stats;
use lanecast_measure::baseline::{BaselineTests, Embree};
use lanecast_measure::bench::{self, Baseline, BenchError, Contender, Row, Setting, Tracer};
use lanecast_measure::clock::Clock;
use lanecast_measure::index_stats::StructureRow;
use lanecast_measure::queries::Job;
use lanecast_measure::ray_kinds::{Kind, Order};
use lanecast_measure::rays::{Source, direction_of, light_of, ray_sets};
use lanecast_model::plan::{Accel, Choices, Kernels, LaneCount, Plan, PlanError, Precision, plan};
use lanecast_model::scene::Shape;
use lanecast_picture::render::{Progress, RenderConfig};
use std::sync::Arc;

/// Maximum number of ray-primitive tests that a linear scan may make in total.
const MAX_TESTS: f64 = 2e11;
/// Maximum number of rays per set that a linear scan repeats at one lane.
const CHECKED_LINEAR: usize = 1 << 14;

pub struct Work<'a> {
    prepared: &'a Prepared,
    structures: Vec<Structure>,
    /// Precisions that lack the requested width, and why.
    pub left_out: Vec<String>,
    baseline: Option<(Embree, Vec<HitId>)>,
    orders: Vec<Order>,
    reps: u32,
    builds: u32,
    cachings: Vec<Caching>,
    pub clock: Clock,
    style: Style,
}

/// One of our structures, and the modes that trace through it.
struct Structure {
    accel: Accel,
    build: BuildQuality,
    plan: Plan,
    modes: Vec<(Precision, Kernels)>,
    world: Option<World>,
    seconds: Vec<f64>,
}

impl Structure {
    /// Returns a name such as `bvh` for medium quality, or `bvh-high`.
    fn name(&self) -> String {
        let accel = self.accel.name();
        match self.build {
            BuildQuality::Medium => accel.into(),
            build => format!("{accel}-{}", build.name()),
        }
    }
}

impl<'a> Work<'a> {
    /// Plans every requested structure, in every precision, at the machine's width and
    /// at one lane; arguments narrow the choice.
    pub fn plan(args: &BenchArgs, prepared: &'a Prepared) -> Result<Work<'a>, CliError> {
        let accels = match &args.accels {
            Some(accels) => accels.0.clone(),
            None => vec![args.common.accel],
        };
        let precisions = match args.common.precision {
            Some(asked) => vec![asked],
            None => vec![Precision::Fast, Precision::Guarded, Precision::Exact],
        };
        let widths = match &args.common.lanes {
            Some(asked) => asked.0.clone(),
            None => vec![LaneCount::Auto, LaneCount::One],
        };
        let mut structures: Vec<Structure> = Vec::new();
        let mut refused: Vec<(Precision, PlanError)> = Vec::new();
        for accel in accels {
            let mut modes = Vec::new();
            let mut first = None;
            for precision in &precisions {
                for lanes in &widths {
                    let choices = Choices {
                        precision: *precision,
                        lanes: *lanes,
                        accel: accel.0,
                    };
                    match plan(&prepared.scene, &prepared.instances, &choices) {
                        Ok(plan) => {
                            modes.push((*precision, plan.kernels));
                            first.get_or_insert(plan);
                        }
                        // A width may exist for one precision and not for another.
                        Err(error) => refused.push((*precision, error)),
                    }
                }
            }
            let Some(plan) = first else {
                continue;
            };
            // Two names may mean one structure.
            if structures.iter().any(|other| other.accel == plan.accel) {
                continue;
            }
            let builds = match plan.accel {
                Accel::Bvh | Accel::ItemBuffer => &args.build.0[..],
                _ => &[BuildQuality::Medium],
            };
            structures.extend(builds.iter().map(|build| Structure {
                accel: plan.accel,
                build: *build,
                plan: plan.clone(),
                modes: modes.clone(),
                world: None,
                seconds: Vec::new(),
            }));
        }
        if let (true, Some((_, error))) = (structures.is_empty(), refused.first()) {
            return Err(CliError::Usage(error.to_string()));
        }
        let left_out = refused.iter().map(|(precision, error)| {
            let name = precision.name();
            format!("{name} is left out: {error}")
        });
        let mut left_out: Vec<String> = left_out.collect();
        left_out.sort();
        left_out.dedup();
        let baseline = match &args.peers {
            Some(_) => Some(baseline(prepared, &precisions)?),
            None => None,
        };
        Ok(Work {
            prepared,
            structures,
            left_out,
            baseline,
            orders: args.order.0.clone(),
            reps: args.reps,
            builds: args.builds,
            cachings: args.shadow_cache.0.clone(),
            clock: Clock::for_threads(prepared.pool.current_num_threads()),
            style: args.common.progress.style,
        })
    }

    /// Rejects a linear scan that would not finish in reasonable time. `rays` is the
    /// number of rays of all sets.
    pub fn check_effort(&self, rays: u64) -> Result<(), CliError> {
        let linear = |s: &&Structure| s.accel == Accel::Linear;
        let Some(linear) = self.structures.iter().find(linear) else {
            return Ok(());
        };
        // One run to compare, one to count.
        let runs = linear.modes.len() as u64 * u64::from(self.reps + 2);
        let rays = rays.saturating_mul(runs);
        let scene = &self.prepared.scene;
        let of_shape = |shape: &Shape| match shape {
            Shape::Mesh(id) => scene.meshes.row(*id).triangles.len() as f64,
            _ => 1.0,
        };
        let shapes = scene.shapes.rows.iter();
        let counts = self.prepared.instances.of_shapes(scene);
        let each = shapes.zip(counts).map(|(s, n)| of_shape(s) * n as f64);
        let primitives: f64 = each.sum();
        let tests = primitives * rays as f64;
        if tests > MAX_TESTS {
            return Err(CliError::Usage(format!(
                "--accel linear would test {rays} rays against {primitives} primitives, \
                 {tests:.1e} tests in total, and at most {MAX_TESTS:.0e} are allowed; \
                 choose a smaller --size, fewer --reps or --kinds, or --accel bvh"
            )));
        }
        Ok(())
    }

    /// Builds every structure the requested number of times, in turns.
    pub fn build(&mut self, progress: &Progress) -> Result<(), CliError> {
        for _ in 0..self.builds {
            self.build_own(progress)?;
            self.build_baseline(progress)?;
        }
        Ok(())
    }

    pub fn build_own(&mut self, progress: &Progress) -> Result<(), CliError> {
        let Prepared {
            scene,
            instances,
            kd,
            pool,
            ..
        } = self.prepared;
        for own in &mut self.structures {
            // The old world is dropped first: two at once would count twice in the peak
            // memory.
            own.world = None;
            let kind = structure(&own.plan, kd);
            let build = || World::build_to(own.build, scene, instances, kind);
            let (world, seconds) = pool.install(|| self.clock.time(build));
            own.world = Some(world);
            own.seconds.push(seconds);
            interrupt::check(progress)?;
        }
        Ok(())
    }

    pub fn build_baseline(&mut self, progress: &Progress) -> Result<(), CliError> {
        if let Some((embree, _)) = &mut self.baseline {
            let built = self.prepared.pool.install(|| embree.build(self.clock));
            built.map_err(|error| CliError::Usage(error.to_string()))?;
            interrupt::check(progress)?;
        }
        Ok(())
    }

    /// Adds the bytes of the first structure.
    pub fn memory(&self, stats: &mut Stats) {
        if let Some((_, world)) = self.worlds().next() {
            for (name, bytes) in world.bytes() {
                stats.memory.insert(name.into(), bytes as u64);
            }
        }
    }

    pub fn index_stats(&self) -> Vec<StructureRow> {
        let triangles = self.prepared.scene.meshes.triangles.len() as u64;
        let own = self.structures.iter().filter_map(|own| {
            let world = own.world.as_ref()?;
            let name = own.name();
            Some(StructureRow::of_world(
                world,
                &name,
                triangles,
                &own.seconds,
            ))
        });
        let baselines = self
            .baseline
            .iter()
            .flat_map(|(embree, _)| embree.index_stats());
        own.chain(baselines).collect()
    }

    /// Generates the scene's ray sets, in every order.
    pub fn jobs(
        &self,
        config: &RenderConfig,
        kinds: &[Kind],
        progress: &Progress,
    ) -> Result<Vec<Job>, CliError> {
        let prepared = self.prepared;
        let choices = Choices {
            precision: Precision::Exact,
            ..config.choices
        };
        let plan = plan(&prepared.scene, &prepared.instances, &choices)
            .map_err(|e| CliError::Usage(e.to_string()))?;
        let Some((_, world)) = self.oracle_world() else {
            return Ok(Vec::new());
        };
        let light = light_of(world, &prepared.camera);
        let mut jobs = Vec::new();
        for order in &self.orders {
            let source = Source {
                world,
                kernels: plan.kernels,
                camera: prepared.camera,
                grid: config.grid,
                size: [config.width, config.height],
                order: *order,
                light,
                direction: direction_of(world, light),
            };
            let sets = prepared.pool.install(|| ray_sets(&source, kinds, progress));
            let sets = sets.ok_or(CliError::Interrupted)?;
            let name = |kind: &Kind| match &self.orders[..] {
                [_] => kind.name().into(),
                _ => format!("{}-{}", kind.name(), order.name()),
            };
            jobs.extend(kinds.iter().zip(sets).map(|(kind, rays)| Job {
                kind: name(kind),
                ask: kind.ask(),
                rays,
            }));
        }
        Ok(jobs)
    }

    pub fn bench(&self, jobs: &[Job], progress: &Arc<Progress>) -> Result<Vec<Row>, CliError> {
        let _drawing = Drawing::start(progress, self.style);
        let own: Vec<Contender> = self
            .worlds()
            .flat_map(|(own, world)| modes(own, world, &self.cachings))
            .collect();
        let Some(oracle) = self.oracle() else {
            return Ok(Vec::new());
        };
        let linear = |(own, _): (&Structure, _)| own.accel == Accel::Linear;
        let setting = Setting {
            reps: self.reps,
            checked: if self.oracle_world().is_some_and(linear) {
                CHECKED_LINEAR
            } else {
                usize::MAX
            },
        };
        let baseline = self
            .baseline
            .as_ref()
            .map(|(tracer, ids)| Baseline { tracer, ids });
        let pool = &self.prepared.pool;
        bench::bench(&oracle, &own, baseline, pool, jobs, &setting, progress).map_err(|error| {
            match error {
                BenchError::Interrupted => CliError::Interrupted,
                other => CliError::Short(other.to_string()),
            }
        })
    }

    pub fn threads(&self) -> usize {
        self.prepared.pool.current_num_threads()
    }

    fn worlds(&self) -> impl Iterator<Item = (&Structure, &World)> {
        let built = self.structures.iter();
        built.filter_map(|own| own.world.as_ref().map(|world| (own, world)))
    }

    /// Returns the structure of the oracle: any but the slow linear scan, if there is
    /// one.
    fn oracle_world(&self) -> Option<(&Structure, &World)> {
        let fast = |(own, _): &(&Structure, _)| own.accel != Accel::Linear;
        self.worlds().find(fast).or_else(|| self.worlds().next())
    }

    /// Returns the oracle: exact tracing at one lane.
    fn oracle(&self) -> Option<Contender<'_>> {
        let (own, world) = self.oracle_world()?;
        let kernels = Kernels {
            precision: Precision::Exact,
            lanes: 1,
        };
        Some(contender(
            own,
            world,
            Precision::Exact,
            kernels,
            Caching::Off,
        ))
    }
}

fn modes<'w>(own: &'w Structure, world: &'w World, cachings: &[Caching]) -> Vec<Contender<'w>> {
    let each = |(precision, kernels): &(Precision, Kernels)| {
        let (precision, kernels) = (*precision, *kernels);
        let cachings = cachings.iter();
        let with = move |caching: &Caching| contender(own, world, precision, kernels, *caching);
        cachings.map(with).collect::<Vec<_>>()
    };
    own.modes.iter().flat_map(each).collect()
}

fn contender<'w>(
    own: &Structure,
    world: &'w World,
    precision: Precision,
    kernels: Kernels,
    caching: Caching,
) -> Contender<'w> {
    let kernel = match kernels.lanes {
        _ if matches!(world.accelerator, Accelerator::Nested(_)) => "stream",
        1 => "single",
        _ if world.item_boxes.is_some() => "raster",
        _ if world.wide().is_some() => "tile",
        _ => "packet",
    };
    Contender {
        accel: own.name(),
        kernel: kernel.into(),
        lanes: kernels.lanes,
        precision: precision.name(),
        exact: precision == Precision::Exact,
        isa: isa(),
        tracer: Tracer::Own {
            world,
            kernels,
            caching,
        },
    }
}

/// Prepares Embree over the scene's triangles, not yet built, with the tests that
/// compare fairly with these precisions.
fn baseline(
    prepared: &Prepared,
    precisions: &[Precision],
) -> Result<(Embree, Vec<HitId>), CliError> {
    let Prepared {
        scene, instances, ..
    } = prepared;
    let (set, dropped) = triangles(scene, instances, "--export").map_err(CliError::Usage)?;
    if dropped.is_some() {
        return Err(CliError::Usage(
            "--peers embree traces triangles only, and this scene has other shapes; \
             leave it out, or choose a scene of meshes"
                .into(),
        ));
    }
    let mut ids = Vec::with_capacity(set.triangles.len());
    for (instance, row) in (0_u64..).zip(instances.iter(scene)) {
        if let Shape::Mesh(id) = scene.shapes.row(row.shape) {
            let count = scene.meshes.row(id).triangles.len();
            ids.extend((0..count).map(|primitive| HitId {
                instance,
                primitive: primitive as u32,
            }));
        }
    }
    let tests = BaselineTests::ALL.into_iter();
    let wanted = |tests: &BaselineTests| {
        precisions
            .iter()
            .any(|p| BaselineTests::beside(*p) == *tests)
    };
    let tests: Vec<BaselineTests> = tests.filter(wanted).collect();
    let embree = Embree::new(&set, &tests, prepared.pool.current_num_threads());
    let embree = embree.map_err(|error| CliError::Usage(error.to_string()))?;
    Ok((embree, ids))
}
