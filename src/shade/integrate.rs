//! Whitted's integrator (1980), breadth first: a wave of rays is traced as one
//! batch, lit by one batch of shadow rays per light, and leaves behind the next
//! wave of mirrored and refracted rays, to a bounded depth.
//!
//! Columns live in the thread's arena and go with it. The order of additions to
//! a pixel is that of its own rays, so no tile split or packet width shows.

use super::light::Arrival;
use super::material::{leaves_rays, onward, reflected};
use super::surface::Surface;
use crate::accel::World;
use crate::math::unit;
use crate::plan::Kernels;
use crate::scene::{Light, Material, Rgb};
use crate::trace::{HitId, Hits, MAX_LANES, Outcome, RayKind, Rays, TracedRay, any, closest};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use serde::Serialize;

/// Rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    pub primary: u64,
    pub primary_hits: u64,
    pub shadow: u64,
    pub shadow_occluded: u64,
    pub reflection: u64,
    pub refraction: u64,
}

impl RayCounts {
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.reflection + self.refraction
    }

    pub fn add(&mut self, other: &RayCounts) {
        self.primary += other.primary;
        self.primary_hits += other.primary_hits;
        self.shadow += other.shadow;
        self.shadow_occluded += other.shadow_occluded;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
    }
}

/// Rays of one depth, columns of equal length.
pub struct Wave<'b> {
    org: [ArenaVec<'b, f64>; 3],
    dir: [ArenaVec<'b, f32>; 3],
    t_min: ArenaVec<'b, f32>,
    t_max: ArenaVec<'b, f32>,
    /// Row of the tile's film.
    pub pixel: ArenaVec<'b, u32>,
    /// What the ray's radiance counts for in its pixel.
    weight: ArenaVec<'b, Rgb>,
    kind: ArenaVec<'b, RayKind>,
}

impl<'b> Wave<'b> {
    pub fn with_capacity(rays: usize, arena: &'b Bump) -> Wave<'b> {
        let rays = rays.next_multiple_of(MAX_LANES);
        let f64s = || ArenaVec::with_capacity_in(rays, arena);
        let f32s = || ArenaVec::with_capacity_in(rays, arena);
        Wave {
            org: [f64s(), f64s(), f64s()],
            dir: [f32s(), f32s(), f32s()],
            t_min: f32s(),
            t_max: f32s(),
            pixel: ArenaVec::with_capacity_in(rays, arena),
            weight: ArenaVec::with_capacity_in(rays, arena),
            kind: ArenaVec::with_capacity_in(rays, arena),
        }
    }

    /// World space.
    pub fn push(
        &mut self,
        org: DVec3,
        dir: [f32; 3],
        t_max: f32,
        pixel: u32,
        weight: Rgb,
        kind: RayKind,
    ) {
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        self.t_min.push(0.0);
        self.t_max.push(t_max);
        self.pixel.push(pixel);
        self.weight.push(weight);
        self.kind.push(kind);
    }

    pub fn len(&self) -> usize {
        self.pixel.len()
    }

    pub fn is_empty(&self) -> bool {
        self.pixel.is_empty()
    }

    /// Fills the ray columns up to whole packets with rays that meet nothing.
    fn pad(&mut self) {
        let padded = self.len().next_multiple_of(MAX_LANES);
        let at = self.len().saturating_sub(1);
        for k in 0..3 {
            let (org, dir) = (self.org[k].get(at).copied(), self.dir[k].get(at).copied());
            self.org[k].resize(padded, org.unwrap_or(0.0));
            self.dir[k].resize(padded, dir.unwrap_or(1.0));
        }
        self.t_min.resize(padded, 0.0);
        self.t_max.resize(padded, -1.0);
    }

    fn rays(&self) -> Rays<'_> {
        Rays {
            org: [&self.org[0], &self.org[1], &self.org[2]],
            dir: [&self.dir[0], &self.dir[1], &self.dir[2]],
            t_min: &self.t_min,
            t_max: &self.t_max,
        }
    }

    pub fn org(&self, i: usize) -> [f64; 3] {
        [self.org[0][i], self.org[1][i], self.org[2][i]]
    }

    pub fn dir(&self, i: usize) -> [f32; 3] {
        [self.dir[0][i], self.dir[1][i], self.dir[2][i]]
    }
}

/// What the integrator notes beside radiance: counts always, rays if wanted.
pub struct Ledger<'a> {
    pub counts: RayCounts,
    /// Every ray with its answer, for `verify`.
    pub record: Option<&'a mut Vec<TracedRay>>,
    /// For the record: sample number, and the picture's pixel of a film row.
    pub sample: u32,
    pub pixel_of: &'a dyn Fn(u32) -> u32,
}

