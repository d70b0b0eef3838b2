//! Parser of expressions in x, y and z.
//!
//! An expression has numbers, `x y z`, `pi`, names of parameters, `+ - * / ^`, parentheses
//! and functions. A polynomial becomes a tape, any other expression a formula. Precedence
//! from low to high: sums, products, signs, powers. Powers associate to the right, all other
//! operators to the left. The parser is Dijkstra's shunting yard, whose operators wait on a
//! stack of its own, so there is no limit on nesting.

use super::operations::{FUNCTIONS, Function, OperationError, Operations, Operator};
use super::tree::{nearest, quoted};
use super::{formula, polynomial};
use crate::geom::formula::{Formula, MAX_STEPS as MAX_FORMULA_STEPS};
use crate::geom::tape::{MAX_DEGREE, MAX_SLOTS, MAX_STEPS, Tape};
use crate::shared::rational::Rational;
use std::collections::BTreeMap;

/// Limit on the bytes of an expression.
const MAX_LENGTH: usize = 1 << 16;

/// Names of functions that users may try but that are not supported.
const NO_FUNCTIONS: &[&str] = &[
    "atan2", "log", "log2", "log10", "pow", "cbrt", "floor", "ceil", "round", "sign", "mod",
];

/// An error in an expression: its byte offset and message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub at: usize,
    pub message: String,
    /// Whether the expression is no polynomial, but may be a formula.
    is_not_polynomial: bool,
}

impl Fault {
    fn new(at: usize, message: impl Into<String>) -> Fault {
        Fault {
            at,
            message: message.into(),
            is_not_polynomial: false,
        }
    }
}

type Result<T> = std::result::Result<T, Fault>;

/// The parameters of an expression: constants by name.
pub(super) type Parameters = BTreeMap<String, Rational>;

/// A parsed expression.
#[derive(Clone, Debug)]
pub(super) enum Surface {
    Polynomial(Tape),
    Formula(Formula),
}

/// Parses an expression as a polynomial or else as a formula. Fails for malformed expressions,
/// and for polynomials and formulas beyond the limits on degree and steps.
pub(super) fn surface(text: &str, parameters: &Parameters) -> Result<Surface> {
    let fault = match polynomial(text, parameters) {
        Ok(tape) => return Ok(Surface::Polynomial(tape)),
        Err(fault) => fault,
    };
    let mut builder = formula::FormulaBuilder::default();
    let value = match Parser::new(text, parameters).parse(&mut builder) {
        Ok(value) => value,
        Err(other) if fault.is_not_polynomial => return Err(other),
        Err(_) => return Err(fault),
    };
    match builder.finish(&value) {
        None => Err(fault),
        Some(formula) if formula.steps().len() > MAX_FORMULA_STEPS => {
            Err(too_many(formula.steps().len(), MAX_FORMULA_STEPS))
        }
        Some(formula) => Ok(Surface::Formula(formula)),
    }
}

/// Parses an expression as a polynomial.
fn polynomial(text: &str, parameters: &Parameters) -> Result<Tape> {
    let mut builder = polynomial::PolynomialBuilder::default();
    let value = Parser::new(text, parameters).parse(&mut builder)?;
    let tape = builder
        .finish(value)
        .map_err(|why| fault(0, "expression", why))?;
    let (steps, slots) = (tape.steps().len(), tape.slot_count());
    if steps > MAX_STEPS {
        return Err(too_many(steps, MAX_STEPS));
    }
    if slots > MAX_SLOTS {
        let message = format!(
            "the expression needs {slots} values at once; at most {MAX_SLOTS} are supported: \
             begin with what is nested most deeply"
        );
        return Err(Fault::new(0, message));
    }
    Ok(tape)
}

/// Says that an expression has too many steps.
fn too_many(steps: usize, most: usize) -> Fault {
    let message = format!("the expression has {steps} steps; at most {most} are supported");
    Fault::new(0, message)
}

/// Evaluates a constant expression; fails if it depends on x, y or z.
pub(super) fn constant(text: &str) -> Result<Rational> {
    let parameters = Parameters::new();
    let parser = Parser {
        is_parameter: true,
        ..Parser::new(text, &parameters)
    };
    match parser.parse(&mut formula::FormulaBuilder::default())? {
        formula::Value::Constant(value) => Ok(value),
        formula::Value::Step { .. } => {
            let message = "a parameter is a constant: it cannot have x, y or z";
            Err(Fault::new(0, message))
        }
    }
}

