//! Gathers the indirect light of points: rays over the hemisphere above each, as the samples of a
//! pixel of its own.

use super::{Asked, Filler};
use crate::light::hemisphere::{Change, Sight, change};
use crate::light::sampler::{Kind, Sampler};
use crate::light::sampling::cosine_hemisphere;
use crate::render::paths::PathPicture;
use crate::render::picture::Worker;
use crate::shade::path::{
    IrradianceRecord, Missed, PathScratch, PathTracer, SECTORS, SampleNumbers, Seen, Slot,
    sector_direction,
};
use crate::shade::{RayCounts, Statistics};
use crate::trace::{Caching, RayKind, ShadowCache};
use glam::{DMat2, DVec2, DVec3};

/// Radii of records in widths of a pixel where they lie.
pub(super) const LEAST_WIDTHS: f64 = 1.5;
const MOST_WIDTHS: f64 = 64.0;

/// Points that have things nearer than so many widths get no record: light there is left to paths.
const LEFT_WIDTHS: f64 = 1.0;

/// The part of the error that the change of second order may be at the end of what a record
/// serves. Between records it is a fraction of that.
const OF_ERROR: f64 = 0.25;

/// Rays that gather a record's light, times the square of the error; and their bounds.
const SAMPLES: f64 = 80.0;
const LEAST_SAMPLES: u32 = 256;
const MOST_SAMPLES: u32 = 16384;

/// Records go on, to so many times the rays at most, while the second half of their rays makes more
/// than this part of the error of a difference.
const MOST_TIMES: u32 = 8;
const NOISE: f64 = 0.5;

/// Rays that tell how far a record serves, as a part of those that gather its light. They are
/// others: were they the same, records that chance has made bright would serve farther than those
/// that it has made dark, and all would be too bright.
const OF_SAMPLES: u32 = 4;

/// Cells of the grid that changes are derived from, at most.
const MOST_CELLS: u32 = 1024;

/// The greater radius in lesser ones.
const MOST_OBLONG: f64 = 4.0;

/// Sine of the height of rays just above the horizon that look for what stands around; and up to
/// what sine other rays tell of it.
const HEIGHT: f64 = 0.04;
const LOW: f64 = 0.15;

/// Keys of records differ from those of pixels by this bit of x; and those of the rays that tell
/// how far they serve by the other.
const RECORD: u32 = 1 << 30;
const EXTENT: u32 = 1 << 31;

/// Rays of a record that are traced together.
const TOGETHER: usize = 64;

/// What rays of a record have met, by the cells of a grid.
struct Sights {
    /// The sum of light by cell, and what its first ray has met.
    cells: Vec<Sight>,
    columns: usize,
    samples: u32,
    /// The sum of the light of the first half of the samples.
    half: [f64; 3],
    is_done: bool,
}

impl Sights {
    fn new(samples: u32) -> Sights {
        let cells = samples.min(MOST_CELLS);
        Sights {
            cells: vec![Sight::DARK; cells as usize],
            columns: 1 << cells.ilog2().div_ceil(2),
            samples: 0,
            half: [0.0; 3],
            is_done: false,
        }
    }

    /// Says that there are so many samples, which are a power of two; they may be enough.
    fn count(&mut self, samples: u32, is_enough: bool, error: f64) {
        let mut sum = [0.0; 3];
        for cell in &self.cells {
            for k in 0..3 {
                sum[k] += cell.light[k];
            }
        }
        let off: f64 = (0..3).map(|k| (2.0 * self.half[k] - sum[k]).abs()).sum();
        self.samples = samples;
        self.half = sum;
        self.is_done = is_enough && off <= error * (sum[0] + sum[1] + sum[2]);
    }

    /// Notes what a ray of some numbers has met.
    fn note(
        &mut self,
        [u, v]: [f32; 2],
        number: u32,
        (toward, distance, light): (DVec3, f64, Slot),
    ) {
        let is_first = (number as usize) < self.cells.len();
        let rows = self.cells.len() / self.columns;
        let column = (u * self.columns as f32) as usize;
        let cell = &mut self.cells[(v * rows as f32) as usize * self.columns + column];
        if is_first {
            (cell.toward, cell.distance) = (toward, distance);
        }
        for k in 0..3 {
            cell.light[k] += f64::from(light[k]);
        }
    }

