//! A stream's rays in one space, and which triangles of a block each may meet.

use super::stream::each;
use crate::accel::{Block, STREAM, Slabs, StreamRays, WIDE};
use crate::geom::Ray;
use crate::geom::triangle::{Seen, cross_with_size, plane_ratio};
use crate::math::lanes::{Entries, Lanes, Mask, Register, max, min};
use crate::math::{Aabb32, Vec3};

/// Rays in one space, in f32 whatever their own precision, in columns: what only
/// sorts out.
#[derive(Default)]
pub(super) struct Bunch {
    pub boxes: StreamRays,
    pub sight: Sight,
}

/// What triangles are met with.
pub(super) struct Sight {
    org: [Column; 3],
    /// The shear of each ray, and its axis.
    shear: [Column; 3],
    axis: [u8; STREAM],
    /// t_min as a depth along the axis, in the ray's sense; rounded down.
    begin: Column,
    /// By how much a corner, seen along the ray, may be out of place.
    misplaced: Column,
}

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column([f32; STREAM]);

impl Default for Sight {
    fn default() -> Sight {
        let none = Column::default();
        Sight {
            org: [none; 3],
            shear: [none; 3],
            axis: [0; STREAM],
            begin: none,
            misplaced: none,
        }
    }
}

impl Default for Column {
    fn default() -> Column {
        Column([0.0; STREAM])
    }
}

impl Bunch {
    /// Takes in all rays. `ray`: origin, direction and t_min of a row.
    #[inline(always)]
    pub fn take_in(
        &mut self,
        set: u64,
        ray: impl Fn(usize) -> ([f64; 3], [f64; 3], f32),
        bounds: &Aabb32,
    ) {
        let mut columns = [Column::default(); 7];
        each(set, |i| {
            let (org, dir, t_min) = ray(i);
            for k in 0..3 {
                columns[k].0[i] = org[k] as f32;
                columns[3 + k].0[i] = dir[k] as f32;
            }
            columns[6].0[i] = t_min;
        });
        for first in (0..STREAM).step_by(<Register as Lanes>::COUNT) {
            if (set >> first) & ((1 << <Register as Lanes>::COUNT) - 1) == 0 {
                continue;
            }
            let load = |column: usize| Register::load(&columns[column].0[first..]);
            let org = Vec3::new(load(0), load(1), load(2));
            let dir = Vec3::new(load(3), load(4), load(5));
            let t_min = load(6);
            let ray = Ray::new(org, dir, t_min);
            self.boxes.put(first, &Slabs::new(org, dir, bounds), t_min);
            let reach = |k: usize| {
                let o = org.axis(k);
                let low = Register::splat(bounds.min[k]) - o;
                let high = Register::splat(bounds.max[k]) - o;
                max(max(low.abs(), high.abs()), o.abs())
            };
            let reach = max(max(reach(0), reach(1)), reach(2));
            // As `Seen::bounds` counts, and of a direction that is too short.
            let misplaced = reach * Register::splat(10.75 * 0.5 * f32::EPSILON);
            let misplaced = misplaced + Register::splat(f32::MIN_POSITIVE);
            let shear = &ray.shear;
            let short = Register::splat(f32::MIN_POSITIVE / (0.5 * f32::EPSILON));
            let long = Lanes::gt(shear.along.abs(), short);
            let infinite = Register::splat(f32::INFINITY);
            let misplaced = <Register as Lanes>::select(long, misplaced, infinite);
            let begin = t_min * shear.along.abs();
            let store = |column: &mut Column, x: Register| x.store(&mut column.0[first..]);
            let sight = &mut self.sight;
            for k in 0..3 {
                store(&mut sight.org[k], org.axis(k));
            }
            store(&mut sight.shear[0], shear.x);
            store(&mut sight.shear[1], shear.y);
            store(&mut sight.shear[2], shear.along);
            let lanes = shear.lanes.map(Mask::bits);
            for lane in 0..<Register as Lanes>::COUNT {
                let is = |k: usize| (lanes[k] >> lane & 1) as u8;
                sight.axis[first + lane] = is(1) | is(2) << 1;
            }
            store(
                &mut sight.begin,
                begin - begin.abs() * Register::splat(SLACK),
            );
            store(&mut sight.misplaced, misplaced);
        }
    }
}

/// A block that several rays are to meet.
pub(super) struct Faces<'a> {
    block: Block<'a>,
    /// Normals of the triangles' planes by axis, as `plane_depth` takes them.
    normal: [[f32; WIDE]; 3],
    /// Sums of the magnitudes that these are differences of.
    size: [f32; WIDE],
    /// Slots that hold a triangle.
    used: u32,
}

impl Faces<'_> {
    /// `exact`: as [`Sight::may_meet`] takes it; others need neither sizes nor
    /// which slots are used.
    #[inline(always)]
    pub fn new(block: Block, exact: bool) -> Faces {
        let (mut normal, mut size) = ([[0.0; WIDE]; 3], [0.0; WIDE]);
        let [a, b, c] = block.columns([0, 1, 2]);
        let (n, terms) = cross_with_size(minus(a, c), minus(b, a));
        for k in 0..3 {
            n[k].store(&mut normal[k]);
        }
        let mut used = u32::MAX;
        if exact {
            (terms[0] + terms[1] + terms[2]).store(&mut size);
            used = block.used();
        }
        Faces {
            block,
            normal,
            size,
            used,
        }
    }
}

