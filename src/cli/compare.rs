//! `lanecast compare`: compares two pictures, channel by channel.

use super::args::CompareArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use super::pipeline::thread_pool;
use lanecast_io::{LoadError, read_channels};
use lanecast_measure::compare::{Comparison, comparable, compare, page};
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What `--json` gets.
#[derive(Serialize)]
struct Report<'a> {
    a: String,
    b: String,
    tolerance: f64,
    #[serde(flatten)]
    comparison: &'a Comparison,
    /// Values that are infinite or no number in one picture alone, which no error counts.
    not_finite: u64,
    /// The bounds that were asked for and are exceeded.
    exceeded: Vec<&'static str>,
}

pub fn run(args: &CompareArgs) -> Result<(), CliError> {
    let files: Vec<PathBuf> = args.html.iter().cloned().collect();
    check_destinations(&[&args.a, &args.b], &files, args.json.iter())?;
    let progress = interrupt::watch();
    let pool = thread_pool(args.threads)?;
    let (a, b) = (read_channels(&args.a)?, read_channels(&args.b)?);
    interrupt::check(&progress)?;
    let refused = |message: String| {
        CliError::Load(LoadError::Invalid {
            path: args.a.clone(),
            place: format!("against {}", args.b.display()),
            message,
        })
    };
    let channels = comparable((&a, &b), args.channels.as_deref()).map_err(refused)?;
    let comparison = pool.install(|| compare((&a, &b), &channels, args.tolerance));
    interrupt::check(&progress)?;
    let exceeded = exceeded(args, &comparison)?;
    let mut results = Results::default();
    if let Some(path) = &args.html {
        let names = [name_of(&args.a), name_of(&args.b)];
        let html = page((&a, &b), [&names[0], &names[1]], &comparison, path)?;
        results.outputs.add(path, html.into_bytes())?;
    }
    let report = Report {
        a: args.a.display().to_string(),
        b: args.b.display().to_string(),
        tolerance: args.tolerance,
        comparison: &comparison,
        not_finite: not_finite(&comparison),
        exceeded: exceeded.iter().map(|(name, _)| *name).collect(),
    };
    results.add(&args.json, &report)?;
    interrupt::check(&progress)?;
    results.commit(&summary(&comparison))?;
    match exceeded.is_empty() {
        true => Ok(()),
        false => {
            let all: Vec<String> = exceeded.into_iter().map(|(_, said)| said).collect();
            Err(CliError::Short(format!(
                "{} differs from {}: {}",
                printable_line(&args.a.display().to_string()),
                printable_line(&args.b.display().to_string()),
                all.join(", ")
            )))
        }
    }
}

fn not_finite(comparison: &Comparison) -> u64 {
    comparison.channels.iter().map(|row| row.not_finite).sum()
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    printable_line(&name.to_string_lossy())
}

/// Lists the bounds that the comparison exceeds, and by what. Refuses those that it cannot tell.
fn exceeded(
    args: &CompareArgs,
    comparison: &Comparison,
) -> Result<Vec<(&'static str, String)>, CliError> {
    let mut all = Vec::new();
    if let Some(most) = args.max_wrong.filter(|most| comparison.wrong > *most) {
        let wrong = comparison.wrong;
        all.push((
            "max_wrong",
            format!("{wrong} pixels are wrong, more than {most}"),
        ));
    }
    let odd = not_finite(comparison);
    if args.max_rmse.is_some() && odd > 0 {
        all.push((
            "max_rmse",
            format!("{odd} values are infinite or no number in one picture alone"),
        ));
    }
    let rmse = comparison.error.rmse;
    if let Some(most) = args.max_rmse.filter(|most| rmse > *most) {
        all.push((
            "max_rmse",
            format!("the RMSE is {rmse:.6}, more than {most}"),
        ));
    }
    match (args.max_flip, comparison.flip) {
        (Some(most), Some(flip)) if flip > most => {
            all.push(("max_flip", format!("FLIP is {flip:.6}, more than {most}")));
        }
        (Some(_), None) => {
            return Err(CliError::Usage(
                "--max-flip compares colours, and R, G and B are not compared; add them to \
                 --channels, or leave it out"
                    .into(),
            ));
        }
        _ => {}
    }
    Ok(all)
}

fn summary(comparison: &Comparison) -> String {
    let mut text = format!(
        "{}x{}: {} of {} pixels wrong\n",
        comparison.width, comparison.height, comparison.wrong, comparison.pixels
    );
    let e = &comparison.error;
    let [largest, mean, rmse, relmse] = [e.max, e.mean, e.rmse, e.relmse].map(short);
    let bias = match e.bias < 0.0 {
        true => format!("-{}", short(-e.bias)),
        false => format!("+{}", short(e.bias)),
    };
    let _ = write!(
        text,
        "colour: largest {largest}, mean {mean}, bias {bias}, RMSE {rmse}, relMSE {relmse}"
    );
    if let Some(flip) = comparison.flip {
        let _ = write!(text, ", FLIP {flip:.6}");
    }
    let odd = not_finite(comparison);
    if odd > 0 {
        let _ = write!(
            text,
            "; without {odd} values that are not finite in one picture"
        );
    }
    text.push('\n');
    for row in comparison.channels.iter().filter(|row| row.differ > 0) {
        let name = printable_line(&row.name);
        let _ = match &row.error {
            Some(e) => write!(
                text,
                "  {name}: {} differ, largest {}, RMSE {}",
                row.differ,
                short(e.max),
                short(e.rmse)
            ),
            None => write!(text, "  {name}: {} ids differ", row.differ),
        };
        if row.not_finite > 0 {
            let _ = write!(text, ", {} not finite in one", row.not_finite);
        }
        text.push('\n');
    }
    text
}

/// Writes an error with six decimals, or with a power of ten where these would say too little or
/// too much.
fn short(x: f64) -> String {
    match x {
        x if x == 0.0 || (1e-4..1e6).contains(&x) => format!("{x:.6}"),
        _ => format!("{x:.3e}"),
    }
}
