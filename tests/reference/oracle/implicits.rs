//! Polynomial surfaces: hits and multiplicities worked out by hand, and products of known
//! factors.

use super::*;
use crate::common::property;
use lanecast::internals::geom::tape::Builder;
use lanecast::internals::geom::{Clip, Tape};
use lanecast::internals::reference::Crossing;
use proptest::prelude::*;

/// A polynomial, written down.
pub type Formula = fn(&mut Builder, [u32; 3]) -> u32;

pub fn tape(formula: impl FnOnce(&mut Builder, [u32; 3]) -> u32) -> Tape {
    let mut b = Builder::default();
    let xyz = [0, 1, 2].map(|axis| b.coordinate(axis));
    let last = formula(&mut b, xyz);
    b.finish(last)
}

/// f ≤ 0.
pub fn implicit(formula: Formula) -> impl Fn(&mut SceneBuilder) -> ShapeId + Copy {
    move |b| b.implicit("", tape(formula), false, None)
}

/// f = 0.
fn surface(formula: Formula, clip: Option<Clip>) -> impl Fn(&mut SceneBuilder) -> ShapeId + Copy {
    move |b| b.implicit("", tape(formula), true, clip)
}

fn squares(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let [x, y, z] = xyz.map(|v| b.power(v, 2));
    let sum = b.sum(x, y);
    b.sum(sum, z)
}

/// x² + y² + z² − 1.
pub fn ball(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let (sum, one) = (squares(b, xyz), b.constant(1.0));
    b.difference(sum, one)
}

/// Of radii 1.5 and 0.5 about the z-axis: (x² + y² + z² + 2)² − 9 (x² + y²).
pub fn torus(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let (sum, two) = (squares(b, xyz), b.constant(2.0));
    let sum = b.sum(sum, two);
    let square = b.power(sum, 2);
    let [x, y, _] = xyz.map(|v| b.power(v, 2));
    let (round, nine) = (b.sum(x, y), b.constant(9.0));
    let round = b.product(nine, round);
    b.difference(square, round)
}

/// x² − y² z.
fn umbrella(b: &mut Builder, [x, y, z]: [u32; 3]) -> u32 {
    let [xx, yy] = [x, y].map(|v| b.power(v, 2));
    let rest = b.product(yy, z);
    b.difference(xx, rest)
}

/// (x² + y² + z² − 1)².
fn squared(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let ball = ball(b, xyz);
    b.power(ball, 2)
}

fn minus_squared(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let square = squared(b, xyz);
    b.negated(square)
}

fn cubed(b: &mut Builder, xyz: [u32; 3]) -> u32 {
    let ball = ball(b, xyz);
    b.power(ball, 3)
}

/// All crossings of the only instance.
fn crossings(
    make: impl FnOnce(&mut SceneBuilder) -> ShapeId,
    org: [f64; 3],
    dir: [f64; 3],
) -> Vec<Crossing> {
    let (scene, all) = scene_of(|b| place(b, make));
    let reference = Reference::new(&scene, &all).unwrap();
    reference.crossings(org, dir, 0, 0)
}

pub fn depths(
    make: impl FnOnce(&mut SceneBuilder) -> ShapeId,
    org: [f64; 3],
    dir: [f64; 3],
) -> Vec<f64> {
    crossings(make, org, dir).iter().map(|c| c.t).collect()
}

pub const NONE: [f64; 0] = [];
pub const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

#[test]
fn torus_hits_and_normals() {
    let ring = implicit(torus);
    expect(ring, [-5.0, 0.0, 0.0], X, 3.0, [-1.0, 0.0, 0.0]);
    expect(ring, [0.0; 3], X, 1.0, [-1.0, 0.0, 0.0]);
    expect(ring, [1.5, 0.0, 0.0], X, 0.5, X);
    expect(ring, [0.0, 1.5, 9.0], [0.0, 0.0, -2.0], 4.25, Z);
    expect_miss(ring, [0.0, 0.0, 9.0], [0.0, 0.0, -1.0]);
    expect_miss(ring, [-5.0, 0.0, 0.5_f64.next_up()], X);
    assert_eq!(depths(ring, [-5.0, 0.0, 0.0], X), [3.0, 4.0, 6.0, 7.0]);
}

