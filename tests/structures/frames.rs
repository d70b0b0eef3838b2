//! Sequences of frames: refitted worlds, and camera rays that begin with the hits of the frame
//! before. No bit of a picture shows what was reused.

use crate::common::{ALL_AOVS, Loaded, assets, hash, in_repository, load};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{
    Accelerator, KeptTrees, RefitOutcome, Structure, WORST_REFIT, World,
};
use lanecast::internals::geom::Sphere;
use lanecast::internals::math::{Aabb32, Affine};
use lanecast::internals::plan::Precision;
use lanecast::internals::render::{
    FrameMemory, LightCache, Progress, RenderConfig, View, render_after,
};
use lanecast::internals::scene::{
    Camera, Edge, Instances, Key, MeshData, Scene, SceneBuilder, SceneError, Target,
};
use lanecast::internals::trace::Reuse;

const FRAMES: u32 = 5;

fn moved(to: DVec3) -> Affine {
    DAffine3::from_translation(to).into()
}

fn turned(to: DVec3, degrees: f64) -> Affine {
    (DAffine3::from_translation(to) * DAffine3::from_rotation_y(degrees.to_radians())).into()
}

fn key(at: f64, local: Affine) -> Key {
    Key { at, local }
}

fn completed(scene: Scene) -> Loaded {
    let instances = Instances::of(&scene).unwrap();
    let row = (!scene.cameras.rows.is_empty()).then_some(0);
    let (scene, camera) = scene.completed(row, &instances, 4.0 / 3.0);
    Loaded {
        scene,
        instances,
        camera,
    }
}

/// A closed bumpy ball, so that silhouettes and edges abound.
fn ball(across: u32, down: u32) -> MeshData {
    let mut mesh = MeshData::default();
    for j in 0..=down {
        for i in 0..=across {
            let (u, v) = (
                f64::from(i % across) / f64::from(across) * std::f64::consts::TAU,
                f64::from(j) / f64::from(down) * std::f64::consts::PI,
            );
            let r = 1.0 + 0.15 * (5.0 * u).sin() * (4.0 * v).sin();
            let p = [r * v.sin() * u.cos(), r * v.cos(), r * v.sin() * u.sin()];
            mesh.positions.push(p);
        }
    }
    let row = across + 1;
    for j in 0..down {
        for i in 0..across {
            let a = j * row + i;
            if j > 0 {
                mesh.triangles.push([a, a + 1, a + row]);
            }
            if j + 1 < down {
                mesh.triangles.push([a + 1, a + row + 1, a + row]);
            }
        }
    }
    mesh
}

/// Meshes that turn, cross each other and go behind each other.
fn crossing_meshes() -> Loaded {
    let mut scene = SceneBuilder::default();
    let mesh = scene.mesh("", &ball(48, 24));
    let still = scene.mesh("", &ball(24, 12));
    for i in 0..12 {
        let (a, x) = (f64::from(i) * 0.7, f64::from(i % 4) * 1.6 - 2.4);
        let from = DVec3::new(x, f64::from(i / 4) * 1.5 - 1.5, a.sin() * 2.0);
        let to = from + DVec3::new(2.5 * a.cos(), 0.4, -2.0 * a.sin());
        let keys = [
            key(0.5, turned(0.5 * (from + to), 50.0 + 9.0 * a)),
            key(1.0, turned(to, 100.0)),
        ];
        let id = scene.moving(turned(from, 9.0 * a), &keys);
        scene.instance("", Edge::shape(mesh).transform(id));
    }
    scene.instance("", Edge::shape(still));
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.5, 1.0, 9.0), DVec3::ZERO, DVec3::Y, 45.0),
    );
    completed(scene.finish().unwrap())
}

