//! Polynomial surfaces of any size and from any distance: the same rays meet them.

use crate::common::{Random, RayColumns, barth_sextic, kernels, torus};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Clip, Sphere};
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::scene::{Edge, Instances, Scene, SceneBuilder, ShapeId};
use lanecast::internals::trace::{HitId, ShadowCache};

const RIGHT: [Precision; 2] = [Precision::Guarded, Precision::Exact];

/// Rays a side.
const SIDE: u32 = 64;

/// Of a grid's 4096 rays those that may meet the one and miss the other of two surfaces
/// that differ by their size: no more than lie by chance within the roundings of a silhouette.
/// From 10^6 radii away these are about 10^-10 of the grid's spacing, and some 300
/// rays lie beside silhouettes; so by chance it is none.
const AT_SILHOUETTES: usize = 1;

/// Each ray of a grid that is asked of the reference as well.
const SAMPLE: usize = 89;

#[derive(Clone, Copy, Debug)]
enum Size {
    /// Of its transform.
    Placed,
    /// Its own lengths.
    Own,
}

#[derive(Clone, Copy, Debug)]
enum Surface {
    /// Of radii 1 and 0.3.
    Torus,
    /// In a ball of radius 2.2.
    Sextic,
}

impl Surface {
    fn add(self, to: &mut SceneBuilder, scale: f64) -> ShapeId {
        let center = DVec3::ZERO;
        match self {
            Surface::Torus => to.implicit("", torus(center, [scale, 0.3 * scale]), false, None),
            Surface::Sextic => {
                let radius = 2.2 * scale;
                let clip = Clip::Sphere(Sphere { center, radius });
                to.implicit("", barth_sextic(center, scale), true, Some(clip))
            }
        }
    }

    /// Half the side of a square that it is seen in.
    fn reach(self) -> f64 {
        match self {
            Surface::Torus => 1.4,
            Surface::Sextic => 2.3,
        }
    }

    /// Turned, so that nothing of it is along an axis; not about the origin.
    fn scene(self, size: Size, scale: f64) -> Scene {
        let mut to = SceneBuilder::default();
        let (own, placed) = match size {
            Size::Placed => (1.0, scale),
            Size::Own => (scale, 1.0),
        };
        let shape = self.add(&mut to, own);
        let axis = DVec3::new(0.6, 0.3, -0.2).normalize();
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(placed),
            DQuat::from_axis_angle(axis, 0.9),
            MIDDLE * scale,
        );
        let edge = Edge::shape(shape).transform(to.transform(map.into()));
        to.instance("", edge);
        to.finish().expect("a good scene")
    }
}

const MIDDLE: DVec3 = DVec3::new(0.25, -0.5, 0.125);

#[derive(Clone, Copy, Debug)]
enum Rays {
    Parallel,
    /// From one point.
    Central,
}

/// The grid, about a surface of the size `scale`, from `distance` times that.
fn grid(rays: Rays, reach: f64, distance: f64, scale: f64) -> RayColumns {
    let mut columns = RayColumns::default();
    for i in 0..SIDE * SIDE {
        let [a, b] = [i % SIDE, i / SIDE].map(|k| (2 * k + 1) as f64 / SIDE as f64 - 1.0);
        let across = DVec3::new(a, b, 0.0) * reach;
        let eye = MIDDLE + DVec3::Z * distance;
        match rays {
            Rays::Parallel => columns.push((eye + across) * scale, [0.0, 0.0, -1.0]),
            Rays::Central => {
                let dir = across / distance - DVec3::Z;
                columns.push(eye * scale, dir.to_array().map(|x| x as f32));
            }
        }
    }
    columns
}

/// Which rays meet it, and where, by each arithmetic; the reference agrees.
fn met(scene: &Scene, columns: &RayColumns, context: &str) -> [Vec<bool>; 2] {
    let instances = Instances::of(scene).expect("one");
    let world = World::build(scene, &instances, Structure::Bvh);
    let reference = Reference::new(scene, &instances).expect("one");
    RIGHT.map(|precision| {
        let answers = columns.closest(&world, &kernels(precision));
        let cache = &mut ShadowCache::new(Default::default());
        let ends = vec![f32::INFINITY; columns.len()];
        let blocked = columns.any(&world, &kernels(precision), &ends, cache);
        for i in (0..columns.len()).step_by(SAMPLE) {
            let (org, dir) = columns.ray(i);
            let truth = reference.nearest(org, dir.map(f64::from), f64::INFINITY);
            let (t, id) = answers[i];
            let context = format!("{context} {precision:?} {org:?} {dir:?}: {t} {truth:?}");
            assert_eq!(id != HitId::NONE, truth.is_some(), "{context}");
            let near = match precision {
                Precision::Exact => 1e-14,
                _ => 1e-6,
            };
            let far = truth.is_some_and(|truth| (t - truth.t).abs() > near * truth.t);
            assert!(!far, "{context}");
        }
        let met: Vec<bool> = answers.iter().map(|a| a.1 != HitId::NONE).collect();
        assert_eq!(blocked, met, "{context} {precision:?}");
        met
    })
}

