//! Media that touch: light goes from one into the other without air between.

use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::render::Integrator;
use lanecast::shapes::Cuboid;
use lanecast::{Camera, DVec3, Edge, Material, RenderConfig, SceneBuilder, Tracer, TracerOptions};

fn medium(ior: f32) -> Material {
    Material {
        transmission: 1.0,
        ior,
        ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
    }
}

/// Two slabs of indices 1.5 and 1.33 with a gap between them, and a strip that shines behind,
/// seen by one ray aslant. Returns what it sees.
fn seen(gap: f64, liquid_first: bool, strip: [f64; 2], inside: bool) -> f32 {
    colors_seen(gap, liquid_first, strip, inside, 0.0)[0]
}

/// As [`seen`], with this dispersion of the first slab; the three colours.
fn colors_seen(
    gap: f64,
    liquid_first: bool,
    strip: [f64; 2],
    inside: bool,
    dispersion: f32,
) -> [f32; 3] {
    let mut scene = SceneBuilder::default();
    let slab = |scene: &mut SceneBuilder, from: f64, to: f64, ior| {
        let mut material = medium(ior);
        if ior == 1.5 {
            material.layers.dispersion = dispersion;
        }
        let material = scene.material("", material);
        let slab = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::new(from, -50.0, -50.0),
                max: DVec3::new(to, 50.0, 50.0),
            },
        );
        scene.instance("", Edge::shape(slab).material(material));
    };
    let first = if inside { -3.0 } else { 1.0 };
    if liquid_first {
        slab(&mut scene, 2.0 + gap, 3.0, 1.33);
        slab(&mut scene, first, 2.0, 1.5);
    } else {
        slab(&mut scene, first, 2.0, 1.5);
        slab(&mut scene, 2.0 + gap, 3.0, 1.33);
    }
    let [low, high] = strip;
    let at = |y, z| DVec3::new(5.0, y, z);
    let points = [at(low, -9.0), at(low, 9.0), at(high, 9.0), at(high, -9.0)];
    let shape = scene.polygon("", &points, &[]);
    let light = scene.material(
        "",
        Material {
            emission: [1.0; 3],
            ..Material::metallic_roughness([0.0; 3], 0.0, 1.0)
        },
    );
    scene.instance("", Edge::shape(shape).material(light));
    let towards = DVec3::new(0.764_842_187_284_488_5, 0.644_217_687_237_691, 0.0);
    scene.camera(
        "",
        Camera::orthographic(DVec3::ZERO, towards, DVec3::Y, 1e-7),
    );
    let scene = scene.finish().unwrap();
    let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
    let config = RenderConfig {
        width: 4,
        height: 4,
        spp: 64,
        integrator: Integrator::Path,
        filter: FilterKind::Box,
        max_depth: 16,
        ..RenderConfig::default()
    };
    let picture = tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    [0, 1, 2].map(|k| picture.color.iter().map(|c| c[k]).sum::<f32>() / 16.0)
}

/// Where the ray lands by Snell's law.
fn landing(ways: &[(f64, f64)]) -> f64 {
    let sin = 0.644_217_687_237_691;
    ways.iter()
        .map(|(way, index)| {
            let sin = sin / index;
            way * sin / (1.0 - sin * sin).sqrt()
        })
        .sum()
}

#[test]
fn touching_media_bend_light_once() {
    let y = landing(&[(1.0, 1.0), (1.0, 1.5), (1.0, 1.33), (2.0, 1.0)]);
    assert!((y - 3.5561).abs() < 1e-4);
    for liquid_first in [false, true] {
        let hit = seen(0.0, liquid_first, [y - 1e-4, y + 1e-4], false);
        assert!((0.85..0.95).contains(&hit), "{hit}");
        // All that lands beside it was reflected twice.
        let beside = seen(0.0, liquid_first, [y + 1e-4, y + 0.5], false);
        assert!(beside < 0.02, "{beside}");
    }
}

#[test]
fn a_gap_of_air_bends_light_twice_more() {
    let gap = 1e-3;
    let y = landing(&[(1.0 + gap + 2.0, 1.0), (1.0, 1.5), (1.0 - gap, 1.33)]);
    let hit = seen(gap, false, [y - 1e-4, y + 1e-4], false);
    assert!((0.75..0.92).contains(&hit), "{hit}");
}

#[test]
fn an_eye_in_glass_knows_it() {
    // The direction is the one in glass.
    let sin: f64 = 0.644_217_687_237_691;
    let tan = |sin: f64| sin / (1.0 - sin * sin).sqrt();
    let y = 2.0 * tan(sin) + tan(sin * 1.5 / 1.33) + 2.0 * tan(sin * 1.5);
    let hit = seen(0.0, false, [y - 1e-3, y + 1e-3], true);
    assert!(hit > 0.5, "{hit}");
}

/// Each colour lands where its own index sends it; all 1,024 paths are of one colour each.
#[test]
fn dispersion_parts_the_colours() {
    for (channel, index) in [(0, 1.475), (1, 1.5), (2, 1.525)] {
        let y = landing(&[(1.0, 1.0), (1.0, index), (1.0, 1.33), (2.0, 1.0)]);
        let hit = colors_seen(0.0, false, [y - 1e-4, y + 1e-4], false, 2.0);
        // A third of the paths, each of thrice the light: 0.92, and 3 sigma.
        assert!((hit[channel] - 0.92).abs() < 0.13, "{hit:?}");
        for other in [(channel + 1) % 3, (channel + 2) % 3] {
            assert!(hit[other] < 0.02, "{hit:?}");
        }
    }
}
