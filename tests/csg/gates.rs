//! Compares gate programs with the operators that they stand for.

use super::truth::Tree;
use crate::common::property;
use lanecast::internals::csg::{Builder, Place, Restricted, State};
use lanecast::internals::scene::Operator;
use proptest::prelude::*;

const OPERATORS: [Operator; 5] = [
    Operator::Union,
    Operator::Intersection,
    Operator::Difference,
    Operator::Xor,
    Operator::Complement,
];

/// An operator over others and operands, by a list of choices.
fn grow(builder: &mut Builder, place: Place, choices: &mut impl Iterator<Item = u8>) -> Tree {
    let choice = choices.next().unwrap_or(0);
    if choice < 80 {
        return Tree::Operand(builder.operand(place) as usize);
    }
    let operator = OPERATORS[usize::from(choice) % 5];
    let [first, others] = builder.operator(operator, place);
    let more = match operator {
        Operator::Complement => 0,
        _ => choice / 8 % 4,
    };
    let mut below = vec![grow(builder, first, choices)];
    below.extend((0..more).map(|_| grow(builder, others, choices)));
    Tree::of(operator, below)
}

proptest! {
    #![proptest_config(property(2_000))]

    /// Gates that count, and bits of some operands, say what the operators say.
    #[test]
    fn programs_say_what_operators_say(
        choices in prop::collection::vec(any::<u8>(), 1..60),
        inside in any::<u64>(),
        matter in any::<u64>(),
    ) {
        let mut builder = Builder::default();
        let answer = builder.answer();
        let tree = grow(&mut builder, answer, &mut choices.into_iter());
        let program = builder.finish();
        prop_assume!(program.operands() <= 64);
        let is_inside = |i: u32| (inside & matter) >> i & 1 != 0;
        let numbers = 0..program.operands() as u32;
        let truth = tree.says(&numbers.clone().map(is_inside).collect::<Vec<_>>());
        let outside = tree.says(&vec![false; program.operands()]);

        let mut state = State::default();
        program.start(&mut state);
        prop_assert_eq!(program.is_inside(&state), outside);
        for operand in numbers.clone().filter(|i| is_inside(*i)) {
            program.flip(&mut state, operand, true);
        }
        prop_assert_eq!(program.is_inside(&state), truth);

        let some: Vec<u32> = numbers.filter(|i| matter >> i & 1 != 0).collect();
        let mut part = Restricted::default();
        part.set(&program, &some);
        let rays = some.iter().map(|i| if is_inside(*i) { 2 } else { 0 });
        let found = part.inside(rays, &mut Vec::new());
        prop_assert_eq!(found & 2 != 0, truth);
        prop_assert_eq!(found & 1 != 0, outside);
    }
}
