//! Nested trees have the hits of flat ones, bit for bit, however deep; and scenes with too
//! many instances for a flat tree.

use crate::common::{
    ALL_AOVS, Random, RayColumns, Way, campaign, hard_rays, hard_scene, hash, in_repository,
    kernels, load, picture, property, random_scene, random_shape, within_seconds,
};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Accelerator, Structure, World};
use lanecast::internals::geom::{HalfSpace, Sphere};
use lanecast::internals::math::Affine;
use lanecast::internals::plan::{Precision, native_width};
use lanecast::internals::render::RenderConfig;
use lanecast::internals::scene::*;
use lanecast::internals::trace::HitId;
use proptest::prelude::*;

const ALL: [Precision; 3] = [Precision::Fast, Precision::Guarded, Precision::Exact];

/// (t, id) of each ray that hits anything. Those of `fast` at the end of f32 are left out:
/// flat slabs are open there, and keep what f64 boxes do not (docs/numerics/boxes.md, X9).
fn hits(rays: &RayColumns, world: &World, precision: Precision) -> Vec<Option<(u64, HitId)>> {
    let found = rays.closest(world, &kernels(precision));
    let end = match precision {
        Precision::Fast => f64::from(f32::MAX),
        _ => f64::INFINITY,
    };
    let hit = |(t, id): (f64, HitId)| (id != HitId::NONE && t < end).then_some((t.to_bits(), id));
    found.into_iter().map(hit).collect()
}

/// How many rays hit something; all agree. Flat: by streams, and by packets.
fn agree(scene: &Scene, rays: &RayColumns, why: &str) -> usize {
    let instances = Instances::of(scene).unwrap();
    let nested = World::build(scene, &instances, Structure::Nested);
    assert!(matches!(nested.accelerator, Accelerator::Nested(_)));
    let mut number = 0;
    for structure in [Structure::Bvh, Structure::Linear] {
        let flat = World::build(scene, &instances, structure);
        assert_eq!(flat.bounds, nested.bounds, "{why}");
        for precision in ALL {
            let [a, b] = [&flat, &nested].map(|world| hits(rays, world, precision));
            for (i, (a, b)) in a.iter().zip(&b).enumerate() {
                let ray = rays.ray(i);
                assert_eq!(a, b, "{why}, {structure:?}, {precision:?}, ray {i} {ray:?}");
            }
            number = a.iter().flatten().count();
        }
    }
    number
}

/// Rays at and about points of random instances, of different origins.
fn rays_at(scene: &Scene, random: &mut Random, count: usize) -> RayColumns {
    let instances = Instances::of(scene).unwrap();
    let mut rays = RayColumns::default();
    while rays.len() < count {
        let row = instances.get(scene, random.below(instances.count()));
        let bounds = shape_bounds(scene, row.shape);
        let (center, half) = bounds.map_or((DVec3::ZERO, DVec3::ONE), |b| (b.center(), b.extent()));
        let own = center + random.vector() * half * 0.6;
        let to_world = |p: DVec3| DVec3::from_array(row.world_from_object.point(p.to_array()));
        let at = to_world(own);
        let size = row.world_from_object.norm() * half.max_element();
        let away = size * [0.5, 3.0, 30.0, 1e4][random.below(4) as usize];
        let dir = (random.vector() * away).as_vec3();
        if dir != glam::Vec3::ZERO && dir.is_finite() {
            rays.push(at - dir.as_dvec3(), dir.to_array());
        }
    }
    rays
}

/// Placements as awkward as `kind` asks for.
fn random_map(random: &mut Random, kind: u64) -> DAffine3 {
    let turn = DQuat::from_axis_angle(random.vector().normalize_or(DVec3::X), random.unit() * 3.0);
    let shift = random.vector() * 2.0;
    match kind {
        0 => DAffine3::IDENTITY,
        1 => DAffine3::from_translation(shift),
        2 => DAffine3::from_scale_rotation_translation(DVec3::splat(0.6), turn, shift),
        3 => {
            let scale = DVec3::new(random.size(), random.size(), -random.size()) * 2.0;
            DAffine3::from_scale_rotation_translation(scale, turn, shift)
        }
        4 => {
            let axis = |r: &mut Random| libm::pow(10.0, r.unit() * 4.0);
            let scale = DVec3::new(axis(random), axis(random), axis(random));
            DAffine3::from_scale_rotation_translation(scale, turn, shift)
        }
        5 => DAffine3::from_translation(DVec3::new(3e4, -2e5, 1e4)),
        6 => DAffine3::from_scale(DVec3::splat(libm::pow(10.0, random.unit() * 4.0))),
        7 => {
            let far = libm::exp10(4.0 + 5.0 * (1.0 + random.unit()));
            DAffine3::from_translation(random.vector() * far)
        }
        8 => {
            let far = libm::exp10(70.0 + 60.0 * random.unit());
            DAffine3::from_translation(random.vector() * far)
        }
        _ => {
            let map = DAffine3::from_scale(DVec3::new(1e5, 1.0, 1e-4));
            DAffine3::from_quat(turn) * map * DAffine3::from_translation(shift)
        }
    }
}

