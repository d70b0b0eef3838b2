//! Spheres, ellipsoids, cylinders and truncated cones: quadratics.

use super::approx::*;
use super::ray::{Crossing, Ray, length};
use super::roots::{linear, quadratic};
use crate::geom::{Cone, Cylinder, Ellipsoid, Sphere};

/// |p − c|² = r².
pub fn sphere(ray: &Ray, shape: &Sphere, out: &mut Vec<Crossing>) {
    let center = shape.center.to_array();
    let ray = ray.near(center, shape.radius);
    let w = sub(ray.org, exact3(center));
    let a = dot(ray.dir, ray.dir);
    let b = dot(w, ray.dir);
    let c = dot(w, w) - Approx::exact(shape.radius).squared();
    for root in quadratic(a, b, c, ray.reach).into_iter().flatten() {
        let normal = values(add(w, scaled(ray.dir, root.t)));
        out.push(ray.crossing(root.t, root.exists, normal));
    }
}

/// The unit sphere after division by the radii.
pub fn ellipsoid(ray: &Ray, shape: &Ellipsoid, out: &mut Vec<Crossing>) {
    let center = shape.center.to_array();
    let radii = exact3(shape.radii.to_array());
    let ray = ray.near(center, shape.radii.max_element());
    let over_radii = |v: Approx3| -> Approx3 { std::array::from_fn(|k| v[k] / radii[k]) };
    let w = over_radii(sub(ray.org, exact3(center)));
    let d = over_radii(ray.dir);
    let c = dot(w, w) - Approx::exact(1.0);
    for root in quadratic(dot(d, d), dot(w, d), c, ray.reach)
        .into_iter()
        .flatten()
    {
        // The gradient: divided by the radii once more.
        let normal = values(over_radii(add(w, scaled(d, root.t))));
        out.push(ray.crossing(root.t, root.exists, normal));
    }
}

/// A cone of equal radii.
pub fn cylinder(ray: &Ray, shape: &Cylinder, out: &mut Vec<Crossing>) {
    let cone = Cone {
        base: shape.base,
        top: shape.top,
        base_radius: shape.radius,
        top_radius: shape.radius,
        open: shape.open,
    };
    self::cone(ray, &cone, out);
}

/// With s from 0 at the base to 1 at the top, the side is where the distance
/// from the axis is r₀ + (r₁ − r₀)·s, 0 ≤ s ≤ 1.
pub fn cone(ray: &Ray, shape: &Cone, out: &mut Vec<Crossing>) {
    let (base, top) = (shape.base.to_array(), shape.top.to_array());
    let middle = std::array::from_fn(|k| base[k] * 0.5 + top[k] * 0.5);
    let half: [f64; 3] = std::array::from_fn(|k| top[k] * 0.5 - base[k] * 0.5);
    let ray = ray.near(
        middle,
        length(half) + f64::max(shape.base_radius, shape.top_radius),
    );
    let axis = sub(exact3(top), exact3(base));
    let height2 = dot(axis, axis);
    let from_base = sub(ray.org, exact3(base));

    // s and the distance from the axis along the ray: s0 + t·sd, |w + t·e|.
    let s0 = dot(from_base, axis) / height2;
    let sd = dot(ray.dir, axis) / height2;
    let w = sub(from_base, scaled(axis, s0));
    let e = sub(ray.dir, scaled(axis, sd));
    // The radius along the ray: rho + t·sigma.
    let base_radius = Approx::exact(shape.base_radius);
    let top_radius = Approx::exact(shape.top_radius);
    let widening = top_radius - base_radius;
    let rho = base_radius + widening * s0;
    let sigma = widening * sd;

    let a = dot(e, e) - sigma.squared();
    let b = dot(w, e) - rho * sigma;
    let c = dot(w, w) - rho.squared();
    for root in quadratic(a, b, c, ray.reach).into_iter().flatten() {
        let s = s0 + root.t * sd;
        let between = s.at_least_zero().and(Approx::exact(1.0).at_least(s));
        let exists = root.exists.and(between);
        if exists.is_no() {
            continue;
        }
        // The gradient of |w|² − radius².
        let outward = add(w, scaled(e, root.t));
        let slope = (rho + root.t * sigma) * widening / height2;
        let normal = values(sub(outward, scaled(axis, slope)));
        out.push(ray.crossing(root.t, exists, normal));
    }
    if shape.open {
        return;
    }
    for (end, radius, outward) in [(0.0, base_radius, -1.0), (1.0, top_radius, 1.0)] {
        let Some(root) = linear(sd, s0 - Approx::exact(end), ray.reach) else {
            continue;
        };
        let p = add(w, scaled(e, root.t));
        let exists = root.exists.and(radius.squared().at_least(dot(p, p)));
        if radius.value > 0.0 && !exists.is_no() {
            let normal = values(axis).map(|x| x * outward);
            out.push(ray.crossing(root.t, exists, normal));
        }
    }
}
