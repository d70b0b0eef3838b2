//! Patterns of materials as types.

use super::schema::{Color, Scale, Triple};
use super::schema_texture::{Filter, Texture, Wrap};
use super::source_spans::At;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};
use std::borrow::Cow;

/// A colour, a pattern of colours, or an image.
#[derive(Debug)]
pub enum ColorOrPattern {
    Color(Color),
    Pattern(Box<Pattern>),
    Texture(Box<Texture>),
}

/// A number, or a pattern of numbers.
#[derive(Debug)]
pub enum NumberOrPattern {
    Number(f32),
    Pattern(Box<Pattern>),
}

/// Colours or numbers by the place in the shape's own space; exactly one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pattern {
    /// Cells of two colours by turns.
    pub checker: Option<At<Checker>>,
    /// A ramp of colours from one point to another.
    pub gradient: Option<At<Gradient>>,
    /// A ramp of colours over gradient noise.
    pub noise: Option<At<Noise>>,
    /// Courses of bricks along x that rise with y.
    pub brick: Option<At<Brick>>,
}

/// A pattern of colours, or an image by `texture`; exactly one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColorTable {
    /// Cells of two colours by turns.
    pub checker: Option<At<Checker>>,
    /// A ramp of colours from one point to another.
    pub gradient: Option<At<Gradient>>,
    /// A ramp of colours over gradient noise.
    pub noise: Option<At<Noise>>,
    /// Courses of bricks along x that rise with y.
    pub brick: Option<At<Brick>>,
    /// A picture (.png, .jpg, .webp; .ktx2 by a feature), relative to this file.
    pub texture: Option<At<String>>,
    /// Of an image: the mesh's set of texture coordinates: 0, the only one that is kept; 0 if absent.
    pub uv: Option<At<u32>>,
    /// Of an image: what is beyond its edges; `repeat` if absent.
    pub wrap: Option<Wrap>,
    /// Of an image: `linear` if absent.
    pub filter: Option<Filter>,
    /// Of an image: factors of the texture coordinates; 1 if absent.
    pub scale: Option<[f64; 2]>,
    /// Of an image: degrees that the coordinates are turned after that; 0 if absent.
    pub rotation: Option<f64>,
    /// Of an image: what is added after that; 0 if absent.
    pub offset: Option<[f64; 2]>,
}

impl ColorTable {
    /// Tells the two apart; fails if the table is of both.
    fn either<E: de::Error>(self) -> Result<ColorOrPattern, E> {
        let pattern = Pattern {
            checker: self.checker,
            gradient: self.gradient,
            noise: self.noise,
            brick: self.brick,
        };
        let Some(file) = self.texture else {
            let of_images = [
                ("uv", self.uv.is_some()),
                ("wrap", self.wrap.is_some()),
                ("filter", self.filter.is_some()),
                ("scale", self.scale.is_some()),
                ("rotation", self.rotation.is_some()),
                ("offset", self.offset.is_some()),
            ];
            return match of_images.iter().find(|(_, is)| *is) {
                Some((key, _)) => Err(de::Error::custom(format!(
                    "{key} is of an image; name it by texture = \"FILE\", or leave {key} out"
                ))),
                None => Ok(ColorOrPattern::Pattern(Box::new(pattern))),
            };
        };
        if pattern.is_any() {
            let message = "the colour is of an image and of a pattern at once; give exactly one";
            return Err(de::Error::custom(message));
        }
        Ok(ColorOrPattern::Texture(Box::new(Texture {
            file,
            uv: self.uv,
            wrap: self.wrap,
            filter: self.filter,
            scale: self.scale,
            rotation: self.rotation,
            offset: self.offset,
        })))
    }
}

impl Pattern {
    fn is_any(&self) -> bool {
        self.checker.is_some()
            || self.gradient.is_some()
            || self.noise.is_some()
            || self.brick.is_some()
    }
}

/// Cells of two colours by turns, the first in the cell from the origin upward.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checker {
    /// Two, of a colour.
    pub colors: Option<Vec<Color>>,
    /// Two, of a number.
    pub values: Option<Vec<f32>>,
    /// Of a cell, one number or one for each axis; 1 if absent.
    pub size: Option<Scale>,
}

