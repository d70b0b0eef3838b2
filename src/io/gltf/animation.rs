//! Animations: the curves by which nodes move and meshes morph.
//!
//! A channel's value at a time is that of its sampler (glTF 2.0, appendix C): the key's before
//! (STEP), a mean of two keys (LINEAR; on the sphere of quaternions for rotations), or a cubic
//! through both (CUBICSPLINE). Before the first key and after the last one it stays. Times are
//! divided by the animation's last, so that a motion goes from 0 to 1.

use super::File;
use super::accessor::{Accept, quadruples, scalars, triples};
use super::container::Placement;
use crate::shared::messages::one_line;
use crate::{Animated, ImportReport, LoadError};
use glam::DQuat;
use gltf::json::Index;
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;

/// An animation as the file writes it.
#[derive(Deserialize)]
pub(super) struct Source {
    #[serde(default)]
    name: Option<String>,
    #[serde(default)]
    channels: Vec<Channel>,
    #[serde(default)]
    samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Deserialize)]
struct Target {
    #[serde(default)]
    node: Option<usize>,
    path: String,
}

#[derive(Deserialize)]
struct Sampler {
    input: u32,
    output: u32,
    #[serde(default)]
    interpolation: Option<String>,
}

/// How a curve goes from key to key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Step,
    Linear,
    Cubic,
}

/// The keys of a property, which has `width` numbers.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub way: Way,
    pub width: usize,
    /// Times from 0 to 1, rising.
    pub at: Vec<f64>,
    /// Per key `width` numbers; of a cubic the tangent into it, the value, and the tangent out.
    values: Vec<f64>,
}

impl Curve {
    /// Returns the values of a key: of a cubic 0 is the tangent into it, 1 the value, 2 the
    /// tangent out of it; else all are the value.
    fn key(&self, row: usize, part: usize) -> &[f64] {
        let row = match self.way {
            Way::Cubic => 3 * row + part,
            _ => row,
        };
        &self.values[row * self.width..][..self.width]
    }

    /// Computes the values at a time.
    pub fn value(&self, time: f64) -> Vec<f64> {
        let after = self.at.partition_point(|at| *at <= time);
        if after == 0 || after == self.at.len() {
            return self.key(after.saturating_sub(1), 1).to_vec();
        }
        let (a, b) = (after - 1, after);
        let (from, to) = (self.key(a, 1), self.key(b, 1));
        let length = self.at[b] - self.at[a];
        let s = (time - self.at[a]) / length;
        match self.way {
            Way::Step => from.to_vec(),
            Way::Linear => {
                let mix = |(a, b): (&f64, &f64)| a * (1.0 - s) + b * s;
                from.iter().zip(to).map(mix).collect()
            }
            Way::Cubic => {
                let (out, into) = (self.key(a, 2), self.key(b, 0));
                let (s2, s3) = (s * s, s * s * s);
                // Hermite's polynomials.
                let weights = [
                    2.0 * s3 - 3.0 * s2 + 1.0,
                    length * (s3 - 2.0 * s2 + s),
                    3.0 * s2 - 2.0 * s3,
                    length * (s3 - s2),
                ];
                let mix = |k: usize| {
                    let values = [from[k], out[k], to[k], into[k]];
                    values.iter().zip(weights).map(|(v, w)| v * w).sum()
                };
                (0..self.width).map(mix).collect()
            }
        }
    }

    /// Computes a rotation at a time; keys are turned into each other the shorter way.
    fn rotation(&self, time: f64) -> [f64; 4] {
        let after = self.at.partition_point(|at| *at <= time);
        if self.way != Way::Linear || after == 0 || after == self.at.len() {
            let value = self.value(time);
            return std::array::from_fn(|k| value[k]);
        }
        let s = (time - self.at[after - 1]) / (self.at[after] - self.at[after - 1]);
        let [a, b] = [after - 1, after].map(|row| DQuat::from_slice(self.key(row, 1)));
        slerp(a, b, s).to_array()
    }
}