#[test]
fn a_torus_is_touched() {
    let ring = implicit(torus);
    // From outside at its outer rim; its top is one circle.
    expect_at(ring, [2.0, -5.0, 0.0], Y, 5.0);
    assert_eq!(depths(ring, [-5.0, 0.0, 0.5], X), [3.5, 6.5]);
    assert_eq!(depths(ring, [-5.0, 1.5, 0.5], X), [5.0]);
    expect_miss(ring, [2.0_f64.next_up(), -5.0, 0.0], Y);
    assert_eq!(depths(ring, [2.0_f64.next_down(), -5.0, 0.0], Y).len(), 2);
    // From inside at its inner rim: nothing changes there but for the surface.
    let y = 3.0_f64.sqrt();
    assert_eq!(depths(ring, [1.0, 0.0, 0.0], Y), [-y, y]);
    let all = [-y, 0.0, y];
    assert_eq!(depths(surface(torus, None), [1.0, 0.0, 0.0], Y), all);
    assert_eq!(depths(ring, [1.0_f64.next_down(), -5.0, 0.0], Y).len(), 4);
}

#[test]
fn roots_of_even_multiplicity_count_where_the_line_is_outside() {
    let org = [-5.0, 0.0, 0.0];
    assert_eq!(depths(implicit(squared), org, X), [4.0, 6.0]);
    assert_eq!(depths(implicit(minus_squared), org, X), NONE);
    assert_eq!(depths(implicit(cubed), org, X), [4.0, 6.0]);
    // A tangent, fourfold and sixfold.
    assert_eq!(depths(implicit(squared), [-5.0, 1.0, 0.0], X), [5.0]);
    assert_eq!(depths(implicit(minus_squared), [-5.0, 1.0, 0.0], X), NONE);
    assert_eq!(depths(implicit(cubed), [-5.0, 1.0, 0.0], X), [5.0]);
    assert_eq!(
        depths(implicit(cubed), [-5.0, 1.0_f64.next_up(), 0.0], X),
        NONE
    );
    let formulas: [Formula; 3] = [squared, minus_squared, cubed];
    for formula in formulas {
        assert_eq!(depths(surface(formula, None), org, X), [4.0, 6.0]);
        assert_eq!(depths(surface(formula, None), [-5.0, 1.0, 0.0], X), [5.0]);
    }
    // Where the square is a root, its gradient is zero.
    assert_eq!(crossings(implicit(squared), org, X)[0].normal, [0.0; 3]);
}

#[test]
fn umbrellas_have_a_handle() {
    let turned = |b: &mut Builder, xyz: [u32; 3]| {
        let f = umbrella(b, xyz);
        b.negated(f)
    };
    // Through the double line: outside of x² ≤ y² z on both sides, or inside of its
    // opposite; and the handle below, where there is no surface about it.
    for z in [1.0, -1.0] {
        let org = [-3.0, 0.0, z];
        assert_eq!(depths(implicit(umbrella), org, X), [3.0]);
        assert_eq!(depths(implicit(turned), org, X), NONE);
        assert_eq!(depths(surface(turned, None), org, X), [3.0]);
        assert_eq!(crossings(implicit(umbrella), org, X)[0].normal, [0.0; 3]);
    }
    // x = t − 3, y = t: x² = y² / 4.
    let dir = [1.0, 1.0, 0.0];
    assert_eq!(
        depths(implicit(umbrella), [-3.0, 0.0, 0.25], dir),
        [2.0, 6.0]
    );
    // Along the handle, and within a line of the sheet.
    assert_eq!(depths(surface(umbrella, None), [0.0, 0.0, -3.0], Z), NONE);
    assert_eq!(depths(implicit(umbrella), [-3.0, -3.0, 1.0], dir), NONE);
    assert_eq!(depths(surface(umbrella, None), [0.0; 3], [0.0; 3]), NONE);
}

