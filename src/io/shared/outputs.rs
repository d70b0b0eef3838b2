//! Atomic output: files appear complete or not at all.
//!
//! [`Outputs`] writes each file under a temporary name in its target folder;
//! [`Outputs::commit`] renames the files when all are complete. `Outputs` that are dropped
//! before leave nothing behind, and older files of the same names stay as they were. A
//! write through a symbolic link replaces the link's target, or creates it. Files reach the
//! disk before they get their names, and the names before the commit returns. What a killed
//! process left in a folder goes with the next commit there (`leftovers.rs`). A device or pipe
//! (`/dev/stdout`) cannot be renamed over, and what it received cannot be taken back, so
//! devices are written before any file gets its name ([`Outputs::send`]).
//!
//! [`discard_unfinished`] serves a process that must end at once while another thread may
//! be writing.

use super::leftovers::{prefix, sweep};
use crate::SaveError;
use std::collections::BTreeSet;
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
        self.add_by(path, |file| file.write_all(&bytes))
    }

    /// Does as [`Outputs::add`] does with what `write` writes.
    pub fn add_by(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), Error>,
    ) -> Result<(), SaveError> {
        let failed = |source| failed(path, source);
        match destination(path)? {
            Destination::Device => {
                let mut bytes = Vec::new();
                write(&mut bytes).map_err(failed)?;
                self.direct.push((path.into(), bytes));
            }
            Destination::File {
                target,
                permissions,
            } => self.files.push(Pending {
                existed: permissions.is_some(),
                temporary: Temporary::write(&target, permissions, write).map_err(failed)?,
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

    /// Writes what [`Outputs::send`] has not written yet, flushes all files to the disk, and
    /// renames them to their targets. If a rename fails, new files that were already renamed are removed again;
    /// targets that existed before keep their new content.
    pub fn commit(mut self) -> Result<(), SaveError> {
        self.send()?;
        self.flush()?;
        let folders: BTreeSet<PathBuf> = self
            .files
            .iter()
            .map(|file| folder_of(&file.target).into())
            .collect();
        self.place()?;
        for folder in &folders {
            // Not every file system can flush a folder, and the names are there.
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
            sweep(folder);
        }
        Ok(())
    }

    /// Renames all files to their targets as [`Outputs::commit`] does, and waits for no disk: after
    /// a power failure they may be without their bytes. For many small outputs of a process that
    /// can make each again.
    pub fn place(mut self) -> Result<(), SaveError> {
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

    /// Flushes all files to the disk: each by itself, or whole file systems where files are
    /// many, since each flush waits for the disk.
    fn flush(&self) -> Result<(), SaveError> {
        #[cfg(target_os = "linux")]
        if self.files.len() > FLUSHED_EACH {
            use std::os::unix::fs::MetadataExt;
            let mut devices = BTreeSet::new();
            for Pending {
                temporary, target, ..
            } in &self.files
            {
                let device = temporary.opened().and_then(|file| {
                    let device = file.metadata()?.dev();
                    if devices.insert(device) {
                        rustix::fs::syncfs(&file)?;
                    }
                    Ok(())
                });
                device.map_err(|source| failed(target, source))?;
            }
            return Ok(());
        }
        for Pending {
            temporary, target, ..
        } in &self.files
        {
            let flushed = temporary.opened().and_then(|file| file.sync_all());
            flushed.map_err(|source| failed(target, source))?;
        }
        Ok(())
    }
}

/// The greatest number of files that are flushed one by one.
#[cfg(target_os = "linux")]
const FLUSHED_EACH: usize = 16;

/// Checks that a file of this name can be written, before long work is done for it. The
/// answer may be out of date when the file is written.
pub fn check_writable(path: &Path) -> Result<(), SaveError> {
    match destination(path)? {
        Destination::Device => Ok(()),
        Destination::File { target, .. } => Temporary::write(&target, None, |_| Ok(()))
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
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Locks the list of temporary files, also after a panic of another thread.
fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
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
    if path.as_os_str().as_encoded_bytes().last() == Some(&b'/') {
        return refuse("it ends in '/', as the name of a folder; name a file");
    }
    let path = &followed(path).map_err(|e| failed(path, e))?;
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

/// Follows a symbolic link whose end does not exist; returns any other path as it is.
fn followed(path: &Path) -> Result<PathBuf, Error> {
    /// As many as Linux follows.
    const LINKS: usize = 40;
    let mut end = path.to_path_buf();
    for _ in 0..LINKS {
        let is_link = |about: Metadata| about.is_symlink();
        if end.exists() || !fs::symlink_metadata(&end).is_ok_and(is_link) {
            return Ok(end);
        }
        end = folder_of(&end).join(fs::read_link(&end)?);
    }
    Err(Error::new(
        ErrorKind::InvalidInput,
        "it is a symbolic link that leads to itself, or through too many others",
    ))
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
    /// Writes a temporary file in the target's folder by `write`, with the given permissions or those
    /// of a new file.
    fn write(
        target: &Path,
        permissions: Option<Permissions>,
        write: impl FnOnce(&mut dyn Write) -> Result<(), Error>,
    ) -> Result<Temporary, Error> {
        let mut builder = tempfile::Builder::new();
        let prefix = prefix(std::process::id());
        builder.prefix(&prefix).suffix(".tmp");
        let (mut file, path) = {
            // The lock is held until the file is listed, so that no file escapes
            // `discard_unfinished`.
            let mut unfinished = unfinished();
            let (file, path) = builder.make_in(folder_of(target), create_new)?.into_parts();
            unfinished.insert(path.to_path_buf());
            (file, path)
        };
        let temporary = Temporary { path: Some(path) };
        write(&mut file)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        Ok(temporary)
    }

    /// Opens the file again, to flush it: open files are too few to keep one for each.
    fn opened(&self) -> Result<File, Error> {
        match &self.path {
            Some(path) => File::open(path),
            None => Err(ErrorKind::NotFound.into()),
        }
    }

    /// Renames the file to `target`.
    fn rename(mut self, target: &Path) -> Result<(), SaveError> {
        let mut unfinished = unfinished();
        let Some(path) = self.path.take() else {
            return Ok(());
        };
        unfinished.remove(&*path);
        path.persist(target).map_err(|e| failed(target, e.error))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = self.path.take() {
            let mut unfinished = unfinished();
            unfinished.remove(&*path);
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
mod tests;
