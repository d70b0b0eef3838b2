//! Parts of pictures: `render --samples` and `merge`.

use crate::run::{fails, folder, lanecast, names, stderr, stdout};
use std::fs;
use std::path::Path;

const SCENE: &str = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                     [[instance]]\nshape = \"ball\"\n";

fn scene() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    folder
}

fn part(folder: &Path, samples: &str, to: &str, more: &[&str]) {
    sized_part(folder, "21x13", samples, to, more);
}

fn sized_part(folder: &Path, size: &str, samples: &str, to: &str, more: &[&str]) {
    let arguments = [
        "render",
        "s.toml",
        "--size",
        size,
        "--samples",
        samples,
        "-o",
        to,
    ];
    let done = lanecast(folder, &[&arguments, more].concat());
    assert!(done.status.success(), "{}", stderr(&done));
}

/// Textures are looked up alike, whatever the number of a part's samples.
#[test]
fn parts_of_textured_pictures_add_up_to_the_whole() {
    let folder = folder();
    let path = folder.path();
    let texels = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8 * 4, y as u8 * 3, 9]));
    texels.save(path.join("t.png")).unwrap();
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 9 0\nvt 9 9\nvt 0 9\n\
                  f 1/1 2/2 3/3 4/4\n";
    fs::write(path.join("square.obj"), square).unwrap();
    let scene = "format = 1\n[material.m]\nbase_color_texture = { file = \"t.png\" }\n\
                 [shape.square]\nmesh = \"square.obj\"\n\
                 [[instance]]\nshape = \"square\"\nmaterial = \"m\"\n";
    fs::write(path.join("s.toml"), scene).unwrap();
    let whole = "render s.toml --size 21x13 --spp 16 -o whole.exr";
    let whole = lanecast(path, &whole.split(' ').collect::<Vec<_>>());
    assert!(whole.status.success(), "{}", stderr(&whole));
    part(path, "0..8", "0.sums", &[]);
    part(path, "8..16", "1.sums", &[]);
    let merged = lanecast(path, &["merge", "-o", "merged.exr", "0.sums", "1.sums"]);
    assert!(merged.status.success(), "{}", stderr(&merged));
    let [whole, merged] =
        ["whole.exr", "merged.exr"].map(|name| fs::read(path.join(name)).unwrap());
    assert!(whole == merged);
}

