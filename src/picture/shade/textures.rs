//! Look-ups of textures and of vertices' colours at hits.
//!
//! Each is one function of the place on a triangle or another surface, the ray's footprint and
//! random numbers, in plain f64 and f32 arithmetic, so that its bits depend on nothing else.

use super::barycentric::barycentrics;
use super::interaction::InteractionPart;
use super::patterns::{Spot, base_color_at, roughness_at};
use super::surface::Surface;
use crate::accel::World;
use crate::math::Affine;
use crate::scene::{
    Image, Material, MaterialId, Model, Rgb, Shape, Slot, Tables, TextureRef, TexturedMaterial,
    Textures, Wrap,
};
use crate::trace::HitId;
use glam::DVec3;

/// Where a hit lies on a triangle of a mesh that has attributes; or, without attributes, on the
/// triangle in texture coordinates whose corners are (0, 0), (1, 0) and (0, 1), as if it were flat
/// and of the texels' size at the hit.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The mesh's row of attributes; `u32::MAX` where there are none.
    pub attributes: u32,
    pub triangle: u32,
    /// Of the second and third corner, of a mesh's triangle from 0 to 1; without attributes these
    /// are u and v.
    pub weights: [f64; 2],
    /// Twice the triangle's area in world space.
    pub area: f32,
    /// The interpolated tangent in world space, of any length, and the sign of the bitangent as
    /// seen from the outer side; zeros where the mesh has none.
    pub tangent: [f64; 3],
    pub bitangent: f64,
}

impl Place {
    pub const NOWHERE: Place = Place {
        attributes: u32::MAX,
        triangle: 0,
        weights: [0.0; 2],
        area: 0.0,
        tangent: [0.0; 3],
        bitangent: 0.0,
    };

    /// Sets the tangent from those of the mesh's corners.
    pub(super) fn set_tangent(
        &mut self,
        tangents: &[[i16; 4]],
        mirrored: bool,
        to_world: impl Fn([f64; 3]) -> [f64; 3],
    ) {
        let first = 3 * self.triangle as usize;
        let corners: [[i16; 4]; 3] = std::array::from_fn(|k| tangents[first + k]);
        let [x, y, z, w] = self.mean(|k| corners[k].map(f64::from));
        self.tangent = to_world([x, y, z]);
        self.bitangent = if (w < 0.0) != mirrored { -1.0 } else { 1.0 };
    }

    /// Interpolates what the corners have.
    #[inline(always)]
    fn mean<const N: usize>(&self, corner: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        let [v, w] = self.weights;
        let u = (1.0 - v - w).max(0.0);
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        std::array::from_fn(|k| a[k] * u + b[k] * v + c[k] * w)
    }

    /// Returns the texture coordinates of a set at the corners; zeros where a mesh has others
    /// only.
    fn corners(&self, scene: &Tables, set: u8) -> [[f64; 2]; 3] {
        let meshes = &scene.meshes;
        let Some(row) = meshes.attributes.rows.get(self.attributes as usize) else {
            return [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        };
        if set >= row.sets {
            return [[0.0; 2]; 3];
        }
        let first = row.uvs + usize::from(set) * row.vertices;
        let corners = meshes.row(row.mesh).triangles[self.triangle as usize];
        corners.map(|v| meshes.attributes.uvs[first + v as usize].map(f64::from))
    }

    /// Returns the texture coordinates of the first set.
    pub fn uv(&self, scene: &Tables) -> [f64; 2] {
        let corners = self.corners(scene, 0);
        self.mean(|k| corners[k])
    }

    /// Returns the linear colour and alpha of the vertices, white where there are none.
    pub fn color(&self, scene: &Tables) -> [f32; 4] {
        let meshes = &scene.meshes;
        let row = meshes.attributes.rows.get(self.attributes as usize);
        let Some((row, first)) = row.and_then(|row| Some((row, row.colors?))) else {
            return [1.0; 4];
        };
        let corners = meshes.row(row.mesh).triangles[self.triangle as usize];
        let of = |k: usize| meshes.attributes.colors[first + corners[k] as usize].map(f64::from);
        self.mean(of).map(|x| (x * (1.0 / 65_535.0)) as f32)
    }
}

/// Says whether a map turns right hands into left ones.
pub(super) fn mirrors(map: &Affine) -> bool {
    let [x, y, z] = map.linear().map(DVec3::from_array);
    x.cross(y).dot(z) < 0.0
}

/// How a look-up takes its texel: a mean, or one texel that random numbers choose so that the
/// mean of many look-ups is the mean of texels (Pharr et al. 2024, "Filtering after Shading with
/// Stochastic Texture Filtering").
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// The width of the ray's cone on the surface, in world units; 0 for a point.
    pub width: f32,
    /// Random numbers for the texel and the level, if one texel is taken.
    pub pick: Option<[f32; 2]>,
}

