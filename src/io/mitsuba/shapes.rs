//! Instances: one shape each, or one for each material of a mesh.

use super::looks::escaped;
use super::{NO_MATERIAL, Writer, frame, list, number, rgb, to_world};
use crate::geom::HalfSpace;
use crate::math::Affine;
use crate::scene::{Instance, MaterialId, MeshId, PolygonId, PolyhedronId, Shape};
use crate::shared::triangulate::Triangulator;
use crate::shared::write_ply::{PlyMesh, encode};
use glam::DVec3;
use std::fmt::Write;

/// What a PLY file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum MeshKey {
    Whole(u32),
    /// The triangles of a mesh that have this material of their own, or none.
    Part(u32, Option<u32>),
    Polygon(u32),
    Polyhedron(u32),
}

impl Writer<'_> {
    pub(super) fn instance(&mut self, instance: &Instance) {
        let scene = self.scene;
        let map = &instance.world_from_object;
        let material = instance.material;
        match scene.shapes.row(instance.shape) {
            Shape::Sphere(id) => {
                let sphere = scene.spheres.row(id);
                match similarity(map) {
                    Some(scale) => {
                        self.sphere(point(map, sphere.center), sphere.radius * scale, material)
                    }
                    None => self.notes.missing("sphere that its transform deforms"),
                }
            }
            Shape::Cuboid(id) => {
                let cuboid = scene.cuboids.row(id);
                let half = (cuboid.max - cuboid.min) * 0.5;
                let unit = frame(
                    DVec3::X * half.x,
                    DVec3::Y * half.y,
                    DVec3::Z * half.z,
                    (cuboid.min + cuboid.max) * 0.5,
                );
                let flip = is_mirrored(map);
                self.shape("cube", &to_world(&map.then_after(&unit)), flip, material);
            }
            Shape::Cylinder(id) => {
                let row = scene.cylinders.row(id);
                match similarity(map) {
                    Some(scale) => {
                        let (base, top) = (point(map, row.base), point(map, row.top));
                        self.cylinder(base, top, row.radius * scale, row.open, material);
                    }
                    None => self.notes.missing("cylinder that its transform deforms"),
                }
            }
            Shape::HalfSpace(id) => self.half_space(&scene.half_spaces.row(id), instance),
            Shape::Polygon(id) => self.polygon(id, instance),
            Shape::Polyhedron(id) => self.polyhedron(id, instance),
            Shape::Mesh(id) => self.mesh(id, instance),
            other => self.notes.missing(other.kind_name()),
        }
    }

    /// Writes a shape of some type: its parameters, its material, and what it emits.
    fn shape(&mut self, kind: &str, parameters: &str, flip: bool, material: Option<MaterialId>) {
        let name = match material {
            Some(id) => format!("material_{}", id.0),
            None => NO_MATERIAL.into(),
        };
        let flip = match flip {
            true => "<boolean name=\"flip_normals\" value=\"true\"/>",
            false => "",
        };
        let emission = self.emission(material);
        let emitter = match emission == [0.0; 3] {
            true => String::new(),
            false => format!(
                "<emitter type=\"area\"><rgb name=\"radiance\" value=\"{}\"/></emitter>",
                rgb(emission)
            ),
        };
        let _ = writeln!(
            self.xml,
            "  <shape type=\"{kind}\">{parameters}{flip}<ref id=\"{name}\"/>{emitter}</shape>"
        );
    }

    fn emission(&self, material: Option<MaterialId>) -> [f32; 3] {
        let row = material.map(|id| self.scene.materials.rows[id.index()]);
        row.map_or([0.0; 3], |row| row.emission)
    }

    /// Whether a flat shape through `at` with this normal shines away from the middle of the
    /// scene and must be turned round.
    fn turns_away(&mut self, at: DVec3, normal: DVec3, material: Option<MaterialId>) -> bool {
        if self.emission(material) == [0.0; 3] {
            return false;
        }
        self.notes.similar("flat light, which shines on one side");
        normal.dot(self.middle - at) < 0.0
    }

    fn sphere(&mut self, center: DVec3, radius: f64, material: Option<MaterialId>) {
        let parameters = format!(
            "<point name=\"center\" value=\"{}\"/><float name=\"radius\" value=\"{}\"/>",
            list(&center.to_array()),
            number(radius)
        );
        self.shape("sphere", &parameters, false, material);
    }

    fn cylinder(
        &mut self,
        base: DVec3,
        top: DVec3,
        radius: f64,
        open: bool,
        material: Option<MaterialId>,
    ) {
        let parameters = format!(
            "<point name=\"p0\" value=\"{}\"/><point name=\"p1\" value=\"{}\"/>\
             <float name=\"radius\" value=\"{}\"/>",
            list(&base.to_array()),
            list(&top.to_array()),
            number(radius)
        );
        self.shape("cylinder", &parameters, false, material);
        let axis = (top - base).normalize();
        for (center, normal) in [(base, -axis), (top, axis)] {
            if !open {
                let (u, v) = normal.any_orthonormal_pair();
                let cap = frame(u * radius, v * radius, normal, center);
                self.shape("disk", &to_world(&cap), false, material);
            }
        }
    }

    fn half_space(&mut self, row: &HalfSpace, instance: &Instance) {
        let foot = row.normal * (row.offset / row.normal.length_squared());
        let at = point(&instance.world_from_object, foot);
        let normal = instance
            .object_from_world
            .transposed_vector(row.normal.to_array());
        let normal = DVec3::from_array(normal).normalize();
        // Below the middle of the scene, and so large that its rim is hardly seen.
        let center = self.middle - normal * normal.dot(self.middle - at);
        let side = 1000.0 * (self.reach + (center - self.middle).length());
        let (u, v) = normal.any_orthonormal_pair();
        self.notes.similar("half-space, as a square");
        let square = frame(u * side, v * side, normal, center);
        self.shape("rectangle", &to_world(&square), false, instance.material);
    }

    fn polygon(&mut self, id: PolygonId, instance: &Instance) {
        let map = &instance.world_from_object;
        let points = self.scene.polygons.points(id);
        let world: Vec<DVec3> = points.iter().map(|p| point(map, *p)).collect();
        let at = world.iter().sum::<DVec3>() / world.len() as f64;
        let normal = area_vector(&world);
        let away = self.turns_away(at, normal, instance.material);
        if let Some((u, v)) = rectangle(&world) {
            let (u, v) = if away { (v, u) } else { (u, v) };
            let square = frame(u, v, u.cross(v).normalize(), at);
            self.shape("rectangle", &to_world(&square), false, instance.material);
            return;
        }
        let key = MeshKey::Polygon(id.0);
        let file = self.file(key, || {
            let positions: Vec<[f32; 3]> = points.iter().map(|p| single(*p)).collect();
            let mut triangles = Vec::new();
            Triangulator::new().split(points, |triangle| triangles.push(triangle));
            encode(&PlyMesh {
                positions: &positions,
                triangles: &triangles,
                ..PlyMesh::default()
            })
        });
        let flip = away != is_mirrored(map);
        self.ply(file, map, false, flip, instance.material);
    }

    fn polyhedron(&mut self, id: PolyhedronId, instance: &Instance) {
        let (planes, points) = (
            self.scene.polyhedra.planes(id),
            self.scene.polyhedra.points(id),
        );
        let file = self.file(MeshKey::Polyhedron(id.0), || {
            let positions: Vec<[f32; 3]> = points.iter().map(|p| single(*p)).collect();
            let triangles: Vec<[u32; 3]> = planes
                .iter()
                .flat_map(|plane| {
                    let corners = corners_of(plane, points);
                    (2..corners.len())
                        .map(|i| [corners[0], corners[i - 1], corners[i]])
                        .collect::<Vec<_>>()
                })
                .collect();
            encode(&PlyMesh {
                positions: &positions,
                triangles: &triangles,
                ..PlyMesh::default()
            })
        });
        let map = &instance.world_from_object;
        self.ply(file, map, false, is_mirrored(map), instance.material);
    }

    fn mesh(&mut self, id: MeshId, instance: &Instance) {
        let mesh = self.scene.meshes.row(id);
        let map = instance.world_from_object.then_after(&Affine::new(
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            mesh.center.to_array(),
        ));
        let encoded = |triangles: &[[u32; 3]]| {
            encode(&PlyMesh {
                positions: mesh.positions,
                normals: mesh.normals,
                triangles,
                ..PlyMesh::default()
            })
        };
        let smooth = mesh.normals.is_some();
        let parts: Vec<(MeshKey, Option<MaterialId>)> = match instance.material {
            Some(material) => vec![(MeshKey::Whole(id.0), Some(material))],
            None if mesh.parts.is_empty() => vec![(MeshKey::Whole(id.0), None)],
            None => {
                let rows = 0..mesh.triangles.len() as u32;
                let mut materials: Vec<Option<u32>> =
                    rows.map(|t| mesh.material(t).map(|m| m.0)).collect();
                materials.sort_unstable();
                materials.dedup();
                materials
                    .into_iter()
                    .map(|m| (MeshKey::Part(id.0, m), m.map(MaterialId)))
                    .collect()
            }
        };
        for (key, material) in parts {
            let file = self.file(key, || match key {
                MeshKey::Part(_, wanted) => {
                    let rows = 0..mesh.triangles.len() as u32;
                    let chosen: Vec<[u32; 3]> = rows
                        .filter(|t| mesh.material(*t).map(|m| m.0) == wanted)
                        .map(|t| mesh.triangles[t as usize])
                        .collect();
                    encoded(&chosen)
                }
                _ => encoded(mesh.triangles),
            });
            if mesh.open && self.emission(material) != [0.0; 3] {
                self.notes.similar("open mesh, which shines on one side");
            }
            self.ply(file, &map, smooth, is_mirrored(&map), material);
        }
    }

    /// Returns the name of the file for a key, which is made once.
    fn file(&mut self, key: MeshKey, encode: impl FnOnce() -> Vec<u8>) -> String {
        let next = self.files.len();
        let row = *self.meshes.entry(key).or_insert(next);
        if row == next {
            let name = format!("{}_mesh_{}.ply", self.stem, self.meshes.len() - 1);
            self.files.push((name, encode()));
        }
        self.files[row].0.clone()
    }

    fn ply(
        &mut self,
        file: String,
        map: &Affine,
        smooth: bool,
        flip: bool,
        material: Option<MaterialId>,
    ) {
        let flat = match smooth {
            true => "",
            false => "<boolean name=\"face_normals\" value=\"true\"/>",
        };
        let parameters = format!(
            "<string name=\"filename\" value=\"{}\"/>{flat}{}",
            escaped(&file),
            to_world(map)
        );
        self.shape("ply", &parameters, flip, material);
    }
}

