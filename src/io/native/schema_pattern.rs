//! Patterns of materials as types.

use super::schema::{Color, Scale, Triple};
use super::schema_texture::Wrap;
use super::source_spans::At;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};
use std::borrow::Cow;

/// A colour, or a pattern of colours.
#[derive(Debug)]
pub enum ColorOrPattern {
    Color(Color),
    Pattern(Box<Pattern>),
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
                f.write_str("a list of 3 numbers or a pattern, such as { checker = { … } }")
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
                let pattern = Pattern::deserialize(MapAccessDeserializer::new(map))?;
                Ok(ColorOrPattern::Pattern(Box::new(pattern)))
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
        let pattern = generator.subschema_for::<Pattern>();
        schemars::json_schema!({ "anyOf": [plain, pattern] })
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
