//! Closed meshes made for the tests, and lines that cross their edges exactly.

use crate::common::{Random, RayColumns};
use glam::DVec3;
use lanecast::internals::geom::Cuboid;
use lanecast::internals::scene::MeshData;

/// A box whose faces are squares cut in two, `cells` along every axis. Each face
/// has vertices of its own.
pub fn cube(row: &Cuboid, cells: u32) -> MeshData {
    let mut mesh = MeshData::default();
    let at = |i: [u32; 3]| -> [f64; 3] {
        std::array::from_fn(|k| {
            let part = f64::from(i[k]) / f64::from(cells);
            row.min[k] * (1.0 - part) + row.max[k] * part
        })
    };
    for face in 0..6 {
        let (axis, is_far) = (face / 2, face % 2 == 1);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let first = mesh.positions.len() as u32;
        for i in 0..=cells {
            for j in 0..=cells {
                let mut place = [0; 3];
                (place[axis], place[u], place[v]) = (if is_far { cells } else { 0 }, i, j);
                mesh.positions.push(at(place));
            }
        }
        for i in 0..cells {
            for j in 0..cells {
                let vertex = |i: u32, j: u32| first + i * (cells + 1) + j;
                let (a, b) = (vertex(i, j), vertex(i + 1, j));
                let (c, d) = (vertex(i + 1, j + 1), vertex(i, j + 1));
                // Either diagonal.
                let halves = if (i + j) % 2 == 0 {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                };
                let turned = |[a, b, c]: [u32; 3]| if is_far { [a, b, c] } else { [a, c, b] };
                mesh.triangles.extend(halves.map(turned));
            }
        }
    }
    mesh
}

/// A ring about the y-axis, of `around` times `across` squares cut in two. With
/// `step` other than 0 its corners are multiples of that.
pub fn torus(center: DVec3, radii: [f64; 2], [around, across]: [u32; 2], step: f64) -> MeshData {
    let mut mesh = MeshData::default();
    let angle = |i: u32, n: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
    for i in 0..around {
        for j in 0..across {
            let (a, b) = (angle(i, around), angle(j, across));
            let out = radii[0] + radii[1] * b.cos();
            let p = DVec3::new(out * a.cos(), radii[1] * b.sin(), out * a.sin());
            let p = if step > 0.0 {
                (p / step).round() * step
            } else {
                p
            };
            mesh.positions.push((center + p).to_array());
            let vertex = |i: u32, j: u32| i % around * across + j % across;
            let corners = [
                vertex(i, j),
                vertex(i, j + 1),
                vertex(i + 1, j + 1),
                vertex(i + 1, j),
            ];
            let [a, b, c, d] = corners;
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Every triangle the other way round.
pub fn turned(mesh: &MeshData) -> MeshData {
    let turn = |[a, b, c]: &[u32; 3]| [*a, *c, *b];
    MeshData {
        triangles: mesh.triangles.iter().map(turn).collect(),
        ..mesh.clone()
    }
}

/// Lines that meet corners and points of edges without any rounding, at t = 1, 2 or
/// 4, and some that run along edges; of a mesh whose corners are f32.
pub fn aimed(mesh: &MeshData, random: &mut Random, count: usize) -> RayColumns {
    let mut rays = RayColumns::default();
    let vertex =
        |v: u32| DVec3::from_array(mesh.positions[v as usize].map(|x| f64::from(x as f32)));
    for _ in 0..count {
        let corners = mesh.triangles[random.below(mesh.triangles.len() as u64) as usize];
        let first = random.below(3) as usize;
        let [a, b] = [0, 1].map(|next| vertex(corners[(first + next) % 3]));
        let at = match random.below(4) {
            0 => a,
            _ => a + (b - a) * (random.below(16) as f64 / 16.0),
        };
        let mut dir = (random.vector() * 32.0).round() / 16.0;
        match random.below(16) {
            // Along the edge, where that needs no rounding.
            0 => dir = b - a,
            1 | 2 => dir = DVec3::AXES[random.below(3) as usize],
            // To another corner.
            3 => {
                let other = mesh.triangles[random.below(mesh.triangles.len() as u64) as usize][0];
                dir = vertex(other) - at;
            }
            _ => {}
        }
        if dir == DVec3::ZERO {
            dir = DVec3::X;
        }
        let dir = dir.to_array().map(|x| x as f32);
        let back = f64::from(1_u32 << random.below(3));
        let org = at - DVec3::from_array(dir.map(f64::from)) * back;
        rays.push(org, dir);
    }
    rays
}
