//! Where a line crosses a surface: roots of f(t) = a t² + 2b t + c, and their
//! order, without square roots.
//!
//! A root α is where f rises or where it falls (with a ≥ 0, the upper or the
//! lower one), so its place beside a fraction x follows from the signs of f and
//! of its slope at x. A linear function m t + n at α has the sign of m or its
//! opposite, as α lies beside −n/m. And against the root β of a second polynomial
//! g, α is placed by the signs of g and of its slope *at α*: the slope is linear,
//! and a₁ g has there the values of a₁ g − a₂ f, which is linear, too. Equal
//! roots, common and double ones, and equal polynomials are no cases of their
//! own. docs/NUMERICS.md has the proof.

use super::plane::Through;
use super::surface::Surface;
use super::{Line, plane};
use crate::geom::guarded::implicit::nearest;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::math::bounds::Bounded;
use crate::math::dyadic::{Dyadic, Space, exactly};
use crate::math::int::decoded;
use crate::math::{Number, Vec3};
use glam::DVec3;
use std::cmp::Ordering;

/// Which root of a polynomial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Branch {
    Lower,
    /// Also where there is but one.
    Upper,
    /// So many distinct ones are before it: of a surface of any degree.
    Nth(u8),
    /// The only one near `t`, within its error and a little beyond: of such a surface.
    Only,
}

/// Where a line crosses a surface.
#[derive(Clone, Copy, Debug)]
pub struct Root<'a> {
    line: Line,
    surface: Surface<'a>,
    branch: Branch,
    /// t, as far as f64 knows it.
    pub t: Bounded,
}

impl<'a> Root<'a> {
    #[inline(always)]
    pub(super) fn new(line: &Line, surface: Surface<'a>, branch: Branch, t: Bounded) -> Root<'a> {
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

    /// Of the surface that is crossed, at or near the crossing `p`: outward, any
    /// length. At an edge of a solid it is that of the face that decides.
    pub fn normal_at(&self, p: DVec3) -> DVec3 {
        self.surface.normal_at(p)
    }

    /// By t, exactly.
    #[inline]
    pub fn order(&self, other: &Root) -> Ordering {
        let certain = self.t.order(&other.t);
        certain.unwrap_or_else(|| self.order_exact(other))
    }

    /// t against a number, exactly. Infinity is above all, and so is NaN.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        let certain = self.t.order(&Bounded::exact(x));
        certain.unwrap_or_else(|| self.order_with_exact(x))
    }

    /// The f64 nearest to t, ties to even; so equal t have equal bits.
    pub fn rounded(&self) -> f64 {
        match self.branch {
            Branch::Nth(_) => return self.t.value,
            Branch::Only => return algebraic::rounded(self),
            Branch::Lower | Branch::Upper => {}
        }
        // Integers of a size for triangles are faster.
        if let Surface::Facet(corners) = self.surface {
            let Line { org, dir } = self.line;
            let pair = Pair { org, dir, corners };
            if let Some(crossing) = meet_exact(&pair) {
                return crossing.rounded();
            }
        }
        let t = self.of_plane().and_then(|plane| plane::rounded(&plane));
        t.unwrap_or_else(|| exactly(&|space| Form::of(space, self).rounded(&self.t)))
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

    /// The f64 that kernels in f64 have of it: of a polynomial surface nearly always the
    /// nearest one, else as it was found.
    pub fn as_kernels(&self) -> f64 {
        let Line { org, dir } = self.line;
        let Bounded { value, error } = self.t;
        match (self.surface, self.branch) {
            (Surface::Implicit(tape), Branch::Only) => {
                let ends = [value - error, value, value + error];
                nearest::<f64>(tape, (Vec3::splat(org), Vec3::splat(dir)), ends, true)
            }
            _ => value,
        }
    }

    #[cold]
    #[inline(never)]
    fn order_exact(&self, other: &Root) -> Ordering {
        let same_branch = self.branch == other.branch
            && (self.branch != Branch::Only || self.t.value == other.t.value);
        if self.line == other.line && self.surface == other.surface && same_branch {
            return Ordering::Equal;
        }
        if self.is_of_any_degree() || other.is_of_any_degree() {
            return algebraic::order(self, other);
        }
        if let (Some(a), Some(b)) = (self.of_plane(), other.of_plane())
            && let Some(order) = plane::order(&a, &b)
        {
            return order;
        }
        exactly(&|space| Form::of(space, self).order(&Form::of(space, other)))
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
            let order = exactly(&|space| Form::of(space, self).order_of_number(x));
            order.reverse()
        })
    }

