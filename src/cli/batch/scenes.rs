//! The scenes of a job: paths, globs and lists of them, in a fixed order.

use super::ranges::MOST_NUMBERS;
use crate::error::CliError;
use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

/// Lists the scene files that a job names, relative to the folder of the job file: globs in the
/// order of their names, lists line by line. A file that is named twice counts once. A path
/// without stars need not exist: its tasks fail alone.
pub fn found(names: &[String], job: &Path) -> Result<Vec<PathBuf>, CliError> {
    let folder = job.parent().unwrap_or(Path::new(""));
    let failed = |why: String| CliError::Input(format!("{}: scene: {why}", job.display()));
    let mut found = Vec::new();
    for name in names {
        match name.strip_prefix('@') {
            Some(list) => {
                let path = folder.join(list);
                let text = std::fs::read_to_string(&path).map_err(|e| {
                    failed(format!("the list {} cannot be read: {e}", path.display()))
                })?;
                // Names in a list count from the list's own folder.
                let beside = Path::new(list).parent().unwrap_or(Path::new(""));
                let lines = text.lines().map(str::trim);
                for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
                    let name = beside.join(line);
                    add(&name.to_string_lossy(), folder, &mut found).map_err(&failed)?;
                }
            }
            None => add(name, folder, &mut found).map_err(&failed)?,
        }
        if found.len() as u64 > MOST_NUMBERS {
            return Err(failed(format!("there are more than {MOST_NUMBERS} scenes")));
        }
    }
    let mut seen = HashSet::new();
    found.retain(|path| seen.insert(path.clone()));
    match found.is_empty() {
        true => Err(failed(
            "there is none; name files or globs, such as \"parts/*.glb\"".into(),
        )),
        false => Ok(found),
    }
}

/// Adds the files that a path or glob names.
fn add(name: &str, folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let is_glob = name.contains(['*', '?', '[']);
    if name.is_empty() {
        return Err("a name is empty".into());
    }
    if !is_glob || folder.join(name).is_file() {
        let is_step = |part: &Component| !matches!(part, Component::CurDir);
        found.push(Path::new(name).components().filter(is_step).collect());
        return Ok(());
    }
    // Stars in the folder's own name are none of the pattern's.
    let root = glob::Pattern::escape(&folder.to_string_lossy());
    let pattern = Path::new(&root).join(name);
    let paths = glob::glob(&pattern.to_string_lossy())
        .map_err(|e| format!("the glob '{name}' is malformed: {}", e.msg))?;
    let before = found.len();
    for path in paths {
        let path =
            path.map_err(|e| format!("{}: cannot be read: {}", e.path().display(), e.error()))?;
        if path.is_file() {
            found.push(path.strip_prefix(folder).unwrap_or(&path).into());
        }
    }
    match found.len() == before {
        true => Err(format!(
            "the glob '{name}' matches no file; globs count from the folder of the job file"
        )),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("parts/deep")).unwrap();
        for name in ["parts/b.stl", "parts/a.stl", "parts/deep/c.stl", "x[1].stl"] {
            std::fs::write(at(name), "").unwrap();
        }
        std::fs::write(at("parts/list"), "# first\n\n a.stl \ndeep/*\n").unwrap();
        let names = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|n| n.to_string()).collect();
            let found = found(&names, &at("job.toml"));
            found.map(|all| {
                let all: Vec<_> = all.iter().map(|p| p.to_str().unwrap().to_owned()).collect();
                all.join(" ")
            })
        };
        let is = |asked: &[&str], expected: &str| assert_eq!(names(asked).unwrap(), expected);
        is(&["parts/*.stl"], "parts/a.stl parts/b.stl");
        is(&["parts/b.stl", "parts/*.stl"], "parts/b.stl parts/a.stl");
        is(
            &["**/*.stl"],
            "parts/a.stl parts/b.stl parts/deep/c.stl x[1].stl",
        );
        is(&["@parts/list"], "parts/a.stl parts/deep/c.stl");
        is(&["x[1].stl", "gone.stl"], "x[1].stl gone.stl");
        is(&["./gone.stl", "gone.stl"], "gone.stl");
        let said = |asked: &[&str]| {
            let error = names(asked).unwrap_err();
            assert_eq!(error.exit_code(), 3);
            error.to_string()
        };
        assert!(said(&["*.obj"]).contains("'*.obj' matches no file"));
        assert!(said(&["a/**b"]).contains("malformed"));
        assert!(said(&["@none"]).contains("the list"));
        assert!(said(&[]).contains("there is none"));
    }
}
