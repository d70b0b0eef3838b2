//! Horner's scheme in three variables without branches: a polynomial in x whose coefficients are
//! polynomials in y whose coefficients are polynomials in z, each of one degree less than the one
//! before.
//!
//! Coefficients come lowest power first: those of x⁰, among them those of y⁰.

use crate::math::Vec3;
use crate::math::lanes::Lanes;

/// Returns Σ c zᵏ, k = 0 … M.
#[inline(always)]
fn line<D: Lanes, const M: usize>(c: &impl Fn(usize) -> D, first: usize, z: D) -> D {
    let mut sum = c(first + M);
    for k in (0..M).rev() {
        sum = sum * z + c(first + k);
    }
    sum
}

/// Returns the same sum and its derivative.
#[inline(always)]
fn line_slope<D: Lanes, const M: usize>(c: &impl Fn(usize) -> D, first: usize, z: D) -> [D; 2] {
    let (mut sum, mut slope) = (c(first + M), D::zero());
    for k in (0..M).rev() {
        slope = if k + 1 == M { sum } else { slope * z + sum };
        sum = sum * z + c(first + k);
    }
    [sum, slope]
}

#[inline(always)]
fn plane0<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, _: D, _: D) -> D {
    c(first)
}

/// A value, and its derivatives by y and z.
#[inline(always)]
fn plane_slopes0<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, _: D, _: D) -> [D; 3] {
    [c(first), D::zero(), D::zero()]
}

/// Defines polynomials in y and z of one degree each, from the polynomial that y is multiplied
/// with.
macro_rules! planes {
    ($($name:ident, $slopes:ident, $m:literal, $below:ident, $below_slopes:ident;)*) => {$(
        #[inline(always)]
        fn $name<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, y: D, z: D) -> D {
            $below(c, first + $m + 1, y, z) * y + line::<D, $m>(c, first, z)
        }

        #[inline(always)]
        fn $slopes<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, y: D, z: D) -> [D; 3] {
            let [value, by_y, by_z] = $below_slopes(c, first + $m + 1, y, z);
            let [own, own_by_z] = line_slope::<D, $m>(c, first, z);
            // A constant needs no multiplication.
            if $m == 1 {
                return [value * y + own, value, own_by_z];
            }
            [value * y + own, by_y * y + value, by_z * y + own_by_z]
        }
    )*};
}

planes! {
    plane1, plane_slopes1, 1, plane0, plane_slopes0;
    plane2, plane_slopes2, 2, plane1, plane_slopes1;
    plane3, plane_slopes3, 3, plane2, plane_slopes2;
    plane4, plane_slopes4, 4, plane3, plane_slopes3;
}

#[inline(always)]
fn solid0<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, _: Vec3<D>) -> D {
    c(first)
}

#[inline(always)]
fn solid_slopes0<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, _: Vec3<D>) -> (D, Vec3<D>) {
    let zero = D::zero();
    (c(first), Vec3::new(zero, zero, zero))
}

/// Defines polynomials in x, y and z of one degree each, given the number of coefficients of x⁰.
macro_rules! solids {
    ($($name:ident, $slopes:ident, $m:literal, $count:literal,
       $below:ident, $below_slopes:ident, $plane:ident, $plane_slopes:ident;)*) => {$(
        #[inline(always)]
        fn $name<D: Lanes>(c: &impl Fn(usize) -> D, first: usize, p: Vec3<D>) -> D {
            $below(c, first + $count, p) * p.x + $plane(c, first, p.y, p.z)
        }

        #[inline(always)]
        fn $slopes<D: Lanes>(
            c: &impl Fn(usize) -> D,
            first: usize,
            p: Vec3<D>,
        ) -> (D, Vec3<D>) {
            let (value, by) = $below_slopes(c, first + $count, p);
            let [own, own_by_y, own_by_z] = $plane_slopes(c, first, p.y, p.z);
            if $m == 1 {
                return (value * p.x + own, Vec3::new(value, own_by_y, own_by_z));
            }
            let slopes = Vec3::new(
                by.x * p.x + value,
                by.y * p.x + own_by_y,
                by.z * p.x + own_by_z,
            );
            (value * p.x + own, slopes)
        }
    )*};
}

solids! {
    solid1, solid_slopes1, 1, 3, solid0, solid_slopes0, plane1, plane_slopes1;
    solid2, solid_slopes2, 2, 6, solid1, solid_slopes1, plane2, plane_slopes2;
    solid3, solid_slopes3, 3, 10, solid2, solid_slopes2, plane3, plane_slopes3;
    solid4, solid_slopes4, 4, 15, solid3, solid_slopes3, plane4, plane_slopes4;
}

/// Evaluates a polynomial of degree 2, 3 or 4.
#[inline(always)]
pub fn value<D: Lanes>(degree: usize, c: &impl Fn(usize) -> D, p: Vec3<D>) -> D {
    match degree {
        2 => solid2(c, 0, p),
        3 => solid3(c, 0, p),
        _ => solid4(c, 0, p),
    }
}

/// Evaluates a polynomial of degree 2, 3 or 4 and its gradient.
#[inline(always)]
pub fn gradient<D: Lanes>(degree: usize, c: &impl Fn(usize) -> D, p: Vec3<D>) -> (D, Vec3<D>) {
    match degree {
        2 => solid_slopes2(c, 0, p),
        3 => solid_slopes3(c, 0, p),
        _ => solid_slopes4(c, 0, p),
    }
}
