//! The traversal of a block by one lane: a three-dimensional digital differential analyser
//! (Amanatides and Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, 1987) that tolerates
//! rounding.
//!
//! Theirs visits one cell at a time, and at a corner rounding decides which. Here each axis
//! has a front, the last cell entered, and a back, the first cell not yet left, both by padded
//! planes; they differ where the ray is within the pad of a plane. When the front of an axis
//! enters a cell, that cell is visited together with all cells from back to front on the other
//! axes. So a cell is visited when the last of its axes enters it, if the others have not left
//! it: once, and if and only if its padded interval is not empty. Away from planes that is one
//! cell a step.

use super::{Content, Walk};
use crate::math::lanes::{Lanes, Mask, Scalar};

/// The slab constants (inv, low, high) of one lane and axis, as of
/// [`Slabs::axis`](crate::accel::Slabs::axis).
pub(super) type Axis<S> = (S, S, S);

/// The state of a lane along one axis of a block. Cells are counted in the ray's direction.
#[derive(Clone, Copy)]
struct Track<'g, S> {
    planes: &'g [f32],
    inv: S,
    /// The constant of planes through which cells are entered.
    near: S,
    /// The constant of planes through which cells are left.
    far: S,
    backward: bool,
    front: usize,
    back: usize,
    /// The t at which the front enters its next cell; ∞ if there is none.
    next: S,
    /// The t at which the back leaves its cell.
    leave: S,
}

impl<'g, S: Scalar> Track<'g, S> {
    /// Makes the state at `t`, which lies between the first entry and the last exit. `guess`
    /// returns about the cell of a coordinate.
    #[inline(always)]
    fn new(
        planes: &'g [f32],
        (inv, low, high): Axis<S>,
        t: S,
        guess: impl Fn(f64) -> usize,
    ) -> Track<'g, S> {
        let backward = inv < S::from_f32(0.0);
        let (near, far) = if backward { (high, low) } else { (low, high) };
        let mut track = Track {
            planes,
            inv,
            near,
            far,
            backward,
            front: 0,
            back: 0,
            next: S::INFINITY,
            leave: S::INFINITY,
        };
        let last = planes.len() - 2;
        if last > 0 {
            let middle = (near.to_f64() + far.to_f64()) * 0.5;
            let cell = guess((t.to_f64() - middle) / inv.to_f64()).min(last);
            track.front = if backward { last - cell } else { cell };
            while track.front > 0 && track.enter(track.front) > t {
                track.front -= 1;
            }
            while track.front < last && track.enter(track.front + 1) <= t {
                track.front += 1;
            }
            track.back = track.front;
            while track.back > 0 && track.exit(track.back - 1) >= t {
                track.back -= 1;
            }
            track.next = track.after_front();
        }
        track.leave = track.exit(track.back);
        track
    }

    /// Returns the i-th plane along the ray.
    #[inline(always)]
    fn plane(&self, i: usize) -> S {
        let at = if self.backward {
            self.planes.len() - 1 - i
        } else {
            i
        };
        S::from_f32(self.planes[at])
    }

    /// Returns the t at which the ray enters the i-th cell.
    #[inline(always)]
    fn enter(&self, i: usize) -> S {
        self.plane(i).scalar_mul_add(self.inv, self.near)
    }

    /// Returns the t at which the ray leaves the i-th cell.
    #[inline(always)]
    fn exit(&self, i: usize) -> S {
        self.plane(i + 1).scalar_mul_add(self.inv, self.far)
    }

    /// Returns the t at which the ray enters the cell behind the front; ∞ if there is none.
    #[inline(always)]
    fn after_front(&self) -> S {
        if self.front + 2 < self.planes.len() {
            self.enter(self.front + 1)
        } else {
            S::INFINITY
        }
    }

    /// Moves the front to its next cell.
    #[inline(always)]
    fn advance(&mut self) {
        self.front += 1;
        self.next = self.after_front();
    }

    /// Moves the back past the cells that the ray leaves before `t`.
    #[inline(always)]
    fn leave_before(&mut self, t: S) {
        while self.leave < t && self.back < self.front {
            self.back += 1;
            self.leave = self.exit(self.back);
        }
    }

    /// Returns the cell's number in the block.
    #[inline(always)]
    fn cell(&self, i: usize) -> usize {
        if self.backward {
            self.planes.len() - 2 - i
        } else {
            i
        }
    }
}