/// Meshes that deform, one of them turning, among others that do not.
fn deforming_meshes() -> Loaded {
    let mut scene = SceneBuilder::default();
    let stretched = |by: [f64; 3]| {
        let mut mesh = ball(32, 16);
        for vertex in &mut mesh.positions {
            *vertex = std::array::from_fn(|k| vertex[k] * by[k]);
        }
        mesh
    };
    let keys = [
        (0.6, stretched([0.4, 2.0, 1.0])),
        (1.0, stretched([1.5, 0.8, 0.5])),
    ];
    let deforming = scene.deforming_mesh("", &stretched([1.0; 3]), &keys);
    let still = scene.mesh("", &ball(24, 12));
    let to = DVec3::new(1.5, 0.5, 0.5);
    let id = scene.moving(turned(to, 0.0), &[key(1.0, turned(to, 80.0))]);
    scene.instance("", Edge::shape(deforming).transform(id));
    scene.instance("", Edge::shape(deforming));
    let aside = scene.transform(moved(DVec3::new(-2.0, 0.0, 1.0)));
    scene.instance("", Edge::shape(still).transform(aside));
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.5, 1.0, 9.0), DVec3::ZERO, DVec3::Y, 45.0),
    );
    completed(scene.finish().unwrap())
}

fn scenes() -> Vec<(String, Loaded)> {
    let mut scenes = vec![
        ("meshes".into(), crossing_meshes()),
        ("deforming".into(), deforming_meshes()),
        (
            "moving".into(),
            load(&in_repository("scenes/moving.toml"), 4.0 / 3.0),
        ),
        (
            "glass".into(),
            load(&in_repository("scenes/glass.toml"), 4.0 / 3.0),
        ),
    ];
    if let Some(assets) = assets() {
        let teapot = load(&assets.join("meshes/teapot_6k.glb"), 4.0 / 3.0);
        scenes.push(("teapot".into(), teapot));
    }
    scenes
}

/// Every frame cold, and by each way of reuse through worlds that follow: one
/// hash.
fn same_bits(precision: Precision, threads: usize, tree: Structure) {
    let pool = rayon_pool(threads);
    let config = RenderConfig {
        width: 96,
        height: 72,
        aovs: ALL_AOVS,
        ..RenderConfig::default()
    };
    for (name, loaded) in scenes() {
        let kernels = loaded.kernels(precision);
        let camera = loaded.camera;
        let mut scene = loaded.scene;
        // Always fitted, as it comes, never fitted; and each with its reuse.
        let ways = [
            (f64::INFINITY, Reuse::Depth),
            (WORST_REFIT, Reuse::Hit),
            (0.0, Reuse::Depth),
        ];
        let mut memories = ways.map(|(_, reuse)| FrameMemory::new(reuse));
        let mut kept: [Option<KeptTrees>; 3] = Default::default();
        let mut bounded = 0;
        for frame in 0..FRAMES {
            scene = scene.at(f64::from(frame) / f64::from(FRAMES - 1)).unwrap();
            let instances = Instances::of(&scene).unwrap();
            let render = |world: &World, memory: &mut FrameMemory| {
                let view = View {
                    world,
                    kernels,
                    camera,
                    lights: &scene.lights,
                };
                pool(&mut || {
                    let kept = (&mut *memory, &mut LightCache::default());
                    hash(&render_after(&view, &config, kept, &Progress::default()).unwrap())
                })
            };
            let world = World::build(&scene, &instances, tree);
            let cold = render(&world, &mut FrameMemory::new(Reuse::None));
            for (i, (worst, reuse)) in ways.into_iter().enumerate() {
                let world = match kept[i].take() {
                    None => World::build(&scene, &instances, tree),
                    Some(kept) => World::next(kept, &scene, &instances, tree, worst).0,
                };
                let warm = render(&world, &mut memories[i]);
                assert_eq!(warm, cold, "{name}, frame {frame}, {reuse:?}, {worst}");
                bounded += memories[i].counts().bounded;
                kept[i] = Some(world.keep());
            }
        }
        assert!(bounded > 1000, "{name}: nothing was reused");
    }
}

/// A runner on so many threads.
fn rayon_pool(threads: usize) -> impl Fn(&mut (dyn FnMut() -> u64 + Send)) -> u64 {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    move |run| pool.install(run)
}

#[test]
fn fast_pictures_do_not_show_reuse() {
    same_bits(Precision::Fast, 1, Structure::Bvh);
}

