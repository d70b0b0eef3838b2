//! Feature lines, as of a technical drawing: where fine samples beside one another meet different
//! things, where the surface turns sharply, and where it is interrupted in depth.
//!
//! Samples lie on a grid that is [`FINE`] times as fine as the pixels, over a tile and a margin, so
//! that a line is the same from both sides of a tile's border. Between two samples lies a crack or
//! none; what is within half a line's width of a crack is ink.

use super::camera::RayGenerator;
use super::config::Backdrop;
use super::pixel_order::{BLOCK, Spot, morton_order};
use crate::math::lanes::Lanes;
use crate::scene::{MaterialId, Rgb};
use crate::shade::{Doubles, Integrator, RayCounts, STEP, Scratch, Statistics, Surface};
use crate::trace::{HitId, RayKind};
use bumpalo::Bump;
use glam::DVec3;

/// Samples along a pixel's side.
pub const FINE: u32 = 4;
/// Half the width of outlines, and of other lines, in samples: 1.5 and 1 pixels wide.
const OUTLINE: f64 = 0.75 * FINE as f64;
const CREASE: f64 = 0.5 * FINE as f64;
/// Samples beyond a tile that its lines may come from, and one more for their neighbours.
const MARGIN: u32 = OUTLINE as u32 + 2;
/// Side of the blocks of samples that are traced at once.
const SIDE: u32 = 2 * BLOCK;
/// The least turn of the normal between two samples that is a crease, in radians: 25°. Facets of
/// round things turn by less.
const TURN: f64 = 0.436;
/// How many times the turns beside it such a turn must exceed, for round things that are small in
/// the picture turn fast everywhere.
const SUDDEN: f64 = 1.5;
/// How far beside both tangent planes, in distances of samples, a surface is interrupted: one that
/// curves to its own outline stays within 1.
const GAP: f64 = 2.0;

/// The paper that surfaces show, and the ink of lines.
const PAPER: Rgb = [1.0; 3];
const INK: Rgb = [0.0; 3];

/// What a sample meets.
#[derive(Clone, Copy)]
struct Met {
    instance: u64,
    material: Option<MaterialId>,
    point: DVec3,
    /// Unit normals of the surface and of its shading, on the ray's side.
    flat: DVec3,
    smooth: DVec3,
}

/// What lies between two samples.
#[derive(Clone, Copy, PartialEq)]
enum Crack {
    None,
    Crease,
    Outline,
}

/// What a pixel shows.
#[derive(Clone, Copy)]
pub struct Drawn {
    /// Of which what is not covered is left out.
    pub color: Rgb,
    /// The share that lines and surfaces cover.
    pub alpha: f32,
    /// The share that lines cover.
    pub ink: f32,
}

/// Draws the lines of a tile.
pub struct Lines<'a> {
    pub generator: &'a RayGenerator,
    /// Finds first hits, and nothing else.
    pub integrator: Integrator<'a>,
    pub backdrop: Backdrop,
    /// The tile's left upper pixel, and its width and height.
    pub corner: (u32, u32),
    pub size: (u32, u32),
}

/// A tile's grid of samples, by rows.
struct Grid<'a> {
    width: usize,
    height: usize,
    met: &'a [Option<Met>],
}

