//! `verify --light` where normals are interpolated.

use crate::light::{is_right, matte, shining, stage};
use glam::DVec3;
use lanecast::internals::math::Affine;
use lanecast::internals::scene::*;
use lanecast::shapes::Cuboid;
use std::f64::consts::PI;

/// A ball of few facets, about a centre, with the normals of the sphere.
fn faceted(center: DVec3, radius: f64) -> MeshData {
    let (rows, columns) = (6, 9);
    let mut mesh = MeshData::default();
    for row in 0..=rows {
        // The poles' vertices lie in one place, so that the mesh is closed.
        let (sin, cos) = match row {
            0 => (0.0, 1.0),
            _ if row == rows => (0.0, -1.0),
            _ => (PI * f64::from(row) / f64::from(rows)).sin_cos(),
        };
        for column in 0..columns {
            let (y, x) = (2.0 * PI * f64::from(column) / f64::from(columns)).sin_cos();
            let out = DVec3::new(sin * x, cos, -sin * y);
            mesh.positions.push((center + out * radius).to_array());
            mesh.normals.push(out.to_array().map(|c| c as f32));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |r: u32, c: u32| (row + r) * columns + (column + c) % columns;
            if row + 1 < rows {
                mesh.triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
            }
            if row > 0 {
                mesh.triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
    }
    mesh
}

fn materials() -> [(&'static str, Material); 4] {
    let coated = Layers {
        clearcoat: 0.8,
        clearcoat_roughness: 0.1,
        ..Layers::default()
    };
    let glass = Material {
        transmission: 1.0,
        ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
    };
    let lacquer = Material {
        layers: coated,
        ..matte()
    };
    [
        ("matte", matte()),
        (
            "metal",
            Material::metallic_roughness([0.9, 0.7, 0.4], 1.0, 0.3),
        ),
        ("lacquer", lacquer),
        ("glass", glass),
    ]
}

#[test]
fn smooth_meshes_are_right() {
    for (name, material) in materials() {
        let mut scene = stage(material);
        shining(&mut scene);
        let material = scene.material("smooth", material);
        let mesh = scene.mesh("", &faceted(DVec3::new(0.0, 1.3, 2.4), 0.6));
        scene.instance("", Edge::shape(mesh).material(material));
        // Mirrored and drawn out, so that normals do not turn as points do.
        let map = [[-0.5, 0.0, 0.1], [0.0, 0.9, 0.0], [0.2, 0.0, 0.4]];
        let placed = scene.transform(Affine::new(map, [1.4, 0.4, 1.2]));
        scene.instance("", Edge::shape(mesh).material(material).transform(placed));
        // One of the floor's and the block's material, whose hits come next to its own.
        let placed = scene.transform(Affine::new(
            [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]],
            [1.3, 0.9, 0.6],
        ));
        let floor = MaterialId(0);
        scene.instance("", Edge::shape(mesh).material(floor).transform(placed));
        is_right(name, scene);
    }
}

/// A tile whose normals lean outwards, and a block with a hollow that a smooth mesh has left.
#[test]
fn smooth_polygons_and_operands_are_right() {
    let mut scene = stage(matte());
    shining(&mut scene);
    let material = scene.material("smooth", matte());
    let corners = [[0.2, 1.2], [1.4, 1.2], [1.6, 2.0], [0.9, 2.6], [0.1, 2.1]];
    let points = corners.map(|[x, z]| DVec3::new(x, 0.4, z));
    let normals = points.map(|p| (p - DVec3::new(0.8, -0.6, 1.8)).normalize());
    let tile = scene.polygon("", &points, &normals);
    scene.instance("", Edge::shape(tile).material(material));
    let mesh = scene.mesh("", &faceted(DVec3::ZERO, 0.5));
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-1.6, 0.7, 1.3),
            max: DVec3::new(0.2, 1.9, 1.7),
        },
    );
    let drawn_out = [[1.4, 0.0, 0.1], [0.0, 1.0, 0.0], [0.0, 0.0, 0.6]];
    let placed = scene.transform(Affine::new(drawn_out, [-0.7, 1.3, 1.7]));
    let hollow = Operand::shape(mesh).transform(placed);
    let operands = [Operand::shape(block), hollow];
    let solid = scene.csg("", Operator::Difference, &operands);
    scene.instance("", Edge::shape(solid).material(material));
    is_right("polygon and operand", scene);
}