/// Checks the name of a parameter; the error says why it may not have this name.
pub(super) fn check_name(name: &str) -> std::result::Result<(), String> {
    let shown = quoted(name);
    if ["x", "y", "z", "pi"].contains(&name) {
        return Err(format!(
            "{shown} has a meaning of its own; give the parameter another name"
        ));
    }
    if function(name).is_some() || NO_FUNCTIONS.contains(&name) {
        return Err(format!(
            "{shown} is a function; give the parameter another name"
        ));
    }
    let is_name = name.starts_with(begins_name) && name.chars().all(continues_name);
    match is_name {
        true => Ok(()),
        false => Err(format!(
            "{shown} cannot stand in an expression; give the parameter a name of letters, digits \
             and _"
        )),
    }
}

/// Finds a function by name.
fn function(name: &str) -> Option<Function> {
    let found = FUNCTIONS.iter().find(|(known, _)| *known == name);
    found.map(|(_, function)| *function)
}

/// Whether a name may begin with this character.
fn begins_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// Whether a name may have this character after the first.
fn continues_name(c: char) -> bool {
    begins_name(c) || c.is_ascii_digit()
}

/// What waits on the stack of operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// An open parenthesis.
    Open,
    /// A function with its open parenthesis, and the number of values before its operands.
    Call(Function, usize),
    Binary(Operator),
    Negate,
}

/// An operator, sign or parenthesis that waits for the text that follows, and its offset.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    at: usize,
    kind: Kind,
}

impl Kind {
    /// The precedence, high for operators that bind strongly; 0 for open parentheses.
    fn precedence(self) -> u32 {
        match self {
            Kind::Open | Kind::Call(..) => 0,
            Kind::Binary(Operator::Sum | Operator::Difference) => 1,
            Kind::Binary(Operator::Product | Operator::Quotient) => 2,
            Kind::Negate => 3,
            Kind::Binary(Operator::Power) => 4,
        }
    }
}

/// The state of the parser.
struct Parser<'t, M: Operations> {
    text: &'t str,
    at: usize,
    parameters: &'t Parameters,
    /// Whether the expression is the value of a parameter, which has no parameters itself.
    is_parameter: bool,
    waiting: Vec<Waiting>,
    values: Vec<M::Value>,
}

