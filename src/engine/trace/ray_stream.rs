//! A stream's rays in one space, and the triangles of a block that each of them may hit
//! (T5 to T11, docs/numerics/triangles.md).

use super::stream::for_each_bit;
use crate::accel::{Block, BoxRays, STREAM, Slabs, WIDE};
use crate::geom::Ray;
use crate::geom::triangle::{Seen, cross_with_size, plane_ratio};
use crate::math::lanes::{Entries, Lanes, Mask, Register, max, min};
use crate::math::{Aabb32, Vec3};

/// A stream's rays in one space, in columns of f32. They only cull; hits come from the rays
/// themselves.
#[derive(Default)]
pub(super) struct StreamRays {
    pub boxes: BoxRays,
    pub triangle_rays: TriangleRays,
}

/// Rays as the culling of triangles needs them.
pub(super) struct TriangleRays {
    org: [Column; 3],
    /// Shear of each ray.
    shear: [Column; 3],
    /// Bit sets of rays whose main axis is y, and z.
    axis: [u64; 2],
    /// t_min as a depth along the axis in the ray's sense, rounded down.
    begin: Column,
    /// Error bound of a sheared corner (T7); infinite where nothing is certain.
    misplaced: Column,
    /// Coefficients of an edge function's error bound over m = [`Seen::size`] (T2): of m, and
    /// constant. That of m² is the same for all rays.
    carried: Column,
    rest: Column,
    /// Error bound of T − D · `begin` over S (T9).
    begun: Column,
}

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column([f32; STREAM]);

impl Default for TriangleRays {
    fn default() -> TriangleRays {
        let none = Column::default();
        TriangleRays {
            org: [none; 3],
            shear: [none; 3],
            axis: [0; 2],
            begin: none,
            misplaced: none,
            carried: none,
            rest: none,
            begun: none,
        }
    }
}

impl Default for Column {
    fn default() -> Column {
        Column([0.0; STREAM])
    }
}

impl StreamRays {
    /// Loads the rays of a set. `ray` returns origin, direction and t_min of a row. `sees`:
    /// for triangles too, not only for boxes.
    #[inline(always)]
    pub fn load(
        &mut self,
        set: u64,
        ray: impl Fn(usize) -> ([f64; 3], [f64; 3], f32),
        bounds: &Aabb32,
        sees: bool,
    ) {
        /// All lanes of a register.
        const EVERY: u64 = (1 << <Register as Lanes>::COUNT) - 1;
        let mut columns = [Column::default(); 7];
        for_each_bit(set, |i| {
            let (org, dir, t_min) = ray(i);
            for k in 0..3 {
                columns[k].0[i] = org[k] as f32;
                columns[3 + k].0[i] = dir[k] as f32;
            }
            columns[6].0[i] = t_min;
        });
        for first in (0..STREAM).step_by(<Register as Lanes>::COUNT) {
            if (set >> first) & EVERY == 0 {
                continue;
            }
            let load = |column: usize| Register::load(&columns[column].0[first..]);
            let org = Vec3::new(load(0), load(1), load(2));
            let dir = Vec3::new(load(3), load(4), load(5));
            let t_min = load(6);
            self.boxes.put(first, &Slabs::new(org, dir, bounds), t_min);
            if !sees {
                continue;
            }
            let ray = Ray::new(org, dir, t_min);
            let reach = |k: usize| {
                let o = org.axis(k);
                let low = Register::splat(bounds.min[k]) - o;
                let high = Register::splat(bounds.max[k]) - o;
                max(max(low.abs(), high.abs()), o.abs())
            };
            let reach = max(max(reach(0), reach(1)), reach(2));
            // T7; nothing is certain for a direction that is too short or too long (T5).
            let misplaced = reach * Register::splat(MISPLACED * 0.5 * f32::EPSILON);
            let misplaced = misplaced + Register::splat(f32::MIN_POSITIVE);
            let shear = &ray.shear;
            let short = Register::splat(f32::MIN_POSITIVE / (0.5 * f32::EPSILON));
            let long = Register::splat(0.5 * f32::EPSILON / f32::MIN_POSITIVE);
            // Nor where products may leave the format (T10).
            let sane = Lanes::gt(shear.along.abs(), short)
                & Lanes::lt(shear.along.abs(), long)
                & Lanes::lt(misplaced, Register::splat(FARTHEST))
                // Nor where a t of this size has lost bits.
                & Lanes::lt(shear.along.abs() * short, reach);
            let infinite = Register::splat(f32::INFINITY);
            let misplaced = <Register as Lanes>::select(sane, misplaced, infinite);
            let begin = t_min * shear.along.abs();
            let begin = begin - begin.abs() * Register::splat(SLACK);
            // T2.
            let carried = misplaced * Register::splat(4.1);
            let rest = misplaced * misplaced * Register::splat(2.1);
            let rest = rest + Register::splat(f32::MIN_POSITIVE);
            let begun = plane_error(misplaced, begin.abs());
            let store = |column: &mut Column, x: Register| x.store(&mut column.0[first..]);
            let triangle_rays = &mut self.triangle_rays;
            for k in 0..3 {
                store(&mut triangle_rays.org[k], org.axis(k));
            }
            store(&mut triangle_rays.shear[0], shear.x);
            store(&mut triangle_rays.shear[1], shear.y);
            store(&mut triangle_rays.shear[2], shear.along);
            let [_, y, z] = &shear.lanes;
            for (rays, lanes) in triangle_rays.axis.iter_mut().zip([y, z]) {
                *rays = *rays & !(EVERY << first) | u64::from(lanes.bits()) << first;
            }
            store(&mut triangle_rays.begin, begin);
            store(&mut triangle_rays.misplaced, misplaced);
            store(&mut triangle_rays.carried, carried);
            store(&mut triangle_rays.rest, rest);
            store(&mut triangle_rays.begun, begun);
        }
    }
}

