//! Hits ready to be lit, in columns: lights and materials meet them in lanes, all
//! of one width, since plain arithmetic has the same bits at any.

use super::surface::{Surface, Surfaces};
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

    pub fn resize(&mut self, rows: usize) {
        self.0
            .iter_mut()
            .for_each(|column| column.resize(rows, 0.0));
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

    /// Of rising rows, the last of which may come again.
    #[inline(always)]
    pub fn gather(&self, rows: &[u32; STEP]) -> Vec3<Doubles> {
        if adjoin(rows) {
            return self.step(rows[0] as usize);
        }
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

    /// Of rising rows, the last of which may come again.
    #[inline(always)]
    fn scatter(&mut self, rows: &[u32; STEP], v: Vec3<Doubles>) {
        for (column, x) in self.0.iter_mut().zip([v.x, v.y, v.z]) {
            scatter(column, rows, x);
        }
    }
}

/// Whether rising rows, the last of which may come again, are a step of a column.
#[inline(always)]
pub fn adjoin(rows: &[u32; STEP]) -> bool {
    let [first, .., one, last] = *rows;
    one < last && last - first == STEP as u32 - 1
}

#[inline(always)]
fn scatter(column: &mut [f64], rows: &[u32; STEP], x: Doubles) {
    if adjoin(rows) {
        return x.store(&mut column[rows[0] as usize..]);
    }
    for (row, x) in rows.iter().zip(x.to_array()) {
        column[*row as usize] = x;
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

/// Fills up the last step.
fn repeat_last<T: Copy>(column: &mut [T], len: usize) {
    let last = len.checked_sub(1).map(|i| column[i]);
    column[len..].fill_with(|| last.expect("a step has a row"));
}

/// World space; whole steps.
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

    /// Rows for so many hits, none of which is [set](LitHits::set) yet.
    pub fn start(&mut self, hits: usize) {
        let rows = hits.next_multiple_of(STEP);
        let columns = [&mut self.point, &mut self.ng, &mut self.ns];
        columns.into_iter().for_each(|column| column.resize(rows));
        self.incoming.resize(rows);
        self.row.resize(rows, 0);
        self.material.resize(rows, None);
        self.side.resize(rows, 1.0);
        self.offset.resize(rows, 0.0);
        self.len = hits;
    }

    /// Rising rows, the last of which may come again, with what is in their lanes.
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
    }

    /// All hits are set.
    pub fn close(&mut self) {
        let len = self.len;
        let columns = [&mut self.point, &mut self.ng, &mut self.ns];
        for column in columns.into_iter().chain([&mut self.incoming]) {
            column
                .0
                .iter_mut()
                .for_each(|column| repeat_last(column, len));
        }
        repeat_last(&mut self.row, len);
        repeat_last(&mut self.material, len);
        repeat_last(&mut self.side, len);
        repeat_last(&mut self.offset, len);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn column(arena: &Bump) -> Column3<'_> {
        let mut column = Column3::with_capacity(32, arena);
        column.resize(32);
        column
    }

    #[test]
    fn rows_are_set_and_gathered_whether_they_adjoin_or_not() {
        let arena = Bump::new();
        for rows in [
            [8, 9, 10, 11, 12, 13, 14, 15],
            [0, 2, 3, 4, 5, 6, 7, 8],
            // As far from the first to the last as in a step.
            [3, 5, 10, 10, 10, 10, 10, 10],
            [0, 1, 2, 3, 4, 5, 7, 7],
            [9; STEP],
        ] {
            let values = Doubles::load(&rows.map(f64::from));
            let mut column = column(&arena);
            column.scatter(&rows, Vec3::new(values, -values, values + values));
            for row in 0..32 {
                let set = if rows.contains(&row) {
                    f64::from(row)
                } else {
                    0.0
                };
                let expected = DVec3::new(set, -set, 2.0 * set);
                assert_eq!(column.get(row as usize), expected, "{rows:?}");
            }
            let back = column.gather(&rows);
            assert_eq!(back.y.to_array(), (-values).to_array(), "{rows:?}");
        }
    }
}