/// Levels of nodes over random shapes; `kinds` of placements.
fn random_graph(seed: u64, levels: usize, kinds: u64) -> Scene {
    let random = &mut Random(seed);
    let mut b = SceneBuilder::default();
    let mut shapes: Vec<ShapeId> = (0..4).map(|_| random_shape(&mut b, random)).collect();
    if random.below(4) == 0 {
        let half_space = HalfSpace {
            normal: random.vector(),
            offset: -3.0,
        };
        shapes.push(b.half_space("", half_space));
    }
    let mut nodes: Vec<NodeId> = Vec::new();
    for _ in 0..levels {
        let edges: Vec<Edge> = (0..1 + random.below(4))
            .map(|_| {
                let edge = match random.below(3) {
                    1.. if !nodes.is_empty() => {
                        // Mostly of the level below.
                        let back = random.below(nodes.len().min(3) as u64) as usize;
                        Edge::node(nodes[nodes.len() - 1 - back])
                    }
                    _ => Edge::shape(shapes[random.below(shapes.len() as u64) as usize]),
                };
                let kind = random.below(kinds);
                let map = random_map(random, kind);
                edge.transform(b.transform(map.into()))
            })
            .collect();
        nodes.push(b.node("", &edges));
    }
    let top = *nodes.last().expect("a level");
    b.instance("", Edge::node(top));
    let map = random_map(random, 2);
    let turned = b.transform(map.into());
    b.instance("", Edge::node(top).transform(turned));
    b.finish().unwrap_or_else(|e| panic!("{e}"))
}

proptest! {
    #![proptest_config(property(96))]

    #[test]
    fn depth_changes_no_bit(seed in any::<u64>(), levels in 1_usize..7, kinds in 1_u64..11) {
        let scene = random_graph(seed, levels, kinds);
        let rays = rays_at(&scene, &mut Random(!seed), 300);
        agree(&scene, &rays, &format!("seed {seed}, {levels} levels, {kinds} kinds"));
    }
}

/// A node whose space lies beyond what f32 holds, between others that do not.
#[test]
fn spaces_beyond_f32() {
    for exponent in [-60, -40, -20, 20, 40, 60] {
        let random = &mut Random(5);
        let mut b = SceneBuilder::default();
        let scale = |e: i32| DAffine3::from_scale(DVec3::splat(libm::exp10(f64::from(e))));
        let edges: Vec<Edge> = (0..30)
            .map(|_| {
                let shape = random_shape(&mut b, random);
                let map = scale(-exponent) * random_map(random, 3);
                Edge::shape(shape).transform(b.transform(map.into()))
            })
            .collect();
        let node = b.node("", &edges);
        let back = b.transform(scale(exponent).into());
        b.instance("", Edge::node(node).transform(back));
        let scene = b.finish().unwrap();
        let rays = rays_at(&scene, random, 300);
        let met = agree(&scene, &rays, &format!("10^{exponent}"));
        assert!(met > 100, "{met}");
    }
}

/// Shifts below a node that cancel: spaces of nodes and of what is below are rounded apart.
#[test]
fn shifts_that_cancel() {
    for far in [1e9, 1e12, 1e14] {
        let random = &mut Random(6);
        let mut b = SceneBuilder::default();
        let (center, radius) = (DVec3::ZERO, 0.1);
        let ball = b.sphere("", Sphere { center, radius });
        let away = at(&mut b, -far, 0.0, 0.0);
        let mut below = Edge::node(b.node("", &[Edge::shape(ball).transform(away)]));
        for x in [0.25 * far, 0.75 * far + 0.1] {
            let back = at(&mut b, x, 0.0, 0.0);
            below = Edge::node(b.node("", &[below.transform(back)]));
        }
        let here = at(&mut b, 0.3, 0.0, 0.0);
        b.instance("", below.transform(here));
        let scene = b.finish().unwrap();
        let mut rays = RayColumns::default();
        for _ in 0..4_000 {
            let org = DVec3::new(0.4, 0.0, 2.0) + 0.2 * random.vector();
            rays.push(org, [0.0, 0.0, -1.0]);
        }
        let met = agree(&scene, &rays, &format!("{far}"));
        assert!(met > 400, "{met}");
    }
}

