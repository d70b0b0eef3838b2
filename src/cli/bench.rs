//! `lanecast bench`: rays per second by ray kind and mode.
//!
//! Scene or mesh → world → ray sets → measure → report. Sets and triangles can
//! be exported for other programs and read back.

use super::args::{BenchArgs, RENDER_SIZE};
use super::error::CliError;
use super::output::{Results, check_destinations, complain};
use super::pipeline::{Prepared, complete, isa, prepare};
use super::{export, interrupt};
use crate::accel::World;
use crate::io::{LoadError, RaySet, TriangleSet};
use crate::measure::bench::{BenchError, Clock, Mode, Row, Setting, bench};
use crate::measure::queries::{Ask, Job};
use crate::measure::rays::{Kind, Source, light_of, ray_sets};
use crate::measure::{Stats, Watch};
use crate::plan::{Accel, Choices, LaneCount, PlanError, Precision, plan};
use crate::render::{Progress, RayGenerator, RenderConfig};
use crate::scene::{Edge, MeshData, Scene, SceneBuilder, Shape};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `--json` writes.
#[derive(Serialize)]
struct Report {
    build_seconds: f64,
    /// Of all trees and their leaves.
    tree_bytes: usize,
    triangles: u64,
    appearances: u64,
    /// `thread cpu` or `wall`.
    clock: &'static str,
    reps: u32,
    results: Vec<Row>,
}

/// A set of so many rays takes 1 GB.
const MAX_RAYS: u64 = 1 << 25;
/// Tests of a ray against a primitive that a linear scan may make in all.
const MAX_TESTS: f64 = 2e11;

pub fn run(args: &BenchArgs) -> Result<(), CliError> {
    let mut config = args.common.config(RENDER_SIZE)?;
    // Figures of one thread compare best.
    config.threads = config.threads.or(Some(1));
    if config.spp != 1 {
        return Err(CliError::Usage(format!(
            "bench traces one camera ray per pixel; leave out --spp {}",
            config.spp
        )));
    }
    if rays_of(&config) > MAX_RAYS {
        return Err(CliError::Usage(format!(
            "{}x{} are too many rays to keep at once; at most {MAX_RAYS} are supported",
            config.width, config.height
        )));
    }
    let inputs: Vec<&Path> = [&args.scene, &args.mesh, &args.rays]
        .into_iter()
        .filter_map(|path| path.as_deref())
        .collect();
    let kinds: &[Kind] = args.kinds.as_ref().map_or(&Kind::ALL, |kinds| &kinds.0);
    let exports = exports(args, kinds);
    check_destinations(&inputs, &exports, args.common.sinks())?;

    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = Stats::default();
    let (prepared, given) = match (&args.scene, &args.mesh, &args.rays) {
        (Some(scene), ..) => {
            let options = args.common.load_options();
            // The first mode that exists; the others are planned below.
            config.choices.lanes = LaneCount::Auto;
            let prepared = prepare(Some(scene), &options, &config, &mut watch, &mut stats)?;
            (prepared, None)
        }
        (None, Some(mesh), Some(rays)) => {
            let scene = scene_of(TriangleSet::load(mesh)?, mesh)?;
            let job = given_job(rays)?;
            config.choices.lanes = LaneCount::Auto;
            let prepared = complete(scene, mesh, &config, &mut watch, &mut stats)?;
            (prepared, Some(job))
        }
        // The arguments' own rules leave nothing else.
        _ => return Err(CliError::Usage("name a SCENE, or --mesh and --rays".into())),
    };
    let modes = modes(args, &prepared)?;
    let (rays, sets) = match &given {
        Some(job) => (job.rays.len() as u64, 1),
        None => (rays_of(&config), kinds.len() as u64),
    };
    let runs = sets * modes.len() as u64 * u64::from(args.reps + 1);
    check_effort(&prepared, rays.saturating_mul(runs))?;
    interrupt::check(&progress)?;
    let world = prepared.world(&mut watch, &mut stats);
    interrupt::check(&progress)?;
    let jobs = match given {
        Some(job) => vec![job],
        None => jobs(&prepared, &world, &config, kinds, &progress)?,
    };
    stats.stages.push(watch.stage("rays"));

    let mut results = Results::default();
    if !exports.is_empty() {
        let (triangles, dropped) =
            export::triangles(&prepared.scene, &prepared.appearances).map_err(CliError::Usage)?;
        if let Some(dropped) = dropped {
            complain(&format!("warning: {}: {dropped}", exports[0].display()));
        }
        triangles.save_into(&exports[0], &mut results.outputs)?;
        for (path, job) in exports[1..].iter().zip(&jobs) {
            job.rays.save_into(path, &mut results.outputs)?;
        }
        stats.stages.push(watch.stage("export"));
    }
    for job in jobs.iter().filter(|job| job.rays.is_empty()) {
        complain(&format!(
            "warning: {}: no rays; the camera sees nothing for them to leave from",
            job.kind
        ));
    }
    interrupt::check(&progress)?;

    let setting = Setting {
        accel: prepared.plan.accel.name(),
        isa: isa(),
        reps: args.reps,
    };
    let rows = bench(&world, &prepared.pool, &jobs, &modes, &setting, &progress);
    let rows = rows.map_err(|error| match error {
        BenchError::Interrupted => CliError::Interrupted,
        other => CliError::Short(other.to_string()),
    })?;
    stats.stages.push(watch.stage("bench"));
    stats.finish();
    let report = Report {
        build_seconds: stats.seconds("build"),
        tree_bytes: tree_bytes(&world),
        triangles: stats.scene.triangles,
        appearances: stats.scene.appearances,
        clock: Clock::of(prepared.pool.current_num_threads()).name(),
        reps: args.reps,
        results: rows,
    };
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    interrupt::check(&progress)?;
    results.commit(&table(&report))
}

