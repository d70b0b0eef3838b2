//! Radiance by closed formulas, within 1e-4 or three standard errors. Each scene is seen through
//! a tiny window, so that all pixels show one radiance; their spread gives the standard error.

use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::render::Integrator;
use lanecast::internals::scene::{Environment, Falloff, Layers, Model};
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, RenderConfig, Scene, SceneBuilder, Tracer, TracerOptions,
};
use std::f64::consts::PI;

/// The side of the window's picture: its pixels times samples make 2^18 paths.
const SIDE: u32 = 4;
const SPP: u32 = 16_384;

fn lambert(albedo: f32) -> Material {
    Material {
        model: Model::Phong {
            diffuse: [albedo; 3],
            specular: [0.0; 3],
            exponent: 1.0,
            mirror: [0.0; 3],
        },
        ..Material::default()
    }
}

fn shining(radiance: f32, albedo: f32) -> Material {
    Material {
        emission: [radiance; 3],
        ..lambert(albedo)
    }
}

/// A window on a point, from a little above it.
fn window(scene: &mut SceneBuilder, eye: DVec3, at: DVec3) {
    scene.camera("", Camera::orthographic(eye, at, DVec3::X, 1e-6));
}

/// Returns the mean of the window's radiance, and its standard error.
fn seen(scene: &Scene, max_depth: u32) -> (f64, f64) {
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    let config = RenderConfig {
        width: SIDE,
        height: SIDE,
        spp: SPP,
        integrator: Integrator::Path,
        filter: FilterKind::Box,
        max_depth,
        ..RenderConfig::default()
    };
    let picture = tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    for color in &picture.color {
        assert!(color.iter().all(|c| *c >= 0.0 && c.is_finite()));
        assert_eq!([color[0]; 3], *color, "the scene is grey");
    }
    let values = || picture.color.iter().map(|color| f64::from(color[0]));
    let count = f64::from(SIDE * SIDE);
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

#[track_caller]
fn check(name: &str, scene: SceneBuilder, max_depth: u32, expected: f64) {
    check_within(1e-4, name, scene, max_depth, expected);
}

/// As [`check`], where Russian roulette makes noise that this many paths do not bring below 1e-4.
#[track_caller]
fn check_within(part: f64, name: &str, scene: SceneBuilder, max_depth: u32, expected: f64) {
    let scene = scene.finish().unwrap();
    let (mean, error) = seen(&scene, max_depth);
    println!("{name}: {mean:.7} ± {error:.1e}, formula {expected:.7}");
    let off = (mean - expected).abs();
    assert!(
        off <= (3.0 * error).min(part * expected.max(1.0)) || off <= 1e-6 * expected,
        "{name}: {mean} ± {error} instead of {expected}"
    );
}

fn floor(scene: &mut SceneBuilder, material: Material) {
    let material = scene.material("floor", material);
    let floor = scene.half_space(
        "floor",
        HalfSpace {
            normal: DVec3::Y,
            offset: 0.0,
        },
    );
    scene.instance("", Edge::shape(floor).material(material));
    window(scene, DVec3::new(0.0, 1e-3, 0.0), DVec3::ZERO);
}

fn polygon(scene: &mut SceneBuilder, points: &[DVec3], material: Material) {
    let material = scene.material("light", material);
    let shape = scene.polygon("light", points, &[]);
    scene.instance("", Edge::shape(shape).material(material));
}

/// Irradiance of a polygon of radiance 1 (Lambert 1760).
fn lambert_1760(points: &[DVec3], normal: DVec3) -> f64 {
    let n = points.len();
    let edge = |i: usize| {
        let (a, b) = (points[i].normalize(), points[(i + 1) % n].normalize());
        let turn = a.dot(b).clamp(-1.0, 1.0).acos();
        turn * a.cross(b).normalize().dot(normal)
    };
    ((0..n).map(edge).sum::<f64>() * 0.5).abs()
}

#[test]
fn a_square_light_above_a_floor() {
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    let at = |x, z| DVec3::new(x, 1.0, z);
    let points = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
    polygon(&mut scene, &points, shining(1.0, 0.0));
    check("square light", scene, 1, 0.5 * 0.5541264240);
}

/// A sheet that is all hole, between a floor and lamps that are met, changes nothing: what is
/// behind it is weighed by the light sampled where the path was scattered.
#[test]
fn a_hole_in_front_of_a_light_is_not_there() {
    for of_table in [false, true] {
        let mut scene = SceneBuilder::default();
        floor(&mut scene, lambert(0.5));
        let square = |height: f64, half: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, z)| DVec3::new(x * half, height, z * half))
        };
        if of_table {
            scene.light(Light::Rectangle {
                center: DVec3::Y,
                edges: [DVec3::X * 2.0, DVec3::Z * 2.0],
                radiance: [1.0; 3],
                two_sided: false,
            });
        } else {
            polygon(&mut scene, &square(1.0, 1.0), shining(1.0, 0.0));
        }
        let hole = Material {
            layers: Layers {
                opacity: 0.0,
                ..Layers::default()
            },
            ..lambert(0.5)
        };
        polygon(&mut scene, &square(0.9, 3.0), hole);
        check("light behind a hole", scene, 3, 0.5 * 0.5541264240);
    }
}