    /// The sign that a polynomial has at this crossing of a plane.
    #[cold]
    #[inline(never)]
    pub(super) fn sign_of(&self, surface: &Surface) -> Ordering {
        exactly(&|space| {
            let f = surface.exactly_along(space, &self.line);
            Form::of(space, self).sign_of(&f)
        })
    }
}

/// Roots of which one at least is of a polynomial of any degree.
mod algebraic {
    use super::super::along::along;
    use super::{Branch, Root};
    use crate::roots::{RealRoots, real_roots};
    use std::cmp::Ordering;

    /// All roots of the polynomial that a root is one of, and which it is.
    fn roots(of: &Root) -> Option<(RealRoots, usize)> {
        let roots = real_roots(&along(&of.surface, &of.line))?;
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

/// A root in exact numbers: of a t² + 2b t + c with a > 0, or with a = 0 and
/// b > 0.
struct Form<'a> {
    space: &'a Space<'a>,
    f: [Dyadic<'a>; 3],
    branch: Branch,
}

/// Sign of a product.
fn signed(sign: Ordering, factor: Ordering) -> Ordering {
    match factor {
        Ordering::Less => sign.reverse(),
        Ordering::Equal => Ordering::Equal,
        Ordering::Greater => sign,
    }
}

/// All answers are `None` where numbers find no room.
impl<'a> Form<'a> {
    #[inline(never)]
    fn of(space: &'a Space<'a>, root: &Root) -> Self {
        let f = root.surface.exactly_along(space, &root.line);
        let first = f[0].sign().filter(|s| s.is_ne());
        let negate = first.or(f[1].sign()) == Some(Ordering::Less);
        Form {
            space,
            f: f.map(|x| x.negated_if(negate)),
            branch: root.branch,
        }
    }

    /// −c / 2b, of a linear one; b is positive.
    fn fraction(&self) -> (Dyadic<'a>, Dyadic<'a>) {
        let [_, b, c] = &self.f;
        (c.negated(), b.doubled())
    }

    /// p/q against the root; q > 0.
    #[inline(never)]
    fn order_of(&self, p: &Dyadic<'a>, q: &Dyadic<'a>) -> Option<Ordering> {
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

    /// ± m · 2^power against the root.
    fn order_of_scaled(&self, m: u64, power: i32, negative: bool) -> Option<Ordering> {
        let Form { space, .. } = *self;
        space.briefly(|| {
            let x = Dyadic::scaled(space, m, power, negative);
            self.order_of(&x, &Dyadic::of(space, 1.0))
        })
    }

    /// The sign of m t + n at the root.
    #[inline(never)]
    fn sign_at(&self, m: &Dyadic<'a>, n: &Dyadic<'a>) -> Option<Ordering> {
        let rise = m.sign()?;
        if rise.is_eq() {
            return n.sign();
        }
        // Where it is zero, beside the root.
        let down = rise.is_lt();
        let zero = || self.order_of(&n.negated_if(!down), &m.negated_if(down));
        let zero = self.space.briefly(zero)?;
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

    /// The sign of another polynomial at this linear one's root.
    #[inline(never)]
    fn sign_of(&self, [a, b, c]: &[Dyadic<'a>; 3]) -> Option<Ordering> {
        let (p, q) = self.fraction();
        let slope = a.times(&p).plus(&b.doubled().times(&q));
        slope.times(&p).plus(&c.times(&q.squared())).sign()
    }

    /// Bisection over the bits of the f64 that `t` leaves, and a look at the
    /// number halfway to the next.
    fn rounded(&self, t: &Bounded) -> Option<f64> {
        let sign = self.order_of_number(0.0)?.reverse();
        if sign.is_eq() {
            return Some(0.0);
        }
        let negative = sign.is_lt();
        // |t| against m · 2^power.
        let against = |(m, power): (u64, i32)| {
            let order = self.order_of_scaled(m, power, negative)?;
            Some(if negative { order } else { order.reverse() })
        };
        // |t| is at least the one number and less than the other, in the end neighbours.
        let around = |x: f64| if negative { -x } else { x };
        let least = around(t.value) - t.error;
        let most = around(t.value) + t.error;
        let least = if least > 0.0 { least.next_down() } else { 0.0 };
        let most = if most < f64::MAX {
            most.next_up()
        } else {
            f64::MAX
        };
        let (mut low, mut high) = (least.to_bits(), most.to_bits() + 1);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if against(decoded(f64::from_bits(middle)))?.is_lt() {
                high = middle;
            } else {
                low = middle;
            }
        }
        let (m, power) = decoded(f64::from_bits(low));
        let up = match against((2 * m + 1, power - 1))? {
            Ordering::Less => 0,
            Ordering::Equal => low & 1,
            Ordering::Greater => 1,
        };
        // Beyond the last number is infinity.
        Some(around(f64::from_bits(low + up)))
    }
}
