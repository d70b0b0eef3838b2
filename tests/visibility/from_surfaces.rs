//! Rays that start on surfaces, as those of paths do: f32 leaves most of them open.

use crate::common::{Random, RayColumns, kernels, random_scene};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::plan::{Kernels, Precision};
use lanecast::internals::scene::{
    Edge, Instances, Material, Operand, Operator, Scene, SceneBuilder, ShapeId,
};
use lanecast::internals::trace::{HitId, TraceScratch};
use lanecast::shapes::{Cuboid, Ellipsoid, Sphere};

/// Rays in all directions from where some rays meet the scene, moved by `start`.
fn from_hits(
    world: &World,
    random: &mut Random,
    start: impl Fn(&mut Random, DVec3) -> DVec3,
) -> RayColumns {
    let mut first = RayColumns::default();
    for i in 0..1500 {
        let org = random.vector() * if i % 2 == 0 { 4.0 } else { 0.3 };
        first.push(org, (random.vector() - org).to_array());
    }
    let met = first.closest(world, &kernels(Precision::Exact));
    let mut rays = RayColumns::default();
    for (i, (t, id)) in met.iter().enumerate() {
        if *id != HitId::NONE {
            let [org, dir] = <[_; 2]>::from(first.ray(i)).map(DVec3::from_array);
            let from = start(random, org + dir * *t);
            rays.push(from, random.vector().to_array());
        }
    }
    rays
}

fn bits(met: &[(f64, HitId)]) -> Vec<(u64, HitId)> {
    met.iter().map(|(t, id)| (t.to_bits(), *id)).collect()
}

/// Hits that the double pass is certain of are those of exact arithmetic, with its t.
#[test]
fn hits_from_the_surface_have_the_t_of_exact_decisions() {
    let mut compared = 0;
    for seed in 0..60 {
        let scene = random_scene(seed);
        let instances = Instances::of(&scene).expect("few instances");
        let world = World::build(&scene, &instances, Structure::Bvh);
        let random = &mut Random(seed);
        // Off the surface, on either side, by as little as f64 has and as much as f32 has.
        let rays = from_hits(&world, random, |random, point| {
            let off = (10.0 + 6.0 * random.unit()) as i32;
            point + random.vector() * point.abs().max_element() * 0.1_f64.powi(off)
        });
        let exact = bits(&rays.closest_all_exact(&world));
        for lanes in [1, 8, 16] {
            let kernels = Kernels {
                precision: Precision::Guarded,
                lanes,
            };
            let met = bits(&rays.closest(&world, &kernels));
            for (i, (met, exact)) in met.iter().zip(&exact).enumerate() {
                assert_eq!(met, exact, "seed {seed}, ray {i}, {lanes} lanes");
            }
        }
        compared += rays.len();
    }
    assert!(compared > 10_000, "{compared}");
}

fn alone(make: impl Fn(&mut SceneBuilder) -> ShapeId) -> Scene {
    let mut scene = SceneBuilder::default();
    let matte = scene.material("", Material::default());
    let shape = make(&mut scene);
    scene.instance("", Edge::shape(shape).material(matte));
    scene.finish().expect("a right scene")
}

/// Rays that start a little within a ball, an ellipsoid, and a room that is cut out of a block.
#[test]
fn rays_within_solids_are_hardly_ever_in_doubt() {
    let (middle, radii) = (DVec3::new(0.1, 0.2, -0.1), DVec3::new(1.0, 1.4, 0.8));
    let ball = |b: &mut SceneBuilder| {
        let (center, radius) = (middle, 1.0);
        b.sphere("", Sphere { center, radius })
    };
    let egg = |b: &mut SceneBuilder| {
        let center = middle;
        b.ellipsoid("", Ellipsoid { center, radii })
    };
    let room = |b: &mut SceneBuilder| {
        let boxes = [1.2, 1.0].map(|size| {
            let (min, max) = (DVec3::splat(-size), DVec3::splat(size));
            Operand::shape(b.cuboid("", Cuboid { min, max }))
        });
        let (min, max) = (DVec3::new(0.5, -0.4, -0.3), DVec3::new(2.0, 0.4, 0.3));
        let window = Operand::shape(b.cuboid("", Cuboid { min, max }));
        b.csg("", Operator::Difference, &[boxes[0], boxes[1], window])
    };
    // Points of the surface from the middle, and the direction outwards.
    let round = |random: &mut Random, radii: DVec3| {
        let out = random.vector().normalize();
        (out * radii, out / radii)
    };
    type Points<'a> = &'a dyn Fn(&mut Random) -> (DVec3, DVec3);
    let scenes: [(&str, Scene, DVec3, Points); 3] = [
        ("ball", alone(ball), middle, &|random| {
            round(random, DVec3::ONE)
        }),
        ("egg", alone(egg), middle, &|random| round(random, radii)),
        ("room", alone(room), DVec3::ZERO, &|random| {
            let on = random.vector();
            // On the floor, the ceiling, and the walls beside the window.
            let out = [DVec3::Y * on.y.signum(), DVec3::Z * on.z.signum()];
            let out = out[random.below(2) as usize];
            (on + out * (1.0 - on.dot(out)), out)
        }),
    ];
    for (name, scene, middle, point) in scenes {
        let instances = Instances::of(&scene).expect("few instances");
        let world = World::build(&scene, &instances, Structure::Bvh);
        let random = &mut Random(3);
        let mut rays = RayColumns::default();
        for _ in 0..2000 {
            let ((from, out), dir) = (point(random), random.vector());
            let inwards = if dir.dot(out) < 0.0 { dir } else { -dir };
            rays.push(middle + from * (1.0 - 1e-13), inwards.to_array());
        }
        let scratch = &mut TraceScratch::default();
        let ends = vec![f32::INFINITY; rays.len()];
        let met = rays.closest_with(&world, &kernels(Precision::Guarded), &ends, scratch);
        let hits = met.iter().filter(|(_, id)| *id != HitId::NONE).count();
        println!("{name}: {} of {hits} hits in doubt", scratch.decided);
        assert!(hits > 1500, "{name}: {hits}");
        assert!(scratch.decided < hits as u64 / 20, "{name}");
    }
}
