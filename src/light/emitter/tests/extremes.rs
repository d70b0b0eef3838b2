//! Nothing is NaN, and degenerate emitters are left out.

use super::*;
use lanecast_model::scene::Falloff;

fn assert_sane(emitters: &Emitters, point: DVec3, normal: DVec3, u: [f32; 3], what: &Body) {
    let sample = sample(emitters, point, normal, u);
    let dir = DVec3::from(sample.dir);
    assert!(dir.is_finite(), "{what:?} from {point}: {sample:?}");
    assert!(
        sample.pdf > 0.0 && sample.pdf.is_finite(),
        "{what:?} from {point}: {sample:?}"
    );
    assert!(
        sample.radiance.iter().all(|x| x.is_finite()),
        "{what:?} from {point}: {sample:?}"
    );
    if sample.some {
        assert!(dir != DVec3::ZERO);
        let pdf = emitters.pdf::<f32>([0], point.into(), single(normal), sample.dir);
        assert!(
            pdf >= 0.0 && pdf.is_finite(),
            "{what:?} from {point}: {pdf}"
        );
    }
}

#[test]
fn no_place_and_no_size_gives_a_nan() {
    let mut random = Random(99);
    for round in 0..40_000 {
        let scale = |random: &mut Random, most: f64| libm::exp10(random.signed() * most);
        let size = scale(&mut random, if round % 2 == 0 { 3.0 } else { 16.0 });
        let far = scale(&mut random, if round % 3 == 0 { 2.0 } else { 16.0 });
        let at = random.vector() * far;
        let (a, b) = (random.vector() * size, random.vector() * size);
        let body = match round % 7 {
            0 => Body::Sphere {
                center: at,
                radius: size,
            },
            1 => Body::Triangle([at, at + a, at + b]),
            2 => Body::Rectangle {
                corner: at,
                u: a,
                v: a.cross(b).normalize() * size,
            },
            3 => Body::Point {
                position: at,
                radius: size,
                falloff: Falloff::None,
            },
            4 => Body::Panel {
                corner: at,
                u: a,
                v: a.cross(b).normalize() * size,
                two_sided: round % 2 == 0,
            },
            5 => Body::Disc {
                center: at,
                normal: a.normalize_or_zero(),
                radius: size,
                two_sided: round % 2 == 0,
            },
            _ => Body::Spot {
                position: at,
                direction: a,
                inner: 0.1,
                outer: 0.2,
                radius: size,
            },
        };
        let emitters = only(body);
        // On the body, in its plane, at its corner and middle, and anywhere.
        let points = [
            at,
            at + a,
            at + a * 0.5,
            at + a * 0.25 + b * 0.25,
            at + a.normalize() * size,
            at + a * 3.0,
            DVec3::ZERO,
            random.vector(),
        ];
        for point in points {
            for normal in [DVec3::ZERO, random.unit()] {
                let u = match round % 7 {
                    0 => [0.0; 3],
                    1 => [1.0 - f32::EPSILON / 2.0; 3],
                    2 => [0.0, 0.0, 1.0 - f32::EPSILON / 2.0],
                    _ => [random.next(), random.next(), random.next()],
                };
                assert_sane(&emitters, point, normal, u, &body);
            }
        }
    }
}

#[test]
fn degenerate_and_black_emitters_are_never_sampled() {
    let p = DVec3::new(1.0, 2.0, 3.0);
    let bodies = [
        Body::Triangle([p, p, p]),
        Body::Triangle([p, p * 2.0, p * 3.0]),
        Body::Sphere {
            center: p,
            radius: 0.0,
        },
        Body::Rectangle {
            corner: p,
            u: p,
            v: DVec3::ZERO,
        },
        Body::Sphere {
            center: p * f64::INFINITY,
            radius: 1.0,
        },
        Body::Triangle([p, p * f64::NAN, p * 3.0]),
        Body::Sun {
            towards: DVec3::ZERO,
            angle: 0.0,
        },
    ];
    let black = Emitter {
        body: Body::Sphere {
            center: p,
            radius: 1.0,
        },
        light: [0.0; 3],
    };
    let mut list: Vec<Emitter> = bodies.into_iter().map(white).collect();
    list.push(black);
    let emitters = Emitters::new(list.clone(), None, [1.0; 3]);
    assert!(emitters.is_empty());
    assert!(!sample(&emitters, DVec3::ZERO, DVec3::Z, [0.5; 3]).some);
    assert_eq!(
        emitters.sky::<f32>(single(DVec3::Z), p.into(), single(DVec3::Z)),
        ([1.0; 3], 0.0)
    );
    // A good one among them keeps its id.
    list.push(white(Body::Sphere {
        center: p,
        radius: 1.0,
    }));
    let emitters = Emitters::new(list, None, [1.0; 3]);
    let found = sample(&emitters, DVec3::ZERO, DVec3::Z, [0.5; 3]);
    assert!(found.some && found.emitter == [8]);
}

#[test]
fn no_light_comes_from_behind_the_surface() {
    let sphere = only(Body::Sphere {
        center: DVec3::new(0.0, 0.0, -3.0),
        radius: 1.0,
    });
    let two = Emitters::new(
        vec![
            white(Body::Sphere {
                center: DVec3::new(0.0, 0.0, -3.0),
                radius: 1.0,
            });
            2
        ],
        None,
        [0.0; 3],
    );
    assert!(!sample(&two, DVec3::ZERO, DVec3::Z, [0.5; 3]).some);
    assert!(sample(&two, DVec3::ZERO, DVec3::ZERO, [0.5; 3]).some);
    assert!(sample(&sphere, DVec3::ZERO, DVec3::NEG_Z, [0.5; 3]).some);
}
