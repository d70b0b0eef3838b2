//! The text of a `.csg` file as nodes with arguments, in one list in the order of the file.
//!
//! OpenSCAD writes a tree: `name(arguments) { children }` or `name(arguments);`, before which
//! modifiers may stand. Nothing recurses but lists in arguments, whose depth is bounded, so
//! any text is read in linear time and room.

use super::nodes::brief;
use crate::LoadError;
use crate::shared::line_column::line_column;
use crate::shared::messages::one_line;
use std::path::Path;

/// How deep lists may lie in each other; OpenSCAD's own are matrices of rows.
const MOST_LISTS: usize = 16;

/// The value of an argument.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Undefined,
    Bool(bool),
    /// A number, which may be infinite or NaN.
    Number(f64),
    Text(String),
    List(Vec<Value>),
}

#[derive(Clone, Debug)]
pub(super) struct Argument<'t> {
    /// Empty for an argument that is known by its place.
    pub name: &'t str,
    pub value: Value,
}

/// What stands before a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Modifiers {
    /// `%`: shown, but no part of the solid.
    pub is_background: bool,
    /// `#`: shown in another colour.
    pub is_marked: bool,
    /// `*`: as if it were not there.
    pub is_disabled: bool,
    /// `!`: all that is drawn.
    pub is_root: bool,
}

/// A node; its children are the nodes after it before `end` that are no children of others.
#[derive(Clone, Debug)]
pub(super) struct Node<'t> {
    pub name: &'t str,
    /// The byte at which its name begins.
    pub at: usize,
    pub modifiers: Modifiers,
    pub arguments: Vec<Argument<'t>>,
    /// The row behind the last one of its subtree.
    pub end: u32,
}

/// A file's nodes.
pub(super) struct Tree<'t> {
    path: &'t Path,
    text: &'t str,
    pub nodes: Vec<Node<'t>>,
}

impl<'t> Tree<'t> {
    pub fn parse(path: &'t Path, text: &'t str) -> Result<Tree<'t>, LoadError> {
        let tree = Tree {
            path,
            text,
            nodes: Vec::new(),
        };
        let mut parser = Parser {
            tree,
            bytes: text.as_bytes(),
            at: 0,
        };
        parser.statements()?;
        Ok(parser.tree)
    }

    /// Makes an error at a node.
    pub fn error(&self, row: usize, message: impl Into<String>) -> LoadError {
        let at = self.nodes.get(row).map_or(self.text.len(), |node| node.at);
        self.error_at(at, message)
    }

    fn error_at(&self, at: usize, message: impl Into<String>) -> LoadError {
        let (line, column) = line_column(self.text.as_bytes(), at);
        LoadError::Syntax {
            path: self.path.into(),
            line,
            column,
            message: message.into(),
        }
    }

    /// Returns the rows of a node's children.
    pub fn children(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.siblings(row + 1, self.nodes[row].end as usize)
    }

    /// Returns the rows of the nodes that stand at the top of the file.
    pub fn top(&self) -> impl Iterator<Item = usize> + '_ {
        self.siblings(0, self.nodes.len())
    }

    fn siblings(&self, first: usize, end: usize) -> impl Iterator<Item = usize> + '_ {
        let mut next = first;
        std::iter::from_fn(move || {
            let row = (next < end).then_some(next)?;
            next = self.nodes[row].end as usize;
            Some(row)
        })
    }

    /// Counts the line of each node.
    pub fn lines(&self) -> Vec<u32> {
        let (mut line, mut at) = (1, 0);
        let bytes = self.text.as_bytes();
        let lines = self.nodes.iter().map(|node| {
            line += bytes[at..node.at].iter().filter(|b| **b == b'\n').count() as u32;
            at = node.at;
            line
        });
        lines.collect()
    }
}

struct Parser<'t> {
    tree: Tree<'t>,
    bytes: &'t [u8],
    at: usize,
}

type Result_<T> = Result<T, LoadError>;

/// What is open: a block of a node, or a node that waits for the one child without a block.
#[derive(Clone, Copy)]
enum Open {
    Block(u32),
    Single(u32),
}

impl<'t> Parser<'t> {
    fn error<T>(&self, at: usize, message: impl Into<String>) -> Result_<T> {
        Err(self.tree.error_at(at, message))
    }

