//! `lanecast version`: tells what the program is, what it is built for, and what this machine has.

use super::args::VersionArgs;
use super::error::CliError;
use super::isa;
use super::output::{Results, check_destinations};
use lanecast_model::plan;
use serde::Serialize;

/// The value that `--json` writes.
#[derive(Serialize)]
struct Report {
    version: &'static str,
    /// With `-dirty` where sources were changed; null where git was not there.
    commit: Option<&'static str>,
    target: &'static str,
    rustc: &'static str,
    isa: Isa,
    /// Rays per packet.
    lanes: Vec<usize>,
    /// Those of cargo that are on.
    features: Vec<&'static str>,
}

#[derive(Serialize)]
struct Isa {
    build: &'static str,
    machine: &'static str,
}

/// The features of cargo, and whether each is on.
const FEATURES: [(&str, bool); 6] = [
    ("all-lanes", plan::ALL_LANES),
    ("denoise", cfg!(feature = "denoise")),
    ("draco", cfg!(feature = "draco")),
    ("ktx2", cfg!(feature = "ktx2")),
    ("peer-embree", cfg!(feature = "peer-embree")),
    ("view", cfg!(feature = "view")),
];

/// Lists the features of cargo that are on.
pub fn features() -> impl Iterator<Item = &'static str> {
    FEATURES.iter().filter(|f| f.1).map(|f| f.0)
}

pub fn run(args: &VersionArgs) -> Result<(), CliError> {
    check_destinations(&[], &[], args.json.iter())?;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        commit: option_env!("LANECAST_COMMIT"),
        target: env!("LANECAST_TARGET"),
        rustc: env!("LANECAST_RUSTC"),
        isa: Isa {
            build: isa::of_build(),
            machine: isa::of_machine(),
        },
        lanes: plan::widths(),
        features: features().collect(),
    };
    let mut results = Results::default();
    results.add(&args.json, &report)?;
    results.commit(&text(&report))
}

fn text(report: &Report) -> String {
    let lanes: Vec<String> = report.lanes.iter().map(usize::to_string).collect();
    let features = match report.features.is_empty() {
        true => "none".to_owned(),
        false => report.features.join(", "),
    };
    format!(
        "lanecast {} ({})\n\
         built for  {}, {}, by {}\n\
         machine    {}\n\
         lanes      {}\n\
         features   {features}\n",
        report.version,
        report.commit.unwrap_or("commit unknown"),
        report.target,
        report.isa.build,
        report.rustc,
        report.isa.machine,
        lanes.join(", "),
    )
}
