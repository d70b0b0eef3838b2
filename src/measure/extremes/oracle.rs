//! The oracle: compares one precision's answers to a case's rays with the reference's.

use super::rays::SweepRay;
use crate::verify::Float;
use lanecast_engine::accel::World;
use lanecast_engine::trace::{
    Caching, Depths, HitId, HitIds, Hits, MAX_LANES, Rays, ShadowCache, TraceScratch, Vectors, any,
    closest,
};
use lanecast_model::plan::{Kernels, Precision};
use lanecast_picture::shade::Surface;
use lanecast_reference::{Hit, Reference};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// The figures of one precision at one value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    pub precision: &'static str,
    /// Number of queries compared: a closest-hit and an any-hit query per ray.
    pub rays: u64,
    /// Closest-hit queries that hit.
    pub hits: u64,
    /// Hits where the reference misses, or the reverse.
    pub wrong_hit: u64,
    /// Another instance or primitive, or another crossing of the same one.
    pub wrong_id: u64,
    /// Blocked where the reference is clear, or the reverse.
    pub wrong_shadow: u64,
    /// Hits with NaN or infinity in t, point, normal or offset of leaving rays.
    pub not_finite: u64,
    /// Error of t in units in the last place of the precision's numbers, over correct
    /// hits; never NaN.
    pub max_t_ulps: f64,
    pub median_t_ulps: f64,
    /// Number of (ray, primitive) pairs that error bounds left to the exact fallback.
    pub escalated: u64,
    /// The first wrong decision, with all its numbers.
    pub first_wrong: Option<String>,
    /// Best of several runs, on one thread.
    pub ns_per_ray: f64,
}

impl Figures {
    /// Returns the number of decisions that certainly differ from the reference's.
    pub fn wrong(&self) -> u64 {
        self.wrong_hit + self.wrong_id + self.wrong_shadow
    }

    /// Returns the gravest fault.
    pub fn fault(&self) -> Option<&'static str> {
        let faults = [
            (self.not_finite > 0, "not finite"),
            (self.wrong_hit > 0, "hit"),
            (self.wrong_id > 0, "id"),
            (self.wrong_shadow > 0, "shadow"),
            (self.max_t_ulps > super::ULPS_ALLOWED, "t"),
        ];
        faults.into_iter().find(|(is, _)| *is).map(|(_, what)| what)
    }
}

