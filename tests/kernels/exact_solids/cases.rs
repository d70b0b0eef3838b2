//! Rays and solids, most of them chosen so that exact decisions are hard.

use super::Random;
use super::touching::tangent;
use glam::DVec3;
use lanecast::internals::geom::exact::{Line, Solid};
use lanecast::internals::geom::{Cone, Cuboid, Ellipsoid, HalfSpace, Polygon, Quadric, Sphere};

/// A row that owns its numbers.
#[derive(Clone, Debug)]
pub enum Shape {
    HalfSpace(HalfSpace),
    Polyhedron(Vec<HalfSpace>),
    Cuboid(Cuboid),
    Sphere(Sphere),
    Ellipsoid(Ellipsoid),
    Cone(Cone),
    Quadric(Quadric),
    Polygon { points: Vec<DVec3>, normal: DVec3 },
}

#[derive(Clone, Debug)]
pub struct Case {
    pub line: Line,
    pub shape: Shape,
}

/// Kinds of shapes: half-space, polyhedron, box, sphere, ellipsoid, closed cone,
/// closed cylinder, open cone, open cylinder, polygon, quadric.
pub const KINDS: usize = 11;

/// Sorts of rays, see [`case`].
pub const SORTS: usize = 9;
/// Those whose numbers have a few bits.
pub const LATTICES: [usize; 3] = [1, 2, 3];

impl Shape {
    pub fn solid(&self) -> Solid<'_> {
        match self {
            Shape::HalfSpace(row) => Solid::HalfSpace(*row),
            Shape::Polyhedron(planes) => Solid::Polyhedron(planes),
            Shape::Cuboid(row) => Solid::Cuboid(*row),
            Shape::Sphere(row) => Solid::Sphere(*row),
            Shape::Ellipsoid(row) => Solid::Ellipsoid(*row),
            Shape::Cone(row) => Solid::Cone(*row),
            Shape::Quadric(row) => Solid::Quadric(*row),
            Shape::Polygon { points, normal } => Solid::Polygon(Polygon {
                points,
                normal: *normal,
            }),
        }
    }

    /// Every length (not normals), and every coefficient of a quadric, through a
    /// function; radii stay positive.
    pub fn map(&self, f: &mut impl FnMut(f64) -> f64) -> Shape {
        let mut of = |v: DVec3| DVec3::new(f(v.x), f(v.y), f(v.z));
        let positive = |x: f64| if x == 0.0 { 5e-324 } else { x.abs() };
        match self.clone() {
            Shape::HalfSpace(row) => Shape::HalfSpace(HalfSpace {
                offset: f(row.offset),
                ..row
            }),
            Shape::Polyhedron(planes) => {
                let plane = |row: HalfSpace| HalfSpace {
                    offset: f(row.offset),
                    ..row
                };
                Shape::Polyhedron(planes.into_iter().map(plane).collect())
            }
            Shape::Cuboid(row) => Shape::Cuboid(Cuboid {
                min: of(row.min),
                max: of(row.max),
            }),
            Shape::Sphere(row) => Shape::Sphere(Sphere {
                center: of(row.center),
                radius: positive(f(row.radius)),
            }),
            Shape::Ellipsoid(row) => Shape::Ellipsoid(Ellipsoid {
                center: of(row.center),
                radii: DVec3::from_array(of(row.radii).to_array().map(positive)),
            }),
            Shape::Cone(row) => Shape::Cone(Cone {
                base: of(row.base),
                top: of(row.top),
                base_radius: f(row.base_radius).abs(),
                top_radius: f(row.top_radius).abs(),
                ..row
            }),
            Shape::Quadric(row) => Shape::Quadric(Quadric {
                coefficients: row.coefficients.map(&mut *f),
            }),
            Shape::Polygon { points, normal } => Shape::Polygon {
                points: points.into_iter().map(of).collect(),
                normal,
            },
        }
    }
}

impl Case {
    pub fn is_finite(&self) -> bool {
        let mut finite = true;
        let _ = self.shape.map(&mut |x| {
            finite &= x.is_finite();
            x
        });
        finite
            && self
                .line
                .org
                .iter()
                .chain(&self.line.dir)
                .all(|x| x.is_finite())
    }

    /// All lengths times 2^k: the same t.
    pub fn scaled(&self, by: f64) -> Case {
        Case {
            line: Line {
                org: self.line.org.map(|x| x * by),
                dir: self.line.dir.map(|x| x * by),
            },
            shape: match &self.shape {
                // Those of squares over as much: then none is too large.
                Shape::Quadric(row) => {
                    let mut coefficients = row.coefficients.map(|x| x / by);
                    for (k, x) in row.coefficients.iter().enumerate().skip(6) {
                        coefficients[k] = if k == 9 { x * by } else { *x };
                    }
                    Shape::Quadric(Quadric { coefficients })
                }
                shape => shape.map(&mut |x| x * by),
            },
        }
    }
}

