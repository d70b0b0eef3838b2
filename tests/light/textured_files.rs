//! Textures that come from files: alpha that counts and alpha that does not, and images that
//! several files share.

use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::render::Integrator;
use lanecast::internals::scene::linear_from_srgb;
use lanecast::{RenderConfig, Tracer, TracerOptions};

/// Two by two texels: red 128, green 255, blue 64 that is half there, and nothing.
const TEXELS: [u8; 16] = [
    128, 0, 0, 255, 0, 255, 0, 255, 0, 0, 64, 128, 255, 255, 255, 0,
];

/// The lines of a material whose image is repeated as often as is said.
fn image(times: u32) -> String {
    format!("base_color_texture = {{ file = \"t.png\", scale = [{times}, {times}] }}\n")
}

/// Loads a square under a sky of radiance 1, seen whole, of an unlit material with these lines.
fn square(material: &str) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let texels = image::RgbaImage::from_raw(2, 2, TEXELS.to_vec()).unwrap();
    texels.save(place("t.png")).unwrap();
    let square = "mtllib s.mtl\nusemtl own\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n\
                  vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(place("s.obj"), square).unwrap();
    std::fs::write(place("s.mtl"), "newmtl own\nmap_Kd t.png\n").unwrap();
    let text = format!(
        "format = 1\n[[light]]\nenvironment = {{ color = [1, 1, 1] }}\n\
         [camera]\neye = [0, 0, 3]\nlook_at = [0, 0, 0]\northographic = 2\n\
         [material.m]\nunlit = true\nbase_color = [1, 1, 1]\n{material}\
         [shape.s]\nmesh = \"s.obj\"\n\
         [[instance]]\nshape = \"s\"\nmaterial = \"m\"\n"
    );
    std::fs::write(place("s.toml"), text).unwrap();
    load(&place("s.toml"), &LoadOptions::default())
}

/// Renders the square with two pixels on a side.
fn seen(material: &str, spp: u32, integrator: Integrator) -> Vec<[f32; 3]> {
    let scene = square(material).unwrap_or_else(|e| panic!("{e}")).scene;
    let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
    let config = RenderConfig {
        width: 2,
        height: 2,
        spp,
        integrator,
        filter: FilterKind::Box,
        max_depth: 4,
        ..RenderConfig::default()
    };
    let picture = tracer.render(&config, &Default::default(), &|_| ());
    picture.unwrap().color
}

fn near(a: [f32; 3], b: [f32; 3], most: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
}

fn linear(code: u8) -> f32 {
    linear_from_srgb(f64::from(code) / 255.0) as f32
}

/// Each pixel sees the image 64 times along a side, so that its cone is wider than the image.
#[test]
fn far_away_an_opaque_image_shows_its_plain_mean() {
    let parts = [linear(128), linear(255), linear(64)];
    let plain = [0, 1, 2].map(|k| (parts[k] + 1.0) / 4.0);
    for spp in [1, 16] {
        for found in seen(&image(128), spp, Integrator::Path) {
            // Codes of 8 bits.
            assert!(near(found, plain, 0.005), "{found:?} {plain:?}");
        }
    }
    // Where alpha counts, what does not show has no part.
    let there = 128.0 / 255.0;
    let weighed = [parts[0], parts[1], parts[2] * there].map(|part| part / (2.0 + there));
    let masked = image(128) + "alpha = \"mask\"\nalpha_cutoff = 0.0\n";
    for found in seen(&masked, 1, Integrator::Path) {
        assert!(near(found, weighed, 0.005), "{found:?} {weighed:?}");
    }
}

#[test]
fn opacity_is_that_of_what_a_mask_leaves() {
    let red = [linear(128), 0.0, 0.0];
    let sky = [1.0; 3];
    for (opacity, integrator, shows) in [
        (0.25, Integrator::Path, 0.25),
        (1.0, Integrator::Path, 1.0),
        (0.75, Integrator::Direct, 1.0),
        (0.25, Integrator::Direct, 0.0),
    ] {
        let lines = "alpha = \"mask\"\nalpha_cutoff = 0.6\n";
        let lines = format!("{}{lines}opacity = {opacity}\n", image(1));
        // Texels are seen as they are in the corners of a picture of one texel a pixel.
        let lines = lines.replace("scale", "filter = \"nearest\", scale");
        let found = seen(&lines, 4096, integrator);
        if integrator == Integrator::Path {
            let part = [0, 1, 2].map(|k| red[k] * shows + sky[k] * (1.0 - shows));
            assert!(near(found[0], part, 0.012), "{opacity}: {found:?}");
            assert!(near(found[2], sky, 1e-5), "{opacity}: {found:?}");
        } else {
            // There or not, by the half.
            assert_eq!(near(found[0], found[2], 1e-5), shows == 0.0, "{opacity}");
        }
    }
}

/// The material of the scene and that of its mesh file have one image.
#[test]
fn scenes_share_images_with_their_mesh_files() {
    let loaded = square(&image(1)).unwrap();
    assert_eq!(loaded.warning, None);
    let textures = &loaded.scene.textures;
    assert_eq!(textures.iter().count(), 2);
    assert_eq!(textures.images.len(), 1);
    // Alpha that counts makes another one of it.
    let blended = square(&(image(1) + "alpha = \"blend\"\n")).unwrap();
    assert_eq!(blended.scene.textures.images.len(), 2);
}
