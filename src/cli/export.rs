//! `lanecast export`: writes a scene for other programs.

use super::args::{ExportArgs, RENDER_SIZE};
use super::error::CliError;
use super::interrupt;
use super::output::{Results, Sink, check_destinations, print, printable_line};
use super::scene;
use crate::io::{LoadError, pov_text};
use crate::scene::Instances;

pub fn run(args: &ExportArgs) -> Result<(), CliError> {
    interrupt::end_at_signal();
    let outputs = check_destinations(&[&args.scene], &[], [&args.pov].into_iter())?;
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    let row = scene::pick_camera(&scene.cameras, args.camera.as_deref())?;
    let of_scene = |source| LoadError::of_scene(&args.scene, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let aspect = f64::from(RENDER_SIZE.width) / f64::from(RENDER_SIZE.height);
    let (scene, camera) = scene.completed(row, &instances, aspect);
    let text = pov_text(&scene, &camera).map_err(|e| CliError::Usage(e.to_string()))?;
    let Sink::File(path) = &args.pov else {
        return print(&text);
    };
    let bytes = text.len();
    let mut results = Results::default();
    results.outputs.add(path, text.into_bytes())?;
    let name = printable_line(&path.display().to_string());
    results.commit(&format!("{name}: {bytes} bytes\n"))
}
