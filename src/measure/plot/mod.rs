//! Results of `bench`, `extremes` and `roots` as one HTML page of bars and curves,
//! drawn as inline SVG.
//!
//! The page needs no external resource and no script; colours follow the reader's light
//! or dark setting. Every number that a mark stands for is also written beside it or in
//! its title, and the JSON output contains all of them.

mod bars;
mod curves;
mod embed;
mod extremes;
mod page;
mod solvers;
mod svg;
mod tradeoff;

pub use embed::data;
pub use extremes::extremes_page;
pub use page::{Heading, Section, page_with};
pub use solvers::solvers_page;
pub use svg::escaped;
pub use tradeoff::tradeoff_page;

use super::bench::{Comparison, Row};
use super::growth::Growth;
use super::index_stats::StructureRow;
use super::ray_kinds::Kind;
use bars::{Bar, Group};
use curves::{Chart, Line, Stroke};

/// The meaning of a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tone {
    Fast,
    Guarded,
    Exact,
    Baseline,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Tone::Fast => "t-fast",
            Tone::Guarded => "t-guarded",
            Tone::Exact => "t-exact",
            Tone::Baseline => "t-peer",
        }
    }

    fn for_row(row: &Row) -> Tone {
        match row.precision {
            _ if row.peer => Tone::Baseline,
            "exact" => Tone::Exact,
            "guarded" => Tone::Guarded,
            _ => Tone::Fast,
        }
    }
}

/// Writes the page of one scene's figures.
pub fn bench_page(
    heading: &Heading,
    rows: &[Row],
    structures: &[StructureRow],
    comparisons: &[Comparison],
) -> String {
    let mut sections = Vec::new();
    if !comparisons.is_empty() {
        sections.push(Section {
            heading: "Compared with the baseline's best".into(),
            note:
                "Ratio of the median rates, our fastest over the baseline's fastest. Rays between \
                   hits and a point light may be traced in either direction: the baseline's faster \
                   direction counts. guarded and exact are compared with its robust tests."
                    .into(),
            figure: bars::draw(&[ratio_group(rows, comparisons)], "×", Some(1.0)),
        });
    }
    sections.push(Section {
        heading: "Rays per second".into(),
        note: "Millions, from an array of rays to arrays of t and id; medians. One scale for all \
               kinds, so that the cost of lost coherence shows."
            .into(),
        figure: bars::draw(&kind_groups(rows), "Mrays/s", None),
    });
    if let Some(group) = build_group(structures) {
        sections.push(Section {
            heading: "Building".into(),
            note: "Million triangles per second; medians.".into(),
            figure: bars::draw(&[group], "Mtris/s", None),
        });
        sections.push(Section {
            heading: "Memory".into(),
            note:
                "Bytes of nodes and leaves per triangle. Our leaves hold copies of the triangles; \
                   the baseline's may share the input instead."
                    .into(),
            figure: bars::draw(&[memory_group(structures)], "bytes", None),
        });
    }
    page::write(heading, &tones(rows), &sections)
}

/// Writes the page of a growth measurement.
pub fn growth_page(heading: &Heading, growth: &Growth) -> String {
    let lines = |what: &str| {
        let fits = growth.fits.iter().filter(|fit| fit.what == what);
        // One colour per compared item: a kind of rays, or a structure.
        let mut hues: Vec<&str> = Vec::new();
        let mut lines = Vec::new();
        for fit in fits {
            let key = match what {
                "trace" => fit.name.split(' ').next().unwrap_or_default(),
                _ => &fit.name,
            };
            let hue = hues.iter().position(|hue| *hue == key);
            let hue = hue.unwrap_or_else(|| {
                hues.push(key);
                hues.len() - 1
            });
            lines.push(Line {
                label: format!("{} n^{:.2}", fit.name, fit.exponent),
                hue,
                stroke: if fit.peer {
                    Stroke::Dashed
                } else {
                    Stroke::Solid
                },
                points: fit.points.clone(),
                names: Vec::new(),
            });
        }
        lines
    };
    let mut sections = Vec::new();
    for (what, heading, note, unit) in [
        (
            "build",
            "Building",
            "Seconds over triangles, both axes logarithmic; n^e is the least-squares fit.",
            "seconds",
        ),
        (
            "trace",
            "Tracing",
            "Nanoseconds per ray over triangles, both axes logarithmic; the baseline's best is dashed.",
            "ns per ray",
        ),
        (
            "memory",
            "Memory",
            "Bytes of the structures, and the peak memory of the process, over triangles.",
            "bytes",
        ),
    ] {
        let lines = lines(what);
        if !lines.is_empty() {
            sections.push(Section {
                heading: heading.into(),
                note: note.into(),
                figure: curves::draw(&Chart {
                    x_label: "triangles",
                    y_label: unit,
                    y_covers: None,
                    lines,
                }),
            });
        }
    }
    page::write(heading, &[], &sections)
}