#[test]
fn parts_add_up_to_the_bits_of_the_whole() {
    let folder = scene();
    let path = folder.path();
    for (spp, parts, more) in [
        ("128", &["0..64", "64..128"][..], &[][..]),
        (
            "11",
            &["8..10", "10..11", "0..8"],
            &["--background", "transparent"],
        ),
        (
            "4",
            &["0..4"],
            &["--integrator", "ao", "--sampler", "independent"],
        ),
    ] {
        for name in ["whole.exr", "whole.png"] {
            let whole = [
                "render", "s.toml", "--size", "21x13", "--spp", spp, "-o", name,
            ];
            assert!(lanecast(path, &[&whole, more].concat()).status.success());
            let files: Vec<String> = (0..parts.len()).map(|i| format!("{i}.sums")).collect();
            for ((samples, file), threads) in parts.iter().zip(&files).zip(["1", "2", "3"]) {
                part(
                    path,
                    samples,
                    file,
                    &[more, &["--threads", threads]].concat(),
                );
            }
            let to = name.replace("whole", "merged");
            let merge: Vec<&str> = ["merge", "-o", &to]
                .into_iter()
                .chain(files.iter().map(String::as_str))
                .collect();
            let merged = lanecast(path, &merge);
            assert!(merged.status.success(), "{}", stderr(&merged));
            assert!(stdout(&merged).contains(&format!("21x13, {spp} spp")));
            let [whole, merged] = [name, &to].map(|name| fs::read(path.join(name)).unwrap());
            assert!(whole == merged, "{spp} {name}");
        }
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let folder = scene();
    let path = folder.path();
    part(path, "0..4", "a.sums", &[]);
    part(path, "4..8", "b.sums", &[]);
    part(path, "4..6", "half.sums", &[]);
    part(path, "8..16", "c.sums", &[]);
    part(path, "4..8", "seed.sums", &["--seed", "1"]);
    sized_part(path, "22x13", "4..8", "large.sums", &[]);
    fs::write(path.join("s.toml"), SCENE.replace("= 1 }", "= 1.5 }")).unwrap();
    part(path, "4..8", "scene.sums", &[]);
    let mut damaged = fs::read(path.join("b.sums")).unwrap();
    *damaged.last_mut().unwrap() ^= 1;
    fs::write(path.join("damaged.sums"), &damaged).unwrap();
    fs::write(path.join("short.sums"), &damaged[..100]).unwrap();
    let before = names(path);
    for (parts, code, says) in [
        (
            &["a.sums", "c.sums"][..],
            2,
            "samples 4..8 are missing before c.sums",
        ),
        (&["b.sums"], 2, "samples 0..4 are missing before b.sums"),
        (&["a.sums", "b.sums", "a.sums"], 3, "leave one of them out"),
        (
            &["a.sums", "half.sums", "b.sums"],
            3,
            "in half.sums already",
        ),
        (
            &["a.sums", "seed.sums"],
            3,
            "of another scene, camera or setting",
        ),
        (
            &["a.sums", "scene.sums"],
            3,
            "of another scene, camera or setting",
        ),
        (&["a.sums", "large.sums"], 3, "it has 22x13 pixels"),
        (&["a.sums", "damaged.sums"], 3, "not what was written"),
        (&["a.sums", "short.sums"], 3, "100 bytes"),
        (&["a.sums", "none.sums"], 3, "none.sums: cannot be read"),
        (&["s.toml"], 3, "s.toml"),
        (&[], 2, "PART"),
    ] {
        let output = lanecast(path, &[&["merge", "-o", "x.exr"], parts].concat());
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{parts:?}: {said}");
        assert!(said.contains(says), "{parts:?}: {said}");
        assert_eq!(said.matches("error: ").count(), 1, "{parts:?}: {said}");
        assert_eq!(names(path), before, "{parts:?}");
    }
    let output = lanecast(path, &["merge", "a.sums", "-o", "a.sums"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn ranges_that_are_no_parts_are_refused_with_the_remedy() {
    let with = |more: &[&'static str]| {
        [
            &[
                "render",
                "--integrator",
                "path",
                "-o",
                "x.sums",
                "--samples",
            ],
            more,
        ]
        .concat()
    };
    fails(&with(&["64..192"]), 2, "render 64..128, 128..192 and merge");
    fails(&with(&["0..6"]), 2, "render 0..4, 4..6 and merge");
    for wrong in ["6", "6..6", "7..6", "0..70000", "..4", "-1..4"] {
        fails(&with(&[wrong]), 2, "such as 64..128");
    }
    fails(&with(&["0..4", "--spp", "4"]), 2, "cannot be used with");
    fails(&with(&["0..4", "--noise", "0.1"]), 2, "cannot be used with");
    fails(&with(&["0..4", "--frames", "4"]), 2, "cannot be used with");
    fails(
        &with(&["0..4", "--sampler", "stratified"]),
        2,
        "independent",
    );
    fails(&with(&["0..4", "--grid", "corners"]), 2, "--grid corners");
    fails(
        &with(&["0..4", "--background", "white"]),
        2,
        "ask for --background transparent",
    );
    let png = [
        "render",
        "--integrator",
        "path",
        "-o",
        "x.png",
        "--samples",
        "0..4",
    ];
    fails(&png, 2, "name a .sums file");
    let direct = [
        "render",
        "--integrator",
        "direct",
        "-o",
        "x.sums",
        "--samples",
        "0..4",
    ];
    fails(&direct, 2, "--integrator path");
}