/// Rays in columns, with the reference's answer to each.
pub struct Truth {
    rays: Vec<SweepRay>,
    org: [Vec<f64>; 3],
    dir: [Vec<f64>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
    nearest: Vec<Option<Hit>>,
    blocked: Vec<bool>,
}

/// Asks the reference for every ray, on the current rayon pool.
pub fn ask(reference: &Reference, rays: &[SweepRay]) -> Truth {
    let rows = rays.len().next_multiple_of(MAX_LANES);
    let column = |of: &dyn Fn(&SweepRay) -> f32, padding: f32| {
        let mut column: Vec<f32> = rays.iter().map(of).collect();
        column.resize(rows, padding);
        column
    };
    let doubles = |of: &dyn Fn(&SweepRay) -> f64, padding: f64| {
        let mut column: Vec<f64> = rays.iter().map(of).collect();
        column.resize(rows, padding);
        column
    };
    let org = |k: usize| doubles(&|ray| ray.org[k], 0.0);
    let dir = |k: usize| doubles(&|ray| ray.dir[k], 1.0);
    let answers = rays.par_iter().map(|ray| {
        let (dir, t_max) = (ray.dir, f64::from(ray.t_max));
        let blocked = reference.blocked(ray.org, dir, t_max);
        (reference.nearest(ray.org, dir, t_max), blocked)
    });
    let (nearest, blocked) = answers.unzip();
    Truth {
        rays: rays.to_vec(),
        org: [org(0), org(1), org(2)],
        dir: [dir(0), dir(1), dir(2)],
        t_min: vec![0.0; rows],
        t_max: column(&|ray| ray.t_max, -1.0),
        nearest,
        blocked,
    }
}

/// One precision's answers.
struct Answers {
    t: Vec<f64>,
    id: HitIds,
    blocked: Vec<bool>,
    escalated: u64,
    seconds: f64,
}

/// Number of timed runs: batches are short, and the first run is cold.
const RUNS: usize = 3;

fn trace(world: &World, kernels: &Kernels, truth: &Truth) -> Answers {
    let [x, y, z] = &truth.org;
    let rays = Rays {
        org: Vectors::Double([x, y, z]),
        dir: Vectors::Double(truth.dir.each_ref().map(|x| &x[..])),
        t_min: &truth.t_min,
        t_max: &truth.t_max,
    };
    let rows = rays.len();
    let mut answers = Answers {
        t: vec![0.0; rows],
        id: HitIds::none(rows),
        blocked: vec![false; rows],
        escalated: 0,
        seconds: f64::INFINITY,
    };
    let scratch = &mut TraceScratch::default();
    for run in 0..RUNS {
        let start = Instant::now();
        let mut hits = Hits {
            t: Depths::Double(&mut answers.t),
            id: answers.id.columns(),
        };
        closest(world, kernels, &rays, &mut hits, scratch);
        let cache = &mut ShadowCache::new(Caching::On);
        any(world, kernels, &rays, cache, &mut answers.blocked, scratch);
        answers.seconds = answers.seconds.min(start.elapsed().as_secs_f64());
        if run == 0 {
            answers.escalated = scratch.decided;
        }
    }
    answers
}

pub fn figures(
    world: &World,
    (precision, kernels): (Precision, &Kernels),
    reference: &Reference,
    truth: &Truth,
) -> Figures {
    let answers = trace(world, kernels, truth);
    let queries = 2 * truth.rays.len() as u64;
    let (mut wrong_hit, mut wrong_id, mut wrong_shadow) = (0, 0, 0);
    let (mut hits, mut not_finite) = (0, 0);
    let mut ulps = Vec::new();
    let mut first_wrong = None;
    for (i, ray) in truth.rays.iter().enumerate() {
        let id = answers.id.get(i);
        let hit = (id != HitId::NONE).then_some((answers.t[i], id));
        if let Some((t, id)) = hit {
            let surface = Surface::at(world, kernels.precision, ray.org, ray.dir, t, id);
            hits += 1;
            not_finite += u64::from(!is_finite(t, &surface));
        }
        let said = &truth.nearest[i];
        let crossings = |id: HitId| {
            let dir = ray.dir.map(f64::from);
            let all = reference.crossings(ray.org, dir, id.instance, id.primitive);
            all.iter().map(|c| c.t).collect()
        };
        let nearest = compare(float_of(precision), hit, said, crossings);
        match nearest {
            Verdict::Right(like) => {
                let of = |(t, _): (f64, _)| t_ulps(precision, t, &like?);
                ulps.extend(hit.and_then(of));
            }
            Verdict::WrongHit => wrong_hit += 1,
            Verdict::WrongId => wrong_id += 1,
        }
        let blocked = truth.blocked[i];
        let differs = blocked != answers.blocked[i];
        wrong_shadow += u64::from(differs);
        let wrong = matches!(nearest, Verdict::WrongHit | Verdict::WrongId) || differs;
        if wrong && first_wrong.is_none() {
            first_wrong = Some(format!(
                "{ray:?}: {hit:?}, blocked {}; by the reference {:?}, blocked {blocked}",
                answers.blocked[i], said
            ));
        }
    }
    ulps.sort_by(f64::total_cmp);
    Figures {
        precision: precision.name(),
        rays: queries,
        hits,
        wrong_hit,
        wrong_id,
        wrong_shadow,
        not_finite,
        max_t_ulps: ulps.last().copied().unwrap_or(0.0),
        median_t_ulps: ulps.get(ulps.len() / 2).copied().unwrap_or(0.0),
        escalated: answers.escalated,
        first_wrong,
        ns_per_ray: answers.seconds * 1e9 / queries.max(1) as f64,
    }
}

fn is_finite(t: f64, surface: &Surface) -> bool {
    let Surface {
        point,
        ng,
        ns,
        offset,
        ..
    } = surface;
    t.is_finite() && point.is_finite() && ng.is_finite() && ns.is_finite() && offset.is_finite()
}

enum Verdict {
    /// Agrees with the reference; holds the reference's hit, if there is one.
    Right(Option<Hit>),
    WrongHit,
    WrongId,
}

/// Compares a closest hit, or a miss, with the reference's. `crossings` returns t of
/// all crossings of one primitive.
fn compare(
    float: Float,
    hit: Option<(f64, HitId)>,
    said: &Option<Hit>,
    crossings: impl Fn(HitId) -> Vec<f64>,
) -> Verdict {
    let ((t, id), like) = match (hit, said) {
        (None, None) => return Verdict::Right(None),
        (Some(hit), Some(like)) => (hit, like),
        _ => return Verdict::WrongHit,
    };
    if (like.instance, like.primitive) != (id.instance, id.primitive) {
        return Verdict::WrongId;
    }
    let off = (t - float.reported(like.t)).abs();
    // A large error may mean another crossing: the far side instead of the near one.
    let is_other = |other: &f64| (other - t).abs() < off;
    if off > 1e-5 * like.t.abs() && crossings(id).iter().any(is_other) {
        return Verdict::WrongId;
    }
    Verdict::Right(Some(*like))
}

fn float_of(precision: Precision) -> Float {
    match precision {
        Precision::Exact => Float::Double,
        Precision::Fast | Precision::Guarded => Float::Single,
    }
}

fn t_ulps(precision: Precision, t: f64, like: &Hit) -> Option<f64> {
    let float = float_of(precision);
    let ulps = (t - float.reported(like.t)).abs() / float.ulp(like.t);
    (!ulps.is_nan()).then_some(ulps)
}
