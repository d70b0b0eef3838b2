//! `lanecast batch --merge`: joins the records of all runs, and names what is missing.

use super::dataset;
use super::join;
use super::key::{Hashes, settings};
use super::records::{Known, Record, Standing};
use super::tasks::Tasks;
use crate::error::CliError;
use crate::output::Results;
use lanecast_io::{Outputs, SaveError};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The most ranges of numbers that a message lists.
const MOST_RANGES: usize = 20;

/// Writes `records.jsonl`, a line for each task that is done, in their order. Fails with what is
/// missing or failed.
pub fn merge(
    tasks: &Tasks,
    chosen: &[u32],
    (out, hashes, known): (&Path, &Hashes, &Known),
) -> Result<(), CliError> {
    let path = out.join("records.jsonl");
    let (mut lines, mut missing) = (Vec::new(), Vec::new());
    let mut there = Vec::new();
    let mut reasons = String::new();
    for number in chosen {
        let task = tasks.task(*number);
        match known.standing(&settings(tasks, &task), (out, hashes), false) {
            Standing::Done(record) => {
                there.push(task);
                // Numbers are those of the job as it is.
                let record = Record {
                    task: *number,
                    ..*record
                };
                serde_json::to_writer(&mut lines, &record).map_err(|e| SaveError::Encode {
                    path: path.clone(),
                    message: e.to_string(),
                })?;
                lines.push(b'\n');
            }
            standing => {
                if let (Standing::Failed(error), true) = (standing, reasons.is_empty()) {
                    reasons = format!("; task {number} failed: {}", error.message);
                }
                missing.push(*number);
            }
        }
    }
    let done = chosen.len() - missing.len();
    if done == 0 {
        return Err(CliError::Short(format!(
            "{}: none of {} tasks is done, so that there is nothing to merge{reasons}; run the job \
             without --merge first",
            out.display(),
            chosen.len()
        )));
    }
    let joined = match tasks.of_picture() {
        1 => String::new(),
        _ => join::joined(tasks, (chosen, &missing), (out, hashes, known))?,
    };
    let mut results = Results::default();
    results.outputs.add(&path, lines)?;
    let mut names = vec!["records.jsonl".into()];
    if let Some(settings) = &tasks.dataset {
        names.extend(dataset::write(
            (tasks, settings),
            &there,
            out,
            &mut results.outputs,
        )?);
    }
    let merged = Merged::read(out);
    for name in &names {
        merged.check_is_ours(out, name)?;
    }
    // First, so that a merge that is killed between its files can be done again.
    let mut list = Outputs::default();
    list.add(&out.join(Merged::LIST), merged.with(&names).into_bytes())?;
    list.commit()?;
    let written = names.iter().map(|name| out.join(name));
    let written: Vec<String> = written.map(|path| path.display().to_string()).collect();
    results.commit(&format!(
        "{}: {done} of {} tasks{joined}\n",
        written.join(", "),
        chosen.len()
    ))?;
    match missing.is_empty() {
        true => Ok(()),
        false => Err(CliError::Short(format!(
            "{} of {} tasks are missing: {}{reasons}",
            missing.len(),
            chosen.len(),
            ranges(&missing)
        ))),
    }
}

/// The files that merges have written into a folder, by their names from there.
struct Merged(BTreeSet<PathBuf>);

impl Merged {
    /// Where they are listed, a line each.
    const LIST: &str = "records/merged.txt";

    fn read(out: &Path) -> Merged {
        let text = fs::read_to_string(out.join(Merged::LIST)).unwrap_or_default();
        Merged(text.lines().map(PathBuf::from).collect())
    }

    /// Refuses to replace a file that no merge has written.
    fn check_is_ours(&self, out: &Path, name: &Path) -> Result<(), CliError> {
        let path = out.join(name);
        match self.0.contains(name) || path.symlink_metadata().is_err() {
            true => Ok(()),
            false => Err(CliError::Usage(format!(
                "{} exists, and no --merge of this folder has written it; move it away, or give \
                 another folder with --out",
                path.display()
            ))),
        }
    }

    /// Returns the list with more files.
    fn with(self, names: &[PathBuf]) -> String {
        let mut all = self.0;
        all.extend(names.iter().cloned());
        all.iter()
            .map(|name| format!("{}\n", name.display()))
            .collect()
    }
}

/// Writes numbers as `--tasks` reads them; many are cut short.
pub fn ranges(numbers: &[u32]) -> String {
    let mut ranges: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == *number => *last = *number,
            _ => ranges.push((*number, *number)),
        }
    }
    let text = ranges
        .iter()
        .take(MOST_RANGES)
        .map(|(first, last)| match first == last {
            true => first.to_string(),
            false => format!("{first}-{last}"),
        });
    let text: Vec<String> = text.collect();
    let more = if ranges.len() > MOST_RANGES {
        ",…"
    } else {
        ""
    };
    text.join(",") + more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_ranges() {
        assert_eq!(ranges(&[]), "");
        assert_eq!(ranges(&[3]), "3");
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
        let odd: Vec<u32> = (0..100).map(|i| 2 * i + 1).collect();
        assert!(ranges(&odd).ends_with("39,…"));
    }
}
