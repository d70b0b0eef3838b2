//! Options of `batch`.

use super::common::ProgressArgs;
use crate::cli::batch::{Ranges, Shard};
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
    #[arg(long, conflicts_with = "check")]
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
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Do a task that has ended the process before, and nothing else.
    #[arg(long, hide = true)]
    pub alone: bool,
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
            progress,
            alone: false,
        }
    }
}
