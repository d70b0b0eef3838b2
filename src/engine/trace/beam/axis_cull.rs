//! The axis cull: removes rays of a beam that pass by the axis of a cylinder or cone.
//!
//! The box of an oblique cylinder is mostly empty, and the kernel costs the same for misses.
//! The distance of a line through o along d from an axis through m along the unit vector n
//! is |w·(d × n)| / |d × n| with w = o − m (the moment of Plücker coordinates). A ray misses
//! if it exceeds the largest radius. For one origin w × n is shared by the beam, for one
//! direction d × n is; two products remain per ray. B14 and B15 give the bounds.

use super::rays::Beam;
use crate::geom::cone::Upright;
use crate::math::bounds::UNIT;
use crate::math::lanes::Lanes;
use crate::math::length;
use glam::DVec3;

/// The cull of one axis, set up for a beam.
#[derive(Clone, Copy)]
pub(super) enum AxisCull {
    Pinhole {
        /// Coefficients of (u, v, 1): the moment over the axis' distance.
        moment: [f32; 3],
        /// Coefficients of (u, v, 1): d·n.
        along: [f32; 3],
        /// Squared radius over squared distance.
        room: f32,
        /// Error of the moment (B14).
        slack: f32,
    },
    Parallel {
        /// Coefficients of (u, v, 1): the moment.
        moment: [f32; 3],
        /// Moment of a line at the largest radius, errors included (B15).
        room: f32,
    },
}

/// u, the unit roundoff of f32.
const U: f32 = f32::EPSILON / 2.0;

impl AxisCull {
    /// Sets up the cull. `org`: the shared origin, if there is one.
    #[inline(always)]
    pub fn new<L: Lanes, const S: usize>(beam: &Beam<L, S>, row: &Upright, org: DVec3) -> AxisCull {
        let ([a, b, k], sign) = (beam.frustum.axes, f64::from(beam.frustum.sign));
        let turned = |v: DVec3| DVec3::new(v[a], v[b], v[k] * sign);
        let radius = row.radius + row.growth.abs() * row.half;
        let n = turned(row.unit);
        let size = |v: DVec3| v.abs().max_element();
        if beam.parallel {
            let place = DVec3::from_array(beam.org.map(f64::from));
            let w = place - turned(row.middle);
            let [p, q] = beam.shear.slopes.map(f64::from);
            let across = DVec3::new(p, q, 1.0).cross(n);
            let off = 16.0 * UNIT * (size(row.middle) + row.half);
            let room = radius + beam.shear.passing() + off;
            // Nearly along the axis, d × n cancels (B15: 64v).
            let noise = 64.0 * UNIT * (f64::from(beam.reach) + room);
            let room = room * length(across) + noise;
            return AxisCull::Parallel {
                moment: [across.x, across.y, w.dot(across)].map(|x| x as f32),
                room: room as f32 * (1.0 + 8.0 * U) + f32::MIN_POSITIVE,
            };
        }
        let w = turned(org - row.middle);
        let far = size(w);
        let moment = (w / far).cross(n);
        let off = 16.0 * UNIT * (size(org) + size(row.middle) + row.half) / far;
        let [u, v] = beam.widest;
        let room = radius / far;
        AxisCull::Pinhole {
            moment: [moment.x, moment.y, moment.z].map(|x| x as f32),
            along: [n.x, n.y, n.z].map(|x| x as f32),
            room: (room * room) as f32 * (1.0 + 8.0 * U) + f32::MIN_POSITIVE,
            slack: (1.0 + u + v) * (18.0 * U + off as f32),
        }
    }