/// Turns one rotation evenly into another, the shorter way (Shoemake 1985). Files round
/// quaternions; as in the specification's formula a longer one counts for more on the way.
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let (p, q) = (a.normalize(), b.normalize());
    // The sine by distances, which has its digits where that of the cosine has not.
    let sine = 0.5 * ((p - q).length() * (p + q).length());
    let angle = libm::atan2(sine, p.dot(q));
    let (from, to) = match sine > 1e-12 {
        true => (
            libm::sin((1.0 - s) * angle) / sine,
            libm::sin(s * angle) / sine,
        ),
        false => (1.0 - s, s),
    };
    a * from + b * to
}

/// The curves of one node.
#[derive(Clone, Debug, Default)]
pub(super) struct Curves {
    translation: Option<Curve>,
    rotation: Option<Curve>,
    scale: Option<Curve>,
    pub weights: Option<Curve>,
    /// Per axis the largest scale at a key, by size.
    largest: [f64; 3],
}

/// A scale is kept from 0 by this part of the largest one: what is scaled to nothing for a while
/// is too small to be seen, and no transform is singular.
const LEAST_SCALE: f64 = 1e-6;

impl Curves {
    /// Lists the curves that move the node.
    pub fn of_placement(&self) -> impl Iterator<Item = &Curve> {
        [&self.translation, &self.rotation, &self.scale]
            .into_iter()
            .flatten()
    }

    /// Says whether the node itself moves.
    pub fn moves(&self) -> bool {
        self.of_placement().next().is_some()
    }

    /// Returns the placement at a time; what has no curve is as at rest.
    pub fn placement(&self, rest: &Placement, time: f64) -> Placement {
        let three = |curve: &Curve| {
            let value = curve.value(time);
            [value[0], value[1], value[2]]
        };
        let translation = self.translation.as_ref().map(three).or(rest.translation);
        let rotation = self.rotation.as_ref().map(|curve| curve.rotation(time));
        let scale = self.scale.as_ref().map(|curve| {
            let scale = three(curve);
            std::array::from_fn(|k| {
                let least = LEAST_SCALE * self.largest[k];
                match scale[k].abs() < least {
                    true => least.copysign(scale[k]),
                    false => scale[k],
                }
            })
        });
        Placement {
            matrix: None,
            translation,
            rotation: rotation.or(rest.rotation),
            scale: scale.or(rest.scale),
        }
    }
}

/// The animation that is shown.
pub(super) struct Animation {
    /// The seconds that it takes, above 0.
    pub seconds: f64,
    pub nodes: HashMap<usize, Curves>,
}

