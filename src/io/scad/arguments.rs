//! The arguments of a node by name, or by the place that they have in OpenSCAD.

use super::syntax::{Node, Value};
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// The arguments of a node; `places` are the names of those that may stand without one.
pub(super) struct Arguments<'a> {
    node: &'a Node<'a>,
    places: &'static [&'static str],
}

impl<'a> Arguments<'a> {
    pub fn of(node: &'a Node<'a>, places: &'static [&'static str]) -> Arguments<'a> {
        Arguments { node, places }
    }

    /// Returns an argument; one that is `undef` counts as absent.
    pub fn get(&self, name: &str) -> Option<&'a Value> {
        let arguments = &self.node.arguments;
        let named = arguments.iter().rev().find(|a| a.name == name);
        let by_place = || {
            let place = self.places.iter().position(|place| *place == name)?;
            let mut unnamed = arguments.iter().filter(|a| a.name.is_empty());
            unnamed.nth(place)
        };
        let found = named.or_else(by_place).map(|a| &a.value);
        found.filter(|value| **value != Value::Undefined)
    }

    /// Returns a number; `None` if it is absent or no number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name).and_then(number)
    }

    pub fn number_or(&self, name: &str, default: f64) -> f64 {
        self.number(name).unwrap_or(default)
    }

    pub fn is_true(&self, name: &str) -> bool {
        match self.get(name) {
            Some(Value::Bool(is)) => *is,
            Some(Value::Number(x)) => *x != 0.0,
            _ => false,
        }
    }

    /// Returns a list of as many numbers, or one number for all.
    pub fn numbers<const N: usize>(&self, name: &str, default: f64) -> [f64; N] {
        match self.get(name) {
            Some(Value::Number(x)) => [*x; N],
            Some(Value::List(list)) => {
                std::array::from_fn(|i| list.get(i).and_then(number).unwrap_or(default))
            }
            _ => [default; N],
        }
    }

    /// Returns a matrix of three or four rows; what is missing is that of the identity.
    pub fn matrix(&self, name: &str) -> Option<DAffine3> {
        let Some(Value::List(rows)) = self.get(name) else {
            return None;
        };
        let entry = |row: usize, column: usize| {
            let default = f64::from(u8::from(row == column));
            match rows.get(row) {
                Some(Value::List(row)) => row.get(column).and_then(number).unwrap_or(default),
                _ => default,
            }
        };
        let column = |j: usize| DVec3::new(entry(0, j), entry(1, j), entry(2, j));
        Some(DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        })
    }
}

pub(super) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(x) => Some(*x),
        _ => None,
    }
}

/// Reads a list of points; what is none of `N` numbers is refused by its place.
pub(super) fn points<const N: usize>(value: Option<&Value>) -> Result<Vec<[f64; N]>, String> {
    let Some(Value::List(list)) = value else {
        return Ok(Vec::new());
    };
    let point = |(i, value): (usize, &Value)| {
        let wrong = || format!("point {i} (from 0) is no list of {N} finite numbers");
        let Value::List(numbers) = value else {
            return Err(wrong());
        };
        let numbers: Vec<f64> = numbers.iter().filter_map(number).collect();
        let point: [f64; N] = numbers[..].try_into().map_err(|_| wrong())?;
        match point.iter().all(|x| x.is_finite()) {
            true => Ok(point),
            false => Err(wrong()),
        }
    };
    list.iter().enumerate().map(point).collect()
}

/// Reads lists of rows of `count` points.
pub(super) fn faces(value: Option<&Value>, count: usize) -> Result<Vec<Vec<u32>>, String> {
    let Some(Value::List(list)) = value else {
        return Ok(Vec::new());
    };
    let face = |(i, value): (usize, &Value)| {
        let Value::List(rows) = value else {
            return Err(format!("face {i} (from 0) is no list of points"));
        };
        let row = |value: &Value| {
            let row = number(value).filter(|x| *x >= 0.0 && *x < count as f64);
            row.map(|x| x as u32)
                .ok_or_else(|| format!("face {i} (from 0) names a point that is not there"))
        };
        rows.iter().map(row).collect()
    };
    list.iter().enumerate().map(face).collect()
}

/// Reads lists of rows, or one list of them.
pub(super) fn faces_or_one(value: Option<&Value>, count: usize) -> Result<Vec<Vec<u32>>, String> {
    match value {
        Some(Value::List(list)) if list.first().and_then(number).is_some() => {
            faces(Some(&Value::List(vec![Value::List(list.clone())])), count)
        }
        _ => faces(value, count),
    }
}

pub(super) fn to_plane(points: Vec<[f64; 2]>) -> Vec<DVec2> {
    points.into_iter().map(DVec2::from_array).collect()
}
