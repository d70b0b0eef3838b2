//! Sampling of pictures: alpha, and samples that go where the noise is.

use lanecast::internals::render::{Adaptive, Backdrop, Integrator};
use lanecast::shapes::Sphere;
use lanecast::{
    Camera, DVec3, Edge, Material, RenderConfig, Scene, SceneBuilder, Tracer, TracerOptions,
};

fn ball() -> Scene {
    let mut scene = SceneBuilder::default();
    let grey = scene.material("", Material::metallic_roughness([0.6; 3], 0.0, 0.5));
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        },
    );
    scene.instance("", Edge::shape(ball).material(grey));
    scene.camera(
        "",
        Camera::orthographic(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, 4.0),
    );
    scene.finish().unwrap()
}

fn config() -> RenderConfig {
    RenderConfig {
        width: 64,
        height: 64,
        spp: 64,
        integrator: Integrator::Path,
        ..RenderConfig::default()
    }
}

fn render(config: &RenderConfig) -> lanecast::Picture {
    let tracer = Tracer::new(&ball(), &TracerOptions::default()).unwrap();
    tracer.render(config, &Default::default(), &|_| ()).unwrap()
}

#[test]
fn alpha_is_the_share_that_is_covered() {
    for integrator in [Integrator::Direct, Integrator::Path] {
        let picture = render(&RenderConfig {
            integrator,
            backdrop: Backdrop::Transparent,
            ..config()
        });
        let alpha = picture.alpha.unwrap();
        let covered = alpha.iter().map(|a| f64::from(*a)).sum::<f64>() / 4096.0 * 16.0;
        assert!((covered - std::f64::consts::PI).abs() < 0.02, "{covered}");
        assert_eq!((alpha[0], picture.color[0]), (0.0, [0.0; 3]));
        assert_eq!(alpha[32 * 64 + 32], 1.0);
    }
    assert!(render(&config()).alpha.is_none());
}

#[test]
fn quiet_pictures_are_those_of_all_samples_where_these_were_taken() {
    let adaptive = |noise| RenderConfig {
        adaptive: Some(Adaptive { noise, most: 128 }),
        spp: 128,
        ..config()
    };
    let all = render(&RenderConfig {
        spp: 128,
        ..config()
    });
    // Nothing is quiet enough: every pixel has the bits of 128 samples.
    assert_eq!(render(&adaptive(1e-4)).color, all.color);
    // The corners are, and the ball's edge is not.
    let some = render(&adaptive(0.02));
    assert_eq!(some.color[0], all.color[0]);
    let mean = |color: &[[f32; 3]]| color.iter().map(|c| f64::from(c[0])).sum::<f64>() / 4096.0;
    let off = mean(&some.color) / mean(&all.color) - 1.0;
    assert!(off.abs() < 5e-4, "{off}");
}

/// Stopping believes in the difference of two halves: it is not far above the error that a
/// picture really has, so that few samples are wasted, and not below it.
#[test]
fn noise_is_told_within_a_small_factor() {
    const MOST: u32 = 4096;
    let truth = render(&RenderConfig {
        spp: 2 * MOST,
        ..config()
    });
    let noise = 0.005_f64;
    let mut adaptive = RenderConfig {
        adaptive: Some(Adaptive {
            noise: noise as f32,
            most: MOST,
        }),
        spp: MOST,
        seed: 7,
        ..config()
    };
    assert!(adaptive.aovs.add("samples"));
    let picture = render(&adaptive);
    let samples = picture.samples.as_ref().unwrap();
    let error = |i: usize| {
        let (is, should) = (picture.color[i], truth.color[i]);
        let sum: f64 = should.iter().map(|c| f64::from(*c)).sum();
        let off: f64 = (0..3).map(|k| f64::from((is[k] - should[k]).abs())).sum();
        off / if sum > 1.0 { sum } else { sum.sqrt() + 1e-3 }
    };
    let mean_around = |x: usize, y: usize| -> f64 {
        let near = (y - 1..y + 2).flat_map(|v| (x - 1..x + 2).map(move |u| v * 64 + u));
        near.map(error).sum::<f64>() / 9.0
    };
    // Of blocks that needed more than the first pass, and not all there are.
    let mut blocks = Vec::new();
    for (x, y) in (0..16).map(|block| (block % 4 * 16, block / 4 * 16)) {
        if !(256..MOST).contains(&samples[y * 64 + x]) {
            continue;
        }
        let inside = (y + 1..y + 15).flat_map(|v| (x + 1..x + 15).map(move |u| (u, v)));
        blocks.push(inside.map(|(u, v)| mean_around(u, v)).fold(0.0, f64::max));
    }
    // Others had to go on because of their neighbours.
    assert!(!blocks.is_empty());
    let most = blocks.iter().copied().fold(0.0, f64::max);
    assert!(most > 0.2 * noise, "{most}: too many samples");
    assert!(most < 1.2 * noise, "{most}: too few samples");
}
