//! Materials that vary from hit to hit: their looks, normals and emission at hits, and surfaces
//! that are there in part only.

use super::materials::Look;
use super::state::{Cone, Paths};
use super::{PathTracer, SampleNumbers};
use crate::light::bsdf::{Bsdf, Looks, Variation};
use crate::math::lanes::Lanes;
use crate::scene::{
    Alpha, Material, MaterialId, Model, Rgb, Slot, Tables, TextureRef, TexturedMaterial, Texturing,
};
use crate::shade::columns::{STEP, Singles};
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::hit_columns::HitColumns;
use crate::shade::hits::fill_hit_buffer;
use crate::shade::ray_queue::RayQueue;
use crate::shade::textures::{Footprint, LookUp, Place, colored, look_up};
use crate::trace::{HitId, RayKind, TraceScratch};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// How a material varies.
#[derive(Debug)]
pub(super) struct Varied {
    pub texturing: Texturing,
    pub refs: Vec<(Slot, TextureRef)>,
    /// Whether more varies than base colour, metallic and roughness, emission and normals.
    pub is_deep: bool,
}

impl Varied {
    /// Says whether the surface is there in part only.
    pub fn has_alpha(&self) -> bool {
        self.texturing.alpha != Alpha::Opaque
    }

    /// Says whether a normal map bends the surface or its coat.
    pub fn has_normals(&self) -> bool {
        self.has(Slot::Normal) || self.has(Slot::ClearcoatNormal)
    }

    /// Returns the normal map of the base or of the coat.
    pub fn map_of(&self, slot: Slot) -> Option<&TextureRef> {
        let mut refs = self.refs.iter();
        refs.find(|(of, _)| *of == slot).map(|(_, map)| map)
    }

    fn has(&self, slot: Slot) -> bool {
        self.refs.iter().any(|(of, _)| *of == slot)
    }

    fn row(&self) -> TexturedMaterial<'_> {
        TexturedMaterial {
            // Whose it is does not matter for look-ups.
            material: MaterialId(0),
            texturing: &self.texturing,
            refs: &self.refs,
        }
    }
}

impl Look {
    /// Makes the look of a material that varies. What alpha leaves out is left out before
    /// shading, so its opacity is 1 there.
    pub(super) fn varied(mut material: Material, row: &TexturedMaterial) -> Look {
        let mut varied = Varied {
            texturing: *row.texturing,
            refs: row.refs.to_vec(),
            is_deep: row.refs.iter().any(|(slot, _)| !slot.is_plain()),
        };
        if let Model::Phong { .. } = material.model {
            // Its lobes have constants of their own.
            let texturing = &varied.texturing;
            let has_pattern = texturing.base_color.is_some();
            varied.is_deep |= row.has(Slot::BaseColor) || texturing.vertex_color || has_pattern;
        }
        let opacity = material.layers.opacity;
        if varied.has_alpha() {
            material.layers.opacity = 1.0;
        }
        let varies = row.has(Slot::MetallicRoughness) || row.texturing.roughness.is_some();
        let variation = match varies {
            true => Variation::Textured,
            false => Variation::Uniform,
        };
        let mut look = Look::new(material);
        look.bsdf = Bsdf::varied(&material, variation);
        look.alpha = opacity;
        look.bends_coat = material.layers.clearcoat > 0.0 && varied.has_normals();
        look.follows_tangents = varied.texturing.follows_tangents;
        look.varied = Some(varied);
        look
    }
}

/// Pads of random numbers for textures lie behind those of all depths.
const TEXTURE_PADS: u32 = 1 << 16;

/// Those for textures of sampled lights lie behind those for textures of hits.
const LIGHT_TEXTURE_PADS: u32 = 1 << 17;

/// Rays pass no more surfaces that are not there than this.
const MOST_PASSED: usize = 256;

/// Rays that pass surfaces that are not there, by row of their wave.
pub(super) struct Passing<'b> {
    rays: RayQueue<'b>,
    hits: HitColumns<'b>,
    /// The rest of each ray's random number; negative before it is drawn.
    rest: ArenaVec<'b, f32>,
}

