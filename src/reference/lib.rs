//! The judge: a ray tracer so plain that one believes it by reading, and exact.
//!
//! Textbook formulas, one (ray, primitive) pair at a time. It shares with the
//! fast path the tables and the definition of the object ray (docs/NUMERICS.md),
//! and no kernel, predicate, integer or tree. Formulas are written once and
//! worked out in f64 with a bound on the error ([`approx`]); where that leaves a
//! sign open, in integers of any length ([`dyadic`]). So every decision, whether
//! a ray hits and what first, is that of exact arithmetic, and every t the f64
//! nearest to the exact one. Polynomial surfaces are met by integers alone
//! (`algebraic`).
//!
//! Primitives are seen from both sides; a ray that starts inside a solid meets
//! its far side. Combinations are worked out along the whole line
//! (`combination`). Hits count where 0 < t < t_max. Where two are equally near,
//! the lower (instance, primitive) is the answer.
//!
//! [`Reference::new`] prunes by a median-split tree of its own;
//! [`Reference::brute_force`] looks at everything. tests/reference.rs compares.
//! Both lay all appearances out, and refuse scenes that have too many for it.
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

use lanecast_model::{geom, scene};
use lanecast_numerics::math;

mod algebraic;
pub mod approx;
mod bounds;
mod camera;
mod combination;
pub mod dyadic;
mod facet;
mod implicit;
mod kinds;
mod level_set;
mod meet;
pub mod number;
mod path;
mod polynomial;
mod ray;
pub mod root;
mod rounding;
mod slack;
mod solids;
mod surd;
mod tree;

pub use camera::{Grid, WorldRay, camera_ray};
pub use combination::TURNED;
pub use path::{Shadow, shadow};
pub use ray::Ray;

use crate::scene::{Appearance, Appearances, MeshId, Scene, SceneError, Shape};
use combination::Combination;
use dyadic::Dyadic;
use meet::{Primitive, Within};
use solids::Meeting;
use std::borrow::Cow;
use std::sync::Arc;
use tree::{Part, Tree};

/// Placements worse conditioned than this stay out of the tree: their world
/// boxes would not be worth much.
const MAX_CONDITION: f64 = 1e8;

/// A scene to ask.
pub struct Reference<'a> {
    scene: &'a Scene,
    /// Appearances by id.
    rows: Cow<'a, [Appearance]>,
    /// Over `rows`.
    tree: Tree,
    /// Rows that are in no tree.
    always: Vec<u32>,
    /// The worst condition of a placement in the tree.
    condition: f64,
    /// Of those that appear, by row of the scene's table.
    combinations: Vec<Option<Combination>>,
    /// Over the triangles of each mesh, about its centre; none for brute force.
    triangles: Arc<[Tree]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The f64 nearest to the exact one.
    pub t: f64,
    /// Id of one of [`Appearances`].
    pub instance: u64,
    /// Triangle of a mesh; surface of a combination, by number, and [`TURNED`]; 0
    /// otherwise.
    pub primitive: u32,
    /// Geometric, world space, unit, outward (of a combination: of the whole); of triangles and polygons by
    /// their winding. Zero where the surface has none (a cone's apex, a node).
    pub normal: [f64; 3],
}

/// One place where a line meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    pub t: f64,
    /// As hits have it.
    pub primitive: u32,
    /// World space, unit, outward.
    pub normal: [f64; 3],
}

/// A primitive that may be the first, and where it is met.
struct Candidate {
    instance: u32,
    primitive: u32,
    within: Within,
}

