//! A program restricted to the operands that a packet of rays may meet. Every ray is
//! outside the other operands, so their share of a gate's inputs is a constant. Each ray is
//! a bit, so a gate is one operation for all rays.

use super::program::{Gate, OUT, Program, Wire};

/// The inputs and gates that the chosen operands can change. Storage is reused.
#[derive(Clone, Debug, Default)]
pub struct Restricted {
    /// The inputs, per chosen operand and in its order.
    inputs: Vec<Input>,
    /// The gates, each behind those that feed it; the last gives the answer.
    gates: Vec<Partial>,
    /// The needed gates of the program, in descending order.
    needed: Vec<u32>,
    /// Per gate of the program: its row here, or [`NONE`] if it is not needed. All are
    /// [`NONE`] between calls.
    rows: Vec<u32>,
}

/// The row of a gate that is not needed.
const NONE: u32 = u32::MAX;

/// The row of [`Restricted::gates`] that a value feeds.
#[derive(Clone, Copy, Debug)]
struct Input {
    gate: u32,
    /// All ones if the value is negated on the way.
    flip: u32,
}

/// A gate of which only some inputs vary.
#[derive(Clone, Copy, Debug)]
struct Partial {
    gate: Gate,
    /// The value of the constant inputs, the same in all bits.
    rest: u32,
    out: Input,
}

/// Returns a value of the same bit for all rays.
fn all(on: bool) -> u32 {
    if on { u32::MAX } else { 0 }
}

impl Restricted {
    /// Restricts `program` to the operands of these numbers.
    pub fn set(&mut self, program: &Program, operands: &[u32]) {
        let (needed, rows) = (&mut self.needed, &mut self.rows);
        needed.clear();
        rows.resize(program.gates().max(rows.len()), NONE);
        for operand in operands {
            let mut gate = program.operand_wires[*operand as usize].gate;
            // A gate that is marked already has all gates above it marked.
            while gate != OUT && rows[gate as usize] == NONE {
                rows[gate as usize] = 0;
                needed.push(gate);
                gate = program.gate_wires[gate as usize].gate;
            }
        }
        if needed.is_empty() {
            needed.push(0);
        }
        // A gate has a greater number than the gate that it feeds.
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

    /// Returns the bits of the rays in the solid, from the bits of the rays in each chosen
    /// operand, in their order.
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
