//! Compares one ray's answer with the reference's.

use super::{Comparison, MismatchKind, Said, VerifyOptions};
use lanecast_engine::trace::{Outcome, TracedRay};
use lanecast_reference::{Crossing, Hit, Ray, Reference, Shadow};

pub(super) fn compare(
    reference: &Reference,
    ray: &TracedRay,
    options: &VerifyOptions,
    out: &mut Comparison,
) {
    let said = ask(reference, ray, 0.0);
    check(reference, ray, said, options, out);
}

/// Asks the reference, with the functions of level sets shifted by `level`.
fn ask(reference: &Reference, ray: &TracedRay, level: f64) -> Said {
    let (own, t_max) = (own_ray(ray, level), f64::from(ray.t_max));
    match ray.outcome {
        Outcome::Clear | Outcome::Blocked => Said::Shadow(Shadow {
            blocked: reference.blocked_of(own, t_max),
            grazing: false,
        }),
        Outcome::Miss | Outcome::Hit { .. } => Said::Nearest(reference.nearest_of(own, t_max)),
    }
}

fn own_ray(ray: &TracedRay, level: f64) -> Ray {
    Ray {
        org: ray.org,
        dir: ray.dir.map(f64::from),
        level,
    }
}

/// Compares an answer with the reference's. A wrong answer is undecided if it were
/// right with level sets shifted by the error that f64 may have in them: by one shift for all of
/// the ray, or by one for what it hits and another for what lies before that.
pub(super) fn check(
    reference: &Reference,
    ray: &TracedRay,
    said: Said,
    options: &VerifyOptions,
    out: &mut Comparison,
) {
    if reference.scene().level_sets.is_empty() {
        return check_at(reference, ray, (&said, 0.0), options, out);
    }
    let mut own = Comparison::default();
    check_at(reference, ray, (&said, 0.0), options, &mut own);
    if own.counts.wrong() > 0 {
        let is_right = |level: &f64| {
            let mut shifted = Comparison::default();
            let said = ask(reference, ray, *level);
            check_at(reference, ray, (&said, *level), options, &mut shifted);
            shifted.counts.wrong() == 0
        };
        if [1.0, -1.0].iter().any(is_right) || may_be_hit(reference, ray) {
            own = Comparison::default();
            own.counts.rays = 1;
            own.note(MismatchKind::Undecided, ray, said);
        }
    }
    out.append(own);
}

/// Says whether, for some shifts, a ray's hit is a crossing and nothing lies before it.
fn may_be_hit(reference: &Reference, ray: &TracedRay) -> bool {
    let Outcome::Hit {
        t,
        instance,
        primitive,
        ..
    } = ray.outcome
    else {
        return false;
    };
    const SHIFTS: [f64; 3] = [0.0, 1.0, -1.0];
    let near = |c: &Crossing| c.primitive == primitive && (c.t - t).abs() <= SAME * t.abs();
    let crosses = |level: &f64| {
        let crossings = reference.crossings_of(own_ray(ray, *level), instance, primitive);
        crossings.iter().any(near)
    };
    let is_first = |level: &f64| {
        let nearest = reference.nearest_of(own_ray(ray, *level), f64::from(ray.t_max));
        nearest.is_none_or(|hit| hit.t >= t - SAME * t.abs())
    };
    SHIFTS.iter().any(crosses) && SHIFTS.iter().any(is_first)
}

fn check_at(
    reference: &Reference,
    ray: &TracedRay,
    (said, level): (&Said, f64),
    options: &VerifyOptions,
    out: &mut Comparison,
) {
    match said {
        Said::Shadow(own) => check_shadow(ray, *own, out),
        Said::Nearest(answer) => {
            let crossings = |i, p| reference.crossings_of(own_ray(ray, level), i, p);
            let kind = |i| reference.kind(i);
            check_nearest(ray, answer, crossings, kind, options, out);
        }
    }
}

pub(super) fn check_shadow(ray: &TracedRay, own: Shadow, out: &mut Comparison) {
    out.counts.rays += 1;
    if own.blocked == (ray.outcome == Outcome::Blocked) {
        return;
    }
    let kind = if own.grazing {
        MismatchKind::Undecided
    } else {
        MismatchKind::WrongShadow
    };
    out.note(kind, ray, Said::Shadow(own));
}

/// The relative distance up to which two t are those of one crossing.
const SAME: f64 = 1e-5;

pub(super) fn check_nearest(
    ray: &TracedRay,
    answer: &Option<Hit>,
    crossings: impl Fn(u64, u32) -> Vec<Crossing>,
    kind: impl Fn(u64) -> Option<&'static str>,
    options: &VerifyOptions,
    out: &mut Comparison,
) {
    out.counts.rays += 1;
    let mut wrong = |mismatch| {
        let kind = |instance: Option<u64>| instance.and_then(&kind).unwrap_or("nothing");
        let said = match ray.outcome {
            Outcome::Hit { instance, .. } => Some(instance),
            _ => None,
        };
        let kinds = format!("{} for {}", kind(said), kind(answer.map(|h| h.instance)));
        *out.wrong_kinds.entry(kinds).or_default() += 1;
        out.note(mismatch, ray, Said::Nearest(*answer));
    };
    let (hit, t, normal) = match (answer, ray.outcome) {
        (None, Outcome::Miss) => return,
        (None, _) | (_, Outcome::Miss) => return wrong(MismatchKind::WrongHit),
        (
            Some(hit),
            Outcome::Hit {
                t,
                instance,
                primitive,
                normal,
            },
        ) if (hit.instance, hit.primitive) == (instance, primitive) => (hit, t, normal),
        _ => return wrong(MismatchKind::WrongId),
    };
    let all = || crossings(hit.instance, hit.primitive);
    let expected = options.float.reported(hit.t);
    let off = (t - expected).abs();
    let rel_t_error = off / expected.abs();
    // A large error may mean another crossing: the far side instead of the near one. It
    // does not where the mode's number type has no closer number, as below its whole
    // range.
    let far = rel_t_error > SAME && off > options.float.ulp(hit.t);
    let other = |c: &Crossing| c.primitive == hit.primitive && (c.t - t).abs() < off;
    if !t.is_finite() || far && all().iter().any(other) {
        return wrong(MismatchKind::WrongId);
    }
    raise(&mut out.counts.max_rel_t_error, rel_t_error);
    if options.float.measures(hit.t, ray) {
        out.t_ulps.push((off / options.float.ulp(hit.t)) as f32);
    } else {
        out.counts.without_ulps += 1;
    }
    if normal.iter().any(|x| x.is_nan()) {
        return;
    }
    let mut error = degrees_between(hit.normal, normal);
    if error > out.counts.max_normal_error_deg {
        // At an edge any of the faces that meet there is accepted.
        let faces = all().into_iter().filter(|c| c.t == hit.t);
        error = faces
            .map(|c| degrees_between(c.normal, normal))
            .fold(error, f64::min);
    }
    raise(&mut out.counts.max_normal_error_deg, error);
}

fn raise(max: &mut f64, value: f64) {
    *max = f64::max(*max, value);
}

fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (glam::DVec3::from_array(a), glam::DVec3::from_array(b));
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
}
