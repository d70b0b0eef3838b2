//! Scenes at which roundings decide: every structure and width has the same hits, and `exact`
//! those of the brute-force reference.

#![cfg(feature = "all-lanes")]

use crate::common::{Random, RayColumns, campaign, hard_rays, hard_scene, random_mesh};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Accelerator, Density, KdQuality, Structure, World};
use lanecast::internals::geom::{Cylinder, Ellipsoid, Sphere};
use lanecast::internals::math::{Aabb, Affine};
use lanecast::internals::plan::{Kernels, Precision};
use lanecast::internals::reference::{Hit, Reference};
use lanecast::internals::scene::{Edge, Instances, MeshId, SceneBuilder};
use lanecast::internals::trace::HitId;
use rayon::prelude::*;

const RAYS: usize = 1000;

/// Bits of t and the id, of rays that meet something.
fn bits(answers: Vec<(f64, HitId)>) -> Vec<Option<(u64, HitId)>> {
    let met = |(t, id): (f64, HitId)| (id != HitId::NONE).then(|| (t.to_bits(), id));
    answers.into_iter().map(met).collect()
}

/// How often rays of a scene meet something, in all precisions, and differ between
/// tiles and packets in f32.
fn all_alike(seed: u64) -> [usize; 2] {
    let (mut met, mut apart) = (0, 0);
    let scene = hard_scene(seed);
    let instances = Instances::of(&scene).unwrap();
    let rays = hard_rays(&scene, &instances, seed, RAYS);
    let kd = Structure::Kd(KdQuality::default());
    let grid = Structure::Grid(Density::default());
    let (heap, spheres) = (Structure::Heap, Structure::HeapSpheres);
    let worlds = [Structure::Linear, Structure::Bvh, kd, grid, heap, spheres]
        .map(|structure| World::build(&scene, &instances, structure));
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        let of = |world, lanes| {
            let kernels = Kernels { precision, lanes };
            bits(rays.closest(world, &kernels))
        };
        let expected = of(&worlds[0], 1);
        met += expected.iter().flatten().count();
        for (i, world) in worlds.iter().enumerate() {
            // The f32 tile kernel decides triangles by other arithmetic, at
            // every width alike.
            let tiles = precision == Precision::Fast && i == 1;
            let expected = if tiles {
                let own = of(world, 1);
                let pairs = own.iter().zip(&expected);
                apart += pairs.filter(|(own, other)| own != other).count();
                own
            } else {
                expected.clone()
            };
            for lanes in [1, 4, 8, 16] {
                for (ray, (got, expected)) in of(world, lanes).iter().zip(&expected).enumerate() {
                    assert_eq!(
                        got, expected,
                        "seed {seed}, ray {ray}: {precision:?}, structure {i}, {lanes} lanes"
                    );
                }
            }
        }
    }
    [met, apart]
}

#[test]
fn hard_scenes_do_not_depend_on_structure_or_width() {
    // Forty of each kind at full size.
    let scenes = campaign(200);
    let counts: Vec<[usize; 2]> = (0..scenes as u64).into_par_iter().map(all_alike).collect();
    let apart: usize = counts.iter().map(|[_, apart]| apart).sum();
    let mut met = [0; 5];
    for (seed, [hits, _]) in counts.iter().enumerate() {
        met[seed % 5] += hits;
    }
    println!(
        "{apart} of {} rays differ between tiles and packets in f32",
        scenes * RAYS
    );
    assert!(apart < scenes * RAYS / 100);
    println!(
        "hits of {} rays per kind of scene: {met:?}",
        scenes / 5 * 3 * RAYS
    );
    assert!(met.iter().all(|hits| *hits > scenes / 5 * RAYS / 4));
}

/// Vectors a few roundings away. The reference is exact and kernels of solids
/// round, so at edges and between coincident faces they may differ; but then ours
/// is the answer to one of these rays.
fn beside(org: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let size = org.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    [1e-15, 1e-14, 1e-13, 1e-12, 1e-11]
        .into_iter()
        .flat_map(move |relative| {
            (0..27).map(move |i| {
                let step = |k: i32| f64::from(i / 3_i32.pow(k as u32) % 3 - 1);
                let by = relative * size;
                [
                    org[0] + step(0) * by,
                    org[1] + step(1) * by,
                    org[2] + step(2) * by,
                ]
            })
        })
}

