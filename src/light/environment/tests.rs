//! Maps keep their radiance and orientation, samples follow their densities.

use super::*;
use crate::chi2::{self, Random};
use std::f64::consts::PI as PI64;

/// Makes a map of a function of the direction.
fn map(width: u32, rotation: f64, of: impl Fn([f64; 3]) -> f64) -> Environment {
    let height = width / 2;
    let pixel = |k: u32| {
        let (x, y) = (f64::from(k % width) + 0.5, f64::from(k / width) + 0.5);
        let longitude = (x / f64::from(width) - 0.5) * 2.0 * PI64;
        let (s, c) = (y / f64::from(height) * PI64).sin_cos();
        // Column ½ + atan2(x, −z)/2π, row acos(y)/π.
        [of([s * longitude.sin(), c, -s * longitude.cos()]) as f32; 3]
    };
    Environment {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        rotation,
        scale: [1.0; 3],
    }
}

fn lane(v: [f64; 3]) -> Vec3<f32> {
    let [x, y, z] = v.map(|x| x as f32);
    Vec3::new(x, y, z)
}

fn array(v: Vec3<f32>) -> [f64; 3] {
    [v.x, v.y, v.z].map(f64::from)
}

/// A sky with a small bright sun, dark below.
fn sunny(width: u32) -> Environment {
    let sun = [0.6, 0.64, -0.48];
    map(width, 0.0, |d| {
        let near = 1.0 - (d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2]);
        let sky = if d[1] > 0.0 { 0.5 + 0.5 * d[1] } else { 0.0 };
        sky + 400.0 * (-near * 2000.0).exp()
    })
}

#[test]
fn the_square_and_the_sphere_map_to_each_other() {
    let mut random = Random(5);
    for k in 0..100_000 {
        let mut at = random.square();
        // Edges, corners and diagonals, too.
        if k % 10 == 0 {
            at[0] = [0.0, 0.5, 1.0][k / 10 % 3];
        }
        if k % 15 == 0 {
            at[1] = [0.0, 0.5, 1.0][k / 15 % 3];
        }
        let dir = octahedral::direction(at);
        assert!((dir.length() - 1.0).abs() < 4e-7, "{at:?}");
        let back = octahedral::direction(octahedral::place(dir));
        assert!((back - dir).length() < 1e-6, "{at:?}: {dir:?} and {back:?}");
        let edge = at.iter().any(|&x| x.min(1.0 - x) < 1e-6);
        let again = octahedral::place(dir);
        let apart = (again[0] - at[0]).abs().max((again[1] - at[1]).abs());
        assert!(edge || apart < 1e-5, "{at:?} and {again:?}");
    }
}

#[test]
fn the_square_covers_the_sphere_evenly() {
    chi2::check(
        "octahedral map",
        [16, 32],
        400_000,
        10,
        |u| Some(chi2::place_of(array(octahedral::direction(u)))),
        |_| 1.0,
    );
}

#[test]
fn maps_keep_their_directions() {
    let axis = |d: [f64; 3]| (2.0 * d[0] + 3.0 * d[1] - 0.5 * d[2]).exp();
    let sky = SkyMap::new(&map(512, 0.0, axis), Compensation::Plain);
    let mut random = Random(6);
    let mut squares = 0.0;
    for _ in 0..10_000 {
        let dir = chi2::direction_of(random.square().map(f64::from));
        let found = f64::from(sky.radiance(lane(dir))[1]);
        let apart = found / axis(dir) - 1.0;
        // At the square's edges, where lines of the map turn, a third of a texel: 0.005·|∇f|.

        assert!(apart.abs() < 2e-2, "{dir:?}: {apart}");
        squares += apart * apart;
    }
    assert!((squares / 1e4).sqrt() < 1e-3, "{squares}");
    // A quarter turn about +y takes what was at −z to −x.
    let spot = |d: [f64; 3]| if d[2] < -0.9 { 1.0 } else { 0.0 };
    let sky = SkyMap::new(&map(512, PI64 / 2.0, spot), Compensation::Plain);
    assert_eq!(sky.radiance(lane([-1.0, 0.0, 0.0]))[0], 1.0);
    assert_eq!(sky.radiance(lane([0.0, 0.0, -1.0]))[0], 0.0);
}

#[test]
fn radiance_is_continuous_across_the_squares_edges() {
    let sky = SkyMap::new(
        &map(64, 0.3, |d| 1.0 + 0.5 * d[0] - 0.4 * d[2]),
        Compensation::Plain,
    );
    for k in 0..1000 {
        let angle = f64::from(k) / 1000.0 * 2.0 * PI64;
        // The lower half's quadrants meet where x or y is 0.
        let around = |e: f64| {
            let (s, c) = angle.sin_cos();
            let d = [e, s, -c.abs()];
            let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
            sky.radiance(lane(d.map(|x| x / length)))[0]
        };
        assert!((around(1e-6) - around(-1e-6)).abs() < 1e-4, "{angle}");
    }
}

