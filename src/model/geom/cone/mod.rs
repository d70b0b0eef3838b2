//! Truncated cones, and cylinders as the case of equal radii.
//!
//! About the axis' midpoint m with unit axis n, a point p has height z = p·n and
//! the surface has radius r(z) = r_m + k·z. Along the ray the quadric
//! |p − zn|² = r(z)² is A t² + 2B t + C = 0, taken from the point of the line
//! nearest m, so that far origins do not cancel. Inside the *one* cone whose
//! r ≥ 0 lies an interval of the line: between the roots where A > 0, beyond one
//! of them where A < 0. A closed solid is that interval cut by the two planes,
//! so no ray slips through at the rim; an open one has just the roots whose
//! height lies between them.

pub(super) mod exact;
pub mod guarded;

use super::chart::Chart;
use super::columns::table;
use super::exact::{Inside, Line, Root};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::kinds::ConeId;
use super::primitive::{Exact, Flaw, OPEN, Primitive, finite, finite3, positive, require};
use super::ray::{Meet, Ray, Span};
use crate::geom::Scratch;
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb, AxisOrder, Vec3, units_and_lengths};
use glam::DVec3;

/// A truncated circular cone from `base` to `top`; one radius may be 0 (an
/// apex), and equal radii make a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    pub base: DVec3,
    pub top: DVec3,
    /// ≥ 0.
    pub base_radius: f64,
    /// ≥ 0, not both 0.
    pub top_radius: f64,
    /// Whether the caps are left out: it is then a surface without inside.
    pub open: bool,
}

/// A cone as kernels take it. Computing it from the two ends takes a square root and several
/// divisions, so tables keep it.
#[derive(Clone, Copy, Debug)]
pub struct Upright {
    /// Half the height.
    pub half: f64,
    /// The unit vector along the axis, from base to top.
    pub unit: DVec3,
    pub middle: DVec3,
    /// The radius at the middle.
    pub radius: f64,
    /// The growth of the radius along the axis.
    pub growth: f64,
    /// The order in which sums over the axes add.
    pub order: AxisOrder,
    pub open: bool,
}

impl Cone {
    /// Computes the form that kernels take, without overflow.
    pub fn upright(&self) -> Upright {
        let half = self.top * 0.5 - self.base * 0.5;
        let size = half.abs().max_element();
        let scaled = half / size;
        // Not `length()`: glam's libm has the legacy SSE square root, which between
        // 512-bit instructions costs hundreds of nanoseconds.
        let order = AxisOrder::of(scaled.abs().to_array());
        let [x, y, z] = order.of_axes((scaled * scaled).to_array());
        let length = (x + y + z).sqrt();
        let half = size * length;
        Upright {
            half,
            unit: scaled / length,
            middle: self.base * 0.5 + self.top * 0.5,
            radius: (self.base_radius + self.top_radius) * 0.5,
            growth: (self.top_radius - self.base_radius) / (2.0 * half),
            order,
            open: self.open,
        }
    }

    /// Returns the box around the two end discs: along axis k a disc with unit normal n reaches
    /// r·√(1 − n_k²).
    pub fn bounds(&self) -> Aabb {
        let n = self.upright().unit;
        // The length of the other two components, because 1 − n_k² would cancel.
        let length = |a: f64, b: f64| (a * a + b * b).sqrt();
        let reach = DVec3::new(length(n.y, n.z), length(n.x, n.z), length(n.x, n.y));
        let disc = |c: DVec3, r: f64| {
            // Grown by 4.5 roundings of 2⁻⁵², which cover those of this computation: one of each
            // product and sum, and those of `unit`.
            Aabb::new(c, c).grown(reach * r + (c.abs() + r) * 1e-15)
        };
        disc(self.base, self.base_radius).union(&disc(self.top, self.top_radius))
    }

    /// Returns the outward normal, of any length, of the closed solid's cap or side, whichever is
    /// nearer to `p`.
    pub fn normal_at(&self, p: DVec3) -> DVec3 {
        self.upright().nearest(Vec3::<f64>::from(p)).1.into()
    }
}

