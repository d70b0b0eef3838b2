//! Outlines that OpenSCAD itself makes: `text`, and `import` of a DXF or SVG file.
//!
//! Which fonts there are, which one stands for one that is missing, where letters stand beside each
//! other, and what a drawing's entities mean is what OpenSCAD says: it is given the node alone, and
//! writes an SVG of the outline. So outlines are the same, and there is no second reader of fonts and
//! drawings.

use super::arguments::Arguments;
use super::curves::{self, FINE_SIDES};
use super::nodes::{Made, Outcome, Reader, brief, is_size};
use super::openscad::{Failure, Source, run};
use super::outlines::Shape;
use super::polygons::{self, Rings};
use super::syntax::Value;
use crate::scene::Operator;
use glam::DVec2;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long OpenSCAD may take for all outlines of a file; one takes it a tenth of a second.
const LIMIT: Duration = Duration::from_secs(60);

/// `$fn` where curves of letters are exact. OpenSCAD gives such a curve an eighth of it and one chord
/// more: with 17 chords, a letter lacks 0.04 % of its area.
const FINE_LETTERS: u32 = 128;

/// The most letters of a text: their outlines have some 100 corners each.
const MOST_LETTERS: usize = 4096;

/// The most bytes of an SVG file; more corners than operators take have less.
const MOST_BYTES: u64 = 1 << 20;

/// Arguments of texts that are texts.
const OF_TEXTS: [&str; 6] = [
    "font",
    "direction",
    "language",
    "script",
    "halign",
    "valign",
];

/// Outlines by the programs that make them, each in pieces, and what time these have taken.
#[derive(Default)]
pub(super) struct Foreign {
    made: HashMap<String, Vec<Rings>>,
    took: Duration,
}

impl Reader<'_> {
    pub(super) fn text(&mut self, row: usize) -> Outcome<Made> {
        let of = self.arguments(row, &["text", "size", "font"]);
        let size = of.number_or("size", 10.0);
        let letters = match of.get("text") {
            Some(Value::Text(text)) if !text.is_empty() && is_size(size) => text,
            _ => return Ok(Made::Nothing),
        };
        if letters.len() > MOST_LETTERS {
            return Err(format!("this text is longer than {MOST_LETTERS} bytes"));
        }
        let sides = curves::sides_if_any(self.curves, &of, size);
        if sides.is_none() {
            let chords = FINE_LETTERS / 8 + 1;
            let what = format!("text(), with {chords} chords to a curve");
            self.report.shown_as(&what);
        }
        let mut program = format!("text(text = {}, size = {size}", quoted(letters));
        write_numbers(&mut program, &of, &["spacing"]);
        write_texts(&mut program, &of, &OF_TEXTS);
        let sides = sides.unwrap_or(FINE_LETTERS);
        let _ = write!(program, ", $fn = {sides});");
        self.foreign_outline(row, &program)
    }

    /// Imports the outline of a file that is there.
    pub(super) fn drawing(&mut self, row: usize, file: &Path) -> Outcome<Made> {
        let of = self.arguments(row, &["file"]);
        let absolute = file.canonicalize().map_err(|why| why.to_string())?;
        let Some(absolute) = absolute.to_str() else {
            return Err("import() of a path that is not UTF-8".into());
        };
        let mut program = format!("import(file = {}", quoted(absolute));
        write_texts(&mut program, &of, &["layer", "id"]);
        write_numbers(&mut program, &of, &["scale", "dpi"]);
        let [x, y]: [f64; 2] = of.numbers("origin", 0.0);
        if x.is_finite() && y.is_finite() {
            let _ = write!(program, ", origin = [{x}, {y}]");
        }
        if of.is_true("center") {
            program.push_str(", center = true");
        }
        // Sides depend on radii, which only OpenSCAD knows.
        match curves::sides_if_any(self.curves, &of, 0.0) {
            Some(_) => write_numbers(&mut program, &of, &["$fn", "$fa", "$fs"]),
            None => {
                let what = format!("import() of a drawing, with {FINE_SIDES} sides to a circle");
                self.report.shown_as(&what);
                let _ = write!(program, ", $fn = {FINE_SIDES}");
            }
        }
        program.push_str(");");
        self.foreign_outline(row, &program)
    }

    /// Makes the outline of a program, which OpenSCAD is given once.
    fn foreign_outline(&mut self, row: usize, program: &str) -> Outcome<Made> {
        if !self.foreign.made.contains_key(program) {
            let pieces = self.pieces(row, program)?;
            self.foreign.made.insert(program.into(), pieces);
        }
        let pieces = self.foreign.made[program].clone();
        let line = self.lines[row];
        let outlines = &mut self.outlines;
        let pieces: Vec<u32> = pieces
            .into_iter()
            .map(|rings| outlines.push(line, Shape::Rings(rings)))
            .collect();
        Ok(match pieces.is_empty() {
            true => Made::Nothing,
            false => Made::Outline(outlines.op(line, Operator::Union, pieces)),
        })
    }

    /// Has OpenSCAD make an outline, whose parts that are apart are pieces.
    fn pieces(&mut self, row: usize, program: &str) -> Outcome<Vec<Rings>> {
        let node = self.node_name(row);
        let start = Instant::now();
        let left = LIMIT.saturating_sub(self.foreign.took);
        let run = run(Source::Text(program), "svg", left, MOST_BYTES);
        self.foreign.took += start.elapsed();
        let run = run.map_err(|failure| match failure {
            Failure::Absent => format!(
                "{node}() of an outline is drawn by the command openscad, which is not on the path; \
                 install it, or have it make a mesh where it is, and draw that: openscad -o part.stl \
                 part.csg"
            ),
            Failure::TooLong(_) => {
                let seconds = LIMIT.as_secs();
                format!("openscad took more than {seconds} seconds for outlines of this file")
            }
            other => other.to_string(),
        })?;
        if run.said.is_empty {
            return Ok(Vec::new());
        }
        if let Some(why) = run.error() {
            return Err(format!("openscad failed at this {node}(): {}", brief(&why)));
        }
        if let Some(first) = &run.said.warning {
            let what = format!("part of {node}() that openscad warns of (first: {first})");
            self.report.add_many(&what, run.said.warnings);
        }
        let nothing = |why| format!("openscad has written no outline of this {node}(): {why}");
        let written = run.written.map_err(|why| nothing(why.to_string()))?;
        if written.len() as u64 == MOST_BYTES {
            return Err(format!(
                "this {node}() has too many corners; ask for fewer by $fn"
            ));
        }
        let rings = rings_of(&written).ok_or_else(|| nothing("its SVG has no path".into()))?;
        polygons::pieces(&rings)
    }
}