#[inline(always)]
fn minus(p: [Register; 3], q: [Register; 3]) -> [Register; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

impl Sight {
    /// Triangles of the block that a ray may meet before its limit, as far as f32
    /// can tell; and of these those that it certainly meets. `exact`: if exact
    /// arithmetic is to judge that, not f32 at one lane.
    #[inline(always)]
    pub fn may_meet(&self, i: usize, faces: &Faces, exact: bool, limit: f32) -> [u32; 2] {
        // The steps of `Shear::apply`, along the one axis that this ray has.
        let splat = |column: &Column| Register::splat(column.0[i]);
        let k = usize::from(self.axis[i]) % 3;
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let org = (
            splat(&self.org[a]),
            splat(&self.org[b]),
            splat(&self.org[k]),
        );
        let (shear_x, shear_y) = (splat(&self.shear[0]), splat(&self.shear[1]));
        // Sheared; then x and y as they were.
        let see = |[x, y, z]: [Register; 3]| {
            let (x, y, z) = (x - org.0, y - org.1, z - org.2);
            [shear_x.mul_add(z, x), shear_y.mul_add(z, y), z, x, y]
        };
        let [
            [ax, ay, az, raw_x, raw_y],
            [bx, by, bz, ..],
            [cx, cy, cz, ..],
        ] = match &faces.block {
            Block::Shared(block) => {
                let vertices = [block.vertices(a), block.vertices(b), block.vertices(k)];
                let mut seen = [vertices[0]; 5];
                for i in 0..vertices[0].len() {
                    let all = see([vertices[0][i], vertices[1][i], vertices[2][i]]);
                    for (to, x) in seen.iter_mut().zip(all) {
                        to[i] = x;
                    }
                }
                // What is not used is not made. Spelled out, for arrays' own `map` is
                // not always part of what surrounds it.
                let [x, y, z, raw_x, raw_y] = seen;
                let seen = |at: Entries| [at.of(x), at.of(y), at.of(z), at.of(raw_x), at.of(raw_y)];
                let [a, b, c] = block.entries();
                [seen(a), seen(b), seen(c)]
            }
            Block::Apart(_) => {
                let [a, b, c] = faces.block.columns([a, b, k]);
                [see(a), see(b), see(c)]
            }
        };
        let seen = Seen {
            x: [ax, bx, cx],
            y: [ay, by, cy],
            z: [az, bz, cz],
        };
        let along = self.shear[2].0[i];
        let sense = Register::splat(1.0_f32.copysign(along));
        let begin = splat(&self.begin);
        let depths = [az * sense, bz * sense, cz * sense];
        let least = min(min(depths[0], depths[1]), depths[2]);
        let most = max(max(depths[0], depths[1]), depths[2]);
        let end = limit * along.abs();
        let pad = splat(&self.misplaced) * Register::splat(4.0);
        let (least_padded, most_padded) = (least - pad, most + pad);
        let (end_late, end_early) = (end * (1.0 + SLACK), end * (1.0 - SLACK));
        let after = begin + begin.abs() * Register::splat(2.0 * SLACK);
        // What `plane_depth` divides, t in its plane and the corners' least, is
        // compared as products here: depths in the ray's sense.
        let normal = |axis: usize| Register::load(&faces.normal[axis]);
        let normal = [normal(a), normal(b), normal(k)];
        let [above, det] = plane_ratio([raw_x, raw_y, az], normal, [shear_x, shear_y]);
        let above = above * sense;
        let above = <Register as Lanes>::select(det.lt(Register::zero()), -above, above);
        let det = det.abs();
        if exact {
            // Each term of T, at most reach · size in sum, is rounded nine times,
            // and those of det ten.
            let moved = splat(&self.misplaced);
            let size = Register::load(&faces.size);
            let tiny = Register::splat(f32::MIN_POSITIVE);
            let top_error = moved * size + tiny;
            let det_error = size * Register::splat(DET_ERROR) + tiny;
            // Everything that rules a triangle out is a number below zero: one
            // comparison for all. What is no number rules nothing out.
            let [beside, inside] = seen.beside_and_inside(moved);
            let first = begin * det - begin.abs() * det_error;
            let last = Register::splat(end_late) * (det + det_error);
            let plane = min(above + top_error - first, last - (above - top_error));
            // Where terms of T leave the format, its sign may be anyone's; and that of
            // det, where it is less than its error.
            let known = Lanes::gt(det, det_error) & Lanes::lt(top_error, Register::splat(1e30));
            let plane = <Register as Lanes>::select(known, plane, Register::zero());
            let ends = min(
                Register::splat(end_late) - least_padded,
                most_padded - begin,
            );
            let out = min(min(ends, plane), beside).lt(Register::zero());
            let within =
                Lanes::gt(least_padded, after) & Lanes::lt(most_padded, Register::splat(end_early));
            let sure = Lanes::gt(inside, Register::zero()) & within;
            return [(!out).bits() & faces.used, sure.bits() & faces.used];
        }
        let before = Lanes::le(least_padded, Register::splat(end_late));
        let within =
            Lanes::gt(least_padded, after) & Lanes::lt(most_padded, Register::splat(end_early));
        let (inside, _) = seen.inside();
        // Without area, as the places that fill a block up.
        let none = Lanes::eq(above, Register::zero()) | Lanes::eq(det, Register::zero());
        let begun = Lanes::gt(above, begin * det) | Lanes::gt(least, begin);
        // The hit is then moved into its triangle's box, and may come before the
        // limit: that is for the test for good, unless the whole triangle lies
        // between the ray's ends.
        let inside = inside & !none;
        [(inside & begun & before).bits(), (inside & within).bits()]
    }
}

/// More than what a depth is wrong by, relative to itself, that takes four
/// roundings.
const SLACK: f32 = 4.0 * f32::EPSILON;

/// Of det, in the magnitudes of its terms.
const DET_ERROR: f32 = 10.75 * 0.5 * f32::EPSILON;
