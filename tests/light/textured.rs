//! Textures against closed values: under a sky of radiance 1 a Lambertian surface shows its
//! colour, so that a picture shows what look-ups find. And their bits.

use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::plan::{Accel, Choices, LaneCount, Precision};
use lanecast::internals::render::{Integrator, TileOrder};
use lanecast::internals::scene::{
    Alpha, Layers, MeshData, Slot, Texels, TextureRef, Texturing, linear_from_srgb,
};
use lanecast::{
    Camera, DVec3, Edge, Material, RenderConfig, Scene, SceneBuilder, Tracer, TracerOptions,
};

/// A square of side 2 around the origin, across z, whose texture coordinates go from 0 to 1 and
/// down, and whose vertices are white above and `below` below.
fn square(below: [u16; 4]) -> MeshData {
    MeshData {
        positions: vec![
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]],
        colors: vec![below, below, [u16::MAX; 4], [u16::MAX; 4]],
        ..MeshData::default()
    }
}

/// Two by two texels: red 128, green 255, blue 64 that is half there, and nothing.
const TEXELS: [u8; 16] = [
    128, 0, 0, 255, 0, 255, 0, 255, 0, 0, 64, 128, 255, 255, 255, 0,
];

/// What shows its base colour whatever the light.
fn flat() -> Material {
    Material {
        layers: Layers {
            unlit: true,
            ..Layers::default()
        },
        ..Material::metallic_roughness([1.0; 3], 0.0, 1.0)
    }
}

/// A square before black, with an image, seen whole by a picture of a given number of pixels.
fn scene(material: Material, texturing: Texturing, nearest: bool, below: [u16; 4]) -> Scene {
    let mut scene = SceneBuilder::default();
    let image = scene.image(Texels::Bytes(TEXELS.to_vec()), 4, true, [2, 2]);
    let id = scene.material("", material);
    let texture = TextureRef {
        nearest,
        ..TextureRef::plain(image)
    };
    scene.texture(id, texturing, &[(Slot::BaseColor, texture)]);
    let shape = scene.mesh("", &square(below));
    scene.instance("", Edge::shape(shape).material(id));
    scene.environment(lanecast::internals::scene::Environment {
        width: 1,
        height: 1,
        pixels: vec![[1.0; 3]].into(),
        rotation: 0.0,
        scale: [1.0; 3],
    });
    let camera = Camera::orthographic(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 2.0);
    scene.camera("", camera);
    scene.finish().unwrap()
}

fn config(size: u32, spp: u32) -> RenderConfig {
    RenderConfig {
        width: size,
        height: size,
        spp,
        integrator: Integrator::Path,
        filter: FilterKind::Box,
        max_depth: 4,
        ..RenderConfig::default()
    }
}

fn render(scene: &Scene, choices: Choices, config: &RenderConfig) -> Vec<[f32; 3]> {
    let options = TracerOptions {
        choices,
        ..TracerOptions::default()
    };
    let tracer = Tracer::new(scene, &options).unwrap();
    let picture = tracer.render(config, &Default::default(), &|_| ()).unwrap();
    picture.color
}

fn near(a: [f32; 3], b: [f32; 3], most: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
}

fn linear(code: u8) -> f32 {
    linear_from_srgb(f64::from(code) / 255.0) as f32
}

#[test]
fn nearest_texels_and_colours_of_vertices_show_where_they_are() {
    let below = [0, 0, u16::MAX, u16::MAX];
    let coloured = Texturing {
        vertex_color: true,
        ..Texturing::default()
    };
    let scene = scene(flat(), coloured, true, below);
    let seen = render(&scene, Choices::default(), &config(4, 256));
    // Rows from above: the mean share of the lower vertices' colour.
    for (row, share) in [0.125, 0.375, 0.625, 0.875].into_iter().enumerate() {
        let above = 1.0 - share;
        let expected = match row < 2 {
            true => [[linear(128) * above, 0.0, 0.0], [0.0, above, 0.0]],
            false => [[0.0, 0.0, linear(64)], [above, above, 1.0]],
        };
        assert!(near(seen[4 * row], expected[0], 4e-3), "{row}: {seen:?}");
        assert!(
            near(seen[4 * row + 3], expected[1], 4e-3),
            "{row}: {seen:?}"
        );
    }
}

