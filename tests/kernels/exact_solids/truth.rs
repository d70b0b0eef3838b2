//! The oracle in integers of any length. A solid is a set of polynomials in t that are not
//! above zero, as docs/NUMERICS.md defines it; roots are kept as (u ± √w) / q and compared by
//! squaring.

use super::cases::{Case, Shape};
use crate::number::Exact;
use lanecast::internals::geom::exact::Line;
use std::cmp::Ordering;

/// a + b t + c t².
#[derive(Clone, Debug)]
pub struct Polynomial([Exact; 3]);

impl Polynomial {
    fn constant(x: Exact) -> Polynomial {
        Polynomial([x, Exact::int(0), Exact::int(0)])
    }

    fn plus(&self, other: &Polynomial) -> Polynomial {
        Polynomial(std::array::from_fn(|k| &self.0[k] + &other.0[k]))
    }

    fn minus(&self, other: &Polynomial) -> Polynomial {
        Polynomial(std::array::from_fn(|k| &self.0[k] - &other.0[k]))
    }

    fn times(&self, other: &Polynomial) -> Polynomial {
        let ([a, b, c], [x, y, z]) = (&self.0, &other.0);
        for lost in [b * z, c * y, c * z] {
            assert_eq!(lost.signum(), 0, "of degree two at most");
        }
        Polynomial([
            a * x,
            &(a * y) + &(b * x),
            &(&(a * z) + &(b * y)) + &(c * x),
        ])
    }

    /// In rising order; of none where it does not depend on t.
    fn roots(&self) -> Vec<Root> {
        let [a, b, c] = &self.0;
        let root = |u: Exact, sigma: i32, w: Exact, q: &Exact| {
            let down = q.signum() < 0;
            Root {
                u: if down { -&u } else { u },
                sigma: if down { -sigma } else { sigma },
                w,
                q: if down { -q } else { q.clone() },
            }
        };
        if c.signum() == 0 {
            if b.signum() == 0 {
                return Vec::new();
            }
            return vec![root(-a, 0, Exact::int(0), b)];
        }
        let w = &(b * b) - &(&(a * c) * &Exact::int(4));
        let q = c + c;
        if w.signum() < 0 {
            return Vec::new();
        }
        let both = [-1, 1].map(|sigma| root(-b, sigma * q.signum(), w.clone(), &q));
        both.into()
    }
}

fn sum(terms: [Polynomial; 3]) -> Polynomial {
    let [x, y, z] = terms;
    x.plus(&y).plus(&z)
}

/// (u + σ √w) / q, q > 0.
#[derive(Clone, Debug)]
pub struct Root {
    u: Exact,
    sigma: i32,
    w: Exact,
    q: Exact,
}

/// Of u + v √w.
fn sign_of_two(u: &Exact, v: &Exact, w: &Exact) -> i32 {
    let (s, t) = (u.signum(), v.signum() * w.signum());
    if s == t || t == 0 {
        return s;
    }
    if s == 0 {
        return t;
    }
    s * (&(u * u) - &(&(v * v) * w)).signum()
}

/// Of p + s √x + r √y.
fn sign_of_three(p: &Exact, (s, x): (i32, &Exact), (r, y): (i32, &Exact)) -> i32 {
    let (s, r) = (s * x.signum(), r * y.signum());
    let roots = match (s, r) {
        (0, _) => r,
        (_, 0) => s,
        _ if s == r => s,
        _ => s * (x - y).signum(),
    };
    if roots == 0 || p.signum() == roots {
        return p.signum();
    }
    if p.signum() == 0 {
        return roots;
    }
    // p² against x + y + 2 s r √(x y), of those that are there.
    let there = |s: i32, x: &Exact| if s == 0 { Exact::int(0) } else { x.clone() };
    let (x, y) = (there(s, x), there(r, y));
    let rest = &(&(p * p) - &x) - &y;
    p.signum() * sign_of_two(&rest, &Exact::int(-2 * s * r), &(&x * &y))
}

