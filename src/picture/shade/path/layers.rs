//! Layers of light: what a pixel gets, parted by the way of the light.
//!
//! Light that a path meets before it is scattered is `emission` or `environment`. What it meets
//! after one scattering is direct, what it meets after several indirect; each is parted into
//! diffuse and specular by what the lobes at the first scattering share of its weight, by channel.
//! Holes and smooth panes do not scatter. Rays towards sampled light count as if the path had been
//! scattered to the light. Beside this, all light goes to the layer of its group, the last layer
//! being that of lights without a group. Nothing here is made unless it was asked for.

use super::Slot;
use super::guides::GUIDES;
use super::luminaires::Luminaires;
use crate::light::emitter::Emitters;
use crate::scene::{Lit, MaterialId, Rgb, Tables};
use crate::shade::columns::{STEP, Singles};
use bumpalo::Bump;

/// The layers of the light's way, in the order of their numbers.
pub const LIGHT_LAYERS: [&str; 6] = [
    "diffuse_direct",
    "diffuse_indirect",
    "specular_direct",
    "specular_indirect",
    "emission",
    "environment",
];

/// Numbers of [`LIGHT_LAYERS`].
const DIFFUSE: usize = 0;
const SPECULAR: usize = 2;
pub(super) const EMISSION: usize = 4;
pub(super) const ENVIRONMENT: usize = 5;

/// Which layers are kept, and to which group each light belongs.
#[derive(Debug)]
pub struct LayerPlan {
    /// Number of layers of groups, that of lights without a group last; 0 if none are kept.
    groups: usize,
    /// Whether the last layers are a denoiser's guides.
    has_guides: bool,
    /// By emitter, and by material.
    of_emitter: Vec<u32>,
    of_material: Vec<u32>,
    sky: u32,
}

impl LayerPlan {
    /// Plans the layers of light, those of groups if the scene has some and `by_group`, and a
    /// denoiser's guides if `has_guides`.
    pub fn new(
        scene: &Tables,
        (luminaires, emitter_materials): (&Luminaires, &[(u32, MaterialId)]),
        lights: usize,
        (by_group, has_guides): (bool, bool),
    ) -> LayerPlan {
        let names = scene.light_groups.names().len() as u32;
        let by_group = by_group && names > 0;
        let of = |lit| scene.light_groups.of(lit).unwrap_or(names);
        let materials = (0..scene.materials.len() as u32).map(MaterialId);
        // Last are surfaces without a material.
        let of_material: Vec<u32> = materials
            .map(|id| of(Lit::Material(id)))
            .chain([names])
            .collect();
        let mut of_emitter = vec![names; luminaires.emitters.count()];
        for (row, group) in of_emitter.iter_mut().enumerate().take(lights) {
            *group = of(Lit::Light(crate::scene::LightId(row as u32)));
        }
        for (emitter, material) in emitter_materials {
            of_emitter[*emitter as usize] = of_material[material.index()];
        }
        LayerPlan {
            groups: if by_group { names as usize + 1 } else { 0 },
            has_guides,
            of_emitter,
            of_material,
            sky: of(Lit::Environment),
        }
    }

    /// Says whether groups, and a denoiser's guides, are kept.
    pub fn kept(&self) -> (bool, bool) {
        (self.groups > 0, self.has_guides)
    }

    /// Returns the number of layers.
    pub fn count(&self) -> usize {
        let guides = if self.has_guides { GUIDES.len() } else { 0 };
        LIGHT_LAYERS.len() + self.groups + guides
    }

    /// Returns the number of the first of a denoiser's guides, if they are kept.
    pub fn guides(&self) -> Option<usize> {
        let first = LIGHT_LAYERS.len() + self.groups;
        self.has_guides.then_some(first)
    }

    /// Returns the group of light of which nobody knows where it comes from.
    pub(super) fn unknown(&self) -> u32 {
        self.groups.saturating_sub(1) as u32
    }

    /// Returns the group of what shines of a material.
    pub(super) fn of_material(&self, number: u32) -> u32 {
        // Ambient occlusion has materials of its own.
        let last = self.of_material.last().copied().unwrap_or(0);
        *self.of_material.get(number as usize).unwrap_or(&last)
    }

    /// Returns the group of a sampled emitter; that of the sky lies after the last.
    pub(super) fn of_emitter(&self, emitter: u32) -> u32 {
        *self.of_emitter.get(emitter as usize).unwrap_or(&self.sky)
    }
}

/// The way of a path, as far as layers ask for it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trail {
    /// How often the path was scattered: 0, 1, or more.
    scattered: u8,
    /// The diffuse share of its first scattering.
    diffuse: Rgb,
}

