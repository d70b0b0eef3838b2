//! Parts of a picture: a range of each pixel's samples, whose sums add up to those of the
//! whole, bit by bit.

use super::blur::{Blur, sum_picture};
use super::camera::RayGenerator;
use super::config::{Backdrop, Integrator, RenderConfig};
use super::film::blank;
use super::irradiance::LightCache;
use super::paths::PathPicture;
use super::picture::{RenderError, View};
use super::pixel_order::BLOCK;
use super::progress::Progress;
use super::slices::Slices;
use super::sums::plus;
use super::tile::color_of;
use super::{AovSet, Picture};
use crate::io::{Part, PartHeader};
use crate::plan::{BITS, Precision};
use crate::shade::RayCounts;
use std::fmt::Write;
use std::ops::Range;

/// Says whether a range of samples is a term of the sums by halves: 2^k samples from a multiple
/// of 2^k on.
pub fn is_part(samples: &Range<u32>) -> bool {
    let len = samples.end.saturating_sub(samples.start);
    len.is_power_of_two() && samples.start.is_multiple_of(len)
}

/// Divides a range of samples into the fewest parts.
pub fn parts_of(samples: Range<u32>) -> Vec<Range<u32>> {
    let mut parts = Vec::new();
    let mut start = samples.start;
    while start < samples.end {
        let left = samples.end - start;
        let most = 1 << left.ilog2();
        let len = match start {
            0 => most,
            _ => most.min(1 << start.trailing_zeros()),
        };
        parts.push(start..start + len);
        start += len;
    }
    parts
}

/// Renders a range of the samples of every pixel, which [`is_part`] holds of.
pub fn render_part(
    view: (&View, Option<&Slices>),
    config: &RenderConfig,
    samples: Range<u32>,
    progress: &Progress,
) -> Result<(Part, RayCounts), RenderError> {
    let (sums, counts) = render_samples(view, config, samples.clone(), progress)?;
    let flags = [
        config.backdrop == Backdrop::Transparent,
        config.integrator == Integrator::Path,
    ];
    let key = picture_key(view.0, config);
    let size = (config.width, config.height);
    Ok((Part::new(size, samples, flags, key, sums), counts))
}

/// Renders the sums of a range of the samples of every pixel, as [`render_part`] does, for
/// [`Merge::add_sums`] in the same process.
pub fn render_samples(
    (view, slices): (&View, Option<&Slices>),
    config: &RenderConfig,
    samples: Range<u32>,
    progress: &Progress,
) -> Result<(Vec<[f64; 4]>, RayCounts), RenderError> {
    let (width, height) = (config.width, config.height);
    let mut picture = PathPicture::new(view, config).ok_or(RenderError::NoPaths)?;
    // Whatever the number of samples of a part, the whole has more.
    picture.picks_texels = true;
    let generator = RayGenerator::new(view.camera, width, height, config.grid);
    let (picture, mut counts) = match slices {
        None => {
            let (picture, counts, _) = picture.cached(
                (view, config),
                &generator,
                &mut LightCache::default(),
                progress,
            )?;
            (picture, counts)
        }
        Some(_) => (picture, RayCounts::default()),
    };
    let blur = slices.map(|slices| Blur::new(view, slices, config, Some(&picture)));
    let blur = blur.transpose()?;
    let side = match &blur {
        Some(blur) => blur.side(samples.len() as u32, config.tiles),
        None => BLOCK,
    };
    progress.start(width.div_ceil(side) * height.div_ceil(side));
    let pictures = (Some(&picture), blur.as_ref());
    let sums = sum_picture((view, config), pictures, &samples, side, progress)?;
    counts.add(&sums.counts);
    Ok((sums.all, counts))
}

/// Hashes the scene and all settings that show in a picture, but not which window of it is rendered.
pub fn window_key(view: &View, config: &RenderConfig) -> u128 {
    let mut key = Key(picture_key(view, config));
    // Writing to a hash cannot fail.
    let _ = write!(
        key,
        " {} {:?} {:?} {}",
        config.spp, config.grid, config.aovs, config.matte_ranks
    );
    key.0
}

/// Hashes the scene and all settings that show in a picture's samples (FNV-1a of 128 bits),
/// as this version of the program writes them.
fn picture_key(view: &View, config: &RenderConfig) -> u128 {
    let mut key = Key::EMPTY;
    let kernels = showing_kernels(view, config);
    // Writing to a hash cannot fail.
    let _ = write!(
        key,
        "{} {BITS} {:?} {:?} {:?} {:?}",
        env!("CARGO_PKG_VERSION"),
        *view.world.scene,
        view.lights,
        view.camera,
        kernels,
    );
    let _ = write!(
        key,
        "{} {} {:?} {:?} {:?} {} {} {} {:?} {:?} {:?}",
        config.width,
        config.height,
        config.integrator,
        config.sampler,
        config.filter,
        config.seed,
        config.frame,
        config.max_depth,
        config.backdrop,
        config.ground,
        config.caching,
    );
    if let Some(shutter) = &config.shutter {
        let _ = write!(key, " {shutter:?}");
    }
    key.0
}

/// Returns what shows of how rays are traced: lanes and structures show only without bounds.
pub(super) fn showing_kernels(view: &View, config: &RenderConfig) -> impl std::fmt::Debug {
    let is_fast = view.kernels.precision == Precision::Fast;
    is_fast.then_some((view.kernels, config.choices.accel, config.build, config.kd))
}