#[test]
fn a_look_up_is_a_mean_of_texels() {
    let scene = scene(flat(), Texturing::default(), false, [u16::MAX; 4]);
    // In the middle of the image all four texels count alike, from nearby.
    let window = |spp: u32| {
        let mut around = SceneBuilder::from(scene.clone());
        around.camera(
            "window",
            Camera::orthographic(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 1e-6),
        );
        let around = around.finish().unwrap();
        let options = TracerOptions::default();
        let tracer = Tracer::new(&around, &options).unwrap();
        let mut config = config(4, spp);
        config.camera = Some("window".into());
        let picture = tracer
            .render(&config, &Default::default(), &|_| ())
            .unwrap();
        let mut mean = [0.0; 3];
        for color in &picture.color {
            mean = std::array::from_fn(|k| mean[k] + color[k] / 16.0);
        }
        mean
    };
    let quarter = |a: f32| 0.25 * a;
    let expected = [
        quarter(linear(128) + 1.0),
        quarter(1.0 + 1.0),
        quarter(linear(64) + 1.0),
    ];
    assert!(near(window(4), expected, 1e-4), "{:?}", window(4));
    // Texel by texel: 16 pixels of 4,096 samples, whose standard error is below 0.002.
    assert!(near(window(4096), expected, 0.006), "{:?}", window(4096));
}

#[test]
fn masks_and_blends_let_through_what_they_say() {
    let of = |alpha: Alpha, spp: u32| {
        let texturing = Texturing {
            alpha,
            ..Texturing::default()
        };
        let scene = scene(flat(), texturing, true, [u16::MAX; 4]);
        render(&scene, Choices::default(), &config(2, spp))
    };
    let sky = [1.0; 3];
    let (red, green) = ([linear(128), 0.0, 0.0], [0.0, 1.0, 0.0]);
    let blue = [0.0, 0.0, linear(64)];
    let masked = of(Alpha::Mask(0.5), 4);
    for (found, expected) in masked.iter().zip([red, green, blue, sky]) {
        assert!(near(*found, expected, 1e-5), "{masked:?}");
    }
    assert!(near(of(Alpha::Mask(0.6), 4)[2], sky, 1e-5));
    let there = 128.0 / 255.0;
    let half = std::array::from_fn(|k| blue[k] * there + 1.0 - there);
    let blended = of(Alpha::Blend, 4096);
    for (found, expected) in blended.iter().zip([red, green, half, sky]) {
        // 1/√4096 over two, three times; Sobol' points do better.
        assert!(near(*found, expected, 0.012), "{blended:?}");
    }
}

#[test]
fn a_shadow_is_as_dense_as_what_throws_it() {
    // A lamp from above, a square that is half there, and a floor below it.
    let lit = |alpha: Alpha| {
        let mut scene = SceneBuilder::default();
        let image = scene.image(Texels::Bytes(vec![255, 255, 255, 64]), 4, true, [1, 1]);
        let material = Material::metallic_roughness([0.0; 3], 0.0, 1.0);
        let id = scene.material("", material);
        let texturing = Texturing {
            alpha,
            ..Texturing::default()
        };
        scene.texture(
            id,
            texturing,
            &[(Slot::BaseColor, TextureRef::plain(image))],
        );
        let square = scene.mesh("", &square([u16::MAX; 4]));
        scene.instance("", Edge::shape(square).material(id));
        let floor = scene.half_space(
            "",
            lanecast::shapes::HalfSpace {
                normal: DVec3::Z,
                offset: -1.0,
            },
        );
        scene.instance("", Edge::shape(floor));
        scene.light(lanecast::Light::Directional {
            direction: -DVec3::Z,
            irradiance: [1.0; 3],
            angle: 0.0,
        });
        let eye = DVec3::new(4.0, 0.0, -0.5);
        let at = DVec3::new(0.0, 0.0, -1.0);
        scene.camera("", Camera::orthographic(eye, at, DVec3::Z, 1e-6));
        let scene = scene.finish().unwrap();
        // Light that comes straight from the lamp alone.
        let config = RenderConfig {
            max_depth: 1,
            ..config(2, 16)
        };
        render(&scene, Choices::default(), &config)[0][0]
    };
    let open = lit(Alpha::Mask(0.5));
    assert!(open > 0.0);
    assert_eq!(lit(Alpha::Opaque), 0.0);
    let there = 64.0 / 255.0;
    let part = lit(Alpha::Blend) / open;
    assert!((part - (1.0 - there)).abs() < 1e-3, "{part}");
}

