//! Comparison of two pictures, channel by channel.
//!
//! The second picture is the reference: relative errors are relative to it. NaN equals NaN, and
//! infinity equals infinity of the same sign; where only one of the two numbers is one of these,
//! the pixel is wrong and does not count for means.

mod flip;
mod page;
#[cfg(test)]
mod tests;

pub use flip::flip;
pub use page::page;

use lanecast_io::{Channel, ChannelPicture, Encoding, linear_from_srgb};
use serde::Serialize;
use std::collections::BTreeSet;

/// Darkness below which relMSE counts errors no more for being relative to less (Rousselle, Knaus
/// & Zwicker, "Adaptive Sampling and Reconstruction using Greedy Error Minimization" 2011).
const DARK: f64 = 0.01;

/// The figures of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub width: u32,
    pub height: u32,
    pub pixels: u64,
    /// Pixels of which some channel differs by more than the tolerance, or some id at all.
    pub wrong: u64,
    /// The share of the pixels that are wrong.
    pub wrong_share: f64,
    /// Of the picture's colour, or of all numbers where it has none.
    pub error: Errors,
    /// The mean FLIP of the colour, clamped to what a monitor shows; absent without colour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    pub channels: Vec<Compared>,
    /// FLIP of each pixel.
    #[serde(skip)]
    pub flip_map: Vec<f32>,
    /// Whether each pixel is wrong.
    #[serde(skip)]
    pub wrong_map: Vec<bool>,
}

/// Errors of one or several columns of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// The largest difference.
    pub max: f64,
    /// The mean of A - B.
    pub bias: f64,
    /// The mean of |A - B|.
    pub mean: f64,
    pub rmse: f64,
    /// The mean of (A - B)² / (B² + 0.01).
    pub relmse: f64,
}

/// The comparison of one channel.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    pub name: String,
    /// Rows that differ by more than the tolerance; of ids, that differ.
    pub differ: u64,
    /// Rows where only one of the two is NaN, or infinite.
    pub not_finite: u64,
    /// Absent for ids.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Errors>,
}

/// Sums of errors.
#[derive(Clone, Copy, Default)]
struct Sums {
    max: f64,
    signed: f64,
    absolute: f64,
    squared: f64,
    relative: f64,
    count: u64,
}

impl Sums {
    fn add(&mut self, a: f64, b: f64) {
        let d = a - b;
        self.max = self.max.max(d.abs());
        self.signed += d;
        self.absolute += d.abs();
        self.squared += d * d;
        self.relative += d * d / (b * b + DARK);
        self.count += 1;
    }

    fn plus(self, other: Sums) -> Sums {
        Sums {
            max: self.max.max(other.max),
            signed: self.signed + other.signed,
            absolute: self.absolute + other.absolute,
            squared: self.squared + other.squared,
            relative: self.relative + other.relative,
            count: self.count + other.count,
        }
    }

    fn errors(&self) -> Errors {
        let share = 1.0 / self.count.max(1) as f64;
        Errors {
            max: self.max,
            bias: self.signed * share,
            mean: self.absolute * share,
            rmse: (self.squared * share).sqrt(),
            relmse: self.relative * share,
        }
    }
}

/// Says why two pictures cannot be compared, or lists the channels to compare: all, or those that
/// are `asked` for by name or layer.
pub fn comparable(
    (a, b): (&ChannelPicture, &ChannelPicture),
    asked: Option<&[String]>,
) -> Result<Vec<String>, String> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(format!(
            "they have {}x{} and {}x{} pixels; render both at one --size",
            a.width, a.height, b.width, b.height
        ));
    }
    if a.encoding != b.encoding {
        return Err(
            "one has sRGB codes and the other linear radiance; take two .png, or two .exr".into(),
        );
    }
    let names = |picture: &ChannelPicture| -> BTreeSet<String> {
        let all = picture.channels.keys().cloned();
        match asked {
            None => all.collect(),
            Some(asked) => {
                let is = |name: &String, asked: &String| {
                    name == asked
                        || name
                            .rsplit_once('.')
                            .is_some_and(|(layer, _)| layer == asked)
                };
                all.filter(|name| asked.iter().any(|a| is(name, a)))
                    .collect()
            }
        }
    };
    let (of_a, of_b) = (names(a), names(b));
    let known = |asked: &&String| {
        let layer = format!("{asked}.");
        let all = || of_a.iter().chain(&of_b);
        all().any(|name| name == *asked || name.starts_with(&layer))
    };
    if let Some(unknown) = asked.iter().flat_map(|all| all.iter()).find(|a| !known(a)) {
        return Err(format!(
            "they have no channel or layer {unknown}; known are {}",
            listed(a.channels.keys())
        ));
    }
    if of_a != of_b {
        let sides = [("first", &of_a, &of_b), ("second", &of_b, &of_a)];
        let only = sides.into_iter().filter_map(|(name, of, other)| {
            let mut all = of.difference(other).peekable();
            all.peek()?;
            Some(format!("only the {name} has {}", listed(all)))
        });
        return Err(format!(
            "they have different channels: {}; name those to compare with --channels",
            only.collect::<Vec<_>>().join(", ")
        ));
    }
    if of_a.is_empty() {
        return Err(format!(
            "they have no such channels; known are {}",
            listed(a.channels.keys())
        ));
    }
    for name in &of_a {
        let kind = |picture: &ChannelPicture| matches!(picture.channels[name], Channel::Ids(_));
        if kind(a) != kind(b) {
            return Err(format!(
                "the channel {name} has whole numbers in one of them only; leave it out with \
                 --channels"
            ));
        }
    }
    Ok(of_a.into_iter().collect())
}

