//! One operand along the rays of a packet.

use crate::geom::guarded::Ends;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// An operand's boundaries beyond the rays' start.
#[derive(Clone, Copy)]
pub(super) struct Track<L: Lanes> {
    /// At least, as computed, at most; infinite where none is left.
    pub next: [L; 3],
    /// Where it is left, of rays that `next` says come in.
    pub exit: [L; 3],
    /// Rays inside, a bit each.
    pub inside: u32,
    /// Of an operand that rays may come into many times, the rows of what follows
    /// `exit`: from, to.
    pub more: [usize; 2],
}

impl<L: Lanes> Track<L> {
    /// Brings a span to the rays' start: `own` says on which side of it ends lie, `wide`
    /// what they are one with. Returns the lanes for which that is not certain.
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

    /// The next of the boundaries that follow take their places, in some lanes.
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

/// Lanes that start certainly beyond a span, and that start within.
#[inline(always)]
fn behind<L: Lanes>(own: &Ends<L>, wide: &Ends<L>, t_min: L) -> [L::Mask; 2] {
    let gone = wide.some & own.exit[2].le(t_min);
    [gone, wide.some & !gone & own.enter[2].le(t_min)]
}

/// No end of a span that certainly lies before the rays' start is one with what lies
/// beyond this.
#[inline(always)]
pub(super) fn last_behind<L: Lanes>(own: &Ends<L>, wide: &Ends<L>, t_min: L) -> L {
    let [gone, inside] = behind(own, wide, t_min);
    let entered = L::select(inside, wide.enter[2], -L::splat(L::Scalar::INFINITY));
    L::select(gone, wide.exit[2], entered)
}
