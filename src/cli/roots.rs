//! `lanecast roots`: finds the real roots of polynomials with any solver.

use super::args::RootsArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use lanecast_io::{Listed, load_polynomials};
use lanecast_measure::plot::{Heading, solvers_page};
use lanecast_measure::solvers::{DegreeRow, Total, Trial, totals, trial};
use lanecast_numerics::roots::{Answer, Cluster, Interval, Polynomial, Root, Solver};
use serde::Serialize;
use std::fmt::Write;
use std::ops::Bound;

/// The value that `--json` writes; for `--coeffs` the row of its polynomial.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Report {
    One(Row),
    Many {
        polynomials: Vec<Row>,
        solvers: Vec<Total>,
        degrees: Vec<DegreeRow>,
    },
}

#[derive(Debug, Serialize)]
struct Row {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    degree: usize,
    /// Ends of the interval; null if it is unbounded.
    low: Option<f64>,
    high: Option<f64>,
    /// The solver that found these roots.
    solver: &'static str,
    roots: Vec<Root>,
    clusters: Vec<Cluster>,
    complete: bool,
    solvers: Vec<Trial>,
}

pub fn run(args: &RootsArgs) -> Result<(), CliError> {
    interrupt::end_at_signal();
    let inputs: Vec<_> = args.file.as_deref().into_iter().collect();
    let files: Vec<_> = args.plot.iter().cloned().collect();
    check_destinations(&inputs, &files, args.json.iter())?;
    let report = match (&args.coeffs, &args.file) {
        (Some(coefficients), _) => {
            let polynomial = Polynomial::new(&coefficients.0);
            let polynomial = polynomial.map_err(|e| CliError::Usage(format!("--coeffs: {e}")))?;
            Report::One(row(None, &polynomial, None, args)?)
        }
        (None, Some(file)) => many(&load_polynomials(file)?, args)?,
        (None, None) => {
            let message = "give the polynomial as --coeffs=c0,c1,… or a list of them as --file";
            return Err(CliError::Usage(message.into()));
        }
    };
    let mut results = Results::default();
    results.add(&args.json, &report)?;
    if let (Some(path), Report::Many { degrees, .. }) = (&args.plot, &report) {
        let heading = Heading {
            title: "Roots of polynomials".into(),
            facts: vec![("list", inputs[0].display().to_string())],
        };
        let page = solvers_page(&heading, degrees);
        results.outputs.add(path, page.into_bytes())?;
    }
    results.commit(&text_report(&report))?;
    match &report {
        Report::Many { solvers, .. } => check_auto(solvers),
        Report::One(_) => Ok(()),
    }
}

/// Returns an error unless `auto` finds the roots that a list knows, as it guarantees.
fn check_auto(totals: &[Total]) -> Result<(), CliError> {
    let auto = totals
        .iter()
        .find(|total| total.solver == Solver::Auto.name());
    let Some(tally) = auto.and_then(|total| total.tally.as_ref()) else {
        return Ok(());
    };
    let (lost, wrong) = (tally.lost, tally.false_roots + tally.wrong_multiplicity);
    if lost + wrong == 0 {
        return Ok(());
    }
    Err(CliError::Short(format!(
        "auto does not find the known roots of the file: {lost} lost, {wrong} others; it \
         guarantees them, so the file or auto is wrong"
    )))
}

fn many(listed: &[Listed], args: &RootsArgs) -> Result<Report, CliError> {
    let mut polynomials = Vec::new();
    for one in listed {
        let row = row(Some(&one.name), &one.polynomial, Some(one), args);
        polynomials.push(row?);
    }
    let mut degrees: Vec<usize> = polynomials.iter().map(|row| row.degree).collect();
    degrees.sort_unstable();
    degrees.dedup();
    let trials = |row: &'_ Row| row.solvers.clone();
    let of_degree = |degree: &usize| {
        let rows = polynomials.iter().filter(|row| row.degree == *degree);
        let trials: Vec<Trial> = rows.flat_map(trials).collect();
        DegreeRow {
            degree: *degree,
            solvers: totals(trials.iter()),
        }
    };
    Ok(Report::Many {
        solvers: totals(polynomials.iter().flat_map(|row| &row.solvers)),
        degrees: degrees.iter().map(of_degree).collect(),
        polynomials,
    })
}

