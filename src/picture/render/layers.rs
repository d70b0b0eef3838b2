//! What a path-traced picture keeps of its samples beside their mean: layers of light, the
//! variance, and mattes.

use super::mattes::{MatteNames, Met, MetFilm, MetLists};
use super::paths::TileSums;
use super::{AovSet, Picture};
use crate::io::{Layer, Matte};
use crate::scene::{Rgb, Scene};
use crate::shade::path::{GUIDES, LIGHT_LAYERS};
use std::collections::TryReserveError;

/// The name of the layer of lights without a group.
const UNGROUPED: &str = "ungrouped";

/// Lists the layers of light that a picture keeps, and a denoiser's guides: numbers of the
/// integrator's layers, and names.
fn layers(aovs: &AovSet, scene: &Scene) -> Vec<(usize, String)> {
    let asked = (0..).zip(aovs.light_layers());
    let asked = asked.filter(|(_, is)| *is);
    let mut all: Vec<(usize, String)> = asked
        .map(|(k, _)| (k, LIGHT_LAYERS[k].to_string()))
        .collect();
    let groups = scene.light_groups.names();
    let mut next = LIGHT_LAYERS.len();
    if aovs.light_groups && groups.len() > 0 {
        let names = groups
            .chain([UNGROUPED])
            .map(|name| format!("light_{name}"));
        all.extend((next..).zip(names));
        next += scene.light_groups.names().len() + 1;
    }
    let guides = (next..).zip(GUIDES).zip(aovs.guides());
    all.extend(
        guides
            .filter(|(_, is)| *is)
            .map(|((k, name), _)| (k, name.to_string())),
    );
    all
}

/// What a picture keeps of its paths.
pub struct PathOutputs<'s> {
    /// The integrator's number of each of the picture's layers.
    numbers: Vec<usize>,
    mattes: Option<MatteNames<'s>>,
}

impl<'s> PathOutputs<'s> {
    /// Plans what is asked for, and makes room for it in the picture. Fails if memory does not
    /// suffice.
    pub fn new(
        aovs: &AovSet,
        mattes: Option<MatteNames<'s>>,
        scene: &Scene,
        picture: &mut Picture,
    ) -> Result<PathOutputs<'s>, TryReserveError> {
        let pixels = picture.color.len();
        let mut numbers = Vec::new();
        for (number, name) in layers(aovs, scene) {
            let color = super::film::column(pixels, [0.0; 3])?;
            picture.layers.push(Layer { name, color });
            numbers.push(number);
        }
        for name in mattes.iter().flat_map(MatteNames::layers) {
            let ranks = mattes.as_ref().map_or(0, |mattes| mattes.ranks);
            picture.mattes.push(Matte {
                name,
                ranks,
                rows: super::film::column(pixels * ranks as usize, [0.0; 2])?,
                manifest: Default::default(),
            });
        }
        Ok(PathOutputs { numbers, mattes })
    }

    /// Whether nothing is kept but, perhaps, the variance.
    fn is_empty(&self) -> bool {
        self.numbers.is_empty() && self.mattes.is_none()
    }

    /// Puts what a tile's samples have given into the picture; `place` finds a row's pixel.
    pub fn put(&self, picture: &mut Picture, sums: &TileSums, place: impl Fn(u32) -> usize) {
        let count = sums.all.count();
        for (layer, number) in picture.layers.iter_mut().zip(&self.numbers) {
            for row in 0..sums.all.pixels() {
                let color = mean(sums.layers[*number].of(row), count);
                layer.color[place(row as u32)] = bounded(&layer.name, color);
            }
        }
        if let (Some(column), Some(half)) = (&mut picture.variance, &sums.half) {
            for (row, half) in half.iter().enumerate() {
                let all = (sums.all.of(row), count);
                column[place(row as u32)] = variance(all, (*half, count / 2));
            }
        }
        if let (Some(names), Some(lists)) = (&self.mattes, &sums.met) {
            for row in 0..sums.all.pixels() {
                let of = |kind| lists.of(row, kind);
                names.rank(of, count, &mut picture.mattes, place(row as u32));
            }
        }
    }

    /// Completes the picture by the names of what its mattes show.
    pub fn finish(self, picture: &mut Picture) {
        if let Some(names) = self.mattes {
            names.finish(&mut picture.mattes);
        }
    }
}

/// Returns the mean of samples, finite.
fn mean(sum: [f64; 4], count: u32) -> Rgb {
    let share = 1.0 / f64::from(count.max(1));
    std::array::from_fn(|k| finite(sum[k] * share))
}

