//! Source spans: a serde deserialiser from the tree to typed values, whose errors have byte
//! offsets in the text.
//!
//! Types derive `Deserialize` as usual. [`At`] asks for the offset of a value beside the
//! value, by a newtype's name that only this deserialiser knows; the crate `serde_spanned`
//! does the same for TOML, but nothing does for JSON.

use super::tree::{Key, Kind, Value, nearest, quoted};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::{self, DeserializeSeed, Deserializer, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;
use std::borrow::Cow;
use std::fmt::Display;
use std::marker::PhantomData;

/// A value that does not fit its type: the message, and the byte offset once it is known.
#[derive(Debug)]
pub(super) struct DecodeError {
    pub at: Option<usize>,
    pub message: String,
}

impl DecodeError {
    fn new(at: usize, message: impl Into<String>) -> DecodeError {
        DecodeError {
            at: Some(at),
            message: message.into(),
        }
    }

    /// Sets the offset unless a value further inside has set it.
    fn within(self, at: usize) -> DecodeError {
        DecodeError {
            at: self.at.or(Some(at)),
            ..self
        }
    }
}

impl std::error::Error for DecodeError {}

impl Display for DecodeError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl de::Error for DecodeError {
    fn custom<T: Display>(message: T) -> DecodeError {
        DecodeError {
            at: None,
            message: message.to_string(),
        }
    }

    /// Reports the kind of a value, for visitors that take more than one kind.
    fn invalid_type(found: de::Unexpected, expected: &dyn de::Expected) -> DecodeError {
        let found = match found {
            de::Unexpected::Bool(_) => "true or false",
            de::Unexpected::Unsigned(_) | de::Unexpected::Signed(_) | de::Unexpected::Float(_) => {
                "a number"
            }
            de::Unexpected::Str(_) => "text",
            de::Unexpected::Unit => "null",
            de::Unexpected::Seq => "a list",
            de::Unexpected::Map => "a table",
            other => return DecodeError::custom(format!("expected {expected}, found {other}")),
        };
        // Types of numbers have names that are Rust's alone.
        let expected = match &*expected.to_string() {
            "i32" | "u8" | "u32" | "u64" => "a whole number".to_owned(),
            other => other.to_owned(),
        };
        DecodeError::custom(format!("expected {expected}, found {found}"))
    }

    fn invalid_length(found: usize, expected: &dyn de::Expected) -> DecodeError {
        DecodeError::custom(format!("expected {expected}, found {found} values"))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> DecodeError {
        DecodeError::custom(unknown("key", field, known))
    }

    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> DecodeError {
        DecodeError::custom(unknown("value", variant, known))
    }

    fn missing_field(field: &'static str) -> DecodeError {
        DecodeError::custom(format!("the key '{field}' is missing"))
    }
}

/// Words of other programs, and what this format has instead: one of its keys, or a remedy.
const FOREIGN: [(&str, &str); 25] = [
    ("file", "texture"),
    ("image", "texture"),
    ("map", "texture"),
    ("extrude", "prism"),
    ("linear_extrude", "prism"),
    ("extrusion", "prism"),
    ("revolve", "lathe"),
    ("revolution", "lathe"),
    ("rotate_extrude", "lathe"),
    ("sor", "lathe"),
    ("cube", "box"),
    ("cuboid", "box"),
    ("plane", "half_space"),
    ("triangles", "mesh"),
    ("spot", "point"),
    ("sun", "directional"),
    ("distant", "directional"),
    ("color", "base_color"),
    ("colour", "base_color"),
    ("albedo", "base_color"),
    ("diffuse", "base_color"),
    ("emissive", "emission"),
    ("lights", "light"),
    ("cameras", "camera"),
    ("ambient", AMBIENT),
];

const AMBIENT: &str = "there is no ambient light; give materials an 'emission', the scene a \
                       'background', or add a light";

/// Reports an unknown name, with the known one that is meant or most similar, or else all
/// known ones. Of values all known ones are listed, since they are few.
fn unknown(what: &str, name: &str, known: &[&str]) -> String {
    let name_shown = quoted(name);
    let foreign = FOREIGN.iter().find(|(word, _)| *word == name);
    let meant = match foreign {
        Some((_, AMBIENT)) => return format!("unknown {what} {name_shown}; {AMBIENT}"),
        Some((_, ours)) if known.contains(ours) => Some(*ours),
        _ => None,
    };
    let similar = || nearest(name, known.iter().copied()).filter(|_| what != "value");
    match meant.or_else(similar) {
        Some(like) => format!("unknown {what} {name_shown}; did you mean '{like}'?"),
        None => format!(
            "unknown {what} {name_shown}; known are {}",
            known.join(", ")
        ),
    }
}

impl<'de> Value<'de> {
    /// Fails because the value is not what is expected.
    fn wrong<T>(&self, expected: &str) -> Result<T, DecodeError> {
        let hint = match (expected, &self.kind) {
            ("a list", Kind::Table(_)) => {
                "; several tables are [[name]] in TOML, and [{ ... }] as one value"
            }
            _ => "",
        };
        let message = format!("expected {expected}, found {}{hint}", self.kind.describe());
        Err(DecodeError::new(self.at, message))
    }

    /// Returns a finite number; integers beyond 2^53 are rounded.
    fn number(&self) -> Result<f64, DecodeError> {
        match self.kind {
            Kind::Integer(i) => Ok(i as f64),
            Kind::Float(x) if x.is_finite() => Ok(x),
            Kind::Float(x) => Err(DecodeError::new(
                self.at,
                format!("{x} is not a finite number"),
            )),
            _ => self.wrong("a number"),
        }
    }

    /// Gives the items of a list to a visitor.
    fn visit_list<V: Visitor<'de>>(
        at: usize,
        list: Vec<Value<'de>>,
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        visitor
            .visit_seq(Items(list.into_iter()))
            .map_err(|e| e.within(at))
    }

    /// Gives the entries of a table to a visitor; fails if the value is no table.
    fn visit_table<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        let Kind::Table(entries) = self.kind else {
            return self.wrong("a table");
        };
        let entries = Entries {
            rest: entries.into_iter(),
            held: None,
        };
        visitor.visit_map(entries).map_err(|e| e.within(self.at))
    }
}