impl<'t, M: Operations> Parser<'t, M> {
    fn new(text: &'t str, parameters: &'t Parameters) -> Parser<'t, M> {
        Parser {
            text,
            at: 0,
            parameters,
            is_parameter: false,
            waiting: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Reads operands and operators in turn, to the end of the text.
    fn parse(mut self, builder: &mut M) -> Result<M::Value> {
        if self.text.len() > MAX_LENGTH {
            let message = format!(
                "the expression is {} bytes long; at most {MAX_LENGTH} are supported",
                self.text.len()
            );
            return Err(Fault::new(0, message));
        }
        loop {
            self.operand(builder)?;
            if !self.operator(builder)? {
                break;
            }
        }
        // One value is left after the last operator is applied.
        let whole = self.values.pop();
        Ok(whole.unwrap_or_else(|| builder.constant(Rational::whole(0))))
    }

    /// The text that is not read yet.
    fn rest(&self) -> &'t str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Skips white space and returns the next character without reading it.
    fn next(&mut self) -> Option<char> {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
        self.rest().chars().next()
    }

    /// Reads characters while they satisfy `such`.
    fn take(&mut self, such: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|c| !such(c)).unwrap_or(rest.len())];
        self.at += taken.len();
        taken
    }

    /// Quotes the next word or character for a message, without reading it.
    fn found(&mut self) -> String {
        let Some(next) = self.next() else {
            return "the end".into();
        };
        let (start, such): (usize, fn(char) -> bool) = (self.at, continues_name);
        let word = match self.take(such) {
            "" => next.to_string(),
            word => word.into(),
        };
        self.at = start;
        quoted(&word)
    }

    /// Reads an operand: signs and open parentheses, then a number or a name.
    fn operand(&mut self, builder: &mut M) -> Result<()> {
        loop {
            let next = self.next();
            let at = self.at;
            match next {
                Some('+') => self.at += 1,
                Some('-') => self.wait(1, Kind::Negate),
                Some('(') => self.wait(1, Kind::Open),
                Some(c) if c.is_ascii_digit() || c == '.' => {
                    let number = self.number(at)?;
                    self.values.push(builder.constant(number));
                    return Ok(());
                }
                Some(c) if begins_name(c) => {
                    if self.name(at, builder)? {
                        return Ok(());
                    }
                }
                _ => {
                    let found = self.found();
                    let hint = match self.text[..at].trim_end().ends_with('*') && next == Some('*')
                    {
                        true => "; a power is written x^2",
                        false => "",
                    };
                    let message =
                        format!("expected a number, a name or a parenthesis, found {found}{hint}");
                    return Err(Fault::new(at, message));
                }
            }
        }
    }

    /// Puts an operator of so many bytes on the stack.
    fn wait(&mut self, length: usize, kind: Kind) {
        self.waiting.push(Waiting { at: self.at, kind });
        self.at += length;
    }

    /// Reads a decimal number, exactly. An `e` without digits is not part of the number.
    fn number(&mut self, at: usize) -> Result<Rational> {
        let digit = |c: char| c.is_ascii_digit();
        let whole = self.take(digit);
        let part = match self.rest().strip_prefix('.') {
            Some(_) => {
                self.at += 1;
                self.take(digit)
            }
            None => "",
        };
        if whole.is_empty() && part.is_empty() {
            return Err(Fault::new(at, "a point without digits is no number"));
        }
        let before = self.at;
        let mut exponent = 0;
        if self.rest().starts_with(['e', 'E']) {
            self.at += 1;
            let is_negative = self.rest().starts_with('-');
            if self.rest().starts_with(['+', '-']) {
                self.at += 1;
            }
            let digits = self.take(digit);
            // An exponent with more digits than i64 holds is out of range in any case.
            let value = digits.parse().unwrap_or(i64::MAX);
            exponent = if is_negative { -value } else { value };
            if digits.is_empty() {
                // The `e` begins a name, which the caller will find.
                (self.at, exponent) = (before, 0);
            }
        }
        Rational::decimal(whole, part, exponent).map_err(|why| Fault::new(at, why.message()))
    }

    /// Reads a name. Returns true if it is an operand, and false if it is a function, whose
    /// operands follow.
    fn name(&mut self, at: usize, builder: &mut M) -> Result<bool> {
        let name = self.take(continues_name);
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            self.values.push(builder.coordinate(axis as u8));
            return Ok(true);
        }
        if let Some(value) = self.parameters.get(name) {
            self.values.push(builder.constant(value.clone()));
            return Ok(true);
        }
        if name == "pi" {
            self.values.push(builder.constant(Rational::pi()));
            return Ok(true);
        }
        let is_call = self.next() == Some('(');
        if let Some(function) = function(name) {
            if !is_call {
                let found = self.found();
                let message = format!("expected '(' after {name}, found {found}");
                return Err(Fault::new(self.at, message));
            }
            self.at += 1;
            let kind = Kind::Call(function, self.values.len());
            self.waiting.push(Waiting { at, kind });
            return Ok(false);
        }
        let shown = quoted(name);
        if NO_FUNCTIONS.contains(&name) {
            let hint = match name {
                "log" => "the natural logarithm is ln".into(),
                "pow" => "a power is written x^2".into(),
                "cbrt" => "of positive numbers it is written x^(1/3)".into(),
                _ => format!("known are {}", known_functions()),
            };
            return Err(Fault::new(at, format!("{shown} is not supported; {hint}")));
        }
        let what = if is_call { "function" } else { "parameter" };
        let names = self.parameters.keys().map(|name| &**name);
        let known: Vec<&str> = match is_call {
            true => FUNCTIONS.iter().map(|(name, _)| *name).collect(),
            false => ["x", "y", "z", "pi"].into_iter().chain(names).collect(),
        };
        let message = match nearest(name, known.into_iter()) {
            Some(like) => format!("there is no {what} {shown}; did you mean {}?", quoted(like)),
            None if is_call => {
                let known = known_functions();
                format!("there is no function {shown}; known are {known}")
            }
            None if self.is_parameter => {
                format!("{shown} is no number; a parameter cannot be made of others")
            }
            None => {
                format!("there is no parameter {shown}; define it as parameters = {{ {name} = … }}")
            }
        };
        Err(Fault::new(at, message))
    }

    /// Reads closing parentheses and an operator. Returns whether an operand must follow.
    fn operator(&mut self, builder: &mut M) -> Result<bool> {
        loop {
            let next = self.next();
            let at = self.at;
            let operator = match next {
                Some('+') => Operator::Sum,
                Some('-') => Operator::Difference,
                Some('*') => Operator::Product,
                Some('/') => Operator::Quotient,
                Some('^') => Operator::Power,
                Some(',') if self.calls() => {
                    self.apply(Kind::Open, builder)?;
                    self.at += 1;
                    return Ok(true);
                }
                Some(')') => {
                    self.close(builder)?;
                    continue;
                }
                None => {
                    self.apply(Kind::Open, builder)?;
                    return match self.waiting.pop() {
                        Some(open) => Err(Fault::new(open.at, "this parenthesis is never closed")),
                        None => Ok(false),
                    };
                }
                Some(c) => {
                    let found = self.found();
                    let hint = match c {
                        ',' => "; only min and max have several values",
                        '=' => {
                            "; the surface is where the expression is 0, so bring all to one side"
                        }
                        '(' | '.' => "; a product is written with *",
                        c if continues_name(c) => "; a product is written with *",
                        '²' | '³' => "; a power is written x^2",
                        _ => "",
                    };
                    let message = format!("expected an operator or the end, found {found}{hint}");
                    return Err(Fault::new(at, message));
                }
            };
            let kind = Kind::Binary(operator);
            self.apply(kind, builder)?;
            self.wait(1, kind);
            return Ok(true);
        }
    }

    /// Reads a `)`: applies the operators since its open parenthesis, and the function before
    /// that, if there is one.
    fn close(&mut self, builder: &mut M) -> Result<()> {
        self.apply(Kind::Open, builder)?;
        let Some(open) = self.waiting.pop() else {
            return Err(Fault::new(self.at, "this parenthesis was never opened"));
        };
        self.at += 1;
        let Kind::Call(function, before) = open.kind else {
            return Ok(());
        };
        let operands = self.values.split_off(before);
        let expected = match function {
            Function::Unary(_) if operands.len() != 1 => "one value",
            Function::Min | Function::Max if operands.len() < 2 => "two values or more",
            _ => "",
        };
        if !expected.is_empty() {
            let message = format!("expected {expected} here, found {}", operands.len());
            return Err(Fault::new(open.at, message));
        }
        let value = builder.call(function, operands);
        let value = value.map_err(|why| fault(open.at, "function", why))?;
        self.values.push(value);
        Ok(())
    }

    /// Whether the innermost open parenthesis is that of a function.
    fn calls(&self) -> bool {
        let open = self.waiting.iter().rfind(|w| w.kind.precedence() == 0);
        open.is_some_and(|open| matches!(open.kind, Kind::Call(..)))
    }

    /// Applies the waiting operators whose precedence is not below that of `next`, back to the
    /// innermost open parenthesis. A power does not apply an earlier power, since powers
    /// associate to the right.
    fn apply(&mut self, next: Kind, builder: &mut M) -> Result<()> {
        while let Some(top) = self.waiting.last().copied() {
            let is_open = top.kind.precedence() == 0;
            let stays = top.kind.precedence() < next.precedence();
            let power = Kind::Binary(Operator::Power);
            if is_open || stays || next == power && top.kind == power {
                break;
            }
            self.waiting.pop();
            let Some(b) = self.values.pop() else { break };
            let Kind::Binary(operator) = top.kind else {
                self.values.push(builder.negated(b));
                continue;
            };
            let Some(a) = self.values.pop() else { break };
            let value = builder.binary(operator, a, b);
            let value = value.map_err(|why| fault(top.at, operator.result(), why))?;
            self.values.push(value);
        }
        Ok(())
    }
}

/// Lists the names of all functions for a message.
fn known_functions() -> String {
    let names: Vec<&str> = FUNCTIONS.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Makes the error of an operation, whose result messages call `what`.
fn fault(at: usize, what: &str, why: OperationError) -> Fault {
    let message = match why {
        OperationError::Constant(why) => why.message().into(),
        OperationError::Degree(degree) => {
            format!("this {what} has degree {degree}; at most {MAX_DEGREE} is supported")
        }
        OperationError::NotPolynomial => format!("this {what} is no polynomial"),
        OperationError::LargeExponent => "this exponent is too large".into(),
        OperationError::NoExponent => "an exponent must be a constant, without x, y and z".into(),
        OperationError::Undefined => format!("this {what} has no value"),
    };
    Fault {
        is_not_polynomial: why == OperationError::NotPolynomial,
        ..Fault::new(at, message)
    }
}

#[cfg(test)]
#[path = "expression_tests.rs"]
mod tests;
