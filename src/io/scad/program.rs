//! `.scad` programs: OpenSCAD itself, where it is installed, makes the `.csg` of them.

use crate::shared::child::Child;
use crate::shared::folder;
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use std::fs::File;
use std::io::{BufRead, BufReader, Error, ErrorKind, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long OpenSCAD may take; it makes no mesh for a `.csg`, so most programs take it a second.
const LIMIT: Duration = Duration::from_secs(60);

/// How often its end is looked for.
const PAUSE: Duration = Duration::from_millis(10);

/// The most bytes of its messages that are read; a program may say anything for a minute.
const MOST_MESSAGES: u64 = 1 << 24;

/// Returns the text of the `.csg` that OpenSCAD makes of a program. Fails with the first error that
/// it names; its warnings, such as of a file that is not there, are counted in the report.
pub(super) fn csg_of(path: &Path, report: &mut ImportReport) -> Result<Vec<u8>, LoadError> {
    // A program that cannot be read is not OpenSCAD's to complain about.
    folder::read_file(path)?;
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    let no_room = |source: Error| {
        let folder = std::env::temp_dir();
        let folder = folder.display();
        let message = format!(
            "no temporary file can be made in {folder}: {source}; set TMPDIR to a folder where one \
             can"
        );
        invalid(path, message)
    };
    let made = tempfile::tempdir().map_err(no_room)?;
    let (csg, messages) = (made.path().join("part.csg"), made.path().join("messages"));
    let said = File::create(&messages).map_err(no_room)?;
    let absolute = path.canonicalize().map_err(failed)?;
    let mut command = Command::new("openscad");
    command
        .arg("-o")
        .arg(&csg)
        .arg(&absolute)
        // Without a screen, too.
        .env("QT_QPA_PLATFORM", "offscreen")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said);
    let openscad = Child::start(&mut command, made).map_err(|source| match source.kind() {
        ErrorKind::NotFound => LoadError::Unsupported {
            path: path.into(),
            what: "an OpenSCAD program without the command openscad on the path".into(),
            remedy: Some(
                "install it, or give the .csg that it makes: openscad -o part.csg part.scad".into(),
            ),
        },
        _ => no_openscad(path, &source),
    })?;
    let no_openscad = |source: Error| no_openscad(path, &source);
    let start = Instant::now();
    let status = loop {
        if let Some(status) = openscad.ended().map_err(no_openscad)? {
            break status;
        }
        if start.elapsed() > LIMIT {
            let seconds = LIMIT.as_secs();
            return Err(invalid(
                path,
                format!("openscad took more than {seconds} seconds"),
            ));
        }
        std::thread::sleep(PAUSE);
    };
    let file = File::open(&messages).map_err(no_room)?;
    let said = Said::of(BufReader::new(file.take(MOST_MESSAGES))).map_err(no_room)?;
    let first = said.error.or(said.first.filter(|_| !status.success()));
    if first.is_some() || !status.success() {
        let why = first.unwrap_or("it says no more".into());
        return Err(invalid(path, format!("openscad failed: {why}")));
    }
    if let Some(first) = said.warning {
        let what = format!("part of the program that openscad warns of (first: {first})");
        report.add_many(&what, said.warnings);
    }
    std::fs::read(&csg)
        .map_err(|source| invalid(path, format!("openscad has written no .csg: {source}")))
}

/// What OpenSCAD says: the first line of each kind.
#[derive(Default)]
struct Said {
    first: Option<String>,
    error: Option<String>,
    warning: Option<String>,
    warnings: usize,
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
            if !line.is_empty() {
                said.first.get_or_insert(line);
            }
        }
        Ok(said)
    }
}

fn no_openscad(path: &Path, source: &Error) -> LoadError {
    invalid(
        path,
        format!("the command openscad cannot be run: {source}"),
    )
}

fn invalid(path: &Path, message: String) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "OpenSCAD program".into(),
        message,
    }
}
