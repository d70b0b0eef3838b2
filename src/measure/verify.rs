//! Compares the fast path with the reference.
//!
//! [`replay`] asks the reference about the very rays that were traced: any difference
//! is an error. [`independent`] lets the reference trace its own rays from the camera
//! on and counts where the results differ: only this comparison shows self-intersection
//! and light leaks, and also rays that differ in their last bit.
//!
//! The reference is exact: an answer that differs from it is wrong. `undecided` counts,
//! in `independent`, lights in the surface's plane, where rounding alone separates the
//! two; and elsewhere, rays that start on a level set or graze it, where the
//! reference's own rounding decides. Mismatches are listed in the rays' order, whatever
//! the number of threads.

mod check;
mod show;
mod widths;

pub use widths::Differences;

use crate::adversarial::Aimed;
use check::{check, check_nearest, check_shadow, compare};
use lanecast_engine::trace::{Outcome, RayKind, TracedRay};
use lanecast_model::scene::Camera;
use lanecast_picture::render::Progress;
use lanecast_reference::{Grid, Hit, Reference, Shadow, camera_ray, shadow};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use thiserror::Error;

#[derive(Clone, Copy, Debug)]
pub struct VerifyOptions {
    /// Compares every n-th pixel; 1 compares all. A number coprime to the width spreads
    /// the pixels best.
    pub sample: u32,
    /// Maximum number of mismatches kept with all their numbers.
    pub list: usize,
    /// The type in which t was computed: errors of t are counted in its units in the
    /// last place.
    pub float: Float,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Float {
    Single,
    Double,
}

impl Float {
    /// Returns the number that stands for an exact `x`: the largest of the type for what is
    /// beyond it (docs/SPEC.md, S58).
    pub fn reported(self, x: f64) -> f64 {
        match self {
            Float::Double => x,
            Float::Single => x.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)),
        }
    }

    /// Returns a unit in the last place of `x`.
    pub fn ulp(self, x: f64) -> f64 {
        match self {
            Float::Double => {
                let x = x.abs().min(f64::MAX.next_down());
                x.next_up() - x
            }
            Float::Single => {
                let x = (x as f32).abs().min(f32::MAX.next_down());
                f64::from(x.next_up()) - f64::from(x)
            }
        }
    }

    /// Whether units in the last place measure an error of `t` on this ray. They do not
    /// where `t` is no normal number of the type, nor where the hit is as near to the
    /// origin as the rounding of the origin's coordinates.
    fn measures(self, t: f64, ray: &TracedRay) -> bool {
        let (unit, normal) = match self {
            Float::Single => (
                f64::from(f32::EPSILON),
                f32::MIN_POSITIVE.into()..=f32::MAX.into(),
            ),
            Float::Double => (f64::EPSILON, f64::MIN_POSITIVE..=f64::MAX),
        };
        let largest = |v: [f64; 3]| v.into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let step = t.abs() * largest(ray.dir.map(f64::from));
        normal.contains(&t.abs()) && step > 0.5 * unit * largest(ray.org)
    }
}

impl Default for VerifyOptions {
    fn default() -> VerifyOptions {
        VerifyOptions {
            sample: 1,
            list: 20,
            float: Float::Double,
        }
    }
}

/// The view of the reference's own camera.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub camera: &'a Camera,
    /// Width and height, in pixels.
    pub size: [u32; 2],
    pub grid: Grid,
}

/// The counts, with the field names of `verify --json`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Number of rays compared.
    pub rays: u64,
    /// Hits where the reference misses, or the reverse.
    pub wrong_hit: u64,
    /// Another instance or primitive, or another crossing of the same one.
    pub wrong_id: u64,
    /// Blocked where the reference is clear, or the reverse.
    pub wrong_shadow: u64,
    /// Answers of which the reference is not certain: lights in the surface's plane (in
    /// `independent` only), and decisions of level sets within rounding.
    pub undecided: u64,
    /// Maximum over hits of the same primitive; never NaN.
    pub max_rel_t_error: f64,
    pub max_normal_error_deg: f64,
    /// Hits of the same primitive whose t is nearly 0, or outside the range of the mode's
    /// numbers: their error is not counted in units in the last place.
    pub without_ulps: u64,
    /// `independent` only: (pixel, light) pairs that the reference sees lit and for
    /// which no shadow ray was traced (a shading normal turned away, or a lost ray).
    pub not_traced: u64,
}

