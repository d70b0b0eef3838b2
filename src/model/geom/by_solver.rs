//! Meets polynomial surfaces by a solver that the user chooses, in `fast` only.
//!
//! One ray at a time, the coefficients of the polynomial along the ray are computed in f64 and
//! [`solve`] finds the roots. The answer has no error bound: the coefficients are rounded, and a
//! solver may miss roots. `verify` measures the errors; docs/ROOTS.md has a table.
//!
//! A [`Cluster`] of roots that a solver cannot separate counts as one root in its middle if the
//! polynomial has different signs at its ends, and as none otherwise.

use super::guarded::ObjectRay;
use super::tape::{Arithmetic, MAX_DEGREE, Tape};
use super::{Implicit, Ray};
use crate::math::Vec3;
use crate::math::lanes::Mask;
use crate::roots::{
    self, Answer, Cluster, Interval, Parity, Polynomial, Solver, Want, horner, solve,
};
use std::ops::Bound;

/// Origin and direction, in the surface's space.
type Line = ([f64; 3], [f64; 3]);

/// Returns the least t between two numbers at which a ray meets the surface within its clip.
pub fn first(row: &Implicit, solver: Solver, line: Line, between: [f64; 2]) -> Option<f64> {
    let part = LinePart::clipped(row, line, between)?;
    let p = part.polynomial(row.tape, line)?;
    let mut answer = part.solved(&p, solver, Want::Nearest)?;
    // A cluster ends the search, and may turn out to be no root.
    if !answer.clusters.is_empty() {
        answer = part.solved(&p, solver, Want::All)?;
    }
    let roots = answer.roots.iter().map(|root| root.t);
    let clusters = answer.clusters.iter().filter_map(|c| part.crossed(&p, c));
    let s = roots.chain(clusters).min_by(f64::total_cmp)?;
    Some(part.at(s))
}

/// Says whether there is such a t, which some solvers can do without finding it.
pub fn exists(row: &Implicit, solver: Solver, line: Line, between: [f64; 2]) -> bool {
    let count = || {
        let part = LinePart::clipped(row, line, between)?;
        let p = part.polynomial(row.tape, line)?;
        roots::count(&p, &part.interval(), solver)
    };
    match count() {
        Some(count) => count > 0,
        None => first(row, solver, line, between).is_some(),
    }
}

/// Finds all t between two numbers at which a line enters or leaves the polynomial's solid,
/// ascending; returns whether it is inside at the first of the two.
pub fn crossings(
    tape: &Tape,
    solver: Solver,
    line: Line,
    [from, to]: [f64; 2],
    found: &mut Vec<f64>,
) -> bool {
    found.clear();
    let part = LinePart {
        from,
        to,
        begins_in: false,
    };
    let Some(p) = part.polynomial(tape, line) else {
        return false;
    };
    if let Some(answer) = part.solved(&p, solver, Want::All) {
        let roots = answer
            .roots
            .iter()
            .filter(|root| root.multiplicity % 2 == 1);
        found.extend(roots.map(|root| part.at(root.t)));
        let clusters = answer.clusters.iter().filter_map(|c| part.crossed(&p, c));
        found.extend(clusters.map(|s| part.at(s)));
        found.sort_unstable_by(f64::total_cmp);
    }
    begins(&p) < 0.0
}

/// Returns the sign of a polynomial just above 0.
fn begins(p: &Polynomial) -> f64 {
    let first = p.coefficients().iter().find(|c| **c != 0.0);
    first.map_or(0.0, |c| c.signum())
}

/// A part of a line, parametrised by s from 0 to 1, or from 0 to ∞ if it is unbounded.
struct LinePart {
    from: f64,
    to: f64,
    /// Whether a root at s = 0 counts, because the clip or the bounds begin there.
    begins_in: bool,
}

impl LinePart {
    /// Returns the part of a line in the surface's clip or bounds.
    fn clipped(row: &Implicit, (org, dir): Line, [from, to]: [f64; 2]) -> Option<LinePart> {
        let (org, dir) = (Vec3::<f64>::splat(org), Vec3::splat(dir));
        let ray = Ray::new(org, dir, from);
        let line = ObjectRay::new(&org, &dir, &ray);
        let part = match row.region_ends(&line) {
            None => LinePart {
                from,
                to,
                begins_in: false,
            },
            Some(ends) if ends.some.any() => LinePart {
                from: from.max(ends.enter[1]),
                to: to.min(ends.exit[1]),
                begins_in: ends.enter[1] > from,
            },
            Some(_) => return None,
        };
        (part.from < part.to).then_some(part)
    }

