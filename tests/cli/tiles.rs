//! Tiles of pictures: `render --tile`, `merge`, and the axis `tile` of jobs.

use crate::run::{folder, lanecast, names, stderr, stdout};
use std::fs;
use std::path::Path;

const SCENE: &str = "format = 1\n\
    [camera]\neye = [1, 2, 5]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
    [[light]]\nname = \"key\"\npoint = { position = [3, 4, 5], intensity = [90, 90, 90] }\n\
    [material.red]\nbase_color = [0.8, 0.1, 0.1]\n\
    [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
    [shape.block]\nbox = { min = [-2, -1.5, -2], max = [2, -1, 2] }\n\
    [[instance]]\nshape = \"ball\"\nmaterial = \"red\"\n\
    motion = [{ at = 1.0, transform = [{ translate = [1, 0, 0] }] }]\n\
    [[instance]]\nshape = \"block\"\n";

/// A folder with a scene.
fn scene() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    folder
}

fn run(folder: &Path, line: &str) -> std::process::Output {
    lanecast(folder, &line.split_whitespace().collect::<Vec<_>>())
}

fn succeeds(folder: &Path, line: &str) -> String {
    let done = run(folder, line);
    assert_eq!(done.status.code(), Some(0), "{line}: {}", stderr(&done));
    stdout(&done).into()
}

fn fails(folder: &Path, line: &str, code: i32, says: &str) {
    let done = run(folder, line);
    let said = stderr(&done);
    assert_eq!(done.status.code(), Some(code), "{line}: {said}");
    assert!(
        said.contains(says) && said.matches("error: ").count() == 1,
        "{line}: {said}"
    );
}

/// Renders a picture, and the tiles of a grid, which joined have its bits.
fn tiles_join(options: &str, name: &str, (columns, rows): (u32, u32)) {
    let folder = scene();
    let path = folder.path();
    succeeds(path, &format!("render s.toml {options} -o whole.{name}"));
    let mut tiles = Vec::new();
    // In any order, and by any number of threads.
    for number in (0..columns * rows).rev() {
        let threads = 1 + number % 3;
        let tile = format!("--tile {number}/{columns}x{rows} -o {number}.tile --threads {threads}");
        succeeds(path, &format!("render s.toml {options} {tile}"));
        tiles.push(format!("{number}.tile"));
    }
    let said = succeeds(path, &format!("merge {} -o joined.{name}", tiles.join(" ")));
    assert!(
        said.contains(&format!("of {} tiles", columns * rows)),
        "{said}"
    );
    let stem = name.split('.').next().unwrap();
    for ending in [stem, "aov.exr"] {
        let [whole, joined] =
            ["whole", "joined"].map(|n| fs::read(path.join(format!("{n}.{ending}"))).ok());
        assert!(ending != stem || whole.is_some());
        assert!(whole == joined, "{options} {ending}");
    }
}

#[test]
fn tiles_join_to_the_bits_of_the_whole() {
    for (options, name, grid) in [
        ("--size 100x70", "png", (4, 3)),
        (
            "--size 100x70 --aov depth,instance_id,uv --metadata fixed",
            "png",
            (2, 2),
        ),
        ("--size 65x33 --spp 3 --precision fast", "exr", (3, 2)),
        ("--size 70x70 --spp 4 --integrator path", "png", (2, 1)),
        (
            "--size 70x40 --spp 4 --integrator path --background transparent --view-transform agx --bits 16",
            "png",
            (1, 2),
        ),
        (
            "--size 70x70 --spp 4 --integrator path --aov all --metadata fixed",
            "exr",
            (2, 3),
        ),
        (
            "--size 70x70 --spp 4 --shutter 0..0.5 --aov motion --metadata fixed",
            "exr",
            (3, 3),
        ),
        (
            "--size 70x70 --spp 4 --shutter 0..0.5 --integrator path",
            "hdr",
            (3, 3),
        ),
        (
            "--size 66x40 --grid corners --integrator direct",
            "png",
            (2, 1),
        ),
        ("--size 70x70 --accel item-buffer", "exr", (2, 2)),
        ("--size 70x70 --integrator edges", "png", (3, 1)),
        ("--size 70x70 --integrator heat", "png", (1, 3)),
        ("--size 70x70 --integrator ao --spp 2", "png", (2, 2)),
    ] {
        tiles_join(options, name, grid);
    }
}

