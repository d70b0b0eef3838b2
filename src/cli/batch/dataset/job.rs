//! What a job says of data sets, and what its tasks are by it.

use super::files::Beside;
use super::settings::Format;
use crate::batch::job::Job;
use crate::batch::tasks::{Task, Tasks};
use clap::Command;
use std::path::{Path, PathBuf};

impl Tasks {
    /// Returns a text of what shows in the files of a task beside its options; `None` where these are
    /// its picture alone.
    pub fn of_dataset(&self, task: &Task) -> Option<String> {
        let settings = self.dataset.as_ref()?;
        Some(format!("{} {}", task.number, settings.text()))
    }

    /// Lists the files that a task writes beside its picture whatever that shows, and the folders of
    /// all that it writes.
    pub fn beside(&self, task: &Task) -> (Vec<PathBuf>, Vec<PathBuf>) {
        let parent = task.output.parent().map(Path::to_path_buf);
        let Some(settings) = &self.dataset else {
            return (Vec::new(), parent.into_iter().collect());
        };
        let beside = Beside {
            picture: &task.output,
            in_folders: settings.writes(Format::Bop),
        };
        let folders = beside.folders().into_iter().chain(parent);
        (beside.always(), folders.collect())
    }
}

/// Refuses random options that are none, or that the job has elsewhere.
pub fn check_random(job: &Job, render: &Command) -> Result<(), String> {
    let Some(random) = &job.random else {
        return Ok(());
    };
    let has_views = !job.camera.0.is_empty() || !job.view.0.is_empty() || !job.orbit.0.is_empty();
    let variants = job
        .variant
        .0
        .iter()
        .flat_map(|variant| variant.options.keys());
    let fixed = job.render.keys().chain(variants);
    let fixed: Vec<String> = fixed.map(|key| key.replace('_', "-")).collect();
    random.check(render, has_views, &|name| {
        fixed.iter().any(|key| key == name)
    })
}

/// Refuses data sets that are wrong, or that no view of the job has.
pub fn check_dataset(job: &Job) -> Result<(), String> {
    let Some(dataset) = &job.dataset else {
        return Ok(());
    };
    dataset.check()?;
    if !job.view.0.is_empty() {
        return Err(
            "view looks by parallel rays, for which data sets have no numbers; ask for orbit or camera"
                .into(),
        );
    }
    match (dataset.writes(Format::Bop), &job.output) {
        (true, Some(_)) => Err("bop names pictures itself; leave output out".into()),
        _ => Ok(()),
    }
}
