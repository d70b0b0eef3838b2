//! Irradiances without obstacles against closed forms.

use super::*;
use crate::environment::Compensation;
use lanecast_model::scene::{Environment, Falloff};

/// Returns the irradiance at a point with this normal, estimated with n samples.
fn irradiance(emitters: &Emitters, point: DVec3, normal: DVec3, n: u32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n {
        let sample = sample(emitters, point, normal, numbers(i));
        if sample.some {
            let cos = DVec3::from(sample.dir).normalize().dot(normal).max(0.0);
            sum += f64::from(sample.radiance[1]) * cos / f64::from(sample.pdf);
        }
    }
    sum / f64::from(n)
}

fn assert_near(found: f64, expected: f64, relative: f64) {
    let apart = (found / expected - 1.0).abs();
    assert!(apart < relative, "{found}, not {expected}");
}

/// Lambert's formula: ½ Σ Θᵢ n·Γᵢ over the edges of a polygon above the horizon.
fn lambert(corners: &[DVec3], point: DVec3, normal: DVec3) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(&a, &b)| {
        let (a, b) = (a - point, b - point);
        a.angle_between(b) * a.cross(b).normalize().dot(normal)
    });
    (0.5 * edges.sum::<f64>()).abs()
}

#[test]
fn a_square_gives_its_form_factor() {
    let square = only(Body::Rectangle {
        corner: DVec3::new(-1.0, -1.0, 1.0),
        u: DVec3::X * 2.0,
        v: DVec3::Y * 2.0,
    });
    let found = irradiance(&square, DVec3::ZERO, DVec3::Z, 1 << 16);
    assert_near(found, PI * 0.554_126_424_0, 1e-5);
}

#[test]
fn polygons_give_lamberts_formula() {
    let corners = [
        DVec3::new(0.3, 0.2, 0.5),
        DVec3::new(1.5, 0.4, 0.9),
        DVec3::new(0.5, 1.8, 0.7),
    ];
    let triangle = only(Body::Triangle(corners));
    for point in [
        DVec3::ZERO,
        DVec3::new(0.7, 0.6, 0.3),
        DVec3::new(-4.0, 3.0, 0.1),
    ] {
        let expected = lambert(&corners, point, DVec3::Z);
        assert_near(
            irradiance(&triangle, point, DVec3::Z, 1 << 16),
            expected,
            1e-4,
        );
    }
    let (corner, u, v) = (
        DVec3::new(0.5, -0.5, 0.2),
        DVec3::X,
        DVec3::new(0.0, 1.0, 1.0),
    );
    let rectangle = only(Body::Rectangle { corner, u, v });
    let corners = [corner, corner + u, corner + u + v, corner + v];
    for point in [
        DVec3::ZERO,
        DVec3::new(1.0, 0.1, 0.1),
        DVec3::new(60.0, 3.0, 0.0),
    ] {
        let expected = lambert(&corners, point, DVec3::Z);
        assert_near(
            irradiance(&rectangle, point, DVec3::Z, 1 << 16),
            expected,
            1e-4,
        );
    }
}

#[test]
fn spheres_give_the_square_of_their_sine() {
    for (radius, center) in [
        (1.0, DVec3::new(0.0, 1.0, 2.0)),
        (1e-6, DVec3::new(3.0, 1.0, 2.0)),
        (1.999, DVec3::new(0.0, 0.0, 2.0)),
    ] {
        let cos = center.normalize().z;
        let expected = PI * (radius / center.length()).powi(2) * cos;
        let sphere = only(Body::Sphere { center, radius });
        assert_near(
            irradiance(&sphere, DVec3::ZERO, DVec3::Z, 1 << 18),
            expected,
            1e-4,
        );
    }
    // Any point inside sees radiance 1 everywhere.
    let sphere = only(Body::Sphere {
        center: DVec3::new(0.4, 0.2, 0.1),
        radius: 1.0,
    });
    assert_near(
        irradiance(&sphere, DVec3::ZERO, DVec3::Z, 1 << 18),
        PI,
        2e-3,
    );
}

