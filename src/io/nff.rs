//! Importer of NFF, Haines' Neutral File Format, in full: v b l f s c p pp and comments.
//!
//! Every object becomes a shape and a root instance, in the order of the file. NFF does not
//! define the brightness of lights. Here lights do not fade, and each of n lights of colour
//! c has intensity π·c/√n, so that with one light a facing Lambert surface reflects
//! kd·colour·c. `hither` and `resolution` are read and ignored: nothing is clipped, and the
//! user chooses the size of the picture. One-sided surfaces are visible from both sides, as
//! the published counts assume.

use crate::geom::{Cone, Cylinder, Sphere};
use crate::scene::{
    Camera, Edge, Falloff, Layers, Light, Material, MaterialId, Model, Rgb, SceneBuilder, ShapeId,
};
use crate::shared::line_column::line_column;
use crate::shared::text::decode;
use crate::{ImportReport, LoadError, LoadOptions};
use glam::DVec3;
use std::path::Path;

type Result<T> = std::result::Result<T, LoadError>;

/// Reads an NFF file into the builder.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<()> {
    let bytes = options.read(path)?;
    let text = decode(path, &bytes)?;
    let mut words = Words {
        path,
        text: text.as_bytes(),
        at: 0,
    };
    let mut lights = Vec::new();
    let mut material = None;
    while let Some(word) = words.next() {
        let shape = match word.text {
            b"v" => {
                let camera = view(&mut words, &word)?;
                scene.camera("", camera);
                continue;
            }
            b"b" => {
                scene.background(words.color()?);
                continue;
            }
            b"l" => {
                lights.push(light(&mut words)?);
                continue;
            }
            b"f" => {
                material = Some(scene.material("", fill(&mut words)?));
                continue;
            }
            b"s" => sphere(&mut words, scene, report)?,
            b"c" => cone(&mut words, &word, scene, report)?,
            b"p" => polygon(&mut words, scene, Patch::Flat)?,
            b"pp" => polygon(&mut words, scene, Patch::Smooth)?,
            _ => {
                let message = format!(
                    "unknown entity {}; known are v b l f s c p pp and # comments",
                    word.shown()
                );
                return Err(words.error(&word, message));
            }
        };
        scene.instance("", instance(shape, material));
    }
    let share = std::f64::consts::PI / (lights.len() as f64).sqrt();
    for (position, color) in lights {
        scene.light(Light::Point {
            position,
            intensity: color.map(|c| (f64::from(c) * share) as f32),
            falloff: Falloff::None,
            radius: 0.0,
        });
    }
    Ok(())
}

/// An instance of the shape with the current fill, if there is one.
fn instance(shape: ShapeId, material: Option<MaterialId>) -> Edge {
    let edge = Edge::shape(shape);
    match material {
        Some(material) => edge.material(material),
        None => edge,
    }
}

/// Reads a view, whose parts have names and may come in any order. `start` is the `v`, for
/// messages.
fn view(words: &mut Words, start: &Word) -> Result<Camera> {
    let (mut from, mut at, mut up, mut angle) = (None, None, None, None);
    while let Some(word) = words.peek() {
        let keep = words.at;
        words.next();
        match word.text {
            b"from" => from = Some(words.point()?),
            b"at" => at = Some(words.point()?),
            b"up" => {
                let v = words.point()?;
                if v == DVec3::ZERO {
                    return Err(words.error(&word, "up is (0, 0, 0); it must point somewhere"));
                }
                up = Some(v);
            }
            b"angle" => {
                let degrees = words.number()?;
                if !(degrees > 0.0 && degrees < 180.0) {
                    let message =
                        format!("angle is {degrees}; it must be between 0 and 180 degrees");
                    return Err(words.error(&word, message));
                }
                angle = Some(degrees);
            }
            b"hither" => {
                words.number()?;
            }
            b"resolution" => {
                words.number()?;
                words.number()?;
            }
            _ => {
                words.at = keep;
                break;
            }
        }
    }
    let missing = |what: &str| words.error(start, format!("the view has no '{what}'"));
    let from = from.ok_or_else(|| missing("from"))?;
    let at = at.ok_or_else(|| missing("at"))?;
    let up = up.ok_or_else(|| missing("up"))?;
    let angle = angle.ok_or_else(|| missing("angle"))?;
    if from == at {
        let message = "from and at are the same point; the view looks nowhere";
        return Err(words.error(start, message));
    }
    Ok(Camera::perspective(from, at, up, angle))
}