/// A multiple of 2^−bits in [−1, 1).
fn short(random: &mut Random, bits: u32) -> f64 {
    let steps = 1_u64 << bits;
    random.below(2 * steps) as f64 / steps as f64 - 1.0
}

fn short_vector(random: &mut Random, bits: u32) -> DVec3 {
    DVec3::new(
        short(random, bits),
        short(random, bits),
        short(random, bits),
    )
}

/// 2^k, |k| ≤ most.
pub fn power(random: &mut Random, most: i32) -> f64 {
    2.0_f64.powi(random.below(2 * most as u64 + 1) as i32 - most)
}

/// A radius with few bits.
fn size(random: &mut Random, bits: u32) -> f64 {
    let steps = 1_u64 << bits;
    (1 + random.below(steps)) as f64 / steps as f64
}

/// Of numbers with so many bits.
pub fn shape(random: &mut Random, kind: usize, bits: u32) -> Shape {
    let center = short_vector(random, bits);
    match kind {
        0 => Shape::HalfSpace(HalfSpace {
            normal: short_vector(random, bits) + DVec3::X * size(random, bits),
            offset: short(random, bits),
        }),
        1 => {
            // Around its centre, cut off at random.
            let planes = 4 + random.below(9);
            let plane = |random: &mut Random| {
                let normal = short_vector(random, bits);
                let offset = normal.dot(center) + size(random, bits);
                HalfSpace { normal, offset }
            };
            Shape::Polyhedron((0..planes).map(|_| plane(random)).collect())
        }
        2 => {
            let by = DVec3::new(size(random, bits), size(random, bits), size(random, bits));
            Shape::Cuboid(Cuboid {
                min: center - by,
                max: center + by,
            })
        }
        3 => Shape::Sphere(Sphere {
            center,
            radius: size(random, bits),
        }),
        4 => {
            let radii = DVec3::new(size(random, bits), size(random, bits), size(random, bits));
            Shape::Ellipsoid(Ellipsoid { center, radii })
        }
        5..=8 => {
            let along = match random.below(3) {
                0 => DVec3::AXES[random.below(3) as usize] * size(random, bits),
                _ => short_vector(random, bits),
            };
            let base_radius = match random.below(3) {
                0 if kind % 2 == 1 => 0.0,
                _ => size(random, bits),
            };
            let (base, top) = (center - along, center + along);
            let top_radius = match kind % 2 {
                0 => base_radius,
                _ => size(random, bits),
            };
            let open = kind >= 7;
            let [(base, base_radius), (top, top_radius)] = if random.below(2) == 0 {
                [(base, base_radius), (top, top_radius)]
            } else {
                [(top, top_radius), (base, base_radius)]
            };
            Shape::Cone(Cone {
                base,
                top,
                base_radius,
                top_radius,
                open,
            })
        }
        10 => {
            let mut coefficients = [0.0; 10];
            for x in &mut coefficients {
                if random.below(3) > 0 {
                    *x = short(random, bits);
                }
            }
            Shape::Quadric(Quadric { coefficients })
        }
        _ => {
            let (u, v) = (short_vector(random, bits), short_vector(random, bits));
            let corners = 3 + random.below(7);
            let corner = |random: &mut Random| {
                let (a, b) = (short(random, 3), short(random, 3));
                center + u * a + v * b
            };
            let points = (0..corners).map(|_| corner(random)).collect();
            let normal = match random.below(3) {
                0 => short_vector(random, bits),
                1 => u.cross(v).normalize_or(DVec3::X),
                _ => u.cross(v),
            };
            Shape::Polygon { points, normal }
        }
    }
}

/// A point that matters: a corner, an edge, a rim, an apex, a centre.
fn special(random: &mut Random, shape: &Shape) -> DVec3 {
    let pick = |random: &mut Random| random.below(3) as usize;
    match shape {
        Shape::HalfSpace(_) | Shape::Polyhedron(_) | Shape::Quadric(_) => short_vector(random, 4),
        Shape::Cuboid(row) => {
            let middle = row.min * 0.5 + row.max * 0.5;
            let mut at = || match pick(random) {
                0 => row.min,
                1 => row.max,
                _ => middle,
            };
            DVec3::new(at().x, at().y, at().z)
        }
        Shape::Sphere(row) => {
            row.center + DVec3::AXES[pick(random)] * row.radius * short(random, 1).round()
        }
        Shape::Ellipsoid(row) => row.center + DVec3::AXES[pick(random)] * row.radii,
        Shape::Cone(row) => {
            let end = random.below(2) == 0;
            let (at, radius) = if end {
                (row.base, row.base_radius)
            } else {
                (row.top, row.top_radius)
            };
            match pick(random) {
                0 => at,
                1 => at * 0.5 + (row.base + row.top) * 0.25,
                // On the rim, where the axis is a coordinate axis.
                _ => at + DVec3::AXES[pick(random)] * radius,
            }
        }
        Shape::Polygon { points, .. } => {
            let i = random.below(points.len() as u64) as usize;
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            let part = [0.0, 0.5, short(random, 4).abs()][pick(random)];
            a + (b - a) * part
        }
    }
}