#[test]
fn exact_pictures_do_not_show_reuse() {
    same_bits(Precision::Exact, 2, Structure::Bvh);
}

#[test]
fn other_structures_do_not_show_reuse() {
    same_bits(Precision::Fast, 2, Structure::Narrow);
}

fn holds(outer: &Aabb32, inner: &Aabb32) -> bool {
    (0..3).all(|k| outer.min[k] <= inner.min[k] && inner.max[k] <= outer.max[k])
}

#[test]
fn fitted_trees_contain_everything() {
    let loaded = crossing_meshes();
    let mut scene = loaded.scene;
    let mut kept: Option<KeptTrees> = None;
    for frame in 0..FRAMES {
        scene = scene.at(f64::from(frame) / f64::from(FRAMES - 1)).unwrap();
        let instances = Instances::of(&scene).unwrap();
        let built = World::build(&scene, &instances, Structure::Bvh);
        let world = match kept.take() {
            None => World::build(&scene, &instances, Structure::Bvh),
            Some(kept) => {
                let infinite = f64::INFINITY;
                let (world, outcome) =
                    World::next(kept, &scene, &instances, Structure::Bvh, infinite);
                assert_eq!(outcome, RefitOutcome::Refitted);
                world
            }
        };
        let Accelerator::Wide(levels) = &world.accelerator else {
            panic!("not wide");
        };
        // Every entry once, at its place, in its leaf's box and all above it.
        let mut seen = vec![0; world.entries.len()];
        let mut open = vec![(0, world.bounds)];
        while let Some((node, around)) = open.pop() {
            let node = &levels.tlas.nodes[node];
            for c in 0..node.count as usize {
                let bounds = node.bounds_of(c);
                assert!(holds(&around, &bounds));
                match node.child[c].leaf_range() {
                    None => open.push((node.child[c].index(), bounds)),
                    Some(range) => {
                        for i in range {
                            assert!(holds(&bounds, &world.entries[i].bounds));
                            seen[i] += 1;
                        }
                    }
                }
            }
        }
        assert!(seen.iter().all(|n| *n == 1));
        for id in 0..instances.count() {
            let (a, b) = (world.entry_of(id), built.entry_of(id));
            assert_eq!((a.instance, a.bounds), (id, b.bounds));
        }
        assert_eq!(world.bounds, built.bounds);
        kept = Some(world.keep());
    }
}

/// How a scene's worlds came about, each from the one before.
fn follow(
    mut scene: Scene,
    times: [f64; 4],
    worst: f64,
    mut see: impl FnMut(f64, &World),
) -> Vec<RefitOutcome> {
    let mut renewals = Vec::new();
    let mut kept: Option<KeptTrees> = None;
    for time in times {
        scene = scene.at(time).unwrap();
        let instances = Instances::of(&scene).unwrap();
        let (world, outcome) = match kept.take() {
            None => (
                World::build(&scene, &instances, Structure::Bvh),
                RefitOutcome::Built,
            ),
            Some(kept) => World::next(kept, &scene, &instances, Structure::Bvh, worst),
        };
        see(time, &world);
        renewals.push(outcome);
        kept = Some(world.keep());
    }
    renewals
}

#[test]
fn a_tree_that_has_grown_too_dear_is_built_again() {
    let mut scene = SceneBuilder::default();
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 0.1,
        },
    );
    // Neighbours go opposite ways.
    for i in 0..64 {
        let x = f64::from(i);
        let far = moved(DVec3::X * (f64::from(i * 29 % 64)));
        let id = scene.moving(moved(DVec3::X * x), &[key(1.0, far)]);
        scene.instance("", Edge::shape(ball).transform(id));
    }
    let times = [0.0, 1e-6, 1.0, 1.0];
    let renewals = follow(scene.finish().unwrap(), times, WORST_REFIT, |_, _| ());
    use RefitOutcome::{Built, Rebuilt, Refitted};
    assert_eq!(renewals, [Built, Refitted, Rebuilt, Refitted]);
}

