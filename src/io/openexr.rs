//! OpenEXR writer: one part of scan lines, with lossless ZIP compression.
//!
//! | output | channels | type |
//! |---|---|---|
//! | colour | `R` `G` `B`, linear Rec. 709, premultiplied | FLOAT |
//! | alpha | `A` | FLOAT |
//! | depth | `Z` | FLOAT |
//! | position, normal | `position.X` `.Y` `.Z`, `normal.X` `.Y` `.Z` | FLOAT |
//! | albedo | `albedo.R` `.G` `.B` | FLOAT |
//! | instance_id | `instance_id.lo` `instance_id.hi`: id = hi · 2³² + lo | UINT |
//! | primitive_id | `primitive_id` | UINT |
//! | samples | `samples` | UINT |
//! | distance | `distance` | FLOAT |
//! | geometric_normal, camera_normal | `geometric_normal.X` … | FLOAT |
//! | uv | `uv.U` `uv.V` | FLOAT |
//! | motion vectors, of Blender | `Vector.X` `.Y` `.Z` `.W` | FLOAT |
//! | motion vectors, of Nuke | `forward.u` `.v`, `backward.u` `.v` | FLOAT |
//! | variance | `variance.R` `.G` `.B` | FLOAT |
//! | a denoiser's guides | `denoising_albedo.R` …, `denoising_normal.X` … | FLOAT |
//! | layers of light | `diffuse_direct.R` …, `light_GROUP.R` … | FLOAT |
//! | Cryptomattes | `CryptoObject00.R` … (`mattes.rs`) | FLOAT |
//!
//! `Z` is OpenEXR's own name for depth: Blender makes it the Depth pass, and OpenCV reads
//! it as the picture of a file that has no colour. Other names are `layer.component`, which
//! viewers group by layer. Values keep their bits, also the infinite depth where nothing
//! was hit, and NaN.

use crate::exr_header::text_of;
use crate::{Matte, Picture, SaveError, exr_header};
use exr::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// Rows of the picture that ZIP compresses together.
pub(super) const CHUNK_ROWS: u32 = 16;

/// The channels to write.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    ColorAndAovs,
    Aovs,
}

/// Encodes the channels of a picture; `path` is for messages only.
pub(super) fn encode(
    picture: &Picture,
    content: Content,
    path: &Path,
) -> std::result::Result<Vec<u8>, SaveError> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels(picture, content).into());
    let mut attributes = LayerAttributes::default();
    let mut metadata = picture.metadata.clone();
    metadata.extend(picture.mattes.iter().flat_map(Matte::attributes));
    exr_header::set(&metadata, &mut attributes);
    let mut image = Image::from_layer(Layer::new(size, attributes, encoding, channels));
    if !metadata.is_empty() {
        image.attributes.chromaticities = Some(exr_header::chromaticities());
    }
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| SaveError::Encode {
            path: path.into(),
            message: e.to_string(),
        })?;
    let mut bytes = bytes.into_inner();
    if !metadata.is_empty() {
        exr_header::sort(&mut bytes);
    }
    Ok(bytes)
}

/// Copies the columns of a picture into named channels.
fn channels(picture: &Picture, content: Content) -> Vec<AnyChannel<FlatSamples>> {
    let mut channels = Vec::new();
    let mut float = |name: String, values: Vec<f32>| {
        channels.push(AnyChannel::new(text_of(&name), FlatSamples::F32(values)));
    };
    let mut triple = |prefix: &str, components: [&str; 3], values: &[[f32; 3]]| {
        for (i, component) in components.iter().enumerate() {
            float(
                format!("{prefix}{component}"),
                values.iter().map(|v| v[i]).collect(),
            );
        }
    };
    if content == Content::ColorAndAovs {
        triple("", ["R", "G", "B"], &picture.color);
    }
    if let Some(position) = &picture.position {
        triple("position.", ["X", "Y", "Z"], position);
    }
    if let Some(normal) = &picture.normal {
        triple("normal.", ["X", "Y", "Z"], normal);
    }
    if let Some(albedo) = &picture.albedo {
        triple("albedo.", ["R", "G", "B"], albedo);
    }
    for (name, values) in [
        ("geometric_normal.", &picture.geometric_normal),
        ("camera_normal.", &picture.camera_normal),
    ] {
        if let Some(values) = values {
            triple(name, ["X", "Y", "Z"], values);
        }
    }
    if let Some(variance) = &picture.variance {
        triple("variance.", ["R", "G", "B"], variance);
    }
    for layer in &picture.layers {
        let components = match layer.name == "denoising_normal" {
            true => ["X", "Y", "Z"],
            false => ["R", "G", "B"],
        };
        triple(&format!("{}.", layer.name), components, &layer.color);
    }
    if let Some(uv) = &picture.uv {
        for (k, name) in ["uv.U", "uv.V"].iter().enumerate() {
            float(name.to_string(), uv.iter().map(|uv| uv[k]).collect());
        }
    }
    for (names, ways) in [
        (
            ["Vector.X", "Vector.Y", "Vector.Z", "Vector.W"],
            &picture.vector,
        ),
        (
            ["forward.u", "forward.v", "backward.u", "backward.v"],
            &picture.motion,
        ),
    ] {
        for (k, name) in names.iter().enumerate() {
            if let Some(ways) = ways {
                float(name.to_string(), ways.iter().map(|way| way[k]).collect());
            }
        }
    }
    for (name, values) in picture.mattes.iter().flat_map(Matte::channels) {
        float(name, values);
    }
    if let Some(distance) = &picture.distance {
        float("distance".into(), distance.clone());
    }
    let alpha = picture.alpha.as_ref();
    if let Some(alpha) = alpha.filter(|_| content == Content::ColorAndAovs) {
        float("A".into(), alpha.clone());
    }
    if let Some(depth) = &picture.depth {
        float("Z".into(), depth.clone());
    }
    let mut uint = |name: &str, values: Vec<u32>| {
        channels.push(AnyChannel::new(text_of(name), FlatSamples::U32(values)));
    };
    if let Some(ids) = &picture.instance_id {
        uint("instance_id.lo", ids.iter().map(|id| *id as u32).collect());
        uint(
            "instance_id.hi",
            ids.iter().map(|id| (*id >> 32) as u32).collect(),
        );
    }
    if let Some(ids) = &picture.primitive_id {
        uint("primitive_id", ids.clone());
    }
    if let Some(samples) = &picture.samples {
        uint("samples", samples.clone());
    }
    channels
}
