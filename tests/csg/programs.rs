//! Random CSG programs over solids of all kinds, many of them with coincident faces, and rays.

use super::shells::{cube, torus};
use super::truth::Tree;
use crate::common::{Random, RayColumns, ball, throat, torus as tube};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Quadric, Sphere};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder, ShapeId};

#[derive(Clone, Copy, Debug)]
pub enum Leaf {
    Ball(Sphere),
    Box(Cuboid),
    Cylinder(Cylinder),
    Cone(Cone),
    Ellipsoid(Ellipsoid),
    HalfSpace(HalfSpace),
    Quadric(Quadric),
    /// Its centre, and how far off its corners are.
    Octahedron(DVec3, f64),
    /// A box by its triangles.
    Shell(Cuboid),
    /// Triangles around a centre, and how far out: a torus on a grid.
    Ring(DVec3, f64),
    /// A ball as a polynomial.
    Round(Sphere),
    /// A torus about y: its centre and radii.
    Tube(DVec3, [f64; 2]),
    /// A quartic without end: its centre, and how wide it is there.
    Throat(DVec3, f64),
}

impl Leaf {
    /// All lengths times `scale`.
    pub fn add(&self, scene: &mut SceneBuilder, scale: f64) -> ShapeId {
        match *self {
            Leaf::Ball(row) => scene.sphere(
                "",
                Sphere {
                    center: row.center * scale,
                    radius: row.radius * scale,
                },
            ),
            Leaf::Box(row) => scene.cuboid(
                "",
                Cuboid {
                    min: row.min * scale,
                    max: row.max * scale,
                },
            ),
            Leaf::Cylinder(row) => scene.cylinder(
                "",
                Cylinder {
                    base: row.base * scale,
                    top: row.top * scale,
                    radius: row.radius * scale,
                    ..row
                },
            ),
            Leaf::Cone(row) => scene.cone(
                "",
                Cone {
                    base: row.base * scale,
                    top: row.top * scale,
                    base_radius: row.base_radius * scale,
                    top_radius: row.top_radius * scale,
                    ..row
                },
            ),
            Leaf::Ellipsoid(row) => scene.ellipsoid(
                "",
                Ellipsoid {
                    center: row.center * scale,
                    radii: row.radii * scale,
                },
            ),
            Leaf::HalfSpace(row) => scene.half_space(
                "",
                HalfSpace {
                    offset: row.offset * scale,
                    ..row
                },
            ),
            Leaf::Quadric(Quadric { mut coefficients }) => {
                for linear in &mut coefficients[6..9] {
                    *linear *= scale;
                }
                coefficients[9] *= scale * scale;
                scene.quadric("", Quadric { coefficients })
            }
            Leaf::Octahedron(center, size) => octahedron(scene, center * scale, size * scale),
            Leaf::Shell(row) => scene.mesh(
                "",
                &cube(
                    &Cuboid {
                        min: row.min * scale,
                        max: row.max * scale,
                    },
                    2,
                ),
            ),
            Leaf::Ring(center, size) => {
                let radii = [size * scale, size * scale * 0.5];
                let step = scale / 64.0;
                scene.mesh("", &torus(center * scale, radii, [8, 6], step))
            }
            Leaf::Round(row) => {
                let tape = ball(row.center * scale, row.radius * scale);
                scene.implicit("", tape, false, None)
            }
            Leaf::Tube(center, radii) => {
                let tape = tube(center * scale, radii.map(|radius| radius * scale));
                scene.implicit("", tape, false, None)
            }
            Leaf::Throat(center, size) => {
                let tape = throat(center * scale, size * scale);
                scene.implicit("", tape, false, None)
            }
        }
    }

