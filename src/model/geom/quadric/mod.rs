//! Quadrics: the points at which a polynomial of degree two is not above zero.
//!
//! Along a ray q is A t² + 2B t + C, taken from the point of the line nearest the origin, so that
//! far origins do not cancel. The inside lies between the roots if A > 0, and everywhere else if A
//! < 0.

pub mod guarded;

use super::columns::table;
use super::exact::{Inside, Line, solid};
use super::guarded::{Ends, ObjectRay};
use super::kinds::QuadricId;
use super::primitive::{Blur, Exact, Flaw, Height, Primitive, finite};
use super::ray::Meet;
use super::ray::{Ray, Span};
use crate::geom::Scratch;
use crate::math::bounds::ErrorBounded;
use crate::math::lanes::{Lanes, Mask, Scalar, odd_sum};
use crate::math::units_and_lengths;
use crate::math::{Aabb, Number, Vec3};
use glam::DVec3;

/// The solid q(x, y, z) ≤ 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// The coefficients of x², y², z², xy, xz, yz, x, y, z and 1; one but the last is not 0.
    pub coefficients: [f64; 10],
}

/// The function 2q = x·(Hx) + 2 l·x + 2j, in which no coefficient is halved.
struct Form<T> {
    /// H: its diagonal, and then [xy, xz, yz].
    squares: [T; 3],
    mixed: [T; 3],
    linear: [T; 3],
    constant: T,
}

impl Quadric {
    /// Returns the form of 2q.
    #[inline(always)]
    fn doubled(&self) -> Form<f64> {
        let [a, b, c, d, e, f, g, h, i, j] = self.coefficients;
        Form {
            squares: [2.0 * a, 2.0 * b, 2.0 * c],
            mixed: [d, e, f],
            linear: [g, h, i],
            constant: 2.0 * j,
        }
    }

    /// Returns the gradient of q: the outward normal, zero at a centre or an apex.
    pub fn normal_at(&self, p: DVec3) -> DVec3 {
        self.normals_at(Vec3::<f64>::from(p)).into()
    }

    /// Returns [`normal_at`](Self::normal_at) in lanes.
    #[inline(always)]
    pub fn normals_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        let form = self.doubled();
        product(&form, p) + Vec3::splat(form.linear)
    }

    /// Returns q, its gradient, and the sum of the magnitudes of its terms.
    pub fn value_at(&self, p: DVec3) -> (f64, DVec3, f64) {
        let (value, gradient, sum) = self.values_at(Vec3::<f64>::from(p));
        (value, gradient.into(), sum)
    }

    /// Returns [`value_at`](Self::value_at) in lanes.
    #[inline(always)]
    pub fn values_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>, D) {
        let form = self.doubled();
        let linear = Vec3::splat(form.linear);
        let gradient = product(&form, p) + linear;
        let constant = D::splat(form.constant);
        let half = D::splat(0.5);
        let value = half * (p.dot(gradient) + linear.dot(p) + constant);
        let abs = Form {
            squares: form.squares.map(f64::abs),
            mixed: form.mixed.map(f64::abs),
            ..form
        };
        let (size, linear) = (p.abs(), linear.abs());
        let sum = size.dot(product(&abs, size)) + D::splat(2.0) * linear.dot(size) + constant.abs();
        (value, gradient, half * sum)
    }

    /// Returns the box of an ellipsoid from its centre −H⁻¹l and the diagonal of H⁻¹, with all
    /// errors bounded (Q9, docs/numerics/quadratics.md). `None` for other quadrics, and where f64
    /// does not decide.
    pub fn bounds(&self) -> Option<Aabb> {
        // H scaled to the size of 1: what then underflows is nothing beside it, and its error is
        // counted.
        let size = self.coefficients[..6]
            .iter()
            .fold(0.0, |m, x| f64::max(m, x.abs()));
        let scale = 1.0 / size;
        if !scale.is_normal() {
            return None;
        }
        let of = |x: f64| {
            let (value, error) = (x * scale, (x * scale).abs() * f64::EPSILON);
            let error = error + f64::MIN_POSITIVE;
            ErrorBounded {
                value,
                error: if x == 0.0 { 0.0 } else { error },
            }
        };
        let Form {
            squares,
            mixed,
            linear,
            constant,
        } = self.doubled();
        let ([a, b, c], [d, e, f]) = (squares.map(of), mixed.map(of));
        let (l, j) = (linear.map(of), of(constant));
        let minor =
            |x: &ErrorBounded, y: &ErrorBounded, z: &ErrorBounded| x.times(y).minus(&z.squared());
        // H⁻¹ times the determinant: its diagonal, and the mixed entries.
        let straight = [minor(&b, &c, &f), minor(&a, &c, &e), minor(&a, &b, &d)];
        let crossed = [
            e.times(&f).minus(&d.times(&c)),
            d.times(&f).minus(&e.times(&b)),
            d.times(&e).minus(&a.times(&f)),
        ];
        let row = d.times(&crossed[0]).plus(&e.times(&crossed[1]));
        let determinant = a.times(&straight[0]).plus(&row);
        let is_positive = |x: &ErrorBounded| x.sign().is_some_and(|s| s.is_gt());
        if ![a, straight[2], determinant].iter().all(is_positive) {
            return None;
        }
        let [s0, s1, s2] = straight;
        let [xy, xz, yz] = crossed;
        let center = [[s0, xy, xz], [xy, s1, yz], [xz, yz, s2]].map(|row| {
            let sum = row[0].times(&l[0]).plus(&row[1].times(&l[1]));
            let sum = sum.plus(&row[2].times(&l[2]));
            sum.negated().over(&determinant)
        });
        // Inside, x·(Hx) about the centre is at most −l·center − 2j.
        let along = |k: usize| l[k].times(&center[k]);
        let room = along(0).plus(&along(1)).plus(&along(2)).plus(&j).negated();
        let mut bounds = Aabb::new(DVec3::ZERO, DVec3::ZERO);
        for k in 0..3 {
            let squared = room.times(&straight[k]).over(&determinant);
            let most = (squared.value + squared.error).max(0.0).sqrt().next_up();
            let reach = (center[k].error + most).next_up();
            bounds.min[k] = (center[k].value - reach).next_down();
            bounds.max[k] = (center[k].value + reach).next_up();
        }
        let is_known = bounds.min.is_finite() && bounds.max.is_finite();
        is_known.then_some(bounds)
    }
}

