//! Textures: images of files, data URIs and views, with their samplers and transforms.
//!
//! What is malformed or of another kind is left out and counted with the reason, for geometry
//! does not depend on it. An image is decoded where a material asks for it first, once for
//! colours and once for other numbers; equal bytes are one image.

use super::File;
use super::accessor::view_bytes;
use super::buffers::{data_uri, file_name};
use crate::scene::{ImageId, SceneBuilder, Slot, TextureRef, Wrap};
use crate::shared::messages::one_line;
use crate::shared::texels::{self, Decoded, texture_transform};
use crate::{Folder, ImportReport};
use gltf::json::Index;
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;

/// The lists of a document that textures are made of, and its materials as they are written.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Sources {
    pub materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
}

/// Texels of all images together; four bytes each, and a third more for smaller levels.
const MOST_TEXELS: u64 = 1 << 30;

/// A material's sets of texture coordinates are at most these; more are hardly ever read.
pub(super) const MOST_SETS: u8 = 8;

/// The bytes of an image's file, and whether it holds colours.
type ImageKey = (Vec<u8>, bool);

/// The images read so far.
pub(super) struct Images<'f> {
    file: &'f File<'f>,
    folder: &'f Folder,
    /// By number of the image, and whether it holds colours.
    known: HashMap<(usize, bool), Option<(ImageId, bool)>>,
    /// By the bytes of image files.
    same: HashMap<ImageKey, Option<(ImageId, bool)>>,
    texels: u64,
}

/// How a material refers to a texture.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Info {
    index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    extensions: InfoExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct InfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    transform: Option<Transform>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transform {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
    tex_coord: Option<u32>,
}

impl Default for Transform {
    fn default() -> Transform {
        Transform {
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
            tex_coord: None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Sampler {
    mag_filter: Option<u32>,
    wrap_s: Option<u32>,
    wrap_t: Option<u32>,
}

impl<'f> Images<'f> {
    pub fn new(file: &'f File<'f>, folder: &'f Folder) -> Images<'f> {
        Images {
            file,
            folder,
            known: HashMap::new(),
            same: HashMap::new(),
            texels: 0,
        }
    }

    /// Reads the texture that a part of a material refers to, and says whether it has alpha.
    /// What cannot be read is counted as left out.
    pub fn read(
        &mut self,
        info: &Value,
        slot: Slot,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Option<(TextureRef, bool)> {
        match self.texture(info, slot, scene) {
            Ok(found) => Some(found),
            Err(why) => {
                report.add(&format!("texture ({why})"));
                None
            }
        }
    }

    fn texture(
        &mut self,
        info: &Value,
        slot: Slot,
        scene: &mut SceneBuilder,
    ) -> Result<(TextureRef, bool), String> {
        let sources = &self.file.sources;
        let info = Info::deserialize(info).map_err(|e| one_line(&e.to_string()))?;
        let all = &sources.textures;
        let texture = all
            .get(info.index)
            .ok_or_else(|| format!("texture {} of {}", info.index, all.len()))?;
        let number = |value: Option<&Value>| value.and_then(Value::as_u64);
        let webp = texture.pointer("/extensions/EXT_texture_webp/source");
        let image = number(webp).or(number(texture.get("source")));
        let image = image.ok_or("texture of an unknown kind of image")? as usize;
        let (image, has_alpha) = self.image(image, slot.is_color(), scene)?;
        let sampler = number(texture.get("sampler")).and_then(|i| sources.samplers.get(i as usize));
        let sampler = sampler.map_or(Ok(Sampler::default()), Sampler::deserialize);
        let sampler = sampler.map_err(|e| one_line(&e.to_string()))?;
        let wrap = |code| match code {
            Some(33_071) => Wrap::Clamp,
            Some(33_648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let transform = info.extensions.transform.unwrap_or_default();
        let set = transform.tex_coord.unwrap_or(info.tex_coord);
        if set >= u32::from(MOST_SETS) {
            return Err(format!("texture coordinates {set}"));
        }
        let found = TextureRef {
            image,
            uv_set: set as u8,
            wrap: [wrap(sampler.wrap_s), wrap(sampler.wrap_t)],
            nearest: sampler.mag_filter == Some(9728),
            transform: transform.matrix()?,
        };
        Ok((found, has_alpha))
    }

    /// Reads an image, and says whether it has alpha.
    fn image(
        &mut self,
        number: usize,
        is_color: bool,
        scene: &mut SceneBuilder,
    ) -> Result<(ImageId, bool), String> {
        let failed = || format!("image {number}, as before");
        if let Some(known) = self.known.get(&(number, is_color)) {
            return known.ok_or_else(failed);
        }
        // What is found out is remembered, so that a broken image is decoded once.
        self.known.insert((number, is_color), None);
        let bytes = self
            .bytes(number)
            .map_err(|why| format!("image {number}: {why}"))?;
        let key = (bytes, is_color);
        if let Some(same) = self.same.get(&key) {
            self.known.insert((number, is_color), *same);
            return same.ok_or_else(failed);
        }
        let decoded = self.decode(&key.0, is_color);
        let found = decoded.map(|image| {
            let has_alpha = image.has_alpha();
            let id = scene.image(image.texels, image.channels, is_color, image.size);
            (id, has_alpha)
        });
        self.same.insert(key, found.as_ref().ok().copied());
        self.known
            .insert((number, is_color), found.as_ref().ok().copied());
        found.map_err(|why| format!("image {number}: {why}"))
    }

    fn decode(&mut self, bytes: &[u8], is_color: bool) -> Result<Decoded, String> {
        let image = texels::decode(bytes, is_color).map_err(|why| one_line(&why))?;
        self.texels += u64::from(image.size[0]) * u64::from(image.size[1]);
        match self.texels <= MOST_TEXELS {
            true => Ok(image),
            false => Err("all images have more than 2^30 texels".into()),
        }
    }

    /// Returns the bytes of an image's file.
    fn bytes(&self, number: usize) -> Result<Vec<u8>, String> {
        #[derive(Deserialize)]
        #[serde(rename_all = "camelCase")]
        struct Source {
            uri: Option<String>,
            buffer_view: Option<u32>,
        }
        let all = &self.file.sources.images;
        let source = all
            .get(number)
            .ok_or_else(|| format!("there are {}", all.len()))?;
        let source = Source::deserialize(source).map_err(|e| one_line(&e.to_string()))?;
        match (source.uri, source.buffer_view) {
            (Some(uri), _) => match uri.strip_prefix("data:") {
                Some(data) => data_uri(data),
                None => {
                    let read = self.folder.read(&file_name(&uri)?);
                    read.map_err(|e| one_line(&e.to_string()))
                }
            },
            (None, Some(view)) => {
                let bytes = view_bytes(self.file, Index::new(view), "image");
                bytes
                    .map(<[u8]>::to_vec)
                    .map_err(|e| one_line(&e.to_string()))
            }
            _ => Err("it has neither a uri nor a bufferView".into()),
        }
    }
}

impl Transform {
    /// Returns the map of texture coordinates: scaled, turned and moved.
    fn matrix(&self) -> Result<[[f64; 3]; 2], String> {
        let map = texture_transform(self.scale, self.rotation, self.offset);
        match map.iter().flatten().all(|x| x.is_finite()) {
            true => Ok(map),
            false => Err("a transform that is not finite".into()),
        }
    }
}