fn rays_of(config: &RenderConfig) -> u64 {
    u64::from(config.width) * u64::from(config.height)
}

/// The `.msh` first, then a `.rays` of each kind; none without `--export`.
fn exports(args: &BenchArgs, kinds: &[Kind]) -> Vec<PathBuf> {
    let (Some(folder), Some(scene)) = (&args.export, &args.scene) else {
        return Vec::new();
    };
    let file = |end: String| {
        let mut name = scene.file_stem().unwrap_or("scene".as_ref()).to_os_string();
        name.push(end);
        folder.join(name)
    };
    let sets = kinds
        .iter()
        .map(|kind| file(format!(".{}.rays", kind.name())));
    std::iter::once(file(".msh".into())).chain(sets).collect()
}

/// Rays from a file; the question follows from its name.
fn given_job(path: &Path) -> Result<Job, LoadError> {
    let rays = RaySet::load(path)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = stem.rsplit('.').next().unwrap_or_default();
    let kind = Kind::named(name);
    Ok(Job {
        kind: kind.map_or("rays", Kind::name).into(),
        ask: kind.map_or(Ask::Closest, Kind::ask),
        rays,
    })
}

/// A scene of one mesh.
fn scene_of(set: TriangleSet, path: &Path) -> Result<Scene, LoadError> {
    let mut scene = SceneBuilder::default();
    let data = MeshData {
        positions: set.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: set.triangles,
        ..MeshData::default()
    };
    let mesh = scene.mesh("", &data);
    scene.instance("", Edge::shape(mesh));
    scene.finish().map_err(|source| LoadError::Scene {
        path: path.into(),
        source,
    })
}

/// Every precision at the machine's width and at one lane; what is asked for
/// narrows it.
fn modes(args: &BenchArgs, prepared: &Prepared) -> Result<Vec<Mode>, CliError> {
    let precisions = match args.common.precision {
        Some(asked) => vec![asked],
        None => vec![Precision::Fast, Precision::Exact],
    };
    let widths = match args.common.lanes {
        Some(asked) => vec![asked],
        None => vec![LaneCount::Auto, LaneCount::One],
    };
    let mut modes = Vec::new();
    let mut refused: Option<PlanError> = None;
    for precision in precisions {
        for lanes in &widths {
            let choices = Choices {
                precision,
                lanes: *lanes,
                accel: args.common.accel,
            };
            match plan(&prepared.scene, &prepared.appearances, &choices) {
                Ok(plan) => modes.push(Mode {
                    precision,
                    kernels: plan.kernels,
                }),
                // A width may be there for one precision and not for the other.
                Err(error) => refused = Some(error),
            }
        }
    }
    match refused {
        Some(error) if modes.is_empty() => Err(CliError::Usage(error.to_string())),
        _ => Ok(modes),
    }
}

