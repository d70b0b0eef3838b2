//! `lanecast bench`: rays per second by ray kind and mode.

use super::args::{BenchArgs, BenchKinds, RENDER_SIZE};
use super::error::CliError;
use super::output::check_destinations;
use super::{not_yet, scene};
use crate::io::{RaySet, TriangleSet};
use std::path::Path;

pub fn run(args: &BenchArgs) -> Result<(), CliError> {
    let config = args.common.config(RENDER_SIZE)?;
    let inputs: Vec<&Path> = [&args.scene, &args.mesh, &args.rays]
        .into_iter()
        .filter_map(|path| path.as_deref())
        .collect();
    check_destinations(&inputs, &[], args.common.sinks())?;
    let _kinds = args.kinds.unwrap_or(BenchKinds::ALL);
    // ==== PIPELINE: rays → trace `args.reps` times → check the hits → report ====
    // `args.export` is the folder for .msh and .rays.
    let _ = (args.reps, &args.export);
    match (&args.scene, &args.mesh, &args.rays) {
        (Some(scene), ..) => {
            let scene = scene::load(scene, &args.common.load_options())?;
            let _camera = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
        }
        (None, Some(mesh), Some(rays)) => {
            let _mesh = TriangleSet::load(mesh)?;
            let _rays = RaySet::load(rays)?;
        }
        // The arguments' own rules leave nothing else.
        _ => return Err(CliError::Usage("name a SCENE, or --mesh and --rays".into())),
    }
    Err(not_yet("bench"))
}
