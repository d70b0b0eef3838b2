//! Groups of properties: base materials, colours, textures, and mixtures of these.

use super::model::number;
use super::xml::Tag;
use crate::ImportReport;
use crate::scene::{Wrap, linear_from_srgb};
use crate::shared::messages::one_line;
use std::collections::HashMap;

/// Numbers that the rows of a mixture may have.
const MOST_PARTS: usize = 16;

/// A linear colour and its opacity.
pub(super) type Color = [f32; 4];

/// A group of properties, whose rows triangles refer to.
#[derive(Debug)]
pub(super) enum Group {
    /// Materials that do not vary over a triangle, with their names.
    Materials(Vec<(String, Color)>),
    /// Colours, which vary from corner to corner.
    Colors(Vec<Color>),
    /// Places of a texture of this id; v counts upwards.
    Coordinates(u32, Vec<[f32; 2]>),
    /// Rows of several groups at once.
    Several(Vec<u32>, Vec<Vec<u32>>),
}

/// A picture, and how it goes on beyond its edges.
#[derive(Debug)]
pub(super) struct Texture {
    /// The name of its part.
    pub path: String,
    pub wrap: [Wrap; 2],
    pub nearest: bool,
}

#[derive(Default)]
pub(super) struct Properties {
    pub groups: HashMap<u32, Group>,
    pub textures: HashMap<u32, Texture>,
    /// The group that is being read.
    open: Option<(u32, Group)>,
    /// Of a mixture the colours that it mixes.
    mixed: Vec<Color>,
}

impl Properties {
    /// Begins a resource that is no object. Says whether its elements are rows of it.
    pub fn begin(&mut self, tag: &Tag, report: &mut ImportReport) -> Result<bool, String> {
        let name = tag.name();
        let group = match name {
            "basematerials" => Group::Materials(Vec::new()),
            "colorgroup" => Group::Colors(Vec::new()),
            "texture2dgroup" => {
                let [texture] = tag.values(["texid"])?;
                Group::Coordinates(number(texture, name, "texid")?, Vec::new())
            }
            "compositematerials" => {
                let [base, rows] = tag.values(["matid", "matindices"])?;
                let base = number(base, name, "matid")?;
                let rows = whole_numbers(rows.as_deref().unwrap_or_default(), "matindices")?;
                let Some(Group::Materials(all)) = self.groups.get(&base) else {
                    return Err(format!(
                        "{name}: there are no base materials {base} before it"
                    ));
                };
                let mixed = rows.iter().map(|row| {
                    let of = all.get(*row as usize);
                    of.map(|(_, color)| *color)
                        .ok_or_else(|| format!("{name}: base materials {base} have no row {row}"))
                });
                self.mixed = mixed.collect::<Result<_, _>>()?;
                Group::Materials(Vec::new())
            }
            "multiproperties" => {
                let [groups] = tag.values(["pids"])?;
                report.shown_as("multiproperties, by one of their layers");
                let groups = whole_numbers(groups.as_deref().unwrap_or_default(), "pids")?;
                Group::Several(groups, Vec::new())
            }
            "texture2d" => {
                self.texture(tag, report)?;
                return Ok(false);
            }
            "pbspeculardisplayproperties"
            | "pbmetallicdisplayproperties"
            | "pbspeculartexturedisplayproperties"
            | "pbmetallictexturedisplayproperties"
            | "translucentdisplayproperties" => {
                report.add("set of display properties");
                return Ok(false);
            }
            _ => {
                report.add(&format!("resource '{}'", one_line(name)));
                return Ok(false);
            }
        };
        let [id] = tag.values(["id"])?;
        let id = number(id, name, "id")?;
        if id == 0 {
            return Err(format!("the id of a {name} is 0; ids count from 1"));
        }
        self.open = Some((id, group));
        Ok(true)
    }

    fn texture(&mut self, tag: &Tag, report: &mut ImportReport) -> Result<(), String> {
        let [id, path, u, v, filter] =
            tag.values(["id", "path", "tilestyleu", "tilestylev", "filter"])?;
        let mut wrap = |style: Option<&str>| match style.unwrap_or("wrap") {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            "none" => {
                report.shown_as("texture that ends at its edges, by its edges");
                Wrap::Clamp
            }
            _ => Wrap::Repeat,
        };
        let texture = Texture {
            path: path.map(|path| path.into_owned()).unwrap_or_default(),
            wrap: [wrap(u.as_deref()), wrap(v.as_deref())],
            nearest: filter.as_deref() == Some("nearest"),
        };
        let id = number(id, "texture2d", "id")?;
        self.textures.insert(id, texture);
        Ok(())
    }

