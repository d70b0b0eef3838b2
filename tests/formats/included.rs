//! `include`: definitions of other files.

use crate::placed::{bits, refused, scene, seen, warning};

#[test]
fn included_definitions_are_as_if_they_were_in_the_file() {
    let materials = "[material.red]\nbase_color = [1.0, 0.0, 0.0]\n";
    let parts = "include = ['../materials.toml']\n[shape.ball]\n\
                 sphere = { center = [0, 0, 0], radius = 1 }\n\
                 [node.two]\nchildren = [{ shape = 'ball', material = 'red' },\n\
                 { shape = 'ball', transform = [{ translate = [3, 0, 0] }] }]\n\
                 [[instance]]\nshape = 'ball'\n";
    let parts = parts.replace("../", "");
    let main = "include = ['materials.toml', 'parts.toml']\n[material.blue]\n\
                [[instance]]\nnode = 'two'\nmaterial = 'blue'\n[[instance]]\nshape = 'ball'\n";
    let files = [
        ("main.toml", main),
        ("materials.toml", materials),
        ("parts.toml", &*parts),
    ];
    let one = format!(
        "{materials}{}[material.blue]\n[[instance]]\nnode = 'two'\nmaterial = 'blue'\n\
         [[instance]]\nshape = 'ball'\n",
        parts
            .replace("include = ['materials.toml']\n", "")
            .replace("[[instance]]\nshape = 'ball'\n", "")
    );
    let [several, one] = [scene(&files), scene(&[("main.toml", &one)])];
    assert_eq!(seen(&several), seen(&one));
    assert_eq!(bits(&several), bits(&one));
    assert_eq!(several.materials.rows, one.materials.rows);
    assert_eq!(
        warning(&files),
        "not imported: 1 × instance of an included file"
    );
}

#[test]
fn includes_that_cannot_be_are_refused() {
    let see = "[shape.b]\nsphere = { center = [0, 0, 0], radius = 1 }\n[[instance]]\nshape = 'b'\n";
    let main = |include: &str| format!("include = ['{include}']\n{see}");
    refused(
        &[
            ("main.toml", &main("a.toml")),
            (
                "a.toml",
                "[shape.b]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n",
            ),
        ],
        &[
            "main.toml:3:8: the shape 'b' is defined here and at ",
            "a.toml:2:8",
        ],
    );
    refused(
        &[
            ("main.toml", &main("a.toml")),
            ("a.toml", "include = ['main.toml']\n"),
        ],
        &[
            "a.toml:2:12: files include each other in a circle: ",
            "main.toml → ",
            "a.toml → ",
        ],
    );
    refused(
        &[("main.toml", &main("main.toml"))],
        &["main.toml:2:12: files include each other in a circle"],
    );
    let gone = [("main.toml", &*main("gone.toml"))];
    refused(
        &gone,
        &["main.toml:2:12: the included file 'gone.toml' cannot be read"],
    );
    refused(
        &[("main.toml", &main("a.obj")), ("a.obj", "")],
        &["main.toml:2:12: the included file 'a.obj' is no .toml or .json"],
    );
    refused(
        &[
            ("main.toml", &main("a.toml")),
            ("a.toml", "[node.n]\nchildren = [{ shape = 'c' }]\n"),
        ],
        &["a.toml:3:23: there is no shape 'c'"],
    );
    // An error of the finished scene has the included file's line.
    let flat = "[shape.c]\nsphere = { center = [0, 0, 0], radius = -1 }\n";
    refused(
        &[("main.toml", &main("a.toml")), ("a.toml", flat)],
        &["a.toml:2:8: sphere 'c' has radius = -1"],
    );
}