impl Upright {
    /// Returns the first-order distance of `p` above the nearer of cap and side, and its unit
    /// normal.
    #[inline(always)]
    pub fn nearest<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>) {
        // The growth is infinite where the height is next to nothing.
        let k = self.growth.clamp(-f64::MAX, f64::MAX);
        let n = Vec3::<D>::splat(self.unit.to_array());
        let p = p - Vec3::splat(self.middle.to_array());
        let z = p.dot(n);
        let radial = p - n * z;
        let r = D::splat(self.radius) + D::splat(k) * z;
        let (outward, length) = units_and_lengths(radial);
        // The apex has no normal; the axis stands in for it.
        let apex = self.unit * (if k > 0.0 { -1.0 } else { 1.0 });
        // Distances are measured across the side.
        let across = D::splat(match k.abs() < 1e100 {
            true => 1.0 / (1.0 + k * k).sqrt(),
            false => 1.0 / k.abs(),
        });
        let off_side = (length - r) * across;
        let side = Vec3::select(
            outward.max_abs().gt(D::zero()),
            (outward - n * D::splat(k)) * across,
            Vec3::splat(apex.to_array()),
        );
        if self.open {
            return (off_side, side);
        }
        let off_cap = z.abs() - D::splat(self.half);
        let one = D::splat(1.0);
        let cap = n * D::select(z.lt(D::zero()), -one, one);
        let on_cap = off_cap.abs().lt(off_side.abs());
        (
            D::select(on_cap, off_cap, off_side),
            Vec3::select(on_cap, cap, side),
        )
    }
}

/// The cone and the ray in the kernel's coordinates.
struct Frame<L: Lanes> {
    /// t at the point of the line nearest the axis' midpoint.
    shift: L,
    height: L,
    rise: L,
    half: L,
    a: L,
    b: L,
    c: L,
    /// The radius r at that point, and its rate along the ray.
    radius: L,
    widening: L,
}

#[inline(always)]
fn frame<L: Lanes>(cone: &Upright, ray: &Ray<L>) -> Frame<L> {
    let splat = |v: DVec3| Vec3::<L>::splat(v.to_array().map(L::Scalar::from_f64));
    let (k, order) = (L::from_f64(cone.growth), cone.order);
    let (n, dir) = (splat(cone.unit).ordered(order), ray.dir.ordered(order));
    let org = (ray.org - splat(cone.middle)).ordered(order);
    let shift = -(org.dot(dir) / ray.dir_squared);
    let near = org.along(dir, shift);
    let (height, rise) = (near.dot(n), dir.dot(n));
    let (across, drift) = (near - n * height, dir - n * rise);
    let radius = L::from_f64(cone.radius) + k * height;
    let widening = k * rise;
    Frame {
        shift,
        height,
        rise,
        half: L::from_f64(cone.half),
        a: drift.length_squared() - widening * widening,
        b: across.dot(drift) - radius * widening,
        c: across.length_squared() - radius * radius,
        radius,
        widening,
    }
}

/// Returns the roots of A t² + 2B t + C, the lower one first; for A = 0 one root and ±∞.
#[inline(always)]
fn roots<L: Lanes>(f: &Frame<L>) -> (L::Mask, L, L) {
    let zero = L::zero();
    let squared = f.b * f.b - f.a * f.c;
    // Where A < 0 only rounding at the apex makes the square negative: it is a double root.
    let root = squared.max(zero).sqrt();
    let q = -(f.b + L::select(f.b.lt(zero), -root, root));
    let none = q.eq(zero);
    let t0 = L::select(none, zero, f.c / q);
    let t1 = L::select(none & f.a.eq(zero), zero, q / f.a);
    (squared.ge(zero), t0.min(t1), t0.max(t1))
}

