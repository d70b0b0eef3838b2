//! Samples follow their densities, densities integrate to 1, and both sides agree on them.

use super::*;

/// Bodies and points from which they are seen, with the cones that bound them there.
fn cases() -> Vec<(String, Body, DVec3, DVec3, f64)> {
    let mut cases = Vec::new();
    let mut add = |name: &str, body: Body, point: DVec3| {
        let (center, radius) = match body {
            Body::Sphere { center, radius } => (center, radius),
            Body::Point {
                position, radius, ..
            } => (position, radius),
            Body::Triangle(corners) => bounding(&corners),
            Body::Rectangle { corner, u, v } | Body::Panel { corner, u, v, .. } => {
                bounding(&[corner, corner + u, corner + v, corner + u + v])
            }
            Body::Disc { center, radius, .. } => (center, radius),
            Body::Sun { towards, angle } => (point + towards, angle.sin()),
            Body::Spot { .. } => unreachable!(),
        };
        let (axis, angle) = cone(center, radius * 1.000_001, point);
        cases.push((name.into(), body, point, axis, angle));
    };
    let sphere = |radius| Body::Sphere {
        center: DVec3::new(1.0, 2.0, 3.0),
        radius,
    };
    add("sphere", sphere(1.0), DVec3::ZERO);
    add("tiny sphere", sphere(1e-9), DVec3::ZERO);
    add(
        "large sphere",
        sphere(14.0_f64.sqrt() * 0.9999),
        DVec3::ZERO,
    );
    add("sphere from inside", sphere(6.0), DVec3::ZERO);
    add(
        "sphere from its centre",
        sphere(2.0),
        DVec3::new(1.0, 2.0, 3.0),
    );
    let ball = |falloff| Body::Point {
        position: DVec3::new(-3.0, 1.0, 0.5),
        radius: 0.75,
        falloff,
    };
    add(
        "ball",
        ball(lanecast_model::scene::Falloff::InverseSquare),
        DVec3::ZERO,
    );
    add(
        "sun",
        Body::Sun {
            towards: DVec3::new(0.3, -0.2, 1.0).normalize(),
            angle: 0.004_65,
        },
        DVec3::ONE,
    );
    add(
        "wide sun",
        Body::Sun {
            towards: DVec3::NEG_Z,
            angle: 1.2,
        },
        DVec3::ONE,
    );
    let triangle = |s: f64| {
        let corner = |x, y, z| DVec3::new(x, y, z);
        Body::Triangle([
            corner(0.0, 0.0, 1.0),
            corner(s, 0.0, 1.0),
            corner(s / 3.0, s / 2.0, 1.0 + s / 4.0),
        ])
    };
    add("triangle", triangle(1.0), DVec3::new(0.2, -0.3, 0.0));
    add("far triangle", triangle(1e-3), DVec3::new(0.2, -0.3, 0.0));
    add("tiny triangle", triangle(1e-7), DVec3::new(0.2, -0.3, 0.0));
    add("near triangle", triangle(1.0), DVec3::new(0.4, 0.2, 1.09));
    add(
        "very near triangle",
        triangle(1.0),
        DVec3::new(0.4, 0.2, 1.0999),
    );
    add(
        "triangle from behind",
        triangle(1.0),
        DVec3::new(0.4, 0.2, 2.0),
    );
    add(
        "grazed triangle",
        triangle(1.0),
        DVec3::new(-0.5, 0.2, 1.25),
    );
    let rectangle = |s: f64| Body::Rectangle {
        corner: DVec3::new(-s / 3.0, 1.0, -s / 3.0),
        u: DVec3::new(s, 0.0, 0.0),
        v: DVec3::new(0.0, 0.1 * s, 0.5 * s),
    };
    add("rectangle", rectangle(1.0), DVec3::ZERO);
    add(
        "rectangle seen aslant",
        rectangle(1.0),
        DVec3::new(2.0, 0.5, 1.0),
    );
    add(
        "rectangle from above",
        rectangle(1.0),
        DVec3::new(0.1, 2.0, 0.0),
    );
    add("far rectangle", rectangle(0.1), DVec3::ZERO);
    add("farther rectangle", rectangle(0.04), DVec3::ZERO);
    add("near rectangle", rectangle(1.0), DVec3::new(0.1, 1.0, 0.0));
    add(
        "very near rectangle",
        rectangle(1.0),
        DVec3::new(0.1, 1.022, -0.05),
    );
    add(
        "grazed rectangle",
        rectangle(1.0),
        DVec3::new(-0.6, 1.2, 0.0),
    );
    let panel = |two_sided| Body::Panel {
        corner: DVec3::new(-0.5, 1.0, -0.25),
        u: DVec3::new(1.0, 0.0, 0.0),
        v: DVec3::new(0.0, 0.1, 0.5),
        two_sided,
    };
    add("panel", panel(false), DVec3::ZERO);
    add("panel from behind", panel(true), DVec3::new(0.3, 2.0, 0.0));
    let disc = |radius, two_sided| Body::Disc {
        center: DVec3::new(0.5, 2.0, 0.0),
        normal: DVec3::new(0.6, -0.8, 0.0),
        radius,
        two_sided,
    };
    add("disc", disc(1.0, false), DVec3::ZERO);
    add("tiny disc", disc(1e-7, false), DVec3::ZERO);
    add("wide disc", disc(5.0, false), DVec3::ZERO);
    add("near disc", disc(1.0, false), DVec3::new(0.0, 1.6, 0.1));
    add(
        "disc from behind",
        disc(1.0, true),
        DVec3::new(0.0, 4.0, 0.0),
    );
    cases
}

