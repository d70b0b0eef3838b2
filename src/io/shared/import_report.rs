//! Import report: counts, by kind, what an importer left out of the scene, repaired, or shows as
//! something else.

use std::collections::BTreeMap;

/// The kinds that a summary names; it counts the others.
const NAMED: usize = 10;

/// Counts of what was not imported, of what was repaired, and of what is shown as something else,
/// by kind; the source of one summarised warning.
#[derive(Clone, Debug, Default)]
pub struct ImportReport {
    left_out: BTreeMap<String, usize>,
    repaired: BTreeMap<String, usize>,
    shown_as: BTreeMap<String, usize>,
}

impl ImportReport {
    /// Counts one more thing of the kind `what` that is not imported. The kind is a singular
    /// noun for people: `texture`, `alpha mode`.
    pub fn add(&mut self, what: &str) {
        self.add_many(what, 1);
    }

    /// Counts `count` more things that are not imported; 0 adds nothing.
    pub fn add_many(&mut self, what: &str, count: usize) {
        if count > 0 {
            *self.left_out.entry(what.into()).or_default() += count;
        }
    }

    /// Counts `count` more things of the kind `what` that are wrong in the file and were
    /// read as they are meant; 0 adds nothing.
    pub fn repair(&mut self, what: &str, count: usize) {
        if count > 0 {
            *self.repaired.entry(what.into()).or_default() += count;
        }
    }

    /// Counts one more thing that the scene holds in another way: `circle, with 256 sides`.
    pub fn shown_as(&mut self, what: &str) {
        *self.shown_as.entry(what.into()).or_default() += 1;
    }

    /// Formats the counts in one line, kinds in alphabetical order, ten at most:
    /// `not imported: 1 × animation, 3 × texture; repaired: 2 × byteStride of 0`. `None` if
    /// there is nothing to say.
    pub fn summary(&self) -> Option<String> {
        let parts = [
            ("not imported", &self.left_out),
            ("repaired", &self.repaired),
            ("shown as", &self.shown_as),
        ];
        let parts: Vec<String> = parts
            .into_iter()
            .filter(|(_, counts)| !counts.is_empty())
            .map(|(what, counts)| format!("{what}: {}", list(counts)))
            .collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Formats counts by kind.
fn list(counts: &BTreeMap<String, usize>) -> String {
    let named = counts.iter().take(NAMED);
    let mut list: Vec<String> = named.map(|(what, n)| format!("{n} × {what}")).collect();
    if counts.len() > NAMED {
        let things: usize = counts.values().skip(NAMED).sum();
        list.push(format!("{things} × {} other kinds", counts.len() - NAMED));
    }
    list.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_names_ten_kinds_at_most() {
        let mut report = ImportReport::default();
        assert_eq!(report.summary(), None);
        report.repair("byteStride of 0", 2);
        assert_eq!(report.summary().unwrap(), "repaired: 2 × byteStride of 0");
        for i in 0..30 {
            report.add_many(&format!("element {i:02}"), 2);
        }
        let summary = report.summary().unwrap();
        assert!(
            summary.starts_with("not imported: 2 × element 00, "),
            "{summary}"
        );
        let end = "2 × element 09, 40 × 20 other kinds; repaired: 2 × byteStride of 0";
        assert!(summary.ends_with(end), "{summary}");
    }
}
