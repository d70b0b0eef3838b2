//! Rays in lanes, and what a kernel answers.
//!
//! A [`Ray`] is the object ray of each lane (see DESIGN's truth), rounded to the
//! lanes' type, with what every triangle and polygon test needs of it worked
//! out once. Kernels are generic over [`Certainty`]: `Fast` takes an answer as
//! it is; a guarded kernel also says which lanes it could not settle, and the
//! caller has those decided exactly, one (ray, primitive) pair at a time.

use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};

/// How sure a kernel has to be of its answer.
pub trait Certainty: Copy + Send + Sync + 'static {
    /// Kernels report doubt, and queries keep between which t a hit lies. Where
    /// false, all of it is compiled away.
    const GUARDED: bool;
    /// Every decision is in doubt: what others are compared with.
    const DOUBTS_ALL: bool;

    /// Lanes of a packet, a bit each, whose decision about a primitive is in
    /// doubt whatever its kernel says: for tests. Asked only where guarded.
    #[inline(always)]
    fn doubts(_instance: u64, _primitive: u32) -> u32 {
        0
    }
}

/// Answers are taken as they are. Zero-sized, costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fast;

impl Certainty for Fast {
    const GUARDED: bool = false;
    const DOUBTS_ALL: bool = false;
}

/// What the kernels' error bounds cannot settle is decided exactly.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guarded;

impl Certainty for Guarded {
    const GUARDED: bool = true;
    const DOUBTS_ALL: bool = false;
}

/// Where each lane's ray first meets a primitive beyond `t_min`.
#[derive(Clone, Copy, Debug)]
pub struct Meet<L: Lanes> {
    pub hit: L::Mask,
    /// The canonical evaluation; meaningless where not `hit`.
    pub t: L,
    /// Where a hit truly lies, at least and at most; under [`Fast`] both are t.
    pub within: [L; 2],
    /// Lanes that the kernel could not settle; none under [`Fast`].
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

    /// Nothing is known.
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
    /// Lanes whose line meets the solid at all.
    pub some: L::Mask,
    /// −∞ where the line has always been inside.
    pub enter: L,
    pub exit: L,
}

impl<L: Lanes> Span<L> {
    /// The first boundary beyond `t_min`: a ray that starts inside meets the
    /// far side.
    #[inline(always)]
    pub fn first_beyond(self, t_min: L) -> Meet<L> {
        let t = L::select(self.enter.gt(t_min), self.enter, self.exit);
        Meet::certain(self.some & t.gt(t_min), t)
    }
}

/// Object rays at the lanes' precision.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L: Lanes> {
    pub org: Vec3<L>,
    pub dir: Vec3<L>,
    pub t_min: L,
    /// dir · dir.
    pub dir_squared: L,
    pub shear: Shear<L>,
}

/// The shear that takes each ray to the axis along which it is longest (Woop,
/// Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2013).
///
/// Lanes may differ in that axis; coherent packets hardly ever do. A kernel
/// runs once for each axis present, on the lanes that have it.
#[derive(Clone, Copy, Debug)]
pub struct Shear<L: Lanes> {
    /// Bit k: some lane's longest axis is k.
    pub axes: u8,
    pub lanes: [L::Mask; 3],
    /// −dir[k+1] / dir[k] and −dir[k+2] / dir[k], k the lane's own axis.
    pub x: L,
    pub y: L,
    /// dir[k], and 1 over it.
    pub along: L,
    pub inverse: L,
}

impl<L: Lanes> Ray<L> {
    #[inline(always)]
    pub fn new(org: Vec3<L>, dir: Vec3<L>, t_min: L) -> Ray<L> {
        let (shear, turned) = Shear::of(dir);
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
    /// And the direction, as [`turned`](Self::turned) has it.
    #[inline(always)]
    fn of(d: Vec3<L>) -> (Shear<L>, Vec3<L>) {
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

    /// The axes to run a kernel for, as (k, lanes).
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = (usize, L::Mask)> + '_ {
        (0..3)
            .filter(|k| self.axes >> k & 1 != 0)
            .map(|k| (k, self.lanes[k]))
    }

    /// The ray's longest axis last, in place of z. Sums over axes then go the same way
    /// however scene and ray are turned: the first two of three are alike.
    #[inline(always)]
    pub fn turned(&self, v: Vec3<L>) -> Vec3<L> {
        turned(&self.lanes, v)
    }

    /// The same of the direction that this is the shear of.
    #[inline(always)]
    pub fn turned_dir(&self, dir: Vec3<L>) -> Vec3<L> {
        let [on_x, on_y, _] = self.lanes;
        let (x, y) = (L::select(on_x, dir.z, dir.x), L::select(on_y, dir.z, dir.y));
        Vec3::new(x, y, self.along)
    }

    /// A point relative to the ray's origin, seen along the ray: (x, y, depth
    /// along axis k). The same operations for every primitive that shares the
    /// point, so shared edges are seen at the same place.
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
