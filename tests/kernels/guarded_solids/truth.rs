//! The oracle for a ray and a primitive: polynomials in t with exact coefficients.

use super::cases::{Case, Kind};
use crate::number::{Exact, Quotient, Vector, dot, minus, vector};
use std::cmp::Ordering;

/// c₀ + c₁ t ≤ 0.
struct Linear([Exact; 2]);

/// C + 2B t + A t².
struct Quadratic {
    a: Exact,
    b: Exact,
    c: Exact,
}

/// What bounds a primitive.
pub struct Truth {
    planes: Vec<Linear>,
    side: Option<Quadratic>,
    /// The side is all there is.
    open: bool,
    /// The side need not be convex: where it only touches zero from below, nothing is.
    bends_both_ways: bool,
    /// A half-space's, a polygon's or a triangle's t, if the line meets it.
    plane: Option<Option<Quotient>>,
}

/// A boundary that a ray meets first.
#[derive(Clone, Debug)]
pub enum Place {
    At(Quotient),
    /// The lower or upper root of the side.
    Root(usize),
}

impl Linear {
    fn sign(&self, t: &Quotient) -> Ordering {
        (&(&self.0[0] * &t.bottom) + &(&self.0[1] * &t.top)).sign()
    }

    fn zero(&self) -> Option<Quotient> {
        let [c, slope] = &self.0;
        slope
            .sign()
            .is_ne()
            .then(|| Quotient::new(-c, slope.clone()))
    }
}

impl Quadratic {
    fn sign(&self, t: &Quotient) -> Ordering {
        let (p, q) = (&t.top, &t.bottom);
        let two_b = &self.b + &self.b;
        let inner = &(&self.a * p) + &(&two_b * q);
        (&(&inner * p) + &(&(&self.c * q) * q)).sign()
    }

    fn discriminant(&self) -> Ordering {
        (&(&self.b * &self.b) - &(&self.a * &self.c)).sign()
    }

    /// How many different roots.
    fn count(&self) -> usize {
        match (self.a.sign().is_eq(), self.b.sign().is_eq()) {
            (true, true) => 0,
            (true, false) => 1,
            _ => match self.discriminant() {
                Ordering::Less => 0,
                Ordering::Equal => 1,
                Ordering::Greater => 2,
            },
        }
    }

    /// A root against t.
    fn order(&self, root: usize, t: &Quotient) -> Ordering {
        if self.a.sign().is_eq() {
            let two_b = &self.b + &self.b;
            return Quotient::new(-&self.c, two_b).order(t);
        }
        let vertex = Quotient::new(-&self.b, self.a.clone());
        if self.discriminant().is_eq() {
            return vertex.order(t);
        }
        let before = t.order(&vertex).is_le();
        // Times the sign of A: positive outside the roots.
        let sign = match self.a.sign() {
            Ordering::Less => self.sign(t).reverse(),
            _ => self.sign(t),
        };
        match (root, before) {
            (0, true) => sign,
            (0, false) => Ordering::Less,
            (_, true) => Ordering::Greater,
            (_, false) => sign.reverse(),
        }
    }
}

