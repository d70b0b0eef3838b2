//! Properties of the reference on random rays: hits are where membership changes, placement
//! means the object ray, and the tree changes nothing.

use super::*;
use crate::common::property;
use glam::{DMat3, DQuat};
use proptest::prelude::*;

const SOLIDS: usize = 9;

/// Whether a point belongs to the solid, by its definition; `edge` is how much
/// nearer than the surface still counts.
fn contains(kind: usize, p: DVec3, edge: f64) -> bool {
    let k = 1.0 + edge;
    match kind {
        0 => (p - v(1.0, 0.0, 0.0)).length() <= 2.0 * k,
        1 => ((p - v(0.0, 1.0, 0.0)) / v(1.0, 2.0, 4.0)).length() <= k,
        2 => p.x * p.x + p.y * p.y <= 1.0 + p.z * p.z + edge * (1.0 + p.length_squared()),
        3 => p.x.hypot(p.z) <= k && (p.y - 1.5).abs() <= 1.5 * k,
        4 => p.y >= -edge && p.x.hypot(p.z) <= (4.0 - p.y) / 2.0 + edge,
        5 => (p.abs() / v(1.0, 2.0, 3.0)).max_element() <= k,
        6 => p.abs().element_sum() <= k,
        7 => p.y <= 2.0 + edge,
        _ => (p.x.hypot(p.y) - 1.5).hypot(p.z) <= 0.5 + edge,
    }
}

fn number() -> impl Strategy<Value = f64> {
    -4.0..4.0_f64
}

fn vector() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| v(x, y, z))
}

prop_compose! {
    /// Turned, mirrored, stretched and moved, but not flat.
    fn placement()(axis in vector(), angle in number(), scale in vector(), at in vector())
        -> DAffine3
    {
        let turn = DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::X), angle);
        let scale = scale + scale.signum() * 0.1;
        let linear = DMat3::from_quat(turn) * DMat3::from_diagonal(scale);
        DAffine3::from_mat3_translation(linear, at)
    }
}

fn placed(b: &mut SceneBuilder, kind: usize, place: DAffine3) {
    let shape = KINDS[kind](b);
    let transform = b.transform(place.into());
    b.instance("", Edge::shape(shape).transform(transform));
}

/// Instance and primitive, or a miss.
type Ids = Option<(u64, u32)>;

fn ids(answer: &Option<Hit>) -> Ids {
    answer.map(|h| (h.instance, h.primitive))
}

