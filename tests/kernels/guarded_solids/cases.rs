//! Primitives, and rays that are hard for them: at silhouettes, edges, rims and apexes,
//! tangent, from their surfaces and from far away, at all scales.

use crate::common::Random;
use glam::DVec3;
use lanecast::internals::geom::triangle::Corners;
use lanecast::internals::geom::{
    Cone, Cuboid, Ellipsoid, HalfSpace, Quadric, Sphere, polygon_plane,
};

#[derive(Clone, Debug)]
pub enum Kind {
    Sphere(Sphere),
    Ellipsoid(Ellipsoid),
    /// Cylinders too.
    Cone(Cone),
    Cuboid(Cuboid),
    HalfSpace(HalfSpace),
    /// Planes, and a corner.
    Polyhedron(Vec<HalfSpace>, DVec3),
    /// Corners, and the normal.
    Polygon(Vec<DVec3>, DVec3),
    Triangle(Corners),
    Quadric(Quadric),
}

pub const NAMES: [&str; 12] = [
    "sphere",
    "ellipsoid",
    "cylinder",
    "open cylinder",
    "cone",
    "open cone",
    "box",
    "polyhedron",
    "polygon",
    "half-space",
    "triangle",
    "quadric",
];
pub const KINDS: usize = NAMES.len();

/// A ray before a primitive.
#[derive(Clone, Debug)]
pub struct Case {
    pub kind: Kind,
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_min: f32,
}

/// A primitive about as large as `size`, and points that are special about it.
pub struct Subject {
    pub kind: Kind,
    pub center: DVec3,
    pub size: f64,
    /// Corners, or an axis' ends.
    points: Vec<DVec3>,
}

fn below_one(random: &mut Random) -> f64 {
    random.unit().abs()
}

fn direction(random: &mut Random) -> DVec3 {
    random.vector().try_normalize().unwrap_or(DVec3::X)
}

/// 1, or now and then far from it.
fn stretch(random: &mut Random, much: i32) -> f64 {
    match random.below(3) {
        0 => 10.0_f64.powf(random.unit() * f64::from(much)),
        _ => 0.1 + below_one(random),
    }
}

fn across(n: DVec3) -> [DVec3; 2] {
    let u = n.any_orthonormal_vector();
    [u, n.cross(u)]
}

