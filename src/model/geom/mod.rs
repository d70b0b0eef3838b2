//! Primitives, one kind a file or folder: table, check, bounds, kernels, exact predicate and
//! surface.
//!
//! All primitives live in object space in f64 and are seen from both sides.
//! Every kernel is written once, generic over [`Lanes`](crate::math::lanes) and over certainty.
//! Kernels keep no state; what they reuse from ray to ray is in a [`Scratch`] that the caller
//! passes.

pub mod by_solver;
pub mod chart;
mod columns;
pub mod cone;
pub mod cuboid;
mod cylinder;
pub mod dense;
pub mod ellipsoid;
pub mod exact;
pub mod face;
pub mod formula;
pub mod guarded;
pub mod half_space;
pub mod hull;
pub mod implicit;
pub mod implicit_bounds;
pub mod kinds;
mod level_set;
pub mod polygon;
pub mod polyhedron;
pub mod primitive;
pub mod prism;
pub mod quadric;
mod ray;
mod scratch;
pub mod sphere;
pub mod tape;
pub mod triangle;

pub use chart::Chart;
pub use cone::{Cone, Cones};
pub use cuboid::{Cuboid, Cuboids};
pub use cylinder::{Cylinder, Cylinders};
pub use dense::Dense;
pub use ellipsoid::{Ellipsoid, Ellipsoids};
pub use formula::{Binary, Formula, Step as FormulaStep, Unary};
pub use half_space::{HalfSpace, HalfSpaces};
pub use implicit::{Clip, Implicit, Implicits};
pub use level_set::{LevelSet, LevelSets};
pub use polygon::{Polygon, Polygons, polygon_plane};
pub use polyhedron::Polyhedra;
pub use prism::{Prism, PrismRow, Prisms};
pub use quadric::{Quadric, Quadrics};
pub use ray::{Certainty, Fast, Guarded, Meet, Ray, Shear, Span};
pub use scratch::Scratch;
pub use sphere::{Sphere, Spheres};
pub use tape::{Step, Tape};
