//! Surfaces as polynomials in the tables' own numbers.

use super::Line;
use crate::geom::formula::{Formula, border, value_and_gradient};
use crate::geom::implicit;
use crate::geom::triangle::Corners;
use crate::geom::{Cone, Quadric, Tape};
use crate::math::bounds::UNIT;
use crate::math::number::{cross, dot};
use crate::math::{ExactSign, Number};
use glam::DVec3;

/// A surface on which a polynomial is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::geom) enum Surface<'a> {
    /// The plane n·x = offset.
    Plane {
        normal: [f64; 3],
        offset: f64,
    },
    /// The plane n·(x − p) = 0.
    PlaneThrough {
        normal: [f64; 3],
        point: [f64; 3],
    },
    /// The plane of a cone's base or top.
    Cap {
        cone: Cone,
        at_top: bool,
    },
    /// The plane of a triangle.
    Facet(Corners),
    Sphere {
        center: [f64; 3],
        radius: f64,
    },
    Ellipsoid {
        center: [f64; 3],
        radii: [f64; 3],
    },
    /// The quadric with ten coefficients as in `Quadric`.
    Quadric([f64; 10]),
    /// The zeros of a polynomial of any degree.
    Implicit(&'a Tape),
    /// The zeros of a formula, at the t on the line that the search defines.
    LevelSet {
        formula: &'a Formula,
        t: f64,
    },
    /// The side of a cone, unbounded in both directions and mirrored beyond its apex.
    Side(Cone),
}