pub fn subject(random: &mut Random, kind: usize, plain: bool) -> Subject {
    let much = if plain { 0 } else { 3 };
    let size = match random.below(4) {
        0 if !plain => 2.0_f64.powi(random.below(81) as i32 - 40),
        _ => 1.0,
    };
    let center = match random.below(4) {
        0 => random.vector(),
        1 if !plain => random.vector() * 10.0_f64.powf(below_one(random) * 6.0),
        2 if !plain => (random.vector() * 4.0).round(),
        _ => DVec3::ZERO,
    } * size;
    let mut points = vec![center];
    let mut extent = size;
    let kind = match kind {
        0 => {
            let radius = size * stretch(random, much.min(1));
            extent = radius;
            Kind::Sphere(Sphere { center, radius })
        }
        1 => {
            let radii = DVec3::new(
                stretch(random, much),
                stretch(random, much),
                stretch(random, much),
            ) * size;
            extent = radii.max_element();
            points.push(center + DVec3::new(radii.x, 0.0, 0.0));
            points.push(center + DVec3::new(0.0, 0.0, -radii.z));
            Kind::Ellipsoid(Ellipsoid { center, radii })
        }
        2..=5 => {
            let axis = match random.below(3) {
                0 => DVec3::AXES[random.below(3) as usize],
                _ => direction(random),
            } * (size * stretch(random, much));
            let (base, top) = (center - axis, center + axis);
            let base_radius = size * stretch(random, much);
            let top_radius = match random.below(3) {
                _ if kind < 4 => base_radius,
                0 => 0.0,
                1 => base_radius + axis.length() * 2.0 * random.unit().max(0.0),
                _ => size * stretch(random, much),
            };
            extent = axis.length().max(base_radius).max(top_radius);
            let open = kind % 2 == 1;
            points.extend([base, top]);
            for n in across(axis.normalize()) {
                points.push(base + n * base_radius);
                points.push(top + n * top_radius);
                points.push(center + n * ((base_radius + top_radius) * 0.5));
            }
            Kind::Cone(Cone {
                base,
                top,
                base_radius,
                top_radius,
                open,
            })
        }
        6 => {
            let half = DVec3::new(
                stretch(random, much),
                stretch(random, much),
                stretch(random, much),
            ) * size;
            extent = half.max_element();
            let (min, max) = (center - half, center + half);
            let corner = |i: usize| {
                let at = |k: usize| if i >> k & 1 == 0 { min[k] } else { max[k] };
                DVec3::new(at(0), at(1), at(2))
            };
            points.extend((0..8).map(corner));
            Kind::Cuboid(Cuboid { min, max })
        }
        7 => {
            let count = 4 + random.below(8) as usize;
            let mut planes: Vec<HalfSpace> = (0..count)
                .map(|_| {
                    let normal = direction(random) * stretch(random, 1);
                    let room = normal.length() * size * (0.3 + below_one(random));
                    HalfSpace {
                        normal,
                        offset: normal.dot(center) + room,
                    }
                })
                .collect();
            // Bounded, by a box.
            for k in 0..3 {
                for normal in [DVec3::AXES[k], -DVec3::AXES[k]] {
                    let offset = normal.dot(center) + size;
                    planes.push(HalfSpace { normal, offset });
                }
            }
            let corner = center + random.vector() * size;
            points.push(center + DVec3::splat(size));
            Kind::Polyhedron(planes, corner)
        }
        8 => {
            let [u, v] = match random.below(2) {
                0 => {
                    let k = random.below(3) as usize;
                    [DVec3::AXES[k], DVec3::AXES[(k + 1) % 3]]
                }
                _ => across(direction(random)),
            }
            .map(|axis| axis * size);
            let corners = 3 + random.below(if plain { 3 } else { 30 }) as usize;
            let spiky = !plain && random.below(2) == 0;
            let outline = (0..corners).map(|i| {
                let turn = i as f64 / corners as f64 * std::f64::consts::TAU;
                let r = if spiky { 0.1 + below_one(random) } else { 1.0 };
                let long = if spiky { 0.01 } else { 1.0 };
                center + u * (turn.cos() * r) + v * (turn.sin() * r * long)
            });
            let outline: Vec<DVec3> = outline.collect();
            points.extend(&outline);
            let normal = polygon_plane(&outline).unwrap_or(u.cross(v).normalize());
            Kind::Polygon(outline, normal)
        }
        9 => {
            let mut normal = direction(random) * stretch(random, much);
            if random.below(4) == 0 {
                // At 45 degrees to two axes.
                let [i, j, k] = axes_from(random);
                normal[i] = if random.below(2) == 0 { 0.0 } else { normal[i] };
                normal[j] = normal[k] * [1.0, -1.0][random.below(2) as usize];
            }
            Kind::HalfSpace(HalfSpace {
                normal,
                offset: normal.dot(center),
            })
        }
        11 => {
            let (row, reach) = quadric(random, center, size, much);
            extent = reach;
            Kind::Quadric(row)
        }
        _ => {
            let long = random.vector() * (size * stretch(random, 1));
            let wide = random.vector() * (size * stretch(random, much));
            // A needle may be thinner than f32 can tell.
            let wide = match random.below(4) {
                0 if !plain => long * below_one(random) + wide * 1e-4,
                _ => wide,
            };
            let corners = [center, center + long, center + wide];
            let corners = corners.map(|p| p.to_array().map(|x| x as f32));
            points.extend(corners.map(|p| DVec3::from_array(p.map(f64::from))));
            extent = long.abs().max_element().max(wide.abs().max_element());
            Kind::Triangle(corners)
        }
    };
    Subject {
        kind,
        center,
        size: extent,
        points,
    }
}

/// The three axes, from a random one on.
fn axes_from(random: &mut Random) -> [usize; 3] {
    let first = random.below(3) as usize;
    [0, 1, 2].map(|k| (first + k) % 3)
}