fn product<D: Lanes<Scalar = f64>>(form: &Form<f64>, v: Vec3<D>) -> Vec3<D> {
    let ([a, b, c], [d, e, f]) = (form.squares.map(D::splat), form.mixed.map(D::splat));
    Vec3::new(
        a * v.x + d * v.y + e * v.z,
        d * v.x + b * v.y + f * v.z,
        e * v.x + f * v.y + c * v.z,
    )
}

/// The form of 2q in lanes.
#[derive(Clone, Copy)]
pub(super) struct Lifted<L: Lanes> {
    squares: Vec3<L>,
    mixed: Vec3<L>,
    pub linear: Vec3<L>,
    pub constant: L,
}

impl<L: Lanes> Lifted<L> {
    #[inline(always)]
    pub fn new(row: &Quadric) -> Lifted<L> {
        let Form {
            squares,
            mixed,
            linear,
            constant,
        } = row.doubled();
        let splat = |v: [f64; 3]| Vec3::splat(v.map(L::Scalar::from_f64));
        Lifted {
            squares: splat(squares),
            mixed: splat(mixed),
            linear: splat(linear),
            constant: L::from_f64(constant),
        }
    }

    /// Returns the form with the magnitudes of all coefficients.
    #[inline(always)]
    pub fn abs(&self) -> Lifted<L> {
        let abs = |v: Vec3<L>| Vec3::new(v.x.abs(), v.y.abs(), v.z.abs());
        Lifted {
            squares: abs(self.squares),
            mixed: abs(self.mixed),
            linear: abs(self.linear),
            constant: self.constant.abs(),
        }
    }

    /// Returns H v.
    #[inline(always)]
    pub fn times(&self, v: Vec3<L>) -> Vec3<L> {
        let (a, d) = (self.squares, self.mixed);
        Vec3::new(
            odd_sum(a.x * v.x, d.x * v.y, d.y * v.z),
            odd_sum(d.x * v.x, a.y * v.y, d.z * v.z),
            odd_sum(d.y * v.x, d.z * v.y, a.z * v.z),
        )
    }

    /// Returns lanes in which every product in H v is zero because a factor is, and not because it
    /// underflows (Q7, docs/numerics/quadratics.md).
    #[inline(always)]
    pub fn is_nothing_times(&self, v: Vec3<L>) -> L::Mask {
        let zero = |x: L, y: L| x.eq(L::zero()) | y.eq(L::zero());
        let (a, d) = (self.squares, self.mixed);
        let squares = zero(a.x, v.x) & zero(a.y, v.y) & zero(a.z, v.z);
        let first = zero(d.x, v.x) & zero(d.x, v.y) & zero(d.y, v.x);
        squares & first & zero(d.y, v.z) & zero(d.z, v.y) & zero(d.z, v.z)
    }

    #[inline(always)]
    pub fn is_nothing_along(&self, v: Vec3<L>) -> L::Mask {
        let zero = |x: L, y: L| x.eq(L::zero()) | y.eq(L::zero());
        let l = self.linear;
        zero(l.x, v.x) & zero(l.y, v.y) & zero(l.z, v.z)
    }
}

