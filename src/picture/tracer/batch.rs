//! Rays and hits of the stable interface, in columns that need no padding by hand.

use crate::trace::{HitId, HitIds, MAX_LANES, Rays, TURNED, Vectors};
use glam::DVec3;
use std::ops::Range;
use thiserror::Error;

/// Rays in world space, in columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayBatch {
    org: [Vec<f64>; 3],
    dir: [Vec<f64>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
}

/// A column that has not a row for each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the column {column} has {rows} rows and org[0] has {rays}; give every column a row per ray"
)]
pub struct ColumnError {
    pub column: &'static str,
    pub rows: usize,
    pub rays: usize,
}

impl RayBatch {
    /// Makes an empty batch with room for `rays` rays.
    pub fn with_capacity(rays: usize) -> RayBatch {
        let column = || [0; 3].map(|_| Vec::with_capacity(rays));
        RayBatch {
            org: column(),
            dir: column(),
            t_min: Vec::with_capacity(rays),
            t_max: Vec::with_capacity(rays),
        }
    }

    /// Takes the x, y and z of origins and of directions, a row per ray, and the bounds of t as
    /// [`push_within`](Self::push_within) has them: lower and upper ones, or `None` for rays that
    /// end nowhere. Returns an error if a column is shorter or longer than the first.
    pub fn from_columns(
        org: [Vec<f64>; 3],
        dir: [Vec<f64>; 3],
        t: Option<[Vec<f32>; 2]>,
    ) -> Result<RayBatch, ColumnError> {
        let rays = org[0].len();
        let [mut t_min, mut t_max] =
            t.unwrap_or_else(|| [vec![0.0; rays], vec![f32::INFINITY; rays]]);
        let lengths = [
            ("org[1]", org[1].len()),
            ("org[2]", org[2].len()),
            ("dir[0]", dir[0].len()),
            ("dir[1]", dir[1].len()),
            ("dir[2]", dir[2].len()),
            ("t[0]", t_min.len()),
            ("t[1]", t_max.len()),
        ];
        if let Some((column, rows)) = lengths.into_iter().find(|(_, rows)| *rows != rays) {
            return Err(ColumnError { column, rows, rays });
        }
        for (start, end) in t_min.iter_mut().zip(&mut t_max) {
            (*start, *end) = bounded(*start..*end);
        }
        Ok(RayBatch {
            org,
            dir,
            t_min,
            t_max,
        })
    }

    /// Adds a ray that ends nowhere. Its direction may have any length but 0; t counts in
    /// lengths of it, so that of a short direction it may leave f32's range ([`Hit::t`]).
    pub fn push(&mut self, org: DVec3, dir: DVec3) {
        self.push_within(org, dir, 0.0..f32::INFINITY);
    }

    /// Adds a ray whose hits lie strictly within an interval of t, of which the part below 0
    /// does not count. If a bound is NaN the ray hits nothing.
    pub fn push_within(&mut self, org: DVec3, dir: DVec3, t: Range<f32>) {
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        let (t_min, t_max) = bounded(t);
        self.t_min.push(t_min);
        self.t_max.push(t_max);
    }