#[test]
fn points_and_balls_give_intensity_over_squared_distance() {
    let position = DVec3::new(1.0, 2.0, 2.0);
    let cos = 2.0 / 3.0;
    for radius in [0.0, 1e-30, 1e-3, 1.5] {
        let point = |falloff| Body::Point {
            position,
            radius,
            falloff,
        };
        let lamp = only(point(Falloff::InverseSquare));
        assert_near(
            irradiance(&lamp, DVec3::ZERO, DVec3::Z, 1 << 14),
            cos / 9.0,
            2e-4,
        );
        let lamp = only(point(Falloff::None));
        assert_near(irradiance(&lamp, DVec3::ZERO, DVec3::Z, 1 << 14), cos, 2e-4);
        // In the middle of a spot light's cone, and half way between the cones.
        let spot = |direction| Body::Spot {
            position,
            direction,
            inner: 0.2,
            outer: 0.4,
            radius,
        };
        let lamp = only(spot(-position));
        assert_near(
            irradiance(&lamp, DVec3::ZERO, DVec3::Z, 1 << 14),
            cos / 9.0,
            2e-4,
        );
        let half = ((0.2_f64.cos() + 0.4_f64.cos()) / 2.0).acos();
        let across = position.normalize().any_orthonormal_vector() * position.length() * half.tan();
        let lamp = only(spot(-position + across));
        assert_near(
            irradiance(&lamp, DVec3::ZERO, DVec3::Z, 1 << 14),
            cos / 36.0,
            2e-4,
        );
        let lamp = only(spot(position));
        assert_eq!(irradiance(&lamp, DVec3::ZERO, DVec3::Z, 64), 0.0);
    }
}

#[test]
fn suns_give_their_irradiance() {
    let towards = DVec3::new(1.0, 0.0, 1.0);
    for angle in [0.0, 1e-5, 0.004_65, 0.5] {
        let sun = only(Body::Sun { towards, angle });
        let found = irradiance(&sun, DVec3::ZERO, DVec3::Z, 1 << 14);
        assert_near(found, 0.5_f64.sqrt(), 2e-4);
    }
}

#[test]
fn many_kinds_add_up() {
    let corners = [
        DVec3::new(0.3, 0.2, 0.5),
        DVec3::new(1.5, 0.4, 0.9),
        DVec3::new(0.5, 1.8, 0.7),
    ];
    let mut bodies = vec![
        Body::Triangle(corners),
        Body::Sphere {
            center: DVec3::new(-1.0, 1.0, 2.0),
            radius: 0.5,
        },
        Body::Point {
            position: DVec3::new(0.0, -1.0, 1.0),
            radius: 0.0,
            falloff: Falloff::InverseSquare,
        },
        Body::Sun {
            towards: DVec3::new(1.0, 0.0, 1.0),
            angle: 0.1,
        },
        Body::Sun {
            towards: DVec3::new(1.0, 0.05, 1.0),
            angle: 0.1,
        },
        Body::Sun {
            towards: DVec3::new(0.0, -1.0, 1.0),
            angle: 0.0,
        },
    ];
    let alone = |body: &Body| irradiance(&only(*body), DVec3::ZERO, DVec3::Z, 1 << 16);
    let expected: f64 = bodies.iter().map(alone).sum();
    // Below the horizon.
    bodies.push(Body::Sphere {
        center: DVec3::new(-1.0, 1.0, -2.0),
        radius: 0.5,
    });
    let all = Emitters::new(bodies.into_iter().map(white).collect(), None, [0.0; 3]);
    assert_near(
        irradiance(&all, DVec3::ZERO, DVec3::Z, 1 << 18),
        expected,
        1e-3,
    );
}

#[test]
fn an_environment_adds_to_lamps_and_suns() {
    let sky = gradient();
    let lamps = [
        white(Body::Sun {
            towards: DVec3::new(1.0, 0.3, 2.0),
            angle: 0.05,
        }),
        white(Body::Sphere {
            center: DVec3::new(1.0, 1.0, 3.0),
            radius: 1.0,
        }),
    ];
    let alone = |lamps: Vec<Emitter>, sky: Option<&Environment>| {
        let all = Emitters::with_compensation(lamps, sky, [0.0; 3], Compensation::Plain);
        irradiance(&all, DVec3::ZERO, DVec3::Z, 1 << 18)
    };
    let each = lamps.iter().map(|&lamp| alone(vec![lamp], None));
    let expected = each.sum::<f64>() + alone(vec![], Some(&sky));
    assert_near(alone(lamps.to_vec(), Some(&sky)), expected, 2e-3);
    // Radiance 1 + z over the floor z = 0: π(1 + 2/3).
    assert_near(alone(vec![], Some(&sky)), PI * (1.0 + 2.0 / 3.0), 3e-4);
}

