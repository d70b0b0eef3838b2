//! What an importer left out, counted by kind, for one summarised warning.

use std::collections::BTreeMap;

#[derive(Clone, Debug, Default)]
pub struct ImportReport {
    counts: BTreeMap<String, usize>,
}

impl ImportReport {
    /// One more thing of this kind, named as people say it: `texture`,
    /// `spot light cone`.
    pub fn add(&mut self, what: &str) {
        self.add_many(what, 1);
    }

    pub fn add_many(&mut self, what: &str, count: usize) {
        if count > 0 {
            *self.counts.entry(what.into()).or_default() += count;
        }
    }

    /// `not imported: 3 × texture, 1 × animation`.
    pub fn summary(&self) -> Option<String> {
        if self.counts.is_empty() {
            return None;
        }
        let list: Vec<String> = self
            .counts
            .iter()
            .map(|(what, n)| format!("{n} × {what}"))
            .collect();
        Some(format!("not imported: {}", list.join(", ")))
    }
}