#[test]
fn samples_follow_their_density() {
    for compensation in [Compensation::Plain, Compensation::Compensated] {
        for (name, environment) in [
            ("sunny", sunny(256)),
            ("tilted", map(64, 1.0, |d| (3.0 * d[0] + d[1]).exp())),
            (
                "half",
                map(128, 0.2, |d| if d[0] > 0.0 { 1.0 } else { 0.0 }),
            ),
        ] {
            let sky = SkyMap::new(&environment, compensation);
            // The octahedral square is the domain, so that no cell is cut.
            let tree = sky.density.as_ref().unwrap();
            chi2::check(
                name,
                [32, 32],
                400_000,
                12,
                |u| Some(tree.sample(u).map(f64::from)),
                |at| f64::from(tree.density(at.map(|x| x as f32))),
            );
            // And that of directions is the same.
            let mut random = Random(3);
            let mut far = 0;
            for _ in 0..20_000 {
                let u = random.square();
                let place = tree.sample(u);
                let dir = sky.sample(u);
                let (_, pdf) = sky.radiance_and_pdf(dir);
                let own = tree.density(place) / (4.0 * PI);
                assert!(own > 0.0, "{name}");
                far += u32::from((pdf / own - 1.0).abs() > 1e-5);
            }
            // Directions round to another cell now and then.
            assert!(far < 40, "{name}: {far}");
        }
    }
}

#[test]
fn the_density_is_zero_only_where_the_radiance_is() {
    let sky = SkyMap::new(&sunny(256), Compensation::Plain);
    let mut random = Random(8);
    for _ in 0..100_000 {
        let dir = chi2::direction_of(random.square().map(f64::from));
        let (radiance, pdf) = sky.radiance_and_pdf(lane(dir));
        assert!(pdf > 0.0 || radiance == [0.0; 3], "{dir:?}");
    }
}

#[test]
fn a_cosine_sky_gives_its_irradiance() {
    // E = π(1 + 2/3) on a floor under radiance 1 + cos.
    let sky = SkyMap::new(&map(512, 0.0, |d| 1.0 + d[1].max(0.0)), Compensation::Plain);
    let n = 1 << 18;
    let mut sum = 0.0;
    for i in 0..n {
        let [_, u, v] = crate::emitter::tests::numbers(i);
        let dir = sky.sample([u, v]);
        let (radiance, pdf) = sky.radiance_and_pdf(dir);
        sum += f64::from(radiance[0] * dir.y.max(0.0) / pdf);
    }
    let found = sum / f64::from(n);
    let expected = PI64 * (1.0 + 2.0 / 3.0);
    assert!(
        (found / expected - 1.0).abs() < 2e-4,
        "{found}, not {expected}"
    );
}

#[test]
fn a_constant_map_is_left_to_bsdf_sampling() {
    let gray = map(32, 0.0, |_| 0.7);
    let sky = SkyMap::new(&gray, Compensation::Compensated);
    assert_eq!(sky.sampled_mean(), 0.0);
    let (radiance, pdf) = sky.radiance_and_pdf(lane([0.0, 0.6, 0.8]));
    assert!((radiance[0] - 0.7).abs() < 1e-6 && pdf == 0.0);
    let plain = SkyMap::new(&gray, Compensation::Plain);
    let (_, pdf) = plain.radiance_and_pdf(lane([0.0, 0.6, 0.8]));
    assert!((pdf * 4.0 * PI - 1.0).abs() < 1e-5);
    // A black one too.
    let black = SkyMap::new(&map(32, 0.0, |_| 0.0), Compensation::Plain);
    assert_eq!(black.sampled_mean(), 0.0);
}

#[test]
fn one_bright_pixel_keeps_its_power() {
    let mut environment = map(512, 0.0, |_| 0.0);
    let bright = 100 * 512 + 77;
    let mut pixels = environment.pixels.to_vec();
    pixels[bright] = [1e6; 3];
    environment.pixels = pixels.into();
    let sky = SkyMap::new(&environment, Compensation::Plain);
    let mean = f64::from(sky.sampled_mean());
    let cells = (2.0 * PI64 / 512.0) * (PI64 / 256.0) * ((100.5 / 256.0) * PI64).sin();
    let expected = 1e6 * cells / (4.0 * PI64);
    assert!(
        (mean / expected - 1.0).abs() < 0.02,
        "{mean}, not {expected}"
    );
}

#[test]
fn bad_pixels_count_as_black() {
    let mut environment = map(64, 0.0, |_| 1.0);
    let mut pixels = environment.pixels.to_vec();
    pixels[100] = [f32::NAN, f32::INFINITY, -5.0];
    environment.pixels = pixels.into();
    let sky = SkyMap::new(&environment, Compensation::Compensated);
    assert!(
        sky.texels
            .iter()
            .flatten()
            .all(|x| (0.0..=1.001).contains(x))
    );
}
