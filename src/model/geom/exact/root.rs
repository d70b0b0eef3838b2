//! Crossings of a line and a surface: roots of f(t) = a t² + 2b t + c, and their exact order
//! without square roots (D14, docs/numerics/exact.md).
//!
//! At a root α f rises or falls (with a ≥ 0 at the upper or the lower one), so the order of α and
//! a fraction x follows from the signs of f and its slope at x. A linear function m t + n has at α
//! the sign of m or its opposite, depending on the order of α and −n/m. The order of α and the
//! root β of a second polynomial g follows from the signs of g and its slope *at α*: the slope is
//! linear, and at α a₁ g equals a₁ g − a₂ f, which is linear, too. Equal, common and double roots
//! and equal polynomials need no cases of their own.

use super::axis_plane::AxisPlane;
use super::plane::Through;
use super::rounding::rounded;
use super::surface::Surface;
use super::{Line, plane};
use crate::geom::guarded::implicit::nearest;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::math::bounds::ErrorBounded;
use crate::math::double_double::DoubleDouble;
use crate::math::dyadic::{Dyadic, exactly};
use crate::math::int::decoded;
use crate::math::{ExactSign, Number};
use glam::DVec3;
use std::cell::OnceCell;
use std::cmp::Ordering;

/// The root of a polynomial that is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::geom) enum Branch {
    Lower,
    /// The upper root, or the only one.
    Upper,
    /// The root with so many distinct ones before it, of a surface of any degree.
    Nth(u8),
    /// The only root within the error bound of `t` and a little beyond, of such a surface.
    Only,
}

/// A crossing of a line and a surface.
#[derive(Clone, Copy, Debug)]
pub struct Root<'a> {
    line: Line,
    surface: Surface<'a>,
    branch: Branch,
    /// t in f64 with its error bound.
    pub t: ErrorBounded,
}

