//! The time of a sample and of a density, per lane; a measurement, not a test.

use super::*;
use lanecast_numerics::math::lanes::{Lanes, Mask, f32x8};
use std::hint::black_box;
use std::time::Instant;

/// Prints nanoseconds per lane of sampling, and of the density of what was sampled.
fn time(name: &str, emitters: &Emitters) {
    type L = f32x8;
    let mut random = Random(1);
    let steps = 2048;
    let inputs: Vec<_> = (0..steps)
        .map(|_| {
            let mut lane = || {
                let at = DVec3::new(random.signed() * 8.0, random.signed() * 8.0, 0.0);
                (at, [random.next(), random.next(), random.next()])
            };
            let lanes: [_; 8] = std::array::from_fn(|_| lane());
            let point = Vec3::<<L as Lanes>::Double>::of_lanes(|i| lanes[i].0.to_array());
            (point, Vec3::<L>::of_lanes(|i| lanes[i].1))
        })
        .collect();
    let normal = Vec3::<L>::splat([0.0, 0.0, 1.0]);
    let mut best = [f64::INFINITY; 2];
    for _ in 0..20 {
        let start = Instant::now();
        let samples: Vec<_> = inputs
            .iter()
            .map(|&(point, u)| {
                emitters.sample::<L>(point, normal, Mask::splat(true), u.x, [u.y, u.z])
            })
            .collect();
        let middle = Instant::now();
        for ((point, _), s) in inputs.iter().zip(&samples) {
            if s.far.any() {
                let [x, y, z] = [s.dir.x, s.dir.y, s.dir.z].map(L::narrow);
                black_box(emitters.sky(Vec3::new(x, y, z), *point, normal));
            } else {
                black_box(emitters.pdf(s.emitter, *point, normal, s.dir));
            }
        }
        let lanes = f64::from(steps) * 8.0 / 1e9;
        best[0] = best[0].min((middle - start).as_secs_f64() / lanes);
        best[1] = best[1].min(middle.elapsed().as_secs_f64() / lanes);
        black_box(samples);
    }
    println!(
        "{name}: sample {:.1} ns, density {:.1} ns a lane",
        best[0], best[1]
    );
}

#[test]
#[ignore = "a measurement"]
fn times() {
    let rectangle = |z: f64| Body::Rectangle {
        corner: DVec3::new(-1.0, -1.0, z),
        u: DVec3::X * 2.0,
        v: DVec3::Y * 2.0,
    };
    time("a rectangle", &only(rectangle(3.0)));
    let triangle = Body::Triangle([
        DVec3::Z,
        DVec3::new(1.0, 0.0, 2.0),
        DVec3::new(0.0, 1.0, 2.0),
    ]);
    time("a triangle", &only(triangle));
    let sphere = |x: f64| Body::Sphere {
        center: DVec3::new(x, 0.0, 3.0),
        radius: 0.5,
    };
    time("a sphere", &only(sphere(0.0)));
    let eight: Vec<_> = (0..8)
        .map(|k| white(rectangle(2.0 + f64::from(k))))
        .collect();
    time("8 rectangles", &Emitters::new(eight, None, [0.0; 3]));
    let eight: Vec<_> = (0..8).map(|k| white(sphere(f64::from(k)))).collect();
    time("8 spheres", &Emitters::new(eight, None, [0.0; 3]));
    let sky = super::irradiance::gradient();
    time(
        "an environment",
        &Emitters::new(vec![], Some(&sky), [0.0; 3]),
    );
    let many = super::many::triangles(10_000);
    let start = Instant::now();
    let many = Emitters::new(many, None, [0.0; 3]);
    println!("tree of 10,000 built in {:?}", start.elapsed());
    time("10,000 triangles", &many);
}