#[test]
fn frames_have_tiles() {
    let folder = scene();
    let path = folder.path();
    let frame = "render s.toml --size 70x40 --frames 3..4";
    succeeds(path, &format!("{frame} -o whole.png"));
    for number in 0..2 {
        succeeds(
            path,
            &format!("{frame} --tile {number}/2x1 -o {number}.tile"),
        );
    }
    succeeds(path, "merge 0_0003.tile 1_0003.tile -o joined.png");
    let [whole, joined] = ["whole_0003.png", "joined.png"].map(|n| fs::read(path.join(n)).unwrap());
    assert!(whole == joined);
}

#[test]
fn tiles_that_are_developed_differently_need_an_option() {
    let folder = scene();
    let path = folder.path();
    for (number, stops) in [(0, 1), (1, 2)] {
        let tile = format!("--tile {number}/2 --exposure {stops} -o {number}.tile");
        succeeds(path, &format!("render s.toml --size 70x70 {tile}"));
    }
    let says = "it was rendered with another --exposure";
    fails(path, "merge 0.tile 1.tile -o x.png", 3, says);
    for order in ["0.tile 1.tile", "1.tile 0.tile"] {
        succeeds(path, &format!("merge {order} --exposure 1 -o x.png"));
        fs::rename(path.join("x.png"), path.join(order)).unwrap();
    }
    let read = |name: &str| fs::read(path.join(name)).unwrap();
    assert!(read("0.tile 1.tile") == read("1.tile 0.tile"));
}

#[test]
fn tiles_that_do_not_fit_are_refused() {
    let folder = scene();
    let path = folder.path();
    let tile = |more: &str| succeeds(path, &format!("render s.toml --size 70x70 {more}"));
    tile("--tile 0/3 -o a.tile");
    tile("--tile 1/3 -o b.tile");
    tile("--tile 2/3 -o c.tile");
    tile("--tile 1/2 -o wide.tile");
    tile("--tile 2/3 --seed 1 -o seed.tile");
    fails(
        path,
        "merge a.tile c.tile -o x.png",
        2,
        "column 0 and row 32",
    );
    fails(
        path,
        "merge a.tile b.tile c.tile wide.tile -o x.png",
        3,
        "already; leave one of them",
    );
    fails(
        path,
        "merge a.tile b.tile seed.tile -o x.png",
        3,
        "of another picture",
    );
    fs::write(
        path.join("c.tile"),
        &fs::read(path.join("c.tile")).unwrap()[..5000],
    )
    .unwrap();
    fails(
        path,
        "merge a.tile b.tile c.tile -o x.png",
        3,
        "c.tile: tile: its content is not",
    );
    fs::write(path.join("c.tile"), "garbage").unwrap();
    fails(
        path,
        "merge a.tile b.tile c.tile -o x.png",
        3,
        "no tile of a picture",
    );
    fails(
        path,
        "merge a.tile b.tile gone.tile -o x.png",
        3,
        "gone.tile: cannot be read",
    );
    assert!(!names(path).contains(&"x.png".to_owned()));
}

