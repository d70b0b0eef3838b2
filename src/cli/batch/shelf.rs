//! The scenes in memory: each is loaded by the first task that needs it and dropped after the last,
//! or, with `--memory`, when others need the room.
//!
//! Files of equal bytes that name no other files are one scene, whatever they are called. Only tasks
//! that are being done hold a scene for certain: with `--memory` any other may go, and is loaded again.

use super::end::End;
use super::key::{Hashes, Input};
use super::picture::Loaded;
use super::records::Failure;
use super::tasks::{Task, Tasks};
use crate::args::RenderArgs;
use crate::interrupt;
use crate::memory::give_back;
use crate::output::complain;
use lanecast_io::{self as io, LoadOptions, ReadLog};
use lanecast_picture::render::Progress;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::time::Duration;

/// Scenes that tasks are waiting for, and some that others had.
pub struct Shelf {
    state: Mutex<State>,
    /// Told when a task has let go of its scene.
    released: Condvar,
    /// The most bytes of scenes, if there is a limit.
    limit: Option<u64>,
}

#[derive(Default)]
struct State {
    /// By [`Tasks::loading`].
    waiting: HashMap<usize, Waiting>,
    /// The keys of those whose scenes are in memory.
    loaded: Vec<usize>,
    /// Scenes that no task waits for, the oldest first; none without a limit.
    kept: Vec<Arc<Loaded>>,
    /// Scenes that are somewhere in memory, by what they were made of.
    by_content: HashMap<Content, Weak<Loaded>>,
}

#[derive(Default)]
struct Waiting {
    /// Tasks that have not ended.
    left: usize,
    /// Tasks that are being done.
    active: usize,
    /// The frames of those that are left.
    frames: Option<FrameRange>,
    slot: Arc<Slot>,
}

/// A scene, once it is loaded, and what was read for it.
#[derive(Default)]
pub struct Slot {
    read: ReadLog,
    loaded: OnceLock<Result<Arc<Loaded>, Failure>>,
}

/// What a scene of one file is made of: the bytes' hash, the name's ending, and the options of loading.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Content {
    hash: String,
    extension: String,
    options: String,
}

/// The first frame, the last, and a step that meets all.
#[derive(Clone, Copy)]
struct FrameRange {
    first: u32,
    last: u32,
    step: u32,
}

impl Shelf {
    /// Makes the place of each scene of some tasks.
    pub fn of(tasks: &Tasks, todo: &[u32], limit: Option<u64>) -> Shelf {
        let mut waiting: HashMap<usize, Waiting> = HashMap::new();
        for number in todo {
            let task = tasks.task(*number);
            let scene = waiting.entry(tasks.loading(&task)).or_default();
            scene.left += 1;
            scene.frames = task
                .frame
                .map(|frame| FrameRange::with(scene.frames, frame));
        }
        Shelf {
            state: Mutex::new(State {
                waiting,
                ..State::default()
            }),
            released: Condvar::new(),
            limit,
        }
    }