impl Footprint {
    pub const POINT: Footprint = Footprint {
        width: 0.0,
        pick: None,
    };
}

/// Looks a texture up.
pub fn look_up(
    scene: &Tables,
    texture: &TextureRef,
    place: &Place,
    footprint: Footprint,
) -> [f32; 4] {
    let corners = place.corners(scene, texture.uv_set);
    let [u, v] = place.mean(|k| corners[k]);
    let map = &texture.transform;
    let at = [0, 1].map(|k| map[k][0] * u + map[k][1] * v + map[k][2]);
    let textures = &scene.textures;
    let image = &textures.images[texture.image.index()];
    let level = match footprint.width > 0.0 && !texture.nearest {
        true => level_of(texture, image, (place, &corners), footprint.width),
        false => 0.0,
    };
    sample((textures, image), texture, at, (level, footprint.pick))
}

/// Returns about the mean of a texture over a triangle of a mesh, by its row of attributes: of
/// up to 16 equal parts, each of the level whose texels are as large as the part.
pub fn mean_over(
    scene: &Tables,
    texture: &TextureRef,
    (attributes, triangle): (u32, u32),
) -> [f32; 4] {
    /// The parts along a side of the triangle.
    const PARTS: u32 = 4;
    let at = |x: u32, y: u32, third: u32| {
        let along = |n: u32| f64::from(3 * n + third) / f64::from(3 * PARTS);
        let place = Place {
            attributes,
            triangle,
            weights: [along(x), along(y)],
            // Of texture coordinates alone, which is all that the level depends on.
            area: 1.0,
            ..Place::NOWHERE
        };
        let footprint = Footprint {
            width: 1.0 / PARTS as f32,
            pick: None,
        };
        look_up(scene, texture, &place, footprint)
    };
    let mut sum = [0.0; 4];
    for x in 0..PARTS {
        for y in 0..PARTS - x {
            // The part that is like the whole, and the one between it and its neighbours.
            let is_between = x + y + 1 < PARTS;
            for third in 1..=1 + u32::from(is_between) {
                let texel = at(x, y, third);
                sum = std::array::from_fn(|k| sum[k] + texel[k]);
            }
        }
    }
    sum.map(|sum| sum / (PARTS * PARTS) as f32)
}

/// Returns the level whose texels are about as wide as a cone (Akenine-Möller et al. 2021,
/// "Improved Shader and Texture Level of Detail Using Ray Cones").
fn level_of(
    texture: &TextureRef,
    image: &Image,
    (place, corners): (&Place, &[[f64; 2]; 3]),
    width: f32,
) -> f32 {
    let [a, b, c] = corners;
    let [p, q] = [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]];
    let [[ux, vx, _], [uy, vy, _]] = texture.transform;
    let [columns, rows] = image.size().map(f64::from);
    let texels = (p[0] * q[1] - p[1] * q[0]).abs() * (ux * vy - vx * uy).abs() * columns * rows;
    // Texels across the cone, squared.
    let across = texels / f64::from(place.area) * f64::from(width) * f64::from(width);
    match across > 1.0 && across < f64::MAX {
        true => 0.5 * log2(across),
        false => 0.0,
    }
}

