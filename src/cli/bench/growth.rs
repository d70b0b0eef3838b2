//! `lanecast bench --growth MIN:MAX`: the same figures over generated meshes of
//! increasing size.

use super::report::growth_table;
use super::work::Work;
use super::{check_config, scene_of, warn_left_out};
use crate::args::{BenchArgs, Size};
use crate::error::CliError;
use crate::interrupt;
use crate::output::{Results, check_destinations};
use crate::pipeline::{complete, isa};
use glam::DVec3;
use lanecast_measure::bench::comparisons;
use lanecast_measure::growth::{self, Growth, fits, sizes};
use lanecast_measure::plot::{Heading, growth_page};
use lanecast_measure::ray_kinds::Kind;
use lanecast_measure::{Stats, Watch, peak_resident_bytes, restart_peak_resident};
use lanecast_model::scene::{Camera, Falloff, Light, SceneBuilder};
use lanecast_picture::render::{Progress, RenderConfig};
use std::path::Path;
use std::sync::Arc;

const SIZE: Size = Size {
    width: 512,
    height: 512,
};
/// Number of triangles of a mesh that is built almost instantly.
const QUICK: u64 = 200_000;
/// Default kinds: one of each class of rays.
const KINDS: [Kind; 4] = [
    Kind::Primary,
    Kind::LightShadow,
    Kind::Diffuse,
    Kind::DiffuseAny,
];

pub fn run(args: &BenchArgs) -> Result<(), CliError> {
    let mut config = args.config(SIZE)?;
    check_config(&mut config)?;
    let files: Vec<_> = args.plot.iter().cloned().collect();
    check_destinations(&[], &files, args.common.sinks())?;
    let progress = interrupt::watch();
    let mut watch = Watch::start();
    let mut stats = Stats::default();
    let mut growth = Growth::default();
    let range = args.growth.unwrap_or_default();
    for triangles in sizes(range.min, range.max) {
        let size = measure(args, &config, triangles, &mut watch, &mut stats, &progress)?;
        growth.sizes.push(size);
    }
    growth.fits = fits(&growth.sizes);
    stats.finish();

    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &growth)?;
    if let Some(path) = &args.plot {
        let threads = config.threads.unwrap_or(1);
        let heading = Heading {
            title: "lanecast bench: growth".into(),
            facts: vec![
                ("mesh", args.generate.title().into()),
                ("camera rays", format!("{}×{}", config.width, config.height)),
                ("threads", threads.to_string()),
                ("instructions", isa().into()),
                ("runs", format!("{}, medians", args.reps)),
            ],
        };
        let page = growth_page(&heading, &growth);
        results.outputs.add(path, page.into_bytes())?;
    }
    results.commit(&growth_table(&growth))
}

fn measure(
    args: &BenchArgs,
    config: &RenderConfig,
    triangles: u64,
    watch: &mut Watch,
    stats: &mut Stats,
    progress: &Arc<Progress>,
) -> Result<growth::Size, CliError> {
    let restarted = restart_peak_resident();
    let name = Path::new("the generated mesh");
    let scene = scene_of(seen(), args.generate.mesh(triangles), name)?;
    let prepared = complete(scene, name, config, watch, stats)?;
    let mut work = Work::plan(args, &prepared)?;
    let range = args.growth.unwrap_or_default();
    if sizes(range.min, range.max).first() == Some(&triangles) {
        warn_left_out(&work);
    }
    let kinds: &[Kind] = args.kinds.as_ref().map_or(&KINDS, |kinds| &kinds.0);
    let rays = u64::from(config.width) * u64::from(config.height);
    work.check_effort(rays * kinds.len() as u64)?;
    work.build_own(progress)?;
    let peak = peak_resident_bytes().filter(|_| restarted);
    work.build_baseline(progress)?;
    // The first builds were cold; a few more of a small mesh cost nothing.
    let more = (QUICK / triangles).min(20) as u32;
    for _ in 1..args.builds.max(1 + more) {
        work.build_own(progress)?;
        work.build_baseline(progress)?;
    }
    let jobs = work.jobs(config, kinds, progress)?;
    let results = work.bench(&jobs, progress)?;
    stats.stages.push(watch.stage("bench"));
    Ok(growth::Size {
        triangles: stats.scene.triangles,
        structures: work.index_stats(),
        peak_resident_bytes: peak,
        comparisons: comparisons(&results),
        results,
    })
}

/// Returns the view of the baseline's figures of this mesh.
fn seen() -> SceneBuilder {
    let mut scene = SceneBuilder::default();
    let eye = DVec3::new(0.0, 0.6, 3.2);
    scene.camera("", Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 38.0));
    scene.light(Light::Point {
        position: DVec3::new(4.0, 6.0, 5.0),
        intensity: [100.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    scene
}
