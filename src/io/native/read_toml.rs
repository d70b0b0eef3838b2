//! Reader of TOML text into the tree, by the crate `toml_parser`, which gives events.
//!
//! Events become the tree at once, in the order of the file; the crate `toml` would build
//! tables of its own first, which take several times the memory of the tree. Tokens are
//! parsed a piece of the text at a time, and pieces end between two lines outside of any
//! bracket. What the grammar leaves open is checked here: keys given twice, tables that are
//! extended where TOML forbids it, and depth. `every_text_is_read_as_the_crate_toml_reads_it`

use super::toml_tables::{Extend, Table};
use super::tree::{Key, Kind, MAX_DEPTH, Source, Value, quoted};
use crate::LoadError;
use std::borrow::Cow;
use toml_parser::decoder::{Encoding, ScalarKind};
use toml_parser::lexer::{Token, TokenKind};
use toml_parser::parser::{Event, EventKind, EventReceiver, parse_document};
use toml_parser::{ErrorSink, Expected, ParseError, Span};

/// The least number of tokens that are parsed at once.
const PIECE: usize = 1 << 14;

/// Reads the text. Fails for malformed TOML, repeated keys and too deep nesting.
pub(super) fn read<'a>(source: &Source<'a>) -> Result<Value<'a>, LoadError> {
    let text = toml_parser::Source::new(source.text);
    let mut builder = Builder::new(text);
    let mut fault: Option<ParseError> = None;
    let mut tokens = text.lex();
    let mut piece = Vec::new();
    while next_piece(&mut tokens, &mut piece) {
        parse_document(&piece, &mut builder, &mut fault);
        if let Some(fault) = fault {
            let end = source.text.len();
            let at = fault.unexpected().map_or(end, |span| span.start());
            return Err(source.error(at, message(&fault)));
        }
    }
    let kind = builder.root.finish();
    Ok(Value { at: 0, kind })
}

/// Replaces `piece` by the next tokens, to the end of a line outside of any bracket; returns
/// false if there are none.
fn next_piece(tokens: &mut impl Iterator<Item = Token>, piece: &mut Vec<Token>) -> bool {
    piece.clear();
    let mut depth = 0_usize;
    for token in tokens {
        piece.push(token);
        match token.kind() {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => depth += 1,
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                depth = depth.saturating_sub(1);
            }
            TokenKind::Newline if depth == 0 && piece.len() >= PIECE => break,
            _ => {}
        }
    }
    !piece.is_empty()
}

/// Formats an error of the crate.
fn message(fault: &ParseError) -> String {
    let mut message = fault.description().to_string();
    let Some(expected) = fault.expected() else {
        return message;
    };
    let names = expected.iter().map(|expected| match expected {
        Expected::Literal("\n") => "newline".into(),
        Expected::Literal("`") => "'`'".into(),
        Expected::Literal(text) => format!("`{}`", text.escape_debug()),
        Expected::Description(what) => (*what).into(),
        _ => "something else".into(),
    });
    let names: Vec<String> = names.collect();
    message += ", expected ";
    message += &match names.is_empty() {
        true => "nothing".into(),
        false => names.join(", "),
    };
    message
}

/// The state between two events.
struct Builder<'a> {
    text: toml_parser::Source<'a>,
    root: Table<'a>,
    /// The table of the last header: rows of entries from the root.
    here: Vec<usize>,
    /// Depth of that table in the tree.
    here_depth: usize,
    /// Start of the header that is being read.
    header: Option<usize>,
    /// Keys of the header or entry that is being read, outside of any value.
    keys: Vec<Key<'a>>,
    /// Lists and inline tables that are not closed yet.
    open: Vec<Open<'a>>,
}

/// A list or inline table that is not closed yet.
struct Open<'a> {
    at: usize,
    depth: usize,
    what: What<'a>,
}

enum What<'a> {
    List(Vec<Value<'a>>),
    /// The entries so far, and the keys of the one that is being read.
    Inline(Table<'a>, Vec<Key<'a>>),
}

