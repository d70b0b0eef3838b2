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