impl Root {
    pub fn order(&self, other: &Root) -> Ordering {
        let p = &(&self.u * &other.q) - &(&other.u * &self.q);
        let scaled = |w: &Exact, q: &Exact| w * &(q * q);
        let (x, y) = (scaled(&self.w, &other.q), scaled(&other.w, &self.q));
        sign_of_three(&p, (self.sigma, &x), (-other.sigma, &y)).cmp(&0)
    }

    pub fn order_with(&self, x: &Exact) -> Ordering {
        let u = &self.u - &(x * &self.q);
        sign_of_two(&u, &Exact::int(self.sigma), &self.w).cmp(&0)
    }

    fn sign_of(&self, f: &Polynomial) -> i32 {
        let ([a, b, c], Root { u, sigma, w, q }) = (&f.0, self);
        let plain = &(&(c * &(&(u * u) + &(w * &Exact::int(sigma * sigma)))) + &(b * &(u * q)))
            + &(a * &(q * q));
        let with_root = &(&(&(c * u) * &Exact::int(2)) + &(b * q)) * &Exact::int(*sigma);
        sign_of_two(&plain, &with_root, w)
    }

    /// Whether x is the f64 nearest to it, the even one of two.
    pub fn rounds_to(&self, x: f64) -> bool {
        let half = |x: f64| {
            // Halfway to the next number; beyond the last as if there were one.
            let m = Exact::from(x);
            let step = if x == f64::MAX {
                Exact {
                    integer: 1.into(),
                    power: 970,
                }
            } else {
                let gap = &Exact::from(x.next_up()) - &m;
                Exact {
                    power: gap.power - 1,
                    ..gap
                }
            };
            &m + &step
        };
        let even = x.to_bits() & 1 == 0;
        let below = |order: Ordering, tie: bool| order.is_lt() || order.is_eq() && tie;
        let above = |order: Ordering, tie: bool| order.is_gt() || order.is_eq() && tie;
        if x == f64::INFINITY {
            return above(self.order_with(&half(f64::MAX)), true);
        }
        if x == f64::NEG_INFINITY {
            return below(self.order_with(&-&half(f64::MAX)), true);
        }
        let upper = half(x.abs());
        let upper = if x < 0.0 { -&upper } else { upper };
        let outer = self.order_with(&upper);
        let outer = if x < 0.0 {
            above(outer, even)
        } else {
            below(outer, even)
        };
        let inner = if x == 0.0 {
            // Halfway to the least number below.
            above(self.order_with(&-&half(0.0)), true)
        } else {
            let lower = half(x.abs().next_down());
            let lower = if x < 0.0 { -&lower } else { lower };
            let order = self.order_with(&lower);
            if x < 0.0 {
                below(order, even)
            } else {
                above(order, even)
            }
        };
        outer && inner
    }
}

/// What a ray meets of a primitive.
pub struct Truth {
    /// Ends of the span; or of an open side or a polygon, where it is met.
    ends: Vec<Root>,
    /// Some root has an exact twin: a tangent, or a common edge.
    pub twins: bool,
}

fn place(line: &Line) -> [Polynomial; 3] {
    std::array::from_fn(|k| {
        Polynomial([
            Exact::from(line.org[k]),
            Exact::from(line.dir[k]),
            Exact::int(0),
        ])
    })
}

fn constant(v: glam::DVec3) -> [Polynomial; 3] {
    v.to_array().map(|x| Polynomial::constant(Exact::from(x)))
}

fn minus(p: &[Polynomial; 3], q: &[Polynomial; 3]) -> [Polynomial; 3] {
    std::array::from_fn(|k| p[k].minus(&q[k]))
}

fn dot(p: &[Polynomial; 3], q: &[Polynomial; 3]) -> Polynomial {
    sum([0, 1, 2].map(|k| p[k].times(&q[k])))
}

