//! Writes the subset of SVG that charts need, as text.
//!
//! Styling is left to the page's style sheet: shapes carry classes. Text and titles are
//! escaped here, so callers pass them unescaped.

use std::fmt::Write;

pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

/// The position of a text relative to its point.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    pub fn new(width: f64, height: f64) -> Svg {
        Svg {
            width,
            height,
            body: String::new(),
        }
    }

    /// Adds a bar. `hint` is its tooltip.
    pub fn bar(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], class: &str, hint: &str) {
        let _ = writeln!(
            self.body,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"2\" \
             class=\"{class}\"><title>{}</title></rect>",
            escaped(hint)
        );
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
        let _ = writeln!(
            self.body,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" class=\"{class}\"/>"
        );
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], class: &str) {
        let mut list = String::new();
        for [x, y] in points {
            let _ = write!(list, "{x:.1},{y:.1} ");
        }
        let list = list.trim_end();
        let _ = writeln!(self.body, "<polyline points=\"{list}\" class=\"{class}\"/>");
    }

    pub fn dot(&mut self, [x, y]: [f64; 2], class: &str, hint: &str) {
        let _ = writeln!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" class=\"{class}\"><title>{}</title></circle>",
            escaped(hint)
        );
    }

    /// Adds a circle that is not filled, and does not hide the hint of what is below.
    pub fn ring(&mut self, [x, y]: [f64; 2], radius: f64, class: &str) {
        let _ = writeln!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" class=\"{class}\" pointer-events=\"none\"/>"
        );
    }

    pub fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, class: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" class=\"{class}\">{}</text>",
            escaped(text)
        );
    }

    pub fn finish(self) -> String {
        let Svg {
            width,
            height,
            body,
        } = self;
        format!(
            "<svg viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" role=\"img\" \
             xmlns=\"http://www.w3.org/2000/svg\">\n{body}</svg>\n"
        )
    }
}

pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// Estimates the width of a text in a chart, slightly too large so that none is cut.
pub fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * 7.1
}

/// Returns a step for an axis from 0 to `max`: 1, 2 or 5 times a power of ten, which
/// gives four to ten steps.
pub fn linear_step(max: f64) -> f64 {
    let rough = max / 8.0;
    if !(rough > 0.0 && rough.is_finite()) {
        return 1.0;
    }
    let power = 10.0_f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|k| k * power);
    let fits = steps.into_iter().find(|step| *step >= rough);
    fits.unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for max in [0.03, 0.9, 1.0, 3.7, 44.0, 1234.0] {
            let step = linear_step(max);
            let count = max / step;
            assert!((3.0..=10.0).contains(&count), "{max}: {step}");
        }
        assert_eq!(linear_step(40.0), 5.0);
        assert_eq!(linear_step(0.0), 1.0);
        assert_eq!(linear_step(f64::NAN), 1.0);
    }

    #[test]
    fn text_cannot_break_out() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text([0.0, 0.0], Anchor::Start, "label", "</text><script>\"&");
        let drawn = svg.finish();
        assert!(!drawn.contains("<script"), "{drawn}");
        assert!(drawn.contains("&lt;/text&gt;&lt;script&gt;&quot;&amp;"));
    }
}