impl<L: Lanes> Walk<'_, '_, L> {
    /// Walks one lane through a block; `enter..=exit` is its interval inside it.
    pub(super) fn march(
        &mut self,
        block: usize,
        lane: usize,
        axes: &[Axis<L::Scalar>; 3],
        enter: L::Scalar,
        exit: L::Scalar,
    ) {
        let grid = self.grid;
        let of = &grid.blocks[block];
        let mut tracks: [Track<L::Scalar>; 3] = std::array::from_fn(|k| {
            Track::new(grid.planes(of, k), axes[k], enter, |at| {
                ((at - of.min[k]) * of.scale[k]) as usize
            })
        });
        self.visit(block, lane, axes, &tracks, enter);
        loop {
            let [x, y, z] = [tracks[0].next, tracks[1].next, tracks[2].next];
            let (k, a, b) = if x < y {
                if x < z { (0, 1, 2) } else { (2, 0, 1) }
            } else if y < z {
                (1, 0, 2)
            } else {
                (2, 0, 1)
            };
            let t = tracks[k].next;
            // The walk also ends where t is NaN or ∞.
            if !(t <= exit && t <= self.limit.lane(lane)) || t == L::Scalar::INFINITY {
                return;
            }
            tracks[k].advance();
            tracks[a].leave_before(t);
            tracks[b].leave_before(t);
            let mut step = tracks;
            step[k].back = step[k].front;
            self.visit(block, lane, axes, &step, enter);
        }
    }

    /// Visits the cells from back to front on every axis.
    #[inline(always)]
    fn visit(
        &mut self,
        block: usize,
        lane: usize,
        axes: &[Axis<L::Scalar>; 3],
        tracks: &[Track<L::Scalar>; 3],
        enter: L::Scalar,
    ) {
        let [x, y, z] = tracks;
        for k in z.back..=z.front {
            for j in y.back..=y.front {
                for i in x.back..=x.front {
                    let at = [x.cell(i), y.cell(j), z.cell(k)];
                    self.visit_cell(block, lane, axes, at, enter);
                }
            }
        }
    }

    #[inline(always)]
    fn visit_cell(
        &mut self,
        block: usize,
        lane: usize,
        axes: &[Axis<L::Scalar>; 3],
        at: [usize; 3],
        enter: L::Scalar,
    ) {
        let grid = self.grid;
        let of = &grid.blocks[block];
        self.counter.node(L::Mask::from_bits(1 << lane));
        match grid.content(of.cell(at)) {
            Content::Nothing => {}
            Content::List(from, to) => {
                self.counter.leaf(L::Mask::from_bits(1 << lane));
                self.list(from, to);
            }
            Content::Block(inner) => {
                let (min, max) = grid.cell_box(of, at);
                let (mut first, mut last) = (enter, L::Scalar::INFINITY);
                for k in 0..3 {
                    let (inv, low, high) = axes[k];
                    let t0 = L::Scalar::from_f32(min[k]).scalar_mul_add(inv, low);
                    let t1 = L::Scalar::from_f32(max[k]).scalar_mul_add(inv, high);
                    let (t0, t1) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
                    first = if t0 > first { t0 } else { first };
                    last = if t1 < last { t1 } else { last };
                }
                if first <= last && first <= self.limit.lane(lane) {
                    self.march(inner, lane, axes, first, last);
                }
            }
        }
    }
}
