//! Materials as the path tracer needs them.

use super::state::Media;
use super::textured::Varied;
use crate::light::bsdf::Bsdf;
use crate::scene::{Material, MaterialId, Rgb, Textures};
use crate::trace::{Solids, TraceScratch};
use glam::DVec3;

/// What the path tracer needs to know of each material, and of all of them together.
#[derive(Debug)]
pub struct Materials {
    /// By material, and last that of surfaces without one.
    pub(super) rows: Vec<Look>,
    /// True if light inside some material is bent, absorbed or both.
    pub(super) has_media: bool,
    /// True if some medium bends the three colours differently.
    pub(super) has_dispersion: bool,
    /// True if some material shines.
    pub(super) any_shines: bool,
    /// True if shadow rays may pass some surface.
    pub(super) has_holes: bool,
    /// True if some material varies from hit to hit; if the alpha of some does, and if some have
    /// normal maps.
    pub(super) has_textures: bool,
    pub(super) has_cutouts: bool,
    pub(super) has_normal_maps: bool,
    /// True if the normals of some coats are not those below.
    pub(super) bends_coats: bool,
}

/// A material as the path tracer reads it.
#[derive(Debug)]
pub(super) struct Look {
    pub(super) material: Material,
    pub(super) bsdf: Bsdf,
    /// Absorption inside, per world unit.
    pub(super) absorption: Rgb,
    /// How it varies from hit to hit.
    pub(super) varied: Option<Varied>,
    /// The factor of an alpha that varies.
    pub(super) alpha: f32,
    /// Whether the normal of its coat is not that of the base.
    pub(super) bends_coat: bool,
    /// Whether its highlights are stretched along the tangents of meshes.
    pub(super) follows_tangents: bool,
}

impl Materials {
    /// Prepares a scene's materials, which textures may vary.
    pub fn new(rows: &[Material], textures: &Textures) -> Materials {
        let all = rows.iter().copied().chain([Material::default()]);
        let mut rows: Vec<Look> = all.map(Look::new).collect();
        for row in textures.iter() {
            let look = &mut rows[row.material.index()];
            *look = Look::varied(look.material, &row);
        }
        let has = |what: fn(&Varied) -> bool| {
            let mut all = rows.iter().filter_map(|look| look.varied.as_ref());
            all.any(what)
        };
        Materials {
            has_textures: has(|_| true),
            has_cutouts: has(Varied::has_alpha),
            has_normal_maps: has(Varied::has_normals),
            bends_coats: rows.iter().any(|look| look.bends_coat),
            any_shines: rows.iter().any(|look| look.shine().is_some()),
            has_media: rows.iter().any(Look::has_medium),
            has_dispersion: rows.iter().any(Look::has_dispersion),
            has_holes: rows.iter().any(Look::lets_shadow_rays_pass),
            rows,
        }
    }

    /// Returns the medium that is there where several overlap: the one of the highest priority,
    /// of the highest number among equals.
    pub(super) fn innermost(&self, media: &Media) -> Option<u32> {
        let priority = |m: &u32| (self.rows[*m as usize].material.layers.priority, *m);
        media.iter().max_by_key(priority)
    }

    /// Returns the share of light that the innermost of some media leaves over a way in world
    /// units, which may be infinite (Beer and Lambert).
    pub(super) fn left(&self, media: &Media, way: f32) -> Rgb {
        let Some(medium) = self.innermost(media) else {
            return [1.0; 3];
        };
        let left = |absorption: f32| match absorption {
            0.0 => 1.0,
            _ => libm::expf(-absorption * way),
        };
        self.rows[medium as usize].absorption.map(left)
    }

    /// Says whether paths and shadow rays may pass some surface.
    pub fn has_holes(&self) -> bool {
        self.has_holes
    }

    /// Returns the index of refraction of a medium, 1 without one, for red, green or blue: that
    /// of `KHR_materials_dispersion`, whose red and blue are the Fraunhofer lines C and F.
    pub(super) fn index(&self, medium: Option<u32>, channel: usize) -> f32 {
        let of = |m: u32| {
            let Material { ior, layers, .. } = &self.rows[m as usize].material;
            let part = [-0.025, 0.0, 0.025][channel];
            ior + (ior - 1.0) * layers.dispersion * part
        };
        medium.map_or(1.0, of)
    }

    /// Says whether a medium bends the three colours differently.
    pub(super) fn disperses(&self, medium: Option<u32>) -> bool {
        self.has_dispersion
            && medium.is_some_and(|m| self.rows[m as usize].material.layers.dispersion > 0.0)
    }

    /// Says whether some material varies from hit to hit.
    pub fn has_textures(&self) -> bool {
        self.has_textures
    }

    /// Says whether light inside some material is bent or absorbed.
    pub fn has_media(&self) -> bool {
        self.has_media
    }

    /// Says whether a surface of this material bounds a medium.
    pub fn bounds_medium(&self, id: Option<MaterialId>) -> bool {
        self.rows[self.number(id) as usize].has_medium()
    }

    /// Lists the media around a point: those of the solids that contain it.
    pub fn media_at(&self, solids: &Solids, point: DVec3, trace: &mut TraceScratch) -> Media {
        let mut media = Media::default();
        solids.around(point, trace, |material| {
            if self.bounds_medium(material) {
                media.enter(self.number(material));
            }
        });
        media
    }

    #[inline(always)]
    pub(super) fn number(&self, id: Option<MaterialId>) -> u32 {
        id.map_or(self.rows.len() as u32 - 1, |id| id.index() as u32)
    }
}

impl Look {
    pub(super) fn new(material: Material) -> Look {
        let layers = &material.layers;
        let absorb = |c: f32| -libm::logf(c.max(1e-6)) / layers.attenuation_distance;
        Look {
            bsdf: Bsdf::new(&material),
            absorption: layers.attenuation_color.map(absorb),
            material,
            varied: None,
            alpha: 1.0,
            bends_coat: false,
            follows_tangents: false,
        }
    }

    /// Returns the radiance of the surface itself, if it shines.
    pub(super) fn shine(&self) -> Option<Rgb> {
        let unlit = self.material.layers.unlit;
        let shown = |k: usize| {
            self.material.emission[k]
                + if unlit {
                    self.material.base_color[k]
                } else {
                    0.0
                }
        };
        let opacity = self.material.layers.opacity;
        let radiance = [shown(0), shown(1), shown(2)].map(|c| c * opacity);
        (radiance != [0.0; 3]).then_some(radiance)
    }

    /// Says whether the material bounds a medium of its own.
    pub(super) fn has_medium(&self) -> bool {
        self.material.transmission > 0.0 && !self.material.layers.thin_walled
    }

    pub(super) fn has_dispersion(&self) -> bool {
        self.has_medium() && self.material.layers.dispersion > 0.0
    }

    pub(super) fn lets_shadow_rays_pass(&self) -> bool {
        let layers = &self.material.layers;
        let is_pane = self.material.transmission > 0.0 && layers.thin_walled;
        let cutout = self.varied.as_ref().is_some_and(Varied::has_alpha);
        cutout || layers.opacity < 1.0 || is_pane && self.bsdf.only_delta
    }
}