/// Returns the part of each ray in a closed cone, without error bounds.
#[inline(always)]
pub fn span<L: Lanes>(cone: &Upright, ray: &Ray<L>) -> Span<L> {
    let f = frame(cone, ray);
    let zero = L::zero();
    let infinity = L::splat(L::Scalar::INFINITY);
    let (real, t0, t1) = roots(&f);

    // The interval inside the one cone with r ≥ 0.
    let between = f.a.gt(zero);
    // A ray parallel to the axis of a cylinder has A = B = 0: it is inside or outside all along.
    let constant = f.a.eq(zero) & f.b.eq(zero);
    let outside = constant & f.c.gt(zero);
    let widens = f.widening.gt(zero) | (f.widening.eq(zero) & f.b.lt(zero));
    let enter = L::select(between, t0, L::select(widens, t1, -infinity));
    let exit = L::select(between, t1, L::select(widens, infinity, t0));
    let linear = f.a.eq(zero) & !constant;
    // One root −C / 2B: inside ahead of it where B < 0, behind it where B > 0.
    let only = -(f.c / (f.b + f.b));
    let enter = L::select(linear, L::select(f.b.lt(zero), only, -infinity), enter);
    let exit = L::select(linear, L::select(f.b.lt(zero), infinity, only), exit);
    let enter = L::select(constant, -infinity, enter);
    let exit = L::select(constant, infinity, exit);
    // Both roots lie on the mirrored cone behind the apex, so the ray is not inside this one.
    let middle = (t0 + t1) * L::from_f32(0.5);
    let mirrored = between & (f.radius + f.widening * middle).lt(zero);
    // Rounding may leave no real root where the line passes the apex.
    let real = real | linear | constant | f.a.lt(zero);

    // The slab between the caps.
    let (low, high) = (-f.half - f.height, f.half - f.height);
    let (s0, s1) = (low / f.rise, high / f.rise);
    let level = f.rise.eq(zero);
    let within = low.le(zero) & high.ge(zero);
    let slab_enter = L::select(level, -infinity, s0.min(s1));
    let slab_exit = L::select(level, infinity, s0.max(s1));

    let enter = enter.max(slab_enter);
    let exit = exit.min(slab_exit);
    Span {
        some: real & !outside & !mirrored & (within | !level) & enter.le(exit),
        enter: enter + f.shift,
        exit: exit + f.shift,
    }
}

/// Meets the side of an open cone, without error bounds.
#[inline(always)]
pub fn meet_side<L: Lanes>(cone: &Upright, ray: &Ray<L>) -> Meet<L> {
    let f = frame(cone, ray);
    let (real, t0, t1) = roots(&f);
    let t_min = ray.t_min - f.shift;
    let on_side = |t: L| {
        let z = f.height + f.rise * t;
        real & t.gt(t_min) & z.abs().le(f.half)
    };
    let (first, second) = (on_side(t0), on_side(t1));
    let t = L::select(first, t0, t1) + f.shift;
    Meet::certain((first | second) & t.gt(ray.t_min), t)
}

table!(Cones of Cone by ConeId {
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
    open: bool,
} with uprights: Upright = Cone::upright);

impl Cones {
    /// Returns the row in the form that kernels take.
    #[inline(always)]
    pub fn upright(&self, id: ConeId) -> &Upright {
        &self.uprights[id.index()]
    }
}

impl Primitive for Cones {
    type Id = ConeId;
    type Row<'a> = Cone;

    #[inline(always)]
    fn exact(&self, id: ConeId) -> Cone {
        self.row(id)
    }

    fn check(&self, id: ConeId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("base", row.base)?;
        finite3("top", row.top)?;
        finite("base_radius", &[row.base_radius])?;
        finite("top_radius", &[row.top_radius])?;
        for (field, radius) in [
            ("base_radius", row.base_radius),
            ("top_radius", row.top_radius),
        ] {
            require(radius >= 0.0, field, radius, "0 or greater")?;
        }
        positive("base_radius + top_radius", row.base_radius + row.top_radius)?;
        apart(row.base, row.top)
    }

    fn bounds(&self, id: ConeId) -> Option<Aabb> {
        Some(self.row(id).bounds())
    }

