//! `lanecast tradeoff`: renders a scene in all ways that make a difference to it, and shows what each
//! takes and what it is off by.

mod ways;
mod work;

pub use work::{Task, trade};

use super::args::{TradeoffArgs, VERIFY_SIZE, needed_integrator};
use super::denoise::Denoiser;
use super::error::CliError;
use super::output::{Results, check_destinations, quoted};
use super::{interrupt, scene};
use lanecast_io::LoadError;
use lanecast_measure::plot::tradeoff_page;
use lanecast_measure::tradeoff::{Point, shown, within};
use lanecast_model::scene::Scene;
use lanecast_picture::render::{Grid, Integrator, RenderConfig};
use serde::Serialize;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::PathBuf;

/// What `--json` gets.
#[derive(Serialize)]
struct Report<'a> {
    scene: String,
    size: [u32; 2],
    threads: usize,
    reps: u32,
    /// Samples per pixel of the converged picture.
    converged: u32,
    points: &'a [Point],
    /// The point that keeps the bounds of `--within`, by its number.
    #[serde(skip_serializing_if = "Option::is_none")]
    within: Option<usize>,
}

pub fn run(args: &TradeoffArgs) -> Result<(), CliError> {
    let files: Vec<PathBuf> = args.html.iter().cloned().collect();
    let outputs = check_destinations(&[&args.scene], &files, args.json.iter())?;
    let progress = interrupt::watch();
    let loaded = scene::load(&args.scene, &args.import.load_options(outputs))?;
    let denoiser = Denoiser::if_there();
    let task = Task {
        path: &args.scene,
        reps: args.reps,
        converged: args.converged,
        style: args.progress.style,
        denoiser: denoiser.as_ref(),
        progress: &progress,
    };
    let trade = trade(composed(loaded, args)?, &task)?;
    let points = &trade.points[..];
    let best = within(points, &args.within);
    let number = best.map(|best| {
        let same = |point: &&Point| std::ptr::eq(*point, best);
        points.iter().take_while(|point| !same(point)).count()
    });
    let report = Report {
        scene: args.scene.display().to_string(),
        size: trade.size,
        threads: trade.threads,
        reps: args.reps,
        converged: trade.converged,
        points,
        within: number.filter(|_| !args.within.is_empty()),
    };
    let mut results = Results::default();
    if let Some(path) = &args.html {
        let [width, height] = trade.size;
        let facts = vec![
            ("size", format!("{width}x{height}")),
            ("threads", report.threads.to_string()),
            ("pictures of each way", args.reps.to_string()),
            ("converged", format!("{} spp", trade.converged)),
        ];
        let pictures = (points, &trade.pictures[..], &trade.truth);
        let html = tradeoff_page(
            (&report.scene, &command(std::env::args_os())),
            facts,
            pictures,
            path,
        )?;
        results.outputs.add(path, html.into_bytes())?;
    }
    results.add(&args.json, &report)?;
    interrupt::check(&progress)?;
    if args.within.is_empty() {
        return results.commit(&table(points));
    }
    match best {
        Some(best) => results.commit(&format!("{}\n", best.options)),
        None => {
            results.commit("")?;
            Err(CliError::Short(
                "no way to render the scene keeps these bounds; --json and --html tell what there is"
                    .into(),
            ))
        }
    }
}

/// Returns the command line of `render` that begins as that of this process: with all options but those
/// that `render` has not.
fn command(arguments: impl Iterator<Item = OsString>) -> String {
    const OWN: [&str; 6] = [
        "--html",
        "--within",
        "--reps",
        "--converged",
        "--json",
        "--progress",
    ];
    let mut line = String::from("lanecast render");
    // The program and its command come first.
    let mut arguments = arguments
        .skip(2)
        .map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = arguments.next() {
        match word.split_once('=') {
            Some((name, _)) if OWN.contains(&name) => {}
            None if OWN.contains(&&*word) => {
                arguments.next();
            }
            _ => line += &format!(" {}", quoted(&word)),
        }
    }
    line
}

/// Returns the scene from the view that is asked for, in the middle of its shutter, and how `render`
/// would render it.
fn composed(scene: Scene, args: &TradeoffArgs) -> Result<(Scene, RenderConfig), CliError> {
    let size = args.size.unwrap_or(VERIFY_SIZE);
    let config = RenderConfig {
        width: size.width,
        height: size.height,
        threads: args.threads,
        camera: args.view.camera.clone(),
        ..RenderConfig::default()
    };
    let (scene, config) = scene::viewed(scene, config, &args.view, &args.scene)?;
    let row = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
    let exposure = args
        .shutter
        .exposure(&scene, row, (Grid::Centers, None), (0.0, 1.0))?;
    let integrator = needed_integrator(&scene, row, Grid::Centers).0;
    let (spp, max_depth) = match integrator {
        Integrator::Direct if exposure.is_some() => (64, 5),
        Integrator::Direct => (1, 5),
        _ => (64, 16),
    };
    let config = RenderConfig {
        integrator,
        spp,
        max_depth,
        shutter: exposure,
        ..config
    };
    let scene = match exposure {
        Some(exposure) => scene
            .at(exposure.middle())
            .map_err(|source| LoadError::of_scene(&args.scene, source))?,
        None => scene,
    };
    Ok((scene, config))
}

/// Lists the points, nearest first; those that nothing beats have a star.
fn table(points: &[Point]) -> String {
    let mut rows: Vec<&Point> = points.iter().collect();
    rows.sort_by(|a, b| {
        a.rmse
            .total_cmp(&b.rmse)
            .then(a.seconds.total_cmp(&b.seconds))
    });
    let mut text =
        String::from("   seconds      RMSE      FLIP  wrong pixels  t error  normal, °  options\n");
    for point in rows {
        let (t, normal) = (shown(point.t_error), shown(point.normal_error));
        let wrong = point.wrong_pixels.map_or("?".into(), |n| n.to_string());
        let options = match &point.options[..] {
            "" => "(the scene's own way)",
            options => options,
        };
        let star = if point.pareto { '*' } else { ' ' };
        let _ = writeln!(
            text,
            "{star} {:8.4} {:9.6} {:9.6} {wrong:>13} {t:>8} {normal:>10}  {options}",
            point.seconds, point.rmse, point.flip
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_names_commands_of_the_same_scene_and_view() {
        let line =
            "lanecast tradeoff --html a.html a_b.toml --view iso --reps=2 --json - --size 9x9";
        let words = line.split(' ').map(|word| word.replace('_', " ").into());
        let expected = "lanecast render 'a b.toml' --view iso --size 9x9";
        assert_eq!(command(words), expected);
    }
}
