//! Primitives, one kind a file: the row, its bounds, its kernel, its surface.
//!
//! All primitives live in object space in f64 and are seen from both sides.
//! Every kernel is written once, generic over [`Lanes`](crate::math::lanes) and
//! over certainty.

pub mod by_solver;
pub mod cone;
pub mod cuboid;
mod cylinder;
pub mod dense;
pub mod ellipsoid;
pub mod exact;
pub mod formula;
pub mod guarded;
pub mod half_space;
pub mod hull;
pub mod implicit;
pub mod implicit_bounds;
mod level_set;
pub mod polygon;
pub mod quadric;
mod ray;
pub mod sphere;
pub mod tape;
pub mod triangle;

pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use dense::Dense;
pub use ellipsoid::Ellipsoid;
pub use formula::{Binary, Formula, Step as FormulaStep, Unary};
pub use half_space::HalfSpace;
pub use implicit::{Clip, Implicit};
pub use level_set::LevelSet;
pub use polygon::{Polygon, polygon_plane};
pub use quadric::Quadric;
pub use ray::{Certainty, Fast, Guarded, Meet, Ray, Shear, Span};
pub use sphere::Sphere;
pub use tape::{Step, Tape};