impl<'b> Passing<'b> {
    pub fn new(arena: &'b Bump) -> Passing<'b> {
        Passing {
            rays: RayQueue::with_capacity(0, arena),
            hits: HitColumns::empty(arena),
            rest: ArenaVec::new_in(arena),
        }
    }
}

/// Returns how much wider the cone of a scattered ray gets: about a quarter of the width of the
/// lobe whose density this is.
pub(super) fn widening(pdf: f32) -> f32 {
    match pdf > 0.0 {
        true => (0.25 / pdf.sqrt()).min(0.5),
        false => 0.5,
    }
}

impl PathTracer<'_> {
    /// Returns the footprint of a ray at its hit.
    pub(super) fn footprint(
        &self,
        wave: &Paths,
        (buffer, hit): (&HitBuffer, u32),
        pick: [f32; 2],
    ) -> Footprint {
        let hit = hit as usize;
        let ray = buffer.row[hit] as usize;
        let Cone { width, .. } = self.cone_at(wave, (buffer, hit), ray);
        // The mean of the ellipse's axes.
        let cos = buffer.incoming.get(hit).dot(buffer.ng.get(hit)).abs() as f32;
        Footprint {
            width: width / cos.max(1e-3).sqrt(),
            pick: self.picks_texels.then_some(pick),
        }
    }

    /// Returns a ray's cone where it meets a surface.
    pub(super) fn cone_at(
        &self,
        wave: &Paths,
        (buffer, hit): (&HitBuffer, usize),
        ray: usize,
    ) -> Cone {
        let Some(cones) = &wave.cones else {
            return Cone {
                width: 0.0,
                spread: 0.0,
            };
        };
        let Cone { width, spread } = cones[ray];
        let way = buffer.point.get(hit) - DVec3::from_array(wave.rays.org(ray));
        Cone {
            width: width + spread * way.length() as f32,
            spread,
        }
    }

    /// Returns the cones of the rays that go on from some hits.
    pub(super) fn cones_after(
        &self,
        (wave, buffer): (&Paths, &HitBuffer),
        (hits, rays): (&[u32; STEP], &[u32; STEP]),
        wider: [f32; STEP],
    ) -> [Cone; STEP] {
        std::array::from_fn(|i| {
            let cone = self.cone_at(wave, (buffer, hits[i] as usize), rays[i] as usize);
            Cone {
                spread: cone.spread + wider[i],
                ..cone
            }
        })
    }

    /// Returns the random numbers of a hit's look-ups.
    pub(super) fn picks(
        &self,
        (samples, depth): (SampleNumbers, u32),
        wave: &Paths,
        ray: usize,
    ) -> [f32; 4] {
        let sample = samples.of(wave.rays.pixel[ray]);
        self.sampler
            .pad_one(wave.key[ray], sample, TEXTURE_PADS + depth)
    }

    /// Returns the random numbers of the look-up at a sampled point of a light.
    pub(super) fn light_picks(&self, key: u32, sample: u32, depth: u32) -> [f32; 2] {
        let pad = LIGHT_TEXTURE_PADS + depth;
        let [texel, level, ..] = self.sampler.pad_one(key, sample, pad);
        [texel, level]
    }

    /// Returns the looks of some hits of a material.
    pub(super) fn looks_at(
        &self,
        (look, varied): (&Look, &Varied),
        at: (SampleNumbers, u32),
        wave: &Paths,
        (buffer, hits): (&HitBuffer, &[u32; STEP]),
    ) -> Looks<Singles> {
        let mut color = [[0.0_f32; STEP]; 3];
        let (mut metallic, mut roughness) = ([0.0_f32; STEP], [0.0_f32; STEP]);
        let own = look.bsdf.looks::<f32>();
        for (i, hit) in hits.iter().enumerate() {
            if i > 0 && hits[i] == hits[i - 1] {
                for column in color.iter_mut().chain([&mut metallic, &mut roughness]) {
                    column[i] = column[i - 1];
                }
                continue;
            }
            let at = self.looked_up(at, wave, (buffer, *hit));
            let looks = one_look(&self.world.scene, varied, own, at);
            for (column, channel) in color.iter_mut().zip(looks.base_color) {
                column[i] = channel;
            }
            (metallic[i], roughness[i]) = (looks.metallic, looks.roughness);
        }
        Looks {
            base_color: color.each_ref().map(|column| Singles::load(column)),
            metallic: Singles::load(&metallic),
            roughness: Singles::load(&roughness),
            coat_normal: None,
        }
    }

