//! The table of sweeps: each goes from the easy to the extreme.

use super::Case;
use super::objects::{Stand, mesh_of, place, rotation, shapes};
use super::rays::{Random, SweepRay, at_targets, rounded, through};
use crate::geom::Sphere;
use crate::measure::generate::displaced_sphere;
use crate::scene::{Edge, SceneBuilder};
use glam::{DAffine3, DMat3, DVec3};

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    Triangles,
    /// Spheres, ellipsoids, cylinders, cones, boxes, polyhedra, polygons and
    /// half-spaces.
    Solids,
}

impl Subject {
    pub fn name(self) -> &'static str {
        match self {
            Subject::Triangles => "triangles",
            Subject::Solids => "solids",
        }
    }
}

pub struct Sweep {
    /// As `--only` calls it.
    pub name: &'static str,
    /// For people.
    pub title: &'static str,
    /// What the values are.
    pub axis: &'static str,
    /// Each is a sweep of its own.
    pub subjects: &'static [Subject],
    /// From the easy to the extreme.
    pub values: fn() -> Vec<f64>,
    /// The scene and so many rays at a value.
    pub case: fn(Subject, f64, usize, &mut Random) -> Case,
}

/// Where `guarded` and `exact` are known to fall short of exact arithmetic, and
/// why: everywhere else they promise to be right.
const GAPS: &[(Option<&str>, Subject, &str)] = &[
    (
        Some("overflow"),
        Subject::Triangles,
        "tiles lose triangles where products leave f32: exact from 1e20, guarded from 1e38",
    ),
    (
        Some("underflow"),
        Subject::Triangles,
        "products of f32 below the least normal number: bounds of t, and tiles",
    ),
];

impl Sweep {
    pub fn known_gap(&self, subject: Subject) -> Option<&'static str> {
        let here = |(sweep, of, _): &&(Option<&str>, Subject, &str)| {
            *of == subject && sweep.is_none_or(|name| name == self.name)
        };
        GAPS.iter().find(here).map(|(_, _, why)| *why)
    }
}

const TRIANGLES: &[Subject] = &[Subject::Triangles];
const SOLIDS: &[Subject] = &[Subject::Solids];
const BOTH: &[Subject] = &[Subject::Triangles, Subject::Solids];

