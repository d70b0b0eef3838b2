//! Bad native scenes: each is refused in little time by one message with the place and the
//! fault.

use lanecast::internals::io::{LoadOptions, load};
use std::path::Path;
use std::time::Instant;

mod files;
mod numbers;
mod patterns;
mod polynomials;
mod shutters;

/// Loads and gives the message; fails if the file is accepted or takes long.
fn refusal(path: &Path, what: &str) -> String {
    let start = Instant::now();
    let result = load(path, &LoadOptions::default());
    let message = match result {
        Ok(_) => panic!("this was loaded: {what}"),
        Err(e) => e.to_string(),
    };
    assert!(
        start.elapsed().as_secs() < 30,
        "{what} took {:?}",
        start.elapsed()
    );
    assert!(message.len() < 2000, "a message of {} bytes", message.len());
    message
}

fn check(name: &str, text: &[u8], expected: &[&str]) {
    let misses = misses(name, text, expected);
    assert!(misses.is_empty(), "{misses}");
}

/// What the message lacks, for people.
fn misses(name: &str, text: &[u8], expected: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let shown: String = String::from_utf8_lossy(text).chars().take(400).collect();
    let message = refusal(&path, &shown);
    let missing = expected.iter().filter(|part| !message.contains(**part));
    missing
        .map(|part| format!("{shown}\n  gave {message}\n  not  {part}\n"))
        .collect()
}

/// A sphere and its instance, for cases that are bad elsewhere. Seven lines
/// with the case's first line on line 2.
fn toml(case: &str) -> String {
    format!(
        "format = 1\n{case}\n[shape.ball]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n\
         [[instance]]\nshape = 'ball'\n"
    )
}

/// The case stands on line 2, alone.
fn shape(kind: &str) -> String {
    format!("format = 1\nshape.x.{kind}\n[[instance]]\nshape = 'x'\n")
}

fn all(cases: &[(String, &[&str])]) {
    let misses = cases
        .iter()
        .map(|(text, e)| misses("scene.toml", text.as_bytes(), e));
    let misses: String = misses.collect();
    assert!(misses.is_empty(), "{misses}");
}

