//! Convex hulls: planes from points and points from planes.
