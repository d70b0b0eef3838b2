//! The film: tiles add to it, the picture comes out of it.

use super::{AovSet, Picture};
use crate::scene::Rgb;

/// One pixel's first hit.
#[derive(Clone, Copy, Debug)]
pub struct AovSample {
    pub depth: f32,
    pub position: [f32; 3],
    pub normal: [f32; 3],
    pub albedo: Rgb,
    pub instance: u64,
    pub primitive: u32,
}

impl AovSample {
    /// Where nothing is.
    pub const NOTHING: AovSample = AovSample {
        depth: f32::INFINITY,
        position: [0.0; 3],
        normal: [0.0; 3],
        albedo: [0.0; 3],
        instance: Picture::NO_ID,
        primitive: u32::MAX,
    };
}

/// A picture with room for what was asked for, and nothing else.
pub fn blank(width: u32, height: u32, aovs: AovSet) -> Picture {
    let pixels = width as usize * height as usize;
    let nothing = AovSample::NOTHING;
    Picture {
        width,
        height,
        color: vec![[0.0; 3]; pixels],
        depth: aovs.depth.then(|| vec![nothing.depth; pixels]),
        position: aovs.position.then(|| vec![nothing.position; pixels]),
        normal: aovs.normal.then(|| vec![nothing.normal; pixels]),
        albedo: aovs.albedo.then(|| vec![nothing.albedo; pixels]),
        instance_id: aovs.instance_id.then(|| vec![nothing.instance; pixels]),
        primitive_id: aovs.primitive_id.then(|| vec![nothing.primitive; pixels]),
    }
}

/// Copies a tile's rows into the picture. `aovs` is empty where none are kept.
pub fn put(
    picture: &mut Picture,
    corner: (u32, u32),
    size: (u32, u32),
    color: &[Rgb],
    aovs: &[AovSample],
) {
    for row in 0..size.1 {
        let from = (row * size.0) as usize;
        let to = (corner.1 + row) as usize * picture.width as usize + corner.0 as usize;
        let width = size.0 as usize;
        picture.color[to..to + width].copy_from_slice(&color[from..from + width]);
        if aovs.is_empty() {
            continue;
        }
        for (i, sample) in aovs[from..from + width].iter().enumerate() {
            set(&mut picture.depth, to + i, sample.depth);
            set(&mut picture.position, to + i, sample.position);
            set(&mut picture.normal, to + i, sample.normal);
            set(&mut picture.albedo, to + i, sample.albedo);
            set(&mut picture.instance_id, to + i, sample.instance);
            set(&mut picture.primitive_id, to + i, sample.primitive);
        }
    }
}

fn set<T>(column: &mut Option<Vec<T>>, i: usize, value: T) {
    if let Some(column) = column {
        column[i] = value;
    }
}
