//! Hits of one material, as many as there are lanes, prepared for scattering.

use super::emission::narrow;
use super::materials::Look;
use super::state::{Media, Paths};
use crate::light::bsdf::Looks;
use crate::light::sampling::Frame;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};
use crate::shade::columns::{Doubles, STEP, Singles, each_lane, gather, keep};
use crate::shade::hit_buffer::HitBuffer;
use crate::trace::RayKind;

type DoubleMask = <Doubles as Lanes>::Mask;

/// Hits of one material, a step of them.
pub(super) struct Spot {
    /// Rows of the hit buffer and of the wave; the last may repeat.
    pub hits: [u32; STEP],
    pub rays: [u32; STEP],
    /// The lanes that are not repeated.
    pub lanes: u32,
    pub point: Vec3<Doubles>,
    /// The point, lifted off the facet of a smooth mesh: where scattered rays and rays towards
    /// light start, so that facets throw no shadows on their neighbours.
    pub lifted: Vec3<Doubles>,
    /// Lanes whose facet stands for a curved surface: what its shading normal faces is above it.
    pub curved: u32,
    pub ng: Vec3<Doubles>,
    /// The geometric normal on the ray's side.
    pub facing: Vec3<Doubles>,
    /// The shading normal, on the ray's side and not facing away from the ray.
    pub ns: Vec3<Doubles>,
    /// Where the ray came from, unit.
    pub out: Vec3<Doubles>,
    pub frame: Frame<Singles>,
    pub out_local: Vec3<Singles>,
    /// What varies of the material.
    pub looks: Looks<Singles>,
    pub throughput: Vec3<Singles>,
    /// The throughput of paths that are not scattered here, which a cache does not lessen.
    pub passing: Vec3<Singles>,
    /// Index of refraction on the far side over that on the ray's side.
    pub eta: Singles,
    /// The media on the far side.
    pub behind: [Media; STEP],
}

pub(super) fn widen(v: Vec3<Singles>) -> Vec3<Doubles> {
    Vec3::new(v.x.widen(), v.y.widen(), v.z.widen())
}

impl Spot {
    pub fn new(
        (wave, buffer): (&Paths, &HitBuffer),
        look: &Look,
        hits: &[u32; STEP],
        count: usize,
    ) -> Spot {
        let rays = each_lane(|i| buffer.row[hits[i] as usize]);
        let ng = buffer.ng.gather(hits);
        let side: Doubles = gather(&buffer.side, hits);
        let facing = ng * side;
        let out = -buffer.incoming.gather(hits);
        let ns = buffer.ns.gather(hits);
        let ns = Vec3::select(out.dot(ns).gt(Doubles::zero()), ns, facing);
        let frame = Frame::about(narrow(ns));
        let mut out_local = frame.local_from_world(narrow::<Singles>(out));
        out_local.z = out_local.z.max(Singles::splat(f32::MIN_POSITIVE));
        let passing = wave.rays.weight.gather(&rays);
        let throughput = match wave.onward(&rays) {
            None => passing,
            Some(Vec3 { x, y, z }) => Vec3::new(passing.x * x, passing.y * y, passing.z * z),
        };
        let point = buffer.point.gather(hits);
        let lifted = match buffer.wants_lift {
            true => point + buffer.lift.gather(hits),
            false => point,
        };
        Spot {
            hits: *hits,
            rays,
            lanes: (1 << count) - 1,
            point,
            lifted,
            curved: 0,
            ng,
            facing,
            ns,
            out,
            frame,
            out_local,
            looks: look.bsdf.looks(),
            throughput,
            passing,
            eta: Singles::splat(1.0),
            behind: wave.media_of(&rays),
        }
    }

    /// Says whether all paths end here: what they would find has come from a cache.
    pub fn is_spent(&self, wave: &Paths, look: &Look) -> bool {
        let Vec3 { x, y, z } = self.throughput;
        let left = x.max(y).max(z).gt(Singles::zero()).bits() & self.lanes;
        left == 0 && wave.onward(&self.rays).is_some() && !look.material.layers.thin_walled
    }

    /// Computes the directions of perfect mirrors, and in the lanes of `through` those of
    /// perfect refraction, in f64: images in glass are as sharp as the picture.
    pub fn mirrored_or_bent(&self, through: u32, thin: bool) -> Vec3<Doubles> {
        let cos = self.out.dot(self.ns);
        let mirrored = self.ns * (cos + cos) - self.out;
        if through == 0 {
            return mirrored;
        }
        let bent = if thin {
            -self.out
        } else {
            let one = Doubles::splat(1.0);
            let part = one / self.eta.widen();
            let sin2 = part * part * (one - cos * cos);
            let cos_behind = (one - sin2).max(Doubles::zero()).sqrt();
            self.ns * (part * cos - cos_behind) - self.out * part
        };
        Vec3::select(DoubleMask::from_bits(through), bent, mirrored)
    }

    /// Returns where rays start: above the surface in the lanes of `above`, from the lifted
    /// points in those of `curved`, and below it in the others.
    pub fn leave(&self, above: u32, curved: u32, offset: Doubles) -> Vec3<Doubles> {
        let from = Vec3::select(DoubleMask::from_bits(curved), self.lifted, self.point);
        let above = DoubleMask::from_bits(above);
        from + Vec3::select(above, self.facing, -self.facing) * offset
    }

    /// Appends rays, whose states are appended already.
    pub fn push(
        &self,
        ray: (Vec3<Doubles>, Vec3<Doubles>),
        (kinds, rows): (&[RayKind; STEP], u32),
        wave: &Paths,
        next: &mut Paths,
    ) {
        let pixels = each_lane(|i| wave.rays.pixel[self.rays[i] as usize]);
        next.rays.push_some(rows, ray, &pixels);
        keep(&mut next.rays.kind, kinds, rows);
        let keys = each_lane(|i| wave.key[self.rays[i] as usize]);
        keep(&mut next.key, &keys, rows);
    }
}
