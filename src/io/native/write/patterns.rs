//! Patterns of materials.

use super::looks::color;
use super::text::{Table, Value, numbers, one, short};
use crate::scene::{MaterialId, Pattern, Textures, Wrap};

/// Puts a material's patterns in place of its base colour and its roughness.
pub(super) fn put(textures: &Textures, id: MaterialId, table: &mut Table) {
    let Some(row) = textures.of(id) else {
        return;
    };
    for (key, pattern, is_color) in [
        ("base_color", row.texturing.base_color, true),
        ("roughness", row.texturing.roughness, false),
    ] {
        let found = table.iter_mut().find(|(name, _)| name == key);
        if let (Some(pattern), Some((_, value))) = (pattern, found) {
            *value = written(textures.pattern(pattern), is_color);
        }
    }
}

fn written(pattern: &Pattern, is_color: bool) -> Value {
    let colors = pattern.colors().iter();
    let ramp = match is_color {
        true => ("colors", Value::List(colors.map(|c| color(*c)).collect())),
        false => (
            "values",
            Value::List(colors.map(|c| Value::Number(short(c[0]))).collect()),
        ),
    };
    let mut table: Table = vec![(ramp.0.into(), ramp.1)];
    let mut put = |key: &str, value: Value| table.push((key.into(), value));
    match pattern {
        Pattern::Checker { size, .. } => put("size", numbers(*size)),
        Pattern::Gradient { from, to, wrap, .. } => {
            put("from", numbers(*from));
            put("to", numbers(*to));
            let wrap = match wrap {
                Wrap::Clamp => "clamp",
                Wrap::Repeat => "repeat",
                Wrap::Mirror => "mirror",
            };
            put("wrap", Value::Text(wrap.into()));
        }
        Pattern::Noise {
            size,
            octaves,
            seed,
            ..
        } => {
            put("size", numbers(*size));
            put("octaves", Value::Whole((*octaves).into()));
            put("seed", Value::Whole((*seed).into()));
        }
        Pattern::Brick { size, joint, .. } => {
            put("size", numbers(*size));
            put("joint", Value::Number(*joint));
        }
    }
    one(pattern.kind_name(), Value::Table(table))
}
