//! Closed meshes have no cracks: rays from outside, aimed exactly at a shared
//! edge or vertex, meet the surface there or before it, in both precisions.
//!
//! Aimed exactly: the target has few bits (a vertex, or the middle of an edge),
//! the direction is any f32 vector, and the origin, the target less a power of
//! two times the direction, is exact in f64 (nearly so, now and then). So the
//! line of the ray goes through the target itself; only fast rounds its origin.
//! Of the outline, where a ray may pass by, only so much is said: nothing.

mod common;

use common::{Loaded, Random, RayColumns, assets, load};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::accel::Structure;
use lanecast::plan::Arithmetic;
use lanecast::scene::{Appearances, Camera};
use lanecast::scene::{Edge, Mesh, MeshData, MeshId, SceneBuilder};
use lanecast::trace::HitId;
use std::collections::HashMap;

const RAYS: usize = 100_000;

/// A point that triangles share, and their normals.
struct Target {
    point: DVec3,
    normals: Vec<DVec3>,
}

/// Vertices and middles of edges, joined by place: files repeat vertices along
/// seams.
fn targets(mesh: &Mesh) -> Vec<Target> {
    let key = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let mut edges: HashMap<_, Target> = HashMap::new();
    let mut vertices: HashMap<_, Target> = HashMap::new();
    for i in 0..mesh.triangles.len() {
        let p = mesh.corners(i).map(|c| DVec3::from_array(c.map(f64::from)));
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        let add = |map: &mut HashMap<_, Target>, key, point| {
            let target = map.entry(key).or_insert(Target {
                point,
                normals: Vec::new(),
            });
            target.normals.push(normal);
        };
        for k in 0..3 {
            let (a, b) = (key(p[k]), key(p[(k + 1) % 3]));
            let middle = (p[k] + p[(k + 1) % 3]) * 0.5;
            add(&mut edges, (a.min(b), a.max(b)), middle);
            add(&mut vertices, (a, a), p[k]);
        }
    }
    assert!(
        edges.values().all(|e| e.normals.len() == 2),
        "the mesh is closed"
    );
    // By place, not as the map has them.
    let mut all: Vec<Target> = edges.into_values().chain(vertices.into_values()).collect();
    all.sort_by_key(|t| t.point.to_array().map(f64::to_bits));
    all
}

/// Rays and the t at which each is at its target.
struct Aimed {
    rays: RayColumns,
    t: Vec<f64>,
    /// Targets left out because they lie on the outline.
    outline: usize,
}

/// `turn` takes world directions to the mesh's space, `place` its points to the
/// world.
fn aim(mesh: &Mesh, turn: DMat3, place: impl Fn(DVec3) -> DVec3) -> Aimed {
    let targets = targets(mesh);
    let bounds = mesh.bounds();
    let size = (place(bounds.max) - place(bounds.min)).length();
    let random = &mut Random(7);
    let mut aimed = Aimed {
        rays: RayColumns::default(),
        t: Vec::new(),
        outline: 0,
    };
    while aimed.t.len() < RAYS {
        let target = &targets[random.below(targets.len() as u64) as usize];
        let dir = random.vector().to_array().map(|x| x as f32);
        let wide = DVec3::from_array(dir.map(f64::from));
        let seen = (turn * wide).normalize_or_zero();
        if is_on_outline(target, seen) {
            aimed.outline += 1;
            continue;
        }
        // Farther off than the mesh is large.
        let t = libm::exp2(libm::ceil(libm::log2(size / wide.length())));
        aimed.rays.push(place(target.point) - wide * t, dir);
        aimed.t.push(t);
    }
    aimed
}

/// Seen along `seen`, the surface turns away at the target, or nearly.
fn is_on_outline(target: &Target, seen: DVec3) -> bool {
    let faces = target.normals.iter().map(|n| n.dot(seen));
    let (least, most) = faces.fold((1.0_f64, -1.0_f64), |(l, m), x| (l.min(x), m.max(x)));
    least < 0.02 && most > -0.02
}

/// `exact`: how far, relative to t, exact rays may be off their target.
fn no_cracks(name: &str, loaded: &Loaded, aimed: &Aimed, exact: f64) {
    let world = loaded.world(Structure::Bvh);
    for (arithmetic, tolerance) in [(Arithmetic::F32, 1e-4), (Arithmetic::F64, exact)] {
        let hits = aimed.rays.closest(&world, &loaded.kernels(arithmetic));
        let past = |(hit, t): &(&(f64, HitId), &f64)| {
            hit.1 == HitId::NONE || hit.0 > **t * (1.0 + tolerance)
        };
        let missed = hits.iter().filter(|h| h.1 == HitId::NONE).count();
        let cracks = hits.iter().zip(&aimed.t).filter(past).count();
        let at = |(hit, t): &(&(f64, HitId), &f64)| (hit.0 - **t).abs() <= **t * tolerance;
        let there = hits.iter().zip(&aimed.t).filter(at).count();
        println!(
            "{name} {arithmetic:?}: {} rays ({} on the outline left out), {there} met the target \
             itself, {cracks} went past it, {missed} of them through everything",
            hits.len(),
            aimed.outline
        );
        assert_eq!(cracks, 0, "{name} {arithmetic:?}");
        assert!(there > RAYS / 4);
    }
}

