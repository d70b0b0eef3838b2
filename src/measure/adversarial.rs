//! Rays aimed at points where small errors change answers: edges, corners, silhouettes
//! and tangents.
//!
//! A target is a point of a primitive and two tangent directions there, in object
//! space, mapped to the world. Rays go to targets from the camera, from around the
//! scene and from other targets; backwards along rounded directions, so that f64 holds
//! the target exactly or nearly; along the surface; along the axes; and away from
//! targets on the surface. Some targets are rounded to f32, some are moved by a few
//! units in the last place.
//!
//! Deterministic: the same scene, count and seed give the same rays.

mod implicits;
mod level_sets;
mod targets;

use glam::DVec3;
use lanecast_engine::accel::World;
use lanecast_engine::trace::{
    BEAM, Caching, Depths, HitId, HitIds, Hits, Outcome, RayKind, Rays, ScratchPool, ShadowCache,
    TraceScratch, TracedRay, Vectors, any, closest,
};
use lanecast_model::plan::Kernels;
use lanecast_model::scene::{Camera, Instance, Scene};
use lanecast_picture::render::{Progress, mix, unit};
use rayon::prelude::*;
use targets::in_object;

/// A world ray; hits count where 0 < t < t_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aimed {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_max: f32,
}

/// A point of a surface, and two tangent directions there, of any length.
#[derive(Clone, Copy)]
struct Target {
    point: DVec3,
    along: [DVec3; 2],
}

struct Random(u64);

/// Number of targets that estimate the scene's size and position.
const PROBES: usize = 256;

/// Generates `count` rays or fewer; none for a scene without instances.
pub fn adversarial_rays(
    scene: &Scene,
    rows: &[Instance],
    camera: &Camera,
    count: usize,
    seed: u64,
) -> Vec<Aimed> {
    if rows.is_empty() {
        return Vec::new();
    }
    let random = &mut Random(mix(seed));
    let target = |random: &mut Random| target(scene, random.one_of(rows), random);
    let probes: Vec<DVec3> = (0..PROBES).map(|_| target(random).point).collect();
    let about = About::of(&probes);
    let mut rays = Vec::with_capacity(count);
    for i in 0..count {
        // Camera rays come first: rays of one origin have kernels of their own.
        let from_camera = i < count / 4;
        let ray = (0..8).find_map(|_| {
            let to = target(random).point;
            let to = random.moved(to);
            let other = target(random);
            let (org, dir, t_max) = if from_camera {
                from_eye(camera, to, about.size)
            } else {
                about.ray(to, &other, random)
            };
            let dir = dir.to_array();
            let finite = org.is_finite() && dir.iter().all(|x| x.is_finite());
            (finite && dir != [0.0; 3]).then_some(Aimed {
                org: org.to_array(),
                dir,
                t_max,
            })
        });
        rays.extend(ray);
    }
    rays
}

fn from_eye(camera: &Camera, to: DVec3, size: f64) -> (DVec3, DVec3, f32) {
    if camera.projection.is_parallel() {
        let dir = rounded(camera.forward);
        return (to - dir * (4.0 * size), dir, f32::INFINITY);
    }
    (camera.eye, to - camera.eye, f32::INFINITY)
}

/// Approximate centre and size of a scene.
struct About {
    center: DVec3,
    size: f64,
}

impl About {
    fn of(points: &[DVec3]) -> About {
        let finite = || points.iter().filter(|p| p.is_finite());
        let min = finite().fold(DVec3::INFINITY, |a, b| a.min(*b));
        let max = finite().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
        let (center, size) = ((min + max) * 0.5, (max - min).max_element() * 0.5);
        let sound = center.is_finite() && size > 0.0;
        About {
            center: if sound { center } else { DVec3::ZERO },
            size: if sound { size } else { 1.0 },
        }
    }