pub const SWEEPS: &[Sweep] = &[
    Sweep {
        name: "small",
        title: "A small scene, seen from as near",
        axis: "size of the scene",
        subjects: BOTH,
        values: || decades(0, -9),
        case: scaled,
    },
    Sweep {
        name: "large",
        title: "A large scene, seen from as far",
        axis: "size of the scene",
        subjects: BOTH,
        values: || decades(0, 9),
        case: scaled,
    },
    Sweep {
        name: "far-camera",
        title: "Rays that come from far away",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let mut scene = SceneBuilder::default();
            let shapes = shapes(subject, &mut scene, &Stand::HERE);
            place(&mut scene, &shapes, None);
            let rays = at_targets(rays, 4.0 * value, random, |r| r.in_ball());
            Case { scene, rays }
        },
    },
    Sweep {
        name: "offset",
        title: "Object and camera far from the origin, the object by its own numbers",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let stand = Stand {
                middle: AWAY * value,
                size: 1.0,
            };
            seen(subject, &stand, rays, random)
        },
    },
    Sweep {
        name: "offset-placed",
        title: "Object and camera far from the origin, the object by a transform",
        axis: "distance in radii",
        subjects: BOTH,
        values: || decades(0, 9),
        case: |subject, value, rays, random| {
            let map = DAffine3::from_translation(AWAY * value);
            placed(subject, map, rays, random)
        },
    },
    Sweep {
        name: "grazing",
        title: "Rays along a plane of triangles",
        axis: "sine of the angle",
        subjects: TRIANGLES,
        values: || decades(0, -12),
        case: |_, value, rays, random| along_planes(value, rays, random),
    },
    Sweep {
        name: "tangent",
        title: "Rays that just meet or just miss a sphere",
        axis: "distance from the silhouette in radii",
        subjects: SOLIDS,
        values: || decades(-1, -16),
        case: |_, value, rays, random| tangent(value, rays, random),
    },
    Sweep {
        name: "edges",
        title: "Rays near the edges and corners of a mesh",
        axis: "distance from the edge in edges",
        subjects: TRIANGLES,
        values: || decades(-1, -17),
        case: |_, value, rays, random| near_edges(value, rays, random),
    },
    Sweep {
        name: "slivers",
        title: "Triangles from squat to sliver",
        axis: "height over base",
        subjects: TRIANGLES,
        values: || decades(0, -8),
        case: |_, value, rays, random| slivers(value, rays, random),
    },
    Sweep {
        name: "small-spheres",
        title: "Spheres that are small for their distance",
        axis: "radius over distance",
        subjects: SOLIDS,
        values: || decades(-1, -9),
        case: |_, value, rays, random| small_spheres(value, rays, random),
    },
    Sweep {
        name: "needles",
        title: "Objects squeezed along two axes",
        axis: "thickness over length",
        subjects: BOTH,
        values: || decades(0, -9),
        case: |subject, value, rays, random| {
            let scale = DVec3::new(value, value, 1.0);
            let map = rotation(random) * DMat3::from_diagonal(scale);
            placed(subject, DAffine3::from_mat3(map), rays, random)
        },
    },
    Sweep {
        name: "pancakes",
        title: "Objects squeezed along one axis",
        axis: "thickness over width",
        subjects: BOTH,
        values: || decades(0, -9),
        case: |subject, value, rays, random| {
            let scale = DVec3::new(1.0, value, 1.0);
            let map = rotation(random) * DMat3::from_diagonal(scale);
            placed(subject, DAffine3::from_mat3(map), rays, random)
        },
    },
    Sweep {
        name: "condition",
        title: "Objects sheared and squeezed by a transform",
        axis: "condition of the transform",
        subjects: BOTH,
        values: || decades(0, 12),
        case: |subject, value, rays, random| {
            let scale = DVec3::new(1.0, 1.0 / value.sqrt(), 1.0 / value);
            let inner = rotation(random);
            let map = rotation(random) * DMat3::from_diagonal(scale) * inner;
            placed(subject, DAffine3::from_mat3(map), rays, random)
        },
    },
    Sweep {
        name: "chain",
        title: "Instances in instances: turned, scaled and moved at each level",
        axis: "levels",
        subjects: BOTH,
        values: || [1, 2, 3, 5, 7, 10, 15, 20, 30, 40].map(f64::from).to_vec(),
        case: |subject, value, rays, random| chain(subject, value as usize, rays, random),
    },
    Sweep {
        name: "short-directions",
        title: "Short directions, down to denormal ones",
        axis: "length of the direction",
        subjects: BOTH,
        values: || {
            [
                every(5, 0, -35),
                [-37, -38, -40, -42, -44, -45].map(power).to_vec(),
            ]
            .concat()
        },
        case: directed,
    },
    Sweep {
        name: "long-directions",
        title: "Long directions, up to the largest",
        axis: "length of the direction",
        subjects: BOTH,
        values: || [every(5, 0, 35), decades(36, 38)].concat(),
        case: directed,
    },
    Sweep {
        name: "skew-directions",
        title: "Directions of which one part is tiny beside the others",
        axis: "the part over the largest",
        subjects: BOTH,
        values: || every(5, 0, -45),
        case: |subject, value, rays, random| {
            turned(subject, rays, random, |dir, random| {
                let k = random.below(3);
                let mut dir = rounded(dir);
                dir[k] = (f64::from(dir[k]) * value) as f32;
                dir
            })
        },
    },
    Sweep {
        name: "zero-directions",
        title: "Directions along planes and axes, and none at all",
        axis: "parts that are zero",
        subjects: BOTH,
        values: || vec![1.0, 2.0, 3.0],
        case: |subject, value, rays, random| {
            turned(subject, rays, random, |dir, random| {
                let first = random.below(3);
                let mut dir = rounded(dir);
                for i in 0..value as usize {
                    // Of either sign.
                    dir[(first + i) % 3] *= 0.0;
                }
                dir
            })
        },
    },
    Sweep {
        name: "underflow",
        title: "Scenes down to the least numbers",
        axis: "size of the scene",
        subjects: BOTH,
        values: || {
            let single = [-10, -15, -20, -25, -30, -35, -38, -40, -42, -44, -45];
            let double = [-60, -80, -100, -150, -160, -200, -300, -308, -320];
            single.into_iter().chain(double).map(power).collect()
        },
        case: scaled,
    },
    Sweep {
        name: "overflow",
        title: "Scenes up to the largest numbers",
        axis: "size of the scene",
        subjects: BOTH,
        values: || {
            let single = [10, 15, 18, 20, 25, 30, 35, 36, 37, 38, 39];
            let double = [60, 80, 100, 150, 160, 200, 300, 307];
            single.into_iter().chain(double).map(power).collect()
        },
        case: scaled,
    },
];

/// Where things stand that are far from the origin; not along an axis, and of
/// length 1.
const AWAY: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// The f64 nearest to 10^k, on every machine.
fn power(k: i32) -> f64 {
    format!("1e{k}").parse().unwrap_or(0.0)
}

fn decades(from: i32, to: i32) -> Vec<f64> {
    every(1, from, to)
}