/// A linear scan of a large scene would not end.
fn check_effort(prepared: &Prepared, rays: u64) -> Result<(), CliError> {
    if prepared.plan.accel != Accel::Linear {
        return Ok(());
    }
    let scene = &prepared.scene;
    let of_shape = |shape: &Shape| match shape {
        Shape::Mesh(id) => scene.meshes.row(*id).triangles.len() as f64,
        _ => 1.0,
    };
    let shapes = scene.shapes.rows.iter();
    let counts = prepared.appearances.of_shapes(scene);
    let each = shapes.zip(counts).map(|(s, n)| of_shape(s) * n as f64);
    let primitives: f64 = each.sum();
    let tests = primitives * rays as f64;
    if tests > MAX_TESTS {
        return Err(CliError::Usage(format!(
            "--accel linear would test {rays} rays against {primitives} primitives, {tests:.1e} \
             times in all, and at most {MAX_TESTS:.0e} are allowed; \
             take a smaller --size, fewer --reps or --kinds, or --accel bvh"
        )));
    }
    Ok(())
}

fn jobs(
    prepared: &Prepared,
    world: &World,
    config: &RenderConfig,
    kinds: &[Kind],
    progress: &Progress,
) -> Result<Vec<Job>, CliError> {
    let choices = Choices {
        precision: Precision::Exact,
        ..config.choices
    };
    let plan = plan(&prepared.scene, &prepared.appearances, &choices)
        .map_err(|e| CliError::Usage(e.to_string()))?;
    let (width, height) = (config.width, config.height);
    let source = Source {
        world,
        kernels: plan.kernels,
        generator: RayGenerator::new(prepared.camera, width, height, config.grid),
        size: [width, height],
        light: light_of(world, &prepared.camera),
    };
    let sets = prepared.pool.install(|| ray_sets(&source, kinds, progress));
    let sets = sets.ok_or(CliError::Interrupted)?;
    let job = |(kind, rays): (&Kind, RaySet)| Job {
        kind: kind.name().into(),
        ask: kind.ask(),
        rays,
    };
    Ok(kinds.iter().zip(sets).map(job).collect())
}

fn tree_bytes(world: &World) -> usize {
    let bytes = world.bytes();
    let trees = bytes.iter().filter(|(name, _)| *name != "appearances");
    trees.map(|(_, bytes)| bytes).sum()
}

/// For people.
fn table(report: &Report) -> String {
    let mut text = format!(
        "{} appearances, {} triangles; built in {:.3} s, {:.1} MB; {} time, {} runs each\n\
         {:<12} {:<9} {:>5} {:<6} {:>7} {:>9} {:>9}  {:>8} {:>8} {:>8} {:>8}\n",
        report.appearances,
        report.triangles,
        report.build_seconds,
        report.tree_bytes as f64 * 1e-6,
        report.clock,
        report.reps,
        "kind",
        "precision",
        "lanes",
        "accel",
        "threads",
        "rays",
        "hits",
        "Mrays/s",
        "best",
        "convert",
        "differ",
    );
    for row in &report.results {
        let Row {
            kind,
            precision,
            lanes,
            accel,
            threads,
            rays,
            hits,
            ..
        } = row;
        text += &format!(
            "{kind:<12} {precision:<9} {lanes:>5} {accel:<6} {threads:>7} {rays:>9} {hits:>9}  \
             {:>8.3} {:>8.3} {:>7.1}% {:>8}\n",
            row.mrays_per_s,
            row.mrays_per_s_best,
            row.conversion_share * 100.0,
            row.differ,
        );
    }
    if let Some(checked) = report.results.iter().map(|row| row.checked).max() {
        text += &format!(
            "differ: of {checked} rays of each set, those that f64 at one lane answers otherwise\n"
        );
    }
    text
}
