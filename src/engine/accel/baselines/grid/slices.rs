//! The traversal of a block by a coherent packet, slice by slice along the axis on which it
//! crosses the most cells (Wald, Ize, Kensler, Knoll, Parker: Ray tracing animated scenes
//! using coherent grid traversal, 2006).
//!
//! Four planes bound the lanes on the two other axes. Between the block's first and last plane
//! a lane's coordinate is linear, so the least of all lanes is concave and lies above the line
//! between its ends; likewise for the greatest. So the rectangle of cells of a slice comes
//! from two interpolations per axis. Theirs are added up from slice to slice; here each is
//! computed anew, and widened by twice the slabs' pads, which has room for its roundings. The
//! padded intervals of the rectangle's cells that have entries are tested for all lanes; a
//! cell that no lane is in costs no primitive test.

use super::{Content, Walk};
use crate::math::lanes::{Lanes, Mask, Scalar};

/// The volume of a packet in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct PacketVolume {
    /// The axis of the slices, and the two others.
    axes: [usize; 3],
    /// Whether the rays pass the slices in descending order.
    backward: bool,
    /// The first and the last slice, in ascending order of cells.
    slices: (usize, usize),
    /// For each of the two other axes, in cells and widened: the least and the greatest
    /// coordinate of any lane at the block's lower plane, each with its change across the
    /// block. Cells from `floor(least)` to `floor(greatest)` are reached.
    sides: [[(f64, f64); 2]; 2],
}

/// The most cells per slice and lane for which a packet goes by slices.
const WIDEST: f64 = 1.0;

impl<L: Lanes> Walk<'_, '_, L> {
    /// Returns the volume of a packet; `None` if the lanes are better walked one by one,
    /// because their directions differ in sign, they are spread over too many cells, or the
    /// bounds overflow.
    #[inline(always)]
    pub(super) fn volume(
        &self,
        block: usize,
        inside: L::Mask,
        enter: L,
        exit: L,
    ) -> Option<PacketVolume> {
        let of = &self.grid.blocks[block];
        let bits = inside.bits();
        if bits.count_ones() < 2 {
            return None;
        }
        let constants = self.slabs.planes();
        // The speed of the first lane, in cells, chooses the axis.
        let one = bits.trailing_zeros() as usize;
        let pace: [f64; 3] =
            std::array::from_fn(|k| of.scale[k] / constants[k].0.lane(one).to_f64().abs());
        let k = if pace[0] >= pace[1] && pace[0] >= pace[2] {
            0
        } else if pace[1] >= pace[2] {
            1
        } else {
            2
        };
        let axes = [k, (k + 1) % 3, (k + 2) % 3];
        let (inv, low, high) = constants[k];
        let falling = (inv.lt(L::zero()) & inside).bits();
        if falling != 0 && falling != bits {
            return None;
        }
        let half = L::from_f32(0.5);
        let one = L::from_f32(1.0);
        let infinity = L::splat(L::Scalar::INFINITY);
        let least = |x: L| L::select(inside, x, infinity).least().to_f64();
        let greatest = |x: L| L::select(inside, x, -infinity).greatest().to_f64();

        // A lane's coordinate at t is (t − middle)·dir, and its pad is δ.
        let dir = one / inv;
        let middle = (low + high) * half;
        let pad = ((high - low) * half * dir).abs();
        let in_cells = |k: usize, x: f64| (x - of.min[k]) * of.scale[k];
        let last = exit.min(self.limit);
        let (from, to) = ((enter - middle) * dir, (last - middle) * dir);
        let slack = 2.0 * greatest(pad) * of.scale[k] + of.wobble[k];
        let lower = in_cells(k, least(from.min(to))) - slack;
        let upper = in_cells(k, greatest(from.max(to))) + slack;
        let end = of.res[k] as usize - 1;
        // An unlimited ray leaves at the end; with NaN the whole block is taken.
        let first_slice = if lower >= 0.0 {
            (lower as usize).min(end)
        } else {
            0
        };
        let last_slice = if upper < end as f64 {
            upper.max(0.0) as usize
        } else {
            end
        };

        let planes = self.grid.planes(of, k);
        let (start, stop) = (L::from_f32(planes[0]), L::from_f32(planes[end + 1]));
        let (start, stop) = (start.mul_add(inv, middle), stop.mul_add(inv, middle));
        let mut sides = [[(0.0, 0.0); 2]; 2];
        let mut area = [1.0, 1.0];
        for (side, a) in sides.iter_mut().zip([axes[1], axes[2]]) {
            if of.res[a] == 1 {
                continue;
            }
            let (inv_a, low_a, high_a) = constants[a];
            let dir_a = one / inv_a;
            let middle_a = (low_a + high_a) * half;
            let pad_a = ((high_a - low_a) * half * dir_a).abs();
            let slope = (inv * dir_a).abs();
            let slack = 2.0 * greatest(pad_a + slope * pad) * of.scale[a] + of.wobble[a];
            let (u, v) = ((start - middle_a) * dir_a, (stop - middle_a) * dir_a);
            let lower = [least(u), least(v)].map(|x| in_cells(a, x) - slack);
            let upper = [greatest(u), greatest(v)].map(|x| in_cells(a, x) + slack);
            *side = [
                (lower[0], lower[1] - lower[0]),
                (upper[0], upper[1] - upper[0]),
            ];
            // The width in cells at the first and at the last slice.
            for (area, slice) in area.iter_mut().zip([first_slice, last_slice]) {
                let at = (slice as f64 + 0.5) / (end + 1) as f64;
                let width = side[1].0 + side[1].1 * at - (side[0].0 + side[0].1 * at);
                *area *= 1.0 + width + side[0].1.abs() / (end + 1) as f64;
            }
        }
        let spread = area[0] + area[1];
        if spread.is_nan() || spread > 2.0 * WIDEST * f64::from(bits.count_ones()) {
            return None;
        }
        Some(PacketVolume {
            axes,
            backward: falling != 0,
            slices: (first_slice, last_slice),
            sides,
        })
    }

