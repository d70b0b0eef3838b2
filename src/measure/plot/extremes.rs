//! The page of the stress sweeps: a table of where each precision begins to err, then
//! two charts per sweep, of the share of wrong answers and of the error of t.

use super::curves::{Chart, Line, Stroke, draw};
use super::page::{self, Heading, Section};
use super::svg::escaped;
use crate::extremes::{Figures, Report, Start, SweepReport, ULPS_ALLOWED, shown};
use std::fmt::Write;

/// Substitute for zero, which a logarithmic axis cannot show: this share of one answer
/// for no wrong answer, this share of a unit in the last place for an exact t.
const NOTHING: f64 = 0.1;

pub fn extremes_page(heading: &Heading, report: &Report) -> String {
    let mut sections = vec![Section {
        heading: "Where each precision begins to err".into(),
        note: format!(
            "The first value of the axis at which a decision is wrong (hit, id, shadow), a number is \
             not finite, or t is off by more than {ULPS_ALLOWED} units in the last place; a dash means \
             nowhere."
        ),
        figure: table(report),
    }];
    for sweep in &report.sweeps {
        let share = |f: &Figures| (f.wrong() as f64).max(NOTHING) / f.rays.max(1) as f64;
        let error = |f: &Figures| f.max_t_ulps.max(NOTHING);
        let least = NOTHING / (2.0 * report.rays.max(1) as f64);
        let shares = chart(sweep, ("share of wrong answers", [least, 1.0]), &share);
        let label = "largest error of t, in units in the last place";
        let errors = chart(sweep, (label, [NOTHING, 1e4]), &error);
        sections.push(Section {
            heading: format!("{}: {}", sweep.name, sweep.subject),
            note: format!(
                "{}. Both axes are logarithmic; no wrong answer is drawn as {NOTHING} of an answer, \
                 an error below {NOTHING} of a unit as {NOTHING}.",
                sweep.title
            ),
            figure: shares + &errors,
        });
    }
    page::write(heading, &[], &sections)
}

/// Draws one chart. `covers` is the range that the y-axis shows at least.
fn chart(
    sweep: &SweepReport,
    (y_label, covers): (&'static str, [f64; 2]),
    of: &dyn Fn(&Figures) -> f64,
) -> String {
    let line = |(row, start): (usize, &Start)| {
        let built = sweep.points.iter().filter(|point| point.refused.is_none());
        let mut points: Vec<[f64; 2]> = built.map(|p| [p.value, of(&p.modes[row])]).collect();
        // Labels stand at the last point, on the right.
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Line {
            label: start.precision.into(),
            hue: row,
            // A dashed line on a solid one shows both where they coincide.
            stroke: if row == 2 {
                Stroke::Dashed
            } else {
                Stroke::Solid
            },
            points,
            names: Vec::new(),
        }
    };
    draw(&Chart {
        x_label: sweep.axis,
        y_label,
        y_covers: Some(covers),
        lines: sweep.starts.iter().enumerate().map(line).collect(),
    })
}

fn table(report: &Report) -> String {
    let mut html = String::from("<table>\n<tr><th>sweep</th><th>of</th><th>axis</th><th>to</th>");
    let starts = report.sweeps.first().map_or(&[][..], |sweep| &sweep.starts);
    for start in starts {
        let _ = write!(html, "<th>{}</th>", start.precision);
    }
    html.push_str("</tr>\n");
    for sweep in &report.sweeps {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
            sweep.name,
            sweep.subject,
            escaped(sweep.axis),
            sweep
                .points
                .last()
                .map_or(String::new(), |p| shown(p.value)),
        );
        for start in &sweep.starts {
            let _ = write!(html, "<td>{}</td>", escaped(&start.to_string()));
        }
        html.push_str("</tr>\n");
    }
    html + "</table>\n"
}