impl Truth {
    pub fn of(case: &Case) -> Truth {
        let (org, dir) = (vector(case.org), vector(case.dir));
        let mut truth = Truth {
            planes: Vec::new(),
            side: None,
            open: false,
            bends_both_ways: false,
            plane: None,
        };
        let plane = |normal: &Vector, offset: &Exact| {
            Linear([&dot(normal, &org) - offset, dot(normal, &dir)])
        };
        match &case.kind {
            Kind::Sphere(s) => {
                let from = minus(&org, &vector(s.center.to_array()));
                let radius = Exact::from(s.radius);
                truth.side = Some(Quadratic {
                    a: dot(&dir, &dir),
                    b: dot(&from, &dir),
                    c: &dot(&from, &from) - &(&radius * &radius),
                });
            }
            Kind::Ellipsoid(e) => {
                let [x, y, z] = vector(e.radii.to_array());
                let by = [&y * &z, &z * &x, &x * &y];
                let times = |v: &Vector| [0, 1, 2].map(|k| &v[k] * &by[k]);
                let from = times(&minus(&org, &vector(e.center.to_array())));
                let dir = times(&dir);
                let all = &by[0] * &x;
                truth.side = Some(Quadratic {
                    a: dot(&dir, &dir),
                    b: dot(&from, &dir),
                    c: &dot(&from, &from) - &(&all * &all),
                });
            }
            Kind::Quadric(row) => {
                // Twice q is x·(Hx) + 2 l·x + 2j.
                let [a, b, c, d, e, f, g, h, i, j] = row.coefficients.map(Exact::from);
                let [aa, bb, cc, jj] = [&a, &b, &c, &j].map(|x| x + x);
                let rows = [[aa, d.clone(), e.clone()], [d, bb, f.clone()], [e, f, cc]];
                let times = |v: &Vector| [0, 1, 2].map(|k| dot(&rows[k], v));
                let linear = [g, h, i];
                let level = dot(&linear, &org);
                truth.side = Some(Quadratic {
                    a: dot(&dir, &times(&dir)),
                    b: &dot(&org, &times(&dir)) + &dot(&linear, &dir),
                    c: &(&dot(&org, &times(&org)) + &(&level + &level)) + &jj,
                });
                truth.bends_both_ways = true;
            }
            Kind::Cone(cone) => {
                let base = vector(cone.base.to_array());
                let axis = minus(&vector(cone.top.to_array()), &base);
                let length = dot(&axis, &axis);
                let w = minus(&org, &base);
                let (h0, h1) = (dot(&w, &axis), dot(&dir, &axis));
                let (r0, r1) = (Exact::from(cone.base_radius), Exact::from(cone.top_radius));
                let grow = &r1 - &r0;
                // L²|w|² − L h² − (r₀ L + (r₁ − r₀) h)²
                let (s0, s1) = (&(&r0 * &length) + &(&grow * &h0), &grow * &h1);
                let squared = &length * &length;
                let term =
                    |ww: Exact, hh: Exact, ss: Exact| &(&(&squared * &ww) - &(&length * &hh)) - &ss;
                truth.side = Some(Quadratic {
                    a: term(dot(&dir, &dir), &h1 * &h1, &s1 * &s1),
                    b: term(dot(&w, &dir), &h0 * &h1, &s0 * &s1),
                    c: term(dot(&w, &w), &h0 * &h0, &s0 * &s0),
                });
                truth.planes.push(Linear([-&h0, -&h1]));
                truth.planes.push(Linear([&h0 - &length, h1]));
                truth.open = cone.open;
            }
            Kind::Cuboid(c) => {
                for k in 0..3 {
                    let (o, d) = (&org[k], &dir[k]);
                    let (low, high) = (Exact::from(c.min[k]), Exact::from(c.max[k]));
                    truth.planes.push(Linear([&low - o, -d]));
                    truth.planes.push(Linear([o - &high, d.clone()]));
                }
            }
            Kind::Polyhedron(planes, _) => {
                for p in planes {
                    let normal = vector(p.normal.to_array());
                    truth.planes.push(plane(&normal, &p.offset.into()));
                }
            }
            Kind::HalfSpace(p) => {
                let normal = vector(p.normal.to_array());
                truth.plane = Some(plane(&normal, &p.offset.into()).zero());
            }
            Kind::Polygon(points, normal) => {
                let normal = vector(normal.to_array());
                let first = vector(points[0].to_array());
                let at = plane(&normal, &dot(&normal, &first)).zero();
                // Near the corners: in their box, grown by a thousandth of its longest side.
                let least = |k: usize| points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
                let most = |k: usize| points.iter().map(|p| p[k]).fold(-f64::INFINITY, f64::max);
                let margin = (0..3).map(|k| most(k) - least(k)).fold(0.0, f64::max) * 1e-3;
                let side = |t: &Quotient, k: usize, bound: f64| {
                    let mut axis = [0.0; 3];
                    axis[k] = 1.0;
                    let bound = bound.clamp(-f64::MAX, f64::MAX);
                    plane(&vector(axis), &bound.into()).sign(t)
                };
                let near = |t: &Quotient| {
                    (0..3).all(|k| {
                        let low = (least(k) - margin).next_down();
                        let high = (most(k) + margin).next_up();
                        side(t, k, low).is_ge() && side(t, k, high).is_le()
                    })
                };
                let corners: Vec<Vector> = points.iter().map(|p| vector(p.to_array())).collect();
                let met = encloses(&corners, &org, &dir);
                truth.plane = Some(at.filter(|t| met && near(t)));
            }
            Kind::Triangle(corners) => {
                let corners = corners.map(|p| vector(p.map(f64::from)));
                let [a, b, c] = &corners;
                let (u, v) = (minus(b, a), minus(c, a));
                let normal =
                    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &(&u[i] * &v[j]) - &(&u[j] * &v[i]));
                let at = plane(&normal, &dot(&normal, a)).zero();
                let met = encloses(&corners, &org, &dir);
                truth.plane = Some(at.filter(|_| met));
            }
        }
        truth
    }

    fn holds(&self, t: &Quotient) -> bool {
        let within = self.planes.iter().all(|plane| plane.sign(t).is_le());
        within && (self.open || self.side.as_ref().is_none_or(|side| side.sign(t).is_le()))
    }

    /// Against t.
    pub fn order(&self, place: &Place, t: &Quotient) -> Ordering {
        match (place, &self.side) {
            (Place::At(at), _) => at.order(t),
            (Place::Root(root), Some(side)) => side.order(*root, t),
            (Place::Root(_), None) => unreachable!(),
        }
    }

    /// Whether a boundary's place is in the closed solid.
    fn has(&self, place: &Place) -> bool {
        match (place, &self.side) {
            (Place::At(at), _) => self.holds(at),
            (Place::Root(root), Some(side)) => self.planes.iter().all(|plane| {
                let [c, slope] = &plane.0;
                match slope.sign() {
                    Ordering::Equal => c.sign().is_le(),
                    rises => {
                        let zero = Quotient::new(-c, slope.clone());
                        let order = side.order(*root, &zero);
                        order.is_eq() || order == rises.reverse()
                    }
                }
            }),
            _ => unreachable!(),
        }
    }

    /// Where the ray meets the boundary first beyond t_min.
    pub fn first(&self, t_min: f64) -> Option<Place> {
        let beyond = |place: &Place| self.order(place, &t_min.into()).is_gt();
        if let Some(plane) = &self.plane {
            return plane.clone().map(Place::At).filter(beyond);
        }
        let touches = |side: &Quadratic| {
            let concave = side.a.sign().is_lt();
            self.bends_both_ways && concave && side.discriminant().is_eq()
        };
        let side = self.side.as_ref().filter(|side| !touches(side));
        let roots = side.map_or(0, Quadratic::count);
        let roots = (0..roots).map(Place::Root);
        if self.open {
            return roots.filter(|root| self.has(root)).find(beyond);
        }
        // The ends of the part inside are boundaries that lie in the solid; of the
        // others none does but where two coincide.
        let planes = self.planes.iter().filter_map(Linear::zero).map(Place::At);
        let ends: Vec<Place> = roots.chain(planes).filter(|end| self.has(end)).collect();
        // A concave side's ends may both be far from where the caps are.
        let after = ends.iter().filter(|end| beyond(end));
        let earliest = after.reduce(|a, b| if self.before(b, a) { b } else { a });
        earliest.cloned()
    }

    fn before(&self, a: &Place, b: &Place) -> bool {
        match (a, b) {
            (Place::Root(a), Place::Root(b)) => a < b,
            (_, Place::At(t)) => self.order(a, t).is_lt(),
            (Place::At(t), _) => self.order(b, t).is_gt(),
        }
    }
}

