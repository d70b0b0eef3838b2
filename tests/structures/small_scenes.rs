//! Small scenes, most of them degenerate, ten thousand at full size: every structure, kernel
//! and width has the hits of the linear scan, bit by bit.

use crate::common::{Random, RayColumns, campaign, property, random_shape, structures};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cuboid, HalfSpace, Sphere};
use lanecast::internals::plan::{Kernels, Precision, native_width, widths};
use lanecast::internals::scene::{Edge, Instances, MeshData, Scene, SceneBuilder, ShapeId};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};
use proptest::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sort {
    /// Nothing to meet: a point for a triangle, and a node without children. (A
    /// scene without any shape is refused.)
    Empty,
    One,
    /// One shape or many alike, in one place.
    Identical,
    /// All in one plane.
    Flat,
    /// Centres, or the triangles themselves, on one line.
    Line,
    /// One in the other, about one centre.
    Nested,
    /// Faces, edges and corners in common.
    Lattice,
    Anything,
}

const SORTS: [Sort; 8] = [
    Sort::Empty,
    Sort::One,
    Sort::Identical,
    Sort::Flat,
    Sort::Line,
    Sort::Nested,
    Sort::Lattice,
    Sort::Anything,
];

/// A coordinate that others are likely to share.
fn round(random: &mut Random) -> f64 {
    random.below(5) as f64 * 0.5 - 1.0
}

fn round_point(random: &mut Random) -> DVec3 {
    DVec3::new(round(random), round(random), round(random))
}

fn triangles(
    scene: &mut SceneBuilder,
    random: &mut Random,
    place: impl Fn(DVec3) -> DVec3,
) -> ShapeId {
    let vertices = 3 + random.below(9);
    let corner = |random: &mut Random| match random.below(2) {
        0 => round_point(random),
        _ => random.vector(),
    };
    let positions = (0..vertices).map(|_| place(corner(random)).to_array());
    let positions: Vec<[f64; 3]> = positions.collect();
    let index = |random: &mut Random| random.below(vertices) as u32;
    let triangles = (0..1 + random.below(24)).map(|_| [(); 3].map(|()| index(random)));
    let data = MeshData {
        triangles: triangles.collect(),
        positions,
        ..MeshData::default()
    };
    scene.mesh("", &data)
}

fn anywhere(scene: &mut SceneBuilder, random: &mut Random, edge: Edge) -> Edge {
    let turn = DQuat::from_axis_angle(random.vector().normalize_or(DVec3::X), random.unit() * 3.0);
    let scale = DVec3::new(random.size(), random.size(), random.size()) * 2.0;
    let place = DAffine3::from_scale_rotation_translation(scale, turn, random.vector());
    edge.transform(scene.transform(place.into()))
}

