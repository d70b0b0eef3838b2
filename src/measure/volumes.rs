//! Volume, area and centroid of solids, by lines through them.
//!
//! Lines of all directions and places through a solid's box, as evenly as a
//! low-discrepancy sequence has them (Roberts' R sequence in four dimensions).
//! What a line has inside is a share of the volume, and each boundary that it
//! crosses one of the surface (Cauchy and Crofton; Santaló, Integral Geometry and
//! Geometric Probability, 1976): of lines with density 1 per area across their
//! direction, the chords sum up to the volume and the crossings to half the area.
//! The error comes from independent repetitions with the sequence shifted. Where
//! nothing is met by 2^18 lines, and so few of the rest can meet anything that they
//! would not reach the goal, it ends: the volume is 0, with an absolute error.

use crate::accel::{Combined, FacetTrees};
use crate::geom::exact::{Line, Root, span};
use crate::math::bounds::{Bounded, UNIT};
use crate::math::{Aabb, Affine};
use crate::render::{Progress, mix, unit};
use crate::scene::{Scene, Shape, ShapeId, check_closed, shape_bounds};
use crate::trace::{boundaries, solid_of};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Independent estimates; what they differ by is the error.
const REPETITIONS: u64 = 32;

/// Student's t of 31 degrees of freedom, two-sided, 95 %.
const STUDENT: f64 = 2.0395;

/// Lines after which nothing may be what there is.
const LEAST_EMPTY: u64 = 1 << 18;

/// No line of N met it: in 95 of 100 cases fewer than 3 in N do.
const RULE_OF_THREE: f64 = 3.0;

/// In the unit of the scene, its square and its cube.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Volume {
    pub volume: f64,
    /// Half the width of the interval that holds the volume in 95 of 100 cases.
    pub volume_error: f64,
    pub area: f64,
    pub area_error: f64,
    /// World space; none without volume.
    pub centroid: Option<[f64; 3]>,
    pub lines: u64,
    /// Errors are larger than was asked for: the solid is too thin for as many lines.
    pub is_rough: bool,
}

impl Volume {
    /// Of `self` in lengths of `unit`, those in the scene's. `None` where f64 has no
    /// number for one of them.
    fn of_units(self, unit: f64) -> Option<Volume> {
        // Step by step: nothing leaves the format that comes back.
        let square = |x: f64| x * unit * unit;
        let cube = |x: f64| x * unit * unit * unit;
        let error = |own: f64, whole: f64| match own > 0.0 {
            true => whole.max(f64::MIN_POSITIVE),
            false => whole,
        };
        let whole = Volume {
            volume: cube(self.volume),
            volume_error: error(self.volume_error, cube(self.volume_error)),
            area: square(self.area),
            area_error: error(self.area_error, square(self.area_error)),
            ..self
        };
        let same = |own: f64, whole: f64| own == 0.0 || whole.is_normal();
        let is_known = same(self.volume, whole.volume) && same(self.area, whole.area);
        (is_known && whole.is_finite()).then_some(whole)
    }

    fn is_finite(&self) -> bool {
        let figures = [self.volume, self.volume_error, self.area, self.area_error];
        let centroid = self.centroid.unwrap_or_default();
        figures.iter().chain(&centroid).all(|x| x.is_finite())
    }
}

/// What was found out about a solid, in lengths of a unit of its size: so it is known
/// of the smallest and largest as well, whose cubes f64 does not hold.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Its centroid is in the scene's unit.
    own: Volume,
    unit: f64,
}

impl Measured {
    /// With all lengths `scale` times as long, and the centroid where `place` puts it.
    /// `None` where f64 has no number for one of the figures.
    pub fn volume(&self, scale: f64, place: impl Fn([f64; 3]) -> [f64; 3]) -> Option<Volume> {
        let placed = Volume {
            centroid: self.own.centroid.map(place),
            ..self.own
        };
        placed.of_units(self.unit * scale)
    }
}

