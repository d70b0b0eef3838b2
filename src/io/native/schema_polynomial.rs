//! Polynomial surfaces in the native format.

use super::schema::{Cuboid, Sphere, Triple};
use super::source_spans::At;
use schemars::JsonSchema;
use serde::de::{Deserializer, Visitor};
use serde::{Deserialize, de};

/// About the y axis, at the origin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Torus {
    /// From the middle to that of the tube; greater than 0.
    pub major: At<f64>,
    /// Of the tube; greater than 0.
    pub minor: At<f64>,
}

/// The solid (x/a)^p + (y/b)^q + (z/c)^r ≤ 1.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Superquadric {
    /// a, b and c, each greater than 0.
    pub radii: At<Triple>,
    /// p, q and r: even whole numbers from 2 to 24.
    pub exponents: At<Triple>,
}

/// Of the polynomial's terms, first by falling powers of x, then of y, then of z.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Coefficients {
    /// 20 of a cubic, 35 of a quartic; the last is the constant.
    #[schemars(length(min = 20, max = 35))]
    pub coefficients: At<Vec<f64>>,
}

/// A sphere or a box; exactly one of the two.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clip {
    pub sphere: Option<Sphere>,
    #[serde(rename = "box")]
    pub cuboid: Option<Cuboid>,
}

/// A constant: a number, or an expression without x, y and z, such as "sqrt(2)/2".
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum Parameter {
    Number(f64),
    Expression(String),
}

impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Parameter, D::Error> {
        struct NumberOrText;
        impl Visitor<'_> for NumberOrText {
            type Value = Parameter;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or a constant expression in quotes, such as \"sqrt(2)/2\"")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Parameter, E> {
                Ok(Parameter::Number(value as f64))
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Parameter, E> {
                Ok(Parameter::Number(value))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Parameter, E> {
                Ok(Parameter::Expression(text.into()))
            }
        }
        deserializer.deserialize_any(NumberOrText)
    }
}
