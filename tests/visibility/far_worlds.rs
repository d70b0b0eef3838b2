//! Scenes far from the origin: their boxes are relative to a centre, so they are as tight as at
//! the origin, and every structure has the hits of the linear scan.

use crate::common::{
    ALL_AOVS, Random, RayColumns, Way, campaign, hard_rays, hard_scene, hash, kernels, picture,
    random_mesh, random_shape, structures,
};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cone, Cuboid, Sphere};
use lanecast::internals::math::{Aabb, Affine};
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::reference::Reference;
use lanecast::internals::render::RenderConfig;
use lanecast::internals::scene::{
    Camera, Edge, Instances, Light, MeshData, Operand, Operator, Scene, SceneBuilder,
};
use lanecast::internals::trace::{HitId, ShadowCache};

const RAYS: usize = 512;

fn size(world: &World) -> DVec3 {
    let bounds: Aabb = world.bounds.widened();
    bounds.extent()
}

/// Of well conditioned places: others lose in f64 what the distance costs.
#[test]
fn boxes_of_far_worlds_are_as_fine_as_near_ones() {
    let row = || {
        let mut scene = SceneBuilder::default();
        for i in 0..10 {
            let center = DVec3::new(3.0 * f64::from(i), 0.0, 1.0);
            let sphere = Sphere {
                center,
                radius: 1.0,
            };
            let shape = scene.sphere("", sphere);
            scene.instance("", Edge::shape(shape));
        }
        scene.finish().unwrap()
    };
    let built = |scene: &Scene| {
        let instances = Instances::of(scene).unwrap();
        let world = World::build(scene, &instances, Structure::Bvh);
        let boxes: Vec<f64> = world
            .entries
            .iter()
            .map(|entry| entry.bounds.widened().extent().max_element())
            .collect();
        (world.center, boxes)
    };
    let (center, near) = built(&row());
    assert_eq!(center, DVec3::ZERO);
    for distance in [1e4, 1e6, 1e9] {
        let offset = DVec3::new(0.6, -0.8, 0.3) * distance;
        let (center, far) = built(&row().moved(1.0, offset).unwrap());
        assert!((center - offset).length() < 64.0, "{distance}: {center}");
        for (near, far) in near.iter().zip(&far) {
            assert!((far - near).abs() < 1e-4, "{distance}: {far}");
        }
    }
}

#[test]
fn far_worlds_lose_nothing() {
    let mut hits = 0;
    for seed in 0..12 {
        let near = hard_scene(seed);
        let instances = Instances::of(&near).unwrap();
        let near_size = size(&World::build(&near, &instances, Structure::Bvh));
        let distance = [1e3, 1e6, 1e9][seed as usize % 3] * near_size.max_element();
        let offset = DVec3::new(0.6, -0.8, 0.3) * distance;
        let far = hard_scene(seed).moved(1.0, offset).unwrap();
        let instances = Instances::of(&far).unwrap();

        let scan = World::build(&far, &instances, Structure::Linear);
        assert_ne!(scan.center, DVec3::ZERO, "{seed}");

        let rays = hard_rays(&far, &instances, seed, RAYS);
        for precision in [Precision::Exact, Precision::Guarded] {
            let kernels = |lanes| Kernels { precision, lanes };
            let answers = |world: &World, lanes| {
                let nearest = rays.closest(world, &kernels(lanes));
                let t_max = vec![1.0; RAYS];
                let cache = &mut ShadowCache::new(Default::default());
                let blocked = rays.any(world, &kernels(lanes), &t_max, cache);
                let met = |(t, id): &(f64, HitId)| (*id != HitId::NONE).then(|| (t.to_bits(), *id));
                let nearest: Vec<_> = nearest.iter().map(met).collect();
                (nearest, blocked)
            };
            let expected = answers(&scan, 1);
            hits += expected.0.iter().flatten().count();
            for structure in structures() {
                let world = World::build(&far, &instances, structure);
                for lanes in [1, native_width()] {
                    let found = answers(&world, lanes);
                    assert!(found == expected, "{seed}: {structure:?}, {lanes} lanes");
                }
            }
        }
    }
    assert!(hits > RAYS, "{hits}");
}

