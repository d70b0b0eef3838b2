//! Lanecast: a CPU ray tracer whose decisions are exact.
//!
//! What a ray meets is what exact arithmetic says, so a picture has the same bits at every
//! lane width, structure, thread count, tile split and machine.
//!
//! ```
//! use lanecast::{DVec3, Edge, Material, RayBatch, RenderConfig, SceneBuilder, Tracer, TracerOptions};
//! use lanecast::shapes::{HalfSpace, Sphere};
//!
//! // A scene: tables, checked once. `lanecast::load` reads one from a file.
//! let mut scene = SceneBuilder::default();
//! let brass = scene.material("brass", Material::metallic_roughness([0.85, 0.65, 0.25], 1.0, 0.2));
//! let ball = scene.sphere("ball", Sphere { center: DVec3::Y, radius: 1.0 });
//! let floor = scene.half_space("floor", HalfSpace { normal: DVec3::Y, offset: 0.0 });
//! scene.instance("", Edge::shape(ball).material(brass));
//! scene.instance("", Edge::shape(floor));
//! let scene = scene.finish()?;
//!
//! // Its trees, and what rays meet.
//! let tracer = Tracer::new(&scene, &TracerOptions::default())?;
//! let mut rays = RayBatch::default();
//! rays.push(DVec3::new(0.0, 1.0, 5.0), -DVec3::Z);
//! rays.push(DVec3::new(0.0, 3.0, 5.0), DVec3::Y);
//! let hits = tracer.closest(&rays);
//! assert_eq!(hits.get(0).map(|hit| hit.t), Some(4.0));
//! assert_eq!(hits.get(1), None);
//!
//! // A picture, with default view and lights, since the scene brings none.
//! let config = RenderConfig { width: 64, height: 48, ..RenderConfig::default() };
//! let picture = tracer.render(&config, &Default::default(), &|_tile| ())?;
//! assert_eq!(picture.color.len(), 64 * 48);
//! // picture.save("ball.png".as_ref())?;
//! # Ok::<(), lanecast::Error>(())
//! ```
//!
//! What the fields of these values can be is in [`options`], [`tables`] and [`outputs`], and what
//! errors say in [`errors`].
//!
//! The items below are the stable interface. `benches/tracer.rs` is an example that uses
//! nothing else. The parts that they stand on are under [`internals`] and may change with any
//! version.

// Scenes: from a file, or built.
pub use lanecast_io::{Animated, LoadError, LoadOptions, Loaded, load};
pub use lanecast_model::scene::{
    Camera, Edge, Light, Material, MeshData, Scene, SceneBuilder, ShutterShape,
};
// Tracing.
pub use lanecast_engine::trace::{End, Span, Spans};
pub use lanecast_model::plan::{Choices, Precision};
pub use lanecast_picture::tracer::{
    Error, Hit, Hits, RayBatch, Solids, Surfaces, Tracer, TracerOptions,
};
// Pictures.
pub use lanecast_io::{AovSet, Bits, Development, Picture, Tone};
pub use lanecast_picture::render::{Backdrop, Exposure, FinishedTile, Progress, RenderConfig};
// Vectors, and maps for `SceneBuilder::transform`.
pub use glam::{DAffine3, DVec3};

/// Rows of the scene's tables: what a shape is made from.
pub mod shapes {
    pub use lanecast_model::geom::{
        Clip, Cone, Cuboid, Cylinder, Ellipsoid, Formula, HalfSpace, Implicit, LevelSet, Polygon,
        Prism, Quadric, Sphere, Tape,
    };
}

/// What can be asked for: the types of the fields of [`RenderConfig`], [`TracerOptions`],
/// [`Choices`] and [`LoadOptions`].
///
/// ```
/// use lanecast::options::{Accel, BuildQuality, Filter, Integrator, Sampler};
/// use lanecast::shapes::Sphere;
/// use lanecast::{Choices, DVec3, Edge, Material, RenderConfig, SceneBuilder, Tracer, TracerOptions};
///
/// // A matte ball that reflects half the light, under a white sky.
/// let mut scene = SceneBuilder::default();
/// let grey = scene.material("grey", Material::metallic_roughness([0.5; 3], 0.0, 1.0));
/// let ball = scene.sphere("ball", Sphere { center: DVec3::ZERO, radius: 1.0 });
/// scene.instance("", Edge::shape(ball).material(grey));
/// scene.background([1.0; 3]);
/// let scene = scene.finish()?;
///
/// let tracer = Tracer::new(&scene, &TracerOptions {
///     choices: Choices { accel: Some(Accel::Kd), ..Choices::default() },
///     build: BuildQuality::default(),
/// })?;
/// let picture = tracer.render(
///     &RenderConfig {
///         width: 32,
///         height: 32,
///         integrator: Integrator::Path,
///         spp: 16,
///         sampler: Sampler::Sobol,
///         filter: Filter::Box,
///         ..RenderConfig::default()
///     },
///     &Default::default(),
///     &|_tile| (),
/// )?;
/// let [corner, middle] = [0, 16 * 32 + 16].map(|pixel| picture.color[pixel][0]);
/// assert_eq!(corner, 1.0);
/// assert!(middle > 0.4 && middle < 0.7);
/// # Ok::<(), lanecast::Error>(())
/// ```
pub mod options {
    // Of the tracer.
    pub use lanecast_engine::accel::BuildQuality;
    pub use lanecast_model::plan::{Accel, LaneCount};
    // Of pictures.
    pub use lanecast_engine::accel::{KdClip, KdQuality, KdStop};
    pub use lanecast_engine::trace::Caching;
    pub use lanecast_light::filter::Kind as Filter;
    pub use lanecast_light::sampler::Kind as Sampler;
    pub use lanecast_numerics::roots::Solver;
    pub use lanecast_picture::render::{
        Adaptive, Cost, Grid, Ground, IndirectCaching, Inspection, Integrator, TileOrder, Window,
    };
    // Of files.
    pub use lanecast_io::{Curves, Given, ReadLog, ZUp};
    pub use lanecast_model::scene::{Hatch, Pace, Timeline};
}

/// The types of the fields of cameras, lights, materials, edges and ends of spans.
pub mod tables {
    pub use lanecast_model::scene::{
        Calibration, Falloff, FisheyeMapping, Layers, Lens, MaterialId, Model, NodeId, Projection,
        ShapeId, Target, TransformId,
    };
}

/// The types of the fields of a [`Picture`].
pub mod outputs {
    pub use lanecast_io::{Attribute, Layer, Matte, Metadata};
}

/// The kinds of [`Error`].
pub mod errors {
    pub use lanecast_io::SaveError;
    pub use lanecast_model::plan::PlanError;
    pub use lanecast_model::scene::{Entity, EntityKind, SceneError, UnknownCamera};
    pub use lanecast_picture::render::{ConfigError, RenderError, SliceError};
    pub use lanecast_picture::tracer::{ColumnError, SurfaceError};
}

/// The parts of the tracer, for its tests and for people who study them: they may change with
/// any version. docs/ARCHITECTURE.md says what each is and which may use which.
pub mod internals {
    pub use lanecast_cli as cli;
    pub use lanecast_engine::{accel, trace};
    pub use lanecast_io as io;
    pub use lanecast_light as light;
    pub use lanecast_measure as measure;
    pub use lanecast_model::{csg, geom, plan, scene};
    pub use lanecast_numerics::{math, roots};
    pub use lanecast_picture::{render, shade};
    pub use lanecast_reference as reference;
}
