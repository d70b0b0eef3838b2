//! Textures: images of files, data URIs and views, with their samplers and transforms.
//!
//! What is malformed or of another kind is left out and counted with the reason, for geometry
//! does not depend on it. An image is decoded where a material asks for it first, once for each
//! use; equal files are one image.

use super::File;
use super::accessor::view_bytes;
use super::buffers::{data_uri, file_name};
use crate::scene::{Image, SceneBuilder, TextureRef, Wrap};
use crate::shared::images::{BrokenImage, ImageStore};
use crate::shared::messages::one_line;
use crate::shared::texels::{ImageUse, texture_transform};
use crate::{Folder, ImportReport};
use gltf::json::Index;
use serde::Deserialize;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// The lists of a document that textures are made of, and its materials, scenes and extensions as
/// they are written.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Sources {
    pub materials: Vec<Value>,
    pub scenes: Vec<Value>,
    pub extensions: Value,
    textures: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
}

/// A material's sets of texture coordinates are at most these; more are hardly ever read.
pub(super) const MOST_SETS: u8 = 8;

/// The images read so far.
pub(super) struct Images<'f> {
    file: &'f File<'f>,
    folder: &'f Folder,
    store: &'f mut ImageStore,
    /// By number of the image and use.
    known: HashMap<(usize, ImageUse), Result<Arc<Image>, String>>,
    /// The first image that has no bytes for a reason.
    without_bytes: HashMap<String, String>,
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
    pub fn new(file: &'f File<'f>, folder: &'f Folder, store: &'f mut ImageStore) -> Images<'f> {
        Images {
            file,
            folder,
            store,
            known: HashMap::new(),
            without_bytes: HashMap::new(),
        }
    }

    /// Reads the texture that a part of a material refers to, and says whether it has alpha.
    /// What cannot be read is counted as left out.
    pub fn read(
        &mut self,
        info: &Value,
        used: ImageUse,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Option<(TextureRef, bool)> {
        match self.texture(info, used, scene, report) {
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
        used: ImageUse,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<(TextureRef, bool), String> {
        let sources = &self.file.sources;
        let info = Info::deserialize(info).map_err(|e| one_line(&e.to_string()))?;
        let all = &sources.textures;
        let texture = all
            .get(info.index)
            .ok_or_else(|| format!("texture {} of {}", info.index, all.len()))?;
        let number = |value: Option<&Value>| value.and_then(Value::as_u64);
        let of = |name| number(texture.pointer(&format!("/extensions/{name}/source")));
        let basis = of("KHR_texture_basisu");
        let image = basis.filter(|_| cfg!(feature = "ktx2"));
        let image = image.or(of("EXT_texture_webp"));
        let image = image.or(number(texture.get("source"))).or(basis);
        let image = image.ok_or("texture of an unknown kind of image")? as usize;
        let image = self.image(image, used)?;
        let named = texture.get("sampler").filter(|named| !named.is_null());
        let sampler = number(named).and_then(|i| sources.samplers.get(i as usize));
        if named.is_some() && sampler.is_none() {
            report.add("sampler that the file does not have");
        }
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
        let has_alpha = image.channels.is_multiple_of(2);
        let found = TextureRef {
            image: scene.shared_image(image),
            uv_set: set as u8,
            wrap: [wrap(sampler.wrap_s), wrap(sampler.wrap_t)],
            nearest: sampler.mag_filter == Some(9728),
            transform: transform.matrix()?,
        };
        Ok((found, has_alpha))
    }

    /// Returns an image. Fails with the place that was the first to need it, and what is wrong.
    pub fn image(&mut self, number: usize, used: ImageUse) -> Result<Arc<Image>, String> {
        if let Some(known) = self.known.get(&(number, used)) {
            return known.clone();
        }
        let place = format!("image {number}");
        let found = match self.origin(number) {
            Ok(Origin::File(path)) => self.store.file(&path, used, &place),
            Ok(Origin::Bytes(bytes)) => self.store.bytes(&bytes, used, &place),
            Err(why) => {
                let first = self.without_bytes.entry(why.clone()).or_insert(place);
                let first = first.clone();
                Err(BrokenImage { first, why })
            }
        };
        let found = found.map_err(|broken| broken.to_string());
        self.known.insert((number, used), found.clone());
        found
    }

    /// Returns where an image's bytes are.
    fn origin(&self, number: usize) -> Result<Origin<'f>, String> {
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
                Some(data) => Ok(Origin::Bytes(data_uri(data)?.into())),
                None => {
                    let found = self.folder.resolve(&file_name(&uri)?);
                    found
                        .map(Origin::File)
                        .map_err(|e| one_line(&e.to_string()))
                }
            },
            (None, Some(view)) => {
                let bytes = view_bytes(self.file, Index::new(view), "image");
                let bytes = bytes.map_err(|e| one_line(&e.to_string()))?;
                Ok(Origin::Bytes(bytes.into()))
            }
            _ => Err("it has neither a uri nor a bufferView".into()),
        }
    }
}

/// Where the bytes of an image are.
enum Origin<'f> {
    File(PathBuf),
    Bytes(Cow<'f, [u8]>),
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