    /// Returns where a hit's material is looked up, and how wide.
    fn looked_up<'h>(
        &self,
        at: (SampleNumbers, u32),
        wave: &Paths,
        (buffer, hit): (&'h HitBuffer, u32),
    ) -> LookUp<'h> {
        let [texel, level, ..] = self.picks(at, wave, buffer.row[hit as usize] as usize);
        let footprint = self.footprint(wave, (buffer, hit), [texel, level]);
        buffer.look_up(hit as usize, footprint)
    }

    /// Returns the look of one hit whose material varies in more than shading varies in lanes:
    /// that of a material of the numbers that are there.
    pub(super) fn look_at(
        &self,
        (look, varied): (&Look, &Varied),
        at: (SampleNumbers, u32),
        wave: &Paths,
        (buffer, hit): (&HitBuffer, u32),
    ) -> Look {
        let at = self.looked_up(at, wave, (buffer, hit));
        Look {
            bends_coat: look.bends_coat,
            follows_tangents: look.follows_tangents,
            ..Look::new(self.material_there((look, varied), at))
        }
    }

    /// Returns a material of the numbers that are at a place.
    pub(super) fn material_there(&self, (look, varied): (&Look, &Varied), at: LookUp) -> Material {
        let scene = &self.world.scene;
        let looks = one_look(scene, varied, look.bsdf.looks(), at);
        let mut material = look.material;
        match &mut material.model {
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => (*metallic, *roughness) = (looks.metallic, looks.roughness),
            Model::Phong { diffuse, .. } => {
                *diffuse = at.base_color(scene, &varied.row(), *diffuse);
            }
        }
        material.base_color = looks.base_color;
        for (slot, texture) in &varied.refs {
            if !slot.is_plain() {
                let texel = look_up(scene, texture, at.place, at.footprint);
                scale(&mut material, *slot, texel, varied.texturing.film_least);
            }
        }
        material
    }

    /// Returns the radiance that a surface shows by itself at a hit.
    pub(super) fn shine_at(
        &self,
        (look, varied): (&Look, &Varied),
        at: (SampleNumbers, u32),
        wave: &Paths,
        (buffer, hit): (&HitBuffer, usize),
    ) -> Rgb {
        let scene = &self.world.scene;
        let at = self.looked_up(at, wave, (buffer, hit as u32));
        let mut shown = self.emission_at((look, varied), at.place, at.footprint);
        if look.material.layers.unlit {
            let color = at.base_color(scene, &varied.row(), look.material.base_color);
            let opacity = look.material.layers.opacity;
            shown = std::array::from_fn(|k| shown[k] + color[k] * opacity);
        }
        shown
    }

    /// Returns the emission of a material at a place; holes do not shine.
    pub(super) fn emission_at(
        &self,
        (look, varied): (&Look, &Varied),
        place: &Place,
        footprint: Footprint,
    ) -> Rgb {
        let opacity = look.material.layers.opacity;
        let mut shown = look.material.emission.map(|c| c * opacity);
        for (slot, texture) in &varied.refs {
            if *slot == Slot::Emission {
                let texel = look_up(&self.world.scene, texture, place, footprint);
                shown = std::array::from_fn(|k| shown[k] * texel[k]);
            }
        }
        shown
    }

    /// Returns the share of a surface that is there at a place.
    pub(super) fn opacity_at(&self, look: &Look, varied: &Varied, place: &Place) -> f32 {
        let row = varied.row();
        let point = Footprint::POINT;
        let [.., alpha] = colored(&self.world.scene, &row, [0.0; 3], (place, point));
        match varied.texturing.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Blend => (alpha * look.alpha).clamp(0.0, 1.0),
            Alpha::Mask(cutoff) if alpha >= cutoff => look.alpha,
            Alpha::Mask(_) => 0.0,
        }
    }

    /// Brings the rays of a wave to the first surfaces that are there: those of a mask where it
    /// says so, those that blend by a random number. Surfaces passed count as no bounce.
    pub(super) fn pass_cutouts(
        &self,
        at: (SampleNumbers, u32),
        (wave, hits): (&mut Paths, &mut HitColumns),
        (passing, buffer, trace): (&mut Passing, &mut HitBuffer, &mut TraceScratch),
    ) {
        let Passing {
            rays,
            hits: found,
            rest,
        } = passing;
        rays.truncate(0);
        rest.clear();
        for round in 0..=MOST_PASSED {
            // The first time all rays of the wave, then those that passed.
            let count = match round {
                0 => wave.rays.len(),
                _ => rays.len(),
            };
            if round > 0 {
                found.closest((self.world, &self.kernels), rays, trace);
                for i in 0..count {
                    let ray = rays.pixel[i] as usize;
                    wave.rays.set_org(ray, rays.org(i));
                    hits.t[ray] = found.t[i];
                    hits.instance[ray] = found.instance[i];
                    hits.primitive[ray] = found.primitive[i];
                }
            }
            let some = match round {
                0 => &*hits,
                _ => &*found,
            };
            let mut met = some.instance[..count].iter();
            if met.all(|instance| *instance == HitId::NONE.instance) {
                break;
            }
            let queue = if round == 0 { &wave.rays } else { &*rays };
            fill_hit_buffer(
                (self.world, self.kernels.precision),
                (queue, 0..count),
                (&some.t, &some.instance, &some.primitive),
                buffer,
            );
            for hit in 0..buffer.len() {
                let number = self.materials.number(buffer.material[hit]);
                let look = &self.materials.rows[number as usize];
                let Some(varied) = look.varied.as_ref().filter(|varied| varied.has_alpha()) else {
                    continue;
                };
                let row = buffer.row[hit] as usize;
                let (ray, mut left) = match round {
                    0 => (row, -1.0),
                    _ => (rays.pixel[row] as usize, rest[row]),
                };
                let there = self.opacity_at(look, varied, &buffer.places[hit]);
                if there >= 1.0 || round == MOST_PASSED {
                    continue;
                }
                if there > 0.0 {
                    if left < 0.0 {
                        [_, _, left, _] = self.picks(at, wave, ray);
                    }
                    if left < there {
                        continue;
                    }
                    // The rest of the number is as good as new.
                    left = ((left - there) / (1.0 - there)).min(1.0 - f32::EPSILON);
                }
                let surface = buffer.surface(hit);
                let dir = DVec3::from_array(wave.rays.dir(ray));
                if self.materials.has_media {
                    let way = surface.point - DVec3::from_array(wave.rays.org(ray));
                    let share = self
                        .materials
                        .left(&wave.media(ray as u32), way.length() as f32);
                    let weight = wave.rays.weight.row(ray);
                    let weight = std::array::from_fn(|k| weight[k] * share[k]);
                    wave.rays.weight.set(ray, weight);
                }
                let cone = self.cone_at(wave, (buffer, hit), ray);
                if let Some(cones) = &mut wave.cones {
                    cones[ray] = cone;
                }
                let org = surface.leave(dir);
                let kind = RayKind::Refraction;
                rays.push(org, dir, f32::INFINITY, ray as u32, [1.0; 3], kind);
                rest.push(left);
            }
            if round > 0 {
                rays.drop_first(count);
                rest.drain(..count);
            }
            if rays.is_empty() {
                break;
            }
        }
    }
}

