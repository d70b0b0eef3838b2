//! One picture, whatever found it: every structure, width, kernel set, thread
//! count and tile order, over random scenes of all kinds of shapes.

use crate::common::{ALL_AOVS, EVERYTHING, Way, hash, picture, random_scene, structures};
use lanecast::accel::Structure;
use lanecast::plan::{Arithmetic, Choices, plan};
use lanecast::render::{RenderConfig, TileOrder};
use lanecast::scene::{Appearances, Scene};

fn small() -> RenderConfig {
    RenderConfig {
        width: 40,
        height: 36,
        aovs: ALL_AOVS,
        max_depth: 3,
        ..RenderConfig::default()
    }
}

fn hash_of(scene: &Scene, way: Way, config: &RenderConfig) -> u64 {
    let camera = scene.cameras.rows[0];
    hash(&picture(
        scene,
        camera,
        &scene.lights,
        EVERYTHING,
        way,
        config,
    ))
}

/// One picture per scene, but for the f32 tile kernel: it decides triangles by
/// other arithmetic, at every width alike. Returns the scenes where that shows.
fn one_hash(arithmetic: Arithmetic, seeds: std::ops::Range<u64>) -> usize {
    let mut apart = 0;
    for seed in seeds {
        let scene = random_scene(seed);
        let base = Way {
            arithmetic,
            lanes: 1,
            structure: Structure::Linear,
        };
        let expected = hash_of(&scene, base, &small());
        for structure in structures() {
            let tiles = arithmetic == Arithmetic::F32 && structure == Structure::Bvh;
            let expected = if tiles {
                let own = hash_of(&scene, Way { structure, ..base }, &small());
                apart += usize::from(own != expected);
                own
            } else {
                expected
            };
            for lanes in [1, 4, 8, 16] {
                let way = Way {
                    structure,
                    lanes,
                    ..base
                };
                assert_eq!(
                    hash_of(&scene, way, &small()),
                    expected,
                    "seed {seed}: {way:?}"
                );
            }
        }
    }
    apart
}

#[test]
fn fast_pictures_do_not_depend_on_structure_or_width() {
    let apart = one_hash(Arithmetic::F32, 0..80);
    println!("{apart} of 80 scenes differ between tiles and packets");
    assert!(apart <= 6);
}

#[test]
fn exact_pictures_do_not_depend_on_structure_or_width() {
    assert_eq!(one_hash(Arithmetic::F64, 200..280), 0);
}

#[test]
fn guarded_pictures_do_not_depend_on_structure_or_width() {
    assert_eq!(one_hash(Arithmetic::F32Guarded, 400..480), 0);
}

/// The kernels that a scene does not need are left out without a trace.
#[test]
fn what_a_scene_lacks_changes_nothing() {
    for seed in 400..500 {
        let scene = random_scene(seed);
        let appearances = Appearances::of(&scene).unwrap();
        let needs = plan(&scene, &appearances, &Choices::default())
            .unwrap()
            .kernels
            .needs;
        let way = Way {
            arithmetic: Arithmetic::F64,
            lanes: 8,
            structure: Structure::Bvh,
        };
        let camera = scene.cameras.rows[0];
        let planned = picture(&scene, camera, &scene.lights, needs, way, &small());
        assert_eq!(
            hash(&planned),
            hash_of(&scene, way, &small()),
            "seed {seed}"
        );
    }
}

#[test]
fn threads_and_tiles_do_not_show() {
    for seed in 500..520 {
        let scene = random_scene(seed);
        let way = Way {
            arithmetic: Arithmetic::F32,
            lanes: 16,
            structure: Structure::Bvh,
        };
        let config = RenderConfig {
            width: 150,
            height: 70,
            spp: 3,
            ..small()
        };
        let expected = hash_of(&scene, way, &config);
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            for tiles in [TileOrder::Scanline, TileOrder::Reverse, TileOrder::Small] {
                let config = RenderConfig {
                    tiles,
                    ..config.clone()
                };
                let got = pool.install(|| hash_of(&scene, way, &config));
                assert_eq!(got, expected, "seed {seed}, {threads} threads, {tiles:?}");
            }
        }
    }
}

/// f32 packets see what f64 lanes see; and, bit by bit, what they see with every
/// decision made by exact arithmetic.
#[test]
fn guarded_pictures_are_exact() {
    for seed in 520..600 {
        let scene = random_scene(seed);
        let camera = scene.cameras.rows[0];
        let of = |arithmetic, lanes| {
            let way = Way {
                arithmetic,
                lanes,
                structure: Structure::Bvh,
            };
            picture(&scene, camera, &scene.lights, EVERYTHING, way, &small())
        };
        let exact = of(Arithmetic::F64, 8);
        let guarded = of(Arithmetic::F32Guarded, 16);
        let [a, b] = [&guarded.picture, &exact.picture];
        assert_eq!(a.instance_id, b.instance_id, "seed {seed}");
        assert_eq!(a.primitive_id, b.primitive_id, "seed {seed}");
        for lanes in [1, 16] {
            let doubting = of(Arithmetic::F32DoubtingAll, lanes);
            assert_eq!(hash(&doubting), hash(&guarded), "seed {seed}");
        }
    }
}

/// Rays that run exactly level along a thin box far away: a zero component of
/// the direction must not cost them their hit.
#[test]
fn level_rays_meet_thin_boxes() {
    use glam::DVec3;
    use lanecast::geom::Cuboid;
    use lanecast::scene::{Camera, Edge, SceneBuilder};
    for thickness in [0.002, 1e-6] {
        let mut scene = SceneBuilder::default();
        let slab = Cuboid {
            min: DVec3::new(-2.0, -thickness, -2.0),
            max: DVec3::new(2.0, 0.0, 2.0),
        };
        let slab = scene.cuboid("", slab);
        scene.instance("", Edge::shape(slab));
        let eye = DVec3::new(0.0, 0.0, 10.0);
        scene.camera("", Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 20.0));
        let scene = scene.finish().unwrap();
        let config = RenderConfig {
            width: 33,
            height: 33,
            grid: lanecast::render::Grid::Corners,
            max_depth: 0,
            ..RenderConfig::default()
        };
        for arithmetic in [Arithmetic::F32, Arithmetic::F64] {
            for lanes in [1, 8] {
                let way = Way {
                    arithmetic,
                    lanes,
                    structure: Structure::Bvh,
                };
                let camera = scene.cameras.rows[0];
                let seen = picture(&scene, camera, &[], EVERYTHING, way, &config);
                // The middle row meets the front face's upper edge, |x| ≤ 2 of
                // a picture that is 2·10·tan(10°) wide at the centre.
                assert!(seen.counts.primary_hits >= 33, "{way:?}: {:?}", seen.counts);
            }
        }
    }
}
