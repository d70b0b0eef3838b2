//! Triangles and planar polygons, as the ray sees them: the corners relative to
//! its origin, projected along its direction.

use super::bounds;
use super::number::{Number, Vector, cross, dot, minus, vector};
use super::ray::Ray;
use super::root::{Poly, Root};
use std::cmp::Ordering;

/// Möller and Trumbore's determinants (1997). Edges and corners belong to it;
/// seen exactly edge-on it is not met.
pub fn triangle<N: Number>(ray: &Ray, corners: [[f64; 3]; 3]) -> Result<Option<Root<N>>, N::Doubt> {
    let (org, d) = (vector(ray.org), vector(ray.dir));
    let [a, b, c] = corners.map(|p| minus(&vector(p), &org));
    let edge = |x: &Vector<N>, y: &Vector<N>| dot(&d, &cross(x, y));
    let signs = [edge(&b, &c), edge(&c, &a), edge(&a, &b)].map(|e| e.sign());
    // Two that oppose each other are a miss, whatever the third.
    let has = |wanted: Ordering| signs.iter().any(|s| matches!(s, Ok(s) if *s == wanted));
    if has(Ordering::Less) && has(Ordering::Greater) {
        return Ok(None);
    }
    let mut side = Ordering::Equal;
    for sign in signs {
        side = side.then(sign?);
    }
    if side.is_eq() {
        return Ok(None);
    }
    // The plane through A, from the corners themselves; d·n has the edges' sign.
    let [p, q, r] = corners.map(vector);
    let n = cross(&minus(&q, &p), &minus(&r, &p));
    Ok(Some(Root::fraction(dot(&a, &n), dot(&d, &n), side)))
}

/// The same of a triangle of a closed surface: where the ray goes through an edge
/// or a corner, as one does whose origin is moved by ε along the one axis and ε²
/// along the other that follow the axis along which it is longest (Edelsbrunner and
/// Mücke, Simulation of Simplicity, 1990). And the sign of d·n.
pub fn crossed<N: Number>(
    ray: &Ray,
    corners: [[f64; 3]; 3],
) -> Result<Option<(Root<N>, Ordering)>, N::Doubt> {
    let d = vector::<N>(ray.dir);
    let Some(t) = triangle(ray, corners)? else {
        return Ok(None);
    };
    let size = ray.dir.map(f64::abs);
    let k = (0..3).fold(0, |k, i| if size[i] > size[k] { i } else { k });
    let shifts = [1, 2].map(|next| {
        let mut axis = [0.0; 3];
        axis[(k + next) % 3] = 1.0;
        vector::<N>(axis)
    });
    let org = vector::<N>(ray.org);
    let mut side = None;
    for i in 0..3 {
        let [p, q] = [1, 2].map(|next| vector::<N>(corners[(i + next) % 3]));
        let (a, b) = (minus(&p, &org), minus(&q, &org));
        let mut sign = dot(&d, &cross(&a, &b)).sign()?;
        // (a − δ) × (b − δ) is a × b and δ × (a − b).
        for shift in &shifts {
            if sign.is_eq() {
                sign = dot(&d, &cross(shift, &minus(&p, &q))).sign()?;
            }
        }
        if sign.is_eq() || side.is_some_and(|side| side != sign) {
            return Ok(None);
        }
        side = Some(sign);
    }
    Ok(side.map(|side| (t, side)))
}

/// The plane through the first corner with this normal, where the ray goes
/// through the outline or meets it (even-odd: Shimrat, Communications of the ACM
/// 1962), and if that is in the box of the corners, which grows by a thousandth of
/// its longest side.
pub fn polygon<N: Number>(
    ray: &Ray,
    normal: [f64; 3],
    points: &[[f64; 3]],
) -> Result<Option<Root<N>>, N::Doubt> {
    let (org, d, n) = (vector(ray.org), vector(ray.dir), vector::<N>(normal));
    let speed = dot(&n, &d);
    let toward = speed.sign()?;
    if toward.is_eq() || !inside(&org, &d, ray, points)? {
        return Ok(None);
    }
    let first = minus(&vector(points[0]), &org);
    let t = Root::fraction(dot(&n, &first), speed, toward);
    let room = bounds::near_outline(points);
    for k in 0..3 {
        // At least `low` and at most `high`, as polynomials of t.
        let [low, high] = [room.min, room.max].map(|b| org[k].minus(&N::of(b[k])));
        let from_low = t.sign_of(&Poly::linear(low, d[k].clone()))?;
        let from_high = t.sign_of(&Poly::linear(high, d[k].clone()))?;
        if from_low.is_lt() || from_high.is_gt() {
            return Ok(None);
        }
    }
    Ok(Some(t))
}

/// Whether the line goes through the outline, or meets it.
fn inside<N: Number>(
    org: &Vector<N>,
    d: &Vector<N>,
    ray: &Ray,
    points: &[[f64; 3]],
) -> Result<bool, N::Doubt> {
    // Along d onto the plane of two axes, and times d's third coordinate.
    let size = ray.dir.map(f64::abs);
    let k = (0..3).fold(0, |k, i| if size[i] > size[k] { i } else { k });
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let seen = |p: &[f64; 3]| {
        let a = minus(&vector::<N>(*p), org);
        let along = |i: usize| a[i].times(&d[k]).minus(&a[k].times(&d[i]));
        [along(i), along(j)]
    };
    let mut odd = false;
    let mut a = seen(&points[points.len() - 1]);
    for point in points {
        let b = seen(point);
        let (below, above) = (a[1].sign()?, b[1].sign()?);
        // An edge that lies all above or all below the x-axis says nothing.
        if below.is_eq() || below != above {
            let turn = a[0].times(&b[1]).minus(&a[1].times(&b[0])).sign()?;
            let between = || a[0].times(&b[0]).plus(&a[1].times(&b[1])).sign();
            if turn.is_eq() && between()?.is_le() {
                return Ok(true);
            }
            if below.is_gt() != above.is_gt() && turn.is_gt() == above.is_gt() {
                odd = !odd;
            }
        }
        a = b;
    }
    Ok(odd)
}
