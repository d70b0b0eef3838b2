//! The film: collects the tiles' results in the picture.

use super::{AovSet, Picture};
use crate::scene::Rgb;
use std::collections::TryReserveError;

/// One pixel's first hit.
#[derive(Clone, Copy, Debug)]
pub struct AovSample {
    pub depth: f32,
    pub position: [f32; 3],
    pub normal: [f32; 3],
    pub albedo: Rgb,
    pub instance: u64,
    pub primitive: u32,
    pub distance: f32,
    pub geometric_normal: [f32; 3],
    pub camera_normal: [f32; 3],
    pub uv: [f32; 2],
}

impl AovSample {
    /// The values of a pixel whose ray hits nothing.
    pub const NOTHING: AovSample = AovSample {
        depth: f32::INFINITY,
        position: [0.0; 3],
        normal: [0.0; 3],
        albedo: [0.0; 3],
        instance: Picture::NO_ID,
        primitive: u32::MAX,
        distance: f32::INFINITY,
        geometric_normal: [0.0; 3],
        camera_normal: [0.0; 3],
        uv: [0.0; 2],
    };
}

/// Allocates a picture with the requested channels. Returns an error if memory does not
/// suffice.
pub fn blank(
    width: u32,
    height: u32,
    aovs: AovSet,
    has_alpha: bool,
) -> Result<Picture, TryReserveError> {
    let pixels = width as usize * height as usize;
    let nothing = AovSample::NOTHING;
    Ok(Picture {
        width,
        height,
        color: column(pixels, [0.0; 3])?,
        alpha: wanted(has_alpha, pixels, 1.0)?,
        depth: wanted(aovs.depth, pixels, nothing.depth)?,
        position: wanted(aovs.position, pixels, nothing.position)?,
        normal: wanted(aovs.normal, pixels, nothing.normal)?,
        albedo: wanted(aovs.albedo, pixels, nothing.albedo)?,
        instance_id: wanted(aovs.instance_id, pixels, nothing.instance)?,
        primitive_id: wanted(aovs.primitive_id, pixels, nothing.primitive)?,
        samples: wanted(aovs.samples, pixels, 0)?,
        distance: wanted(aovs.distance, pixels, nothing.distance)?,
        geometric_normal: wanted(aovs.geometric_normal, pixels, nothing.geometric_normal)?,
        camera_normal: wanted(aovs.camera_normal, pixels, nothing.camera_normal)?,
        uv: wanted(aovs.uv, pixels, nothing.uv)?,
        variance: wanted(aovs.variance, pixels, [0.0; 3])?,
        ..Picture::default()
    })
}

/// Returns the bytes of a picture's columns, but those of groups of lights, which the scene tells.
pub fn bytes(width: u32, height: u32, aovs: AovSet, matte_ranks: u32) -> u64 {
    let of = |wanted: bool, bytes: usize| if wanted { bytes as u64 } else { 0 };
    let pixel = of(true, size_of::<Rgb>())
        + of(aovs.depth, size_of::<f32>())
        + of(aovs.position, size_of::<[f32; 3]>())
        + of(aovs.normal, size_of::<[f32; 3]>())
        + of(aovs.albedo, size_of::<Rgb>())
        + of(aovs.instance_id, size_of::<u64>())
        + of(aovs.primitive_id, size_of::<u32>())
        + of(aovs.samples, size_of::<u32>())
        + of(aovs.distance, size_of::<f32>())
        + of(aovs.geometric_normal, size_of::<[f32; 3]>())
        + of(aovs.camera_normal, size_of::<[f32; 3]>())
        + of(aovs.uv, size_of::<[f32; 2]>())
        + of(aovs.vector, size_of::<[f32; 4]>())
        + of(aovs.motion, size_of::<[f32; 4]>())
        + of(aovs.variance, size_of::<[f32; 3]>());
    let layers = aovs.light_layers().into_iter().chain(aovs.guides());
    let layers = layers.map(|is| of(is, size_of::<Rgb>()));
    let mattes = [
        aovs.crypto_object,
        aovs.crypto_material,
        aovs.crypto_instance,
    ];
    let mattes = mattes.map(|is| of(is, size_of::<[f32; 2]>() * matte_ranks as usize));
    let pixel = pixel + layers.sum::<u64>() + mattes.iter().sum::<u64>();
    u64::from(width) * u64::from(height) * pixel
}

pub(super) fn column<T: Clone>(pixels: usize, value: T) -> Result<Vec<T>, TryReserveError> {
    let mut column = Vec::new();
    column.try_reserve_exact(pixels)?;
    column.resize(pixels, value);
    Ok(column)
}

fn wanted<T: Clone>(
    wanted: bool,
    pixels: usize,
    value: T,
) -> Result<Option<Vec<T>>, TryReserveError> {
    wanted.then(|| column(pixels, value)).transpose()
}

/// Copies a tile's rows into the picture. `aovs` is empty if no AOV is requested.
pub fn put(
    picture: &mut Picture,
    corner: (u32, u32),
    size: (u32, u32),
    color: &[Rgb],
    alpha: &[f32],
    aovs: &[AovSample],
) {
    for row in 0..size.1 {
        let from = (row * size.0) as usize;
        let to = (corner.1 + row) as usize * picture.width as usize + corner.0 as usize;
        let width = size.0 as usize;
        picture.color[to..to + width].copy_from_slice(&color[from..from + width]);
        if let Some(column) = &mut picture.alpha {
            column[to..to + width].copy_from_slice(&alpha[from..from + width]);
        }
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
            set(&mut picture.distance, to + i, sample.distance);
            set(
                &mut picture.geometric_normal,
                to + i,
                sample.geometric_normal,
            );
            set(&mut picture.camera_normal, to + i, sample.camera_normal);
            set(&mut picture.uv, to + i, sample.uv);
        }
    }
}

fn set<T>(column: &mut Option<Vec<T>>, i: usize, value: T) {
    if let Some(column) = column {
        column[i] = value;
    }
}