/// A placed shape's ray is rounded in the shape's space, by its distance and by how
/// oblique the placement is. What it meets there counts, though the ray in the world
/// passes by the shape's box.
#[test]
fn far_rays_meet_what_their_rounding_meets() {
    let mut hits = 0;
    let scenes = campaign(320);
    for seed in 0..scenes as u64 {
        let random = &mut Random(seed);
        let mut b = SceneBuilder::default();
        let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
        let corners = Aabb::new(min, max).corners().map(|c| c.to_array());
        let sides = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let halves = sides
            .into_iter()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let mesh = MeshData {
            positions: corners.to_vec(),
            triangles: halves.collect(),
            ..MeshData::default()
        };
        let shapes = [b.cuboid("", Cuboid { min, max }), b.mesh("", &mesh)];
        // From turned shapes to needles that lie obliquely in their own space.
        let decades = [0.0, 1.0, 3.0, 6.0][seed as usize % 4];
        let oblique = |random: &mut Random| {
            let axis = |r: &mut Random| libm::exp10(r.unit() * decades);
            let stretch = DVec3::new(axis(random), axis(random), axis(random));
            random.oblique(stretch)
        };
        let mut places = Vec::new();
        for i in 0..8 {
            let shift = DAffine3::from_translation(random.vector() * 2.0);
            let inner = shift * oblique(random);
            let placed = b.transform(inner.into());
            let shape = shapes[i % 2];
            if seed % 8 < 4 {
                b.instance("", Edge::shape(shape).transform(placed));
                places.push(inner);
                continue;
            }
            // An operand of what stands as it is, or is placed itself.
            let outer = match i < 4 {
                true => DAffine3::IDENTITY,
                false => oblique(random),
            };
            let operand = Operand::shape(shape).transform(placed);
            let solid = b.csg("", Operator::Union, &[operand]);
            let placed = b.transform(outer.into());
            b.instance("", Edge::shape(solid).transform(placed));
            places.push(outer * inner);
        }
        let scene = b.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let reference = Reference::new(&scene, &instances).unwrap();
        let mut rays = RayColumns::default();
        let mut expected = Vec::new();
        while rays.len() < RAYS {
            let place = places[random.below(8) as usize];
            let corner = corners[random.below(8) as usize];
            let at = place.transform_point3(DVec3::from_array(corner));
            let mut dir = random.vector();
            let distance = libm::exp10(1.0 + 12.0 * random.unit().abs());
            dir[random.below(3) as usize] = distance * Affine::from(place).norm();
            let dir = dir.as_vec3();
            let org = at - dir.as_dvec3();
            rays.push(org, dir.to_array());
            let dir = dir.as_dvec3().to_array();
            let hit = reference.nearest(org.to_array(), dir, f64::INFINITY);
            expected.push(hit.map_or(HitId::NONE, |hit| HitId {
                instance: hit.instance,
                primitive: hit.primitive,
            }));
        }
        hits += expected.iter().filter(|id| **id != HitId::NONE).count();
        for structure in structures().into_iter().chain([Structure::Nested]) {
            let world = World::build(&scene, &instances, structure);
            for precision in [Precision::Exact, Precision::Guarded] {
                for lanes in [1, native_width()] {
                    let kernels = Kernels { precision, lanes };
                    let found = rays.closest(&world, &kernels);
                    for (i, ((_, found), expected)) in found.iter().zip(&expected).enumerate() {
                        let ray = rays.ray(i);
                        let how = (structure, precision, lanes);
                        assert_eq!(found, expected, "{seed}: {how:?}, {ray:?}");
                    }
                }
            }
        }
    }
    assert!(hits > scenes * RAYS / 6, "{hits}");
}

/// Where the operands' spaces blur, a CSG solid has no box in the world either.
#[test]
fn csg_solids_of_oblique_needles_stand_outside_the_trees() {
    let outside = |long: f64, outer: DAffine3| {
        let mut b = SceneBuilder::default();
        let (center, radius) = (DVec3::ZERO, 1.0);
        let ball = b.sphere("", Sphere { center, radius });
        let turn = DAffine3::from_rotation_z(0.7);
        let needle = turn * DAffine3::from_scale(DVec3::new(long, 1.0, 1.0)) * turn;
        let operand = Operand::shape(ball).transform(b.transform(needle.into()));
        let solid = b.csg("", Operator::Union, &[operand]);
        let placed = b.transform(outer.into());
        b.instance("", Edge::shape(solid).transform(placed));
        let scene = b.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let world = World::build(&scene, &instances, Structure::Bvh);
        world.unbounded_solids().count()
    };
    let scaled = DAffine3::from_scale(DVec3::new(1e-4, 1.0, 1.0));
    assert_eq!(outside(1e6, DAffine3::IDENTITY), 1);
    assert_eq!(outside(100.0, DAffine3::IDENTITY), 0);
    assert_eq!(outside(100.0, DAffine3::from_scale(DVec3::splat(1e6))), 0);
    // Neither map does, but both together.
    assert_eq!(outside(1.0, scaled), 0);
    assert_eq!(outside(100.0, scaled), 1);
}

