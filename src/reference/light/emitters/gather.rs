//! The list of a scene's emitters: its lights, then luminous instances in the order of their
//! ids, of which spheres, polygons and meshes can be sampled.

use super::super::bsdf::Color;
use super::clusters::Cluster;
use super::{Ball, Bounds, Emitter, Emitters, FEW, Kind, Light, Rectangle, SkyMap, Sun, Tree};
use crate::math::Affine;
use crate::scene::{Environment, Falloff, Instance, MaterialId, Scene, Shape};
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// How far a map may be from one that keeps angles, and a polygon from a rectangle.
const SIMILAR: f64 = 1e-12;

/// More emitters with a place than this are refused: each choice looks at many of them.
const MOST: usize = 4096;

/// The emitters of an instance, by place in the list.
pub enum Owner {
    One(usize),
    /// By triangle.
    Mesh(Vec<Option<usize>>),
    /// The triangles of a polygon's fan.
    Fan(Vec<usize>),
}

impl Emitters {
    /// Lists what shines; names what cannot be listed.
    pub fn new(
        scene: &Scene,
        rows: &[Instance],
        lights: &[Light],
        environment: Option<&Environment>,
    ) -> Result<Emitters, &'static str> {
        let is_flat = |light: &Light| matches!(light, Light::Rectangle { .. } | Light::Disc { .. });
        if lights.iter().any(is_flat) {
            return Err("rectangles and discs of light");
        }
        // A sky of one radiance is found by scattered rays alone.
        let uniform = environment.and_then(Environment::uniform_radiance);
        let environment = environment.filter(|_| uniform.is_none());
        let mut all = Emitters {
            near: Vec::new(),
            tree: None,
            suns: Vec::new(),
            background: uniform.unwrap_or(scene.background).map(f64::from),
            map: environment.map(SkyMap::new),
            owners: HashMap::new(),
        };
        for light in lights {
            all.add_light(light);
        }
        for (id, row) in rows.iter().enumerate() {
            all.add_instance(scene, id as u64, row);
        }
        if all.near.len() > MOST {
            return Err("more than 4096 emitters");
        }
        if all.near.len() > FEW {
            let clusters: Vec<Cluster> = all.near.iter().map(Cluster::new).collect();
            all.tree = Some(Tree::new(&clusters));
        }
        Ok(all)
    }

    /// Returns the emitter that a hit lies on.
    pub(super) fn owner(&self, instance: u64, primitive: u32, point: DVec3) -> Option<usize> {
        match self.owners.get(&instance)? {
            Owner::One(emitter) => Some(*emitter),
            Owner::Mesh(of) => of[primitive as usize],
            Owner::Fan(parts) => {
                let depth = |k: &usize| match self.near[*k].kind {
                    Kind::Triangle(corners) => least_weight(corners, point),
                    _ => f64::NEG_INFINITY,
                };
                let best = |a: &&usize, b: &&usize| depth(a).total_cmp(&depth(b));
                parts.iter().max_by(best).copied()
            }
        }
    }

    fn add_light(&mut self, light: &Light) {
        let color = |c: [f32; 3]| c.map(|x| f64::from(x).max(0.0));
        match *light {
            Light::Directional {
                direction,
                irradiance,
                angle,
            } => {
                let irradiance = color(irradiance);
                if irradiance != [0.0; 3] {
                    self.suns.push(Sun {
                        towards: -direction.normalize(),
                        versine: 2.0 * libm::sin(angle / 2.0).powi(2),
                        irradiance,
                    });
                }
            }
            Light::Point {
                position,
                intensity,
                falloff,
                radius,
            } => self.add_lamp(
                (position, radius, color(intensity)),
                (DVec3::ZERO, None),
                falloff == Falloff::None,
            ),
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                radius,
            } => {
                // KHR_lights_punctual: scale = 1/max(0.001, cos inner − cos outer).
                let scale = 1.0 / (libm::cos(inner) - libm::cos(outer)).max(1e-3);
                let ramp = [scale, -libm::cos(outer) * scale];
                self.add_lamp(
                    (position, radius, color(intensity)),
                    (direction.normalize(), Some(ramp)),
                    false,
                );
            }
            Light::Rectangle { .. } | Light::Disc { .. } => {}
        }
    }

    fn add_lamp(
        &mut self,
        (center, radius, light): (DVec3, f64, Color),
        (axis, ramp): (DVec3, Option<[f64; 2]>),
        constant: bool,
    ) {
        let kind = Kind::Lamp {
            ball: Ball { center, radius },
            ramp,
            constant,
        };
        let bounds = Bounds {
            center,
            radius,
            low: center - radius,
            high: center + radius,
            axis,
            power: 1.0,
        };
        self.push(kind, light, bounds);
    }

    /// Appends an emitter unless it is black; `bounds.power` comes as an area.
    fn push(&mut self, kind: Kind, light: Color, bounds: Bounds) -> Option<usize> {
        if light == [0.0; 3] {
            return None;
        }
        let mean = light.iter().sum::<f64>() / 3.0;
        let bounds = Bounds {
            power: (mean * bounds.power).clamp(1e-30, 1e30),
            ..bounds
        };
        self.near.push(Emitter {
            kind,
            light,
            bounds,
        });
        Some(self.near.len() - 1)
    }

    fn add_instance(&mut self, scene: &Scene, id: u64, row: &Instance) {
        let emission = |id: Option<MaterialId>| {
            id.map_or([0.0; 3], |id| {
                scene.materials.rows[id.index()]
                    .sampled_emission()
                    .map(f64::from)
            })
        };
        let own = emission(row.material);
        let place = &row.world_from_object;
        let owner = match scene.shapes.row(row.shape) {
            Shape::Mesh(mesh) => {
                let mesh = scene.meshes.row(mesh);
                let corner = |i: u32| {
                    let p = mesh.positions[i as usize].map(f64::from);
                    at(place, DVec3::from_array(p) + mesh.center)
                };
                let of = |k: usize| {
                    let light = emission(row.material.or_else(|| mesh.material(k as u32)));
                    self.add_triangle(mesh.triangles[k].map(corner), light)
                };
                Owner::Mesh((0..mesh.triangles.len()).map(of).collect())
            }
            _ if own == [0.0; 3] => return,
            Shape::Sphere(sphere) => {
                let sphere = scene.spheres.row(sphere);
                let Some(scale) = similarity(place) else {
                    return;
                };
                let (center, radius) = (at(place, sphere.center), sphere.radius * scale);
                let bounds = Bounds {
                    center,
                    radius,
                    low: center - radius,
                    high: center + radius,
                    axis: DVec3::ZERO,
                    power: PI * radius * radius,
                };
                match self.push(Kind::Sphere(Ball { center, radius }), own, bounds) {
                    Some(k) => Owner::One(k),
                    None => return,
                }
            }
            Shape::Polygon(polygon) => {
                let points = scene.polygons.row(polygon).points;
                let placed: Vec<DVec3> = points.iter().map(|p| at(place, *p)).collect();
                match rectangle(&placed) {
                    Some((rectangle, bounds)) => {
                        match self.push(Kind::Rectangle(rectangle), own, bounds) {
                            Some(k) => Owner::One(k),
                            None => return,
                        }
                    }
                    None if is_convex(points) => {
                        let parts = 1..placed.len() - 1;
                        let parts = parts.map(|i| [placed[0], placed[i], placed[i + 1]]);
                        Owner::Fan(parts.filter_map(|c| self.add_triangle(c, own)).collect())
                    }
                    None => return,
                }
            }
            _ => return,
        };
        self.owners.insert(id, owner);
    }

    fn add_triangle(&mut self, corners: [DVec3; 3], light: Color) -> Option<usize> {
        let [a, b, c] = corners;
        let n = (b - a).cross(c - a);
        if n.length() == 0.0 {
            return None;
        }
        let center = (a + b + c) / 3.0;
        let radius = corners.map(|p| p.distance(center));
        let bounds = Bounds {
            center,
            radius: radius.into_iter().fold(0.0, f64::max),
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            axis: n.normalize(),
            power: 0.5 * n.length(),
        };
        self.push(Kind::Triangle(corners), light, bounds)
    }
}

