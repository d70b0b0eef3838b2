//! Accepted and settled lanes side by side in one query.
//!
//! A certainty that doubts every second (lane, primitive) pair must give, for
//! each ray, the nearest over all primitives of: the f64 resolver's t where the
//! pair is doubted, the f32 kernel's t, widened, where it is not; equal t's to
//! the lower id. A primitive that appears twice, once doubted and once not, makes
//! t's that agree in f32 alone.

use super::*;
use crate::geom::{Cuboid, Sphere};
use crate::scene::{Appearances, Edge, MeshData, Scene, SceneBuilder, Shape};
use crate::trace::{Caching, HitIds, Origins, resolve_one};
use glam::{DAffine3, DVec3};

#[derive(Clone, Copy)]
struct DoubtEverySecond;

impl Certainty for DoubtEverySecond {
    const GUARDED: bool = true;
    const DOUBTS_ALL: bool = false;

    fn doubts(instance: u64, primitive: u32) -> u32 {
        0x5555_5555 << ((instance ^ u64::from(primitive)) & 1)
    }
}

/// Vigna's SplitMix64, in [−1, 1).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ x >> 31) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }
}

/// Each shape appears twice in the same place, and once turned and moved.
fn crowd(random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    for _ in 0..4 {
        let (center, radius) = (random.vector(), 0.3 + 0.2 * random.unit());
        let positions = (0..9).map(|_| random.vector().to_array()).collect();
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
            let moved = DAffine3::from_translation(random.vector() * 0.5) * turned;
            let place = scene.transform(moved.into());
            scene.instance("", Edge::shape(shape).transform(place));
        }
    }
    scene.finish().unwrap()
}

struct Columns {
    org: [Vec<f64>; 3],
    dir: [Vec<f32>; 3],
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
            let org = random.vector() * 3.0;
            let dir = random.vector() * 0.8 - org;
            for k in 0..3 {
                columns.org[k].push(org[k]);
                columns.dir[k].push(dir[k] as f32);
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
            org: Origins::Double(self.org.each_ref().map(Vec::as_slice)),
            dir: self.dir.each_ref().map(Vec::as_slice),
            t_min: &self.t_min,
            t_max: &self.t_max,
        }
    }
}

/// Where ray `i` meets one primitive, asked about it alone.
fn alone(world: &World, rays: &Rays, i: usize, doubted: bool, id: HitId) -> Option<f64> {
    let (org, dir) = (rays.org.at(i), rays.dir.map(|c| f64::from(c[i])));
    if doubted {
        return resolve_one(world, (org, dir), f64::from(rays.t_min[i]), id);
    }
    let packet = rays.packet::<f32>(i, world);
    let mut query = Closest::<f32, Fast>::new(f32::INFINITY);
    Tester::<f32, Fast, Everything>::new(world, &packet).single(id, &mut query);
    (query.id(0) != HitId::NONE).then(|| query.t(0))
}

fn primitives(world: &World) -> Vec<HitId> {
    let of = |(row, shape): (usize, Shape)| {
        let count = match shape {
            Shape::Mesh(id) => world.scene.meshes.row(id).triangles.len(),
            _ => 1,
        };
        (0..count as u32).map(move |primitive| HitId {
            instance: row as u64,
            primitive,
        })
    };
    let rows = world.appearances.rows.iter();
    let shapes = rows.map(|row| world.scene.shapes.row(row.shape));
    shapes.enumerate().flat_map(of).collect()
}

fn compare<L: Lanes>(world: &World, columns: &Columns, seen: &mut [usize; 2]) {
    let Forests::Narrow(forest) = &world.forest else {
        unreachable!("packets go through narrow trees");
    };
    let rays = columns.rays();
    let (mut t, mut id) = (vec![0.0; RAYS], HitIds::none(RAYS));
    ClosestBatch {
        items: None,
        world,
        rays: &rays,
        hits: &mut Hits {
            t: Depths::Double(&mut t),
            id: id.columns(),
        },
    }
    .packets::<L, DoubtEverySecond, Everything, _, _>(forest, &());
    let mut blocked = vec![false; RAYS];
    AnyBatch {
        world,
        rays: &rays,
        cache: &mut ShadowCache::new(Caching::On),
        blocked: &mut blocked,
    }
    .packets::<L, DoubtEverySecond, Everything, _, _>(forest, &());

    let all = primitives(world);
    for i in 0..RAYS {
        let doubted = |id: HitId| {
            DoubtEverySecond::doubts(id.instance, id.primitive) >> (i % L::COUNT) & 1 != 0
        };
        let nearest = all
            .iter()
            .filter_map(|id| Some((alone(world, &rays, i, doubted(*id), *id)?, *id)))
            .filter(|(t, _)| *t < f64::from(rays.t_max[i]))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let got = (id.get(i) != HitId::NONE).then_some((t[i], id.get(i)));
        assert_eq!(got, nearest, "ray {i} at {} lanes", L::COUNT);
        assert_eq!(blocked[i], nearest.is_some(), "ray {i}: any hit");
        if let Some((_, id)) = nearest {
            seen[usize::from(doubted(id))] += 1;
        }
    }
}

#[test]
fn accepted_and_settled_lanes_mix() {
    let mut seen = [0; 2];
    for seed in 0..24 {
        let random = &mut Random(seed);
        let scene = crowd(random);
        let appearances = Appearances::of(&scene).unwrap();
        let structure = crate::accel::Structure::Narrow;
        let world = World::build(&scene, &appearances, structure);
        let columns = Columns::random(random);
        compare::<f32>(&world, &columns, &mut seen);
        compare::<f32x4>(&world, &columns, &mut seen);
        compare::<f32x8>(&world, &columns, &mut seen);
        compare::<f32x16>(&world, &columns, &mut seen);
    }
    // Both must win often, or the mix proves nothing.
    assert!(
        seen.iter().all(|n| *n > 3000),
        "accepted, settled: {seen:?}"
    );
}