#[test]
fn exact_packets_agree_with_the_reference_on_hard_scenes() {
    // Per kind of scene: answers, other ids than the reference's, wrong.
    let mut counts = [[0; 3]; 5];
    let mut first = None;
    for seed in 0..campaign(300) as u64 {
        let scene = hard_scene(seed);
        let instances = Instances::of(&scene).unwrap();
        let rays = hard_rays(&scene, &instances, seed, RAYS / 4);
        let world = World::build(&scene, &instances, Structure::Bvh);
        let kernels = Kernels {
            precision: Precision::Exact,
            lanes: 8,
        };
        let reference = Reference::brute_force(&scene, &instances).unwrap();
        let answers = rays.closest(&world, &kernels);
        for (i, (t, id)) in answers.iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let expected = reference.nearest(org, dir.map(f64::from), f64::INFINITY);
            let ours = (*id != HitId::NONE).then_some(*id);
            let same = ours.map(|id| (id.instance, id.primitive))
                == expected.map(|h| (h.instance, h.primitive));
            // Of coincident faces f64 may take either: the t must be the same.
            let says = |hit: &Option<Hit>| match (ours, hit) {
                (None, None) => true,
                (Some(id), Some(h)) => {
                    (id.instance, id.primitive) == (h.instance, h.primitive)
                        || (t - h.t).abs() <= 1e-11 * h.t
                }
                _ => false,
            };
            let allowed = says(&expected)
                || beside(org)
                    .any(|org| says(&reference.nearest(org, dir.map(f64::from), f64::INFINITY)));
            let count = &mut counts[seed as usize % 5];
            count[0] += 1;
            count[1] += u32::from(!same);
            count[2] += u32::from(!allowed);
            if !allowed && first.is_none() {
                first = Some(format!(
                    "seed {seed}, ray {i}, org {org:?} dir {dir:?}: {ours:?} at {t:?}, reference {expected:?}"
                ));
            }
        }
    }
    println!("[answers, other ids, wrong] per kind of scene: {counts:?}");
    println!("the first: {first:?}");
    let wrong: u32 = counts.iter().map(|c| c[2]).sum();
    assert_eq!(wrong, 0, "{first:?}");
}

/// `world_from_object` is only nearly the inverse of the map that defines an
/// instance; the box made with it still holds every point that rays can meet:
/// the x with object_from_world · x = corner, here to some 30 digits.
#[test]
fn badly_conditioned_boxes_hold_every_corner() {
    let (mut corners, mut farthest, mut outside) = (0, 0.0, 0);
    for seed in 0..500 {
        let random = &mut Random(seed);
        let mut scene = SceneBuilder::default();
        let shape = scene.mesh("", &random_mesh(random));
        let power = |r: &mut Random| libm::pow(10.0, r.unit() * 6.0);
        let stretch = DVec3::new(power(random), power(random), power(random));
        let map = random.oblique(stretch);
        let map = DAffine3::from_translation(random.vector() * power(random)) * map;
        let transform = scene.transform(map.into());
        scene.instance("", Edge::shape(shape).transform(transform));
        let scene = scene.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let row = instances.rows[0];
        let mesh = scene.meshes.row(MeshId(0));
        // Nested trees have boxes of all of them; flat ones leave the worst out.
        let world = World::build(&scene, &instances, Structure::Nested);
        let Accelerator::Nested(levels) = &world.accelerator else {
            panic!("not nested");
        };
        let center = levels.instance_bvhs.center();
        let about = levels.instance_bvhs.bounds(center).widened();
        let bounds = Aabb::new(about.min + center, about.max + center);
        for i in 0..mesh.triangles.len() {
            for corner in mesh.corners(i) {
                let corner = DVec3::from_array(corner.map(f64::from)) + mesh.center;
                let start = DVec3::from_array(row.world_from_object.point(corner.to_array()));
                // Newton's steps, as a sum of two so that it does not end at f64.
                let (mut x, mut low) = (start, DVec3::ZERO);
                let mut step = 0.0;
                for _ in 0..8 {
                    let off = residual(&row.object_from_world, corner, x, low);
                    let off = DVec3::from_array(row.world_from_object.vector(off.to_array()));
                    step = off.length();
                    low += off;
                    let sum = x + low;
                    low -= sum - x;
                    x = sum;
                }
                let size = bounds.max_abs();
                // Worse conditioned than f64 can say: Newton's steps do not settle.
                if step > 1e-20 * size {
                    continue;
                }
                corners += 1;
                farthest = f64::max(farthest, (x - start).length() / size);
                let x = x - center;
                let inside = x.cmpge(about.min).all() && x.cmple(about.max).all();
                outside += u32::from(!inside);
            }
        }
    }
    println!(
        "{corners} corners, {outside} outside; the approximate inverse is off by up to \
         {farthest:.1e} of the box"
    );
    assert_eq!(outside, 0);
    assert!(
        corners > 40_000 && farthest > 1e-7,
        "farther off than f32 boxes forgive"
    );
}