    /// Skips blanks and comments.
    fn skip(&mut self) -> Result_<()> {
        loop {
            match self.bytes.get(self.at..) {
                Some([b' ' | b'\t' | b'\r' | b'\n', ..]) => self.at += 1,
                Some([b'/', b'/', ..]) => {
                    let rest = &self.bytes[self.at..];
                    let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
                    self.at += end.unwrap_or(rest.len());
                }
                Some([b'/', b'*', ..]) => {
                    let rest = &self.bytes[self.at + 2..];
                    match rest.windows(2).position(|two| two == b"*/") {
                        Some(end) => self.at += end + 4,
                        None => return self.error(self.at, "this comment has no end: */"),
                    }
                }
                _ => return Ok(()),
            }
        }
    }

    fn peek(&mut self) -> Result_<Option<u8>> {
        self.skip()?;
        Ok(self.bytes.get(self.at).copied())
    }

    /// Passes a byte if it comes next.
    fn passes(&mut self, byte: u8) -> Result_<bool> {
        let is = self.peek()? == Some(byte);
        self.at += usize::from(is);
        Ok(is)
    }

    /// Says what stands at a place, for messages.
    fn found(&self, at: usize) -> String {
        let rest = self.tree.text.get(at..).unwrap_or_default();
        let word: String = rest
            .chars()
            .take_while(|c| !c.is_whitespace())
            .take(24)
            .collect();
        match word.is_empty() {
            true => "the end of the file".into(),
            false => format!("'{}'", one_line(&word)),
        }
    }

    fn expect(&mut self, byte: u8, what: &str) -> Result_<()> {
        if self.passes(byte)? {
            return Ok(());
        }
        let message = format!("expected {what}, found {}", self.found(self.at));
        self.error(self.at, message)
    }

