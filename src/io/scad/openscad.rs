//! Runs the command `openscad`, in a folder that goes when it ends.

use crate::shared::child::Child;
use crate::shared::messages::one_line;
use std::fs::File;
use std::io::{BufRead, BufReader, Error, ErrorKind, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How often its end is looked for.
const PAUSE: Duration = Duration::from_millis(5);

/// The most bytes of its messages that are read; a program may say anything for a minute.
const MOST_MESSAGES: u64 = 1 << 24;

/// What OpenSCAD reads.
pub(super) enum Source<'a> {
    /// A file, by its absolute path.
    File(&'a Path),
    /// A program of our own.
    Text(&'a str),
}

/// What OpenSCAD has said and written.
pub(super) struct Run {
    pub is_success: bool,
    pub said: Said,
    pub written: Result<Vec<u8>, Error>,
}

/// Why OpenSCAD has not run to its end.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error(
        "no temporary file can be made in {folder}: {why}; set TMPDIR to a folder where one can",
        folder = std::env::temp_dir().display(),
        why = .0
    )]
    NoRoom(Error),
    #[error("the command openscad is not on the path")]
    Absent,
    #[error("the command openscad cannot be run: {0}")]
    CannotRun(Error),
    #[error("openscad took more than {} seconds", .0.as_secs())]
    TooLong(Duration),
}

/// Has OpenSCAD write a file of an extension, whose first `most` bytes are returned.
pub(super) fn run(
    source: Source,
    extension: &str,
    limit: Duration,
    most: u64,
) -> Result<Run, Failure> {
    let made = tempfile::tempdir().map_err(Failure::NoRoom)?;
    let at = |name: &str| made.path().join(name);
    let (target, messages) = (at(&format!("part.{extension}")), at("messages"));
    let own = at("own.scad");
    let source = match source {
        Source::File(path) => path,
        Source::Text(text) => {
            std::fs::write(&own, text).map_err(Failure::NoRoom)?;
            &own
        }
    };
    let said = File::create(&messages).map_err(Failure::NoRoom)?;
    let mut command = Command::new("openscad");
    command
        .arg("-o")
        .arg(&target)
        .arg(source)
        // Without a screen, too.
        .env("QT_QPA_PLATFORM", "offscreen")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said);
    let openscad = Child::start(&mut command, made).map_err(|source| match source.kind() {
        ErrorKind::NotFound => Failure::Absent,
        _ => Failure::CannotRun(source),
    })?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = openscad.ended().map_err(Failure::CannotRun)? {
            break status;
        }
        if start.elapsed() > limit {
            return Err(Failure::TooLong(limit));
        }
        std::thread::sleep(PAUSE);
    };
    let file = File::open(&messages).map_err(Failure::NoRoom)?;
    let said = Said::of(BufReader::new(file.take(MOST_MESSAGES))).map_err(Failure::NoRoom)?;
    let mut written = Vec::new();
    let read = File::open(&target).and_then(|file| file.take(most).read_to_end(&mut written));
    Ok(Run {
        is_success: status.success(),
        said,
        written: read.map(|_| written),
    })
}

impl Run {
    /// Returns the first error that OpenSCAD names, or the first line if it has failed otherwise.
    pub fn error(&self) -> Option<String> {
        let failed = || (!self.is_success).then(|| self.said.first.clone());
        let why = self.said.error.clone().map(Some).or_else(failed)?;
        Some(why.unwrap_or("it says no more".into()))
    }
}

/// What OpenSCAD says: the first line of each kind.
#[derive(Default)]
pub(super) struct Said {
    pub first: Option<String>,
    pub error: Option<String>,
    pub warning: Option<String>,
    pub warnings: usize,
    /// Whether what it was to write has nothing in it.
    pub is_empty: bool,
}

impl Said {
    fn of(mut lines: impl BufRead) -> Result<Said, Error> {
        let mut said = Said::default();
        let mut bytes = Vec::new();
        while lines.read_until(b'\n', &mut bytes)? > 0 {
            let line = one_line(&String::from_utf8_lossy(&bytes));
            bytes.clear();
            let kind = line.split_once(':').map_or("", |(kind, _)| kind);
            // Such as ERROR, PARSER-ERROR and EXPORT-WARNING.
            let is = |word: &str| {
                kind == word || kind.strip_suffix(word).is_some_and(|k| k.ends_with('-'))
            };
            if is("ERROR") {
                said.error.get_or_insert_with(|| line.clone());
            }
            if is("WARNING") {
                said.warnings += 1;
                said.warning.get_or_insert_with(|| line.clone());
            }
            said.is_empty |= line.starts_with("Current top level object is ");
            if !line.is_empty() {
                said.first.get_or_insert(line);
            }
        }
        Ok(said)
    }
}
