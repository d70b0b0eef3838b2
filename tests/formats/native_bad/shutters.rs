//! Faults of shutters, of cameras that move, and of interpolation.

use super::{all, check, toml};

fn camera(more: &str) -> String {
    toml(&format!(
        "[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 40\n{more}"
    ))
}

#[test]
fn shutters() {
    let case = |shutter: &str| camera(&format!("shutter = {shutter}"));
    all(&[
        (case("{}"), &["6:11: the key 'close' is missing"]),
        (
            case("{ close = 0 }"),
            &["6:11: the shutter opens at 0 and closes at 0;"],
        ),
        (
            case("{ open = 0.5, close = 0.2 }"),
            &["opens at 0.5 and closes at 0.2"],
        ),
        (case("{ close = 1, shape = 'iris' }"), &["unknown", "iris"]),
        (
            case("{ close = 1, rise = 0.5 }"),
            &["rise and fall are of a shutter with shape"],
        ),
        (
            case("{ close = 1, shape = 'trapezoid', rise = 0.7, fall = 0.7 }"),
            &["rise = 0.7 and fall = 0.7;", "at most 1"],
        ),
        (case("{ close = 1, ends = 1 }"), &["unknown key 'ends'"]),
        (case("3"), &["expected a table"]),
    ]);
}

#[test]
fn cameras_that_move() {
    let case = |motion: &str| camera(&format!("motion = {motion}"));
    all(&[
        (case("[]"), &["6:10: motion has no keys"]),
        (
            case("[{ at = 0, eye = [1, 0, 5] }]"),
            &["at = 0; it must be above that of the key before"],
        ),
        (
            case("[{ at = 0.5 }, { at = 0.5 }]"),
            &["at = 0.5; it must be above"],
        ),
        (case("[{ at = 1.5 }]"), &["at = 1.5;", "at most 1"]),
        (
            case("[{ at = 1, eye = [0, 0, 0] }]"),
            &["6:11: eye and look_at are the same point"],
        ),
        (case("[{ at = 1, up = [0, 0, 0] }]"), &["up"]),
        // It would look backward, and nowhere on the way.
        (
            case("[{ at = 1, eye = [0, 0, -5] }]"),
            &["at time 0.500000 camera", "looks nowhere"],
        ),
    ]);
}

#[test]
fn meshes_that_deform() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let square = |name: &str, z: f64, triangles: &str| {
        let corners = format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n");
        write(name, &(corners + triangles));
    };
    square("a.obj", 0.0, "f 1 2 3\nf 1 3 4\n");
    square("b.obj", 1.0, "f 1 2 3\nf 1 3 4\n");
    square("other.obj", 1.0, "f 1 2 3\nf 2 3 4\n");
    write("more.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n");
    let load = |motion: &str, more: &str| {
        let text = format!(
            "format = 1\n[shape.m]\nmesh = 'a.obj'\nmotion = {motion}\n{more}\n\
             [[instance]]\nshape = 'm'\n"
        );
        write("scene.toml", &text);
        let loaded = lanecast::load(&folder.path().join("scene.toml"), &Default::default());
        loaded.map_or_else(|e| e.to_string(), |_| "fine".into())
    };
    assert_eq!(load("[{ at = 1, mesh = 'b.obj' }]", ""), "fine");
    for (motion, more, says) in [
        ("[]", "", "motion has no keys"),
        (
            "[{ at = 0, mesh = 'b.obj' }]",
            "",
            "at = 0; it must be above",
        ),
        (
            "[{ at = 1, mesh = 'c.obj' }]",
            "",
            "the mesh file 'c.obj' cannot be read",
        ),
        (
            "[{ at = 1, mesh = 'other.obj' }]",
            "",
            "of the same triangles, in the same order",
        ),
        (
            "[{ at = 1, mesh = 'more.obj' }]",
            "",
            "has 3 vertices, 0 normals and 1 triangles",
        ),
        (
            "[{ at = 1, mesh = 'b.obj' }]",
            "[shape.u]\nunion = ['m', 'm']",
            "it deforms, and nobody follows its inside",
        ),
    ] {
        let said = load(motion, more);
        assert!(said.contains(says), "{motion}: {said}");
    }
    all(&[(
        toml(
            "[shape.x]\nsphere = { center = [0, 0, 0], radius = 1 }\nmotion = [{ at = 1, mesh = 'a.obj' }]",
        ),
        &["4:10: a sphere cannot have a motion of its own"],
    )]);
}

#[test]
fn interpolation() {
    let case = |more: &str| format!("{}{more}\n", toml(""));
    let mirror = "motion = [{ at = 1, transform = [{ scale = [1, -1, 1] }] }]";
    all(&[
        (
            case("interpolation = 'rigid'"),
            &["7:17: interpolation is how things move between"],
        ),
        (
            case(&format!("{mirror}\ninterpolation = 'smooth'")),
            &["smooth", "rigid"],
        ),
        (
            case(&format!("{mirror}\ninterpolation = 'rigid'")),
            &["instance number 0 mirrors at one key and not at the next, and at time 0.5"],
        ),
    ]);
    let half = "motion = [{ at = 1, transform = [{ rotate_y = 180 }] }]";
    // By straight ways it would be flat; what is rigid turns.
    check(
        "scene.toml",
        case(half).as_bytes(),
        &["singular at time 0.5"],
    );
    let rigid = case(&format!("{half}\ninterpolation = 'rigid'"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, rigid).unwrap();
    lanecast::load(&path, &Default::default()).unwrap();
}
