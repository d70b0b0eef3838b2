//! Surfaces at hits of the stable interface: those that pictures show, and closed forms.

use super::tracer::{ball, config, tracer};
use crate::common::{ALL_AOVS, in_repository, load};
use glam::DVec3;
use lanecast::internals::render::RayGenerator;
use lanecast::internals::scene::{Operand, Operator};
use lanecast::shapes::{Cuboid, Sphere};
use lanecast::{
    AovSet, Edge, Hits, Material, MeshData, Precision, Progress, RayBatch, RenderConfig,
    SceneBuilder, Surfaces, Tracer,
};

/// The hits and surfaces of rays of which each goes from a point along a direction.
fn met(tracer: &Tracer, along: &[([f64; 3], [f64; 3])]) -> (Hits, Surfaces) {
    let mut rays = RayBatch::default();
    rays.extend(
        along
            .iter()
            .map(|(org, dir)| (DVec3::from(*org), DVec3::from(*dir))),
    );
    let hits = tracer.closest(&rays);
    let surfaces = tracer.surfaces(&rays, &hits).unwrap();
    (hits, surfaces)
}

#[test]
fn surfaces_are_those_that_pictures_show() {
    for file in [
        "csg_bracket.toml",
        "primitives.toml",
        "csg_mesh.toml",
        "textures_solids.toml",
    ] {
        let loaded = load(&in_repository("scenes").join(file), 4.0 / 3.0);
        let tracer = tracer(&loaded.scene, Precision::Guarded);
        let config = RenderConfig {
            aovs: AovSet {
                geometric_normal: true,
                ..ALL_AOVS
            },
            ..config()
        };
        let picture = tracer
            .render(&config, &Progress::default(), &|_| ())
            .unwrap();
        let camera = loaded.scene.cameras.rows[0];
        let generator = RayGenerator::new(camera, config.width, config.height, config.grid);
        let mut rays = RayBatch::default();
        let pixels = (0..config.height).flat_map(|y| (0..config.width).map(move |x| (x, y)));
        rays.extend(pixels.map(|(x, y)| generator.ray(x, y, [0.5; 2])));
        let hits = tracer.closest(&rays);
        let surfaces = tracer.surfaces(&rays, &hits).unwrap();
        let instances = picture.instance_id.unwrap();
        let [points, normals, geometric] =
            [picture.position, picture.normal, picture.geometric_normal].map(Option::unwrap);
        let primitives = picture.primitive_id.unwrap();
        let single = |v: DVec3| v.to_array().map(|x| x as f32);
        let mut seen = 0;
        for row in (0..rays.len()).filter(|row| hits.get(*row).is_some()) {
            seen += 1;
            let ng = surfaces.geometric_normal[row];
            let ns = surfaces.shading_normal[row];
            let facing = if rays.ray(row).1.dot(ng) <= 0.0 {
                ng
            } else {
                -ng
            };
            assert_eq!(
                (hits.instance[row], hits.primitive[row]),
                (instances[row], primitives[row])
            );
            assert_eq!(single(surfaces.point[row]), points[row], "{file} {row}");
            assert_eq!(single(ns), normals[row], "{file} {row}");
            assert_eq!(single(facing), geometric[row], "{file} {row}");
        }
        assert!(seen > 1000, "{file}: {seen}");
    }
}