    fn width(&self) -> f64 {
        let width = self.to - self.from;
        if width.is_finite() { width } else { 1.0 }
    }

    fn at(&self, s: f64) -> f64 {
        self.from + s * self.width()
    }

    /// Returns the interval of s.
    fn interval(&self) -> Interval {
        let low = match self.begins_in {
            true => Bound::Included(0.0),
            false => Bound::Excluded(0.0),
        };
        let high = match (self.to - self.from).is_finite() {
            true => Bound::Included(1.0),
            false => Bound::Unbounded,
        };
        Interval { low, high }
    }

    /// Returns the middle of a cluster, cut to the part, if the polynomial changes its sign there.
    fn crossed(&self, p: &Polynomial, cluster: &Cluster) -> Option<f64> {
        let end = match (self.to - self.from).is_finite() {
            true => 1.0,
            false => f64::MAX,
        };
        let (low, high) = (cluster.low.max(0.0), cluster.high.min(end));
        if low > high {
            return None;
        }
        let sign = |s: f64| {
            let at = horner(p.coefficients(), s);
            if at.certain() { at.value.signum() } else { 0.0 }
        };
        let before = if low == 0.0 { begins(p) } else { sign(low) };
        let is_odd = match before * sign(high) {
            0.0 => cluster.parity == Parity::Odd,
            product => product < 0.0,
        };
        is_odd.then_some(low + 0.5 * (high - low))
    }

    fn polynomial(&self, tape: &Tape, (org, dir): Line) -> Option<Polynomial> {
        let along = MovingPoint {
            start: std::array::from_fn(|k| org[k] + self.from * dir[k]),
            step: dir.map(|x| x * self.width()),
        };
        let powers = tape.evaluate_plain(&along);
        Polynomial::new(&powers.c[..=powers.degree]).ok()
    }

    /// Solves for the roots. Newton's method starts at the beginning of the part, because the
    /// nearest root is sought.
    fn solved(&self, p: &Polynomial, solver: Solver, want: Want) -> Option<Answer> {
        solve(p, &self.interval(), solver, want, &[0.0]).ok()
    }
}

/// A point on the line as a linear function of s.
struct MovingPoint {
    start: [f64; 3],
    step: [f64; 3],
}

/// A polynomial in s; coefficients above the degree are not used.
#[derive(Clone, Copy)]
struct Powers {
    c: [f64; MOST],
    degree: usize,
}

const MOST: usize = MAX_DEGREE as usize + 1;

impl Powers {
    fn linear(low: f64, high: f64, degree: usize) -> Powers {
        let mut c = [0.0; MOST];
        (c[0], c[1]) = (low, high);
        Powers { c, degree }
    }

    fn each(&self, other: &Powers, of: impl Fn(f64, f64) -> f64) -> Powers {
        Powers {
            c: std::array::from_fn(|i| of(self.c[i], other.c[i])),
            degree: self.degree.max(other.degree),
        }
    }
}

impl Arithmetic for MovingPoint {
    type Value = Powers;

    fn coordinate(&self, axis: usize) -> Powers {
        Powers::linear(self.start[axis], self.step[axis], 1)
    }

    fn constant(&self, value: f64) -> Powers {
        Powers::linear(value, 0.0, 0)
    }

    fn sum(&self, a: &Powers, b: &Powers) -> Powers {
        a.each(b, |x, y| x + y)
    }

    fn difference(&self, a: &Powers, b: &Powers) -> Powers {
        a.each(b, |x, y| x - y)
    }

    fn product(&self, a: &Powers, b: &Powers) -> Powers {
        let mut product = Powers::linear(0.0, 0.0, (a.degree + b.degree).min(MOST - 1));
        for (i, x) in a.c[..=a.degree].iter().enumerate() {
            for (to, y) in product.c[i..].iter_mut().zip(&b.c[..=b.degree]) {
                *to += x * y;
            }
        }
        product
    }
}

#[cfg(test)]
mod tests;