impl Counts {
    /// Returns the number of rays whose answer differs from the reference's.
    pub fn wrong(&self) -> u64 {
        self.wrong_hit + self.wrong_id + self.wrong_shadow
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MismatchKind {
    WrongHit,
    WrongId,
    WrongShadow,
    Undecided,
}

/// One difference, with all its numbers.
#[derive(Clone, Debug)]
pub struct Mismatch {
    pub kind: MismatchKind,
    pub ray: TracedRay,
    pub reference: Said,
}

/// The reference's answer.
#[derive(Clone, Debug)]
pub enum Said {
    Nearest(Option<Hit>),
    Shadow(Shadow),
}

/// Errors of t in units in the last place, over hits of the right primitive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct UlpErrors {
    pub median: f64,
    pub max: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Comparison {
    pub counts: Counts,
    /// Error of each hit of the right primitive, in no particular order, but those of
    /// `Counts::without_ulps`.
    pub t_ulps: Vec<f32>,
    /// Wrong closest hits by the kinds found and expected, such as "nothing for
    /// sphere".
    pub wrong_kinds: BTreeMap<String, u64>,
    /// The first mismatches, wrong ones before undecided ones.
    pub mismatches: Vec<Mismatch>,
}

/// The error of a run that was cancelled before the last ray was compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("interrupted")]
pub struct Interrupted;

/// Asks the reference about the rays that the fast path traced.
pub fn replay(
    reference: &Reference,
    rays: &[TracedRay],
    options: &VerifyOptions,
    progress: &Progress,
) -> Result<Comparison, Interrupted> {
    let step = options.sample.max(1);
    in_parallel(rays.len(), options.list, progress, |row, out| {
        if rays[row].pixel.is_multiple_of(step) {
            compare(reference, &rays[row], options, out);
        }
    })
}

/// Returns the reference's closest hits of world rays, with 0 < t < t_max.
pub fn nearest_hits(
    reference: &Reference,
    rays: &[Aimed],
    progress: &Progress,
) -> Result<Vec<Option<Hit>>, Interrupted> {
    progress.start(rays.len().div_ceil(RUN).try_into().unwrap_or(u32::MAX));
    let one = |ray: &Aimed| {
        if progress.is_cancelled() {
            return Err(Interrupted);
        }
        let dir = ray.dir.map(f64::from);
        Ok(reference.nearest(ray.org, dir, ray.t_max.into()))
    };
    let runs = rays.par_chunks(RUN).map(|run| {
        let hits: Vec<_> = run.iter().map(one).collect::<Result<_, _>>()?;
        progress.add_tile(run.len() as u64);
        Ok(hits)
    });
    Ok(runs.collect::<Result<Vec<_>, _>>()?.concat())
}

/// Compares like [`replay`], for rays that were traced for the closest hit and then all
/// of them again for any hit. `nearest` holds the reference's answer to each, so that
/// several modes share one query of the reference.
pub fn replay_aimed(
    reference: &Reference,
    nearest: &[Option<Hit>],
    rays: &[TracedRay],
    options: &VerifyOptions,
    progress: &Progress,
) -> Result<Comparison, Interrupted> {
    in_parallel(rays.len(), options.list, progress, |row, out| {
        let (ray, hit) = (&rays[row], nearest[row % nearest.len()]);
        let said = match ray.outcome {
            Outcome::Clear | Outcome::Blocked => Said::Shadow(Shadow {
                blocked: hit.is_some(),
                grazing: false,
            }),
            Outcome::Miss | Outcome::Hit { .. } => Said::Nearest(hit),
        };
        check(reference, ray, said, options, out);
    })
}

/// Lets the reference trace its own rays for the pixels of the camera rays among
/// `rays`, and for the lights that shadow rays were traced to from their hits (depth
/// 0). Only sample 0 is compared: it must lie on the grid.
///
/// Lights are compared where both hit the same primitive.
pub fn independent(
    reference: &Reference,
    view: &View,
    rays: &[TracedRay],
    options: &VerifyOptions,
    progress: &Progress,
) -> Result<Comparison, Interrupted> {
    let step = options.sample.max(1);
    let pixels = view.size[0].saturating_mul(view.size[1]);
    let mut rows: Vec<u32> = (0..rays.len() as u32)
        .filter(|i| {
            let ray = &rays[*i as usize];
            let camera = matches!(ray.kind, RayKind::Primary | RayKind::Shadow { .. });
            camera
                && ray.depth == 0
                && ray.sample == 0
                && ray.pixel.is_multiple_of(step)
                && ray.pixel < pixels
        })
        .collect();
    // The camera ray of each pixel comes first, then its shadow rays.
    rows.sort_by_key(|i| {
        let ray = &rays[*i as usize];
        (ray.pixel, ray.kind != RayKind::Primary)
    });
    let pixels: Vec<&[u32]> = rows
        .chunk_by(|a, b| rays[*a as usize].pixel == rays[*b as usize].pixel)
        .collect();
    in_parallel(pixels.len(), options.list, progress, |pixel, out| {
        let mut rows = pixels[pixel].iter().map(|i| &rays[*i as usize]);
        if let Some(primary) = rows.next().filter(|r| r.kind == RayKind::Primary) {
            trace_own(reference, view, options, primary, rows, out);
        }
    })
}

fn trace_own<'a>(
    reference: &Reference,
    view: &View,
    options: &VerifyOptions,
    primary: &TracedRay,
    shadows: impl Iterator<Item = &'a TracedRay>,
    out: &mut Comparison,
) {
    let at = [primary.pixel % view.size[0], primary.pixel / view.size[0]];
    let own = camera_ray(view.camera, view.size, view.grid, at);
    let dir = own.dir.map(f64::from);
    let answer = reference.nearest(own.org, dir, f64::INFINITY);
    let crossings = |i, p| reference.crossings(own.org, dir, i, p);
    let kind = |i| reference.kind(i);
    check_nearest(primary, &answer, crossings, kind, options, out);

    let (
        Outcome::Hit {
            instance,
            primitive,
            ..
        },
        Some(hit),
    ) = (primary.outcome, &answer)
    else {
        return;
    };
    if (instance, primitive) != (hit.instance, hit.primitive) {
        return;
    }
    let lights = &reference.scene().lights;
    let mut said: Vec<Option<Shadow>> = vec![None; lights.len()];
    for row in shadows {
        let RayKind::Shadow { light } = row.kind else {
            continue;
        };
        let Some(slot) = said.get_mut(light as usize) else {
            continue;
        };
        let own = *slot
            .get_or_insert_with(|| shadow(reference, own.org, dir, hit, &lights[light as usize]));
        check_shadow(row, own, out);
    }
    for (light, said) in lights.iter().zip(said) {
        if said.is_none() {
            let own = shadow(reference, own.org, dir, hit, light);
            out.counts.not_traced += u64::from(!own.blocked && !own.grazing);
        }
    }
}

impl Comparison {
    fn note(&mut self, kind: MismatchKind, ray: &TracedRay, reference: Said) {
        let counts = &mut self.counts;
        *match kind {
            MismatchKind::WrongHit => &mut counts.wrong_hit,
            MismatchKind::WrongId => &mut counts.wrong_id,
            MismatchKind::WrongShadow => &mut counts.wrong_shadow,
            MismatchKind::Undecided => &mut counts.undecided,
        } += 1;
        self.mismatches.push(Mismatch {
            kind,
            ray: *ray,
            reference,
        });
    }

