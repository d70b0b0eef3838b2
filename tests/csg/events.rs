//! Faces that count as coincident although their hits lie far apart along the ray, because
//! the ray grazes one of them: around the ends of the ray, and where the placement of an
//! operand makes its faces uncertain.

use super::asked::{Asked, RIGHT, agree};
use super::coincidence::v;
use super::programs::Leaf;
use crate::common::{Random, RayColumns, campaign, kernels};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, HalfSpace, Quadric, Sphere};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder, ShapeId};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};

use Operator::{Difference, Intersection, Union, Xor};

/// Nearest hits up to where each ray ends, and whether there are any, are the reference's.
/// How many rays meet something.
fn agree_within(asked: &Asked, rays: &RayColumns, ends: &[f32], name: &str) -> usize {
    let (world, reference) = (asked.world(), asked.reference());
    let mut hits = 0;
    for precision in RIGHT {
        let kernels = kernels(precision);
        let answers = rays.closest_within(&world, &kernels, ends);
        let blocked = rays.any(&world, &kernels, ends, &mut ShadowCache::new(Caching::Off));
        for (i, end) in ends.iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let (dir, end) = (dir.map(f64::from), f64::from(*end));
            let said = reference.nearest(org, dir, end);
            let own = said.map_or(HitId::NONE, |hit| HitId {
                instance: hit.instance,
                primitive: hit.primitive,
            });
            let (t, id) = answers[i];
            let context = format!("{name}: {precision:?} {org:?} {dir:?} to {end}");
            assert_eq!(id, own, "{context}: at {t}, not {said:?}");
            assert_eq!(blocked[i], said.is_some(), "{context}");
            hits += usize::from(said.is_some());
        }
    }
    hits
}

fn cube(scene: &mut SceneBuilder) -> ShapeId {
    let [min, max] = [DVec3::NEG_ONE, DVec3::ONE];
    scene.cuboid("", Cuboid { min, max })
}

/// A block turned by nearly 45° about z, so that its upper right face ends in an edge at
/// x = 1, y = 0, and is left by rays along (1, −1, 0) at the rate `rise`; and so much
/// farther another solid, entered head-on.
fn behind_an_edge(
    scene: &mut SceneBuilder,
    (rise, gap): (f64, f64),
    is_round: bool,
    operator: Operator,
    many: bool,
) -> ShapeId {
    let block = cube(scene);
    let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4 - rise);
    let edge = turn * v(1.0, -1.0, 0.0);
    let map = DAffine3::from_rotation_translation(turn, v(1.0, 0.0, 0.0) - edge);
    let map = scene.transform(map.into());
    let other = match is_round {
        true => Leaf::Round(Sphere {
            center: v(2.0 + gap, 0.0, 0.0),
            radius: 1.0,
        }),
        false => Leaf::Box(Cuboid {
            min: v(1.0 + gap, -1.5, -1.0),
            max: v(2.0, 0.5, 1.0),
        }),
    };
    let other = other.add(scene, 1.0);
    let mut operands = vec![Operand::shape(block).transform(map), Operand::shape(other)];
    // So many that a tree stands over them.
    for i in 0..if many { 12 } else { 0 } {
        let min = v(0.25 * f64::from(i) - 2.0, 2.5, 2.5);
        let max = min + DVec3::splat(0.2);
        operands.push(Operand::shape(scene.cuboid("", Cuboid { min, max })));
    }
    scene.csg("", operator, &operands)
}

