//! The page of `tradeoff`: time against error, a table whose rows are commands, and any two pictures
//! under a slider. It needs no other file and no network.

use super::curves::{COLOURS, Chart, Line, Stroke, draw};
use super::embed::data;
use super::page::{Heading, Section, page_with_curves};
use super::svg::escaped;
use crate::tradeoff::{Point, shown};
use lanecast_io::{Picture, SaveError};
use std::fmt::Write;
use std::path::Path;

const STYLE: &str = "
body { max-width: 1120px; } h1 { overflow-wrap: anywhere; }
.pair { position: relative; line-height: 0; max-width: 960px; }
.pair img { width: 100%; height: auto; image-rendering: pixelated; }
.pair img + img { position: absolute; inset: 0; clip-path: inset(0 0 0 var(--cut, 50%)); }
.pair.difference { filter: brightness(var(--gain, 8)); isolation: isolate; }
.pair.difference img + img { clip-path: none; mix-blend-mode: difference; }
.cut { width: 100%; max-width: 960px; margin: 10px 0; display: block; }
select, button { font: inherit; color: inherit; background: var(--page); border: 1px solid var(--axis);
  border-radius: 4px; padding: 1px 8px; max-width: 46%; }
tr[data-way] { cursor: pointer; } tr.front code::after { content: '  \\2605'; }
button.copy { font-size: 11px; min-width: 54px; cursor: pointer; }
td.number { text-align: right; } td { white-space: nowrap; } .figure { overflow-x: auto; }
.figure > svg { min-width: 640px; }
";

/// The script: which pictures are shown, where the border is, and what a button copies.
const SCRIPT: &str = "<script>
const pair = document.querySelector('.pair'), [left, right] = pair.querySelectorAll('img');
const [first, second] = document.querySelectorAll('select');
// Where a page may not write to the clipboard by itself, what is selected is copied.
const copy = async text => {
  try { await navigator.clipboard.writeText(text); }
  catch {
    const shown = document.body.appendChild(document.createElement('textarea'));
    shown.value = text; shown.select(); document.execCommand('copy'); shown.remove(); } };
const show = () => { left.src = pictures[first.value]; right.src = pictures[second.value]; };
first.onchange = second.onchange = show;
document.querySelector('.cut').oninput = e => pair.style.setProperty('--cut', e.target.value + '%');
document.querySelector('.gain').oninput = e => {
  pair.classList.toggle('difference', e.target.value > 0);
  pair.style.setProperty('--gain', 2 ** e.target.value); };
for (const button of document.querySelectorAll('button.copy')) button.onclick = () =>
  copy(button.dataset.command).then(() => {
    button.textContent = 'copied'; setTimeout(() => button.textContent = 'copy', 1200); });
for (const row of document.querySelectorAll('tr[data-way]')) row.onclick = () => {
  first.value = row.dataset.way; show(); };
show();
</script>
";

