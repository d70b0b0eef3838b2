//! The ray sets that `bench` times: each pixel once, and from each hit one ray of each kind.

use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::Sphere;
use lanecast::internals::io::RaySet;
use lanecast::internals::measure::queries::{Answers, Ask, trace};
use lanecast::internals::measure::ray_kinds::{Kind, Order};
use lanecast::internals::measure::rays::{LIGHT_SIZE, Source, direction_of, light_of, ray_sets};
use lanecast::internals::plan::{Choices, plan};
use lanecast::internals::render::{Grid, Progress};
use lanecast::internals::scene::{Camera, Edge, Instances, Scene, SceneBuilder};
use lanecast::internals::trace::Caching;

const LIGHT: DVec3 = DVec3::new(3.0, 9.0, 5.0);

fn ball() -> Scene {
    let mut scene = SceneBuilder::default();
    let sphere = Sphere {
        center: DVec3::new(0.0, 1.0, 0.0),
        radius: 1.0,
    };
    let ball = scene.sphere("", sphere);
    scene.instance("", Edge::shape(ball));
    scene.finish().unwrap()
}

fn sets_of(scene: &Scene, size: [u32; 2], order: Order) -> (Vec<RaySet>, usize) {
    let instances = Instances::of(scene).unwrap();
    let world = World::build(scene, &instances, Structure::Bvh);
    let kernels = plan(scene, &instances, &Choices::default())
        .unwrap()
        .kernels;
    let eye = DVec3::new(0.0, 1.0, 6.0);
    let camera = Camera::perspective(eye, DVec3::Y, DVec3::Y, 30.0);
    let source = Source {
        world: &world,
        kernels,
        camera,
        grid: Grid::Centers,
        size,
        order,
        light: LIGHT,
        direction: direction_of(&world, LIGHT),
    };
    let progress = Progress::default();
    let sets = ray_sets(&source, &Kind::ALL, &progress).unwrap();
    let mut answers = Answers::default();
    trace(
        &world,
        &kernels,
        &sets[0],
        (Ask::Closest, Caching::On),
        &mut answers,
        &progress,
    )
    .unwrap();
    (sets, answers.hits())
}

#[test]
fn every_pixel_once_in_blocks() {
    let (sets, _) = sets_of(&ball(), [37, 21], Order::Tile);
    let primary = &sets[0];
    assert_eq!(primary.len(), 37 * 21);
    let mut seen: Vec<[u32; 3]> = (0..primary.len())
        .map(|i| primary.dir(i).map(f32::to_bits))
        .collect();
    seen.sort();
    seen.dedup();
    assert_eq!(seen.len(), 37 * 21);
    // The second ray is to the right of the first, the third below it.
    let [a, b, c] = [0, 1, 2].map(|i| primary.dir(i));
    assert!(b[0] > a[0] && b[1] == a[1]);
    assert!(c[0] == a[0] && c[1] < a[1]);
    // Row 16 begins after two blocks of 16×16 and one of 5×16.
    let below = primary.dir(37 * 16);
    assert!(below[0] == a[0] && below[1] < primary.dir(37 * 16 - 1)[1]);
}