impl<'de> Deserializer<'de> for Value<'de> {
    type Error = DecodeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        let at = self.at;
        match self.kind {
            Kind::Null => visitor.visit_unit(),
            Kind::Bool(b) => visitor.visit_bool(b),
            Kind::Integer(i) => visitor.visit_i64(i),
            Kind::Float(_) => visitor.visit_f64(self.number()?),
            Kind::Text(Cow::Borrowed(text)) => visitor.visit_borrowed_str(text),
            Kind::Text(Cow::Owned(text)) => visitor.visit_string(text),
            Kind::Date => return self.wrong("a value"),
            Kind::List(list) => Value::visit_list(at, list, visitor),
            Kind::Table(_) => self.visit_table(visitor),
        }
        .map_err(|e: DecodeError| e.within(at))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        visitor.visit_f64(self.number()?)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        let x = self.number()?;
        if !(x as f32).is_finite() {
            let message = format!("{x:e} is too large; at most 3e38 is possible here");
            return Err(DecodeError::new(self.at, message));
        }
        visitor.visit_f64(x)
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::Bool(b) => visitor.visit_bool(b),
            _ => self.wrong("true or false"),
        }
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::Text(_) => self.deserialize_any(visitor),
            _ => self.wrong("text in quotes"),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::List(list) => Value::visit_list(self.at, list, visitor),
            _ => self.wrong("a list"),
        }
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::List(list) if list.len() != len => {
                let message = format!("expected {len} values, found {}", list.len());
                Err(DecodeError::new(self.at, message))
            }
            Kind::List(list) => Value::visit_list(self.at, list, visitor),
            _ => self.wrong(&format!("a list of {len} values")),
        }
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        self.visit_table(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        self.visit_table(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        match self.kind {
            Kind::Text(text) => visitor
                .visit_enum(text.into_deserializer())
                .map_err(|e: DecodeError| e.within(self.at)),
            _ => self.wrong("text in quotes"),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        if name == AT {
            return visitor.visit_seq(Placed {
                at: Some(self.at),
                value: Some(self),
            });
        }
        visitor.visit_newtype_struct(self)
    }

    /// Accepts any value without looking into it.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 char bytes byte_buf unit
        unit_struct tuple_struct
    }
}

/// The items of a list that are not read yet.
struct Items<'de>(std::vec::IntoIter<Value<'de>>);

impl<'de> de::SeqAccess<'de> for Items<'de> {
    type Error = DecodeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DecodeError> {
        self.0.next().map(|v| seed.deserialize(v)).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

/// The entries of a table that are not read yet; `held` is the value of the last key.
struct Entries<'de> {
    rest: std::vec::IntoIter<(Key<'de>, Value<'de>)>,
    held: Option<Value<'de>>,
}

impl<'de> de::MapAccess<'de> for Entries<'de> {
    type Error = DecodeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, DecodeError> {
        let Some((key, value)) = self.rest.next() else {
            return Ok(None);
        };
        self.held = Some(value);
        let name = Value {
            at: key.at,
            kind: Kind::Text(key.name),
        };
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(
        &mut self,
        seed: V,
    ) -> Result<V::Value, DecodeError> {
        match self.held.take() {
            Some(value) => {
                let at = value.at;
                seed.deserialize(value).map_err(|e| e.within(at))
            }
            None => Err(de::Error::custom("a value before its key")),
        }
    }
}

/// A value and its byte offset in the file.
#[derive(Clone, Copy, Debug)]
pub struct At<T> {
    /// Byte offset in the text.
    pub at: usize,
    pub value: T,
}

/// The name by which [`At`] asks for the offset.
const AT: &str = "$lanecast::At";

/// The offset and the value, as a sequence of two.
struct Placed<'de> {
    at: Option<usize>,
    value: Option<Value<'de>>,
}

impl<'de> de::SeqAccess<'de> for Placed<'de> {
    type Error = DecodeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DecodeError> {
        if let Some(at) = self.at.take() {
            return seed.deserialize(at.into_deserializer()).map(Some);
        }
        self.value.take().map(|v| seed.deserialize(v)).transpose()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<At<T>, D::Error> {
        struct Both<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Both<T> {
            type Value = At<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a value with its place")
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<At<T>, A::Error> {
                let missing = || de::Error::custom("a value without its place");
                Ok(At {
                    at: seq.next_element()?.ok_or_else(missing)?,
                    value: seq.next_element()?.ok_or_else(missing)?,
                })
            }
        }
        deserializer.deserialize_newtype_struct(AT, Both(PhantomData))
    }
}

/// The schema is that of the value, because the offset is not part of the format.
impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}