fn point(map: &Affine, p: DVec3) -> DVec3 {
    DVec3::from_array(map.point(p.to_array()))
}

fn single(p: DVec3) -> [f32; 3] {
    p.to_array().map(|x| x as f32)
}

fn columns(map: &Affine) -> [DVec3; 3] {
    map.linear().map(DVec3::from_array)
}

fn is_mirrored(map: &Affine) -> bool {
    let [x, y, z] = columns(map);
    x.cross(y).dot(z) < 0.0
}

/// Returns the scale of a map that keeps angles, within 1e-9; `None` for others.
fn similarity(map: &Affine) -> Option<f64> {
    let [x, y, z] = columns(map);
    let square = x.length_squared();
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * square;
    let is = near(y.length_squared(), square)
        && near(z.length_squared(), square)
        && near(x.dot(y), 0.0)
        && near(y.dot(z), 0.0)
        && near(z.dot(x), 0.0);
    is.then(|| square.sqrt())
}

/// Returns twice the area of a planar polygon, along its normal (Newell's formula).
fn area_vector(points: &[DVec3]) -> DVec3 {
    let first = points[0];
    let sides = points.windows(2);
    sides
        .map(|side| (side[0] - first).cross(side[1] - first))
        .sum()
}

/// Returns the half sides of four corners that make a rectangle, within 1e-9 of its size.
fn rectangle(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let [a, b, c, d] = *points else { return None };
    let (u, v) = ((b - a) * 0.5, (d - a) * 0.5);
    let size = u.length_squared().max(v.length_squared());
    let closes = (a + c - b - d).length_squared() <= 1e-18 * size;
    let is_right = u.dot(v).abs() <= 1e-9 * size;
    (closes && is_right && u.cross(v).length_squared() > 0.0).then_some((u, v))
}

/// Returns the corners of a convex solid on one of its planes, counter-clockwise seen from
/// outside.
fn corners_of(plane: &HalfSpace, points: &[DVec3]) -> Vec<u32> {
    let normal = plane.normal.normalize();
    let offset = plane.offset / plane.normal.length();
    let size = points.iter().map(|p| p.length()).fold(0.0, f64::max);
    let near = |p: &DVec3| (normal.dot(*p) - offset).abs() <= 1e-9 * size;
    let mut rows: Vec<u32> = (0..points.len() as u32)
        .filter(|i| near(&points[*i as usize]))
        .collect();
    let sum: DVec3 = rows.iter().map(|i| points[*i as usize]).sum();
    let middle = sum / rows.len().max(1) as f64;
    let (u, v) = normal.any_orthonormal_pair();
    let angle = |i: &u32| {
        let p = points[*i as usize] - middle;
        libm::atan2(p.dot(v), p.dot(u))
    };
    rows.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    rows
}
