//! Polynomial surfaces: the zeros of a polynomial in x, y, z along a line (docs/SPEC.md,
//! S29 to S32).

use super::algebraic::Algebraic;
use super::dyadic::Dyadic;
use super::number::{Number, vector};
use super::polynomial::Polynomial;
use super::ray::Ray;
use super::root::{Poly, Root};
use super::solids::{self, Meeting};
use crate::geom::{Clip, Implicit, Step, Tape};
use std::cmp::Ordering;

/// A root of f along the line, and the signs of f just before and just behind it.
struct Zero {
    t: Algebraic,
    before: Ordering,
    behind: Ordering,
}

/// Finds where a line meets a polynomial surface. A solid without a clip is met at the
/// roots with f > 0 just before or just behind: the line enters, leaves, or touches the
/// solid from outside (S29). An open or clipped surface is met at every root, or at the
/// roots in the closed clip (S30).
pub fn meetings<N: Number>(ray: &Ray, row: &Implicit) -> Result<Vec<Meeting<N>>, N::Undecided> {
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

/// Returns the span of a solid as a CSG operand: whether f ≤ 0 before all roots, and the
/// roots where the sign of f changes.
pub fn span<N: Number>(ray: &Ray, row: &Implicit) -> Result<(bool, Vec<Meeting<N>>), N::Undecided> {
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

/// Returns the polynomial in t that a tape is on the line o + t·d.
fn along<N: Number>(ray: &Ray, tape: &Tape) -> Result<Polynomial, N::Undecided> {
    // Polynomials have exact coefficients; bounded f64 leaves them undecided.
    let exactly = |v: [f64; 3]| -> Result<Vec<Dyadic>, N::Undecided> {
        vector::<N>(v).iter().map(N::exactly).collect()
    };
    let (org, dir) = (exactly(ray.org)?, exactly(ray.dir)?);
    let mut values: Vec<Vec<Dyadic>> = Vec::new();
    for step in tape.steps() {
        let value = |i: &u32| &values[*i as usize];
        values.push(match step {
            Step::Coordinate(axis) => {
                let k = usize::from(*axis);
                vec![org[k].clone(), dir[k].clone()]
            }
            Step::Constant(value) => vec![Dyadic::from_f64(*value)],
            Step::Sum(a, b) => termwise(value(a), value(b), Dyadic::plus),
            Step::Difference(a, b) => termwise(value(a), value(b), Dyadic::minus),
            Step::Product(a, b) => product(value(a), value(b)),
            Step::Scaled(a, by) => product(value(a), &[Dyadic::from_f64(*by)]),
        });
    }
    Ok(Polynomial::from_dyadics(&values.pop().unwrap_or_default()))
}

fn termwise(a: &[Dyadic], b: &[Dyadic], op: fn(&Dyadic, &Dyadic) -> Dyadic) -> Vec<Dyadic> {
    let term = |c: &[Dyadic], k: usize| c.get(k).cloned().unwrap_or_else(Dyadic::zero);
    let count = a.len().max(b.len());
    (0..count).map(|k| op(&term(a, k), &term(b, k))).collect()
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

/// Returns the gradient of a tape in f64: outward; zero at a node.
pub fn gradient(tape: &Tape, p: [f64; 3]) -> [f64; 3] {
    // The value and the gradient of each step.
    let mut values: Vec<(f64, [f64; 3])> = Vec::new();
    for step in tape.steps() {
        let value = |i: &u32| values[*i as usize];
        values.push(match step {
            Step::Coordinate(axis) => {
                let k = usize::from(*axis);
                let slope = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
                (p[k], slope)
            }
            Step::Constant(value) => (*value, [0.0; 3]),
            Step::Sum(a, b) => {
                let ((a, u), (b, v)) = (value(a), value(b));
                (a + b, std::array::from_fn(|k| u[k] + v[k]))
            }
            Step::Difference(a, b) => {
                let ((a, u), (b, v)) = (value(a), value(b));
                (a - b, std::array::from_fn(|k| u[k] - v[k]))
            }
            Step::Product(a, b) => {
                let ((a, u), (b, v)) = (value(a), value(b));
                (a * b, std::array::from_fn(|k| a * v[k] + b * u[k]))
            }
            Step::Scaled(a, by) => {
                let (a, u) = value(a);
                (a * by, u.map(|u| u * by))
            }
        });
    }
    values.last().map_or([0.0; 3], |(_, slope)| *slope)
}