    /// Returns the mean light, and how it changes.
    fn derive(mut self) -> ([f64; 3], Change) {
        let of_cell = self.cells.len() as f64 / f64::from(self.samples.max(1));
        let share = 1.0 / self.cells.len() as f64;
        let mut mean = [0.0; 3];
        for cell in &mut self.cells {
            for k in 0..3 {
                cell.light[k] *= of_cell;
                mean[k] += share * cell.light[k];
            }
        }
        (mean, change(&self.cells, self.columns))
    }
}

/// What stands around a point.
#[derive(Clone, Copy)]
struct Around {
    /// Distance of the nearest thing.
    nearest: f64,
    /// By sector: one over the distance of the nearest low thing where it begins.
    inverse: [f64; SECTORS],
}

impl Around {
    /// Notes that a ray has met something.
    fn note(&mut self, toward: DVec3, distance: f64) {
        self.nearest = self.nearest.min(distance);
        if toward.z >= LOW {
            return;
        }
        let along = toward.truncate();
        let inverse = 1.0 / (distance * along.length());
        let sector = IrradianceRecord::sector_of(along);
        for sector in [sector, (sector + 1) % SECTORS] {
            self.inverse[sector] = self.inverse[sector].max(inverse);
        }
    }

    /// Returns one over the distance that is free where sectors begin, and to both sides of there.
    fn blocked(&self) -> [f32; SECTORS] {
        std::array::from_fn(|sector| {
            let beside = [SECTORS - 1, 0, 1].map(|by| self.inverse[(sector + by) % SECTORS]);
            beside.into_iter().fold(0.0, f64::max) as f32
        })
    }
}

