//! Renders random scenes of all kinds of shapes by every structure, width, precision, number
//! of threads and order of tiles: each scene has one picture.

#![cfg(feature = "all-lanes")]

use crate::common::{ALL_AOVS, Way, campaign, hash, picture, random_scene, structures};
use lanecast::internals::accel::Structure;
use lanecast::internals::plan::Precision;
use lanecast::internals::render::{RenderConfig, TileOrder};
use lanecast::internals::scene::Scene;

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
    hash(&picture(scene, camera, &scene.lights, way, config))
}

/// One picture for each of so many scenes from a seed on, but for the f32 tile kernel: it decides triangles by
/// other arithmetic, at every width alike. Returns the scenes where that shows.
fn one_hash(precision: Precision, first: u64, scenes: usize) -> usize {
    let mut apart = 0;
    for seed in first..first + scenes as u64 {
        let scene = random_scene(seed);
        let base = Way {
            precision,
            lanes: 1,
            structure: Structure::Linear,
        };
        let expected = hash_of(&scene, base, &small());
        for structure in structures() {
            let tiles = precision == Precision::Fast && structure == Structure::Bvh;
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
    let scenes = campaign(80);
    let apart = one_hash(Precision::Fast, 0, scenes);
    println!("{apart} of {scenes} scenes differ between tiles and packets");
    assert!(apart * 80 <= 6 * scenes);
}

#[test]
fn exact_pictures_do_not_depend_on_structure_or_width() {
    assert_eq!(one_hash(Precision::Exact, 200, campaign(80)), 0);
}

#[test]
fn guarded_pictures_do_not_depend_on_structure_or_width() {
    assert_eq!(one_hash(Precision::Guarded, 400, campaign(80)), 0);
}

#[test]
fn threads_and_tiles_do_not_show() {
    for seed in 500..520 {
        let scene = random_scene(seed);
        let way = Way {
            precision: Precision::Fast,
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
            for tiles in [TileOrder::Spread, TileOrder::Reverse, TileOrder::Small] {
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
    for seed in 520..520 + campaign(80) as u64 {
        let scene = random_scene(seed);
        let camera = scene.cameras.rows[0];
        let of = |precision, lanes| {
            let way = Way {
                precision,
                lanes,
                structure: Structure::Bvh,
            };
            picture(&scene, camera, &scene.lights, way, &small())
        };
        let exact = of(Precision::Exact, 8);
        let guarded = of(Precision::Guarded, 16);
        let [a, b] = [&guarded.picture, &exact.picture];
        assert_eq!(a.instance_id, b.instance_id, "seed {seed}");
        assert_eq!(a.primitive_id, b.primitive_id, "seed {seed}");
    }
}

/// Rays that run exactly level along a thin box far away: a zero component of
/// the direction must not cost them their hit.
#[test]
fn level_rays_meet_thin_boxes() {
    use glam::DVec3;
    use lanecast::internals::geom::Cuboid;
    use lanecast::internals::scene::{Camera, Edge, SceneBuilder};
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
            grid: lanecast::internals::render::Grid::Corners,
            max_depth: 0,
            ..RenderConfig::default()
        };
        for precision in [Precision::Fast, Precision::Exact] {
            for lanes in [1, 8] {
                let way = Way {
                    precision,
                    lanes,
                    structure: Structure::Bvh,
                };
                let camera = scene.cameras.rows[0];
                let seen = picture(&scene, camera, &[], way, &config);
                // The middle row meets the front face's upper edge, |x| ≤ 2 of
                // a picture that is 2·10·tan(10°) wide at the centre.
                assert!(seen.counts.primary_hits >= 33, "{way:?}: {:?}", seen.counts);
            }
        }
    }
}
