//! `lanecast verify --light`: compares the path integrator's samples with the reference's own
//! path tracer.

use super::super::args::VerifyArgs;
use super::super::error::CliError;
use super::super::interrupt;
use super::super::output::{Results, check_destinations};
use super::super::progress::Drawing;
use super::LISTED;
use lanecast_io::LoadError;
use lanecast_measure::light::{LightComparison, LightError, verify_light};
use lanecast_measure::{Stats, Watch};
use lanecast_picture::render::{Grid, Integrator, RenderConfig, View};
use lanecast_reference::Reference;
use std::fmt::Write;

/// Samples per pixel unless `--spp` says otherwise.
const SPP: u32 = 16;

pub fn run(args: &VerifyArgs) -> Result<(), CliError> {
    let config = RenderConfig {
        integrator: Integrator::Path,
        spp: args.spp.unwrap_or(SPP),
        ..args.config()?
    };
    if config.grid != Grid::Centers {
        return Err(CliError::Usage(
            "verify --light has samples all over the pixels; leave out --grid corners".into(),
        ));
    }
    let outputs = check_destinations(&[&args.scene], &[], args.common.sinks())?;
    let progress = interrupt::watch();
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let prepared = super::prepared(args, outputs, &config, &mut watch, &mut stats)?;
    let too_many = |source| LoadError::of_scene(&args.scene, source);
    prepared.instances.check_enumerable().map_err(too_many)?;
    let world = prepared.world(&mut watch, &mut stats);
    let reference = Reference::new(&prepared.scene, &prepared.instances).map_err(too_many)?;
    stats.stages.push(watch.stage("reference"));
    let view = View {
        world: &world,
        kernels: prepared.plan.kernels,
        camera: prepared.camera,
        lights: &prepared.scene.lights,
    };
    let compared = {
        let _drawing = Drawing::start(&progress, args.common.progress.style);
        let compare = || verify_light(&view, &config, &reference, LISTED, &progress);
        prepared.pool.install(compare)
    };
    let compared = compared.map_err(|error| match error {
        LightError::Interrupted => CliError::Interrupted,
        LightError::Unknown(_) => CliError::Usage(error.to_string()),
    })?;
    stats.stages.push(watch.stage("verify"));
    stats.finish();
    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &compared)?;
    results.commit(&text_report(&compared))?;
    match compared.counts.unexplained {
        0 => Ok(()),
        n => Err(CliError::Short(format!(
            "{n} samples differ from the reference without an explanation"
        ))),
    }
}

fn text_report(of: &LightComparison) -> String {
    let c = &of.counts;
    let mut text = format!(
        "{} samples: {} are the reference's (within {:.1e}), {} differ in {} pixels\n",
        c.samples,
        c.same,
        c.greatest,
        c.samples - c.same,
        c.pixels
    );
    let rows = [
        (c.other_hit, "explained: rays that meet another primitive"),
        (
            c.other_shadow,
            "explained: light rays that are blocked in one",
        ),
        (
            c.other_choice,
            "explained: numbers at the threshold of a choice",
        ),
    ];
    for (count, what) in rows {
        let _ = writeln!(text, "{count:>9} {what}");
    }
    let _ = writeln!(
        text,
        "{:>9} grown: no decision turned, and within the bound on rounding along the path (at \
         most {:.2} of it)",
        c.grown, c.grown_part
    );
    let _ = writeln!(text, "{:>9} unexplained", c.unexplained);
    for one in &of.unexplained {
        let _ = writeln!(text, "\n{one}");
    }
    text
}