impl Filler<'_> {
    /// Returns the records of some points; none of those that have things within a pixel's width.
    pub(super) fn gather(
        &self,
        picture: &PathPicture,
        asked: &[Asked],
    ) -> Vec<Option<IrradianceRecord>> {
        let tile = self.tile(picture, &[]);
        // Cells of a grid get a sample each from this sampler alone.
        let sampler = Sampler::new(Kind::Sobol, self.config.seed, self.config.frame, 1);
        let tracer = PathTracer {
            // The ray itself is one of the times that a path is scattered.
            max_depth: picture.max_depth - 1,
            backdrop: Seen::Nothing,
            ground: None,
            cache: None,
            only_indirect: true,
            sampler,
            ..tile.tracer()
        };
        let horizon = PathTracer {
            max_depth: 0,
            ..tile.tracer()
        };
        let samples = self.samples();
        let counts = [(samples / OF_SAMPLES).max(LEAST_SAMPLES), samples];
        let keys = [EXTENT, RECORD].map(|bit| {
            let keys = asked.iter().map(|((x, y), _)| sampler.key(x | bit, *y));
            keys.collect::<Vec<u32>>()
        });
        let sights = |samples: u32| {
            asked
                .iter()
                .map(|_| Sights::new(samples))
                .collect::<Vec<_>>()
        };
        let mut sights = counts.map(sights);
        let nothing = Around {
            nearest: f64::INFINITY,
            inverse: [0.0; SECTORS],
        };
        let mut around = vec![nothing; asked.len()];
        let mut is_left = vec![false; asked.len()];
        self.workers.with(|worker| {
            let Worker { arena, trace } = worker;
            let scratch = PathScratch::new(arena, trace, picture.kinds());
            let slots = arena.alloc_slice_fill_copy(asked.len() * TOGETHER, Slot::default());
            let mut rays = Rays::new(scratch, asked, slots, self.config.shadow_cache);
            rays.scratch.ask_reach();
            // Near things are looked for first: a point that has them within a pixel gets no record.
            rays.trace(&horizon, &keys[0], 0, |_, number| {
                (number < SECTORS).then(|| sector_direction(number).extend(HEIGHT))
            });
            for (place, distance) in rays.met() {
                around[place / TOGETHER].note(rays.locals[place], distance);
            }
            for (row, (_, missed)) in asked.iter().enumerate() {
                let width = self.generator.pixel_width(missed.point);
                is_left[row] = around[row].nearest < LEFT_WIDTHS * width;
            }
            for (k, (sights, keys)) in sights.iter_mut().zip(&keys).enumerate() {
                let most = counts[k] * [1, MOST_TIMES][k];
                for first in (0..most).step_by(TOGETHER) {
                    rays.trace(&tracer, keys, first, |row, number| {
                        let goes_on = !is_left[row] && !sights[row].is_done;
                        goes_on.then(|| towards(&sampler, keys[row], first + number as u32).1)
                    });
                    if self.progress.is_cancelled() {
                        break;
                    }
                    for (place, distance) in rays.met() {
                        let (row, number) = (place / TOGETHER, rays.numbers[place]);
                        let (numbers, toward) = towards(&sampler, keys[row], number);
                        around[row].note(toward, distance);
                        let sight = (toward, distance, rays.slots[place]);
                        sights[row].note(numbers, number, sight);
                    }
                    let now = first + TOGETHER as u32;
                    if now.is_power_of_two() && now >= counts[k] / 2 {
                        let error = NOISE * self.caching.error;
                        let going = sights.iter_mut().filter(|sights| !sights.is_done);
                        going.for_each(|sights| sights.count(now, now >= counts[k], error));
                    }
                    if (0..asked.len()).all(|row| is_left[row] || sights[row].is_done) {
                        break;
                    }
                }
            }
            self.count(&rays.counts);
            drop(rays);
            arena.reset();
        });
        let [of_extent, of_light] = sights;
        let all = asked.iter().zip(of_extent.into_iter().zip(of_light));
        let all = all.zip(around.iter().zip(is_left));
        let records = all.map(|(((_, missed), sights), (around, is_left))| {
            (!is_left).then(|| self.record(missed, sights, around))
        });
        records.collect()
    }

    /// Returns the number of rays that gather a record's light.
    fn samples(&self) -> u32 {
        let wanted = SAMPLES / (self.caching.error * self.caching.error);
        let [least, most] = [LEAST_SAMPLES, MOST_SAMPLES].map(f64::from);
        (wanted.clamp(least, most) as u32).next_power_of_two()
    }

    /// Makes the record of a point, from the sights that tell how far it serves and those of its
    /// light.
    fn record(
        &self,
        missed: &Missed,
        (of_extent, of_light): (Sights, Sights),
        around: &Around,
    ) -> IrradianceRecord {
        let mean = |of: [f64; 3]| (of[0] + of[1] + of[2]) / 3.0;
        let (light, first) = of_extent.derive();
        let (light, steep) = (mean(light), mean(first.gradient.map(DVec2::length)));
        let width = self.generator.pixel_width(missed.point);
        let [least, most] = [LEAST_WIDTHS, MOST_WIDTHS].map(|widths| widths * width);
        // Where the change of first order would take all the light away, it is no longer one.
        let most = most.min(light / steep).max(least);
        // Where the change of second order is the error's part of the light.
        let radius = |bend: f64| {
            let wanted = (2.0 * OF_ERROR * self.caching.error * light / bend.abs()).sqrt();
            if wanted < most {
                wanted.max(least)
            } else {
                most
            }
        };
        let (axis, bends) = principal(first.hessian);
        let short = radius(bends[0]);
        let long = radius(bends[1]).min(short * MOST_OBLONG);
        let across = axis.perp();
        let outer = |v: DVec2, radius: f64| DMat2::from_cols(v * v.x, v * v.y) * radius.powi(-2);
        let (light, of_light) = of_light.derive();
        let record = IrradianceRecord {
            point: missed.point,
            normal: missed.normal,
            axes: missed.normal.any_orthonormal_pair().into(),
            light: light.map(|c| {
                if c >= 0.0 {
                    c.min(f64::from(f32::MAX)) as f32
                } else {
                    0.0
                }
            }),
            gradient: agreed(of_light.gradient, first.gradient),
            turn: agreed(of_light.turn, first.turn),
            metric: outer(axis, short) + outer(across, long),
            radii: [short, long],
            least_cosine: least_cosine(self.caching.error),
            close: least,
            blocked: around.blocked(),
        };
        let extent = record.extent().min(long);
        IrradianceRecord {
            radii: [short, extent],
            ..record
        }
    }
}

/// Returns the least cosine between the normals of a record and of the surfaces that it serves.
pub(super) fn least_cosine(error: f64) -> f64 {
    // As for the change along the surface: the second derivative of the irradiance, as the normal
    // turns, is at most about itself.
    libm::cos((OF_ERROR * error).sqrt())
}

