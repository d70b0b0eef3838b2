//! One primitive of each kind, with a random size and centre.

use crate::common::{Random, barth_sextic, clebsch, dented, gyroid, torus};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::World;
use lanecast::internals::geom::exact::sign_at;
use lanecast::internals::geom::formula::value_and_gradient;
use lanecast::internals::geom::*;
use lanecast::internals::math::Affine;
use lanecast::internals::scene::*;
use std::cmp::Ordering;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Sphere,
    Ellipsoid,
    /// An ellipsoid, multiplied out.
    Quadric,
    /// Any quadric.
    Saddle,
    Cylinder,
    OpenCylinder,
    Cone,
    OpenCone,
    Box,
    Polyhedron,
    HalfSpace,
    Polygon,
    /// A convex, closed mesh.
    Ball,
    /// Triangles anywhere.
    Soup,
    Torus,
    /// Clebsch's, open and in a clip.
    Cubic,
    /// Barth's, with its double points; open and in a clip.
    Sextic,
    /// A gyroid, open and in a clip.
    Gyroid,
}

pub const KINDS: [Kind; 18] = [
    Kind::Sphere,
    Kind::Ellipsoid,
    Kind::Quadric,
    Kind::Saddle,
    Kind::Cylinder,
    Kind::OpenCylinder,
    Kind::Cone,
    Kind::OpenCone,
    Kind::Box,
    Kind::Polyhedron,
    Kind::HalfSpace,
    Kind::Polygon,
    Kind::Ball,
    Kind::Soup,
    Kind::Torus,
    Kind::Cubic,
    Kind::Sextic,
    Kind::Gyroid,
];

impl Kind {
    /// What is met on leaving outward is met wrongly, whatever it is.
    pub fn is_convex(self) -> bool {
        !matches!(
            self,
            Kind::Saddle | Kind::Soup | Kind::Torus | Kind::Cubic | Kind::Sextic | Kind::Gyroid
        )
    }

    /// A ray that leaves inward meets the other side.
    pub fn is_closed(self) -> bool {
        !matches!(
            self,
            Kind::OpenCylinder
                | Kind::OpenCone
                | Kind::HalfSpace
                | Kind::Polygon
                | Kind::Saddle
                | Kind::Soup
                | Kind::Cubic
                | Kind::Sextic
                | Kind::Gyroid
        )
    }

    /// A plane, or many: no ray that leaves one comes back to it.
    pub fn is_flat(self) -> bool {
        matches!(
            self,
            Kind::HalfSpace | Kind::Polygon | Kind::Ball | Kind::Soup
        )
    }
}

/// A scene of one instance.
pub struct Subject {
    pub builder: SceneBuilder,
    /// Around what there is to see of it, object space.
    pub center: DVec3,
    pub size: f64,
    pub object_from_world: Affine,
    pub world_from_object: Affine,
}

impl Subject {
    /// Of an implicit surface's function, at a point of the world; of a polynomial exact.
    pub fn sign_at(&self, world: &World, point: [f64; 3]) -> Option<Ordering> {
        let instance = world.instances.get(&world.scene, 0);
        let point = self.object_from_world.point(point);
        match world.scene.shapes.row(instance.shape) {
            Shape::Implicit(id) => Some(sign_at(world.scene.implicits.row(id).tape, point)),
            Shape::LevelSet(id) => {
                let formula = world.scene.level_sets.row(id).formula;
                value_and_gradient(formula, point).0.partial_cmp(&0.0)
            }
            _ => None,
        }
    }
}

/// `scale` is that of the numbers of the shape or of the transform.
pub fn subject(kind: Kind, scale: f64, random: &mut Random) -> Subject {
    let mut builder = SceneBuilder::default();
    let way = random.below(3);
    let (own, placed) = if way == 2 { (1.0, scale) } else { (scale, 1.0) };
    // Far from the origin the numbers of a quadric are large for what it is.
    let far = if kind == Kind::Quadric { 40.0 } else { 2.0 };
    let center = random.vector() * (far * own);
    let shape = shape(&mut builder, kind, center, own, random);
    let mut edge = Edge::shape(shape);
    let mut world_from_object = Affine::IDENTITY;
    if way > 0 {
        let axis = random.vector().normalize_or(DVec3::X);
        let turn = DQuat::from_axis_angle(axis, random.unit() * 3.0);
        let stretch = DVec3::from_array([(); 3].map(|()| 0.3 + 1.2 * random.unit().abs()));
        let map = DAffine3::from_scale_rotation_translation(
            stretch * placed,
            turn,
            random.vector() * (5.0 * scale),
        );
        world_from_object = map.into();
        edge = edge.transform(builder.transform(world_from_object));
    }
    builder.instance("", edge);
    Subject {
        builder,
        center,
        size: own,
        object_from_world: world_from_object.inverse().expect("not singular"),
        world_from_object,
    }
}

