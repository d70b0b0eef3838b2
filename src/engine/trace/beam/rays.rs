//! A beam's rays in one space, as lines over depth along their main axis.

use super::local_frame::{LocalFrame, LocalLines};
use super::parallel::{LocalStarts, Shear};
use crate::accel::{Frustum, WideBlas};
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Vec3};
use crate::trace::query::Query;

/// What the rays of a beam share, at compile time: origin or direction.
pub(super) trait Projection {
    /// Whether the rays share their direction, else their origin.
    const PARALLEL: bool;
}

/// Rays of one origin.
pub(super) struct Pinhole;

/// Rays of one direction.
pub(super) struct Parallel;

impl Projection for Pinhole {
    const PARALLEL: bool = false;
}

impl Projection for Parallel {
    const PARALLEL: bool = true;
}

/// As many rays of a beam as there are lanes. Depths are measured along the main axis k:
/// from the shared origin, z = t·|d_k|, or from the near side of the tree.
#[derive(Clone, Copy)]
pub(super) struct RayGroup<L: Lanes> {
    /// Rounded to the lanes' type; padding has the middle ray's.
    pub dir: Vec3<L>,
    /// Loss of that rounding, itself rounded to the lanes' type.
    pub low: Vec3<L>,
    /// Coordinates of the line. One origin: its slopes, d_a / |d_k| and d_b / |d_k|. One
    /// direction: its position along a and b at depth 0.
    pub u: L,
    pub v: L,
    /// 1/u and 1/v; for one direction, u and v over the slopes.
    pub(super) inv_u: L,
    pub(super) inv_v: L,
    /// |d_k|.
    pub along: L,
    /// Rays whose own main axis may differ from the beam's.
    pub oblique: u32,
    /// Depth beyond which no hit matters; negative for finished rays.
    pub limit: L,
    /// Greatest limit of the group, rounded up.
    pub deepest: f32,
    /// Middle and half extent of u and of v, rounded outward.
    pub rect: [[f32; 2]; 2],
}

/// `S` groups of rays, and what they share in one space.
pub(super) struct Beam<L: Lanes, const S: usize> {
    /// Whether the rays share their direction: see [`Projection`].
    pub parallel: bool,
    pub frustum: Frustum,
    /// The shared origin at the lanes' precision.
    pub object_org: [L::Scalar; 3],
    /// The shared origin.
    pub exact_org: [f64; 3],
    /// The shared origin in f32 along (a, b, k), k times the sign; for one direction, the
    /// middle of the tree's near side.
    pub org: [f32; 3],
    pub groups: [RayGroup<L>; S],
    /// One direction: its shear, and where rays start.
    pub shear: Shear,
    pub starts: [LocalStarts<L>; S],
    /// `guarded`: the line that lines and corners are relative to.
    pub centre: LocalFrame,
    pub lines: [LocalLines<L>; S],
    /// 1 or the greatest |slope|.
    pub steepest: f32,
    /// One origin: the greatest |u| and |v|, rounded up.
    pub widest: [f32; 2],
    /// One origin: its largest coordinate.
    pub origin: f32,
    /// Largest distance, along an axis, from the origin of the space or of the rays to the
    /// far side of the tree.
    pub reach: f32,
}

/// Largest slope of a beam's rays; steeper ones are traced as a stream.
const STEEPEST: f32 = 8.0;

/// Least and greatest length of a beam's directions along the main axis (B4, B13): beyond
/// them f32 would round directions, depths or inverses to fewer bits.
pub(super) const SHORTEST: f64 = 1e-30;
const LONGEST: f64 = 1e30;

/// Largest reach of a beam (B13): boxes are cut off there, and an origin may be infinite.
const FARTHEST: f32 = 1e38;

/// Least t of a beam (B13): 2⁻¹⁰², the least normal number over 2⁻²⁴. f32 would round smaller
/// t, and limits with them, by more than a rounding of the distance.
pub(super) const SOONEST: f32 = f32::MIN_POSITIVE / (0.5 * f32::EPSILON);