/// Between a floor and a lamp, both inside a medium of index 1 that absorbs, lies a body of
/// another medium that the first displaces: it changes nothing.
#[test]
fn a_displaced_medium_is_not_there() {
    let light = |with_body: bool| {
        let mut scene = SceneBuilder::default();
        floor(&mut scene, lambert(0.5));
        let points = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let points = points.map(|(x, z)| DVec3::new(x, 1.0, z));
        polygon(&mut scene, &points, shining(1.0, 0.0));
        let medium = |ior: f32, priority: i32| Material {
            transmission: 1.0,
            ior,
            layers: Layers {
                priority,
                attenuation_color: [0.5; 3],
                attenuation_distance: 2.0,
                ..Layers::default()
            },
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        };
        let air = scene.material("", medium(1.0, 1));
        let whole = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 50.0,
            },
        );
        scene.instance("", Edge::shape(whole).material(air));
        if with_body {
            let glass = scene.material("", medium(1.5, 0));
            let body = scene.cuboid(
                "",
                Cuboid {
                    min: DVec3::new(-4.0, 0.4, -4.0),
                    max: DVec3::new(4.0, 0.6, 4.0),
                },
            );
            scene.instance("", Edge::shape(body).material(glass));
        }
        seen(&scene.finish().unwrap(), 6)
    };
    let [without, with] = [false, true].map(light);
    // Absorbed over a way of 1 at least.
    assert!(without.0 < 0.5 * 0.5541264240 * 0.5_f64.sqrt());
    assert!(without.0 > 0.15, "{without:?}");
    let error = 3.0 * (without.1 + with.1) + 1e-4;
    assert!((without.0 - with.0).abs() < error, "{without:?}, {with:?}");
}

/// Lights of the table with an area: matte floors see them as they would a body.
#[test]
fn rectangles_and_discs_of_light_above_a_floor() {
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    scene.light(Light::Rectangle {
        center: DVec3::Y,
        edges: [DVec3::X * 2.0, DVec3::Z * 2.0],
        radiance: [2.0; 3],
        two_sided: false,
    });
    // It shines along x × z = -y.
    check("rectangle of light", scene, 1, 0.5541264240);
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    for (height, two_sided, normal) in [
        (1.0, false, -DVec3::Y * 3.0),
        (1.5, false, DVec3::Y),
        (2.0, true, DVec3::Y),
    ] {
        scene.light(Light::Disc {
            center: DVec3::Y * height,
            normal,
            radius: 1.0,
            radiance: [1.0; 3],
            two_sided,
        });
    }
    // The second one shines away from the floor.
    check("discs of light", scene, 1, 0.5 * (1.0 / 2.0 + 1.0 / 5.0));
}

#[test]
fn mirrors_show_rectangles_and_discs_of_light_and_the_camera_does_not() {
    for (direction, expected) in [(-DVec3::Y, 3.0), (DVec3::Y, 0.0)] {
        let mut scene = SceneBuilder::default();
        let mirror = Material {
            model: Model::Phong {
                diffuse: [0.0; 3],
                specular: [0.0; 3],
                exponent: 1.0,
                mirror: [1.0; 3],
            },
            ..Material::default()
        };
        floor(&mut scene, mirror);
        // Between the camera and the floor, and seen in it.
        scene.light(Light::Disc {
            center: DVec3::Y * 5e-4,
            normal: direction,
            radius: 1e-3,
            radiance: [3.0; 3],
            two_sided: false,
        });
        check("mirrored disc", scene, 1, expected);
    }
}

