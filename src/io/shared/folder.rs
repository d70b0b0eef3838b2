//! The folder of a scene file: other files it names are read through here.
//!
//! A name is relative to the scene file. After symbolic links are followed it
//! must still lie in the scene's folder, unless the user has allowed more.

use crate::{LoadError, LoadOptions};
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub struct Folder {
    scene: PathBuf,
    root: PathBuf,
    allow_outside: bool,
    /// Those that exist, with links followed.
    outputs: Vec<PathBuf>,
}

impl Folder {
    pub fn of(scene: &Path, options: &LoadOptions) -> Folder {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty());
        Folder {
            scene: scene.into(),
            root: parent.unwrap_or(Path::new(".")).into(),
            allow_outside: options.allow_outside,
            outputs: options
                .outputs
                .iter()
                .filter_map(|output| output.canonicalize().ok())
                .collect(),
        }
    }

    /// The path of a file that the scene names, if it may be read.
    pub fn resolve(&self, named: &str) -> Result<PathBuf, LoadError> {
        let outside = || LoadError::Outside {
            path: self.scene.clone(),
            named: named.into(),
        };
        let path = self.root.join(named);
        // Textually first: a file that does not exist cannot be canonicalised,
        // and must not tell whether it exists elsewhere.
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
        let found = real(&path)?;
        if !self.allow_outside && !found.starts_with(real(&self.root)?) {
            return Err(outside());
        }
        if self.outputs.contains(&found) {
            return Err(LoadError::Output {
                path: self.scene.clone(),
                named: named.into(),
            });
        }
        Ok(found)
    }

    pub fn read(&self, named: &str) -> Result<Vec<u8>, LoadError> {
        let path = self.resolve(named)?;
        read_file(&path)
    }
}

/// The bytes of a regular file; anything else (a folder, a device that never
/// ends) is refused.
pub fn read_file(path: &Path) -> Result<Vec<u8>, LoadError> {
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    let about = std::fs::metadata(path).map_err(failed)?;
    if !about.is_file() {
        return Err(failed(std::io::Error::new(
            std::io::ErrorKind::InvalidInput,
            "it is not a regular file",
        )));
    }
    std::fs::read(path).map_err(failed)
}
