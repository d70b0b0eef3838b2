//! Block tests in f32 with error bounds (docs/numerics/beams.md): rays that edge functions
//! leave undecided are deferred.

#[cfg(test)]
mod oracle_tests;
mod parallel;
mod pinhole;

use super::commit::Found;
use super::leaf::{BlockRef, BlockTest, GroupState};
use super::local_frame::{Bounds, LocalLines};
use super::mesh::{MeshTraversal, Nearest};
use super::rays::{Beam, Projection, RayGroup};
use crate::accel::{Block, WIDE};
use crate::geom::Meet;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Register, Scalar, max, min};
use crate::trace::query::Query;

pub(super) use parallel::Edges as ParallelEdges;
pub(super) use pinhole::Edges as PinholeEdges;

/// Limit of finished rays: below any depth.
const DONE: f32 = f32::MIN;

/// u, the unit roundoff of f32.
const UNIT: f32 = <f32 as Scalar>::UNIT_ROUNDOFF;

/// A block's edge functions and depths as all rays of a beam share them, with error bounds.
pub(super) trait Edges: Sized {
    /// Values of edge functions and depth at some rays and triangles.
    type Candidates<L: Lanes>;

    /// Sets up the edge functions of a block. `any`: for any-hit rays.
    fn new<L: Lanes, const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> Self;
    /// Returns the triangles that may lie in front of the rays.
    fn live(&self) -> u32;
    /// Returns the triangles that some ray of the group may hit, by the greatest value of
    /// each edge function over the group's rectangle and by depth.
    fn may_meet<L: Lanes>(&self, group: &RayGroup<L>, lines: &LocalLines<L>) -> u32;
    /// Takes lines from a group's rays by `pick`: each lane's, or one for all lanes.
    fn line<L: Lanes, M: Lanes>(&self, state: &GroupState<L>, pick: impl Fn(&L) -> M) -> Line<M>;
    /// Evaluates rays and triangles, a pair per lane; `at` reads a column of triangles.
    fn meet<L: Lanes>(
        &self,
        at: impl Fn(&[f32; WIDE]) -> L,
        line: &Line<L>,
        any: bool,
    ) -> Self::Candidates<L>;
    /// Returns the lanes whose ray may hit the triangle before its limit.
    fn possible<L: Lanes>(met: &Self::Candidates<L>) -> L::Mask;
    /// Certifies the hits of these lanes, with bounds of their depths.
    fn certify<L: Lanes>(
        &self,
        at: impl Fn(&[f32; WIDE]) -> L,
        met: &Self::Candidates<L>,
        any: bool,
    ) -> Certified<L>;
}

/// A ray as a line over depth: relative to the beam's local frame ([`LocalLines`]) and as
/// all kernels have it ([`RayGroup`]), with bounds of its start and of its limit in depth.
#[derive(Clone, Copy)]
pub(super) struct Line<L: Lanes> {
    centred: [L; 2],
    slopes: [L; 2],
    start: [L; 2],
    least: L,
    limit: L,
}

/// Certified hits of some lanes.
pub(super) struct Certified<L: Lanes> {
    /// Lanes that certainly hit the triangle beyond the ray's start; of any-hit rays of one
    /// origin, also before their end.
    sure: L::Mask,
    /// Depth as all kernels compute it.
    depth: L,
    /// Bounds of the hit's exact depth.
    from: L,
    to: L,
}

/// [`Edges::may_meet`] from edge functions that are grown by their error bounds.
#[inline(always)]
fn may_meet<L: Lanes>(
    normal: &[[[f32; WIDE]; 3]],
    nearest: &[f32; WIDE],
    group: &RayGroup<L>,
    lines: &LocalLines<L>,
) -> u32 {
    let [[u, du], [v, dv]] = lines.rect;
    let (u, du) = (Register::splat(u), Register::splat(du));
    let (v, dv) = (Register::splat(v), Register::splat(dv));
    let greatest = |which: usize| {
        let [x, y, z] = &normal[which];
        let n = [Register::load(x), Register::load(y), Register::load(z)];
        let spread = n[0].abs().mul_add(du, n[1].abs().mul_add(dv, n[2]));
        n[0].mul_add(u, n[1].mul_add(v, spread))
    };
    let least = min(min(greatest(0), greatest(1)), greatest(2));
    let late = Register::load(nearest).gt(Register::splat(group.deepest));
    (!(least.lt(Register::zero()) | late)).bits()
}

