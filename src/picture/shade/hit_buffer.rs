//! The hit buffer: columns of surfaces to shade, read by lights and materials in lanes.

use super::columns::{Column3, Doubles, STEP, repeat_last, scatter};
use super::patterns::Spot;
use super::surface::{Surface, Surfaces};
use super::textures::{Footprint, LookUp, Place};
use crate::math::lanes::Lanes;
use crate::math::{Vec3, units};
use crate::scene::{MaterialId, Textures};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

/// Surfaces of a batch's hits in world space, padded so that a step may start at each.
pub struct HitBuffer<'b> {
    /// Row of the ray queue.
    pub row: ArenaVec<'b, u32>,
    pub material: ArenaVec<'b, Option<MaterialId>>,
    pub point: Column3<'b, Doubles>,
    pub ng: Column3<'b, Doubles>,
    pub ns: Column3<'b, Doubles>,
    /// 1 if the ray came from the outer side, else −1.
    pub side: ArenaVec<'b, f64>,
    pub offset: ArenaVec<'b, f64>,
    pub shadow_offset: ArenaVec<'b, f64>,
    /// The ray's direction, unit after [`finish`](HitBuffer::finish).
    pub incoming: Column3<'b, Doubles>,
    /// From the hit to the surface that vertex normals suggest, where it is asked for.
    pub lift: Column3<'b, Doubles>,
    pub wants_lift: bool,
    /// The normals of coats, where they are kept.
    pub coat_ns: Column3<'b, Doubles>,
    /// Where hits lie on images, where textures are asked for.
    pub places: ArenaVec<'b, Place>,
    pub wants_places: bool,
    /// Where hits lie in patterns, where there are some.
    pub spots: ArenaVec<'b, Spot>,
    pub wants_spots: bool,
    len: usize,
}

impl<'b> HitBuffer<'b> {
    pub fn with_capacity(rows: usize, arena: &'b Bump) -> HitBuffer<'b> {
        let columns = || Column3::with_capacity(rows, arena);
        let numbers = || ArenaVec::with_capacity_in(rows + STEP, arena);
        HitBuffer {
            row: ArenaVec::with_capacity_in(rows + STEP, arena),
            material: ArenaVec::with_capacity_in(rows + STEP, arena),
            point: columns(),
            ng: columns(),
            ns: columns(),
            side: numbers(),
            offset: numbers(),
            shadow_offset: numbers(),
            incoming: columns(),
            lift: Column3::with_capacity(0, arena),
            wants_lift: false,
            coat_ns: Column3::with_capacity(0, arena),
            places: ArenaVec::new_in(arena),
            wants_places: false,
            spots: ArenaVec::new_in(arena),
            wants_spots: false,
            len: 0,
        }
    }

    /// Makes room for that many hits, none of which is [set](HitBuffer::set) yet.
    pub fn start(&mut self, hits: usize) {
        // A step may start at any of the hits.
        let rows = if hits == 0 { 0 } else { hits + STEP };
        for column in [
            &mut self.point,
            &mut self.ng,
            &mut self.ns,
            &mut self.incoming,
        ] {
            column.resize(rows, [0.0; 3]);
        }
        if self.wants_lift {
            self.lift.truncate(0);
            self.lift.resize(rows, [0.0; 3]);
        }
        if self.wants_places {
            self.places.clear();
            self.places.resize(rows, Place::NOWHERE);
        }
        if self.wants_spots {
            self.spots.clear();
            self.spots.resize(rows, Spot::NOWHERE);
        }
        self.row.resize(rows, 0);
        self.material.resize(rows, None);
        self.side.resize(rows, 1.0);
        self.offset.resize(rows, 0.0);
        self.shadow_offset.resize(rows, 0.0);
        self.len = hits;
    }

    /// Stores the surfaces of a step in any rows; one that repeats gets the last.
    #[inline(always)]
    pub fn set(&mut self, rows: &[u32; STEP], surfaces: &Surfaces<Doubles>, dir: Vec3<Doubles>) {
        let one = Doubles::splat(1.0);
        self.point.scatter(rows, surfaces.point);
        self.ng.scatter(rows, surfaces.ng);
        self.ns.scatter(rows, surfaces.ns);
        self.incoming.scatter(rows, dir);
        let side = Lanes::select(surfaces.front, one, -one);
        scatter(&mut self.side, rows, side);
        scatter(&mut self.offset, rows, surfaces.offset);
        scatter(&mut self.shadow_offset, rows, surfaces.shadow_offset);
    }

    /// Pads the columns to whole steps and normalises directions; call it once all hits
    /// are set.
    pub fn finish(&mut self) {
        let len = self.len;
        for column in [
            &mut self.point,
            &mut self.ng,
            &mut self.ns,
            &mut self.incoming,
        ] {
            column.repeat_last(len);
        }
        if self.wants_lift {
            self.lift.repeat_last(len);
        }
        if self.wants_places {
            repeat_last(&mut self.places, len);
        }
        if self.wants_spots {
            repeat_last(&mut self.spots, len);
        }
        repeat_last(&mut self.row, len);
        repeat_last(&mut self.material, len);
        repeat_last(&mut self.side, len);
        repeat_last(&mut self.offset, len);
        repeat_last(&mut self.shadow_offset, len);
        for first in (0..self.len).step_by(STEP) {
            let unit = units(self.incoming.step(first));
            self.incoming.set_step(first, unit);
        }
    }

    /// Keeps the shading normals as those of coats, before normal maps change the others.
    pub fn keep_coat_normals(&mut self) {
        self.coat_ns.truncate(0);
        self.coat_ns
            .resize(self.len.next_multiple_of(STEP), [0.0; 3]);
        for hit in 0..self.len {
            self.coat_ns.set(hit, self.ns.row(hit));
        }
    }

    /// Pads the shading normals again, after some of them are changed, and those of
    /// coats where they are kept.
    pub fn finish_normals(&mut self, has_coats: bool) {
        let len = self.len;
        self.ns.repeat_last(len);
        if has_coats {
            self.coat_ns.repeat_last(len);
        }
    }

    /// Asks for what a scene's textures and patterns are looked up by.
    pub fn want_look_ups(&mut self, textures: &Textures) {
        self.wants_places = !textures.is_empty();
        self.wants_spots = !textures.patterns.is_empty();
    }

    /// Returns where the material of a hit is looked up.
    pub fn look_up(&self, hit: usize, footprint: Footprint) -> LookUp<'_> {
        LookUp {
            place: &self.places[hit],
            spot: self.spots.get(hit).unwrap_or(&Spot::NOWHERE),
            footprint,
        }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn surface(&self, i: usize) -> Surface {
        Surface {
            point: self.point.get(i),
            ng: self.ng.get(i),
            ns: self.ns.get(i),
            front: self.side[i] > 0.0,
            offset: self.offset[i],
            material: self.material[i],
        }
    }
}