    /// Moved as a whole.
    pub fn moved(self, by: DVec3) -> Leaf {
        match self {
            Leaf::Ball(row) => Leaf::Ball(Sphere {
                center: row.center + by,
                ..row
            }),
            Leaf::Box(row) => Leaf::Box(Cuboid {
                min: row.min + by,
                max: row.max + by,
            }),
            Leaf::Cylinder(row) => Leaf::Cylinder(Cylinder {
                base: row.base + by,
                top: row.top + by,
                ..row
            }),
            Leaf::Cone(row) => Leaf::Cone(Cone {
                base: row.base + by,
                top: row.top + by,
                ..row
            }),
            Leaf::Ellipsoid(row) => Leaf::Ellipsoid(Ellipsoid {
                center: row.center + by,
                ..row
            }),
            Leaf::HalfSpace(row) => Leaf::HalfSpace(HalfSpace {
                offset: row.offset + row.normal.dot(by),
                ..row
            }),
            Leaf::Quadric(Quadric { mut coefficients }) => {
                // q(x − s) = q(x) − s·∇q(x) + what is of degree two in s.
                let row = Quadric { coefficients };
                let linear = DVec3::from_array([6, 7, 8].map(|k| coefficients[k]));
                let bend = row.normal_at(by) - linear;
                coefficients[9] += 0.5 * by.dot(bend) - linear.dot(by);
                for k in 0..3 {
                    coefficients[6 + k] -= bend[k];
                }
                Leaf::Quadric(Quadric { coefficients })
            }
            Leaf::Octahedron(center, size) => Leaf::Octahedron(center + by, size),
            Leaf::Shell(row) => Leaf::Shell(Cuboid {
                min: row.min + by,
                max: row.max + by,
            }),
            Leaf::Ring(center, size) => Leaf::Ring(center + by, size),
            Leaf::Round(row) => Leaf::Round(Sphere {
                center: row.center + by,
                ..row
            }),
            Leaf::Tube(center, radii) => Leaf::Tube(center + by, radii),
            Leaf::Throat(center, size) => Leaf::Throat(center + by, size),
        }
    }
}

pub fn octahedron(scene: &mut SceneBuilder, center: DVec3, size: f64) -> ShapeId {
    let planes: Vec<HalfSpace> = (0..8)
        .map(|i| {
            let sign = |k: usize| if i >> k & 1 == 0 { 1.0 } else { -1.0 };
            let normal = DVec3::new(sign(0), sign(1), sign(2));
            let offset = normal.dot(center) + size;
            HalfSpace { normal, offset }
        })
        .collect();
    let points: Vec<DVec3> = DVec3::AXES
        .iter()
        .flat_map(|axis| [center + *axis * size, center - *axis * size])
        .collect();
    scene.polyhedron("", &planes, &points)
}

/// Solids, some of them placed, and operators over them.
#[derive(Clone, Debug)]
pub struct Program {
    pub leaves: Vec<(Leaf, Option<DAffine3>)>,
}

impl Program {
    /// Of so many solids; placed ones among them, or all in one space.
    pub fn random(random: &mut Random, count: u64, placed: bool) -> Program {
        let leaf = |random: &mut Random| {
            let place = placed && random.below(2) == 0;
            (random_leaf(random), place.then(|| placement(random)))
        };
        let leaves = (0..count).map(|_| leaf(random)).collect();
        Program { leaves }
    }

    /// A shape for each leaf.
    pub fn shapes(&self, scene: &mut SceneBuilder, scale: f64) -> Vec<ShapeId> {
        let add = |(leaf, place): &(Leaf, Option<DAffine3>)| {
            let shape = leaf.add(scene, scale);
            let Some(mut map) = *place else {
                return shape;
            };
            map.translation *= scale;
            let map = scene.transform(map.into());
            let operand = Operand::shape(shape).transform(map);
            scene.csg("", Operator::Union, &[operand])
        };
        self.leaves.iter().map(add).collect()
    }

    /// Operators at random, over up to `most` of the leaves, some of them twice.
    pub fn tree(&self, random: &mut Random, most: u64) -> Tree {
        let leaf =
            |random: &mut Random| Tree::Operand(random.below(self.leaves.len() as u64) as usize);
        if most <= 1 {
            return leaf(random);
        }
        let operators = [
            Operator::Union,
            Operator::Intersection,
            Operator::Difference,
            Operator::Xor,
        ];
        if random.below(10) == 0 {
            return Tree::of(Operator::Complement, [self.tree(random, most)]);
        }
        let operator = operators[random.below(4) as usize];
        let count = 2 + random.below(most.min(4) - 1);
        let of: Vec<Tree> = (0..count)
            .map(|_| self.tree(random, most / count))
            .collect();
        Tree::of(operator, of)
    }
}

/// On a grid, so that much of it coincides, or anywhere.
fn point(random: &mut Random, on_grid: bool) -> DVec3 {
    let p = random.vector();
    if on_grid { (p * 4.0).round() / 4.0 } else { p }
}

fn length(random: &mut Random, on_grid: bool) -> f64 {
    if on_grid {
        0.25 * (1 + random.below(4)) as f64
    } else {
        random.size()
    }
}

