//! `lanecast bench`: rays per second by ray kind, structure and mode.
//!
//! Scene or mesh → worlds → ray sets → measure → report. Ray sets and triangles can be
//! exported for other programs and read back. `--growth` does the same over generated
//! meshes of increasing size (`growth.rs`); `--frames` measures what one frame of a
//! moving scene gains from the one before (`frames.rs`).

mod frames;
mod growth;
mod report;
mod work;

use super::args::{BenchArgs, RENDER_SIZE};
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, complain};
use super::pipeline::{complete, isa, prepare};
use super::triangles::triangles;
use lanecast_io::{LoadError, RaySet, TriangleSet};
use lanecast_measure::bench::comparisons;
use lanecast_measure::plot::{Heading, bench_page};
use lanecast_measure::queries::{Ask, Job};
use lanecast_measure::ray_kinds::Kind;
use lanecast_measure::{Stats, Watch};
use lanecast_model::plan::LaneCount;
use lanecast_model::scene::{Edge, MeshData, Scene, SceneBuilder};
use lanecast_picture::render::RenderConfig;
use report::{Origin, Report};
use std::path::{Path, PathBuf};
use work::Work;

/// Maximum number of rays per set, which takes 1 GB.
const MAX_RAYS: u64 = 1 << 25;

pub fn run(args: &BenchArgs) -> Result<(), CliError> {
    if args.growth.is_some() {
        return growth::run(args);
    }
    if let Some(frames) = args.frames {
        return frames::run(args, frames);
    }
    let mut config = args.config(RENDER_SIZE)?;
    config.solver = args.solver.checked(args.common.precision)?;
    check_config(&mut config)?;
    let inputs: Vec<&Path> = [&args.scene, &args.mesh]
        .into_iter()
        .filter_map(|path| path.as_deref())
        .chain(args.rays.iter().map(PathBuf::as_path))
        .collect();
    let kinds: &[Kind] = args.kinds.as_ref().map_or(&Kind::ALL, |kinds| &kinds.0);
    let exports = exports(args, kinds);
    let mut files = exports.clone();
    files.extend(args.plot.clone());
    let outputs = check_destinations(&inputs, &files, args.common.sinks())?;

    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = Stats::default();
    // The first mode that exists; the others are planned below.
    config.choices.lanes = LaneCount::Auto;
    let (prepared, given) = match (&args.scene, &args.mesh) {
        (Some(scene), _) => {
            let options = args.common.load_options(outputs);
            let prepared = prepare(
                Some(scene),
                &options,
                (&config, &args.common.view),
                &mut watch,
                &mut stats,
            )?;
            (prepared, None)
        }
        (None, Some(mesh)) => {
            let scene = scene_of(SceneBuilder::default(), TriangleSet::load(mesh)?, mesh)?;
            let jobs: Result<Vec<Job>, LoadError> = args.rays.iter().map(|p| given(p)).collect();
            let prepared = complete(scene, mesh, &config, &mut watch, &mut stats)?;
            (prepared, Some(jobs?))
        }
        // The argument parser's rules exclude every other case.
        _ => return Err(CliError::Usage("name a SCENE, or --mesh and --rays".into())),
    };
    let mut work = Work::plan(args, &prepared)?;
    warn_left_out(&work);
    let (rays, sets) = match &given {
        Some(jobs) => (jobs.iter().map(|job| job.rays.len() as u64).sum(), 1),
        None => {
            let sets = kinds.len() * args.order.0.len();
            (rays_of(&config), sets as u64)
        }
    };
    work.check_effort(rays * sets)?;
    interrupt::check(&progress)?;
    work.build(&progress)?;
    work.memory(&mut stats);
    stats.stages.push(watch.stage("build"));
    let jobs = match given {
        Some(jobs) => jobs,
        None => work.jobs(&config, kinds, &progress)?,
    };
    stats.stages.push(watch.stage("rays"));

    let mut results = Results::default();
    if !exports.is_empty() {
        let (set, dropped) =
            triangles(&prepared.scene, &prepared.instances, "--export").map_err(CliError::Usage)?;
        if let Some(dropped) = dropped {
            complain(&format!("warning: {}: {dropped}", exports[0].display()));
        }
        set.save_into(&exports[0], &mut results.outputs)?;
        for (path, job) in exports[1..].iter().zip(&jobs) {
            job.rays.save_into(path, &mut results.outputs)?;
        }
        stats.stages.push(watch.stage("export"));
    }
    for job in jobs.iter().filter(|job| job.rays.is_empty()) {
        complain(&format!(
            "warning: {}: no rays; the camera sees no surface to start them from",
            job.kind
        ));
    }
    interrupt::check(&progress)?;

    let rows = work.bench(&jobs, &progress)?;
    stats.stages.push(watch.stage("bench"));
    stats.finish();
    let structures = work.index_stats();
    let scene = args.scene.as_ref().or(args.mesh.as_ref());
    let report = Report {
        origin: Origin::now(
            scene.map(|path| path.display().to_string()),
            [config.width, config.height],
        ),
        build_seconds: structures[0].build_seconds,
        tree_bytes: structures[0].tree_bytes,
        triangles: stats.scene.triangles,
        instances: stats.scene.instances,
        clock: work.clock.name(),
        reps: args.reps,
        order: args.order.0.iter().map(|order| order.name()).collect(),
        comparisons: comparisons(&rows),
        structures,
        results: rows,
    };
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    if let Some(path) = &args.plot {
        let heading = Heading {
            title: format!("lanecast bench: {}", name_of(args)),
            facts: facts(&report, &config, work.threads()),
        };
        let Report {
            results: rows,
            structures,
            comparisons,
            ..
        } = &report;
        let page = bench_page(&heading, rows, structures, comparisons);
        results.outputs.add(path, page.into_bytes())?;
    }
    interrupt::check(&progress)?;
    results.commit(&report.table())
}

