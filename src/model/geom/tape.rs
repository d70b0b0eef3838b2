//! Polynomials in x, y, z as tapes of sums and products, factored as they were written.
//!
//! Every step is a sum, a difference or a product of two earlier ones, a coordinate, a constant
//! (an exact f64), or an earlier step times a constant. The last step is the polynomial. A tape
//! stands for the exact value of these steps; an evaluation in rounded arithmetic has to bound its
//! error.

mod fused;
mod roundings;

pub use fused::Fused;
use roundings::Roundings;
use std::collections::HashMap;

/// The highest degree of a surface's polynomial.
pub const MAX_DEGREE: u32 = 24;

/// The most steps of a surface's tape.
pub const MAX_STEPS: usize = 4096;

/// The most values that a surface's tape keeps at once.
pub const MAX_SLOTS: usize = 64;

/// A step of a tape; its operands are numbers of earlier steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The coordinate x, y or z: 0, 1 or 2.
    Coordinate(u8),
    Constant(f64),
    Sum(u32, u32),
    /// The first operand minus the second.
    Difference(u32, u32),
    Product(u32, u32),
    /// The operand times a constant.
    Scaled(u32, f64),
}

impl Step {
    /// Returns the constant in this step.
    pub fn constant(&self) -> Option<f64> {
        match *self {
            Step::Constant(value) | Step::Scaled(_, value) => Some(value),
            _ => None,
        }
    }

    /// Returns a key that is the same for equal steps only.
    pub fn key(&self) -> (u8, u64, u64) {
        match *self {
            Step::Coordinate(axis) => (0, u64::from(axis), 0),
            Step::Constant(value) => (1, value.to_bits(), 0),
            Step::Sum(a, b) => (2, u64::from(a), u64::from(b)),
            Step::Difference(a, b) => (3, u64::from(a), u64::from(b)),
            Step::Product(a, b) => (4, u64::from(a), u64::from(b)),
            Step::Scaled(a, by) => (5, u64::from(a), by.to_bits()),
        }
    }
}

/// Arithmetic in which a tape can be evaluated.
pub trait Arithmetic {
    type Value: Clone;

