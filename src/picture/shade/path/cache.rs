//! An irradiance cache (Ward, Rubinstein and Clear 1988): indirect light changes slowly along
//! surfaces, so it is gathered at few records and interpolated between them.
//!
//! A record holds what the Lambertian lobe of a surface gets of light that has been reflected
//! before; light that comes straight from what shines is found by the path itself, as without a
//! cache. Where no record is near, the path goes on as if there were no cache.
//!
//! With [`UseMode::Control`] the cache is a control variate of what scattered paths meet: some go
//! on nevertheless, and find by how much it is off, so that the mean is right whatever is in it
//! (Dereviannykh et al. 2024, "Neural Two-Level Monte Carlo", section 4, with another cache).

mod record;

pub use record::{IrradianceRecord, SECTORS, sector_direction};

use super::PathTracer;
use super::layers::{EMISSION, Film, LayerPlan, Trail};
use super::materials::Look;
use super::spot::Spot;
use super::state::Paths;
use crate::light::bsdf::Sampled;
use crate::light::sampling::cosine_hemisphere_density;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};
use crate::scene::Rgb;
use crate::shade::columns::{Doubles, STEP, Singles, gather};
use crate::shade::hit_buffer::HitBuffer;
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// The share of paths that go on where the cache is a control variate.
const ONWARD: f32 = 0.5;

/// Where mirrors are between, records whose paths are longer than those that the picture asks for
/// serve only if these may still be scattered so often: what follows is next to nothing.
const LEFT_DEPTH: u32 = 8;

/// Most records of a leaf of the tree.
const LEAF: usize = 4;

/// Records and a tree of boxes around what they serve.
#[derive(Clone, Debug, Default)]
pub struct Irradiance {
    pub records: Vec<IrradianceRecord>,
    /// Numbers of records, leaf by leaf.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

/// A box, and the node after its subtree, where a point outside of it goes on.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    next: u32,
    /// Range of `order`; empty for inner nodes.
    first: u32,
    count: u32,
}

impl Irradiance {
    /// Builds the tree: halves by number along the longest side.
    pub fn new(records: Vec<IrradianceRecord>) -> Irradiance {
        let mut made = Irradiance {
            order: (0..records.len() as u32).collect(),
            nodes: Vec::new(),
            records,
        };
        let mut order = std::mem::take(&mut made.order);
        let count = order.len();
        made.build(&mut order, 0..count);
        made.order = order;
        made
    }

    fn build(&mut self, order: &mut [u32], range: std::ops::Range<usize>) {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for number in &order[range.clone()] {
            let record = &self.records[*number as usize];
            let extent = record.half_extent();
            min = min.min(record.point - extent);
            max = max.max(record.point + extent);
        }
        let place = self.nodes.len();
        let is_leaf = range.len() <= LEAF;
        self.nodes.push(Node {
            min,
            max,
            next: 0,
            first: range.start as u32,
            count: if is_leaf { range.len() as u32 } else { 0 },
        });
        if !is_leaf {
            let size = max - min;
            let axis = (0..3).fold(0, |a, b| if size[b] > size[a] { b } else { a });
            let key = |number: &u32| self.records[*number as usize].point[axis];
            // Ties go by number, so that the tree is a function of the records.
            order[range.clone()].sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
            let middle = range.start + range.len() / 2;
            self.build(order, range.start..middle);
            self.build(order, middle..range.end);
        }
        self.nodes[place].next = self.nodes.len() as u32;
    }

