//! Polygons whose corners lie a little off their plane, and rays that nearly lie in it: every
//! structure has the reference's hits.

use crate::common::{Random, RayColumns, dented, kernels, structures};
use glam::DVec3;
use lanecast::internals::accel::World;
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::scene::{Edge, Instances, PolygonId, SceneBuilder};
use lanecast::internals::trace::HitId;

/// Of three, four or eight corners, lifted by up to 5 * 10^-7.
fn uneven_polygons(random: &mut Random) -> SceneBuilder {
    let mut scene = SceneBuilder::default();
    for sort in 0..12 {
        let (u, v) = (random.vector(), random.vector());
        let up = u.cross(v).normalize();
        let center = random.vector();
        let flat = |x: f64, y: f64| center + u * x + v * y;
        let outline = match sort % 3 {
            0 => vec![flat(0.0, 0.0), flat(1.0, 0.0), flat(0.0, 1.0)],
            1 => [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
                .map(|(x, y)| flat(x, y))
                .to_vec(),
            _ => dented(flat).to_vec(),
        };
        let size = u.abs().max(v.abs()).max_element();
        let lifted = |p: DVec3| p + up * (random.vector().x * size * 5e-7);
        let points: Vec<DVec3> = outline.into_iter().map(lifted).collect();
        let shape = scene.polygon("", &points, &[]);
        scene.instance("", Edge::shape(shape));
    }
    scene
}

#[test]
fn grazing_rays_meet_polygons_as_the_reference_does() {
    let (mut hits, mut beside) = (0, 0);
    for seed in 0..20 {
        let random = &mut Random(seed);
        let scene = uneven_polygons(random).finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        let reference = Reference::new(&scene, &instances).unwrap();
        let mut rays = RayColumns::default();
        for i in 0..240 {
            let polygon = scene.polygons.row(PolygonId(i as u32 % 12));
            let corner = |random: &mut Random| {
                let n = polygon.points.len();
                polygon.points[random.below(n as u64) as usize]
            };
            let (a, b) = (corner(random), corner(random));
            // From corner to corner, and off the plane by less and less.
            let off = polygon.normal * (random.vector().x * f64::powi(10.0, -(i % 10)));
            let org = a + (a - b) * 0.5 + off * 1e-3;
            let dir = (b - a - off).to_array().map(|x| x as f32);
            if dir != [0.0; 3] {
                rays.push(org, dir);
            }
        }
        let expected: Vec<Option<HitId>> = (0..rays.len())
            .map(|i| {
                let (org, dir) = rays.ray(i);
                let hit = reference.nearest(org, dir.map(f64::from), f64::INFINITY)?;
                Some(HitId {
                    instance: hit.instance,
                    primitive: hit.primitive,
                })
            })
            .collect();
        hits += expected.iter().flatten().count();
        beside += expected.len();
        for structure in structures() {
            let world = World::build(&scene, &instances, structure);
            for precision in [Precision::Exact, Precision::Guarded] {
                let kernels = kernels(precision);
                let found = rays.closest(&world, &kernels);
                for (i, (_, id)) in found.into_iter().enumerate() {
                    let id = (id != HitId::NONE).then_some(id);
                    let what = format!("seed {seed}, ray {i}: {structure:?}, {precision:?}");
                    assert_eq!(id, expected[i], "{what}");
                }
            }
        }
    }
    println!("{hits} hits of {beside} rays");
    assert!(hits > 1000);
}