/// Finds the roots of one polynomial with the requested solver, or with `auto` and all
/// others.
fn row(
    name: Option<&str>,
    p: &Polynomial,
    listed: Option<&Listed>,
    args: &RootsArgs,
) -> Result<Row, CliError> {
    let interval = &args.interval;
    let asked: &[Solver] = match &args.solver {
        Some(solver) => std::slice::from_ref(solver),
        None => &Solver::ALL,
    };
    // The known roots are those of the whole line.
    let known = listed.and_then(|l| l.known.as_deref());
    let known = known.filter(|_| *interval == Interval::LINE);
    let mut first: Option<Answer> = None;
    let mut solvers = Vec::new();
    for solver in asked {
        match trial(p, interval, *solver, known) {
            Ok((answer, trial)) => {
                first.get_or_insert(answer);
                solvers.push(trial);
            }
            // In a list, or beside other solvers, a solver that cannot handle the
            // polynomial is skipped.
            Err(_) if listed.is_some() || asked.len() > 1 => {}
            Err(e) => return Err(CliError::Usage(e.to_string())),
        }
    }
    let (roots, clusters) = first.map(|a| (a.roots, a.clusters)).unwrap_or_default();
    let end = |bound: Bound<f64>| match bound {
        Bound::Included(x) | Bound::Excluded(x) => Some(x),
        Bound::Unbounded => None,
    };
    Ok(Row {
        name: name.map(Into::into),
        degree: p.degree(),
        low: end(interval.low),
        high: end(interval.high),
        solver: asked[0].name(),
        roots,
        clusters,
        complete: solvers.first().is_some_and(|s| s.complete),
        solvers,
    })
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    match report {
        Report::One(row) => one(&mut text, row),
        Report::Many {
            polynomials,
            solvers,
            ..
        } => {
            for row in polynomials {
                heading(&mut text, row);
            }
            sums(&mut text, solvers);
        }
    }
    text
}

// Writing to a string cannot fail, here and below.

fn one(text: &mut String, row: &Row) {
    let end = |x: Option<f64>, none: &str| x.map_or(none.into(), |x| x.to_string());
    let (low, high) = (end(row.low, "-inf"), end(row.high, "inf"));
    let closing = if row.high.is_some() { "]" } else { ")" };
    let _ = writeln!(
        text,
        "degree {}, {} in ({low}, {high}{closing}, by {}\n",
        row.degree,
        distinct(row.roots.len()),
        row.solver
    );
    for root in &row.roots {
        let _ = writeln!(
            text,
            "  t {:<24} ± {:<8.1e} multiplicity {}",
            shown(root.t),
            root.error,
            root.multiplicity
        );
    }
    for cluster in &row.clusters {
        let _ = writeln!(text, "  {}", unresolved(cluster));
    }
    if !row.complete {
        let _ = writeln!(
            text,
            "  others may be missing: {} does not prove completeness",
            row.solver
        );
    }
    let _ = writeln!(text, "\nsolver      roots clusters complete           ns");
    for trial in &row.solvers {
        let _ = writeln!(
            text,
            "{:<11} {:>5} {:>8} {:<8} {:>12}",
            trial.solver,
            trial.roots,
            trial.clusters,
            if trial.complete { "yes" } else { "unproven" },
            trial.nanoseconds
        );
    }
}

fn heading(text: &mut String, row: &Row) {
    let roots: Vec<String> = row.roots.iter().map(root).collect();
    let mut line = roots.join("  ");
    for cluster in &row.clusters {
        let _ = write!(line, "  {}", unresolved(cluster));
    }
    let name = printable_line(row.name.as_deref().unwrap_or(""));
    let count = distinct(row.roots.len());
    let _ = writeln!(text, "{name} (degree {}): {count}", row.degree);
    if !line.is_empty() {
        let _ = writeln!(text, "  {}", line.trim());
    }
}

fn distinct(count: usize) -> String {
    match count {
        1 => "1 distinct real root".into(),
        _ => format!("{count} distinct real roots"),
    }
}

fn root(root: &Root) -> String {
    match root.multiplicity {
        1 => shown(root.t),
        m => format!("{} (×{m})", shown(root.t)),
    }
}

fn shown(t: f64) -> String {
    let size = t.abs();
    if size == f64::MAX {
        format!("beyond {t:e}")
    } else if size != 0.0 && !(1e-5..1e16).contains(&size) {
        format!("{t:e}")
    } else {
        t.to_string()
    }
}

fn unresolved(cluster: &Cluster) -> String {
    let Cluster { low, high, parity } = cluster;
    let parity = format!("{parity:?}").to_lowercase();
    let (low, high) = (shown(*low), shown(*high));
    format!("cluster {low} to {high}: unresolved roots, their number is {parity}")
}

fn sums(text: &mut String, totals: &[Total]) {
    let _ = writeln!(
        text,
        "\nsolver     polynomials roots clusters  right multiplicity in cluster lost false           ns"
    );
    for total in totals {
        let _ = write!(
            text,
            "{:<11} {:>10} {:>5} {:>8}",
            total.solver, total.polynomials, total.roots, total.clusters
        );
        let _ = match &total.tally {
            Some(t) => write!(
                text,
                " {:>6} {:>12} {:>10} {:>4} {:>5}",
                t.found, t.wrong_multiplicity, t.in_clusters, t.lost, t.false_roots
            ),
            None => write!(text, " {:>6} {:>12} {:>10} {:>4} {:>5}", "", "", "", "", ""),
        };
        let _ = writeln!(text, " {:>12}", total.nanoseconds);
    }
    if totals.iter().any(|total| total.tally.is_some()) {
        let _ = writeln!(
            text,
            "\nknown roots of the file: right, with another multiplicity, inside a cluster, lost;\n\
             false: roots found that do not exist"
        );
    }
}
