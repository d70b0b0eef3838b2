//! Closed formulas for the figures of primitives under any linear map.
//!
//! Volumes, centroids and second moments transform exactly with the map. Areas do not:
//! - of an ellipsoid, 4π R_G(b²c², c²a², a²b²) with Carlson's symmetric integrals (DLMF
//!   19.33.1), whose duplication converges by a factor of four a step;
//! - of the sides of cones and cylinders, and of a torus, the trapezoidal rule over whole
//!   periods, which converges exponentially (Trefethen and Weideman, The Exponentially
//!   Convergent Trapezoidal Rule, 2014); its error is the difference to half the points.
//!
//! Everything is computed from axes that are mapped first and then divided by the unit, so
//! no square overflows or underflows.

use super::body::{Body, Method, ROUNDINGS};
use super::moments::{Symmetric, eigenvalues, outer, plus};
use super::triangles;
use glam::{DVec2, DVec3};
use lanecast_model::geom::implicit::torus;
use lanecast_model::geom::{Cone, HalfSpace, PrismRow, Quadric};
use lanecast_model::scene::{Scene, Shape, ShapeId, shape_bounds};
use lanecast_numerics::math::Affine;
use std::cell::Cell;
use std::f64::consts::PI;

/// Figures about `center`, which is in object space.
pub struct Found {
    pub body: Body,
    pub center: DVec3,
}

/// A linear map to lengths of the unit.
struct Map<'a> {
    linear: &'a Affine,
    unit: f64,
}

impl Map<'_> {
    fn vector(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(self.linear.vector(v.to_array())) / self.unit
    }
}

/// Returns the figures of a primitive that has formulas for them, under the linear part of
/// a map and in lengths of `unit`; `None` of all other shapes.
pub fn closed_form(scene: &Scene, id: ShapeId, linear: &Affine, unit: f64) -> Option<Found> {
    let map = &Map { linear, unit };
    let (body, center) = match scene.shapes.row(id) {
        Shape::Sphere(id) => {
            let row = scene.spheres.row(id);
            let axes = DVec3::AXES.map(|axis| map.vector(axis * row.radius));
            (ellipsoid(axes), row.center)
        }
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            let axes = [0, 1, 2].map(|k| map.vector(DVec3::AXES[k] * row.radii[k]));
            (ellipsoid(axes), row.center)
        }
        Shape::Cuboid(id) => {
            let row = scene.cuboids.row(id);
            let size = row.max - row.min;
            let sides = [0, 1, 2].map(|k| map.vector(DVec3::AXES[k] * size[k]));
            (cuboid(sides), row.min + size * 0.5)
        }
        Shape::Cylinder(id) => cone(map, &scene.cylinders.row(id).as_cone())?,
        Shape::Cone(id) => cone(map, &scene.cones.row(id))?,
        Shape::Prism(row) => {
            let center = shape_bounds(scene, id)?.center();
            (prism(map, &scene.prisms.row(row), center)?, center)
        }
        Shape::Polyhedron(id) => {
            let points = scene.polyhedra.points(id);
            let center = points.iter().sum::<DVec3>() / points.len() as f64;
            (
                polyhedron(map, scene.polyhedra.planes(id), points, center)?,
                center,
            )
        }
        Shape::Quadric(id) => {
            let (axes, center, relative) = axes_of(&scene.quadrics.row(id))?;
            let mut body = ellipsoid(axes.map(|axis| map.vector(axis)));
            body.volume_error += relative * body.volume;
            body.area_error += relative * body.area;
            body.centroid_error += relative;
            body.spread_error += relative * body.spread[..3].iter().sum::<f64>();
            (body, center)
        }
        Shape::Implicit(id) => {
            let row = scene.implicits.row(id);
            let [major, minor] = torus::radii_of(row.tape)?;
            (ring(map, major, minor)?, DVec3::ZERO)
        }
        _ => return None,
    };
    (body.volume > 0.0 && body.volume.is_finite()).then_some(Found { body, center })
}

/// Returns |det|, and a bound on its roundings.
fn volume_of([a, b, c]: [DVec3; 3]) -> (f64, f64) {
    let det = a.dot(b.cross(c)).abs();
    (det, ROUNDINGS * a.length() * b.length() * c.length())
}

