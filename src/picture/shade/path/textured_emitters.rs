//! Emissive triangles that images vary: how much light sampling makes of each, and what a sampled
//! point of one shines.

use super::spot::Spot;
use super::state::Paths;
use super::textured::widening;
use super::{PathTracer, SampleNumbers};
use crate::light::emitter::{Emitters, LightSample, NONE};
use crate::math::lanes::Lanes;
use crate::scene::{MaterialId, MeshId, Rgb, Slot, Tables};
use crate::shade::columns::{STEP, Singles};
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::textures::{Footprint, Place, mean_over};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;

/// An emitter whose radiance is that of a place on images.
#[derive(Clone, Copy, Debug)]
struct TexturedTriangle {
    emitter: u32,
    material: MaterialId,
    attributes: u32,
    triangle: u32,
}

/// The emitters that images vary, by rising id.
#[derive(Clone, Debug, Default)]
pub(super) struct TexturedEmitters(Vec<TexturedTriangle>);

impl TexturedEmitters {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds an emitter, whose id is greater than those before.
    pub fn push(&mut self, emitter: u32, material: MaterialId, (attributes, triangle): (u32, u32)) {
        self.0.push(TexturedTriangle {
            emitter,
            material,
            attributes,
            triangle,
        });
    }

    /// Returns the material of an emitter that images vary, and its place at a point in world
    /// space.
    fn at(&self, emitters: &Emitters, id: u32, point: DVec3) -> Option<(MaterialId, Place)> {
        let found = self.0.binary_search_by_key(&id, |row| row.emitter).ok()?;
        let row = &self.0[found];
        let (weights, area) = emitters.on_triangle(id, point);
        let place = Place {
            attributes: row.attributes,
            triangle: row.triangle,
            weights,
            area: area as f32,
            ..Place::NOWHERE
        };
        Some((row.material, place))
    }
}

/// The mean radiance of each triangle of meshes with a material that images vary. It is the same
/// wherever and whenever the mesh is placed.
#[derive(Clone, Debug, Default)]
pub(super) struct MeanRadiance(HashMap<(MeshId, MaterialId), Arc<[Rgb]>>);

impl MeanRadiance {
    /// Returns the mean radiance of the triangles of a mesh that are of a material, and 0 of the
    /// others; `own` returns a triangle's material.
    pub fn of(
        &mut self,
        scene: &Tables,
        (mesh, attributes): (MeshId, u32),
        material: MaterialId,
        own: impl Fn(u32) -> Option<MaterialId>,
    ) -> &[Rgb] {
        self.0.entry((mesh, material)).or_insert_with(|| {
            let count = scene.meshes.row(mesh).triangles.len() as u32;
            let mean = |triangle: u32| match own(triangle) == Some(material) {
                true => mean_radiance(scene, material, (attributes, triangle)),
                false => [0.0; 3],
            };
            (0..count).map(mean).collect()
        })
    }
}

/// Returns the mean radiance of a triangle as images scale it. What alpha leaves of it is not
/// looked at.
fn mean_radiance(scene: &Tables, material: MaterialId, triangle: (u32, u32)) -> Rgb {
    let mut mean = scene.materials.rows[material.index()].sampled_emission();
    for (slot, texture) in scene.textures.of(material).map_or(&[][..], |row| row.refs) {
        if *slot == Slot::Emission {
            let texel = mean_over(scene, texture, triangle);
            mean = std::array::from_fn(|k| mean[k] * texel[k]);
        }
    }
    mean
}

impl PathTracer<'_> {
    /// Returns the radiance of sampled points in the lanes of `rows`: that of the emitter, or of
    /// the place on images where some vary it. The cone there is that of a ray which is scattered
    /// to it, whose density is `pdf`, so that sampled and met light are of the same levels.
    pub(super) fn sampled_radiance(
        &self,
        (light, pdf): (&LightSample<Singles>, Singles),
        (wave, buffer): (&Paths, &HitBuffer),
        (spot, rows): (&Spot, u32),
        (samples, depth): (SampleNumbers, u32),
        start: impl Fn(usize) -> DVec3,
    ) -> [Singles; 3] {
        let luminaires = self.luminaires;
        if luminaires.textured.is_empty() {
            return light.radiance;
        }
        let mut radiance = light.radiance.map(|channel| channel.to_array());
        for lane in (0..STEP).filter(|lane| rows >> lane & 1 != 0) {
            let emitter = light.emitter.as_ref()[lane];
            if emitter == NONE {
                continue;
            }
            let dir = [light.dir.x, light.dir.y, light.dir.z].map(|x| x.lane(lane));
            let dir = DVec3::from_array(dir);
            let point = start(lane) + dir;
            let Some((material, place)) =
                luminaires.textured.at(&luminaires.emitters, emitter, point)
            else {
                continue;
            };
            let look = &self.materials.rows[material.index()];
            let Some(varied) = &look.varied else {
                continue;
            };
            let (hit, ray) = (spot.hits[lane] as usize, spot.rays[lane] as usize);
            let cone = self.cone_at(wave, (buffer, hit), ray);
            let way = dir.length();
            let spread = cone.spread + widening(pdf.lane(lane));
            let cos = luminaires.emitters.cosine(emitter, dir) as f32;
            let sample = samples.of(wave.rays.pixel[ray]);
            let pick = self.light_picks(wave.key[ray], sample, depth);
            let footprint = Footprint {
                width: (cone.width + spread * way as f32) / cos.max(1e-3).sqrt(),
                pick: self.picks_texels.then_some(pick),
            };
            let mut found = self.emission_at((look, varied), &place, footprint);
            if varied.has_alpha() {
                let there = self.opacity_at(look, varied, &place);
                found = found.map(|c| c * there);
            }
            for (column, channel) in radiance.iter_mut().zip(found) {
                column[lane] = channel;
            }
        }
        radiance.map(|column| Singles::load(&column))
    }
}
