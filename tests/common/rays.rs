//! Rays in columns, and the hits of a world along them.

use glam::DVec3;
use lanecast::internals::accel::World;
use lanecast::internals::plan::Kernels;
use lanecast::internals::trace::{
    Depths, HitId, HitIds, Hits, ItemBuffer, MAX_LANES, Origins, Rays, ShadowCache, any, closest,
    closest_listed,
};

/// Rays in columns, with room for the answers.
#[derive(Default)]
pub struct RayColumns {
    org: [Vec<f64>; 3],
    dir: [Vec<f32>; 3],
    len: usize,
}

impl RayColumns {
    pub fn push(&mut self, org: DVec3, dir: [f32; 3]) {
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        self.len += 1;
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn ray(&self, i: usize) -> ([f64; 3], [f32; 3]) {
        (
            std::array::from_fn(|k| self.org[k][i]),
            std::array::from_fn(|k| self.dir[k][i]),
        )
    }

    /// (t, id) of the nearest hit beyond t = 0 of each ray.
    pub fn closest(&self, world: &World, kernels: &Kernels) -> Vec<(f64, HitId)> {
        self.closest_within(world, kernels, &vec![f32::INFINITY; self.len])
    }

    /// The same of rays that end at `t_max`, each at its own.
    pub fn closest_within(
        &self,
        world: &World,
        kernels: &Kernels,
        t_max: &[f32],
    ) -> Vec<(f64, HitId)> {
        self.answers(t_max, |rays, hits| closest(world, kernels, rays, hits))
    }

    /// The same by an item buffer, where there is one for these rays.
    pub fn closest_listed(&self, world: &World, kernels: &Kernels) -> Option<Vec<(f64, HitId)>> {
        Some(self.closest_by(&self.item_buffer(world)?, world, kernels))
    }

    pub fn item_buffer(&self, world: &World) -> Option<ItemBuffer> {
        ItemBuffer::of_rays(world, self.len, |i| Some(self.ray(i)))
    }

    pub fn closest_by(
        &self,
        items: &ItemBuffer,
        world: &World,
        kernels: &Kernels,
    ) -> Vec<(f64, HitId)> {
        self.answers(&vec![f32::INFINITY; self.len], |rays, hits| {
            closest_listed(world, kernels, rays, (items, 0), hits)
        })
    }

    /// The nearest hits with every decision made by exact arithmetic.
    #[cfg(feature = "all-lanes")]
    pub fn closest_doubting(&self, world: &World) -> Vec<(f64, HitId)> {
        self.answers(&vec![f32::INFINITY; self.len], |rays, hits| {
            lanecast::internals::trace::closest_doubting_all(world, rays, hits)
        })
    }

    fn answers(&self, t_max: &[f32], trace: impl FnOnce(&Rays, &mut Hits)) -> Vec<(f64, HitId)> {
        self.padded(t_max.to_vec(), |rays| {
            let (mut t, mut id) = (vec![0.0; rays.len()], HitIds::none(rays.len()));
            let mut hits = Hits {
                t: Depths::Double(&mut t),
                id: id.columns(),
            };
            trace(rays, &mut hits);
            t.into_iter().zip(id.iter()).take(self.len).collect()
        })
    }

    /// Whether anything lies between t = 0 and `t_max` of each ray.
    pub fn any(
        &self,
        world: &World,
        kernels: &Kernels,
        t_max: &[f32],
        cache: &mut ShadowCache,
    ) -> Vec<bool> {
        self.padded(t_max.to_vec(), |rays| {
            let mut blocked = vec![false; rays.len()];
            any(world, kernels, rays, cache, &mut blocked);
            blocked.truncate(self.len);
            blocked
        })
    }

    fn padded<T>(&self, mut t_max: Vec<f32>, trace: impl FnOnce(&Rays) -> T) -> T {
        let padded = self.len.next_multiple_of(MAX_LANES);
        let (mut org, mut dir) = (self.org.clone(), self.dir.clone());
        for k in 0..3 {
            org[k].resize(padded, 0.0);
            dir[k].resize(padded, 1.0);
        }
        t_max.resize(padded, -1.0);
        trace(&Rays {
            org: Origins::Double([&org[0], &org[1], &org[2]]),
            dir: [&dir[0], &dir[1], &dir[2]],
            t_min: &vec![0.0; padded],
            t_max: &t_max,
        })
    }
}
