//! What shines in a scene: its lights, its sky, and the bodies of emissive materials, laid out
//! for light sampling, with the way back from a hit to the emitter that it lies on.

use super::textured_emitters::{MeanRadiance, TexturedEmitters};
use crate::light::emitter::{Body, Emitter, Emitters};
use crate::math::Affine;
use crate::scene::{
    Environment, Instances, Light, Material, MaterialId, MeshId, Rgb, Shape, Tables,
};
use glam::DVec3;
use std::collections::HashMap;

/// Bodies of more triangles than this are found by scattered rays alone.
const MOST_EMITTERS: usize = 4_000_000;

/// Scales along two directions differ by less than this where a ball stays a ball.
const BALL: f64 = 1e-12;

/// The lights, sky and luminous bodies of a scene.
#[derive(Debug)]
pub struct Luminaires {
    pub emitters: Emitters,
    owners: HashMap<u64, Owner>,
    /// The emitters that images vary.
    pub(super) textured: TexturedEmitters,
    /// The mean radiance of their triangles, for other times of the same scene.
    means: MeanRadiance,
    /// Number of luminous instances that light sampling cannot aim at: solids of other kinds
    /// than spheres, polygons and meshes. Scattered rays find them.
    pub unsampled: u64,
}

/// The emitters of an instance.
#[derive(Clone, Debug)]
enum Owner {
    One(u32),
    /// By triangle of the mesh; `u32::MAX` for those that do not shine.
    Triangles(Vec<u32>),
    /// Parts of a polygon: the first emitter, and the corners of each.
    Fan(u32, Vec<[DVec3; 3]>),
}

impl Luminaires {
    /// Lists what shines: `lights` and `environment` beside the scene's bodies.
    pub fn of(
        (scene, instances): (&Tables, &Instances),
        lights: &[Light],
        environment: Option<&Environment>,
    ) -> Luminaires {
        let all = Gathered::of((scene, instances), lights, MeanRadiance::default());
        Luminaires {
            emitters: Emitters::new(all.rows, environment, scene.background),
            owners: all.owners,
            textured: all.textured,
            means: all.means,
            unsampled: all.unsampled,
        }
    }

    /// Returns the luminaires of the same scene at another time, under the same sky; `None` if
    /// none has moved.
    pub fn at_time(
        &self,
        (before, instances_before): (&Tables, &Instances),
        (scene, instances): (&Tables, &Instances),
    ) -> Option<Luminaires> {
        let stays = |id: &u64| {
            let shape = instances.get(scene, *id).shape;
            if matches!(scene.shapes.row(shape), Shape::Mesh(mesh) if scene.deformations.has(mesh))
            {
                return false;
            }
            let [a, b] = [(before, instances_before), (scene, instances)];
            a.1.object_from_world(a.0, *id) == b.1.object_from_world(b.0, *id)
        };
        if before.lights == scene.lights && self.owners.keys().all(stays) {
            return None;
        }
        let all = Gathered::of((scene, instances), &scene.lights, self.means.clone());
        Some(Luminaires {
            emitters: self.emitters.under_same_sky(all.rows),
            owners: all.owners,
            textured: all.textured,
            means: all.means,
            unsampled: all.unsampled,
        })
    }

    /// Lists the emitters that are bodies of the scene, with their materials.
    pub fn materials(&self, scene: &Tables, instances: &Instances) -> Vec<(u32, MaterialId)> {
        let mut all = Vec::new();
        for (id, owner) in &self.owners {
            let instance = instances.get(scene, *id);
            let own = instance.material;
            match (owner, scene.shapes.row(instance.shape)) {
                (Owner::One(emitter), _) => all.extend(own.map(|m| (*emitter, m))),
                (Owner::Triangles(of), Shape::Mesh(mesh)) => {
                    let mesh = scene.meshes.row(mesh);
                    for (triangle, emitter) in of.iter().enumerate() {
                        let material = own.or_else(|| mesh.material(triangle as u32));
                        let some = material.filter(|_| *emitter != u32::MAX);
                        all.extend(some.map(|m| (*emitter, m)));
                    }
                }
                (Owner::Fan(first, parts), _) => {
                    let ids = (*first..).take(parts.len());
                    all.extend(own.iter().flat_map(|m| ids.clone().map(|id| (id, *m))));
                }
                _ => {}
            }
        }
        all
    }

