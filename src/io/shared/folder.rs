//! Access to the files that a scene file names.
//!
//! A name is relative to the scene file's folder. After symbolic links are followed the
//! file must still lie in that folder, unless the user allows files outside.

use crate::{LoadError, LoadOptions};
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The files that a scene was read from, beside its own: a list that clones share. A name that led
/// to no file is in it, too, for a file that comes there makes another scene.
#[derive(Clone, Debug, Default)]
pub struct ReadLog(Arc<Mutex<BTreeSet<PathBuf>>>);

impl ReadLog {
    /// Returns the files so far.
    pub fn files(&self) -> BTreeSet<PathBuf> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    pub(crate) fn add(&self, path: &Path) {
        let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.insert(path.into());
    }
}

/// The folder of a scene file, and which files a scene in it may name.
#[derive(Clone, Debug)]
pub struct Folder {
    /// The scene file, for messages.
    scene: PathBuf,
    root: PathBuf,
    allow_outside: bool,
    /// The outputs that exist already, with links followed.
    outputs: Vec<PathBuf>,
    reads: ReadLog,
}

impl Folder {
    /// Takes the folder of the scene file `scene`; the current one for a bare file name.
    pub fn new(scene: &Path, options: &LoadOptions) -> Folder {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty());
        Folder {
            scene: scene.into(),
            root: parent.unwrap_or(Path::new(".")).into(),
            allow_outside: options.allow_outside,
            reads: options.reads.clone(),
            outputs: options
                .outputs
                .iter()
                .filter_map(|output| output.canonicalize().ok())
                .collect(),
        }
    }

    /// Returns the path of the file that the scene calls `named`, with links followed.
    ///
    /// Fails if the file does not exist ([`LoadError::Read`]), lies outside the folder
    /// ([`LoadError::Outside`]) or is an output of the run ([`LoadError::Output`]).
    pub fn resolve(&self, named: &str) -> Result<PathBuf, LoadError> {
        let outside = || LoadError::Outside {
            path: self.scene.clone(),
            named: named.into(),
        };
        let path = self.root.join(named);
        // The name is checked as text first: a file that does not exist cannot be
        // canonicalised, and the error must not tell whether a file exists outside.
        let leaves = Path::new(named).is_absolute()
            || Path::new(named)
                .components()
                .try_fold(0_i32, |depth, c| match c {
                    std::path::Component::ParentDir if depth == 0 => None,
                    std::path::Component::ParentDir => Some(depth - 1),
                    std::path::Component::Normal(_) => Some(depth + 1),
                    _ => Some(depth),
                })
                .is_none();
        if leaves && !self.allow_outside {
            return Err(outside());
        }
        let real = |p: &Path| {
            p.canonicalize().map_err(|source| LoadError::Read {
                path: p.into(),
                source,
            })
        };
        let found = real(&path);
        self.reads.add(found.as_deref().unwrap_or(&path));
        let found = found?;
        if !self.allow_outside && !found.starts_with(real(&self.root)?) {
            return Err(outside());
        }
        // An output may be a folder, all of whose files are.
        if self.outputs.iter().any(|output| found.starts_with(output)) {
            return Err(LoadError::Output {
                path: self.scene.clone(),
                named: named.into(),
            });
        }
        Ok(found)
    }

    /// Returns the path of a file whose name differs from `named` in the case of letters
    /// only, the first one by its name. `None` if there is none, or [`Folder::resolve`]
    /// refuses it.
    pub fn resolve_any_case(&self, named: &str) -> Option<PathBuf> {
        let mut found = PathBuf::new();
        for part in Path::new(named).components() {
            let part = part.as_os_str();
            if self.root.join(&found).join(part).exists() {
                found.push(part);
                continue;
            }
            let wanted = part.to_string_lossy().to_lowercase();
            let entries = std::fs::read_dir(self.root.join(&found)).ok()?;
            let names = entries.filter_map(|entry| Some(entry.ok()?.file_name()));
            found.push(
                names
                    .filter(|name| name.to_string_lossy().to_lowercase() == wanted)
                    .min()?,
            );
        }
        self.resolve(found.to_str()?).ok()
    }

    /// Reads the file that the scene calls `named`; fails as [`Folder::resolve`] does.
    pub fn read(&self, named: &str) -> Result<Vec<u8>, LoadError> {
        let path = self.resolve(named)?;
        read_file(&path)
    }
}

/// Reads all bytes of a regular file. Refuses folders, pipes and devices, some of which
/// never end.
pub fn read_file(path: &Path) -> Result<Vec<u8>, LoadError> {
    open_file(path)?;
    std::fs::read(path).map_err(|source| LoadError::Read {
        path: path.into(),
        source,
    })
}

/// Opens a regular file, and returns its number of bytes beside it. Fails as [`read_file`] does.
pub fn open_file(path: &Path) -> Result<(File, u64), LoadError> {
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    // The kind is checked before the file is opened, since opening a pipe waits for its writer.
    let about = std::fs::metadata(path).map_err(failed)?;
    if !about.is_file() {
        return Err(failed(std::io::Error::new(
            std::io::ErrorKind::InvalidInput,
            "it is not a regular file",
        )));
    }
    Ok((File::open(path).map_err(failed)?, about.len()))
}
