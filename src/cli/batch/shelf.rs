//! The scenes in memory: each is loaded by the first task that needs it and dropped after the last.

use super::end::End;
use super::key::{Hashes, Input};
use super::picture::Loaded;
use super::records::Failure;
use super::tasks::{Task, Tasks};
use crate::cli::args::RenderArgs;
use crate::cli::{interrupt, scene};
use crate::io::{LoadOptions, ReadLog};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Scenes that tasks are waiting for, by [`Tasks::loading`].
pub struct Shelf(Mutex<HashMap<usize, Waiting>>);

#[derive(Default)]
struct Waiting {
    /// Tasks that have not ended.
    left: usize,
    /// The frames of these.
    frames: Option<FrameRange>,
    slot: Arc<Slot>,
}

/// A scene, once it is loaded, and what was read for it.
#[derive(Default)]
pub struct Slot {
    read: ReadLog,
    loaded: OnceLock<Result<Loaded, Failure>>,
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
    pub fn of(tasks: &Tasks, todo: &[u32]) -> Shelf {
        let mut scenes: HashMap<usize, Waiting> = HashMap::new();
        for number in todo {
            let task = tasks.task(*number);
            let scene = scenes.entry(tasks.loading(&task)).or_default();
            scene.left += 1;
            scene.frames = task
                .frame
                .map(|frame| FrameRange::with(scene.frames, frame));
        }
        Shelf(Mutex::new(scenes))
    }

    /// Returns the place of a task's scene.
    pub fn slot(&self, tasks: &Tasks, task: &Task) -> Arc<Slot> {
        let waiting = self.lock();
        let waiting = waiting.get(&tasks.loading(task));
        waiting.map_or_else(Arc::default, |waiting| Arc::clone(&waiting.slot))
    }

    /// Drops a scene after its last task, which this is if no other is left.
    pub fn release(&self, tasks: &Tasks, task: &Task) {
        let loading = tasks.loading(task);
        let mut scenes = self.lock();
        if let Some(waiting) = scenes.get_mut(&loading) {
            waiting.left -= 1;
            if waiting.left == 0 {
                let gone = scenes.remove(&loading);
                // It may be large, and others need not wait for its end.
                drop(scenes);
                drop(gone);
            }
        }
    }

    /// Returns the scene of a task; the first that asks loads it, and others wait.
    pub fn loaded<'s>(
        &self,
        slot: &'s Slot,
        (tasks, task): (&Tasks, &Task),
        args: &RenderArgs,
    ) -> Result<&'s Loaded, End> {
        let loaded = slot.loaded.get_or_init(|| {
            let mut options = LoadOptions {
                reads: slot.read.clone(),
                ..args.load_options(Vec::new())
            };
            let frames = self.lock().get(&tasks.loading(task)).and_then(|w| w.frames);
            if let (Some(animation), Some(frames)) = (&mut options.animation, frames) {
                animation.timeline.first = frames.first;
                animation.timeline.end = frames.last + 1;
                animation.timeline.stride = frames.step.max(1);
            }
            let scene = scene::load(&tasks.scene_path(task), &options);
            scene
                .map(Loaded::new)
                .map_err(|e| match End::from(interrupt::cause(e)) {
                    End::Failed(failure) => failure,
                    // The thread stops at its next look.
                    End::Stop(error) => Failure {
                        code: Some(error.exit_code()),
                        message: error.to_string(),
                        again: true,
                    },
                })
        });
        loaded
            .as_ref()
            .map_err(|failure| End::Failed(failure.clone()))
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<usize, Waiting>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Slot {
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