/// Of any sort, with its own axes or those of the coordinates, multiplied out and
/// rounded; and how large it is about there.
fn quadric(random: &mut Random, center: DVec3, size: f64, much: i32) -> (Quadric, f64) {
    let turned = direction(random);
    let axes = match random.below(2) {
        0 => DVec3::AXES,
        _ => {
            let [u, v] = across(turned);
            [turned, u, v]
        }
    };
    let mut extent = 0.0;
    let weights = [(); 3].map(|()| {
        let radius = size * stretch(random, much);
        extent = f64::max(extent, radius);
        [1.0, 1.0, -1.0, 0.0][random.below(4) as usize] / (radius * radius)
    });
    // Where nothing bends, it rises.
    let mut rise = DVec3::ZERO;
    for (axis, weight) in axes.iter().zip(weights) {
        if weight == 0.0 || random.below(8) == 0 {
            rise += *axis * (random.unit() / size);
        }
    }
    rise += if weights == [0.0; 3] {
        axes[0] / size
    } else {
        DVec3::ZERO
    };
    let entry =
        |i: usize, j: usize| -> f64 { (0..3).map(|k| axes[k][i] * axes[k][j] * weights[k]).sum() };
    let about = |i: usize| -> f64 { (0..3).map(|j| entry(i, j) * center[j]).sum() };
    let level = [1.0, 1.0, -1.0, 0.0][random.below(4) as usize];
    let constant = (0..3).map(|i| about(i) * center[i]).sum::<f64>() - rise.dot(center) - level;
    let [xy, xz, yz] = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| 2.0 * entry(i, j));
    let [x, y, z] = [0, 1, 2].map(|i| rise[i] - 2.0 * about(i));
    let sign = if random.below(3) == 0 { -1.0 } else { 1.0 };
    let (a, b, c) = (entry(0, 0), entry(1, 1), entry(2, 2));
    let coefficients = [a, b, c, xy, xz, yz, x, y, z, constant].map(|x| x * sign);
    (Quadric { coefficients }, extent)
}