/// Makes a body about its centre.
fn about_center(
    (volume, volume_error): (f64, f64),
    (area, area_error): (f64, f64),
    spread: Symmetric,
) -> Body {
    let trace: f64 = spread[..3].iter().sum();
    Body {
        volume,
        volume_error,
        area,
        area_error: area_error + ROUNDINGS * area,
        spread,
        spread_error: trace * (ROUNDINGS + volume_error / volume),
        method: Method::ClosedForm,
        area_method: Method::ClosedForm,
        ..Body::default()
    }
}

/// The image of the unit ball under the matrix of these columns.
fn ellipsoid(axes: [DVec3; 3]) -> Body {
    let (det, error) = volume_of(axes);
    let volume = 4.0 / 3.0 * PI * det;
    let spread = axes
        .map(|axis| outer(axis, volume / 5.0))
        .into_iter()
        .fold([0.0; 6], plus);
    let [a, b, c] = axes;
    // The squares of products of two semi-axes are the eigenvalues of the cofactors'
    // Gram matrix.
    let cofactors = [b.cross(c), c.cross(a), a.cross(b)];
    let gram = cofactors
        .map(|c| outer(c, 1.0))
        .into_iter()
        .fold([0.0; 6], plus);
    let area = 4.0 * PI * carlson_g(eigenvalues(&gram).map(|x| x.max(0.0)));
    about_center((volume, 4.2 * error), (area, 0.0), spread)
}

fn cuboid([a, b, c]: [DVec3; 3]) -> Body {
    let (volume, error) = volume_of([a, b, c]);
    let spread = [a, b, c]
        .map(|side| outer(side, volume / 12.0))
        .into_iter()
        .fold([0.0; 6], plus);
    let area = 2.0 * (a.cross(b).length() + b.cross(c).length() + c.cross(a).length());
    about_center((volume, error), (area, 0.0), spread)
}

/// Carlson's R_G, with R_F and R_D by duplication (Carlson, Numerical Computation of Real
/// or Complex Elliptic Integrals, 1995; DLMF 19.36(i)).
fn carlson_g(mut squares: [f64; 3]) -> f64 {
    squares.sort_by(f64::total_cmp);
    // With the middle one in the last place no terms cancel (DLMF 19.21.10).
    let [x, z, y] = squares;
    if z == 0.0 {
        return 0.5 * y.sqrt();
    }
    let (rf, rd) = carlson_f_and_d(x, y, z);
    0.5 * (z * rf - (x - z) * (y - z) * rd / 3.0 + (x * y / z).sqrt())
}

