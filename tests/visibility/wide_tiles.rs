//! Rays that share an origin or a direction but diverge too much for a beam go to a mesh as a
//! stream: in `exact` that changes nothing, and in `fast` no width shows.

use crate::common::{Random, RayColumns};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::measure::generate::displaced_sphere;
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::scene::{Edge, Instances, MeshData, Scene, SceneBuilder};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};

const RAYS: usize = 64 * 40;

/// A mesh of some hundred blocks of triangles, where it is and placed.
fn scene() -> Scene {
    let mesh = displaced_sphere(120, 60);
    let positions = mesh.positions.iter().map(|p| p.map(f64::from));
    let data = MeshData {
        positions: positions.collect(),
        triangles: mesh.triangles,
        ..MeshData::default()
    };
    let mut scene = SceneBuilder::default();
    let shape = scene.mesh("", &data);
    scene.instance("", Edge::shape(shape));
    let map = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.7, 1.1, 0.9),
        DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0),
        DVec3::new(1.5, 0.3, 0.2),
    );
    let placed = scene.transform(map.into());
    scene.instance("", Edge::shape(shape).transform(placed));
    scene.finish().expect("a good scene")
}

/// Tile by tile, each spread wider than the one before it or much less; of one
/// origin, or of one direction.
fn rays(one_origin: bool, random: &mut Random) -> RayColumns {
    let (eye, target) = (DVec3::new(0.5, 0.8, 4.0), DVec3::new(0.7, 0.0, 0.0));
    let forward = target - eye;
    let mut rays = RayColumns::default();
    for tile in 0..RAYS / 64 {
        let spread = [1.5, 0.3, 0.05, 0.005][tile % 4];
        let middle = random.vector();
        for _ in 0..64 {
            let aside = middle + random.vector() * spread;
            if one_origin {
                let dir = forward + aside;
                rays.push(eye, dir.to_array().map(|x| x as f32));
            } else {
                rays.push(eye + aside, forward.to_array().map(|x| x as f32));
            }
        }
    }
    rays
}

fn widths() -> Vec<usize> {
    if cfg!(feature = "all-lanes") {
        vec![1, 4, 8, 16]
    } else {
        vec![1, native_width()]
    }
}

fn kernels(precision: Precision, lanes: usize) -> Kernels {
    Kernels { precision, lanes }
}

fn met(answers: Vec<(f64, HitId)>) -> Vec<Option<(u64, HitId)>> {
    let hit = |(t, id): (f64, HitId)| (id != HitId::NONE).then_some((t.to_bits(), id));
    answers.into_iter().map(hit).collect()
}

#[test]
fn wide_tiles_meet_what_packets_meet() {
    let scene = scene();
    let instances = Instances::of(&scene).unwrap();
    let [tiles, packets] =
        [Structure::Bvh, Structure::Narrow].map(|s| World::build(&scene, &instances, s));
    let random = &mut Random(7);
    for one_origin in [true, false] {
        let rays = rays(one_origin, random);
        let exact = kernels(Precision::Exact, 1);
        let nearest = rays.closest(&packets, &exact);
        let ends: Vec<f32> = nearest
            .iter()
            .map(|(t, id)| {
                let t = if *id == HitId::NONE { 10.0 } else { *t as f32 };
                [0.9 * t, t, t.next_up(), 2.0 * t][random.below(4) as usize]
            })
            .collect();
        let off = || ShadowCache::new(Caching::Off);
        let blocked = rays.any(&packets, &exact, &ends, &mut off());
        let nearest = met(nearest);
        assert!(nearest.iter().flatten().count() > RAYS / 3);
        assert!(blocked.iter().filter(|b| **b).count() > RAYS / 6);
        for lanes in widths() {
            let kernels = kernels(Precision::Exact, lanes);
            assert_eq!(met(rays.closest(&tiles, &kernels)), nearest, "{lanes}");
            let found = rays.any(&tiles, &kernels, &ends, &mut off());
            assert_eq!(found, blocked, "{lanes}");
        }
        let guarded = kernels(Precision::Guarded, 1);
        let guarded = met(rays.closest(&packets, &guarded));
        for lanes in widths() {
            let kernels = kernels(Precision::Guarded, lanes);
            assert_eq!(met(rays.closest(&tiles, &kernels)), guarded, "{lanes}");
            let found = rays.any(&tiles, &kernels, &ends, &mut off());
            assert_eq!(found, blocked, "{lanes}");
        }
        let one = kernels(Precision::Fast, 1);
        let alone = met(rays.closest(&tiles, &one));
        let alone_blocked = rays.any(&tiles, &one, &ends, &mut off());
        for lanes in widths() {
            let kernels = kernels(Precision::Fast, lanes);
            assert_eq!(met(rays.closest(&tiles, &kernels)), alone, "{lanes}");
            let found = rays.any(&tiles, &kernels, &ends, &mut off());
            assert_eq!(found, alone_blocked, "{lanes}");
        }
        // Other arithmetic, hardly another answer.
        let ids = |met: &[Option<(u64, HitId)>]| -> Vec<_> {
            met.iter().map(|hit| hit.map(|(_, id)| id)).collect()
        };
        let pairs = ids(&alone).into_iter().zip(ids(&nearest));
        assert!(pairs.filter(|(a, b)| a != b).count() <= 2);
    }
}