impl Subject {
    /// On the surface, about.
    fn surface(&self, random: &mut Random) -> DVec3 {
        let n = direction(random);
        match &self.kind {
            Kind::Sphere(s) => s.center + n * s.radius,
            Kind::Ellipsoid(e) => e.center + n * e.radii,
            Kind::Cone(cone) => {
                let s = match random.below(4) {
                    0 => 0.0,
                    1 => 1.0,
                    _ => below_one(random),
                };
                let axis = cone.top - cone.base;
                let radius = cone.base_radius + (cone.top_radius - cone.base_radius) * s;
                let around = axis.cross(n).try_normalize().unwrap_or(DVec3::ZERO);
                cone.base + axis * s + around * radius
            }
            Kind::Cuboid(c) => {
                let mut p = c.min + (c.max - c.min) * random.vector().abs();
                let k = random.below(3) as usize;
                p[k] = if random.below(2) == 0 {
                    c.min[k]
                } else {
                    c.max[k]
                };
                p
            }
            Kind::Polyhedron(planes, _) => {
                let plane = &planes[random.below(planes.len() as u64) as usize];
                let n = plane.normal.normalize();
                let p = self.center + random.vector() * self.size;
                p + n * ((plane.offset - plane.normal.dot(p)) / plane.normal.length())
            }
            Kind::Polygon(points, _) => {
                let i = random.below(points.len() as u64) as usize;
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                // On the edge, or far beyond its end.
                let far = if random.below(4) == 0 { 300.0 } else { 1.0 };
                a + (b - a) * (below_one(random) * far)
            }
            Kind::Triangle(corners) => {
                let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)));
                let edge = a + (b - a) * below_one(random);
                match random.below(2) {
                    0 => edge,
                    _ => edge + (c - edge) * below_one(random),
                }
            }
            Kind::Quadric(row) => {
                let from = self.center + random.vector() * self.size;
                let (c, slope, _) = row.value_at(from);
                let bend = (row.normal_at(n) - row.normal_at(DVec3::ZERO)).dot(n) * 0.5;
                let b = slope.dot(n);
                let root = (b * b - 4.0 * bend * c).sqrt();
                let q = -0.5 * (b + root.copysign(b));
                let t = if random.below(2) == 0 {
                    c / q
                } else {
                    q / bend
                };
                if t.is_finite() { from + n * t } else { from }
            }
            Kind::HalfSpace(plane) => {
                let p = self.center + random.vector() * self.size;
                let n = plane.normal;
                p + n * ((plane.offset - n.dot(p)) / n.length_squared())
            }
        }
    }

    fn aim(&self, random: &mut Random) -> DVec3 {
        match random.below(4) {
            0 => self.points[random.below(self.points.len() as u64) as usize],
            1 => self.center + random.vector() * self.size,
            _ => self.surface(random),
        }
    }

    /// A ray as a tracer has them: from `far` radii away, at the primitive.
    pub fn plain_ray(&self, random: &mut Random, far: f64, narrow: bool) -> Case {
        let target = self.center + random.vector() * self.size;
        let org = self.center + direction(random) * (self.size * far);
        self.case(random, org, (target - org).normalize(), narrow)
    }

    pub fn hard_ray(&self, random: &mut Random) -> Case {
        let target = self.aim(random);
        let far = 10.0_f64.powf(below_one(random) * 6.0) * self.size;
        let mut org = match random.below(8) {
            0 => self.aim(random),
            1 => self.center + random.vector() * self.size,
            2 => self.center + (direction(random) * 4.0).round() * self.size,
            3 => self.center + DVec3::AXES[random.below(3) as usize] * far,
            _ => self.center + direction(random) * far,
        };
        let mut dir = match random.below(8) {
            0 => DVec3::AXES[random.below(3) as usize],
            1 if matches!(self.kind, Kind::Quadric(_)) => {
                // Tangent to it, there.
                let Kind::Quadric(row) = &self.kind else {
                    unreachable!()
                };
                let dir = row.normal_at(target).cross(direction(random));
                org = target - dir.normalize_or_zero() * far;
                dir
            }
            1 => {
                // Tangent to a sphere about the centre, through the target.
                let radial = target - self.center;
                let dir = radial.cross(direction(random));
                org = target - dir.normalize_or_zero() * far;
                dir
            }
            2 => {
                let [from, to] = [self.aim(random), target];
                org = from - (to - from) * below_one(random) * 3.0;
                to - from
            }
            _ => target - org,
        };
        if random.below(8) == 0 {
            dir[random.below(3) as usize] = 0.0;
        }
        if random.below(8) == 0 {
            dir[random.below(3) as usize] *= 10.0_f64.powf(-20.0 * below_one(random));
        }
        dir *= match random.below(8) {
            0 => 2.0_f64.powi(random.below(61) as i32 - 30) / self.size,
            1 => 10.0_f64.powf(random.unit() * 20.0),
            _ => 1.0 / dir.length().max(1e-300),
        };
        if random.below(64) == 0 {
            const ENDS: [f64; 6] = [0.0, 1e-300, 1e300, 1e-42, 1e38, f64::INFINITY];
            let k = random.below(3) as usize;
            let end = ENDS[random.below(6) as usize];
            match random.below(2) {
                0 => dir[k] = end,
                _ => org[k] = -end,
            }
        }
        if let Kind::HalfSpace(_) = self.kind
            && random.below(4) == 0
        {
            // Along a diagonal, to which planes at 45 degrees are parallel.
            let [_, j, k] = axes_from(random);
            dir[j] = dir[k] * [1.0, -1.0][random.below(2) as usize];
        }
        let narrow = random.below(2) == 0;
        self.case(random, org, dir, narrow)
    }

    fn case(&self, random: &mut Random, org: DVec3, dir: DVec3, narrow: bool) -> Case {
        let single = |v: DVec3| v.to_array().map(|x| f64::from(x as f32));
        let length = dir.length();
        let reach = (org - self.center).length() / length;
        let t_min = match random.below(8) {
            0 => (reach * below_one(random) * 1.5) as f32,
            1 => -reach as f32,
            _ => 0.0,
        };
        Case {
            kind: self.kind.clone(),
            org: org.to_array(),
            dir: if narrow { single(dir) } else { dir.to_array() },
            t_min: if t_min.is_finite() { t_min } else { 0.0 },
        }
    }
}
