//! Guides of a denoiser: the albedo and the shading normal of what each sample meets first that is
//! neither a mirror nor smooth glass. Those are followed, and so are holes and smooth panes, for
//! what is seen in them has edges that the mirror itself has not.

use super::PathTracer;
use super::layers::{LayerPlan, LayerSlots};
use super::state::Paths;
use crate::scene::Rgb;
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::textures::Footprint;
use crate::trace::HitId;

/// The guides, in the order of their layers.
pub const GUIDES: [&str; 2] = ["denoising_albedo", "denoising_normal"];

impl PathTracer<'_> {
    /// Notes what paths meet that have come by mirrors, smooth glass and holes alone, in place of
    /// these. `guiding` has the weight that the pixel filter gives each path's sample, 0 of paths
    /// whose guides are known.
    pub(super) fn guide(
        &self,
        (layers, plan): (&mut LayerSlots, &LayerPlan),
        (wave, guiding): (&Paths, &[f32]),
        instance: &[u64],
        buffer: &HitBuffer,
    ) {
        let Some(first) = plan.guides() else {
            return;
        };
        let mut set = |ray: usize, guides: [Rgb; GUIDES.len()]| {
            for (k, guide) in guides.into_iter().enumerate() {
                layers.set(first + k, wave.rays.pixel[ray], guide);
            }
        };
        for (ray, weight) in guiding.iter().enumerate() {
            // Behind a hole there may be nothing.
            if *weight != 0.0 && instance[ray] == HitId::NONE.instance {
                set(ray, [[0.0; 3]; 2]);
            }
        }
        for hit in 0..buffer.len() {
            let ray = buffer.row[hit] as usize;
            let weight = guiding[ray];
            if weight == 0.0 {
                continue;
            }
            let look = &self.materials.rows[self.materials.number(buffer.material[hit]) as usize];
            let is_unlit = look.material.layers.unlit;
            if look.bsdf.only_delta && !look.bsdf.is_black && !is_unlit {
                continue;
            }
            let albedo = match is_unlit {
                // What it shows is its own light, which is not scattered.
                true => [0.0; 3],
                false => {
                    let material = match &look.varied {
                        None => look.material,
                        Some(varied) => {
                            let at = buffer.look_up(hit, Footprint::POINT);
                            self.material_there((look, varied), at)
                        }
                    };
                    material.base_color.map(|c| c.clamp(0.0, 1.0) * weight)
                }
            };
            let normal = buffer.ns.get(hit).as_vec3() * weight;
            set(ray, [albedo, normal.to_array()]);
        }
    }
}