/// One hit of a primary ray, for AOVs: the film row, the surface, t and the id.
pub type PrimaryHit<'a> = &'a mut dyn FnMut(u32, &Surface, f64, HitId);

pub struct Integrator<'w> {
    pub world: &'w World<'w>,
    pub kernels: Kernels,
    pub lights: &'w [Light],
    pub background: Rgb,
    pub max_depth: u32,
}

impl Integrator<'_> {
    /// Adds the wave's radiance to `film`, a row per pixel, with everything that
    /// its rays spawn. `occluders` has a row per light, kept for the tile.
    pub fn run<'b>(
        &self,
        mut wave: Wave<'b>,
        film: &mut [Rgb],
        occluders: &mut [HitId],
        ledger: &mut Ledger,
        primary: PrimaryHit,
        arena: &'b Bump,
    ) {
        for depth in 0..=self.max_depth {
            if wave.is_empty() {
                return;
            }
            wave.pad();
            let padded = wave.t_max.len();
            let mut t = ArenaVec::from_iter_in(std::iter::repeat_n(0.0, padded), arena);
            let mut id = ArenaVec::from_iter_in(std::iter::repeat_n(HitId::NONE, padded), arena);
            let mut hits = Hits {
                t: &mut t,
                id: &mut id,
            };
            closest(self.world, &self.kernels, &wave.rays(), &mut hits);
            count(&wave, &id, depth, ledger);

            let mut lit = ArenaVec::with_capacity_in(wave.len(), arena);
            for i in 0..wave.len() {
                if id[i] == HitId::NONE {
                    self.note(&wave, i, depth, Outcome::Miss, ledger);
                    add(film, &wave, i, self.background);
                    continue;
                }
                let surface = Surface::at(
                    self.world,
                    self.kernels.arithmetic,
                    wave.org(i),
                    wave.dir(i),
                    t[i],
                    id[i],
                );
                let outcome = Outcome::Hit {
                    t: t[i],
                    instance: id[i].instance,
                    primitive: id[i].primitive,
                    normal: surface.ng.to_array(),
                };
                self.note(&wave, i, depth, outcome, ledger);
                if depth == 0 {
                    primary(wave.pixel[i], &surface, t[i], id[i]);
                }
                let material = self.material(&surface);
                add(film, &wave, i, material.emission);
                let dir = DVec3::from_array(wave.dir(i).map(f64::from));
                lit.push(Lit {
                    row: i as u32,
                    surface,
                    incoming: unit(dir),
                    material,
                });
            }
            for (number, light) in self.lights.iter().enumerate() {
                let shadows = self.shadows(&wave, &lit, number as u32, light, arena);
                let occluder = &mut occluders[number];
                self.light(&wave, &lit, shadows, depth, occluder, film, ledger, arena);
            }
            let spawning = depth < self.max_depth;
            let next = if spawning { lit.len() } else { 0 };
            let mut onwards = Wave::with_capacity(next, arena);
            if spawning {
                for lit in lit.iter().filter(|lit| leaves_rays(&lit.material)) {
                    spawn(&wave, lit, &mut onwards);
                }
            }
            wave = onwards;
        }
    }

    fn material(&self, surface: &Surface) -> Material {
        match surface.material {
            Some(id) => self.world.scene.materials.rows[id.index()],
            None => Material::default(),
        }
    }

    /// Shadow rays of all hits that the light could reach.
    fn shadows<'b>(
        &self,
        wave: &Wave,
        lit: &[Lit],
        number: u32,
        light: &Light,
        arena: &'b Bump,
    ) -> Shadows<'b> {
        let mut shadows = Shadows {
            rays: Wave::with_capacity(lit.len(), arena),
            of: ArenaVec::with_capacity_in(lit.len(), arena),
        };
        for (
            row,
            Lit {
                row: i, surface, ..
            },
        ) in lit.iter().enumerate()
        {
            let Some(arrival) = Arrival::at(light, surface.point) else {
                continue;
            };
            // On the lit side of both the true and the shading surface.
            let towards = arrival.towards;
            if towards.dot(surface.ns) <= 0.0 || towards.dot(surface.facing()) <= 0.0 {
                continue;
            }
            let org = surface.leave(towards);
            // Towards the light from where the ray really starts.
            let Some(arrival) = Arrival::at(light, org) else {
                continue;
            };
            let dir = arrival.dir.to_array().map(|x| x as f32);
            let kind = RayKind::Shadow { light: number };
            let pixel = wave.pixel[*i as usize];
            shadows
                .rays
                .push(org, dir, arrival.t_max, pixel, arrival.irradiance, kind);
            shadows.of.push((row as u32, arrival.towards));
        }
        shadows
    }

    /// Traces the shadow rays and adds what arrives.
    #[expect(clippy::too_many_arguments)]
    fn light<'b>(
        &self,
        wave: &Wave,
        lit: &[Lit],
        mut shadows: Shadows<'b>,
        depth: u32,
        occluder: &mut HitId,
        film: &mut [Rgb],
        ledger: &mut Ledger,
        arena: &'b Bump,
    ) {
        let count = shadows.rays.len();
        shadows.rays.pad();
        let padded = shadows.rays.t_max.len();
        let mut blocked = ArenaVec::from_iter_in(std::iter::repeat_n(false, padded), arena);
        let rays = shadows.rays.rays();
        any(self.world, &self.kernels, &rays, occluder, &mut blocked);
        for s in 0..count {
            ledger.counts.shadow += 1;
            let outcome = if blocked[s] {
                ledger.counts.shadow_occluded += 1;
                Outcome::Blocked
            } else {
                Outcome::Clear
            };
            self.note(&shadows.rays, s, depth, outcome, ledger);
            if blocked[s] {
                continue;
            }
            let (row, towards) = shadows.of[s];
            let lit = &lit[row as usize];
            let light = shadows.rays.weight[s];
            let (ns, out) = (lit.surface.ns, -lit.incoming);
            let radiance = reflected(&lit.material, ns, out, towards, light);
            add(film, wave, lit.row as usize, radiance);
        }
    }

    #[inline(always)]
    fn note(&self, wave: &Wave, i: usize, depth: u32, outcome: Outcome, ledger: &mut Ledger) {
        let Some(record) = &mut ledger.record else {
            return;
        };
        record.push(TracedRay {
            kind: wave.kind[i],
            pixel: (ledger.pixel_of)(wave.pixel[i]),
            sample: ledger.sample,
            depth,
            org: wave.org(i),
            dir: wave.dir(i),
            t_max: wave.t_max[i],
            outcome,
        });
    }
}