/// Returns the part of each line between the roots of q, or on one side of its only root; and the
/// lanes in which the solid is the rest of the line, ends included.
#[inline(always)]
pub fn span<L: Lanes>(row: &Quadric, ray: &Ray<L>) -> (Span<L>, L::Mask) {
    let (zero, infinity) = (L::zero(), L::splat(L::Scalar::INFINITY));
    let form = Lifted::new(row);
    let shift = -(ray.org.unordered_dot(ray.dir) / ray.dir_squared);
    let near = ray.org.along(ray.dir, shift);
    let along = form.times(ray.dir);
    let gradient = form.times(near) + form.linear;
    // Adding zero removes −0, whose sign would become that of the root at infinity.
    let a = along.unordered_dot(ray.dir) + zero;
    let b = gradient.unordered_dot(ray.dir);
    let c = near.unordered_dot(gradient) + form.linear.unordered_dot(near) + form.constant;
    let squared = b * b - a * c;
    let root = squared.max(zero).sqrt();
    let q = -(b + L::select(b.lt(zero), -root, root));
    // A line without a slope is inside or outside all along.
    let level = a.eq(zero) & b.eq(zero);
    let none = q.eq(zero);
    let (t0, t1) = (L::select(none, zero, c / q), L::select(none, zero, q / a));
    let enter = t0.min(t1) + shift;
    let exit = t0.max(t1) + shift;
    let span = Span {
        some: L::Mask::from_bits(((!level & squared.ge(zero)) | (level & c.le(zero))).bits()),
        enter: L::select(level, -infinity, enter),
        exit: L::select(level, infinity, exit),
    };
    (span, a.lt(zero))
}

table!(Quadrics of Quadric by QuadricId { coefficients: [f64; 10] });

impl Primitive for Quadrics {
    type Id = QuadricId;
    type Row<'a> = Quadric;
    const BLUR: Blur = Blur::Apart;
    const IS_DISTANCE: bool = false;

    #[inline(always)]
    fn exact(&self, id: QuadricId) -> Quadric {
        self.row(id)
    }

    fn check(&self, id: QuadricId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite("coefficients", &row.coefficients)?;
        if row.coefficients[..9].iter().all(|x| *x == 0.0) {
            return Err(Flaw::Degenerate(
                "all its coefficients but the last are 0, and it has no surface".into(),
            ));
        }
        Ok(())
    }

    fn bounds(&self, id: QuadricId) -> Option<Aabb> {
        // `bounds` rounds outward itself.
        self.row(id).bounds()
    }

    fn thickness(&self, _id: QuadricId) -> Option<f64> {
        None
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: QuadricId,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        let _ = active;
        span(&self.row(id), object.ray)
            .0
            .first_beyond(object.ray.t_min)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: QuadricId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(&self.row(id), object, active)
    }

    #[inline(always)]
    fn ends_fast<L: Lanes>(&self, id: QuadricId, object: &ObjectRay<L>) -> Ends<L> {
        let (between, turned) = span(&self.row(id), object.ray);
        Ends {
            turned,
            ..Ends::certain(&between)
        }
    }

    #[inline(always)]
    fn ends<L: Lanes>(&self, id: QuadricId, object: &ObjectRay<L>, astray: L::Double) -> Ends<L> {
        guarded::ends(&self.row(id), object, astray)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: QuadricId, p: Vec3<D>) -> (D, Vec3<D>) {
        let (value, gradient, _) = self.row(id).values_at(p);
        (value, gradient)
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: QuadricId, p: Vec3<D>) -> Vec3<D> {
        let normals = self.row(id).normals_at(p);
        // An apex has no normal; +y stands in for it.
        let none = normals.max_abs().eq(D::zero());
        Vec3::select(none, Vec3::splat(DVec3::Y.to_array()), normals)
    }

    #[inline(always)]
    fn height<D: Lanes<Scalar = f64>>(&self, (value, gradient): (D, Vec3<D>)) -> Height<D> {
        let (normal, slope) = units_and_lengths(gradient);
        let none = normal.max_abs().eq(D::zero());
        Height {
            above: value / slope,
            normal: Vec3::select(none, Vec3::splat(DVec3::Y.to_array()), normal),
            slope,
        }
    }

    #[inline(always)]
    fn blur<D: Lanes<Scalar = f64>>(&self, id: QuadricId, at: Vec3<D>, slope: Option<D>) -> D {
        let (_, gradient, size) = self.row(id).values_at(at);
        size / slope.unwrap_or_else(|| gradient.length())
    }
}

impl<'a> Exact<'a> for Quadric {
    fn is_finite(&self) -> bool {
        self.coefficients.iter().all(|x| x.is_finite())
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        solid::quadric(line, self)
    }
}
