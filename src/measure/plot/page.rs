//! The HTML page around the figures.

use super::curves::COLOURS;
use super::svg::escaped;
use std::fmt::Write;

/// The title of a page, and the facts listed below it.
#[derive(Clone, Debug, Default)]
pub struct Heading {
    pub title: String,
    /// Pairs (name, value): the machine, the scene, the settings.
    pub facts: Vec<(&'static str, String)>,
}

pub struct Section {
    pub heading: String,
    pub note: String,
    /// SVG or a table.
    pub figure: String,
}

/// The page's style sheet. The colours are Okabe and Ito's palette, which people with
/// any kind of colour vision can tell apart, lightened for a dark page.
const STYLE: &str = "
:root { color-scheme: light dark; --page: #fff; --ink: #1b1f24; --soft: #5c6670; --grid: #e3e7eb;
  --axis: #9aa4ae; --fast: #0072b2; --guarded: #009e73; --exact: #56a5d8; --peer: #d55e00;
  --k0: #0072b2; --k1: #d55e00; --k2: #009e73; --k3: #b0548d; --k4: #b58900; --k5: #3f8fc0;
  --k6: #6b6b6b; --k7: #8c4a00; --k8: #c2255c; --k9: var(--ink); }
@media (prefers-color-scheme: dark) { :root { --page: #14171a; --ink: #e8ebee; --soft: #9aa5b0;
  --grid: #2a3037; --axis: #5b6670; --fast: #4aa8e0; --guarded: #2fc39a; --exact: #2f6f96;
  --peer: #f08a3c; --k0: #4aa8e0; --k1: #f08a3c; --k2: #2fc39a; --k3: #dd8fbf; --k4: #e0bb3a;
  --k5: #8ccbf0; --k6: #b3b3b3; --k7: #c98a4b; --k8: #ff8fb0; } }
body { margin: 0 auto; padding: 32px 24px 64px; max-width: 980px; background: var(--page);
  color: var(--ink); font: 15px/1.5 system-ui, 'Segoe UI', 'Liberation Sans', sans-serif; }
h1 { font-size: 26px; font-weight: 650; margin: 0 0 10px; }
h2 { font-size: 18px; font-weight: 650; margin: 40px 0 2px; }
p { margin: 0 0 12px; color: var(--soft); max-width: 46em; }
dl { display: flex; flex-wrap: wrap; gap: 4px 26px; margin: 0; }
dl div { display: flex; gap: 7px; } dt { color: var(--soft); } dd { margin: 0; }
.legend { display: flex; flex-wrap: wrap; gap: 4px 20px; margin-top: 14px; }
.legend span::before { content: ''; display: inline-block; width: 12px; height: 12px;
  border-radius: 2px; margin-right: 7px; vertical-align: -1px; background: var(--tone); }
.figure { overflow-x: auto; } svg { display: block; max-width: 100%; height: auto; }
svg text { font-size: 12px; fill: var(--ink); }
svg .title { font-size: 14px; font-weight: 650; } svg .note, svg .tick { fill: var(--soft); }
svg .tick { font-size: 11px; } svg .value, svg .tick { font-variant-numeric: tabular-nums; }
svg .grid { stroke: var(--grid); } svg .axis { stroke: var(--axis); }
svg .t-fast { fill: var(--fast); } svg .t-guarded { fill: var(--guarded); }
svg .t-exact { fill: var(--exact); } svg .t-peer { fill: var(--peer); }
svg .mark { stroke: var(--ink); stroke-dasharray: 4 3; }
svg .dashed { stroke-dasharray: 6 4; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 2px 14px 2px 0; border-bottom: 1px solid var(--grid); }
svg .curve { fill: none; stroke-width: 2; stroke-linejoin: round; }
svg .front { fill: none; stroke: var(--ink); stroke-width: 1.6; stroke-linejoin: round; }
svg .cross { stroke: var(--peer); stroke-width: 1.6; }
svg .name { paint-order: stroke; stroke: var(--page); stroke-width: 3px; stroke-linejoin: round; }
";

/// Writes the page. `legend` holds class and name of each colour.
pub fn write(heading: &Heading, legend: &[(&str, &str)], sections: &[Section]) -> String {
    write_with((&curve_colours(), legend), heading, sections)
}

/// Writes a page without legend, with a style of its own beside the common one.
pub fn page_with(heading: &Heading, style: &str, sections: &[Section]) -> String {
    write_with((style, &[]), heading, sections)
}

/// Writes a page with curves, without legend and with a style of its own.
pub fn page_with_curves(heading: &Heading, style: &str, sections: &[Section]) -> String {
    write_with((&(curve_colours() + style), &[]), heading, sections)
}

fn write_with(
    (style, legend): (&str, &[(&str, &str)]),
    heading: &Heading,
    sections: &[Section],
) -> String {
    let title = escaped(&heading.title);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<dl>\n"
    );
    for (what, value) in &heading.facts {
        let _ = writeln!(
            html,
            "<div><dt>{what}</dt><dd>{}</dd></div>",
            escaped(value)
        );
    }
    html.push_str("</dl>\n");
    if !legend.is_empty() {
        html.push_str("<div class=\"legend\">\n");
        for (class, name) in legend {
            let tone = class.trim_start_matches("t-");
            let _ = writeln!(
                html,
                "<span style=\"--tone: var(--{tone})\">{}</span>",
                escaped(name)
            );
        }
        html.push_str("</div>\n");
    }
    for section in sections {
        let (heading, note) = (escaped(&section.heading), escaped(&section.note));
        let _ = write!(
            html,
            "<h2>{heading}</h2>\n<p>{note}</p>\n<div class=\"figure\">\n{}</div>\n",
            section.figure
        );
    }
    html.push_str("</body>\n</html>\n");
    html
}

/// Writes the colours of the curves' strokes, dots and labels.
fn curve_colours() -> String {
    (0..COLOURS)
        .map(|i| {
            format!(
                "svg .s{i} {{ stroke: var(--k{i}); }} \
                 svg .d{i} {{ fill: var(--k{i}); }} svg text.e{i} {{ fill: var(--k{i}); }}\n"
            )
        })
        .collect()
}