/// Lessens changes by how much others, which other rays tell of the same, differ from them: to
/// nothing where both are chance.
fn agreed(changes: [DVec2; 3], others: [DVec2; 3]) -> [DVec2; 3] {
    std::array::from_fn(|k| {
        let (one, other) = (changes[k], others[k]);
        let off = (one - other).length_squared();
        let both = one.length_squared() + other.length_squared();
        // What is left is 2·one·other in place of both squares.
        one * (1.0 - off / both.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    })
}

/// Returns the direction of a symmetric matrix's eigenvalue of greater size, and both
/// eigenvalues, that one first.
fn principal(m: DMat2) -> (DVec2, [f64; 2]) {
    let (xx, xy, yy) = (m.x_axis.x, m.y_axis.x, m.y_axis.y);
    let middle = 0.5 * (xx + yy);
    let off = libm::hypot(0.5 * (xx - yy), xy);
    let greater = if middle >= 0.0 {
        middle + off
    } else {
        middle - off
    };
    // Either row of the matrix less the other value leads along the axis.
    let other = 2.0 * middle - greater;
    let rows = [DVec2::new(xx - other, xy), DVec2::new(xy, yy - other)];
    let longer = match rows[0].length_squared() >= rows[1].length_squared() {
        true => rows[0],
        false => rows[1],
    };
    (longer.normalize_or(DVec2::X), [greater, other])
}

/// Rays of some points, so many of each together.
struct Rays<'b, 'a> {
    scratch: PathScratch<'b>,
    asked: &'a [Asked],
    /// By ray: its direction in the frame of its point, and the number of its sample.
    locals: Vec<DVec3>,
    numbers: Vec<u32>,
    /// Places of the rays that are traced.
    places: Vec<usize>,
    slots: &'b mut [Slot],
    cache: ShadowCache,
    counts: RayCounts,
}

impl<'b, 'a> Rays<'b, 'a> {
    fn new(
        scratch: PathScratch<'b>,
        asked: &'a [Asked],
        slots: &'b mut [Slot],
        shadow_cache: Caching,
    ) -> Rays<'b, 'a> {
        Rays {
            scratch,
            asked,
            locals: vec![DVec3::Z; slots.len()],
            numbers: vec![0; slots.len()],
            places: Vec::with_capacity(slots.len()),
            slots,
            cache: ShadowCache::new(shadow_cache),
            counts: RayCounts::default(),
        }
    }

    /// Traces the next rays of all points, where they have a direction that leads away from the
    /// surface.
    fn trace(
        &mut self,
        tracer: &PathTracer,
        keys: &[u32],
        first: u32,
        local: impl Fn(usize, usize) -> Option<DVec3>,
    ) {
        let (queue, own) = self.scratch.camera_rays();
        self.places.clear();
        for (row, (_, missed)) in self.asked.iter().enumerate() {
            let (x, y) = missed.normal.any_orthonormal_pair();
            for number in 0..TOGETHER {
                let Some(local) = local(row, number) else {
                    continue;
                };
                let toward = x * local.x + y * local.y + missed.normal * local.z;
                if !(toward.dot(missed.facing) > 0.0) {
                    continue;
                }
                let place = row * TOGETHER + number;
                self.locals[place] = local;
                self.numbers[place] = first + number as u32;
                queue.push_one((missed.start, toward), place as u32);
                own.push(keys[row]);
                self.places.push(place);
            }
        }
        queue.complete(f32::INFINITY, RayKind::Reflection);
        self.slots.fill(Slot::default());
        let numbers = SampleNumbers::Each(&self.numbers);
        let statistics = &mut Statistics::of_counts();
        tracer.run(
            &mut self.scratch,
            numbers,
            self.slots,
            &mut self.cache,
            statistics,
        );
        self.counts.add(&statistics.counts);
    }

    /// Lists places of the rays, and how far they have reached.
    fn met(&self) -> impl Iterator<Item = (usize, f64)> {
        let reach = self.scratch.reach().iter().copied();
        self.places.iter().copied().zip(reach)
    }
}

/// Returns the numbers of a record's sample in the unit square, and its direction.
fn towards(sampler: &Sampler, key: u32, sample: u32) -> ([f32; 2], DVec3) {
    let [u, v, ..] = sampler.pad_one(key, sample, 0);
    let toward = cosine_hemisphere::<f32>([u, v]);
    let toward = DVec3::from([toward.x, toward.y, toward.z].map(f64::from));
    ([u, v], toward)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_principal_direction_is_that_of_the_greatest_size() {
        for (angle, values) in [(0.3, [5.0, 1.0]), (2.0, [-4.0, 3.0]), (1.0, [2.0, -1.9])] {
            let axis = DVec2::from_angle(angle);
            let outer = |v: DVec2, by: f64| DMat2::from_cols(v * v.x, v * v.y) * by;
            let (found, bends) = principal(outer(axis, values[0]) + outer(axis.perp(), values[1]));
            assert!(found.dot(axis).abs() > 1.0 - 1e-9);
            assert!((bends[0] - values[0]).abs() + (bends[1] - values[1]).abs() < 1e-9);
        }
        assert_eq!(principal(DMat2::ZERO), (DVec2::X, [0.0, 0.0]));
    }
}
