//! Convex solids, and cylinders and cones without caps: the points where all of a few
//! polynomials are ≤ 0.
//!
//! Along a ray x = o + t·d each kind is a few polynomials in t of degree one or two, as
//! docs/SPEC.md defines them (S19 to S26). The solid begins and ends where one of them
//! vanishes and no other is above zero (docs/numerics/oracle.md, O2).

use super::number::{Number, vector};
use super::ray::Ray;
use super::root::{Poly, Root};
use crate::geom::{Cone, Cuboid, Ellipsoid, HalfSpace, Quadric, Sphere};

/// A point where a line meets a primitive.
#[derive(Clone, Debug)]
pub struct Meeting<N> {
    pub t: Root<N>,
    /// The face that is met, by the number of its polynomial.
    pub face: usize,
    /// The surface's number of a CSG solid, with the bit [`TURNED`](super::TURNED); 0
    /// otherwise.
    pub surface: u32,
}

/// Finds both ends of the part of a line where no polynomial is above zero; an end where
/// several vanish is found once for each.
pub fn ends<N: Number>(faces: &[Poly<N>]) -> Result<Vec<Meeting<N>>, N::Undecided> {
    let mut found = Vec::new();
    for face in 0..faces.len() {
        meet_face(faces, face, &mut found)?;
    }
    Ok(found)
}

/// Finds where the first polynomial vanishes and no other is above zero. A line within that
/// surface does not cross it (S25).
pub fn first_face<N: Number>(faces: &[Poly<N>]) -> Result<Vec<Meeting<N>>, N::Undecided> {
    let mut found = Vec::new();
    meet_face(faces, 0, &mut found)?;
    Ok(found)
}

fn meet_face<N: Number>(
    faces: &[Poly<N>],
    face: usize,
    found: &mut Vec<Meeting<N>>,
) -> Result<(), N::Undecided> {
    'roots: for t in faces[face].roots()? {
        for (other, f) in faces.iter().enumerate() {
            if other != face && t.sign_of(f)?.is_gt() {
                continue 'roots;
            }
        }
        let surface = 0;
        found.push(Meeting { t, face, surface });
    }
    Ok(())
}

/// Returns the ray's point less another one, as polynomials in t.
fn from_point<N: Number>(ray: &Ray, p: [f64; 3]) -> [Poly<N>; 3] {
    let (org, dir) = (vector::<N>(ray.org), vector::<N>(ray.dir));
    let p = vector::<N>(p);
    std::array::from_fn(|k| Poly::linear(org[k].minus(&p[k]), dir[k].clone()))
}

fn dot<N: Number>(a: &[Poly<N>; 3], b: &[Poly<N>; 3]) -> Poly<N> {
    let [x, y, z] = std::array::from_fn(|k| a[k].clone() * b[k].clone());
    x + y + z
}

fn constants<N: Number>(v: [f64; 3]) -> [Poly<N>; 3] {
    v.map(Poly::constant)
}

/// Returns n·x − w for each plane; a half-space is n·x ≤ w (S20).
pub fn half_spaces<N: Number>(ray: &Ray, planes: &[HalfSpace]) -> Vec<Poly<N>> {
    let x = from_point::<N>(ray, [0.0; 3]);
    let face = |plane: &HalfSpace| {
        dot(&constants(plane.normal.to_array()), &x) - Poly::constant(plane.offset)
    };
    planes.iter().map(face).collect()
}

/// Returns the polynomials of min ≤ x ≤ max, the three lower faces first (S21).
pub fn cuboid<N: Number>(ray: &Ray, shape: &Cuboid) -> Vec<Poly<N>> {
    let x = from_point::<N>(ray, [0.0; 3]);
    let (min, max) = (shape.min.to_array(), shape.max.to_array());
    let lower = (0..3).map(|k| Poly::constant(min[k]) - x[k].clone());
    let upper = (0..3).map(|k| x[k].clone() - Poly::constant(max[k]));
    lower.chain(upper).collect()
}

/// Returns the polynomial of |x − c|² ≤ r² (S22).
pub fn sphere<N: Number>(ray: &Ray, shape: &Sphere) -> Vec<Poly<N>> {
    let w = from_point::<N>(ray, shape.center.to_array());
    vec![dot(&w, &w) - Poly::constant(shape.radius).squared()]
}

/// Returns the polynomial of Σ ((x_k − c_k) / r_k)² ≤ 1, times (r₀ r₁ r₂)² (S23).
pub fn ellipsoid<N: Number>(ray: &Ray, shape: &Ellipsoid) -> Vec<Poly<N>> {
    let [x, y, z] = from_point::<N>(ray, shape.center.to_array());
    let [a, b, c] = constants::<N>(shape.radii.to_array());
    let (bc, ac, ab) = (
        b.clone() * c.clone(),
        a.clone() * c.clone(),
        a.clone() * b.clone(),
    );
    let abc = a * b * c;
    let terms = bc.squared() * x.squared() + ac.squared() * y.squared();
    vec![terms + ab.squared() * z.squared() - abc.squared()]
}

/// Returns A x² + B y² + C z² + D xy + E xz + F yz + G x + H y + I z + J (S26).
pub fn quadric<N: Number>(ray: &Ray, shape: &Quadric) -> Vec<Poly<N>> {
    let [x, y, z] = from_point::<N>(ray, [0.0; 3]);
    let one = || Poly::constant(1.0);
    let monomials = [
        x.squared(),
        y.squared(),
        z.squared(),
        x.clone() * y.clone(),
        x.clone() * z.clone(),
        y.clone() * z.clone(),
        x,
        y,
        z,
        one(),
    ];
    let terms = monomials.into_iter().zip(shape.coefficients);
    let sum = terms.map(|(term, factor)| term * Poly::constant(factor));
    vec![sum.fold(Poly::constant(0.0), |all, term| all + term)]
}

/// Finds the boundaries of f ≤ 0: the roots where f changes its sign, and a root that f
/// touches from above, where the solid is one point of the line (S26).
pub fn changes<N: Number>(f: &Poly<N>) -> Result<Vec<Meeting<N>>, N::Undecided> {
    let roots = f.roots()?;
    let touches = roots.len() == 1 && f.sign_far_off(true)? == f.sign_far_off(false)?;
    if touches && f.sign_far_off(true)?.is_lt() {
        return Ok(Vec::new());
    }
    let (face, surface) = (0, 0);
    let met = |t| Meeting { t, face, surface };
    Ok(roots.into_iter().map(met).collect())
}

/// Returns the polynomials of the side, the base and the top (S24). With a = Q − P, w = x −
/// P, L = a·a and h = w·a, the solid is L² |w|² − L h² ≤ (r₀ L + (r₁ − r₀) h)² and 0 ≤ h ≤
/// L.
pub fn cone<N: Number>(ray: &Ray, shape: &Cone) -> Vec<Poly<N>> {
    let (base, top) = (
        constants(shape.base.to_array()),
        constants::<N>(shape.top.to_array()),
    );
    let a: [Poly<N>; 3] = std::array::from_fn(|k| top[k].clone() - base[k].clone());
    let w = from_point(ray, shape.base.to_array());
    let (l, h) = (dot(&a, &a), dot(&w, &a));
    let (r0, r1) = (
        Poly::constant(shape.base_radius),
        Poly::constant(shape.top_radius),
    );
    let radius = r0.clone() * l.clone() + (r1 - r0) * h.clone();
    let distance = l.squared() * dot(&w, &w) - l.clone() * h.squared();
    vec![
        distance - radius.squared(),
        Poly::constant(0.0) - h.clone(),
        h - l,
    ]
}
