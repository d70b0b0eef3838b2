//! Images of materials and of the environment, with their files.

use super::Writer;
use super::looks::{angle, color};
use super::text::{Table, Value, numbers, short};
use crate::Picture;
use crate::openexr::{self, Content};
use crate::scene::{
    Alpha, Environment, Image, ImageId, MaterialId, Slot, Texels, TextureRef, Wrap,
};
use crate::shared::texels::texture_transform;
use crate::shared::view_transform::srgb_from_linear;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

impl Writer<'_> {
    /// Puts what varies a material over meshes into its table: images, what their alpha does, and
    /// colours of vertices.
    pub(super) fn put_images(&mut self, id: MaterialId, table: &mut Table) {
        let Some(row) = self.scene.textures.of(id) else {
            return;
        };
        let mut has_alpha = row.texturing.vertex_color;
        for (slot, texture) in row.refs {
            let key = match slot {
                Slot::BaseColor => "base_color_texture",
                Slot::MetallicRoughness => "metallic_roughness_texture",
                Slot::Emission => "emission_texture",
                Slot::Normal => "normal_texture",
                _ => {
                    self.lose("image of a layer of a material");
                    continue;
                }
            };
            if texture.uv_set > 0 {
                self.lose("image by a further set of texture coordinates");
                continue;
            }
            if let Some(value) = self.texture(texture, id) {
                has_alpha |= *slot == Slot::BaseColor;
                table.push((key.into(), value));
                let scale = row.texturing.normal_scale;
                if *slot == Slot::Normal && scale != 1.0 {
                    table.push(("normal_scale".into(), Value::Number(short(scale))));
                }
            }
        }
        let is_stretched = self.scene.materials.rows[id.index()].layers.anisotropy > 0.0;
        if row.texturing.follows_tangents && is_stretched {
            self.lose("direction of highlights along a mesh's tangents");
        }
        if row.texturing.vertex_color {
            table.push(("vertex_colors".into(), Value::Flag(true)));
        }
        let (alpha, cutoff) = match row.texturing.alpha {
            Alpha::Opaque => return,
            Alpha::Blend => ("blend", None),
            Alpha::Mask(cutoff) => ("mask", Some(cutoff)),
        };
        if !has_alpha {
            self.lose("material's mode of alpha");
            return;
        }
        table.push(("alpha".into(), Value::Text(alpha.into())));
        if let Some(cutoff) = cutoff {
            let cutoff = Value::Number(short(cutoff));
            table.push(("alpha_cutoff".into(), cutoff));
        }
    }

    /// Writes an environment by its picture; `None` if its file cannot be made.
    pub(super) fn environment(&mut self, map: &Environment) -> Option<Table> {
        let picture = Picture {
            width: map.width,
            height: map.height,
            color: map.pixels.to_vec(),
            ..Picture::default()
        };
        let name = self.file_name("environment", 0, "exr");
        let bytes = openexr::encode(&picture, Content::ColorAndAovs, Path::new(&name)).ok()?;
        let path = format!("{}/{name}", self.folder);
        self.files.push((name, bytes));
        let mut table: Table = vec![("file".into(), Value::Text(path))];
        if map.rotation != 0.0 {
            table.push(("rotate_y".into(), angle(map.rotation)));
        }
        if map.scale != [1.0; 3] {
            table.push(("scale".into(), color(map.scale)));
        }
        Some(table)
    }

    /// Writes an image as a material refers to it; `None` if its file cannot be made.
    fn texture(&mut self, texture: &TextureRef, of: MaterialId) -> Option<Value> {
        let file = self.image_file(texture.image, of)?;
        let path = format!("{}/{file}", self.folder);
        let mut table: Table = vec![("file".into(), Value::Text(path))];
        let mut put = |key: &str, value: Value| table.push((key.into(), value));
        let [wrap, other] = texture.wrap;
        match wrap {
            Wrap::Repeat => {}
            Wrap::Mirror => put("wrap", Value::Text("mirror".into())),
            Wrap::Clamp => put("wrap", Value::Text("clamp".into())),
        }
        if texture.nearest {
            put("filter", Value::Text("nearest".into()));
        }
        let turn = Turn::of(&texture.transform);
        if turn.scale != [1.0; 2] {
            put("scale", numbers(turn.scale));
        }
        if turn.degrees != 0.0 {
            put("rotation", Value::Number(turn.degrees));
        }
        if turn.offset != [0.0; 2] {
            put("offset", numbers(turn.offset));
        }
        let is_same = turn.transform() == texture.transform;
        self.lose_many(
            "last digit of turned texture coordinates",
            usize::from(!is_same),
        );
        self.lose_many("wrap of an image along v", usize::from(wrap != other));
        Some(Value::Table(table))
    }

    /// Returns the name of an image's file, which is made for the first material of it.
    fn image_file(&mut self, id: ImageId, of: MaterialId) -> Option<String> {
        if let Some(name) = &self.image_files[id.index()] {
            return Some(name.clone());
        }
        let image = &self.scene.textures.images[id.index()];
        let Some(bytes) = encoded(image) else {
            self.lose("image");
            return None;
        };
        if image.is_srgb && matches!(image.texels, Texels::Words(_)) {
            self.lose("last digit of an image of 16 bits");
        }
        let name = self.file_name(&self.materials[of.index()], id.0, "png");
        self.files.push((name.clone(), bytes));
        self.image_files[id.index()] = Some(name.clone());
        Some(name)
    }
}