#[test]
fn keys_and_types() {
    all(&[
        (
            String::new(),
            &["scene.toml:1:1: the key 'format' is missing"],
        ),
        ("# nothing\n".into(), &["the key 'format' is missing"]),
        (
            "format = 2\nnonsense = 1".into(),
            &["scene.toml:1:10: format 2 is unknown", "format 1"],
        ),
        (
            "format = '1'".into(),
            &["scene.toml:1:10: expected 1, found text"],
        ),
        ("format = 1".into(), &["the scene is empty"]),
        (
            "format = 1\nformat = 1".into(),
            &["scene.toml:2:1: the key 'format' is given twice"],
        ),
        ("format = ".into(), &["scene.toml:1:"]),
        ("format 1".into(), &["scene.toml:1:"]),
        ("format = 1\n[shape.x".into(), &["scene.toml:2:"]),
        (
            toml("backround = [0, 0, 0]"),
            &["scene.toml:2:1: unknown key 'backround'; did you mean 'background'?"],
        ),
        (
            toml("[material.a]\nmetalic = 1"),
            &["scene.toml:3:1: unknown key 'metalic'; did you mean 'metallic'?"],
        ),
        (
            toml("[material.a]\nzzz = 1"),
            &["scene.toml:3:1: unknown key 'zzz'; known are base_color, metallic"],
        ),
        (
            toml("[camera]\neye = [0,0,1]\nlook_at = [0,0,0]\nfov = 35"),
            &["scene.toml:5:1: unknown key 'fov'; did you mean 'fov_y'?"],
        ),
        (
            toml("[shape.y]\nspere = { center = [0, 0, 0], radius = 1 }"),
            &["scene.toml:3:1: unknown key 'spere'; did you mean 'sphere'?"],
        ),
        (
            toml("[shape.y]\nextrude = { points = [], height = 1 }"),
            &["scene.toml:3:1: unknown key 'extrude'; did you mean 'prism'?"],
        ),
        (
            toml("[[light]]\nambient = [1, 1, 1]"),
            &["scene.toml:3:1: unknown key 'ambient'; there is no ambient light; give materials"],
        ),
        (
            toml("ambient = [1, 1, 1]"),
            &["scene.toml:2:1: unknown key 'ambient'; there is no ambient light; give materials"],
        ),
        (
            toml("[[camera]]\neye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 35"),
            &["scene.toml:2:1: cameras are in a list; a scene of this format has one, written"],
        ),
        (
            toml("[camera]\nfov_y = 35\n[camera.top]\neye = [0,0,1]\nlook_at = [0,0,0]"),
            &["scene.toml:4:9: unknown key 'top'"],
        ),
        (
            toml("[camera.top]\neye = [0,0,1]\nlook_at = [0,0,0]\n[camera.side]\nfov_y = 35"),
            &[
                "scene.toml:2:1: the camera's projection is empty; give one of fov_y, half_height, orthographic, k",
            ],
        ),
        (
            toml("background = [-1, 0, 0]"),
            &["scene.toml:2:14: the background has colour = -1"],
        ),
        (
            toml("[[light]]\npiont = { position = [0, 0, 0] }"),
            &["scene.toml:3:1: unknown key 'piont'; did you mean 'point'?"],
        ),
        (
            shape("sphere = { centre = [0, 0, 0], radius = 1 }"),
            &["scene.toml:2:20: unknown key 'centre'; did you mean 'center'?"],
        ),
        (
            shape("sphere = { center = [0, 0, 0], radius = 'one' }"),
            &["scene.toml:2:49: expected a number, found text"],
        ),
        (
            shape("sphere = { center = [0, 0, 0] }"),
            &["scene.toml:2:18: the key 'radius' is missing"],
        ),
        (
            shape("sphere = { center = [0, 0], radius = 1 }"),
            &["scene.toml:2:29: expected 3 values, found 2"],
        ),
        (
            shape("sphere = { center = [0, 0, 0, 0], radius = 1 }"),
            &["scene.toml:2:29: expected 3 values, found 4"],
        ),
        (
            shape("sphere = { center = 0, radius = 1 }"),
            &["scene.toml:2:29: expected a list of 3 values, found a number"],
        ),
        (
            shape("sphere = { center = [0, true, 0], radius = 1 }"),
            &["scene.toml:2:33: expected a number, found true or false"],
        ),
        (
            shape("sphere = { center = [0, 0, 0], radius = 1, radius = 2 }"),
            &["scene.toml:2:52: the key 'radius' is given twice"],
        ),
        (
            shape("sphere = 1979-05-27"),
            &["scene.toml:2:", "expected a table, found a date"],
        ),
        (
            shape("sphere = [1]"),
            &["scene.toml:2:", "expected a table, found a list"],
        ),
        (toml("shape = 3"), &["scene.toml:"]),
        (
            "format = 1\nshape = 3".into(),
            &["scene.toml:2:9: expected a table, found a number"],
        ),
        (
            "format = 1\n[instance]\nshape = 'x'".into(),
            &["scene.toml:2:", "expected a list, found a table"],
        ),
        (
            toml("[camera]\n[camera]"),
            &["scene.toml:3:", "given twice"],
        ),
        (
            toml("[[camera]]\n[[camera]]"),
            &[
                "scene.toml:2:",
                "has one, written as [camera], or several by name",
            ],
        ),
        (
            toml("[material.a]\n[material.a]"),
            &["scene.toml:3:", "the key 'a' is given twice"],
        ),
        (
            toml("[shape.ball]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }"),
            &["scene.toml:4:8: the key 'ball' is given twice"],
        ),
        (
            toml(
                "[[light]]\npoint = { position = [0,0,0], intensity = [1,1,1], falloff = 'linear' }",
            ),
            &["scene.toml:3:62: unknown value 'linear'; known are inverse_square, none"],
        ),
        (
            toml("[[light]]\npoint = { position = [0,0,0], intensity = [1,1,1], falloff = 2 }"),
            &["scene.toml:3:62: expected text in quotes, found a number"],
        ),
        (
            toml("[material.a]\nior = 1e39"),
            &["scene.toml:3:7:", "too large"],
        ),
        (
            toml("background = [0x1ffffffffffffffff, 0, 0]"),
            &["scene.toml:2:15: the number is too large"],
        ),
    ]);
}

