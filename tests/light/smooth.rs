//! Smooth meshes: facets throw no shadows on their neighbours, and no light leaks through them.

use lanecast::internals::render::Integrator;
use lanecast::internals::scene::{Environment, Model};
use lanecast::shapes::{Cuboid, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, MeshData, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};
use std::collections::HashMap;

/// A sphere of triangles: an icosahedron whose faces are split in four, so often.
fn icosphere(splits: u32) -> MeshData {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        points.push(DVec3::new(0.0, a, b));
        points.push(DVec3::new(a, b, 0.0));
        points.push(DVec3::new(b, 0.0, a));
    }
    let points_near = |p: DVec3, q: DVec3| (p.distance(q) - 2.0).abs() < 1e-9;
    let mut faces: Vec<[usize; 3]> = Vec::new();
    for a in 0..12 {
        for b in 0..12 {
            for c in 0..12 {
                let [p, q, r] = [a, b, c].map(|i| points[i]);
                let near = points_near(p, q) && points_near(q, r) && points_near(r, p);
                if near && a < b && a < c && (q - p).cross(r - p).dot(p) > 0.0 {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..splits {
        let mut middles: HashMap<[usize; 2], usize> = HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: usize, j: usize| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    points.push(points[i].normalize() + points[j].normalize());
                    points.len() - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = next;
    }
    let unit: Vec<DVec3> = points.iter().map(|p| p.normalize()).collect();
    MeshData {
        positions: unit.iter().map(|p| p.to_array()).collect(),
        normals: unit
            .iter()
            .map(|p| p.to_array().map(|x| x as f32))
            .collect(),
        triangles: faces.iter().map(|f| f.map(|i| i as u32)).collect(),
        ..MeshData::default()
    }
}

fn matte(scene: &mut SceneBuilder) -> lanecast::internals::scene::MaterialId {
    scene.material(
        "",
        Material {
            model: Model::Phong {
                diffuse: [1.0; 3],
                specular: [0.0; 3],
                exponent: 1.0,
                mirror: [0.0; 3],
            },
            ..Material::default()
        },
    )
}

fn lit(scene: &mut SceneBuilder, eye: DVec3, at: DVec3) {
    scene.light(Light::Directional {
        direction: DVec3::new(-1.0, -0.3, -0.1),
        irradiance: [3.0; 3],
        angle: 0.0,
    });
    scene.camera("", Camera::perspective(eye, at, DVec3::Y, 25.0));
}

fn picture(scene: &Scene, integrator: Integrator) -> Vec<f32> {
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    let config = RenderConfig {
        width: 96,
        height: 96,
        spp: 4,
        max_depth: 1,
        integrator,
        ..RenderConfig::default()
    };
    let picture = tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    picture.color.iter().map(|c| c[0]).collect()
}

#[test]
fn light_fades_over_facets_as_over_a_sphere() {
    let of_mesh = |mesh: bool| {
        let mut scene = SceneBuilder::default();
        let material = matte(&mut scene);
        let ball = match mesh {
            true => scene.mesh("", &icosphere(2)),
            false => scene.sphere(
                "",
                Sphere {
                    center: DVec3::ZERO,
                    radius: 1.0,
                },
            ),
        };
        scene.instance("", Edge::shape(ball).material(material));
        lit(&mut scene, DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO);
        scene.finish().unwrap()
    };
    let (mesh, sphere) = (of_mesh(true), of_mesh(false));
    let error = |integrator| {
        let (a, b) = (picture(&mesh, integrator), picture(&sphere, integrator));
        // The middle of the picture, where silhouettes are not.
        let inside = |i: &usize| {
            let (x, y) = (*i as f64 % 96.0 - 47.5, *i as f64 / 96.0 - 47.5);
            x * x + y * y < 27.0 * 27.0
        };
        // Where light grazes, which is where facets show.
        let grazed = |i: &usize| inside(i) && b[*i] < 0.2;
        let squares = (0..96 * 96).filter(grazed).map(|i| (a[i] - b[i]).powi(2));
        (squares.sum::<f32>() / (96.0 * 96.0)).sqrt()
    };
    // Whitted's integrator starts rays to lights on the facets.
    let (before, after) = (error(Integrator::Direct), error(Integrator::Path));
    println!("RMSE on facets {before}, lifted {after}");
    assert!(after * 4.0 < before, "{after} of {before}");
}

#[test]
fn no_light_enters_a_closed_smooth_mesh() {
    let mut scene = SceneBuilder::default();
    let material = matte(&mut scene);
    let ball = scene.mesh("", &icosphere(1));
    scene.instance("", Edge::shape(ball).material(material));
    lit(&mut scene, DVec3::ZERO, DVec3::new(1.0, 0.2, 0.1));
    let scene = scene.finish().unwrap();
    assert!(picture(&scene, Integrator::Path).iter().all(|c| *c == 0.0));
}

/// Normals at the corners of a fold describe no surface near the facet. Lifted onto the one that
/// they suggest, paths from the facet's middle would start inside the black box above it.
#[test]
fn folds_are_not_lifted_into_their_neighbours() {
    let mut scene = SceneBuilder::default();
    let corners = [0.0, 1.0, 2.0].map(|k| {
        let (sin, cos) = (k * std::f64::consts::TAU / 3.0).sin_cos();
        DVec3::new(cos, 0.0, -sin)
    });
    // 60° off, outwards.
    let (up, out) = (0.5, 0.75_f64.sqrt());
    let tilted = |corner: DVec3| (DVec3::Y * up + corner * out).to_array().map(|x| x as f32);
    let fold = scene.mesh(
        "",
        &MeshData {
            positions: corners.map(|p| p.to_array()).to_vec(),
            normals: corners.map(tilted).to_vec(),
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        },
    );
    let white = matte(&mut scene);
    scene.instance("", Edge::shape(fold).material(white));
    // The mean of the corners' tangent planes lies here.
    let lifted = DVec3::Y * (up * out);
    let half = DVec3::splat(0.05);
    let box_there = scene.cuboid(
        "",
        Cuboid {
            min: lifted - half,
            max: lifted + half,
        },
    );
    let black = scene.material("", Material::metallic_roughness([0.0; 3], 0.0, 0.0));
    scene.instance("", Edge::shape(box_there).material(black));
    scene.environment(Environment::uniform([1.0; 3]));
    // From below the box: a hundredth of the sky, weighed by the cosine, is hidden by it.
    let eye = DVec3::new(0.02, 0.2, 0.0);
    scene.camera("", Camera::orthographic(eye, DVec3::ZERO, DVec3::X, 1e-6));
    let scene = scene.finish().unwrap();
    let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
    let config = RenderConfig {
        width: 4,
        height: 4,
        spp: 256,
        integrator: Integrator::Path,
        max_depth: 4,
        ..RenderConfig::default()
    };
    let picture = tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    let mean = picture.color.iter().map(|c| c[0]).sum::<f32>() / 16.0;
    assert!((0.93..1.0).contains(&mean), "{mean}");
}

/// A mesh whose first triangle has no material: the second one's is not taken for both.
#[test]
fn materials_that_begin_late_are_kept_apart() {
    let mut scene = SceneBuilder::default();
    let lamp = scene.material(
        "",
        Material {
            emission: [2.0; 3],
            ..Material::default()
        },
    );
    let corner = |x: f64, y: f64| [x, y, 0.0];
    let mesh = MeshData {
        positions: vec![
            corner(-1.0, -1.0),
            corner(0.0, -1.0),
            corner(0.0, 1.0),
            corner(0.0, -1.0),
            corner(1.0, -1.0),
            corner(0.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        parts: vec![(1, Some(lamp))],
        ..MeshData::default()
    };
    let shape = scene.mesh("", &mesh);
    scene.instance("", Edge::shape(shape));
    let eye = DVec3::new(0.0, 0.0, 4.0);
    scene.camera("", Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 25.0));
    let scene = scene.finish().expect("a right scene");
    let seen = picture(&scene, Integrator::Path);
    // Of 96x96 pixels, in the lower middle of each triangle.
    let at = |x: usize| seen[60 * 96 + x];
    assert!(at(40) < 1.0, "{}", at(40));
    assert!(at(56) >= 2.0, "{}", at(56));
}
