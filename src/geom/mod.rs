//! Primitives, one kind a file: the row, its bounds, its kernel, its surface.
//!
//! All primitives live in object space in f64 and are seen from both sides.
//! Every kernel is written once, generic over [`Lanes`](crate::math::lanes) and
//! over certainty.

mod cone;
mod cuboid;
mod cylinder;
mod ellipsoid;
mod half_space;
pub mod hull;
pub(crate) mod polygon;
mod sphere;

pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use half_space::HalfSpace;
pub use polygon::polygon_plane;
pub use sphere::Sphere;
