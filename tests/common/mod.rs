//! Shared by the integration tests: random scenes, and all bits of a picture.
#![allow(dead_code)]

use glam::{DAffine3, DQuat, DVec3};
use lanecast::accel::{Density, KdQuality, Structure, World};
use lanecast::geom::*;
use lanecast::plan::{Arithmetic, Choices, Kernels, Needs, native_width, plan};
use lanecast::render::{AovSet, Progress, RenderConfig, Rendered, View, render};
use lanecast::scene::*;
use lanecast::trace::{
    Depths, HitId, HitIds, Hits, ItemBuffer, MAX_LANES, Origins, Rays, ShadowCache, any, closest,
    closest_listed,
};
use std::path::{Path, PathBuf};

/// The folder of test assets, or `None` after saying that it is absent.
pub fn assets() -> Option<PathBuf> {
    let folder = std::env::var_os("LANECAST_ASSETS").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets")),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no assets at {}", folder.display());
    None
}

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

    pub fn size(&mut self) -> f64 {
        0.1 + 0.5 * self.unit().abs()
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

/// One shape of a random kind, about the origin.
pub fn random_shape(scene: &mut SceneBuilder, random: &mut Random) -> ShapeId {
    let center = random.vector() * 0.3;
    match random.below(9) {
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
            let points = [
                corner(-0.7, -0.7),
                corner(0.7, -0.7),
                corner(0.7, 0.7),
                corner(0.0, 0.1),
                corner(-0.7, 0.7),
            ];
            scene.polygon("", &points, &[])
        }
        _ => {
            let data = random_mesh(random);
            scene.mesh("", &data)
        }
    }
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
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.5, 0.7, 5.0), DVec3::ZERO, DVec3::Y, 50.0),
    );
    scene.light(Light::Point {
        position: DVec3::new(3.0, 4.0, 5.0),
        intensity: [60.0; 3],
        falloff: Falloff::InverseSquare,
    });
    scene.light(Light::Directional {
        direction: DVec3::new(1.0, -1.0, -0.5),
        irradiance: [1.0; 3],
    });
    scene.background([0.1, 0.2, 0.3]);
    scene.finish().expect("a random scene is a good scene")
}

pub const ALL_AOVS: AovSet = AovSet {
    depth: true,
    position: true,
    normal: true,
    albedo: true,
    instance_id: true,
    primitive_id: true,
};

/// How a picture is computed; nothing of it may show.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub arithmetic: Arithmetic,
    pub lanes: usize,
    pub structure: Structure,
}

/// All that find primitives.
pub fn structures() -> [Structure; 8] {
    [
        Structure::Linear,
        Structure::Bvh,
        Structure::Nested,
        Structure::Narrow,
        Structure::Kd(KdQuality::default()),
        Structure::Grid(Density::default()),
        Structure::Heap,
        Structure::HeapSpheres,
    ]
}

/// Needs that are right for every scene.
pub const EVERYTHING: Needs = Needs {
    meshes: true,
    solids: true,
    transforms: true,
};

pub fn picture(
    scene: &Scene,
    camera: Camera,
    lights: &[Light],
    needs: Needs,
    way: Way,
    config: &RenderConfig,
) -> Rendered {
    let appearances = Appearances::of(scene).expect("checked");
    let world = World::build(scene, &appearances, way.structure);
    let view = View {
        world: &world,
        kernels: Kernels {
            arithmetic: way.arithmetic,
            lanes: way.lanes,
            needs,
        },
        camera,
        lights,
    };
    render(&view, config, false, &Progress::default()).expect("nobody interrupts")
}

