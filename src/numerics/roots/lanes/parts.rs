//! Intervals of one polynomial per lane, and their subdivision.

use crate::math::lanes::{Lanes, Mask, Scalar};

/// Number of nested cuts after which a lane is in doubt.
const DEPTH: u32 = 40;

/// Error bound of an interval's ends in t: two roundings per cut. Lemma Z6,
/// docs/numerics/roots.md.
pub(super) const SLACK: f64 = 2.0 * DEPTH as f64 * f64::EPSILON;

/// A stack of intervals of any degree. Callers keep one per thread, so that nothing
/// allocates.
#[derive(Clone, Debug)]
pub struct Waiting<L: Lanes> {
    /// Per interval N coefficients, then `error`, `first`, `low` and `high`.
    values: Vec<L>,
    /// Per interval its lanes and its depth.
    marks: Vec<(L::Mask, u32)>,
}

impl<L: Lanes> Default for Waiting<L> {
    fn default() -> Self {
        Waiting {
            values: Vec::new(),
            marks: Vec::new(),
        }
    }
}

impl<L: Lanes> Waiting<L> {
    pub(super) fn clear(&mut self) {
        self.values.clear();
        self.marks.clear();
    }

    /// Pushes an interval and returns its values on the stack.
    #[inline(always)]
    fn push<const N: usize>(&mut self, part: &Part<L, N>) -> &mut [L] {
        let at = self.values.len();
        self.values.extend_from_slice(&part.b);
        let rest = [part.error, part.first, part.low, part.high];
        self.values.extend_from_slice(&rest);
        self.marks.push((part.lanes, part.depth));
        &mut self.values[at..at + N + 4]
    }

    #[inline(always)]
    pub(super) fn pop<const N: usize>(&mut self) -> Option<Part<L, N>> {
        let (lanes, depth) = self.marks.pop()?;
        let at = self.values.len() - (N + 4);
        let values = &self.values[at..];
        let part = Part {
            b: std::array::from_fn(|j| values[j]),
            error: values[N],
            first: values[N + 1],
            low: values[N + 2],
            high: values[N + 3],
            lanes,
            depth,
        };
        self.values.truncate(at);
        Some(part)
    }
}

/// An interval of each lane with its Bernstein coefficients and their error bounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<L: Lanes, const N: usize> {
    pub b: [L; N],
    pub error: L,
    /// Error bound of `b[0]`.
    pub first: L,
    pub low: L,
    pub high: L,
    pub lanes: L::Mask,
    pub depth: u32,
}

/// Returns the largest coefficient in magnitude.
#[inline(always)]
pub(super) fn largest<L: Lanes, const N: usize>(b: &[L; N]) -> L {
    b[1..].iter().fold(b[0].abs(), |m, b| m.max(b.abs()))
}

/// Lanes in which all signs are certain, in which there is a sign change, and in which
/// there are several.
pub(super) struct Changes<L: Lanes> {
    pub certain: L::Mask,
    pub some: L::Mask,
    pub several: L::Mask,
}

impl<L: Lanes<Scalar = f64>, const N: usize> Part<L, N> {
    /// Counts sign changes beyond the error bounds. Lemma Z7, docs/numerics/roots.md.
    #[inline(always)]
    pub(super) fn changes(&self) -> Changes<L> {
        let (error, negative) = (self.error, -self.error);
        let mut above = self.b[0].gt(self.first);
        let mut below = self.b[0].lt(-self.first);
        let mut certain = above | below;
        let (mut some, mut several) = (L::Mask::splat(false), L::Mask::splat(false));
        for b in &self.b[1..] {
            let (next_above, next_below) = (b.gt(error), b.lt(negative));
            let change = (above & next_below) | (below & next_above);
            several = several | (some & change);
            some = some | change;
            certain = certain & (next_above | next_below);
            (above, below) = (next_above, next_below);
        }
        Changes {
            certain,
            some,
            several,
        }
    }

    /// Returns the first and second zero crossing of the control polygon, relative to the
    /// interval's width; 1 for a crossing that does not exist.
    #[inline(always)]
    pub(super) fn crossings(&self) -> (L, L) {
        let zero = L::zero();
        let (mut first, mut second) = (L::from_f64(1.0), L::from_f64(1.0));
        let (mut is_first, mut is_second) = (L::Mask::splat(true), L::Mask::splat(false));
        let width = 1.0 / (N as f64 - 1.0);
        let mut before = self.b[0];
        for (j, b) in self.b.iter().enumerate().skip(1) {
            let change = (before.lt(zero) & b.ge(zero)) | (before.ge(zero) & b.lt(zero));
            let at = (before / (before - *b) + L::from_f64(j as f64 - 1.0)) * L::from_f64(width);
            first = L::select(is_first & change, at, first);
            second = L::select(is_second & change, at, second);
            is_second = (is_second & !change) | (is_first & change);
            is_first = is_first & !change;
            before = *b;
        }
        (first, second)
    }

    /// Cuts at a place in (0, 1) of the width: this becomes the left part, and the right
    /// part waits. Each of n rows adds at most 5u of the largest coefficient. Lemma Z6,
    /// docs/numerics/roots.md.
    #[inline(always)]
    pub(super) fn cut(&mut self, at: L, lanes: L::Mask, waiting: &mut Waiting<L>) {
        // Lemma Z6, docs/numerics/roots.md.
        let rounding = 5.01 * (N as f64 - 1.0) * f64::UNIT_ROUNDOFF;
        self.error = self.error + L::from_f64(rounding) * largest(&self.b);
        let middle = self.low + (self.high - self.low) * at;
        (self.lanes, self.depth) = (lanes, self.depth + 1);
        let right = waiting.push(self);
        for m in (1..N).rev() {
            for j in 0..m {
                let b = right[j];
                right[j] = b + at * (right[j + 1] - b);
            }
            self.b[N - m] = right[0];
        }
        // The bound of b[0] holds only at the old lower end, which the left part keeps.
        (right[N + 1], right[N + 2]) = (self.error, middle);
        self.high = middle;
    }

    /// Returns a place for a cut before which one root is expected.
    #[inline(always)]
    pub(super) fn place(&self) -> L {
        let (first, second) = self.crossings();
        let middle = L::from_f64(0.5) * (first + second);
        middle.max(L::from_f64(0.0625)).min(L::from_f64(0.9375))
    }

    /// Lanes in which further cuts settle nothing: the depth is exhausted, or all
    /// coefficients are within four error bounds.
    #[inline(always)]
    pub(super) fn hopeless(&self) -> L::Mask {
        if self.depth >= DEPTH {
            return L::Mask::splat(true);
        }
        largest(&self.b).le(L::from_f64(4.0) * self.error)
    }
}
