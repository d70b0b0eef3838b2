//! t of a solid is invariant under permutations of the axes.

use super::Turn;
use crate::common::property;
use glam::DVec3;
use lanecast::internals::geom::guarded::{self, ObjectRay};
use lanecast::internals::geom::{
    Cone, Cuboid, Ellipsoid, HalfSpace, Meet, Ray, Sphere, cone, cuboid, ellipsoid, half_space,
    sphere,
};
use lanecast::internals::math::lanes::{Lanes, Mask, Scalar};
use lanecast::internals::math::{Vec3, unordered_dot};
use proptest::prelude::*;

/// Numbers of which solids are made.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    center: DVec3,
    /// Positive.
    size: DVec3,
    radii: [f64; 2],
}

impl Numbers {
    fn turned(&self, turn: &Turn) -> Numbers {
        Numbers {
            center: turn.of(self.center),
            size: turn.of(self.size).abs(),
            ..*self
        }
    }

    /// From one corner of the box to the opposite one: always the same two.
    fn cone(&self, turn: &Turn) -> Cone {
        let along = turn.of(turn_back(turn, self.size));
        Cone {
            base: self.center - along,
            top: self.center + along,
            base_radius: self.radii[0],
            top_radius: self.radii[1],
            open: false,
        }
    }
}

/// Where positive sizes, already turned, come from.
fn turn_back(turn: &Turn, size: DVec3) -> DVec3 {
    let mut back = DVec3::ZERO;
    for k in 0..3 {
        back[turn.from[k]] = size[k];
    }
    back
}

/// The bits of t.
fn bits<L: Lanes>(meet: Meet<L>) -> Option<u64> {
    meet.hit.any().then(|| meet.t.lane(0).to_f64().to_bits())
}

/// t of each solid by each kernel, where it is certain.
fn depths<L: Lanes>(solid: &Numbers, turn: &Turn, org: DVec3, dir: DVec3) -> Vec<Option<u64>> {
    let full = |v: DVec3| Vec3::<L::Double>::splat(v.to_array());
    let lanes = |v: DVec3| Vec3::<L>::splat(v.to_array().map(L::Scalar::from_f64));
    let ray = Ray::new(lanes(org), lanes(dir), L::zero());
    let (org, dir) = (full(org), full(dir));
    let object = ObjectRay::new(&org, &dir, &ray);
    let all = L::Mask::splat(true);
    let Numbers {
        center,
        size,
        radii,
    } = *solid;
    let ball = Sphere {
        center,
        radius: radii[0],
    };
    let egg = Ellipsoid {
        center,
        radii: size,
    };
    let cuboid = Cuboid {
        min: center - size,
        max: center + size,
    };
    let drum = solid.cone(turn);
    let axis = turn.of(turn_back(turn, size));
    let plane = |normal: DVec3| HalfSpace {
        normal,
        offset: 0.25 + unordered_dot(normal, center),
    };
    let planes = [
        plane(axis),
        plane(turn.of(DVec3::X)),
        plane(turn.of(-DVec3::Y)),
    ];
    let beyond = |span: lanecast::internals::geom::Span<L>| span.first_beyond(ray.t_min);
    let meets = [
        guarded::sphere::meet_sphere(&ball, &object, all),
        guarded::sphere::meet_ellipsoid(&egg, &object, all),
        guarded::cuboid::meet(&cuboid, &object, all),
        guarded::cone::meet(&drum.upright(), &object, all),
        guarded::half_space::meet(&planes[0], &object, all),
        guarded::half_space::meet_polyhedron(&planes, center, &object, all),
        beyond(sphere::span(&ball, &ray)),
        beyond(ellipsoid::span(&egg, &ray)),
        beyond(cuboid::span(&cuboid, &ray)),
        beyond(cone::span(&drum.upright(), &ray)),
        beyond(half_space::span(&planes, &ray)),
    ];
    meets.into_iter().map(bits).collect()
}

fn vector(range: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-range..range).prop_map(DVec3::from_array)
}

proptest! {
    #![proptest_config(property(500))]

    #[test]
    fn a_solid_is_as_deep_however_it_is_turned(
        center in vector(1.0),
        size in vector(1.0),
        radii in prop::array::uniform2(0.1..1.5_f64),
        org in vector(4.0),
        aside in vector(1.0),
    ) {
        let solid = Numbers { center, size: size.abs() + DVec3::splat(0.05), radii };
        let dir = solid.center + aside - org;
        let dir = DVec3::from_array(dir.to_array().map(|x| f64::from(x as f32)));
        let single = depths::<f32>(&solid, &Turn::NONE, org, dir);
        let double = depths::<f64>(&solid, &Turn::NONE, org, dir);
        for turn in super::all_turns() {
            let (solid, org, dir) = (solid.turned(&turn), turn.of(org), turn.of(dir));
            prop_assert_eq!(&depths::<f32>(&solid, &turn, org, dir), &single, "{:?}", turn);
            prop_assert_eq!(&depths::<f64>(&solid, &turn, org, dir), &double, "{:?}", turn);
        }
    }
}
