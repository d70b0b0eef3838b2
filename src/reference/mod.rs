//! The judge: a scalar f64 ray tracer so plain that one believes it by reading.
//!
//! Textbook formulas, one (ray, primitive) pair at a time. It shares with the
//! fast path the tables and the definition of the object ray (DESIGN.md,
//! section 4), and no kernel, predicate or tree. Every decision carries a bound
//! on its own rounding error ([`approx`]). Triangles that f64 cannot settle are
//! decided and ordered in exact arithmetic; where rounding could turn any other
//! answer, [`Answer::perhaps`] lists all that exact arithmetic might say.
//!
//! Primitives are seen from both sides; a ray that starts inside a solid meets
//! its far side. Hits count where 0 < t < t_max. Where two are equally near, as
//! far as f64 can tell, the lower (instance, primitive) is the answer.
//!
//! [`Reference::new`] prunes by a median-split tree of its own;
//! [`Reference::brute_force`] looks at everything. tests/reference.rs compares.
//! Both lay all appearances out, and refuse scenes that have too many for it.
//! Beyond about 10^±75 squares of squares leave f64: all is doubt there.

pub mod approx;
mod bounds;
mod camera;
mod exact;
mod facet;
mod flat;
mod path;
mod ray;
mod roots;
mod round;
mod tree;

pub use camera::{Grid, WorldRay, camera_ray};
pub use path::{Shadow, shadow};
pub use ray::{Crossing, Ray};

use crate::scene::{Appearance, Appearances, MeshId, Scene, SceneError, Shape};
use approx::{Approx, Verdict};
use std::borrow::Cow;
use tree::Tree;

/// Placements worse conditioned than this stay out of the tree: their world
/// boxes would not be worth much.
const MAX_CONDITION: f64 = 1e8;

/// A scene to ask.
pub struct Reference<'a> {
    scene: &'a Scene,
    /// Appearances by id.
    rows: Cow<'a, [Appearance]>,
    /// Over `rows`; `None` for brute force.
    instances: Option<Tree>,
    /// Rows that are not in the tree.
    always: Vec<u32>,
    /// The worst condition of a placement in the tree.
    condition: f64,
    /// Over the triangles of each mesh, about its centre.
    triangles: Vec<Tree>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f64,
    /// Bound on the error of `t`.
    pub t_error: f64,
    /// Id of one of [`Appearances`].
    pub instance: u64,
    /// Triangle of a mesh; 0 otherwise.
    pub primitive: u32,
    /// Geometric, world space, unit, outward; of triangles and polygons by
    /// their winding. Zero where the surface has none (a cone's apex).
    pub normal: [f64; 3],
}

/// What a ray meets first.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// By plain f64; `None` is a miss.
    pub outcome: Option<Hit>,
    /// All that exact arithmetic may say, by id, a miss first; one alone if
    /// certain.
    pub perhaps: Vec<Option<Hit>>,
    /// More than one.
    pub doubt: bool,
}

