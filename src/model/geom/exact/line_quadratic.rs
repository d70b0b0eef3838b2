//! A surface's quadratic along a line: its coefficients in f64 with error bounds, their signs
//! (exact where f64 leaves them undecided), and its roots (D13 to D15, docs/numerics/exact.md).

use super::root::Branch;
use super::surface::Surface as AnySurface;
use super::{Line, plane};
use crate::math::Number;
use crate::math::bounds::ErrorBounded;
use crate::math::double_double::DoubleDouble;
use crate::math::dyadic::{Dyadic, exactly};
use std::cmp::Ordering;

/// A surface of degree two at most.
type Surface = AnySurface<'static>;
type Root = super::root::Root<'static>;

pub(in crate::geom) struct LineQuadratic {
    line: Line,
    surface: Surface,
    /// The origin of t. Near the surface the coefficients of far rays are accurate, too.
    shift: f64,
    /// The coefficients a, b, c of a t² + 2b t + c.
    f: [ErrorBounded; 3],
}

/// Returns approximately the t of the line's point nearest to another point.
pub(in crate::geom) fn nearest_to(line: &Line, point: [f64; 3]) -> f64 {
    let (mut along, mut squared) = (0.0, 0.0);
    for k in 0..3 {
        along += (point[k] - line.org[k]) * line.dir[k];
        squared += line.dir[k] * line.dir[k];
    }
    let t = along / squared;
    if t.is_finite() { t } else { 0.0 }
}

impl LineQuadratic {
    #[inline(always)]
    pub fn new(line: &Line, surface: Surface, shift: f64) -> LineQuadratic {
        LineQuadratic {
            line: *line,
            surface,
            shift,
            f: surface.on_line((), line, shift),
        }
    }

    /// Returns the sign of a. It does not depend on the origin of t; nor does the sign of b if a
    /// is zero, nor that of c if both are.
    #[inline(always)]
    pub fn quadratic_sign(&self) -> Ordering {
        self.coefficient(0)
    }

    /// Returns the sign of b, if a is zero.
    #[inline(always)]
    pub fn linear_sign(&self) -> Ordering {
        self.coefficient(1)
    }

    /// Returns the sign of c, if a and b are zero.
    #[inline(always)]
    pub fn constant_sign(&self) -> Ordering {
        self.coefficient(2)
    }

    #[inline(always)]
    fn coefficient(&self, k: usize) -> Ordering {
        let known = self.f[k].sign();
        known.unwrap_or_else(|| self.exact_coefficient(k))
    }

    #[cold]
    #[inline(never)]
    fn exact_coefficient(&self, k: usize) -> Ordering {
        // A ray along a face of a box.
        if let Surface::Plane { normal, .. } = &self.surface
            && k == 1
            && (0..3).all(|i| normal[i] == 0.0 || self.line.dir[i] == 0.0)
        {
            return Ordering::Equal;
        }
        if let Surface::PlaneThrough { normal, .. } = &self.surface
            && k == 1
            && let Some(rise) = plane::rise(normal, &self.line.dir)
        {
            return rise;
        }
        let twice: [DoubleDouble; 3] = self.surface.on_line_exactly((), &self.line);
        twice[k].sign().unwrap_or_else(|| {
            exactly(&|space| {
                let exact: [Dyadic; 3] = self.surface.on_line_exactly(space, &self.line);
                exact[k].sign()
            })
        })
    }

    #[cold]
    #[inline(never)]
    fn exact_discriminant(&self) -> Ordering {
        let twice: [DoubleDouble; 3] = self.surface.on_line_exactly((), &self.line);
        discriminant(&twice).sign().unwrap_or_else(|| {
            exactly(&|space| {
                let exact: [Dyadic; 3] = self.surface.on_line_exactly(space, &self.line);
                discriminant(&exact).sign()
            })
        })
    }

    /// Returns the lower and the upper root, if a has the sign `bend` ≠ 0.
    #[inline(always)]
    pub fn roots(&self, bend: Ordering) -> Option<[Root; 2]> {
        let [a, b, c] = &self.f;
        let square = discriminant(&self.f);
        let real = square.sign().unwrap_or_else(|| self.exact_discriminant());
        if real.is_lt() {
            return None;
        }
        let root = square.sqrt();
        // The root that does not cancel; the other from their product or by the formula, whichever
        // has the smaller bound (D15, docs/numerics/exact.md).
        let (less, more) = (b.plus(&root).negated(), root.minus(b));
        let down = b.value < 0.0;
        let (q, other) = if down { (more, less) } else { (less, more) };
        let t = q.over(a);
        let (by_product, direct) = (c.over(&q), other.over(a));
        let better = by_product.error < direct.error;
        let u = if better { by_product } else { direct };
        let (lower, upper) = if down == bend.is_gt() { (u, t) } else { (t, u) };
        Some([
            self.root(Branch::Lower, &lower),
            self.root(Branch::Upper, &upper),
        ])
    }

    /// Returns the root, if a is zero and b is not.
    #[inline(always)]
    pub fn root_of_linear(&self) -> Root {
        let [_, b, c] = &self.f;
        self.root(Branch::Upper, &c.negated().over(&b.doubled()))
    }

    #[inline(always)]
    fn root(&self, branch: Branch, t: &ErrorBounded) -> Root {
        let t = ErrorBounded::exact(self.shift).plus(t);
        Root::new(&self.line, self.surface, branch, t)
    }

    /// Returns the sign at a crossing of a plane, given the sign of a and the roots.
    #[inline(always)]
    pub fn sign_at(&self, at: &Root, bend: Ordering, roots: Option<&[Root; 2]>) -> Ordering {
        let Some([lower, upper]) = roots.filter(|_| bend.is_ne()) else {
            return if bend.is_ne() {
                bend
            } else {
                at.sign_of(&self.surface)
            };
        };
        let (from, to) = (at.t.order(&lower.t), at.t.order(&upper.t));
        match (from, to) {
            (Some(Ordering::Less), _) | (_, Some(Ordering::Greater)) => bend,
            (Some(Ordering::Greater), Some(Ordering::Less)) => bend.reverse(),
            _ => at.sign_of(&self.surface),
        }
    }
}

/// Returns b² − a c.
#[inline(always)]
fn discriminant<N: Number>([a, b, c]: &[N; 3]) -> N {
    b.squared().minus(&a.times(c))
}