fn check(surface: Surface, size: Size) {
    for rays in [Rays::Parallel, Rays::Central] {
        for distance in [1e1, 1e3, 1e6] {
            let context = format!("{surface:?} {size:?} {rays:?} from {distance}");
            let of = |scale: f64| {
                let scene = surface.scene(size, scale);
                let columns = grid(rays, surface.reach(), distance, scale);
                met(&scene, &columns, &format!("{context}, {scale}"))
            };
            let unscaled = of(1.0);
            let count = unscaled[0].iter().filter(|met| **met).count();
            assert_eq!(unscaled[0], unscaled[1], "{context}");
            assert!(count > 900 && count < 3900, "{context}: {count}");
            for power in [-6, -5, -3, -1, 2, 4, 6] {
                let scaled = of(libm::exp10(f64::from(power)));
                for (met, precision) in scaled.iter().zip(RIGHT) {
                    let pairs = met.iter().zip(&unscaled[0]);
                    let other = pairs.filter(|(a, b)| a != b).count();
                    let context = format!("{context}, 10^{power} {precision:?}");
                    assert!(other <= AT_SILHOUETTES, "{context}: {other} of {count}");
                }
            }
        }
    }
}

#[test]
fn a_torus_of_any_size_from_anywhere() {
    check(Surface::Torus, Size::Placed);
    check(Surface::Torus, Size::Own);
}

#[test]
fn a_sextic_of_any_size_from_anywhere() {
    check(Surface::Sextic, Size::Placed);
}

/// From far away a torus is seen as from near.
#[test]
fn distance_does_not_show_in_parallel_rays() {
    for surface in [Surface::Torus, Surface::Sextic] {
        let scene = surface.scene(Size::Placed, 1.0);
        let of = |distance: f64| {
            let columns = grid(Rays::Parallel, surface.reach(), distance, 1.0);
            met(&scene, &columns, &format!("{surface:?} from {distance}"))
        };
        let near = of(1e1);
        for distance in [1e2, 1e4, 1e6] {
            for (far, near) in of(distance).iter().zip(&near) {
                let other = far.iter().zip(near).filter(|(a, b)| a != b).count();
                assert!(other <= AT_SILHOUETTES, "{surface:?} {distance}: {other}");
            }
        }
    }
}

/// Radii and places of tori times a power of two.
#[test]
fn lengths_times_powers_of_two_change_no_bit_of_t() {
    let world_of = |scale: f64| {
        let random = &mut Random(17);
        let mut to = SceneBuilder::default();
        for i in 0..12 {
            // 1 is a length like others.
            let radii = [random.size(), 0.375 * (1.0 + f64::from(i % 2))];
            let center = random.vector() * 2.0 * scale;
            let shape = match i % 4 {
                3 => {
                    let radius = radii[0] * scale;
                    let clip = Clip::Sphere(Sphere { center, radius });
                    to.implicit("", barth_sextic(center, 0.3 * scale), true, Some(clip))
                }
                _ => to.implicit("", torus(center, radii.map(|r| r * scale)), false, None),
            };
            to.instance("", Edge::shape(shape));
        }
        to.finish().expect("a good scene")
    };
    let rays_of = |scale: f64| {
        let random = &mut Random(18);
        let mut rays = RayColumns::default();
        for i in 0..1500 {
            let org = random.vector() * [3.0, 1.0, 300.0][i % 3];
            let dir = random.vector() * 2.0 - org;
            rays.push(org * scale, dir.to_array().map(|x| x as f32));
        }
        rays
    };
    let bits = |scale: f64, precision: Precision| -> Vec<(f64, HitId)> {
        let scene = world_of(scale);
        let instances = Instances::of(&scene).expect("few");
        let world = World::build(&scene, &instances, Structure::Bvh);
        rays_of(scale).closest(&world, &kernels(precision))
    };
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        let expected = bits(1.0, precision);
        let hits = expected.iter().filter(|a| a.1 != HitId::NONE).count();
        assert!(hits > 300, "{hits}");
        let far = match precision {
            Precision::Exact => 100,
            _ => 40,
        };
        for power in [-far, -17, -1, 1, 2, far] {
            let scale = libm::exp2(f64::from(power));
            for (i, (found, expected)) in bits(scale, precision).iter().zip(&expected).enumerate() {
                let context = format!("{precision:?} 2^{power} ray {i}: {found:?} {expected:?}");
                assert_eq!(found.1, expected.1, "{context}");
                let same = found.0.to_bits() == (expected.0 * scale).to_bits();
                assert!(same || found.1 == HitId::NONE, "{context}");
            }
        }
    }
}