#[test]
fn what_a_tile_cannot_have_is_refused() {
    let folder = scene();
    let path = folder.path();
    for (line, says) in [
        ("--tile 0/2 -o x.png", "name a .tile file"),
        ("-o x.tile", "ask for one with --tile"),
        ("--tile 0/4x3 --size 70x70 -o x.tile", "at most 3x3 tiles"),
        ("--tile 4/2x2 -o x.tile", "4 tiles"),
        ("--tile 0/2 --noise 0.1 -o x.tile", "--noise"),
        ("--tile 0/2 --samples 0..4 -o x.tile", "--samples"),
        (
            "--tile 0/2 --background white -o x.tile",
            "--background transparent",
        ),
        ("--tile 0/2 --metadata all -o x.tile", "--metadata fixed"),
    ] {
        fails(path, &format!("render s.toml {line}"), 2, says);
    }
    assert_eq!(names(path), ["s.toml"]);
    // Without a name it is one of the tile's.
    succeeds(path, "render s.toml --size 70x40 --tile 1/2x1");
    assert_eq!(names(path), ["s.toml", "s_01.tile"]);
}

const JOB: &str = "format = 1\nscene = \"s.toml\"\nview = [\"iso\", \"top\"]\nframe = \"0-6:6\"\n\
    tile = \"2x2\"\n[render]\nsize = \"70x40\"\n";

#[test]
fn tiles_of_a_job_are_tasks() {
    let folder = scene();
    let path = folder.path();
    fs::write(path.join("job.toml"), JOB).unwrap();
    fs::write(path.join("plain.toml"), JOB.replace("tile = \"2x2\"\n", "")).unwrap();
    succeeds(path, "batch plain.toml --out plain");
    let listed = succeeds(path, "batch job.toml --list");
    assert_eq!(listed.lines().count(), 16);
    assert!(
        listed.contains("6  s_iso_0006.png.tiles/02.tile  s.toml  --view=iso"),
        "{listed}"
    );
    succeeds(path, "batch job.toml --out o --shard 1/2");
    let missing = run(path, "batch job.toml --out o --merge");
    assert_eq!(missing.status.code(), Some(1));
    assert!(
        stdout(&missing).contains("2 pictures were joined"),
        "{}",
        stdout(&missing)
    );
    succeeds(path, "batch job.toml --out o --tasks 0-7");
    let joined = succeeds(path, "batch job.toml --out o --merge");
    assert!(
        joined.contains("16 of 16 tasks; 2 pictures were joined, 2 were there"),
        "{joined}"
    );
    for name in names(&path.join("plain"))
        .iter()
        .filter(|n| n.ends_with(".png"))
    {
        let [whole, joined] = ["plain", "o"].map(|f| fs::read(path.join(f).join(name)).unwrap());
        assert!(whole == joined, "{name}");
    }
    // A tile that is made again is joined again.
    fs::write(path.join("s.toml"), SCENE.replace("0.8, 0.1", "0.7, 0.1")).unwrap();
    succeeds(path, "batch job.toml --out o");
    let again = succeeds(path, "batch job.toml --out o --merge");
    assert!(
        again.contains("4 pictures were joined, 0 were there"),
        "{again}"
    );
    // What no record names is not replaced.
    succeeds(path, "batch job.toml --out other");
    fs::write(path.join("other/s_top_0000.png"), "mine").unwrap();
    fails(
        path,
        "batch job.toml --out other --merge",
        2,
        "s_top_0000.png exists",
    );
    assert_eq!(
        fs::read(path.join("other/s_top_0000.png")).unwrap(),
        b"mine"
    );
}

#[test]
fn jobs_with_wrong_tiles_are_refused() {
    let folder = scene();
    let path = folder.path();
    for (job, says) in [
        (JOB.replace("2x2", "4x4"), "at most 3x2 tiles"),
        (JOB.replace("2x2", "x"), "tile: 'x' is no grid"),
        (JOB.replace("\"2x2\"", "true"), "job.toml:5:8"),
        (
            format!("{JOB}tile = \"0/2\"\n"),
            "tile = \"4x4\", beside [render]",
        ),
        (
            format!("{JOB}background = \"white\"\n"),
            "--background transparent",
        ),
    ] {
        fs::write(path.join("job.toml"), &job).unwrap();
        fails(path, "batch job.toml --out o", 3, says);
    }
    assert!(!path.join("o").exists());
}
