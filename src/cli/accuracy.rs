//! `render --accuracy within:BOUNDS`: chooses the options of the fastest way that keeps the bounds, by
//! the trade of speed and accuracy that was measured for scenes of this class.
//!
//! A class is what a scene is made of, by kinds and powers of two of counts, and how its picture is
//! made, on a machine and with a version ([`class_of`]). No number of a camera is in it: a class that was
//! never met is measured once, from the view that is asked for and from others around the scene, and
//! the worst of these counts. The trade is kept below the folder for caches of the user.

use super::args::STDIN;
use super::args::{RenderArgs, has_lens};
use super::error::CliError;
use super::output::complain;
use super::pipeline::named;
use super::render::composed;
use super::tradeoff::{Task, trade};
use super::{interrupt, isa, scene};
use glam::DVec3;
use lanecast_io::{AovSet, LoadError};
use lanecast_measure::tradeoff::{Bound, Point, within, worst_of};
use lanecast_model::scene::{Instances, Outlook, Projection, Scene};
use lanecast_picture::render::{Backdrop, Grid, Integrator, RenderConfig};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The most pixels of the pictures that are measured, 240x135. Of more pixels fewer lie on edges, so
/// that a larger picture is not farther from its own converged one.
const PIXELS: f64 = 32_400.0;

/// From where a class is measured beside the view that is asked for: directions from the scene's middle
/// to the eye, from a little above on the far sides of the default view.
const AROUND: [DVec3; 2] = [DVec3::new(-1.0, 0.5, 0.3), DVec3::new(0.5, 0.8, -1.0)];

/// Samples per pixel of the converged pictures: of more the errors would be smaller by a few hundredths.
const CONVERGED: u32 = 512;

/// The part of a bound that a class has to keep: from views that were not measured, errors have been up
/// to 1.2 times the largest that were (docs/BENCHMARKS.md).
const MARGIN: f64 = 0.8;

/// Returns the arguments of the process with the chosen options in place of `--accuracy`.
pub fn resolved(args: &RenderArgs, bounds: &[Bound]) -> Result<Vec<OsString>, CliError> {
    let Some(path) = args.scene.as_deref() else {
        return Err(CliError::Usage(
            "--accuracy measures a scene, and none is named; name one, or leave it out".into(),
        ));
    };
    if path == Path::new(STDIN) {
        return Err(CliError::Usage(
            "--accuracy reads the scene twice, and standard input is read once; name a file".into(),
        ));
    }
    if args.common.grid == Grid::Corners {
        return Err(CliError::Usage(
            "--accuracy is of pictures, and --grid corners traces one ray through each corner; leave \
             one of them out"
                .into(),
        ));
    }
    // What was left out of the file is said when it is loaded for the picture.
    let loaded = lanecast_io::load(path, &args.load_options(Vec::new()))?.scene;
    let asked = composed(args, loaded, args.config()?)?;
    let config = small(&asked.1);
    let class = class_of(&asked.0, &config, path)?;
    let file = cache_file(&class);
    let known = file.as_deref().and_then(read);
    let from = match &known {
        Some(_) => "as measured before for scenes of its class",
        None => "as measured for this scene",
    };
    let points = match known {
        Some(points) => points,
        None => {
            let points = measured(&asked.0, &config, args)?;
            if let Some(file) = &file {
                write(file, &points);
            }
            points
        }
    };
    let kept: Vec<Bound> = bounds.iter().map(|bound| bound.within(MARGIN)).collect();
    let aovs = &asked.1.aovs;
    let with_outputs: Vec<Point> = points
        .iter()
        .filter(|point| has_outputs(&point.options, aovs))
        .cloned()
        .collect();
    let Some(best) = within(&with_outputs, &kept) else {
        let but = match within(&points, &kept) {
            Some(_) => " and has the outputs of --aov; leave out light_groups and variance, or",
            None => " from all sides;",
        };
        return Err(CliError::Short(format!(
            "no way to render {} keeps these bounds{but} lanecast tradeoff shows what there is",
            path.display()
        )));
    };
    let options = match &best.options[..] {
        "" => "the scene's own way",
        options => options,
    };
    complain(&format!(
        "accuracy: {options}, {from} at {}x{} from {} sides (RMSE {:.4}, FLIP {:.4}, {} wrong pixels)",
        config.width,
        config.height,
        1 + AROUND.len(),
        best.rmse,
        best.flip,
        best.wrong_pixels
            .map_or("unknown".into(), |n| n.to_string())
    ));
    Ok(with_options(std::env::args_os(), &best.options))
}