    fn coordinate(&self, axis: usize) -> Self::Value;
    fn constant(&self, value: f64) -> Self::Value;
    fn sum(&self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    fn difference(&self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    fn product(&self, a: &Self::Value, b: &Self::Value) -> Self::Value;

    /// Multiplies a value by itself, for which some arithmetic has tighter bounds.
    fn square(&self, a: &Self::Value) -> Self::Value {
        self.product(a, a)
    }

    /// Multiplies a value by a constant, for which some arithmetic has tighter bounds.
    fn scaled(&self, a: &Self::Value, by: f64) -> Self::Value {
        self.product(a, &self.constant(by))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Tape {
    steps: Vec<Step>,
    /// An upper bound of each step's degree.
    degrees: Vec<u32>,
    /// The slot in which each step's value is kept.
    slots: Vec<u16>,
    /// The number of slots.
    slot_count: usize,
    /// The same polynomial in fewer steps, with the slots of their values.
    fused: Vec<(Fused, u16)>,
    fused_count: usize,
    /// The error of an evaluation in f64.
    roundings: Roundings,
}

impl Tape {
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Returns an upper bound of the polynomial's degree; leading terms may cancel.
    pub fn degree(&self) -> u32 {
        self.degrees.last().copied().unwrap_or(0)
    }

    /// Returns an upper bound of each step's degree.
    pub fn degrees(&self) -> &[u32] {
        &self.degrees
    }

    pub fn slots(&self) -> &[u16] {
        &self.slots
    }

    pub fn slot_count(&self) -> usize {
        self.slot_count
    }

    /// Returns the fused steps, which give the same bits, each with the slot of its value; and the
    /// number of slots.
    pub fn fused(&self) -> (&[(Fused, u16)], usize) {
        (&self.fused, self.fused_count)
    }

    /// Returns how many roundings of its magnitude a value in f64 may be off by, with coordinates'
    /// magnitudes no less than [`floor`](Self::floor) (F1, docs/numerics/polynomials.md).
    pub fn roundings(&self) -> f64 {
        self.roundings.count
    }

    /// Returns the least magnitude of a coordinate that bounds may take; above it nothing
    /// underflows (F4, docs/numerics/polynomials.md).
    pub fn floor(&self) -> f64 {
        self.roundings.floor
    }

    pub fn bytes(&self) -> usize {
        let step = size_of::<Step>() + size_of::<u32>() + size_of::<u16>();
        self.steps.len() * step + self.fused.len() * size_of::<(Fused, u16)>()
    }

    /// Evaluates the tape in an arithmetic of plain numbers, in slots on the stack.
    #[inline(always)]
    pub fn evaluate_plain<A: Arithmetic<Value: Copy>>(&self, arithmetic: &A) -> A::Value {
        let zero = arithmetic.constant(0.0);
        match self.slot_count {
            0..=6 => self.evaluate_in(arithmetic, &mut [zero; 6]),
            7..=12 => self.evaluate_in(arithmetic, &mut [zero; 12]),
            13..=24 => self.evaluate_in(arithmetic, &mut [zero; 24]),
            _ => self.evaluate_in(arithmetic, &mut vec![zero; self.slot_count]),
        }
    }

    #[inline(always)]
    fn evaluate_in<A: Arithmetic<Value: Copy>>(
        &self,
        arithmetic: &A,
        kept: &mut [A::Value],
    ) -> A::Value {
        let mut last = kept[0];
        for (step, slot) in self.steps.iter().zip(&self.slots) {
            let of = |i: &u32| &kept[usize::from(self.slots[*i as usize])];
            last = match step {
                Step::Coordinate(axis) => arithmetic.coordinate(usize::from(*axis)),
                Step::Constant(value) => arithmetic.constant(*value),
                Step::Sum(a, b) => arithmetic.sum(of(a), of(b)),
                Step::Difference(a, b) => arithmetic.difference(of(a), of(b)),
                Step::Product(a, b) => arithmetic.product(of(a), of(b)),
                Step::Scaled(a, by) => arithmetic.scaled(of(a), *by),
            };
            kept[usize::from(*slot)] = last;
        }
        last
    }

    /// Evaluates the tape in any arithmetic.
    pub fn evaluate<A: Arithmetic>(&self, arithmetic: &A) -> A::Value {
        let mut values: Vec<A::Value> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let of = |i: &u32| &values[*i as usize];
            let value = match step {
                Step::Coordinate(axis) => arithmetic.coordinate(usize::from(*axis)),
                Step::Constant(value) => arithmetic.constant(*value),
                Step::Sum(a, b) => arithmetic.sum(of(a), of(b)),
                Step::Difference(a, b) => arithmetic.difference(of(a), of(b)),
                Step::Product(a, b) if a == b => arithmetic.square(of(a)),
                Step::Product(a, b) => arithmetic.product(of(a), of(b)),
                Step::Scaled(a, by) => arithmetic.scaled(of(a), *by),
            };
            values.push(value);
        }
        values.pop().unwrap_or_else(|| arithmetic.constant(0.0))
    }
}

/// Builds tapes: equal steps are stored once, and products with 0 or 1 make no step.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    steps: Vec<Step>,
    known: HashMap<(u8, u64, u64), u32>,
}

impl Builder {
    pub fn coordinate(&mut self, axis: u8) -> u32 {
        self.push(Step::Coordinate(axis))
    }

    /// Adds a constant, which is finite.
    pub fn constant(&mut self, value: f64) -> u32 {
        // −0 becomes +0, so that there is one zero.
        self.push(Step::Constant(value + 0.0))
    }

    pub fn sum(&mut self, a: u32, b: u32) -> u32 {
        match (self.value(a), self.value(b)) {
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            _ => self.push(Step::Sum(a.min(b), a.max(b))),
        }
    }

    pub fn difference(&mut self, a: u32, b: u32) -> u32 {
        match self.value(b) {
            Some(0.0) => a,
            _ if a == b => self.constant(0.0),
            _ => self.push(Step::Difference(a, b)),
        }
    }

    pub fn product(&mut self, a: u32, b: u32) -> u32 {
        match (self.value(a), self.value(b)) {
            (Some(0.0), _) | (_, Some(1.0)) => a,
            (_, Some(0.0)) | (Some(1.0), _) => b,
            (Some(by), _) => self.push(Step::Scaled(b, by)),
            (_, Some(by)) => self.push(Step::Scaled(a, by)),
            _ => self.push(Step::Product(a.min(b), a.max(b))),
        }
    }

    /// Adds a power by repeated squaring.
    pub fn power(&mut self, base: u32, exponent: u32) -> u32 {
        let (mut square, mut rest) = (base, exponent);
        let mut result = None;
        while rest > 0 {
            if rest & 1 == 1 {
                result = Some(match result {
                    None => square,
                    Some(product) => self.product(product, square),
                });
            }
            rest >>= 1;
            if rest > 0 {
                square = self.product(square, square);
            }
        }
        result.unwrap_or_else(|| self.constant(1.0))
    }

    pub fn negated(&mut self, a: u32) -> u32 {
        if let Some(value) = self.value(a) {
            return self.constant(-value);
        }
        let zero = self.constant(0.0);
        self.push(Step::Difference(zero, a))
    }

    /// Returns the value of a step that is a constant.
    pub fn value(&self, step: u32) -> Option<f64> {
        match self.steps[step as usize] {
            Step::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// Returns the tape whose last step is `last`, without the steps that it does not need.
    pub fn finish(self, last: u32) -> Tape {
        let mut needed = vec![false; self.steps.len()];
        needed[last as usize] = true;
        for i in (0..=last as usize).rev() {
            if needed[i] {
                for operand in operands(&self.steps[i]).into_iter().flatten() {
                    needed[operand as usize] = true;
                }
            }
        }
        let mut place = vec![0; self.steps.len()];
        let mut steps = Vec::new();
        for i in (0..=last as usize).filter(|i| needed[*i]) {
            place[i] = steps.len() as u32;
            let of = |operand: u32| place[operand as usize];
            steps.push(match self.steps[i] {
                Step::Sum(a, b) => Step::Sum(of(a), of(b)),
                Step::Difference(a, b) => Step::Difference(of(a), of(b)),
                Step::Product(a, b) => Step::Product(of(a), of(b)),
                Step::Scaled(a, by) => Step::Scaled(of(a), by),
                leaf => leaf,
            });
        }
        let operands: Vec<_> = steps.iter().map(operands).collect();
        let places = Places::assign(&operands);
        let (fused, fused_count) = fused::fused(&steps);
        Tape {
            degrees: degrees(&steps),
            roundings: Roundings::count(&steps),
            steps,
            slots: places.of,
            slot_count: places.count,
            fused,
            fused_count,
        }
    }

    fn push(&mut self, step: Step) -> u32 {
        let next = self.steps.len() as u32;
        let number = *self.known.entry(step.key()).or_insert(next);
        if number == next {
            self.steps.push(step);
        }
        number
    }
}

fn operands(step: &Step) -> [Option<u32>; 2] {
    match *step {
        Step::Coordinate(_) | Step::Constant(_) => [None, None],
        Step::Sum(a, b) | Step::Difference(a, b) | Step::Product(a, b) => [Some(a), Some(b)],
        Step::Scaled(a, _) => [Some(a), None],
    }
}

fn degrees(steps: &[Step]) -> Vec<u32> {
    let mut degrees: Vec<u32> = Vec::with_capacity(steps.len());
    for step in steps {
        let of = |i: u32| degrees[i as usize];
        degrees.push(match *step {
            Step::Coordinate(_) => 1,
            Step::Constant(_) => 0,
            Step::Sum(a, b) | Step::Difference(a, b) => of(a).max(of(b)),
            Step::Product(a, b) => of(a).saturating_add(of(b)),
            Step::Scaled(a, _) => of(a),
        });
    }
    degrees
}

/// Slots of steps' values: the slot of a value is free again after its last use.
struct Places {
    of: Vec<u16>,
    count: usize,
}

impl Places {
    /// Assigns slots to steps with up to K operands each.
    fn assign<const K: usize>(needs: &[[Option<u32>; K]]) -> Places {
        let mut last_use: Vec<usize> = (0..needs.len()).collect();
        for (i, operands) in needs.iter().enumerate() {
            for operand in operands.iter().flatten() {
                last_use[*operand as usize] = i;
            }
        }
        if let Some(last) = last_use.last_mut() {
            *last = usize::MAX;
        }
        let (mut free, mut count) = (Vec::new(), 0_u16);
        let mut of: Vec<u16> = Vec::with_capacity(needs.len());
        for (i, operands) in needs.iter().enumerate() {
            // The result may take an operand's slot, because operands are read before the result
            // is written.
            for (k, operand) in operands.iter().enumerate() {
                if let Some(j) = operand.filter(|_| !operands[..k].contains(operand))
                    && last_use[j as usize] == i
                {
                    free.push(of[j as usize]);
                }
            }
            of.push(free.pop().unwrap_or_else(|| {
                count = count.saturating_add(1);
                count - 1
            }));
        }
        Places {
            of,
            count: usize::from(count),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Plain([f64; 3]);

    impl Arithmetic for Plain {
        type Value = f64;

        fn coordinate(&self, axis: usize) -> f64 {
            self.0[axis]
        }

        fn constant(&self, value: f64) -> f64 {
            value
        }

        fn sum(&self, a: &f64, b: &f64) -> f64 {
            a + b
        }

        fn difference(&self, a: &f64, b: &f64) -> f64 {
            a - b
        }

        fn product(&self, a: &f64, b: &f64) -> f64 {
            a * b
        }
    }

    /// (x² + y² + z² − 1)³ − x² z³.
    fn heart() -> Tape {
        let mut b = Builder::default();
        let [x, y, z] = [0, 1, 2].map(|axis| b.coordinate(axis));
        let [xx, yy, zz] = [x, y, z].map(|v| b.power(v, 2));
        let one = b.constant(1.0);
        let sum = b.sum(xx, yy);
        let sum = b.sum(sum, zz);
        let ball = b.difference(sum, one);
        let cube = b.power(ball, 3);
        let zzz = b.power(z, 3);
        let rest = b.product(xx, zzz);
        let _unused = b.sum(rest, one);
        let last = b.difference(cube, rest);
        b.finish(last)
    }

    #[test]
    fn steps_give_the_polynomial() {
        let heart = heart();
        assert_eq!(heart.degree(), 6);
        let value = heart.evaluate(&Plain([0.5, -2.0, 1.5]));
        let ball: f64 = 0.25 + 4.0 + 2.25 - 1.0;
        assert_eq!(value, ball.powi(3) - 0.25 * 3.375);
    }

    #[test]
    fn equal_steps_are_one_and_unused_ones_none() {
        let heart = heart();
        // x y z, three squares, 1, two sums, the ball, its square and cube, z³, the
        // product, the difference.
        assert_eq!(heart.steps().len(), 15);
    }

    #[test]
    fn no_value_is_overwritten_before_its_last_use() {
        let heart = heart();
        assert!(heart.slot_count() < heart.steps().len());
        let plain = Plain([0.5, -2.0, 1.5]);
        let mut kept = vec![f64::NAN; heart.slot_count()];
        for (step, slot) in heart.steps().iter().zip(heart.slots()) {
            let of = |i: &u32| kept[usize::from(heart.slots()[*i as usize])];
            kept[usize::from(*slot)] = match step {
                Step::Coordinate(axis) => plain.coordinate(usize::from(*axis)),
                Step::Constant(value) => *value,
                Step::Sum(a, b) => of(a) + of(b),
                Step::Difference(a, b) => of(a) - of(b),
                Step::Product(a, b) => of(a) * of(b),
                Step::Scaled(a, by) => of(a) * by,
            };
        }
        let last = usize::from(heart.slots()[heart.steps().len() - 1]);
        assert_eq!(kept[last], heart.evaluate(&plain));
    }

    #[test]
    fn powers_and_constants() {
        let mut b = Builder::default();
        let x = b.coordinate(0);
        let none = b.power(x, 0);
        assert_eq!(b.value(none), Some(1.0));
        let zero = b.constant(-0.0);
        assert_eq!(b.sum(x, zero), x);
        assert_eq!(b.product(x, none), x);
        let high = b.power(x, 13);
        let tape = b.finish(high);
        assert_eq!(tape.degree(), 13);
        assert_eq!(tape.evaluate(&Plain([2.0, 0.0, 0.0])), 8192.0);
    }
}