fn bounding(corners: &[DVec3]) -> (DVec3, f64) {
    let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let far = corners.iter().map(|c| c.distance(center));
    (center, far.fold(0.0, f64::max))
}

fn density(emitters: &Emitters, body: &Body, point: DVec3, dir: DVec3) -> f64 {
    let met = crossings(body, point, dir);
    let each = met.iter().map(|&to| match body {
        Body::Sun { .. } => f64::from(
            emitters
                .sky::<f32>(single(dir), point.into(), single(DVec3::ZERO))
                .1,
        ),
        // Balls have no ray that meets them; their density is that of the sphere.
        &Body::Point {
            position, radius, ..
        } => {
            let sphere = only(Body::Sphere {
                center: position,
                radius,
            });
            f64::from(sphere.pdf::<f32>([0], point.into(), single(DVec3::ZERO), to.into()))
        }
        _ => f64::from(emitters.pdf::<f32>([0], point.into(), single(DVec3::ZERO), to.into())),
    });
    each.sum()
}

/// Says whether a disc is sampled by the square around it.
fn is_wide_disc(body: &Body, point: DVec3) -> bool {
    match *body {
        Body::Disc { center, radius, .. } => point.distance(center) < 1.9 * radius,
        _ => false,
    }
}

#[test]
fn samples_follow_densities_that_sum_to_one() {
    for (name, body, point, axis, angle) in cases() {
        let emitters = only(body);
        let grid = Grid::new(axis, angle, 10);
        let density = |dir| density(&emitters, &body, point, dir);
        match is_wide_disc(&body, point) {
            true => {
                let share = assert_share_follows(&name, &emitters, point, &grid, 100, density);
                assert!((0.7..1.0).contains(&share), "{name}: {share}");
            }
            false => assert_follows(&name, &emitters, point, &grid, 100, density),
        }
    }
}

#[test]
fn rays_get_the_density_of_samples() {
    let mut random = Random(7);
    for (name, body, point, ..) in cases() {
        if matches!(body, Body::Point { .. }) {
            continue;
        }
        let emitters = only(body);
        for _ in 0..2000 {
            let u = [random.next(), random.next(), random.next()];
            let sample = sample(&emitters, point, DVec3::ZERO, u);
            if !sample.some && is_wide_disc(&body, point) {
                continue;
            }
            assert!(sample.some, "{name}");
            let normal = single(DVec3::ZERO);
            let pdf = match body {
                Body::Sun { .. } => {
                    let dir = single(sample.dir.into());
                    emitters.sky::<f32>(dir, point.into(), normal).1
                }
                _ => emitters.pdf::<f32>([0], point.into(), normal, sample.dir),
            };
            let apart = (pdf / sample.pdf - 1.0).abs();
            assert!(
                apart < 1e-4 || (name == "sun" && pdf == 0.0),
                "{name}: {pdf} for {}",
                sample.pdf
            );
        }
    }
}

#[test]
fn samples_lie_on_their_bodies() {
    let mut random = Random(3);
    for (name, body, point, ..) in cases() {
        let emitters = only(body);
        for _ in 0..2000 {
            let u = [random.next(), random.next(), random.next()];
            let sample = sample(&emitters, point, DVec3::ZERO, u);
            if !sample.some {
                assert!(is_wide_disc(&body, point), "{name}");
                continue;
            }
            let dir = DVec3::from(sample.dir);
            let at = point + dir;
            let off = match body {
                Body::Sphere { center, radius }
                | Body::Point {
                    position: center,
                    radius,
                    ..
                } => (at.distance(center) - radius) / point.distance(center).max(radius),
                Body::Triangle([p, q, r]) => (at - p).dot((q - p).cross(r - p).normalize()),
                Body::Rectangle { corner, u, v } | Body::Panel { corner, u, v, .. } => {
                    (at - corner).dot(u.cross(v).normalize())
                }
                Body::Disc {
                    center,
                    normal,
                    radius,
                    ..
                } => {
                    assert!(at.distance(center) <= radius * (1.0 + 1e-6), "{name}");
                    (at - center).dot(normal)
                }
                Body::Sun { .. } => dir.length() - 1.0,
                Body::Spot { .. } => unreachable!(),
            };
            assert!(off.abs() < 1e-7, "{name}: {off}");
        }
    }
}
