//! Normal maps: the shading normals of hits and those of their coats, and the tangents along which
//! highlights are stretched.

use super::emission::narrow;
use super::spot::Spot;
use super::state::Paths;
use super::textured::Varied;
use super::{PathTracer, SampleNumbers};
use crate::light::sampling::Frame;
use crate::math::Vec3;
use crate::math::lanes::Lanes;
use crate::scene::Slot;
use crate::shade::columns::{Doubles, STEP, Singles};
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::textures::{Place, look_up};
use glam::DVec3;

impl PathTracer<'_> {
    /// Bends the shading normals of hits by the normal maps of their materials, and keeps those of
    /// coats: bent by the coat's own map, and else the interpolated ones.
    pub(super) fn bend_normals(
        &self,
        at: (SampleNumbers, u32),
        wave: &Paths,
        buffer: &mut HitBuffer,
    ) {
        if self.materials.bends_coats {
            buffer.keep_coat_normals();
        }
        for hit in 0..buffer.len() {
            let number = self.materials.number(buffer.material[hit]);
            let look = &self.materials.rows[number as usize];
            let Some(varied) = look.varied.as_ref().filter(|varied| varied.has_normals()) else {
                continue;
            };
            let (before, wave) = (buffer.ns.get(hit), (at, wave));
            if let Some(bent) = self.bent((varied, Slot::Normal), before, wave, (buffer, hit)) {
                buffer.ns.set(hit, bent.to_array());
            }
            if !look.bends_coat {
                continue;
            }
            let slot = Slot::ClearcoatNormal;
            let coat = self.bent((varied, slot), before, wave, (buffer, hit));
            // What the coat mirrors has to be above the base's horizon, too.
            let (out, base) = (-buffer.incoming.get(hit), buffer.ns.get(hit));
            let coat = above_surface(coat.unwrap_or(before), base, out);
            buffer.coat_ns.set(hit, coat.to_array());
        }
        buffer.finish_normals(self.materials.bends_coats);
    }

    /// Returns a normal as a map bends it; `None` without a map or without a tangent.
    fn bent(
        &self,
        (varied, slot): (&Varied, Slot),
        before: DVec3,
        (at, wave): ((SampleNumbers, u32), &Paths),
        (buffer, hit): (&HitBuffer, usize),
    ) -> Option<DVec3> {
        let map = varied.map_of(slot)?;
        let place = &buffer.places[hit];
        let side = buffer.side[hit];
        let [tangent, bitangent] = tangents(place, before, side)?;
        let [texel, level, ..] = self.picks(at, wave, buffer.row[hit] as usize);
        let footprint = self.footprint(wave, (buffer, hit as u32), [texel, level]);
        let texel = look_up(&self.world.scene, map, place, footprint).map(f64::from);
        let scale = f64::from(match slot {
            Slot::ClearcoatNormal => varied.texturing.coat_normal_scale,
            _ => varied.texturing.normal_scale,
        });
        let [x, y, z] = [0, 1, 2].map(|k| 2.0 * texel[k] - 1.0);
        let normal = before * side;
        let bent = tangent * (x * scale) + bitangent * (y * scale) + normal * z;
        let bent = (bent * side).normalize_or_zero();
        if bent == DVec3::ZERO {
            return None;
        }
        let facing = buffer.ng.get(hit) * side;
        let out = -buffer.incoming.get(hit);
        Some(above_surface(bent, facing, out))
    }
}

/// Returns the tangent and the bitangent about a normal on the ray's side, as they are from
/// outside; `None` where the mesh has none.
fn tangents(place: &Place, normal: DVec3, side: f64) -> Option<[DVec3; 2]> {
    if place.bitangent == 0.0 {
        return None;
    }
    // The frame of the outer side; seen from inside, all of it is turned.
    let normal = normal * side;
    let tangent = DVec3::from_array(place.tangent);
    let tangent = (tangent - normal * normal.dot(tangent)).normalize_or_zero();
    let bitangent = normal.cross(tangent) * place.bitangent;
    (tangent != DVec3::ZERO).then_some([tangent, bitangent])
}

impl Spot {
    /// Turns the frames of hits so that x is along the tangent and y along the bitangent, where
    /// there are some. Lobes are their own mirror images, so the frame may be left-handed.
    pub(super) fn follow_tangents(&mut self, buffer: &HitBuffer) {
        let Frame { x, y, z } = self.frame;
        let [mut xs, mut ys] = [x, y].map(|v| [v.x, v.y, v.z].map(|x| x.to_array()));
        for i in 0..STEP {
            let hit = self.hits[i] as usize;
            let ns = [self.ns.x, self.ns.y, self.ns.z].map(|x| x.lane(i));
            let Some(place) = buffer.places.get(hit) else {
                continue;
            };
            if let Some([x, y]) = tangents(place, ns.into(), buffer.side[hit]) {
                for k in 0..3 {
                    (xs[k][i], ys[k][i]) = (x[k] as f32, y[k] as f32);
                }
            }
        }
        let load = |columns: [[f32; STEP]; 3]| {
            let [x, y, z] = columns.each_ref().map(|column| Singles::load(column));
            Vec3::new(x, y, z)
        };
        let (x, y) = (load(xs), load(ys));
        self.frame = Frame { x, y, z };
        let mut out = self.frame.local_from_world(narrow::<Singles>(self.out));
        out.z = self.out_local.z;
        self.out_local = out;
    }

    /// Returns the normals of coats in the frames of hits.
    pub(super) fn coat_normals(&self, buffer: &HitBuffer) -> Vec3<Singles> {
        let normal = buffer.coat_ns.gather(&self.hits);
        let is_seen = self.out.dot(normal).gt(Doubles::zero());
        let normal = Vec3::select(is_seen, normal, self.facing);
        self.frame.local_from_world(narrow(normal))
    }
}

/// Turns a normal towards the one that faces the ray until what is mirrored about it leaves the
/// surface: eight halvings of the way between them.
fn above_surface(bent: DVec3, facing: DVec3, out: DVec3) -> DVec3 {
    let least = 0.01_f64.min(0.9 * out.dot(facing));
    let is_above = |n: DVec3| {
        let cos = n.dot(out);
        cos > 0.0 && (n * (2.0 * cos) - out).dot(facing) >= least
    };
    if is_above(bent) {
        return bent;
    }
    let between = |t: f64| (bent * (1.0 - t) + facing * t).normalize_or(facing);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        match is_above(between(middle)) {
            true => high = middle,
            false => low = middle,
        }
    }
    between(high)
}
