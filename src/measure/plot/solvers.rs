//! The page of the root finders: their cost and the share of roots they miss, by
//! degree.

use super::curves::{Chart, Line, Stroke, draw};
use super::page::{self, Heading, Section};
use crate::solvers::{DegreeRow, Total};

/// Substitute for a share of zero, which a logarithmic axis cannot show.
const NOTHING: f64 = 1e-3;

/// Writes the page. `rows` have increasing degrees and the same solvers, except for
/// degrees without a formula.
pub fn solvers_page(heading: &Heading, rows: &[DegreeRow]) -> String {
    let time = |t: &Total| t.nanoseconds / t.polynomials as f64;
    let missed = |t: &Total| t.tally.map_or(f64::NAN, |t| t.missed()).max(NOTHING);
    let degree = |row: &DegreeRow| row.degree.max(1) as f64;
    let lines = |point: &dyn Fn(&DegreeRow, &Total) -> [f64; 2]| -> Vec<Line> {
        let names = rows.iter().flat_map(|row| &row.solvers).map(|t| t.solver);
        let mut solvers: Vec<&str> = Vec::new();
        for name in names {
            if !solvers.contains(&name) {
                solvers.push(name);
            }
        }
        let line = |(hue, solver): (usize, &&str)| {
            let of = |row: &DegreeRow| {
                let total = row.solvers.iter().find(|t| t.solver == *solver)?;
                Some(point(row, total))
            };
            Line {
                label: (*solver).into(),
                hue,
                stroke: Stroke::Solid,
                points: rows.iter().filter_map(of).collect(),
                names: Vec::new(),
            }
        };
        solvers.iter().enumerate().map(line).collect()
    };
    let mut plane = lines(&|_, total| [time(total), missed(total)]);
    for line in &mut plane {
        line.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        line.stroke = Stroke::Dots;
    }
    let chart = |x_label, y_label, lines| {
        draw(&Chart {
            x_label,
            y_label,
            y_covers: None,
            lines,
        })
    };
    let by_degree = lines(&|row, total| [degree(row), time(total)]);
    let missed_by_degree = lines(&|row, total| [degree(row), missed(total)]);
    let note = format!(
        "Known roots that a solver does not find with their multiplicity: inside a cluster, or \
         lost. A share of zero is drawn as {NOTHING}."
    );
    let sections = [
        Section {
            heading: "Time by degree".into(),
            note: "Nanoseconds per polynomial, the mean of the best times.".into(),
            figure: chart("degree", "ns", by_degree),
        },
        Section {
            heading: "Share of missed roots by degree".into(),
            note: note.clone(),
            figure: chart("degree", "share", missed_by_degree),
        },
        Section {
            heading: "Speed and accuracy".into(),
            note: format!("One point per degree. {note}"),
            figure: chart("ns per polynomial", "share of missed roots", plane),
        },
    ];
    page::write(heading, &[], &sections)
}