    /// Returns the place of a task's scene for as long as the task is done, until
    /// [`Shelf::release`]. Waits for room while other tasks' scenes take more than the limit.
    pub fn slot(&self, tasks: &Tasks, task: &Task, progress: &Progress) -> Arc<Slot> {
        /// How often a waiting task looks whether the run is to stop.
        const PAUSE: Duration = Duration::from_millis(100);
        let loading = tasks.loading(task);
        let mut state = self.lock();
        while let Some(limit) = self.limit {
            let is_there = state.loaded.contains(&loading);
            if is_there || progress.is_cancelled() || state.active_bytes() <= limit {
                break;
            }
            let woken = self.released.wait_timeout(state, PAUSE);
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
        match state.waiting.get_mut(&loading) {
            Some(waiting) => {
                waiting.active += 1;
                Arc::clone(&waiting.slot)
            }
            None => Arc::default(),
        }
    }

    /// Lets go of a task's scene, which is dropped if this was the last task that needs it and there
    /// is no room to keep it.
    pub fn release(&self, tasks: &Tasks, task: &Task) {
        let loading = tasks.loading(task);
        let mut state = self.lock();
        // Scenes may be large, and others need not wait for their end.
        let mut gone = Vec::new();
        let mut scene_ended = false;
        if let Some(waiting) = state.waiting.get_mut(&loading) {
            waiting.left -= 1;
            waiting.active -= 1;
            let (is_last, slot) = (waiting.left == 0, Arc::clone(&waiting.slot));
            scene_ended = is_last;
            if is_last {
                state.waiting.remove(&loading);
                state.loaded.retain(|other| *other != loading);
            }
            if let (true, Some(_), Some(scene)) = (is_last, self.limit, slot.scene()) {
                let scene = Arc::clone(scene);
                state.kept.retain(|other| !Arc::ptr_eq(other, &scene));
                state.kept.push(scene);
            }
            gone.push(slot);
        }
        if let Some(limit) = self.limit {
            state.make_room(limit, &mut gone);
        }
        drop(state);
        self.released.notify_all();
        drop(gone);
        if scene_ended {
            give_back();
        }
    }

    /// Returns the scene of a task; the first that asks loads it, and others wait.
    pub fn loaded<'s>(
        &self,
        slot: &'s Slot,
        (tasks, task): (&Tasks, &Task),
        (args, hashes): (&RenderArgs, &Hashes),
    ) -> Result<&'s Loaded, End> {
        let loading = tasks.loading(task);
        let loaded = slot.loaded.get_or_init(|| {
            let mut options = LoadOptions {
                reads: slot.read.clone(),
                ..args.load_options(Vec::new())
            };
            let frames = self.lock().waiting.get(&loading).and_then(|w| w.frames);
            if let (Some(animation), Some(frames)) = (&mut options.animation, frames) {
                animation.timeline.first = frames.first;
                animation.timeline.end = frames.last + 1;
                animation.timeline.stride = frames.step.max(1);
            }
            let path = tasks.scene_path(task);
            let content = Content::of(&path, &options, hashes);
            let known = content.as_ref().and_then(|content| {
                let state = self.lock();
                state.by_content.get(content).and_then(Weak::upgrade)
            });
            let loaded = match known {
                Some(loaded) => Ok(loaded),
                None => {
                    io::load(&path, &options).map(|l| Arc::new(Loaded::new(l.scene, l.warning)))
                }
            };
            let loaded = loaded.map_err(|e| match End::from(interrupt::cause(e.into())) {
                End::Failed(failure) => failure,
                // The thread stops at its next look.
                End::Stop(error) => Failure {
                    code: Some(error.exit_code()),
                    message: error.to_string(),
                    again: true,
                },
            })?;
            if let Some(warning) = &loaded.warning {
                complain(&format!("warning: {}: {warning}", path.display()));
            }
            let is_alone = slot.read.files().iter().all(|file| *file == path);
            if let (Some(content), true) = (content, is_alone) {
                self.lock().remember(content, &loaded);
            }
            let mut state = self.lock();
            if state.waiting.contains_key(&loading) {
                state.loaded.push(loading);
            }
            Ok(loaded)
        });
        loaded
            .as_deref()
            .map_err(|failure| End::Failed(failure.clone()))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Returns the bytes of the scenes of tasks that are being done.
    fn active_bytes(&self) -> u64 {
        let active = self.waiting_of_loaded().filter(|w| w.active > 0);
        bytes(active.filter_map(|w| w.slot.scene()))
    }

    fn waiting_of_loaded(&self) -> impl Iterator<Item = &Waiting> {
        let keys = self.loaded.iter();
        keys.filter_map(|key| self.waiting.get(key))
    }

