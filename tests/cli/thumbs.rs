//! `lanecast thumbs`: pictures of all scene files of a folder, and their page.

use crate::run::{folder, lanecast, names, stderr, stdout};
use std::fs;

const BALL: &str = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                    [[instance]]\nshape = \"ball\"\n";
const TRIANGLE: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";
const SMALL: [&str; 7] = [
    "thumbs", "parts", "--out", "t", "--size", "16x16", "--spp=1",
];

#[test]
fn every_scene_has_a_picture_or_a_reason_on_the_page() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir_all(path.join("parts/deep & dark")).unwrap();
    fs::create_dir_all(path.join("parts/.hidden")).unwrap();
    let write = |name: &str, text: &str| fs::write(path.join("parts").join(name), text).unwrap();
    write("a.toml", BALL);
    write("a.obj", TRIANGLE);
    write("deep & dark/[b]*.obj", TRIANGLE);
    write("@c.OBJ", TRIANGLE);
    write("broken.stl", "no mesh");
    write(".hidden/d.obj", TRIANGLE);
    // What is no scene.
    write("Cargo.toml", "[package]\nname = \"x\"\n");
    write("notes.txt", "");

    let done = lanecast(path, &SMALL);
    assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    assert!(
        stderr(&done).contains("parts/broken.stl: "),
        "{}",
        stderr(&done)
    );
    assert!(stdout(&done).contains("4 pictures"), "{}", stdout(&done));
    assert_eq!(names(&path.join("t")), ["index.html", "parts", "records"]);
    let pictures = ["@c.OBJ.png", "a.obj.png", "a.toml.png", "deep & dark"];
    assert_eq!(names(&path.join("t/parts")), pictures);
    assert_eq!(names(&path.join("t/parts/deep & dark")), ["[b]*.obj.png"]);
    let picture = image::open(path.join("t/parts/a.toml.png"))
        .unwrap()
        .to_rgba8();
    assert_eq!(picture.dimensions(), (16, 16));
    // The ball fills the middle; the corners are transparent.
    assert_eq!(
        (picture.get_pixel(8, 8)[3], picture.get_pixel(0, 0)[3]),
        (255, 0)
    );
    let page = fs::read_to_string(path.join("t/index.html")).unwrap();
    assert!(
        page.contains("src=\"parts/deep%20%26%20dark/%5Bb%5D%2A.obj.png\""),
        "{page}"
    );
    assert!(page.contains("<dt>parts/broken.stl</dt>"), "{page}");
    assert!(
        page.contains("<figcaption>parts/@c.OBJ</figcaption>"),
        "{page}"
    );
    assert_eq!(page.matches("<img").count(), 4);

    // Only what changed is rendered again.
    write(
        "broken.stl",
        "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
          vertex 0 1 0\nendloop\nendfacet\nendsolid x\n",
    );
    let done = lanecast(path, &SMALL);
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(stdout(&done).contains("1 pictures") && stdout(&done).contains("4 were there"));
    let page = fs::read_to_string(path.join("t/index.html")).unwrap();
    assert_eq!(page.matches("<img").count(), 5);
    assert!(!page.contains("<dt>"));
}

#[test]
fn z_up_turns_the_files_that_do_not_say() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir_all(path.join("parts")).unwrap();
    // A mast, and a ball that no turn changes.
    let mast = "v -1 0 0\nv 1 0 0\nv 0 0 9\nv 0 1 0\nf 1 2 3\nf 2 4 3\nf 4 1 3\n";
    fs::write(path.join("parts/mast.obj"), mast).unwrap();
    fs::write(path.join("parts/ball.toml"), BALL).unwrap();
    let pictures = |out: &str, more: &[&str]| {
        let line = [
            &["thumbs", "parts", "--out", out, "--size=32x32", "--spp=1"],
            more,
        ]
        .concat();
        let done = lanecast(path, &line);
        assert!(done.status.success(), "{}", stderr(&done));
        ["ball.toml.png", "mast.obj.png"].map(|name| {
            let picture = image::open(path.join(out).join("parts").join(name)).unwrap();
            let covered = picture.to_rgba8();
            let covered: Vec<_> = covered
                .enumerate_pixels()
                .filter(|(_, _, p)| p[3] > 0)
                .collect();
            let height = |y: u32| covered.iter().any(|(_, at, _)| *at == y);
            (0..32).filter(|y| height(*y)).count()
        })
    };
    let [ball, lying] = pictures("as_it_is", &[]);
    let [same, standing] = pictures("turned", &["--z-up"]);
    assert_eq!(ball, same);
    assert!(standing > 20 && lying < standing - 5, "{standing} {lying}");
}

