//! The oracle: a scalar, exact ray tracer that is plain enough to be believed by reading
//! (docs/numerics/oracle.md).
//!
//! It evaluates textbook formulas, one pair of ray and primitive at a time. It shares with
//! the fast path the scene's tables and the definition of the object ray (docs/SPEC.md, S5
//! to S8), and no kernel, predicate, integer or tree. Each formula is written once and
//! evaluated in f64 with a running error bound ([`approx`]); where the bound leaves a sign
//! undecided, the pair is evaluated again in integers of any length ([`dyadic`], O1). So
//! every decision, whether a ray hits and which hit is closest, is that of exact
//! arithmetic, and every t is the f64 nearest to the exact one (O6). Polynomial surfaces
//! are met by integers alone (`algebraic`, O3).
//!
//! Primitives are seen from both sides, so a ray that starts inside a solid meets its far
//! side (S14). CSG solids are evaluated along the whole line (`CSG solid`, O4). A hit
//! counts where 0 < t < t_max. Of hits at equal t, the one with the lower (instance,
//! primitive) is the answer (S10).
//!
//! [`Reference::new`] prunes by a median-split tree of its own (O7);
//! [`Reference::brute_force`] tests every primitive. tests/reference/ compares the two.
//! Both lay out all instances, and refuse scenes that have too many of them.
//!
//! This crate is an internal part of Lanecast and may change with any version; the crate
//! `lanecast` has the stable interface.

use lanecast_model::{geom, scene};
use lanecast_numerics::math;

mod algebraic;
pub mod approx;
mod bounds;
mod camera;
mod csg;
pub mod dyadic;
mod facet;
mod implicit;
mod kinds;
mod level_set;
pub mod light;
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
pub use csg::TURNED;
pub use path::{Shadow, shadow};
pub use ray::Ray;

use crate::scene::{Instance, Instances, MeshId, Scene, SceneError, Shape};
use csg::Csg;
use dyadic::Dyadic;
use meet::{Primitive, Within};
use solids::Meeting;
use std::borrow::Cow;
use std::sync::Arc;
use tree::{Part, Tree};

/// The largest condition of a placement in the tree. Placements with a greater one stay
/// outside the tree, because their world boxes would be too large to prune.
const MAX_CONDITION: f64 = 1e8;

/// The oracle of one scene: its instances, laid out, and the trees that prune them.
pub struct Reference<'a> {
    scene: &'a Scene,
    /// Instances by id.
    rows: Cow<'a, [Instance]>,
    /// The tree over the world boxes of `rows`.
    tree: Tree,
    /// Rows in no tree, which every ray is tested against.
    always: Vec<u32>,
    /// The greatest condition of a placement in the tree.
    condition: f64,
    /// The CSG solids that instances place, by row of the scene's table.
    csg_solids: Vec<Option<Csg>>,
    /// Per mesh, the tree over its triangles about the mesh's centre; empty for brute
    /// force.
    triangles: Arc<[Tree]>,
}

/// The closest hit of a world ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The f64 nearest to the exact t.
    pub t: f64,
    /// The id of one of [`Instances`].
    pub instance: u64,
    /// The primitive id (S13): the triangle of a mesh; the surface of a CSG solid, with the
    /// bit [`TURNED`]; 0 otherwise.
    pub primitive: u32,
    /// The unit geometric normal in world space. It points outward (of the whole CSG
    /// solid); of triangles and polygons it follows their winding. Zero where the surface
    /// has none (a cone's apex, a node).
    pub normal: [f64; 3],
}

/// One point where a line meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The f64 nearest to the exact t.
    pub t: f64,
    /// The primitive id, as in [`Hit`].
    pub primitive: u32,
    /// The unit normal in world space, outward.
    pub normal: [f64; 3],
}

/// A primitive that may be the closest hit, and bounds on the t where the ray first meets
/// it.
struct Candidate {
    instance: u32,
    primitive: u32,
    within: Within,
}

impl<'a> Reference<'a> {
    /// Builds the oracle with trees.
    pub fn new(scene: &'a Scene, instances: &'a Instances) -> Result<Reference<'a>, SceneError> {
        let mut all = Reference::brute_force(scene, instances)?;
        let mut always = Vec::new();
        let mut boxes = Vec::new();
        let mut worst = 1.0;
        for (i, a) in all.rows.iter().enumerate() {
            let shape = scene.shapes.row(a.shape);
            let (to, from) = (&a.world_from_object, &a.object_from_world);
            let mut condition = bounds::condition(to, from);
            let object = match all.csg(shape) {
                Some(csg) => {
                    condition *= csg.condition;
                    csg.bounds
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
                    .map(|i| (i as u32, bounds::triangle_bounds(&mesh, i)))
                    .collect();
                Tree::new(&boxes)
            })
            .collect();
        for csg in all.csg_solids.iter_mut().flatten() {
            csg.triangles = triangles.clone();
        }
        Ok(Reference {
            tree: Tree::new(&boxes),
            always,
            condition: worst,
            triangles,
            ..all
        })
    }

