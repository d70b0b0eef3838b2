//! Included files: what others define is defined here, too.
//!
//! Each file is read once, however many others include it. Definitions come in the order of the
//! files' lists, those of an included file before those of the file that names it. Names, of
//! files and of images alike, are relative to the file that they stand in.

use super::schema;
use super::source_spans::At;
use super::tree::{Source, quoted};
use super::{Syntax, parse};
use crate::{Folder, ImportReport, LoadError, LoadOptions};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// A file of this format, as it was read.
pub(super) struct Unit {
    pub path: PathBuf,
    pub text: String,
    pub file: schema::File,
}

impl Unit {
    /// Returns the text, for messages.
    pub(super) fn source(&self) -> Source<'_> {
        Source {
            path: &self.path,
            text: &self.text,
        }
    }
}

/// A file whose includes are followed.
struct Open {
    unit: Unit,
    /// Its path without links.
    real: PathBuf,
    next: usize,
}

/// Reads a file and all that it includes, itself last. Fails if one cannot be read or parsed, or
/// includes itself.
pub(super) fn read(
    path: &Path,
    syntax: Syntax,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<Vec<Unit>, LoadError> {
    let mut units = Vec::new();
    let real = path.canonicalize().unwrap_or_else(|_| path.into());
    let mut known = HashSet::from([real.clone()]);
    // A list in place of recursion: a chain of files may be long.
    let mut open = vec![Open {
        unit: unit(path, syntax, options)?,
        real,
        next: 0,
    }];
    while let Some(last) = open.last_mut() {
        let names = last.unit.file.include.as_ref().map(|all| &all.value);
        let Some(name) = names.and_then(|all| all.get(last.next)) else {
            units.extend(open.pop().map(|done| done.unit));
            continue;
        };
        let (real, syntax) = included(&last.unit.source(), name, options)?;
        let at = name.at;
        last.next += 1;
        if let Some(first) = open.iter().position(|file| file.real == real) {
            let shown = |file: &Open| file.unit.path.display().to_string();
            let chain: Vec<String> = open[first..].iter().map(shown).collect();
            let message = format!(
                "files include each other in a circle: {} → {}; leave one of the includes out",
                chain.join(" → "),
                open[first].unit.path.display()
            );
            return Err(open[open.len() - 1].unit.source().error(at, message));
        }
        if !known.insert(real.clone()) {
            continue;
        }
        let unit = unit(&real, syntax, options)?;
        count_left_out(&unit.file, report);
        open.push(Open {
            unit,
            real,
            next: 0,
        });
    }
    Ok(units)
}

/// Returns the path of an included file and its syntax.
fn included(
    source: &Source,
    name: &At<String>,
    options: &LoadOptions,
) -> Result<(PathBuf, Syntax), LoadError> {
    let refuse = |why: String| {
        let message = format!("the included file {} {why}", quoted(&name.value));
        source.error(name.at, message)
    };
    let folder = Folder::new(source.path, options);
    let path = folder.resolve(&name.value).map_err(|e| match e {
        LoadError::Read { source: why, .. } => refuse(format!("cannot be read: {why}")),
        other => other,
    })?;
    if path.is_dir() {
        return Err(refuse("is a folder; name a file in it".into()));
    }
    match &*crate::extension(&path) {
        "toml" => Ok((path, Syntax::Toml)),
        "json" => Ok((path, Syntax::Json)),
        _ => Err(refuse(
            "is no .toml or .json; place files of other formats by scene = \"FILE\" on an instance"
                .into(),
        )),
    }
}

fn unit(path: &Path, syntax: Syntax, options: &LoadOptions) -> Result<Unit, LoadError> {
    let bytes = options.read(path)?;
    let (text, file) = parse(path, &bytes, syntax)?;
    Ok(Unit {
        path: path.into(),
        text,
        file,
    })
}

/// Counts what an included file has for its own picture alone.
fn count_left_out(file: &schema::File, report: &mut ImportReport) {
    let rows = |list: Option<usize>| list.unwrap_or_default();
    let instances = rows(file.instance.as_ref().map(Vec::len));
    report.add_many("instance of an included file", instances);
    let lights = rows(file.light.as_ref().map(Vec::len));
    report.add_many("light of an included file", lights);
    let cameras = rows(file.camera.as_ref().map(|all| all.0.0.len()));
    report.add_many("camera of an included file", cameras);
    let shutters = usize::from(file.shutter.is_some());
    report.add_many("shutter of an included file", shutters);
    let backgrounds = usize::from(file.background.is_some());
    report.add_many("background of an included file", backgrounds);
    let lengths = usize::from(file.seconds.is_some());
    report.add_many("seconds of an included file", lengths);
}

/// Where names are defined, by kind: the number of the file, and the offset in it.
#[derive(Default)]
pub(super) struct Defined {
    at: HashMap<(&'static str, String), (usize, usize)>,
}

impl Defined {
    /// Notes the definition of a name in file `k`; fails if another file has it, too.
    pub(super) fn check(
        &mut self,
        kind: &'static str,
        (units, k): (&[Unit], usize),
        name: &At<String>,
    ) -> Result<(), LoadError> {
        if units.len() == 1 {
            return Ok(());
        }
        let known = self.at.insert((kind, name.value.clone()), (k, name.at));
        match known {
            None => Ok(()),
            Some((other, at)) => {
                let source = units[k].source();
                let (line, column) = units[other].source().place(at);
                let other = format!("{}:{line}:{column}", units[other].path.display());
                let message = format!(
                    "the {kind} {} is defined here and at {other}; give one of them another name",
                    quoted(&name.value)
                );
                Err(source.error(name.at, message))
            }
        }
    }
}