    /// Reads an element of the open group.
    pub fn row(&mut self, tag: &Tag) -> Result<(), String> {
        let Some((id, group)) = &mut self.open else {
            return Ok(());
        };
        let wrong = |what: String| Err(format!("properties {id}: {what}"));
        match (tag.name(), group) {
            ("base", Group::Materials(rows)) => {
                let [name, color] = tag.values(["name", "displaycolor"])?;
                let Some(color) = color else {
                    return wrong("a base has no displaycolor".into());
                };
                let name = one_line(name.as_deref().unwrap_or_default());
                rows.push((name, self::color(&color)?));
            }
            ("color", Group::Colors(rows)) => {
                let [color] = tag.values(["color"])?;
                let Some(color) = color else {
                    return wrong("a color has no color".into());
                };
                rows.push(self::color(&color)?);
            }
            ("tex2coord", Group::Coordinates(_, rows)) => {
                let mut at = [0.0; 2];
                for (x, word) in at.iter_mut().zip(tag.values(["u", "v"])?) {
                    let word = word.as_deref().unwrap_or_default().trim();
                    let found = word.parse::<f32>().ok().filter(|x| x.is_finite());
                    let Some(found) = found else {
                        return wrong(format!("'{}' is not a finite number", one_line(word)));
                    };
                    *x = found;
                }
                rows.push(at);
            }
            ("composite", Group::Materials(rows)) => {
                let [values] = tag.values(["values"])?;
                let parts = values.as_deref().unwrap_or_default();
                rows.push((String::new(), mixture(parts, &self.mixed)?));
            }
            ("multi", Group::Several(_, rows)) => {
                let [parts] = tag.values(["pindices"])?;
                let parts = parts.as_deref().unwrap_or_default();
                rows.push(whole_numbers(parts, "pindices")?);
            }
            _ => {}
        }
        Ok(())
    }

    /// Ends the open group.
    pub fn end(&mut self) {
        self.groups.extend(self.open.take());
    }
}

/// Parses `#RRGGBB` or `#RRGGBBAA`, encoded by sRGB's curve.
fn color(text: &str) -> Result<Color, String> {
    let wrong = || {
        let text = one_line(text);
        format!("the colour '{text}' is not # and six or eight hexadecimal digits")
    };
    let digits = text.trim().strip_prefix('#').ok_or_else(wrong)?;
    let is_hex = digits.bytes().all(|b| b.is_ascii_hexdigit());
    if !is_hex || !matches!(digits.len(), 6 | 8) {
        return Err(wrong());
    }
    let code = |at: usize| {
        let pair = digits.get(at..at + 2).unwrap_or("ff");
        f64::from(u8::from_str_radix(pair, 16).unwrap_or(u8::MAX)) / 255.0
    };
    let channel = |at| linear_from_srgb(code(at)) as f32;
    Ok([channel(0), channel(2), channel(4), code(6) as f32])
}

/// Mixes colours by their shares.
fn mixture(shares: &str, colors: &[Color]) -> Result<Color, String> {
    let mut sum = [0.0; 4];
    let mut all = 0.0;
    for (word, color) in shares.split_whitespace().zip(colors) {
        let share = word.parse::<f32>().ok();
        let Some(share) = share.filter(|x| x.is_finite() && *x >= 0.0) else {
            return Err(format!(
                "'{}' is not the share of a mixture",
                one_line(word)
            ));
        };
        all += share;
        for (sum, channel) in sum.iter_mut().zip(color) {
            *sum += share * channel;
        }
    }
    match all > 0.0 && all.is_finite() {
        true => Ok(sum.map(|x| (x / all).clamp(0.0, 1.0))),
        false => Err("the shares of a mixture add up to nothing".into()),
    }
}

/// Parses whole numbers between blanks.
fn whole_numbers(text: &str, name: &str) -> Result<Vec<u32>, String> {
    let words = text.split_whitespace();
    let numbers: Vec<u32> = words
        .take(MOST_PARTS + 1)
        .map(|word| {
            let found = word.parse();
            found.map_err(|_| format!("{name}: '{}' is not a whole number", one_line(word)))
        })
        .collect::<Result<_, String>>()?;
    match numbers.len() > MOST_PARTS {
        true => Err(format!("{name} are more than {MOST_PARTS} numbers")),
        false => Ok(numbers),
    }
}