/// FNV-1a over every bit of every channel, and the counts.
pub fn hash(rendered: &Rendered) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |bits: u64| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    let picture = &rendered.picture;
    let triples = [&picture.position, &picture.normal, &picture.albedo];
    let triples = triples.into_iter().flatten().chain([&picture.color]);
    for value in triples.flatten().flatten() {
        eat(u64::from(value.to_bits()));
    }
    for depth in picture.depth.iter().flatten() {
        eat(u64::from(depth.to_bits()));
    }
    for id in picture.instance_id.iter().flatten() {
        eat(*id);
    }
    for id in picture.primitive_id.iter().flatten() {
        eat(u64::from(*id));
    }
    let counts = &rendered.counts;
    eat(counts.primary_hits);
    eat(counts.shadow);
    eat(counts.shadow_occluded);
    eat(counts.reflection);
    eat(counts.refraction);
    hash
}

/// A scene file, complete with a view and lights.
pub struct Loaded {
    pub scene: Scene,
    pub appearances: Appearances,
    pub camera: Camera,
}

/// `aspect`: the picture's width over its height.
pub fn load(path: &Path, aspect: f64) -> Loaded {
    let loaded = lanecast::io::load(path, &Default::default());
    let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    let appearances = Appearances::of(&scene).expect("few appearances");
    let row = (!scene.cameras.rows.is_empty()).then_some(0);
    let (scene, camera) = scene.completed(row, &appearances, aspect);
    Loaded {
        scene,
        appearances,
        camera,
    }
}

impl Loaded {
    /// What the plan would take for it, at the machine's own width.
    pub fn kernels(&self, arithmetic: Arithmetic) -> Kernels {
        let planned = plan(&self.scene, &self.appearances, &Choices::default());
        Kernels {
            arithmetic,
            lanes: native_width(arithmetic),
            needs: planned
                .expect("the default choices can be built")
                .kernels
                .needs,
        }
    }

    pub fn world(&self, structure: Structure) -> World<'_> {
        World::build(&self.scene, &self.appearances, structure)
    }

    pub fn render(
        &self,
        world: &World,
        kernels: Kernels,
        lights: &[Light],
        config: &RenderConfig,
    ) -> Rendered {
        let view = View {
            world,
            kernels,
            camera: self.camera,
            lights,
        };
        render(&view, config, false, &Progress::default()).expect("nobody interrupts")
    }
}

/// Rays in columns, with room for the answers.
#[derive(Default)]
pub struct RayColumns {
    org: [Vec<f64>; 3],
    dir: [Vec<f32>; 3],
    len: usize,
}