#[test]
fn a_triangle_light_beside_a_floor() {
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.8));
    let points = [
        DVec3::new(0.3, 0.5, 0.2),
        DVec3::new(2.0, 0.7, -1.0),
        DVec3::new(1.0, 2.0, 1.0),
    ];
    polygon(&mut scene, &points, shining(2.0, 0.0));
    let irradiance = 2.0 * lambert_1760(&points, DVec3::Y);
    check("triangle light", scene, 1, 0.8 / PI * irradiance);
}

#[test]
fn a_ball_light_above_a_floor() {
    for (radius, center) in [
        (0.5, DVec3::new(1.0, 2.0, 0.5)),
        (1e-4, DVec3::new(0.0, 3.0, 0.0)),
    ] {
        let mut scene = SceneBuilder::default();
        floor(&mut scene, lambert(0.5));
        let ball = scene.sphere("", Sphere { center, radius });
        let light = scene.material("", shining(1e4, 0.0));
        scene.instance("", Edge::shape(ball).material(light));
        let d2 = center.length_squared();
        let expected = 0.5 * 1e4 * radius * radius / d2 * center.y / d2.sqrt();
        check("ball light", scene, 1, expected);
    }
}

#[test]
fn lights_without_a_body() {
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    let position = DVec3::new(1.0, 2.0, 0.0);
    scene.light(Light::Point {
        position,
        intensity: [7.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    scene.light(Light::Directional {
        direction: DVec3::new(0.0, -2.0, 1.0),
        irradiance: [3.0; 3],
        angle: 0.0,
    });
    let point = 7.0 * 2.0 / 5f64.powf(1.5);
    let directional = 3.0 * 2.0 / 5f64.sqrt();
    check("lights", scene, 1, 0.5 / PI * (point + directional));
}

#[test]
fn a_soft_sun_lights_as_a_sharp_one() {
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    scene.light(Light::Directional {
        direction: -DVec3::Y,
        irradiance: [PI as f32; 3],
        angle: 0.2,
    });
    check("soft sun", scene, 1, 0.5);
}

#[test]
fn a_closed_ball_whose_wall_shines() {
    // E(1 - 0.5^(d+1))/(1 - 0.5) for d bounces after the first sight.
    for depth in [1, 3, 40] {
        let mut scene = SceneBuilder::default();
        let ball = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.0,
            },
        );
        let wall = scene.material("", shining(1.0, 0.5));
        scene.instance("", Edge::shape(ball).material(wall));
        window(
            &mut scene,
            DVec3::new(0.1, 0.2, 0.0),
            DVec3::new(0.5, -0.3, 0.1),
        );
        let expected = 2.0 * (1.0 - 0.5_f64.powi(depth + 1));
        check_within(1e-3, "closed ball", scene, depth as u32, expected);
    }
}

#[test]
fn two_plates() {
    let (e1, r1, e2, r2) = (1.0, 0.6, 0.5, 0.8);
    let mut scene = SceneBuilder::default();
    floor(&mut scene, shining(e1 as f32, r1 as f32));
    let ceiling = scene.half_space(
        "",
        HalfSpace {
            normal: -DVec3::Y,
            offset: -1.0,
        },
    );
    let other = scene.material("", shining(e2 as f32, r2 as f32));
    scene.instance("", Edge::shape(ceiling).material(other));
    check_within(3e-3, "plates", scene, 200, (e1 + r1 * e2) / (1.0 - r1 * r2));
}

/// A ball in a white sky, seen through its middle.
fn ball_in_a_furnace(material: Material) -> SceneBuilder {
    let mut scene = SceneBuilder::default();
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        },
    );
    let white = scene.material("", material);
    scene.instance("", Edge::shape(ball).material(white));
    scene.environment(Environment::uniform([1.0; 3]));
    window(
        &mut scene,
        DVec3::new(0.3, 0.2, 2.0),
        DVec3::new(0.3, 0.2, 0.0),
    );
    scene
}

#[test]
fn a_white_ball_in_a_white_furnace() {
    for material in [
        lambert(1.0),
        Material::metallic_roughness([1.0; 3], 1.0, 0.0),
        Material {
            transmission: 1.0,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        },
    ] {
        check("furnace", ball_in_a_furnace(material), 100, 1.0);
    }
}

/// Frosted glass is given back nearly all that its facets lose (S115), at each of some ten crossings
/// of the surface.
#[test]
fn a_frosted_ball_in_a_white_furnace() {
    for roughness in [0.3, 0.5, 0.7, 1.0] {
        let frosted = Material {
            transmission: 1.0,
            ..Material::metallic_roughness([1.0; 3], 0.0, roughness)
        };
        let scene = ball_in_a_furnace(frosted);
        let (mean, error) = seen(&scene.finish().unwrap(), 100);
        println!("frosted at {roughness}: {mean:.7} ± {error:.1e}");
        assert!(
            mean > 0.97 && mean < 1.001 + 3.0 * error,
            "{mean} ± {error}"
        );
    }
}

