//! Expressions in x, y and z, as text, into polynomials.
//!
//! Numbers, `x y z`, `pi`, names of parameters, `+ - * / ^`, parentheses, and of
//! constants `sqrt` and `abs`. From weak to strong: sums, products, signs, powers; powers
//! from right to left, all others from left to right. Operators wait on a stack of their
//! own (Dijkstra's shunting yard), so no text nests too deeply.

use super::polynomial::{Maker, Trouble, Value};
use super::tree::{nearest, quoted};
use crate::geom::tape::{MAX_DEGREE, MAX_SLOTS, MAX_STEPS, Tape};
use crate::io::precise::Precise;
use std::collections::BTreeMap;

/// Bytes of one expression.
const MAX_LENGTH: usize = 1 << 16;

/// Functions of constants.
const FUNCTIONS: [&str; 2] = ["sqrt", "abs"];

/// Names that people try.
const NO_POLYNOMIALS: &[&str] = &[
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
    "ln", "log2", "log10", "pow", "cbrt", "min", "max", "floor", "ceil", "round", "sign", "mod",
];

const ONLY: &str = "only polynomials in x, y and z are supported";

/// What is wrong, and at which byte of the expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub at: usize,
    pub message: String,
}

impl Fault {
    fn new(at: usize, message: impl Into<String>) -> Fault {
        Fault {
            at,
            message: message.into(),
        }
    }
}

type Result<T> = std::result::Result<T, Fault>;

/// Constants by name.
pub(super) type Parameters = BTreeMap<String, Precise>;

