//! Hits ready to be lit, in columns: lights and materials meet them in lanes, all
//! of one width, since plain arithmetic has the same bits at any.

use super::surface::Surface;
use crate::math::lanes::{Lanes, f32x8, f64x8};
use crate::math::{Vec3, units};
use crate::scene::MaterialId;
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// Colours in lanes; [`Doubles`] are as many.
pub type Singles = f32x8;
pub type Doubles = f64x8;

/// Lanes of a step.
pub const STEP: usize = <Doubles as Lanes>::COUNT;

/// Points or directions. Whole steps are read: [`Column3::pad`] comes first.
pub struct Column3<'b>([ArenaVec<'b, f64>; 3]);

impl<'b> Column3<'b> {
    pub fn with_capacity(rows: usize, arena: &'b Bump) -> Column3<'b> {
        let column = |_| ArenaVec::with_capacity_in(rows + STEP, arena);
        Column3(std::array::from_fn(column))
    }

    pub fn clear(&mut self) {
        self.0.iter_mut().for_each(|column| column.clear());
    }

    #[inline(always)]
    pub fn push(&mut self, v: DVec3) {
        for (column, x) in self.0.iter_mut().zip(v.to_array()) {
            column.push(x);
        }
    }

    /// The rows of a step whose bits are set.
    #[inline(always)]
    pub fn push_some(&mut self, step: Vec3<Doubles>, rows: u32) {
        for (column, x) in self.0.iter_mut().zip([step.x, step.y, step.z]) {
            keep(column, &x.to_array(), rows);
        }
    }

    /// The last row again, up to whole steps.
    pub fn pad(&mut self) {
        for column in &mut self.0 {
            pad(column);
        }
    }

    #[inline(always)]
    pub fn get(&self, row: usize) -> DVec3 {
        DVec3::new(self.0[0][row], self.0[1][row], self.0[2][row])
    }

    #[inline(always)]
    pub fn step(&self, first: usize) -> Vec3<Doubles> {
        let [x, y, z] = self.0.each_ref().map(|c| Doubles::load(&c[first..]));
        Vec3::new(x, y, z)
    }

    #[inline(always)]
    pub fn gather(&self, rows: &[u32; STEP]) -> Vec3<Doubles> {
        let of = |column: &[f64]| Doubles::load(&rows.map(|row| column[row as usize]));
        let [x, y, z] = self.0.each_ref().map(|column| of(column));
        Vec3::new(x, y, z)
    }

    #[inline(always)]
    fn set_step(&mut self, first: usize, v: Vec3<Doubles>) {
        for (column, x) in self.0.iter_mut().zip([v.x, v.y, v.z]) {
            x.store(&mut column[first..]);
        }
    }
}

/// Appends the values whose bits are set.
#[inline(always)]
pub fn keep<T: Copy>(column: &mut ArenaVec<T>, values: &[T], rows: u32) {
    if rows.trailing_ones() as usize == values.len() {
        return column.extend_from_slice_copy(values);
    }
    let mut rows = rows;
    while rows != 0 {
        column.push(values[rows.trailing_zeros() as usize]);
        rows &= rows - 1;
    }
}

pub fn pad<T: Copy>(column: &mut ArenaVec<T>) {
    if let Some(last) = column.last().copied() {
        column.resize(column.len().next_multiple_of(STEP), last);
    }
}

/// World space.
pub struct LitHits<'b> {
    /// Row of the wave.
    pub row: ArenaVec<'b, u32>,
    pub material: ArenaVec<'b, Option<MaterialId>>,
    pub point: Column3<'b>,
    pub ng: Column3<'b>,
    pub ns: Column3<'b>,
    /// 1 where the ray came from the outer side, else −1.
    pub side: ArenaVec<'b, f64>,
    pub offset: ArenaVec<'b, f64>,
    /// The ray's direction, unit once the hits are [closed](LitHits::close).
    pub incoming: Column3<'b>,
    len: usize,
}

impl<'b> LitHits<'b> {
    pub fn with_capacity(rows: usize, arena: &'b Bump) -> LitHits<'b> {
        let columns = || Column3::with_capacity(rows, arena);
        let numbers = || ArenaVec::with_capacity_in(rows + STEP, arena);
        LitHits {
            row: ArenaVec::with_capacity_in(rows + STEP, arena),
            material: ArenaVec::with_capacity_in(rows + STEP, arena),
            point: columns(),
            ng: columns(),
            ns: columns(),
            side: numbers(),
            offset: numbers(),
            incoming: columns(),
            len: 0,
        }
    }

    pub fn clear(&mut self) {
        let columns = [&mut self.point, &mut self.ng, &mut self.ns];
        columns.into_iter().for_each(Column3::clear);
        self.incoming.clear();
        self.row.clear();
        self.material.clear();
        self.side.clear();
        self.offset.clear();
        self.len = 0;
    }

    #[inline(always)]
    pub fn push(&mut self, row: u32, surface: &Surface, dir: DVec3) {
        self.row.push(row);
        self.material.push(surface.material);
        self.point.push(surface.point);
        self.ng.push(surface.ng);
        self.ns.push(surface.ns);
        self.side.push(if surface.front { 1.0 } else { -1.0 });
        self.offset.push(surface.offset);
        self.incoming.push(dir);
        self.len += 1;
    }

    /// No more hits come.
    pub fn close(&mut self) {
        let columns = [&mut self.point, &mut self.ng, &mut self.ns];
        columns.into_iter().for_each(Column3::pad);
        self.incoming.pad();
        pad(&mut self.row);
        pad(&mut self.material);
        pad(&mut self.side);
        pad(&mut self.offset);
        for first in (0..self.len).step_by(STEP) {
            let unit = units(self.incoming.step(first));
            self.incoming.set_step(first, unit);
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
