//! Names of rows, kept only for the rows that have one.

use std::collections::BTreeMap;

#[derive(Clone, Debug, Default)]
pub struct Names {
    of_row: BTreeMap<u32, Box<str>>,
}

impl Names {
    /// Names row `row`; an empty name stands for none.
    pub fn set(&mut self, row: u32, name: &str) {
        if !name.is_empty() {
            self.of_row.insert(row, name.into());
        }
    }

    pub fn get(&self, row: u32) -> Option<&str> {
        self.of_row.get(&row).map(|name| &**name)
    }

    /// Puts a prefix before the names of all rows from `first` on.
    pub(super) fn prefix(&mut self, first: u32, prefix: &str) {
        for (_, name) in self.of_row.range_mut(first..) {
            *name = format!("{prefix}{name}").into();
        }
    }

    /// Lists the rows that have a name, and the names.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &str)> {
        self.of_row.iter().map(|(row, name)| (*row, &**name))
    }

    /// Returns the name in quotes, or the row's number, for messages.
    pub fn label(&self, row: u32) -> String {
        match self.get(row) {
            Some(name) => format!("'{name}'"),
            None => format!("number {row}"),
        }
    }

    pub fn bytes(&self) -> usize {
        self.of_row
            .values()
            .map(|n| n.len() + size_of::<(u32, Box<str>)>())
            .sum()
    }
}
