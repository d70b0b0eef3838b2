//! Records of tasks: a line of JSON each, in `DIR/records/`, one file a process.
//!
//! A line is appended by one write, so that a process that is killed leaves at most one torn line,
//! the last, which is ignored. Nothing is ever locked: processes that do one task at the same time
//! write the same picture.

use super::key::{Hashes, Input, file_hash, key};
use crate::error::CliError;
use crate::output::complain;
use crate::pipeline::isa;
use crate::version::features;
use lanecast_io::SaveError;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// The version of the records.
const VERSION: u32 = 1;

/// So many starts without an end, and a task is done by a process of its own.
pub const SUSPECT: u32 = 3;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    Started,
    Done,
    Failed,
    /// It was cut short together with its run.
    Stopped,
}

/// A line.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    pub v: u32,
    pub task: u32,
    pub status: Status,
    /// Hash of what was asked for.
    pub settings: String,
    /// Hash of that and of all that was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// Starts of this task so far, this one included.
    pub attempt: u32,
    /// Of a start the names alone.
    pub outputs: Vec<Output>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<Input>,
    /// Seconds of each stage.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub stages: BTreeMap<String, f64>,
    #[serde(default)]
    pub rays: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<Failure>,
    pub build: Build,
    /// When the task began, in seconds since 1970.
    pub started: f64,
    #[serde(default)]
    pub seconds: f64,
}

/// A file of a task, from the folder of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    pub path: PathBuf,
    #[serde(default)]
    pub bytes: u64,
    /// SHA-256.
    #[serde(default)]
    pub hash: String,
}

/// Why a task failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// The exit code that `lanecast render` would have had; 101 of a panic, and none of what ended
    /// the process.
    pub code: Option<u8>,
    pub message: String,
    /// Whether another run tries again although nothing was changed.
    pub again: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Build {
    pub version: String,
    pub commit: String,
    pub isa: String,
    /// Features of cargo.
    #[serde(default)]
    pub features: Vec<String>,
}

impl Build {
    pub fn of_this() -> Build {
        Build {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("LANECAST_COMMIT").unwrap_or("unknown").into(),
            isa: isa().into(),
            features: features().map(str::to_owned).collect(),
        }
    }
}

/// Returns the seconds since 1970.
pub fn now() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |since| since.as_secs_f64())
}

/// What records tell of the tasks of a folder.
#[derive(Default)]
pub struct Known {
    tasks: HashMap<String, History>,
    /// All files that a record names.
    files: HashSet<PathBuf>,
}

/// What records tell of a task.
#[derive(Default)]
struct History {
    last: Option<Record>,
    starts: u32,
    /// Starts since the last end.
    open: u32,
}

/// How a task stands.
pub enum Standing {
    Todo,
    /// It was started [`SUSPECT`] times and never ended.
    Suspect,
    Done(Box<Record>),
    /// It failed, and would fail again.
    Failed(Failure),
}

impl Known {
    /// Reads all records of a folder; none if it does not exist.
    pub fn read(folder: &Path) -> Result<Known, CliError> {
        let records = folder.join("records");
        let failed = |path: &Path, e: std::io::Error| {
            CliError::Input(format!("{}: cannot be read: {e}", path.display()))
        };
        let entries = match fs::read_dir(&records) {
            // Of a path through a file the message is that of writing.
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Ok(Known::default());
            }
            entries => entries.map_err(|e| failed(&records, e))?,
        };
        let is_lines = |path: &PathBuf| path.extension().is_some_and(|e| e == "jsonl");
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let mut paths: Vec<PathBuf> = paths.filter(is_lines).collect();
        paths.sort();
        let mut lines = Vec::new();
        let mut unread = 0;
        for path in &paths {
            let text = fs::read(path).map_err(|e| failed(path, e))?;
            let mut all = text.split(|b| *b == b'\n').peekable();
            while let Some(line) = all.next() {
                match serde_json::from_slice::<Record>(line) {
                    Ok(record) if record.v == VERSION => lines.push(record),
                    // What follows the last end of a line is torn, or nothing.
                    _ if all.peek().is_none() => {}
                    _ => unread += 1,
                }
            }
        }
        if unread > 0 {
            complain(&format!(
                "warning: {}: {unread} lines are no records of this version, and count as not there",
                records.display()
            ));
        }
        // One machine's clock at least goes forward.
        lines.sort_by(|a, b| (a.started + a.seconds).total_cmp(&(b.started + b.seconds)));
        let mut known = Known::default();
        lines.into_iter().for_each(|record| known.add(record));
        Ok(known)
    }

    fn add(&mut self, record: Record) {
        let names = record.outputs.iter().map(|output| output.path.clone());
        self.files.extend(names);
        let history = self.tasks.entry(record.settings.clone()).or_default();
        match record.status {
            Status::Started => {
                history.starts += 1;
                history.open += 1;
            }
            Status::Done | Status::Failed => {
                history.open = 0;
                history.last = Some(record);
            }
            Status::Stopped => history.open = 0,
        }
    }

    /// Says whether a record names a file.
    pub fn names(&self, file: &Path) -> bool {
        self.files.contains(file)
    }

    /// Refuses to replace a file that no record names: it is not a picture of this job.
    pub fn check_is_ours(&self, out: &Path, file: &Path) -> Result<(), CliError> {
        let path = out.join(file);
        match self.names(file) || path.symlink_metadata().is_err() {
            true => Ok(()),
            false => Err(CliError::Usage(format!(
                "{} exists, and no record says that it is of this job; move it away, or give another \
                 folder with --out",
                path.display()
            ))),
        }
    }

    /// Returns why a task failed, if that is what it did last.
    pub fn failure(&self, settings: &str) -> Option<&Failure> {
        self.tasks.get(settings)?.last.as_ref()?.error.as_ref()
    }

    /// Removes files that a task had when it was done before and has no longer, as masks of objects
    /// that are gone.
    pub fn remove_others(&self, settings: &str, files: &[PathBuf], folder: &Path) {
        let last = self
            .tasks
            .get(settings)
            .and_then(|history| history.last.as_ref());
        let outputs = last.iter().flat_map(|record| &record.outputs);
        for output in outputs.filter(|output| !files.contains(&output.path)) {
            // One that is gone already, or cannot be removed, harms no task.
            let _ = fs::remove_file(folder.join(&output.path));
        }
    }

    /// Returns how often a task was started.
    pub fn starts(&self, settings: &str) -> u32 {
        self.tasks.get(settings).map_or(0, |history| history.starts)
    }

    /// Returns how the task of these settings stands: done if what it read has the same bytes and
    /// its files have the sizes of the record, with `check` the bytes, too.
    pub fn standing(
        &self,
        settings: &str,
        (folder, hashes): (&Path, &Hashes),
        check: bool,
    ) -> Standing {
        let Some(history) = self.tasks.get(settings) else {
            return Standing::Todo;
        };
        let todo = match history.open >= SUSPECT {
            true => Standing::Suspect,
            false => Standing::Todo,
        };
        let Some(last) = &history.last else {
            return todo;
        };
        let inputs: Vec<Input> = last.inputs.iter().map(|i| hashes.again(&i.path)).collect();
        if last.key.as_ref() != Some(&key(settings, &inputs)) {
            return todo;
        }
        match (&last.status, &last.error) {
            (Status::Done, _) if last.outputs.iter().all(|o| is_there(folder, o, check)) => {
                Standing::Done(Box::new(last.clone()))
            }
            // Another program may read what this one could not.
            (Status::Failed, Some(error)) if !error.again && last.build == Build::of_this() => {
                Standing::Failed(error.clone())
            }
            _ => todo,
        }
    }
}

