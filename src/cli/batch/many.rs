//! Lists of which one row may stand without brackets.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::fmt::{Formatter, Result as FmtResult};
use std::marker::PhantomData;

/// One of something, or a list.
#[derive(Clone, Debug)]
pub struct Many<T>(pub Vec<T>);

impl<T> Default for Many<T> {
    fn default() -> Many<T> {
        Many(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Many<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Many<T>, D::Error> {
        from.deserialize_any(ManyVisitor(PhantomData))
    }
}

struct ManyVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ManyVisitor<T> {
    type Value = Many<T>;

    fn expecting(&self, to: &mut Formatter) -> FmtResult {
        to.write_str("one, or a list")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Many<T>, E> {
        Ok(Many(vec![T::deserialize(StrDeserializer::new(text))?]))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Many<T>, E> {
        Ok(Many(vec![T::deserialize(number.into_deserializer())?]))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Many<T>, E> {
        Ok(Many(vec![T::deserialize(number.into_deserializer())?]))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Many<T>, E> {
        Ok(Many(vec![T::deserialize(number.into_deserializer())?]))
    }

    fn visit_bool<E: Error>(self, is: bool) -> Result<Many<T>, E> {
        Ok(Many(vec![T::deserialize(is.into_deserializer())?]))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Many<T>, A::Error> {
        Ok(Many(vec![T::deserialize(MapAccessDeserializer::new(map))?]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Many<T>, A::Error> {
        let mut all = Vec::new();
        while let Some(one) = list.next_element()? {
            all.push(one);
        }
        match all.is_empty() {
            true => Err(A::Error::custom(
                "the list is empty; put something into it, or leave it out",
            )),
            false => Ok(Many(all)),
        }
    }
}

impl<T: JsonSchema> JsonSchema for Many<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Many_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<T>();
        let list = schemars::json_schema!({ "type": "array", "items": one.clone(), "minItems": 1 });
        schemars::json_schema!({ "anyOf": [one, list] })
    }
}
