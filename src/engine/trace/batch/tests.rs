//! Lanes decided by kernels and by exact arithmetic, mixed in one query.
//!
//! Three certainties must give the same bits: one that leaves every second (lane, primitive)
//! pair undecided, one that leaves all undecided, and `guarded`. A primitive that is placed
//! twice, decided once by each, makes ties in t.

use super::*;
use crate::geom::{Cuboid, Sphere};
use crate::math::lanes::Lanes;
use crate::scene::{Edge, Instances, MeshData, Scene, SceneBuilder};
use crate::trace::hits::Depths;
use crate::trace::query::HitId;
use crate::trace::test_random::Random;
use crate::trace::{Caching, HitIds, Vectors};
use glam::{DAffine3, DVec3};

/// Leaves every decision to exact arithmetic.
#[derive(Clone, Copy)]
struct DoubtAll;

impl Certainty for DoubtAll {
    const GUARDED: bool = true;
    const DOUBTS_ALL: bool = true;
}

#[derive(Clone, Copy)]
struct DoubtEverySecond;

impl Certainty for DoubtEverySecond {
    const GUARDED: bool = true;
    const DOUBTS_ALL: bool = false;

    fn doubts(instance: u64, primitive: u32) -> u32 {
        0x5555_5555 << ((instance ^ u64::from(primitive)) & 1)
    }
}

/// Builds a scene that places each shape twice at the same place, and once elsewhere.
fn crowd(random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    for _ in 0..4 {
        let (center, radius) = (DVec3::from(random.vector()), 0.3 + 0.2 * random.unit());
        let positions = (0..9).map(|_| random.vector()).collect();
        let triangles = (0..7).map(|i| [i, i + 1, i + 2]).collect();
        let shapes = [
            scene.sphere("", Sphere { center, radius }),
            scene.cuboid(
                "",
                Cuboid {
                    min: center - DVec3::splat(0.4),
                    max: center + DVec3::new(0.1, 0.3, 0.2),
                },
            ),
            scene.mesh(
                "",
                &MeshData {
                    positions,
                    triangles,
                    ..MeshData::default()
                },
            ),
        ];
        for shape in shapes {
            scene.instance("", Edge::shape(shape));
            scene.instance("", Edge::shape(shape));
            let turned = DAffine3::from_axis_angle(DVec3::Y, random.unit() * 3.0);
            let moved = DAffine3::from_translation(DVec3::from(random.vector()) * 0.5) * turned;
            let place = scene.transform(moved.into());
            scene.instance("", Edge::shape(shape).transform(place));
        }
    }
    scene.finish().unwrap()
}

struct Columns {
    org: [Vec<f64>; 3],
    dir: [Vec<f64>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
}

const RAYS: usize = 256;

impl Columns {
    fn random(random: &mut Random) -> Columns {
        let mut columns = Columns {
            org: [const { Vec::new() }; 3],
            dir: [const { Vec::new() }; 3],
            t_min: vec![0.0; RAYS],
            t_max: Vec::new(),
        };
        for _ in 0..RAYS {
            let org = DVec3::from(random.vector()) * 3.0;
            let dir = DVec3::from(random.vector()) * 0.8 - org;
            for k in 0..3 {
                columns.org[k].push(org[k]);
                columns.dir[k].push(dir[k]);
            }
            let short = (1.0 + 0.5 * random.unit()) as f32;
            let ends = columns.t_max.len().is_multiple_of(3);
            let t_max = if ends { short } else { f32::INFINITY };
            columns.t_max.push(t_max);
        }
        columns
    }

    fn rays(&self) -> Rays<'_> {
        Rays {
            org: Vectors::Double(self.org.each_ref().map(Vec::as_slice)),
            dir: Vectors::Double(self.dir.each_ref().map(Vec::as_slice)),
            t_min: &self.t_min,
            t_max: &self.t_max,
        }
    }
}

/// Traces closest hits and occlusion.
fn answers<L: Lanes, C: Certainty>(
    world: &World,
    columns: &Columns,
) -> Vec<(Option<(u64, HitId)>, bool)> {
    let Accelerator::Baseline(levels) = &world.accelerator else {
        unreachable!("packets go through narrow trees");
    };
    let rays = columns.rays();
    let (mut t, mut id) = (vec![0.0; RAYS], HitIds::none(RAYS));
    let scratch = &mut TraceScratch::default();
    ClosestBatch {
        items: None,
        world,
        rays: &rays,
        hits: &mut Hits {
            t: Depths::Double(&mut t),
            id: id.columns(),
        },
    }
    .packets::<L, C>(levels, Count::default(), scratch);
    let mut blocked = vec![false; RAYS];
    AnyBatch {
        world,
        rays: &rays,
        cache: &mut ShadowCache::new(Caching::On),
        blocked: &mut blocked,
    }
    .packets::<L, C>(levels, Count::default(), scratch);
    let met = |i: usize| (id.get(i) != HitId::NONE).then_some((t[i].to_bits(), id.get(i)));
    (0..RAYS).map(|i| (met(i), blocked[i])).collect()
}

/// Compares the certainties at one width only, since each is compiled anew.
fn compare(world: &World, columns: &Columns, seen: &mut [usize; 2]) {
    type L = f32x8;
    let guarded = answers::<L, Guarded>(world, columns);
    assert!(answers::<L, DoubtAll>(world, columns) == guarded);
    let mixed = answers::<L, DoubtEverySecond>(world, columns);
    for (i, (mixed, guarded)) in mixed.iter().zip(&guarded).enumerate() {
        assert_eq!(mixed, guarded, "ray {i}");
        let (met, blocked) = guarded;
        assert_eq!(*blocked, met.is_some(), "ray {i}: any hit");
        if let Some((_, id)) = met {
            let doubts = DoubtEverySecond::doubts(id.instance, id.primitive);
            seen[(doubts >> (i % L::COUNT) & 1) as usize] += 1;
        }
    }
}

#[test]
fn accepted_and_decided_lanes_mix() {
    let mut seen = [0; 2];
    for seed in 0..96 {
        let random = &mut Random(seed);
        let scene = crowd(random);
        let instances = Instances::of(&scene).unwrap();
        let structure = crate::accel::Structure::Narrow;
        let world = World::build(&scene, &instances, structure);
        let columns = Columns::random(random);
        compare(&world, &columns, &mut seen);
    }
    // Hits of both kinds must be frequent for the comparison to mean anything.
    assert!(
        seen.iter().all(|n| *n > 3000),
        "accepted, decided: {seen:?}"
    );
}
