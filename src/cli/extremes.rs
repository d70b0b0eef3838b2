//! `lanecast extremes`: stress sweeps that show where each precision begins to err.

use super::args::ExtremesArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations};
use super::pipeline::{isa, thread_pool};
use super::progress::Drawing;
use lanecast_measure::extremes::{
    ExtremesOptions, Figures, PRECISIONS, Point, Report, SWEEPS, Start, SweepReport, ULPS_ALLOWED,
    run as sweep, shown,
};
use lanecast_measure::plot::{Heading, extremes_page};
use lanecast_model::plan::{Precision, widths};
use std::fmt::Write;

pub fn run(args: &ExtremesArgs) -> Result<(), CliError> {
    let files: Vec<_> = args.plot.iter().cloned().collect();
    check_destinations(&[], &files, args.json.iter())?;
    args.progress.check(args.json.iter())?;
    let options = ExtremesOptions {
        rays: args.rays as usize,
        seed: args.seed,
        precisions: args.precision.map_or(PRECISIONS.to_vec(), |one| vec![one]),
        lanes: args.lanes,
    };
    check_lanes(&options)?;
    let sweeps = match &args.only {
        Some(asked) => asked.0.clone(),
        None => SWEEPS.iter().collect(),
    };
    let pool = thread_pool(args.threads)?;
    let progress = interrupt::watch();
    let report = {
        let _drawing = Drawing::start(&progress, args.progress.style);
        pool.install(|| sweep(&sweeps, &options, &progress))?
    };
    interrupt::check(&progress)?;

    let mut results = Results::default();
    results.add(&args.json, &report)?;
    if let Some(path) = &args.plot {
        let heading = Heading {
            title: "lanecast extremes".into(),
            facts: vec![
                ("rays at each value", report.rays.to_string()),
                ("seed", report.seed.to_string()),
                ("instructions", isa().into()),
            ],
        };
        let page = extremes_page(&heading, &report);
        results.outputs.add(path, page.into_bytes())?;
    }
    results.commit(&text_report(&report))?;
    check_guarantees(&report)
}

/// Checks before any work that this build has the width.
fn check_lanes(options: &ExtremesOptions) -> Result<(), CliError> {
    let Some(lanes) = options.lanes.count() else {
        return Ok(());
    };
    let built = widths();
    if !built.contains(&lanes) {
        return Err(CliError::Usage(format!(
            "this build has no packets of {lanes} rays; leave --lanes out, or build with \
             --features all-lanes"
        )));
    }
    Ok(())
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} rays at each value, closest hit and any hit; seed {}\n\n\
         Where each precision begins to err: a decision is wrong (hit, id, shadow), a number is not \
         finite,\nor t is off by more than {ULPS_ALLOWED} units in the last place. A dash means nowhere.\n",
        report.rays, report.seed
    );
    let name = |sweep: &SweepReport| format!("{} {}", sweep.name, sweep.subject);
    let names = report.sweeps.iter().map(|sweep| name(sweep).len());
    let axes = report.sweeps.iter().map(|sweep| sweep.axis.len());
    let (name_width, axis_width) = (names.max().unwrap_or(0), axes.max().unwrap_or(0));
    let _ = write!(
        text,
        "{:<name_width$}  {:<axis_width$}  {:<14}",
        "sweep", "axis", "from … to"
    );
    for start in report.sweeps.first().map_or(&[][..], |sweep| &sweep.starts) {
        let _ = write!(text, "  {:<24}", start.precision);
    }
    text.push('\n');
    for sweep in &report.sweeps {
        let end = |point: Option<&Point>| point.map_or(String::new(), |point| shown(point.value));
        let range = format!(
            "{} … {}",
            end(sweep.points.first()),
            end(sweep.points.last())
        );
        let _ = write!(
            text,
            "{:<name_width$}  {:<axis_width$}  {range:<14}",
            name(sweep),
            sweep.axis
        );
        for start in &sweep.starts {
            let _ = write!(text, "  {:<24}", start.to_string());
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    let mut list = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            let _ = writeln!(text, "\n{title}");
        }
        for line in lines {
            let _ = writeln!(text, "  {line}");
        }
    };
    let refused = report.sweeps.iter().flat_map(|sweep| {
        let first = sweep
            .points
            .iter()
            .find_map(|p| Some((p.value, p.refused.as_ref()?)));
        first.map(|(value, why)| format!("{} at {}: {why}", name(sweep), shown(value)))
    });
    list(
        "Scenes refused by validation, from this value on:",
        refused.collect(),
    );
    let gaps = report.sweeps.iter().flat_map(gaps);
    list(
        "Known gaps, where guarded and exact give no guarantee yet:",
        gaps.collect(),
    );
    text
}

/// Describes wrong answers at values without a guarantee.
fn gaps(sweep: &SweepReport) -> Vec<String> {
    let of_precision = |(row, start): (usize, &Start)| {
        let guaranteed = |point: &&Point| point.known_gap.is_none() || point.refused.is_some();
        let unsure = sweep.points.iter().filter(|point| !guaranteed(point));
        let mut wrong = unsure.filter(|point| {
            let f = &point.modes[row];
            is_guaranteed(f) && f.wrong() + f.not_finite > 0
        });
        let first = wrong.next()?;
        let share = |point: &Point| {
            let f = &point.modes[row];
            100.0 * f.wrong() as f64 / f.rays.max(1) as f64
        };
        let (count, most) = wrong.fold((1, share(first)), |(count, most), point| {
            (count + 1, f64::max(most, share(point)))
        });
        Some(format!(
            "{} {}, {}: at {} first, {count} of {} values, at most {most:.1} % wrong: {}",
            sweep.name,
            sweep.subject,
            start.precision,
            shown(first.value),
            sweep.points.len(),
            first.known_gap.unwrap_or_default(),
        ))
    };
    let lines = sweep.starts.iter().enumerate().filter_map(of_precision);
    lines.collect()
}

/// Describes one precision's wrong answers at one value.
fn faults(sweep: &SweepReport, value: f64, f: &Figures) -> String {
    let mut text = format!(
        "{} {} at {}, {}: {} hits, {} ids, {} shadows wrong, {} not finite, of {}",
        sweep.name,
        sweep.subject,
        shown(value),
        f.precision,
        f.wrong_hit,
        f.wrong_id,
        f.wrong_shadow,
        f.not_finite,
        f.rays
    );
    if let Some(first) = &f.first_wrong {
        let _ = write!(text, "; first {first}");
    }
    text
}

/// Returns whether the precision guarantees its answers; `fast` does not.
fn is_guaranteed(figures: &Figures) -> bool {
    figures.precision != Precision::Fast.name()
}

/// Returns an error if a guaranteed answer is wrong, or a number of a precision other
/// than `fast` is NaN or infinite.
fn check_guarantees(report: &Report) -> Result<(), CliError> {
    let broken = |point: &Point, f: &Figures| {
        is_guaranteed(f) && (f.not_finite > 0 || point.known_gap.is_none() && f.wrong() > 0)
    };
    let mut broken = report.rows().filter(|(_, point, f)| broken(point, f));
    let Some((sweep, point, figures)) = broken.next() else {
        return Ok(());
    };
    let faults = faults(sweep, point.value, figures);
    let more = broken.count();
    Err(CliError::Short(format!(
        "{faults}; {more} other values also fail"
    )))
}
