//! Destinations of results: files and standard output.

use super::error::CliError;
use super::interrupt;
use lanecast_io::{Outputs, SaveError, check_writable};
use serde::Serialize;
use std::collections::HashSet;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The destination of machine-readable results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sink {
    /// `-`
    Stdout,
    File(PathBuf),
}

impl Sink {
    pub fn parse(text: &str) -> Result<Sink, String> {
        match text {
            "" => Err("name a file, or - for standard output".into()),
            "-" => Ok(Sink::Stdout),
            file => Ok(Sink::File(file.into())),
        }
    }
}

/// A file that a command has written, as `--json` tells it.
#[derive(Clone, Debug, Serialize)]
pub struct Written {
    pub path: String,
    pub bytes: usize,
}

impl Written {
    pub fn new((path, bytes): &(PathBuf, Vec<u8>)) -> Written {
        Written {
            path: path.display().to_string(),
            bytes: bytes.len(),
        }
    }
}

/// Results collected until the end of the run. Files are committed together, and get
/// their names after standard output has received its text.
#[derive(Default)]
pub struct Results {
    pub outputs: Outputs,
    stdout: String,
}

impl Results {
    pub fn add(&mut self, sink: &Option<Sink>, value: &impl Serialize) -> Result<(), CliError> {
        let Some(sink) = sink else {
            return Ok(());
        };
        let path = match sink {
            Sink::Stdout => Path::new("standard output"),
            Sink::File(path) => path,
        };
        let mut json = serde_json::to_string_pretty(value).map_err(|e| SaveError::Encode {
            path: path.into(),
            message: e.to_string(),
        })?;
        json.push('\n');
        match sink {
            Sink::Stdout => self.stdout.push_str(&json),
            Sink::File(path) => self.outputs.add(path, json.into_bytes())?,
        }
        Ok(())
    }

    /// Prints, then gives the files their names: no file gets its name if any other
    /// output failed. `summary` is for readers, and is omitted if standard output
    /// receives JSON.
    pub fn commit(mut self, summary: &str) -> Result<(), CliError> {
        // A reader may block these writes, so the timeout stays active during them.
        interrupt::begin_sending();
        self.outputs.send()?;
        match self.stdout.as_str() {
            "" => print(&printable(summary))?,
            json => print(json)?,
        }
        interrupt::disable_timeout();
        Ok(self.outputs.commit()?)
    }
}

/// Checks before any work that every output has a path of its own, is writable, and
/// does not overwrite the input. Returns all files that will be written.
pub fn check_destinations<'a>(
    inputs: &[&Path],
    files: &[PathBuf],
    sinks: impl Iterator<Item = &'a Sink>,
) -> Result<Vec<PathBuf>, CliError> {
    let mut stdout = false;
    let mut all = files.to_vec();
    for sink in sinks {
        match sink {
            Sink::File(path) => all.push(path.clone()),
            Sink::Stdout if stdout => {
                return Err(CliError::Usage(
                    "--stats and --json cannot both go to standard output; give one of them a file"
                        .into(),
                ));
            }
            Sink::Stdout => stdout = true,
        }
    }
    let inputs: HashSet<PathBuf> = inputs.iter().filter_map(|i| identity(i)).collect();
    let mut outputs = HashSet::new();
    for path in &all {
        let Some(identity) = identity(path) else {
            continue;
        };
        if inputs.contains(&identity) {
            return Err(CliError::Usage(format!(
                "{} is the input; give the output another name",
                path.display()
            )));
        }
        if !outputs.insert(identity) {
            return Err(CliError::Usage(format!(
                "{} is named for two outputs; give one of them another name",
                path.display()
            )));
        }
    }
    for path in &all {
        check_writable(path)?;
    }
    Ok(all)
}

/// Returns a path that is the same for all names of a file, even before the file
/// exists; `None` for devices, which may take several outputs.
fn identity(path: &Path) -> Option<PathBuf> {
    match path.canonicalize() {
        Ok(real) => real.is_file().then_some(real),
        Err(_) => {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            let folder = folder.unwrap_or(Path::new("."));
            let folder = folder.canonicalize().unwrap_or(folder.into());
            Some(folder.join(path.file_name()?))
        }
    }
}

/// Prints to standard output. A closed pipe is no error.
pub fn print(text: &str) -> Result<(), CliError> {
    let mut stdout = std::io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::Stdout(e)),
        _ => Ok(()),
    }
}

/// Writes one line to standard error; a failure cannot be reported.
pub fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", printable_line(line));
}

/// Returns a word as a shell reads it back.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-+./:=,@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// Escapes what a terminal would obey in a text of several lines: names of files, or names
/// in them, may hold anything.
pub fn printable(text: &str) -> String {
    escaped(text, |c| c == '\n')
}

/// Escapes what a terminal would obey, line feeds too: a name must not begin a line.
pub fn printable_line(text: &str) -> String {
    escaped(text, |_| false)
}

fn escaped(text: &str, keep: impl Fn(char) -> bool) -> String {
    // Marks that reorder or break what is shown beside them.
    let misleads = |c| matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if (c.is_control() || misleads(c)) && !keep(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Appends to a file's name, before its extension.
pub fn with_name_end(path: &Path, end: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(end);
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usage<T: std::fmt::Debug>(result: Result<T, CliError>) -> String {
        let error = result.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn nothing_reaches_a_terminal_that_it_would_obey() {
        let said = printable("a\u{1b}[2J\u{7}\r\u{9b}\u{202e}ç →\nb\n");
        assert_eq!(said, "a\\u{1b}[2J\\u{7}\\r\\u{9b}\\u{202e}ç →\nb\n");
        assert_eq!(printable_line("a\nb"), "a\\nb");
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("--eye=-1,2e-7,3"), "--eye=-1,2e-7,3");
        assert_eq!(quoted("a b'c$"), "'a b'\\''c$'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn outputs_keep_apart() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let file = |name: &str| Sink::File(at(name));
        let scene = at("scene.json");
        std::fs::write(&scene, "{}").unwrap();
        let check =
            |files: &[PathBuf], sinks: &[Sink]| check_destinations(&[&scene], files, sinks.iter());

        check(&[at("x.png")], &[file("a"), file("b")]).unwrap();
        check(&[], &[Sink::Stdout, file("a")]).unwrap();
        let said = usage(check(&[at("x.png")], &[file("./x.png")]));
        assert!(said.contains("two outputs"), "{said}");
        // Two paths of the same file.
        let said = usage(check(&[], &[file("scene.json")]));
        assert!(said.contains("is the input"), "{said}");
        let said = usage(check(&[], &[Sink::Stdout, Sink::Stdout]));
        assert!(said.contains("--stats and --json"), "{said}");
        let error = check(&[at("no/x.png")], &[]).unwrap_err();
        assert_eq!(error.exit_code(), 4);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    }
}