/// How good is good enough.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Errors of volume and area, relative.
    pub relative: f64,
    /// Of one solid.
    pub most_lines: u64,
    pub seed: u64,
}

impl Default for Goal {
    fn default() -> Goal {
        Goal {
            relative: 5e-4,
            most_lines: 1 << 24,
            seed: 0,
        }
    }
}

impl Goal {
    /// After `lines` that met nothing: as many as may yet meet something leave a larger
    /// error, about 2 / √hits.
    fn is_beyond(&self, lines: u64) -> bool {
        let hits = RULE_OF_THREE * self.most_lines as f64 / lines as f64;
        lines >= LEAST_EMPTY && hits * self.relative * self.relative < 4.0
    }
}

/// A solid at a place.
pub struct Placed<'a> {
    scene: &'a Scene,
    shape: Shape,
    /// Of a combination, and of what a line may come into many times.
    combined: Option<Combined>,
    object_from_world: Affine,
    /// World space.
    bounds: Aabb,
    /// What lengths are measured in, a power of two: no less than its box.
    unit: f64,
}

/// Why a shape has no volume to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoVolume {
    /// A surface.
    Surface,
    /// A mesh that is not closed.
    Mesh,
    Unbounded,
}

impl<'a> Placed<'a> {
    pub fn of(
        scene: &'a Scene,
        id: ShapeId,
        world_from_object: &Affine,
        object_from_world: &Affine,
    ) -> Result<Placed<'a>, NoVolume> {
        let shape = scene.shapes.row(id);
        let combined = match shape {
            Shape::Polygon(_) => return Err(NoVolume::Surface),
            Shape::Cylinder(row) if scene.cylinders.row(row).open => return Err(NoVolume::Surface),
            Shape::Cone(row) if scene.cones.row(row).open => return Err(NoVolume::Surface),
            Shape::Mesh(row) => {
                if scene.meshes.open[row.index()] || check_closed(scene, row).is_err() {
                    return Err(NoVolume::Mesh);
                }
                Some(Combined::of_one(scene, id))
            }
            Shape::Implicit(row) if scene.implicits.open[row.index()] => {
                return Err(NoVolume::Surface);
            }
            Shape::LevelSet(row) if scene.level_sets.open[row.index()] => {
                return Err(NoVolume::Surface);
            }
            Shape::Implicit(_) | Shape::LevelSet(_) => Some(Combined::of_one(scene, id)),
            Shape::Combination(row) => {
                Some(Combined::of(scene, id, row, &mut FacetTrees::default()))
            }
            _ => None,
        };
        let own = shape_bounds(scene, id).ok_or(NoVolume::Unbounded)?;
        let corner = |p: DVec3| DVec3::from_array(world_from_object.point(p.to_array()));
        let bounds = Aabb::of_points(own.corners().map(corner));
        let room = bounds.max_abs() * (64.0 * f64::EPSILON);
        let bounds = bounds.grown(DVec3::splat(room));
        let size = bounds.extent().max_element();
        let size = size.clamp(f64::MIN_POSITIVE, f64::MAX);
        Ok(Placed {
            scene,
            shape,
            combined,
            object_from_world: *object_from_world,
            bounds,
            unit: libm::scalbn(1.0, libm::ilogb(size) + 1),
        })
    }

    /// Calls `part` with every span of a world line that is inside, and how far off its
    /// length may be; an end is a boundary.
    fn spans(&self, org: DVec3, dir: DVec3, mut part: impl FnMut(f64, f64, f64)) {
        let line = Line {
            org: self.object_from_world.point(org.to_array()),
            dir: self.object_from_world.vector(dir.to_array()),
        };
        // As well as sums of chords need it. What is no number is not known.
        let room = self.unit * 1e-9;
        let place = |root: &Root| match root.t {
            Bounded { value, error } if error <= room => Bounded {
                value,
                error: error + value.abs() * UNIT,
            },
            _ => Bounded {
                value: root.rounded(),
                error: root.rounded().abs() * UNIT,
            },
        };
        let mut part = |enter: Bounded, exit: Bounded| {
            part(enter.value, exit.value, enter.error + exit.error);
        };
        let Some(combined) = &self.combined else {
            let solid = solid_of(self.scene, self.shape);
            for ends in solid.iter().flat_map(|solid| span(solid, &line).spans()) {
                if let [Some(enter), Some(exit)] = ends {
                    part(place(&enter), place(&exit));
                }
            }
            return;
        };
        let mut since = None;
        boundaries(combined, self.scene, (&line, f64::NEG_INFINITY), |change| {
            let t = place(&change.root);
            if change.enters {
                since = Some(t);
            } else if let Some(enter) = since.take() {
                part(enter, t);
            }
            ControlFlow::Continue(())
        });
    }

    /// `None` where `progress` was cancelled. Runs on the current rayon pool.
    pub fn measure(&self, goal: &Goal, progress: &Progress) -> Option<Measured> {
        let mut sums = vec![Sums::default(); REPETITIONS as usize];
        // Enough for the repetitions to say how far apart they are.
        let (mut from, mut to) = (0, 1 << 11);
        loop {
            let added: Vec<Sums> = (0..REPETITIONS)
                .into_par_iter()
                .map(|r| self.repetition(r, from..to, goal.seed, progress))
                .collect();
            if progress.is_cancelled() {
                return None;
            }
            for (sum, added) in sums.iter_mut().zip(&added) {
                sum.add(added);
            }
            let found = self.estimate(&sums, to);
            let fine = found.volume_error <= goal.relative * found.volume
                && found.area_error <= goal.relative * found.area;
            let empty = sums.iter().all(|s| s.crossings == 0.0);
            let hopeless = empty && goal.is_beyond(to * REPETITIONS);
            if fine || hopeless || to * 2 * REPETITIONS > goal.most_lines {
                let own = Volume {
                    is_rough: !fine,
                    ..found
                };
                let unit = self.unit;
                return Some(Measured { own, unit });
            }
            (from, to) = (to, to * 2);
        }
    }

    fn repetition(
        &self,
        number: u64,
        lines: std::ops::Range<u64>,
        seed: u64,
        progress: &Progress,
    ) -> Sums {
        let shift: [f64; 4] =
            std::array::from_fn(|k| unit(mix(mix(seed) ^ (number * 4 + k as u64))));
        let (center, half) = (self.bounds.center(), self.bounds.extent() * 0.5);
        let short = |x: f64| x / self.unit;
        let mut sums = Sums::default();
        for i in lines {
            if i % 1024 == 0 && progress.is_cancelled() {
                break;
            }
            let at: [f64; 4] = std::array::from_fn(|k| {
                let x = shift[k] + STEPS[k] * i as f64;
                x - libm::floor(x)
            });
            // A half of all directions is enough: lines go both ways.
            let (z, turn) = (at[0], at[1] * std::f64::consts::TAU);
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = libm::sincos(turn);
            let dir = DVec3::new(radius * cos, radius * sin, z);
            let (u, v) = dir.any_orthonormal_pair();
            // The box's shadow is inside this rectangle.
            let [a, b] = [u, v].map(|axis| half.dot(axis.abs()));
            let across = u * (a * (2.0 * at[2] - 1.0)) + v * (b * (2.0 * at[3] - 1.0));
            let area = 4.0 * short(a) * short(b);
            self.spans(center + across, dir, |enter, exit, off| {
                let chord = short(exit - enter);
                sums.volume += area * chord;
                sums.off += area * short(off);
                sums.crossings += 2.0 * area;
                let middle = across + dir * (0.5 * (enter + exit));
                sums.moment += middle / self.unit * (area * chord);
            });
        }
        sums
    }

    /// `lines`: of each repetition.
    fn estimate(&self, sums: &[Sums], lines: u64) -> Volume {
        let (n, center) = (lines as f64, self.bounds.center());
        let mean_and_error = |of: &dyn Fn(&Sums) -> f64| {
            let values: Vec<f64> = sums.iter().map(|s| of(s) / n).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let away = root_of_squares(values.iter().map(|x| x - mean));
            let deviation = away / (count - 1.0).sqrt();
            (mean, STUDENT * deviation / count.sqrt())
        };
        let (volume, spread) = mean_and_error(&|s| s.volume);
        let volume_error = spread + mean_and_error(&|s| s.off).0;
        // A crossing in every direction counts by half the area.
        let (area, area_error) = mean_and_error(&|s| 2.0 * s.crossings);
        let moment = sums.iter().fold(DVec3::ZERO, |m, s| m + s.moment);
        let whole: f64 = sums.iter().map(|s| s.volume).sum();
        if sums.iter().all(|s| s.crossings == 0.0) {
            // Lines cross at most a square of the diagonal, and are no longer inside.
            let diagonal = (self.bounds.extent() / self.unit).length();
            let share = RULE_OF_THREE / (n * sums.len() as f64) * diagonal * diagonal;
            return Volume {
                volume_error: share * diagonal,
                area_error: share * 4.0,
                lines: lines * sums.len() as u64,
                ..Volume::default()
            };
        }
        Volume {
            volume,
            volume_error,
            area,
            area_error,
            centroid: (whole > 0.0).then(|| (center + moment / whole * self.unit).to_array()),
            lines: lines * sums.len() as u64,
            is_rough: false,
        }
    }
}