/// What lies outside of a ray's ends is asked for as far as it may be one with what lies
/// between: also where it is one of many operands, or its polynomial has no other sign.
#[test]
fn boundaries_beyond_the_ends_of_a_ray_may_be_one_with_those_between() {
    let random = &mut Random(79);
    let (mut met, mut all) = (0, 0);
    for i in 0..campaign(240) as u32 {
        let rise = 10.0_f64.powf(-4.0 - 3.0 * random.unit());
        // Some 24 roundings over the rate are one.
        let gap = random.unit() * 1e-14 / rise;
        let operator = [Union, Difference, Xor][i as usize % 3];
        let asked = Asked::one(|scene| {
            let (is_round, many) = (i & 1 != 0, i & 2 != 0);
            behind_an_edge(scene, (rise, gap), is_round, operator, many)
        });
        let (mut rays, mut ends) = (RayColumns::default(), Vec::new());
        for k in 0..32 {
            let dir = v(1.0, -1.0, 0.0);
            // Past the edge by a few units in the last place: the face is left before it.
            let high = random.below(8) as f64 * f64::EPSILON;
            let edge = v(1.0 + high, 0.0, 0.5 * random.unit());
            // Between both, or begun before them and ended between.
            let part = gap * random.unit();
            let back = if k & 1 == 0 { 1.0 } else { -1.0 };
            let from = if k & 2 == 0 { part } else { part - back * 1e-6 };
            let end = if k & 2 == 0 { f32::INFINITY } else { 1e-6 };
            rays.push(edge + dir * from, (dir * back).to_array().map(|x| x as f32));
            ends.push(end);
        }
        let name = format!("{i}, rise {rise}, gap {gap}");
        met += agree_within(&asked, &rays, &ends, &name);
        all += ends.len() * RIGHT.len();
    }
    assert!(met * 8 > all && met * 8 < all * 7, "{met} of {all}");
}

/// Rods and needles at an angle, which their boxes are much wider than, touch
/// themselves.
#[test]
fn thin_rods_at_an_angle_are_known_by_their_radius() {
    let random = &mut Random(80);
    for i in 0..campaign(160) {
        let axis = (random.vector() + v(1.5, 1.5, 1.5)).normalize() * 4.0;
        let (base, top) = (-axis, axis);
        let radius = 10.0_f64.powf(-1.0 - 3.0 * random.unit());
        let leaf = match i % 2 {
            0 => Leaf::Cylinder(Cylinder {
                base,
                top,
                radius,
                open: false,
            }),
            _ => Leaf::Cone(Cone {
                base,
                top,
                base_radius: radius * 0.5,
                top_radius: radius * 1.5,
                open: false,
            }),
        };
        let across = axis.cross(random.vector()).normalize();
        // As far off as placement is, or a few times that.
        let gap = 10.0_f64.powf(-15.5 + 2.5 * random.unit());
        let shift = [1.0, 3.0, 10.0, 100.0][i / 2 % 4];
        let operator = [Union, Intersection, Difference, Xor][i / 8 % 4];
        let asked = Asked::one(|scene| {
            let rod = leaf.add(scene, 1.0);
            let there = scene.transform(DAffine3::from_translation(v(0.0, 0.0, shift)).into());
            let away = scene.csg("", Union, &[Operand::shape(rod).transform(there)]);
            let back = across * (2.0 * radius + gap) - v(0.0, 0.0, shift);
            let back = scene.transform(DAffine3::from_translation(back).into());
            let operands = [Operand::shape(rod), Operand::shape(away).transform(back)];
            scene.csg("", operator, &operands)
        });
        let mut rays = RayColumns::default();
        for k in 0..48 {
            // Through the line that they touch in, from outside, from within, or from it.
            let off = across.cross(axis).normalize() * (random.unit() - 0.5);
            let off = off * [0.0, 1e-6, 1e-3][k % 3] * radius;
            let dir = (across + off / radius).to_array().map(|x| x as f32);
            let dir = if k & 1 == 0 { dir } else { dir.map(|x| -x) };
            let along = DVec3::from_array(dir.map(f64::from));
            // Near the middle coordinates are small there, and bounds with them.
            let place = (random.unit() - 0.5) * [0.0, radius, 1.0][k / 16];
            let touch = across * radius + axis * place + off;
            let before = [3.0, 1.0, 0.5, 1e-9][k / 4 % 4] * radius;
            rays.push(touch - along * before, dir);
        }
        agree(&asked, &rays);
    }
}

/// Rays from a point into a cone that is some hundredths wide.
pub fn rays_from(random: &mut Random, org: DVec3, dir: DVec3, width: f64) -> RayColumns {
    let mut rays = RayColumns::default();
    for _ in 0..64 {
        let dir = dir.normalize() + random.vector() * width;
        rays.push(org, dir.to_array().map(|x| x as f32));
    }
    rays
}

