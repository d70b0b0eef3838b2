//! `lanecast batch`: renders all pictures of a job in one process, and goes on where it was left.
//!
//! job file → axes → numbered tasks → those that are not done → pictures and records. A task is
//! done if a record has its key and its files are there. The same task has the same bits on every
//! machine, so that there are no locks: several processes may work in one folder.

mod alone;
mod axes;
mod dataset;
mod end;
mod job;
mod join;
mod key;
mod many;
mod openjd;
mod options;
mod picture;
mod ranges;
mod records;
mod run;
mod scenes;
mod shelf;
mod summary;
mod tasks;
mod template;

pub use key::relative;
pub use openjd::export;
pub use ranges::{Ranges, Shard};

use super::args::BatchArgs;
use super::error::CliError;
use super::output::{Sink, complain, print, printable_line};
use job::Job;
use key::Hashes;
use ranges::numbers_of_lines;
use records::Known;
use run::Run;
use std::io::Read;
use std::path::{Path, PathBuf};
use tasks::{Task, Tasks};
use template::Template;

/// The most bytes of a list of tasks on standard input.
const MOST_LIST: u64 = 1 << 28;

/// Runs a job; `render` is the definition of `lanecast render`.
pub fn run(args: &BatchArgs, render: clap::Command) -> Result<(), CliError> {
    let lines = args.json.then_some(&Sink::Stdout);
    args.progress.check(lines.into_iter())?;
    let job = Job::read(&args.job)?;
    let tasks = Tasks::new(&job, &args.job, render)?;
    let chosen = chosen(args, tasks.len())?;
    let Some(out) = args.out.as_deref() else {
        return list(&tasks, &chosen, args.json);
    };
    let hashes = Hashes::new(&args.job);
    let known = Known::read(out)?;
    match args.merge {
        true => summary::merge(&tasks, &chosen, (out, &hashes, &known)),
        false => Run::new(args, &tasks, (out, &hashes, &known)).all(&chosen),
    }
}

/// A scene of a job, and how its task ended.
pub struct Shown {
    pub scene: PathBuf,
    /// Its picture, from the folder of the run.
    pub output: PathBuf,
    /// Why it has none.
    pub failure: Option<String>,
}

/// Returns how the tasks of a job have ended.
pub fn shown(args: &BatchArgs, render: clap::Command) -> Result<Vec<Shown>, CliError> {
    let tasks = Tasks::new(&Job::read(&args.job)?, &args.job, render)?;
    let out = args.out.as_deref().unwrap_or(Path::new(""));
    let known = Known::read(out)?;
    let shown = (0..tasks.len() as u32).map(|number| {
        let task = tasks.task(number);
        let failure = known.failure(&key::settings(&tasks, &task));
        let is_there = out.join(&task.output).is_file();
        let failure = failure.map(|failure| failure.message.clone());
        Shown {
            scene: tasks.scene_path(&task),
            failure: failure.or((!is_there).then(|| "it was not rendered".into())),
            output: task.output,
        }
    });
    Ok(shown.collect())
}

/// Returns the picture of a scene by a template of its own names alone, such as `{file}.png`.
pub fn picture_of(scene: &Path, template: &str) -> String {
    let template = Template::parse(template);
    template.map_or_else(|why| why, |template| template.of_scene(scene))
}

/// Lists the numbers of the tasks that are asked for, each once.
fn chosen(args: &BatchArgs, count: usize) -> Result<Vec<u32>, CliError> {
    let numbers: Vec<u32> = match &args.tasks {
        None => (0..count as u32).collect(),
        Some(Ranges::Stdin) => {
            let mut text = String::new();
            let read = std::io::stdin()
                .lock()
                .take(MOST_LIST)
                .read_to_string(&mut text);
            read.map_err(|e| CliError::Input(format!("standard input: cannot be read: {e}")))?;
            numbers_of_lines(&text).map_err(CliError::Input)?
        }
        Some(ranges) => ranges.numbers().collect(),
    };
    let past = numbers.iter().filter(|number| **number as usize >= count);
    if let (Some(first), more) = (past.clone().next(), past.count()) {
        complain(&format!(
            "warning: the job has {count} tasks, from 0 on; task {first}{} left out",
            match more {
                1 => " is".into(),
                more => format!(" and {} more are", more - 1),
            }
        ));
    }
    let mut seen = vec![false; count];
    let new = |number: &u32| {
        let seen = seen.get_mut(*number as usize);
        seen.is_some_and(|seen| !std::mem::replace(seen, true))
    };
    let numbers: Vec<u32> = numbers.into_iter().filter(new).collect();
    Ok(match args.shard {
        Some(shard) => numbers[shard.of(numbers.len())].to_vec(),
        None => numbers,
    })
}

/// Prints the tasks.
fn list(tasks: &Tasks, chosen: &[u32], json: bool) -> Result<(), CliError> {
    /// Lines that are printed at a time.
    const LINES: usize = 1000;
    for numbers in chosen.chunks(LINES) {
        let lines = numbers.iter().map(|number| {
            let task = tasks.task(*number);
            match json {
                true => json_line(tasks, &task),
                false => plain_line(tasks, &task),
            }
        });
        print(&lines.collect::<String>())?;
    }
    Ok(())
}

fn plain_line(tasks: &Tasks, task: &Task) -> String {
    let words = [
        task.number.to_string(),
        task.output.display().to_string(),
        tasks.scene(task).display().to_string(),
    ];
    let options = tasks.options(task);
    let words = words
        .iter()
        .chain(&options)
        .map(|word| printable_line(word));
    words.collect::<Vec<_>>().join("  ") + "\n"
}

fn json_line(tasks: &Tasks, task: &Task) -> String {
    let command = tasks.command(task, Path::new(""));
    let command = command.iter().map(|word| word.to_string_lossy());
    let line = serde_json::json!({
        "task": task.number,
        "output": task.output.to_string_lossy(),
        "scene": tasks.scene(task).to_string_lossy(),
        "camera": tasks.camera(task),
        "variant": tasks.variant(task),
        "frame": task.frame,
        "tile": task.tile.map(|tile| tile.number),
        "picture": task.picture.to_string_lossy(),
        "settings": key::settings(tasks, task),
        "command": command.collect::<Vec<_>>(),
    });
    format!("{line}\n")
}
