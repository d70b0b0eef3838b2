//! Rays and hits of the stable interface, in columns that grow and need no padding by hand.

use crate::trace::{HitId, HitIds, MAX_LANES, Rays, Vectors};
use glam::DVec3;
use std::ops::Range;

/// Rays in world space, in columns.
#[derive(Clone, Debug, Default)]
pub struct RayBatch {
    org: [Vec<f64>; 3],
    dir: [Vec<f64>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
    len: usize,
}

impl RayBatch {
    /// Adds a ray that ends nowhere. Its direction may have any length but 0; t counts in
    /// lengths of it.
    pub fn push(&mut self, org: DVec3, dir: DVec3) {
        self.push_within(org, dir, 0.0..f32::INFINITY);
    }

    /// Adds a ray whose hits lie strictly within an interval of t, of which the part below 0
    /// does not count. If a bound is NaN the ray hits nothing.
    pub fn push_within(&mut self, org: DVec3, dir: DVec3, t: Range<f32>) {
        self.truncate(self.len);
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        let (t_min, t_max) = bounded(t);
        self.t_min.push(t_min);
        self.t_max.push(t_max);
        self.len += 1;
        self.pad();
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub fn clear(&mut self) {
        self.len = 0;
        self.truncate(0);
    }

    /// Returns origin and direction of a ray.
    pub fn ray(&self, row: usize) -> (DVec3, DVec3) {
        let org = [0, 1, 2].map(|k| self.org[k][row]);
        let dir = [0, 1, 2].map(|k| self.dir[k][row]);
        (DVec3::from_array(org), DVec3::from_array(dir))
    }

    /// Returns the length of the columns with their padding.
    pub(super) fn padded(&self) -> usize {
        self.t_max.len()
    }

    /// Borrows rows that begin and end at multiples of [`MAX_LANES`].
    pub(super) fn rows(&self, rows: Range<usize>) -> Rays<'_> {
        let Range { start, end } = rows;
        Rays {
            org: Vectors::Double([0, 1, 2].map(|k| &self.org[k][start..end])),
            dir: Vectors::Double([0, 1, 2].map(|k| &self.dir[k][start..end])),
            t_min: &self.t_min[start..end],
            t_max: &self.t_max[start..end],
        }
    }

    fn truncate(&mut self, rows: usize) {
        self.org.iter_mut().for_each(|column| column.truncate(rows));
        self.dir.iter_mut().for_each(|column| column.truncate(rows));
        self.t_min.truncate(rows);
        self.t_max.truncate(rows);
    }

    /// Fills the columns up with rays that meet nothing.
    fn pad(&mut self) {
        let rows = self.len.next_multiple_of(MAX_LANES);
        self.org
            .iter_mut()
            .for_each(|column| column.resize(rows, 0.0));
        self.dir
            .iter_mut()
            .for_each(|column| column.resize(rows, 1.0));
        self.t_min.resize(rows, 0.0);
        self.t_max.resize(rows, -1.0);
    }
}

/// Returns the bounds of t as rays of the engine have them; those of a ray that meets nothing if
/// one is NaN.
fn bounded(t: Range<f32>) -> (f32, f32) {
    match t.start.is_nan() || t.end.is_nan() {
        true => (0.0, -1.0),
        false => (t.start.max(0.0), t.end),
    }
}

impl Extend<(DVec3, DVec3)> for RayBatch {
    fn extend<I: IntoIterator<Item = (DVec3, DVec3)>>(&mut self, rays: I) {
        for (org, dir) in rays {
            self.push(org, dir);
        }
    }
}

/// Where a ray first meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In lengths of the ray's direction.
    pub t: f64,
    /// The number of the instance: which path through the scene's graph.
    pub instance: u64,
    /// The triangle's number in its mesh, the surface's in a CSG solid; else 0.
    pub primitive: u32,
    /// Barycentric coordinates of a triangle's second and third corner; else 0.
    pub uv: [f64; 2],
}

/// Closest hits in columns, a row per ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// In lengths of the rays' directions; infinite where there is no hit.
    pub t: Vec<f64>,
    /// `u64::MAX` where there is no hit.
    pub instance: Vec<u64>,
    pub primitive: Vec<u32>,
    pub uv: Vec<[f64; 2]>,
}

impl Hits {
    pub(super) fn new(
        len: usize,
        mut t: Vec<f64>,
        ids: HitIds,
        uv: impl Fn(usize, HitId) -> [f64; 2] + Sync,
    ) -> Hits {
        let HitIds {
            mut instance,
            mut primitive,
        } = ids;
        t.truncate(len);
        instance.truncate(len);
        primitive.truncate(len);
        let mut all = vec![[0.0; 2]; len];
        for row in 0..len {
            let id = HitId {
                instance: instance[row],
                primitive: primitive[row],
            };
            if id == HitId::NONE {
                t[row] = f64::INFINITY;
            } else {
                all[row] = uv(row, id);
            }
        }
        Hits {
            t,
            instance,
            primitive,
            uv: all,
        }
    }

    pub fn len(&self) -> usize {
        self.t.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Returns the hit of a ray, if there is one.
    pub fn get(&self, row: usize) -> Option<Hit> {
        let instance = self.instance[row];
        (instance != HitId::NONE.instance).then(|| Hit {
            t: self.t[row],
            instance,
            primitive: self.primitive[row],
            uv: self.uv[row],
        })
    }
}
