//! `lanecast export`: writes a scene for other programs, or a job for a farm.

use super::args::{ExportArgs, RENDER_SIZE};
use super::error::CliError;
use super::output::{Results, Sink, Written, check_destinations, complain, print, printable_line};
use super::triangles::triangles;
use super::{batch, interrupt, scene};
use lanecast_io::{LoadError, MitsubaPicture, mitsuba_scene, pov_text, pov_warning};
use lanecast_model::scene::{Camera, Instances, Lighting, Scene};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Exports a scene or a job; `render` is the definition of `lanecast render`.
pub fn run(args: &ExportArgs, render: clap::Command) -> Result<(), CliError> {
    interrupt::end_at_signal();
    if let Some(sink) = &args.openjd {
        return batch::export(&args.scene, sink, render);
    }
    let files: Vec<PathBuf> = args.mitsuba.iter().chain(&args.msh).cloned().collect();
    let outputs = check_destinations(&[&args.scene], &files, args.pov.iter().chain(&args.json))?;
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    let size = args.size.unwrap_or(RENDER_SIZE);
    let aspect = f64::from(size.width) / f64::from(size.height);
    let scene = scene::viewed_at(scene, aspect, &args.view, &args.scene)?;
    let asked = args
        .view
        .camera
        .as_deref()
        .filter(|_| !args.view.replaces_cameras());
    let row = scene::pick_camera(&scene.cameras, asked)?;
    let of_scene = |source| LoadError::of_scene(&args.scene, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    if scene.moves() {
        complain(&format!(
            "warning: {}: what moves is exported as it is at the beginning, and without its shutter",
            args.scene.display()
        ));
    }
    if let Some(path) = &args.msh {
        return msh(args, path, &scene, &instances);
    }
    let lighting = match args.mitsuba {
        Some(_) => Lighting::Studio,
        None => Lighting::Headlight,
    };
    let (scene, camera) = scene.completed_in(lighting, row, &instances, aspect);
    match &args.mitsuba {
        Some(path) => {
            let picture = MitsubaPicture {
                width: size.width,
                height: size.height,
                max_depth: args.max_bounces.unwrap_or(16),
                stem: path
                    .file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned(),
            };
            let scene = scene.in_studio(&camera);
            mitsuba(args, path, &scene, &instances, &camera, &picture)
        }
        None => pov(args, &scene, &camera),
    }
}

/// What `--json` gets.
#[derive(Serialize)]
struct Report {
    scene: String,
    files: Vec<Written>,
    /// What the other program does not have, or has in another way.
    warning: Option<String>,
}

fn report(
    args: &ExportArgs,
    files: Vec<Written>,
    warning: Option<String>,
    results: &mut Results,
) -> Result<(), CliError> {
    let report = Report {
        scene: args.scene.display().to_string(),
        files,
        warning,
    };
    results.add(&args.json, &report)
}

fn written(files: &[(PathBuf, Vec<u8>)]) -> Vec<Written> {
    files.iter().map(Written::new).collect()
}

fn add_all(
    files: impl IntoIterator<Item = (PathBuf, Vec<u8>)>,
    results: &mut Results,
) -> Result<(), CliError> {
    for (path, bytes) in files {
        results.outputs.add(&path, bytes)?;
    }
    Ok(())
}

fn msh(
    args: &ExportArgs,
    path: &Path,
    scene: &Scene,
    instances: &Instances,
) -> Result<(), CliError> {
    let (set, left_out) = triangles(scene, instances, "--msh").map_err(CliError::Usage)?;
    if set.triangles.is_empty() {
        return Err(CliError::Usage(format!(
            "{}: the scene has no mesh, and .msh has only triangles",
            args.scene.display()
        )));
    }
    if let Some(left_out) = &left_out {
        complain(&format!("warning: {}: {left_out}", args.scene.display()));
    }
    let mut results = Results::default();
    set.save_into(path, &mut results.outputs)?;
    // A header of three words, and three for each vertex and triangle.
    let words = 3 + 3 * (set.positions.len() + set.triangles.len());
    let file = Written {
        path: path.display().to_string(),
        bytes: words * size_of::<u32>(),
    };
    report(args, vec![file], left_out, &mut results)?;
    let name = printable_line(&path.display().to_string());
    results.commit(&format!("{name}: {} triangles\n", set.triangles.len()))
}

fn pov(args: &ExportArgs, scene: &Scene, camera: &Camera) -> Result<(), CliError> {
    let text = pov_text(scene, camera).map_err(|e| CliError::Usage(e.to_string()))?;
    let warning = pov_warning(scene, camera);
    if let Some(warning) = &warning {
        complain(&format!("warning: {}: {warning}", args.scene.display()));
    }
    let Some(Sink::File(path)) = &args.pov else {
        if args.json.is_some() {
            return Err(CliError::Usage(
                "--json tells of files, and --pov - writes none; name a file for --pov".into(),
            ));
        }
        return print(&text);
    };
    let bytes = text.len();
    let mut results = Results::default();
    let files = vec![(path.clone(), text.into_bytes())];
    report(args, written(&files), warning, &mut results)?;
    add_all(files, &mut results)?;
    let name = printable_line(&path.display().to_string());
    results.commit(&format!("{name}: {bytes} bytes\n"))
}

fn mitsuba(
    args: &ExportArgs,
    path: &Path,
    scene: &Scene,
    instances: &Instances,
    camera: &Camera,
    picture: &MitsubaPicture,
) -> Result<(), CliError> {
    let made = mitsuba_scene(scene, instances, camera, picture)
        .map_err(|e| CliError::Usage(e.to_string()))?;
    let mut files = vec![(path.to_path_buf(), made.xml.into_bytes())];
    let beside = made.files.into_iter();
    files.extend(beside.map(|(name, bytes)| (path.with_file_name(name), bytes)));
    let names: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
    check_destinations(&[&args.scene], &names, [].into_iter())?;
    let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    let count = files.len();
    let mut results = Results::default();
    report(args, written(&files), made.warning.clone(), &mut results)?;
    add_all(files, &mut results)?;
    if let Some(warning) = made.warning {
        complain(&format!("warning: {}: {warning}", args.scene.display()));
    }
    let name = printable_line(&path.display().to_string());
    results.commit(&format!("{name}: {count} files, {bytes} bytes\n"))
}