#[test]
fn names_and_choices() {
    let child = |text: &str| toml(&format!("[node.a]\nchildren = [{{ {text} }}]"));
    all(&[
        (
            child("shape = 'bal'"),
            &["scene.toml:3:23: there is no shape 'bal'; did you mean 'ball'?"],
        ),
        (
            child("shape = 'ball', material = 'gold'"),
            &["scene.toml:3:42: there is no material 'gold'; define it as [material.NAME]"],
        ),
        (
            child("node = 'b'"),
            &["scene.toml:3:22: there is no node 'b'"],
        ),
        (
            child("shape = 'ball', node = 'a'"),
            &["scene.toml:3:38: both shape and node are given"],
        ),
        (
            child("material = 'gold'"),
            &["scene.toml:3:13: none of shape, node and scene is given"],
        ),
        (child("node = 'a'"), &["nodes form a cycle: 'a' → 'a'"]),
        (
            toml(
                "[node.a]\nchildren = [{ node = 'b' }]\n[node.b]\nchildren = [{ node = 'c' }]\n[node.c]\nchildren = [{ node = 'a' }]",
            ),
            &["nodes form a cycle: 'a' → 'b' → 'c' → 'a'"],
        ),
        (
            child("shape = 'ball', transform = [{ rotate_w = 1 }]"),
            &["scene.toml:3:46: unknown key 'rotate_w'; did you mean 'rotate"],
        ),
        (
            child("shape = 'ball', transform = [{ scale = 2, rotate_x = 3 }]"),
            &["scene.toml:3:44: a transform step has rotate_x and scale at once"],
        ),
        (
            child("shape = 'ball', transform = [{}]"),
            &["scene.toml:3:44: a transform step is empty; give one of translate"],
        ),
        (
            child("shape = 'ball', transform = { scale = 2 }"),
            &["scene.toml:3:43: expected a list, found a table"],
        ),
        (
            child("shape = 'ball', transform = [{ scale = [1, 2] }]"),
            &["scene.toml:3:54:", "a list of 3 numbers"],
        ),
        (
            child("shape = 'ball', transform = [{ scale = 'big' }]"),
            &["scene.toml:3:54:", "a number or a list of 3 numbers"],
        ),
        (
            child("shape = 'ball', transform = [{ matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }]"),
            &["scene.toml:3:56: expected 4 values, found 3"],
        ),
        (
            child("shape = 'ball', transform = [{ rotate = { axis = [0, 0, 0], degrees = 3 } }]"),
            &["scene.toml:3:64: axis is (0, 0, 0)"],
        ),
        (
            toml("[[light]]\n"),
            &["scene.toml:2:1: a light is empty; give one of point, spot, directional, rectangle"],
        ),
        (
            toml(
                "[[light]]\nrectangle = { center = [0,0,0], edge_u = [1,0,0], edge_v = [1,1,0], radiance = [1,1,1] }",
            ),
            &[
                "light 0 is degenerate: its edges are not at right angles",
                "polygon",
            ],
        ),
        (
            toml(
                "[[light]]\nrectangle = { center = [0,0,0], edge_u = [1,0,0], edge_v = [0,0,0], radiance = [1,1,1] }",
            ),
            &["light 0 is degenerate: it has no area"],
        ),
        (
            toml("[[light]]\nrectangle = { center = [0,0,0], size = [1,0], radiance = [1,1,1] }"),
            &["unknown key 'size'"],
        ),
        (
            toml(
                "[[light]]\ndisc = { center = [0,0,0], normal = [0,0,0], radius = 1, radiance = [1,1,1] }",
            ),
            &["scene.toml:3:", "normal is (0, 0, 0)"],
        ),
        (
            toml(
                "[[light]]\ndisc = { center = [0,0,0], normal = [0,1,0], radius = 0, radiance = [1,1,1] }",
            ),
            &["scene.toml:3:", "radius = 0; it must be greater than 0"],
        ),
        (
            toml(
                "[[light]]\ndisc = { center = [0,0,0], normal = [0,1,0], radius = 1, radiance = [-1,1,1] }",
            ),
            &["light 0", "radiance", "0 or greater"],
        ),
        (
            toml(
                "[[light]]\npoint = { position = [0,0,0], intensity = [1,1,1] }\ndirectional = { direction = [0,1,0], irradiance = [1,1,1] }",
            ),
            &["scene.toml:2:1: a light has point and directional at once"],
        ),
        (
            toml("[shape.y]"),
            &["scene.toml:2:8: shape 'y' is empty; give one of sphere, ellipsoid"],
        ),
        (
            toml(
                "[shape.y]\nsphere = { center = [0,0,0], radius = 1 }\nbox = { min = [0,0,0], max = [1,1,1] }",
            ),
            &["scene.toml:2:8: shape 'y' has sphere and box at once"],
        ),
        (
            toml("[shape.y]\nsphere = { center = [0,0,0], radius = 1 }\nopen = true"),
            &["scene.toml:4:8: a sphere cannot be open"],
        ),
        (
            shape("polyhedron = {}"),
            &[
                "scene.toml:2:",
                "shape 'x': a polyhedron needs planes or points",
            ],
        ),
        (
            shape("polyhedron = { planes = [], points = [] }"),
            &["shape 'x' has both planes and points"],
        ),
    ]);
}