#[test]
fn hard_scenes_agree() {
    let (mut met, scenes) = (0, campaign(60));
    for seed in 0..scenes as u64 {
        let scene = hard_scene(seed);
        let instances = Instances::of(&scene).unwrap();
        let rays = hard_rays(&scene, &instances, seed, 400);
        met += agree(&scene, &rays, &format!("seed {seed}"));
    }
    assert!(met * 3 > 100 * scenes, "{met}");
}

/// Whole pictures, shading and shadows included.
#[test]
fn pictures_agree() {
    let config = RenderConfig {
        width: 80,
        height: 60,
        aovs: ALL_AOVS,
        max_depth: 3,
        ..RenderConfig::default()
    };
    let file = in_repository("scenes/instances.toml");
    let temple = load(&file, 4.0 / 3.0).scene;
    for scene in (0..20).map(random_scene).chain([temple]) {
        let [flat, nested] = [Structure::Linear, Structure::Nested].map(|structure| {
            let way = Way {
                precision: Precision::Exact,
                lanes: native_width(),
                structure,
            };
            let camera = scene.cameras.rows[0];
            hash(&picture(&scene, camera, &scene.lights, way, &config))
        });
        assert_eq!(flat, nested);
    }
}

/// More instances than are laid out, few enough for a flat world: what a plan
/// makes of `bvh`, and of `linear`.
#[test]
fn many_agree() {
    let mut b = SceneBuilder::default();
    let random = &mut Random(7);
    let shapes: Vec<ShapeId> = (0..3).map(|_| random_shape(&mut b, random)).collect();
    let mut below: Vec<Edge> = shapes.iter().map(|s| Edge::shape(*s)).collect();
    for _ in 0..5 {
        let edges: Vec<Edge> = (0..9)
            .map(|k| {
                let map = random_map(random, 2);
                below[k % below.len()].transform(b.transform(map.into()))
            })
            .collect();
        below = vec![Edge::node(b.node("", &edges))];
    }
    let edge = below[0];
    b.instance("", edge);
    let turned = b.transform(random_map(random, 3).into());
    b.instance("", edge.transform(turned));
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    assert!(!instances.are_laid_out() && instances.count() > 1 << 16);
    let rays = rays_at(&scene, random, 2000);
    let nested = World::build(&scene, &instances, Structure::Bvh);
    assert!(matches!(nested.accelerator, Accelerator::Nested(_)));
    let flat = World::build(&scene, &instances, Structure::Narrow);
    assert_eq!(flat.bounds, nested.bounds);
    for precision in ALL {
        let [a, b] = [&flat, &nested].map(|world| hits(&rays, world, precision));
        assert!(a.iter().flatten().count() > 200);
        assert_eq!(a, b);
    }
}

fn at(b: &mut SceneBuilder, x: f64, y: f64, z: f64) -> TransformId {
    b.transform(Affine::from(DAffine3::from_translation(DVec3::new(
        x, y, z,
    ))))
}