/// The functions of t that are not above zero within; of a cone its side first,
/// then its caps.
fn within(line: &Line, shape: &Shape) -> Vec<Polynomial> {
    let x = place(line);
    let one = |v: f64| Polynomial::constant(Exact::from(v));
    let square = |f: &Polynomial| f.times(f);
    match shape {
        Shape::HalfSpace(plane) => {
            vec![dot(&constant(plane.normal), &x).minus(&one(plane.offset))]
        }
        Shape::Polyhedron(planes) => planes
            .iter()
            .map(|plane| dot(&constant(plane.normal), &x).minus(&one(plane.offset)))
            .collect(),
        Shape::Cuboid(cuboid) => (0..3)
            .flat_map(|k| {
                let (min, max) = (one(cuboid.min[k]), one(cuboid.max[k]));
                [min.minus(&x[k]), x[k].minus(&max)]
            })
            .collect(),
        Shape::Sphere(sphere) => {
            let w = minus(&x, &constant(sphere.center));
            vec![dot(&w, &w).minus(&square(&one(sphere.radius)))]
        }
        Shape::Ellipsoid(ellipsoid) => {
            let w = minus(&x, &constant(ellipsoid.center));
            let r = ellipsoid.radii.to_array().map(|r| square(&one(r)));
            let term = |k: usize| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                square(&w[k]).times(&r[i]).times(&r[j])
            };
            let all = r[0].times(&r[1]).times(&r[2]);
            vec![sum([0, 1, 2].map(term)).minus(&all)]
        }
        Shape::Cone(cone) => {
            let base = constant(cone.base);
            let (a, w) = (minus(&constant(cone.top), &base), minus(&x, &base));
            let (length, h) = (dot(&a, &a), dot(&w, &a));
            let (r0, r1) = (one(cone.base_radius), one(cone.top_radius));
            let radius = r0.times(&length).plus(&r1.minus(&r0).times(&h));
            let side = square(&length)
                .times(&dot(&w, &w))
                .minus(&length.times(&square(&h)))
                .minus(&square(&radius));
            vec![side, one(0.0).minus(&h), h.minus(&length)]
        }
        Shape::Quadric(quadric) => {
            let [a, b, c, d, e, f, g, h, i, j] = quadric.coefficients.map(one);
            let [x, y, z] = &x;
            let terms = [
                [
                    square(x).times(&a),
                    square(y).times(&b),
                    square(z).times(&c),
                ],
                [
                    x.times(y).times(&d),
                    x.times(z).times(&e),
                    y.times(z).times(&f),
                ],
                [x.times(&g), y.times(&h), z.times(&i)],
            ];
            vec![sum(terms.map(sum)).plus(&j)]
        }
        Shape::Polygon { .. } => unreachable!("it has no inside"),
    }
}

impl Truth {
    pub fn of(case: &Case) -> Truth {
        let Case { line, shape } = case;
        if let Shape::Polygon { points, normal } = shape {
            let to = minus(&place(line), &constant(points[0]));
            let plane = dot(&constant(*normal), &to);
            let mut ends = plane.roots();
            let (inside, on_edge) = encloses(line, points);
            let [low, high] = near(points);
            let from = |root: &Root, bound: &[f64; 3], k: usize| {
                root.sign_of(&place(line)[k].minus(&Polynomial::constant(Exact::from(bound[k]))))
            };
            let is_near =
                |root: &Root| (0..3).all(|k| from(root, &low, k) >= 0 && from(root, &high, k) <= 0);
            ends.retain(|root| inside && is_near(root));
            return Truth {
                ends,
                twins: on_edge,
            };
        }
        let functions = within(line, shape);
        let open = matches!(shape, Shape::Cone(cone) if cone.open);
        // Where a quadric only touches zero from below, nothing begins or ends.
        let touches = |f: &Polynomial| {
            let roots = f.roots();
            let is_double = roots.len() == 2 && roots[0].order(&roots[1]).is_eq();
            matches!(shape, Shape::Quadric(_)) && is_double && f.0[2].signum() < 0
        };
        let candidates: Vec<Root> = if touches(&functions[0]) {
            Vec::new()
        } else if open {
            functions[0].roots()
        } else {
            functions.iter().flat_map(Polynomial::roots).collect()
        };
        let member = |root: &Root| {
            let mut others = functions.iter().skip(usize::from(open));
            others.all(|f| root.sign_of(f) <= 0)
        };
        let members: Vec<Root> = candidates.into_iter().filter(member).collect();
        let twins = members
            .iter()
            .enumerate()
            .any(|(i, a)| members[..i].iter().any(|b| a.order(b).is_eq()));
        let ends = if open {
            members
        } else {
            let first = members.iter().min_by(|a, b| a.order(b));
            let last = members.iter().max_by(|a, b| a.order(b));
            first.into_iter().chain(last).cloned().collect()
        };
        Truth { ends, twins }
    }