/// Of the powers of 1 over the root of x⁵ = x + 1.
const STEPS: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_126_1,
    0.628_706_721_037_808_6,
    0.538_597_257_223_612_3,
];

/// In lengths of the solid's unit.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    volume: f64,
    /// By how much roundings may move it.
    off: f64,
    crossings: f64,
    /// About the middle of the box.
    moment: DVec3,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.volume += other.volume;
        self.off += other.off;
        self.crossings += other.crossings;
        self.moment += other.moment;
    }
}

/// Of several solids, as if none overlapped. Each with the number of what was measured:
/// the errors of those of one number are the same error, those of others are their own.
/// `None` where f64 has no number for a sum.
pub fn together(all: &[(usize, Volume)]) -> Option<Volume> {
    let mut sum = Volume::default();
    let mut errors = BTreeMap::<usize, [f64; 2]>::new();
    for (number, one) in all {
        sum.volume += one.volume;
        sum.area += one.area;
        sum.lines += one.lines;
        sum.is_rough |= one.is_rough;
        let [volume, area] = errors.entry(*number).or_default();
        *volume += one.volume_error;
        *area += one.area_error;
    }
    [sum.volume_error, sum.area_error] =
        [0, 1].map(|k| root_of_squares(errors.values().map(|e| e[k])));
    sum.centroid = (sum.volume > 0.0).then(|| {
        let share = |one: &Volume| {
            let centroid = one.centroid.map_or(DVec3::ZERO, DVec3::from_array);
            centroid * (one.volume / sum.volume)
        };
        all.iter()
            .map(|(_, one)| share(one))
            .sum::<DVec3>()
            .to_array()
    });
    sum.is_finite().then_some(sum)
}