/// The steps of an expression.
pub(super) fn polynomial(text: &str, parameters: &Parameters) -> Result<Tape> {
    let mut maker = Maker::default();
    let value = Parser::new(text, parameters).parse(&mut maker)?;
    let tape = maker
        .finish(value)
        .map_err(|why| fault(0, "expression", why))?;
    let (steps, slots) = (tape.steps().len(), tape.slot_count());
    if steps > MAX_STEPS {
        let message =
            format!("the expression has {steps} steps; at most {MAX_STEPS} are supported");
        return Err(Fault::new(0, message));
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

/// The value of an expression without x, y and z.
pub(super) fn constant(text: &str) -> Result<Precise> {
    let mut maker = Maker::default();
    let parameters = Parameters::new();
    let value = Parser::new(text, &parameters).parse(&mut maker)?;
    let value = value.as_constant().cloned();
    value.map_err(|_| Fault::new(0, "a parameter is a constant: it cannot have x, y or z"))
}

/// Whether a parameter may have this name, or why not.
pub(super) fn check_name(name: &str) -> std::result::Result<(), String> {
    let shown = quoted(name);
    if ["x", "y", "z", "pi"].contains(&name) {
        return Err(format!(
            "{shown} has a meaning of its own; give the parameter another name"
        ));
    }
    if FUNCTIONS.contains(&name) || NO_POLYNOMIALS.contains(&name) {
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

fn begins_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn continues_name(c: char) -> bool {
    begins_name(c) || c.is_ascii_digit()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Open,
    /// `sqrt` or `abs`, and its parenthesis.
    Call(&'static str),
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    Power,
}

/// One that waits for what stands behind it.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    at: usize,
    kind: Kind,
}

impl Kind {
    /// How strongly it binds.
    fn strength(self) -> u32 {
        match self {
            Kind::Open | Kind::Call(_) => 0,
            Kind::Add | Kind::Subtract => 1,
            Kind::Multiply | Kind::Divide => 2,
            Kind::Negate => 3,
            Kind::Power => 4,
        }
    }
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    parameters: &'t Parameters,
    waiting: Vec<Waiting>,
    values: Vec<Value>,
}

impl<'t> Parser<'t> {
    fn new(text: &'t str, parameters: &'t Parameters) -> Parser<'t> {
        Parser {
            text,
            at: 0,
            parameters,
            waiting: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Operands and operators in turn.
    fn parse(mut self, maker: &mut Maker) -> Result<Value> {
        if self.text.len() > MAX_LENGTH {
            let message = format!(
                "the expression is {} bytes long; at most {MAX_LENGTH} are supported",
                self.text.len()
            );
            return Err(Fault::new(0, message));
        }
        loop {
            self.operand(maker)?;
            if !self.operator(maker)? {
                break;
            }
        }
        // The last operator leaves one.
        let whole = self.values.pop();
        Ok(whole.unwrap_or_else(|| Value::constant(Precise::whole(0))))
    }

    fn rest(&self) -> &'t str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// The next character, past white space.
    fn next(&mut self) -> Option<char> {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
        self.rest().chars().next()
    }

    /// The text from here as long as characters are such.
    fn take(&mut self, such: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|c| !such(c)).unwrap_or(rest.len())];
        self.at += taken.len();
        taken
    }

    /// For messages: what stands here.
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

    /// Signs, parentheses, and then a number or a name.
    fn operand(&mut self, maker: &mut Maker) -> Result<()> {
        loop {
            let next = self.next();
            let at = self.at;
            match next {
                Some('+') => self.at += 1,
                Some('-') => self.wait(1, Kind::Negate),
                Some('(') => self.wait(1, Kind::Open),
                Some(c) if c.is_ascii_digit() || c == '.' => {
                    let number = self.number(at)?;
                    self.values.push(Value::constant(number));
                    return Ok(());
                }
                Some(c) if begins_name(c) => {
                    if self.name(at, maker)? {
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

    fn wait(&mut self, length: usize, kind: Kind) {
        self.waiting.push(Waiting { at: self.at, kind });
        self.at += length;
    }

    fn number(&mut self, at: usize) -> Result<Precise> {
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
            // Of more digits than an i64 has, it is too large in any case.
            let value = digits.parse().unwrap_or(i64::MAX);
            exponent = if is_negative { -value } else { value };
            if digits.is_empty() {
                // A name, which the next look finds.
                (self.at, exponent) = (before, 0);
            }
        }
        Precise::decimal(whole, part, exponent).map_err(|why| Fault::new(at, why.message()))
    }

    /// Whether it is an operand; a function waits for its own.
    fn name(&mut self, at: usize, maker: &mut Maker) -> Result<bool> {
        let name = self.take(continues_name);
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            self.values.push(maker.coordinate(axis as u8));
            return Ok(true);
        }
        if let Some(value) = self.parameters.get(name) {
            self.values.push(Value::constant(value.clone()));
            return Ok(true);
        }
        if name == "pi" {
            self.values.push(Value::constant(Precise::pi()));
            return Ok(true);
        }
        let is_call = self.next() == Some('(');
        if let Some(function) = FUNCTIONS.iter().find(|function| **function == name) {
            if !is_call {
                let found = self.found();
                let message = format!("expected '(' after {function}, found {found}");
                return Err(Fault::new(self.at, message));
            }
            self.at += 1;
            let kind = Kind::Call(function);
            self.waiting.push(Waiting { at, kind });
            return Ok(false);
        }
        let shown = quoted(name);
        if NO_POLYNOMIALS.contains(&name) {
            let message =
                format!("{shown} is not supported: {ONLY}, and of constants sqrt and abs");
            return Err(Fault::new(at, message));
        }
        let what = if is_call { "function" } else { "parameter" };
        let names = self.parameters.keys().map(|name| &**name);
        let known: Vec<&str> = match is_call {
            true => FUNCTIONS.to_vec(),
            false => ["x", "y", "z", "pi"].into_iter().chain(names).collect(),
        };
        let message = match nearest(name, known.into_iter()) {
            Some(like) => format!("there is no {what} {shown}; did you mean {}?", quoted(like)),
            None if is_call => {
                format!("there is no function {shown}; known are sqrt and abs, of constants")
            }
            None => {
                format!("there is no parameter {shown}; define it as parameters = {{ {name} = … }}")
            }
        };
        Err(Fault::new(at, message))
    }

    /// Whether an operand must follow.
    fn operator(&mut self, maker: &mut Maker) -> Result<bool> {
        loop {
            let next = self.next();
            let at = self.at;
            let kind = match next {
                Some('+') => Kind::Add,
                Some('-') => Kind::Subtract,
                Some('*') => Kind::Multiply,
                Some('/') => Kind::Divide,
                Some('^') => Kind::Power,
                Some(')') => {
                    self.close(maker)?;
                    continue;
                }
                None => {
                    self.apply(Kind::Open, maker)?;
                    return match self.waiting.pop() {
                        Some(open) => Err(Fault::new(open.at, "this parenthesis is never closed")),
                        None => Ok(false),
                    };
                }
                Some(c) => {
                    let found = self.found();
                    let hint = match c {
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
            self.apply(kind, maker)?;
            self.wait(1, kind);
            return Ok(true);
        }
    }

    /// Up to the parenthesis that a `)` closes.
    fn close(&mut self, maker: &mut Maker) -> Result<()> {
        self.apply(Kind::Open, maker)?;
        let Some(open) = self.waiting.pop() else {
            return Err(Fault::new(self.at, "this parenthesis was never opened"));
        };
        self.at += 1;
        let (Kind::Call(function), Some(value)) = (open.kind, self.values.last_mut()) else {
            return Ok(());
        };
        let Ok(constant) = value.as_constant() else {
            let message = format!("{function} of x, y or z is not supported: {ONLY}");
            return Err(Fault::new(open.at, message));
        };
        let result = match function {
            "sqrt" => constant
                .root()
                .map_err(|why| Fault::new(open.at, why.message()))?,
            _ => constant.clone().magnitude(),
        };
        *value = Value::constant(result);
        Ok(())
    }

    /// All that bind no less strongly than the next; a power binds what is on its right.
    fn apply(&mut self, next: Kind, maker: &mut Maker) -> Result<()> {
        while let Some(top) = self.waiting.last().copied() {
            let is_open = top.kind.strength() == 0;
            let stays = top.kind.strength() < next.strength();
            if is_open || stays || next == Kind::Power && top.kind == Kind::Power {
                break;
            }
            self.waiting.pop();
            let Some(b) = self.values.pop() else { break };
            if top.kind == Kind::Negate {
                self.values.push(b.negated());
                continue;
            }
            let Some(a) = self.values.pop() else { break };
            self.values.push(binary(top, a, b, maker)?);
        }
        Ok(())
    }
}

fn binary(operator: Waiting, a: Value, b: Value, maker: &mut Maker) -> Result<Value> {
    let at = operator.at;
    let (result, what) = match operator.kind {
        Kind::Add => (maker.sum(a, b), "sum"),
        Kind::Subtract => (maker.sum(a, b.negated()), "difference"),
        Kind::Multiply => (maker.product(a, b), "product"),
        Kind::Divide => (maker.quotient(a, &b), "quotient"),
        _ => {
            let exponent = b.as_constant().ok();
            let Some(exponent) = exponent.and_then(Precise::as_exponent) else {
                let message = match exponent.is_some_and(Precise::is_large_exponent) {
                    true => {
                        format!("this exponent is too large; at most {MAX_DEGREE} is supported")
                    }
                    false => format!("an exponent must be a whole number, 0 or greater: {ONLY}"),
                };
                return Err(Fault::new(at, message));
            };
            (maker.power(a, exponent), "power")
        }
    };
    result.map_err(|why| fault(at, what, why))
}

fn fault(at: usize, what: &str, why: Trouble) -> Fault {
    let message = match why {
        Trouble::Constant(why) => why.message().into(),
        Trouble::Degree(degree) => {
            format!("this {what} has degree {degree}; at most {MAX_DEGREE} is supported")
        }
        Trouble::NotConstant => format!("this divides by x, y or z: {ONLY}"),
        Trouble::Exponent => "this exponent is too large".into(),
    };
    Fault::new(at, message)
}

#[cfg(test)]
#[path = "expression_tests.rs"]
mod tests;