/// A block with the planes of its triangles, shared by the rays of a stream.
pub(super) struct BlockPlanes<'a> {
    block: Block<'a>,
    /// Normals of the planes by axis, as `plane_depth` takes them.
    normal: [[f32; WIDE]; 3],
    /// S: sum of the magnitudes that the normal's components are differences of, rounded up.
    size: [f32; WIDE],
    /// Error bound of D (T8); infinite where nothing is certain.
    det_error: [f32; WIDE],
    /// Slots that hold a triangle.
    used: u32,
}

impl BlockPlanes<'_> {
    /// Sets up the planes. `exact`: with the bounds and used slots that
    /// [`TriangleRays::may_meet`] needs; [`TriangleRays::meets`] needs neither.
    #[inline(always)]
    pub fn new(block: Block, exact: bool) -> BlockPlanes {
        let mut normal = [[0.0; WIDE]; 3];
        let [mut size, mut det_error] = [[0.0; WIDE]; 2];
        let [a, b, c] = block.columns([0, 1, 2]);
        let (n, terms) = cross_with_size(minus(a, c), minus(b, a));
        for k in 0..3 {
            n[k].store(&mut normal[k]);
        }
        let mut used = u32::MAX;
        if exact {
            // `LEAST` covers the underflow of products (T10).
            let sum = terms[0] + terms[1] + terms[2] + Register::splat(LEAST);
            sum.store(&mut size);
            let error = sum * Register::splat(DET_ERROR);
            let sane = Lanes::lt(sum, Register::splat(LARGEST));
            <Register as Lanes>::select(sane, error, Register::splat(f32::INFINITY))
                .store(&mut det_error);
            used = block.used();
        }
        BlockPlanes {
            block,
            normal,
            size,
            det_error,
            used,
        }
    }
}

