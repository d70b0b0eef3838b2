//! The state of one operand along a packet's rays.

use crate::geom::guarded::Ends;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// An operand's next boundaries, a ray per lane.
#[derive(Clone, Copy)]
pub(super) struct Track<L: Lanes> {
    /// Next boundary as (least, computed, greatest) t; infinite where none is left.
    pub next: [L; 3],
    /// Boundary after `next`: the exit of rays that enter there.
    pub exit: [L; 3],
    /// Rays inside, a bit each.
    pub inside: u32,
    /// For operands that rays may enter several times: range of the rows that follow `exit`.
    pub more: [usize; 2],
}

impl<L: Lanes> Track<L> {
    /// Starts the walk of a span at the rays' start. `own` decides on which side of the start
    /// an end lies, `wide` includes the slack of events (K8). Returns the undecided lanes.
    #[inline(always)]
    pub fn start(&mut self, own: &Ends<L>, wide: &Ends<L>, t_min: L) -> u32 {
        let Ends {
            enter,
            exit,
            some,
            none,
            turned,
            ..
        } = wide;
        let [gone, inside] = behind(own, wide, t_min);
        let ahead = *some & enter[0].gt(t_min);
        let certain = *none | gone | ahead | inside & exit[0].gt(t_min);
        let infinity = L::splat(L::Scalar::INFINITY);
        for k in 0..3 {
            let next = L::select(ahead, enter[k], infinity);
            self.next[k] = L::select(inside, exit[k], next);
            self.exit[k] = L::select(ahead, exit[k], infinity);
        }
        self.inside = inside.bits() ^ turned.bits();
        (!certain).bits()
    }

    /// Moves the following boundaries up by one row, in some lanes.
    #[inline(always)]
    pub fn follow(&mut self, lanes: L::Mask, rows: &mut [[L; 3]]) {
        let mut before = &mut self.exit;
        for row in rows {
            for (to, from) in before.iter_mut().zip(&*row) {
                *to = L::select(lanes, *from, *to);
            }
            before = row;
        }
        let infinity = L::splat(L::Scalar::INFINITY);
        for to in before {
            *to = L::select(lanes, infinity, *to);
        }
    }

    /// Crosses the next boundary in some lanes.
    #[inline(always)]
    pub fn flip(&mut self, rays: u32, infinity: L) {
        let lanes = L::Mask::from_bits(rays);
        for k in 0..3 {
            self.next[k] = L::select(lanes, self.exit[k], self.next[k]);
            self.exit[k] = L::select(lanes, infinity, self.exit[k]);
        }
        self.inside ^= rays;
    }
}

/// Returns the lanes whose start lies certainly beyond a span, and those within it.
#[inline(always)]
fn behind<L: Lanes>(own: &Ends<L>, wide: &Ends<L>, t_min: L) -> [L::Mask; 2] {
    let gone = wide.some & own.exit[2].le(t_min);
    [gone, wide.some & !gone & own.enter[2].le(t_min)]
}

/// Greatest t up to which an end before the rays' start may be one event with a boundary
/// beyond it (K8).
#[inline(always)]
pub(super) fn last_behind<L: Lanes>(own: &Ends<L>, wide: &Ends<L>, t_min: L) -> L {
    let [gone, inside] = behind(own, wide, t_min);
    let entered = L::select(inside, wide.enter[2], -L::splat(L::Scalar::INFINITY));
    L::select(gone, wide.exit[2], entered)
}
