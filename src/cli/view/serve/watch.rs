//! Waits for changes of the scene's files, by looking at them: folders on other machines send no
//! notice of changes, and `view` is for these too.

use super::Shared;
use super::model::Model;
use lanecast_io::ReadLog;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// How often files are looked at. A change is taken when two looks agree, so that an editor has
/// finished; together less than half a second.
const PAUSE: Duration = Duration::from_millis(120);

/// What tells versions of a file apart: when it was written, and its size; `None` if there is none.
type Version = Option<(SystemTime, u64)>;

/// Loads the scene again whenever one of its files has changed.
pub fn watch(shared: &Arc<Shared>, asked: &ReadLog) {
    let Some(scene) = shared.base.scene.clone() else {
        return;
    };
    let mut files = files_of(&scene, asked);
    let mut shown = versions(&files);
    loop {
        std::thread::sleep(PAUSE);
        let seen = versions(&files);
        if seen == shown {
            continue;
        }
        std::thread::sleep(PAUSE);
        if versions(&files) != seen {
            continue;
        }
        shown = seen;
        // Files of a scene that fails stay watched, for one of them may be what is wrong.
        let named = ReadLog::default();
        let loaded = Model::load(&shared.base, &named);
        let more = files_of(&scene, &named);
        let known = match loaded {
            Ok(_) => more,
            Err(_) => files.iter().cloned().chain(more).collect(),
        };
        let before: Vec<PathBuf> = std::mem::replace(&mut files, known);
        // What was not watched may have changed while it was read, which no look tells.
        shown = (files.iter())
            .map(|file| match before.iter().position(|known| known == file) {
                Some(row) => shown[row],
                None => version(file),
            })
            .collect();
        shared.replace(loaded);
    }
}

fn files_of(scene: &Path, asked: &ReadLog) -> Vec<PathBuf> {
    let mut files = vec![scene.to_path_buf()];
    files.extend(asked.files());
    files
}

fn versions(files: &[PathBuf]) -> Vec<Version> {
    files.iter().map(|file| version(file)).collect()
}

fn version(file: &Path) -> Version {
    let about = std::fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}