fn through(random: &mut Random, point: DVec3, bits: u32) -> Line {
    let mut dir = short_vector(random, bits);
    match random.below(6) {
        0 => dir[random.below(3) as usize] = 0.0,
        1 => {
            let k = random.below(3) as usize;
            dir = DVec3::AXES[k] * dir[k];
        }
        2 => dir[random.below(3) as usize] = -0.0,
        _ => {}
    }
    let t = power(random, 4) * if random.below(8) == 0 { -1.0 } else { 1.0 };
    Line {
        org: (point - dir * t).to_array(),
        dir: dir.to_array(),
    }
}

/// The numbers where formats begin and end, and others of any size.
fn extreme(random: &mut Random) -> f64 {
    match random.below(8) {
        0 => random.end_of_format([f64::INFINITY, f64::NAN]),
        1..=4 => random.unit(),
        _ => random.any_finite(),
    }
}

/// One case of a kind, below [`KINDS`], and a sort, below [`SORTS`].
pub fn case(random: &mut Random, kind: usize, sort: usize) -> Case {
    let bits = match sort {
        // Lattices of a few numbers.
        1 | 3 => 1 + random.below(3) as u32,
        _ => 2 + random.below(48) as u32,
    };
    let own = shape(random, kind, bits);
    let around = |random: &mut Random| special(random, &own) + random.vector() * 0.6;
    match sort {
        0 => {
            let point = around(random);
            let line = through(random, point, 50);
            Case { line, shape: own }
        }
        1 => {
            let point = short_vector(random, bits) * 2.0;
            let line = through(random, point, bits);
            Case { line, shape: own }
        }
        2 => {
            let (shape, mut line) = tangent(random, kind);
            // Or just not.
            if random.below(3) == 0 {
                let k = random.below(3) as usize;
                line.org[k] = match random.below(2) {
                    0 => line.org[k].next_up(),
                    _ => line.org[k].next_down(),
                };
            }
            Case { line, shape }
        }
        3 => {
            let point = special(random, &own);
            let line = through(random, point, bits);
            Case { line, shape: own }
        }
        // Beginning on the surface, or beside it.
        4 => {
            let point = special(random, &own);
            let mut line = through(random, point, 20);
            line.org = point.to_array();
            if random.below(2) == 0 {
                let k = random.below(3) as usize;
                line.org[k] = line.org[k].next_up();
            }
            Case { line, shape: own }
        }
        // From far away.
        5 => {
            let point = around(random);
            let mut line = through(random, point, 50);
            let far = 1e9 * (1.0 + random.unit().abs());
            line.org = std::array::from_fn(|k| point[k] - far * line.dir[k]);
            Case { line, shape: own }
        }
        // Small or huge.
        6 => {
            let point = if random.below(2) == 0 {
                special(random, &own)
            } else {
                around(random)
            };
            let line = through(random, point, bits);
            let mut case = Case { line, shape: own }.scaled(power(random, 60));
            let stretch = power(random, 200);
            case.line.dir = case.line.dir.map(|x| x * stretch);
            case
        }
        // Noise in one number.
        7 => {
            let point = special(random, &own);
            let mut line = through(random, point, 6);
            let (k, noise) = (random.below(3) as usize, power(random, 150));
            match random.below(2) {
                0 => line.org[k] += random.unit() * noise,
                _ => line.dir[k] = random.unit() * noise,
            }
            Case { line, shape: own }
        }
        // No regard to anything.
        _ => {
            let point = around(random);
            let mut line = through(random, point, 50);
            let shape = match random.below(2) {
                0 => own,
                _ => own.map(&mut |x| {
                    if random.below(3) == 0 {
                        extreme(random)
                    } else {
                        x
                    }
                }),
            };
            for x in line.org.iter_mut().chain(&mut line.dir) {
                if random.below(3) == 0 {
                    *x = extreme(random);
                }
            }
            Case { line, shape }
        }
    }
}
