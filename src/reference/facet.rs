//! Triangles and planar polygons.
//!
//! Triangle: Möller and Trumbore 1997, with the signs taken before the division.
//! Polygon: the plane through the first corner with Newell's normal; inside is
//! even-odd among the corners, seen along the normal's largest component.

use super::approx::*;
use super::flat::around;
use super::ray::{Crossing, Ray};
use super::roots::linear;

pub fn triangle(ray: &Ray, corners: [[f64; 3]; 3], primitive: u32, out: &mut Vec<Crossing>) {
    let [a, b, c] = corners.map(exact3);
    let (org, dir) = (exact3(ray.org), exact3(ray.dir));
    let (ab, ac, s) = (sub(b, a), sub(c, a), sub(org, a));

    let p = cross(dir, ac);
    let det = dot(ab, p);
    let u = dot(s, p);
    if outside(det, u) || det.is_exactly_zero() {
        return;
    }
    let q = cross(s, ab);
    let v = dot(dir, q);
    let w = det - u - v;
    if outside(det, v) || outside(det, w) || outside(u, v) || outside(u, w) || outside(v, w) {
        return;
    }
    let normal = values(cross(ab, ac));
    let crossing = |t, exists| Crossing {
        t,
        exists,
        primitive,
        normal,
    };
    if !det.is_signed() {
        // Seen edge-on within rounding. If the ray meets it, then between its
        // corners.
        let t = [a, b, c].map(|p| dot(sub(p, org), dir) / dot(dir, dir));
        let lo = t.iter().map(|t| t.lo()).fold(f64::INFINITY, f64::min);
        let hi = t.iter().map(|t| t.hi()).fold(f64::NEG_INFINITY, f64::max);
        out.push(crossing(Approx::between(lo, hi), Verdict::PERHAPS));
        return;
    }
    let side = |x: Approx| if det.value > 0.0 { x } else { -x }.at_least_zero();
    let exists = side(u).and(side(v)).and(side(w));
    out.push(crossing(dot(ac, q) / det, exists));
}

/// Whether two numbers that must agree in sign certainly do not.
fn outside(x: Approx, y: Approx) -> bool {
    x.is_signed() && y.is_signed() && (x.value > 0.0) != (y.value > 0.0)
}

pub fn polygon(ray: &Ray, points: &[[f64; 3]], out: &mut Vec<Crossing>) {
    let first = exact3(points[0]);
    // Newell, about the first corner: each fan triangle's cross product.
    let about: Vec<Approx3> = points.iter().map(|p| sub(exact3(*p), first)).collect();
    let normal = about
        .windows(2)
        .fold(exact3([0.0; 3]), |sum, p| add(sum, cross(p[0], p[1])));

    let ray = around(ray, points);
    let height = dot(normal, sub(ray.org, first));
    let Some(root) = linear(dot(normal, ray.dir), height, ray.reach) else {
        return;
    };
    let n = values(normal);
    let axis = (0..3).fold(0, |k, i| if n[i].abs() > n[k].abs() { i } else { k });
    let hit = sub(ray.at(root.t), first);
    let seen = |v: Approx3| [v[(axis + 1) % 3], v[(axis + 2) % 3]];
    let corners: Vec<[Approx; 2]> = about.iter().map(|p| seen(*p)).collect();
    let exists = root.exists.and(inside(seen(hit), &corners));
    if !exists.is_no() {
        out.push(ray.crossing(root.t, exists, n));
    }
}

/// Even-odd. Certain unless the point is on an edge within its error: nothing
/// else could change the count.
fn inside(p: [Approx; 2], corners: &[[Approx; 2]]) -> Verdict {
    let mut verdict = Verdict::NO;
    for (i, b) in corners.iter().enumerate() {
        let a = corners[(i + corners.len() - 1) % corners.len()];
        let (a, b) = ([a[0] - p[0], a[1] - p[1]], [b[0] - p[0], b[1] - p[1]]);
        let turn = a[0] * b[1] - a[1] * b[0];
        if (a[1].value > 0.0) != (b[1].value > 0.0) && (turn.value > 0.0) == (b[1].value > 0.0) {
            verdict.holds = !verdict.holds;
        }
        let beside =
            |k: usize| (a[k].lo() > 0.0 && b[k].lo() > 0.0) || (a[k].hi() < 0.0 && b[k].hi() < 0.0);
        if !(turn.is_signed() || beside(0) || beside(1)) {
            verdict.certain = false;
        }
    }
    verdict
}