    fn no_inside(&self, id: ConeId) -> Option<&'static str> {
        self.open[id.index()].then_some(OPEN)
    }

    fn faces(&self, id: ConeId) -> Vec<Option<Face>> {
        let row = self.row(id);
        vec![
            (row.base_radius > 0.0).then(|| Face::cap(row.base, row.top)),
            (row.top_radius > 0.0).then(|| Face::cap(row.top, row.base)),
        ]
    }

    /// Returns the lesser of height and diameter: the box of an oblique one says nothing about it.
    fn thickness(&self, id: ConeId) -> Option<f64> {
        let row = self.row(id);
        let radius = row.base_radius.max(row.top_radius);
        Some(row.base.distance(row.top).min(2.0 * radius))
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: ConeId,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        let _ = active;
        self.upright(id).meet_fast(object.ray)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: ConeId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(self.upright(id), object, active)
    }

    #[inline(always)]
    fn ends_fast<L: Lanes>(&self, id: ConeId, object: &ObjectRay<L>) -> Ends<L> {
        Ends::certain(&span(self.upright(id), object.ray))
    }

    #[inline(always)]
    fn ends<L: Lanes>(&self, id: ConeId, object: &ObjectRay<L>, _astray: L::Double) -> Ends<L> {
        guarded::ends(self.upright(id), object)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: ConeId, p: Vec3<D>) -> (D, Vec3<D>) {
        self.upright(id).nearest(p)
    }

    fn chart(&self, id: ConeId, p: DVec3, _: DVec3) -> Chart {
        Chart::on_cone(self.upright(id), p)
    }
}

impl<'a> Exact<'a> for Cone {
    fn is_finite(&self) -> bool {
        let radii = [self.base_radius, self.top_radius];
        let ends = self.base.is_finite() && self.top.is_finite();
        ends && radii.iter().all(|r| r.is_finite())
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        if self.open {
            return Inside::NOWHERE;
        }
        Inside::of_convex(exact::cone(line, self))
    }

    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, _: &mut Scratch) -> Option<Root<'a>> {
        if self.open {
            return exact::cone_side(line, self, t_min);
        }
        let beyond = |end: &Root| end.order_with(t_min).is_gt();
        self.inside(line).ends.into_iter().flatten().find(beyond)
    }
}

impl Upright {
    /// Meets it without error bounds.
    #[inline(always)]
    pub(super) fn meet_fast<L: Lanes>(&self, ray: &Ray<L>) -> Meet<L> {
        if self.open {
            meet_side(self, ray)
        } else {
            span(self, ray).first_beyond(ray.t_min)
        }
    }
}

/// Refuses a base and a top whose halves coincide, as the kernel computes them: the least f64
/// numbers have no half.
pub(super) fn apart(base: DVec3, top: DVec3) -> Result<(), Flaw> {
    if base * 0.5 != top * 0.5 {
        return Ok(());
    }
    Err(Flaw::Degenerate(
        "its base and top are the same point".into(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::length;

    #[test]
    fn normals_are_unit_at_any_scale_and_slope() {
        for (radius, height) in [
            (1.0, 2.0),
            (1e-170, 1e-170),
            (1e160, 1e160),
            (1.0, 1e-200),
            (1e-200, 1.0),
            (1.0, 1e-309),
        ] {
            for open in [false, true] {
                let cone = Cone {
                    base: DVec3::ZERO,
                    top: DVec3::Z * height,
                    base_radius: radius,
                    top_radius: 0.0,
                    open,
                };
                // On its side.
                let p = DVec3::new(0.3 * radius, -0.4 * radius, 0.5 * height);
                let normal = cone.normal_at(p);
                let off = (length(normal) - 1.0).abs();
                assert!(off < 1e-14, "{radius}, {height}: {normal}");
                let outward = DVec3::new(0.6 * height, -0.8 * height, radius);
                let outward = outward / outward.abs().max_element();
                let apart = (normal - outward / length(outward)).length();
                assert!(apart < 1e-14, "{radius}, {height}: {normal}");
            }
        }
    }
}
