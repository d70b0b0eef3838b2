//! The fast path against the reference.
//!
//! [`replay`] asks the reference about the very rays that were traced: any
//! difference is wrong. [`independent`] lets the reference go its own way from
//! the camera on and counts where the two ways part: acne and light leaks show
//! only here, and so do rays that differ in their last bit.
//!
//! Equal to the reference's answer is right. Different, but among what exact
//! arithmetic may say for all that the reference knows, is `undecided`.
//! Everything else is wrong. Mismatches are listed in the rays' order, whatever
//! the number of threads.

use crate::reference::{Answer, Grid, Hit, Reference, Shadow, camera_ray, shadow};
use crate::render::Progress;
use crate::scene::Camera;
use crate::trace::{Outcome, RayKind, TracedRay};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;
use thiserror::Error;

#[derive(Clone, Copy, Debug)]
pub struct VerifyOptions {
    /// Every how many pixels; 1 is all. A number without a common factor with
    /// the width spreads them best.
    pub sample: u32,
    /// How many mismatches are kept with all their numbers.
    pub list: usize,
}

impl Default for VerifyOptions {
    fn default() -> VerifyOptions {
        VerifyOptions {
            sample: 1,
            list: 20,
        }
    }
}

/// What the reference's own camera sees.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub camera: &'a Camera,
    /// Width and height.
    pub size: [u32; 2],
    pub grid: Grid,
}

/// The counts, with the names of `verify --json`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Rays compared.
    pub rays: u64,
    /// One hits, the other misses.
    pub wrong_hit: u64,
    /// Another instance or primitive, or another crossing of the same one.
    pub wrong_id: u64,
    /// Blocked or clear.
    pub wrong_shadow: u64,
    /// Differences within the reference's own rounding error.
    pub undecided: u64,
    /// Over hits of the same primitive; never NaN.
    pub max_rel_t_error: f64,
    pub max_normal_error_deg: f64,
    /// Independent only: pairs of pixel and light that the reference sees lit
    /// and for which no shadow ray was traced (a shading normal turned away, or
    /// a ray lost).
    pub not_traced: u64,
}

impl Counts {
    /// Rays whose answer is certainly not the reference's.
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

/// What the reference said.
#[derive(Clone, Debug)]
pub enum Said {
    Nearest(Answer),
    Shadow(Shadow),
}

#[derive(Clone, Debug, Default)]
pub struct Comparison {
    pub counts: Counts,
    /// The first of them, wrong ones before undecided ones.
    pub mismatches: Vec<Mismatch>,
}

/// The progress was cancelled before the last ray was compared.
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
            compare(reference, &rays[row], out);
        }
    })
}

/// Lets the reference trace its own rays for the pixels of the camera rays
/// among `rays`, and for the lights that shadow rays were traced to from their
/// hits (depth 0). Only sample 0 is looked at: it must lie on the grid.
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
    // The camera ray of each pixel first, then its lights.
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
            own_way(reference, view, primary, rows, out);
        }
    })
}

fn own_way<'a>(
    reference: &Reference,
    view: &View,
    primary: &TracedRay,
    shadows: impl Iterator<Item = &'a TracedRay>,
    out: &mut Comparison,
) {
    let at = [primary.pixel % view.size[0], primary.pixel / view.size[0]];
    let own = camera_ray(view.camera, view.size, view.grid, at);
    let dir = own.dir.map(f64::from);
    let answer = reference.nearest(own.org, dir, f64::INFINITY);
    let crossings = |i, p| crossings(reference, own.org, dir, i, p);
    judge_nearest(primary, &answer, crossings, out);

    let (
        Outcome::Hit {
            instance,
            primitive,
            ..
        },
        Some(hit),
    ) = (primary.outcome, &answer.outcome)
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
        judge_shadow(row, own, out);
    }
    for (light, said) in lights.iter().zip(said) {
        if said.is_none() {
            let own = shadow(reference, own.org, dir, hit, light);
            out.counts.not_traced += u64::from(!own.blocked && !own.doubt);
        }
    }
}

fn compare(reference: &Reference, ray: &TracedRay, out: &mut Comparison) {
    let (org, dir) = (ray.org, ray.dir.map(f64::from));
    let t_max = f64::from(ray.t_max);
    match ray.outcome {
        Outcome::Clear | Outcome::Blocked => {
            let (blocked, doubt) = reference.blocked(org, dir, t_max);
            judge_shadow(ray, Shadow { blocked, doubt }, out);
        }
        Outcome::Miss | Outcome::Hit { .. } => {
            let answer = reference.nearest(org, dir, t_max);
            let crossings = |i, p| crossings(reference, org, dir, i, p);
            judge_nearest(ray, &answer, crossings, out);
        }
    }
}

/// The t's of all crossings of one primitive.
fn crossings(
    reference: &Reference,
    org: [f64; 3],
    dir: [f64; 3],
    instance: u64,
    primitive: u32,
) -> Vec<f64> {
    let all = reference.crossings(org, dir, instance, primitive);
    all.iter().map(|c| c.t.value).collect()
}

fn judge_shadow(ray: &TracedRay, own: Shadow, out: &mut Comparison) {
    out.counts.rays += 1;
    if own.blocked == (ray.outcome == Outcome::Blocked) {
        return;
    }
    let kind = if own.doubt {
        MismatchKind::Undecided
    } else {
        MismatchKind::WrongShadow
    };
    out.note(kind, ray, Said::Shadow(own));
}