/// Returns class and name of the colours that the rows use.
fn tones(rows: &[Row]) -> Vec<(&'static str, &'static str)> {
    [
        (Tone::Fast, "fast: f32 lanes"),
        (
            Tone::Guarded,
            "guarded: f32 lanes, uncertain tests decided exactly",
        ),
        (
            Tone::Exact,
            "exact: as guarded, t refined to the nearest f64",
        ),
        (Tone::Baseline, "baseline"),
    ]
    .into_iter()
    .filter(|(tone, _)| rows.iter().any(|row| Tone::for_row(row) == *tone))
    .map(|(tone, name)| (tone.class(), name))
    .collect()
}

/// Groups the rows by kind, fastest first.
fn kind_groups(rows: &[Row]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for row in rows {
        if !groups.iter().any(|group| group.key == row.kind) {
            let share = 100.0 * row.hits as f64 / row.rays.max(1) as f64;
            groups.push(Group {
                key: row.kind.clone(),
                title: row.kind.clone(),
                note: format!("{} rays, {share:.0} % hit", thousands(row.rays as u64)),
                bars: Vec::new(),
            });
        }
        let differ = &row.differences;
        let bar = Bar {
            label: row.tracer(),
            value: row.mrays_per_s,
            text: figure(row.mrays_per_s),
            hint: format!(
                "best {:.2} Mrays/s; {} of {} rays differ from exact",
                row.mrays_per_s_best, differ.differ, differ.checked
            ),
            tone: Tone::for_row(row),
        };
        if let Some(group) = groups.iter_mut().find(|group| group.key == row.kind) {
            group.bars.push(bar);
        }
    }
    for group in &mut groups {
        group.bars.sort_by(|a, b| b.value.total_cmp(&a.value));
    }
    let place = |key: &str| Kind::ALL.iter().position(|kind| kind.name() == key);
    groups.sort_by_key(|group| place(&group.key));
    groups
}

fn ratio_group(rows: &[Row], comparisons: &[Comparison]) -> Group {
    let bar = |c: &Comparison| {
        let (own, peer) = (&rows[c.own], &rows[c.peer]);
        Bar {
            label: format!("{} {}", c.kind, c.precision),
            value: c.ratio,
            text: format!("{:.2}×", c.ratio),
            hint: format!(
                "{} {:.2} Mrays/s; {} {:.2} Mrays/s ({})",
                own.tracer(),
                own.mrays_per_s,
                peer.tracer(),
                peer.mrays_per_s,
                peer.kind
            ),
            tone: Tone::for_row(own),
        }
    };
    Group {
        key: String::new(),
        title: String::new(),
        note: String::new(),
        bars: comparisons.iter().map(bar).collect(),
    }
}

fn build_group(structures: &[StructureRow]) -> Option<Group> {
    let bars: Vec<Bar> = structures
        .iter()
        .filter(|row| row.build_mtris_per_s > 0.0)
        .map(|row| structure_bar(row, row.build_mtris_per_s))
        .collect();
    (!bars.is_empty()).then(|| plain_group(bars))
}

fn memory_group(structures: &[StructureRow]) -> Group {
    let bar = |row: &StructureRow| structure_bar(row, row.bytes_per_triangle);
    plain_group(structures.iter().map(bar).collect())
}

fn plain_group(bars: Vec<Bar>) -> Group {
    Group {
        key: String::new(),
        title: String::new(),
        note: String::new(),
        bars,
    }
}

fn structure_bar(row: &StructureRow, value: f64) -> Bar {
    Bar {
        label: row.name.clone(),
        value,
        text: figure(value),
        hint: format!(
            "{:.3} s, {} triangles, {:.1} MB",
            row.build_seconds,
            thousands(row.triangles),
            row.tree_bytes as f64 * 1e-6
        ),
        tone: if row.version.is_some() {
            Tone::Baseline
        } else {
            Tone::Fast
        },
    }
}

/// Formats three significant digits, at most two decimals.
fn figure(value: f64) -> String {
    match value {
        v if v >= 99.95 => format!("{v:.0}"),
        v if v >= 9.995 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// Formats a number as `1,046,528`.
fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them() {
        assert_eq!(thousands(0), "0");
        assert_eq!(thousands(999), "999");
        assert_eq!(thousands(1_046_528), "1,046,528");
        assert_eq!(figure(3.24159), "3.24");
        assert_eq!(figure(31.4159), "31.4");
        assert_eq!(figure(99.99), "100");
    }
}