/// Returns what is in the files of a task, which are there.
pub fn outputs_of(out: &Path, files: &[PathBuf]) -> Result<Vec<Output>, CliError> {
    let of_file = |file: &PathBuf| {
        let path = out.join(file);
        Ok(Output {
            path: file.clone(),
            bytes: path.metadata().map_err(|e| failed(&path, e))?.len(),
            hash: file_hash(&path).map_err(|e| failed(&path, e))?,
        })
    };
    files.iter().map(of_file).collect()
}

fn is_there(folder: &Path, output: &Output, check: bool) -> bool {
    let path = folder.join(&output.path);
    let has_size =
        fs::metadata(&path).is_ok_and(|about| about.is_file() && about.len() == output.bytes);
    has_size && (!check || file_hash(&path).is_ok_and(|hash| hash == output.hash))
}

/// The file of this process's records.
pub struct Writer {
    path: PathBuf,
    file: File,
}

impl Writer {
    /// Creates the file `records/HOST-PROCESS-TIME.jsonl` in a folder.
    pub fn create(folder: &Path) -> Result<Writer, CliError> {
        let records = folder.join("records");
        fs::create_dir_all(&records).map_err(|source| failed(&records, source))?;
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let plain = |c: char| {
            if c.is_ascii_alphanumeric() || c == '.' {
                c
            } else {
                '_'
            }
        };
        let host: String = host.trim().chars().map(plain).collect();
        let host = if host.is_empty() { "host" } else { &host };
        let (process, start) = (std::process::id(), (now() * 1e3) as u64);
        let path = records.join(format!("{host}-{process}-{start}.jsonl"));
        let mut options = OpenOptions::new();
        let file = options.append(true).create_new(true).open(&path);
        let file = file.map_err(|source| failed(&path, source))?;
        Ok(Writer { path, file })
    }

    /// Appends a record, and returns its line.
    pub fn append(&mut self, record: &Record) -> Result<String, CliError> {
        let mut line = serde_json::to_string(record).map_err(|e| SaveError::Encode {
            path: self.path.clone(),
            message: e.to_string(),
        })?;
        line.push('\n');
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|source| failed(&self.path, source))?;
        Ok(line)
    }
}

impl Record {
    /// Returns the record of a task that begins.
    pub fn started(task: u32, settings: &str, attempt: u32, files: &[PathBuf]) -> Record {
        let output = |path: &PathBuf| Output {
            path: path.clone(),
            bytes: 0,
            hash: String::new(),
        };
        Record {
            v: VERSION,
            task,
            status: Status::Started,
            settings: settings.into(),
            key: None,
            attempt,
            outputs: files.iter().map(output).collect(),
            inputs: Vec::new(),
            stages: BTreeMap::new(),
            rays: 0,
            error: None,
            build: Build::of_this(),
            started: now(),
            seconds: 0.0,
        }
    }

    /// Returns the record of the end of a task that this one began.
    pub fn ended(&self, status: Status, inputs: Vec<Input>) -> Record {
        Record {
            status,
            key: Some(key(&self.settings, &inputs)),
            inputs,
            seconds: (now() - self.started).max(0.0),
            ..self.clone()
        }
    }
}

fn failed(path: &Path, source: std::io::Error) -> CliError {
    CliError::Save(SaveError::Write {
        path: path.into(),
        source,
    })
}