/// Returns the logarithm by its leading digits: the exponent and a straight line between, within
/// 0.09 of the right one, which is the same on every machine.
fn log2(x: f64) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 52) as i32 - 1023;
    let part = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52) - 1.0;
    exponent as f32 + part as f32
}

/// Samples an image at texture coordinates and a level.
fn sample(
    (textures, image): (&Textures, &Image),
    texture: &TextureRef,
    at: [f64; 2],
    (level, pick): (f32, Option<[f32; 2]>),
) -> [f32; 4] {
    let last = image.levels.len() - 1;
    let level = level.min(last as f32);
    let (lower, part) = (level as usize, level - (level as usize) as f32);
    if let Some([texel, between]) = pick {
        let level = lower + usize::from(between < part);
        return texel_at((textures, image), texture, at, (level, Some(texel)));
    }
    let near = texel_at((textures, image), texture, at, (lower, None));
    if part == 0.0 {
        return near;
    }
    let far = texel_at((textures, image), texture, at, (lower + 1, None));
    std::array::from_fn(|k| near[k] + (far[k] - near[k]) * part)
}

/// Reads a level: the mean of the four texels around, or one of them.
fn texel_at(
    (textures, image): (&Textures, &Image),
    texture: &TextureRef,
    at: [f64; 2],
    (level, pick): (usize, Option<f32>),
) -> [f32; 4] {
    let size = image.levels[level].1;
    // Beyond this, coordinates have no places between texels.
    const FARTHEST: f64 = 1e9;
    let place = |k: usize| {
        let along = at[k] * f64::from(size[k]);
        if along.abs() <= FARTHEST { along } else { 0.0 }
    };
    if texture.nearest {
        let [x, y] = [0, 1].map(|k| wrapped(texture.wrap[k], place(k).floor() as i64, size[k]));
        return textures.texel(image, level, x, y);
    }
    let shifted = [place(0) - 0.5, place(1) - 0.5];
    let low = shifted.map(f64::floor);
    let part: [f32; 2] = [0, 1].map(|k| (shifted[k] - low[k]) as f32);
    let column = |more: i64| wrapped(texture.wrap[0], low[0] as i64 + more, size[0]);
    let row = |more: i64| wrapped(texture.wrap[1], low[1] as i64 + more, size[1]);
    if let Some(mut u) = pick {
        let mut more = [0; 2];
        for k in 0..2 {
            let right = u < part[k];
            more[k] = i64::from(right);
            // The rest of the number is as good as new.
            u = match right {
                true => u / part[k],
                false => (u - part[k]) / (1.0 - part[k]),
            };
        }
        return textures.texel(image, level, column(more[0]), row(more[1]));
    }
    let [xs, ys] = [[column(0), column(1)], [row(0), row(1)]];
    let line = |y: u32| {
        let [a, b] = xs.map(|x| textures.texel(image, level, x, y));
        mix(a, b, part[0])
    };
    mix(line(ys[0]), line(ys[1]), part[1])
}

fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

/// Returns the texel that stands for one beyond the image.
fn wrapped(wrap: Wrap, at: i64, size: u32) -> u32 {
    let size = i64::from(size);
    let inside = match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::Clamp => at.clamp(0, size - 1),
        Wrap::Mirror => {
            let at = at.rem_euclid(2 * size);
            at.min(2 * size - 1 - at)
        }
    };
    inside as u32
}