/// Sizes of a block's triangles that error bounds are relative to.
struct Extents {
    /// Λ: greatest distance of the corners and of the lines from the beam's middle.
    across: Register,
    /// D and E: extents of the triangles across and in depth.
    extent: Register,
    deep: Register,
    lowest: Register,
    highest: Register,
}

impl Extents {
    /// Bounds the extents from sheared corners relative to the middle, errors included (B7).
    #[inline(always)]
    fn new([a, b, c]: [[Register; 3]; 3], bounds: &Bounds) -> Extents {
        let splat = Register::splat;
        let range = |i: usize| {
            let low = min(min(a[i], b[i]), c[i]);
            (low, max(max(a[i], b[i]), c[i]))
        };
        let ((low_x, high_x), (low_y, high_y)) = (range(0), range(1));
        let (lowest, highest) = range(2);
        let across = max(max(high_x, -low_x), max(high_y, -low_y)) + splat(bounds.across);
        let extent = (high_x - low_x) + (high_y - low_y);
        Extents {
            across,
            extent: across.mul_add(splat(13.0 * UNIT), extent + splat(bounds.extent)),
            deep: (highest - lowest) + splat(bounds.deep),
            lowest,
            highest,
        }
    }
}

/// The [`BlockTest`] of any [`Edges`].
pub(super) struct GuardedLeaf<E>(E);

impl<L: Lanes, E: Edges> BlockTest<L> for GuardedLeaf<E> {
    #[inline(always)]
    fn new<const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> GuardedLeaf<E> {
        GuardedLeaf(E::new(block, beam, any))
    }

    #[inline(always)]
    fn live(&self) -> u32 {
        self.0.live()
    }

    #[inline(always)]
    fn may_meet(&self, group: &RayGroup<L>, lines: &LocalLines<L>) -> u32 {
        self.0.may_meet(group, lines)
    }

    #[inline(always)]
    fn ray<Q: Query<L>>(&self, lane: usize, block: &BlockRef, state: &mut GroupState<L>) -> bool {
        let at = |column: &[f32; WIDE]| Register::load(column);
        let one = |x: &L| Register::splat(x.lane(lane).to_f64() as f32);
        let line = self.0.line(state, one);
        let GroupState { group, nearest, .. } = state;
        let all = self.0.meet(at, &line, Q::ANY);
        let mut hits = E::possible(&all).bits() & self.0.live();
        if hits == 0 {
            return false;
        }
        let certified = self.0.certify(at, &all, Q::ANY);
        let here = L::Mask::from_bits(1 << lane);
        let mut sure = certified.sure.bits() & hits;
        if Q::ANY {
            // One certain occluder suffices. Without one, any undecided triangle defers the
            // ray.
            hits &= !certified.from.gt(line.limit).bits();
            if hits == 0 {
                return false;
            }
            sure &= hits & certified.to.lt(line.least).bits();
            let slot = if sure == 0 { hits } else { sure }.trailing_zeros() as usize;
            let hit = Certified {
                sure: L::Mask::splat(sure != 0),
                depth: L::zero(),
                from: L::from_f32(certified.from.lane(slot)),
                to: L::from_f32(certified.to.lane(slot)),
            };
            return nearest.commit_sure::<Q>(here, &hit, block, slot, &mut group.limit);
        }
        let columns = [certified.depth, certified.from, certified.to];
        let [depth, from, to] = columns.map(|x| x.to_array());
        let mut met = false;
        while hits != 0 {
            let slot = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let hit = Certified {
                sure: L::Mask::splat(sure >> slot & 1 != 0),
                depth: L::from_f32(depth[slot]),
                from: L::from_f32(from[slot]),
                to: L::from_f32(to[slot]),
            };
            met |= nearest.commit_sure::<Q>(here, &hit, block, slot, &mut group.limit);
        }
        met
    }

    #[inline(always)]
    fn triangle<Q: Query<L>>(
        &self,
        slot: usize,
        block: &BlockRef,
        state: &mut GroupState<L>,
    ) -> bool {
        let at = |column: &[f32; WIDE]| L::from_f32(column[slot]);
        let all = self.0.meet(at, &self.0.line(state, |x| *x), Q::ANY);
        let possible = E::possible(&all);
        if possible.none() {
            return false;
        }
        let hit = self.0.certify(at, &all, Q::ANY);
        let GroupState { group, nearest, .. } = state;
        nearest.commit_sure::<Q>(possible, &hit, block, slot, &mut group.limit)
    }
}