/// Powers of ten whose exponents are `step` apart.
fn every(step: i32, from: i32, to: i32) -> Vec<f64> {
    let towards = (to - from).signum() * step;
    let count = (to - from).abs() / step;
    (0..=count).map(|i| power(from + i * towards)).collect()
}

fn scaled(subject: Subject, size: f64, rays: usize, random: &mut Random) -> Case {
    let middle = DVec3::ZERO;
    seen(subject, &Stand { middle, size }, rays, random)
}

/// The object where it stands, from four radii away.
fn seen(subject: Subject, stand: &Stand, rays: usize, random: &mut Random) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, stand);
    place(&mut scene, &shapes, None);
    let target = |r: &mut Random| stand.at(r.in_ball());
    let rays = at_targets(rays, 4.0 * stand.size, random, target);
    Case { scene, rays }
}

/// The object under a transform, from about four of its own radii away.
fn placed(subject: Subject, map: DAffine3, rays: usize, random: &mut Random) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, &Stand::HERE);
    place(&mut scene, &shapes, Some(map));
    let target = |r: &mut Random| map.transform_point3(r.in_ball());
    let rays = at_targets(rays, 4.0, random, target);
    Case { scene, rays }
}

/// A chain of nodes with the object at its end.
fn chain(subject: Subject, levels: usize, rays: usize, random: &mut Random) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, &Stand::HERE);
    let mut edges: Vec<Edge> = shapes.into_iter().map(Edge::shape).collect();
    let mut map = DAffine3::IDENTITY;
    for _ in 0..levels {
        let scale = random.between(0.8, 1.25);
        let local = DAffine3::from_mat3_translation(
            rotation(random) * scale,
            random.direction() * random.unit(),
        );
        map = local * map;
        let node = scene.node("", &edges);
        edges = vec![Edge::node(node).transform(scene.transform(local.into()))];
    }
    for edge in edges {
        scene.instance("", edge);
    }
    let target = |r: &mut Random| map.transform_point3(r.in_ball());
    let size = map.matrix3.x_axis.length();
    let rays = at_targets(rays, 4.0 * size, random, target);
    Case { scene, rays }
}

