//! Tables of a TOML document while it is read: which of them may still be extended, by a
//! header or by a dotted key.

use super::tree::{Key, Kind, Value};
use std::borrow::Cow;
use std::collections::HashMap;

/// A table whose end is not known yet. By default it is one that headers or dotted keys
/// below it imply.
#[derive(Default)]
pub(super) struct Table<'a> {
    /// Byte offset in the text.
    at: usize,
    origin: Origin,
    entries: Vec<(Key<'a>, Held<'a>)>,
    /// Rows of `entries` by name, once they are too many to search.
    rows: Option<HashMap<Cow<'a, str>, usize>>,
}

/// What a table was made by.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Origin {
    /// The root, an inline table, or a header of a table below this one.
    #[default]
    Implied,
    /// A dotted key.
    Dotted,
    /// Its own header.
    Header,
}

enum Held<'a> {
    /// A value that nothing may extend, an inline table too.
    Value(Value<'a>),
    Table(Table<'a>),
    /// The tables of `[[NAME]]`: complete ones, and the last.
    Tables {
        at: usize,
        done: Vec<Value<'a>>,
        last: Table<'a>,
    },
}

/// A key that TOML does not allow where it is.
pub(super) enum Extend<'a> {
    /// It has a value or a table already.
    Twice(Key<'a>),
    /// Keys below it are given, but it is of another kind, which is named.
    Value(Key<'a>, &'static str),
}

fn cannot_extend<'a>(at: usize, key: &Key<'a>, value: &Value) -> Extend<'a> {
    let name = key.name.clone();
    Extend::Value(Key { at, name }, value.kind.describe())
}

/// The number of entries that are searched one by one.
const SEARCHED: usize = 8;

impl<'a> Table<'a> {
    fn new(at: usize, origin: Origin) -> Table<'a> {
        Table {
            at,
            origin,
            ..Table::default()
        }
    }

    /// Finds the row of an entry.
    fn row(&self, name: &str) -> Option<usize> {
        match &self.rows {
            Some(rows) => rows.get(name).copied(),
            None => self.entries.iter().position(|(key, _)| key.name == name),
        }
    }

    /// Adds an entry, which must not be there, and returns its row.
    fn push(&mut self, key: Key<'a>, held: Held<'a>) -> usize {
        let row = self.entries.len();
        if let Some(rows) = &mut self.rows {
            rows.insert(key.name.clone(), row);
        } else if row == SEARCHED {
            let names = self
                .entries
                .iter()
                .map(|(key, _)| &key.name)
                .chain([&key.name]);
            self.rows = Some(names.cloned().zip(0..).collect());
        }
        self.entries.push((key, held));
        row
    }

    /// Returns the table that `open` has opened.
    pub(super) fn below(&mut self, path: &[usize]) -> &mut Table<'a> {
        path.iter()
            .fold(self, |table, row| match &mut table.entries[*row].1 {
                Held::Table(table) | Held::Tables { last: table, .. } => table,
                Held::Value(_) => unreachable!("paths lead through tables"),
            })
    }

    /// Opens the table of the header with these keys, which begins at `at`: a table, or the
    /// next one of a list. Fills the path to it, and returns its depth in the tree.
    pub(super) fn open(
        &mut self,
        mut keys: Vec<Key<'a>>,
        at: usize,
        is_list: bool,
        path: &mut Vec<usize>,
    ) -> Result<usize, Extend<'a>> {
        let Some(last) = keys.pop() else {
            return Ok(0);
        };
        let (mut table, mut depth) = (self, 0);
        for key in keys {
            let key_at = key.at;
            let row = match table.row(&key.name) {
                Some(row) => row,
                None => table.push(key, Held::Table(Table::new(key_at, Origin::Implied))),
            };
            path.push(row);
            depth += 1;
            let (name, held) = &mut table.entries[row];
            table = match held {
                Held::Table(table) => table,
                Held::Tables { last, .. } => {
                    depth += 1;
                    last
                }
                Held::Value(value) => return Err(cannot_extend(key_at, name, value)),
            };
        }
        depth += 1 + usize::from(is_list);
        let opened = Table::new(at, Origin::Header);
        let Some(row) = table.row(&last.name) else {
            let held = match is_list {
                false => Held::Table(opened),
                true => Held::Tables {
                    at,
                    done: Vec::new(),
                    last: opened,
                },
            };
            path.push(table.push(last, held));
            return Ok(depth);
        };
        path.push(row);
        let (key, held) = &mut table.entries[row];
        match held {
            Held::Table(table) if !is_list && table.origin == Origin::Implied => {
                (table.at, table.origin) = (at, Origin::Header);
                key.at = last.at;
            }
            Held::Tables { done, last, .. } if is_list => {
                done.push(std::mem::replace(last, opened).value());
            }
            _ => return Err(Extend::Twice(last)),
        }
        Ok(depth)
    }

    /// Adds an entry; all keys but the last name tables.
    pub(super) fn insert(
        &mut self,
        mut keys: Vec<Key<'a>>,
        value: Value<'a>,
    ) -> Result<(), Extend<'a>> {
        let Some(last) = keys.pop() else {
            return Ok(());
        };
        let mut table = self;
        for key in keys {
            let key_at = key.at;
            let row = match table.row(&key.name) {
                Some(row) => row,
                None => table.push(key, Held::Table(Table::new(key_at, Origin::Dotted))),
            };
            let (name, held) = &mut table.entries[row];
            table = match held {
                Held::Table(table) if table.origin != Origin::Header => table,
                Held::Table(_) | Held::Tables { .. } => return Err(Extend::Twice(last)),
                Held::Value(value) => return Err(cannot_extend(key_at, name, value)),
            };
        }
        if table.row(&last.name).is_some() {
            return Err(Extend::Twice(last));
        }
        table.push(last, Held::Value(value));
        Ok(())
    }

    fn value(self) -> Value<'a> {
        Value {
            at: self.at,
            kind: self.finish(),
        }
    }

    /// Makes a table of the tree. Recurses no deeper than keys were allowed to be.
    pub(super) fn finish(self) -> Kind<'a> {
        let mut entries = Vec::with_capacity(self.entries.len());
        entries.extend(self.entries.into_iter().map(|(key, held)| {
            let value = match held {
                Held::Value(value) => value,
                Held::Table(table) => table.value(),
                Held::Tables { at, mut done, last } => {
                    done.push(last.value());
                    let kind = Kind::List(done);
                    Value { at, kind }
                }
            };
            (key, value)
        }));
        Kind::Table(entries)
    }
}