/// Says whether a picture with these options has all outputs that are asked for.
fn has_outputs(options: &str, aovs: &AovSet) -> bool {
    let words: Vec<&str> = options.split_whitespace().collect();
    let is_cached = words.contains(&"--cache");
    let is_one_sample = words.windows(2).any(|pair| pair == ["--spp", "1"]);
    !(is_cached && aovs.light_groups || is_one_sample && aovs.variance)
}

/// Returns the configuration of a picture of at most [`PIXELS`], of the same form, but without other
/// outputs, which not all ways have.
fn small(config: &RenderConfig) -> RenderConfig {
    let pixels = f64::from(config.width) * f64::from(config.height);
    let scale = (PIXELS / pixels).sqrt().min(1.0);
    let side = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
    RenderConfig {
        width: side(config.width),
        height: side(config.height),
        aovs: AovSet::default(),
        ..config.clone()
    }
}

/// Puts options in place of `--accuracy`.
fn with_options(arguments: impl Iterator<Item = OsString>, options: &str) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut arguments = arguments.peekable();
    // Behind `--` there are no options.
    while arguments.peek().is_some_and(|argument| argument != "--")
        && let Some(argument) = arguments.next()
    {
        match argument.to_str() {
            Some("--accuracy") => {
                arguments.next();
            }
            Some(text) if text.starts_with("--accuracy=") => {}
            _ => kept.push(argument),
        }
    }
    kept.extend(options.split_whitespace().map(OsString::from));
    kept.extend(arguments);
    kept
}

/// Measures the trade from all sides.
fn measured(
    asked: &Scene,
    config: &RenderConfig,
    args: &RenderArgs,
) -> Result<Vec<Point>, CliError> {
    let path = named(args.scene.as_deref());
    let progress = interrupt::watch();
    let task = Task {
        path,
        reps: 1,
        converged: (config.integrator != Integrator::Direct).then_some(CONVERGED),
        style: args.common.progress.style,
        // Its picture lies beside the one that is asked for.
        denoiser: None,
        progress: &progress,
    };
    let instances = Instances::of(asked).map_err(|e| LoadError::of_scene(path, e))?;
    let mut sides = vec![trade((asked.clone(), config.clone()), &task)?.points];
    for towards_eye in AROUND {
        let outlook = Outlook {
            towards_eye: towards_eye.normalize(),
            ..Outlook::default()
        };
        let scene = asked.clone().framed(&outlook, &instances, config.aspect());
        let config = RenderConfig {
            camera: None,
            ..config.clone()
        };
        sides.push(trade((scene, config), &task)?.points);
    }
    Ok(worst_of(sides))
}