/// Returns a layer's mean within its range: guides of a denoiser have one, which a filter with
/// negative lobes would leave.
fn bounded(layer: &str, color: Rgb) -> Rgb {
    let [albedo, normal] = GUIDES;
    match layer {
        _ if layer == albedo => color.map(|c| c.clamp(0.0, 1.0)),
        _ if layer == normal => color.map(|c| c.clamp(-1.0, 1.0)),
        _ => color,
    }
}

/// Returns the variance of the mean of samples, by their sum and that of the first half, with their
/// numbers: (A - B)² a b / (a + b)² of the means A and B of the a samples of the first half and the b
/// of the rest, which is (A - B)²/4 of halves; 0 of a single sample, which tells none. Samples of
/// variance s give (A - B)² the mean s/a + s/b, and the mean of all has s/(a + b).
pub fn variance((all, count): ([f64; 4], u32), (half, halves): ([f64; 4], u32)) -> Rgb {
    let rest = count - halves;
    if rest == 0 || halves == 0 {
        return [0.0; 3];
    }
    let [a, b, n] = [halves, rest, count].map(f64::from);
    let share = a * b / (n * n);
    std::array::from_fn(|k| {
        let apart = half[k] / f64::from(halves) - (all[k] - half[k]) / f64::from(rest);
        finite(apart * apart * share)
    })
}

fn finite(x: f64) -> f32 {
    let x = x as f32;
    match x.is_nan() {
        true => 0.0,
        false => x.clamp(-f32::MAX, f32::MAX),
    }
}

/// What a picture that is sampled in passes keeps, row by row.
#[derive(Default)]
pub struct LayerFilm {
    layers: Vec<Vec<[f64; 4]>>,
    met: Option<MetFilm>,
}

/// What a pass gives a pixel beside its sum.
pub struct More {
    layers: Vec<[f64; 4]>,
    met: Option<[Vec<Met>; 2]>,
}

impl More {
    /// Collects what a tile's samples have given to a row.
    pub fn of(sums: &TileSums, row: usize) -> More {
        let met = |lists: &MetLists| [0, 1].map(|kind| lists.of(row, kind).to_vec());
        More {
            layers: sums.layers.iter().map(|layer| layer.of(row)).collect(),
            met: sums.met.as_ref().map(met),
        }
    }
}

impl LayerFilm {
    /// Adds what a pass has given to a pixel of a picture of so many.
    pub fn add(&mut self, pixel: usize, more: &More, pixels: usize) {
        if self.layers.len() < more.layers.len() {
            self.layers = vec![vec![[0.0; 4]; pixels]; more.layers.len()];
        }
        for (layer, more) in self.layers.iter_mut().zip(&more.layers) {
            layer[pixel] = super::sums::plus(layer[pixel], *more);
        }
        if let Some(met) = &more.met {
            let film = self.met.get_or_insert_with(|| MetFilm::new(pixels));
            film.add(pixel, met);
        }
    }

    /// Puts all of it into a picture whose pixels have `counts` samples.
    pub fn put(&self, outputs: &PathOutputs, picture: &mut Picture, counts: &[u32]) {
        if outputs.is_empty() {
            return;
        }
        for (layer, number) in picture.layers.iter_mut().zip(&outputs.numbers) {
            for (pixel, color) in layer.color.iter_mut().enumerate() {
                *color = bounded(
                    &layer.name,
                    mean(self.layers[*number][pixel], counts[pixel]),
                );
            }
        }
        if let (Some(names), Some(film)) = (&outputs.mattes, &self.met) {
            for (pixel, count) in counts.iter().enumerate() {
                let of = |kind| film.of(pixel, kind);
                names.rank(of, *count, &mut picture.mattes, pixel);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_tell_the_variance() {
        let of =
            |all: f64, half: f64, count| variance(([all; 4], count), ([half; 4], count / 2))[0];
        assert_eq!(of(3.0, 0.0, 1), 0.0);
        // Halves 1 and 2: the mean is 1.5 ± 0.5.
        assert_eq!(of(3.0, 1.0, 2), 0.25);
        // One sample of 1, and two of the mean 2.
        assert_eq!(of(5.0, 1.0, 3), (2.0 / 9.0) as f32);
        assert_eq!(of(f64::NAN, 1.0, 4), 0.0);
        assert_eq!(of(f64::INFINITY, 1.0, 4), f32::MAX);
    }
}