    /// Returns a sky of radiance 1 and nothing else.
    pub fn white_sky() -> Luminaires {
        Luminaires {
            emitters: Emitters::new(Vec::new(), None, [1.0; 3]),
            owners: HashMap::new(),
            textured: TexturedEmitters::default(),
            means: MeanRadiance::default(),
            unsampled: 0,
        }
    }

    /// Returns the emitter that a hit lies on, `u32::MAX` if light sampling has none there.
    pub fn emitter_at(&self, instance: u64, primitive: u32, point: DVec3) -> u32 {
        match self.owners.get(&instance) {
            None => u32::MAX,
            Some(Owner::One(emitter)) => *emitter,
            Some(Owner::Triangles(of)) => of.get(primitive as usize).map_or(u32::MAX, |e| *e),
            Some(Owner::Fan(first, parts)) => (*first..)
                .zip(parts)
                .max_by(|a, b| depth_in(a.1, point).total_cmp(&depth_in(b.1, point)))
                .map_or(u32::MAX, |(emitter, _)| emitter),
        }
    }
}

/// Returns the least barycentric coordinate of a point in a triangle.
fn depth_in([a, b, c]: &[DVec3; 3], point: DVec3) -> f64 {
    let n = (b - a).cross(c - a);
    let area = |p: &DVec3, q: &DVec3| (p - point).cross(q - point).dot(n);
    area(a, b).min(area(b, c)).min(area(c, a)) / n.length_squared()
}

#[derive(Default)]
struct Gathered {
    rows: Vec<Emitter>,
    owners: HashMap<u64, Owner>,
    textured: TexturedEmitters,
    means: MeanRadiance,
    unsampled: u64,
}

impl Gathered {
    fn of(
        (scene, instances): (&Tables, &Instances),
        lights: &[Light],
        means: MeanRadiance,
    ) -> Gathered {
        let mut all = Gathered {
            means,
            ..Gathered::default()
        };
        all.rows.extend(lights.iter().map(Emitter::from));
        let shines = |material: &Material| material.sampled_emission() != [0.0; 3];
        let materials = &scene.materials.rows;
        if materials.iter().any(shines) && instances.check_enumerable().is_ok() {
            for (id, instance) in instances.iter(scene).enumerate() {
                let shape = scene.shapes.row(instance.shape);
                let place = &instance.world_from_object;
                all.add_instance(scene, id as u64, (shape, place), instance.material);
            }
        }
        all
    }

    fn add_instance(
        &mut self,
        scene: &Tables,
        id: u64,
        (shape, place): (Shape, &Affine),
        material: Option<MaterialId>,
    ) {
        let emission = |id: Option<MaterialId>| {
            let same = id.filter(|id| !scene.textures.varies_emission(*id));
            same.map_or([0.0; 3], |id| {
                scene.materials.rows[id.index()].sampled_emission()
            })
        };
        let own = emission(material);
        let first = self.rows.len() as u32;
        match shape {
            Shape::Mesh(mesh) => self.add_mesh(scene, (id, mesh), place, material, emission),
            _ if own == [0.0; 3] && !matches!(shape, Shape::Csg(_)) => {}
            Shape::Sphere(row) => {
                let sphere = scene.spheres.row(row);
                match scale_of(place) {
                    Some(scale) => {
                        self.push(
                            Body::Sphere {
                                center: at(place, sphere.center),
                                radius: sphere.radius * scale,
                            },
                            own,
                        );
                        self.owners.insert(id, Owner::One(first));
                    }
                    None => self.unsampled += 1,
                }
            }
            Shape::Polygon(row) => {
                let points = scene.polygons.row(row).points;
                self.add_polygon(id, points, place, own);
            }
            Shape::Csg(row) => {
                let parts = scene.csg.operands(row).iter();
                let mut parts = parts.map(|part| emission(part.material));
                let shines = own != [0.0; 3] || parts.any(|part| part != [0.0; 3]);
                self.unsampled += u64::from(shines);
            }
            _ => self.unsampled += 1,
        }
    }

