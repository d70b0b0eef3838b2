//! `lanecast plan`: what a scene requires and what is left out.

use super::args::{PlanArgs, RENDER_SIZE};
use super::error::CliError;
use super::output::check_destinations;
use super::{not_yet, scene};

pub fn run(args: &PlanArgs) -> Result<(), CliError> {
    let _config = args.common.config(RENDER_SIZE)?;
    check_destinations(&[&args.scene], &[], args.common.sinks())?;
    let _scene = scene::load(&args.scene, &args.common.load_options())?;
    // ==== PIPELINE: plan → print ====
    Err(not_yet("plan"))
}