#[test]
fn surfaces_have_the_normals_and_materials_of_closed_forms() {
    let mut scene = SceneBuilder::default();
    let [red, blue] = ["red", ""].map(|name| scene.material(name, Material::default()));
    let (center, radius) = (DVec3::ZERO, 1.0);
    let ball = scene.sphere("ball", Sphere { center, radius });
    let (min, max) = (DVec3::new(-2.0, -2.0, 4.0), DVec3::new(2.0, 2.0, 6.0));
    let block = scene.cuboid("", Cuboid { min, max });
    let bite = scene.sphere(
        "",
        Sphere {
            center: DVec3::Z * 4.0,
            radius,
        },
    );
    let operands = [(block, red), (bite, blue)].map(|(shape, material)| Operand {
        material: Some(material),
        ..Operand::shape(shape)
    });
    let bitten = scene.csg("bitten", Operator::Difference, &operands);
    scene.instance("first", Edge::shape(ball));
    scene.instance("", Edge::shape(bitten));
    let tracer = tracer(&scene.finish().unwrap(), Precision::Guarded);
    let (hits, surfaces) = met(
        &tracer,
        &[
            ([0.0, 0.0, -3.0], [0.0, 0.0, 0.5]),
            ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]),
            ([1.5, 0.0, 3.0], [0.0, 0.0, 2.0]),
            ([0.0, 9.0, 0.0], [0.0, 1.0, 0.0]),
        ],
    );
    let (up, back) = (DVec3::Y, -DVec3::Z);
    assert_eq!(
        surfaces.point[..4],
        [back, up, DVec3::Z * 5.0, DVec3::new(1.5, 0.0, 4.0)]
    );
    assert_eq!(surfaces.geometric_normal[..4], [back, up, back, back]);
    assert_eq!(surfaces.shading_normal[..4], [back, -up, back, back]);
    let materials = [None, None, Some(blue), Some(red), None];
    assert_eq!(surfaces.material, materials);
    assert_eq!(hits.turned, [false, false, true, false, false]);
    assert_eq!(hits.primitive, [0, 0, 1, 0, u32::MAX]);
    assert_eq!(surfaces.len(), 5);
    assert!(surfaces.point[4].is_nan() && surfaces.uv[4][0].is_nan());
    assert_eq!(tracer.instance_name(0).as_deref(), Some("first.0"));
    assert_eq!(tracer.instance_name(1).as_deref(), Some("bitten.1"));
    assert_eq!(tracer.instance_name(2), None);
    assert_eq!(tracer.material_name(red).as_deref(), Some("red"));
    assert_eq!(tracer.material_name(blue).as_deref(), Some("material.1"));
}

#[test]
fn surfaces_of_meshes_have_their_texture_coordinates_and_vertex_normals() {
    let mut scene = SceneBuilder::default();
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    // Coordinates that are x/2 and 1 - y, and normals that lean outward along x.
    let mesh = scene.mesh(
        "",
        &MeshData {
            positions: corners.map(|[x, y]| [x, y, 0.0]).into(),
            normals: corners.map(|[x, _]| [x as f32 - 0.5, 0.0, 1.0]).into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            uvs: vec![
                corners
                    .map(|[x, y]| [x as f32 / 2.0, 1.0 - y as f32])
                    .into(),
            ],
            ..MeshData::default()
        },
    );
    scene.instance("", Edge::shape(mesh));
    let tracer = tracer(&scene.finish().unwrap(), Precision::Guarded);
    for (x, y) in [(0.75, 0.25), (0.25, 0.75), (0.125, 0.5)] {
        let (hits, surfaces) = met(&tracer, &[([x, y, 2.0], [0.0, 0.0, -1.0])]);
        assert_eq!(hits.primitive[0], u32::from(y > x));
        let [u, v] = surfaces.uv[0];
        assert!(
            (u - x / 2.0).abs() < 1e-12 && (v - (1.0 - y)).abs() < 1e-12,
            "{u} {v}"
        );
        let leaning = DVec3::new(x - 0.5, 0.0, 1.0).normalize();
        assert_eq!(surfaces.geometric_normal[0], DVec3::Z);
        assert!(surfaces.shading_normal[0].distance(leaning) < 1e-7);
    }
}

#[test]
fn surfaces_of_hits_that_are_not_the_scene_s_are_refused() {
    let tracer = tracer(&ball(), Precision::Guarded);
    let mut rays = RayBatch::default();
    rays.extend([(DVec3::Z * 4.0, -DVec3::Z); 3]);
    let hits = tracer.closest(&rays);
    let other = |change: fn(&mut Hits)| {
        let mut hits = hits.clone();
        change(&mut hits);
        let refused = tracer.surfaces(&rays, &hits);
        refused.expect_err("other hits").to_string()
    };
    let missing = other(|hits| hits.t.truncate(2));
    assert_eq!(
        missing,
        "there are 3 rays and 2 hits; give the rays that were traced"
    );
    let unknown = "hit 1 is on nothing in this scene; ask the tracer that found it";
    assert_eq!(other(|hits| hits.instance[1] = 1), unknown);
    assert_eq!(other(|hits| hits.primitive[1] = 1), unknown);
    assert_eq!(other(|hits| hits.turned[1] = true), unknown);
}