/// Least magnitude of a slope that is divided by; smaller ones count as this.
pub(super) const LEAST_SLOPE: f32 = 1e-12;

impl<L: Lanes, const S: usize> Beam<L, S> {
    /// Makes room for the rays of one beam after another.
    pub fn empty() -> Self {
        let zero = L::zero();
        let group = RayGroup {
            dir: Vec3::new(zero, zero, zero),
            low: Vec3::new(zero, zero, zero),
            u: zero,
            v: zero,
            inv_u: zero,
            inv_v: zero,
            along: zero,
            oblique: 0,
            limit: -L::from_f32(1.0),
            deepest: -1.0,
            rect: [[0.0; 2]; 2],
        };
        let starts = LocalStarts {
            org: group.dir,
            depth: zero,
            slack: zero,
        };
        Beam {
            parallel: false,
            shear: Shear::default(),
            starts: [starts; S],
            centre: LocalFrame::default(),
            lines: [LocalLines::none(); S],
            frustum: Frustum::default(),
            object_org: [L::Scalar::from_f32(0.0); 3],
            exact_org: [0.0; 3],
            org: [0.0; 3],
            groups: [group; S],
            steepest: 1.0,
            widest: [0.0; 2],
            origin: 0.0,
            reach: 0.0,
        }
    }

    /// Loads rays of one origin; those that are not `alive` are replaced by the middle ray.
    /// Returns false if the rays do not advance together along one axis; the beam is then
    /// undefined. The result is the same at every width and for any set of finished rays:
    /// the main axis is that of the middle ray of `all`.
    #[inline(always)]
    pub fn load_pinhole(
        &mut self,
        org: [f64; 3],
        dirs: impl Fn(usize) -> Vec3<L::Double>,
        all: &[L::Mask; S],
        alive: &[L::Mask; S],
        bounds: &Aabb32,
    ) -> bool {
        for (s, group) in self.groups.iter_mut().enumerate() {
            let exact = dirs(s);
            let narrow =
                |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
            group.dir = narrow(exact);
            let Vec3 { x, y, z } = group.dir;
            group.low = narrow(exact - Vec3::new(x.widen(), y.widen(), z.widen()));
        }
        let (Some([leader, _]), Some([middle, middle_low])) =
            (self.middle_ray(all), self.middle_ray(alive))
        else {
            return false;
        };
        let (axes, sign) = main_axis(leader);
        let k = axes[2];
        let stand_in = Vec3::<L>::splat(middle);
        let mut slopes = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        let (mut wild, mut longest) = (false, 0.0_f32);
        let (one, tiny) = (L::from_f32(1.0), L::from_f32(LEAST_SLOPE));
        let safe = |x: L| L::select(x.abs().lt(tiny), tiny, x);
        for ((group, all), alive) in self.groups.iter_mut().zip(all).zip(alive) {
            let dir = group.dir;
            let along = dir.axis(k) * L::from_f32(sign);
            let (a, b) = (dir.axis(axes[0]), dir.axis(axes[1]));
            let steep = a.abs().max(b.abs()).le(along * L::from_f32(STEEPEST));
            let long = along.ge(L::from_f64(SHORTEST)) & along.le(L::from_f64(LONGEST));
            let fits = steep & long;
            wild |= (*all & !fits).any();
            let most = L::select(*all, along, L::zero()).greatest();
            longest = longest.max(most.to_f64() as f32);
            let dir = Vec3::select(*alive, dir, stand_in);
            group.low = Vec3::select(*alive, group.low, Vec3::<L>::splat(middle_low));
            let along = dir.axis(k) * L::from_f32(sign);
            let (a, b) = (dir.axis(axes[0]), dir.axis(axes[1]));
            let (u, v) = (a / along, b / along);
            group.oblique = (!a.abs().max(b.abs()).lt(along)).bits();
            group.dir = dir;
            group.inv_u = one / safe(u);
            group.inv_v = one / safe(v);
            group.along = along;
            group.set_lines(u, v, &mut slopes);
        }
        if wild {
            return false;
        }
        self.parallel = false;
        self.exact_org = org;
        self.object_org = [
            L::Scalar::from_f64(org[0]),
            L::Scalar::from_f64(org[1]),
            L::Scalar::from_f64(org[2]),
        ];
        let org = [
            org[axes[0]] as f32,
            org[axes[1]] as f32,
            org[axes[2]] as f32 * sign,
        ];
        self.org = org;
        self.reach = (0..3).fold(0.0_f32, |reach, i| {
            let side = if i == 2 { sign } else { 1.0 };
            let (low, high) = (bounds.min[axes[i]] * side, bounds.max[axes[i]] * side);
            reach
                .max((low - org[i]).abs())
                .max((high - org[i]).abs())
                .max(org[i].abs())
        });
        // NaN fails these comparisons.
        if !(self.reach < FARTHEST && longest * SOONEST <= self.reach) {
            return false;
        }
        // 1e-30 covers slopes that are denormal.
        self.widest = slopes.map(|[low, high]| low.abs().max(high.abs()) + 1e-30);
        self.origin = org.iter().fold(0.0, |m, x| x.abs().max(m));
        self.steepest = slopes.iter().flatten().fold(1.0_f32, |m, x| m.max(x.abs()));
        self.frustum = Frustum::new(axes, sign, (org, org), 0.0, slopes, bounds);
        true
    }