impl<'a> Builder<'a> {
    fn new(text: toml_parser::Source<'a>) -> Builder<'a> {
        Builder {
            text,
            root: Table::default(),
            here: Vec::new(),
            here_depth: 0,
            header: None,
            keys: Vec::new(),
            open: Vec::new(),
        }
    }

    /// The depth of a value that begins now.
    fn depth(&self) -> usize {
        match self.open.last() {
            Some(open) => match &open.what {
                What::List(_) => open.depth + 1,
                What::Inline(_, keys) => open.depth + keys.len(),
            },
            None => self.here_depth + self.keys.len(),
        }
    }

    /// Says whether a value that begins now is not too deep; reports it otherwise.
    fn within_depth(&self, at: Span, errors: &mut dyn ErrorSink) -> bool {
        let within = self.depth() <= MAX_DEPTH;
        if !within {
            report(errors, "it is nested too deeply".into(), at);
        }
        within
    }

    /// Begins a list or an inline table; returns false if it is too deep.
    fn begin(&mut self, at: Span, what: What<'a>, errors: &mut dyn ErrorSink) -> bool {
        let depth = self.depth();
        let within = self.within_depth(at, errors);
        if within {
            self.open.push(Open {
                at: at.start(),
                depth,
                what,
            });
        }
        within
    }

    /// Puts a complete value where it belongs.
    fn give(&mut self, value: Value<'a>, errors: &mut dyn ErrorSink) {
        let (table, keys) = match self.open.last_mut().map(|open| &mut open.what) {
            Some(What::List(list)) => return list.push(value),
            Some(What::Inline(table, keys)) => (table, std::mem::take(keys)),
            None => {
                let keys = std::mem::take(&mut self.keys);
                (self.root.below(&self.here), keys)
            }
        };
        if let Err(fault) = table.insert(keys, value) {
            forbid(fault, errors);
        }
    }

    /// Closes the innermost list or inline table.
    fn close(&mut self, errors: &mut dyn ErrorSink) {
        let Some(Open { at, what, .. }) = self.open.pop() else {
            return;
        };
        let kind = match what {
            What::List(mut list) => {
                // Most lists are short, and there are many.
                list.shrink_to_fit();
                Kind::List(list)
            }
            What::Inline(table, _) => table.finish(),
        };
        self.give(Value { at, kind }, errors);
    }

    /// Opens the table of the header that has been read.
    fn open_table(&mut self, is_list: bool, close: Span, errors: &mut dyn ErrorSink) {
        let keys = std::mem::take(&mut self.keys);
        let Some(at) = self.header.take() else {
            return;
        };
        self.here.clear();
        self.here_depth = 0;
        match self.root.open(keys, at, is_list, &mut self.here) {
            Ok(depth) if depth <= MAX_DEPTH => self.here_depth = depth,
            Ok(_) => report(errors, "it is nested too deeply".into(), close),
            Err(fault) => {
                // What follows is read for no purpose, into the root.
                self.here.clear();
                forbid(fault, errors);
            }
        }
    }
}

/// Reports a key that TOML does not allow where it is.
fn forbid(fault: Extend, errors: &mut dyn ErrorSink) {
    let (key, message) = match &fault {
        Extend::Twice(key) => (key, format!("the key {} is given twice", quoted(&key.name))),
        Extend::Value(key, kind) => {
            let name = quoted(&key.name);
            let message = format!("the key {name} has {kind} already, which cannot be extended");
            (key, message)
        }
    };
    report(errors, message, Span::new_unchecked(key.at, key.at));
}

fn report(errors: &mut dyn ErrorSink, message: String, at: Span) {
    errors.report_error(ParseError::new(message).with_unexpected(at));
}

impl EventReceiver for Builder<'_> {
    fn std_table_open(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.header = Some(span.start());
        self.keys.clear();
    }

    fn std_table_close(&mut self, span: Span, errors: &mut dyn ErrorSink) {
        self.open_table(false, span, errors);
    }

    fn array_table_open(&mut self, span: Span, _: &mut dyn ErrorSink) {
        self.header = Some(span.start());
        self.keys.clear();
    }

    fn array_table_close(&mut self, span: Span, errors: &mut dyn ErrorSink) {
        self.open_table(true, span, errors);
    }

    fn inline_table_open(&mut self, span: Span, errors: &mut dyn ErrorSink) -> bool {
        let what = What::Inline(Table::default(), Vec::new());
        self.begin(span, what, errors)
    }

    fn inline_table_close(&mut self, _: Span, errors: &mut dyn ErrorSink) {
        self.close(errors);
    }

    fn array_open(&mut self, span: Span, errors: &mut dyn ErrorSink) -> bool {
        self.begin(span, What::List(Vec::new()), errors)
    }

    fn array_close(&mut self, _: Span, errors: &mut dyn ErrorSink) {
        self.close(errors);
    }

    fn simple_key(&mut self, span: Span, encoding: Option<Encoding>, errors: &mut dyn ErrorSink) {
        let mut name = Cow::Borrowed("");
        if let Some(raw) = self
            .text
            .get(Event::new_unchecked(EventKind::SimpleKey, encoding, span))
        {
            raw.decode_key(&mut name, errors);
        }
        let at = span.start();
        let keys = match self.open.last_mut().map(|open| &mut open.what) {
            Some(What::Inline(_, keys)) => keys,
            _ => &mut self.keys,
        };
        if keys.len() > MAX_DEPTH {
            return report(errors, "it is nested too deeply".into(), span);
        }
        keys.push(Key { at, name });
    }

    fn scalar(&mut self, span: Span, encoding: Option<Encoding>, errors: &mut dyn ErrorSink) {
        let mut text = Cow::Borrowed("");
        let event = Event::new_unchecked(EventKind::Scalar, encoding, span);
        let Some(raw) = self.text.get(event) else {
            return;
        };
        let kind = match raw.decode_scalar(&mut text, errors) {
            ScalarKind::String => Some(Kind::Text(text)),
            ScalarKind::Boolean(b) => Some(Kind::Bool(b)),
            ScalarKind::DateTime => match text.parse::<toml_datetime::Datetime>() {
                Ok(_) => Some(Kind::Date),
                Err(e) => return report(errors, format!("it is no date: {e}"), span),
            },
            ScalarKind::Float => text.parse().ok().map(Kind::Float),
            ScalarKind::Integer(radix) => match i64::from_str_radix(&text, radix.value()) {
                Ok(i) => Some(Kind::Integer(i)),
                // An integer of more than 64 bits can still be a coordinate.
                Err(_) if radix.value() == 10 => text.parse().ok().map(Kind::Float),
                Err(_) => return report(errors, "the number is too large".into(), span),
            },
        };
        let at = span.start();
        match kind {
            Some(kind) if self.within_depth(span, errors) => self.give(Value { at, kind }, errors),
            Some(_) => {}
            None => report(errors, "it is no number".into(), span),
        }
    }

    fn comment(&mut self, span: Span, errors: &mut dyn ErrorSink) {
        if let Some(raw) = self.text.get(span) {
            raw.decode_comment(errors);
        }
    }

    fn newline(&mut self, span: Span, errors: &mut dyn ErrorSink) {
        if let Some(raw) = self.text.get(span) {
            raw.decode_newline(errors);
        }
    }
}

#[cfg(test)]
mod tests;