impl<'a> Root<'a> {
    #[inline(always)]
    pub(in crate::geom) fn new(
        line: &Line,
        surface: Surface<'a>,
        branch: Branch,
        t: ErrorBounded,
    ) -> Root<'a> {
        Root {
            line: *line,
            surface,
            branch,
            t,
        }
    }

    fn is_of_any_degree(&self) -> bool {
        matches!(self.surface, Surface::Implicit(_))
    }

    /// Returns the outward normal, of any length, of the crossed surface near the line's point at
    /// `t`. At an edge of a solid it is that of the face whose crossing this is.
    pub fn normal_at(&self, t: f64) -> DVec3 {
        self.surface.normal_near(&self.line, t)
    }

    /// Returns a number of the smooth face that is crossed. Roots of one face of one solid
    /// have equal numbers.
    pub fn face_number(&self) -> u64 {
        self.surface.number()
    }

    /// Orders by t, exactly.
    #[inline]
    pub fn order(&self, other: &Root) -> Ordering {
        let certain = self.t.order(&other.t);
        certain.unwrap_or_else(|| self.order_exact(other))
    }

    /// Orders t and a number, exactly. Infinity and NaN are above all t.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        let certain = self.t.order(&ErrorBounded::exact(x));
        certain.unwrap_or_else(|| self.order_with_exact(x))
    }

    /// Returns the f64 nearest to t, ties to even, so that equal t have equal bits (D12 and D18,
    /// docs/numerics/exact.md).
    pub fn rounded(&self) -> f64 {
        match self.branch {
            Branch::Nth(_) => return self.t.value,
            Branch::Only => {
                let near = self.certainly_nearest();
                return near.unwrap_or_else(|| algebraic::rounded(self));
            }
            Branch::Lower | Branch::Upper => {}
        }
        // The fixed-size integers of triangles are faster.
        if let Surface::Facet(corners) = self.surface {
            let Line { org, dir } = self.line;
            let pair = Pair { org, dir, corners };
            if let Some(crossing) = meet_exact(&pair) {
                return crossing.rounded();
            }
        }
        let t = self.of_plane().and_then(|plane| plane::rounded(&plane));
        t.unwrap_or_else(|| self.rounded_exactly())
    }

    /// Rounds by double-double arithmetic, and by exact numbers for each comparison that it leaves
    /// undecided.
    #[cold]
    #[inline(never)]
    fn rounded_exactly(&self) -> f64 {
        let twice = NormalizedQuadratic::<DoubleDouble>::new((), self);
        let guess = twice.as_ref().map_or(f64::NAN, |f| f.guess(self.t.value));
        exactly(&|space| {
            let exact: OnceCell<Option<NormalizedQuadratic<Dyadic>>> = OnceCell::new();
            let order = |m, power, negative| {
                let order = twice.as_ref();
                let order = order.and_then(|f| f.order_of_scaled(m, power, negative));
                order.or_else(|| {
                    let exact = exact.get_or_init(|| NormalizedQuadratic::new(space, self));
                    exact.as_ref()?.order_of_scaled(m, power, negative)
                })
            };
            rounded(&order, &self.t, guess)
        })
    }

    fn of_plane(&self) -> Option<Through<'_>> {
        let Surface::PlaneThrough { normal, point } = &self.surface else {
            return None;
        };
        let line = &self.line;
        Some(Through {
            normal,
            point,
            line,
        })
    }

    /// Returns the f64 nearest to a polynomial surface's only root near t, if values in
    /// double-double are certain of it (D18, docs/numerics/exact.md).
    fn certainly_nearest(&self) -> Option<f64> {
        let Surface::Implicit(tape) = self.surface else {
            return None;
        };
        let ErrorBounded { value, error } = self.t;
        let ends = [value - error, value, value + error];
        nearest(tape, (self.line.org, self.line.dir), ends)
    }

    #[cold]
    #[inline(never)]
    fn order_exact(&self, other: &Root) -> Ordering {
        let same_branch = self.branch == other.branch
            && (self.branch != Branch::Only || self.t.value == other.t.value);
        if self.line == other.line {
            if self.surface == other.surface && same_branch {
                return Ordering::Equal;
            }
            if let (Some(a), Some(b)) = (
                AxisPlane::new(&self.surface),
                AxisPlane::new(&other.surface),
            ) && let Some(order) = a.order(&b, &self.line)
            {
                return order;
            }
        }
        if self.is_of_any_degree() || other.is_of_any_degree() {
            return algebraic::order(self, other);
        }
        if let (Some(a), Some(b)) = (self.of_plane(), other.of_plane())
            && let Some(order) = plane::order(&a, &b)
        {
            return order;
        }
        fn order<N: ExactSign>(space: N::Space, a: &Root, b: &Root) -> Option<Ordering> {
            NormalizedQuadratic::<N>::new(space, a)?.order(&NormalizedQuadratic::new(space, b)?)
        }
        order::<DoubleDouble>((), self, other)
            .unwrap_or_else(|| exactly(&|space| order::<Dyadic>(space, self, other)))
    }

    #[cold]
    #[inline(never)]
    fn order_with_exact(&self, x: f64) -> Ordering {
        if !x.is_finite() {
            return if x == f64::NEG_INFINITY {
                Ordering::Greater
            } else {
                Ordering::Less
            };
        }
        if self.is_of_any_degree() {
            return algebraic::order_with(self, x);
        }
        let by_plane = self.of_plane().and_then(|a| plane::order_with(&a, x));
        by_plane.unwrap_or_else(|| {
            fn order<N: ExactSign>(space: N::Space, x: f64, root: &Root) -> Option<Ordering> {
                NormalizedQuadratic::<N>::new(space, root)?.order_of_number(x)
            }
            order::<DoubleDouble>((), x, self)
                .unwrap_or_else(|| exactly(&|space| order::<Dyadic>(space, x, self)))
                .reverse()
        })
    }

    /// Returns the exact sign that a polynomial has at this crossing of a plane.
    #[cold]
    #[inline(never)]
    pub(in crate::geom) fn sign_of(&self, surface: &Surface) -> Ordering {
        fn sign<N: ExactSign>(space: N::Space, root: &Root, surface: &Surface) -> Option<Ordering> {
            let f = surface.on_line_exactly(space, &root.line);
            NormalizedQuadratic::<N>::new(space, root)?.sign_of(&f)
        }
        sign::<DoubleDouble>((), self, surface)
            .unwrap_or_else(|| exactly(&|space| sign::<Dyadic>(space, self, surface)))
    }
}