impl Trail {
    /// Returns the way after another scattering of this diffuse share.
    pub(super) fn after(&self, diffuse: Rgb) -> Trail {
        match self.scattered {
            0 => Trail {
                scattered: 1,
                diffuse,
            },
            _ => Trail {
                scattered: 2,
                ..*self
            },
        }
    }

    /// Returns the way after a cache has given a part of the light of the first scattering's diffuse
    /// lobe, with the factors of what is found later: what is missing there is diffuse.
    pub(super) fn without_cached(&self, onward: Rgb) -> Trail {
        if self.scattered != 1 {
            return *self;
        }
        let diffuse = std::array::from_fn(|k| match onward[k] > 0.0 {
            true => ((self.diffuse[k] - (1.0 - onward[k])) / onward[k]).clamp(0.0, 1.0),
            false => self.diffuse[k],
        });
        Trail { diffuse, ..*self }
    }
}

/// Returns shares lane by lane.
pub(super) fn shares(share: [Singles; 3]) -> [Rgb; STEP] {
    let [r, g, b] = share.map(|c| c.to_array());
    std::array::from_fn(|i| [r[i], g[i], b[i]])
}

/// Where a ray towards sampled light takes its light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LayerKey {
    pub trail: Trail,
    /// The light's group; [`SKY`] where all that is infinitely far has its share.
    pub group: u32,
}

/// Stands for the groups of all that is infinitely far in a direction.
pub(super) const SKY: u32 = u32::MAX;

/// The layers of one sample of a tile's pixels.
pub struct LayerSlots<'b> {
    rows: &'b mut [Slot],
    pixels: usize,
}

impl<'b> LayerSlots<'b> {
    pub fn new(pixels: usize, layers: usize, arena: &'b Bump) -> LayerSlots<'b> {
        LayerSlots {
            rows: arena.alloc_slice_fill_copy(pixels * layers, [0.0; 4]),
            pixels,
        }
    }

    /// Empties all layers.
    pub fn clear(&mut self) {
        self.rows.fill([0.0; 4]);
    }

    /// Lists the layers' rows, each one a pixel.
    pub fn layers(&self) -> impl Iterator<Item = &[Slot]> {
        self.rows.chunks(self.pixels)
    }

    /// Sets a pixel of a layer.
    pub(super) fn set(&mut self, layer: usize, pixel: u32, [r, g, b]: Rgb) {
        self.rows[layer * self.pixels + pixel as usize] = [r, g, b, 0.0];
    }

    fn put(&mut self, layer: usize, pixel: u32, light: Rgb) {
        let slot = &mut self.rows[layer * self.pixels + pixel as usize];
        for k in 0..3 {
            slot[k] += light[k];
        }
    }

    /// Adds light of a group that a path has met: to the layer `own` if it has come straight.
    pub(super) fn add(
        &mut self,
        plan: &LayerPlan,
        pixel: u32,
        (trail, own, group): (&Trail, usize, u32),
        light: Rgb,
    ) {
        match trail.scattered {
            0 => self.put(own, pixel, light),
            n => {
                let indirect = usize::from(n > 1);
                let diffuse = std::array::from_fn(|k| light[k] * trail.diffuse[k]);
                let specular = std::array::from_fn(|k| light[k] * (1.0 - trail.diffuse[k]));
                self.put(DIFFUSE + indirect, pixel, diffuse);
                self.put(SPECULAR + indirect, pixel, specular);
            }
        }
        if plan.groups > 0 {
            self.put(LIGHT_LAYERS.len() + group as usize, pixel, light);
        }
    }

    /// Adds light from a direction of the sky, which suns may share.
    pub(super) fn add_sky(
        &mut self,
        (plan, emitters): (&LayerPlan, &Emitters),
        pixel: u32,
        (trail, dir): (&Trail, [f32; 3]),
        light: Rgb,
    ) {
        let mut left = light;
        if plan.groups > 0 {
            let all = emitters.sky_radiance::<f32>(crate::math::Vec3::new(dir[0], dir[1], dir[2]));
            for (id, radiance) in emitters.suns_at(dir) {
                let part: Rgb = std::array::from_fn(|k| match all[k] > 0.0 {
                    true => light[k] * (radiance[k] / all[k]),
                    false => 0.0,
                });
                left = std::array::from_fn(|k| left[k] - part[k]);
                self.add(plan, pixel, (trail, ENVIRONMENT, plan.of_emitter(id)), part);
            }
        }
        self.add(plan, pixel, (trail, ENVIRONMENT, plan.sky), left);
    }
}

/// What the pixels of a tile collect of one sample.
pub(super) struct Film<'s, 'b> {
    pub slots: &'s mut [Slot],
    pub layers: Option<&'s mut LayerSlots<'b>>,
}