fn write_numbers(program: &mut String, of: &Arguments, names: &[&str]) {
    for name in names {
        if let Some(number) = of.number(name).filter(|x| x.is_finite()) {
            let _ = write!(program, ", {name} = {number}");
        }
    }
}

fn write_texts(program: &mut String, of: &Arguments, names: &[&str]) {
    for name in names {
        if let Some(Value::Text(word)) = of.get(name)
            && word.len() <= MOST_LETTERS
        {
            let _ = write!(program, ", {name} = {}", quoted(word));
        }
    }
}

/// Writes a text as OpenSCAD's language has it. Other letters that control something are left out.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            '\r' => quoted.push_str("\\r"),
            c if c.is_control() => {}
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Reads the rings of the paths of an SVG file that OpenSCAD has written: its y goes down.
fn rings_of(svg: &[u8]) -> Option<Rings> {
    let svg = std::str::from_utf8(svg).ok()?;
    let mut rings = Rings::new();
    for path in svg.split("<path").skip(1) {
        let (_, data) = path.split_once(" d=\"")?;
        let (data, _) = data.split_once('"')?;
        let mut ring = Vec::new();
        let mut x = None;
        for word in data.split([' ', ',', '\n', '\r', '\t']) {
            match word {
                "" | "L" => {}
                "M" | "z" | "Z" => {
                    rings.extend((!ring.is_empty()).then(|| std::mem::take(&mut ring)));
                }
                number => {
                    let number: f64 = number.parse().ok().filter(|x: &f64| x.is_finite())?;
                    match x.take() {
                        None => x = Some(number),
                        Some(x) => ring.push(DVec2::new(x, -number)),
                    }
                }
            }
        }
        rings.extend((!ring.is_empty()).then_some(ring));
    }
    (!rings.is_empty()).then_some(rings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_quoted_so_that_they_stay_texts() {
        assert_eq!(quoted("a\"); b\\\n\u{7}é"), "\"a\\\"); b\\\\\\né\"");
    }

    #[test]
    fn paths_are_rings_and_what_is_none_is_nothing() {
        let svg = b"<svg><path d=\"\nM 1,-2 L 3,-4.5\n L 5,6e0\n z\nM 0,0 L 1,0 L 0,-1\n z\n\" \
                    stroke=\"x\"/></svg>";
        let rings = rings_of(svg).unwrap();
        assert_eq!(rings.len(), 2);
        assert_eq!(rings[0][..2], [DVec2::new(1.0, 2.0), DVec2::new(3.0, 4.5)]);
        assert_eq!(rings[0][2], DVec2::new(5.0, -6.0));
        for wrong in [
            "",
            "<path d=\"M 1,x\"/>",
            "<path/>",
            "<path d=\"C 1,2 3,4 5,6\"/>",
        ] {
            assert!(rings_of(wrong.as_bytes()).is_none(), "{wrong}");
        }
    }
}
