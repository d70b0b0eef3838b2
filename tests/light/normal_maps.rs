//! Normals of coats and tangents of stretched highlights: a map that tilts shows what a tilted
//! square shows.

use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::plan::Choices;
use lanecast::internals::render::Integrator;
use lanecast::internals::scene::{
    Environment, Layers, MeshData, Slot, Texels, TextureRef, Texturing,
};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, RenderConfig, SceneBuilder, Tracer, TracerOptions,
};

/// The normal that maps encode.
const TILT: DVec3 = DVec3::new(0.6, 0.0, 0.8);

/// Where light comes from.
const TOWARDS: DVec3 = DVec3::new(0.6, 0.4, 0.7);

/// A square around the origin whose normal is z, with one tangent everywhere.
fn square(tangent: [f64; 3], bitangent: i16) -> MeshData {
    let [x, y, z] = tangent.map(|x| (x * 32_767.0).round() as i16);
    MeshData {
        positions: vec![
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]],
        tangents: vec![[x, y, z, bitangent * 32_767]; 6],
        ..MeshData::default()
    }
}

/// Returns what a window on the middle of a square shows that is turned about y, with the maps of
/// some slots that tilt normals. `sky` lights it, too.
fn shown(material: Material, mesh: &MeshData, slots: &[Slot], turned: f64, sky: f32) -> f32 {
    let mut scene = SceneBuilder::default();
    // 0.6 is 204 of 255, 0 is 127.5, 0.8 is 229.5.
    let codes = [204.0, 127.5, 229.5].map(|code: f64| (code * 257.0) as u16);
    let image = scene.image(Texels::Words(codes.to_vec()), 3, false, [1, 1]);
    let id = scene.material("", material);
    let refs: Vec<_> = slots
        .iter()
        .map(|slot| (*slot, TextureRef::plain(image)))
        .collect();
    let texturing = Texturing {
        follows_tangents: material.layers.anisotropy > 0.0,
        ..Texturing::default()
    };
    scene.texture(id, texturing, &refs);
    let shape = scene.mesh("", mesh);
    let turn = glam::DAffine3::from_rotation_y(turned);
    let placed = scene.transform(turn.into());
    scene.instance("", Edge::shape(shape).transform(placed).material(id));
    scene.light(Light::Directional {
        direction: -TOWARDS,
        irradiance: [1.0 - sky; 3],
        angle: 0.0,
    });
    scene.environment(Environment::uniform([sky; 3]));
    let camera = Camera::orthographic(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 1e-6);
    scene.camera("", camera);
    let scene = scene.finish().unwrap();
    let options = TracerOptions {
        choices: Choices::default(),
        ..TracerOptions::default()
    };
    let tracer = Tracer::new(&scene, &options).unwrap();
    let config = RenderConfig {
        width: 8,
        height: 8,
        spp: 64,
        integrator: Integrator::Path,
        filter: FilterKind::Box,
        max_depth: 2,
        ..RenderConfig::default()
    };
    let picture = tracer.render(&config, &Default::default(), &|_| ());
    let color = picture.unwrap().color;
    color.iter().map(|c| c[0]).sum::<f32>() / color.len() as f32
}

/// A coat over nothing.
fn coat(roughness: f32) -> Material {
    Material {
        layers: Layers {
            clearcoat: 1.0,
            clearcoat_roughness: roughness,
            specular: 0.0,
            ..Layers::default()
        },
        ..Material::metallic_roughness([0.0; 3], 0.0, 1.0)
    }
}

fn plain() -> MeshData {
    square([1.0, 0.0, 0.0], 1)
}

#[track_caller]
fn assert_near(a: f32, b: f32, most: f32) {
    assert!(b > 1e-6 && (a / b - 1.0).abs() < most, "{a} {b}");
}

#[test]
fn the_normal_map_of_a_coat_tilts_its_highlight() {
    let tilt = TILT.x.atan2(TILT.z);
    for roughness in [0.3, 0.8] {
        let of = |slots: &[Slot], turned| shown(coat(roughness), &plain(), slots, turned, 0.0);
        let mapped = of(&[Slot::ClearcoatNormal], 0.0);
        assert_near(mapped, of(&[], tilt), 2e-3);
        // The map of the base leaves the coat as it is.
        let (flat, base) = (of(&[], 0.0), of(&[Slot::Normal], 0.0));
        assert_near(base, flat, 1e-5);
        assert!((flat / mapped - 1.0).abs() > 0.1, "{flat} {mapped}");
        // Both maps tilt both.
        let both = of(&[Slot::Normal, Slot::ClearcoatNormal], 0.0);
        assert_near(both, mapped, 1e-3);
    }
}

#[test]
fn a_tilted_coat_reflects_a_sky_as_a_tilted_square_does() {
    for (roughness, most) in [(0.0, 2e-3), (0.2, 2e-2)] {
        let mapped = shown(
            coat(roughness),
            &plain(),
            &[Slot::ClearcoatNormal],
            0.0,
            1.0,
        );
        let turned = shown(coat(roughness), &plain(), &[], TILT.x.atan2(TILT.z), 1.0);
        // Of a rough one, what leaves into the surface is lost.
        assert!(mapped <= turned * (1.0 + most), "{mapped} {turned}");
        assert!(mapped >= turned * (1.0 - 5.0 * most), "{mapped} {turned}");
    }
}

#[test]
fn a_base_under_a_tilted_coat_gets_what_the_coat_leaves() {
    // A white sky, a white base: a tilted coat makes no light.
    let white = Material {
        base_color: [1.0; 3],
        ..coat(0.1)
    };
    for slots in [&[Slot::ClearcoatNormal][..], &[Slot::Normal], &[]] {
        let all = shown(white, &plain(), slots, 0.0, 1.0);
        assert!(all < 1.01 && all > 0.85, "{slots:?}: {all}");
    }
}

/// A metal whose highlights are stretched along a direction, in degrees from the tangent.
fn brushed(rotation: f64) -> Material {
    Material {
        layers: Layers {
            anisotropy: 0.8,
            anisotropy_rotation: rotation.to_radians() as f32,
            ..Layers::default()
        },
        ..Material::metallic_roughness([0.9; 3], 1.0, 0.3)
    }
}

#[test]
fn a_stretch_turns_with_the_tangents() {
    let of = |rotation: f64, tangent: f64, bitangent: i16| {
        let (sin, cos) = tangent.to_radians().sin_cos();
        let mesh = square([cos, sin, 0.0], bitangent);
        shown(brushed(rotation), &mesh, &[], 0.0, 0.0)
    };
    let expected = of(30.0, 0.0, 1);
    assert_near(of(0.0, 30.0, 1), expected, 1e-3);
    assert_near(of(-20.0, 50.0, 1), expected, 1e-3);
    // Where the bitangent points the other way, so does the turn.
    assert_near(of(-30.0, 0.0, -1), expected, 1e-3);
    for other in [of(0.0, 0.0, 1), of(-30.0, 0.0, 1), of(90.0, 0.0, 1)] {
        assert!((other / expected - 1.0).abs() > 0.1, "{other} {expected}");
    }
    // Half a turn is none.
    assert_near(of(210.0, 0.0, 1), expected, 1e-3);
}
