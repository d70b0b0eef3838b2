//! Patterns of materials to the scene's.

use super::lower::{Result, exactly_one};
use super::schema;
use super::schema_pattern::{self, ColorOrPattern, NumberOrPattern};
use super::schema_texture;
use super::tree::Source;
use crate::scene::{Pattern, PatternId, Rgb, SceneBuilder, Wrap};

/// What a pattern is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    Colors,
    Numbers,
}

/// A pattern of the file, and its place.
type Row<'a> = (usize, &'a schema_pattern::Pattern);

/// Adds the patterns of a material: that of its base colour, and that of its roughness.
pub(super) fn patterns(
    source: &Source,
    row: &schema::Material,
    scene: &mut SceneBuilder,
) -> Result<[Option<PatternId>; 2]> {
    let color = row.base_color.as_ref().and_then(|row| match &row.value {
        ColorOrPattern::Pattern(pattern) => Some((row.at, &**pattern)),
        ColorOrPattern::Color(_) | ColorOrPattern::Texture(_) => None,
    });
    let roughness = row.roughness.as_ref().and_then(|row| match &row.value {
        NumberOrPattern::Pattern(pattern) => Some((row.at, &**pattern)),
        NumberOrPattern::Number(_) => None,
    });
    let mut add = |row: Option<Row>, holds| {
        let made = row.map(|row| pattern(source, row, holds)).transpose()?;
        Ok(made.map(|pattern| scene.pattern(pattern)))
    };
    Ok([add(color, Holds::Colors)?, add(roughness, Holds::Numbers)?])
}

/// Returns the mean of a pattern, by which what knows no patterns shows a material.
pub(super) fn mean(source: &Source, row: Row, holds: Holds) -> Result<Rgb> {
    // Sizes that the scene's check refuses may have none.
    let mean = pattern(source, row, holds)?.mean();
    Ok(mean.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 }))
}

/// Says whether a part of a base colour is above 1, for which 1 is taken.
pub(super) fn is_above_one(row: &schema::Material) -> bool {
    let above = |color: &[f32; 3]| color.iter().any(|c| *c > 1.0);
    match row.base_color.as_ref().map(|color| &color.value) {
        None | Some(ColorOrPattern::Texture(_)) => false,
        Some(ColorOrPattern::Color(color)) => above(color),
        Some(ColorOrPattern::Pattern(row)) => {
            let lists = [
                row.checker.as_ref().map(|row| &row.value.colors),
                row.gradient.as_ref().map(|row| &row.value.colors),
                row.noise.as_ref().map(|row| &row.value.colors),
                row.brick.as_ref().map(|row| &row.value.colors),
            ];
            let lists = lists.into_iter().flatten().flatten();
            lists.flatten().any(above)
        }
    }
}

/// The size of a brick with its joint, three long and as high as is usual in walls, if absent.
const BRICK: [f64; 3] = [1.0, 0.4, 0.5];

/// The thickness of mortar by a brick's least size, if absent.
const JOINT: f64 = 0.05;

/// The octaves of noise, if absent.
const OCTAVES: u32 = 4;

/// Returns the ramp of a pattern, from whichever of its two lists it holds.
fn ramp(
    (source, at, kind): (&Source, usize, &str),
    holds: Holds,
    (colors, values): (&Option<Vec<[f32; 3]>>, &Option<Vec<f32>>),
) -> Result<Vec<Rgb>> {
    let (key, other, found, has_other): (_, _, Option<Vec<Rgb>>, _) = match holds {
        Holds::Colors => ("colors", "values", colors.clone(), values.is_some()),
        Holds::Numbers => {
            let numbers = values.as_ref();
            let found = numbers.map(|values| values.iter().map(|x| [*x; 3]).collect());
            ("values", "colors", found, colors.is_some())
        }
    };
    let refuse = |why: &str| Err(source.error(at, format!("the {kind} {why}")));
    if has_other {
        return refuse(&format!("has {other}; here it takes {key} alone"));
    }
    let Some(found) = found.filter(|found| found.len() >= 2) else {
        return refuse(&format!("needs {key}, two or more"));
    };
    let all = || found.iter().flatten();
    if let Some(wrong) = all().find(|c| **c < 0.0 || holds == Holds::Numbers && **c > 1.0) {
        return refuse(&format!("has {wrong} in its {key}, which go from 0 to 1"));
    }
    // No surface reflects more than it gets.
    Ok(found.iter().map(|c| c.map(|c| c.min(1.0))).collect())
}

fn pattern(source: &Source, (place, row): Row, holds: Holds) -> Result<Pattern> {
    let given = [
        ("checker", row.checker.as_ref().map(|row| row.at)),
        ("gradient", row.gradient.as_ref().map(|row| row.at)),
        ("noise", row.noise.as_ref().map(|row| row.at)),
        ("brick", row.brick.as_ref().map(|row| row.at)),
    ];
    let at = given.iter().find_map(|(_, at)| *at).unwrap_or(place);
    let names = given.map(|(name, at)| (name, at.is_some()));
    let kind = exactly_one(source, at, "the pattern", &names)?;
    let ramp = |colors, values| ramp((source, at, kind), holds, (colors, values));
    let pair = |colors, values| {
        let all: Vec<Rgb> = ramp(colors, values)?;
        let count = all.len();
        <[Rgb; 2]>::try_from(all).map_err(|_| {
            let message = format!("the {kind} is of two, and {count} are given");
            source.error(at, message)
        })
    };
    if let Some(row) = &row.checker {
        let row = &row.value;
        return Ok(Pattern::Checker {
            colors: pair(&row.colors, &row.values)?,
            size: row.size.map_or([1.0; 3], |size| size.0),
        });
    }
    if let Some(row) = &row.gradient {
        let row = &row.value;
        return Ok(Pattern::Gradient {
            colors: ramp(&row.colors, &row.values)?,
            from: row.from.unwrap_or_default(),
            to: row.to,
            wrap: match row.wrap {
                None | Some(schema_texture::Wrap::Clamp) => Wrap::Clamp,
                Some(schema_texture::Wrap::Repeat) => Wrap::Repeat,
                Some(schema_texture::Wrap::Mirror) => Wrap::Mirror,
            },
        });
    }
    if let Some(row) = &row.noise {
        let row = &row.value;
        return Ok(Pattern::Noise {
            colors: ramp(&row.colors, &row.values)?,
            size: row.size.map_or([1.0; 3], |size| size.0),
            octaves: row.octaves.unwrap_or(OCTAVES),
            seed: row.seed.unwrap_or(0),
        });
    }
    let brick = row.brick.as_ref().map(|row| &row.value);
    let size = brick.and_then(|row| row.size).unwrap_or(BRICK);
    let least = size.into_iter().fold(f64::INFINITY, f64::min);
    let (colors, values) = brick.map_or((&None, &None), |row| (&row.colors, &row.values));
    Ok(Pattern::Brick {
        colors: pair(colors, values)?,
        size,
        joint: brick.and_then(|row| row.joint).unwrap_or(least * JOINT),
    })
}
