//! `lanecast convert`: writes a scene in the native format.

use super::args::ConvertArgs;
use super::error::CliError;
use super::output::{Results, Written, check_destinations, complain, printable_line};
use super::{interrupt, scene};
use lanecast_io::{NativeError, SaveError, native_scene};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `--json` gets.
#[derive(Serialize)]
struct Report {
    scene: String,
    files: Vec<Written>,
    /// What the format has no words for, and was left out or changed.
    warning: Option<String>,
}

pub fn run(args: &ConvertArgs) -> Result<(), CliError> {
    interrupt::end_at_signal();
    let refuse = |e: NativeError| CliError::Usage(e.to_string());
    let extension = args.out.extension().map(|e| e.to_ascii_lowercase());
    if !extension.is_some_and(|e| e == "toml" || e == "json") {
        return Err(refuse(NativeError::Extension));
    }
    let stem = args.out.file_stem().unwrap_or_default().to_string_lossy();
    let folder_name = format!("{stem}_meshes");
    let folder = args.out.with_file_name(&folder_name);
    let mut outputs = check_destinations(
        &[&args.scene],
        std::slice::from_ref(&args.out),
        args.json.iter(),
    )?;
    // What the scene reads from there would be overwritten.
    outputs.push(folder.clone());
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    let made = native_scene(&scene, &args.out, &folder_name).map_err(refuse)?;
    let mut files = vec![(args.out.clone(), made.text.into_bytes())];
    let beside = made.files.into_iter();
    files.extend(beside.map(|(name, bytes)| (folder.join(name), bytes)));
    let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    let count = files.len();
    let report = Report {
        scene: args.scene.display().to_string(),
        files: files.iter().map(Written::new).collect(),
        warning: made.warning.clone(),
    };
    let is_new = count > 1 && created(&folder)?;
    let done = write(args, files, &report);
    if done.is_err() && is_new {
        // Only an empty folder can be removed so.
        let _ = std::fs::remove_dir(&folder);
    }
    let results = done?;
    if let Some(warning) = made.warning {
        complain(&format!("warning: {}: {warning}", args.scene.display()));
    }
    let name = printable_line(&args.out.display().to_string());
    let files = if count == 1 { "file" } else { "files" };
    let committed = results.commit(&format!("{name}: {count} {files}, {bytes} bytes\n"));
    if committed.is_err() && is_new {
        let _ = std::fs::remove_dir(&folder);
    }
    committed
}

/// Makes a folder, unless it is there. Returns whether it was made.
fn created(folder: &Path) -> Result<bool, SaveError> {
    match std::fs::create_dir(folder) {
        Ok(()) => Ok(true),
        Err(_) if folder.is_dir() => Ok(false),
        Err(source) => Err(SaveError::Write {
            path: folder.into(),
            source,
        }),
    }
}

/// Writes all files under temporary names.
fn write(
    args: &ConvertArgs,
    files: Vec<(PathBuf, Vec<u8>)>,
    report: &Report,
) -> Result<Results, CliError> {
    let names: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
    check_destinations(&[&args.scene], &names, args.json.iter())?;
    let mut results = Results::default();
    for (path, bytes) in files {
        results.outputs.add(&path, bytes)?;
    }
    results.add(&args.json, report)?;
    Ok(results)
}
