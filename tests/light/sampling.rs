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