/// A thin pane lets light through in the colour that an image has there, as one of that colour.
#[test]
fn a_pane_colours_light_by_its_image() {
    let lit = |color: [f32; 3], slots: &[Slot]| {
        let mut scene = SceneBuilder::default();
        let image = scene.image(Texels::Bytes(vec![188, 64, 0]), 3, true, [1, 1]);
        let pane = Material {
            transmission: 1.0,
            layers: Layers {
                thin_walled: true,
                ..Layers::default()
            },
            ..Material::metallic_roughness(color, 0.0, 0.0)
        };
        let id = scene.material("", pane);
        let refs: Vec<_> = slots
            .iter()
            .map(|s| (*s, TextureRef::plain(image)))
            .collect();
        if !refs.is_empty() {
            scene.texture(id, Texturing::default(), &refs);
        }
        let square = scene.mesh("", &square([u16::MAX; 4]));
        scene.instance("", Edge::shape(square).material(id));
        let floor = lanecast::shapes::HalfSpace {
            normal: DVec3::Z,
            offset: -1.0,
        };
        let floor = scene.half_space("", floor);
        scene.instance("", Edge::shape(floor));
        scene.light(lanecast::Light::Directional {
            direction: -DVec3::Z,
            irradiance: [1.0; 3],
            angle: 0.0,
        });
        let (eye, at) = (DVec3::new(4.0, 0.0, -0.5), -DVec3::Z);
        scene.camera("", Camera::orthographic(eye, at, DVec3::Z, 1e-6));
        let config = RenderConfig {
            max_depth: 1,
            ..config(2, 16)
        };
        render(&scene.finish().unwrap(), Choices::default(), &config)[0]
    };
    let color = [188, 64, 0].map(linear);
    let by_factor = lit(color, &[]);
    assert!(by_factor[0] > 0.05 && by_factor[2] == 0.0, "{by_factor:?}");
    let by_image = lit([1.0; 3], &[Slot::BaseColor]);
    assert!(
        near(by_image, by_factor, 1e-6),
        "{by_image:?} {by_factor:?}"
    );
    // What transmits less lets less through.
    let less = lit(color, &[Slot::Transmission]);
    assert!(less[0] > 0.0 && less[0] < 0.8 * by_factor[0], "{less:?}");
}

#[test]
fn outputs_beside_light_know_images() {
    let texturing = Texturing::default();
    let scene = scene(
        Material::metallic_roughness([1.0; 3], 0.0, 1.0),
        texturing,
        true,
        [u16::MAX; 4],
    );
    let mut config = config(2, 16);
    config.aovs.add("albedo");
    config.aovs.add("denoising_albedo");
    let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
    let picture = tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    let guide = picture
        .layers
        .iter()
        .find(|layer| layer.name == "denoising_albedo");
    let albedo = picture.albedo.as_ref().unwrap();
    let expected = [
        [linear(128), 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, linear(64)],
    ];
    for (pixel, expected) in expected.into_iter().enumerate() {
        let found = [guide.unwrap().color[pixel], albedo[pixel]];
        assert!(
            found.iter().all(|c| near(*c, expected, 1e-5)),
            "{found:?} {expected:?}"
        );
    }
}

#[test]
fn textured_pictures_show_no_threads_tiles_and_lanes() {
    let shaded = Material::metallic_roughness([1.0; 3], 0.5, 0.5);
    let texturing = Texturing {
        alpha: Alpha::Blend,
        vertex_color: true,
        ..Texturing::default()
    };
    let scene = scene(shaded, texturing, false, [30_000, 60_000, 9_000, 50_000]);
    let bits = |choices: Choices, tiles: TileOrder, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let config = RenderConfig {
            tiles,
            ..config(41, 6)
        };
        let pool = pool.build().unwrap();
        let color = pool.install(|| render(&scene, choices, &config));
        let bits = color.iter().flatten().map(|c| c.to_bits());
        bits.collect::<Vec<u32>>()
    };
    let plain = TileOrder::default();
    let expected = bits(Choices::default(), plain, 1);
    assert_eq!(bits(Choices::default(), TileOrder::Small, 3), expected);
    let widths = [
        (1, LaneCount::One),
        (4, LaneCount::Four),
        (8, LaneCount::Eight),
        (16, LaneCount::Sixteen),
    ];
    let there = lanecast::internals::plan::widths();
    for (_, lanes) in widths.into_iter().filter(|(w, _)| there.contains(w)) {
        let choices = Choices {
            lanes,
            ..Choices::default()
        };
        assert_eq!(bits(choices, plain, 2), expected, "{lanes:?}");
    }
    let linear = Choices {
        accel: Some(Accel::Linear),
        ..Choices::default()
    };
    assert_eq!(bits(linear, plain, 2), expected);
    let exact = Choices {
        precision: Precision::Exact,
        ..Choices::default()
    };
    assert_eq!(bits(exact, plain, 2), expected);
}