/// A few primitives of one sort.
fn small_scene(sort: Sort, random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    let count = 1 + random.below(9);
    let put = |scene: &mut SceneBuilder, shape| scene.instance("", Edge::shape(shape));
    match sort {
        Sort::Empty => {
            let at = round_point(random).to_array();
            let data = MeshData {
                positions: vec![at; 3],
                triangles: vec![[0, 1, 2]],
                ..MeshData::default()
            };
            let point = scene.mesh("", &data);
            put(&mut scene, point);
            let nothing = scene.node("", &[]);
            scene.instance("", Edge::node(nothing));
        }
        Sort::One => {
            let shape = match random.below(4) {
                0 => triangles(&mut scene, random, |p| p),
                1 => scene.half_space(
                    "",
                    HalfSpace {
                        normal: round_point(random) + DVec3::new(0.1, 0.0, 0.0),
                        offset: round(random),
                    },
                ),
                _ => random_shape(&mut scene, random),
            };
            put(&mut scene, shape);
        }
        Sort::Identical => {
            let seed = random.bits();
            let moved = random.below(2) == 0;
            let mut shape = random_shape(&mut scene, &mut Random(seed));
            let mut edge = Edge::shape(shape);
            if moved {
                edge = anywhere(&mut scene, random, edge);
            }
            for _ in 0..count {
                if random.below(2) == 0 {
                    shape = random_shape(&mut scene, &mut Random(seed));
                }
                let transform = edge.transform;
                scene.instance("", Edge::shape(shape).transform(transform));
            }
        }
        Sort::Flat => {
            let (axis, at) = (random.below(3) as usize, round(random));
            for _ in 0..count {
                let flat = |mut p: DVec3| {
                    p[axis] = at;
                    p
                };
                let shape = if random.below(2) == 0 {
                    triangles(&mut scene, random, flat)
                } else {
                    let [mut u, mut v] = [DVec3::ZERO; 2];
                    u[(axis + 1) % 3] = random.size();
                    v[(axis + 2) % 3] = random.size();
                    let corner = flat(round_point(random));
                    scene.polygon("", &[corner, corner + u, corner + u + v, corner + v], &[])
                };
                put(&mut scene, shape);
            }
        }
        Sort::Line => {
            let along = match random.below(2) {
                0 => DVec3::X,
                _ => random.vector(),
            };
            let radius = random.size();
            for i in 0..count {
                let center = along * (i as f64 * 0.5 - 1.0);
                let shape = match random.below(3) {
                    0 => triangles(&mut scene, random, |p| along * p.x),
                    1 => scene.sphere("", Sphere { center, radius }),
                    _ => scene.cuboid(
                        "",
                        Cuboid {
                            min: center - DVec3::splat(radius),
                            max: center + DVec3::splat(radius),
                        },
                    ),
                };
                put(&mut scene, shape);
            }
        }
        Sort::Nested => {
            let center = round_point(random);
            for i in 0..count {
                let size = 0.1 * (i + 1) as f64;
                let shape = match random.below(2) {
                    0 => scene.sphere(
                        "",
                        Sphere {
                            center,
                            radius: size,
                        },
                    ),
                    _ => scene.cuboid(
                        "",
                        Cuboid {
                            min: center - DVec3::splat(size),
                            max: center + DVec3::splat(size),
                        },
                    ),
                };
                put(&mut scene, shape);
            }
        }
        Sort::Lattice => {
            for _ in 0..count {
                let shape = match random.below(3) {
                    0 => triangles(&mut scene, random, |p| (p * 2.0).round() * 0.5),
                    1 => scene.sphere(
                        "",
                        Sphere {
                            center: round_point(random),
                            radius: 0.5,
                        },
                    ),
                    _ => {
                        let min = round_point(random);
                        let max = min + DVec3::splat(0.5);
                        scene.cuboid("", Cuboid { min, max })
                    }
                };
                put(&mut scene, shape);
            }
        }
        Sort::Anything => {
            // Some of them under a node that appears twice.
            let mut children = Vec::new();
            for _ in 0..count {
                let shape = random_shape(&mut scene, random);
                let mut edge = Edge::shape(shape);
                if random.below(2) == 0 {
                    edge = anywhere(&mut scene, random, edge);
                }
                match random.below(2) {
                    0 => children.push(edge),
                    _ => scene.instance("", edge),
                }
            }
            if !children.is_empty() {
                let node = scene.node("", &children);
                scene.instance("", Edge::node(node));
                let edge = anywhere(&mut scene, random, Edge::node(node));
                scene.instance("", edge);
            }
        }
    }
    scene.finish().expect("a small scene is a good scene")
}

/// A tile's rays from one origin, and a stream's from anywhere; some along an
/// axis, many at corners.
fn rays(random: &mut Random) -> RayColumns {
    let mut rays = RayColumns::default();
    let eye = match random.below(2) {
        0 => round_point(random) * 3.0,
        _ => random.vector() * 4.0,
    };
    for i in 0..128 {
        let org = match i / 64 {
            0 => eye,
            _ if random.below(2) == 0 => round_point(random) * 2.0,
            _ => random.vector() * 3.0,
        };
        let target = match random.below(2) {
            0 => round_point(random),
            _ => random.vector() * 1.2,
        };
        let mut dir = (target - org).to_array().map(|x| x as f32);
        if i >= 64 && random.below(4) == 0 {
            let axis = random.below(3) as usize;
            dir = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        }
        if dir == [0.0; 3] {
            dir[1] = -1.0;
        }
        rays.push(org, dir);
    }
    rays
}