impl RayColumns {
    pub fn push(&mut self, org: DVec3, dir: [f32; 3]) {
        for k in 0..3 {
            self.org[k].push(org[k]);
            self.dir[k].push(dir[k]);
        }
        self.len += 1;
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn ray(&self, i: usize) -> ([f64; 3], [f32; 3]) {
        (
            std::array::from_fn(|k| self.org[k][i]),
            std::array::from_fn(|k| self.dir[k][i]),
        )
    }

    /// (t, id) of the nearest hit beyond t = 0 of each ray.
    pub fn closest(&self, world: &World, kernels: &Kernels) -> Vec<(f64, HitId)> {
        self.answers(|rays, hits| closest(world, kernels, rays, hits))
    }

    /// The same by an item buffer, where there is one for these rays.
    pub fn closest_listed(&self, world: &World, kernels: &Kernels) -> Option<Vec<(f64, HitId)>> {
        Some(self.closest_by(&self.item_buffer(world)?, world, kernels))
    }

    pub fn item_buffer(&self, world: &World) -> Option<ItemBuffer> {
        ItemBuffer::of_rays(world, self.len, |i| Some(self.ray(i)))
    }

    pub fn closest_by(
        &self,
        items: &ItemBuffer,
        world: &World,
        kernels: &Kernels,
    ) -> Vec<(f64, HitId)> {
        self.answers(|rays, hits| closest_listed(world, kernels, rays, (items, 0), hits))
    }

    fn answers(&self, trace: impl FnOnce(&Rays, &mut Hits)) -> Vec<(f64, HitId)> {
        self.padded(vec![f32::INFINITY; self.len], |rays| {
            let (mut t, mut id) = (vec![0.0; rays.len()], HitIds::none(rays.len()));
            let mut hits = Hits {
                t: Depths::Double(&mut t),
                id: id.columns(),
            };
            trace(rays, &mut hits);
            t.into_iter().zip(id.iter()).take(self.len).collect()
        })
    }

    /// Whether anything lies between t = 0 and `t_max` of each ray.
    pub fn any(
        &self,
        world: &World,
        kernels: &Kernels,
        t_max: &[f32],
        cache: &mut ShadowCache,
    ) -> Vec<bool> {
        self.padded(t_max.to_vec(), |rays| {
            let mut blocked = vec![false; rays.len()];
            any(world, kernels, rays, cache, &mut blocked);
            blocked.truncate(self.len);
            blocked
        })
    }

    fn padded<T>(&self, mut t_max: Vec<f32>, trace: impl FnOnce(&Rays) -> T) -> T {
        let padded = self.len.next_multiple_of(MAX_LANES);
        let (mut org, mut dir) = (self.org.clone(), self.dir.clone());
        for k in 0..3 {
            org[k].resize(padded, 0.0);
            dir[k].resize(padded, 1.0);
        }
        t_max.resize(padded, -1.0);
        trace(&Rays {
            org: Origins::Double([&org[0], &org[1], &org[2]]),
            dir: [&dir[0], &dir[1], &dir[2]],
            t_min: &vec![0.0; padded],
            t_max: &t_max,
        })
    }
}

/// Scenes and rays that push at roundings: grazed stacks of slivers, coincident
/// triangles, badly conditioned placements, scenes far from the origin, flat
/// boxes under rays parallel to axes.
pub fn hard_scene(seed: u64) -> Scene {
    let random = &mut Random(seed);
    let mut scene = SceneBuilder::default();
    match seed % 5 {
        0 => {
            // Triangles within a sheet, as thin as a rounding or without depth.
            let depth = [0.0, 1e-7, 1e-6, 1e-4][random.below(4) as usize];
            let turn = DQuat::from_axis_angle(random.vector().normalize(), random.unit() * 3.0);
            let turn = if random.below(2) == 0 {
                turn
            } else {
                DQuat::IDENTITY
            };
            let positions = (0..300).map(|_| {
                let p = random.vector();
                (turn * DVec3::new(p.x, p.y, p.z * depth)).to_array()
            });
            let data = MeshData {
                positions: positions.collect(),
                triangles: (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                ..MeshData::default()
            };
            let shape = scene.mesh("", &data);
            let mut edge = Edge::shape(shape);
            if random.below(2) == 0 {
                // As it is once more, and turned.
                scene.instance("", edge);
                let map = DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0, 1.5, 0.7),
                    DQuat::from_axis_angle(random.vector().normalize(), random.unit() * 3.0),
                    random.vector(),
                );
                edge = edge.transform(scene.transform(map.into()));
            }
            scene.instance("", edge);
        }
        1 => {
            // The same triangles twice in a mesh, and the mesh twice in place.
            let mut data = random_mesh(random);
            let twice: Vec<[u32; 3]> = data
                .triangles
                .iter()
                .map(|[a, b, c]| [*b, *c, *a])
                .collect();
            data.triangles.extend(twice);
            let shape = scene.mesh("", &data);
            scene.instance("", Edge::shape(shape));
            scene.instance("", Edge::shape(shape));
        }
        2 => {
            for _ in 0..8 {
                let shape = random_shape(&mut scene, random);
                let axis = |r: &mut Random| libm::pow(10.0, r.unit() * 5.0);
                let stretch =
                    DAffine3::from_scale(DVec3::new(axis(random), axis(random), axis(random)));
                let turn = |r: &mut Random| {
                    DAffine3::from_axis_angle(r.vector().normalize(), r.unit() * 3.0)
                };
                let map = turn(random) * stretch * turn(random);
                let map = DAffine3::from_translation(random.vector() * 10.0) * map;
                let transform = scene.transform(map.into());
                scene.instance("", Edge::shape(shape).transform(transform));
            }
        }
        3 => {
            let away = DAffine3::from_translation(DVec3::new(1e4, -2e4, 3e4));
            for i in 0..12 {
                let shape = random_shape(&mut scene, random);
                let map = away * DAffine3::from_translation(random.vector() * 3.0);
                // Some of them with far vertices of their own.
                let edge = Edge::shape(shape);
                if i % 3 != 0 {
                    let transform = scene.transform(map.into());
                    scene.instance("", edge.transform(transform));
                } else {
                    let mut data = random_mesh(random);
                    for p in &mut data.positions {
                        *p = map.transform_point3(DVec3::from_array(*p)).to_array();
                    }
                    let far = scene.mesh("", &data);
                    scene.instance("", Edge::shape(far));
                }
            }
        }
        _ => {
            // Axis-parallel squares with round coordinates, sharing edges.
            let mut data = MeshData::default();
            for _ in 0..60 {
                let k = random.below(3) as usize;
                let at = [(); 3].map(|()| random.below(5) as f64 - 2.0);
                let first = data.positions.len() as u32;
                for (u, v) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                    let mut p = at;
                    p[(k + 1) % 3] += u;
                    p[(k + 2) % 3] += v;
                    data.positions.push(p);
                }
                data.triangles.push([first, first + 1, first + 2]);
                data.triangles.push([first, first + 2, first + 3]);
            }
            let shape = scene.mesh("", &data);
            scene.instance("", Edge::shape(shape));
        }
    }
    scene.finish().expect("a hard scene is a good scene")
}

