//! Images and patterns on solids: texels that are known stand where the rules T9 to T18 of
//! docs/LIGHT.md say, seen through pictures of what shows its base colour whatever the light.

use lanecast::internals::io::{LoadOptions, load};
use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::plan::{Accel, Choices, LaneCount, Precision};
use lanecast::internals::render::{Inspection, Integrator, TileOrder};
use lanecast::internals::scene::linear_from_srgb;
use lanecast::{DVec3, Picture, RenderConfig, Scene, Tracer, TracerOptions};
use std::path::Path;

/// Texels along each side of an image whose red tells the column and whose green the row.
const SIDE: u32 = 16;

/// Loads a scene of these lines beside the image `t.png` and one of single black and white texels
/// by turns, `fine.png`.
fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let known = image::RgbImage::from_fn(SIDE, SIDE, |x, y| {
        image::Rgb([x, y, 0].map(|k| (16 * k + 8) as u8))
    });
    known.save(place("t.png")).unwrap();
    let fine = image::GrayImage::from_fn(256, 256, |x, y| {
        image::Luma([if (x + y) % 2 == 0 { 0 } else { 255 }])
    });
    fine.save(place("fine.png")).unwrap();
    std::fs::write(place("s.toml"), text).unwrap();
    let loaded = load(&place("s.toml"), &LoadOptions::default());
    loaded.unwrap_or_else(|e| panic!("{e}")).scene
}

/// The lines of a scene that shows a shape `s`, whose lines follow, to a camera at `eye`.
fn lines(material: &str, [eye, at]: [DVec3; 2], transform: &str, shape: &str) -> String {
    let up = if (eye - at).normalize().y.abs() > 0.9 {
        "[0, 0, -1]"
    } else {
        "[0, 1, 0]"
    };
    format!(
        "format = 1\n[camera]\neye = {:?}\nlook_at = {:?}\nup = {up}\northographic = 1e-7\n\
         [material.m]\nunlit = true\n{material}\n\
         [[instance]]\nshape = \"s\"\nmaterial = \"m\"\ntransform = [{transform}]\n[shape.s]\n{shape}\n",
        eye.to_array(),
        at.to_array()
    )
}

const KNOWN: &str =
    "base_color = [1, 1, 1]\nbase_color_texture = { file = \"t.png\", filter = \"nearest\" }";

fn config(size: u32, spp: u32, integrator: Integrator) -> RenderConfig {
    RenderConfig {
        width: size,
        height: size,
        spp,
        integrator,
        filter: FilterKind::Box,
        max_depth: 4,
        ..RenderConfig::default()
    }
}

fn render(scene: &Scene, choices: Choices, config: &RenderConfig) -> Picture {
    let options = TracerOptions {
        choices,
        ..TracerOptions::default()
    };
    let tracer = Tracer::new(scene, &options).unwrap();
    tracer.render(config, &Default::default(), &|_| ()).unwrap()
}

/// Returns a colour divided by its greatest part.
fn hue(color: [f32; 3]) -> [f32; 3] {
    let most = color.iter().copied().fold(0.0, f32::max);
    color.map(|c| c / most)
}

/// Returns the colour of the point `at` seen from outside along its normal; of direct light, that
/// is dimmed, its hue.
fn seen(
    material: &str,
    [at, normal]: [DVec3; 2],
    (transform, shape): (&str, &str),
    integrator: Integrator,
) -> [f32; 3] {
    let is_direct = integrator == Integrator::Direct;
    let matte = match is_direct {
        true => format!("{material}\nphong = {{ diffuse = [1, 1, 1] }}"),
        false => material.into(),
    };
    let text = lines(&matte, [at + normal * 3.0, at], transform, shape);
    let found = render(&scene(&text), Choices::default(), &config(1, 1, integrator)).color[0];
    if is_direct { hue(found) } else { found }
}

/// Checks that a point shows the texel of these texture coordinates.
fn shows([at, normal]: [DVec3; 2], place: (&str, &str), integrator: Integrator, [u, v]: [f64; 2]) {
    let found = seen(KNOWN, [at, normal], place, integrator);
    let linear = |code: f64| linear_from_srgb(code / 255.0) as f32;
    let [red, green] = [u, v].map(|x| {
        let texel = (x.rem_euclid(1.0) * f64::from(SIDE)).floor();
        linear(16.0 * texel + 8.0)
    });
    let mut expected = [red, green, linear(8.0)];
    if integrator == Integrator::Direct {
        expected = hue(expected);
    }
    for k in 0..3 {
        let off = (found[k] - expected[k]).abs();
        assert!(
            off < 1e-5,
            "{place:?} at {at}: {found:?}, expected {expected:?} of {u}, {v}"
        );
    }
}

