//! Horizontal bars in groups, on one linear scale from 0.

use super::Tone;
use super::svg::{Anchor, Svg, linear_step, text_width};

pub struct Group {
    /// Identifier of the group; not shown.
    pub key: String,
    /// Empty for a single group.
    pub title: String,
    pub note: String,
    pub bars: Vec<Bar>,
}

pub struct Bar {
    pub label: String,
    pub value: f64,
    /// The value as written at the bar's end.
    pub text: String,
    pub hint: String,
    pub tone: Tone,
}

const WIDTH: f64 = 960.0;
const BAR: f64 = 15.0;
const STEP: f64 = 20.0;
const TITLE: f64 = 28.0;
const BETWEEN: f64 = 14.0;
/// Space for the value behind the longest bar.
const RIGHT: f64 = 60.0;
const AXIS: f64 = 26.0;

/// Draws the groups. `mark` is a reference value, drawn as a line.
pub fn draw(groups: &[Group], unit: &str, mark: Option<f64>) -> String {
    let bars = || groups.iter().flat_map(|group| &group.bars);
    let left = bars()
        .map(|bar| text_width(&bar.label))
        .fold(80.0, f64::max)
        + 14.0;
    let least = mark.map_or(0.0, |mark| mark * 1.05);
    let max = bars().map(|bar| bar.value).fold(least, f64::max);
    let max = if max > 0.0 && max.is_finite() {
        max
    } else {
        1.0
    };
    let scale = (WIDTH - left - RIGHT) / max;

    let height = |group: &Group| {
        let title = if group.title.is_empty() { 0.0 } else { TITLE };
        title + group.bars.len() as f64 * STEP + BETWEEN
    };
    let body: f64 = groups.iter().map(height).sum();
    let mut svg = Svg::new(WIDTH, body + AXIS);

    let step = linear_step(max);
    for k in 0..=(max / step).floor() as u32 {
        let value = f64::from(k) * step;
        let x = left + value * scale;
        svg.line([x, 0.0], [x, body], if k == 0 { "axis" } else { "grid" });
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        svg.text([x, body + 16.0], Anchor::Middle, "tick", &text);
    }
    svg.text([WIDTH, body + 16.0], Anchor::End, "tick", unit);

    if let Some(mark) = mark {
        let x = left + mark * scale;
        svg.line([x, 0.0], [x, body], "mark");
    }

    let mut y = 0.0;
    for group in groups {
        if !group.title.is_empty() {
            svg.text([0.0, y + 19.0], Anchor::Start, "title", &group.title);
            svg.text([left + 8.0, y + 19.0], Anchor::Start, "note", &group.note);
            y += TITLE;
        }
        for bar in &group.bars {
            let middle = y + STEP * 0.5;
            let end = left + bar.value * scale;
            svg.text([left - 8.0, middle + 4.0], Anchor::End, "label", &bar.label);
            let corner = [left, middle - BAR * 0.5];
            svg.bar(corner, [end - left, BAR], bar.tone.class(), &bar.hint);
            svg.text([end + 6.0, middle + 4.0], Anchor::Start, "value", &bar.text);
            y += STEP;
        }
        y += BETWEEN;
    }
    svg.finish()
}