    /// Keeps the first `list` mismatches, wrong ones before undecided ones.
    pub fn shorten(&mut self, list: usize) {
        self.mismatches
            .sort_by_key(|m| m.kind == MismatchKind::Undecided);
        self.mismatches.truncate(list);
    }

    pub fn append(&mut self, other: Comparison) {
        let (a, b) = (&mut self.counts, other.counts);
        a.rays += b.rays;
        a.wrong_hit += b.wrong_hit;
        a.wrong_id += b.wrong_id;
        a.wrong_shadow += b.wrong_shadow;
        a.undecided += b.undecided;
        a.max_rel_t_error = a.max_rel_t_error.max(b.max_rel_t_error);
        a.max_normal_error_deg = a.max_normal_error_deg.max(b.max_normal_error_deg);
        a.not_traced += b.not_traced;
        a.without_ulps += b.without_ulps;
        self.mismatches.extend(other.mismatches);
        self.t_ulps.extend(other.t_ulps);
        for (kinds, count) in other.wrong_kinds {
            *self.wrong_kinds.entry(kinds).or_default() += count;
        }
    }

    /// Returns the median and the maximum, zero if nothing was hit.
    pub fn ulp_errors(&self) -> UlpErrors {
        let mut all = self.t_ulps.clone();
        all.sort_by(f32::total_cmp);
        UlpErrors {
            median: all.get(all.len() / 2).copied().unwrap_or(0.0).into(),
            max: all.last().copied().unwrap_or(0.0).into(),
        }
    }
}

/// Number of rows that a thread takes at a time.
const RUN: usize = 128;

/// Compares rows in parallel, run by run, and joins the results in order. A run is one
/// tile of the progress; cancellation is read before every row, since the reference may
/// take long over one.
fn in_parallel(
    rows: usize,
    list: usize,
    progress: &Progress,
    check: impl Fn(usize, &mut Comparison) + Sync,
) -> Result<Comparison, Interrupted> {
    let runs = rows.div_ceil(RUN);
    progress.start(runs.try_into().unwrap_or(u32::MAX));
    let one = |run: usize| {
        let mut out = Comparison::default();
        for row in run * RUN..rows.min((run + 1) * RUN) {
            if progress.is_cancelled() {
                return Err(Interrupted);
            }
            check(row, &mut out);
        }
        out.shorten(list);
        progress.add_tile(out.counts.rays);
        Ok(out)
    };
    let runs: Vec<Comparison> = (0..runs)
        .into_par_iter()
        .map(one)
        .collect::<Result<_, _>>()?;
    let mut all = Comparison::default();
    for run in runs {
        all.append(run);
    }
    all.shorten(list);
    Ok(all)
}