    /// Adds the triangles of a mesh that shine; `emission` returns the radiance of a material that
    /// shines evenly.
    fn add_mesh(
        &mut self,
        scene: &Tables,
        (id, mesh_id): (u64, MeshId),
        place: &Affine,
        material: Option<MaterialId>,
        emission: impl Fn(Option<MaterialId>) -> Rgb,
    ) {
        let mesh = scene.meshes.row(mesh_id);
        let material = |triangle: u32| material.or_else(|| mesh.material(triangle));
        let attributes = scene.meshes.attributes.of(mesh_id);
        let varied = |triangle: u32| {
            material(triangle).filter(|id| {
                scene.textures.varies_emission(*id)
                    && scene.materials.rows[id.index()].sampled_emission() != [0.0; 3]
            })
        };
        let shines = |triangle: u32| {
            emission(material(triangle)) != [0.0; 3]
                || attributes.is_some() && varied(triangle).is_some()
        };
        let count = mesh.triangles.len() as u32;
        if !(0..count).any(shines) {
            return;
        }
        if self.rows.len() + count as usize > MOST_EMITTERS {
            self.unsampled += 1;
            return;
        }
        let corner = |vertex: u32| {
            let about = mesh.positions[vertex as usize].map(f64::from);
            at(place, DVec3::from_array(about) + mesh.center)
        };
        let mut emitters = vec![u32::MAX; count as usize];
        for (triangle, emitter) in (0..count).zip(&mut emitters) {
            let mut radiance = emission(material(triangle));
            let textured = attributes.zip(varied(triangle));
            if let Some((attributes, of)) = textured {
                let means = self.means.of(scene, (mesh_id, attributes), of, material);
                radiance = means[triangle as usize];
            }
            let corners = mesh.triangles[triangle as usize].map(corner);
            if radiance != [0.0; 3] && has_area(corners) {
                *emitter = self.rows.len() as u32;
                if let Some((attributes, of)) = textured {
                    self.textured.push(*emitter, of, (attributes, triangle));
                }
                self.push(Body::Triangle(corners), radiance);
            }
        }
        self.owners.insert(id, Owner::Triangles(emitters));
    }

    fn add_polygon(&mut self, id: u64, points: &[DVec3], place: &Affine, radiance: Rgb) {
        let first = self.rows.len() as u32;
        let corner = |i: usize| at(place, points[i]);
        if let &[a, b, c, d] = points {
            let [a, b, c, d] = [a, b, c, d].map(|p| at(place, p));
            let (u, v) = (b - a, d - a);
            let size = u.length() * v.length();
            let is_rectangle =
                (a + u + v - c).length() <= BALL * size.sqrt() && u.dot(v).abs() <= BALL * size;
            if is_rectangle {
                self.push(Body::Rectangle { corner: a, u, v }, radiance);
                self.owners.insert(id, Owner::One(first));
                return;
            }
        }
        if !is_convex(points) {
            self.unsampled += 1;
            return;
        }
        let parts = (1..points.len() - 1).map(|i| [corner(0), corner(i), corner(i + 1)]);
        let parts: Vec<[DVec3; 3]> = parts.filter(|corners| has_area(*corners)).collect();
        for corners in &parts {
            self.push(Body::Triangle(*corners), radiance);
        }
        self.owners.insert(id, Owner::Fan(first, parts));
    }

    fn push(&mut self, body: Body, radiance: Rgb) {
        self.rows.push(Emitter {
            body,
            light: radiance,
        });
    }
}

fn at(place: &Affine, p: DVec3) -> DVec3 {
    DVec3::from_array(place.point(p.to_array()))
}

/// Returns the factor of all lengths of a map that keeps angles, else nothing.
fn scale_of(place: &Affine) -> Option<f64> {
    let columns: [DVec3; 3] = std::array::from_fn(|k| {
        let mut axis = [0.0; 3];
        axis[k] = 1.0;
        DVec3::from_array(place.vector(axis))
    });
    let [x, y, z] = columns;
    let scale = x.length();
    let same = |v: DVec3| (v.length() - scale).abs() <= BALL * scale;
    let right = |u: DVec3, v: DVec3| u.dot(v).abs() <= BALL * scale * scale;
    (same(y) && same(z) && right(x, y) && right(y, z) && right(z, x)).then_some(scale)
}

fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let area = (b - a).cross(c - a).length_squared();
    area > 0.0 && area.is_finite()
}

/// Says whether a polygon turns one way at all its corners.
fn is_convex(points: &[DVec3]) -> bool {
    let n = points.len();
    let turn = |i: usize| {
        let [a, b, c] = [i, (i + 1) % n, (i + 2) % n].map(|i| points[i]);
        (b - a).cross(c - b)
    };
    let normal = (0..n).map(turn).sum::<DVec3>();
    (0..n).all(|i| turn(i).dot(normal) >= 0.0)
}
