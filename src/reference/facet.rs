//! Triangles and planar polygons seen from the ray: their corners relative to its origin,
//! projected along its direction (docs/SPEC.md, S15 to S18, S27 and S28).

use super::bounds;
use super::number::{Number, Vector, cross, dot, minus, vector};
use super::ray::Ray;
use super::root::{Poly, Root};
use std::cmp::Ordering;

/// Meets a triangle by Möller and Trumbore's determinants (1997). Edges and corners belong
/// to the triangle; a triangle seen exactly edge-on is not met (S15, S16).
pub fn triangle<N: Number>(
    ray: &Ray,
    corners: [[f64; 3]; 3],
) -> Result<Option<Root<N>>, N::Undecided> {
    let (org, d) = (vector(ray.org), vector(ray.dir));
    let [a, b, c] = corners.map(|p| minus(&vector(p), &org));
    let edge = |x: &Vector<N>, y: &Vector<N>| dot(&d, &cross(x, y));
    let signs = [edge(&b, &c), edge(&c, &a), edge(&a, &b)].map(|e| e.sign());
    // Two opposite signs are a miss, whatever the third is.
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
    // The plane through the first corner, with its normal from the corners themselves; d·n
    // has the sign of the edge functions.
    let [p, q, r] = corners.map(vector);
    let n = cross(&minus(&q, &p), &minus(&r, &p));
    Ok(Some(Root::fraction(dot(&a, &n), dot(&d, &n), side)))
}

/// Crosses a triangle of a closed mesh, and returns the sign of d·n. A line through an edge
/// or a corner crosses it if the line does whose origin is moved by ε along the one and by
/// ε² along the other of the two axes behind the axis along which |d| is largest (S44;
/// Edelsbrunner and Mücke, *Simulation of Simplicity*, 1990).
pub fn crossed<N: Number>(
    ray: &Ray,
    corners: [[f64; 3]; 3],
) -> Result<Option<(Root<N>, Ordering)>, N::Undecided> {
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
        // (a − δ) × (b − δ) = a × b + δ × (a − b), where a − b = p − q.
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

/// Meets a planar polygon: where the line passes through the outline or meets it (even-odd
/// rule: Shimrat, *Communications of the ACM*, 1962), the t of the plane through the first
/// corner with this normal (S27), if that point is in the box of the corners grown by a
/// thousandth of its longest side (S28).
pub fn polygon<N: Number>(
    ray: &Ray,
    normal: [f64; 3],
    points: &[[f64; 3]],
) -> Result<Option<Root<N>>, N::Undecided> {
    let (org, d, n) = (vector(ray.org), vector(ray.dir), vector::<N>(normal));
    let rate = dot(&n, &d);
    let toward = rate.sign()?;
    if toward.is_eq() || !inside(&org, &d, ray, points)? {
        return Ok(None);
    }
    let first = minus(&vector(points[0]), &org);
    let t = Root::fraction(dot(&n, &first), rate, toward);
    let room = bounds::near_outline(points);
    for k in 0..3 {
        // The point less the room's least and largest coordinate, as polynomials in t.
        let [low, high] = [room.min, room.max].map(|b| org[k].minus(&N::from_f64(b[k])));
        let from_low = t.sign_of(&Poly::linear(low, d[k].clone()))?;
        let from_high = t.sign_of(&Poly::linear(high, d[k].clone()))?;
        if from_low.is_lt() || from_high.is_gt() {
            return Ok(None);
        }
    }
    Ok(Some(t))
}

/// Says whether the line passes through the outline, or meets it.
fn inside<N: Number>(
    org: &Vector<N>,
    d: &Vector<N>,
    ray: &Ray,
    points: &[[f64; 3]],
) -> Result<bool, N::Undecided> {
    // Corners are projected along d onto the plane of two axes, and scaled by the third
    // coordinate of d.
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
        // An edge wholly above or wholly below the first axis does not cross it.
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
