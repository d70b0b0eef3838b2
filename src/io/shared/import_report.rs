//! Import report: counts, by kind, what an importer left out of the scene.

use std::collections::BTreeMap;

/// Counts of what was not imported, by kind; the source of one summarised warning.
#[derive(Clone, Debug, Default)]
pub struct ImportReport {
    counts: BTreeMap<String, usize>,
}

impl ImportReport {
    /// Counts one more thing of the kind `what`, which is a singular noun for people:
    /// `texture`, `spot light cone`.
    pub fn add(&mut self, what: &str) {
        self.add_many(what, 1);
    }

    /// Counts `count` more things of the kind `what`; 0 adds nothing.
    pub fn add_many(&mut self, what: &str, count: usize) {
        if count > 0 {
            *self.counts.entry(what.into()).or_default() += count;
        }
    }

    /// Formats the counts in one line, kinds in alphabetical order and at most ten of them:
    /// `not imported: 1 × animation, 3 × texture`. `None` if nothing was left out.
    pub fn summary(&self) -> Option<String> {
        if self.counts.is_empty() {
            return None;
        }
        const SHOWN: usize = 10;
        let shown = self.counts.iter().take(SHOWN);
        let list: Vec<String> = shown.map(|(what, n)| format!("{n} × {what}")).collect();
        let mut line = format!("not imported: {}", list.join(", "));
        if self.counts.len() > SHOWN {
            let rest: usize = self.counts.values().skip(SHOWN).sum();
            let kinds = self.counts.len() - SHOWN;
            line += &format!(", and {rest} of {kinds} more kinds");
        }
        Some(line)
    }
}