    /// Returns the direction of the middle ray, or of the first live one, as its rounding and
    /// the loss of that.
    #[inline(always)]
    fn middle_ray(&self, alive: &[L::Mask; S]) -> Option<[[L::Scalar; 3]; 2]> {
        let ray = |i: usize| {
            let (group, lane) = (&self.groups[i / L::COUNT], i % L::COUNT);
            let at = |v: &Vec3<L>| [v.x.lane(lane), v.y.lane(lane), v.z.lane(lane)];
            [at(&group.dir), at(&group.low)]
        };
        self.middle_of(alive).map(ray)
    }

    /// Returns the index of the middle ray, or of the first live one.
    #[inline(always)]
    pub(super) fn middle_of(&self, alive: &[L::Mask; S]) -> Option<usize> {
        let is_alive = |i: &usize| alive[i / L::COUNT].bits() >> (i % L::COUNT) & 1 != 0;
        let middle = S * L::COUNT / 2;
        if is_alive(&middle) {
            return Some(middle);
        }
        (0..S * L::COUNT).find(is_alive)
    }

    /// Converts each ray's limit from t to depth; negative limits mark finished rays. Where
    /// the depth does not decide, the limit grows by the roundings between depth and t (B10,
    /// B17), since closest hits of different shapes are compared by t.
    #[inline(always)]
    pub fn limit_t<C: Certainty, Q: Query<L>>(&mut self, s: usize, limit: L) {
        let decides = Q::ANY && !C::GUARDED;
        let group = &mut self.groups[s];
        group.limit = if self.parallel {
            let starts = &self.starts[s];
            let asleep = limit.lt(L::zero());
            let depth = starts.depth + limit * group.along;
            let depth = if decides { depth } else { depth + starts.slack };
            L::select(asleep, -L::from_f32(1.0), depth)
        } else {
            let slack = if decides {
                1.0
            } else {
                1.0 + 8.0 * f32::EPSILON
            };
            limit * (group.along * L::from_f32(slack))
        };
        group.set_deepest();
    }

    /// Estimates the number of a mesh's blocks that the rays' rectangle covers, if blocks are
    /// spread evenly over the mesh's box as seen along the main axis.
    #[inline(always)]
    pub fn blocks_across(&self, mesh: &WideBlas) -> f32 {
        let Frustum { axes, sign, .. } = self.frustum;
        let bounds = &mesh.tree.bounds;
        let extent = |i: usize| bounds.max[axes[i]] - bounds.min[axes[i]];
        let k = axes[2];
        let middle = (0.5 * bounds.min[k] + 0.5 * bounds.max[k]) * sign;
        let depth = (middle - self.org[2]).max(0.5 * extent(2));
        let share = |i: usize| (self.frustum.width(i, depth) / extent(i)).min(1.0);
        share(0) * share(1) * mesh.blocks.len() as f32
    }

