//! Rays in lanes, and what a kernel answers.
//!
//! A [`Ray`] is the object ray of each lane (S6), rounded to the lanes' type, with the values that
//! every triangle and polygon test needs computed once. Kernels are generic over [`Certainty`]:
//! `Fast` takes an answer as it is; a guarded kernel also says which lanes are undecided, and the
//! caller has these decided exactly, one (ray, primitive) pair at a time.

use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};

/// The certainty that a kernel's answers must have.
pub trait Certainty: Copy + Send + Sync + 'static {
    /// Whether kernels report undecided lanes and queries keep bounds of t. If false, all of it is
    /// compiled away.
    const GUARDED: bool;
    /// Whether every lane is left undecided: tests compare other certainties with this one.
    const DOUBTS_ALL: bool;

    /// Returns, for tests, the lanes of a packet (a bit each) that stay undecided about a
    /// primitive whatever its kernel says. Called only if `GUARDED`.
    #[inline(always)]
    fn doubts(_instance: u64, _primitive: u32) -> u32 {
        0
    }
}

/// The certainty that takes answers as they are; zero-sized.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fast;

impl Certainty for Fast {
    const GUARDED: bool = false;
    const DOUBTS_ALL: bool = false;
}

/// The certainty that has lanes decided exactly if the kernels' error bounds leave them undecided.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guarded;

impl Certainty for Guarded {
    const GUARDED: bool = true;
    const DOUBTS_ALL: bool = false;
}

/// The answer of a kernel: where each lane's ray first meets a primitive beyond `t_min`.
#[derive(Clone, Copy, Debug)]
pub struct Meet<L: Lanes> {
    pub hit: L::Mask,
    /// The canonical t; meaningless in lanes that are not `hit`.
    pub t: L,
    /// Lower and upper bound of a hit's exact t; under [`Fast`] both are t.
    pub within: [L; 2],
    /// Undecided lanes; none under [`Fast`].
    pub unsure: L::Mask,
}

impl<L: Lanes> Meet<L> {
    #[inline(always)]
    pub fn certain(hit: L::Mask, t: L) -> Meet<L> {
        Meet {
            hit,
            t,
            within: [t, t],
            unsure: L::Mask::splat(false),
        }
    }

    /// Leaves all of the given lanes undecided.
    #[inline(always)]
    pub fn unsure(lanes: L::Mask) -> Meet<L> {
        Meet {
            unsure: lanes,
            ..Meet::certain(L::Mask::splat(false), L::zero())
        }
    }
}

/// The part of each lane's ray inside a convex solid: `enter ≤ t ≤ exit`.
#[derive(Clone, Copy, Debug)]
pub struct Span<L: Lanes> {
    /// Lanes whose line meets the solid.
    pub some: L::Mask,
    /// −∞ if the line has always been inside.
    pub enter: L,
    pub exit: L,
}

impl<L: Lanes> Span<L> {
    /// Returns the first boundary beyond `t_min`; a ray that starts inside meets the far side.
    #[inline(always)]
    pub fn first_beyond(self, t_min: L) -> Meet<L> {
        let t = L::select(self.enter.gt(t_min), self.enter, self.exit);
        Meet::certain(self.some & t.gt(t_min), t)
    }
}

/// Object rays, rounded to the lanes' type.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L: Lanes> {
    pub org: Vec3<L>,
    pub dir: Vec3<L>,
    pub t_min: L,
    /// The square of the direction's length, dir · dir.
    pub dir_squared: L,
    pub shear: Shear<L>,
}

/// The shear that takes each ray's direction to its longest axis (Woop, Benthin, Wald: Watertight
/// Ray/Triangle Intersection, JCGT 2013).
///
/// Lanes may differ in that axis, though coherent packets hardly ever do. A kernel runs once for
/// each axis present, on the lanes that have it.
#[derive(Clone, Copy, Debug)]
pub struct Shear<L: Lanes> {
    /// Bit k says that some lane's longest axis is k.
    pub axes: u8,
    pub lanes: [L::Mask; 3],
    /// −dir[k+1] / dir[k] and −dir[k+2] / dir[k], where k is the lane's own axis.
    pub x: L,
    pub y: L,
    /// dir[k], and its inverse.
    pub along: L,
    pub inverse: L,
}

impl<L: Lanes> Ray<L> {
    #[inline(always)]
    pub fn new(org: Vec3<L>, dir: Vec3<L>, t_min: L) -> Ray<L> {
        let (shear, turned) = Shear::new(dir);
        Ray {
            org,
            dir,
            t_min,
            dir_squared: turned.length_squared(),
            shear,
        }
    }
}

#[inline(always)]
fn turned<L: Lanes>([on_x, on_y, _]: &[L::Mask; 3], v: Vec3<L>) -> Vec3<L> {
    Vec3::new(
        L::select(*on_x, v.z, v.x),
        L::select(*on_y, v.z, v.y),
        L::select(*on_x, v.x, L::select(*on_y, v.y, v.z)),
    )
}

impl<L: Lanes> Shear<L> {
    /// Computes the shear of directions, and the directions as [`turned`](Self::turned) returns
    /// them.
    #[inline(always)]
    fn new(d: Vec3<L>) -> (Shear<L>, Vec3<L>) {
        let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
        let is_z = z.ge(x) & z.ge(y);
        let is_y = y.ge(x) & !is_z;
        let is_x = !(is_z | is_y);
        let lanes = [is_x, is_y, is_z];
        let turned = turned(&lanes, d);
        let (p, q, along) = (turned.x, turned.y, turned.z);
        let shear = Shear {
            axes: u8::from(is_x.any()) | u8::from(is_y.any()) << 1 | u8::from(is_z.any()) << 2,
            lanes,
            x: -(L::select(is_z, p, q) / along),
            y: -(L::select(is_z, q, p) / along),
            along,
            inverse: L::from_f32(1.0) / along,
        };
        (shear, turned)
    }

    /// Returns the axes to run a kernel for, as (k, lanes).
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = (usize, L::Mask)> + '_ {
        (0..3)
            .filter(|k| self.axes >> k & 1 != 0)
            .map(|k| (k, self.lanes[k]))
    }

    /// Permutes a vector so that the ray's longest axis takes the place of z. Sums over the axes
    /// then round the same way however scene and ray are turned, because the first two of three
    /// components are alike.
    #[inline(always)]
    pub fn turned(&self, v: Vec3<L>) -> Vec3<L> {
        turned(&self.lanes, v)
    }

    /// Returns the ray's own direction, permuted in the same way.
    #[inline(always)]
    pub fn turned_dir(&self, dir: Vec3<L>) -> Vec3<L> {
        let [on_x, on_y, _] = self.lanes;
        let (x, y) = (L::select(on_x, dir.z, dir.x), L::select(on_y, dir.z, dir.y));
        Vec3::new(x, y, self.along)
    }

    /// Returns a point, given relative to the ray's origin, as seen along the ray: (x, y, depth
    /// along axis k). Every primitive that shares the point gets the same numbers, so shared edges
    /// are seen at the same place.
    #[inline(always)]
    pub fn apply(&self, k: usize, p: Vec3<L>) -> (L, L, L) {
        let along = p.axis(k);
        (
            self.x.mul_add(along, p.axis((k + 1) % 3)),
            self.y.mul_add(along, p.axis((k + 2) % 3)),
            along,
        )
    }
}