/// A shape, a point of it, its normal there, and the texture coordinates.
type Row = (&'static str, [f64; 3], [f64; 3], [f64; 2]);

/// No coordinate lies on the edge of a texel.
const ROWS: [Row; 26] = [
    // Around y: an eighth of a turn to the right of the front, a quarter to the left.
    (
        SPHERE,
        [0.51, -0.01, 0.49],
        [1.0, 0.0, 1.0],
        [0.6282, 0.5045],
    ),
    (
        SPHERE,
        [-0.707, 0.01, 0.01],
        [-1.0, 0.0, 0.0],
        [0.2523, 0.4955],
    ),
    (SPHERE, [0.001, 0.5, 0.5], [0.0, 1.0, 1.0], [0.501, 0.2501]),
    (
        SPHERE,
        [-0.01, -0.5, -0.5],
        [0.0, -1.0, -1.0],
        [0.003, 0.749],
    ),
    (ELLIPSOID, [0.02, 0.02, 0.5], [0.0, 0.0, 1.0], [0.51, 0.49]),
    (
        ELLIPSOID,
        [1.0, -0.02, -0.02],
        [1.0, 0.0, 0.0],
        [0.756, 0.503],
    ),
    (CYLINDER, [0.02, 0.3, 0.5], [0.0, 0.0, 1.0], [0.506, 0.35]),
    (
        CYLINDER,
        [-0.5, -0.3, -0.01],
        [-1.0, 0.0, 0.0],
        [0.246, 0.65],
    ),
    // Seen from above right is +x and down +z; from below down is −z.
    (CYLINDER, [0.2, 1.0, 0.3], [0.0, 1.0, 0.0], [0.7, 0.8]),
    (CYLINDER, [0.2, -1.0, 0.3], [0.0, -1.0, 0.0], [0.7, 0.2]),
    (CONE, [0.01, 0.4, 0.8], [0.0, 0.0, 1.0], [0.502, 0.3]),
    (CONE, [0.2, 1.0, 0.1], [0.0, 1.0, 0.0], [0.7, 0.6]),
    (BOX, [0.3, 0.2, 1.0], [0.0, 0.0, 1.0], [0.65, 0.4]),
    (BOX, [0.3, 0.2, -1.0], [0.0, 0.0, -1.0], [0.35, 0.4]),
    (BOX, [1.0, 0.2, 0.3], [1.0, 0.0, 0.0], [0.35, 0.4]),
    (BOX, [-1.0, 0.2, 0.3], [-1.0, 0.0, 0.0], [0.65, 0.4]),
    (BOX, [0.3, 1.0, 0.4], [0.0, 1.0, 0.0], [0.65, 0.7]),
    (BOX, [0.3, -1.0, 0.4], [0.0, -1.0, 0.0], [0.65, 0.3]),
    (TORUS, [0.01, 0.01, 1.3], [0.0, 0.0, 1.0], [0.501, 0.494]),
    (TORUS, [1.0, 0.3, 0.01], [0.0, 1.0, 0.0], [0.748, 0.251]),
    (POLYGON, [0.6, 0.2, 0.0], [0.0, 0.0, 1.0], [0.3, 0.8]),
    // The cap of a prism, and its first side, which is 2 of 6 long.
    (PRISM, [0.6, 0.2, 3.0], [0.0, 0.0, 1.0], [0.3, 0.8]),
    (
        PRISM,
        [0.5, 0.0, 1.0],
        [0.0, -1.0, 0.0],
        [0.5 / 6.0, 2.0 / 3.0],
    ),
    // Along the axes: units of space.
    (OCTAHEDRON, [0.2, 0.9, 0.1], [0.0, 1.0, 0.0], [0.2, 0.1]),
    (SUPER, [0.3, 0.2, 1.0], [0.0, 0.0, 1.0], [0.3, -0.2]),
    (WAVES, [-1.0, 0.2, 0.1], [-1.0, 0.0, 0.0], [0.1, -0.2]),
];

const SPHERE: &str = "sphere = { center = [0, 0, 0], radius = 0.7071067811865476 }";
const ELLIPSOID: &str = "ellipsoid = { center = [0, 0, 0], radii = [1, 0.7, 0.5] }";
const CYLINDER: &str = "cylinder = { base = [0, -1, 0], top = [0, 1, 0], radius = 0.5 }";
const CONE: &str =
    "cone = { base = [0, -1, 0], top = [0, 1, 0], base_radius = 1.5, top_radius = 0.5 }";
const BOX: &str = "box = { min = [-1, -1, -1], max = [1, 1, 1] }";
const TORUS: &str = "torus = { major = 1, minor = 0.3 }";
const POLYGON: &str = "polygon = { points = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]] }";
const PRISM: &str = "prism = { points = [[0, 0], [2, 0], [2, 1], [0, 1]], height = 3 }";
const OCTAHEDRON: &str = "polyhedron = { points = [[3, 0, 0], [-3, 0, 0], [0, 0, 3], [0, 0, -3], [0, 1, 0], [0, -1, 0]] }";
const SUPER: &str = "superquadric = { radii = [1, 1, 1], exponents = [24, 24, 24] }";
const WAVES: &str = "implicit = \"max(abs(x), 0.9*abs(sin(y)) + 0.1*z^2) - 1\"\n\
     clip = { box = { min = [-2, -1, -1], max = [2, 1, 1] } }";

#[test]
fn every_kind_shows_the_texel_that_its_rule_names() {
    for (shape, at, normal, uv) in ROWS {
        let [at, normal] = [at, normal].map(DVec3::from_array);
        for integrator in [Integrator::Path, Integrator::Direct] {
            shows([at, normal.normalize()], ("", shape), integrator, uv);
        }
    }
}

#[test]
fn an_operand_shows_what_the_plain_shape_shows() {
    for (shape, at, normal, uv) in ROWS {
        if shape.starts_with("polygon") {
            continue;
        }
        let [at, normal] = [at, normal].map(DVec3::from_array);
        let spare = "[shape.spare]\nsphere = { center = [9, 9, 9], radius = 0.1 }\n";
        // As it is, and as an operand that is turned and stretched.
        let plain = format!("union = [\"o\", \"spare\"]\n{spare}[shape.o]\n{shape}");
        let direction = normal.normalize();
        shows([at, direction], ("", &plain), Integrator::Path, uv);
        let turned = format!(
            "union = [{{ shape = \"o\", transform = [{{ scale = [1, 2, 4] }}, {{ rotate_y = 90 }}] }}, \
             \"spare\"]\n{spare}[shape.o]\n{shape}"
        );
        let turn = |v: DVec3| DVec3::new(v.z, v.y, -v.x);
        let stretch = DVec3::new(1.0, 2.0, 4.0);
        let (there, out) = (turn(at * stretch), turn(normal / stretch).normalize());
        shows([there, out], ("", &turned), Integrator::Path, uv);
        // And placed as it is by an instance that mirrors.
        let mirror = "{ scale = [-1, 1, 1] }";
        let flip = DVec3::new(-1.0, 1.0, 1.0);
        let mirrored = [at * flip, direction * flip];
        shows(mirrored, (mirror, shape), Integrator::Path, uv);
    }
}

#[test]
fn a_hole_shows_the_coordinates_of_what_cut_it() {
    // The bore is seen from inside, from the front through the open end.
    let shape = format!(
        "difference = [\"block\", \"bore\"]\n[shape.block]\n{BOX}\n[shape.bore]\n\
         box = {{ min = [-0.5, -0.5, 0.5], max = [0.5, 0.5, 2] }}"
    );
    let floor = DVec3::new(0.2, 0.1, 0.5);
    // The bore's face across −z: right is −x there, down is −y.
    shows(
        [floor, DVec3::Z],
        ("", &shape),
        Integrator::Path,
        [0.3, 0.4],
    );
}

#[test]
fn an_image_is_filtered_by_how_wide_a_ray_is_on_any_surface() {
    let fine = "base_color = [1, 1, 1]\nbase_color_texture = { file = \"fine.png\" }";
    for (shape, transform) in [
        (BOX, ""),
        (SPHERE, ""),
        // The seam is in front.
        (SPHERE, "{ rotate_y = 180 }"),
        (CYLINDER, "{ scale = 100 }"),
        (
            TORUS,
            "{ rotate_x = 70 }, { translate = [-1, 0, 0] }, { scale = [0.01, 0.02, 0.01] }",
        ),
    ] {
        let size = match transform {
            "{ scale = 100 }" => 100.0,
            "" | "{ rotate_y = 180 }" => 1.0,
            _ => 0.01,
        };
        let reds = |width: f64, pixels: u32| {
            let eye = [DVec3::Z * 900.0, DVec3::ZERO];
            let text = lines(fine, eye, transform, shape);
            let scene = scene(&text.replace("1e-7", &(width * size).to_string()));
            let config = config(pixels, 1, Integrator::Path);
            let color = render(&scene, Choices::default(), &config).color;
            let reds: Vec<f32> = color.iter().map(|c| c[0]).collect();
            let least = reds.iter().copied().fold(f32::INFINITY, f32::min);
            let most = reds.iter().copied().fold(0.0, f32::max);
            [least, most]
        };
        // Each pixel covers many texels, which are black and white by turns.
        let [least, most] = reds(0.5, 8);
        assert!(least > 0.4 && most < 0.6, "{shape} {least} {most}");
        // A texel takes some pixels, and none is blurred.
        let [least, most] = reds(0.06, 48);
        assert!(most - least > 0.6, "{shape} {least} {most}");
    }
}

#[test]
fn faces_in_planes_between_cells_show_the_cells_inside() {
    let checker = "base_color = { checker = { colors = [[1, 0, 0], [0, 0, 1]], size = 1 } }";
    let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let is = |found: [f32; 3], expected: [f32; 3]| {
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-5),
            "{found:?} {expected:?}"
        );
    };
    for integrator in [Integrator::Path, Integrator::Direct] {
        for i in 0..40 {
            let [x, y] = [0.013, 0.017].map(|step| 0.1 + step * f64::from(i));
            for axis in 0..3 {
                for sign in [1.0, -1.0] {
                    let mut at = [x, y, x];
                    at[axis] = sign;
                    let at = DVec3::from_array(at);
                    let normal = DVec3::AXES[axis] * sign;
                    let place = ("{ rotate_y = 90 }", BOX);
                    let turn = |v: DVec3| DVec3::new(v.z, v.y, -v.x);
                    let found = seen(checker, [turn(at), turn(normal)], place, integrator);
                    is(found, if sign > 0.0 { red } else { blue });
                }
            }
            if i > 3 && integrator == Integrator::Path {
                break;
            }
        }
    }
    // A cut shows the pattern of the solid, as one block has it.
    let cut = format!(
        "difference = [\"block\", {{ shape = \"block\", transform = [{{ translate = [0, 0, 1] }}] }}]\n\
         [shape.block]\n{BOX}"
    );
    for (x, y, expected) in [(0.5, 0.5, blue), (-0.5, 0.5, red), (-0.5, -0.5, blue)] {
        let at = DVec3::new(x, y, 0.0);
        is(
            seen(checker, [at, DVec3::Z], ("", &cut), Integrator::Path),
            expected,
        );
    }
}

