//! `verify` sees every fault, and nothing else: the reference makes rows without a fault, and
//! each test falsifies some of them.

use glam::DVec3;
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::io::{LoadOptions, load};
use lanecast::internals::measure::verify::{self, *};
use lanecast::internals::reference::Reference;
use lanecast::internals::render::Progress;
use lanecast::internals::scene::*;
use lanecast::internals::trace::{Outcome, RayKind, TracedRay};

mod aimed;
mod scene;

use scene::{rows, scene, view, with};

/// To the end: nobody wishes to stop.
fn replay(reference: &Reference, rays: &[TracedRay], options: &VerifyOptions) -> Comparison {
    verify::replay(reference, rays, options, &Progress::default()).unwrap()
}

fn independent(
    reference: &Reference,
    view: &View,
    rays: &[TracedRay],
    options: &VerifyOptions,
) -> Comparison {
    verify::independent(reference, view, rays, options, &Progress::default()).unwrap()
}

const ALL: VerifyOptions = VerifyOptions {
    sample: 1,
    list: 20,
    float: Float::Double,
};

#[test]
fn a_flawless_tracer_has_no_fault() {
    with(|reference, rows| {
        let replay = replay(reference, &rows, &ALL);
        assert_eq!(replay.counts.wrong(), 0, "{:?}", replay.mismatches);
        assert_eq!(replay.counts.rays, rows.len() as u64);
        assert_eq!(replay.counts.max_rel_t_error, 0.0);
        let none = UlpErrors {
            median: 0.0,
            max: 0.0,
        };
        assert_eq!(replay.ulp_errors(), none);
        let hits = rows
            .iter()
            .filter(|r| matches!(r.outcome, Outcome::Hit { .. }));
        assert_eq!(replay.t_ulps.len(), hits.count());
        assert!(replay.counts.max_normal_error_deg < 1e-6);
        let own = independent(reference, &view(reference.scene()), &rows, &ALL);
        assert_eq!(own.counts.wrong() + own.counts.undecided, 0);
        assert_eq!(own.counts.rays, rows.len() as u64);
        assert_eq!(own.counts.not_traced, 0);
        // All sorts of rays were among them.
        let kinds = |f: fn(&TracedRay) -> bool| rows.iter().filter(|r| f(r)).count();
        assert!(kinds(|r| r.outcome == Outcome::Miss) > 50);
        assert!(kinds(|r| r.outcome == Outcome::Blocked) > 50);
        assert!(kinds(|r| r.outcome == Outcome::Clear) > 50);
    });
}

/// The counts after one row, the first that `pick` takes, has been falsified.
fn falsified(
    pick: impl Fn(&TracedRay) -> bool,
    falsify: impl Fn(&mut TracedRay),
) -> [Comparison; 2] {
    with(|reference, mut rows| {
        let i = rows.iter().position(pick).expect("such a row");
        falsify(&mut rows[i]);
        [
            replay(reference, &rows, &ALL),
            independent(reference, &view(reference.scene()), &rows, &ALL),
        ]
    })
}

fn hit_of(wanted: u64) -> impl Fn(&TracedRay) -> bool {
    move |r| matches!(r.outcome, Outcome::Hit { instance, .. } if instance == wanted)
}

#[test]
fn wrong_hits() {
    for both in [
        falsified(hit_of(0), |r| r.outcome = Outcome::Miss),
        falsified(
            |r| r.outcome == Outcome::Miss,
            |r| {
                r.outcome = Outcome::Hit {
                    t: 5.0,
                    instance: 0,
                    primitive: 0,
                    normal: [0.0, 0.0, 1.0],
                }
            },
        ),
    ] {
        for c in both {
            assert_eq!((c.counts.wrong_hit, c.counts.wrong()), (1, 1));
            assert_eq!(c.mismatches.len(), 1);
            let text = c.mismatches[0].to_string();
            assert!(
                text.contains("WrongHit") && text.contains("reference"),
                "{text}"
            );
        }
    }
}

