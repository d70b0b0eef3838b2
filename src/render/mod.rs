//! From a scene to a picture: tiles, samples, film.

mod picture;

pub use picture::{AovSet, Picture};