/// Reads the animation that is asked for. `None` if the file has none, and none is asked for by
/// name.
pub(super) fn import(
    file: &File,
    sources: &[Source],
    asked: &Animated,
    placements: &[Placement],
    report: &mut ImportReport,
) -> Result<Option<Animation>, LoadError> {
    let Some(number) = pick(file, sources, asked.name.as_deref())? else {
        return Ok(None);
    };
    let source = &sources[number];
    let mut times: HashMap<u32, Vec<f64>> = HashMap::new();
    let mut read = Vec::new();
    for (i, channel) in source.channels.iter().enumerate() {
        let place = format!("animation {number}, channel {i}");
        let wrong = |message: &str| file.invalid(&place, message);
        let Some(node) = channel.target.node else {
            report.add("animation of what is no node");
            continue;
        };
        if node >= placements.len() {
            let all = placements.len();
            return Err(wrong(&format!(
                "refers to node {node}, but there are {all}"
            )));
        }
        let path = &*channel.target.path;
        if !matches!(path, "translation" | "rotation" | "scale" | "weights") {
            report.add(&format!("animation of '{}'", one_line(path)));
            continue;
        }
        if path != "weights" && placements[node].matrix.is_some() {
            report.add("animation of a node with a matrix");
            continue;
        }
        let sampler = source.samplers.get(channel.sampler).ok_or_else(|| {
            let (id, all) = (channel.sampler, source.samplers.len());
            wrong(&format!("refers to sampler {id}, but there are {all}"))
        })?;
        let way = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Way::Linear,
            Some("STEP") => Way::Step,
            Some("CUBICSPLINE") => Way::Cubic,
            Some(_) => {
                return Err(wrong(
                    "its interpolation must be LINEAR, STEP or CUBICSPLINE",
                ));
            }
        };
        let at = match times.get(&sampler.input) {
            Some(at) => at.clone(),
            None => {
                let at = input(file, sampler.input, &place)?;
                times.insert(sampler.input, at.clone());
                at
            }
        };
        let (width, values) = output(file, sampler.output, path, &place)?;
        let keys = at.len() * if way == Way::Cubic { 3 } else { 1 };
        let width = width.unwrap_or(values.len() / keys);
        if width == 0 || values.len() != keys * width {
            let message = format!(
                "has {} values for {} keys; there must be as many, and with CUBICSPLINE three \
                 times as many",
                values.len(),
                at.len()
            );
            return Err(wrong(&message));
        }
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            return Err(wrong(&format!("has the value {bad}, which is not finite")));
        }
        let curve = Curve {
            way,
            width,
            at,
            values,
        };
        read.push((node, path, curve));
    }
    let last = read.iter().filter_map(|(_, _, curve)| curve.at.last());
    let seconds = last.fold(0.0_f64, |most, at| most.max(*at));
    // One key at time 0 is a pose that stays.
    let seconds = if seconds > 0.0 { seconds } else { 1.0 };
    let mut nodes: HashMap<usize, Curves> = HashMap::new();
    for (node, path, mut curve) in read {
        for at in &mut curve.at {
            *at /= seconds;
        }
        if curve.way == Way::Cubic {
            // Tangents are per second.
            let width = curve.width;
            for (i, value) in curve.values.iter_mut().enumerate() {
                if i / width % 3 != 1 {
                    *value *= seconds;
                }
            }
        }
        let of = nodes.entry(node).or_default();
        if path == "scale" {
            for (i, value) in curve.values.iter().enumerate() {
                let largest = &mut of.largest[i % 3];
                *largest = largest.max(value.abs());
            }
        }
        let slot = match path {
            "translation" => &mut of.translation,
            "rotation" => &mut of.rotation,
            "scale" => &mut of.scale,
            _ => &mut of.weights,
        };
        *slot = Some(curve);
    }
    Ok(Some(Animation { seconds, nodes }))
}

/// Returns the number of the animation of a name, or of a number; else the first.
fn pick(file: &File, sources: &[Source], name: Option<&str>) -> Result<Option<usize>, LoadError> {
    let Some(name) = name else {
        return Ok((!sources.is_empty()).then_some(0));
    };
    let has = |source: &Source| source.name.as_deref() == Some(name);
    let number = || name.parse().ok().filter(|n| *n < sources.len());
    if let Some(found) = sources.iter().position(has).or_else(number) {
        return Ok(Some(found));
    }
    let known: Vec<String> = (0..)
        .zip(sources)
        .map(|(i, source): (usize, _)| match &source.name {
            Some(name) => one_line(name),
            None => i.to_string(),
        })
        .collect();
    let known = match known.is_empty() {
        true => "the file has none".into(),
        false => format!("known are {}", known.join(", ")),
    };
    let message = format!("there is no animation '{}'; {known}", one_line(name));
    Err(file.invalid("animations", &message))
}

/// Reads the times of keys, in seconds.
fn input(file: &File, id: u32, place: &str) -> Result<Vec<f64>, LoadError> {
    let place = &format!("{place}, input");
    let at = scalars(file, Index::new(id), &Accept::Float, place)?;
    let rises = at.windows(2).all(|pair| pair[0] < pair[1]);
    if !(at[0] >= 0.0 && rises && at[at.len() - 1].is_finite()) {
        return Err(file.invalid(place, "its times must rise from 0 or later"));
    }
    Ok(at)
}