    /// Takes out scenes that no task is being done with until the others keep the limit: first those
    /// that no task waits for.
    fn make_room(&mut self, limit: u64, gone: &mut Vec<Arc<Slot>>) {
        let all = |state: &State| {
            let waiting = state.waiting_of_loaded().filter_map(|w| w.slot.scene());
            bytes(waiting.chain(&state.kept))
        };
        while all(self) > limit {
            if !self.kept.is_empty() {
                let loaded = OnceLock::from(Ok(self.kept.remove(0)));
                let slot = Slot {
                    loaded,
                    ..Slot::default()
                };
                gone.push(Arc::new(slot));
                continue;
            }
            let is_idle = |key: &usize| self.waiting.get(key).is_some_and(|w| w.active == 0);
            let Some(place) = self.loaded.iter().position(is_idle) else {
                return;
            };
            let key = self.loaded.remove(place);
            if let Some(waiting) = self.waiting.get_mut(&key) {
                gone.push(std::mem::take(&mut waiting.slot));
            }
        }
    }

    /// Notes what a scene was made of, and forgets what is gone.
    fn remember(&mut self, content: Content, loaded: &Arc<Loaded>) {
        self.by_content.retain(|_, scene| scene.strong_count() > 0);
        self.by_content.insert(content, Arc::downgrade(loaded));
    }
}

/// Adds up the bytes of scenes, each once.
fn bytes<'s>(scenes: impl Iterator<Item = &'s Arc<Loaded>>) -> u64 {
    let mut all: Vec<&Arc<Loaded>> = scenes.collect();
    all.sort_by_key(|scene| Arc::as_ptr(scene));
    all.dedup_by(|a, b| Arc::ptr_eq(a, b));
    all.iter().map(|scene| scene.bytes()).sum()
}

impl Content {
    /// Returns what the scene of a file is made of, if it names no others; `None` if it cannot be read.
    fn of(path: &Path, options: &LoadOptions, hashes: &Hashes) -> Option<Content> {
        let plain = LoadOptions {
            reads: ReadLog::default(),
            ..options.clone()
        };
        let extension = path.extension().unwrap_or_default();
        Some(Content {
            hash: hashes.of_file(path)?,
            extension: extension.to_string_lossy().to_lowercase(),
            options: format!("{plain:?}"),
        })
    }
}

impl Slot {
    /// Returns the scene, if it was loaded.
    fn scene(&self) -> Option<&Arc<Loaded>> {
        self.loaded.get()?.as_ref().ok()
    }

    /// Returns what was read for a task.
    pub fn inputs(&self, (tasks, task): (&Tasks, &Task), hashes: &Hashes) -> Vec<Input> {
        let mut files = self.read.files();
        files.insert(tasks.scene_path(task));
        hashes.inputs(&files)
    }
}

impl FrameRange {
    /// Returns the range that meets another frame, too.
    fn with(range: Option<FrameRange>, frame: u32) -> FrameRange {
        let Some(range) = range else {
            return FrameRange {
                first: frame,
                last: frame,
                step: 0,
            };
        };
        let first = range.first.min(frame);
        let apart = [range.first - first, frame - first];
        FrameRange {
            first,
            last: range.last.max(frame),
            step: apart.into_iter().fold(range.step, greatest_divisor),
        }
    }
}

fn greatest_divisor(a: u32, b: u32) -> u32 {
    match b {
        0 => a,
        b => greatest_divisor(b, a % b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_meet_all_frames() {
        let of = |frames: &[u32]| {
            let range = frames
                .iter()
                .fold(None, |r, f| Some(FrameRange::with(r, *f)));
            range.map(|r| (r.first, r.last, r.step))
        };
        assert_eq!(of(&[5]), Some((5, 5, 0)));
        assert_eq!(of(&[2, 4, 8]), Some((2, 8, 2)));
        assert_eq!(of(&[9, 3, 6]), Some((3, 9, 3)));
        assert_eq!(of(&[7, 7, 2]), Some((2, 7, 5)));
        assert_eq!(of(&[0, 10, 15]), Some((0, 15, 5)));
    }
}
