//! Placements, their transforms, motions and copies as types of the native format.

use super::schema::{Named, Triple};
use super::source_spans::At;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, de};
use std::borrow::Cow;

/// One placement of a shape, a node or a scene file; exactly one of the three.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Child {
    /// The name of a shape.
    pub shape: Option<At<String>>,
    /// The name of a node.
    pub node: Option<At<String>>,
    /// A scene file of any format that is read, relative to this one: all that its instances
    /// show, with its lights and cameras.
    pub scene: Option<At<String>>,
    /// Of an instance: its own name, which mattes and data sets tell; copies have their number behind it.
    pub name: Option<At<String>>,
    /// Of a scene file: the names of its materials, and of those that take their place.
    pub materials: Option<At<Named<At<String>>>>,
    /// The name of a material; it holds for everything below that has none
    /// nearer. If nothing has one: a light grey.
    pub material: Option<At<String>>,
    /// Applied first to last; nothing if absent.
    pub transform: Option<Vec<At<Step>>>,
    /// Copies of the placement: one after the other, each moved once more.
    pub repeat: Option<At<Repeat>>,
    /// Where it is at later times of a sequence of frames, at least one key;
    /// `transform` is where it is at time 0.
    pub motion: Option<At<Vec<At<Key>>>>,
    /// How it moves between keys; `linear` if absent.
    pub interpolation: Option<At<Interpolation>>,
}

/// Copies of a placement. Copy k, from 0, goes through the placement's own `transform`, and then k
/// times through that of the repeat.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Repeat {
    /// A whole number of copies, 1 or more; the first is where it would be without a repeat.
    #[schemars(with = "u32", range(min = 1))]
    pub count: At<f64>,
    /// From one copy to the next; applied first to last.
    pub transform: Vec<At<Step>>,
}

/// How a placement moves between keys.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Every element of the matrix goes straight; what turns shrinks on the way.
    Linear,
    /// What turns turns evenly, the shorter way, and keeps its size; translation and scale go
    /// straight.
    Rigid,
}

/// Where a placement is at a time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Above 0 and the key before, at most 1.
    pub at: At<f64>,
    /// In place of the placement's own; applied first to last.
    pub transform: Vec<At<Step>>,
}

/// One step of a transform; exactly one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    pub translate: Option<Triple>,
    /// Degrees, counter-clockwise seen from +x.
    pub rotate_x: Option<f64>,
    /// Degrees, counter-clockwise seen from +y.
    pub rotate_y: Option<f64>,
    /// Degrees, counter-clockwise seen from +z.
    pub rotate_z: Option<f64>,
    pub rotate: Option<Turn>,
    /// One number for all axes, or one each; none may be 0.
    pub scale: Option<Scale>,
    /// Three rows of four numbers; the fourth column translates.
    pub matrix: Option<[[f64; 4]; 3]>,
}

/// A rotation about an axis through the origin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Of any length but 0.
    pub axis: At<Triple>,
    /// Counter-clockwise seen from where the axis points.
    pub degrees: f64,
}

/// A factor for each axis.
#[derive(Clone, Copy, Debug)]
pub struct Scale(pub Triple);

impl<'de> Deserialize<'de> for Scale {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Scale, D::Error> {
        struct OneOrThree;
        impl<'de> Visitor<'de> for OneOrThree {
            type Value = Scale;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or a list of 3 numbers")
            }

            fn visit_i64<E: de::Error>(self, factor: i64) -> Result<Scale, E> {
                Ok(Scale([factor as f64; 3]))
            }

            fn visit_f64<E: de::Error>(self, factor: f64) -> Result<Scale, E> {
                Ok(Scale([factor; 3]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Scale, A::Error> {
                let mut scale = [0.0; 3];
                for (i, factor) in scale.iter_mut().enumerate() {
                    let next = seq.next_element()?;
                    *factor = next.ok_or_else(|| de::Error::invalid_length(i, &self))?;
                }
                match seq.next_element::<IgnoredAny>()? {
                    None => Ok(Scale(scale)),
                    Some(_) => Err(de::Error::custom("expected 3 values, found more")),
                }
            }
        }
        deserializer.deserialize_any(OneOrThree)
    }
}

impl JsonSchema for Scale {
    fn schema_name() -> Cow<'static, str> {
        "Scale".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (one, three) = (
            f64::json_schema(generator),
            <[f64; 3]>::json_schema(generator),
        );
        schemars::json_schema!({ "anyOf": [one, three] })
    }
}
