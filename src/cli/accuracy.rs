//! `render --accuracy within:BOUNDS`: chooses the options of the fastest way that keeps the bounds, by
//! the trade of speed and accuracy that was measured for scenes of this class.
//!
//! A class is what a scene is made of, by kinds and decades of counts, and how it is lit, on a
//! machine and with a version. A class that was never met is measured, once, as `tradeoff` does, and
//! kept below the folder for caches of the user.

use super::args::{RenderArgs, Size, TradeoffArgs};
use super::error::CliError;
use super::output::complain;
use super::{interrupt, isa, scene, tradeoff};
use crate::io::LoadError;
use crate::measure::tradeoff::{Bound, Point, within};
use crate::scene::{Instances, Scene};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The size of the pictures that are measured.
const SIZE: Size = Size {
    width: 240,
    height: 135,
};

/// Returns the arguments of the process with the chosen options in place of `--accuracy`.
pub fn resolved(args: &RenderArgs, bounds: &[Bound]) -> Result<Vec<OsString>, CliError> {
    let Some(path) = args.scene.as_deref() else {
        return Err(CliError::Usage(
            "--accuracy measures a scene, and none is named; name one, or leave it out".into(),
        ));
    };
    // What was left out of the file is said when it is loaded for the picture.
    let loaded = crate::io::load(path, &args.load_options(Vec::new()))?.scene;
    let class = class_of(&loaded, path, args)?;
    let file = cache_file(&class);
    let known = file.as_deref().and_then(read);
    let from = match &known {
        Some(_) => "as measured before for scenes of its class",
        None => "as measured for this scene",
    };
    let points = match known {
        Some(points) => points,
        None => {
            let points = measured(loaded, path, args)?;
            if let Some(file) = &file {
                write(file, &points);
            }
            points
        }
    };
    let Some(best) = within(&points, bounds) else {
        return Err(CliError::Short(format!(
            "no way to render {} keeps these bounds; lanecast tradeoff shows what there is",
            path.display()
        )));
    };
    let options = match &best.options[..] {
        "" => "the scene's own way",
        options => options,
    };
    complain(&format!(
        "accuracy: {options}, {from} at {}x{} (RMSE {:.4}, FLIP {:.4}, {} wrong pixels)",
        SIZE.width,
        SIZE.height,
        best.rmse,
        best.flip,
        best.wrong_pixels
            .map_or("unknown".into(), |n| n.to_string())
    ));
    Ok(with_options(std::env::args_os(), &best.options))
}

/// Puts options in place of `--accuracy`.
fn with_options(arguments: impl Iterator<Item = OsString>, options: &str) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut arguments = arguments;
    while let Some(argument) = arguments.next() {
        match argument.to_str() {
            Some("--accuracy") => {
                arguments.next();
            }
            Some(text) if text.starts_with("--accuracy=") => {}
            _ => kept.push(argument),
        }
    }
    kept.extend(options.split_whitespace().map(OsString::from));
    kept
}

fn measured(loaded: Scene, path: &Path, args: &RenderArgs) -> Result<Vec<Point>, CliError> {
    let args = TradeoffArgs {
        scene: path.into(),
        html: None,
        within: Vec::new(),
        size: Some(SIZE),
        reps: 3,
        converged: None,
        threads: args.common.threads,
        view: args.common.view.clone(),
        shutter: args.shutter.clone(),
        import: args.common.import.clone(),
        progress: args.common.progress,
        json: None,
    };
    let progress = interrupt::watch();
    Ok(tradeoff::trade(loaded, &args, &progress)?.points)
}

/// Says of which class a scene is: what decides which ways there are, what they take and how wrong
/// they are, in relation to each other.
fn class_of(loaded: &Scene, path: &Path, args: &RenderArgs) -> Result<String, CliError> {
    let of_scene = |source| LoadError::of_scene(path, source);
    let instances = Instances::of(loaded).map_err(of_scene)?;
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    let counts = instances.of_shapes(loaded);
    for (shape, count) in loaded.shapes.rows.iter().zip(counts) {
        if count > 0 {
            *kinds.entry(shape.kind_name()).or_default() += count;
        }
    }
    let decade = |count: u64| count.checked_ilog10().map_or(0, |decade| decade + 1);
    let mut class = format!(
        "{} {} {} {:?}",
        env!("CARGO_PKG_VERSION"),
        option_env!("LANECAST_COMMIT").unwrap_or("unknown"),
        isa::of_build(),
        args.common.threads,
    );
    for (kind, count) in kinds {
        class += &format!(" {kind}:{}", decade(count));
    }
    let rows = &loaded.materials.rows;
    let row = scene::pick_camera(&loaded.cameras, args.common.view.camera.as_deref())?;
    class += &format!(
        " triangles:{} lights:{} sky:{} shines:{} glass:{} holes:{} textures:{} moves:{} shutter:{:?} {:?}",
        decade(loaded.meshes.triangles.len() as u64),
        decade(loaded.lights.len() as u64),
        loaded.environment.is_some(),
        rows.iter().any(|m| m.emission != [0.0; 3]),
        rows.iter().any(|m| m.transmission > 0.0),
        rows.iter().any(|m| m.layers.opacity < 1.0),
        !loaded.textures.is_empty(),
        loaded.moves(),
        args.shutter.shutter,
        row.map(|row| loaded.cameras.rows[row].projection),
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
    }
}