/// A hash of what is written to it: FNV-1a of 128 bits.
pub(super) struct Key(pub u128);

impl Key {
    /// The hash of nothing.
    pub const EMPTY: Key = Key(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);

    /// Hashes one text.
    pub fn of(text: std::fmt::Arguments) -> u128 {
        let mut key = Key::EMPTY;
        // Writing to a hash cannot fail.
        let _ = key.write_fmt(text);
        key.0
    }
}

impl Write for Key {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        for byte in text.bytes() {
            let mixed = self.0 ^ u128::from(byte);
            self.0 = mixed.wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
        Ok(())
    }
}

/// Adds parts up, in the order of their samples from 0 on, as one run would have.
#[derive(Clone, Debug, Default)]
pub struct Merge {
    /// Sums of 2^k samples, of falling length.
    terms: Vec<(u32, Vec<[f64; 4]>)>,
}

impl Merge {
    /// Returns the number of samples so far.
    pub fn samples(&self) -> u32 {
        self.terms.iter().map(|(len, _)| len).sum()
    }

    /// Adds the part that begins with the next sample, and has as many pixels.
    pub fn add(&mut self, part: Part) {
        let samples = part.header.samples;
        self.add_sums(samples.end - samples.start, part.sums);
    }

    /// Adds the sums of the next `len` samples, which begin at a multiple of their number.
    pub fn add_sums(&mut self, len: u32, sums: Vec<[f64; 4]>) {
        let (mut len, mut sums) = (len, sums);
        while let Some((_, mut before)) = self.terms.pop_if(|(before, _)| *before == len) {
            add_to(&mut before, &sums);
            (len, sums) = (2 * len, before);
        }
        self.terms.push((len, sums));
    }

    /// Returns the picture of all samples. Fails if memory does not suffice.
    pub fn picture(self, header: &PartHeader) -> Result<Picture, RenderError> {
        self.mean((header.width, header.height), header.has_alpha)
    }

    /// Returns the mean of all samples, as a picture of this size.
    pub fn mean(
        mut self,
        (width, height): (u32, u32),
        has_alpha: bool,
    ) -> Result<Picture, RenderError> {
        let share = 1.0 / f64::from(self.samples().max(1));
        let mut sums = Vec::new();
        while let Some((_, mut before)) = self.terms.pop() {
            if !sums.is_empty() {
                add_to(&mut before, &sums);
            }
            sums = before;
        }
        let mut picture = blank(width, height, AovSet::default(), has_alpha)
            .map_err(|_| RenderError::Memory { width, height })?;
        for (pixel, sum) in sums.iter().enumerate() {
            let (color, alpha) = color_of(&sum.map(|sum| (sum * share) as f32));
            picture.color[pixel] = color;
            if let Some(column) = &mut picture.alpha {
                column[pixel] = alpha;
            }
        }
        Ok(picture)
    }
}

fn add_to(before: &mut [[f64; 4]], after: &[[f64; 4]]) {
    for (sum, more) in before.iter_mut().zip(after) {
        *sum = plus(*sum, *more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sums::Sums;
    use bumpalo::Bump;

    #[test]
    fn parts_are_terms_of_the_sums() {
        for (samples, expected) in [
            (0..64, true),
            (64..96, true),
            (64..192, false),
            (1..2, true),
        ] {
            assert_eq!(is_part(&samples), expected, "{samples:?}");
        }
        assert!(!is_part(&(5..5)));
        let of = |samples: Range<u32>| {
            let parts = parts_of(samples);
            assert!(parts.iter().all(is_part), "{parts:?}");
            parts
        };
        assert_eq!(of(64..192), [64..128, 128..192]);
        assert_eq!(of(3..20), [3..4, 4..8, 8..16, 16..20]);
        assert_eq!(of(0..96), [0..64, 64..96]);
        assert_eq!(of(0..u32::MAX).len(), 32);
    }

    #[test]
    fn any_parts_add_up_to_the_same_bits() {
        let of = |i: u32| (f64::from(i).sin() * 1e3).exp2() as f32 - 1.0 / (i as f32 + 1.0);
        let slot = |i: u32| [of(i), -of(i), of(i + 7), 1.0];
        let sum = |samples: Range<u32>| {
            let arena = Bump::new();
            let mut sums = Sums::new(1, &arena);
            samples.for_each(|i| sums.add(&[slot(i)]));
            sums.of(0)
        };
        for end in [1, 2, 7, 64, 96, 100] {
            let mut halves = Merge::default();
            parts_of(0..end / 2)
                .into_iter()
                .chain(parts_of(end / 2..end))
                .for_each(|samples| {
                    let sums = vec![sum(samples.clone())];
                    halves.add(Part::new((1, 1), samples, [false; 2], 0, sums));
                });
            assert_eq!(halves.samples(), end);
            let header = Part::new((1, 1), 0..end, [true, false], 0, vec![]).header;
            let picture = halves.picture(&header).unwrap();
            let share = 1.0 / f64::from(end);
            let (color, alpha) = color_of(&sum(0..end).map(|sum| (sum * share) as f32));
            assert_eq!(
                (picture.color, picture.alpha),
                (vec![color], Some(vec![alpha]))
            );
        }
    }
}