#[test]
fn secondary_rays_belong_to_the_hits() {
    let (sets, hits) = sets_of(&ball(), [64, 64], Order::Tile);
    assert!(hits > 500, "{hits}");
    let set = |kind| &sets[Kind::ALL.iter().position(|k| *k == kind).unwrap()];
    let (shadow, from_light) = (set(Kind::Shadow), set(Kind::LightShadow));
    let (diffuse, any) = (set(Kind::Diffuse), set(Kind::DiffuseAny));
    let (parallel, area) = (set(Kind::Directional), set(Kind::AreaShadow));
    let mirror = set(Kind::Mirror);
    assert_eq!(diffuse, any);
    let center = DVec3::new(0.0, 1.0, 0.0);
    let at = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let (mut cosines, mut spread) = (0.0, 0.0);
    for i in 0..hits {
        let org = at(shadow.org(i));
        // Just outside the sphere, and aimed at the light.
        let height = (org - center).length() - 1.0;
        assert!(height > 0.0 && height < 1e-3, "{height}");
        assert!((org + at(shadow.dir(i)) - LIGHT).length() < 1e-5);
        assert_eq!(at(from_light.org(i)), LIGHT);
        assert!((LIGHT + at(from_light.dir(i)) - org).length() < 1e-5);
        let normal = (at(diffuse.org(i)) - center).normalize();
        let cosine = at(diffuse.dir(i)).dot(normal);
        assert!(cosine > -1e-6, "{cosine}");
        cosines += cosine;
        assert_eq!(parallel.dir(i), parallel.dir(0));
        assert_eq!(parallel.org(i), diffuse.org(i));
        // A point of the square: off its middle by a diagonal at most, and
        // at right angles to the line from there to the ball.
        let off = at(area.org(i)) + at(area.dir(i)) - LIGHT;
        let distance = (center - LIGHT).length();
        assert!(off.length() <= 2.0_f64.sqrt() * LIGHT_SIZE * distance + 1e-5);
        assert!(off.dot(center - LIGHT).abs() < 1e-4);
        spread += off.length_squared() / (LIGHT_SIZE * distance).powi(2);
        // The eye sees along the mirrored ray: both make the same angle.
        let seen = (at(mirror.org(i)) - DVec3::new(0.0, 1.0, 6.0)).normalize();
        let left = at(mirror.dir(i)).normalize();
        assert!((left.dot(normal) + seen.dot(normal)).abs() < 1e-3);
        assert!((left - seen).cross(normal).length() < 1e-3);
    }
    // The mean of u² + v² over the square.
    assert!((spread / hits as f64 - 2.0 / 3.0).abs() < 0.1, "{spread}");
    assert!((at(parallel.dir(0)) - (LIGHT - center).normalize()).length() < 1e-6);
    // ∫ cos²/π over the hemisphere is 2/3; its deviation is 0.236/√n.
    let mean = cosines / hits as f64;
    assert!(
        (mean - 2.0 / 3.0).abs() < 4.0 * 0.236 / (hits as f64).sqrt(),
        "{mean}"
    );
    for set in [shadow, from_light, diffuse, parallel, area, mirror] {
        assert_eq!(set.len(), hits);
    }
}

#[test]
fn parallel_rays_show_as_much() {
    let (sets, _) = sets_of(&ball(), [64, 64], Order::Tile);
    let (primary, ortho) = (&sets[0], &sets[1]);
    assert_eq!(primary.len(), ortho.len());
    for i in 0..ortho.len() {
        assert_eq!(ortho.dir(i), [0.0, 0.0, -1.0]);
        // At the ball's depth both are at the same place.
        let at = |k: usize| f64::from(primary.org(i)[k]) + 6.0 * f64::from(primary.dir(i)[k]);
        assert!((f64::from(ortho.org(i)[0]) - at(0)).abs() < 1e-5);
        assert!((f64::from(ortho.org(i)[1]) - at(1)).abs() < 1e-5);
    }
}

#[test]
fn orders_have_the_same_rays() {
    let rows = |order| {
        let (sets, _) = sets_of(&ball(), [37, 21], order);
        sets.iter()
            .map(|set| {
                let bits = |v: &[f32; 3]| v.map(f32::to_bits);
                let rays = (0..set.len()).map(|i| (set.org(i), set.dir(i)));
                rays.map(|(o, d)| (bits(&o), bits(&d))).collect::<Vec<_>>()
            })
            .collect::<Vec<_>>()
    };
    let tile = rows(Order::Tile);
    for order in [Order::Scanline, Order::Morton, Order::Random] {
        let others = rows(order);
        assert!(others[0] != tile[0], "{}", order.name());
        for (mut other, tile) in others.into_iter().zip(&tile) {
            let mut tile = tile.clone();
            other.sort();
            tile.sort();
            assert_eq!(other, tile, "{}", order.name());
        }
    }
}

#[test]
fn the_light_is_the_first_point_or_beside_the_camera() {
    let scene = ball();
    let instances = Instances::of(&scene).unwrap();
    let world = World::build(&scene, &instances, Structure::Bvh);
    let camera = Camera::perspective(DVec3::new(0.0, 1.0, 6.0), DVec3::Y, DVec3::Y, 30.0);
    let light = light_of(&world, &camera);
    assert!(
        (light - DVec3::new(-2.4, 4.6, 6.0)).length() < 1e-5,
        "{light}"
    );
}