#[test]
fn other_pages_and_empty_folders_are_left_alone() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir_all(path.join("parts")).unwrap();
    let none = lanecast(path, &SMALL);
    assert_eq!(none.status.code(), Some(3));
    assert!(
        stderr(&none).contains("no scene file below parts"),
        "{}",
        stderr(&none)
    );
    fs::write(path.join("parts/a.obj"), TRIANGLE).unwrap();
    let into_itself = lanecast(path, &["thumbs", "parts", "--out", "parts"]);
    assert_eq!(into_itself.status.code(), Some(2));
    assert!(stderr(&into_itself).contains("is the folder that is searched"));
    fs::create_dir_all(path.join("t")).unwrap();
    fs::write(path.join("t/index.html"), "mine").unwrap();
    let refused = lanecast(path, &SMALL);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("t/index.html exists"),
        "{}",
        stderr(&refused)
    );
    assert_eq!(names(&path.join("t")), ["index.html"]);
    let missing = lanecast(path, &["thumbs", "nowhere", "--out", "u"]);
    assert_eq!(missing.status.code(), Some(3), "{}", stderr(&missing));
    let wrong = lanecast(path, &["thumbs", "parts", "--out", "u", "--size", "big"]);
    assert!(
        stderr(&wrong).contains("invalid value 'big'"),
        "{}",
        stderr(&wrong)
    );
}

/// As caches of models have them: links of names with an ending, to files of none.
#[cfg(unix)]
#[test]
fn links_are_shown_under_their_own_names() {
    use std::os::unix::fs::symlink;
    let folder = folder();
    let path = folder.path();
    fs::create_dir_all(path.join("parts")).unwrap();
    fs::create_dir_all(path.join("blobs")).unwrap();
    fs::write(path.join("blobs/abc123"), TRIANGLE).unwrap();
    symlink("../blobs/abc123", path.join("parts/model.obj")).unwrap();
    let done = lanecast(path, &SMALL);
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(names(&path.join("t/parts")), ["model.obj.png"]);
    let page = fs::read_to_string(path.join("t/index.html")).unwrap();
    assert!(
        page.contains("<figcaption>parts/model.obj</figcaption>"),
        "{page}"
    );
    // Single files count from the current folder.
    let alone = ["thumbs", "model.obj", "--out", "../u", "--size", "16x16"];
    let done = lanecast(&path.join("parts"), &alone);
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(names(&path.join("u/parts")), ["model.obj.png"]);
}

/// A file name that no job can hold, and pictures of one name.
#[cfg(unix)]
#[test]
fn names_that_cannot_be_fail_alone() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let path = folder.path();
    fs::create_dir_all(path.join("parts")).unwrap();
    let write = |name: &[u8]| {
        let file = path.join("parts").join(OsStr::from_bytes(name));
        fs::write(file, TRIANGLE).unwrap();
    };
    for name in [&b"a\nb.obj"[..], b"a_b.obj", b"bad\xff.obj", b"ok.obj"] {
        write(name);
    }
    let done = lanecast(path, &SMALL);
    let said = stderr(&done);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(stdout(&done).contains("2 pictures"), "{}", stdout(&done));
    assert_eq!(names(&path.join("t/parts")), ["a_b.obj.png", "ok.obj.png"]);
    assert!(
        said.contains("failed: parts/a\\nb.obj: its picture would be"),
        "{said}"
    );
    assert!(
        said.contains("error: 2 of 4 could not be rendered"),
        "{said}"
    );
    let page = fs::read_to_string(path.join("t/index.html")).unwrap();
    assert!(page.contains("<h2>2 without a picture</h2>"), "{page}");
    assert!(page.contains("its name is not UTF-8"), "{page}");
    assert_eq!(page.matches("<img").count(), 2);

    // Of these alone there is a page, too.
    for name in ["a\nb.obj", "a_b.obj", "ok.obj"] {
        fs::remove_file(path.join("parts").join(name)).unwrap();
    }
    fs::remove_dir_all(path.join("t")).unwrap();
    let done = lanecast(path, &SMALL);
    assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    assert!(path.join("t/index.html").is_file());
}
