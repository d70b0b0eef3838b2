//! Options of `batch`.

use super::common::ProgressArgs;
use crate::batch::{Ranges, Shard};
use clap::{Args, value_parser};
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct BatchArgs {
    /// .toml or .json: scenes, cameras, variants and frames, and the options that all are rendered
    /// with (docs/BATCH.md)
    pub job: PathBuf,
    /// Folder of the pictures and of their records; it is made if there is none. What is done
    /// there already is not done again
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// Print the tasks, their numbers and pictures, and render nothing
    #[arg(long, conflicts_with_all = ["out", "merge", "check", "max_fails"])]
    pub list: bool,
    /// Print a line of JSON for each task: of --list what it is, else its record once it has ended
    #[arg(long)]
    pub json: bool,
    /// Do only the tasks of these numbers, such as 0-99,120 or 0-99:5; - reads a number a line, or
    /// JSON with "task", from standard input
    #[arg(long, value_name = "NUMBERS", value_parser = Ranges::parse_or_stdin)]
    pub tasks: Option<Ranges>,
    /// Do only the I-th of N parts of the tasks, from 0
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    pub shard: Option<Shard>,
    /// Render nothing, and join the records of all runs into DIR/records.jsonl; exit code 1 and a
    /// list if tasks are missing
    #[arg(long, conflicts_with_all = ["check", "shard"])]
    pub merge: bool,
    /// Read what is done already, and do again what has other bytes than its record says
    #[arg(long)]
    pub check: bool,
    /// Stop when more than N tasks have failed [default: go on]
    #[arg(long, value_name = "N", conflicts_with = "merge")]
    pub max_fails: Option<u32>,
    /// Threads: one a task where tasks are many and pictures small, else all for each picture
    /// [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Keep scenes and their trees in memory, up to so many bytes, such as 800M or 4G, and wait for room
    /// before more are loaded. Files of equal bytes are loaded once while they are kept [default: keep
    /// what the tasks in work need]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, conflicts_with_all = ["list", "merge"])]
    pub memory: Option<u64>,
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Do a task that has ended the process before, and nothing else.
    #[arg(long, hide = true)]
    pub alone: bool,
    /// Whether standard output is another's, and gets no summary.
    #[arg(skip)]
    pub quiet: bool,
}

/// Reads a number of bytes, or of thousands, millions or milliards of them.
fn parse_bytes(text: &str) -> Result<u64, String> {
    let wrong = || "write a number of bytes, such as 800M or 4G".to_owned();
    let (number, unit) = match text.char_indices().next_back() {
        Some((end, 'k' | 'K')) => (&text[..end], 1e3),
        Some((end, 'm' | 'M')) => (&text[..end], 1e6),
        Some((end, 'g' | 'G')) => (&text[..end], 1e9),
        _ => (text, 1.0),
    };
    let bytes = number.trim().parse::<f64>().map_err(|_| wrong())? * unit;
    match (1.0..1e15).contains(&bytes) {
        true => Ok(bytes as u64),
        false => Err(wrong()),
    }
}

impl BatchArgs {
    /// Returns the arguments of a whole job.
    pub fn of_job(
        job: PathBuf,
        out: &Path,
        threads: Option<u32>,
        progress: ProgressArgs,
    ) -> BatchArgs {
        BatchArgs {
            job,
            out: Some(out.into()),
            list: false,
            json: false,
            tasks: None,
            shard: None,
            merge: false,
            check: false,
            max_fails: None,
            threads,
            memory: None,
            progress,
            alone: false,
            quiet: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_units() {
        assert_eq!(parse_bytes("12"), Ok(12));
        assert_eq!(parse_bytes("1.5K"), Ok(1500));
        assert_eq!(parse_bytes("800m"), Ok(800_000_000));
        assert_eq!(parse_bytes("4 G"), Ok(4_000_000_000));
        for wrong in ["", "G", "-1", "0", "nan", "inf", "4T", "1e30", "é"] {
            assert!(parse_bytes(wrong).is_err(), "{wrong}");
        }
    }
}