/// No square leaves the format.
fn root_of_squares(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = numbers.clone().fold(0.0, |m: f64, x| m.max(x.abs()));
    // A power of two rounds nothing.
    let power = libm::scalbn(1.0, libm::ilogb(largest.max(f64::MIN_POSITIVE)));
    let square = |x: f64| (x / power) * (x / power);
    power * numbers.map(square).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cuboid, Cylinder, Quadric, Sphere};
    use crate::scene::{Edge, Operand, Operator, SceneBuilder};
    use std::f64::consts::PI;

    /// Where lines are met in integers, fewer of them.
    fn coarse() -> Goal {
        Goal {
            relative: 4e-3,
            ..Goal::default()
        }
    }

    fn measured(build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Volume {
        measured_to(&Goal::default(), build)
    }

    fn measured_to(goal: &Goal, build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Volume {
        let mut scene = SceneBuilder::default();
        let shape = build(&mut scene);
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let identity = Affine::IDENTITY;
        let placed = Placed::of(&scene, shape, &identity, &identity).unwrap();
        placed
            .measure(goal, &Progress::default())
            .and_then(|found| found.volume(1.0, |p| p))
            .unwrap()
    }

    fn holds(found: &Volume, volume: f64, area: f64) {
        holds_to(&Goal::default(), found, volume, area);
    }

    fn holds_to(goal: &Goal, found: &Volume, volume: f64, area: f64) {
        let relative = 2.0 * goal.relative;
        let (dv, da) = ((found.volume - volume).abs(), (found.area - area).abs());
        // Three of the half widths: one case in a million.
        assert!(dv <= 3.0 * found.volume_error, "{found:?}, volume {volume}");
        assert!(da <= 3.0 * found.area_error, "{found:?}, area {area}");
        assert!(found.volume_error < relative * volume, "{found:?}");
        assert!(found.area_error < relative * area, "{found:?}");
    }

    fn ball(center: DVec3, radius: f64) -> Sphere {
        Sphere { center, radius }
    }

    fn rod(along: DVec3) -> Cylinder {
        Cylinder {
            base: -along * 3.0,
            top: along * 3.0,
            radius: 1.0,
            open: false,
        }
    }

    #[test]
    fn volumes_are_those_of_formulas() {
        let center = DVec3::new(5.0, -2.0, 1.0);
        let found = measured(|scene| scene.sphere("", ball(center, 2.0)));
        holds(&found, 32.0 * PI / 3.0, 16.0 * PI);
        assert!((DVec3::from_array(found.centroid.unwrap()) - center).length() < 1e-2);

        let found = measured(|scene| scene.cylinder("", rod(DVec3::Z)));
        holds(&found, 6.0 * PI, 14.0 * PI);

        // Unit spheres one radius apart.
        let found = measured(|scene| {
            let a = scene.sphere("", ball(DVec3::ZERO, 1.0));
            let b = scene.sphere("", ball(DVec3::X, 1.0));
            let both = [Operand::shape(a), Operand::shape(b)];
            scene.combination("", Operator::Intersection, &both)
        });
        holds(&found, 5.0 * PI / 12.0, 2.0 * PI);

        let rods = |axes: &[DVec3]| {
            measured(|scene| {
                let all: Vec<_> = axes
                    .iter()
                    .map(|axis| Operand::shape(scene.cylinder("", rod(*axis))))
                    .collect();
                scene.combination("", Operator::Intersection, &all)
            })
        };
        // Steinmetz' solids; the area of the first is 16 r², that of the other
        // three times its volume.
        holds(&rods(&[DVec3::X, DVec3::Y]), 16.0 / 3.0, 16.0);
        let three = 8.0 * (2.0 - 2.0_f64.sqrt());
        holds(&rods(&DVec3::AXES), three, 3.0 * three);

        // A cube of side 2, drilled through.
        let found = measured(|scene| {
            let min = DVec3::splat(-1.0);
            let block = scene.cuboid("", Cuboid { min, max: -min });
            let bore = Cylinder {
                radius: 0.5,
                ..rod(DVec3::Y)
            };
            let bore = scene.cylinder("", bore);
            let parts = [Operand::shape(block), Operand::shape(bore)];
            scene.combination("", Operator::Difference, &parts)
        });
        holds(&found, 8.0 - PI * 0.5, 24.0 - PI * 0.5 + 2.0 * PI);
    }

    /// What is measured once for a hundred parts errs by a hundred times as much.
    #[test]
    fn errors_of_equal_parts_are_one() {
        let one = Volume {
            volume_error: 3.0,
            ..Volume::default()
        };
        let sum = |numbers: [usize; 2], one| together(&numbers.map(|n| (n, one)));
        assert_eq!(sum([0, 0], one).unwrap().volume_error, 6.0);
        assert_eq!(sum([0, 1], one).unwrap().volume_error, 18.0_f64.sqrt());
        let large = Volume {
            volume: 1e308,
            ..Volume::default()
        };
        assert_eq!(sum([0, 1], large), None);
    }

    /// From the least to the largest whose cubes f64 has, and beyond.
    #[test]
    fn balls_of_any_size() {
        let found = |radius: f64, scale: f64| {
            let mut scene = SceneBuilder::default();
            let shape = scene.sphere("", ball(DVec3::ZERO, radius));
            scene.instance("", Edge::shape(shape));
            let scene = scene.finish().unwrap();
            let identity = Affine::IDENTITY;
            let placed = Placed::of(&scene, shape, &identity, &identity).unwrap();
            let found = placed.measure(&coarse(), &Progress::default());
            found.unwrap().volume(scale, |p| p)
        };
        for (radius, scale) in [
            (2e-102, 1.0),
            (1e102, 1.0),
            (1e120, 1e-120),
            (1e-140, 1e130),
        ] {
            let size: f64 = radius * scale;
            let (volume, area) = (4.0 / 3.0 * PI * size * size * size, 4.0 * PI * size * size);
            holds_to(&coarse(), &found(radius, scale).unwrap(), volume, area);
        }
        for (radius, scale) in [(1e-130, 1.0), (1e-170, 1.0), (1e130, 1.0), (1.0, 1e-110)] {
            assert_eq!(found(radius, scale), None, "{radius}");
        }
    }

    /// What the roundings of its chords may do is in the error.
    #[test]
    fn a_plate_thinner_than_roundings() {
        let min = DVec3::new(-0.5, -0.5, 0.0);
        for thin in [1e-20, 1e-14, 1e-9] {
            let max = DVec3::new(0.5, 0.5, thin);
            let found = measured_to(&coarse(), |scene| scene.cuboid("", Cuboid { min, max }));
            let off = (found.volume - thin).abs();
            assert!(off <= 3.0 * found.volume_error, "{found:?}");
            assert!(
                (found.area - 2.0).abs() <= 3.0 * found.area_error,
                "{found:?}"
            );
        }
    }

    /// Balls that touch in a point: no line meets anything, and few are drawn. But with
    /// a goal that the rest of the lines may reach, they are.
    #[test]
    fn what_is_empty_ends_early() {
        let found = measured(|scene| {
            let centers = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)];
            let balls = centers.map(|c| Operand::shape(scene.sphere("", ball(c, 1.0))));
            scene.combination("", Operator::Intersection, &balls)
        });
        assert!(found.lines <= LEAST_EMPTY && found.is_rough, "{found:?}");
        assert_eq!((found.volume, found.area), (0.0, 0.0));
        assert!(found.volume_error > 0.0 && found.area_error > 0.0);

        let ends = |relative, lines| {
            let goal = Goal {
                relative,
                ..Goal::default()
            };
            goal.is_beyond(lines)
        };
        assert!(ends(5e-4, 1 << 18) && ends(0.1, 1 << 18));
        assert!(!ends(5e-4, 1 << 17) && !ends(0.5, 1 << 18));
    }

    /// Coefficients of which f64 has no squares.
    #[test]
    fn balls_of_any_coefficients() {
        for power in [-1000, -520, 510, 1000] {
            let e = libm::ldexp(1.0, power);
            let coefficients = [e, e, e, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -e];
            let found = measured_to(&coarse(), |scene| {
                scene.quadric("", Quadric { coefficients })
            });
            holds_to(&coarse(), &found, 4.0 / 3.0 * PI, 4.0 * PI);
        }
    }
}