#[test]
fn wrong_ids() {
    let change = |f: fn(&mut f64, &mut u64, &mut u32)| {
        move |r: &mut TracedRay| {
            if let Outcome::Hit {
                t,
                instance,
                primitive,
                ..
            } = &mut r.outcome
            {
                f(t, instance, primitive)
            }
        }
    };
    for both in [
        falsified(hit_of(0), change(|_, instance, _| *instance = 1)),
        falsified(hit_of(0), change(|_, instance, _| *instance = 999)),
        falsified(hit_of(2), change(|_, _, primitive| *primitive ^= 1)),
        falsified(hit_of(2), change(|_, _, primitive| *primitive = 77)),
        falsified(hit_of(0), change(|t, _, _| *t = f64::NAN)),
    ] {
        for c in both {
            assert_eq!((c.counts.wrong_id, c.counts.wrong()), (1, 1));
            assert!(c.counts.max_rel_t_error.is_finite());
        }
    }
    // The far side of the ball instead of the near one.
    let scene = scene();
    let instances = Instances::of(&scene).expect("small");
    let reference = Reference::new(&scene, &instances).unwrap();
    let mut rows = rows(&reference);
    let row = rows.iter_mut().find(|r| hit_of(0)(r)).expect("the ball");
    let all = reference.crossings(row.org, row.dir.map(f64::from), 0, 0);
    let far = all.iter().map(|c| c.t).fold(0.0, f64::max);
    if let Outcome::Hit { t, .. } = &mut row.outcome {
        assert!(far > *t);
        *t = far;
    }
    let found = replay(&reference, &rows, &ALL);
    assert_eq!((found.counts.wrong_id, found.counts.wrong()), (1, 1));
    let kinds: Vec<_> = found.wrong_kinds.into_iter().collect();
    assert_eq!(kinds, [("sphere for sphere".into(), 1)]);
}

/// The largest f32 stands for a t beyond it (docs/SPEC.md, S58), whatever else the ray
/// crosses nearer to that.
#[test]
fn t_beyond_f32_is_the_largest() {
    let mut b = SceneBuilder::default();
    let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1e40));
    let shape = b.cuboid("", Cuboid { min, max });
    b.instance("", Edge::shape(shape));
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    let reference = Reference::new(&scene, &instances).unwrap();
    let (org, dir) = ([0.0; 3], [0.0, 0.0, 1.0]);
    let hit = reference.nearest(org, dir, f64::INFINITY).unwrap();
    let row = |t: f64| TracedRay {
        outcome: Outcome::Hit {
            t,
            instance: 0,
            primitive: 0,
            normal: hit.normal,
        },
        kind: RayKind::Primary,
        pixel: 0,
        sample: 0,
        depth: 0,
        org,
        dir,
        t_max: f32::INFINITY,
    };
    let wrong = |t: f64, float: Float| {
        let options = VerifyOptions { float, ..ALL };
        replay(&reference, &[row(t)], &options).counts.wrong()
    };
    assert_eq!(wrong(f64::from(f32::MAX), Float::Single), 0);
    assert_eq!(wrong(f64::from(f32::MAX), Float::Double), 1);
    assert_eq!(wrong(1.0, Float::Single), 1);
    assert_eq!(wrong(1e40, Float::Double), 0);
}

#[test]
fn errors_of_t_and_normal() {
    let both = falsified(hit_of(0), |r| {
        if let Outcome::Hit { t, normal, .. } = &mut r.outcome {
            *t *= 1.0 + 1e-6;
            let n = DVec3::from_array(*normal);
            *normal = (n + n.any_orthonormal_vector() * 0.01)
                .normalize()
                .to_array();
        }
    });
    for c in both {
        assert_eq!(c.counts.wrong(), 0);
        assert!((c.counts.max_rel_t_error - 1e-6).abs() < 1e-9);
        assert!((c.counts.max_normal_error_deg - 0.01_f64.atan().to_degrees()).abs() < 1e-9);
    }
}

#[test]
fn wrong_shadows() {
    for (from, to) in [
        (Outcome::Clear, Outcome::Blocked),
        (Outcome::Blocked, Outcome::Clear),
    ] {
        for c in falsified(|r| r.outcome == from, |r| r.outcome = to) {
            assert_eq!((c.counts.wrong_shadow, c.counts.wrong()), (1, 1));
        }
    }
    // A ray that was never traced, where the light is seen.
    let both = falsified(|r| r.outcome == Outcome::Clear, |r| r.depth = 1);
    assert_eq!(both[1].counts.not_traced, 1);
}

