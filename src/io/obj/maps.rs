//! Images of MTL materials.

use crate::scene::{Alpha, ImageId, Material, Model, Slot, TextureRef, Texturing, Wrap};
use crate::shared::images::ImageStore;
use crate::shared::mesh_file::MeshFile;
use crate::shared::messages::one_line;
use crate::shared::texels::ImageUse;
use crate::{Folder, ImportReport};
use std::path::PathBuf;

/// An image as a statement names it.
#[derive(Debug)]
pub(super) struct Map {
    pub slot: Slot,
    /// The file, or why it cannot be read.
    file: Result<PathBuf, String>,
    wrap: Wrap,
    scale: [f64; 2],
    offset: [f64; 2],
}

/// A material, and its images.
#[derive(Debug)]
pub(super) struct MtlMaterial {
    pub material: Material,
    pub maps: Vec<Map>,
    /// Whether its colour is the default one, for the file has none or black beside an image.
    pub is_uncolored: bool,
}

impl Map {
    /// Reads a statement: options, of which `-s`, `-o` and `-clamp` count, and a file name, which
    /// may contain blanks.
    pub fn read(slot: Slot, line: &str, folder: &Folder) -> Map {
        let mut map = Map {
            slot,
            file: Err("no file name".into()),
            wrap: Wrap::Repeat,
            scale: [1.0; 2],
            offset: [0.0; 2],
        };
        let mut rest = after_word(line.trim());
        while let Some(option) = rest
            .split_whitespace()
            .next()
            .filter(|w| w.starts_with('-'))
        {
            rest = after_word(rest);
            let words = match option {
                "-mm" => 2,
                "-s" | "-o" | "-t" => 3,
                _ => 1,
            };
            let mut values = [f64::NAN; 3];
            for value in values.iter_mut().take(words) {
                let word = rest.split_whitespace().next().unwrap_or_default();
                let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
                // Options of three numbers may have fewer.
                if words > 1 && number.is_none() {
                    break;
                }
                *value = number.unwrap_or(f64::NAN);
                if option == "-clamp" && word.eq_ignore_ascii_case("on") {
                    map.wrap = Wrap::Clamp;
                }
                rest = after_word(rest);
            }
            for k in 0..2 {
                match option {
                    "-s" if !values[k].is_nan() => map.scale[k] = values[k],
                    "-o" if !values[k].is_nan() => map.offset[k] = values[k],
                    _ => {}
                }
            }
        }
        let name = rest.trim().trim_matches('"').replace('\\', "/");
        if !name.is_empty() {
            let found = folder.resolve(&name);
            map.file = match found {
                Ok(path) => Ok(path),
                Err(e) => match folder.resolve_any_case(&name) {
                    Some(path) => Ok(path),
                    None => Err(one_line(&e.to_string())),
                },
            };
        }
        map
    }

    /// Returns the reference to its image. v counts from below in MTL, from above here.
    fn texture(&self, image: ImageId) -> TextureRef {
        let [su, sv] = self.scale;
        TextureRef {
            wrap: [self.wrap; 2],
            transform: [
                [su, 0.0, self.offset[0]],
                [0.0, sv, 1.0 - sv - self.offset[1]],
            ],
            ..TextureRef::plain(image)
        }
    }
}

/// Returns what follows the first word.
fn after_word(text: &str) -> &str {
    let text = text.trim_start();
    text.split_once(char::is_whitespace)
        .map_or("", |(_, rest)| rest.trim_start())
}

impl MtlMaterial {
    /// Returns the material, and adds its images, read once each, to those of the file, as those
    /// of its material `row`. Images that cannot be read are left out and counted.
    pub fn textured(
        mut self,
        row: usize,
        file: &mut MeshFile,
        images: &mut ImageStore,
        report: &mut ImportReport,
    ) -> Material {
        let mut refs = Vec::new();
        let mut texturing = Texturing::default();
        for map in &self.maps {
            // Alpha of the colour's image does not count.
            let used = match map.slot {
                Slot::Opacity => ImageUse::Opacity,
                _ => ImageUse::Color,
            };
            let found = map.file.as_ref().map_err(String::clone).and_then(|path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let found = images.file(path, used, &one_line(&name));
                found.map_err(|broken| broken.to_string())
            });
            match found {
                Ok(image) => {
                    let id = ImageId(file.images.len() as u32);
                    file.images.push(image);
                    refs.push((map.slot, map.texture(id)));
                }
                Err(why) => report.add(&format!("texture ({why})")),
            }
        }
        if refs.iter().any(|(slot, _)| *slot == Slot::Opacity) {
            texturing.alpha = Alpha::Blend;
        }
        let has_color = refs.iter().any(|(slot, _)| *slot == Slot::BaseColor);
        if has_color && self.is_uncolored {
            let usual = Material::default().base_color;
            let white = |color: &mut [f32; 3]| {
                *color = [0, 1, 2].map(|k| color[k] / usual[k]);
            };
            white(&mut self.material.base_color);
            if let Model::Phong { diffuse, .. } = &mut self.material.model {
                white(diffuse);
            }
        }
        if !refs.is_empty() {
            file.textures.push((row, texturing, refs));
        }
        self.material
    }
}