#[test]
fn clips_are_closed() {
    let sphere = |x: f64, radius: f64| {
        let center = v(x, 0.0, 0.0);
        Some(Clip::Sphere(Sphere { center, radius }))
    };
    let cuboid = |min: DVec3, max: DVec3| Some(Clip::Cuboid(Cuboid { min, max }));
    let org = [-5.0, 0.0, 0.0];
    let ring = |clip| depths(surface(torus, clip), org, X);
    assert_eq!(ring(None), [3.0, 4.0, 6.0, 7.0]);
    assert_eq!(ring(sphere(0.0, 1.0)), [4.0, 6.0]);
    assert_eq!(ring(sphere(0.0, 1.0_f64.next_down())), NONE);
    assert_eq!(ring(sphere(0.0, 1.0_f64.next_up())), [4.0, 6.0]);
    assert_eq!(ring(sphere(-1.5, 0.5)), [3.0, 4.0]);
    // Touched by the line where the surface is.
    assert_eq!(
        depths(surface(torus, sphere(1.0, 1.0)), [2.0, -5.0, 0.0], Y),
        [5.0]
    );
    assert_eq!(
        depths(surface(torus, sphere(1.0, 1.0)), [2.0, -5.0, 0.1], Y),
        NONE
    );
    // And where it is not.
    let touched = surface(torus, sphere(0.0, 1.0));
    assert_eq!(depths(touched, [1.0, 0.0, 0.0], Y), [0.0]);
    let corner = cuboid(v(1.0, 0.0, -1.0), v(2.0, 1.0, 0.0));
    assert_eq!(ring(corner), [6.0, 7.0]);
    let corner = cuboid(v(1.0_f64.next_up(), 0.0, -1.0), v(2.0, 1.0, 0.0));
    assert_eq!(ring(corner), [7.0]);
    assert_eq!(
        ring(cuboid(v(1.0, f64::MIN_POSITIVE, -1.0), v(2.0, 1.0, 0.0))),
        NONE
    );
    // Irrational ends that are equal: the ball of radius √3 / 2 about the origin
    // cuts the line x = y = z at 1/2, and so does the plane x = 1/2.
    let plane = |b: &mut Builder, [x, _, _]: [u32; 3]| {
        let half = b.constant(0.5);
        let off = b.difference(x, half);
        b.power(off, 3)
    };
    let diagonal = [1.0, 1.0, 1.0];
    let half = 0.75_f64.sqrt();
    let radii = [half.next_up(), half, half.next_down()];
    let met = radii.map(|r| depths(surface(plane, sphere(0.0, r)), [-1.0; 3], diagonal).len());
    let inside = radii.map(|r| usize::from(exceeds(r, 0.75)));
    assert_eq!(met, inside);
    assert!(met.contains(&0) && met.contains(&1));
    // And what the tree prunes by is the clip: the same answers without it.
    expect_at(surface(torus, sphere(0.0, 1.0)), org, X, 4.0);
    // Near its rim, too.
    let rim = [2.0, -5.0, 0.0];
    expect_at(surface(torus, sphere(0.0, 2.0)), rim, Y, 5.0);
    let block = cuboid(v(-2.0, 0.0, 0.0), v(2.0, 2.0, 2.0));
    expect_at(surface(torus, block), rim, Y, 5.0);
    expect_miss(surface(torus, sphere(0.0, 0.5)), org, X);
}

/// r² > q, by the exact error of the rounded square.
fn exceeds(r: f64, q: f64) -> bool {
    let square = r * r;
    square > q || square == q && r.mul_add(r, -square) > 0.0
}

#[test]
fn equal_roots_of_different_kinds_are_ties() {
    // The unit ball as a sphere, a polynomial, and one times another factor.
    let unit = |b: &mut SceneBuilder| {
        let (center, radius) = (DVec3::ZERO, 1.0);
        b.sphere("", Sphere { center, radius })
    };
    let more = |b: &mut Builder, xyz: [u32; 3]| {
        let (sum, nine) = (squares(b, xyz), b.constant(9.0));
        let (far, near) = (b.sum(sum, nine), ball(b, xyz));
        b.product(far, near)
    };
    for order in [[0, 1, 2], [1, 0, 2], [2, 1, 0], [2, 0, 1]] {
        let all = |b: &mut SceneBuilder| {
            for kind in order {
                match kind {
                    0 => place(b, unit),
                    1 => place(b, implicit(ball)),
                    _ => place(b, implicit(more)),
                }
            }
        };
        for org in [[-5.0, 0.3, 0.1], [-5.0, 1.0, 0.0], [-0.1, 0.2, 0.3]] {
            assert_eq!(
                certain(&ask_all(all, org, X)).instance,
                0,
                "{order:?} {org:?}"
            );
        }
    }
}

/// Of x alone: c ∏ (x − r)^m ∏ (x² − q).
#[derive(Clone, Debug)]
struct Factors {
    factor: f64,
    linear: Vec<(f64, u32)>,
    quadratic: Vec<f64>,
}