#[test]
fn errors_of_t_are_counted_in_the_mode_s_own_units() {
    with(|reference, rows| {
        let off = |float: Float, by: fn(f64) -> f64| {
            let mut rows = rows.clone();
            for row in &mut rows {
                if let Outcome::Hit { t, .. } = &mut row.outcome {
                    *t = by(*t);
                }
            }
            let options = VerifyOptions { float, ..ALL };
            replay(reference, &rows, &options).ulp_errors()
        };
        let three = |x: f64| x.next_up().next_up().next_up();
        let ulps = off(Float::Double, three);
        assert_eq!((ulps.median, ulps.max), (3.0, 3.0));
        // An f32 lies within half a unit of every number.
        let ulps = off(Float::Single, |t| f64::from(t as f32));
        assert!(
            ulps.max <= 0.5 && ulps.max > 0.4 && ulps.median > 0.1,
            "{ulps:?}"
        );
        let ulps = off(Float::Single, |t| f64::from((t as f32).next_up()));
        assert!(ulps.max <= 1.5 && ulps.median > 0.8, "{ulps:?}");
        // One that is far off does not move the median.
        let mut rows = rows.clone();
        let row = rows.iter_mut().find(|r| hit_of(0)(r)).unwrap();
        if let Outcome::Hit { t, .. } = &mut row.outcome {
            *t *= 1.0 + 2.0_f64.powi(-30);
        }
        let ulps = replay(reference, &rows, &ALL).ulp_errors();
        assert!(
            ulps.median == 0.0 && ulps.max >= 2.0_f64.powi(21),
            "{ulps:?}"
        );
    });
}

/// Two planes meet where a ray starts: their t are no f32, and the nearer one to zero
/// lies behind.
#[test]
fn a_t_below_the_mode_s_numbers_is_zero() {
    let mut b = SceneBuilder::default();
    let (min, max) = (
        DVec3::new(-1e-149, -1.0, -1.0),
        DVec3::new(1e-148, 1.0, 1.0),
    );
    let shape = b.cuboid("", Cuboid { min, max });
    b.instance("", Edge::shape(shape));
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    let reference = Reference::new(&scene, &instances).unwrap();
    let (dir, t_max) = ([1.0, 0.0, 0.0], f32::INFINITY);
    let row = |t| TracedRay {
        kind: RayKind::Primary,
        pixel: 0,
        sample: 0,
        depth: 0,
        org: [0.0; 3],
        dir,
        t_max,
        outcome: Outcome::Hit {
            t,
            instance: 0,
            primitive: 0,
            normal: [1.0, 0.0, 0.0],
        },
    };
    let wrong = |float, t| {
        let options = VerifyOptions { float, ..ALL };
        replay(&reference, &[row(t)], &options).counts.wrong_id
    };
    assert_eq!(wrong(Float::Single, 0.0), 0);
    assert_eq!(wrong(Float::Double, 1e-148), 0);
    assert_eq!(wrong(Float::Double, 0.0), 1);
}

#[test]
fn tangents_edges_and_ties_are_settled() {
    with(|reference, _| {
        let row = |org: [f64; 3], outcome| TracedRay {
            kind: RayKind::Reflection,
            pixel: 0,
            sample: 0,
            depth: 1,
            org,
            dir: [0.0, 0.0, -1.0],
            t_max: f32::INFINITY,
            outcome,
        };
        let hit = |t, instance, primitive| Outcome::Hit {
            t,
            instance,
            primitive,
            normal: [0.0, 0.0, 1.0],
        };
        // Past the ball as a tangent: a hit in one point.
        let tangent = [1.0, 1.5, 9.0];
        let mut other = row(tangent, hit(13.0, 2, 1));
        if let Outcome::Hit { normal, .. } = &mut other.outcome {
            // Not asked for.
            *normal = [f64::NAN; 3];
        }
        let trio = [
            row(tangent, hit(9.0, 0, 0)),
            other,
            row(tangent, Outcome::Miss),
        ];
        let c = replay(reference, &trio, &ALL);
        let kinds: Vec<&str> = c.wrong_kinds.keys().map(|kinds| &kinds[..]).collect();
        assert_eq!(kinds, ["mesh for sphere", "nothing for sphere"]);
        let c = c.counts;
        assert_eq!((c.wrong_id, c.wrong_hit, c.undecided), (1, 1, 0));
        // Between triangles: the lower one, no crack.
        let diagonal = [4.0, 2.0, 9.0];
        let trio = [
            row(diagonal, hit(13.0, 2, 0)),
            row(diagonal, hit(13.0, 2, 1)),
            row(diagonal, Outcome::Miss),
        ];
        let c = replay(reference, &trio, &ALL).counts;
        assert_eq!((c.wrong_id, c.wrong_hit, c.undecided), (1, 1, 0));
        // At an edge of the box the normal of either face will do.
        let mut edge = row([-4.0, 1.0, 0.0], hit(1.0, 1, 0));
        edge.dir = [2.0, -1.0, 0.0];
        for normal in [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
            if let Outcome::Hit { normal: n, .. } = &mut edge.outcome {
                *n = normal;
            }
            let c = replay(reference, &[edge], &ALL).counts;
            assert_eq!((c.wrong(), c.max_normal_error_deg), (0, 0.0));
        }
    });
}