    /// Returns origin, direction and t_max.
    fn ray(&self, to: DVec3, other: &Target, random: &mut Random) -> (DVec3, DVec3, f32) {
        match random.below(8) {
            // From around the scene.
            0 | 1 => {
                let far = self.size * (1.0 + 3.0 * random.unit());
                let org = self.center + random.direction() * far;
                let org = if random.below(2) == 0 {
                    rounded(org)
                } else {
                    org
                };
                (org, to - org, random.end(1.0))
            }
            // From another point of the surface, ending at or beyond the target.
            2 => {
                let org = random.moved(other.point);
                (org, to - org, random.end(1.0))
            }
            3 => {
                let dir = rounded(other.point - to);
                (to - dir, dir, random.end(2.0))
            }
            // From a point on a surface.
            4 => {
                let dir = self.direction(other, random);
                (to, dir, random.end(1.0))
            }
            // Backwards along a direction that f32 holds, so that little or nothing is
            // rounded.
            _ => {
                let dir = rounded(self.direction(other, random));
                let times = [0.25, 0.5, 1.0, 2.0, 4.0, 1.0 / 3.0][random.below(6)];
                (to - dir * times, dir, random.end(times))
            }
        }
    }

    /// Returns a random, axis-parallel or tangent direction about as long as the scene.
    fn direction(&self, surface: &Target, random: &mut Random) -> DVec3 {
        let dir = match random.below(4) {
            0 => random.direction(),
            1 => random.axis(),
            _ => {
                let [a, b] = surface.along.map(|v| v.normalize_or_zero());
                match random.below(3) {
                    0 => a,
                    1 => b,
                    _ => a * random.signed() + b * random.signed(),
                }
            }
        };
        dir * self.size
    }
}

/// Returns a target in world space.
fn target(scene: &Scene, row: &Instance, random: &mut Random) -> Target {
    let Target { point, along } = in_object(scene, scene.shapes.row(row.shape), random);
    let map = &row.world_from_object;
    Target {
        point: map.point(point.to_array()).into(),
        along: along.map(|v| map.vector(v.to_array()).into()),
    }
}

/// Rounds each coordinate to the nearest f32.
fn rounded(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(1);
        mix(self.0)
    }

    /// Returns a number below `n`, which must not be 0.
    fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 16) as usize % n
    }

    fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }

    /// Returns a number in [0, 1).
    fn unit(&mut self) -> f64 {
        unit(self.bits())
    }

    /// Returns a number in [−1, 1).
    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Returns a number from 0 to 1; often 0, 1/2 or 1.
    fn part(&mut self) -> f64 {
        match self.below(8) {
            0..3 => 0.0,
            3..5 => 1.0,
            5 => 0.5,
            _ => self.unit(),
        }
    }

    fn axis(&mut self) -> DVec3 {
        let axis = DVec3::AXES[self.below(3)];
        if self.below(2) == 0 { axis } else { -axis }
    }

    /// Returns a unit direction, often an axis.
    fn direction(&mut self) -> DVec3 {
        if self.below(4) == 0 {
            return self.axis();
        }
        let v = DVec3::new(self.signed(), self.signed(), self.signed());
        v.try_normalize().unwrap_or(DVec3::X)
    }

    fn anywhere(&mut self) -> Target {
        Target {
            point: self.direction(),
            along: [self.direction(), self.direction()],
        }
    }

    /// Returns the point as it is, rounded to f32, or moved by units in the last place
    /// of either type.
    fn moved(&mut self, p: DVec3) -> DVec3 {
        let ulps = |random: &mut Random| random.below(5) as i64 - 2;
        match self.below(8) {
            0..3 => p,
            3 | 4 => rounded(p),
            5 => {
                let step = DVec3::from_array(std::array::from_fn(|_| ulps(self) as f64));
                rounded(p) + step * rounded(p).abs() * f64::from(f32::EPSILON)
            }
            _ => DVec3::from_array(p.to_array().map(|x| {
                let bits = x.to_bits().wrapping_add_signed(ulps(self));
                f64::from_bits(bits)
            })),
        }
    }

    /// Returns t_max: infinity, or the target's t, where the target then does not
    /// count.
    fn end(&mut self, at: f64) -> f32 {
        match self.below(3) {
            0 => at as f32,
            _ => f32::INFINITY,
        }
    }
}