fn shape(
    to: &mut SceneBuilder,
    kind: Kind,
    center: DVec3,
    scale: f64,
    random: &mut Random,
) -> ShapeId {
    let mut size = || (0.2 + 0.8 * random.unit().abs()) * scale;
    let sizes = DVec3::new(size(), size(), size());
    let axis = random.vector().normalize_or(DVec3::Y) * sizes.y;
    let (base, top) = (center - axis, center + axis);
    let open = matches!(kind, Kind::OpenCylinder | Kind::OpenCone);
    match kind {
        Kind::Sphere => {
            let radius = sizes.x;
            to.sphere("", Sphere { center, radius })
        }
        Kind::Ellipsoid => {
            let radii = sizes;
            to.ellipsoid("", Ellipsoid { center, radii })
        }
        Kind::Quadric | Kind::Saddle => {
            // Σ sₖ (uₖ·(x − c) / rₖ)² ≤ 1, of its own or with one sign turned.
            let (v, w) = axis.normalize().any_orthonormal_pair();
            let axes = [axis.normalize(), v, w];
            let mut weights = (sizes * sizes).recip().to_array();
            if kind == Kind::Saddle {
                weights[random.below(3) as usize] *= -1.0;
            }
            let entry = |i: usize, j: usize| -> f64 {
                (0..3).map(|k| axes[k][i] * axes[k][j] * weights[k]).sum()
            };
            let about = |i: usize| -> f64 { (0..3).map(|j| entry(i, j) * center[j]).sum() };
            let constant = (0..3).map(|i| about(i) * center[i]).sum::<f64>() - 1.0;
            let [xy, xz, yz] = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| 2.0 * entry(i, j));
            let [x, y, z] = [0, 1, 2].map(|i| -2.0 * about(i));
            let coefficients = [
                entry(0, 0),
                entry(1, 1),
                entry(2, 2),
                xy,
                xz,
                yz,
                x,
                y,
                z,
                constant,
            ];
            to.quadric("", Quadric { coefficients })
        }
        Kind::Cylinder | Kind::OpenCylinder => {
            let radius = sizes.x;
            let row = Cylinder {
                base,
                top,
                radius,
                open,
            };
            to.cylinder("", row)
        }
        Kind::Cone | Kind::OpenCone => {
            let top_radius = if random.below(2) == 0 { 0.0 } else { sizes.z };
            let row = Cone {
                base,
                top,
                base_radius: sizes.x,
                top_radius,
                open,
            };
            to.cone("", row)
        }
        Kind::Box => {
            let (min, max) = (center - sizes, center + sizes);
            to.cuboid("", Cuboid { min, max })
        }
        Kind::Polyhedron => {
            let corners = [
                DVec3::new(1.0, 1.0, 1.0),
                DVec3::new(-1.0, -1.0, 1.0),
                DVec3::new(-1.0, 1.0, -1.0),
                DVec3::new(1.0, -1.0, -1.0),
            ];
            let plane = |normal: DVec3| HalfSpace {
                normal,
                offset: normal.dot(center) + normal.length() * sizes.x,
            };
            let planes = corners.map(|c| plane(-c));
            let reach = sizes.x * 3.0_f64.sqrt();
            let points = corners.map(|c| center + c * reach);
            to.polyhedron("", &planes, &points)
        }
        Kind::HalfSpace => {
            let normal = axis * 3.0;
            let offset = normal.dot(center);
            to.half_space("", HalfSpace { normal, offset })
        }
        Kind::Polygon => {
            let (u, v) = axis.normalize().any_orthonormal_pair();
            let corner = |x: f64, y: f64| center + (u * x + v * y) * scale;
            to.polygon("", &dented(corner), &[])
        }
        Kind::Ball => {
            let data = ball(center, sizes.x);
            assert!(is_convex(&data));
            to.mesh("", &data)
        }
        Kind::Torus => {
            let radii = [0.7 * sizes.x, 0.3 * sizes.y];
            to.implicit("", torus(center, radii), false, None)
        }
        Kind::Cubic | Kind::Sextic | Kind::Gyroid => {
            let clip = match random.below(2) {
                0 => Clip::Sphere(Sphere {
                    center,
                    radius: scale,
                }),
                _ => Clip::Cuboid(Cuboid {
                    min: center - sizes,
                    max: center + scale,
                }),
            };
            if kind == Kind::Gyroid {
                let waves = gyroid(center, 2.0 / sizes.x);
                return to.level_set("", waves, true, Some(clip));
            }
            let tape = match kind {
                Kind::Cubic => clebsch(center, 0.5 * sizes.x),
                _ => barth_sextic(center, 0.5 * sizes.x),
            };
            to.implicit("", tape, true, Some(clip))
        }
        Kind::Soup => {
            let point = |_| (center + random.vector() * scale).to_array();
            let data = MeshData {
                positions: (0..60).map(point).collect(),
                triangles: (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                ..MeshData::default()
            };
            to.mesh("", &data)
        }
    }
}

/// An octahedron, its triangles split in four twice, on a sphere.
fn ball(center: DVec3, radius: f64) -> MeshData {
    let mut data = MeshData::default();
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    for i in 0..8 {
        let side = |k: usize| if i >> k & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * side(0), DVec3::Y * side(1), DVec3::Z * side(2)];
        let even = side(0) * side(1) * side(2) > 0.0;
        triangles.push(if even { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..2 {
        let split = |[a, b, c]: [DVec3; 3]| {
            let middle = |p: DVec3, q: DVec3| (p + q).normalize();
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    for corners in triangles {
        let corners = corners.map(|c| {
            let p = (center + c * radius).to_array();
            let known = data.positions.iter().position(|q| *q == p);
            known.unwrap_or_else(|| {
                data.positions.push(p);
                data.positions.len() - 1
            }) as u32
        });
        data.triangles.push(corners);
    }
    assert_eq!(data.positions.len(), 66);
    data
}

/// Also once its vertices are f32.
fn is_convex(data: &MeshData) -> bool {
    let at = |v: u32| {
        let rounded = data.positions[v as usize].map(|x| f64::from(x as f32));
        DVec3::from_array(rounded)
    };
    data.triangles.iter().all(|t| {
        let [a, b, c] = t.map(at);
        let normal = (b - a).cross(c - a);
        let others = (0..data.positions.len() as u32).filter(|v| !t.contains(v));
        others
            .into_iter()
            .all(|v| (at(v) - a).dot(normal) < -1e-3 * normal.length() * (b - a).length())
    })
}