/// Reads a light: its position and colour, which is white if none is given.
fn light(words: &mut Words) -> Result<(DVec3, Rgb)> {
    let position = words.point()?;
    let colored = words.peek().is_some_and(|w| w.number().is_some());
    let color = if colored { words.color()? } else { [1.0; 3] };
    Ok((position, color))
}

/// Reads a fill as a Phong material.
fn fill(words: &mut Words) -> Result<Material> {
    let base_color = words.color()?;
    let kd = words.not_negative("Kd")?;
    let ks = words.not_negative("Ks")?;
    let exponent = words.not_negative("Shine")?;
    let at = words.peek();
    let transmission = words.not_negative("T")?;
    if let (Some(word), true) = (at, transmission > 1.0) {
        let message = format!("T is {transmission}; it must be between 0 and 1");
        return Err(words.error(&word, message));
    }
    let ior = words.not_negative("the index of refraction")?;
    Ok(Material {
        base_color,
        emission: [0.0; 3],
        transmission,
        // Files write an index of 0 for opaque fills.
        ior: if ior > 0.0 { ior } else { 1.0 },
        model: Model::Phong {
            diffuse: base_color.map(|c| kd * c),
            specular: [ks; 3],
            exponent,
            mirror: [ks; 3],
        },
        layers: Layers::default(),
    })
}

/// Reads a sphere.
fn sphere(
    words: &mut Words,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<ShapeId> {
    let center = words.point()?;
    let (radius, word) = words.number_at()?;
    if radius == 0.0 {
        return Err(words.error(&word, "the sphere's radius is 0"));
    }
    one_sided(radius < 0.0, report);
    let radius = radius.abs();
    Ok(scene.sphere("", Sphere { center, radius }))
}

/// Reads a cone frustum, open at both ends; equal radii give a cylinder.
fn cone(
    words: &mut Words,
    start: &Word,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<ShapeId> {
    let (base, base_radius) = (words.point()?, words.number()?);
    let (top, top_radius) = (words.point()?, words.number()?);
    if base == top {
        let message = "the cone's base and apex are the same point; discs are not supported";
        return Err(words.error(start, message));
    }
    if base_radius == 0.0 && top_radius == 0.0 {
        return Err(words.error(start, "both radii of the cone are 0"));
    }
    one_sided(base_radius < 0.0 || top_radius < 0.0, report);
    let (base_radius, top_radius, open) = (base_radius.abs(), top_radius.abs(), true);
    if base_radius == top_radius {
        let cylinder = Cylinder {
            base,
            top,
            radius: base_radius,
            open,
        };
        return Ok(scene.cylinder("", cylinder));
    }
    let cone = Cone {
        base,
        top,
        base_radius,
        top_radius,
        open,
    };
    Ok(scene.cone("", cone))
}

/// Counts a surface that NFF, by a negative radius, makes visible from the inside only.
fn one_sided(is: bool, report: &mut ImportReport) {
    report.add_many("one-sided visibility", usize::from(is));
}

/// The two kinds of polygons, `p` and `pp`.
#[derive(Clone, Copy, PartialEq)]
enum Patch {
    Flat,
    /// Has a normal at every corner.
    Smooth,
}

/// Reads a polygon.
fn polygon(words: &mut Words, scene: &mut SceneBuilder, patch: Patch) -> Result<ShapeId> {
    let count = words.count()?;
    // The vectors grow as points are read: the count in the file is only a claim.
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    for _ in 0..count {
        points.push(words.point()?);
        if patch == Patch::Smooth {
            normals.push(words.point()?);
        }
    }
    Ok(scene.polygon("", &points, &normals))
}

/// Splits a file into words and skips comments. Line breaks only end comments.
struct Words<'a> {
    path: &'a Path,
    text: &'a [u8],
    at: usize,
}

/// A word and its byte offset.
#[derive(Clone, Copy)]
struct Word<'a> {
    at: usize,
    text: &'a [u8],
}