    fn identifier(&mut self) -> Result_<Option<&'t str>> {
        self.skip()?;
        let rest = &self.bytes[self.at..];
        let is_part = |b: &&u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'$');
        let length = rest.iter().take_while(is_part).count();
        if length == 0 || rest[0].is_ascii_digit() {
            return Ok(None);
        }
        let word = &self.tree.text[self.at..self.at + length];
        self.at += length;
        Ok(Some(word))
    }

    fn statements(&mut self) -> Result_<()> {
        let mut open: Vec<Open> = Vec::new();
        loop {
            let Some(next) = self.peek()? else {
                let Some(Open::Block(row) | Open::Single(row)) = open.last() else {
                    return Ok(());
                };
                let node = &self.tree.nodes[*row as usize];
                let name = brief(node.name);
                let message = format!("{name}() is not closed at the end of the file");
                return self.error(node.at, message);
            };
            match next {
                b';' => {
                    self.at += 1;
                    self.close_singles(&mut open);
                }
                b'}' => {
                    let Some(Open::Block(row)) = open.pop() else {
                        return self.error(self.at, "this } closes nothing");
                    };
                    self.at += 1;
                    self.close(row);
                    self.close_singles(&mut open);
                }
                _ => {
                    let row = self.node()?;
                    match self.peek()? {
                        Some(b';') => {
                            self.at += 1;
                            self.close(row);
                            self.close_singles(&mut open);
                        }
                        Some(b'{') => {
                            self.at += 1;
                            open.push(Open::Block(row));
                        }
                        _ => open.push(Open::Single(row)),
                    }
                }
            }
        }
    }

    fn close(&mut self, row: u32) {
        self.tree.nodes[row as usize].end = self.tree.nodes.len() as u32;
    }

    /// Closes the nodes whose one child is complete.
    fn close_singles(&mut self, open: &mut Vec<Open>) {
        while let Some(Open::Single(row)) = open.last().copied() {
            open.pop();
            self.close(row);
        }
    }

    /// Reads a node up to its arguments' end.
    fn node(&mut self) -> Result_<u32> {
        let mut modifiers = Modifiers::default();
        loop {
            let of = match self.peek()? {
                Some(b'%') => &mut modifiers.is_background,
                Some(b'#') => &mut modifiers.is_marked,
                Some(b'*') => &mut modifiers.is_disabled,
                Some(b'!') => &mut modifiers.is_root,
                _ => break,
            };
            *of = true;
            self.at += 1;
        }
        let at = self.at;
        let Some(name) = self.identifier()? else {
            let message = format!("expected a node such as cube(…), found {}", self.found(at));
            return self.error(at, message);
        };
        if self.peek()? != Some(b'(') {
            return self.error(
                at,
                format!(
                    "'{}' is OpenSCAD's language, which only OpenSCAD reads; let it write what it \
                     makes: openscad -o part.csg part.scad",
                    brief(name)
                ),
            );
        }
        self.at += 1;
        let arguments = self.arguments()?;
        let row = self.tree.nodes.len() as u32;
        self.tree.nodes.push(Node {
            name,
            at,
            modifiers,
            arguments,
            end: row + 1,
        });
        Ok(row)
    }

    fn arguments(&mut self) -> Result_<Vec<Argument<'t>>> {
        let mut arguments = Vec::new();
        while !self.passes(b')')? {
            let start = self.at;
            let mut name = self.identifier()?.unwrap_or_default();
            let is_named = !name.is_empty() && self.peek()? == Some(b'=');
            if is_named {
                self.at += 1;
            } else {
                (name, self.at) = ("", start);
            }
            let value = self.value()?;
            arguments.push(Argument { name, value });
            if self.peek()? != Some(b')') {
                self.expect(b',', "a comma or ) behind an argument")?;
            }
        }
        Ok(arguments)
    }

    /// Reads a value; lists keep their own stack.
    fn value(&mut self) -> Result_<Value> {
        let mut lists: Vec<Vec<Value>> = Vec::new();
        loop {
            let start = self.at;
            let mut value = match self.peek()? {
                Some(b'[') => {
                    if lists.len() == MOST_LISTS {
                        let message = format!("lists lie more than {MOST_LISTS} deep here");
                        return self.error(start, message);
                    }
                    self.at += 1;
                    lists.push(Vec::new());
                    if !self.passes(b']')? {
                        continue;
                    }
                    Value::List(lists.pop().unwrap_or_default())
                }
                Some(b'"') => Value::Text(self.text()?),
                _ => self.word()?,
            };
            // A value that ends its list makes the list the value.
            loop {
                let Some(list) = lists.last_mut() else {
                    return Ok(value);
                };
                list.push(value);
                if self.passes(b',')? {
                    if !self.passes(b']')? {
                        break;
                    }
                } else {
                    self.expect(b']', "a comma or ] in a list")?;
                }
                value = Value::List(lists.pop().unwrap_or_default());
            }
        }
    }

    /// Reads a text in quotes.
    fn text(&mut self) -> Result_<String> {
        let start = self.at;
        let mut text = String::new();
        let mut chars = self.tree.text[start + 1..].char_indices();
        while let Some((i, c)) = chars.next() {
            match c {
                '"' => {
                    self.at = start + 1 + i + 1;
                    return Ok(text);
                }
                '\\' => match chars.next() {
                    Some((_, 'n')) => text.push('\n'),
                    Some((_, 't')) => text.push('\t'),
                    Some((_, 'r')) => text.push('\r'),
                    Some((_, other)) => text.push(other),
                    None => break,
                },
                _ => text.push(c),
            }
        }
        self.error(start, "this text has no closing quote")
    }

    /// Reads a number, `true`, `false` or `undef`.
    fn word(&mut self) -> Result_<Value> {
        self.skip()?;
        let start = self.at;
        let is_part =
            |b: &&u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'$' | b'.' | b'+' | b'-');
        let length = self.bytes[start..].iter().take_while(is_part).count();
        let word = &self.tree.text[start..start + length];
        self.at += length;
        let bare = word.trim_start_matches(['-', '+']);
        Ok(match word {
            "true" => Value::Bool(true),
            "false" => Value::Bool(false),
            "undef" => Value::Undefined,
            _ => match word.parse() {
                Ok(number) => Value::Number(number),
                Err(_) if bare.starts_with("nan") => Value::Number(f64::NAN),
                Err(_) => {
                    let message = format!("expected a value, found {}", self.found(start));
                    return self.error(start, message);
                }
            },
        })
    }
}

#[cfg(test)]
#[path = "syntax_tests.rs"]
mod tests;
