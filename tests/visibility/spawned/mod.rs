//! Rays that leave a surface do not meet the point that they leave, and skip nothing beyond
//! the stated bound (docs/NUMERICS.md, where rays start).
//!
//! Scenes have one primitive, of every kind and size. Rays hit it, and leave from the hit to
//! both sides, as the integrator has them do. A ray that leaves a convex primitive outward
//! meets nothing; a ray that leaves a flat one does not meet it again. A ray that leaves
//! inward meets the other side; where that is as near as the bound, the reference says
//! whether it is the other side. Then a plate stands in front of the point, at twice the
//! bound, and every ray has to meet it.

mod subjects;

use crate::common::{Random, RayColumns, campaign, kernels};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::HalfSpace;
use lanecast::internals::geom::formula;
use lanecast::internals::geom::guarded::implicit::blur_at;
use lanecast::internals::geom::implicit::gradient_at;
use lanecast::internals::math::Vec3;
use lanecast::internals::math::bounds::UNIT;
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::scene::{Edge, Instances, Scene, shape_bounds};
use lanecast::internals::shade::Surface;
use lanecast::internals::trace::{HitId, ShadowCache};
use std::ops::AddAssign;
use subjects::{KINDS, Kind, Subject, subject};

const MODES: [Precision; 2] = [Precision::Guarded, Precision::Exact];

/// Of each, the power of ten.
const SCALES: [i32; 7] = [-6, -4, -2, 0, 2, 4, 6];

/// Rays at a primitive.
const PRIMARY: usize = 512;

/// Plates in front of what they hit, and rays at each.
const PLATES: usize = 24;
const AT_PLATE: usize = 16;

#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    spawned: usize,
    /// Hits of what was just left.
    own: usize,
    /// Rays that went inward, and found no other side.
    lost: usize,
    /// Asked of the reference.
    asked: usize,
    at_plates: usize,
    skipped: usize,
    /// Starts further off than the bound allows.
    far: usize,
    /// The furthest start, in bounds.
    furthest: f64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.spawned += other.spawned;
        self.own += other.own;
        self.lost += other.lost;
        self.asked += other.asked;
        self.at_plates += other.at_plates;
        self.skipped += other.skipped;
        self.far += other.far;
        self.furthest = self.furthest.max(other.furthest);
    }
}

impl Counts {
    fn settle(&self, what: &str) {
        let bad = [self.own, self.lost, self.skipped, self.far];
        assert_eq!(bad, [0; 4], "{what}: {self:?}");
        assert!(self.spawned > 0 && self.at_plates > 0, "{what}: {self:?}");
    }
}

/// Where a ray hit, and the bound there.
struct Left {
    id: HitId,
    surface: Surface,
    /// 64 roundings of the largest coordinates that made the point, as
    /// docs/NUMERICS.md has it, but for what the point was measured to lie off the
    /// surface: a few roundings, if the ray did not graze it.
    bound: f64,
    grazing: bool,
}

impl Left {
    /// How far off plates stand.
    fn plate(&self) -> f64 {
        match self.grazing {
            true => 2.0 * self.bound.max(self.surface.offset),
            false => 2.0 * self.bound,
        }
    }
}

/// Any way at all, or nearly along the surface; never within 1e-9 of it.
fn leaving(normal: DVec3, side: f64, random: &mut Random) -> Option<[f64; 3]> {
    let any = random.vector();
    let along = any - normal * any.dot(normal);
    let dir = match random.below(3) {
        0 => along + normal * libm::exp10(-8.0 * random.unit().abs()),
        _ => any,
    };
    let dir = if dir.dot(normal) * side < 0.0 {
        -dir
    } else {
        dir
    };
    let dir = dir.to_array();
    let wide = DVec3::from_array(dir);
    let off = wide.dot(normal) * side;
    (off > 1e-9 * wide.length() && wide.length() > 1e-3).then_some(dir)
}

fn wide(dir: [f64; 3]) -> DVec3 {
    DVec3::from_array(dir)
}

/// What rays from outside and inside hit.
fn hits(world: &World, subject: &Subject, precision: Precision, random: &mut Random) -> Vec<Left> {
    let mut rays = RayColumns::default();
    let map = |p: DVec3| DVec3::from_array(subject.world_from_object.point(p.to_array()));
    for _ in 0..PRIMARY {
        let Subject { center, size, .. } = *subject;
        let at = center + random.vector() * size;
        let away = [1.0, 3.0, 30.0][random.below(3) as usize];
        let org = map(center + random.vector() * (size * away));
        rays.push(org, (map(at) - org).to_array());
    }
    let found = rays.closest(world, &kernels(precision));
    let of = |(i, (t, id)): (usize, &(f64, HitId))| {
        if *id == HitId::NONE {
            return None;
        }
        let (org, dir) = rays.ray(i);
        let surface = Surface::at(world, precision, org, dir, *t, *id);
        let bound = bound(world, subject, org, &surface);
        let grazing = surface.ng.dot(wide(dir)).abs() < 0.01 * wide(dir).length();
        Some(Left {
            id: *id,
            surface,
            bound,
            grazing,
        })
    };
    found.iter().enumerate().filter_map(of).collect()
}

