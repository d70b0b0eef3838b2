//! A program of which only some operands matter: those that a packet of rays may
//! meet. All others are as they are outside; what they make of their gates is a
//! constant. Rays are bits, so that a gate is one operation for all of them.

use super::program::{Gate, OUT, Program, Wire};

#[derive(Clone, Debug, Default)]
pub struct Restricted {
    /// By operand that matters, in their order.
    inputs: Vec<Input>,
    /// Those that feed others stand before them; the last gives the answer.
    gates: Vec<Partial>,
    /// Of the program, those that are needed.
    needed: Vec<u32>,
    /// By gate of the program: its row here; [`NONE`] but for the needed ones, and
    /// of all between calls.
    rows: Vec<u32>,
}

const NONE: u32 = u32::MAX;

/// Where a value goes: a row of [`Restricted::gates`].
#[derive(Clone, Copy, Debug)]
struct Input {
    gate: u32,
    /// All ones where negated.
    flip: u32,
}

#[derive(Clone, Copy, Debug)]
struct Partial {
    gate: Gate,
    /// What the other inputs say.
    rest: u32,
    out: Input,
}

fn all(on: bool) -> u32 {
    if on { u32::MAX } else { 0 }
}

impl Restricted {
    /// Of `operands`, by number.
    pub fn set(&mut self, program: &Program, operands: &[u32]) {
        let (needed, rows) = (&mut self.needed, &mut self.rows);
        needed.clear();
        rows.resize(program.gates().max(rows.len()), NONE);
        for operand in operands {
            let mut gate = program.operand_wires[*operand as usize].gate;
            // A chain of gates is followed once.
            while gate != OUT && rows[gate as usize] == NONE {
                rows[gate as usize] = 0;
                needed.push(gate);
                gate = program.gate_wires[gate as usize].gate;
            }
        }
        if needed.is_empty() {
            needed.push(0);
        }
        // A gate's number is greater than that of the one it feeds.
        needed.sort_unstable_by(|a, b| b.cmp(a));
        for (row, gate) in (0..).zip(needed.iter()) {
            rows[*gate as usize] = row;
        }
        let row = |gate: u32| rows[gate as usize];
        let input = |wire: Wire| Input {
            gate: if wire.gate == OUT { 0 } else { row(wire.gate) },
            flip: all(wire.negated),
        };
        self.gates.clear();
        self.gates.extend(needed.iter().map(|gate| Partial {
            gate: program.gates[*gate as usize],
            rest: program.idle[*gate as usize],
            out: input(program.gate_wires[*gate as usize]),
        }));
        self.inputs.clear();
        for operand in operands {
            let wire = program.operand_wires[*operand as usize];
            let input = input(wire);
            self.gates[input.gate as usize].rest -= u32::from(wire.negated);
            self.inputs.push(input);
        }
        for (place, gate) in needed.iter().enumerate() {
            let wire = program.gate_wires[*gate as usize];
            if wire.gate != OUT {
                let idle = program.value(*gate, program.idle[*gate as usize]);
                let out = self.gates[place].out.gate as usize;
                self.gates[out].rest -= u32::from(idle != wire.negated);
            }
        }
        for gate in needed.iter() {
            rows[*gate as usize] = NONE;
        }
        for partial in &mut self.gates {
            partial.rest = all(match partial.gate {
                Gate::Any => partial.rest > 0,
                Gate::Odd => partial.rest & 1 != 0,
            });
        }
    }

    /// The rays that are in the solid, of those in each operand, in their order.
    #[inline]
    pub fn inside(&self, operands: impl Iterator<Item = u32>, values: &mut Vec<u32>) -> u32 {
        values.clear();
        values.extend(self.gates.iter().map(|partial| partial.rest));
        let feed = |values: &mut [u32], to: Input, gate: Gate, rays: u32| {
            let value = &mut values[to.gate as usize];
            match gate {
                Gate::Any => *value |= rays ^ to.flip,
                Gate::Odd => *value ^= rays ^ to.flip,
            }
        };
        for (input, rays) in self.inputs.iter().zip(operands) {
            feed(values, *input, self.gates[input.gate as usize].gate, rays);
        }
        let (answer, others) = match self.gates.split_last() {
            Some(split) => split,
            None => return 0,
        };
        for (place, partial) in others.iter().enumerate() {
            let (rays, out) = (values[place], partial.out);
            feed(values, out, self.gates[out.gate as usize].gate, rays);
        }
        values[others.len()] ^ answer.out.flip
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csg::{Builder, Operator, Place, State};
    use proptest::prelude::*;

    const OPERATORS: [Operator; 5] = [
        Operator::Union,
        Operator::Intersection,
        Operator::Difference,
        Operator::Xor,
        Operator::Complement,
    ];

    /// An operator over others and operands, by a list of choices; and what it
    /// says of a point that is in some of the operands.
    enum Tree {
        Leaf(u32),
        Of(Operator, Vec<Tree>),
    }

    fn grow(builder: &mut Builder, place: Place, choices: &mut impl Iterator<Item = u8>) -> Tree {
        let choice = choices.next().unwrap_or(0);
        if choice < 80 {
            return Tree::Leaf(builder.operand(place));
        }
        let operator = OPERATORS[usize::from(choice) % 5];
        let [first, others] = builder.operator(operator, place);
        let more = if operator == Operator::Complement {
            0
        } else {
            choice / 8 % 4
        };
        let mut below = vec![grow(builder, first, choices)];
        below.extend((0..more).map(|_| grow(builder, others, choices)));
        Tree::Of(operator, below)
    }

    fn says(tree: &Tree, inside: u64) -> bool {
        let (operator, below) = match tree {
            Tree::Leaf(number) => return inside >> number & 1 != 0,
            Tree::Of(operator, below) => (operator, below),
        };
        let mut of = below.iter().map(|t| says(t, inside));
        match operator {
            Operator::Union => of.any(|x| x),
            Operator::Intersection => of.all(|x| x),
            Operator::Difference => of.next() == Some(true) && !of.any(|x| x),
            Operator::Xor => of.filter(|x| *x).count() % 2 == 1,
            Operator::Complement => of.next() == Some(false),
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(2_000)
        })]

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
            let inside = inside & matter;
            let truth = says(&tree, inside);

            let mut state = State::default();
            program.start(&mut state);
            prop_assert_eq!(program.is_inside(&state), says(&tree, 0));
            let numbers = 0..program.operands() as u32;
            for operand in numbers.clone().filter(|i| inside >> i & 1 != 0) {
                program.flip(&mut state, operand, true);
            }
            prop_assert_eq!(program.is_inside(&state), truth);

            let some: Vec<u32> = numbers.filter(|i| matter >> i & 1 != 0).collect();
            let mut part = Restricted::default();
            part.set(&program, &some);
            let rays = some.iter().map(|i| if inside >> i & 1 != 0 { 2 } else { 0 });
            let found = part.inside(rays, &mut Vec::new());
            prop_assert_eq!(found & 2 != 0, truth);
            prop_assert_eq!(found & 1 != 0, says(&tree, 0));
        }
    }
}