/// Pictures of needles that lie obliquely in their own spaces: meshes and solids that no
/// tree has, beside others.
#[test]
fn pictures_of_what_has_no_box_are_the_same() {
    let config = RenderConfig {
        width: 64,
        height: 48,
        aovs: ALL_AOVS,
        max_depth: 2,
        ..RenderConfig::default()
    };
    for seed in 0..6 {
        let random = &mut Random(seed);
        let mut b = SceneBuilder::default();
        for i in 0..12 {
            let shape = match i % 3 {
                0 => b.mesh("", &random_mesh(random)),
                _ => random_shape(&mut b, random),
            };
            let long = if i % 2 == 0 { 1e6 } else { 2.0 };
            let stretch = DVec3::new(long, 1.0, 1.0 + random.unit().abs());
            let map = random.oblique(stretch);
            let map = DAffine3::from_translation(random.vector() * 2.0) * map;
            let map = b.transform(map.into());
            b.instance("", Edge::shape(shape).transform(map));
        }
        b.light(Light::Directional {
            direction: DVec3::new(1.0, -1.0, -0.5),
            irradiance: [1.0; 3],
            angle: 0.0,
        });
        let from = random.vector() + 9.0 * DVec3::Z;
        let camera = Camera::perspective(from, DVec3::ZERO, DVec3::Y, 45.0);
        b.camera("", camera);
        let scene = b.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let world = World::build(&scene, &instances, Structure::Bvh);
        assert!(world.unbounded_meshes().count() > 0 && world.unbounded_solids().count() > 0);
        let structures = structures().into_iter().chain([Structure::ItemBuffer]);
        for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
            let hashes = structures.clone().map(|structure| {
                let way = Way {
                    precision,
                    lanes: native_width(),
                    structure,
                };
                let lights = &scene.lights;
                hash(&picture(&scene, camera, lights, way, &config))
            });
            let hashes: Vec<u64> = hashes.collect();
            assert!(
                hashes.iter().all(|h| *h == hashes[0]),
                "{seed}, {precision:?}: {hashes:x?}"
            );
        }
    }
}

/// What lies beyond f32 takes nothing else along.
#[test]
fn what_is_near_is_met_beside_what_f32_cannot_reach() {
    let balls = |far: Option<f64>| {
        let mut scene = SceneBuilder::default();
        let ball = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.0,
            },
        );
        let places = (0..9).map(|i| DVec3::new(1.5 * f64::from(i), 0.3, 0.0));
        let far = far.map(|x| [DVec3::new(0.0, 0.0, -x), DVec3::new(x, 0.9 * x, 0.0)]);
        for place in places.chain(far.into_iter().flatten()) {
            let map = scene.transform(DAffine3::from_translation(place).into());
            scene.instance("", Edge::shape(ball).transform(map));
        }
        scene.finish().unwrap()
    };
    let near = balls(None);
    let rays = hard_rays(&near, &Instances::of(&near).unwrap(), 1, RAYS);
    let kernels = kernels(Precision::Guarded);
    for distance in [1e38, 3.5e38, 1e39, 1e300] {
        let scene = balls(Some(distance));
        let instances = Instances::of(&scene).unwrap();
        let nearest = |structure| {
            let world = World::build(&scene, &instances, structure);
            rays.closest(&world, &kernels)
        };
        let expected = nearest(Structure::Linear);
        let hits = expected.iter().filter(|(_, id)| *id != HitId::NONE);
        assert!(hits.count() > RAYS / 8);
        for structure in structures() {
            let found = nearest(structure);
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(found.1, expected.1, "{distance}: {structure:?}");
            }
        }
    }
}

/// Rays of one origin that f32 cannot reach, before a cone as large.
#[test]
fn what_is_beyond_f32_is_met_from_one_origin() {
    for size in [1e30, 1e37, 1e38, 1e40, 1e100] {
        let mut scene = SceneBuilder::default();
        let cone = Cone {
            base: DVec3::new(0.0, -size, 0.0),
            top: DVec3::new(0.0, size, 0.0),
            base_radius: size,
            top_radius: 0.0,
            open: false,
        };
        let shape = scene.cone("", cone);
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let mut rays = RayColumns::default();
        for i in 0..RAYS {
            let [y, z] = [i / 16, i % 16].map(|x| (x as f32 - 8.0) / 16.0);
            rays.push(DVec3::new(1.7 * size, -0.9 * size, 0.0), [-1.0, y, z]);
        }
        for precision in [Precision::Exact, Precision::Guarded] {
            let kernels = kernels(precision);
            let met = |structure| {
                let world = World::build(&scene, &instances, structure);
                let nearest = rays.closest(&world, &kernels);
                nearest.iter().map(|(_, id)| *id).collect::<Vec<_>>()
            };
            let expected = met(Structure::Linear);
            let hits = expected.iter().filter(|id| **id != HitId::NONE).count();
            assert!(hits > 64 && hits < RAYS, "{size}: {hits}");
            for structure in structures() {
                assert!(met(structure) == expected, "{size}: {structure:?}");
            }
        }
    }
}