fn bound(world: &World, subject: &Subject, org: [f64; 3], surface: &Surface) -> f64 {
    let scene: &Scene = &world.scene;
    let instance = world.instances.get(scene, 0);
    let shape = scene.shapes.row(instance.shape);
    let single = matches!(
        shape,
        lanecast::internals::scene::Shape::Mesh(_) | lanecast::internals::scene::Shape::Polygon(_)
    );
    let u = if single {
        f32::EPSILON.into()
    } else {
        f64::EPSILON
    } * 0.5;
    let own = shape_bounds(scene, instance.shape).map_or(0.0, |b| b.max_abs());
    let object = DVec3::from_array(subject.object_from_world.point(org));
    let mut object = own.max(object.abs().max_element());
    // The magnitudes that a quadric is made of there, by its slope, are as coordinates.
    if let lanecast::internals::scene::Shape::Quadric(id) = shape {
        let point = subject.object_from_world.point(surface.point.to_array());
        let row = scene.quadrics.row(id);
        let (_, slope, size) = row.value_at(DVec3::from_array(point));
        object = object.max(size / slope.length());
    }
    // And what other polynomials may be off by there, in roundings.
    if let lanecast::internals::scene::Shape::Implicit(id) = shape {
        let point = subject.object_from_world.point(surface.point.to_array());
        let (point, row) = (DVec3::from_array(point), scene.implicits.row(id));
        let size = blur_at((row.tape, row.dense), Vec3::<f64>::from(point)) / UNIT;
        object = object.max(size / gradient_at(row.tape, point).length());
    }
    if let lanecast::internals::scene::Shape::LevelSet(id) = shape {
        let point = subject.object_from_world.point(surface.point.to_array());
        let formula = scene.level_sets.row(id).formula;
        let size = formula::blur_at(formula, Vec3::<f64>::from(DVec3::from_array(point))) / UNIT;
        let (_, slope) = formula::value_and_gradient(formula, point);
        object = object.max(size / DVec3::from_array(slope).length());
    }
    let at = DVec3::from_array(org).abs().max(surface.point.abs());
    let stretch = subject.world_from_object.norm();
    64.0 * (u * stretch * object + 0.5 * f64::EPSILON * at.max_element())
}

/// Rays to both sides of every hit.
fn leave_all(
    world: &World,
    reference: &Reference,
    (kind, subject): (Kind, &Subject),
    precision: Precision,
    left: &[Left],
    random: &mut Random,
) -> Counts {
    let mut counts = Counts::default();
    let mut rays = RayColumns::default();
    let mut from = Vec::new();
    for left in left {
        for side in [1.0, -1.0] {
            let Some(dir) = leaving(left.surface.ng, side, random) else {
                continue;
            };
            rays.push(left.surface.leave(wide(dir)), dir);
            from.push((left, side));
        }
        if !left.grazing {
            let bounds = left.surface.offset / left.bound;
            counts.furthest = counts.furthest.max(bounds);
            counts.far += usize::from(bounds > 1.5);
        }
    }
    counts.spawned = rays.len();
    for (i, (t, id)) in rays
        .closest(world, &kernels(precision))
        .into_iter()
        .enumerate()
    {
        let (left, side) = from[i];
        let (org, dir) = rays.ray(i);
        if id == HitId::NONE {
            counts.lost += usize::from(side < 0.0 && kind.is_closed());
            continue;
        }
        if kind.is_convex() && side > 0.0 || kind.is_flat() && id == left.id {
            counts.own += 1;
            continue;
        }
        // How far above or below the point's own tangent plane.
        let surface = &left.surface;
        let height = (DVec3::from_array(org) + wide(dir) * t - surface.point).dot(surface.ng);
        if kind.is_flat() || height.abs() > 2.0 * left.plate() {
            continue;
        }
        counts.asked += 1;
        if let Some(f) = subject.sign_at(world, org) {
            // It may bend up before the ray, and not behind: what was left is not met if
            // the ray started on its side of it.
            counts.own += usize::from(f != side.total_cmp(&0.0));
            continue;
        }
        // What was left lies behind, the other side ahead.
        let crossings = reference.crossings(org, dir.map(f64::from), id.instance, id.primitive);
        let behind = crossings.iter().any(|c| c.t < 0.0);
        let ahead = crossings.iter().any(|c| c.t > 0.0);
        counts.own += usize::from(!behind || !ahead);
    }
    counts
}