/// Rays at points of a hard scene's shapes: any way, within a triangle's plane
/// or nearly, along an axis.
pub fn hard_rays(scene: &Scene, appearances: &Appearances, seed: u64, count: usize) -> RayColumns {
    let random = &mut Random(!seed);
    let mut rays = RayColumns::default();
    for _ in 0..count {
        let row = appearances.get(scene, random.below(appearances.count()));
        // A point of the shape, and two directions along its surface there.
        let (point, along) = match scene.shapes.row(row.shape) {
            Shape::Mesh(id) => {
                let mesh = scene.meshes.row(id);
                let i = random.below(mesh.triangles.len() as u64) as usize;
                let [a, b, c] = mesh
                    .corners(i)
                    .map(|c| DVec3::from_array(c.map(f64::from)) + mesh.center);
                let (u, v) = match random.below(3) {
                    0 => (0.5, 0.5),
                    _ => (random.unit().abs() * 0.5, random.unit().abs() * 0.5),
                };
                (a + (b - a) * u + (c - a) * v, [b - a, c - a])
            }
            _ => {
                let bounds = shape_bounds(scene, row.shape).expect("bounded");
                let half = bounds.extent() * 0.5;
                (
                    bounds.center() + random.vector() * half,
                    [half, random.vector() * half],
                )
            }
        };
        let map = &row.world_from_object;
        let point = DVec3::from_array(map.point(point.to_array()));
        let along = along.map(|d| DVec3::from_array(map.vector(d.to_array())));
        let within = along[0] * random.unit() + along[1] * random.unit();
        let aside = random.vector() * within.length();
        let dir = match random.below(4) {
            0 => aside,
            1 => within,
            2 => within + aside * 1e-6,
            _ => {
                let mut axis = DVec3::ZERO;
                axis[random.below(3) as usize] = random.unit();
                axis * within.length()
            }
        };
        let dir = dir.to_array().map(|x| x as f32);
        let wide = DVec3::from_array(dir.map(f64::from));
        if wide.length() > 0.0 {
            rays.push(point - wide * (1.0 + 9.0 * random.unit().abs()), dir);
        }
    }
    rays
}
