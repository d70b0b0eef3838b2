//! A page that shows two pictures under a slider, and where they differ: one file, which needs no
//! other.

use super::{Comparison, shown};
use crate::plot::{Heading, Section, data, page_with};
use lanecast_io::{ChannelPicture, Picture, SaveError};
use std::fmt::Write;
use std::path::Path;

/// The style of the two pictures that lie over each other, and of the slider below them.
const STYLE: &str = "
.pair { position: relative; line-height: 0; } .pair img, .map { width: 100%; height: auto;
  image-rendering: pixelated; } .pair img + img { position: absolute; inset: 0;
  clip-path: inset(0 0 0 var(--cut, 50%)); }
.cut { width: 100%; margin: 10px 0 0; } .names { display: flex; justify-content: space-between; }
";

/// The script moves the border between the two pictures.
const SCRIPT: &str =
    "oninput=\"this.previousElementSibling.style.setProperty('--cut', this.value + '%')\"";

/// Writes the page of a comparison of two files of these names. Fails if a picture cannot be
/// encoded.
pub fn page(
    (a, b): (&ChannelPicture, &ChannelPicture),
    names: [&str; 2],
    comparison: &Comparison,
    path: &Path,
) -> Result<String, SaveError> {
    let mut sections = Vec::new();
    if comparison.flip.is_some() {
        let [left, right] = [embedded(a, path)?, embedded(b, path)?];
        let [one, other] = names.map(crate::plot::escaped);
        sections.push(Section {
            heading: "Both".into(),
            note: "The first picture is left of the border, the second right of it.".into(),
            figure: format!(
                "<div class=\"pair\"><img alt=\"{one}\" src=\"{left}\"><img alt=\"{other}\" \
                 src=\"{right}\"></div><input class=\"cut\" type=\"range\" min=\"0\" max=\"100\" \
                 step=\"0.1\" value=\"50\" aria-label=\"Border\" {SCRIPT}>\n\
                 <div class=\"names\"><span>{one}</span><span>{other}</span></div>\n"
            ),
        });
        let map = comparison.flip_map.iter().map(|x| heat(f64::from(*x)));
        sections.push(Section {
            heading: "FLIP".into(),
            note: "What is seen by flipping between the two: black for nothing, yellow-white for \
                   the most."
                .into(),
            figure: image(&picture(a, map.collect()), "FLIP", path)?,
        });
    }
    let map = comparison.wrong_map.iter().map(|wrong| match wrong {
        true => [1.0; 3],
        false => [0.0; 3],
    });
    sections.push(Section {
        heading: "Wrong pixels".into(),
        note: "White where a channel differs by more than the tolerance, or an id at all.".into(),
        figure: image(&picture(a, map.collect()), "Wrong pixels", path)?,
    });
    sections.push(Section {
        heading: "Channels".into(),
        note: "Relative errors are relative to the second picture.".into(),
        figure: table(comparison),
    });
    let heading = Heading {
        title: format!("{} against {}", names[0], names[1]),
        facts: facts(comparison),
    };
    Ok(page_with(&heading, STYLE, &sections))
}

fn facts(comparison: &Comparison) -> Vec<(&'static str, String)> {
    let error = &comparison.error;
    let mut facts = vec![
        (
            "wrong pixels",
            format!("{} of {}", comparison.wrong, comparison.pixels),
        ),
        ("largest", format!("{:.6}", error.max)),
        ("mean", format!("{:.6}", error.mean)),
        ("RMSE", format!("{:.6}", error.rmse)),
        ("relMSE", format!("{:.6}", error.relmse)),
    ];
    if let Some(flip) = comparison.flip {
        facts.push(("FLIP", format!("{flip:.6}")));
    }
    facts
}

fn table(comparison: &Comparison) -> String {
    let mut table = String::from(
        "<table><tr><th>channel<th>differ<th>not finite<th>largest<th>mean<th>bias<th>RMSE\
         <th>relMSE</tr>\n",
    );
    for row in &comparison.channels {
        let name = crate::plot::escaped(&row.name);
        let _ = write!(
            table,
            "<tr><td>{name}<td>{}<td>{}",
            row.differ, row.not_finite
        );
        if let Some(e) = &row.error {
            for x in [e.max, e.mean, e.bias, e.rmse, e.relmse] {
                let _ = write!(table, "<td>{x:.3e}");
            }
        }
        table.push_str("</tr>\n");
    }
    table + "</table>\n"
}

/// Embeds a file's colour as it is shown.
fn embedded(channels: &ChannelPicture, path: &Path) -> Result<String, SaveError> {
    let pixels = shown(channels);
    let color = pixels.iter().map(|rgb| rgb.map(|x| x as f32)).collect();
    data(&picture(channels, color), path)
}

fn picture(like: &ChannelPicture, color: Vec<[f32; 3]>) -> Picture {
    Picture {
        width: like.width,
        height: like.height,
        color,
        ..Picture::default()
    }
}

fn image(picture: &Picture, name: &str, path: &Path) -> Result<String, SaveError> {
    let data = data(picture, path)?;
    Ok(format!(
        "<img class=\"map\" alt=\"{name}\" src=\"{data}\">\n"
    ))
}

/// Colours of a difference from 0 to 1, whose lightness grows evenly, as linear Rec. 709.
const HEAT: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [0.03, 0.01, 0.1],
    [0.2, 0.02, 0.2],
    [0.75, 0.08, 0.1],
    [0.99, 0.4, 0.1],
    [0.98, 0.98, 0.5],
];

fn heat(x: f64) -> [f32; 3] {
    let at = x.clamp(0.0, 1.0) * (HEAT.len() - 1) as f64;
    let below = (at as usize).min(HEAT.len() - 2);
    let part = at - below as f64;
    std::array::from_fn(|k| (HEAT[below][k] + (HEAT[below + 1][k] - HEAT[below][k]) * part) as f32)
}
