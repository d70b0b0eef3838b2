//! Pictures from their tiles, for `lanecast batch --merge`.
//!
//! A joined picture has a record as a task has one, whose inputs are the tiles: it is joined again if
//! one of them has other bytes, and never replaces a file that no record names.

use super::key::{Hashes, settings_of_picture};
use super::records::{Known, Output, Record, Standing, Status, Writer, outputs_of};
use super::tasks::{Task, Tasks};
use crate::error::CliError;
use crate::render::{check_alpha, files};
use crate::{interrupt, tile};
use lanecast_io::{Outputs, sweep};
use lanecast_picture::render::Progress;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Joins the pictures of which all tiles were chosen, and are not missing. Returns how many there are,
/// as a part of a sentence.
pub fn joined(
    tasks: &Tasks,
    (chosen, missing): (&[u32], &[u32]),
    (out, hashes, known): (&Path, &Hashes, &Known),
) -> Result<String, CliError> {
    let progress = interrupt::watch();
    interrupt::keep_what_is_done();
    let of_picture = tasks.of_picture() as u32;
    let missing: BTreeSet<u32> = missing.iter().copied().collect();
    let mut there: Vec<u32> = chosen.to_vec();
    there.retain(|number| !missing.contains(number));
    there.sort_unstable();
    let mut writer = None;
    let (mut count, mut kept) = (0, 0);
    for tiles in there.chunk_by(|a, b| a / of_picture == b / of_picture) {
        if tiles.len() < of_picture as usize {
            continue;
        }
        interrupt::check(&progress)?;
        let tiles: Vec<Task> = tiles.iter().map(|number| tasks.task(*number)).collect();
        let settings = settings_of_picture(tasks, &tiles[0]);
        if let Standing::Done(_) = known.standing(&settings, (out, hashes), false) {
            kept += 1;
            continue;
        }
        let paths: Vec<PathBuf> = tiles.iter().map(|tile| out.join(&tile.output)).collect();
        let (outputs, files) = picture(&tiles[0], &paths, (tasks, out, known), &progress)?;
        let starts = known.starts(&settings) + 1;
        let started = Record::started(tiles[0].number, &settings, starts, &files);
        let writer = match &mut writer {
            Some(writer) => writer,
            None => writer.insert(Writer::create(out)?),
        };
        writer.append(&started)?;
        outputs.place()?;
        let outputs: Result<Vec<Output>, CliError> = outputs_of(out, &files);
        writer.append(&Record {
            outputs: outputs?,
            ..started.ended(Status::Done, hashes.inputs(&paths.into_iter().collect()))
        })?;
        count += 1;
    }
    Ok(format!("; {count} pictures were joined, {kept} were there"))
}

/// Makes the files of a picture of its tiles.
fn picture(
    task: &Task,
    paths: &[PathBuf],
    (tasks, out, known): (&Tasks, &Path, &Known),
    progress: &Progress,
) -> Result<(Outputs, Vec<PathBuf>), CliError> {
    let args = tasks.render_args(task, out, &mut tasks.parser());
    let args = args.map_err(CliError::Usage)?;
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let (picture, development) = tile::joined(&paths, |of_tiles| of_tiles, progress)?;
    check_alpha(picture.alpha.is_some(), &task.picture)?;
    let files = files(&task.picture, args.outputs.most())?;
    for file in &files {
        known.check_is_ours(out, file)?;
    }
    let path = out.join(&task.picture);
    if let Some(folder) = path.parent() {
        sweep(folder);
    }
    let mut outputs = Outputs::default();
    picture.save_into(&path, &development, &mut outputs)?;
    Ok((outputs, files))
}
