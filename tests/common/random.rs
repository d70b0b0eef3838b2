//! Random numbers, meshes, shapes and scenes, each determined by its seed.

use super::surfaces::{clebsch, torus};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::geom::*;
use lanecast::internals::scene::*;

/// Vigna's SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    pub fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// In [−1, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// About any axis, by up to 3 radians either way.
    pub fn turn(&mut self) -> DAffine3 {
        DAffine3::from_axis_angle(self.vector().normalize(), 3.0 * self.unit())
    }

    /// Turned, stretched and turned again.
    pub fn oblique(&mut self, stretch: DVec3) -> DAffine3 {
        self.turn() * DAffine3::from_scale(stretch) * self.turn()
    }

    pub fn size(&mut self) -> f64 {
        0.1 + 0.5 * self.unit().abs()
    }

    /// One of the numbers where f64 begins and ends, of simple ones, and of two more.
    pub fn end_of_format(&mut self, [a, b]: [f64; 2]) -> f64 {
        let ends = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            5e-324,
            -5e-324,
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::MIN,
            1e300,
            -1e300,
            1e-300,
            a,
            b,
        ];
        ends[self.below(ends.len() as u64) as usize]
    }

    /// A finite f64 of any size: bits at random of a number below 2, or that times 1e300.
    pub fn any_finite(&mut self) -> f64 {
        f64::from_bits(self.bits() & !(1 << 62)) * [1.0, 1e300][self.below(2) as usize]
    }
}

/// A closed tetrahedron or a soup of triangles, some of them without area.
pub fn random_mesh(random: &mut Random) -> MeshData {
    let vertices = 4 + random.below(20) as usize;
    let positions: Vec<[f64; 3]> = (0..vertices).map(|_| random.vector().to_array()).collect();
    let triangles = (0..4 + random.below(60))
        .map(|_| [(); 3].map(|()| random.below(vertices as u64) as u32))
        .collect();
    MeshData {
        positions,
        triangles,
        ..MeshData::default()
    }
}

/// A square's corners, and one more that is dented in.
pub fn dented(corner: impl Fn(f64, f64) -> DVec3) -> [DVec3; 5] {
    [
        corner(-0.7, -0.7),
        corner(0.7, -0.7),
        corner(0.7, 0.7),
        corner(0.0, 0.1),
        corner(-0.7, 0.7),
    ]
}

/// A turned ellipsoid about the origin.
fn quadric(scene: &mut SceneBuilder, random: &mut Random) -> ShapeId {
    let mut coefficients = [0.0; 10];
    for (k, x) in coefficients.iter_mut().enumerate() {
        *x = match k {
            0..3 => 2.0 + 4.0 * random.size(),
            9 => -random.size(),
            _ => 0.9 * random.unit(),
        };
    }
    scene.quadric("", Quadric { coefficients })
}

/// One shape of a random kind, about the origin.
pub fn random_shape(scene: &mut SceneBuilder, random: &mut Random) -> ShapeId {
    let center = random.vector() * 0.3;
    // Of polynomial surfaces a few: their bounds take some 30 ms, and their rays more
    // than others.
    let kind = match random.below(200) {
        n @ 0..2 => 10 + n,
        n => n % 10,
    };
    match kind {
        11 => scene.implicit(
            "",
            torus(center, [random.size(), random.size()]),
            false,
            None,
        ),
        10 => {
            let size = random.size();
            let clip = match random.below(2) {
                0 => Clip::Sphere(Sphere {
                    center,
                    radius: 2.0 * size,
                }),
                _ => Clip::Cuboid(Cuboid {
                    min: center - size,
                    max: center + random.size(),
                }),
            };
            scene.implicit("", clebsch(center, size), true, Some(clip))
        }
        9 => quadric(scene, random),
        0 => scene.sphere(
            "",
            Sphere {
                center,
                radius: random.size(),
            },
        ),
        1 => {
            let radii = DVec3::new(random.size(), random.size(), random.size());
            scene.ellipsoid("", Ellipsoid { center, radii })
        }
        2 => scene.cylinder(
            "",
            Cylinder {
                base: center,
                top: center + random.vector() + DVec3::Y * 0.01,
                radius: random.size(),
                open: random.below(2) == 0,
            },
        ),
        3 => scene.cone(
            "",
            Cone {
                base: center,
                top: center + random.vector() + DVec3::Y * 0.01,
                base_radius: random.size(),
                top_radius: if random.below(2) == 0 {
                    0.0
                } else {
                    random.size()
                },
                open: random.below(2) == 0,
            },
        ),
        4 => {
            let size = DVec3::new(random.size(), random.size(), random.size());
            scene.cuboid(
                "",
                Cuboid {
                    min: center - size,
                    max: center + size,
                },
            )
        }
        5 => {
            let corners = [
                DVec3::new(1.0, 1.0, 1.0),
                DVec3::new(-1.0, -1.0, 1.0),
                DVec3::new(-1.0, 1.0, -1.0),
                DVec3::new(1.0, -1.0, -1.0),
            ];
            let planes: Vec<HalfSpace> = corners
                .iter()
                .map(|c| HalfSpace {
                    normal: -*c,
                    offset: 1.0,
                })
                .collect();
            scene.polyhedron("", &planes, &corners)
        }
        6 => {
            let (u, v) = (random.vector(), random.vector());
            let corner = |x: f64, y: f64| center + u * x + v * y;
            scene.polygon("", &dented(corner), &[])
        }
        _ => {
            let data = random_mesh(random);
            scene.mesh("", &data)
        }
    }
}

