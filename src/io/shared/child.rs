//! Programs that run for this process, each in a folder of its own: neither outlives it.
//!
//! A child ends, and its folder goes, when it is dropped. A process that must end at once, with no
//! time for that, ends them by [`end_children`]. Only a process that is killed (SIGKILL) leaves its
//! children behind.

use std::collections::BTreeMap;
use std::io::Error;
use std::process::{Child as Process, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempDir;

/// The children that run now, by number, with their folders.
static RUNNING: Mutex<BTreeMap<u32, (Process, TempDir)>> = Mutex::new(BTreeMap::new());

/// Locks the list of children, also after a panic of another thread.
fn running() -> MutexGuard<'static, BTreeMap<u32, (Process, TempDir)>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A program that runs.
#[derive(Debug)]
pub struct Child {
    number: u32,
}

impl Child {
    /// Starts a program, which may use the folder.
    pub fn start(command: &mut Command, folder: TempDir) -> Result<Child, Error> {
        // Locked before it runs, so that no end of this process comes between.
        let mut running = running();
        let process = command.spawn()?;
        let number = process.id();
        running.insert(number, (process, folder));
        Ok(Child { number })
    }

    /// Returns how the program has ended, or `None` while it runs.
    pub fn ended(&self) -> Result<Option<ExitStatus>, Error> {
        match running().get_mut(&self.number) {
            Some((process, _)) => process.try_wait(),
            // Only `end_children` takes it away, and then this process ends.
            None => Err(Error::other("it was ended")),
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        if let Some((process, folder)) = running().remove(&self.number) {
            end(process, &folder);
        }
    }
}

/// Ends all children of this process and removes their folders, and lets none begin while the
/// returned guard lives. For a process that is about to exit.
#[must_use]
pub fn end_children() -> impl Drop {
    let mut running = running();
    for (process, folder) in std::mem::take(&mut *running).into_values() {
        end(process, &folder);
    }
    running
}

/// Ends a process, which may have ended by itself, and empties its folder.
fn end(mut process: Process, folder: &TempDir) {
    let _ = process.kill();
    let _ = process.wait();
    let _ = std::fs::remove_dir_all(folder.path());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_child_that_is_dropped_ends_and_its_folder_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_path_buf();
        let child = Child::start(Command::new("sleep").arg("1000"), folder).unwrap();
        assert!(child.ended().unwrap().is_none() && path.exists());
        let number = child.number;
        drop(child);
        assert!(!path.exists());
        // Its end was waited for, so the system knows no such process.
        assert!(!running().contains_key(&number));
        assert!(!std::path::Path::new(&format!("/proc/{number}")).exists());
    }
}