    /// Beyond t_min.
    pub fn first(&self, t_min: f64) -> Option<&Root> {
        let beyond = |root: &&Root| match t_min {
            f64::NEG_INFINITY => true,
            f64::INFINITY => false,
            t_min => root.order_with(&Exact::from(t_min)).is_gt(),
        };
        let ends = self.ends.iter().filter(beyond);
        ends.min_by(|a, b| a.order(b))
    }
}

/// Where a triangle's plane is met.
pub fn facet(line: &Line, corners: &[[f32; 3]; 3]) -> Root {
    let [a, b, c] = corners.map(|c| constant(glam::DVec3::from_array(c.map(f64::from))));
    let (p, q) = (minus(&b, &a), minus(&c, &a));
    let minor = |i: usize, j: usize| p[i].times(&q[j]).minus(&p[j].times(&q[i]));
    let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
    let plane = dot(&normal, &minus(&place(line), &a));
    plane.roots().remove(0)
}

/// The corners' box, which grows by a thousandth of its longest side.
fn near(points: &[glam::DVec3]) -> [[f64; 3]; 2] {
    let low = points
        .iter()
        .copied()
        .reduce(glam::DVec3::min)
        .expect("corners");
    let high = points
        .iter()
        .copied()
        .reduce(glam::DVec3::max)
        .expect("corners");
    let margin = (high - low).max_element() * 1e-3;
    let (low, high) = ((low - margin).to_array(), (high + margin).to_array());
    [
        low.map(|x| x.next_down().max(-f64::MAX)),
        high.map(|x| x.next_up().min(f64::MAX)),
    ]
}

/// Whether a line passes inside a polygon or through its border; and the
/// latter. Seen along the first axis that the line moves along; edges are counted
/// that cross a half-line to the left, corners on it counted as above.
fn encloses(line: &Line, points: &[glam::DVec3]) -> (bool, bool) {
    let k = (0..3).find(|k| line.dir[*k] != 0.0).unwrap_or(0);
    let of = Exact::from;
    let seen = |p: &glam::DVec3| {
        let from = |i: usize| &of(p[i]) - &of(line.org[i]);
        let across = |i: usize| &(&from(i) * &of(line.dir[k])) - &(&from(k) * &of(line.dir[i]));
        [across((k + 1) % 3), across((k + 2) % 3)]
    };
    let corners: Vec<[Exact; 2]> = points.iter().map(seen).collect();
    let (mut odd, mut on_edge) = (false, false);
    for (i, [bx, by]) in corners.iter().enumerate() {
        let [ax, ay] = &corners[(i + corners.len() - 1) % corners.len()];
        let turn = (&(ax * by) - &(ay * bx)).signum();
        let facing = (&(ax * bx) + &(ay * by)).signum();
        on_edge |= turn == 0 && facing <= 0;
        let (from, to) = (ay.signum() >= 0, by.signum() >= 0);
        // To the left where the turn is against the way up.
        odd ^= from != to && (turn < 0) == to;
    }
    (odd || on_edge, on_edge)
}