    /// Makes room for more rays.
    pub fn reserve(&mut self, rays: usize) {
        let vectors = self.org.iter_mut().chain(&mut self.dir);
        vectors.for_each(|column| column.reserve(rays));
        self.t_min.reserve(rays);
        self.t_max.reserve(rays);
    }

    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }

    pub fn clear(&mut self) {
        let vectors = self.org.iter_mut().chain(&mut self.dir);
        vectors.for_each(Vec::clear);
        self.t_min.clear();
        self.t_max.clear();
    }

    /// Returns origin and direction of a ray.
    pub fn ray(&self, row: usize) -> (DVec3, DVec3) {
        let org = [0, 1, 2].map(|k| self.org[k][row]);
        let dir = [0, 1, 2].map(|k| self.dir[k][row]);
        (DVec3::from_array(org), DVec3::from_array(dir))
    }

    /// Returns the number of rays with those that pad them.
    pub(super) fn padded(&self) -> usize {
        self.len().next_multiple_of(MAX_LANES)
    }

    /// Borrows the rays of `rows`, which begin and end at multiples of [`MAX_LANES`]. If they go
    /// beyond the last ray they are copied to `end`, and padded there.
    pub(super) fn rows<'r>(&'r self, rows: Range<usize>, end: &'r mut RayBatch) -> Rays<'r> {
        if rows.end <= self.len() {
            return self.borrowed(rows);
        }
        let left = rows.start..self.len();
        *end = RayBatch {
            org: [0, 1, 2].map(|k| filled(&self.org[k][left.clone()], 0.0, rows.len())),
            dir: [0, 1, 2].map(|k| filled(&self.dir[k][left.clone()], 1.0, rows.len())),
            t_min: filled(&self.t_min[left.clone()], NOTHING.0, rows.len()),
            t_max: filled(&self.t_max[left.clone()], NOTHING.1, rows.len()),
        };
        end.borrowed(0..rows.len())
    }

    fn borrowed(&self, rows: Range<usize>) -> Rays<'_> {
        let Range { start, end } = rows;
        Rays {
            org: Vectors::Double([0, 1, 2].map(|k| &self.org[k][start..end])),
            dir: Vectors::Double([0, 1, 2].map(|k| &self.dir[k][start..end])),
            t_min: &self.t_min[start..end],
            t_max: &self.t_max[start..end],
        }
    }
}

/// The bounds of t of a ray that meets nothing.
const NOTHING: (f32, f32) = (0.0, -1.0);

/// Copies a column, and fills it up to a length.
fn filled<T: Copy>(column: &[T], filler: T, len: usize) -> Vec<T> {
    let mut all = Vec::with_capacity(len);
    all.extend_from_slice(column);
    all.resize(len, filler);
    all
}

/// Returns the bounds of t as rays of the engine have them; those of a ray that meets nothing if
/// one is NaN.
fn bounded(t: Range<f32>) -> (f32, f32) {
    match t.start.is_nan() || t.end.is_nan() {
        true => NOTHING,
        false => (t.start.max(0.0), t.end),
    }
}

impl Extend<(DVec3, DVec3)> for RayBatch {
    fn extend<I: IntoIterator<Item = (DVec3, DVec3)>>(&mut self, rays: I) {
        let rays = rays.into_iter();
        self.reserve(rays.size_hint().0);
        for (org, dir) in rays {
            self.push(org, dir);
        }
    }
}

/// Where a ray first meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In lengths of the ray's direction. In the precision `Exact` it is the f64 nearest to the
    /// exact value; in the others the value of an f32, and what lies beyond f32's range has its
    /// largest finite number, about 3.4e38 (docs/SPEC.md, S58).
    pub t: f64,
    /// The number of the instance: which path through the scene's graph.
    pub instance: u64,
    /// The triangle's number in its mesh, the surface's in a CSG solid; else 0.
    pub primitive: u32,
    /// Whether the surface of a CSG solid's operand faces into it here, as where it is subtracted.
    pub turned: bool,
    /// Barycentric coordinates of a triangle's second and third corner; else 0.
    pub uv: [f64; 2],
}

/// Closest hits in columns, a row per ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// As [`Hit::t`]; infinite where there is no hit.
    pub t: Vec<f64>,
    /// `u64::MAX` where there is no hit.
    pub instance: Vec<u64>,
    pub primitive: Vec<u32>,
    pub turned: Vec<bool>,
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
        let (mut all, mut turned) = (vec![[0.0; 2]; len], vec![false; len]);
        for row in 0..len {
            let id = HitId {
                instance: instance[row],
                primitive: primitive[row],
            };
            if id == HitId::NONE {
                t[row] = f64::INFINITY;
            } else {
                all[row] = uv(row, id);
                turned[row] = id.primitive & TURNED != 0;
                primitive[row] &= !TURNED;
            }
        }
        Hits {
            t,
            instance,
            primitive,
            turned,
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
            turned: self.turned[row],
            uv: self.uv[row],
        })
    }
}