fn at(place: &Affine, p: DVec3) -> DVec3 {
    DVec3::from_array(place.point(p.to_array()))
}

/// Returns the factor of lengths of a map that keeps angles.
fn similarity(place: &Affine) -> Option<f64> {
    let [x, y, z] = place.linear().map(DVec3::from_array);
    let scale = x.length();
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * scale.max(b);
    let same = near(y.length(), x.length()) && near(z.length(), x.length());
    let right = [x.dot(y), y.dot(z), z.dot(x)];
    let right = right.iter().all(|d| d.abs() <= 1e-9 * scale * scale);
    (same && right).then_some(scale)
}

fn rectangle(points: &[DVec3]) -> Option<(Rectangle, Bounds)> {
    let &[a, b, c, d] = points else {
        return None;
    };
    let (u, v) = (b - a, d - a);
    let lengths = [u.length(), v.length()];
    let size = lengths[0] * lengths[1];
    let closes = (a + u + v - c).length() <= SIMILAR * size.sqrt();
    if !closes || u.dot(v).abs() > SIMILAR * size {
        return None;
    }
    let edges = [u / lengths[0], v / lengths[1]];
    let corners = [a + u, a + v, a + u + v];
    let bounds = Bounds {
        center: a + (u + v) / 2.0,
        radius: (u + v).length() / 2.0,
        low: corners.into_iter().fold(a, DVec3::min),
        high: corners.into_iter().fold(a, DVec3::max),
        axis: edges[0].cross(edges[1]).normalize(),
        power: size,
    };
    let rectangle = Rectangle {
        corner: a,
        edges,
        lengths,
    };
    Some((rectangle, bounds))
}

fn is_convex(points: &[DVec3]) -> bool {
    let n = points.len();
    let turn = |i: usize| {
        let [a, b, c] = [i, i + 1, i + 2].map(|i| points[i % n]);
        (b - a).cross(c - b)
    };
    let normal: DVec3 = (0..n).map(turn).sum();
    (0..n).all(|i| turn(i).dot(normal) >= 0.0)
}

/// Returns the least barycentric coordinate of a point.
fn least_weight([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let n = (b - a).cross(c - a);
    let area = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(n);
    area(a, b).min(area(b, c)).min(area(c, a)) / n.length_squared()
}