/// On a grid: balls, unending cylinders, cones, paraboloids, hyperboloids, pairs of
/// planes, some of them inside out; or any.
pub fn random_quadric(random: &mut Random) -> Quadric {
    let mut coefficients = [0.0; 10];
    if random.below(3) == 0 {
        for x in &mut coefficients {
            *x = random.unit();
        }
        return Quadric { coefficients };
    }
    for x in &mut coefficients[..3] {
        *x = [1.0, 1.0, 0.0, -1.0][random.below(4) as usize];
    }
    if random.below(3) == 0 {
        coefficients[3 + random.below(3) as usize] = [1.0, -2.0][random.below(2) as usize];
    }
    let k = random.below(3) as usize;
    if coefficients[..6].iter().all(|x| *x == 0.0) || coefficients[k] == 0.0 {
        coefficients[6 + k] = [1.0, -1.0][random.below(2) as usize];
    }
    let radius = length(random, true);
    coefficients[9] = match random.below(4) {
        0 => 0.0,
        1 => radius * radius,
        _ => -radius * radius,
    };
    let by = point(random, true) * 0.5;
    match Leaf::Quadric(Quadric { coefficients }).moved(by) {
        Leaf::Quadric(row) => row,
        _ => Quadric { coefficients },
    }
}

/// Some of one size, so that they coincide. Lengths are no powers of two, for 1 is a
/// length like others.
fn random_polynomial(random: &mut Random, center: DVec3, radius: f64) -> Leaf {
    let radius = radius * 0.75;
    match random.below(4) {
        0 => Leaf::Round(Sphere { center, radius }),
        1 => Leaf::Throat(center, radius * 0.5),
        2 => Leaf::Tube(center, [0.75, 0.1875]),
        _ => Leaf::Tube(center, [radius, 0.375]),
    }
}

fn random_leaf(random: &mut Random) -> Leaf {
    let on_grid = random.below(3) != 0;
    let center = point(random, on_grid);
    let axis = match on_grid {
        true => DVec3::AXES[random.below(3) as usize] * length(random, true),
        false => random.vector() + DVec3::Y * 0.01,
    };
    let radius = length(random, on_grid);
    let (base, top, open) = (center, center + axis, false);
    let sides = [(); 3].map(|()| length(random, on_grid));
    match random.below(11) {
        10 => random_polynomial(random, center, radius),
        8 | 9 => Leaf::Quadric(random_quadric(random)),
        0 | 1 => Leaf::Ball(Sphere { center, radius }),
        2 | 3 => Leaf::Box(Cuboid {
            min: center,
            max: center + DVec3::from_array(sides),
        }),
        4 => Leaf::Cylinder(Cylinder {
            base,
            top,
            radius,
            open,
        }),
        5 => Leaf::Cone(Cone {
            base,
            top,
            base_radius: radius,
            top_radius: if random.below(2) == 0 { 0.0 } else { sides[0] },
            open,
        }),
        6 => Leaf::Ellipsoid(Ellipsoid {
            center,
            radii: DVec3::from_array(sides),
        }),
        _ if random.below(3) == 0 => Leaf::HalfSpace(HalfSpace {
            normal: axis,
            offset: axis.dot(center),
        }),
        _ => Leaf::Octahedron(center, radius),
    }
}

/// Turns by 30°, now and then by anything, and a shift; flat and long ones, too.
fn placement(random: &mut Random) -> DAffine3 {
    let axis = DVec3::AXES[random.below(3) as usize];
    let degrees = match random.below(4) {
        0 => 180.0 * random.unit(),
        _ => 30.0 * random.below(12) as f64,
    };
    let on_grid = random.below(2) == 0;
    let turn = DQuat::from_axis_angle(axis, f64::to_radians(degrees));
    let shift = point(random, on_grid) * 0.5;
    let scale = match random.below(4) {
        0 => DVec3::new(1.0, 1.0, 10.0_f64.powi(random.below(7) as i32 - 6)),
        1 => DVec3::splat(if random.below(2) == 0 { 2.0 } else { 0.5 }),
        _ => DVec3::ONE,
    };
    DAffine3::from_scale_rotation_translation(scale, turn, shift)
}

/// From anywhere to anywhere, along axes, from grid point to grid point.
pub fn random_rays(random: &mut Random, count: usize, scale: f64) -> RayColumns {
    let mut rays = RayColumns::default();
    for _ in 0..count {
        let on_grid = random.below(2) == 0;
        let org = point(random, on_grid) * 3.0;
        let dir = match random.below(3) {
            0 => {
                DVec3::AXES[random.below(3) as usize]
                    * if random.below(2) == 0 { 1.0 } else { -0.5 }
            }
            _ => point(random, on_grid) - org,
        };
        let dir = if dir == DVec3::ZERO { DVec3::X } else { dir };
        rays.push(org * scale, dir.to_array().map(|x| x as f32));
    }
    rays
}
