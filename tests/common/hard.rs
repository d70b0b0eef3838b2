//! Random scenes and rays at which roundings decide.

use super::{Random, RayColumns, random_mesh, random_shape};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::math::Aabb;
use lanecast::internals::scene::*;

/// Grazed stacks of slivers, coincident triangles, badly conditioned placements,
/// scenes far from the origin, flat boxes under rays parallel to axes.
pub fn hard_scene(seed: u64) -> Scene {
    let random = &mut Random(seed);
    let mut scene = SceneBuilder::default();
    match seed % 5 {
        0 => {
            // Triangles within a sheet, as thin as a rounding or without depth.
            let depth = [0.0, 1e-7, 1e-6, 1e-4][random.below(4) as usize];
            let turn = DQuat::from_axis_angle(random.vector().normalize(), random.unit() * 3.0);
            let turn = if random.below(2) == 0 {
                turn
            } else {
                DQuat::IDENTITY
            };
            let positions = (0..300).map(|_| {
                let p = random.vector();
                (turn * DVec3::new(p.x, p.y, p.z * depth)).to_array()
            });
            let data = MeshData {
                positions: positions.collect(),
                triangles: (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                ..MeshData::default()
            };
            let shape = scene.mesh("", &data);
            let mut edge = Edge::shape(shape);
            if random.below(2) == 0 {
                // As it is once more, and turned.
                scene.instance("", edge);
                let map = DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0, 1.5, 0.7),
                    DQuat::from_axis_angle(random.vector().normalize(), random.unit() * 3.0),
                    random.vector(),
                );
                edge = edge.transform(scene.transform(map.into()));
            }
            scene.instance("", edge);
        }
        1 => {
            // The same triangles twice in a mesh, and the mesh twice in place.
            let mut data = random_mesh(random);
            let twice: Vec<[u32; 3]> = data
                .triangles
                .iter()
                .map(|[a, b, c]| [*b, *c, *a])
                .collect();
            data.triangles.extend(twice);
            let shape = scene.mesh("", &data);
            scene.instance("", Edge::shape(shape));
            scene.instance("", Edge::shape(shape));
        }
        2 => {
            for _ in 0..8 {
                let shape = random_shape(&mut scene, random);
                let axis = |r: &mut Random| libm::pow(10.0, r.unit() * 5.0);
                let stretch = DVec3::new(axis(random), axis(random), axis(random));
                let map = random.oblique(stretch);
                let map = DAffine3::from_translation(random.vector() * 10.0) * map;
                let transform = scene.transform(map.into());
                scene.instance("", Edge::shape(shape).transform(transform));
            }
        }
        3 => {
            let away = DAffine3::from_translation(DVec3::new(1e4, -2e4, 3e4));
            for i in 0..12 {
                let shape = random_shape(&mut scene, random);
                let map = away * DAffine3::from_translation(random.vector() * 3.0);
                // Some of them with far vertices of their own.
                let edge = Edge::shape(shape);
                if i % 3 != 0 {
                    let transform = scene.transform(map.into());
                    scene.instance("", edge.transform(transform));
                } else {
                    let mut data = random_mesh(random);
                    for p in &mut data.positions {
                        *p = map.transform_point3(DVec3::from_array(*p)).to_array();
                    }
                    let far = scene.mesh("", &data);
                    scene.instance("", Edge::shape(far));
                }
            }
        }
        _ => {
            // Axis-parallel squares with round coordinates, sharing edges.
            let mut data = MeshData::default();
            for _ in 0..60 {
                let k = random.below(3) as usize;
                let at = [(); 3].map(|()| random.below(5) as f64 - 2.0);
                let first = data.positions.len() as u32;
                for (u, v) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                    let mut p = at;
                    p[(k + 1) % 3] += u;
                    p[(k + 2) % 3] += v;
                    data.positions.push(p);
                }
                data.triangles.push([first, first + 1, first + 2]);
                data.triangles.push([first, first + 2, first + 3]);
            }
            let shape = scene.mesh("", &data);
            scene.instance("", Edge::shape(shape));
        }
    }
    scene.finish().expect("a hard scene is a good scene")
}

/// Rays at points of a hard scene's shapes: any way, within a triangle's plane
/// or nearly, along an axis.
pub fn hard_rays(scene: &Scene, instances: &Instances, seed: u64, count: usize) -> RayColumns {
    let random = &mut Random(!seed);
    let mut rays = RayColumns::default();
    for _ in 0..count {
        let row = instances.get(scene, random.below(instances.count()));
        // A point of the shape, and two directions along its surface there.
        let (point, along) = match scene.shapes.row(row.shape) {
            Shape::Mesh(id) => {
                let mesh = scene.meshes.row(id);
                let i = random.below(mesh.triangles.len() as u64) as usize;
                let [a, b, c] = mesh
                    .corners(i)
                    .map(|c| DVec3::from_array(c.map(f64::from)) + mesh.center);
                let (u, v) = match random.below(3) {
                    0 => (0.5, 0.5),
                    _ => (random.unit().abs() * 0.5, random.unit().abs() * 0.5),
                };
                (a + (b - a) * u + (c - a) * v, [b - a, c - a])
            }
            _ => {
                // What goes on for ever is met anywhere near its origin.
                let anywhere = || Aabb::new(DVec3::splat(-3.0), DVec3::splat(3.0));
                let bounds = shape_bounds(scene, row.shape).unwrap_or_else(anywhere);
                let half = bounds.extent() * 0.5;
                (
                    bounds.center() + random.vector() * half,
                    [half, random.vector() * half],
                )
            }
        };
        let map = &row.world_from_object;
        let point = DVec3::from_array(map.point(point.to_array()));
        let along = along.map(|d| DVec3::from_array(map.vector(d.to_array())));
        let within = along[0] * random.unit() + along[1] * random.unit();
        let aside = random.vector() * within.length();
        let dir = match random.below(4) {
            0 => aside,
            1 => within,
            2 => within + aside * 1e-6,
            _ => {
                let mut axis = DVec3::ZERO;
                axis[random.below(3) as usize] = random.unit();
                axis * within.length()
            }
        };
        let dir = dir.to_array().map(|x| x as f32);
        let wide = DVec3::from_array(dir.map(f64::from));
        if wide.length() > 0.0 {
            rays.push(point - wide * (1.0 + 9.0 * random.unit().abs()), dir);
        }
    }
    rays
}