#[test]
fn closed_meshes_have_no_cracks() {
    let Some(assets) = assets() else { return };
    for name in ["spot_6k", "armadillo_86k"] {
        let loaded = load(&assets.join(format!("meshes/{name}.glb")), 1.0);
        let mesh = loaded.scene.meshes.row(MeshId(0));
        let aimed = aim(&mesh, DMat3::IDENTITY, |p| p);
        no_cracks(name, &loaded, &aimed, 1e-11);
        let placed = placed(&mesh);
        let row = placed.appearances.rows[0];
        let turn = DMat3::from_cols_array_2d(&row.object_from_world.linear);
        let aimed = aim(&mesh, turn, |p| {
            DVec3::from_array(row.world_from_object.point(p.to_array()))
        });
        no_cracks(&format!("{name}, placed"), &placed, &aimed, 1e-11);
    }
}

/// The same mesh turned, stretched and moved.
fn placed(mesh: &Mesh) -> Loaded {
    let mut scene = SceneBuilder::default();
    let data = MeshData {
        positions: mesh.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: mesh.triangles.to_vec(),
        ..MeshData::default()
    };
    let shape = scene.mesh("", &data);
    let map = DAffine3::from_scale_rotation_translation(
        DVec3::new(3.0, 2.0, 2.5),
        DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7),
        DVec3::new(-30.0, 10.0, 20.0),
    );
    let transform = scene.transform(map.into());
    scene.instance("", Edge::shape(shape).transform(transform));
    finished(scene)
}

fn finished(scene: SceneBuilder) -> Loaded {
    let scene = scene.finish().unwrap();
    Loaded {
        appearances: Appearances::of(&scene).unwrap(),
        scene,
        camera: Camera::perspective(DVec3::Z, DVec3::ZERO, DVec3::Y, 40.0),
    }
}

/// An octahedron split `depth` times, its vertices moved in and out and about:
/// closed, its edges as long as its distance from the origin or shorter.
fn rough_ball(depth: u32, random: &mut Random) -> MeshData {
    let mut points: Vec<DVec3> = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| [a, -a]).concat();
    let mut triangles: Vec<[u32; 3]> = (0..8)
        .map(|i| {
            let [x, y, z] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)];
            let even = (i ^ i >> 1 ^ i >> 2) & 1 == 0;
            if even { [x, y, z] } else { [x, z, y] }
        })
        .collect();
    for _ in 0..depth {
        let mut middles = HashMap::new();
        let mut split = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push((points[a as usize] + points[b as usize]).normalize());
                    points.len() as u32 - 1
                })
            });
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = split;
    }
    let shake = 0.3 / f64::from(1 << depth);
    MeshData {
        positions: points
            .iter()
            .map(|p| {
                (*p + random.vector() * shake)
                    .to_array()
                    .map(|x| f64::from(x as f32))
            })
            .collect(),
        triangles,
        ..MeshData::default()
    }
}

/// From close by, where the rounding of the edge functions is not lost in that
/// of the ray: from f32 points some edges' lengths away.
#[test]
fn rough_balls_have_no_cracks_from_close_by() {
    let random = &mut Random(3);
    for depth in 0..5 {
        let mut scene = SceneBuilder::default();
        let shape = scene.mesh("", &rough_ball(depth, random));
        scene.instance("", Edge::shape(shape));
        let loaded = finished(scene);
        let targets = targets(&loaded.scene.meshes.row(MeshId(0)));
        let mut aimed = Aimed {
            rays: RayColumns::default(),
            t: Vec::new(),
            outline: 0,
        };
        let edge = 1.0 / f64::from(1 << depth);
        while aimed.t.len() < RAYS {
            let target = &targets[random.below(targets.len() as u64) as usize];
            let far = target.point + random.vector() * edge * 2.0;
            let org = DVec3::from_array(far.to_array().map(|x| f64::from(x as f32)));
            let dir = (target.point - org).to_array().map(|x| x as f32);
            let seen = DVec3::from_array(dir.map(f64::from)).normalize_or_zero();
            if is_on_outline(target, seen) {
                aimed.outline += 1;
                continue;
            }
            aimed.rays.push(org, dir);
            aimed.t.push(1.0);
        }
        // The direction is rounded to f32.
        let name = format!("ball of {} triangles", 8 << (2 * depth));
        no_cracks(&name, &loaded, &aimed, 1e-4);
    }
}