/// Encodes an image as PNG: codes of 8 bits as they are, colours of 16 bits, which are kept linear, by
/// sRGB's curve again.
fn encoded(image: &Image) -> Option<Vec<u8>> {
    let [width, height] = image.size();
    let channels = usize::from(image.channels);
    let count = width as usize * height as usize * channels;
    let kinds = [
        [ExtendedColorType::L8, ExtendedColorType::L16],
        [ExtendedColorType::La8, ExtendedColorType::La16],
        [ExtendedColorType::Rgb8, ExtendedColorType::Rgb16],
        [ExtendedColorType::Rgba8, ExtendedColorType::Rgba16],
    ];
    let [narrow, wide] = *kinds.get(channels.checked_sub(1)?)?;
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    match &image.texels {
        Texels::Bytes(all) => encoder.write_image(all.get(..count)?, width, height, narrow),
        Texels::Words(all) => {
            let most = f64::from(u16::MAX);
            let code = |(i, word): (usize, &u16)| {
                let is_alpha = channels.is_multiple_of(2) && i % channels == channels - 1;
                match image.is_srgb && !is_alpha {
                    true => (srgb_from_linear(f64::from(*word) / most) * most + 0.5) as u16,
                    false => *word,
                }
            };
            let words = all.get(..count)?.iter().enumerate().map(code);
            // In the machine's order, which the encoder turns to PNG's.
            let samples: Vec<u8> = words.flat_map(u16::to_ne_bytes).collect();
            encoder.write_image(&samples, width, height, wide)
        }
    }
    .ok()?;
    Some(bytes)
}

/// How texture coordinates are scaled, turned and moved.
struct Turn {
    scale: [f64; 2],
    degrees: f64,
    offset: [f64; 2],
}

impl Turn {
    /// Takes a map apart that [`texture_transform`] has made.
    fn of(map: &[[f64; 3]; 2]) -> Turn {
        let [[a, b, u], [c, d, v]] = *map;
        let offset = [u, v];
        // Without a turn scales may be negative, and stay as they are.
        if b == 0.0 && c == 0.0 {
            return Turn {
                scale: [a, d],
                degrees: 0.0,
                offset,
            };
        }
        let turn = match a == 0.0 && c == 0.0 {
            true => libm::atan2(b, d),
            false => libm::atan2(-c, a),
        };
        let (sin, cos) = libm::sincos(turn);
        Turn {
            scale: [libm::hypot(a, c), b * sin + d * cos],
            degrees: turn.to_degrees(),
            offset,
        }
    }

    /// Returns the map as it is read.
    fn transform(&self) -> [[f64; 3]; 2] {
        texture_transform(self.scale, self.degrees.to_radians(), self.offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_of_coordinates_are_taken_apart() {
        for (scale, degrees, offset, is_exact) in [
            ([1.0, 1.0], 0.0, [0.0, 0.0], true),
            ([2.0, -3.0], 0.0, [0.25, 7.0], true),
            ([-1.0, 0.5], 0.0, [0.0, 0.1], true),
            ([2.0, 3.0], 30.0, [0.5, -0.5], false),
            ([0.5, -2.0], 200.0, [0.0, 0.0], false),
            ([0.0, 2.0], 75.0, [1.0, 2.0], false),
        ] {
            let map = texture_transform(scale, f64::to_radians(degrees), offset);
            let back = Turn::of(&map).transform();
            for (back, map) in back.as_flattened().iter().zip(map.as_flattened()) {
                assert!((back - map).abs() < 1e-14, "{scale:?} {degrees}");
            }
            assert!(!is_exact || back == map, "{scale:?}");
        }
    }
}