fn judge_nearest(
    ray: &TracedRay,
    answer: &Answer,
    crossings: impl Fn(u64, u32) -> Vec<f64>,
    out: &mut Comparison,
) {
    out.counts.rays += 1;
    let Outcome::Hit {
        t,
        instance,
        primitive,
        normal,
    } = ray.outcome
    else {
        if answer.outcome.is_some() {
            let allowed = answer.perhaps.contains(&None);
            let kind = if allowed {
                MismatchKind::Undecided
            } else {
                MismatchKind::WrongHit
            };
            out.note(kind, ray, Said::Nearest(answer.clone()));
        }
        return;
    };
    let same = |hit: &&Hit| (hit.instance, hit.primitive) == (instance, primitive);
    // At a box's edge, or where a ray starts on a sphere, one primitive may
    // have several answers: the nearest one counts.
    let near = |hit: &&Hit| (hit.t - t).abs();
    let like = answer
        .perhaps
        .iter()
        .flatten()
        .filter(same)
        .min_by(|a, b| near(a).total_cmp(&near(b)));
    let wrong = if answer.outcome.is_none() {
        MismatchKind::WrongHit
    } else {
        MismatchKind::WrongId
    };
    let Some(like) = like else {
        out.note(wrong, ray, Said::Nearest(answer.clone()));
        return;
    };
    let rel_t_error = (t - like.t).abs() / like.t.abs();
    // Far off: it may be another crossing, the far side instead of the near.
    let other = rel_t_error > 1e-5
        && crossings(instance, primitive)
            .iter()
            .any(|other| (other - t).abs() < near(&like));
    if !t.is_finite() || other {
        out.note(wrong, ray, Said::Nearest(answer.clone()));
        return;
    }
    if !answer.outcome.as_ref().is_some_and(|hit| same(&hit)) {
        out.note(MismatchKind::Undecided, ray, Said::Nearest(answer.clone()));
        return;
    }
    if like.t_error.is_finite() {
        raise(&mut out.counts.max_rel_t_error, rel_t_error);
    }
    let error = answer
        .perhaps
        .iter()
        .flatten()
        .filter(same)
        .filter(|hit| near(hit) <= near(&like) + hit.t_error + like.t_error)
        .map(|hit| degrees_between(hit.normal, normal))
        .fold(f64::INFINITY, f64::min);
    raise(&mut out.counts.max_normal_error_deg, error);
}

fn raise(max: &mut f64, value: f64) {
    *max = f64::max(*max, value);
}

fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (glam::DVec3::from_array(a), glam::DVec3::from_array(b));
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
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

    /// The first `list`, wrong ones before undecided ones.
    fn shorten(&mut self, list: usize) {
        self.mismatches
            .sort_by_key(|m| m.kind == MismatchKind::Undecided);
        self.mismatches.truncate(list);
    }

    fn append(&mut self, other: Comparison) {
        let (a, b) = (&mut self.counts, other.counts);
        a.rays += b.rays;
        a.wrong_hit += b.wrong_hit;
        a.wrong_id += b.wrong_id;
        a.wrong_shadow += b.wrong_shadow;
        a.undecided += b.undecided;
        raise(&mut a.max_rel_t_error, b.max_rel_t_error);
        raise(&mut a.max_normal_error_deg, b.max_normal_error_deg);
        a.not_traced += b.not_traced;
        self.mismatches.extend(other.mismatches);
    }
}

/// Rows judged in parallel, run by run, the results joined in order. A run is
/// the progress's tile; a wish to stop is read before every row, since the
/// reference may take long over one.
fn in_parallel(
    rows: usize,
    list: usize,
    progress: &Progress,
    judge: impl Fn(usize, &mut Comparison) + Sync,
) -> Result<Comparison, Interrupted> {
    const RUN: usize = 128;
    let runs = rows.div_ceil(RUN);
    progress.start(runs.try_into().unwrap_or(u32::MAX));
    let one = |run: usize| {
        let mut out = Comparison::default();
        for row in run * RUN..rows.min((run + 1) * RUN) {
            if progress.is_cancelled() {
                return Err(Interrupted);
            }
            judge(row, &mut out);
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

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (ray, kind) = (&self.ray, self.kind);
        writeln!(
            f,
            "{kind:?}: pixel {} sample {} depth {} {:?}",
            ray.pixel, ray.sample, ray.depth, ray.kind
        )?;
        writeln!(
            f,
            "  ray        org {:?} dir {:?} t_max {:?}",
            ray.org, ray.dir, ray.t_max
        )?;
        writeln!(f, "  fast       {:?}", ray.outcome)?;
        match &self.reference {
            Said::Shadow(own) => write!(
                f,
                "  reference  {}{}",
                if own.blocked { "Blocked" } else { "Clear" },
                if own.doubt { ", in doubt" } else { "" }
            ),
            Said::Nearest(answer) => {
                let show = |hit: &Option<Hit>| match hit {
                    None => "Miss".into(),
                    Some(h) => format!(
                        "Hit t {:?} ± {:.1e} instance {} primitive {} normal {:?}",
                        h.t, h.t_error, h.instance, h.primitive, h.normal
                    ),
                };
                write!(f, "  reference  {}", show(&answer.outcome))?;
                for other in answer.perhaps.iter().filter(|p| **p != answer.outcome) {
                    write!(f, "\n  or perhaps {}", show(other))?;
                }
                Ok(())
            }
        }
    }
}