    /// Walks a packet through the slices of its volume; `enter..=exit` are the lanes'
    /// intervals in the block.
    pub(super) fn slices(&mut self, block: usize, volume: &PacketVolume, enter: L, exit: L) {
        let grid = self.grid;
        let of = &grid.blocks[block];
        let PacketVolume { axes, slices, .. } = *volume;
        let [k, a, b] = axes;
        let (inv, low, high) = self.slabs.planes()[k];
        let planes = grid.planes(of, k);
        let across = 1.0 / f64::from(of.res[k]);
        for step in slices.0..=slices.1 {
            let slice = if volume.backward {
                slices.1 - (step - slices.0)
            } else {
                step
            };
            let t0 = L::from_f32(planes[slice]).mul_add(inv, low);
            let t1 = L::from_f32(planes[slice + 1]).mul_add(inv, high);
            let (first, last) = (t0.min(t1).max(enter), t0.max(t1).min(exit));
            if first.le(exit.min(self.limit)).none() {
                return;
            }
            if first.le(last.min(self.limit)).none() {
                continue;
            }
            // Planes lie off their places by at most `wobble`.
            let ends = [
                ((slice as f64 - of.wobble[k]) * across).max(0.0),
                (((slice + 1) as f64 + of.wobble[k]) * across).min(1.0),
            ];
            let range = |side: &[(f64, f64); 2], axis: usize| {
                let [(low, low_change), (high, high_change)] = *side;
                let lows = ends.map(|at| low + low_change * at);
                let highs = ends.map(|at| high + high_change * at);
                let low = if lows[0] < lows[1] { lows[0] } else { lows[1] };
                let high = if highs[0] > highs[1] {
                    highs[0]
                } else {
                    highs[1]
                };
                // The casts saturate; outside the block there are no cells.
                let end = of.res[axis] as i64 - 1;
                let (low, high) = (low.floor() as i64, high.floor() as i64);
                (low.max(0), high.min(end))
            };
            let (a_range, b_range) = (range(&volume.sides[0], a), range(&volume.sides[1], b));
            for bi in b_range.0..=b_range.1 {
                for ai in a_range.0..=a_range.1 {
                    let mut at = [0; 3];
                    at[k] = slice;
                    at[a] = ai as usize;
                    at[b] = bi as usize;
                    self.slice_cell(block, at, first, last);
                }
            }
        }
    }

    /// Visits one cell of a slice; `first..=last` are the lanes' intervals in the slice.
    #[inline(always)]
    fn slice_cell(&mut self, block: usize, at: [usize; 3], first: L, last: L) {
        let grid = self.grid;
        let of = &grid.blocks[block];
        let content = grid.content(of.cell(at));
        if !self.counter.is_on() && matches!(content, Content::Nothing) {
            return;
        }
        let (min, max) = grid.cell_box(of, at);
        let (enter, exit) = self.slabs.interval(min, max);
        let (enter, exit) = (enter.max(first), exit.min(last));
        let inside = enter.le(exit.min(self.limit));
        self.counter.node(inside);
        if inside.none() {
            return;
        }
        match content {
            Content::Nothing => {}
            Content::List(from, to) => {
                self.counter.leaf(inside);
                self.list(from, to);
            }
            Content::Block(inner) => {
                let enter = L::select(inside, enter, L::splat(L::Scalar::INFINITY));
                // The exit of lanes outside is −∞, so that they stay outside although their limit
                // may be ∞.
                let exit = L::select(inside, exit, -L::splat(L::Scalar::INFINITY));
                self.block(inner, enter, exit);
            }
        }
    }
}