    /// Builds the oracle without trees: every ray is tested against every primitive.
    pub fn brute_force(
        scene: &'a Scene,
        instances: &'a Instances,
    ) -> Result<Reference<'a>, SceneError> {
        let rows = instances.laid_out(scene)?;
        let mut csg_solids = vec![None; scene.csg.len()];
        for row in rows.iter() {
            if let Shape::Csg(id) = scene.shapes.row(row.shape) {
                let unfold = || Csg::new(scene, id);
                csg_solids[id.index()].get_or_insert_with(unfold);
            }
        }
        Ok(Reference {
            scene,
            csg_solids,
            tree: Tree::default(),
            always: (0..rows.len() as u32).collect(),
            rows,
            condition: 1.0,
            triangles: Arc::default(),
        })
    }

    /// Returns the scene that the oracle answers for.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Names the kind of an instance's shape; `None` for ids that do not exist.
    pub fn kind(&self, instance: u64) -> Option<&'static str> {
        let row = self.rows.get(usize::try_from(instance).ok()?)?;
        Some(self.scene.shapes.row(row.shape).kind_name())
    }

    fn csg(&self, shape: Shape) -> Option<&Csg> {
        match shape {
            Shape::Csg(id) => self.csg_solids[id.index()].as_ref(),
            _ => None,
        }
    }

    /// Returns the condition of a hit's placement: how many times a rounding counts on its
    /// other side.
    fn condition_of(&self, hit: &Hit) -> f64 {
        let a = &self.rows[hit.instance as usize];
        let own = bounds::condition(&a.world_from_object, &a.object_from_world);
        let csg = self.csg(self.scene.shapes.row(a.shape));
        own * csg.map_or(1.0, |c| c.condition)
    }

    /// Finds the closest hit of a world ray with 0 < t < t_max.
    pub fn nearest(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> Option<Hit> {
        let level = 0.0;
        self.nearest_of(Ray { org, dir, level }, t_max)
    }

    /// Finds the closest hit as [`Reference::nearest`] does, with level sets shifted by
    /// `level` times the bound on f64's error. Where the shift changes the answer, the
    /// answer is not certain.
    pub fn nearest_of(&self, world: Ray, t_max: f64) -> Option<Hit> {
        let mut found: Vec<Candidate> = Vec::new();
        // The least upper bound of t so far: no primitive beyond it can be the closest.
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
        // Sorted by id, so that the first of equal t stays.
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
        let (ray, target) = self.pair(&world, instance, primitive);
        let t = rounding::nearest(&met.t);
        Some(Hit {
            t,
            instance: u64::from(instance),
            primitive: target.csg.map_or(primitive, |_| met.surface),
            normal: self.normal(instance, &target, &ray, t, &met),
        })
    }

    /// Returns the unit normal of a meeting in world space; zero where the surface has none.
    fn normal(
        &self,
        instance: u32,
        target: &Primitive,
        ray: &Ray,
        t: f64,
        met: &Meeting<Dyadic>,
    ) -> [f64; 3] {
        let normal = match target.csg {
            Some(all) => all.normal(self.scene, ray, t, (met.face, met.surface)),
            None => kinds::normal(target, ray, t, met.face),
        };
        let normal = world_normal(&self.rows[instance as usize], normal);
        // A gradient beyond f64's range has no direction.
        match normal.iter().all(|x| x.is_finite()) {
            true => normal,
            false => [0.0; 3],
        }
    }

    /// Says whether the ray meets any primitive with 0 < t < t_max.
    pub fn blocked(&self, org: [f64; 3], dir: [f64; 3], t_max: f64) -> bool {
        let level = 0.0;
        self.blocked_of(Ray { org, dir, level }, t_max)
    }

    /// Says whether a ray is blocked, with level sets shifted as in
    /// [`Reference::nearest_of`].
    pub fn blocked_of(&self, world: Ray, t_max: f64) -> bool {
        let mut blocked = false;
        self.visit(&world, t_max, |_| {
            blocked = true;
            // One meeting decides the query.
            f64::NEG_INFINITY
        });
        blocked
    }

    /// Lists where the whole line of a world ray meets one primitive, before its origin and
    /// behind it, sorted by t. An edge of a solid gives one crossing for each face. A CSG
    /// solid gives all its boundaries, whatever `primitive` is. Empty for ids that do not
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

    /// Lists crossings, with level sets shifted as in [`Reference::nearest_of`].
    pub fn crossings_of(&self, world: Ray, instance: u64, primitive: u32) -> Vec<Crossing> {
        let Some(a) = usize::try_from(instance)
            .ok()
            .and_then(|i| self.rows.get(i))
        else {
            return Vec::new();
        };
        let primitives = match self.scene.shapes.row(a.shape) {
            Shape::Mesh(id) => self.scene.meshes.row(id).triangles.len(),
            Shape::Csg(_) => usize::MAX,
            _ => 1,
        };
        if primitive as usize >= primitives {
            return Vec::new();
        }
        let instance = instance as u32;
        let (ray, target) = self.pair(&world, instance, primitive);
        let meetings = target.meetings_exactly(&ray);
        let mut crossings: Vec<Crossing> = meetings
            .iter()
            .map(|m| {
                let t = rounding::nearest(&m.t);
                let normal = self.normal(instance, &target, &ray, t, m);
                let primitive = match target.csg {
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

    /// Returns the ray in a primitive's own space, and the primitive.
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
            csg: self.csg(shape),
        };
        (ray, primitive)
    }

    /// Calls `found` for every primitive that the ray meets in 0 < t < t_max, with bounds
    /// on the first t. `found` returns the limit of t from then on.
    fn visit(&self, world: &Ray, t_max: f64, mut found: impl FnMut(Candidate) -> f64) {
        let mut limit = t_max;
        let mut instance = |instance: u32, mut limit: f64| {
            let (ray, mut target) = self.pair(world, instance, 0);
            let shape = target.shape;
            let mut one = |primitive: u32, limit: f64| {
                target.triangle = primitive;
                match target.first_within(&ray, t_max) {
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

/// Maps a normal to world space by the inverse transpose of `world_from_object`, at unit
/// length.
fn world_normal(a: &Instance, n: [f64; 3]) -> [f64; 3] {
    let m = &a.object_from_world;
    ray::unit(m.linear().map(|column| ray::dot(column, n)))
}