impl Factors {
    fn tape(&self) -> Tape {
        tape(|b, [x, _, _]| {
            let mut all = b.constant(self.factor);
            for (r, m) in &self.linear {
                let r = b.constant(*r);
                let off = b.difference(x, r);
                let power = b.power(off, *m);
                all = b.product(all, power);
            }
            for q in &self.quadratic {
                let (xx, q) = (b.power(x, 2), b.constant(*q));
                let factor = b.difference(xx, q);
                all = b.product(all, factor);
            }
            all
        })
    }

    /// Its roots, and the sign on both sides of each.
    fn signs(&self) -> Vec<(f64, f64, f64)> {
        let mut roots: Vec<(f64, u32)> = self.linear.clone();
        for q in self.quadratic.iter().filter(|q| **q > 0.0) {
            roots.extend([(-q.sqrt(), 1), (q.sqrt(), 1)]);
        }
        for q in self.quadratic.iter().filter(|q| **q == 0.0) {
            roots.push((*q, 2));
        }
        roots.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut merged: Vec<(f64, u32)> = Vec::new();
        for (r, m) in roots {
            match merged.last_mut() {
                Some((last, count)) if *last == r => *count += m,
                _ => merged.push((r, m)),
            }
        }
        let degree: u32 = merged.iter().map(|(_, m)| m).sum();
        let mut sign = self.factor.signum() * if degree % 2 == 1 { -1.0 } else { 1.0 };
        let mut signs = Vec::new();
        for (r, m) in merged {
            let before = sign;
            if m % 2 == 1 {
                sign = -sign;
            }
            signs.push((r, before, sign));
        }
        signs
    }
}

prop_compose! {
    /// Of degree 24 at most; roots are no −0.
    fn factors()(
        factor in prop::sample::select(vec![1.0, -1.0, 0.3, -7.0]),
        linear in prop::collection::vec((-12..12_i32, 1..4_u32), 0..5),
        // Not the squares of such roots: √q is no short number then.
        quadratic in prop::collection::vec(
            prop::sample::select(vec![-1.0, 0.5, 2.0, 3.0, 0.7, 1.1, 0.0]), 0..4),
    ) -> Factors {
        let linear = linear.into_iter().map(|(n, m)| (f64::from(n) / 8.0, m)).collect();
        Factors { factor, linear, quadratic }
    }
}

proptest! {
    #![proptest_config(property(300))]

    /// Roots of products are their factors', rounded as the machine does.
    #[test]
    fn products_have_the_roots_of_their_factors(factors in factors()) {
        // A constant has no surface, and is refused.
        prop_assume!(!(factors.linear.is_empty() && factors.quadratic.is_empty()));
        let signs = factors.signs();
        let all: Vec<f64> = signs.iter().map(|s| s.0).collect();
        let outside = signs.iter().filter(|s| s.1 > 0.0 || s.2 > 0.0);
        let solid: Vec<f64> = outside.map(|s| s.0).collect();
        let make = |open| {
            let tape = factors.tape();
            move |b: &mut SceneBuilder| b.implicit("", tape, open, None)
        };
        prop_assert_eq!(depths(make(true), [0.0; 3], X), all);
        prop_assert_eq!(depths(make(false), [0.0; 3], X), solid.clone());
        // From elsewhere, as hits; by the tree and by brute force.
        let first = solid.iter().copied().find(|t| *t > 0.0);
        prop_assert_eq!(ask(make(false), [0.0; 3], X).map(|hit| hit.t), first);
        // As an operand, cut off far outside.
        let cut = |b: &mut SceneBuilder| {
            let one = make(false)(b);
            let row = Cuboid { min: DVec3::splat(-64.0), max: DVec3::splat(64.0) };
            let other = b.cuboid("", row);
            b.csg("", Operator::Intersection, &[one, other].map(Operand::shape))
        };
        let mut ends: Vec<f64> =
            signs.iter().filter(|s| s.1 != s.2).map(|s| s.0).collect();
        let first = signs.first().map_or(factors.factor, |s| s.1);
        let last = signs.last().map_or(factors.factor, |s| s.2);
        if first < 0.0 { ends.insert(0, -64.0); }
        if last < 0.0 { ends.push(64.0); }
        prop_assert_eq!(depths(cut, [0.0; 3], X), ends);
    }
}