proptest! {
    #![proptest_config(property(2000))]

    /// Along the ray the solid neither begins nor ends before the hit, and does
    /// so at the hit.
    #[test]
    fn the_first_hit_is_where_membership_changes(
        kind in 0..SOLIDS, org in vector(), to in vector()
    ) {
        let dir = to - org;
        prop_assume!(dir.length() > 0.1);
        let (scene, all) = scene_of(|b| place(b, KINDS[kind]));
        let reference = Reference::brute_force(&scene, &all).unwrap();
        let answer = reference.nearest(org.to_array(), dir.to_array(), INF);
        let inside = contains(kind, org, 0.0);
        // Samples between 0 and the hit, or far beyond the solid. Points within
        // rounding of the surface say nothing.
        let end = answer.map_or(100.0 / dir.length(), |h| h.t);
        for i in 1..200 {
            let p = org + dir * (end * f64::from(i) / 200.0);
            prop_assert!(
                contains(kind, p, 1e-12) == inside || contains(kind, p, -1e-12) == inside
            );
        }
        if let Some(hit) = answer {
            let p = org + dir * hit.t;
            prop_assert!(contains(kind, p, 1e-12) && !contains(kind, p, -1e-12));
            // The normal is outward: the ray goes in against it.
            let n = DVec3::from_array(hit.normal);
            prop_assert!((n.length() - 1.0).abs() < 1e-14);
            prop_assert_eq!(n.dot(dir) > 0.0, inside);
        }
    }

    /// From within a closed mesh nothing gets out, aimed at an edge, a corner
    /// or past both by one step of f32.
    #[test]
    fn meshes_have_no_cracks(
        corners in prop::collection::vec(prop::array::uniform3(1.0..9.0_f32), 4),
        org in prop::array::uniform3(-0.1..0.1_f64),
        (a, b) in (0..4_usize, 0..4_usize),
        along in prop::sample::select(vec![0.0, 0.5, 0.25, 0.3_f32]),
        at in placement(),
        step in 0..8_u32,
    ) {
        // Around the origin whatever the numbers.
        let signs = [[-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0_f32]];
        let corners: Vec<[f32; 3]> = (0..4)
            .map(|i| std::array::from_fn(|k| corners[i][k] * 0.1 * signs[i][k] + 5.0 * signs[i][k]))
            .collect();
        let data = MeshData {
            positions: corners.iter().map(|c| c.map(f64::from)).collect(),
            triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
            ..MeshData::default()
        };
        let (scene, all) = scene_of(|b| {
            let mesh = b.mesh("", &data);
            let at = b.transform(at.into());
            b.instance("", Edge::shape(mesh).transform(at));
        });
        let aim = std::array::from_fn(|k| {
            let x = corners[a][k] + (corners[b][k] - corners[a][k]) * along;
            f64::from(if step >> k & 1 == 0 { x } else { x.next_up() })
        });
        // From the object's space into the world, rounded as a fast path would.
        let world = |p: [f64; 3]| at.transform_point3(DVec3::from_array(p));
        let (from, to) = (world(org), world(aim));
        let dir = (to - from).to_array().map(|x| f64::from(x as f32));
        for reference in [Reference::new(&scene, &all).unwrap(), Reference::brute_force(&scene, &all).unwrap()] {
            let answer = reference.nearest(from.to_array(), dir, INF);
            prop_assert!(answer.is_some(), "{answer:?}");
            prop_assert!(reference.blocked(from.to_array(), dir, INF));
        }
    }

    /// A placed shape meets a world ray where the shape alone meets the object
    /// ray made by hand; the normal stays orthogonal to placed tangents.
    #[test]
    fn placement_is_the_object_ray(
        kind in 0..KINDS.len(), at in placement(), org in vector(), to in vector()
    ) {
        let (alone, all_alone) = scene_of(|b| place(b, KINDS[kind]));
        let (scene, all) = scene_of(|b| placed(b, kind, at));
        let m = all.rows[0].object_from_world;
        // Numbers at random are never equally large.
        let size = m.linear().map(|c| c.iter().fold(0.0, |s, x| f64::max(s, x.abs())));
        let last = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap();
        let rows = |p: [f64; 3], w: f64| -> [f64; 3] {
            std::array::from_fn(|r| {
                let product = |c: usize| m.linear()[c % 3][r] * p[c % 3];
                let sum = (product(last + 1) + product(last + 2)) + product(last);
                if w == 0.0 { sum } else { sum + m.translation[r] }
            })
        };
        let (org, dir) = (org.to_array(), (to - org).to_array());
        let world = Reference::new(&scene, &all).unwrap().nearest(org, dir, INF);
        let hand =
            Reference::brute_force(&alone, &all_alone).unwrap().nearest(rows(org, 1.0), rows(dir, 0.0), INF);
        prop_assert_eq!(ids(&world), ids(&hand));
        let (Some(a), Some(b)) = (world, hand) else { return Ok(()) };
        prop_assert_eq!(a.t, b.t);
        let (n, object_n) = (DVec3::from_array(a.normal), DVec3::from_array(b.normal));
        for tangent in [object_n.any_orthonormal_vector(), object_n.any_orthonormal_pair().1] {
            let tangent = at.matrix3 * tangent;
            prop_assert!(n.dot(tangent.normalize()).abs() < 1e-12);
        }
        // Outward stays outward, mirrored or not.
        prop_assert!(n.dot(at.matrix3 * object_n) > 0.0);
    }
}