/// Returns the base colour of a material at a place, and its alpha.
pub(super) fn colored(
    scene: &Tables,
    row: &TexturedMaterial,
    base_color: Rgb,
    (place, footprint): (&Place, Footprint),
) -> [f32; 4] {
    let [r, g, b] = base_color;
    let mut color = [r, g, b, 1.0];
    if row.texturing.vertex_color {
        let own = place.color(scene);
        color = std::array::from_fn(|k| color[k] * own[k]);
    }
    for (slot, texture) in row.refs {
        match slot {
            Slot::BaseColor => {
                let texel = look_up(scene, texture, place, footprint);
                color = std::array::from_fn(|k| color[k] * texel[k]);
            }
            Slot::Opacity => color[3] *= look_up(scene, texture, place, footprint)[0],
            _ => {}
        }
    }
    color
}

/// Where a material that varies is looked up: on images, in patterns, and how wide.
#[derive(Clone, Copy, Debug)]
pub struct LookUp<'h> {
    pub place: &'h Place,
    pub spot: &'h Spot,
    pub footprint: Footprint,
}

impl LookUp<'_> {
    /// Returns the base colour of a material that images and patterns vary.
    pub(super) fn base_color(&self, scene: &Tables, row: &TexturedMaterial, own: Rgb) -> Rgb {
        let wide = (self.spot, self.footprint.width);
        let own = base_color_at(scene, row.texturing, own, wide);
        let [r, g, b, _] = colored(scene, row, own, (self.place, self.footprint));
        [r, g, b]
    }

    /// Returns metallic and roughness of a material that images and patterns vary.
    pub(super) fn metallic_roughness(
        &self,
        scene: &Tables,
        row: &TexturedMaterial,
        [mut metallic, roughness]: [f32; 2],
    ) -> [f32; 2] {
        let wide = (self.spot, self.footprint.width);
        let mut roughness = roughness_at(scene, row.texturing, roughness, wide);
        for (slot, texture) in row.refs {
            if *slot == Slot::MetallicRoughness {
                let [_, g, b, _] = look_up(scene, texture, self.place, self.footprint);
                (metallic, roughness) = (metallic * b, roughness * g);
            }
        }
        [metallic, roughness]
    }
}

/// Returns where a ray meets a surface on images, without a mesh's area and tangent, and in
/// patterns.
pub fn place_of(
    (part, world): (&InteractionPart, &World),
    (org, dir): (DVec3, DVec3),
    (surface, id): (&Surface, HitId),
) -> (Place, Spot) {
    let spot = part.spot(surface.point, surface.ng);
    let attributes = match world.entry_of(id.instance).shape {
        Shape::Mesh(mesh) => world.scene.meshes.attributes.of(mesh),
        _ => None,
    };
    let weights = barycentrics(world, org, dir, id);
    let place = match (attributes, weights) {
        (Some(attributes), Some(weights)) => Place {
            attributes,
            triangle: id.primitive,
            weights: weights.map(|x| x.clamp(0.0, 1.0)),
            ..Place::NOWHERE
        },
        _ => part.place(surface.point, surface.ng, id.primitive),
    };
    (place, spot)
}

/// Returns a material as it is at a place, as far as base colour, metallic, roughness and
/// emission go; without a ray's footprint.
pub fn material_at(
    scene: &Tables,
    (id, own): (Option<MaterialId>, &Material),
    (place, spot): (&Place, &Spot),
) -> Material {
    let mut all = *own;
    let Some(row) = id.and_then(|id| scene.textures.of(id)) else {
        return all;
    };
    let at = LookUp {
        place,
        spot,
        footprint: Footprint::POINT,
    };
    all.base_color = at.base_color(scene, &row, all.base_color);
    match &mut all.model {
        Model::Phong { diffuse, .. } => *diffuse = at.base_color(scene, &row, *diffuse),
        Model::MetallicRoughness {
            metallic,
            roughness,
        } => {
            let own = [*metallic, *roughness];
            [*metallic, *roughness] = at.metallic_roughness(scene, &row, own);
        }
    }
    for (slot, texture) in row.refs {
        if *slot == Slot::Emission {
            let texel = look_up(scene, texture, place, Footprint::POINT);
            all.emission = std::array::from_fn(|k| all.emission[k] * texel[k]);
        }
    }
    all
}

#[cfg(test)]
mod tests;