/// Reads the values of keys, and how many numbers each has; of weights the number of keys tells.
fn output(
    file: &File,
    id: u32,
    path: &str,
    place: &str,
) -> Result<(Option<usize>, Vec<f64>), LoadError> {
    let place = &format!("{place}, output");
    let id = Index::new(id);
    Ok(match path {
        "rotation" => (
            Some(4),
            quadruples(file, id, &Accept::Animated, place)?.concat(),
        ),
        "weights" => (None, scalars(file, id, &Accept::Animated, place)?),
        _ => (
            Some(3),
            triples(file, id, &Accept::Animated, place)?.concat(),
        ),
    })
}

/// Returns the animations of a document; none, and how many there are, if they are malformed.
pub(super) fn sources(json: &[u8]) -> (Vec<Source>, usize) {
    #[derive(Default, Deserialize)]
    #[serde(default)]
    struct Some {
        animations: Vec<Source>,
    }
    #[derive(Default, Deserialize)]
    #[serde(default)]
    struct Any {
        animations: Vec<Value>,
    }
    match serde_json::from_slice::<Some>(json) {
        Ok(all) => (all.animations, 0),
        Err(_) => {
            let any: Any = serde_json::from_slice(json).unwrap_or_default();
            (Vec::new(), any.animations.len())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(way: Way, at: &[f64], values: &[f64]) -> Curve {
        let keys = at.len() * if way == Way::Cubic { 3 } else { 1 };
        Curve {
            way,
            width: values.len() / keys,
            at: at.into(),
            values: values.into(),
        }
    }

    #[test]
    fn curves_are_met_at_keys_and_stay_beyond_them() {
        let at = [0.25, 0.5, 1.0];
        let step = curve(Way::Step, &at, &[1.0, 2.0, 4.0]);
        let linear = curve(Way::Linear, &at, &[1.0, 2.0, 4.0]);
        for (time, stepped, mean) in [
            (0.0, 1.0, 1.0),
            (0.25, 1.0, 1.0),
            (0.375, 1.0, 1.5),
            (0.5_f64.next_down(), 1.0, 2.0),
            (0.5, 2.0, 2.0),
            (0.75, 2.0, 3.0),
            (1.0, 4.0, 4.0),
            (3.0, 4.0, 4.0),
        ] {
            assert_eq!(step.value(time), [stepped], "{time}");
            assert!((linear.value(time)[0] - mean).abs() < 1e-14, "{time}");
        }
        // x(t) = t³ between 1/2 and 1, by its values and slopes.
        let slope = |t: f64| 3.0 * t * t;
        let values = [9.0, 0.125, slope(0.5), slope(1.0), 1.0, 9.0];
        let cubic = curve(Way::Cubic, &[0.5, 1.0], &values);
        for time in [0.5, 0.6, 0.75, 0.9, 1.0] {
            let cube = time * time * time;
            assert!((cubic.value(time)[0] - cube).abs() < 1e-14, "{time}");
        }
    }

    #[test]
    fn rotations_turn_evenly_the_shorter_way() {
        let turn = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
        let (a, b) = (turn(10.0), -turn(130.0));
        let values = [a.to_array(), b.to_array()].concat();
        let curve = curve(Way::Linear, &[0.0, 1.0], &values);
        for s in [0.0, 0.25, 0.5, 0.99] {
            let is = DQuat::from_array(curve.rotation(s));
            let should = turn(10.0 + 120.0 * s);
            assert!((is.dot(should).abs() - 1.0).abs() < 1e-15, "{s}");
        }
        // Nearly the same rotation.
        let near = slerp(turn(10.0), turn(10.0 + 1e-7), 0.5);
        assert!((near.dot(turn(10.0)) - 1.0).abs() < 1e-15);
    }
}