    /// Returns the rays of a group that certainly pass by (B14, B15); NaN does not.
    #[inline(always)]
    pub fn passes<L: Lanes, const S: usize>(&self, beam: &Beam<L, S>, s: usize) -> L::Mask {
        let (u, v) = (beam.groups[s].u, beam.groups[s].v);
        let one = L::from_f32(1.0);
        match self {
            AxisCull::Pinhole {
                moment,
                along,
                room,
                slack,
            } => {
                let [x, y, z] = moment.map(L::from_f32);
                let moment = (u * x + v * y + z).abs() - L::from_f32(*slack);
                let [x, y, z] = along.map(L::from_f32);
                let along = u * x + v * y + z;
                let squared = u * u + v * v + one;
                let across = squared * L::from_f32(1.0 + 32.0 * U) - along * along;
                moment.gt(L::zero()) & (moment * moment).gt(across * L::from_f32(*room))
            }
            AxisCull::Parallel { moment, room } => {
                let [x, y, z] = moment.map(L::from_f32);
                let (x, y) = (u * x, v * y);
                let slack = (x.abs() + y.abs() + z.abs()) * L::from_f32(8.0 * U);
                ((x + y + z).abs() - slack).gt(L::from_f32(*room))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Cone;
    use crate::geom::Scratch;
    use crate::geom::exact::{Line, Solid, first_beyond};
    use crate::math::Vec3;
    use crate::math::lanes::Mask;
    use crate::trace::test_random::Random;

    /// Returns a point near a line from `org` that touches a cone's side.
    fn beside(cone: &Cone, org: DVec3, random: &mut Random) -> DVec3 {
        let along = 0.5 + 0.5 * random.unit();
        let axis = cone.base + (cone.top - cone.base) * along;
        let radius = cone.base_radius + (cone.top_radius - cone.base_radius) * along;
        let side = (cone.top - cone.base).cross(axis - org);
        let off = random.size(-7.0, 1.0) * random.unit();
        axis + side / length(side) * radius * (1.0 + off)
    }

    /// A ray near a cone, and whether the cull removes it.
    struct Probe {
        line: Line,
        passes: bool,
    }

    fn probe<L: Lanes>(cone: &Cone, [org, dir]: [DVec3; 2], parallel: bool) -> Option<Probe> {
        let size = (cone.top - cone.base).abs().max_element();
        let dir = (dir / size).to_array();
        let bounds = cone.bounds().outward();
        let mut beam: Beam<L, 1> = Beam::empty();
        let all = [L::Mask::splat(true)];
        let taken = if parallel {
            let orgs = |_| Vec3::splat(org.to_array());
            beam.load_parallel(orgs, dir, &all, &all, &bounds)
        } else {
            let dirs = |_| Vec3::<L::Double>::splat(dir);
            beam.load_pinhole(org.to_array(), dirs, &all, &all, &bounds)
        };
        let around = AxisCull::new(&beam, &cone.upright(), org);
        let org = org.to_array();
        taken.then(|| Probe {
            line: Line { org, dir },
            passes: around.passes(&beam, 0).any(),
        })
    }

    /// Counts hits and culled rays in f32 and f64 lanes; no ray is both.
    fn count(cone: &Cone, ray: [DVec3; 2], [met, passed]: &mut [u32; 2]) {
        for parallel in [false, true] {
            let probes = [
                probe::<f32>(cone, ray, parallel),
                probe::<f64>(cone, ray, parallel),
            ];
            for Probe { line, passes } in probes.into_iter().flatten() {
                let first = first_beyond(
                    &Solid::Cone(*cone),
                    &line,
                    f64::NEG_INFINITY,
                    &mut Scratch::default(),
                );
                assert!(
                    !(first.is_some() && passes),
                    "{cone:?}: {:?}, {:?}, parallel: {parallel}",
                    line.org,
                    line.dir
                );
                *met += u32::from(first.is_some());
                *passed += u32::from(passes);
            }
        }
    }

    #[test]
    fn what_passes_by_is_not_met() {
        let mut random = Random(21);
        let mut counts = [0; 2];
        for case in 0..60_000 {
            let size = random.size(-6.0, 6.0);
            let place = DVec3::from_array(random.vector()) * size;
            let place = place * [0.0, 1.0, 30.0][case % 3];
            let axis = DVec3::from_array(random.vector()) * size;
            // Upright axes too.
            let axis = if case % 7 == 0 { DVec3::Y * size } else { axis };
            let radius = size * random.size(-3.0, 1.0);
            let cone = Cone {
                base: place,
                top: place + axis,
                base_radius: radius,
                top_radius: radius * [1.0, 0.3, 0.0][case / 3 % 3],
                open: false,
            };
            let distance = (axis.abs().max_element() + radius) * random.size(-1.0, 2.0);
            let org = cone.base + DVec3::from_array(random.vector()) * distance;
            let dir = beside(&cone, org, &mut random) - org;
            count(&cone, [org, dir], &mut counts);
        }
        let [met, passed] = counts;
        assert!(met > 30_000 && passed > 10_000, "{met}, {passed}");
    }

    /// Rays nearly along the axis, where d × n cancels.
    #[test]
    fn what_goes_along_the_axis_does_not_pass_by() {
        let mut random = Random(22);
        let mut counts = [0; 2];
        for _ in 0..30_000 {
            let dir = match random.below(2) {
                0 => [(); 3].map(|()| random.below(33) as f32 - 16.0),
                _ => random.vector().map(|x| x as f32),
            };
            let dir = DVec3::from_array(dir.map(f64::from));
            if dir == DVec3::ZERO {
                continue;
            }
            let tilt = random.size(-17.0, -6.0);
            let axis = dir + DVec3::from_array(random.vector()) * tilt;
            let radius = length(axis) * random.size(-3.0, 0.0);
            let place = DVec3::from_array(random.vector()) * random.size(-1.0, 1.0);
            let cone = Cone {
                base: place,
                top: place + axis,
                base_radius: radius,
                top_radius: radius,
                open: false,
            };
            let aside = DVec3::from_array(random.vector()).cross(dir);
            let aside = aside / length(aside) * (radius * random.unit());
            let org = cone.base - dir * random.size(0.0, 1.0) + aside;
            count(&cone, [org, dir], &mut counts);
        }
        assert!(counts[0] > 60_000, "{counts:?}");
    }
}