    /// Returns the greatest limit of all rays; negative if all are finished.
    #[inline(always)]
    pub fn deepest(&self) -> f32 {
        self.groups.iter().fold(-1.0, |m, g| m.max(g.deepest))
    }

    /// Returns the rays of a group that may hit a box before their limits (B16).
    #[inline(always)]
    pub fn reach_box<P: Projection>(&self, s: usize, relative: &RelativeBox) -> L::Mask {
        if P::PARALLEL {
            return self.reach_sheared(s, relative);
        }
        let group = &self.groups[s];
        let [x0, x1, y0, y1, near, far] = relative.0;
        let (x0, x1) = (L::from_f32(x0), L::from_f32(x1));
        let (y0, y1) = (L::from_f32(y0), L::from_f32(y1));
        let (near, far) = (L::from_f32(near), L::from_f32(far));
        let (x0, x1) = (x0 * group.inv_u, x1 * group.inv_u);
        let (y0, y1) = (y0 * group.inv_v, y1 * group.inv_v);
        let enter = x0.min(x1).max(y0.min(y1)).max(near);
        let exit = x0.max(x1).min(y0.max(y1)).min(far);
        let slack = L::from_f32(1.0 + 8.0 * f32::EPSILON);
        enter.le(exit * slack) & enter.le(group.limit * slack)
    }
}

/// Returns the axes (a, b, k), k being the one along which a direction is longest, and the
/// direction's sign along k.
#[inline(always)]
pub(super) fn main_axis<X: Scalar>(dir: [X; 3]) -> ([usize; 3], f32) {
    let size = [
        dir[0].to_f64().abs(),
        dir[1].to_f64().abs(),
        dir[2].to_f64().abs(),
    ];
    let k = if size[2] >= size[0] && size[2] >= size[1] {
        2
    } else if size[1] >= size[0] {
        1
    } else {
        0
    };
    let sign = if dir[k].to_f64() < 0.0 { -1.0 } else { 1.0 };
    ([(k + 1) % 3, (k + 2) % 3, k], sign)
}

impl<L: Lanes> RayGroup<L> {
    /// Sets the lines' coordinates, and widens `all` to include them (B16).
    #[inline(always)]
    pub(super) fn set_lines(&mut self, u: L, v: L, all: &mut [[f32; 2]; 2]) {
        self.u = u;
        self.v = v;
        for (i, x) in [u, v].into_iter().enumerate() {
            let (least, most) = (x.least().to_f64() as f32, x.greatest().to_f64() as f32);
            let [low, high] = all[i];
            all[i] = [
                if least < low { least } else { low },
                if most > high { most } else { high },
            ];
            let middle = 0.5 * (least + most);
            let half = 0.5 * (most - least);
            let half = half + (middle.abs() + half) * (8.0 * f32::EPSILON) + 1e-12;
            self.rect[i] = [middle, half];
        }
    }

    /// Updates the greatest limit of the group.
    #[inline(always)]
    pub fn set_deepest(&mut self) {
        let deepest = self.limit.greatest().to_f64() as f32;
        self.deepest = deepest * (1.0 + f32::EPSILON);
    }
}

/// A padded box relative to the origin: ranges of x, y and depth. For rays of one direction
/// all three are ranges of depth.
#[derive(Clone, Copy)]
pub(super) struct RelativeBox(pub(super) [f32; 6]);

impl RelativeBox {
    #[inline(always)]
    pub fn new<P: Projection, L: Lanes, const S: usize>(
        beam: &Beam<L, S>,
        min: [f32; 3],
        max: [f32; 3],
    ) -> RelativeBox {
        if P::PARALLEL {
            return beam.sheared_box(min, max);
        }
        let ([x0, x1], [y0, y1], [near, far]) = beam.frustum.relative(min, max);
        RelativeBox([x0, x1, y0, y1, near.max(0.0), far])
    }
}