/// Rays through the object whose directions `turn` makes from random ones.
fn turned(
    subject: Subject,
    rays: usize,
    random: &mut Random,
    turn: impl Fn(DVec3, &mut Random) -> [f32; 3],
) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, &Stand::HERE);
    place(&mut scene, &shapes, None);
    let one = |_| {
        let (target, away) = (random.in_ball(), random.between(2.0, 6.0));
        let dir = random.direction();
        let dir = turn(dir, random);
        let size = dir.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        // No direction: from the target itself.
        let distance = if size > 0.0 {
            away / f64::from(size)
        } else {
            0.0
        };
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

fn directed(subject: Subject, length: f64, rays: usize, random: &mut Random) -> Case {
    turned(subject, rays, random, |dir, _| rounded(dir * length))
}

/// Grids of triangles in one plane, exactly: corners are multiples of two whole
/// vectors, and the plane lies askew to the axes. Each is placed so that its rays,
/// all of one direction, meet it under the angle.
fn along_planes(sine: f64, rays: usize, random: &mut Random) -> Case {
    const PLANES: usize = 8;
    const SIDE: u32 = 8;
    let (u, v) = (DVec3::new(2.0, -1.0, 2.0), DVec3::new(-1.0, 2.0, 2.0));
    let on_plane = |x: f64, y: f64| (u * x + v * y) / 4.0;
    let mut scene = SceneBuilder::default();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let half = f64::from(SIDE) / 2.0;
    for y in 0..=SIDE {
        for x in 0..=SIDE {
            let at = on_plane(f64::from(x) - half, f64::from(y) - half);
            positions.push((at / 4.0).to_array());
        }
    }
    for i in 0..SIDE * SIDE {
        let a = i / SIDE * (SIDE + 1) + i % SIDE;
        let (b, c) = (a + 1, a + SIDE + 1);
        triangles.extend([[a, b, c], [b, c + 1, c]]);
    }
    let mesh = scene.mesh("", &mesh_of(positions, triangles));
    // The plane's own axes, to be turned to the ray's.
    let own = DMat3::from_cols(u / 3.0, v / 3.0, u.cross(v) / 9.0);
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    let planes: [(DAffine3, [f32; 3]); PLANES] = std::array::from_fn(|i| {
        let dir = rounded(random.direction());
        let along = DVec3::from_array(dir.map(f64::from)).normalize();
        let (side, _) = along.any_orthonormal_pair();
        let normal = side * cosine - along * sine;
        let across = along * cosine + side * sine;
        let turned = DMat3::from_cols(across, normal.cross(across), normal);
        let map = turned * own.transpose();
        let place = DVec3::X * (8.0 * i as f64);
        (DAffine3::from_mat3_translation(map, place), dir)
    });
    for (map, _) in planes {
        place(&mut scene, &[mesh], Some(map));
    }
    let one = |i: usize| {
        // Tiles of one direction.
        let (map, dir) = planes[i / crate::trace::TILE % PLANES];
        let [x, y] = [(); 2].map(|()| random.between(-half, half));
        let target = map.transform_point3(on_plane(x, y) / 4.0);
        let distance = random.between(2.0, 20.0);
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Half of the rays inside the silhouette of a unit sphere, half outside.
fn tangent(depth: f64, rays: usize, random: &mut Random) -> Case {
    let mut scene = SceneBuilder::default();
    let center = AWAY;
    let ball = scene.sphere(
        "",
        Sphere {
            center,
            radius: 1.0,
        },
    );
    place(&mut scene, &[ball], None);
    let one = |i: usize| {
        let dir = rounded(random.direction());
        let along = DVec3::from_array(dir.map(f64::from)).normalize();
        let side = random.direction();
        let side = (side - along * side.dot(along)).normalize_or(along.any_orthonormal_vector());
        let reach = if i.is_multiple_of(2) {
            1.0 - depth
        } else {
            1.0 + depth
        };
        let distance = random.between(2.0, 20.0);
        through(center + side * reach, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Every fourth ray near a corner.
fn near_edges(depth: f64, rays: usize, random: &mut Random) -> Case {
    let set = displaced_sphere(12, 12);
    let points: Vec<DVec3> = set
        .positions
        .iter()
        .map(|p| DVec3::from_array(p.map(f64::from)))
        .collect();
    let mut scene = SceneBuilder::default();
    let positions = points.iter().map(|p| p.to_array()).collect();
    let mesh = scene.mesh("", &mesh_of(positions, set.triangles.clone()));
    place(&mut scene, &[mesh], None);
    let one = |i: usize| {
        let triangle = set.triangles[random.below(set.triangles.len())];
        let k = random.below(3);
        let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| points[v as usize]);
        let along = if i.is_multiple_of(4) {
            0.0
        } else {
            random.unit()
        };
        let beside = random.direction() * (depth * (b - a).length());
        let target = a + (b - a) * along + beside;
        let dir = rounded(random.direction());
        let distance = random.between(2.0, 6.0);
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Fans of right-angled triangles of base 1 about one corner, so that f32 holds
/// their heights; a few of them, placed.
fn slivers(height: f64, rays: usize, random: &mut Random) -> Case {
    const SLIVERS: u32 = 32;
    const FANS: usize = 8;
    let mut scene = SceneBuilder::default();
    let mut positions = vec![[0.0; 3]];
    for _ in 0..SLIVERS {
        let base = random.direction();
        let up = base.any_orthonormal_vector() * height;
        positions.extend([base.to_array(), up.to_array()]);
    }
    let triangles: Vec<[u32; 3]> = (0..SLIVERS).map(|i| [0, 2 * i + 1, 2 * i + 2]).collect();
    let points: Vec<DVec3> = positions.iter().map(|p| DVec3::from_array(*p)).collect();
    let mesh = scene.mesh("", &mesh_of(positions, triangles.clone()));
    let maps: [DAffine3; FANS] = std::array::from_fn(|_| {
        let middle = random.direction() * 3.0;
        DAffine3::from_mat3_translation(rotation(random), middle)
    });
    for map in maps {
        place(&mut scene, &[mesh], Some(map));
    }
    let one = |_| {
        let map = maps[random.below(FANS)];
        let corners = triangles[random.below(triangles.len())].map(|v| points[v as usize]);
        // A little beyond the borders, too.
        let (u, v) = (random.between(-0.1, 1.0), random.between(-0.1, 1.0));
        let target = corners[1] * u + corners[2] * v;
        let dir = rounded(random.direction());
        let distance = random.between(2.0, 6.0);
        through(map.transform_point3(target), dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Spheres at distance 1 from the first half's eye, at which the others arrive by
/// f64's aim.
fn small_spheres(radius: f64, rays: usize, random: &mut Random) -> Case {
    const SPHERES: usize = 16;
    let mut scene = SceneBuilder::default();
    let centers: [DVec3; SPHERES] = std::array::from_fn(|_| random.direction());
    for center in centers {
        let ball = scene.sphere("", Sphere { center, radius });
        place(&mut scene, &[ball], None);
    }
    let half = rays / 2;
    let one = |i: usize| {
        let center = centers[i / crate::trace::TILE % SPHERES];
        let target = center + random.in_ball() * (1.2 * radius);
        if i >= half {
            let dir = rounded(random.direction());
            return through(target, dir, 1.0, random);
        }
        SweepRay {
            org: [0.0; 3],
            dir: rounded(target),
            t_max: f32::INFINITY,
        }
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}
