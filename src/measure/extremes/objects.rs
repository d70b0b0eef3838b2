//! Objects of the sweeps: a mesh, and one solid of each kind, with a radius of about 1.

use super::rays::Random;
use super::sweeps::Subject;
use crate::generate::displaced_sphere;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast_model::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere};
use lanecast_model::scene::{Edge, MeshData, SceneBuilder, ShapeId};

/// Position and size of an object, applied to its own coordinates: p ↦ middle + size·p.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    pub middle: DVec3,
    pub size: f64,
}

impl Stand {
    pub const HERE: Stand = Stand {
        middle: DVec3::ZERO,
        size: 1.0,
    };

    pub fn at(&self, p: DVec3) -> DVec3 {
        self.middle + p * self.size
    }
}

/// Adds the subject's shapes, not yet instantiated.
pub fn shapes(subject: Subject, scene: &mut SceneBuilder, stand: &Stand) -> Vec<ShapeId> {
    match subject {
        Subject::Triangles => vec![scene.mesh("", &ball(stand))],
        Subject::Solids => solids(scene, stand),
    }
}

/// Instantiates the shapes, by the transform `map` if there is one.
pub fn place(scene: &mut SceneBuilder, shapes: &[ShapeId], map: Option<DAffine3>) {
    let transform = map.map(|map| scene.transform(map.into()));
    for shape in shapes {
        let edge = Edge::shape(*shape);
        scene.instance("", transform.map_or(edge, |id| edge.transform(id)));
    }
}

/// Builds a closed mesh of 264 triangles, a sphere with a displaced surface.
fn ball(stand: &Stand) -> MeshData {
    let set = displaced_sphere(12, 12);
    let vertex = |p: &[f32; 3]| stand.at(DVec3::from_array(p.map(f64::from))).to_array();
    mesh_of(set.positions.iter().map(vertex).collect(), set.triangles)
}

pub fn mesh_of(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> MeshData {
    MeshData {
        positions,
        triangles,
        ..MeshData::default()
    }
}

/// Adds one solid of each kind near the corners of a cube, above a tilted ground plane.
fn solids(scene: &mut SceneBuilder, stand: &Stand) -> Vec<ShapeId> {
    let Stand { size, .. } = *stand;
    let corner = |i: u32| {
        let side = |k: u32| if i >> k & 1 == 0 { -0.5 } else { 0.5 };
        DVec3::new(side(0), side(1), side(2))
    };
    let axis = DVec3::new(0.125, 0.25, -0.0625);
    let (base, top) = (
        |i| stand.at(corner(i) - axis),
        |i| stand.at(corner(i) + axis),
    );
    let sphere = Sphere {
        center: stand.at(corner(0)),
        radius: 0.3 * size,
    };
    let ellipsoid = Ellipsoid {
        center: stand.at(corner(1)),
        radii: DVec3::new(0.3, 0.15, 0.22) * size,
    };
    let cylinder = |i, radius: f64, open| Cylinder {
        base: base(i),
        top: top(i),
        radius: radius * size,
        open,
    };
    let cone = Cone {
        base: base(4),
        top: top(4),
        base_radius: 0.3 * size,
        top_radius: 0.05 * size,
        open: false,
    };
    let half = DVec3::new(0.25, 0.18, 0.3);
    let cuboid = Cuboid {
        min: stand.at(corner(5) - half),
        max: stand.at(corner(5) + half),
    };
    // An octahedron.
    let spikes = [DVec3::X, DVec3::Y, DVec3::Z];
    let spikes = spikes.map(|k| {
        [
            stand.at(corner(6) + k * 0.25),
            stand.at(corner(6) - k * 0.25),
        ]
    });
    let faces: [HalfSpace; 8] = std::array::from_fn(|i| {
        let normal = corner(i as u32);
        let offset = normal.dot(stand.at(corner(6))) + 0.125 * size;
        HalfSpace { normal, offset }
    });
    let (u, v) = (DVec3::new(0.25, 0.125, 0.0), DVec3::new(0.0, 0.125, 0.25));
    let outline = [
        (-1.0, -1.0),
        (1.0, -1.0),
        (1.0, 1.0),
        (0.0, -0.25),
        (-1.0, 1.0),
    ];
    let outline = outline.map(|(x, y)| stand.at(corner(7) + u * x + v * y));
    let normal = DVec3::new(0.125, 1.0, 0.0625);
    let ground = HalfSpace {
        normal,
        offset: normal.dot(stand.at(DVec3::Y * -1.25)),
    };
    vec![
        scene.sphere("", sphere),
        scene.ellipsoid("", ellipsoid),
        scene.cylinder("", cylinder(2, 0.18, false)),
        scene.cylinder("", cylinder(3, 0.25, true)),
        scene.cone("", cone),
        scene.cuboid("", cuboid),
        scene.polyhedron("", &faces, spikes.as_flattened()),
        scene.polygon("", &outline, &[]),
        scene.half_space("", ground),
    ]
}

/// Returns a rotation about a random axis by a random angle.
pub fn rotation(random: &mut Random) -> DMat3 {
    let angle = random.between(0.3, 3.0);
    DMat3::from_quat(DQuat::from_axis_angle(random.direction(), angle))
}