    /// Visits the records that serve a point, with their weights, in an order that is a function
    /// of the records.
    pub fn visit(&self, point: DVec3, normal: DVec3, mut found: impl FnMut(u32, f64)) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let inside = point.cmpge(node.min).all() && point.cmple(node.max).all();
            if !inside {
                at = node.next as usize;
                continue;
            }
            at += 1;
            let (first, count) = (node.first as usize, node.count as usize);
            for number in &self.order[first..first + count] {
                let weight = self.records[*number as usize].weight(point, normal);
                if weight > 0.0 {
                    found(*number, weight);
                }
            }
        }
    }

    /// Interpolates between the records that serve a point; `None` if there is none.
    pub fn at(&self, point: DVec3, normal: DVec3) -> Option<Rgb> {
        let (mut sum, mut weights) = ([0.0_f64; 3], 0.0);
        self.visit(point, normal, |number, weight| {
            let light = self.records[number as usize].at(point, normal);
            weights += weight;
            for k in 0..3 {
                sum[k] += weight * light[k];
            }
        });
        (weights > 0.0).then(|| sum.map(|sum| (sum / weights).max(0.0) as f32))
    }

    /// Says whether a point needs no further record.
    pub fn serves(&self, point: DVec3, normal: DVec3) -> bool {
        let mut most = 0.0;
        self.visit(point, normal, |_, weight| most = f64::max(most, weight));
        most >= PathTracer::SERVED
    }

    /// Returns the bytes of records and tree.
    pub fn bytes(&self) -> usize {
        self.records.len() * size_of::<IrradianceRecord>()
            + self.order.len() * size_of::<u32>()
            + self.nodes.len() * size_of::<Node>()
    }
}

/// How paths use a cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UseMode {
    /// They look where it has no records.
    Probe,
    /// They take its light for right where they come from the camera or from mirrors.
    Final,
    /// They take its light, and some look how right it is.
    Control,
}

/// A cache and its use.
#[derive(Clone, Copy, Debug)]
pub struct CacheUse<'w> {
    pub records: &'w Irradiance,
    pub mode: UseMode,
    /// Probing paths are scattered this often.
    pub probe_depth: u32,
}

/// A point without a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missed {
    /// Row of the film.
    pub pixel: u32,
    pub point: DVec3,
    pub normal: DVec3,
    /// The geometric normal on the side that is seen.
    pub facing: DVec3,
    /// Where rays start that gather light.
    pub start: DVec3,
}

/// What a wave has found in a cache, and not found.
pub(super) struct CacheColumns<'b> {
    /// Rows of the film, the ways to the surfaces, and their light.
    found: ArenaVec<'b, (u32, Trail, Rgb)>,
    pub missed: ArenaVec<'b, Missed>,
    /// t of the first hits of a batch, infinite for rays that meet nothing, if they are asked for.
    pub reach: Option<ArenaVec<'b, f64>>,
}

impl<'b> CacheColumns<'b> {
    pub fn new(arena: &'b Bump) -> CacheColumns<'b> {
        CacheColumns {
            found: ArenaVec::new_in(arena),
            missed: ArenaVec::new_in(arena),
            reach: None,
        }
    }

    pub fn clear_found(&mut self) {
        self.found.clear();
    }

    /// Adds what was found to the film: light that a surface gets from others and scatters
    /// diffusely. Nobody knows its groups.
    pub fn add_to(&self, film: &mut Film, plan: Option<&LayerPlan>) {
        for (pixel, trail, light) in &self.found {
            let slot = &mut film.slots[*pixel as usize];
            for k in 0..3 {
                slot[k] += light[k];
            }
            if let (Some(layers), Some(plan)) = (&mut film.layers, plan) {
                let trail = &trail.after([1.0; 3]).after([1.0; 3]);
                layers.add(plan, *pixel, (trail, EMISSION, plan.unknown()), *light);
            }
        }
    }
}

/// What a cache has given to a step of paths.
pub(super) struct Taken {
    /// The albedo of the lobe that it was given for; 0 where nothing was given.
    albedo: [Singles; 3],
    /// The factor of what the lobe finds by itself.
    left: Singles,
}

impl Taken {
    /// Returns the factor of paths that go on: what they find by the lobe that the cache has
    /// served is left out, or counts more for those that were left out.
    pub fn onward(&self, sampled: &Sampled<Singles>) -> Vec3<Singles> {
        let (zero, one) = (Singles::zero(), Singles::splat(1.0));
        let density = cosine_hemisphere_density(sampled.into.z);
        let [x, y, z] = std::array::from_fn(|k| {
            let whole = sampled.pdf * sampled.weight[k];
            let part = self.albedo[k] * density / whole;
            let part = Lanes::select(whole.gt(zero), part.min(one), one);
            let factor = one - part + part * self.left;
            Lanes::select(
                !sampled.delta & self.albedo[k].gt(zero),
                factor.max(zero),
                one,
            )
        });
        Vec3::new(x, y, z)
    }
}

impl PathTracer<'_> {
    /// The least weight of a record at points that need no other.
    pub const SERVED: f64 = 0.25;

