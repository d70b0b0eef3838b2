//! Inputs from the folder `found/` of the test assets, by the command: every run ends, with
//! an exit code of its own and a message without control characters, and light is right.

use crate::common::assets;
use crate::run::{folder, lanecast, stderr, stdout};
use std::path::{Path, PathBuf};

/// Files of a folder of `found/`, sorted; none without the assets.
fn found(name: &str) -> Vec<PathBuf> {
    let Some(assets) = assets() else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(assets.join("found").join(name)).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// The pixels of an EXR file.
fn pixels(path: &Path) -> Vec<[f32; 3]> {
    let image = exr::image::read::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
        |(width, pixels), at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[at.y() * *width + at.x()] = [r, g, b];
        },
    );
    image.unwrap().layer_data.channel_data.pixels.1
}

/// Renders 64 pixels and returns them, if there is a picture.
fn rendered(scene: &Path, precision: &str) -> Option<Vec<[f32; 3]>> {
    let folder = folder();
    let scene = scene.to_str().unwrap();
    let picture = [
        "-o",
        "x.exr",
        "--size",
        "8x8",
        "--spp",
        "4",
        "--precision",
        precision,
    ];
    let output = lanecast(folder.path(), &[&["render", scene], &picture[..]].concat());
    let said = stderr(&output);
    let text = [said, stdout(&output)].concat();
    assert!(!text.contains("panicked"), "{scene}: {text}");
    assert!(
        text.chars().all(|c| c == '\n' || !c.is_control()),
        "{text:?}"
    );
    match output.status.code() {
        Some(0) => Some(pixels(&folder.path().join("x.exr"))),
        Some(3) => {
            assert_eq!(
                said.matches("error: ").count(),
                1 + said.matches("\\nerror: ").count(),
                "{said}"
            );
            None
        }
        code => panic!("{scene} in {precision}: {code:?}, {said}"),
    }
}

#[test]
fn mutated_scenes_end_and_light_is_never_negative() {
    let (mut rendered_scenes, mut refused) = (0, 0);
    for scene in found("40-mutated") {
        for precision in ["fast", "guarded"] {
            let Some(pixels) = rendered(&scene, precision) else {
                refused += 1;
                continue;
            };
            rendered_scenes += 1;
            let is_light = |x: &f32| x.is_finite() && *x >= 0.0;
            let bad = pixels.iter().flatten().find(|x| !is_light(x));
            assert_eq!(bad, None, "{} in {precision}", scene.display());
        }
    }
    assert!(rendered_scenes == 0 && refused == 0 || rendered_scenes >= 24 && refused >= 8);
}

/// A ray through two panes with a gap of 1e-9, and through one of CSG, lands where Snell's law
/// says, on a strip that shines.
#[test]
fn light_lands_where_snell_says() {
    for scene in found("35-glass") {
        let name = scene.file_stem().unwrap().to_str().unwrap();
        if !["gap", "pane"].contains(&name) {
            continue;
        }
        for precision in ["guarded", "exact"] {
            let folder = folder();
            let one = ["-o", "x.exr", "--size", "1x1", "--precision", precision];
            let one = [&one[..], &["--integrator", "direct"]].concat();
            let scene = scene.to_str().unwrap();
            let output = lanecast(folder.path(), &[&["render", scene], &one[..]].concat());
            assert!(output.status.success(), "{}", stderr(&output));
            let [[r, ..]] = pixels(&folder.path().join("x.exr"))[..] else {
                panic!("one pixel");
            };
            assert!(r > 0.5, "{name} in {precision}: {r}");
        }
    }
}