/// Plates in front of some of the hits: half-spaces and squares.
fn meet_plates(
    subject: &Subject,
    precision: Precision,
    left: &[Left],
    random: &mut Random,
) -> Counts {
    let mut counts = Counts::default();
    let size = subject.size * subject.world_from_object.norm();
    for _ in 0..PLATES.min(left.len()) {
        let left = &left[random.below(left.len() as u64) as usize];
        let (surface, distance) = (&left.surface, left.plate());
        let side = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let normal = surface.ng * side;
        let place = surface.point + normal * distance;
        let mut builder = subject.builder.clone();
        let plate = if random.below(2) == 0 {
            let offset = normal.dot(place);
            builder.half_space("", HalfSpace { normal, offset })
        } else {
            let (u, v) = normal.any_orthonormal_pair();
            let corner = |(x, y): (f64, f64)| place + (u * x + v * y) * size;
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            builder.polygon("", &corners.map(corner), &[])
        };
        builder.instance("", Edge::shape(plate));
        let scene = builder.finish().expect("a good scene");
        let instances = Instances::of(&scene).expect("two");
        let world = World::build(&scene, &instances, Structure::Bvh);
        let mut rays = RayColumns::default();
        while rays.len() < AT_PLATE {
            // Steep enough to come to the plate before it ends.
            let dir = leaving(surface.ng, side, random);
            let steep = |dir: &[f64; 3]| {
                let cosine = wide(*dir).dot(normal) / wide(*dir).length();
                cosine > (4.0 * distance / size).clamp(1e-3, 0.5)
            };
            if let Some(dir) = dir.filter(steep) {
                rays.push(surface.leave(wide(dir)), dir);
            }
        }
        counts.at_plates += rays.len();
        let kernels = kernels(precision);
        let cache = &mut ShadowCache::new(Default::default());
        let blocked = rays.any(&world, &kernels, &[f32::INFINITY; AT_PLATE], cache);
        for (i, (t, id)) in rays.closest(&world, &kernels).into_iter().enumerate() {
            // By an edge of the primitive its other face may come first.
            let dir = wide(rays.ray(i).1);
            let before = id.instance == 0 && t * dir.dot(normal) < distance;
            let met = id.instance == 1 || before;
            counts.skipped += usize::from(!met || !blocked[i]);
        }
    }
    counts
}

/// Scenes of one kind at one scale in one mode.
fn spawn(kind: Kind, scale: f64, precision: Precision, rays: usize, seed: u64) -> Counts {
    let random = &mut Random(seed);
    let mut counts = Counts::default();
    while counts.spawned < rays {
        let subject = subject(kind, scale, random);
        let scene = subject.builder.clone().finish().expect("a good scene");
        let instances = Instances::of(&scene).expect("one");
        let world = World::build(&scene, &instances, Structure::Bvh);
        let reference = Reference::brute_force(&scene, &instances).expect("one");
        let left = hits(&world, &subject, precision, random);
        counts += leave_all(
            &world,
            &reference,
            (kind, &subject),
            precision,
            &left,
            random,
        );
        counts += meet_plates(&subject, precision, &left, random);
    }
    counts
}

fn spawn_everywhere(rays: usize) -> Vec<(Kind, Precision, Counts)> {
    let mut all = Vec::new();
    for kind in KINDS {
        for precision in MODES {
            let mut sum = Counts::default();
            for (seed, power) in (1..).zip(SCALES) {
                let scale = libm::exp10(f64::from(power));
                let each = rays.div_ceil(SCALES.len());
                sum += spawn(kind, scale, precision, each, seed);
            }
            println!(
                "{kind:?} {precision:?}: {} left, {} met it again, {} lost the other side, {} \
                 asked of the reference; {} at plates, {} skipped; off by {:.3} bounds at most",
                sum.spawned, sum.own, sum.lost, sum.asked, sum.at_plates, sum.skipped, sum.furthest
            );
            all.push((kind, precision, sum));
        }
    }
    all
}

fn settle(all: &[(Kind, Precision, Counts)]) {
    for (kind, precision, counts) in all {
        counts.settle(&format!("{kind:?} {precision:?}"));
    }
}

#[test]
fn rays_leave_what_they_start_from_and_skip_nothing() {
    settle(&spawn_everywhere(campaign(7 * 1000)));
}

/// A million rays of each kind and mode.
#[test]
#[ignore = "a campaign of minutes"]
fn a_million_rays_leave_what_they_start_from_and_skip_nothing() {
    settle(&spawn_everywhere(campaign(1_000_000)));
}