impl Surface<'_> {
    /// Returns the outward normal, of any length, in f64, of the surface near the line's point at
    /// `t`.
    pub fn normal_near(&self, line: &Line, t: f64) -> DVec3 {
        let (org, dir) = (DVec3::from_array(line.org), DVec3::from_array(line.dir));
        // The centre is subtracted before t d is added, because far origins would round the sum.
        let from = |center: DVec3| (org - center) + dir * t;
        match self {
            Surface::Plane { normal, .. } | Surface::PlaneThrough { normal, .. } => {
                DVec3::from_array(*normal)
            }
            Surface::Cap { cone, at_top } => {
                let axis = cone.top - cone.base;
                if *at_top { axis } else { -axis }
            }
            Surface::Facet(corners) => {
                let [a, b, c] = corners.map(|c| DVec3::from_array(c.map(f64::from)));
                (b - a).cross(c - a)
            }
            Surface::Sphere { center, .. } => from(DVec3::from_array(*center)),
            Surface::Ellipsoid { center, radii } => {
                let radii = DVec3::from_array(*radii);
                from(DVec3::from_array(*center)) / radii / radii
            }
            Surface::Quadric(coefficients) => Quadric {
                coefficients: *coefficients,
            }
            .normal_at(from(DVec3::ZERO)),
            Surface::Implicit(tape) => implicit::gradient_at(tape, from(DVec3::ZERO)),
            Surface::LevelSet { formula, .. } => {
                let at = from(DVec3::ZERO).to_array();
                let gradient = || value_and_gradient(formula, at).1;
                let there = border(formula, (line.org, line.dir), t, UNIT);
                there.map_or_else(gradient, |there| there.normal).into()
            }
            Surface::Side(cone) => Cone {
                base: DVec3::ZERO,
                top: cone.top - cone.base,
                open: true,
                ..*cone
            }
            .normal_at(from(cone.base)),
        }
    }

    /// Returns a number that tells the faces of one primitive apart. Planes differ by their
    /// coefficients, and triangles by their corners; all other kinds have one face each, but
    /// cones three.
    pub fn number(&self) -> u64 {
        let folded = |kind: u64, numbers: &[f64]| {
            let fold = |sum: u64, x: &f64| (sum ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
            numbers.iter().fold(kind, fold)
        };
        match self {
            Surface::Plane { normal, offset } => {
                let [x, y, z] = *normal;
                folded(0xcbf2_9ce4_8422_2325, &[x, y, z, *offset])
            }
            Surface::PlaneThrough { normal, point } => {
                let ([a, b, c], [x, y, z]) = (*normal, *point);
                folded(0x6c62_272e_07bb_0142, &[a, b, c, x, y, z])
            }
            Surface::Cap { at_top, .. } => 1 + u64::from(*at_top),
            Surface::Facet(corners) => {
                let [a, b, c] = corners.map(|c| c.map(f64::from));
                folded(0x517c_c1b7_2722_0a95, [a, b, c].as_flattened())
            }
            Surface::Sphere { .. } => 4,
            Surface::Ellipsoid { .. } => 5,
            Surface::Quadric(_) => 6,
            Surface::Implicit(_) => 7,
            Surface::LevelSet { .. } => 8,
            Surface::Side(_) => 9,
        }
    }

    /// Returns [a, b, c] of f(t) = a t² + 2b t + c along the line, with t counted from `shift`. f
    /// is below zero inside, or on the side of a plane opposite to its normal.
    ///
    /// The coefficients are polynomials in the inputs of degree 6 at most (D11,
    /// docs/numerics/exact.md), homogeneous except in t and, for quadrics, of degree 3 with terms
    /// of different degrees.
    #[inline(always)]
    pub fn on_line<N: Number>(&self, space: N::Space, line: &Line, shift: f64) -> [N; 3] {
        let number = |x: f64| N::of(space, x);
        let of = |v: &[f64; 3]| v.map(number);
        let minus = |x: &[f64; 3], y: &[f64; 3]| -> [N; 3] {
            std::array::from_fn(|k| N::displaced(space, x[k], 0.0, 0.0, y[k]))
        };
        let axis = |cone: &Cone| minus(&cone.top.to_array(), &cone.base.to_array());
        let dir = of(&line.dir);
        let from = |point: &[f64; 3]| -> [N; 3] {
            std::array::from_fn(|k| N::displaced(space, line.org[k], shift, line.dir[k], point[k]))
        };
        // Twice n·(o − p) + (n·d) t.
        let plane = |normal: &[N; 3], at: N| [number(0.0), dot(normal, &dir), at.doubled()];
        match self {
            Surface::Plane { normal, offset } => {
                let normal = of(normal);
                let at = dot(&normal, &from(&[0.0; 3])).minus(&number(*offset));
                plane(&normal, at)
            }
            Surface::PlaneThrough { normal, point } => {
                let normal = of(normal);
                let at = dot(&normal, &from(point));
                plane(&normal, at)
            }
            Surface::Cap { cone, at_top } => {
                let axis = axis(cone);
                let point = if *at_top { cone.top } else { cone.base };
                let at = dot(&axis, &from(&point.to_array()));
                plane(&axis, at)
            }
            Surface::Facet(corners) => {
                let [a, b, c] = corners.map(|c| c.map(f64::from));
                let normal = cross(&minus(&b, &a), &minus(&c, &a));
                let at = dot(&normal, &from(&a));
                plane(&normal, at)
            }
            Surface::Sphere { center, radius } => {
                let near = from(center);
                let c = dot(&near, &near).minus(&number(*radius).squared());
                [dot(&dir, &dir), dot(&near, &dir), c]
            }
            Surface::Ellipsoid { center, radii } => {
                let near = from(center);
                let [x, y, z] = of(radii).map(|r| r.squared());
                let weights = [y.times(&z), z.times(&x), x.times(&y)];
                let weighted =
                    |v: &[N; 3]| -> [N; 3] { std::array::from_fn(|k| v[k].times(&weights[k])) };
                let (far, steep) = (weighted(&near), weighted(&dir));
                let c = dot(&near, &far).minus(&x.times(&weights[0]));
                [dot(&dir, &steep), dot(&near, &steep), c]
            }
            Surface::Quadric(coefficients) => {
                let [a, b, c, d, e, f, g, h, i, j] = coefficients.map(number);
                let linear = [g, h, i];
                // Twice q is x·(Hx) + 2 l·x + 2j.
                let rows = [
                    [a.doubled(), d, e],
                    [d, b.doubled(), f],
                    [e, f, c.doubled()],
                ];
                let near = from(&[0.0; 3]);
                let along = rows.map(|row| dot(&row, &dir));
                let slope = dot(&along, &near).plus(&dot(&linear, &dir));
                let squares = dot(&rows.map(|row| dot(&row, &near)), &near);
                let rest = dot(&linear, &near).plus(&j).doubled();
                [dot(&along, &dir), slope, squares.plus(&rest)]
            }
            // A polynomial of any degree: see `restriction.rs`.
            Surface::Implicit(_) => [(); 3].map(|_| number(0.0)),
            // The difference of t and that number.
            Surface::LevelSet { t, .. } => {
                let at = N::displaced(space, 0.0, shift, 1.0, *t);
                [number(0.0), number(0.5), at]
            }
            Surface::Side(cone) => {
                let axis = axis(cone);
                let near = from(&cone.base.to_array());
                let (base, top) = (number(cone.base_radius), number(cone.top_radius));
                let length = dot(&axis, &axis);
                // L|w|² − h² = |w × a|² (Lagrange's identity) does not cancel along the axis.
                let (across, drift) = (cross(&near, &axis), cross(&dir, &axis));
                if cone.base_radius == cone.top_radius {
                    // The polynomial of a cylinder, divided by L.
                    let c = dot(&across, &across).minus(&base.squared().times(&length));
                    return [dot(&drift, &drift), dot(&across, &drift), c];
                }
                let growth = top.minus(&base);
                let radius = base.times(&length).plus(&growth.times(&dot(&near, &axis)));
                let widening = growth.times(&dot(&dir, &axis));
                let form = |p: &[N; 3], q: &[N; 3], r: &N, s: &N| {
                    length.times(&dot(p, q)).minus(&r.times(s))
                };
                [
                    form(&drift, &drift, &widening, &widening),
                    form(&across, &drift, &radius, &widening),
                    form(&across, &across, &radius, &radius),
                ]
            }
        }
    }

    /// Returns [a, b, c] from the line's origin, in numbers with exact signs.
    #[inline(never)]
    pub fn on_line_exactly<N: ExactSign>(&self, space: N::Space, line: &Line) -> [N; 3] {
        self.on_line(space, line, 0.0)
    }
}