impl<L: Lanes, const S: usize> MeshTraversal<'_, L, S> {
    /// Prepares the guarded walk: local frame, lower bounds of the closest hits, and limits.
    #[inline(always)]
    pub fn start_guarded<P: Projection, Q: Query<L>>(&mut self, queries: &[Q; S]) {
        if P::PARALLEL {
            self.beam.centre_groups();
        } else {
            let bounds = &self.mesh.tree.bounds;
            self.beam.centre_pinhole(bounds);
        }
        for s in 0..S {
            let (group, starts) = (&mut self.beam.groups[s], &self.beam.starts[s]);
            let least = queries[s].least();
            // Lower bounds in depth: B17 for one direction, B10 for one origin.
            self.nearest[s].least = if P::PARALLEL {
                starts.depth + least * group.along - starts.slack
            } else {
                least * (group.along * L::from_f32(1.0 - 8.0 * f32::EPSILON))
            };
            let asleep = group.limit.lt(L::zero());
            group.limit = L::select(asleep, L::from_f32(DONE), group.limit);
        }
    }

    /// Commits the closest hits to the queries. Returns the deferred rays.
    #[inline(always)]
    pub fn commit_guarded<P: Projection, Q: Query<L>>(
        &mut self,
        queries: &mut [Q; S],
    ) -> [L::Mask; S] {
        let mut deferred = [L::Mask::splat(false); S];
        for s in 0..S {
            let nearest = &self.nearest[s];
            deferred[s] = L::Mask::from_bits(nearest.deferred);
            if Q::ANY || nearest.met == 0 {
                continue;
            }
            let (group, starts) = (&self.beam.groups[s], &self.beam.starts[s]);
            let found = Found {
                entry: self.entry,
                id: self.id,
                mesh: self.mesh,
                nearest,
            };
            let t = if P::PARALLEL {
                found.depths(starts.org, group.dir)
            } else if group.oblique & nearest.met == 0 {
                nearest.depth / group.along
            } else {
                found.depths(Vec3::splat(self.beam.object_org), group.dir)
            };
            let hit = L::Mask::from_bits(nearest.met);
            let known = t.abs().lt(L::splat(L::Scalar::INFINITY));
            deferred[s] = deferred[s] | hit & !known;
            let (from, to) = if P::PARALLEL {
                let start = starts.depth;
                let (from, to) = (nearest.least - start, group.limit - start);
                (from - starts.slack, to + starts.slack)
            } else {
                (nearest.least, group.limit)
            };
            // Three roundings: the division, the direction's and a difference (B17).
            let slack = L::from_f32(4.0 * f32::EPSILON);
            let (from, to) = (from / group.along, to / group.along);
            let within = [from - from.abs() * slack, to + to * slack];
            let meet = Meet {
                hit: hit & known,
                t,
                within,
                unsure: L::Mask::splat(false),
            };
            found.accept_sure(&meet, &mut queries[s]);
        }
        deferred
    }
}

impl<L: Lanes> Nearest<L> {
    /// Commits a triangle to the rays that certainly hit it before their closest hit so far,
    /// and defers the undecided ones. Returns whether any ray has changed.
    #[inline(always)]
    fn commit_sure<Q: Query<L>>(
        &mut self,
        possible: L::Mask,
        hit: &Certified<L>,
        block: &BlockRef,
        slot: usize,
        limit: &mut L,
    ) -> bool {
        let possible = possible & !hit.from.gt(*limit);
        if possible.none() {
            return false;
        }
        let nearer = possible & hit.sure & hit.to.lt(self.least);
        let deferred = possible & !nearer;
        let done = L::from_f32(DONE);
        if Q::ANY {
            *limit = L::select(nearer, done, *limit);
        } else {
            *limit = L::select(nearer, hit.to, *limit);
            self.least = L::select(nearer, hit.from, self.least);
            self.depth = L::select(nearer, hit.depth, self.depth);
        }
        self.take(nearer, block.number, slot, block.sources[slot]);
        if deferred.any() {
            *limit = L::select(deferred, done, *limit);
            self.deferred |= deferred.bits();
            self.met &= !deferred.bits();
        }
        true
    }
}