/// Lists names of channels, or the first of many.
fn listed<'a>(names: impl Iterator<Item = &'a String>) -> String {
    const MOST: usize = 24;
    let names: Vec<&str> = names.map(String::as_str).collect();
    match names.get(..MOST) {
        Some(first) if names.len() > MOST => {
            format!("{} and {} more", first.join(", "), names.len() - MOST)
        }
        _ => names.join(", "),
    }
}

/// Compares channels of two pictures that [`comparable`] has let pass. A row of numbers is wrong
/// if it differs by more than `tolerance`.
pub fn compare(
    (a, b): (&ChannelPicture, &ChannelPicture),
    channels: &[String],
    tolerance: f64,
) -> Comparison {
    let pixels = a.width as usize * a.height as usize;
    let mut wrong_map = vec![false; pixels];
    let (mut color, mut all) = (Sums::default(), Sums::default());
    let mut compared = Vec::new();
    for name in channels {
        let mut row = Compared {
            name: name.clone(),
            differ: 0,
            not_finite: 0,
            error: None,
        };
        match (&a.channels[name], &b.channels[name]) {
            (Channel::Numbers(a), Channel::Numbers(b)) => {
                let mut sums = Sums::default();
                for (i, (a, b)) in a.iter().zip(b).enumerate() {
                    let (a, b) = (f64::from(*a), f64::from(*b));
                    let finite = a.is_finite() && b.is_finite();
                    let same = a == b || a.is_nan() && b.is_nan();
                    match (finite, same) {
                        (true, _) => sums.add(a, b),
                        (false, true) => {}
                        (false, false) => row.not_finite += 1,
                    }
                    let wrong = if finite {
                        (a - b).abs() > tolerance
                    } else {
                        !same
                    };
                    row.differ += u64::from(wrong);
                    wrong_map[i] |= wrong;
                }
                row.error = Some(sums.errors());
                all = all.plus(sums);
                if COLOR.contains(&name.as_str()) {
                    color = color.plus(sums);
                }
            }
            (Channel::Ids(a), Channel::Ids(b)) => {
                for (i, (a, b)) in a.iter().zip(b).enumerate() {
                    row.differ += u64::from(a != b);
                    wrong_map[i] |= a != b;
                }
            }
            _ => {}
        }
        compared.push(row);
    }
    let has_color = COLOR
        .iter()
        .all(|name| channels.iter().any(|channel| channel == name));
    let flip_map = match has_color {
        true => {
            let [test, reference] = [a, b].map(shown);
            flip(&reference, &test, a.width as usize)
        }
        false => Vec::new(),
    };
    let wrong = wrong_map.iter().filter(|wrong| **wrong).count() as u64;
    Comparison {
        width: a.width,
        height: a.height,
        pixels: pixels as u64,
        wrong,
        wrong_share: wrong as f64 / pixels.max(1) as f64,
        error: if has_color { color } else { all }.errors(),
        flip: has_color
            .then(|| flip_map.iter().map(|x| f64::from(*x)).sum::<f64>() / pixels.max(1) as f64),
        channels: compared,
        flip_map,
        wrong_map,
    }
}

/// The channels of a picture's colour.
const COLOR: [&str; 3] = ["R", "G", "B"];

/// Returns the colour that a monitor shows, linear, from 0 to 1; NaN becomes 0.
fn shown(picture: &ChannelPicture) -> Vec<[f64; 3]> {
    let pixels = picture.width as usize * picture.height as usize;
    let mut rows = vec![[0.0; 3]; pixels];
    for (k, name) in COLOR.iter().enumerate() {
        let Some(Channel::Numbers(column)) = picture.channels.get(*name) else {
            continue;
        };
        for (row, x) in rows.iter_mut().zip(column) {
            let x = f64::from(*x);
            let x = if x > 0.0 { x.min(1.0) } else { 0.0 };
            row[k] = match picture.encoding {
                Encoding::Linear => x,
                Encoding::Srgb => linear_from_srgb(x),
            };
        }
    }
    rows
}