/// Rays traced at a time: whole tiles.
const CHUNK: usize = 2048;

/// Traces all rays on the current rayon pool, first for the closest hit, then for any
/// hit. The `pixel` of a row is the ray's number, counted from `first`; normals are
/// NaN. Returns `None` if cancelled.
pub fn trace_aimed(
    world: &World,
    kernels: &Kernels,
    rays: &[Aimed],
    first: u32,
    scratch: &ScratchPool<TraceScratch>,
    progress: &Progress,
) -> Option<Vec<TracedRay>> {
    let answers: Vec<[Vec<Outcome>; 2]> = rays
        .par_chunks(CHUNK)
        .map(|chunk| {
            if progress.is_cancelled() {
                return Default::default();
            }
            scratch.with(|scratch| trace_chunk(world, kernels, chunk, scratch))
        })
        .collect();
    if progress.is_cancelled() {
        return None;
    }
    let kinds = [RayKind::Primary, RayKind::Shadow { light: 0 }];
    let mut rows = Vec::with_capacity(2 * rays.len());
    for (query, kind) in kinds.into_iter().enumerate() {
        let outcomes = answers.iter().flat_map(|both| &both[query]);
        for (number, (ray, outcome)) in rays.iter().zip(outcomes).enumerate() {
            rows.push(TracedRay {
                kind,
                pixel: first + number as u32,
                sample: 0,
                depth: 0,
                org: ray.org,
                dir: ray.dir,
                t_max: ray.t_max,
                outcome: *outcome,
            });
        }
    }
    Some(rows)
}

fn trace_chunk(
    world: &World,
    kernels: &Kernels,
    rays: &[Aimed],
    scratch: &mut TraceScratch,
) -> [Vec<Outcome>; 2] {
    // Padding rays of the last tile hit nothing.
    let idle = Aimed {
        org: [0.0; 3],
        dir: [1.0; 3],
        t_max: -1.0,
    };
    let missing = rays.len().next_multiple_of(BEAM) - rays.len();
    let rows: Vec<&Aimed> = rays
        .iter()
        .chain(std::iter::repeat_n(&idle, missing))
        .collect();
    let org: [Vec<f64>; 3] = std::array::from_fn(|k| rows.iter().map(|r| r.org[k]).collect());
    let dir: [Vec<f64>; 3] = std::array::from_fn(|k| rows.iter().map(|r| r.dir[k]).collect());
    let t_max: Vec<f32> = rows.iter().map(|r| r.t_max).collect();
    let columns = Rays {
        org: Vectors::Double(org.each_ref().map(|x| &x[..])),
        dir: Vectors::Double(dir.each_ref().map(|x| &x[..])),
        t_min: &vec![0.0; rows.len()],
        t_max: &t_max,
    };
    let (mut t, mut ids) = (vec![0.0; rows.len()], HitIds::none(rows.len()));
    let mut hits = Hits {
        t: Depths::Double(&mut t),
        id: ids.columns(),
    };
    closest(world, kernels, &columns, &mut hits, scratch);
    let mut blocked = vec![false; rows.len()];
    let cache = &mut ShadowCache::new(Caching::On);
    any(world, kernels, &columns, cache, &mut blocked, scratch);
    let hit = |i: usize| match ids.get(i) {
        HitId::NONE => Outcome::Miss,
        HitId {
            instance,
            primitive,
        } => Outcome::Hit {
            t: t[i],
            instance,
            primitive,
            normal: [f64::NAN; 3],
        },
    };
    let any_hit = |blocked: &bool| match blocked {
        true => Outcome::Blocked,
        false => Outcome::Clear,
    };
    [
        (0..rays.len()).map(hit).collect(),
        blocked[..rays.len()].iter().map(any_hit).collect(),
    ]
}