#[test]
fn csg_solids() {
    let solid = |text: &str| {
        format!(
            "format = 1\nshape.x.{text}\n[shape.ball]\n\
             sphere = {{ center = [0, 0, 0], radius = 1 }}\n[shape.sheet]\n\
             polygon.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n[shape.pipe]\n\
             cylinder = {{ base = [0, 0, 0], top = [0, 1, 0], radius = 1 }}\nopen = true\n\
             [material.gold]\n[[instance]]\nshape = 'x'\n"
        )
    };
    all(&[
        (
            solid("union = ['ball', 'bal']"),
            &["scene.toml:2:26: there is no shape 'bal'; did you mean 'ball'?"],
        ),
        (
            solid("union = ['ball', { shape = 'pype' }]"),
            &["scene.toml:2:36: there is no shape 'pype'; did you mean 'pipe'?"],
        ),
        (
            solid("union = [{ shape = 'ball', material = 'gould' }]"),
            &["scene.toml:2:47: there is no material 'gould'; did you mean 'gold'?"],
        ),
        (
            solid("union = ['ball']\nshape.x.material = 'gould'"),
            &["scene.toml:3:20: there is no material 'gould'; did you mean 'gold'?"],
        ),
        (
            solid("union = [{ shape = 'ball', transfrom = [] }]"),
            &["scene.toml:2:36: unknown key 'transfrom'; did you mean 'transform'?"],
        ),
        (
            solid("union = [{ material = 'gold' }]"),
            &["scene.toml:2:18: the key 'shape' is missing"],
        ),
        (
            solid("union = 'ball'"),
            &["scene.toml:2:17: expected a list, found text"],
        ),
        (
            solid("union = [3]"),
            &["scene.toml:2:18:", "one operand, the name of a shape"],
        ),
        (
            solid("union = [['ball', 'ball']]"),
            &["scene.toml:2:18: expected one operand, found a list of 2; make them one solid"],
        ),
        (
            solid("complement = ['ball', 'ball']"),
            &["scene.toml:2:22: expected one operand, found a list of 2; make them one solid"],
        ),
        (
            solid("xor = []"),
            &["scene.toml:2:7: CSG solid 'x' is empty: it has no operands"],
        ),
        (
            solid("union = ['ball']\nshape.x.xor = ['ball']"),
            &["scene.toml:2:7: shape 'x' has union and xor at once"],
        ),
        (
            solid("union = ['ball']\nshape.x.open = true"),
            &["scene.toml:3:16: a union cannot be open"],
        ),
        (
            solid("union = ['ball']\nshape.x.tolerance = -1e-3"),
            &[
                "scene.toml:2:7: CSG solid 'x' has tolerance = -0.001",
                "0 or greater",
            ],
        ),
        (
            solid("sphere = { center = [0, 0, 0], radius = 1 }\nshape.x.tolerance = 1"),
            &["scene.toml:3:21: a sphere cannot have a tolerance; only a union"],
        ),
        (
            solid("sphere = { center = [0, 0, 0], radius = 1 }\nshape.x.material = 'gold'"),
            &["scene.toml:3:20: a sphere cannot have a material of its own; only a union"],
        ),
        (
            solid("difference = ['ball', 'sheet']"),
            &[
                "scene.toml:2:7: CSG solid 'x' has polygon 'sheet' as an operand",
                "use a solid",
            ],
        ),
        (
            solid("difference = ['ball', 'pipe']"),
            &[
                "scene.toml:2:7: CSG solid 'x' has cylinder 'pipe' as an operand",
                "leave out 'open'",
            ],
        ),
        (
            solid("difference = ['ball', 'x']"),
            &["shapes form a cycle: CSG solid 'x' → CSG solid 'x'"],
        ),
        (
            solid("xor = ['y']\nshape.y.union = ['z']\nshape.z.complement = 'x'"),
            &["→ CSG solid 'y' → CSG solid 'z'", "made of itself"],
        ),
        (
            solid("union = [{ shape = 'ball', transform = [{ scale = 0 }] }]"),
            &["scene.toml:2:7: an operand of CSG solid 'x'", "singular"],
        ),
    ]);
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
    std::fs::write(folder.path().join("tetra.obj"), obj).unwrap();
    let path = folder.path().join("scene.toml");
    let text = "format = 1\n[shape.tetra]\nmesh = 'tetra.obj'\n[shape.x]\nunion = ['tetra']\n\
                [[instance]]\nshape = 'x'\n";
    std::fs::write(&path, text).unwrap();
    let said = refusal(&path, text);
    assert!(
        said.contains("scene.toml:4:8: CSG solid 'x' has mesh 'tetra' as an operand"),
        "{said}"
    );
    let why = "it is not closed and has no inside: 3 open edges (of one triangle only), the first \
               from (0, 1, 0) to (1, 0, 0) of triangle 0";
    assert!(said.contains(why), "{said}");
}

