//! Atomic output: files appear complete or not at all.
//!
//! [`Outputs`] writes each file under a temporary name in its target folder;
//! [`Outputs::commit`] renames the files when all are complete. `Outputs` that are dropped
//! before leave nothing behind, and older files of the same names stay as they were. A
//! write through a symbolic link replaces the link's target. A device or pipe
//! (`/dev/stdout`) cannot be renamed over, and what it received cannot be taken back, so
//! devices are written before any file gets its name ([`Outputs::send`]).
//!
//! [`discard_unfinished`] serves a process that must end at once while another thread may
//! be writing.

use crate::SaveError;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{Error, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempPath;

/// The output files of a run, which get their names together.
#[derive(Debug, Default)]
pub struct Outputs {
    files: Vec<Pending>,
    /// Devices and pipes, and the bytes for each.
    direct: Vec<(PathBuf, Vec<u8>)>,
}

/// A complete file under a temporary name.
#[derive(Debug)]
struct Pending {
    temporary: Temporary,
    target: PathBuf,
    /// Whether the target existed before, and must not be removed if the commit fails.
    existed: bool,
}

impl Outputs {
    /// Writes `bytes` under a temporary name, to become the file `path` at the commit; keeps
    /// them in memory if `path` is a device or pipe.
    ///
    /// Fails if the folder does not exist, the target is a folder or read-only, or writing
    /// fails.
    pub fn add(&mut self, path: &Path, bytes: Vec<u8>) -> Result<(), SaveError> {
        match destination(path)? {
            Destination::Device => self.direct.push((path.into(), bytes)),
            Destination::File {
                target,
                permissions,
            } => self.files.push(Pending {
                existed: permissions.is_some(),
                temporary: Temporary::write(&target, &bytes, permissions)
                    .map_err(|source| failed(path, source))?,
                target,
            }),
        }
        Ok(())
    }

    /// Writes the bytes for devices and pipes. The call blocks while the reader of a pipe
    /// does not read.
    pub fn send(&mut self) -> Result<(), SaveError> {
        for (target, bytes) in self.direct.drain(..) {
            write_device(&target, &bytes).map_err(|source| failed(&target, source))?;
        }
        Ok(())
    }

    /// Writes what [`Outputs::send`] has not written yet, then renames all files to their
    /// targets. If a rename fails, new files that were already renamed are removed again;
    /// targets that existed before keep their new content.
    pub fn commit(mut self) -> Result<(), SaveError> {
        self.send()?;
        let mut created = Vec::new();
        for file in self.files {
            if let Err(error) = file.temporary.rename(&file.target) {
                for path in created {
                    let _ = fs::remove_file(path);
                }
                return Err(error);
            }
            if !file.existed {
                created.push(file.target);
            }
        }
        Ok(())
    }
}

/// Checks that a file of this name can be written, before long work is done for it. The
/// answer may be out of date when the file is written.
pub fn check_writable(path: &Path) -> Result<(), SaveError> {
    match destination(path)? {
        Destination::Device => Ok(()),
        Destination::File { target, .. } => Temporary::write(&target, &[], None)
            .map(drop)
            .map_err(|source| failed(path, source)),
    }
}

/// Removes all temporary files of this process, and blocks the creation of others while the
/// returned guard lives. For a process that is about to exit.
#[must_use]
pub fn discard_unfinished() -> impl Drop {
    let unfinished = unfinished();
    for path in unfinished.iter() {
        let _ = fs::remove_file(path);
    }
    unfinished
}

/// The temporary files of this process that exist now.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Locks the list of temporary files, also after a panic of another thread.
fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What an output path leads to.
enum Destination {
    /// The file to create or replace, links followed, and its permissions if it exists.
    File {
        target: PathBuf,
        permissions: Option<Permissions>,
    },
    /// A device or pipe.
    Device,
}

/// Finds out what an output path leads to; refuses folders, read-only files and paths in
/// folders that do not exist.
fn destination(path: &Path) -> Result<Destination, SaveError> {
    let refuse = |why: &str| Err(failed(path, Error::new(ErrorKind::InvalidInput, why)));
    if path.file_name().is_none() {
        return refuse("it is not a file name");
    }
    let about: Metadata = match fs::metadata(path) {
        Ok(about) => about,
        Err(e) if e.kind() == ErrorKind::NotFound => {
            let folder = folder_of(path);
            return match fs::metadata(folder) {
                Ok(f) if f.is_dir() => Ok(Destination::File {
                    target: path.into(),
                    permissions: None,
                }),
                Ok(_) => refuse(&format!("'{}' is not a folder", folder.display())),
                Err(e) if e.kind() == ErrorKind::NotFound => refuse(&format!(
                    "the folder '{}' does not exist; create it first",
                    folder.display()
                )),
                Err(e) => Err(failed(path, e)),
            };
        }
        Err(e) => return Err(failed(path, e)),
    };
    if about.is_dir() {
        return refuse("a folder of that name exists");
    }
    if !about.is_file() {
        return Ok(Destination::Device);
    }
    if about.permissions().readonly() {
        return refuse("a read-only file of that name exists");
    }
    Ok(Destination::File {
        target: path.canonicalize().map_err(|e| failed(path, e))?,
        permissions: Some(about.permissions()),
    })
}

/// The folder of a path; the current one for a bare file name.
fn folder_of(path: &Path) -> &Path {
    path.parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// A file under a temporary name, which is removed on drop.
#[derive(Debug)]
struct Temporary {
    /// `None` after the rename.
    path: Option<TempPath>,
}

impl Temporary {
    /// Writes a temporary file in the target's folder, with the given permissions or those
    /// of a new file.
    fn write(
        target: &Path,
        bytes: &[u8],
        permissions: Option<Permissions>,
    ) -> Result<Temporary, Error> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".lanecast-").suffix(".tmp");
        let (mut file, path) = {
            // The lock is held until the file is listed, so that no file escapes
            // `discard_unfinished`.
            let mut unfinished = unfinished();
            let (file, path) = builder.make_in(folder_of(target), create_new)?.into_parts();
            unfinished.push(path.to_path_buf());
            (file, path)
        };
        let temporary = Temporary { path: Some(path) };
        file.write_all(bytes)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok(temporary)
    }

    /// Renames the file to `target`.
    fn rename(mut self, target: &Path) -> Result<(), SaveError> {
        let mut unfinished = unfinished();
        let Some(path) = self.path.take() else {
            return Ok(());
        };
        unfinished.retain(|other| **other != *path);
        path.persist(target).map_err(|e| failed(target, e.error))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = self.path.take() {
            let mut unfinished = unfinished();
            unfinished.retain(|other| **other != *path);
            drop(path);
        }
    }
}