/// Returns base colour, metallic and roughness at a place.
fn one_look(scene: &Tables, varied: &Varied, mut own: Looks<f32>, at: LookUp) -> Looks<f32> {
    let row = varied.row();
    own.base_color = at.base_color(scene, &row, own.base_color);
    let numbers = [own.metallic, own.roughness];
    [own.metallic, own.roughness] = at.metallic_roughness(scene, &row, numbers);
    own
}

/// Scales a number of a material by a texel.
fn scale(material: &mut Material, slot: Slot, texel: [f32; 4], film_least: f32) {
    let [r, g, b, a] = texel;
    let layers = &mut material.layers;
    let tinted = |color: Rgb| [color[0] * r, color[1] * g, color[2] * b];
    match slot {
        Slot::BaseColor
        | Slot::MetallicRoughness
        | Slot::Emission
        | Slot::Normal
        | Slot::ClearcoatNormal
        | Slot::Opacity => {}
        Slot::Specular => layers.specular *= a,
        Slot::SpecularColor => layers.specular_color = tinted(layers.specular_color),
        Slot::Clearcoat => layers.clearcoat *= r,
        Slot::ClearcoatRoughness => layers.clearcoat_roughness *= g,
        Slot::SheenColor => layers.sheen_color = tinted(layers.sheen_color),
        Slot::SheenRoughness => layers.sheen_roughness *= a,
        Slot::Transmission => material.transmission *= r,
        Slot::Iridescence => layers.iridescence *= r,
        Slot::IridescenceThickness => {
            let most = layers.iridescence_thickness;
            layers.iridescence_thickness = film_least + (most - film_least) * g;
        }
        Slot::Anisotropy => {
            let turn = libm::atan2f(2.0 * g - 1.0, 2.0 * r - 1.0);
            layers.anisotropy_rotation += turn;
            layers.anisotropy *= b;
        }
        Slot::DiffuseTransmission => layers.diffuse_transmission *= a,
        Slot::DiffuseTransmissionColor => {
            layers.diffuse_transmission_color = tinted(layers.diffuse_transmission_color);
        }
    }
}