/// What only the scene's check finds still has its line.
#[test]
fn the_check_of_the_scene_knows_the_lines() {
    let text = "format = 1\n\
        [camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
        [[light]]\npoint = { position = [0, 5, 0], intensity = [1, 1, 1] }\n\
        [[light]]\npoint = { position = [0, 5, 0], intensity = [2, 2, 2] }\n\
        [material.dull]\nroughness = 0.5\n\
        [material.shiny]\nroughness = 0.25\n\
        [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
        [shape.block]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n\
        [node.one]\nchildren = [{ shape = 'ball' },\n  { shape = 'block', material = 'dull' }]\n\
        [node.two]\nchildren = [\n  { node = 'one' },\n  { shape = 'ball' }]\n\
        [[instance]]\nnode = 'two'\n\
        [[instance]]\nshape = 'ball'\n";
    assert_eq!(
        text.lines().nth(16),
        Some("box = { min = [0, 0, 0], max = [1, 1, 1] }")
    );
    let mut missed = String::new();
    for (from, to, expected) in [
        (
            "0], max = [1, 1, 1]",
            "0], max = [0, 1, 1]",
            ":16:8: box 'block' is degenerate",
        ),
        (
            "radius = 1",
            "radius = -1",
            ":14:8: sphere 'ball' has radius",
        ),
        (
            "roughness = 0.25",
            "roughness = 7",
            ":12:11: material 'shiny' has roughness",
        ),
        ("[2, 2, 2]", "[2, -2, 2]", ":8:1: light 1 has intensity"),
        (
            "material = 'dull'",
            "transform = [{ scale = 0 }]",
            ":20:3: a child of node 'one'",
        ),
        (
            "{ node = 'one' }",
            "{ node = 'two' }",
            ":21:7: nodes form a cycle",
        ),
        (
            "shape = 'ball'\n",
            "shape = 'ball'\ntransform = [{ scale = 0 }]\n",
            ":27:1: instance",
        ),
    ] {
        let (head, tail) = text.rsplit_once(from).unwrap();
        let bad = format!("{head}{to}{tail}");
        missed += &misses("scene.toml", bad.as_bytes(), &[expected]);
    }
    assert!(missed.is_empty(), "{missed}");
}