/// A sheet that covers a quarter gives off a quarter of its radiance, and lets three quarters of
/// the sky through, also where nothing is scattered on it.
#[test]
fn holes_do_not_shine() {
    for unlit in [false, true] {
        let mut scene = SceneBuilder::default();
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let corners = [at(-9.0, -9.0), at(9.0, -9.0), at(9.0, 9.0), at(-9.0, 9.0)];
        let sheet = scene.polygon("", &corners, &[]);
        let material = Material {
            emission: [1.0; 3],
            layers: Layers {
                opacity: 0.25,
                unlit,
                ..Layers::default()
            },
            base_color: [0.0; 3],
            ..lambert(0.0)
        };
        let material = scene.material("", material);
        scene.instance("", Edge::shape(sheet).material(material));
        scene.environment(Environment::uniform([2.0; 3]));
        window(
            &mut scene,
            DVec3::new(0.3, 0.2, 2.0),
            DVec3::new(0.3, 0.2, 0.0),
        );
        check("sheet", scene, 10, 0.25 + 0.75 * 2.0);
    }
}

#[test]
fn a_pane_of_glass_reflects_a_thirteenth() {
    let mut scene = SceneBuilder::default();
    let pane = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-9.0, -9.0, -1.0),
            max: DVec3::new(9.0, 9.0, 0.0),
        },
    );
    let glass = scene.material(
        "",
        Material {
            transmission: 1.0,
            ior: 1.5,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        },
    );
    scene.instance("", Edge::shape(pane).material(glass));
    // What shines is behind the eye, so only what is reflected is seen.
    let back = scene.half_space(
        "",
        HalfSpace {
            normal: -DVec3::Z,
            offset: -5.0,
        },
    );
    let light = scene.material("", shining(1.0, 0.0));
    scene.instance("", Edge::shape(back).material(light));
    window(&mut scene, DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO);
    let scene = scene.finish().unwrap();
    let (mean, error) = seen(&scene, 60);
    println!("pane: {mean} ± {error}, 1/13 = {}", 1.0 / 13.0);
    assert!((mean - 1.0 / 13.0).abs() < 3.0 * error.max(1e-5));
    assert!(error < 5e-4);
}

#[test]
fn an_absorbing_pane() {
    let mut scene = SceneBuilder::default();
    let pane = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-9.0, -9.0, -2.0),
            max: DVec3::new(9.0, 9.0, 0.0),
        },
    );
    let glass = scene.material(
        "",
        Material {
            transmission: 1.0,
            ior: 1.5,
            layers: Layers {
                attenuation_color: [(-0.5_f32).exp(); 3],
                attenuation_distance: 1.0,
                ..Layers::default()
            },
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        },
    );
    scene.instance("", Edge::shape(pane).material(glass));
    scene.background([1.0; 3]);
    scene.light(Light::Point {
        position: DVec3::ZERO,
        intensity: [0.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    window(&mut scene, DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO);
    let scene = scene.finish().unwrap();
    let (mean, error) = seen(&scene, 60);
    let expected = 0.0449900804 + 0.3391111229;
    println!("absorbing pane: {mean} ± {error}, {expected}");
    assert!((mean - expected).abs() < 3.0 * error.max(1e-5));
    assert!(error < 1e-3);
}

#[test]
fn a_sky_that_brightens_towards_the_zenith() {
    let (width, height) = (512, 256);
    let row = |y: u32| {
        let polar = (f64::from(y) + 0.5) / f64::from(height) * PI;
        (1.0 + polar.cos().max(-1.0)) as f32
    };
    let pixels = (0..width * height).map(|i| [row(i / width); 3]).collect();
    let mut scene = SceneBuilder::default();
    floor(&mut scene, lambert(0.5));
    scene.environment(Environment {
        width,
        height,
        pixels,
        rotation: 0.0,
        scale: [1.0; 3],
    });
    let scene = scene.finish().unwrap();
    let (mean, error) = seen(&scene, 1);
    let expected = 0.5 * (1.0 + 2.0 / 3.0);
    println!("sky: {mean} ± {error}, {expected}");
    // The map is not the formula: its cells are a 256th of the sky high.
    assert!((mean / expected - 1.0).abs() < 1e-3);
}
