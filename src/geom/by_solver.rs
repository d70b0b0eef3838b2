//! Polynomial surfaces by a solver of the user's choice, for those who know no doubt.
//!
//! One ray at a time: the surface's polynomial along the ray, in powers, is worked out in
//! f64, and [`solve`] is asked for its roots. What comes of it is taken as it is: the
//! coefficients are rounded, and a solver may miss roots. How wrong that is `verify`
//! measures; docs/ROOTS.md has a table.
//!
//! Of what a solver cannot separate ([`Cluster`](crate::roots::Cluster)) an odd number of
//! roots counts as one in the middle, an even number as none.

use super::guarded::{Ends, ObjectRay, cuboid, sphere};
use super::tape::{Arithmetic, MAX_DEGREE, Tape};
use super::{Clip, Cuboid, Implicit, Ray};
use crate::math::Vec3;
use crate::math::lanes::Mask;
use crate::roots::{self, Answer, Interval, Parity, Polynomial, Solver, Want, solve};

/// Origin and direction, in the surface's space.
type Line = ([f64; 3], [f64; 3]);

/// The least t of a ray in the surface, or of what its clip leaves of it, between two.
pub fn first(row: &Implicit, solver: Solver, line: Line, between: [f64; 2]) -> Option<f64> {
    let part = Part::of(row, line, between)?;
    let p = part.polynomial(row.tape, line)?;
    let answer = part.solved(&p, solver, Want::Nearest)?;
    let root = answer.roots.first().map(|root| root.t);
    let mut clusters = answer.clusters.iter();
    let odd = clusters.find(|cluster| cluster.parity == Parity::Odd);
    let odd = odd.map(|cluster| middle(cluster.low, cluster.high));
    let s = match (root, odd) {
        (Some(a), Some(b)) => a.min(b),
        (a, b) => a.or(b)?,
    };
    Some(part.at(s))
}

/// Whether there is such a t. Some solvers need not find it.
pub fn exists(row: &Implicit, solver: Solver, line: Line, between: [f64; 2]) -> bool {
    let count = || {
        let part = Part::of(row, line, between)?;
        let p = part.polynomial(row.tape, line)?;
        roots::count(&p, &part.interval(), solver)
    };
    match count() {
        Some(count) => count > 0,
        None => first(row, solver, line, between).is_some(),
    }
}

/// All t between two at which a line comes into the polynomial's solid or leaves it,
/// ascending; and whether it is inside at the first of the two.
pub fn crossings(
    tape: &Tape,
    solver: Solver,
    line: Line,
    [from, to]: [f64; 2],
    found: &mut Vec<f64>,
) -> bool {
    found.clear();
    let part = Part { from, to };
    let Some(p) = part.polynomial(tape, line) else {
        return false;
    };
    let begins = p.coefficients().iter().find(|c| **c != 0.0);
    let begins_inside = begins.is_some_and(|c| *c < 0.0);
    if let Some(answer) = part.solved(&p, solver, Want::All) {
        let roots = answer
            .roots
            .iter()
            .filter(|root| root.multiplicity % 2 == 1);
        found.extend(roots.map(|root| part.at(root.t)));
        let clusters = answer.clusters.iter();
        let clusters = clusters.filter(|cluster| cluster.parity == Parity::Odd);
        found.extend(clusters.map(|cluster| part.at(middle(cluster.low, cluster.high))));
        found.sort_by(f64::total_cmp);
    }
    begins_inside
}

fn middle(low: f64, high: f64) -> f64 {
    (low + 0.5 * (high - low)).max(0.0)
}

/// A part of a line, in which s goes from 0 to 1; from 0 on, where it has no end.
struct Part {
    from: f64,
    to: f64,
}

impl Part {
    /// What of it is in the surface's clip or bounds.
    fn of(row: &Implicit, (org, dir): Line, [from, to]: [f64; 2]) -> Option<Part> {
        let (org, dir) = (Vec3::<f64>::splat(org), Vec3::splat(dir));
        let ray = Ray::new(org, dir, from);
        let line = ObjectRay::new(&org, &dir, &ray);
        let ends: Option<Ends<f64>> = match (row.clip, row.bounds) {
            (Some(Clip::Sphere(ball)), _) => Some(sphere::sphere_ends(&ball, &line)),
            (Some(Clip::Cuboid(row)), _) => Some(cuboid::ends(&row, &line)),
            (None, Some(bounds)) => {
                let (min, max) = (bounds.min, bounds.max);
                Some(cuboid::ends(&Cuboid { min, max }, &line))
            }
            (None, None) => None,
        };
        let part = match ends {
            None => Part { from, to },
            Some(ends) if ends.some.any() => Part {
                from: from.max(ends.enter[1]),
                to: to.min(ends.exit[1]),
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

    /// What s may be.
    fn interval(&self) -> Interval {
        let is_finite = (self.to - self.from).is_finite();
        Interval::half_open(0.0, if is_finite { 1.0 } else { f64::INFINITY })
    }

    fn polynomial(&self, tape: &Tape, (org, dir): Line) -> Option<Polynomial> {
        let along = Along {
            start: std::array::from_fn(|k| org[k] + self.from * dir[k]),
            step: dir.map(|x| x * self.width()),
        };
        let powers = tape.evaluate_plain(&along);
        Polynomial::new(&powers.c[..=powers.degree]).ok()
    }

    /// Newton's method begins where the part does: the nearest root is the one sought.
    fn solved(&self, p: &Polynomial, solver: Solver, want: Want) -> Option<Answer> {
        solve(p, &self.interval(), solver, want, &[0.0]).ok()
    }
}

/// A point that moves with s.
struct Along {
    start: [f64; 3],
    step: [f64; 3],
}

/// A polynomial in s; no power above the degree is used.
#[derive(Clone, Copy)]
struct Powers {
    c: [f64; MOST],
    degree: usize,
}

const MOST: usize = MAX_DEGREE as usize + 1;

impl Powers {
    fn of(low: f64, high: f64, degree: usize) -> Powers {
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

impl Arithmetic for Along {
    type Value = Powers;

    fn coordinate(&self, axis: usize) -> Powers {
        Powers::of(self.start[axis], self.step[axis], 1)
    }

    fn constant(&self, value: f64) -> Powers {
        Powers::of(value, 0.0, 0)
    }

    fn sum(&self, a: &Powers, b: &Powers) -> Powers {
        a.each(b, |x, y| x + y)
    }

    fn difference(&self, a: &Powers, b: &Powers) -> Powers {
        a.each(b, |x, y| x - y)
    }

    fn product(&self, a: &Powers, b: &Powers) -> Powers {
        let mut product = Powers::of(0.0, 0.0, (a.degree + b.degree).min(MOST - 1));
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