proptest! {
    #![proptest_config(property(150))]

    /// The tree prunes, nothing else.
    #[test]
    fn the_tree_is_brute_force(
        shapes in prop::collection::vec((0..KINDS.len(), placement()), 1..40),
        soup in prop::collection::vec((vector(), vector(), vector()), 1..60),
        rays in prop::collection::vec((vector(), vector()), 40),
        far in prop::sample::select(vec![1.0, 1e3, 1e8]),
    ) {
        let (scene, all) = scene_of(|b| {
            for (kind, at) in &shapes {
                placed(b, *kind, *at);
            }
            let mut data = MeshData::default();
            for (p, q, r) in &soup {
                let first = data.positions.len() as u32;
                let corners = [*p, *p + *q * 0.3, *p + *r * 0.3];
                data.positions.extend(corners.map(|c| c.to_array()));
                data.triangles.push([first, first + 1, first + 2]);
            }
            let mesh = b.mesh("", &data);
            let at = b.transform(shapes[0].1.into());
            b.instance("", Edge::shape(mesh).transform(at));
        });
        let (tree, brute) = (Reference::new(&scene, &all).unwrap(), Reference::brute_force(&scene, &all).unwrap());
        for (org, to) in rays {
            let (org, to) = (org * far, to.to_array());
            let dir: [f64; 3] = std::array::from_fn(|k| to[k] - org[k]);
            for t_max in [INF, 1.0] {
                let org = org.to_array();
                prop_assert_eq!(tree.nearest(org, dir, t_max), brute.nearest(org, dir, t_max));
                prop_assert_eq!(tree.blocked(org, dir, t_max), brute.blocked(org, dir, t_max));
            }
        }
    }

    /// Corners off the plane by as much as is allowed: a grazing ray meets the
    /// plane far from the outline's box.
    #[test]
    fn the_tree_finds_polygons_that_are_not_quite_flat(
        lift in prop::collection::vec(-1.0..1.0_f64, 8),
        rays in prop::collection::vec((vector(), vector(), -12..0_i32), 40),
        at in placement(),
    ) {
        let (scene, all) = scene_of(|b| {
            let points: Vec<DVec3> = (0..8)
                .map(|i| {
                    let angle = f64::from(i) * std::f64::consts::FRAC_PI_4;
                    v(angle.cos(), angle.sin(), lift[i as usize] * 5e-7)
                })
                .collect();
            let shape = b.polygon("", &points, &[]);
            let transform = b.transform(at.into());
            b.instance("", Edge::shape(shape).transform(transform));
        });
        let (tree, brute) = (Reference::new(&scene, &all).unwrap(), Reference::brute_force(&scene, &all).unwrap());
        for (org, to, power) in rays {
            let low = v(1.0, 1.0, f64::powi(10.0, power));
            let (from, to) = (org * low, to * v(0.2, 0.2, 1.0) * low);
            let org = at.transform_point3(from).to_array();
            // Toward the outline, or away from it: the plane may be ahead all the same.
            let away = if power % 2 == 0 { 1.0 } else { -1.0 };
            let dir = at.transform_vector3((to - from) * away).to_array();
            for t_max in [INF, 1.0] {
                prop_assert_eq!(tree.nearest(org, dir, t_max), brute.nearest(org, dir, t_max));
                prop_assert_eq!(tree.blocked(org, dir, t_max), brute.blocked(org, dir, t_max));
            }
        }
    }

    /// A power of two changes no t.
    #[test]
    fn powers_of_two_change_nothing(
        at in placement(), kind in 0..KINDS.len(), org in vector(), to in vector(),
        power in -40..40_i32,
    ) {
        let s = f64::powi(2.0, power);
        let (scene, all) = scene_of(|b| placed(b, kind, at));
        let (large, all_large) = scene_of(|b| {
            let shape = KINDS[kind](b);
            let inner = b.transform(at.into());
            let outer = b.transform(DAffine3::from_scale(DVec3::splat(s)).into());
            let node = b.node("", &[Edge::shape(shape).transform(inner)]);
            b.instance("", Edge::node(node).transform(outer));
        });
        let dir = to - org;
        let small = Reference::new(&scene, &all).unwrap().nearest(org.to_array(), dir.to_array(), INF);
        let large = Reference::new(&large, &all_large).unwrap()
            .nearest((org * s).to_array(), (dir * s).to_array(), INF);
        prop_assert_eq!(small, large);
    }
}