#[test]
fn compensated_sampling_and_bsdf_sampling_make_the_whole() {
    let all = Emitters::new(vec![], Some(&gradient()), [0.0; 3]);
    let (point, normal) = (DVec3::ZERO, DVec3::Z);
    let n = 1 << 17;
    let (mut lit, mut found) = (0.0, 0.0);
    for i in 0..n {
        let sample = sample(&all, point, normal, numbers(i));
        let cos = DVec3::from(sample.dir).normalize().dot(normal).max(0.0);
        if sample.some && cos > 0.0 {
            let both = f64::from(sample.pdf) + cos / PI;
            lit += f64::from(sample.radiance[0]) * cos / both;
        }
        let [_, u, v] = numbers(i + 7);
        let (s, c) = (f64::from(u) * TAU).sin_cos();
        let radius = f64::from(v).sqrt();
        let dir = DVec3::new(radius * c, radius * s, (1.0 - f64::from(v)).sqrt());
        let (radiance, pdf) = all.sky::<f32>(single(dir), point.into(), single(normal));
        let both = f64::from(pdf) + dir.z / PI;
        found += f64::from(radiance[0]) * dir.z / both;
    }
    assert!(lit > 0.1 * found, "the compensated part is sampled");
    assert_near((lit + found) / f64::from(n), PI * (1.0 + 2.0 / 3.0), 1e-3);
}

/// A sky of radiance 1 + z above the floor z = 0, and 1 below.
pub fn gradient() -> Environment {
    let (width, height) = (512_u32, 256_u32);
    let pixel = |k: u32| {
        let (x, y) = (f64::from(k % width) + 0.5, f64::from(k / width) + 0.5);
        let longitude = (x / f64::from(width) - 0.5) * TAU;
        let z = -(y / f64::from(height) * PI).sin() * longitude.cos();
        [(1.0 + z.max(0.0)) as f32; 3]
    };
    Environment {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        rotation: 0.0,
        scale: [1.0; 3],
    }
}

#[test]
fn a_disc_gives_its_form_factor_and_one_side_is_dark() {
    for two_sided in [false, true] {
        for (height, radius) in [(1.0, 1.0), (0.05, 2.0), (100.0, 0.3)] {
            let disc = only(Body::Disc {
                center: DVec3::Z * height,
                normal: DVec3::NEG_Z,
                radius,
                two_sided,
            });
            // π·sin² of the half angle, over its axis.
            let expected = PI * radius * radius / (radius * radius + height * height);
            let found = irradiance(&disc, DVec3::ZERO, DVec3::Z, 1 << 16);
            assert_near(found, expected, 2e-3);
            let above = DVec3::Z * (2.0 * height);
            let behind = irradiance(&disc, above, DVec3::NEG_Z, 1 << 16);
            match two_sided {
                true => assert_near(behind, expected, 2e-3),
                false => assert_eq!(behind, 0.0),
            }
        }
    }
}

#[test]
fn panels_bring_as_much_as_rectangles() {
    let (corner, u, v) = (DVec3::new(-1.0, -1.0, 1.0), DVec3::X * 2.0, DVec3::Y * 2.0);
    let rectangle = only(Body::Rectangle { corner, u, v });
    let expected = irradiance(&rectangle, DVec3::ZERO, DVec3::Z, 1 << 12);
    // It shines along u × v, up, and the point is below.
    for (two_sided, u, v, shines) in [
        (false, u, v, false),
        (false, v, u, true),
        (true, u, v, true),
    ] {
        let panel = only(Body::Panel {
            corner,
            u,
            v,
            two_sided,
        });
        let found = irradiance(&panel, DVec3::ZERO, DVec3::Z, 1 << 12);
        match shines {
            true => assert_near(found, expected, 1e-3),
            false => assert_eq!(found, 0.0),
        }
        // A ray meets it where it shines, and not behind something nearer.
        let met = |before| panel.panels_on(DVec3::ZERO, DVec3::Z * 0.5, before).next();
        assert_eq!(met(9.0), shines.then_some((0, 2.0, [1.0; 3])));
        assert_eq!(met(1.5), None);
        let aside = DVec3::new(1.5, 0.0, 1.0);
        assert_eq!(panel.panels_on(DVec3::ZERO, aside, 9.0).next(), None);
    }
}