/// A closed solid; every second on a coarse grid, so that faces of several coincide.
pub fn random_solid(scene: &mut SceneBuilder, random: &mut Random) -> ShapeId {
    if random.below(2) == 0 {
        let grid = |random: &mut Random| (random.unit() * 4.0).round() / 4.0;
        let min = DVec3::new(grid(random), grid(random), grid(random));
        let side = |random: &mut Random| 0.25 * (1 + random.below(4)) as f64;
        let max = min + DVec3::new(side(random), side(random), side(random));
        return match random.below(3) {
            0 => scene.cuboid("", Cuboid { min, max }),
            1 => scene.sphere(
                "",
                Sphere {
                    center: min,
                    radius: side(random),
                },
            ),
            _ => scene.cylinder(
                "",
                Cylinder {
                    base: min,
                    top: DVec3::new(min.x, max.y, min.z),
                    radius: side(random),
                    open: false,
                },
            ),
        };
    }
    loop {
        let shape = random_shape(scene, random);
        let tables = scene.tables();
        let is_solid = match tables.shapes.row(shape) {
            Shape::Cylinder(id) => !tables.cylinders.row(id).open,
            Shape::Cone(id) => !tables.cones.row(id).open,
            Shape::Implicit(id) => !tables.implicits.open[id.index()],
            Shape::Polygon(_) | Shape::Mesh(_) => false,
            _ => true,
        };
        if is_solid {
            return shape;
        }
    }
}

/// Solids csg by random operators, up to three deep.
pub fn random_csg(scene: &mut SceneBuilder, random: &mut Random, deep: u32) -> ShapeId {
    let operators = [
        Operator::Union,
        Operator::Intersection,
        Operator::Difference,
        Operator::Xor,
    ];
    let mut operator = operators[random.below(4) as usize];
    let mut count = 2 + random.below(4);
    if deep > 0 && random.below(8) == 0 {
        (operator, count) = (Operator::Complement, 1);
    }
    let operands: Vec<Operand> = (0..count)
        .map(|_| {
            let shape = if deep < 3 && random.below(3) == 0 {
                random_csg(scene, random, deep + 1)
            } else {
                random_solid(scene, random)
            };
            let operand = Operand::shape(shape);
            if random.below(3) != 0 {
                return operand;
            }
            let angle = [0.5, 1.0, random.unit() * 3.0][random.below(3) as usize];
            let turn = DQuat::from_axis_angle(DVec3::Y, angle * std::f64::consts::PI);
            let map = DAffine3::from_rotation_translation(turn, random.vector() * 0.25);
            operand.transform(scene.transform(map.into()))
        })
        .collect();
    scene.csg("", operator, &operands)
}

/// Some shapes, half of them placed by random transforms, some shared, over a
/// floor now and then, under two lights; mirrors among them.
pub fn random_scene(seed: u64) -> Scene {
    let random = &mut Random(seed);
    let mut scene = SceneBuilder::default();
    let mirror = scene.material("", Material::metallic_roughness([0.9; 3], 1.0, 0.0));
    let glass = scene.material(
        "",
        Material {
            transmission: 0.8,
            ..Material::metallic_roughness([0.9, 1.0, 0.9], 0.0, 0.0)
        },
    );
    if random.below(2) == 0 {
        let floor = scene.half_space(
            "",
            HalfSpace {
                normal: DVec3::Y,
                offset: -1.5,
            },
        );
        scene.instance("", Edge::shape(floor));
    }
    let shapes = 1 + random.below(24);
    for i in 0..shapes {
        let shape = random_shape(&mut scene, random);
        for _ in 0..1 + random.below(3) {
            let mut edge = Edge::shape(shape);
            if random.below(3) != 0 {
                let turn = DQuat::from_axis_angle(
                    random.vector().normalize_or(DVec3::X),
                    random.unit() * 3.0,
                );
                let scale = DVec3::new(random.size(), random.size(), random.size()) * 1.5;
                let map =
                    DAffine3::from_scale_rotation_translation(scale, turn, random.vector() * 2.0);
                edge = edge.transform(scene.transform(map.into()));
            }
            edge = match i % 5 {
                0 => edge.material(mirror),
                1 => edge.material(glass),
                _ => edge,
            };
            scene.instance("", edge);
        }
    }
    for _ in 0..random.below(4) {
        let shape = random_csg(&mut scene, random, 0);
        let map = DAffine3::from_translation(random.vector() * 1.5);
        let edge = Edge::shape(shape).transform(scene.transform(map.into()));
        scene.instance("", edge);
        if random.below(2) == 0 {
            scene.instance("", Edge::shape(shape).material(glass));
        }
    }
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.5, 0.7, 5.0), DVec3::ZERO, DVec3::Y, 50.0),
    );
    scene.light(Light::Point {
        position: DVec3::new(3.0, 4.0, 5.0),
        intensity: [60.0; 3],
        falloff: Falloff::InverseSquare,
        radius: 0.0,
    });
    scene.light(Light::Directional {
        direction: DVec3::new(1.0, -1.0, -0.5),
        irradiance: [1.0; 3],
        angle: 0.0,
    });
    scene.background([0.1, 0.2, 0.3]);
    scene.finish().expect("a random scene is a good scene")
}