#[test]
fn patterns_show_in_albedo_and_coordinates_in_uv() {
    let checker = "base_color = { checker = { colors = [[1, 0, 0], [0, 0, 1]], size = 0.1 } }";
    let eye = [DVec3::new(0.25, 0.05, 3.0), DVec3::new(0.25, 0.05, 1.0)];
    let scene = scene(&lines(checker, eye, "", BOX));
    for integrator in [Integrator::Path, Integrator::Direct, Integrator::Ao] {
        let mut config = config(2, 1, integrator);
        config.aovs.add("albedo");
        config.aovs.add("uv");
        let picture = render(&scene, Choices::default(), &config);
        // The third cell along x, the first along y, the tenth along z.
        assert_eq!(picture.albedo.unwrap()[0], [0.0, 0.0, 1.0]);
        let [u, v] = picture.uv.unwrap()[0];
        assert!(
            (u - 0.625).abs() < 1e-6 && (v - 0.475).abs() < 1e-6,
            "{u} {v}"
        );
    }
    let config = config(2, 1, Integrator::Inspect(Inspection::Uv));
    let [red, green, _] = render(&scene, Choices::default(), &config).color[0];
    assert!((red - 0.625).abs() < 1e-6 && (green - 0.475).abs() < 1e-6);
}

#[test]
fn solids_show_no_threads_tiles_lanes_and_structures() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/textures_solids.toml");
    let scene = load(&path, &LoadOptions::default()).unwrap().scene;
    for integrator in [Integrator::Path, Integrator::Direct] {
        let picture = |choices: Choices, tiles: TileOrder, threads: usize| {
            let config = RenderConfig {
                width: 96,
                height: 64,
                tiles,
                ..config(1, 2, integrator)
            };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            pool.install(|| render(&scene, choices, &config).color)
        };
        let plain = picture(Choices::default(), TileOrder::Spread, 1);
        for (accel, lanes, precision, tiles, threads) in [
            (
                Accel::Bvh,
                LaneCount::Auto,
                Precision::Guarded,
                TileOrder::Small,
                3,
            ),
            (
                Accel::Bvh,
                LaneCount::One,
                Precision::Exact,
                TileOrder::Reverse,
                2,
            ),
            (
                Accel::Kd,
                LaneCount::One,
                Precision::Guarded,
                TileOrder::Small,
                2,
            ),
            (
                Accel::Linear,
                LaneCount::Auto,
                Precision::Guarded,
                TileOrder::Spread,
                2,
            ),
        ] {
            let choices = Choices {
                accel: Some(accel),
                lanes,
                precision,
            };
            let found = picture(choices, tiles, threads);
            assert!(found == plain, "{integrator:?} {accel:?} {precision:?}");
        }
    }
}