/// Whether corners, seen along a ray, have it inside or on an edge.
fn encloses(points: &[Vector], org: &Vector, dir: &Vector) -> bool {
    let Some(k) = (0..3).find(|k| dir[*k].sign().is_ne()) else {
        return false;
    };
    let seen = |p: &Vector| {
        let from = minus(p, org);
        [1, 2].map(|i| {
            let i = (k + i) % 3;
            &(&from[i] * &dir[k]) - &(&dir[i] * &from[k])
        })
    };
    let corners: Vec<[Exact; 2]> = points.iter().map(seen).collect();
    let mut odd = false;
    for i in 0..corners.len() {
        let (a, b) = (&corners[i], &corners[(i + 1) % corners.len()]);
        let side = (&(&a[0] * &b[1]) - &(&a[1] * &b[0])).sign();
        if side.is_eq() {
            // On the edge's line: between its ends?
            let apart = |k: usize| (&a[k] * &b[k]).sign().is_gt();
            if !apart(0) && !apart(1) {
                return true;
            }
        }
        let above = [a, b].map(|p| p[1].sign().is_gt());
        if above[0] != above[1] {
            // The crossing is at x > 0 where this has the sign of the rise.
            odd ^= side.is_gt() == above[1] && side.is_ne();
        }
    }
    odd
}