impl<'a> Reference<'a> {
    /// With trees.
    pub fn new(
        scene: &'a Scene,
        appearances: &'a Appearances,
    ) -> Result<Reference<'a>, SceneError> {
        let mut all = Reference::brute_force(scene, appearances)?;
        let mut always = Vec::new();
        let mut boxes = Vec::new();
        let mut worst = 1.0;
        for (i, a) in all.rows.iter().enumerate() {
            let shape = scene.shapes.row(a.shape);
            let (to, from) = (&a.world_from_object, &a.object_from_world);
            let mut condition = bounds::condition(to, from);
            let object = match all.combination(shape) {
                Some(combination) => {
                    condition *= combination.condition;
                    combination.bounds
                }
                None => kinds::of_shape(scene, shape),
            };
            let placed = object
                .filter(|_| condition <= MAX_CONDITION)
                .map(|b| bounds::placed(&b, to, from))
                .filter(|b| b.min.iter().chain(&b.max).all(|x| x.is_finite()));
            match placed {
                Some(b) => {
                    boxes.push((i as u32, b));
                    worst = f64::max(worst, condition);
                }
                None => always.push(i as u32),
            }
        }
        let triangles: Arc<[Tree]> = (0..scene.meshes.len() as u32)
            .map(|id| {
                let mesh = scene.meshes.row(MeshId(id));
                let boxes: Vec<_> = (0..mesh.triangles.len())
                    .map(|i| (i as u32, bounds::of_triangle(&mesh, i)))
                    .collect();
                Tree::new(&boxes)
            })
            .collect();
        for combination in all.combinations.iter_mut().flatten() {
            combination.triangles = triangles.clone();
        }
        Ok(Reference {
            tree: Tree::new(&boxes),
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
        let mut combinations = vec![None; scene.combinations.len()];
        for row in rows.iter() {
            if let Shape::Combination(id) = scene.shapes.row(row.shape) {
                let of = || Combination::new(scene, id);
                combinations[id.index()].get_or_insert_with(of);
            }
        }
        Ok(Reference {
            scene,
            combinations,
            tree: Tree::default(),
            always: (0..rows.len() as u32).collect(),
            rows,
            condition: 1.0,
            triangles: Arc::default(),
        })
    }

    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// What kind of shape an instance is; none for ids that do not exist.
    pub fn kind(&self, instance: u64) -> Option<&'static str> {
        let row = self.rows.get(usize::try_from(instance).ok()?)?;
        Some(self.scene.shapes.row(row.shape).kind_name())
    }

    fn combination(&self, shape: Shape) -> Option<&Combination> {
        match shape {
            Shape::Combination(id) => self.combinations[id.index()].as_ref(),
            _ => None,
        }
    }

    /// How many times a rounding counts on the other side of a hit's placement.
    fn condition_of(&self, hit: &Hit) -> f64 {
        let a = &self.rows[hit.instance as usize];
        let own = bounds::condition(&a.world_from_object, &a.object_from_world);
        let combination = self.combination(self.scene.shapes.row(a.shape));
        own * combination.map_or(1.0, |c| c.condition)
    }