/// Comparisons of roots of which at least one belongs to a polynomial of any degree (D17,
/// docs/numerics/exact.md).
mod algebraic {
    use super::super::restriction::restrict;
    use super::{Branch, Root};
    use crate::roots::{RealRoots, real_roots};
    use std::cmp::Ordering;

    /// Returns all roots of a root's polynomial, and the number of the root among them.
    fn roots(of: &Root) -> Option<(RealRoots, usize)> {
        let roots = real_roots(&restrict(&of.surface, &of.line))?;
        let last = roots.len().checked_sub(1)?;
        let i = match of.branch {
            Branch::Lower => 0,
            Branch::Upper => last,
            Branch::Nth(i) => last.min(usize::from(i)),
            Branch::Only => {
                let low = (of.t.value - of.t.error).next_down();
                let high = (of.t.value + of.t.error).next_up();
                let inside = |i: &usize| {
                    roots.order_with(*i, low).is_ge() && roots.order_with(*i, high).is_le()
                };
                (0..roots.len()).find(inside)?
            }
        };
        Some((roots, i))
    }

    #[cold]
    #[inline(never)]
    pub fn order(a: &Root, b: &Root) -> Ordering {
        match (roots(a), roots(b)) {
            (Some((p, i)), Some((q, j))) => p.order(i, &q, j),
            _ => a.t.value.total_cmp(&b.t.value),
        }
    }

    #[cold]
    #[inline(never)]
    pub fn rounded(root: &Root) -> f64 {
        roots(root).map_or(root.t.value, |(p, i)| p.t(i))
    }

    #[cold]
    #[inline(never)]
    pub fn order_with(root: &Root, x: f64) -> Ordering {
        match roots(root) {
            Some((p, i)) => p.order_with(i, x),
            None => root.t.value.total_cmp(&x),
        }
    }
}

/// A root of a t² + 2b t + c in numbers of type N, with a > 0, or with a = 0 and b > 0.
struct NormalizedQuadratic<N: ExactSign> {
    space: N::Space,
    f: [N; 3],
    branch: Branch,
}

/// Returns the sign of a product.
fn signed(sign: Ordering, factor: Ordering) -> Ordering {
    match factor {
        Ordering::Less => sign.reverse(),
        Ordering::Equal => Ordering::Equal,
        Ordering::Greater => sign,
    }
}

/// All answers are `None` if double-double arithmetic leaves them undecided, or if exact numbers
/// find no room.
impl<N: ExactSign> NormalizedQuadratic<N> {
    #[inline(never)]
    fn new(space: N::Space, root: &Root) -> Option<Self> {
        let f: [N; 3] = root.surface.on_line_exactly(space, &root.line);
        let first = match f[0].sign()? {
            Ordering::Equal => f[1].sign()?,
            sign => sign,
        };
        Some(NormalizedQuadratic {
            space,
            f: f.map(|x| x.negated_if(first.is_lt())),
            branch: root.branch,
        })
    }

    /// Returns the root −c / 2b of a linear polynomial; b is positive.
    fn fraction(&self) -> (N, N) {
        let [_, b, c] = &self.f;
        (c.negated_if(true), b.doubled())
    }

