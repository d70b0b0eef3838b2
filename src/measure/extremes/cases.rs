//! Cases of the sweeps: scenes and rays at a value, and sequences of values.

use super::objects::{Stand, mesh_of, place, rotation, shapes};
use super::rays::{Random, SweepRay, at_targets, through};
use super::{Case, Subject};
use crate::generate::displaced_sphere;
use glam::{DAffine3, DMat3, DVec3};
use lanecast_model::geom::Sphere;
use lanecast_model::scene::{Edge, SceneBuilder};

/// Unit direction, not along an axis, in which distant objects are placed.
pub const AWAY: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// Returns the f64 nearest to 10^k, the same on every machine.
pub fn power(k: i32) -> f64 {
    format!("1e{k}").parse().unwrap_or(0.0)
}

pub fn decades(from: i32, to: i32) -> Vec<f64> {
    every(1, from, to)
}

/// Returns powers of ten whose exponents are `step` apart.
pub fn every(step: i32, from: i32, to: i32) -> Vec<f64> {
    let towards = (to - from).signum() * step;
    let count = (to - from).abs() / step;
    (0..=count).map(|i| power(from + i * towards)).collect()
}

pub fn scaled(subject: Subject, size: f64, rays: usize, random: &mut Random) -> Case {
    let middle = DVec3::ZERO;
    seen(subject, &Stand { middle, size }, rays, random)
}

/// Places the object at its stand, with rays from a distance of four radii.
pub fn seen(subject: Subject, stand: &Stand, rays: usize, random: &mut Random) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, stand);
    place(&mut scene, &shapes, None);
    let target = |r: &mut Random| stand.at(r.in_ball());
    let rays = at_targets(rays, 4.0 * stand.size, random, target);
    Case { scene, rays }
}

/// Places the object by a transform, with rays from about four of its own radii.
pub fn placed(subject: Subject, map: DAffine3, rays: usize, random: &mut Random) -> Case {
    placed_from(4.0, subject, map, rays, random)
}

/// Places the object by a transform, with rays from `distance`.
pub fn placed_from(
    distance: f64,
    subject: Subject,
    map: DAffine3,
    rays: usize,
    random: &mut Random,
) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, &Stand::HERE);
    place(&mut scene, &shapes, Some(map));
    let target = |r: &mut Random| map.transform_point3(r.in_ball());
    let rays = at_targets(rays, distance, random, target);
    Case { scene, rays }
}

/// Returns a transform of this condition number: a rotation, a scaling and another
/// rotation.
pub fn sheared(condition: f64, random: &mut Random) -> DAffine3 {
    let scale = DVec3::new(1.0, 1.0 / condition.sqrt(), 1.0 / condition);
    let inner = rotation(random);
    DAffine3::from_mat3(rotation(random) * DMat3::from_diagonal(scale) * inner)
}

/// Places the object at the end of a chain of nodes.
pub fn chain(subject: Subject, levels: usize, rays: usize, random: &mut Random) -> Case {
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

/// Generates rays through the object whose directions `turn` derives from random ones.
pub fn turned(
    subject: Subject,
    rays: usize,
    random: &mut Random,
    turn: impl Fn(DVec3, &mut Random) -> [f64; 3],
) -> Case {
    let mut scene = SceneBuilder::default();
    let shapes = shapes(subject, &mut scene, &Stand::HERE);
    place(&mut scene, &shapes, None);
    let one = |_| {
        let (target, away) = (random.in_ball(), random.between(2.0, 6.0));
        let dir = random.direction();
        let dir = turn(dir, random);
        let size = dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        // A zero direction starts at the target itself.
        let distance = if size > 0.0 { away / size } else { 0.0 };
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

pub fn directed(subject: Subject, length: f64, rays: usize, random: &mut Random) -> Case {
    turned(subject, rays, random, |dir, _| (dir * length).to_array())
}

/// Builds grids of exactly coplanar triangles: corners are multiples of two integer
/// vectors, and the plane is oblique to the axes. Each grid is placed so that its rays,
/// all of one direction, meet it at the angle with this sine.
pub fn along_planes(sine: f64, rays: usize, random: &mut Random) -> Case {
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
    // The plane's own axes, which are rotated to the ray's.
    let own = DMat3::from_cols(u / 3.0, v / 3.0, u.cross(v) / 9.0);
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    let planes: [(DAffine3, [f64; 3]); PLANES] = std::array::from_fn(|i| {
        let dir = random.direction().to_array();
        let along = DVec3::from_array(dir).normalize();
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
        let (map, dir) = planes[i / lanecast_engine::trace::BEAM % PLANES];
        let [x, y] = [(); 2].map(|()| random.between(-half, half));
        let target = map.transform_point3(on_plane(x, y) / 4.0);
        let distance = random.between(2.0, 20.0);
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Aims half of the rays inside the silhouette of a unit sphere and half outside, at
/// distance `depth` from it.
pub fn tangent(depth: f64, rays: usize, random: &mut Random) -> Case {
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
        let dir = random.direction().to_array();
        let along = DVec3::from_array(dir).normalize();
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

/// Aims rays near a mesh's edges, every fourth near a corner.
pub fn near_edges(depth: f64, rays: usize, random: &mut Random) -> Case {
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
        let dir = random.direction().to_array();
        let distance = random.between(2.0, 6.0);
        through(target, dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Builds fans of right-angled triangles of base 1 around one corner at the origin, so
/// that f32 holds their heights; several copies are placed by transforms.
pub fn slivers(height: f64, rays: usize, random: &mut Random) -> Case {
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
        // The targets also lie slightly beyond the borders.
        let (u, v) = (random.between(-0.1, 1.0), random.between(-0.1, 1.0));
        let target = corners[1] * u + corners[2] * v;
        let dir = random.direction().to_array();
        let distance = random.between(2.0, 6.0);
        through(map.transform_point3(target), dir, distance, random)
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}

/// Builds spheres at distance 1 from the eye of the first half of the rays; the other
/// half is aimed with f64 accuracy.
pub fn small_spheres(radius: f64, rays: usize, random: &mut Random) -> Case {
    const SPHERES: usize = 16;
    let mut scene = SceneBuilder::default();
    let centers: [DVec3; SPHERES] = std::array::from_fn(|_| random.direction());
    for center in centers {
        let ball = scene.sphere("", Sphere { center, radius });
        place(&mut scene, &[ball], None);
    }
    let half = rays / 2;
    let one = |i: usize| {
        let center = centers[i / lanecast_engine::trace::BEAM % SPHERES];
        let target = center + random.in_ball() * (1.2 * radius);
        if i >= half {
            let dir = random.direction().to_array();
            return through(target, dir, 1.0, random);
        }
        SweepRay {
            org: [0.0; 3],
            dir: target.to_array(),
            t_max: f32::INFINITY,
        }
    };
    let rays = (0..rays).map(one).collect();
    Case { scene, rays }
}