/// Answers without the t of rays that meet nothing.
fn met(answers: Vec<(f64, HitId)>) -> Vec<Option<(u64, HitId)>> {
    let hit = |(t, id): (f64, HitId)| (id != HitId::NONE).then_some((t.to_bits(), id));
    answers.into_iter().map(hit).collect()
}

/// Returns how many rays hit.
fn all_same(sort: Sort, seed: u64) -> usize {
    let random = &mut Random(seed);
    let scene = small_scene(sort, random);
    let instances = Instances::of(&scene).unwrap();
    let rays = rays(random);
    let t_max = [0.5, 1.0, f32::INFINITY][random.below(3) as usize];
    let ends = vec![t_max; rays.len()];
    let scan = World::build(&scene, &instances, Structure::Linear);
    let kernels = |precision, lanes| Kernels { precision, lanes };
    let closest = |world: &World, kernels| met(rays.closest(world, &kernels));
    let any = |world: &World, kernels| {
        rays.any(world, &kernels, &ends, &mut ShadowCache::new(Caching::On))
    };
    let one = kernels(Precision::Exact, 1);
    let (nearest, blocked) = (closest(&scan, one), any(&scan, one));
    // The ray's end is compared with t itself, which what is reported may be far from (of
    // a triangle without width): so another search says what lies before it.
    let before = met(rays.closest_within(&scan, &one, &ends));
    for i in 0..rays.len() {
        let blocked = blocked[i];
        assert_eq!(blocked, before[i].is_some(), "{sort:?} {seed}, ray {i}");
        let same = !blocked || before[i] == nearest[i];
        assert!(
            same,
            "{sort:?} {seed}, ray {i}: {:?} of {:?}",
            before[i], nearest[i]
        );
    }
    // Guarded reports another t, and nothing else.
    let guarded = closest(&scan, kernels(Precision::Guarded, 1));
    for i in 0..rays.len() {
        let [ours, theirs] = [guarded[i], nearest[i]].map(|hit| hit.map(|(_, id)| id));
        assert_eq!(ours, theirs, "{sort:?} {seed}, ray {i}, guarded");
    }
    for structure in structures() {
        let world = World::build(&scene, &instances, structure);
        // Every decision made exactly: what the error bounds decide is the same.
        #[cfg(feature = "all-lanes")]
        {
            let doubting = met(rays.closest_doubting(&world));
            for i in 0..rays.len() {
                let same = doubting[i] == guarded[i];
                assert!(
                    same,
                    "{sort:?} {seed}: {structure:?}, ray {i}, all in doubt"
                );
            }
        }
        let exact = widths();
        let exact = exact.iter().map(|lanes| (Precision::Exact, *lanes));
        for (precision, lanes) in exact.chain([(Precision::Guarded, native_width())]) {
            let kernels = kernels(precision, lanes);
            let what = || format!("{sort:?}, seed {seed}: {structure:?}, {kernels:?}");
            let (found, seen) = (closest(&world, kernels), any(&world, kernels));
            let is_exact = precision == Precision::Exact;
            let nearest = if is_exact { &nearest } else { &guarded };
            for i in 0..rays.len() {
                assert_eq!(found[i], nearest[i], "ray {i} of {}", what());
                assert_eq!(seen[i], blocked[i], "ray {i} of {}, any", what());
            }
        }
    }
    nearest.iter().flatten().count()
}

static HITS: [AtomicUsize; 8] = [const { AtomicUsize::new(0) }; 8];

proptest! {
    #![proptest_config(property(5_000))]

    fn each_small_scene(sort in 0..SORTS.len(), seed in any::<u64>()) {
        HITS[sort].fetch_add(all_same(SORTS[sort], seed), Relaxed);
    }
}

#[test]
fn small_scenes_have_one_answer() {
    assert!(SceneBuilder::default().finish().is_err());
    // Other ones each time.
    rayon::join(each_small_scene, each_small_scene);
    for (sort, hits) in SORTS.iter().zip(&HITS) {
        let hits = hits.load(Relaxed);
        println!("{sort:?}: {hits} rays hit");
        // A scene has 128 rays, and of each sort there is about one in eight.
        let enough = if *sort == Sort::Empty {
            hits == 0
        } else {
            hits > campaign(10_000) / 10
        };
        assert!(enough, "{sort:?}: {hits}");
    }
}