/// Balls of radius 1/4 at 0, 1, … 2^40 − 1 along x.
#[test]
fn forty_levels() {
    let mut b = SceneBuilder::default();
    let center = DVec3::ZERO;
    let ball = b.sphere(
        "",
        Sphere {
            center,
            radius: 0.25,
        },
    );
    let mut below = Edge::shape(ball);
    for level in 0..40 {
        let step = at(&mut b, (1_u64 << level) as f64, 0.0, 0.0);
        below = Edge::node(b.node("", &[below, below.transform(step)]));
    }
    b.instance("", below);
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    assert_eq!(instances.count(), 1 << 40);
    let world = within_seconds(10, || World::build(&scene, &instances, Structure::Bvh));
    let bytes: usize = world.bytes().iter().map(|(_, bytes)| bytes).sum();
    assert!(bytes < 1 << 17, "{bytes}");
    let random = &mut Random(3);
    let mut numbers = vec![0, 1, (1 << 40) - 1, 1 << 39, (1 << 39) - 1];
    numbers.extend((0..123).map(|_| random.below(1 << 40)));
    let mut rays = RayColumns::default();
    for number in &numbers {
        rays.push(DVec3::new(*number as f64, 5.0, 0.0), [0.0, -1.0, 0.0]);
    }
    for (number, (t, id)) in numbers
        .iter()
        .zip(rays.closest(&world, &kernels(Precision::Exact)))
    {
        assert_eq!((t, id.instance), (4.75, *number));
        // Its box has room for the rounding of the largest coordinate, 10^12.
        let entry = world.entry_of(id.instance);
        assert!((-0.26..=-0.25).contains(&entry.bounds.min[1]));
    }
    // Between two balls.
    let mut rays = RayColumns::default();
    rays.push(DVec3::new(77_777_777.5, 5.0, 0.0), [0.0, -1.0, 0.0]);
    rays.push(DVec3::new(1e11 + 0.5, 5.0, 0.0), [0.0, -1.0, 0.0]);
    for (_, id) in rays.closest(&world, &kernels(Precision::Exact)) {
        assert_eq!(id, HitId::NONE);
    }
}

/// The axes of the digits of [`block`], from the last digit on.
const AXES: [usize; 10] = [1, 0, 2, 1, 0, 2, 1, 0, 2, 1];

/// A ball of radius 1/4 at every whole point of a block of 1000 × 10000 × 1000: ten nodes of
/// ten children. The digits of an id are the coordinates'. Where its last digit is 5 a ball
/// is moved to y = `far`, if that is given.
fn block(far: Option<f64>) -> (Scene, Instances) {
    let mut b = SceneBuilder::default();
    let center = DVec3::ZERO;
    let ball = b.sphere(
        "",
        Sphere {
            center,
            radius: 0.25,
        },
    );
    let mut below = Edge::shape(ball);
    let mut unit = [1.0; 3];
    for (level, axis) in AXES.into_iter().enumerate() {
        let edges: Vec<Edge> = (0..10)
            .map(|digit| {
                let mut shift = DVec3::ZERO;
                shift[axis] = match far {
                    Some(far) if (level, digit) == (0, 5) => far,
                    _ => f64::from(digit) * unit[axis],
                };
                below.transform(at(&mut b, shift.x, shift.y, shift.z))
            })
            .collect();
        unit[axis] *= 10.0;
        below = Edge::node(b.node("", &edges));
    }
    b.instance("", below);
    let scene = within_seconds(10, || b.finish()).unwrap();
    let instances = within_seconds(10, || Instances::of(&scene)).unwrap();
    assert_eq!(instances.count(), 10_000_000_000);
    (scene, instances)
}

/// Rays along −x at the balls of these ids, 1/4 away.
fn rays_at_balls(ids: &[u64], far: Option<f64>) -> RayColumns {
    let mut rays = RayColumns::default();
    for id in ids {
        let mut at = DVec3::ZERO;
        let (mut rest, mut unit) = (*id, [1.0; 3]);
        for (level, axis) in AXES.into_iter().enumerate() {
            at[axis] += match far {
                Some(far) if (level, rest % 10) == (0, 5) => far,
                _ => (rest % 10) as f64 * unit[axis],
            };
            unit[axis] *= 10.0;
            rest /= 10;
        }
        rays.push(at + DVec3::X * 0.5, [-1.0, 0.0, 0.0]);
    }
    rays
}

#[test]
fn ten_billion() {
    let (scene, instances) = block(None);
    let world = within_seconds(10, || World::build(&scene, &instances, Structure::Bvh));
    let bytes: usize = world.bytes().iter().map(|(_, bytes)| bytes).sum();
    assert!(bytes < 1 << 20, "{bytes}");

    let random = &mut Random(11);
    let ids: Vec<u64> = [0, 9_999_999_999, 1_234_567_890]
        .into_iter()
        .chain((0..200).map(|_| random.below(10_000_000_000)))
        .collect();
    let rays = rays_at_balls(&ids, None);
    for precision in ALL {
        let found = rays.closest(&world, &kernels(precision));
        for (id, (t, found)) in ids.iter().zip(found) {
            assert_eq!((t, found.instance), (0.25, *id), "{precision:?}");
        }
    }
    // Along a diagonal of the outermost faces nothing is in the way.
    let mut rays = RayColumns::default();
    rays.push(DVec3::new(-5.0, -5.0, 0.5), [1.0, 1.0, 0.0]);
    let (_, id) = rays.closest(&world, &kernels(Precision::Exact))[0];
    assert_eq!(id, HitId::NONE);
}