    /// Takes the indirect light of a step's Lambertian lobes from a cache, where its use says so.
    pub(super) fn take_cached(
        &self,
        cache: &CacheUse,
        (wave, buffer): (&Paths, &HitBuffer),
        (look, spot, depth): (&Look, &Spot, u32),
        cached: &mut CacheColumns,
        survives: impl Fn() -> Singles,
    ) -> Taken {
        let mut taken = Taken {
            albedo: [Singles::zero(); 3],
            left: Singles::zero(),
        };
        let albedo = look.bsdf.lambert(&spot.looks, spot.eta, spot.out_local);
        let some = albedo[0].max(albedo[1]).max(albedo[2]).gt(Singles::zero());
        // Records are of paths that go on from what is seen directly.
        let is_far_enough = depth == 0 || self.max_depth - depth >= LEFT_DEPTH;
        let comes = |i: usize| {
            let ray = spot.rays[i] as usize;
            let is_seen = wave.pdf[ray] == f32::INFINITY;
            let fits = match cache.mode {
                UseMode::Final => is_seen && is_far_enough,
                // What is seen keeps its own light, whose noise the cache would not lessen.
                UseMode::Control => !is_seen,
                UseMode::Probe => true,
            };
            fits && wave.media(ray as u32) == self.media
        };
        let lanes = (0..STEP).filter(|i| (some.bits() & spot.lanes) >> i & 1 != 0 && comes(*i));
        let lanes = lanes.fold(0_u32, |lanes, i| lanes | 1 << i);
        if lanes == 0 {
            return taken;
        }
        let offset: Doubles = gather(&buffer.offset, &spot.hits);
        let start = spot.leave(spot.lanes, spot.curved, offset);
        let mut left = [1.0_f32; STEP];
        let survival = match cache.mode {
            UseMode::Control => survives().to_array(),
            UseMode::Probe | UseMode::Final => [1.0; STEP],
        };
        let mut served = 0_u32;
        let weight: [[f32; STEP]; 3] = [0, 1, 2].map(|k| {
            let throughput = [spot.throughput.x, spot.throughput.y, spot.throughput.z][k];
            (throughput * albedo[k]).to_array()
        });
        for i in (0..STEP).filter(|i| lanes >> i & 1 != 0) {
            let at = |v: &Vec3<Doubles>| {
                DVec3::new(v.x.to_array()[i], v.y.to_array()[i], v.z.to_array()[i])
            };
            let (point, normal) = (at(&spot.point), at(&spot.ns));
            let pixel = wave.rays.pixel[spot.rays[i] as usize];
            if cache.mode == UseMode::Probe {
                if !cache.records.serves(point, normal) {
                    cached.missed.push(Missed {
                        pixel,
                        point,
                        normal,
                        facing: at(&spot.facing),
                        start: at(&start),
                    });
                }
                continue;
            }
            let Some(light) = cache.records.at(point, normal) else {
                continue;
            };
            served |= 1 << i;
            left[i] = match survival[i] < ONWARD {
                true => 1.0 / ONWARD,
                false => 0.0,
            };
            let part = 1.0 - left[i];
            let found = std::array::from_fn(|k| weight[k][i] * light[k] * part);
            let trail = wave.trail_on(spot.rays[i]);
            cached.found.push((pixel, trail, found));
        }
        let served = <Singles as Lanes>::Mask::from_bits(served);
        taken.albedo = albedo.map(|a| Lanes::select(served, a, Singles::zero()));
        taken.left = Singles::load(&left);
        taken
    }
}

#[cfg(test)]
mod tests;