/// On its way a placement may lose its box in the world, and get one again.
#[test]
fn a_placement_that_comes_to_blur_leaves_the_tree() {
    let mut scene = SceneBuilder::default();
    let mesh = scene.mesh("", &ball(12, 6));
    let turn = DAffine3::from_rotation_z(0.7);
    let oblique = turn * DAffine3::from_scale(DVec3::new(1e5, 1.0, 1.0)) * turn;
    for i in 0..9 {
        let to = DVec3::X * 3.0 * f64::from(i);
        let keys = [key(1.0, (DAffine3::from_translation(to) * oblique).into())];
        let keys = if i % 4 == 1 { &keys[..] } else { &[] };
        let id = scene.moving(moved(to), keys);
        scene.instance("", Edge::shape(mesh).transform(id));
    }
    let times = [0.0, 1.0, 1.0, 0.0];
    let renewals = follow(
        scene.finish().unwrap(),
        times,
        f64::INFINITY,
        |time, world| {
            let outside = if time == 1.0 { 2 } else { 0 };
            assert_eq!(world.unbounded.len(), outside);
            assert_eq!(world.entries.len(), 9 - outside);
            for id in 0..9 {
                assert_eq!(world.entry_of(id).instance, id);
            }
        },
    );
    use RefitOutcome::{Built, Rebuilt, Refitted};
    assert_eq!(renewals, [Built, Rebuilt, Refitted, Rebuilt]);
}

#[test]
fn scenes_are_at_their_keys_exactly() {
    let mut scene = SceneBuilder::default();
    let shape = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        },
    );
    let at = |i: u32| {
        turned(
            DVec3::new(0.1, f64::from(i) / 3.0, 0.7),
            11.0 * f64::from(i),
        )
    };
    let id = scene.moving(at(0), &[key(0.3, at(1)), key(0.7, at(2))]);
    scene.instance("", Edge::shape(shape).transform(id));
    // Starts at the identity, and moves all the same.
    let other = scene.moving(Affine::IDENTITY, &[key(1.0, moved(DVec3::X))]);
    scene.instance("", Edge::shape(shape).transform(other));
    let mut scene = scene.finish().unwrap();
    assert!(scene.moves());
    for (time, expected) in [
        (0.0, at(0)),
        (0.3, at(1)),
        (0.7, at(2)),
        (1.0, at(2)),
        (0.0, at(0)),
    ] {
        scene = scene.at(time).unwrap();
        assert_eq!(scene.transforms.local[id.index()], expected);
        assert_eq!(scene.transforms.inverse[id.index()], expected.inverse());
    }
    let scene = scene.at(0.5).unwrap();
    assert_eq!(scene.transforms.local[other.index()], moved(DVec3::X * 0.5));
    assert!(matches!(scene.roots.target[1], Target::Shape(_)));
}

#[test]
fn motions_that_flatten_are_refused() {
    let build = |keys: &[Key]| {
        let mut scene = SceneBuilder::default();
        let shape = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.0,
            },
        );
        let id = scene.moving(Affine::IDENTITY, keys);
        scene.instance("", Edge::shape(shape).transform(id));
        scene.finish().map(|_| ())
    };
    let turn = |degrees| turned(DVec3::ZERO, degrees);
    assert_eq!(
        build(&[key(0.5, turn(90.0)), key(1.0, turn(170.0))]),
        Ok(())
    );
    let Err(SceneError::SingularMotion { time, .. }) = build(&[key(1.0, turn(180.0))]) else {
        panic!("half a turn");
    };
    assert!((time - 0.5).abs() < 1e-3);
    let late = build(&[key(1.5, turn(9.0))]).unwrap_err().to_string();
    assert!(late.contains("above 0 and the key before"), "{late}");
    assert!(build(&[key(0.5, turn(1.0)), key(0.5, turn(2.0))]).is_err());
    let mut nan = turn(3.0);
    nan.translation[1] = f64::NAN;
    assert!(matches!(
        build(&[key(0.5, nan)]),
        Err(SceneError::NotFinite { .. })
    ));
}