fn warn_left_out(work: &Work) {
    for what in &work.left_out {
        complain(&format!("warning: {what}"));
    }
}

/// Rejects common options that `bench` cannot honour, and sets the number of threads.
fn check_config(config: &mut RenderConfig) -> Result<(), CliError> {
    // Figures of one thread compare best.
    config.threads = config.threads.or(Some(1));
    if rays_of(config) > MAX_RAYS {
        return Err(CliError::Usage(format!(
            "{}x{} are too many rays to keep at once; at most {MAX_RAYS} are supported",
            config.width, config.height
        )));
    }
    Ok(())
}

fn rays_of(config: &RenderConfig) -> u64 {
    u64::from(config.width) * u64::from(config.height)
}

/// Returns the input's file name, for the page's title.
fn name_of(args: &BenchArgs) -> String {
    let path = args.scene.as_ref().or(args.mesh.as_ref());
    let name = path.and_then(|path| path.file_name()).unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Returns the facts listed below a page's title.
fn facts(report: &Report, config: &RenderConfig, threads: usize) -> Vec<(&'static str, String)> {
    let mut facts = vec![("triangles", report.triangles.to_string())];
    // Rays from files have neither a camera nor an order.
    let generated = report
        .results
        .iter()
        .any(|row| row.kind.starts_with("primary"));
    if generated {
        facts.push(("camera rays", format!("{}×{}", config.width, config.height)));
        facts.push(("order", report.order.join(", ")));
    }
    facts.push(("threads", threads.to_string()));
    facts.push(("instructions", isa().into()));
    facts.push(("clock", report.clock.into()));
    facts.push(("runs", format!("{}, medians", report.reps)));
    facts
}

/// Returns the paths of the `.msh` and of one `.rays` per kind; none without
/// `--export`.
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

/// Loads rays from a file; the query follows from the file's name.
fn given(path: &Path) -> Result<Job, LoadError> {
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

/// Adds a mesh to a scene and finishes it.
fn scene_of(mut scene: SceneBuilder, set: TriangleSet, path: &Path) -> Result<Scene, LoadError> {
    let data = MeshData {
        positions: set.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: set.triangles,
        ..MeshData::default()
    };
    let mesh = scene.mesh("", &data);
    scene.instance("", Edge::shape(mesh));
    scene
        .finish()
        .map_err(|source| LoadError::of_scene(path, source))
}
