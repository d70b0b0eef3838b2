//! Real roots of degree 1 and 2 with their errors, within a reach about 0.
//!
//! Beyond the reach there is nothing of the shape, so a leading coefficient
//! that is zero within its error does no harm unless the whole polynomial is.

use super::approx::{Approx, Verdict};

/// A root, and whether there is one.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    pub t: Approx,
    pub exists: Verdict,
}

impl Root {
    /// Zero within its error all along: it may vanish anywhere.
    fn lost(reach: f64) -> Root {
        Root {
            t: Approx::anywhere(reach),
            exists: Verdict::PERHAPS,
        }
    }
}

/// The root of b·t + c.
pub fn linear(b: Approx, c: Approx, reach: f64) -> Option<Root> {
    // A surface that the ray lies in, or runs beside, is not crossed.
    if b.is_exactly_zero() || c.certainly_beyond(b.abs_hi() * reach) {
        return None;
    }
    if !b.is_signed() {
        return Some(Root::lost(reach));
    }
    within(
        Root {
            t: -c / b,
            exists: Verdict::YES,
        },
        reach,
    )
}

/// The roots of a·t² + 2b·t + c.
pub fn quadratic(a: Approx, b: Approx, c: Approx, reach: f64) -> [Option<Root>; 2] {
    if c.certainly_beyond((a.abs_hi() * reach + 2.0 * b.abs_hi()) * reach) {
        return [None; 2];
    }
    let discriminant = b.squared() - a * c;
    let exists = discriminant.at_least_zero();
    if exists.is_no() {
        return [None; 2];
    }
    let root = discriminant.sqrt();
    let (minus, plus) = (-b - root, root - b);
    [(minus, plus), (plus, minus)].map(|(top, other)| {
        // The root that goes to infinity as a goes to 0.
        if top.certainly_beyond(a.abs_hi() * reach) {
            return None;
        }
        // Both are the root; which one cancels depends on the sign of b.
        let t = (top / a).or_sharper(c / other);
        if !t.error.is_finite() {
            return Some(Root::lost(reach));
        }
        within(Root { t, exists }, reach)
    })
}

fn within(root: Root, reach: f64) -> Option<Root> {
    (!root.t.certainly_beyond(reach)).then_some(root)
}
