//! Fused tapes, for evaluations that load and store every value: a product that only one sum needs
//! is computed in the same step, which halves the memory traffic.

use super::{Places, Step};

/// A [`Step`] whose operands are slots. Product and sum are rounded separately, as in two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fused {
    Coordinate(u8),
    Constant(f64),
    Sum(u16, u16),
    Difference(u16, u16),
    Product(u16, u16),
    Scaled(u16, f64),
    /// The product of the first two, plus the third.
    ProductAnd(u16, u16, u16),
    /// The product of the first two, minus the third.
    ProductLess(u16, u16, u16),
    /// The third, minus the product of the first two.
    LessProduct(u16, u16, u16),
    ScaledAnd(u16, f64, u16),
    ScaledLess(u16, f64, u16),
    LessScaled(u16, f64, u16),
}

/// Fuses steps; returns those that are left with the slots of their values, and the number of
/// slots.
pub(super) fn fused(steps: &[Step]) -> (Vec<(Fused, u16)>, usize) {
    let mut uses = vec![0_u32; steps.len()];
    for step in steps {
        for operand in super::operands(step).into_iter().flatten() {
            uses[operand as usize] += 1;
        }
    }
    let is_product = |i: u32| matches!(steps[i as usize], Step::Product(..) | Step::Scaled(..));
    // The operand of a sum that is fused with it.
    let inner = |step: &Step| match *step {
        Step::Sum(a, b) | Step::Difference(a, b) => [b, a]
            .into_iter()
            .find(|i| uses[*i as usize] == 1 && is_product(*i)),
        _ => None,
    };
    let mut is_left = vec![true; steps.len()];
    for step in steps {
        if let Some(i) = inner(step) {
            is_left[i as usize] = false;
        }
    }
    // The new number of each step.
    let mut number = vec![0_u32; steps.len()];
    let mut needs: Vec<[Option<u32>; 3]> = Vec::new();
    for (i, step) in steps.iter().enumerate().filter(|(i, _)| is_left[*i]) {
        number[i] = needs.len() as u32;
        let [a, b] = super::operands(step);
        let all = match inner(step) {
            None => [a, b, None],
            Some(product) => {
                let [x, y] = super::operands(&steps[product as usize]);
                [x, y, a.filter(|a| *a != product).or(b)]
            }
        };
        needs.push(all.map(|operand| operand.map(|i| number[i as usize])));
    }
    let Places { of, count } = Places::assign(&needs);
    let place = |i: u32| of[number[i as usize] as usize];
    let fuse = |step: &Step| match (*step, inner(step).map(|i| (i, steps[i as usize]))) {
        (Step::Sum(a, b), Some((i, Step::Product(x, y)))) => {
            Fused::ProductAnd(place(x), place(y), place(if b == i { a } else { b }))
        }
        (Step::Sum(a, b), Some((i, Step::Scaled(x, by)))) => {
            Fused::ScaledAnd(place(x), by, place(if b == i { a } else { b }))
        }
        (Step::Difference(a, b), Some((i, Step::Product(x, y)))) if b == i => {
            Fused::LessProduct(place(x), place(y), place(a))
        }
        (Step::Difference(a, b), Some((i, Step::Scaled(x, by)))) if b == i => {
            Fused::LessScaled(place(x), by, place(a))
        }
        (Step::Difference(_, b), Some((_, Step::Product(x, y)))) => {
            Fused::ProductLess(place(x), place(y), place(b))
        }
        (Step::Difference(_, b), Some((_, Step::Scaled(x, by)))) => {
            Fused::ScaledLess(place(x), by, place(b))
        }
        (Step::Coordinate(axis), _) => Fused::Coordinate(axis),
        (Step::Constant(value), _) => Fused::Constant(value),
        (Step::Sum(a, b), _) => Fused::Sum(place(a), place(b)),
        (Step::Difference(a, b), _) => Fused::Difference(place(a), place(b)),
        (Step::Product(a, b), _) => Fused::Product(place(a), place(b)),
        (Step::Scaled(a, by), _) => Fused::Scaled(place(a), by),
    };
    let left = steps.iter().enumerate().filter(|(i, _)| is_left[*i]);
    let all = left.map(|(i, step)| (fuse(step), place(i as u32)));
    (all.collect(), count)
}