/// Returns what an orthographic window on the middle of a square shows, whose material is white
/// and matte and whose normal map tilts by (0.6, 0, 0.8), lit from a direction.
fn tilted(place: glam::DAffine3, towards: DVec3, from: f64) -> f32 {
    let mut scene = SceneBuilder::default();
    // 0.6 is 204 of 255, 0 is 127.5, 0.8 is 229.5.
    let codes = [204.0, 127.5, 229.5].map(|code: f64| (code * 257.0) as u16);
    let image = scene.image(Texels::Words(codes.to_vec()), 3, false, [1, 1]);
    let white = Material {
        model: lanecast::internals::scene::Model::Phong {
            diffuse: [1.0; 3],
            specular: [0.0; 3],
            exponent: 1.0,
            mirror: [0.0; 3],
        },
        ..Material::default()
    };
    let id = scene.material("", white);
    let refs = [(Slot::Normal, TextureRef::plain(image))];
    scene.texture(id, Texturing::default(), &refs);
    let mesh = MeshData {
        // Along x, with the bitangent along y.
        tangents: vec![[32_767, 0, 0, 32_767]; 6],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        ..square([u16::MAX; 4])
    };
    let shape = scene.mesh("", &mesh);
    let placed = scene.transform(place.into());
    scene.instance("", Edge::shape(shape).transform(placed).material(id));
    scene.light(lanecast::Light::Directional {
        direction: -towards,
        irradiance: [std::f32::consts::PI; 3],
        angle: 0.0,
    });
    let camera = Camera::orthographic(DVec3::Z * from, DVec3::ZERO, DVec3::Y, 1e-6);
    scene.camera("", camera);
    let scene = scene.finish().unwrap();
    render(&scene, Choices::default(), &config(2, 8))[0][0]
}

#[test]
fn a_normal_map_tilts_what_light_sees() {
    let towards = DVec3::new(0.48, 0.36, 0.8);
    let (tilt, mirrored) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.6, 0.0, 0.8));
    let here = tilted(glam::DAffine3::IDENTITY, towards, 3.0);
    assert!((f64::from(here) - tilt.dot(towards)).abs() < 1e-4, "{here}");
    // Mirrored, the map leans to the other side.
    let flip = glam::DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let there = tilted(flip, towards, 3.0);
    assert!(
        (f64::from(there) - mirrored.dot(towards)).abs() < 1e-4,
        "{there}"
    );
    // From behind, the whole frame is turned.
    let behind = tilted(glam::DAffine3::IDENTITY, -towards, -3.0);
    assert!(
        (f64::from(behind) - tilt.dot(towards)).abs() < 1e-4,
        "{behind}"
    );
}

#[test]
fn a_number_that_an_image_scales_is_that_of_the_product() {
    // A clear coat of a half is one of 1 whose image says 0.5, sample by sample.
    let of = |clearcoat: f32, code: Option<u16>| {
        let mut scene = SceneBuilder::default();
        let material = Material {
            layers: Layers {
                clearcoat,
                clearcoat_roughness: 0.3,
                ..Layers::default()
            },
            ..Material::metallic_roughness([0.5, 0.4, 0.3], 0.0, 0.6)
        };
        let id = scene.material("", material);
        if let Some(code) = code {
            let image = scene.image(Texels::Words(vec![code]), 1, false, [1, 1]);
            let refs = [(Slot::Clearcoat, TextureRef::plain(image))];
            scene.texture(id, Texturing::default(), &refs);
        }
        let shape = scene.mesh("", &square([u16::MAX; 4]));
        scene.instance("", Edge::shape(shape).material(id));
        scene.light(lanecast::Light::Directional {
            direction: DVec3::new(0.2, 0.1, -1.0),
            irradiance: [2.0; 3],
            angle: 0.1,
        });
        let camera = Camera::orthographic(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 2.0);
        scene.camera("", camera);
        let scene = scene.finish().unwrap();
        render(&scene, Choices::default(), &config(8, 8))
    };
    // 21845 is a third of 65535; a third of 0.75 is 0.25.
    assert_eq!(
        of(0.75, Some(21_845)),
        of(0.75 * (21_845.0 / 65_535.0), None)
    );
    assert_ne!(of(0.75, Some(21_845)), of(0.75, None));
}
