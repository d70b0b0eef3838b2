//! Numbers that no scene may have, and faults of motions.

use super::*;

#[test]
fn numbers_that_are_no_scene() {
    let view = |keys: &str| toml(&format!("[camera]\n{keys}"));
    let placed = |steps: &str| format!("{}transform = [{steps}]\n", toml(""));
    all(&[
        (
            toml("[[light]]\nsky = { sun_direction = [0, -1, 0] }"),
            &["sun_direction points below the horizon"],
        ),
        (
            toml("[[light]]\nsky = { sun_direction = [0, 1, 0], turbidity = 1e9 }"),
            &["turbidity is 1000000000; it must be from 1.7 to 10"],
        ),
        (
            shape("sphere = { center = [nan, 0, 0], radius = 1 }"),
            &["scene.toml:2:30: NaN is not a finite number"],
        ),
        (
            shape("sphere = { center = [0, 0, 0], radius = inf }"),
            &["scene.toml:2:49: inf is not a finite number"],
        ),
        (
            shape("sphere = { center = [0, 0, -inf], radius = 1 }"),
            &["-inf is not a finite number"],
        ),
        (
            shape("sphere = { center = [0, 0, 1e999], radius = 1 }"),
            &["scene.toml:2:36: inf is not a finite number"],
        ),
        (
            shape("sphere = { center = [0, 0, 0], radius = 0 }"),
            &["sphere 'x' has radius = 0; it must be greater than 0"],
        ),
        (
            shape("sphere = { center = [0, 0, 0], radius = -1 }"),
            &["sphere 'x' has radius = -1"],
        ),
        (
            shape("quadric = { coefficients = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1] }"),
            &["quadric 'x'", "no surface"],
        ),
        (
            shape("quadric = { coefficients = [1, 0, 0, 0, 0, 0, 0, 0, 1] }"),
            &["10"],
        ),
        (
            shape("ellipsoid = { center = [0, 0, 0], radii = [1, 0, 1] }"),
            &["ellipsoid 'x' has radii = 0"],
        ),
        (
            shape("half_space = { normal = [0, 0, 0], offset = 0 }"),
            &["half-space 'x' is degenerate: its normal is (0, 0, 0)"],
        ),
        (
            shape("box = { min = [0, 0, 0], max = [1, 0, 1] }"),
            &["box 'x' is degenerate"],
        ),
        (
            shape("cylinder = { base = [0, 1, 0], top = [0, 1, 0], radius = 1 }"),
            &["cylinder 'x' is degenerate: its base and top"],
        ),
        (
            shape("cone = { base = [0,0,0], top = [0,1,0], base_radius = 0, top_radius = 0 }"),
            &["cone 'x' has base_radius + top_radius = 0"],
        ),
        (
            shape("cone = { base = [0,0,0], top = [0,1,0], base_radius = -1, top_radius = 1 }"),
            &["cone 'x' has base_radius = -1"],
        ),
        (
            shape("polygon = { points = [[0, 0, 0], [1, 0, 0]] }"),
            &["polygon 'x' is empty", "fewer than 3 points"],
        ),
        (
            shape("polygon = { points = [] }"),
            &["polygon 'x' is empty"],
        ),
        (
            shape("polygon = { points = [[0, 0, 0], [1, 1, 1], [2, 2, 2]] }"),
            &["polygon 'x' is degenerate: its points lie on a line"],
        ),
        (
            shape("polygon = { points = [[0, 0, 0], [2, 1, 0], [2, 0, 0], [0, 1, 0]] }"),
            &["polygon 'x' is degenerate: its edges cross"],
        ),
        (
            shape("polygon = { points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1]] }"),
            &["polygon 'x' is degenerate: its points are not in one plane"],
        ),
        (
            shape("polyhedron = { planes = [{ normal = [0, 1, 0], offset = 1 }] }"),
            &["scene.toml:2:33: shape 'x': the planes do not enclose a bounded volume"],
        ),
        (
            shape(
                "polyhedron = { planes = [{ normal = [0, 1, 0], offset = -1 }, { normal = [0, -1, 0], offset = -1 }] }",
            ),
            &["shape 'x': the planes enclose nothing"],
        ),
        (
            shape("polyhedron = { planes = [{ normal = [0, 0, 0], offset = -1 }] }"),
            &["shape 'x': plane 0 (from 0) has no finite normal"],
        ),
        (
            shape("polyhedron = { points = [[0,0,0], [1,0,0], [0,1,0], [1,1,0], [2,3,0]] }"),
            &["scene.toml:2:33: shape 'x': the points lie in one plane"],
        ),
        (
            shape("polyhedron = { points = [[0,0,0], [1,0,0], [0,1,0]] }"),
            &["a polyhedron needs at least 4 points; there are 3"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,1]\nfov_y = 35"),
            &["scene.toml:3:7: eye and look_at are the same point"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 0"),
            &["scene.toml:5:9: fov_y = 0; it must be between 0 and 180 degrees"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 180"),
            &["scene.toml:5:9: fov_y = 180"],
        ),
        (
            view("look_at = [0,0,0]\nfov_y = 35"),
            &["scene.toml:2:1: the camera has no eye; give eye and look_at, or pose"],
        ),
        (
            view(
                "eye = [0,0,1]\nlook_at = [0,0,0]\npose = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]\nfov_y = 35",
            ),
            &["the camera has a pose and eye; leave out one of them"],
        ),
        (
            view("pose = [[1,0,0,0],[0,1,0,0],[0,0,-1,0]]\nfov_y = 35"),
            &["scene.toml:3:8: pose is no rotation", "right-handed"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfisheye = { fov = 361 }"),
            &["fov = 361; it must be greater than 0, up to 360 degrees"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\npanorama = \"cubic\""),
            &["unknown value 'cubic'; known are equirectangular"],
        ),
        (
            view(
                "eye = [0,0,1]\nlook_at = [0,0,0]\nk = { fx = 0, fy = 1, cx = 0, cy = 0, width = 4, height = 4 }",
            ),
            &["fx = 0; it must be greater than 0 and finite"],
        ),
        (
            view(
                "eye = [0,0,1]\nlook_at = [0,0,0]\nk = { fx = 1, fy = 1, cx = 0, cy = 0, width = 0, height = 4 }",
            ),
            &["width = 0; it must be from 1 to 65535"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 35\nlens = { f_number = 2 }"),
            &["scene.toml:6:8: the lens must have radius, or both f_number and focal_length"],
        ),
        (
            view(
                "eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 35\nlens = { radius = 1, focus = [0,0,2] }",
            ),
            &["the plane of focus is -1 before the camera; it must lie ahead of it"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 35\nlens = { radius = 1, blades = 2 }"),
            &["blades = 2; it must be 0 for a disc, or from 3 to 64"],
        ),
        (
            view(
                "eye = [0,0,1]\nlook_at = [0,0,0]\npanorama = \"equirectangular\"\nlens = { radius = 1 }",
            ),
            &["it has a lens, which panoramas and fisheyes cannot have"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]"),
            &[
                "scene.toml:2:1: the camera's projection is empty; give one of fov_y, half_height, orthographic",
            ],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nfov_y = 35\northographic = 2"),
            &["the camera's projection has fov_y and orthographic at once"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\northographic = -2"),
            &["scene.toml:5:16: orthographic = -2; it must be greater than 0"],
        ),
        (
            view("eye = [0,0,1]\nlook_at = [0,0,0]\nup = [0,0,0]\nfov_y = 35"),
            &["scene.toml:5:6: up is (0, 0, 0)"],
        ),
        (
            toml("[[light]]\ndirectional = { direction = [0, 0, 0], irradiance = [1, 1, 1] }"),
            &["scene.toml:3:29: direction is (0, 0, 0)"],
        ),
        (
            toml("[[light]]\npoint = { position = [0, 0, 0], intensity = [-1, 1, 1] }"),
            &["light 0 has intensity = -1"],
        ),
        (
            toml("[[light]]\ndirectional = { direction = [0, 1, 0], irradiance = [-1, 1, 1] }"),
            &["light 0 has irradiance = -1"],
        ),
        (
            toml("[material.a]\nroughness = 1.5"),
            &["material 'a' has roughness = 1.5; it must be between 0 and 1"],
        ),
        (toml("[material.a]\nior = 0"), &["material 'a' has ior = 0"]),
        (
            toml("[material.a]\nior = 1e-320"),
            &["scene.toml:3:7: 1e-320 is too small; at least 1e-45"],
        ),
        (
            view("eye = [1e308, 0, 0]\nlook_at = [-1e308, 0, 0]\nfov_y = 40"),
            &["scene.toml:3:7: eye and look_at are farther apart"],
        ),
        (
            toml("background = [0, -1, 0]"),
            &["the background has colour = -1"],
        ),
        (placed("{ scale = 0 }"), &["has a singular transform"]),
        (
            placed("{ scale = [1, 1, 0] }"),
            &["has a singular transform"],
        ),
        (
            placed("{ matrix = [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]] }"),
            &["has a singular transform"],
        ),
        (
            placed("{ scale = 1e300 }, { scale = 1e300 }"),
            &["has transform = NaN or infinity"],
        ),
    ]);
}

#[test]
fn motion() {
    let still = "transform = []";
    let cases: &[(&str, &[&str])] = &[
        ("[{ at = 1.0 }]", &["7:11: the key 'transform' is missing"]),
        ("[]", &["7:10: motion has no keys; give one"]),
        ("{ at = 1.0 }", &["7:10: expected a list, found"]),
        ("[{ at = 0, STILL }]", &["7:18: at = 0; it must be above 0"]),
        ("[{ at = 1.5, STILL }]", &["7:18: at = 1.5;", "at most 1"]),
        (
            "[{ at = 0.5, STILL }, { at = 0.5, STILL }]",
            &["7:48: at = 0.5 after 0.5; give the keys in the order"],
        ),
        (
            "[{ at = 1.0, transform = [{ scale = 0.0 }] }]",
            &["7:11: the transform of this key is singular"],
        ),
        (
            "[{ at = 1.0, transform = [{ turn = 3 }] }]",
            &["unknown key 'turn'"],
        ),
        ("[{ at = 1.0, STILL, hold = 1 }]", &["unknown key 'hold'"]),
        // Between the keys, and so with a time.
        (
            "[{ at = 0.5, transform = [{ rotate_y = 180.0 }] }]",
            &[
                "instance number 0 has a motion that is singular at time 0.25",
                "more keys",
            ],
        ),
        (
            "[{ at = 0.5, STILL }, { at = 1.0, transform = [{ scale = [1, -1, 1] }] }]",
            &["instance number 0 has a motion that is singular at time 0.75"],
        ),
    ];
    for (motion, expected) in cases {
        let motion = motion.replace("STILL", still);
        let text = format!("{}motion = {motion}\n", toml(""));
        check("scene.toml", text.as_bytes(), expected);
    }
}