/// A hit, ready to be lit.
#[derive(Clone, Copy, Debug)]
struct Lit {
    /// Of the wave.
    row: u32,
    surface: Surface,
    /// The ray's direction, unit.
    incoming: DVec3,
    material: Material,
}

struct Shadows<'b> {
    /// Their weight is the light's irradiance.
    rays: Wave<'b>,
    /// Row of the lit hits, and the direction to the light.
    of: ArenaVec<'b, (u32, DVec3)>,
}

fn count(wave: &Wave, id: &[HitId], depth: u32, ledger: &mut Ledger) {
    if depth == 0 {
        ledger.counts.primary += wave.len() as u64;
        let hits = id[..wave.len()].iter().filter(|id| **id != HitId::NONE);
        ledger.counts.primary_hits += hits.count() as u64;
        return;
    }
    let mirrored = wave.kind.iter().filter(|k| **k == RayKind::Reflection);
    let mirrored = mirrored.count() as u64;
    ledger.counts.reflection += mirrored;
    ledger.counts.refraction += wave.len() as u64 - mirrored;
}

#[inline(always)]
fn add(film: &mut [Rgb], wave: &Wave, i: usize, radiance: Rgb) {
    let (pixel, weight) = (&mut film[wave.pixel[i] as usize], wave.weight[i]);
    for k in 0..3 {
        pixel[k] += weight[k] * radiance[k];
    }
}

/// Rays that count for less in their pixel are not traced (Hall and Greenberg
/// 1983, adaptive depth control): glass in glass would double them at each hit.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

fn spawn(wave: &Wave, lit: &Lit, next: &mut Wave) {
    let (i, surface) = (lit.row as usize, &lit.surface);
    let out = onward(&lit.material, surface.ns, lit.incoming, surface.front);
    let facing = surface.facing();
    let mut push = |dir: DVec3, weight: Rgb, kind| {
        // A bent shading normal may send a ray to the wrong side: bring it back
        // to the surface's own plane.
        let side = match kind {
            RayKind::Reflection => facing,
            _ => -facing,
        };
        let across = dir.dot(side);
        let dir = if across < 0.0 {
            dir - side * (1.001 * across)
        } else {
            dir
        };
        let weight = std::array::from_fn(|k| wave.weight[i][k] * weight[k]);
        if weight.iter().any(|w| *w >= LEAST_WEIGHT) {
            let dir32 = dir.to_array().map(|x| x as f32);
            let org = surface.leave(side);
            next.push(org, dir32, f32::INFINITY, wave.pixel[i], weight, kind);
        }
    };
    if let Some((dir, weight)) = out.mirror {
        push(dir, weight, RayKind::Reflection);
    }
    if let Some((dir, weight)) = out.refract {
        push(dir, weight, RayKind::Refraction);
    }
}