/// corner − map·(x + low), in twice the precision of f64 (Ogita, Rump, Oishi:
/// Accurate sum and dot product, 2005).
fn residual(map: &Affine, corner: DVec3, x: DVec3, low: DVec3) -> DVec3 {
    let row = |r: usize| {
        let (mut sum, mut error) = (corner[r], 0.0);
        let mut add = |a: f64| {
            let before = sum;
            sum += a;
            let back = sum - before;
            error += (before - (sum - back)) + (a - back);
        };
        for k in 0..3 {
            for factor in [x[k], low[k]] {
                let product = -map.linear()[k][r] * factor;
                add(product);
                add((-map.linear()[k][r]).mul_add(factor, -product));
            }
        }
        add(-map.translation[r]);
        sum + error
    };
    DVec3::new(row(0), row(1), row(2))
}

/// Of two shapes one skin apart, which f32 does not tell from each other: the outer one's t
/// is what it is alone, whichever comes first.
#[test]
fn what_comes_first_by_a_hair_keeps_its_own_t() {
    let center = DVec3::new(0.3, -0.2, 0.1);
    let row = |b: &mut SceneBuilder, kind: usize, radius: f64| match kind {
        0 => b.sphere("", Sphere { center, radius }),
        1 | 2 => {
            let (base, top, open) = (center - DVec3::Y, center + DVec3::Y, kind == 2);
            let row = Cylinder {
                base,
                top,
                radius,
                open,
            };
            b.cylinder("", row)
        }
        _ => {
            let radii = DVec3::new(radius, 1.5 * radius, 0.7 * radius);
            b.ellipsoid("", Ellipsoid { center, radii })
        }
    };
    let random = &mut Random(7);
    let mut rays = RayColumns::default();
    for _ in 0..RAYS {
        let org = DVec3::new(5.0, 1.0, -4.0) + random.vector();
        let at = center + random.vector() * 0.3;
        rays.push(org, (at - org).to_array());
    }
    for kind in 0..4 {
        let answers = |radii: &[f64], lanes| {
            let mut b = SceneBuilder::default();
            for radius in radii {
                let shape = row(&mut b, kind, *radius);
                b.instance("", Edge::shape(shape));
            }
            let scene = b.finish().unwrap();
            let instances = Instances::of(&scene).unwrap();
            let world = World::build(&scene, &instances, Structure::Linear);
            let kernels = Kernels {
                precision: Precision::Guarded,
                lanes,
            };
            let met = rays.closest(&world, &kernels);
            let numbered = |(t, id): (f64, HitId)| {
                let t = (id != HitId::NONE).then(|| t.to_bits());
                (t, radii.get(id.instance as usize).copied())
            };
            met.into_iter().map(numbered).collect::<Vec<_>>()
        };
        let (outer, inner) = (0.8, 0.8 - 1e-9);
        for lanes in [1, 8, 16] {
            let alone = answers(&[outer], lanes);
            let hits = alone.iter().filter(|(t, _)| t.is_some()).count();
            assert!(hits > RAYS / 2, "{kind}: {hits}");
            for radii in [[inner, outer], [outer, inner]] {
                // The caps of both lie in one plane: there the first one counts.
                let both = answers(&radii, lanes);
                for (both, alone) in both.iter().zip(&alone) {
                    assert_eq!(both.0, alone.0, "{kind}, {lanes} lanes, {radii:?}");
                    assert!(kind == 1 || both.1 == alone.1, "{kind}, {radii:?}");
                }
            }
        }
    }
}