#[test]
fn sampling_listing_and_threads() {
    with(|reference, mut rows| {
        for row in &mut rows {
            if row.outcome == Outcome::Miss {
                row.outcome = Outcome::Clear;
            }
            row.outcome = match row.outcome {
                Outcome::Clear => Outcome::Blocked,
                Outcome::Blocked => Outcome::Clear,
                other => other,
            };
        }
        let options = VerifyOptions {
            sample: 7,
            list: 3,
            ..ALL
        };
        let sampled = replay(reference, &rows, &options);
        let kept = rows.iter().filter(|r| r.pixel % 7 == 0).count();
        assert_eq!(sampled.counts.rays, kept as u64);
        assert_eq!(sampled.mismatches.len(), 3);
        assert!(sampled.mismatches.iter().all(|m| m.ray.pixel % 7 == 0));
        let none = VerifyOptions {
            sample: 0,
            list: 0,
            ..ALL
        };
        assert_eq!(
            replay(reference, &rows, &none).counts.rays,
            rows.len() as u64
        );

        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let alone = one.install(|| replay(reference, &rows, &ALL));
        let many = replay(reference, &rows, &ALL);
        assert_eq!(alone.counts, many.counts);
        let text = |c: &Comparison| {
            c.mismatches
                .iter()
                .map(|m| m.to_string())
                .collect::<Vec<_>>()
        };
        assert_eq!(text(&alone), text(&many));
        assert_eq!(many.mismatches.len(), 20);
        assert!(many.mismatches.is_sorted_by_key(|m| m.ray.pixel));
    });
}

#[test]
fn a_comparison_counts_its_tiles_and_stops_when_asked_to() {
    use std::sync::atomic::Ordering::Relaxed;
    with(|reference, rows| {
        let view = view(reference.scene());
        let progress = Progress::default();
        let all = verify::replay(reference, &rows, &ALL, &progress).unwrap();
        let tiles = progress.tiles.load(Relaxed);
        assert!(tiles > 10, "too few to show progress: {tiles}");
        assert_eq!(progress.tiles_done.load(Relaxed), tiles);
        assert_eq!(progress.rays.load(Relaxed), all.counts.rays);
        let own = verify::independent(reference, &view, &rows, &ALL, &progress).unwrap();
        let tiles = progress.tiles.load(Relaxed);
        assert_eq!(progress.tiles_done.load(Relaxed), tiles);
        assert_eq!(progress.rays.load(Relaxed), own.counts.rays);

        progress.cancel();
        let replayed = verify::replay(reference, &rows, &ALL, &progress);
        assert_eq!(replayed.err(), Some(Interrupted));
        let own = verify::independent(reference, &view, &rows, &ALL, &progress);
        assert_eq!(own.err(), Some(Interrupted));
        assert_eq!(progress.rays.load(Relaxed), 0);
    });
}

/// A ray that begins and ends within roundings of a gyroid: of the two crossings either may count,
/// and what counts must still be one of them.
#[test]
fn a_ray_may_begin_and_end_on_a_level_set() {
    let text = "format = 1\n[shape.gyroid]\n\
                implicit = \"sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)\"\nopen = true\n\
                clip.sphere = { center = [0, 0, 0], radius = 6 }\n\
                [[instance]]\nshape = \"gyroid\"\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gyroid.toml");
    std::fs::write(&path, text).unwrap();
    let loaded = load(&path, &LoadOptions::default()).unwrap();
    let instances = Instances::of(&loaded.scene).unwrap();
    let reference = &Reference::new(&loaded.scene, &instances).unwrap();
    let row = |t, t_max| TracedRay {
        kind: RayKind::Primary,
        pixel: 0,
        sample: 0,
        depth: 0,
        org: [
            -2.8664484520422797,
            -0.27003278341544057,
            3.1364812354577203,
        ],
        dir: [5.261877363140163, 3.48741840153586, 1.0626980638412218],
        t_max,
        outcome: Outcome::Hit {
            t,
            instance: 0,
            primitive: 0,
            normal: [f64::NAN; 3],
        },
    };
    let counts = |row| replay(reference, &[row], &ALL).counts;
    let right = counts(row(1.0, 1.0));
    assert_eq!((right.wrong(), right.undecided), (0, 1));
    for t in [0.5, 0.999] {
        assert_eq!(counts(row(t, 1.0)).wrong(), 1, "{t}");
    }
}