impl<'a> Reference<'a> {
    /// With trees.
    pub fn new(
        scene: &'a Scene,
        appearances: &'a Appearances,
    ) -> Result<Reference<'a>, SceneError> {
        let all = Reference::brute_force(scene, appearances)?;
        let mut always = Vec::new();
        let mut boxes = Vec::new();
        let mut worst = 1.0;
        for (i, a) in all.rows.iter().enumerate() {
            let object = bounds::of_shape(scene, scene.shapes.row(a.shape));
            let condition = bounds::condition(a);
            let placed = object
                .filter(|_| condition <= MAX_CONDITION)
                .map(|b| bounds::placed(&b, a))
                .filter(|b| b.min.iter().chain(&b.max).all(|x| x.is_finite()));
            match placed {
                Some(b) => {
                    boxes.push((i as u32, b));
                    worst = f64::max(worst, condition);
                }
                None => always.push(i as u32),
            }
        }
        let triangles = (0..scene.meshes.len() as u32)
            .map(|id| {
                let mesh = scene.meshes.row(MeshId(id));
                let boxes: Vec<_> = (0..mesh.triangles.len())
                    .map(|i| (i as u32, bounds::of_triangle(&mesh, i)))
                    .collect();
                Tree::new(&boxes)
            })
            .collect();
        Ok(Reference {
            instances: Some(Tree::new(&boxes)),
            always,
            condition: worst,
            triangles,
            ..all
        })
    }

    /// Without trees: every ray against every primitive.
    pub fn brute_force(
        scene: &'a Scene,
        appearances: &'a Appearances,
    ) -> Result<Reference<'a>, SceneError> {
        let rows = appearances.laid_out(scene)?;
        Ok(Reference {
            scene,
            instances: None,
            always: (0..rows.len() as u32).collect(),
            rows,
            condition: 1.0,
            triangles: Vec::new(),
        })
    }

    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Of a hit.
    fn appearance(&self, hit: &Hit) -> &Appearance {
        &self.rows[hit.instance as usize]
    }

    /// The first hit with 0 < t < t_max of a world ray.
    pub fn nearest(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> Answer {
        let mut found: Vec<(u32, Crossing)> = Vec::new();
        // Nothing beyond this can be the nearest.
        let mut limit = t_max;
        self.visit(&Ray { org, dir }, t_max, |instance, crossing| {
            if crossing.exists.is_yes() {
                limit = f64::min(limit, crossing.t.hi());
            }
            if !crossing.t.certainly_above(limit) {
                found.push((instance, crossing));
            }
            limit
        });
        found.retain(|(_, c)| !c.t.certainly_above(limit));
        self.order_triangles(&Ray { org, dir }, t_max, &mut found);

        let hits = || found.iter().map(|(i, c)| (c.exists, self.hit(*i, c)));
        let holding = || hits().filter(|(e, _)| e.holds).map(|(_, hit)| hit);
        // Equally near within rounding is taken for equally near: faces that
        // coincide do.
        let reach = holding()
            .min_by(|a, b| a.t.total_cmp(&b.t))
            .map(|hit| hit.t + hit.t_error);
        let outcome = holding()
            .filter(|hit| reach.is_some_and(|reach| hit.t - hit.t_error <= reach))
            .min_by(|a, b| {
                let ids = |h: &Hit| (h.instance, h.primitive);
                ids(a).cmp(&ids(b)).then(a.t.total_cmp(&b.t))
            });
        let mut perhaps: Vec<Option<Hit>> = hits().map(|(_, hit)| Some(hit)).collect();
        // Whatever order a tree found them in.
        perhaps.sort_by(|a, b| {
            let key = |h: &Option<Hit>| h.map(|h| (h.instance, h.primitive));
            let t = |h: &Option<Hit>| h.map_or(0.0, |h| h.t);
            key(a).cmp(&key(b)).then(t(a).total_cmp(&t(b)))
        });
        if !found.iter().any(|(_, c)| c.exists.is_yes()) {
            perhaps.push(None);
        }
        Answer {
            outcome,
            doubt: perhaps.len() > 1,
            perhaps,
        }
    }

    /// Whether anything is met with 0 < t < t_max, and whether that is in doubt.
    pub fn blocked(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> (bool, bool) {
        let mut verdict = Verdict::NO;
        self.visit(&Ray { org, dir }, t_max, |_, crossing| {
            if crossing.exists.is_yes() {
                verdict = Verdict::YES;
            } else if !verdict.is_yes() {
                verdict.holds |= crossing.exists.holds;
                verdict.certain = false;
            }
            // One certain hit settles it.
            if verdict.is_yes() {
                f64::NEG_INFINITY
            } else {
                t_max
            }
        });
        (verdict.holds, !verdict.certain)
    }

    /// All crossings of one primitive with a world ray, in no order, certain or
    /// not, before and behind its origin. None for ids that do not exist.
    pub fn crossings(
        &self,
        org: [f64; 3],
        dir: [f64; 3],
        instance: u64,
        primitive: u32,
    ) -> Vec<Crossing> {
        let mut out = Vec::new();
        let Some(a) = self.rows.get(instance as usize) else {
            return out;
        };
        let ray = Ray { org, dir }.through(&a.object_from_world);
        match self.scene.shapes.row(a.shape) {
            Shape::Mesh(id) => {
                let mesh = self.scene.meshes.row(id);
                if (primitive as usize) < mesh.triangles.len() {
                    let corners = mesh.corners(primitive as usize).map(|p| p.map(f64::from));
                    let ray = ray.about(mesh.center.to_array());
                    facet::triangle(&ray, corners, primitive, &mut out);
                }
            }
            _ if primitive > 0 => {}
            shape => self.cross(&ray, shape, &mut out),
        }
        out
    }

    /// Where more than one answer is left, the nearest triangle is found by exact
    /// arithmetic, and the others go.
    fn order_triangles(&self, ray: &Ray, t_max: f64, found: &mut Vec<(u32, Crossing)>) {
        if found.iter().all(|(_, c)| c.exists.is_yes()) && found.len() < 2 {
            return;
        }
        let mut best: Option<(exact::Fraction, u32, Crossing)> = None;
        found.retain(|(instance, c)| {
            let a = &self.rows[*instance as usize];
            let Shape::Mesh(id) = self.scene.shapes.row(a.shape) else {
                return true;
            };
            let mesh = self.scene.meshes.row(id);
            let corners = mesh.corners(c.primitive as usize).map(|p| p.map(f64::from));
            let ray = ray.through(&a.object_from_world);
            let ray = ray.about(mesh.center.to_array());
            if !ray.org.iter().chain(&ray.dir).all(|x| x.is_finite()) {
                return true;
            }
            let Some(t) = exact::triangle(ray.org, ray.dir, corners) else {
                return false;
            };
            if t.compare_number(0.0).is_gt() && t.compare_number(t_max).is_lt() {
                let id = (*instance, c.primitive);
                let nearer = best.as_ref().is_none_or(|(least, i, b)| {
                    t.compare(least).then(id.cmp(&(*i, b.primitive))).is_lt()
                });
                if nearer {
                    let exists = Verdict::YES;
                    best = Some((t, *instance, Crossing { exists, ..*c }));
                }
            }
            false
        });
        if let Some((_, instance, crossing)) = best {
            found.retain(|(_, c)| !c.t.certainly_above(crossing.t.hi()));
            found.push((instance, crossing));
        }
    }

    fn hit(&self, instance: u32, crossing: &Crossing) -> Hit {
        let m = &self.rows[instance as usize].object_from_world;
        let n = crossing.normal;
        // By the inverse transpose of world_from_object.
        let normal = ray::unit(m.linear.map(|column| ray::dot(column, n)));
        Hit {
            t: crossing.t.value,
            t_error: crossing.t.error,
            instance: u64::from(instance),
            primitive: crossing.primitive,
            normal,
        }
    }

    /// Calls `found` for every crossing that may lie in 0 < t < t_max; it
    /// answers with the t beyond which nothing matters any more.
    fn visit(&self, ray: &Ray, t_max: f64, mut found: impl FnMut(u32, Crossing) -> f64) {
        let (zero, end) = (Approx::exact(0.0), Approx::exact(t_max));
        let mut limit = t_max;
        let mut crossings = Vec::new();
        let mut instance = |i: u32, mut limit: f64| {
            let a = &self.rows[i as usize];
            let ray = ray.through(&a.object_from_world);
            let mut settle = |crossings: &mut Vec<Crossing>, mut limit: f64| {
                for mut c in crossings.drain(..) {
                    c.exists = c.exists.and(zero.less(c.t)).and(c.t.less(end));
                    if !c.exists.is_no() {
                        limit = found(i, c);
                    }
                }
                limit
            };
            let Shape::Mesh(id) = self.scene.shapes.row(a.shape) else {
                self.cross(&ray, self.scene.shapes.row(a.shape), &mut crossings);
                return settle(&mut crossings, limit);
            };
            let mesh = self.scene.meshes.row(id);
            let ray = ray.about(mesh.center.to_array());
            let mut triangle = |k: u32, limit: f64| {
                let corners = mesh.corners(k as usize).map(|p| p.map(f64::from));
                facet::triangle(&ray, corners, k, &mut crossings);
                settle(&mut crossings, limit)
            };
            if let Some(tree) = self.triangles.get(id.index()) {
                let slack = bounds::slack(ray.org, 1.0);
                tree.visit(&ray, slack, limit, |k| {
                    limit = triangle(k, limit);
                    limit
                });
            } else {
                for k in 0..mesh.triangles.len() as u32 {
                    limit = triangle(k, limit);
                }
            }
            limit
        };
        for i in &self.always {
            limit = instance(*i, limit);
        }
        if let Some(tree) = &self.instances {
            let slack = bounds::slack(ray.org, self.condition);
            tree.visit(ray, slack, limit, |i| {
                limit = instance(i, limit);
                limit
            });
        }
    }

    /// Everything but meshes.
    fn cross(&self, ray: &Ray, shape: Shape, out: &mut Vec<Crossing>) {
        let scene = self.scene;
        let arrays = |points: &[glam::DVec3]| -> Vec<[f64; 3]> {
            points.iter().map(|p| p.to_array()).collect()
        };
        match shape {
            Shape::HalfSpace(id) => flat::half_space(ray, &scene.half_spaces.row(id), out),
            Shape::Sphere(id) => round::sphere(ray, &scene.spheres.row(id), out),
            Shape::Ellipsoid(id) => round::ellipsoid(ray, &scene.ellipsoids.row(id), out),
            Shape::Cylinder(id) => round::cylinder(ray, &scene.cylinders.row(id), out),
            Shape::Cone(id) => round::cone(ray, &scene.cones.row(id), out),
            Shape::Cuboid(id) => flat::cuboid(ray, &scene.cuboids.row(id), out),
            Shape::Polyhedron(id) => {
                let points = arrays(scene.polyhedra.points(id));
                flat::polyhedron(ray, scene.polyhedra.planes(id), &points, out);
            }
            Shape::Polygon(id) => {
                facet::polygon(ray, &arrays(scene.polygons.points(id)), out);
            }
            Shape::Mesh(_) => {}
        }
    }
}