/// Creates a file with the permissions that a file written without a temporary one would
/// have (0666 less the umask). Errors are the system's own, since those of `tempfile` name
/// the temporary file, which means nothing to the user.
fn create_new(path: &Path) -> Result<File, Error> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o666);
    options.open(path)
}

/// Writes to a device or pipe that exists.
fn write_device(target: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = OpenOptions::new().write(true).open(target)?;
    file.write_all(bytes)?;
    file.flush()
}

fn failed(path: &Path, source: Error) -> SaveError {
    SaveError::Write {
        path: path.into(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn nothing_before_the_commit_and_everything_after() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        fs::write(&b, "old").unwrap();
        let mut outputs = Outputs::default();
        outputs.add(&a, b"one".into()).unwrap();
        outputs.add(&b, b"two".into()).unwrap();
        assert!(!a.exists());
        assert_eq!(fs::read(&b).unwrap(), b"old");
        outputs.commit().unwrap();
        assert_eq!(fs::read(&a).unwrap(), b"one");
        assert_eq!(fs::read(&b).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[test]
    fn dropped_outputs_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let old = folder.path().join("old");
        fs::write(&old, "as it was").unwrap();
        let mut outputs = Outputs::default();
        outputs.add(&old, b"new".into()).unwrap();
        outputs
            .add(&folder.path().join("new"), b"new".into())
            .unwrap();
        assert_eq!(names(folder.path()).len(), 3);
        drop(outputs);
        assert_eq!(names(folder.path()), ["old"]);
        assert_eq!(fs::read(&old).unwrap(), b"as it was");
    }

    #[test]
    fn a_failed_commit_takes_back_what_it_placed() {
        let folder = tempfile::tempdir().unwrap();
        let (first, second) = (folder.path().join("first"), folder.path().join("second"));
        let mut outputs = Outputs::default();
        outputs.add(&first, b"1".into()).unwrap();
        outputs.add(&second, b"2".into()).unwrap();
        // A folder has taken the name since it was checked.
        fs::create_dir(&second).unwrap();
        fs::write(second.join("inside"), "").unwrap();
        assert!(outputs.commit().is_err());
        assert_eq!(names(folder.path()), ["second"]);
    }

    #[test]
    fn refusals_say_why() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "").unwrap();
        fs::write(at("locked"), "").unwrap();
        let mut locked = fs::metadata(at("locked")).unwrap().permissions();
        locked.set_readonly(true);
        fs::set_permissions(at("locked"), locked).unwrap();
        for (path, why) in [
            (at("missing").join("x.png"), "does not exist; create it"),
            (at("file").join("x.png"), ""),
            (folder.path().into(), "a folder of that name"),
            (at("locked"), "read-only"),
            (PathBuf::new(), "not a file name"),
            (PathBuf::from(".."), "not a file name"),
        ] {
            let said = check_writable(&path).unwrap_err().to_string();
            assert!(said.contains(why), "{said}");
            let added = Outputs::default().add(&path, vec![1]).unwrap_err();
            assert_eq!(added.to_string(), said);
        }
        assert_eq!(names(folder.path()), ["file", "locked"]);
    }

    #[test]
    fn checking_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        check_writable(&folder.path().join("x")).unwrap();
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn the_list_of_unfinished_files_is_true() {
        // A call of `discard_unfinished` would disturb other tests of this process.
        let folder = tempfile::tempdir().unwrap();
        let mut outputs = Outputs::default();
        outputs.add(&folder.path().join("x"), vec![0; 9]).unwrap();
        let here = |list: &[PathBuf]| list.iter().filter(|p| p.starts_with(&folder)).count();
        assert_eq!(here(&unfinished()), 1);
        outputs.commit().unwrap();
        assert_eq!(here(&unfinished()), 0);
        check_writable(&folder.path().join("y")).unwrap();
        assert_eq!(here(&unfinished()), 0);
    }

    #[cfg(unix)]
    #[test]
    fn links_permissions_and_devices() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        symlink(&file, &link).unwrap();
        let mut outputs = Outputs::default();
        outputs.add(&link, b"new".into()).unwrap();
        outputs.add(Path::new("/dev/null"), vec![0; 99]).unwrap();
        outputs.commit().unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(
            fs::metadata(&file).unwrap().permissions().mode() & 0o777,
            0o640
        );
        assert!(!fs::metadata("/dev/null").unwrap().is_file());

        let full = Path::new("/dev/full");
        if full.exists() {
            let mut outputs = Outputs::default();
            outputs.add(&folder.path().join("with"), vec![1]).unwrap();
            outputs.add(full, vec![0; 99]).unwrap();
            assert!(outputs.commit().is_err());
            assert_eq!(names(folder.path()), ["file", "link"]);
        }
    }
}