#[inline(always)]
fn minus(p: [Register; 3], q: [Register; 3]) -> [Register; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

/// A block's triangles, sheared along a ray.
struct SeenBlock {
    seen: Seen<Register>,
    /// First corners relative to the origin across the main axis, not sheared.
    raw: [Register; 2],
    /// The ray's axes, the main axis last.
    axes: [usize; 3],
}

/// Depths of a block's triangles along a ray, in its sense.
struct DepthRange {
    /// Least and greatest depth of the corners.
    least: Register,
    most: Register,
    /// T and D of the planes, turned so that D ≥ 0: the ray crosses a plane at the depth T / D.
    above: Register,
    det: Register,
}

impl TriangleRays {
    /// Shears a block's triangles along a ray. Loops are unrolled by hand, since `map` of
    /// arrays is not always inlined; unused results are optimized away.
    #[inline(always)]
    fn see(&self, i: usize, block: &Block) -> SeenBlock {
        // The steps of `Shear::apply` along this ray's axis.
        let splat = |column: &Column| Register::splat(column.0[i]);
        let [y, z] = self.axis.map(|rays| (rays >> i & 1) as usize);
        let k = (y + 2 * z) % 3;
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let org = (
            splat(&self.org[a]),
            splat(&self.org[b]),
            splat(&self.org[k]),
        );
        let (shear_x, shear_y) = (splat(&self.shear[0]), splat(&self.shear[1]));
        // Sheared coordinates, then x and y as they were.
        let see = |[x, y, z]: [Register; 3]| {
            let (x, y, z) = (x - org.0, y - org.1, z - org.2);
            [shear_x.mul_add(z, x), shear_y.mul_add(z, y), z, x, y]
        };
        let [
            [ax, ay, az, raw_x, raw_y],
            [bx, by, bz, ..],
            [cx, cy, cz, ..],
        ] = match block {
            Block::Indexed(block) => {
                let vertices = [block.vertices(a), block.vertices(b), block.vertices(k)];
                let mut seen = [vertices[0]; 5];
                for i in 0..vertices[0].len() {
                    let all = see([vertices[0][i], vertices[1][i], vertices[2][i]]);
                    for (to, x) in seen.iter_mut().zip(all) {
                        to[i] = x;
                    }
                }
                let [x, y, z, raw_x, raw_y] = seen;
                let seen = |at: Entries| [at.of(x), at.of(y), at.of(z), at.of(raw_x), at.of(raw_y)];
                let [a, b, c] = block.entries();
                [seen(a), seen(b), seen(c)]
            }
            Block::Unindexed(_) => {
                let [a, b, c] = block.columns([a, b, k]);
                [see(a), see(b), see(c)]
            }
        };
        SeenBlock {
            seen: Seen {
                x: [ax, bx, cx],
                y: [ay, by, cy],
                z: [az, bz, cz],
            },
            raw: [raw_x, raw_y],
            axes: [a, b, k],
        }
    }

    /// Returns two numbers: if the first is above zero, the line certainly hits the triangle;
    /// if the second is below zero, it certainly misses (T3). NaN decides neither.
    #[inline(always)]
    fn inside_and_beside(&self, i: usize, seen: &Seen<Register>) -> [Register; 2] {
        let splat = |column: &Column| Register::splat(column.0[i]);
        // T2, as in `Seen::margin`.
        let (agreement, m) = (seen.agreement(), seen.size());
        let margin = m.mul_add(splat(&self.carried), splat(&self.rest));
        let margin = (m * m).mul_add(Register::splat(4.1 * 0.5 * f32::EPSILON), margin);
        [agreement - margin, agreement + margin]
    }

    /// `guarded`: returns the triangles that a ray may hit before its limit, and those that it
    /// certainly hits (T11).
    #[inline(always)]
    pub fn may_meet(&self, i: usize, planes: &BlockPlanes, limit: f32) -> [u32; 2] {
        let misplaced = self.misplaced.0[i];
        if misplaced == f32::INFINITY {
            return [planes.used, 0];
        }
        let splat = Register::splat;
        let sighted = self.see(i, &planes.block);
        let at = self.along(i, planes, &sighted);
        let begin = self.begin.0[i];
        let end = limit * self.shear[2].0[i].abs();
        let pad = misplaced * 4.0;
        // Rays may end at negative t.
        let [more, less] = [end * (1.0 + SLACK), end * (1.0 - SLACK)];
        let (end_late, end_early) = (more.max(less), more.min(less));
        let after = begin + begin.abs() * (2.0 * SLACK);

        // Each condition that rules a triangle out is a number below zero, so one comparison
        // serves all; NaN rules nothing out.
        let [inside, beside] = self.inside_and_beside(i, &sighted.seen);
        let ends = min(
            splat(end_late + pad) - at.least,
            at.most - splat(begin - pad),
        );
        // T − D · begin and D · end − T (T9).
        let size = Register::load(&planes.size);
        let ended = plane_error(splat(misplaced), splat(more.abs()));
        let first = splat(-begin).mul_add(at.det, at.above);
        let last = splat(end_late).mul_add(at.det, -at.above);
        let plane = min(
            size.mul_add(splat(self.begun.0[i]), first),
            size.mul_add(ended, last),
        );
        // Covers the underflow of products (T10).
        let plane = plane + splat(f32::MIN_POSITIVE);
        // The sign of D is unknown where D is below its error (T8).
        let known = Lanes::gt(at.det, Register::load(&planes.det_error));
        let plane = <Register as Lanes>::select(known, plane, Register::zero());
        let out = min(min(ends, plane), beside).lt(Register::zero());
        let within =
            Lanes::gt(at.least, splat(after + pad)) & Lanes::lt(at.most, splat(end_early - pad));
        let sure = Lanes::gt(inside, Register::zero()) & within;
        [(!out).bits() & planes.used, sure.bits() & planes.used]
    }

    /// Computes the depths of a block's triangles along a ray.
    #[inline(always)]
    fn along(&self, i: usize, planes: &BlockPlanes, sighted: &SeenBlock) -> DepthRange {
        let SeenBlock { seen, raw, axes } = sighted;
        let [az, bz, cz] = seen.z;
        let sense = Register::splat(1.0_f32.copysign(self.shear[2].0[i]));
        let depths = [az * sense, bz * sense, cz * sense];
        let normal = |axis: usize| Register::load(&planes.normal[axis]);
        let normal = [normal(axes[0]), normal(axes[1]), normal(axes[2])];
        let shear = |axis: usize| Register::splat(self.shear[axis].0[i]);
        let shear = [shear(0), shear(1)];
        let [above, det] = plane_ratio([raw[0], raw[1], az], normal, shear);
        let above = above * sense;
        DepthRange {
            least: min(min(depths[0], depths[1]), depths[2]),
            most: max(max(depths[0], depths[1]), depths[2]),
            above: <Register as Lanes>::select(det.lt(Register::zero()), -above, above),
            det: det.abs(),
        }
    }

    /// `fast`: returns the triangles that the test at one f32 lane may hit before the limit,
    /// and those that it certainly hits.
    #[inline(always)]
    pub fn meets(&self, i: usize, planes: &BlockPlanes, limit: f32) -> [u32; 2] {
        let splat = Register::splat;
        let sighted = self.see(i, &planes.block);
        // The quotients of `plane_depth` are compared as products here.
        let at = self.along(i, planes, &sighted);
        let begin = splat(self.begin.0[i]);
        let end = limit * self.shear[2].0[i].abs();
        let pad = splat(self.misplaced.0[i]) * splat(4.0);
        let (least_padded, most_padded) = (at.least - pad, at.most + pad);
        let (end_late, end_early) = (end * (1.0 + SLACK), end * (1.0 - SLACK));
        let after = begin + begin.abs() * splat(2.0 * SLACK);
        let before = Lanes::le(least_padded, splat(end_late));
        let within = Lanes::gt(least_padded, after) & Lanes::lt(most_padded, splat(end_early));
        let (inside, _) = sighted.seen.inside();
        // Triangles without area, such as those that fill up a block.
        let none = Lanes::eq(at.above, Register::zero()) | Lanes::eq(at.det, Register::zero());
        let begun = Lanes::gt(at.above, begin * at.det) | Lanes::gt(at.least, begin);
        // `fast` then clamps t to the triangle's box, which may bring it before the limit. So
        // a hit is certain only if the whole triangle lies between the ray's ends.
        let inside = inside & !none;
        [(inside & begun & before).bits(), (inside & within).bits()]
    }
}

/// Error bound of T − D · depth over S (T9): (13 · reach + 14 · |depth|) u.
#[inline(always)]
fn plane_error(misplaced: Register, depth: Register) -> Register {
    let roundings = |n: f32| Register::splat(n * 0.5 * f32::EPSILON);
    depth.mul_add(
        roundings(14.0),
        misplaced * Register::splat(13.0 / MISPLACED),
    )
}

/// Error of a sheared corner in roundings of the reach (T7).
const MISPLACED: f32 = 10.75;

/// Largest error of a corner and largest S: beyond them products may leave the format (T10).
const FARTHEST: f32 = 1e6;
const LARGEST: f32 = 1e24;

/// Added to S, so that its roundings cover the underflow of products of four numbers (T10).
const LEAST: f32 = 1e-31;

/// Relative error bound of a depth that takes four roundings (T11): 8u.
const SLACK: f32 = 4.0 * f32::EPSILON;

/// Error of D over S (T8).
const DET_ERROR: f32 = 10.75 * 0.5 * f32::EPSILON;

#[cfg(test)]
mod tests;
