//! Polynomial surfaces: where a polynomial in x, y, z is zero along a line.

use super::algebraic::Algebraic;
use super::dyadic::Dyadic;
use super::number::{Number, vector};
use super::polynomial::Polynomial;
use super::ray::Ray;
use super::root::{Poly, Root};
use super::solids::{self, Meeting};
use crate::geom::{Clip, Implicit, Step, Tape};
use std::cmp::Ordering;

/// A root, and the polynomial's signs just before it and just behind it.
struct Zero {
    t: Algebraic,
    before: Ordering,
    behind: Ordering,
}

/// Of a closed one where the line is outside just before or just behind: it comes
/// in there, or leaves, or touches from outside. Of an open one every zero, or those
/// in its clip, the ends of it included.
pub fn meetings<N: Number>(ray: &Ray, row: &Implicit) -> Result<Vec<Meeting<N>>, N::Doubt> {
    let clip = row.clip.as_ref().map(|clip| faces_of_clip(ray, clip));
    if let Some(faces) = &clip
        && solids::ends(faces)?.is_empty()
    {
        return Ok(Vec::new());
    }
    let is_surface = row.open || clip.is_some();
    let mut found = Vec::new();
    'zeros: for zero in zeros(&along::<N>(ray, row.tape)?) {
        if !is_surface && zero.before.is_lt() && zero.behind.is_lt() {
            continue;
        }
        let t = Root::Algebraic(zero.t);
        for face in clip.iter().flatten() {
            if t.sign_of(face)?.is_gt() {
                continue 'zeros;
            }
        }
        found.push(met(t));
    }
    Ok(found)
}

/// Of a closed one as an operand: whether the line is in it from the start, and where
/// that changes.
pub fn span<N: Number>(ray: &Ray, row: &Implicit) -> Result<(bool, Vec<Meeting<N>>), N::Doubt> {
    let f = along::<N>(ray, row.tape)?;
    let changes = zeros(&f)
        .into_iter()
        .filter(|zero| zero.before != zero.behind);
    let changes = changes.map(|zero| met(Root::Algebraic(zero.t))).collect();
    Ok((f.sign_far_off(true).is_le(), changes))
}

fn met<N>(t: Root<N>) -> Meeting<N> {
    let (face, surface) = (0, 0);
    Meeting { t, face, surface }
}

fn zeros(f: &Polynomial) -> Vec<Zero> {
    let zero = |t: Algebraic| Zero {
        before: f.sign_at(&t.lo),
        behind: f.sign_at(&t.hi),
        t,
    };
    Algebraic::roots(f).into_iter().map(zero).collect()
}

fn faces_of_clip<N: Number>(ray: &Ray, clip: &Clip) -> Vec<Poly<N>> {
    match clip {
        Clip::Sphere(sphere) => solids::sphere(ray, sphere),
        Clip::Cuboid(cuboid) => solids::cuboid(ray, cuboid),
    }
}

/// The polynomial in t that a tape is on the line o + t d.
fn along<N: Number>(ray: &Ray, tape: &Tape) -> Result<Polynomial, N::Doubt> {
    // Only of numbers without errors.
    let exactly = |v: [f64; 3]| -> Result<Vec<Dyadic>, N::Doubt> {
        vector::<N>(v).iter().map(N::exactly).collect()
    };
    let (org, dir) = (exactly(ray.org)?, exactly(ray.dir)?);
    let mut values: Vec<Vec<Dyadic>> = Vec::new();
    for step in tape.steps() {
        let of = |i: &u32| &values[*i as usize];
        values.push(match step {
            Step::Coordinate(axis) => {
                let k = usize::from(*axis);
                vec![org[k].clone(), dir[k].clone()]
            }
            Step::Constant(value) => vec![Dyadic::of(*value)],
            Step::Sum(a, b) => termwise(of(a), of(b), Dyadic::plus),
            Step::Difference(a, b) => termwise(of(a), of(b), Dyadic::minus),
            Step::Product(a, b) => product(of(a), of(b)),
            Step::Scaled(a, by) => product(of(a), &[Dyadic::of(*by)]),
        });
    }
    Ok(Polynomial::of(&values.pop().unwrap_or_default()))
}

fn termwise(a: &[Dyadic], b: &[Dyadic], of: fn(&Dyadic, &Dyadic) -> Dyadic) -> Vec<Dyadic> {
    let term = |c: &[Dyadic], k: usize| c.get(k).cloned().unwrap_or_else(Dyadic::zero);
    let count = a.len().max(b.len());
    (0..count).map(|k| of(&term(a, k), &term(b, k))).collect()
}

fn product(a: &[Dyadic], b: &[Dyadic]) -> Vec<Dyadic> {
    let mut c = vec![Dyadic::zero(); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            c[i + j] = c[i + j].plus(&x.times(y));
        }
    }
    c
}

/// Outward; zero at a node.
pub fn gradient(tape: &Tape, p: [f64; 3]) -> [f64; 3] {
    // Each step's value and gradient.
    let mut values: Vec<(f64, [f64; 3])> = Vec::new();
    for step in tape.steps() {
        let of = |i: &u32| values[*i as usize];
        values.push(match step {
            Step::Coordinate(axis) => {
                let k = usize::from(*axis);
                let slope = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
                (p[k], slope)
            }
            Step::Constant(value) => (*value, [0.0; 3]),
            Step::Sum(a, b) => {
                let ((a, u), (b, v)) = (of(a), of(b));
                (a + b, std::array::from_fn(|k| u[k] + v[k]))
            }
            Step::Difference(a, b) => {
                let ((a, u), (b, v)) = (of(a), of(b));
                (a - b, std::array::from_fn(|k| u[k] - v[k]))
            }
            Step::Product(a, b) => {
                let ((a, u), (b, v)) = (of(a), of(b));
                (a * b, std::array::from_fn(|k| a * v[k] + b * u[k]))
            }
            Step::Scaled(a, by) => {
                let (a, u) = of(a);
                (a * by, u.map(|u| u * by))
            }
        });
    }
    values.last().map_or([0.0; 3], |(_, slope)| *slope)
}
