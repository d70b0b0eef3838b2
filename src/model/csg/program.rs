//! Boolean programs, as gates that count their true inputs.
//!
//! De Morgan's laws leave two kinds of gates, any-of and odd-number-of, with negations on
//! the wires. An operand that flips changes one count, and the change stops at the first
//! gate whose value stays. So a step costs at most the height of the program, whatever its
//! size. Nested operators of one kind are one gate: a chain of differences, however long,
//! is flat.

/// A Boolean operator on solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    Union,
    Intersection,
    /// The first operand without all others.
    Difference,
    /// The points in an odd number of operands.
    Xor,
    /// All points that are not in the one operand.
    Complement,
}

/// A gate: whether any input is true, or an odd number of inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    Any,
    Odd,
}

/// The gate that a value feeds, and whether it is negated on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wire {
    /// The gate; [`OUT`] is the program's answer.
    pub gate: u32,
    pub negated: bool,
}

/// The gate number that stands for the program's answer.
pub(super) const OUT: u32 = u32::MAX;

/// A Boolean program. Operands are numbered in the order in which they were added.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// The gates, each before those that feed it; the first gives the answer.
    pub(super) gates: Vec<Gate>,
    pub(super) gate_wires: Vec<Wire>,
    pub(super) operand_wires: Vec<Wire>,
    /// Per gate: its true inputs while a ray is outside all operands.
    pub(super) idle: Vec<u32>,
}

impl Program {
    /// The number of operands.
    pub fn operands(&self) -> usize {
        self.operand_wires.len()
    }

    /// The number of gates.
    pub fn gates(&self) -> usize {
        self.gates.len()
    }

    /// The bytes of all columns.
    pub fn bytes(&self) -> usize {
        self.gates.len() * (size_of::<Gate>() + size_of::<Wire>() + size_of::<u32>())
            + self.operand_wires.len() * size_of::<Wire>()
    }

    /// Sets the state of a ray that is outside all operands.
    pub fn start(&self, state: &mut State) {
        state.counts.clear();
        state.counts.extend_from_slice(&self.idle);
    }

    /// Returns the value of a gate with so many true inputs.
    pub(super) fn value(&self, gate: u32, count: u32) -> bool {
        match self.gates[gate as usize] {
            Gate::Any => count > 0,
            Gate::Odd => count & 1 != 0,
        }
    }

    /// Says whether the ray is in the solid.
    pub fn is_inside(&self, state: &State) -> bool {
        self.value(0, state.counts[0]) != self.gate_wires[0].negated
    }

    /// Updates the state where a ray enters an operand (`inside`) or leaves it.
    pub fn flip(&self, state: &mut State, operand: u32, inside: bool) {
        let (mut wire, mut now) = (self.operand_wires[operand as usize], inside);
        while wire.gate != OUT {
            let count = &mut state.counts[wire.gate as usize];
            let before = self.value(wire.gate, *count);
            *count = if now != wire.negated {
                *count + 1
            } else {
                *count - 1
            };
            now = self.value(wire.gate, *count);
            if now == before {
                return;
            }
            wire = self.gate_wires[wire.gate as usize];
        }
    }
}

/// The state of a ray: per gate, the number of its true inputs.
#[derive(Clone, Debug, Default)]
pub struct State {
    counts: Vec<u32>,
}

/// Builds a [`Program`] from the answer down.
#[derive(Debug, Default)]
pub struct Builder {
    program: Program,
}

/// The wire that the operands of an operator feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place(Wire);

impl Builder {
    /// Returns the place of the whole solid.
    pub fn answer(&self) -> Place {
        Place(Wire {
            gate: OUT,
            negated: false,
        })
    }

    /// Adds an operator that feeds `place`. Returns the place of its first operand, and the
    /// place of all others.
    pub fn operator(&mut self, operator: Operator, place: Place) -> [Place; 2] {
        let gate = match operator {
            Operator::Xor => Gate::Odd,
            _ => Gate::Any,
        };
        // A ∩ B = ¬(¬A ∪ ¬B), A − B = ¬(¬A ∪ B).
        let (out, first, others) = match operator {
            Operator::Union | Operator::Xor => (false, false, false),
            Operator::Intersection => (true, true, true),
            Operator::Difference => (true, true, false),
            Operator::Complement => return [self.negated(place); 2],
        };
        let wire = Wire {
            negated: place.0.negated != out,
            ..place.0
        };
        let into = match self.program.gates.get(wire.gate as usize) {
            Some(above) if *above == gate && !wire.negated => wire.gate,
            _ => self.gate(gate, wire),
        };
        [first, others].map(|negated| {
            Place(Wire {
                gate: into,
                negated,
            })
        })
    }

    fn negated(&self, place: Place) -> Place {
        Place(Wire {
            negated: !place.0.negated,
            ..place.0
        })
    }

    /// Adds a gate that feeds `wire`.
    fn gate(&mut self, gate: Gate, wire: Wire) -> u32 {
        self.program.gates.push(gate);
        self.program.gate_wires.push(wire);
        self.program.idle.push(0);
        self.program.gates.len() as u32 - 1
    }

    /// Adds an operand that feeds `place`, and returns its number.
    pub fn operand(&mut self, place: Place) -> u32 {
        let mut wire = place.0;
        if wire.gate == OUT {
            wire = Wire {
                gate: self.gate(Gate::Any, wire),
                negated: false,
            };
        }
        self.program.operand_wires.push(wire);
        self.program.operand_wires.len() as u32 - 1
    }

    /// Finishes a program of at least one operand.
    pub fn finish(mut self) -> Program {
        let Program {
            gates,
            gate_wires,
            operand_wires,
            idle,
        } = &mut self.program;
        for wire in operand_wires {
            idle[wire.gate as usize] += u32::from(wire.negated);
        }
        for gate in (1..gates.len()).rev() {
            let value = match gates[gate] {
                Gate::Any => idle[gate] > 0,
                Gate::Odd => idle[gate] & 1 != 0,
            };
            let wire = gate_wires[gate];
            idle[wire.gate as usize] += u32::from(value != wire.negated);
        }
        self.program
    }
}
