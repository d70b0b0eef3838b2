//! Lanecast: a CPU ray tracer that knows how wrong it is.
//!
//! Triangles, spheres, ellipsoids, cylinders, cones, boxes, polyhedra, quadrics
//! and polygons are traced in coherent packets of SIMD lanes, with the same bits at
//! every lane width, structure, thread count and tile split. A scalar
//! [`reference`] tracer, written apart, says what is right.
//!
//! The way of the data, one module a stage: [`io`] or a
//! [`SceneBuilder`](scene::SceneBuilder) fills the tables of a
//! [`scene`], [`plan`] chooses kernels and structure, [`accel`] builds the
//! trees, [`trace`] answers batches of rays, [`shade`] turns hits into light,
//! [`render`] makes the picture of it.
//!
//! ```
//! use glam::DVec3;
//! use lanecast::accel::{Structure, World};
//! use lanecast::geom::{HalfSpace, Sphere};
//! use lanecast::plan::{Choices, plan};
//! use lanecast::render::{Progress, RenderConfig, View, render};
//! use lanecast::scene::*;
//!
//! // Tables, checked once.
//! let mut scene = SceneBuilder::default();
//! let brass = scene.material("brass", Material::metallic_roughness([0.85, 0.65, 0.25], 1.0, 0.2));
//! let ball = scene.sphere("ball", Sphere { center: DVec3::Y, radius: 1.0 });
//! let floor = scene.half_space("floor", HalfSpace { normal: DVec3::Y, offset: 0.0 });
//! scene.instance("", Edge::shape(ball).material(brass));
//! scene.instance("", Edge::shape(floor));
//! let scene = scene.finish()?;
//!
//! // A default view and lights, since the scene brings none.
//! let config = RenderConfig { width: 64, height: 48, ..RenderConfig::default() };
//! let instances = Instances::of(&scene)?;
//! let (scene, camera) = scene.completed(None, &instances, 64.0 / 48.0);
//!
//! // What the scene needs, its trees, its picture.
//! let plan = plan(&scene, &instances, &Choices::default())?;
//! let world = World::build(&scene, &instances, Structure::Bvh);
//! let view = View { world: &world, kernels: plan.kernels, camera, lights: &scene.lights };
//! let rendered = render(&view, &config, false, &Progress::default())?;
//!
//! assert_eq!(rendered.counts.primary, 64 * 48);
//! assert!(rendered.counts.primary_hits > 0);
//! // rendered.picture.save("ball.png".as_ref())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use lanecast_engine::{accel, trace};
pub use lanecast_io as io;
pub use lanecast_model::{csg, geom, plan, scene};
pub use lanecast_numerics::{math, roots};
pub use lanecast_reference as reference;

pub mod cli;
pub mod measure;
pub mod render;
pub mod shade;