/// Every tenth of ten billion balls lies far away, and costs the others nothing.
#[test]
fn far_children_cost_the_others_nothing() {
    for far in [1e5, 1e8, 1e12, 1e30, 1e100] {
        let (scene, instances) = block(Some(far));
        let world = within_seconds(10, || World::build(&scene, &instances, Structure::Bvh));
        let random = &mut Random(12);
        let mut near = || loop {
            let id = random.below(10_000_000_000);
            if id % 10 != 5 {
                return id;
            }
        };
        let mut ids: Vec<u64> = (0..200).map(|_| near()).collect();
        // Far off the coordinates of the others are whole numbers as long as f64 has them.
        if far == 1e8 {
            ids.extend((0..8).map(|_| near() / 10 * 10 + 5));
        }
        let rays = rays_at_balls(&ids, Some(far));
        for precision in ALL {
            let found = within_seconds(10, || rays.closest(&world, &kernels(precision)));
            for (id, (t, found)) in ids.iter().zip(found) {
                assert_eq!((t, found.instance), (0.25, *id), "{far}, {precision:?}");
            }
        }
        // Rays that end nowhere: between the balls, above them, and on their way there.
        let mut rays = RayColumns::default();
        for _ in 0..200 {
            let dir = random.vector().as_vec3().to_array();
            rays.push(DVec3::new(500.0, 5e3, 1.5e3) + 10.0 * random.vector(), dir);
        }
        rays.push(DVec3::new(-5.0, -5.0, 0.5), [1.0, 1.0, 0.0]);
        let found = within_seconds(10, || rays.closest(&world, &kernels(Precision::Guarded)));
        assert_eq!(found[200].1, HitId::NONE);
    }
}

/// Twins at every level: the first of 2²⁴ balls at one place is what a ray meets.
#[test]
fn twins_cost_nothing() {
    let mut b = SceneBuilder::default();
    let (center, radius) = (DVec3::ZERO, 1.0);
    let ball = b.sphere("", Sphere { center, radius });
    let mut below = Edge::shape(ball);
    for _ in 0..24 {
        let [one, other] = [0, 1].map(|_| at(&mut b, 0.5, 0.0, 0.0));
        let row = [below.transform(one), below.transform(other)];
        below = Edge::node(b.node("", &row));
    }
    b.instance("", below);
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    assert_eq!(instances.count(), 1 << 24);
    let world = World::build(&scene, &instances, Structure::Bvh);
    let mut rays = RayColumns::default();
    for i in 0..64 {
        rays.push(DVec3::new(12.0, 0.0, 9.0), [0.005 * i as f32, 0.001, -1.0]);
    }
    for precision in ALL {
        let found = within_seconds(10, || rays.closest(&world, &kernels(precision)));
        let met = found.iter().filter(|(_, id)| id.instance == 0).count();
        let missed = found.iter().filter(|(_, id)| *id == HitId::NONE).count();
        assert!(met > 15 && met + missed == 64, "{met}, {missed}");
    }
}

/// Balls at 0, 3, … up to 2⁶⁰ along x, which f32 slabs cannot tell apart from near.
#[test]
fn sixty_levels() {
    let mut b = SceneBuilder::default();
    let (center, radius) = (DVec3::ZERO, 1.0);
    let ball = b.sphere("", Sphere { center, radius });
    let mut below = Edge::shape(ball);
    for level in 0..60 {
        let step = at(&mut b, 3.0 * (1_u64 << level) as f64, 0.0, 0.0);
        below = Edge::node(b.node("", &[below, below.transform(step)]));
    }
    b.instance("", below);
    let scene = b.finish().unwrap();
    let instances = Instances::of(&scene).unwrap();
    let world = World::build(&scene, &instances, Structure::Bvh);
    let mut rays = RayColumns::default();
    for i in 0..64 {
        rays.push(DVec3::new(0.0, 0.0, 9.0), [0.01 * i as f32, 0.001, -1.0]);
    }
    for precision in ALL {
        let found = within_seconds(10, || rays.closest(&world, &kernels(precision)));
        let met = found.iter().filter(|(_, id)| *id != HitId::NONE).count();
        assert!((20..64).contains(&met), "{met}");
        assert!(
            found
                .iter()
                .all(|(_, id)| *id == HitId::NONE || id.instance < 3)
        );
    }
}