impl<'a> Word<'a> {
    fn number(&self) -> Option<f64> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }

    /// Quotes the word for a message, escaped and shortened.
    fn shown(&self) -> String {
        const SHOWN: usize = 40;
        let part = &self.text[..self.text.len().min(SHOWN)];
        let more = if self.text.len() > SHOWN { "…" } else { "" };
        format!("'{}{more}'", part.escape_ascii())
    }
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<Word<'a>> {
        let mut rest = &self.text[self.at..];
        loop {
            let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
            rest = &rest[start..];
            if rest[0] != b'#' {
                break;
            }
            rest = &rest[rest.iter().position(|b| matches!(b, b'\n' | b'\r'))?..];
        }
        let ends = |b: &u8| b.is_ascii_whitespace() || *b == b'#';
        let len = rest.iter().position(ends).unwrap_or(rest.len());
        let at = self.text.len() - rest.len();
        self.at = at + len;
        let text = &rest[..len];
        Some(Word { at, text })
    }

    fn peek(&mut self) -> Option<Word<'a>> {
        let at = self.at;
        let word = self.next();
        self.at = at;
        word
    }

    /// Makes an error at the line and column of a word.
    fn error(&self, word: &Word, message: impl Into<String>) -> LoadError {
        let (line, column) = line_column(self.text, word.at);
        LoadError::Syntax {
            path: self.path.into(),
            line,
            column,
            message: message.into(),
        }
    }

    /// Returns the next word; fails at the end of the file, with `what` in the message.
    fn expect(&mut self, what: &str) -> Result<Word<'a>> {
        let end = Word {
            at: self.text.len(),
            text: b"",
        };
        self.next()
            .ok_or_else(|| self.error(&end, format!("expected {what}, found the end of the file")))
    }

    /// Reads a finite number, and returns its word for later messages.
    fn number_at(&mut self) -> Result<(f64, Word<'a>)> {
        let word = self.expect("a number")?;
        match word.number() {
            Some(x) if x.is_finite() => Ok((x, word)),
            Some(_) => {
                let message = format!("{} is not a finite number", word.shown());
                Err(self.error(&word, message))
            }
            None => {
                let message = format!("expected a number, found {}", word.shown());
                Err(self.error(&word, message))
            }
        }
    }

    fn number(&mut self) -> Result<f64> {
        Ok(self.number_at()?.0)
    }

    fn point(&mut self) -> Result<DVec3> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    /// Reads a number that is 0 or greater and finite in f32.
    fn not_negative(&mut self, what: &str) -> Result<f32> {
        let (x, word) = self.number_at()?;
        if x >= 0.0 && (x as f32).is_finite() {
            return Ok(x as f32);
        }
        let message = format!("{what} is {}; it must be 0 or greater", word.shown());
        Err(self.error(&word, message))
    }

    fn color(&mut self) -> Result<Rgb> {
        let mut color = [0.0; 3];
        for c in &mut color {
            *c = self.not_negative("the colour")?;
        }
        Ok(color)
    }

    /// Reads the number of corners of a polygon, at least 3.
    fn count(&mut self) -> Result<u64> {
        let word = self.expect("a number of points")?;
        let text = std::str::from_utf8(word.text).unwrap_or_default();
        match text.parse() {
            Ok(n) if n >= 3 => Ok(n),
            _ => {
                let message = format!(
                    "a polygon has a whole number of points, 3 or more; found {}",
                    word.shown()
                );
                Err(self.error(&word, message))
            }
        }
    }
}