/// Writes the page of a scene: its points with their pictures, and the converged picture. `command`
/// is the command line of the scene's own way, to which a point's options are added. Fails if a picture
/// cannot be encoded.
pub fn tradeoff_page(
    (scene, command): (&str, &str),
    facts: Vec<(&'static str, String)>,
    (points, pictures, truth): (&[Point], &[Picture], &Picture),
    path: &Path,
) -> Result<String, SaveError> {
    let plot = draw(&Chart {
        x_label: "seconds",
        y_label: "RMSE against the converged picture",
        lines: lines(points),
        y_covers: None,
    });
    let sections = [
        Section {
            heading: "Time against error".into(),
            note:
                "Left is faster, below is nearer to the converged picture. Each dot is a way to render \
                   the scene, in the colour of what it varies, and tells its options where it is \
                   pointed at. The line is the front: no other way is as fast and as near as those \
                   with rings. Both axes are logarithmic."
                    .into(),
            figure: plot,
        },
        Section {
            heading: "Pictures".into(),
            note: "The first picture is left of the border, the second right of it; the second \
                   slider shows their difference, brighter the farther it is."
                .into(),
            figure: viewer(points, pictures, truth, path)?,
        },
        Section {
            heading: "Ways".into(),
            note: "Wrong pixels are those whose camera ray meets something else than exact \
                   arithmetic says; of the others the largest errors of t, relative, and of the \
                   normal are told. No other way beats those with a star. A click on a row shows its picture \
                   on the left; copy takes its whole command line."
                .into(),
            figure: table(command, points),
        },
    ];
    let heading = Heading {
        title: format!("Speed against accuracy: {scene}"),
        facts,
    };
    let page = page_with_curves(&heading, STYLE, &sections);
    // The script stands behind the figures that it moves.
    Ok(page.replacen("</body>", &format!("{SCRIPT}</body>"), 1))
}

/// Dots for each choice, and the front.
fn lines(points: &[Point]) -> Vec<Line> {
    let mut choices: Vec<&'static str> = Vec::new();
    for point in points {
        if !choices.contains(&point.choice) {
            choices.push(point.choice);
        }
    }
    let place = |point: &Point| [point.seconds, point.rmse];
    let mut lines: Vec<Line> = choices
        .iter()
        .enumerate()
        .map(|(row, choice)| {
            let of = || points.iter().filter(|point| point.choice == *choice);
            Line {
                label: (*choice).to_owned(),
                // The scene's own way has the colour of text, which is the last.
                hue: (row + COLOURS - 1) % COLOURS,
                stroke: Stroke::Dots,
                points: of().map(place).collect(),
                names: of().map(|point| name(point).to_owned()).collect(),
            }
        })
        .collect();
    let mut best: Vec<&Point> = points.iter().filter(|point| point.pareto).collect();
    best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let front = Line {
        label: "the front".into(),
        hue: 0,
        stroke: Stroke::Front,
        points: best.iter().map(|point| place(point)).collect(),
        names: best.iter().map(|point| name(point).to_owned()).collect(),
    };
    let wrong = points
        .iter()
        .filter(|point| point.wrong_pixels.is_some_and(|n| n > 0));
    let wrong = Line {
        label: "wrong pixels".into(),
        hue: 0,
        stroke: Stroke::Crosses,
        points: wrong.map(place).collect(),
        names: Vec::new(),
    };
    // Below the dots, which keep their colours and hints.
    lines.insert(0, front);
    lines.push(wrong);
    lines
}

fn name(point: &Point) -> &str {
    match &point.options[..] {
        "" => "the scene's own way",
        options => options,
    }
}

fn viewer(
    points: &[Point],
    pictures: &[Picture],
    truth: &Picture,
    path: &Path,
) -> Result<String, SaveError> {
    let mut html = String::from("<script>const pictures = [\n");
    for picture in pictures.iter().chain([truth]) {
        let _ = writeln!(html, "\"{}\",", data(picture, path)?);
    }
    html.push_str("];</script>\n<p>");
    // At first the fastest of the front beside the converged picture.
    let fastest = points.iter().enumerate().filter(|(_, point)| point.pareto);
    let fastest = fastest.min_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    for (side, chosen) in [
        ("Left", fastest.map_or(0, |(row, _)| row)),
        ("Right", points.len()),
    ] {
        let _ = write!(html, "<select aria-label=\"{side}\">");
        let names = points.iter().map(name).chain(["the converged picture"]);
        for (row, name) in names.enumerate() {
            let selected = if row == chosen { " selected" } else { "" };
            let name = escaped(name);
            let _ = write!(html, "<option value=\"{row}\"{selected}>{name}</option>");
        }
        html.push_str("</select> ");
    }
    html.push_str(
        "</p>\n<div class=\"pair\"><img alt=\"Left\"><img alt=\"Right\"></div>\n\
         <input class=\"cut\" type=\"range\" min=\"0\" max=\"100\" step=\"0.1\" value=\"50\" \
         aria-label=\"Border\">\n<label>Difference <input class=\"gain\" type=\"range\" min=\"0\" \
         max=\"6\" step=\"0.1\" value=\"0\"></label>\n",
    );
    Ok(html)
}

fn table(command: &str, points: &[Point]) -> String {
    let mut html = String::from(
        "<table><tr><th>options<th>varies<th>seconds<th>spread<th>build<th>wrong pixels<th>t error\
         <th>normal, °<th>RMSE<th>relMSE<th>FLIP</tr>\n",
    );
    let mut rows: Vec<(usize, &Point)> = points.iter().enumerate().collect();
    rows.sort_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    for (row, point) in rows {
        let class = if point.pareto { " class=\"front\"" } else { "" };
        let wrong = point.wrong_pixels.map_or("?".into(), |n| n.to_string());
        let (t, normal) = (shown(point.t_error), shown(point.normal_error));
        let whole = escaped(format!("{command} {}", point.options).trim_end());
        let number = |text: String| format!("<td class=\"number\">{text}");
        let numbers = [
            format!("{:.4}", point.seconds),
            format!("{:.4}", point.spread),
            format!("{:.4}", point.build_seconds),
            wrong,
            t,
            normal,
            format!("{:.5}", point.rmse),
            format!("{:.5}", point.relmse),
            format!("{:.5}", point.flip),
        ];
        let _ = writeln!(
            html,
            "<tr data-way=\"{row}\"{class}><td><button class=\"copy\" data-command=\"{whole}\" \
             title=\"{whole}\">copy</button> <code>{}</code><td>{}{}</tr>",
            escaped(name(point)),
            point.choice,
            numbers.map(number).concat()
        );
    }
    html + "</table>\n"
}
