//! Rays in columns.

use super::beam::BEAM;
use super::packet::Packet;
use crate::accel::{STREAM, World};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Scalar};

/// Columns of rays are padded to a multiple of this, the number of rays of a beam.
pub const MAX_LANES: usize = BEAM;

/// Rays in world space. Columns are padded to a multiple of [`MAX_LANES`] with rays whose
/// `t_max` is negative, which hit nothing. No `t_min` is below 0.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    pub org: Vectors<'a>,
    /// Of any length; t counts in lengths of it.
    pub dir: Vectors<'a>,
    pub t_min: &'a [f32],
    pub t_max: &'a [f32],
}

/// Columns of points or directions, in either type. f32 is widened, which loses nothing.
#[derive(Clone, Copy)]
pub enum Vectors<'a> {
    Single([&'a [f32]; 3]),
    Double([&'a [f64]; 3]),
}

impl Vectors<'_> {
    /// Returns the vector of ray `i`.
    #[inline(always)]
    pub fn at(&self, i: usize) -> [f64; 3] {
        match self {
            Vectors::Single(columns) => columns.map(|x| f64::from(x[i])),
            Vectors::Double(columns) => columns.map(|x| x[i]),
        }
    }

    /// Loads the vectors of as many rays as there are lanes, from row `first` on.
    #[inline(always)]
    pub(super) fn lanes<D: Lanes<Scalar = f64>>(&self, first: usize) -> Vec3<D> {
        match self {
            Vectors::Single([x, y, z]) => {
                let load = |column: &[f32]| load_f32::<D>(&column[first..]);
                Vec3::new(load(x), load(y), load(z))
            }
            Vectors::Double([x, y, z]) => {
                let load = |column: &[f64]| D::load(&column[first..]);
                Vec3::new(load(x), load(y), load(z))
            }
        }
    }

    /// Returns the columns of some rows.
    pub fn rows(&self, range: std::ops::Range<usize>) -> Self {
        match self {
            Vectors::Single(columns) => Vectors::Single(columns.map(|x| &x[range.clone()])),
            Vectors::Double(columns) => Vectors::Double(columns.map(|x| &x[range.clone()])),
        }
    }
}

impl Rays<'_> {
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }

    /// Returns some of the rays; both ends are multiples of [`MAX_LANES`].
    pub fn rows(&self, range: std::ops::Range<usize>) -> Self {
        Rays {
            org: self.org.rows(range.clone()),
            dir: self.dir.rows(range.clone()),
            t_min: &self.t_min[range.clone()],
            t_max: &self.t_max[range],
        }
    }

    /// Returns the rays of a stream with a range of t, as a bit set.
    #[inline(always)]
    pub(super) fn alive(&self, first: usize) -> u64 {
        let mut alive = 0;
        for i in 0..STREAM {
            let (t_min, t_max) = (self.t_min[first + i], self.t_max[first + i]);
            alive |= u64::from(t_min < t_max && t_max >= 0.0) << i;
        }
        alive
    }

    /// Loads a packet with slab constants for the world's top-level tree.
    #[inline(always)]
    pub(super) fn packet<L: Lanes>(&self, first: usize, world: &World) -> Packet<L> {
        let (org, dir, t_min) = self.numbers(first);
        Packet::about(world.center, org, dir, t_min, &world.bounds)
    }

    /// Loads a packet for tests without boxes.
    #[inline(always)]
    pub(super) fn open_packet<L: Lanes>(&self, first: usize) -> Packet<L> {
        let (org, dir, t_min) = self.numbers(first);
        Packet::open(org, dir, t_min)
    }

    #[inline(always)]
    fn numbers<L: Lanes>(&self, first: usize) -> (Vec3<L::Double>, Vec3<L::Double>, L) {
        (
            self.org.lanes(first),
            self.dir.lanes(first),
            load_f32(&self.t_min[first..]),
        )
    }
}

/// Loads f32 into lanes of any type.
#[inline(always)]
pub(super) fn load_f32<L: Lanes>(from: &[f32]) -> L {
    let mut lanes = L::zero().to_array();
    for (to, from) in lanes.as_mut().iter_mut().zip(&from[..L::COUNT]) {
        *to = L::Scalar::from_f32(*from);
    }
    L::load(lanes.as_ref())
}