/// What lies between two solids by a tolerance, or between spaces by placement, is worked
/// out from their normals; these may have any length, and be small beside coordinates.
#[test]
fn normals_of_any_length_say_how_far_off_a_surface_may_be() {
    let random = &mut Random(81);
    let far = v(1e9, 0.0, 0.0);
    for kind in 0..6 {
        let mut tolerance = 0.1;
        let asked = Asked::one(|scene| {
            let [a, b] = match kind {
                // Two half-spaces, as written with normals that have no squares.
                0..4 => {
                    let size = [1e-170, 1e170, 1.0, 1e-300][kind];
                    [(1.0, 0.0), (-1.0, -0.05)].map(|(side, offset)| {
                        let (normal, offset) = (DVec3::Z * (side * size), offset * size);
                        scene.half_space("", HalfSpace { normal, offset })
                    })
                }
                // Small balls far away, with a gap for which the rate matters.
                _ => {
                    tolerance = [4.2e-7, 3e-7][kind - 4];
                    [0.0, 2e-6].map(|x| {
                        let center = far + v(x, 0.0, 0.0);
                        let radius = 1e-6;
                        scene.sphere("", Sphere { center, radius })
                    })
                }
            };
            let (shape, id) = scene.declare_csg("", Union);
            scene.set_operands(id, &[a, b].map(Operand::shape));
            scene.set_tolerance(id, tolerance);
            shape
        });
        let rays = match kind {
            0..4 => rays_from(random, v(0.3, 0.1, -0.5), v(-0.1, -0.2, 1.0), 0.05),
            _ => rays_from(random, far + v(0.0, 7e-7, 0.0), DVec3::X, 0.2),
        };
        agree_within(&asked, &rays, &[f32::INFINITY; 64], &format!("{kind}"));
    }
}

/// Planes as quadrics, in two spaces: nearer than both of their placements together.
#[test]
fn planes_by_their_quadrics_are_one_within_their_placements() {
    let random = &mut Random(82);
    for (distance, gap) in [(1e3, 1.7e-11), (1e9, 1.7e-5), (1e3, 4e-12), (1e3, 4e-11)] {
        let asked = Asked::one(|scene| {
            let (min, max) = (v(-1.0, -1.0, distance - 1.0), v(1.0, 1.0, distance + 1.0));
            let block = scene.cuboid("", Cuboid { min, max });
            let planes = [0.0, 1.0].map(|i| {
                let coefficients = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -gap * i];
                let plane = scene.quadric("", Quadric { coefficients });
                let map = DAffine3::from_translation(v(distance * i, 0.0, distance));
                Operand::shape(plane).transform(scene.transform(map.into()))
            });
            let both = scene.csg("", Xor, &planes);
            scene.csg("", Intersection, &[block, both].map(Operand::shape))
        });
        let rays = rays_from(random, v(0.3, 0.2, 0.0), DVec3::Z, 0.3 / distance);
        let name = format!("{distance} {gap}");
        agree_within(&asked, &rays, &[f32::INFINITY; 64], &name);
    }
}

/// A plane, itself in a space where it may be far off, and a third one that is one with
/// the second alone.
#[test]
fn what_follows_either_of_two_planes_that_are_nearly_one_may_be_one_with_them() {
    let random = &mut Random(83);
    for (scale, gap) in [(1e9, 1e-9), (1e12, 2e-6), (1e9, 1e-5)] {
        let asked = Asked::one(|scene| {
            let block = cube(scene);
            let mut below = |side: f64, offset: f64| {
                let normal = DVec3::Z * side;
                scene.half_space("", HalfSpace { normal, offset })
            };
            let (lower, upper, taken) = (below(1.0, 0.0), below(-1.0, 0.0), below(-1.0, -gap));
            let map = DAffine3::from_scale(v(scale, 1e3, 3e3));
            let upper = Operand::shape(upper).transform(scene.transform(map.into()));
            let union = scene.csg("", Union, &[Operand::shape(lower), upper]);
            let less = scene.csg("", Difference, &[union, taken].map(Operand::shape));
            scene.csg("", Intersection, &[block, less].map(Operand::shape))
        });
        let rays = rays_from(random, v(0.9, 0.0, -0.5), v(-0.05, 0.0, 0.5), 0.1);
        let name = format!("{scale} {gap}");
        agree_within(&asked, &rays, &[f32::INFINITY; 64], &name);
    }
}