    /// The first hit with 0 < t < t_max of a world ray.
    pub fn nearest(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> Option<Hit> {
        let level = 0.0;
        self.nearest_of(Ray { org, dir, level }, t_max)
    }

    /// The same, where functions that are no polynomials are shifted by `level` times what
    /// f64 may have them off by: where that makes a difference, the answer is not certain.
    pub fn nearest_of(&self, world: Ray, t_max: f64) -> Option<Hit> {
        let mut found: Vec<Candidate> = Vec::new();
        // Nothing beyond this can be the nearest.
        let mut limit = t_max;
        self.visit(&world, t_max, |candidate| {
            limit = f64::min(limit, candidate.within.hi);
            found.push(candidate);
            limit
        });
        found.retain(|c| c.within.lo <= limit);
        let exact = |c: &Candidate| {
            let (ray, primitive) = self.pair(&world, c.instance, c.primitive);
            primitive.first_exactly(&ray, t_max)
        };
        // In the order of their ids, so that the first of equal ones stays.
        found.sort_by_key(|c| (c.instance, c.primitive));
        let mut first: Option<(Meeting<Dyadic>, &Candidate)> = None;
        for candidate in &found {
            let known = candidate.within.exact.clone();
            let Some(met) = known.or_else(|| exact(candidate)) else {
                continue;
            };
            let nearer = first.as_ref().is_none_or(|(least, _)| {
                let Ok(order) = met.t.order(&least.t);
                order.is_lt()
            });
            if nearer {
                first = Some((met, candidate));
            }
        }
        let (met, candidate) = first?;
        let (instance, primitive) = (candidate.instance, candidate.primitive);
        let (ray, of) = self.pair(&world, instance, primitive);
        let t = rounding::nearest(&met.t);
        Some(Hit {
            t,
            instance: u64::from(instance),
            primitive: of.combination.map_or(primitive, |_| met.surface),
            normal: self.normal(instance, &of, &ray, t, &met),
        })
    }

    /// World space, unit.
    fn normal(
        &self,
        instance: u32,
        of: &Primitive,
        ray: &Ray,
        t: f64,
        met: &Meeting<Dyadic>,
    ) -> [f64; 3] {
        let normal = match of.combination {
            Some(all) => all.normal(self.scene, ray, t, (met.face, met.surface)),
            None => kinds::normal(of, ray, t, met.face),
        };
        world_normal(&self.rows[instance as usize], normal)
    }

    /// Whether anything is met with 0 < t < t_max.
    pub fn blocked(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> bool {
        let level = 0.0;
        self.blocked_of(Ray { org, dir, level }, t_max)
    }

    /// The same, shifted as [`Reference::nearest_of`].
    pub fn blocked_of(&self, world: Ray, t_max: f64) -> bool {
        let mut blocked = false;
        self.visit(&world, t_max, |_| {
            blocked = true;
            // One settles it.
            f64::NEG_INFINITY
        });
        blocked
    }

    /// Where the whole line of a world ray meets one primitive, before its origin
    /// and behind it, by t. At an edge of a solid once for each face. Of a
    /// combination all boundaries, whatever the primitive. None for ids that do not
    /// exist.
    pub fn crossings(
        &self,
        org: [f64; 3],
        dir: [f64; 3],
        instance: u64,
        primitive: u32,
    ) -> Vec<Crossing> {
        let level = 0.0;
        self.crossings_of(Ray { org, dir, level }, instance, primitive)
    }

    /// The same, shifted as [`Reference::nearest_of`].
    pub fn crossings_of(&self, world: Ray, instance: u64, primitive: u32) -> Vec<Crossing> {
        let Some(a) = usize::try_from(instance)
            .ok()
            .and_then(|i| self.rows.get(i))
        else {
            return Vec::new();
        };
        let primitives = match self.scene.shapes.row(a.shape) {
            Shape::Mesh(id) => self.scene.meshes.row(id).triangles.len(),
            Shape::Combination(_) => usize::MAX,
            _ => 1,
        };
        if primitive as usize >= primitives {
            return Vec::new();
        }
        let instance = instance as u32;
        let (ray, of) = self.pair(&world, instance, primitive);
        let meetings = of.meetings_exactly(&ray);
        let mut crossings: Vec<Crossing> = meetings
            .iter()
            .map(|m| {
                let t = rounding::nearest(&m.t);
                let normal = self.normal(instance, &of, &ray, t, m);
                let primitive = match of.combination {
                    Some(_) => m.surface,
                    None => primitive,
                };
                Crossing {
                    t,
                    primitive,
                    normal,
                }
            })
            .collect();
        crossings.sort_by(|a, b| a.t.total_cmp(&b.t));
        crossings
    }

    /// The ray in a primitive's own space, and the primitive.
    fn pair(&self, ray: &Ray, instance: u32, triangle: u32) -> (Ray, Primitive<'_>) {
        let a = &self.rows[instance as usize];
        let (scene, shape) = (self.scene, self.scene.shapes.row(a.shape));
        let mut ray = ray.through(&a.object_from_world);
        if let Shape::Mesh(id) = shape {
            ray = ray.about(scene.meshes.row(id).center.to_array());
        }
        let primitive = Primitive {
            scene,
            shape,
            triangle,
            combination: self.combination(shape),
        };
        (ray, primitive)
    }

    /// Calls `found` for every primitive that is met in 0 < t < t_max, with the
    /// first place; it answers with the t beyond which nothing matters any more.
    fn visit(&self, world: &Ray, t_max: f64, mut found: impl FnMut(Candidate) -> f64) {
        let mut limit = t_max;
        let mut instance = |instance: u32, mut limit: f64| {
            let (ray, mut of) = self.pair(world, instance, 0);
            let shape = of.shape;
            let mut one = |primitive: u32, limit: f64| {
                of.triangle = primitive;
                match of.first_within(&ray, t_max) {
                    Some(within) if within.lo <= limit => found(Candidate {
                        instance,
                        primitive,
                        within,
                    }),
                    _ => limit,
                }
            };
            let Shape::Mesh(id) = shape else {
                return one(0, limit);
            };
            if let Some(tree) = self.triangles.get(id.index()) {
                let slack = bounds::slack(ray.org, 1.0);
                tree.visit(&ray, slack, Part::Until(limit), |k| {
                    limit = one(k, limit);
                    limit
                });
            } else {
                for k in 0..self.scene.meshes.row(id).triangles.len() as u32 {
                    limit = one(k, limit);
                }
            }
            limit
        };
        for i in &self.always {
            if limit == f64::NEG_INFINITY {
                return;
            }
            limit = instance(*i, limit);
        }
        let slack = bounds::slack(world.org, self.condition);
        self.tree.visit(world, slack, Part::Until(limit), |i| {
            limit = instance(i, limit);
            limit
        });
    }
}

/// By the inverse transpose of world_from_object.
fn world_normal(a: &Appearance, n: [f64; 3]) -> [f64; 3] {
    let m = &a.object_from_world;
    ray::unit(m.linear().map(|column| ray::dot(column, n)))
}