fn carlson_f_and_d(mut x: f64, mut y: f64, mut z: f64) -> (f64, f64) {
    let (mut power, mut sum) = (1.0, 0.0);
    // Differences fall by four a step: from any f64 to below 1e-3, where the series of
    // degree 5 leave less than a rounding.
    for _ in 0..600 {
        let mean = (x + y + 3.0 * z) / 5.0;
        let most = [x, y, z]
            .map(|v| (v - mean).abs())
            .into_iter()
            .fold(0.0, f64::max);
        if most < 1e-3 * mean {
            break;
        }
        let [p, q, r] = [x, y, z].map(f64::sqrt);
        let lambda = p * q + q * r + r * p;
        sum += power / (r * (z + lambda));
        power *= 0.25;
        [x, y, z] = [x, y, z].map(|v| 0.25 * (v + lambda));
    }
    let mean = (x + y + z) / 3.0;
    let [a, b] = [x, y].map(|v| 1.0 - v / mean);
    let c = -a - b;
    let (e2, e3) = (a * b - c * c, a * b * c);
    let rf = (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / mean.sqrt();
    let mean = (x + y + 3.0 * z) / 5.0;
    let [a, b] = [x, y].map(|v| 1.0 - v / mean);
    let c = -(a + b) / 3.0;
    let (e2, e3) = (a * b - 6.0 * c * c, (3.0 * a * b - 8.0 * c * c) * c);
    let (e4, e5) = (3.0 * (a * b - c * c) * c * c, a * b * c * c * c);
    let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
        - 3.0 * e4 / 22.0
        - 9.0 * e2 * e3 / 52.0
        + 3.0 * e5 / 26.0;
    let rd = 3.0 * sum + power * series / (mean * mean.sqrt());
    (rf, rd)
}

/// Integrates a function of period 2π; returns the integral and an estimate of its error.
fn around(f: impl Fn(f64, f64) -> f64) -> (f64, f64) {
    let mut count = 32_u32;
    let sum = |count: u32, shift: f64| -> f64 {
        let turn = |i: u32| 2.0 * PI * ((f64::from(i) + shift) / f64::from(count));
        let at = |i| {
            let (sin, cos) = libm::sincos(turn(i));
            f(sin, cos)
        };
        (0..count).map(at).sum()
    };
    let mut known = sum(count, 0.0);
    loop {
        let both = known + sum(count, 0.5);
        let step = 2.0 * PI / f64::from(count);
        let (coarse, fine) = (known * step, both * step * 0.5);
        let error = (fine - coarse).abs();
        (known, count) = (both, count * 2);
        if error <= 1e-15 * fine.abs() || count >= 1 << 16 {
            return (fine, error);
        }
    }
}

/// A truncated cone, from its base.
fn cone(map: &Map, cone: &Cone) -> Option<(Body, DVec3)> {
    if cone.open {
        return None;
    }
    let radius = cone.base_radius.max(cone.top_radius);
    let axis = cone.top - cone.base;
    let along = axis / axis.abs().max_element();
    let (e, f) = (along / along.length()).any_orthonormal_pair();
    let [h, e, f] = [axis, e * radius, f * radius].map(|v| map.vector(v));
    let (a, b) = (cone.base_radius / radius, cone.top_radius / radius);
    let (det, error) = volume_of([h, e, f]);
    // ∫ sʲ r(s)² ds from 0 to 1, and ∫ r⁴ ds.
    let m0 = (a * a + a * b + b * b) / 3.0;
    let m1 = (a * a + 2.0 * a * b + 3.0 * b * b) / 12.0;
    let m2 = (a * a + 3.0 * a * b + 6.0 * b * b) / 30.0;
    let quartic = (a * a * (a * a + a * b + b * b) + (a + b) * b * b * b) / 5.0;
    let middle = m1 / m0;
    let along = outer(h, PI * det * (m2 - middle * m1));
    let across = PI * det * quartic / 4.0;
    let spread = plus(along, plus(outer(e, across), outer(f, across)));
    let caps = PI * (a * a + b * b) * e.cross(f).length();
    let (he, hf, ef) = (h.cross(e), h.cross(f), e.cross(f));
    let (side, side_error) = around(|sin, cos| (he * -sin + hf * cos + ef * (b - a)).length());
    let mean = 0.5 * (a + b);
    let area = (caps + mean * side, mean * side_error);
    let mut body = about_center((PI * m0 * det, PI * error), area, spread);
    body.centroid_error = ROUNDINGS * h.length();
    Some((body, cone.base + axis * middle))
}

/// A torus about y that does not pass through itself.
fn ring(map: &Map, major: f64, minor: f64) -> Option<Body> {
    if minor > major {
        return None;
    }
    // Axes at the size of the outer radius.
    let outermost = major + minor;
    let (r, t) = (major / outermost, minor / outermost);
    let [x, y, z] = DVec3::AXES.map(|axis| map.vector(axis * outermost));
    let (det, error) = volume_of([x, y, z]);
    let own = 2.0 * PI * PI * r * t * t;
    let wide = own * det * (r * r + 0.75 * t * t) * 0.5;
    let high = own * det * t * t * 0.25;
    let spread = plus(outer(y, high), plus(outer(x, wide), outer(z, wide)));
    let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
    // The normal of the torus, mapped by the cofactors, over both angles.
    let tube_error = Cell::new(0.0_f64);
    let (area, area_error) = around(|sin, cos| {
        let (tube, error) = around(|s, c| {
            let normal = cofactors[0] * (c * cos) + cofactors[1] * s + cofactors[2] * (c * sin);
            normal.length() * t * (r + t * c)
        });
        tube_error.set(tube_error.get().max(error));
        tube
    });
    let area = (area, area_error + 2.0 * PI * tube_error.get());
    Some(about_center((own * det, own * error), area, spread))
}

/// A prism about a point of its own space: Green's formulas for its outline.
fn prism(map: &Map, row: &PrismRow, center: DVec3) -> Option<Body> {
    let [x, y, z] = DVec3::AXES;
    let height = row.height();
    // The outline at the size of 1.
    let flat = center.truncate();
    let size = row.rings().flatten().fold(0.0, |most: f64, p| {
        most.max((*p - flat).abs().max_element())
    });
    let [x, y, h] = [x * size, y * size, z * height].map(|v| map.vector(v));
    let (det, error) = volume_of([x, y, h]);
    let (mut area, mut first, mut second) = (0.0, DVec2::ZERO, [0.0; 3]);
    let (mut magnitude, mut sides, mut count) = (0.0, 0.0, 0.0);
    for ring in row.rings() {
        let mut a = (*ring.last()? - flat) / size;
        for b in ring {
            let b = (*b - flat) / size;
            let cross = a.perp_dot(b);
            area += cross / 2.0;
            magnitude += (a.x * b.y).abs() + (a.y * b.x).abs();
            first += (a + b) * (cross / 6.0);
            let product = |i: usize, j: usize| {
                let both = a[i] * b[j] + b[i] * a[j];
                cross / 24.0 * (2.0 * (a[i] * a[j] + b[i] * b[j]) + both)
            };
            second[0] += product(0, 0);
            second[1] += product(1, 1);
            second[2] += product(0, 1);
            let edge = x * (b.x - a.x) + y * (b.y - a.y);
            sides += edge.cross(h).length();
            a = b;
            count += 1.0;
        }
    }
    // Plain sums round once a term.
    let relative = ROUNDINGS * magnitude / area + count * f64::EPSILON * magnitude / area;
    let at = first / area;
    let volume = area * det;
    let [xx, yy, xy] = [
        second[0] - area * at.x * at.x,
        second[1] - area * at.y * at.y,
        second[2] - area * at.x * at.y,
    ];
    let mixed: Symmetric = std::array::from_fn(|k| {
        let [i, j] = super::moments::PAIRS[k];
        x[i] * x[j] * xx + y[i] * y[j] * yy + (x[i] * y[j] + y[i] * x[j]) * xy
    });
    let spread = plus(mixed.map(|v| v * det), outer(h, volume / 12.0));
    let caps = 2.0 * area * x.cross(y).length();
    let volume_error = area * error + relative * volume;
    let area_error = (count * f64::EPSILON + relative) * (caps + sides);
    let mut body = about_center((volume, volume_error), (caps + sides, area_error), spread);
    body.spread_error += relative * volume * (x.length_squared() + y.length_squared());
    // Between its caps, about the centre of its box.
    let up = map.vector(DVec3::new(0.0, 0.0, 0.5 * height - center.z));
    body.centroid = x * at.x + y * at.y + up;
    body.centroid_error = relative * (x.length() + y.length()) + ROUNDINGS * h.length();
    Some(body)
}

/// A convex polyhedron about a point of its own space: each face is the polygon of the
/// corners on its plane.
fn polyhedron(map: &Map, planes: &[HalfSpace], points: &[DVec3], center: DVec3) -> Option<Body> {
    let about: Vec<DVec3> = points.iter().map(|p| *p - center).collect();
    let size = about
        .iter()
        .fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    let mut faces: Vec<[DVec3; 3]> = Vec::new();
    // How far corners lie from the planes, of the size.
    let mut off = 0.0_f64;
    for plane in planes {
        let scale = plane.normal.abs().max_element();
        let normal = (plane.normal / scale).normalize();
        let length = (plane.normal / scale).length();
        let offset = plane.offset / scale / length - normal.dot(center);
        let height = |p: &&DVec3| (normal.dot(**p) - offset) / size;
        let corners: Vec<&DVec3> = about.iter().filter(|p| height(p).abs() <= 1e-9).collect();
        off = corners.iter().map(|p| height(p).abs()).fold(off, f64::max);
        let middle = corners.iter().copied().sum::<DVec3>() / corners.len().max(1) as f64;
        let (u, v) = normal.any_orthonormal_pair();
        let turn = |p: &&DVec3| libm::atan2((**p - middle).dot(v), (**p - middle).dot(u));
        let mut around: Vec<(f64, DVec3)> = corners.iter().map(|p| (turn(p), **p)).collect();
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        for i in 2..around.len() {
            let [a, b, c] = [around[0].1, around[i - 1].1, around[i].1];
            let corners = [a, b, c].map(|p| map.vector(p));
            faces.push(corners);
        }
    }
    let mut body = triangles::body(faces.into_iter())?;
    // The planes are the solid: it differs from the corners' hull by at most a layer of
    // that thickness.
    let [x, y, z] = DVec3::AXES.map(|axis| map.vector(axis * size));
    let reach = x.length() + y.length() + z.length();
    let layer = off * reach * body.area;
    body.volume_error += layer;
    body.area_error += off * reach * 8.0 * reach;
    body.centroid_error += layer * reach / body.volume;
    body.spread_error += layer * reach * reach;
    Some(body)
}

/// Returns the semi-axes (columns of a matrix), the centre and the relative error of the
/// ellipsoid that a quadric is; `None` of other quadrics, and where f64 knows too little.
fn axes_of(row: &Quadric) -> Option<([DVec3; 3], DVec3, f64)> {
    row.bounds()?;
    let own = row.coefficients;
    let most = own[..6].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let power = -libm::ilogb(most);
    let [a, b, c, d, e, f, g, h, i, j] = own.map(|x| libm::scalbn(x, power));
    // q = xᵀMx + l·x + j, and M = LLᵀ.
    let (d, e, f) = (0.5 * d, 0.5 * e, 0.5 * f);
    let l11 = a.sqrt();
    let (l21, l31) = (d / l11, e / l11);
    let l22 = (b - l21 * l21).sqrt();
    let l32 = (f - l31 * l21) / l22;
    let l33 = (c - l31 * l31 - l32 * l32).sqrt();
    let forward = |v: DVec3| {
        let x = v.x / l11;
        let y = (v.y - l21 * x) / l22;
        DVec3::new(x, y, (v.z - l31 * x - l32 * y) / l33)
    };
    let back = |v: DVec3| {
        let z = v.z / l33;
        let y = (v.y - l32 * z) / l22;
        DVec3::new((v.x - l21 * y - l31 * z) / l11, y, z)
    };
    let half = forward(DVec3::new(g, h, i) * -0.5);
    let center = back(half);
    let level = half.length_squared() - j;
    let radius = level.sqrt();
    let axes = DVec3::AXES.map(|axis| back(axis) * radius);
    let inverse: f64 = axes.iter().map(|v| v.length_squared()).sum::<f64>() / level;
    let condition = inverse * (a + b + c);
    let lost = (half.length_squared() + j.abs()) / level;
    let relative = ROUNDINGS * (condition + lost * condition);
    let is_known = relative < 1e-6 && center.is_finite() && axes.iter().all(|v| v.is_finite());
    is_known.then_some((axes, center, relative))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// R_G(x, x, x) = √x, R_G(0, x, x) = π/4 √x, R_G(0, 0, x) = √x / 2; and the value of
    /// DLMF's example R_G(2, 3, 4).
    #[test]
    fn symmetric_integrals() {
        let near = |squares, wanted: f64| {
            let found = carlson_g(squares);
            assert!(
                (found - wanted).abs() <= 4e-16 * wanted,
                "{squares:?} {found} {wanted}"
            );
        };
        near([4.0, 4.0, 4.0], 2.0);
        near([4.0, 0.0, 4.0], PI / 2.0);
        near([0.0, 9.0, 0.0], 1.5);
        near([2.0, 3.0, 4.0], 1.725_503_028_069_227_8);
        near([0.0, 0.0796, 4.0], 1.028_475_809_028_804);
    }
}