impl Lines<'_> {
    /// Draws the tile: calls `put` with each row of its film.
    pub fn draw(
        &self,
        arena: &Bump,
        scratch: &mut Scratch,
        mut put: impl FnMut(u32, Drawn),
    ) -> RayCounts {
        let width = (self.size.0 * FINE + 2 * MARGIN) as usize;
        let height = (self.size.1 * FINE + 2 * MARGIN) as usize;
        let met = arena.alloc_slice_fill_copy(width * height, None);
        let mut counts = RayCounts::default();
        for y in (0..height as u32).step_by(SIDE as usize) {
            for x in (0..width as u32).step_by(SIDE as usize) {
                let size = (SIDE.min(width as u32 - x), SIDE.min(height as u32 - y));
                let found = |row: u32, hit: Met| {
                    let at = (y + row / size.0) as usize * width + (x + row % size.0) as usize;
                    met[at] = Some(hit);
                };
                counts.add(&self.trace((x, y), &morton_order(size), scratch, found));
            }
        }
        let grid = Grid { width, height, met };
        let ink = arena.alloc_slice_fill_copy(width * height, false);
        grid.ink(self.generator, ink);
        for y in 0..self.size.1 {
            for x in 0..self.size.0 {
                put(y * self.size.0 + x, self.pixel(&grid, ink, (x, y)));
            }
        }
        counts
    }

    /// Traces a block of samples, whose first is `first` of the tile's grid.
    fn trace(
        &self,
        first: (u32, u32),
        order: &[Spot],
        scratch: &mut Scratch,
        mut found: impl FnMut(u32, Met),
    ) -> RayCounts {
        let queue = scratch.camera_rays();
        for some in order.chunks(STEP) {
            let spots: [Spot; STEP] = std::array::from_fn(|i| some[i.min(some.len() - 1)]);
            // Positions in pixels: whole ones, and the way into them.
            let place = |corner: u32, at: u32| {
                let fine = f64::from(corner) * f64::from(FINE) + f64::from(at) - f64::from(MARGIN);
                let pixel = (fine / f64::from(FINE)).floor();
                (pixel, (fine + 0.5) / f64::from(FINE) - pixel)
            };
            let x = spots.map(|spot| place(self.corner.0, first.0 + spot.x));
            let y = spots.map(|spot| place(self.corner.1, first.1 + spot.y));
            let load = |of: [f64; STEP]| Doubles::load(&of);
            let across = self
                .generator
                .across(load(x.map(|p| p.0)), load(x.map(|p| p.1)));
            let up = self
                .generator
                .up(load(y.map(|p| p.0)), load(y.map(|p| p.1)));
            let rays = self.generator.through(across, up);
            let rows = self.generator.seeing(&rays.1, some.len());
            queue.push_some(rows, rays, &spots.map(|spot| spot.row));
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
        let mut statistics = Statistics::of_counts();
        let mut first_hit = |row: u32, surface: &Surface, id: HitId| {
            let hit = Met {
                instance: id.instance,
                material: surface.material,
                point: surface.point,
                flat: surface.facing(),
                smooth: surface.ns,
            };
            found(row, hit);
        };
        // Nobody looks at the emission and the backdrop that are added here.
        let film = &mut [[0.0; 3]; (SIDE * SIDE) as usize];
        let integrator = &self.integrator;
        integrator.run(
            scratch,
            film,
            &mut [],
            &mut statistics,
            Some(&mut first_hit),
        );
        statistics.counts
    }

    /// Returns the mean of a pixel's samples.
    fn pixel(&self, grid: &Grid, ink: &[bool], (x, y): (u32, u32)) -> Drawn {
        let backdrop = match self.backdrop {
            Backdrop::Auto => PAPER,
            Backdrop::Color(color) => color,
            Backdrop::Transparent => [0.0; 3],
        };
        let (mut sum, mut covered, mut lines) = ([0.0; 3], 0.0, 0.0);
        for j in 0..FINE {
            for i in 0..FINE {
                let at = grid.at(MARGIN + x * FINE + i, MARGIN + y * FINE + j);
                let (shown, covers) = match (ink[at], grid.met[at].is_some()) {
                    (true, _) => (INK, 1.0),
                    (false, true) => (PAPER, 1.0),
                    (false, false) => (backdrop, 0.0),
                };
                for (sum, shown) in sum.iter_mut().zip(shown) {
                    *sum += shown;
                }
                covered += covers;
                lines += f32::from(u8::from(ink[at]));
            }
        }
        let share = 1.0 / (FINE * FINE) as f32;
        Drawn {
            color: sum.map(|c| c * share),
            alpha: covered * share,
            ink: lines * share,
        }
    }
}

impl Grid<'_> {
    fn at(&self, x: u32, y: u32) -> usize {
        y as usize * self.width + x as usize
    }

    /// Marks the samples that lines cover. Cracks at the grid's own rim, whose neighbours are not
    /// known, reach no pixel.
    fn ink(&self, generator: &RayGenerator, ink: &mut [bool]) {
        for y in 1..self.height - 1 {
            for x in 1..self.width - 1 {
                let at = y * self.width + x;
                for (step, [dx, dy]) in [(1, [0.5, 0.0]), (self.width, [0.0, 0.5])] {
                    let on = |ways: isize| {
                        let to = at as isize + ways * step as isize;
                        usize::try_from(to).ok().and_then(|to| *self.met.get(to)?)
                    };
                    let radius = match crack([on(-1), on(0), on(1), on(2)], generator) {
                        Crack::None => continue,
                        Crack::Crease => CREASE,
                        Crack::Outline => OUTLINE,
                    };
                    self.draw_dot([x as f64 + dx, y as f64 + dy], radius, ink);
                }
            }
        }
    }

    fn draw_dot(&self, [x, y]: [f64; 2], radius: f64, ink: &mut [bool]) {
        let range = |at: f64, end: usize| {
            let last = (at + radius).floor().min(end as f64 - 1.0);
            (at - radius).ceil().max(0.0) as usize..=last as usize
        };
        for j in range(y, self.height) {
            for i in range(x, self.width) {
                let away = (i as f64 - x).powi(2) + (j as f64 - y).powi(2);
                if away <= radius * radius {
                    ink[j * self.width + i] = true;
                }
            }
        }
    }
}

/// Says what lies between the second and the third of four samples in a row.
fn crack([before, a, b, after]: [Option<Met>; 4], generator: &RayGenerator) -> Crack {
    let (a, b) = match (a, b) {
        (Some(a), Some(b)) => (a, b),
        (None, None) => return Crack::None,
        _ => return Crack::Outline,
    };
    let between = b.point - a.point;
    let beside = a.flat.dot(between).abs().min(b.flat.dot(between).abs());
    let [near, far] = [a, b].map(|met| generator.pixel_width(met.point));
    if beside > GAP * near.min(far) / f64::from(FINE) {
        return Crack::Outline;
    }
    if a.instance != b.instance || a.material != b.material {
        return Crack::Crease;
    }
    let turn = |a: Met, b: Met| libm::acos(a.smooth.dot(b.smooth).clamp(-1.0, 1.0));
    let beside = |a: Met, b: Option<Met>| {
        let same = b.filter(|b| b.instance == a.instance);
        same.map_or(f64::INFINITY, |b| turn(a, b))
    };
    let usual = beside(a, before).min(beside(b, after));
    let usual = if usual.is_finite() { usual } else { 0.0 };
    match turn(a, b) > TURN + SUDDEN * usual {
        true => Crack::Crease,
        false => Crack::None,
    }
}