    /// Orders p/q and the root; q > 0.
    #[inline(never)]
    fn order_of(&self, p: &N, q: &N) -> Option<Ordering> {
        let [a, b, c] = &self.f;
        if a.sign()?.is_eq() {
            return b.doubled().times(p).plus(&c.times(q)).sign();
        }
        let slope = a.times(p).plus(&b.times(q));
        let value = slope.times(p).plus(&b.times(p).plus(&c.times(q)).times(q));
        let (slope, value) = (slope.sign()?, value.sign()?);
        Some(match self.branch {
            Branch::Upper | Branch::Nth(_) | Branch::Only if slope.is_lt() => Ordering::Less,
            Branch::Upper | Branch::Nth(_) | Branch::Only => value,
            Branch::Lower if slope.is_gt() => Ordering::Greater,
            Branch::Lower => value.reverse(),
        })
    }

    fn order_of_number(&self, x: f64) -> Option<Ordering> {
        let (m, power) = decoded(x);
        self.order_of_scaled(m, power, x < 0.0)
    }

    /// Orders ± m · 2^power and the root.
    fn order_of_scaled(&self, m: u64, power: i32, negative: bool) -> Option<Ordering> {
        let NormalizedQuadratic { space, .. } = *self;
        N::briefly(space, || {
            let x = N::scaled(space, m, power, negative);
            self.order_of(&x, &N::of(space, 1.0))
        })
    }

    /// Returns the sign of m t + n at the root.
    #[inline(never)]
    fn sign_at(&self, m: &N, n: &N) -> Option<Ordering> {
        let rise = m.sign()?;
        if rise.is_eq() {
            return n.sign();
        }
        // The order of −n/m and the root.
        let down = rise.is_lt();
        let zero = || self.order_of(&n.negated_if(!down), &m.negated_if(down));
        let zero = N::briefly(self.space, zero)?;
        Some(signed(zero.reverse(), rise))
    }

    #[inline(never)]
    fn order(&self, other: &Self) -> Option<Ordering> {
        let ([a, b, c], [x, y, z]) = (&self.f, &other.f);
        if x.sign()?.is_eq() {
            let (p, q) = other.fraction();
            return Some(self.order_of(&p, &q)?.reverse());
        }
        if a.sign()?.is_eq() {
            let (p, q) = self.fraction();
            return other.order_of(&p, &q);
        }
        let slope = self.sign_at(x, y)?;
        match other.branch {
            Branch::Upper if slope.is_lt() => return Some(Ordering::Less),
            Branch::Lower if slope.is_gt() => return Some(Ordering::Greater),
            _ => {}
        }
        let m = a.times(y).minus(&x.times(b)).doubled();
        let n = a.times(z).minus(&x.times(c));
        let value = self.sign_at(&m, &n)?;
        Some(match other.branch {
            Branch::Upper | Branch::Nth(_) | Branch::Only => value,
            Branch::Lower => value.reverse(),
        })
    }

    /// Returns the sign of another polynomial at this linear one's root.
    #[inline(never)]
    fn sign_of(&self, [a, b, c]: &[N; 3]) -> Option<Ordering> {
        let (p, q) = self.fraction();
        let slope = a.times(&p).plus(&b.doubled().times(&q));
        slope.times(&p).plus(&c.times(&q.squared())).sign()
    }
}

impl NormalizedQuadratic<DoubleDouble> {
    /// Returns the f64 that Newton's method from a place near the root leads to.
    fn guess(&self, from: f64) -> f64 {
        let [a, b, c] = &self.f;
        let mut t = from;
        // Each step doubles the digits; the caller checks the result.
        for _ in 0..4 {
            let at = DoubleDouble::of((), t);
            let slope = a.times(&at).plus(b);
            let value = slope.plus(b).times(&at).plus(c);
            let next = t - value.value() / slope.doubled().value();
            if !next.is_finite() || next == t {
                break;
            }
            t = next;
        }
        t
    }
}