/// Says of which class a picture is: what decides which ways there are, what they take and how wrong
/// they are, in relation to each other. Numbers are told by powers of two.
///
/// It has the version and commit of the program, its instructions and threads; each kind of shape with
/// its instances, triangles, lights; whether there are a sky, things that shine, glass, holes, textures,
/// motion; the integrator and its depth, the shutter, a lens, whether the camera has an image plane, what
/// the background shows, the pixels; and the ground, which is a shape.
fn class_of(scene: &Scene, config: &RenderConfig, path: &Path) -> Result<String, CliError> {
    let instances = Instances::of(scene).map_err(|e| LoadError::of_scene(path, e))?;
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    let counts = instances.of_shapes(scene);
    for (shape, count) in scene.shapes.rows.iter().zip(counts) {
        if count > 0 {
            *kinds.entry(shape.kind_name()).or_default() += count;
        }
    }
    let power = |count: u64| count.checked_ilog2().map_or(0, |power| power + 1);
    let mut class = format!(
        "{} {} {} {:?}",
        env!("CARGO_PKG_VERSION"),
        option_env!("LANECAST_COMMIT").unwrap_or("unknown"),
        isa::of_build(),
        config.threads,
    );
    for (kind, count) in kinds {
        class += &format!(" {kind}:{}", power(count));
    }
    let rows = &scene.materials.rows;
    class += &format!(
        " triangles:{} lights:{} sky:{} shines:{} glass:{} holes:{} textures:{} moves:{}",
        power(scene.meshes.triangles.len() as u64),
        power(scene.lights.len() as u64),
        scene.environment.is_some(),
        rows.iter().any(|m| m.emission != [0.0; 3]),
        rows.iter().any(|m| m.transmission > 0.0),
        rows.iter().any(|m| m.layers.opacity < 1.0),
        !scene.textures.is_empty(),
        scene.moves(),
    );
    let row = scene::pick_camera(&scene.cameras, config.camera.as_deref())?;
    let camera = row.map(|row| scene.cameras.rows[row]);
    let projection = match camera.map(|camera| camera.projection) {
        Some(Projection::Panorama) => "panorama",
        Some(Projection::Fisheye { .. }) => "fisheye",
        _ => "plane",
    };
    let backdrop = match config.backdrop {
        Backdrop::Auto => "own",
        Backdrop::Color(_) => "colour",
        Backdrop::Transparent => "none",
    };
    class += &format!(
        " {:?} depth:{} slices:{:?} lens:{} {projection} behind:{backdrop} build:{} pixels:{}",
        config.integrator,
        config.max_depth,
        config.shutter.map(|shutter| shutter.slices),
        camera.is_some_and(|camera| has_lens(&camera)),
        config.build.name(),
        power(u64::from(config.width) * u64::from(config.height)),
    );
    Ok(class)
}

/// Returns the file that keeps a class's trade; `None` where the user has no folder for caches.
fn cache_file(class: &str) -> Option<PathBuf> {
    let of_home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"));
    let folder = std::env::var_os("XDG_CACHE_HOME")
        .filter(|folder| !folder.is_empty())
        .map(PathBuf::from)
        .or_else(of_home)?;
    let hash: String = Sha256::digest(class)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Some(folder.join("lanecast").join(format!("trade-{hash}.json")))
}

/// Reads a kept trade; a file that is not there or is none is not known.
fn read(file: &Path) -> Option<Vec<Point>> {
    let points: Vec<Point> = serde_json::from_slice(&std::fs::read(file).ok()?).ok()?;
    (!points.is_empty()).then_some(points)
}

/// Keeps a trade, where that is possible: without it the next picture only takes longer.
fn write(file: &Path, points: &[Point]) {
    let Some(folder) = file.parent() else { return };
    let kept = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let unfinished = tempfile::NamedTempFile::new_in(folder)?;
        serde_json::to_writer(&unfinished, points)?;
        unfinished.persist(file)?;
        Ok(())
    };
    let _ = kept();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_take_the_place_of_the_bounds() {
        let words = |line: &str| -> Vec<OsString> { line.split(' ').map(OsString::from).collect() };
        for line in [
            "lanecast render a.toml --accuracy within:rmse=0.1 -o b.png",
            "lanecast render a.toml --accuracy=within:rmse=0.1 -o b.png",
        ] {
            let with = with_options(words(line).into_iter(), "--spp 16 --precision fast");
            let expected = "lanecast render a.toml -o b.png --spp 16 --precision fast";
            assert_eq!(with, words(expected));
        }
        let line = words("lanecast render --accuracy within:flip=0.1 -o b.png -- --accuracy");
        let expected = "lanecast render -o b.png --spp 16 -- --accuracy";
        assert_eq!(with_options(line.into_iter(), "--spp 16"), words(expected));
    }

    #[test]
    fn ways_without_an_output_that_is_asked_for_are_left_out() {
        let groups = AovSet {
            light_groups: true,
            ..AovSet::default()
        };
        let variance = AovSet {
            variance: true,
            ..AovSet::default()
        };
        for (options, has) in [
            ("", [true, true]),
            ("--spp 16", [true, true]),
            ("--spp 1", [true, false]),
            ("--precision fast --spp 1 --lanes 1", [true, false]),
            ("--cache unbiased", [false, true]),
        ] {
            let found = [groups, variance].map(|aovs| has_outputs(options, &aovs));
            assert_eq!(found, has, "{options}");
        }
    }
}
