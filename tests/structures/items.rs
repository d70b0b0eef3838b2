//! The item buffer has the hits of the tree and of the linear scan: random scenes, degenerate
//! ones, and scenes of files; rays in patches of a picture, and rays in random order.

use crate::common::{
    Random, RayColumns, assets, hash, in_repository, load, property, random_mesh, random_scene,
};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::render::{AovSet, RenderConfig};
use lanecast::internals::scene::{Edge, Instances, MeshData, Scene, SceneBuilder};
use lanecast::internals::trace::HitId;
use proptest::prelude::*;

/// A picture of 24×24 rays from anywhere, also from among the shapes, of any
/// width up to 140 degrees, in patches of 8×8 or row by row.
fn camera_rays(random: &mut Random) -> RayColumns {
    const SIDE: u64 = 24;
    let distance = [0.0, 0.5, 3.0, 1000.0][random.below(4) as usize];
    let eye = random.vector() * 0.3 + random.vector().normalize() * distance;
    let forward = if distance > 1.0 {
        -eye.normalize()
    } else {
        random.vector().normalize()
    };
    let half = if distance > 100.0 {
        0.002
    } else {
        [0.1, 0.6, 2.7][random.below(3) as usize]
    };
    let right = forward.cross(random.vector()).normalize();
    let up = right.cross(forward);
    let patches = random.below(4) != 0;
    let mut rays = RayColumns::default();
    for i in 0..SIDE * SIDE {
        let (x, y) = if patches {
            let (patch, i) = (i / 64, i % 64);
            (patch % 3 * 8 + i % 8, patch / 3 * 8 + i / 8)
        } else {
            (i % SIDE, i / SIDE)
        };
        let at = |i: u64| ((i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0) * half;
        let dir = forward + right * at(x) - up * at(y);
        rays.push(eye, dir.to_array().map(|x| x as f32));
    }
    rays
}

/// A few meshes of triangles that are alike, flat, on a line or at a point.
fn degenerate(random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    for _ in 0..1 + random.below(3) {
        let axes = [0.0, 1.0].map(|x: f64| x);
        let mut keep = || axes[random.below(2) as usize];
        let mask = DVec3::new(keep(), keep(), keep());
        let alike = random.below(2) == 0;
        let corners: Vec<DVec3> = (0..3).map(|_| random.vector()).collect();
        let count = 1 + random.below(80);
        let positions = (0..3 * count).map(|i| {
            let free = if alike {
                corners[i as usize % 3]
            } else {
                random.vector()
            };
            (free * mask).to_array()
        });
        let mesh = MeshData {
            positions: positions.collect(),
            triangles: (0..count as u32)
                .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
                .collect(),
            ..MeshData::default()
        };
        let mesh = scene.mesh("", &mesh);
        scene.instance("", Edge::shape(mesh));
    }
    scene.finish().unwrap()
}

/// Meshes some of whose triangles stand in the same place once more, in whose
/// spaces the rays of a wide tile do not advance together.
fn twins(random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    for _ in 0..1 + random.below(12) {
        let whole = random_mesh(random);
        let mut some = whole.clone();
        some.triangles.truncate(some.triangles.len() / 3);
        // Flat, by up to a hundred.
        let mut size = || libm::pow(10.0, random.unit());
        let size = DVec3::new(size(), size(), size());
        let turn = DQuat::from_axis_angle(random.vector().normalize(), random.unit() * 3.0);
        let map = DAffine3::from_scale_rotation_translation(size, turn, random.vector());
        for data in [whole, some] {
            let mesh = scene.mesh("", &data);
            let transform = scene.transform(map.into());
            scene.instance("", Edge::shape(mesh).transform(transform));
        }
    }
    scene.finish().unwrap()
}

type Met = Vec<Option<(u64, HitId)>>;

fn met(answers: Vec<(f64, HitId)>) -> Met {
    let met = |(t, id): (f64, HitId)| (id != HitId::NONE).then(|| (t.to_bits(), id));
    answers.into_iter().map(met).collect()
}

fn same_as_traced(scene: &Scene, rays: &RayColumns) -> Result<(), TestCaseError> {
    let instances = Instances::of(scene).unwrap();
    let tree = World::build(scene, &instances, Structure::Bvh);
    let items = World::build(scene, &instances, Structure::ItemBuffer);
    let scan = World::build(scene, &instances, Structure::Linear);
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        for lanes in [1, native_width()] {
            let kernels = Kernels { precision, lanes };
            let expected = met(rays.closest(&tree, &kernels));
            let Some(listed) = rays.closest_listed(&items, &kernels).map(met) else {
                return Err(TestCaseError::fail("no lists"));
            };
            if precision != Precision::Fast {
                let scanned = met(rays.closest(&scan, &kernels));
                prop_assert_eq!(&expected, &scanned, "traced, {:?}", kernels);
                prop_assert_eq!(listed, expected, "{:?}", kernels);
                continue;
            }
            // Which of two triangles at one rounded depth is met may depend on
            // the order.
            for (listed, expected) in listed.iter().zip(&expected) {
                let t = |met: &Option<(u64, HitId)>| met.map(|(t, _)| f64::from_bits(t));
                match (t(listed), t(expected)) {
                    (Some(a), Some(b)) => prop_assert!((a - b).abs() <= 1e-5 * b.abs()),
                    (a, b) => prop_assert_eq!(a, b),
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(property(500))]

    #[test]
    fn random_scenes(seed in any::<u64>()) {
        let scene = random_scene(seed);
        same_as_traced(&scene, &camera_rays(&mut Random(seed)))?;
    }

    #[test]
    fn degenerate_scenes(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let scene = degenerate(random);
        same_as_traced(&scene, &camera_rays(random))?;
    }

    #[test]
    fn meshes_that_stand_twice(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let scene = twins(random);
        same_as_traced(&scene, &camera_rays(random))?;
    }
}

/// Rays from within placed meshes, some of which go against the others there:
/// found when such tiles lost what they met.
#[test]
fn rays_that_fan_out_within_meshes() -> Result<(), TestCaseError> {
    for seed in [
        2884728167441963754,
        3884191051923679857,
        10003407492326734310,
    ] {
        let scene = random_scene(seed);
        same_as_traced(&scene, &camera_rays(&mut Random(seed)))?;
    }
    Ok(())
}

/// No lists, or lists that do not fit the rays: the trees answer.
#[test]
fn rays_without_lists_are_traced() {
    let scene = random_scene(7);
    let instances = Instances::of(&scene).unwrap();
    let tree = World::build(&scene, &instances, Structure::Bvh);
    let items = World::build(&scene, &instances, Structure::ItemBuffer);
    let kernels = Kernels {
        precision: Precision::Exact,
        lanes: 1,
    };
    let [mut apart, mut here] = [RayColumns::default(), RayColumns::default()];
    let random = &mut Random(7);
    for _ in 0..640 {
        let dir = (-random.vector()).to_array().map(|x| x as f32);
        apart.push(random.vector() * 2.0, dir);
        here.push(DVec3::new(0.1, 0.2, 0.3), dir);
    }
    let expected = met(here.closest(&tree, &kernels));
    assert_eq!(met(here.closest(&items, &kernels)), expected);
    // Rays all around the origin, in no order, have no lists.
    assert!(here.closest_listed(&items, &kernels).is_none());
    // Nor have rays of origins of their own.
    let expected = met(apart.closest(&tree, &kernels));
    assert_eq!(met(apart.closest(&items, &kernels)), expected);
    assert!(apart.closest_listed(&items, &kernels).is_none());

    // Lists of another picture serve nothing that they do not stand for.
    let (ours, others) = (camera_rays(&mut Random(3)), camera_rays(&mut Random(4)));
    let buffer = others.item_buffer(&items).unwrap();
    let expected = met(ours.closest(&tree, &kernels));
    assert_eq!(met(ours.closest_by(&buffer, &items, &kernels)), expected);
}

#[test]
fn pictures_of_files() {
    let Some(assets) = assets() else { return };
    let scenes = in_repository("scenes");
    let mut some = 0;
    for path in [
        assets.join("meshes/dragon_202k.glb"),
        assets.join("spd/teapot_12.nff"),
        assets.join("spd/balls_4.nff"),
        scenes.join("instances.toml"),
        scenes.join("primitives.toml"),
        scenes.join("glass.toml"),
    ] {
        let loaded = load(&path, 300.0 / 200.0);
        let config = RenderConfig {
            width: 300,
            height: 200,
            spp: 2,
            max_depth: 1,
            aovs: AovSet {
                depth: true,
                instance_id: true,
                primitive_id: true,
                ..AovSet::default()
            },
            ..RenderConfig::default()
        };
        let (tree, items) = (
            loaded.world(Structure::Bvh),
            loaded.world(Structure::ItemBuffer),
        );
        let of = |world: &World, precision| {
            let kernels = loaded.kernels(precision);
            loaded.render(world, kernels, &loaded.scene.lights, &config)
        };
        let name = path.file_name().unwrap().display();
        let exact = [&tree, &items].map(|world| of(world, Precision::Exact));
        assert!(hash(&exact[0]) == hash(&exact[1]), "{name}");
        some += exact[0].counts.primary_hits;
        let [by_tree, by_items] = [&tree, &items].map(|world| of(world, Precision::Fast).picture);
        let ids = by_tree.primitive_id.iter().zip(&by_items.primitive_id);
        let differ = ids
            .flat_map(|(a, b)| a.iter().zip(b))
            .filter(|(a, b)| a != b);
        println!("{name}: fast, {} of 60000 pixels differ", differ.count());
    }
    assert!(some > 10_000);
}