/// A ramp of evenly spaced colours from one point to another.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gradient {
    /// Two or more, of a colour.
    pub colors: Option<Vec<Color>>,
    /// Two or more, of a number.
    pub values: Option<Vec<f32>>,
    /// Where the first colour is; the origin if absent.
    pub from: Option<Triple>,
    /// Where the last colour is.
    pub to: Triple,
    /// What is beyond; `clamp` if absent.
    pub wrap: Option<Wrap>,
}

/// A ramp of evenly spaced colours over gradient noise.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Two or more, of a colour.
    pub colors: Option<Vec<Color>>,
    /// Two or more, of a number.
    pub values: Option<Vec<f32>>,
    /// Of a cell of the first octave, one number or one for each axis; 1 if absent.
    pub size: Option<Scale>,
    /// How many octaves, each of half the size and height of the one before; 4 if absent.
    pub octaves: Option<u32>,
    /// Another number makes another noise; 0 if absent.
    pub seed: Option<u32>,
}

/// Courses of bricks along x that rise with y, every other shifted by half a brick.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Brick {
    /// That of bricks and that of mortar.
    pub colors: Option<Vec<Color>>,
    /// That of bricks and that of mortar, of a number.
    pub values: Option<Vec<f32>>,
    /// Of a brick with its joint; [1, 0.4, 0.5] if absent.
    pub size: Option<Triple>,
    /// How thick the mortar is; a twentieth of the least size if absent.
    pub joint: Option<f64>,
}

impl<'de> Deserialize<'de> for ColorOrPattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<ColorOrPattern, D::Error> {
        struct ThreeOrTable;
        impl<'de> Visitor<'de> for ThreeOrTable {
            type Value = ColorOrPattern;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(
                    "a list of 3 numbers, a pattern such as { checker = { … } }, or an image such as \
                     { texture = \"wood.png\" }",
                )
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<ColorOrPattern, A::Error> {
                let mut color = [0.0; 3];
                for (i, part) in color.iter_mut().enumerate() {
                    let next = seq.next_element()?;
                    *part = next.ok_or_else(|| de::Error::invalid_length(i, &self))?;
                }
                match seq.next_element::<IgnoredAny>()? {
                    None => Ok(ColorOrPattern::Color(color)),
                    Some(_) => Err(de::Error::custom("expected 3 values, found more")),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ColorOrPattern, A::Error> {
                ColorTable::deserialize(MapAccessDeserializer::new(map))?.either()
            }
        }
        deserializer.deserialize_any(ThreeOrTable)
    }
}

impl<'de> Deserialize<'de> for NumberOrPattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<NumberOrPattern, D::Error> {
        struct OneOrTable;
        impl<'de> Visitor<'de> for OneOrTable {
            type Value = NumberOrPattern;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or a pattern, such as { noise = { … } }")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<NumberOrPattern, E> {
                Ok(NumberOrPattern::Number(value as f32))
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<NumberOrPattern, E> {
                Ok(NumberOrPattern::Number(value as f32))
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<NumberOrPattern, E> {
                Ok(NumberOrPattern::Number(value as f32))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NumberOrPattern, A::Error> {
                let pattern = Pattern::deserialize(MapAccessDeserializer::new(map))?;
                Ok(NumberOrPattern::Pattern(Box::new(pattern)))
            }
        }
        deserializer.deserialize_any(OneOrTable)
    }
}

impl JsonSchema for ColorOrPattern {
    fn schema_name() -> Cow<'static, str> {
        "ColorOrPattern".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let plain = <Color>::json_schema(generator);
        let table = generator.subschema_for::<ColorTable>();
        schemars::json_schema!({ "anyOf": [plain, table] })
    }
}

impl JsonSchema for NumberOrPattern {
    fn schema_name() -> Cow<'static, str> {
        "NumberOrPattern".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let plain = f32::json_schema(generator);
        let pattern = generator.subschema_for::<Pattern>();
        schemars::json_schema!({ "anyOf": [plain, pattern] })
    }
}
