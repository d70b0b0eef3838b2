//! Reader of polynomial lists: JSON with the coefficients of each polynomial, as numbers or
//! text, constant first, and optionally its known real roots.

use crate::LoadError;
use crate::roots::Polynomial;
use crate::shared::folder::read_file;
use crate::shared::messages::{json_fault, one_line};
use serde::Deserialize;
use std::path::Path;

/// One polynomial of a list.
#[derive(Clone, Debug)]
pub struct Listed {
    pub name: String,
    pub polynomial: Polynomial,
    /// The real roots, if the file gives them.
    pub known: Option<Vec<KnownRoot>>,
}

/// A known root, as the file gives it.
#[derive(Clone, Copy, Debug)]
pub struct KnownRoot {
    /// The f64 nearest to the root.
    pub t: f64,
    pub multiplicity: u32,
    /// Bound on the error of a backward-stable f64 solver, to first order; 0 if the file
    /// gives none.
    pub forward_bound: f64,
}

#[derive(Deserialize)]
struct File {
    polynomials: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    coeffs_f64: Vec<Written>,
    real_roots_f64: Option<Vec<Known>>,
}

#[derive(Deserialize)]
struct Known {
    x: Written,
    mult: u32,
    forward_bound: Option<Written>,
}

/// A number as the file writes it.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Text(String),
    Other(serde_json::Value),
}

impl Written {
    /// Converts to f64; fails if the value is no number, or underflows to 0.
    fn value(&self) -> Result<f64, String> {
        match self {
            Written::Number(x) => Ok(*x),
            Written::Text(text) => {
                let number: f64 = text.trim().parse().map_err(|_| no_number(text))?;
                let mut digits = text.split(['e', 'E']).next().unwrap_or_default().chars();
                if number == 0.0 && digits.any(|c| matches!(c, '1'..='9')) {
                    let text = one_line(text);
                    return Err(format!("'{text}' is not 0, but too small for an f64"));
                }
                Ok(number)
            }
            Written::Other(value) => Err(no_number(&value.to_string())),
        }
    }
}

/// Says that a text is no number.
fn no_number(text: &str) -> String {
    let text = one_line(text);
    format!("'{text}' is no number; write one such as -2.5e-3")
}

/// Reads a list of polynomials. Fails if the file cannot be read, is malformed or has an
/// empty list, and for numbers that are out of range; errors name the polynomial.
pub fn load_polynomials(path: &Path) -> Result<Vec<Listed>, LoadError> {
    let file: File = serde_json::from_slice(&read_file(path)?).map_err(|e| LoadError::Syntax {
        path: path.into(),
        line: e.line().max(1),
        column: e.column().max(1),
        message: format!(
            "{}; expected is {{\"polynomials\": [{{\"name\": …, \"coeffs_f64\": […]}}]}}",
            json_fault(&e)
        ),
    })?;
    if file.polynomials.is_empty() {
        return Err(LoadError::Invalid {
            path: path.into(),
            place: "polynomials".into(),
            message: "the list is empty; give each a name and coeffs_f64".into(),
        });
    }
    let entries = file.polynomials.into_iter();
    entries.map(|entry| listed(path, entry)).collect()
}

/// Checks and converts one entry.
fn listed(path: &Path, entry: Entry) -> Result<Listed, LoadError> {
    let name = one_line(&entry.name);
    let invalid = |message: String| LoadError::Invalid {
        path: path.into(),
        place: format!("polynomial '{name}'"),
        message,
    };
    let numbers = entry.coeffs_f64.iter().map(Written::value);
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(invalid)?;
    let polynomial = Polynomial::new(&numbers).map_err(|e| invalid(e.to_string()))?;
    let known = |root: &Known| {
        let bound = root.forward_bound.as_ref().map(Written::value);
        let known = KnownRoot {
            t: root.x.value()?,
            multiplicity: root.mult,
            forward_bound: bound.transpose()?.unwrap_or(0.0),
        };
        if !known.t.is_finite() {
            return Err(format!("a root is {}; it must be finite", known.t));
        }
        let KnownRoot {
            t,
            multiplicity,
            forward_bound,
        } = known;
        if multiplicity == 0 {
            return Err(format!("the root {t} has mult = 0; it must be 1 or more"));
        }
        if !(0.0..f64::INFINITY).contains(&forward_bound) {
            let message = "it must be finite, and not below 0";
            return Err(format!(
                "the root {t} has forward_bound = {forward_bound}; {message}"
            ));
        }
        Ok(known)
    };
    let known = entry
        .real_roots_f64
        .map(|roots| roots.iter().map(known).collect());
    let known: Option<Result<_, String>> = known;
    let known = known.transpose().map_err(invalid)?;
    Ok(Listed {
        name,
        polynomial,
        known,
    })
}
