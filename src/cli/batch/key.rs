//! Keys of tasks: what a picture depends on, and nothing else.
//!
//! The settings of a task are its options, the name of its scene and that of its picture. Its key
//! adds the bytes of every file that was read for it, by paths from the folder of the job file, so
//! that machines with the files elsewhere have the same keys. Threads, lanes, structures and hosts
//! change no bit and are in no key.

use super::tasks::{Task, Tasks};
use lanecast_model::plan::BITS;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::{Error, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes that are read at a time.
const BLOCK: usize = 1 << 16;

/// A file that was read, from the folder of the job file, and the hash of its bytes; none if it
/// could not be read.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Input {
    pub path: PathBuf,
    pub hash: Option<String>,
}

/// Returns the hash of what a task is asked for.
pub fn settings(tasks: &Tasks, task: &Task) -> String {
    let mut hash = Sha256::new();
    hash.update(format!("lanecast {} {BITS}\n", env!("CARGO_PKG_VERSION")));
    let mut field = |bytes: &[u8]| {
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    field(tasks.scene(task).as_os_str().as_encoded_bytes());
    field(task.output.as_os_str().as_encoded_bytes());
    tasks
        .options(task)
        .iter()
        .for_each(|option| field(option.as_bytes()));
    if let Some(text) = tasks.of_dataset(task) {
        field(text.as_bytes());
    }
    hex(hash)
}

/// Returns the hash of what the picture of a task is asked for, which is joined from tiles.
pub fn settings_of_picture(tasks: &Tasks, task: &Task) -> String {
    let mut hash = Sha256::new();
    hash.update("joined\n");
    hash.update(settings(tasks, task));
    hex(hash)
}

/// Returns the key of settings and inputs.
pub fn key(settings: &str, inputs: &[Input]) -> String {
    let mut hash = Sha256::new();
    hash.update(settings);
    for input in inputs {
        let path = input.path.as_os_str().as_encoded_bytes();
        hash.update((path.len() as u64).to_le_bytes());
        hash.update(path);
        hash.update(input.hash.as_deref().unwrap_or("absent"));
    }
    hex(hash)
}

/// Hashes of files, each read once in a run.
pub struct Hashes {
    /// The folder of the job file, with links followed.
    folder: PathBuf,
    known: Mutex<HashMap<PathBuf, Option<String>>>,
}

impl Hashes {
    pub fn new(job: &Path) -> Hashes {
        let folder = job.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        Hashes {
            folder: folder.canonicalize().unwrap_or(folder.into()),
            known: Mutex::default(),
        }
    }

    /// Returns the inputs of files that were read, in the order of their paths.
    pub fn inputs(&self, files: &BTreeSet<PathBuf>) -> Vec<Input> {
        let files = files.iter().map(|file| {
            let real = real(file);
            self.again(&relative(&real, &self.folder))
        });
        let files: BTreeSet<Input> = files.collect();
        files.into_iter().collect()
    }

    /// Returns the hash of a file, if it can be read.
    pub fn of_file(&self, file: &Path) -> Option<String> {
        self.again(&relative(&real(file), &self.folder)).hash
    }

    /// Returns what is at the place of an input now.
    pub fn again(&self, path: &Path) -> Input {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let hash = match known.get(path) {
            Some(hash) => hash.clone(),
            None => {
                let hash = file_hash(&self.folder.join(path)).ok();
                known.insert(path.into(), hash.clone());
                hash
            }
        };
        Input {
            path: path.into(),
            hash,
        }
    }
}

/// Returns a file with links followed; of one that is not there the place where it would be.
fn real(file: &Path) -> PathBuf {
    let beside = || {
        let folder = file.parent()?.canonicalize().ok()?;
        Some(folder.join(file.file_name()?))
    };
    let real = file.canonicalize().ok().or_else(beside);
    real.unwrap_or_else(|| std::path::absolute(file).unwrap_or(file.into()))
}

/// Returns the SHA-256 of a file's bytes.
pub fn file_hash(path: &Path) -> Result<String, Error> {
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; BLOCK];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hex(hash)),
            count => hash.update(&block[..count]),
        }
    }
}

/// Returns the way from a folder to a file; both begin at the root.
pub fn relative(file: &Path, folder: &Path) -> PathBuf {
    let (mut file_parts, mut folder_parts) = (file.components(), folder.components());
    let mut rest = file_parts.clone();
    let mut up = folder_parts.clone();
    while let (Some(a), Some(b)) = (file_parts.next(), folder_parts.next()) {
        if a != b {
            break;
        }
        (rest, up) = (file_parts.clone(), folder_parts.clone());
    }
    let up = up.map(|_| Component::ParentDir);
    up.chain(rest).collect()
}

fn hex(hash: Sha256) -> String {
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_lead_from_folders_to_files() {
        let way = |file: &str, folder: &str| relative(file.as_ref(), folder.as_ref());
        assert_eq!(way("/a/b/c.glb", "/a/b"), Path::new("c.glb"));
        assert_eq!(way("/a/x/c.glb", "/a/b"), Path::new("../x/c.glb"));
        assert_eq!(way("/c.glb", "/a/b"), Path::new("../../c.glb"));
        assert_eq!(way("/a/b", "/a/b/c"), Path::new(".."));
    }

    #[test]
    fn bytes_are_hashed_as_sha256sum_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        std::fs::write(&path, "abc").unwrap();
        let known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(file_hash(&path).unwrap(), known);
        assert!(file_hash(folder.path()).is_err());
    }

    #[test]
    fn a_key_knows_names_and_bytes() {
        let input = |path: &str, hash: &str| Input {
            path: path.into(),
            hash: Some(hash.into()),
        };
        let one = key("s", &[input("a", "1"), input("b", "2")]);
        assert_eq!(one, key("s", &[input("a", "1"), input("b", "2")]));
        // Two textures that change places are others.
        assert_ne!(one, key("s", &[input("a", "2"), input("b", "1")]));
        assert_ne!(one, key("t", &[input("a", "1"), input("b", "2")]));
    }
}
