//! Ray sets of a scene: the work that `bench` times and exports.
//!
//! As the peers' own generator makes them (kinds, counts, order), so that the
//! figures compare. Everything is f32, as in the `.rays` format; later rays
//! start from hits of the rounded ones. Secondary rays follow the order of the
//! primary hits, one a hit, on the camera's side of the surface, whether or not
//! it faces the light. Rays whose numbers f32 cannot hold, or without a
//! direction, are left out.
//!
//! Deterministic: random directions are a hash of the hit's number, elementary
//! functions come from the crate `libm`.

use super::queries::{Answers, Ask, trace};
use crate::accel::World;
use crate::io::RaySet;
use crate::plan::{Arithmetic, Kernels};
use crate::render::{BLOCK, Progress, RayGenerator, every_second_bit, mix, unit};
use crate::scene::{Camera, Light};
use crate::shade::Surface;
use crate::trace::HitId;
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Through the pixels' centres (or corners): absolute blocks of 16×16 pixels
    /// row by row, Morton order inside, the renderer's packets.
    Primary,
    /// From the primary hits to one point light, t in (0, 1).
    Shadow,
    /// The same from the light to the hits, t in (0, 1 − 1e-4).
    LightShadow,
    /// One bounce per primary hit, cosine-distributed about the normal.
    Diffuse,
    /// The same rays, asked for any hit.
    DiffuseAny,
}

impl Kind {
    pub const ALL: [Kind; 5] = [
        Kind::Primary,
        Kind::Shadow,
        Kind::LightShadow,
        Kind::Diffuse,
        Kind::DiffuseAny,
    ];

    /// On the command line and in file names.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Shadow => "shadow",
            Kind::LightShadow => "lightshadow",
            Kind::Diffuse => "diffuse",
            Kind::DiffuseAny => "diffuse_any",
        }
    }

    pub fn named(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    pub fn ask(self) -> Ask {
        match self {
            Kind::Primary | Kind::Diffuse => Ask::Closest,
            Kind::Shadow | Kind::LightShadow | Kind::DiffuseAny => Ask::Any,
        }
    }
}

/// What the sets are made from.
pub struct Source<'a> {
    pub world: &'a World<'a>,
    /// Best f64: the sets depend on the hits.
    pub kernels: Kernels,
    pub generator: RayGenerator,
    /// Rays across and down.
    pub size: [u32; 2],
    /// World space.
    pub light: DVec3,
}

/// Short of the surface that the ray from the light was aimed at.
const LIGHT_T_MAX: f32 = 1.0 - 1e-4;

/// The sets of these kinds, in their order. Runs on the current rayon pool;
/// `None` where `progress` was cancelled.
pub fn ray_sets(source: &Source, kinds: &[Kind], progress: &Progress) -> Option<Vec<RaySet>> {
    let primary = primary(source);
    let mut answers = Answers::default();
    let alone = kinds.iter().all(|kind| *kind == Kind::Primary);
    if !alone {
        let (world, kernels) = (source.world, &source.kernels);
        trace(
            world,
            kernels,
            &primary,
            Ask::Closest,
            &mut answers,
            progress,
        )?;
    }
    let hits = |each: &dyn Fn(&Surface, u64, &mut RaySet)| {
        let mut set = RaySet::default();
        for (i, id) in answers.id.iter().enumerate() {
            if *id == HitId::NONE {
                continue;
            }
            // The offset of f32: that is how the rays are stored.
            let surface = Surface::at(
                source.world,
                Arithmetic::F32,
                primary.org[i].map(f64::from),
                primary.dir[i],
                f64::from(answers.t[i]),
                *id,
            );
            each(&surface, i as u64, &mut set);
        }
        set
    };
    let light = source.light;
    let sets = kinds.iter().map(|kind| match kind {
        Kind::Primary => primary.clone(),
        Kind::Shadow => hits(&|surface, _, set| {
            let from = rounded(surface.leave(surface.facing()));
            push(set, from, light - from, 1.0);
        }),
        Kind::LightShadow => hits(&|surface, _, set| {
            let (from, to) = (rounded(light), surface.leave(surface.facing()));
            push(set, from, to - from, LIGHT_T_MAX);
        }),
        Kind::Diffuse | Kind::DiffuseAny => hits(&|surface, number, set| {
            let facing = surface.facing();
            let dir = cosine_distributed(facing, number);
            push(set, surface.leave(facing), dir, f32::INFINITY);
        }),
    });
    Some(sets.collect())
}

fn primary(source: &Source) -> RaySet {
    let [width, height] = source.size;
    let mut set = RaySet::with_capacity(width as usize * height as usize);
    for block_y in (0..height).step_by(BLOCK as usize) {
        for block_x in (0..width).step_by(BLOCK as usize) {
            for code in 0..BLOCK * BLOCK {
                let x = block_x + every_second_bit(code);
                let y = block_y + every_second_bit(code >> 1);
                if x < width && y < height {
                    let (org, dir) = source.generator.ray(x, y, [0.5, 0.5]);
                    let dir = DVec3::from_array(dir.map(f64::from));
                    push(&mut set, org, dir, f32::INFINITY);
                }
            }
        }
    }
    set
}

fn push(set: &mut RaySet, org: DVec3, dir: DVec3, t_max: f32) {
    let [org, dir] = [org, dir].map(|v| v.to_array().map(|x| x as f32));
    let finite = org.iter().chain(&dir).all(|x| x.is_finite());
    if finite && dir != [0.0; 3] {
        set.push(org, 0.0, dir, t_max);
    }
}

/// What f32 makes of a point.
fn rounded(point: DVec3) -> DVec3 {
    point.as_vec3().as_dvec3()
}

/// Unit, about the unit vector `n` (Malley: a uniform disk, lifted).
fn cosine_distributed(n: DVec3, number: u64) -> DVec3 {
    let bits = mix(number);
    let (u, v) = (unit(bits), unit(mix(bits)));
    let radius = u.sqrt();
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * v);
    let (x, y) = n.any_orthonormal_pair();
    x * (radius * cos) + y * (radius * sin) + n * (1.0 - u).sqrt()
}

/// The scene's first point light; if it has none, a point up and to the left of
/// the camera: eye + (0.6·up − 0.4·right)·d, d the distance from the eye to the
/// middle of what has bounds.
pub fn light_of(world: &World, camera: &Camera) -> DVec3 {
    let first = world.scene.lights.iter().find_map(|light| match light {
        Light::Point { position, .. } => Some(*position),
        Light::Directional { .. } => None,
    });
    first.unwrap_or_else(|| {
        let bounds = world.bounds.widened();
        let distance = (bounds.center() - camera.eye).length();
        let known = !bounds.is_empty() && distance.is_finite() && distance > 0.0;
        let distance = if known { distance } else { 1.0 };
        camera.eye + (camera.up * 0.6 - camera.right * 0.4) * distance
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Structure;
    use crate::geom::Sphere;
    use crate::plan::{Choices, plan};
    use crate::render::Grid;
    use crate::scene::{Appearances, Edge, Scene, SceneBuilder};

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

    fn sets_of(scene: &Scene, size: [u32; 2]) -> (Vec<RaySet>, usize) {
        let appearances = Appearances::of(scene).unwrap();
        let world = World::build(scene, &appearances, Structure::Bvh);
        let kernels = plan(scene, &appearances, &Choices::default())
            .unwrap()
            .kernels;
        let eye = DVec3::new(0.0, 1.0, 6.0);
        let camera = Camera::perspective(eye, DVec3::Y, DVec3::Y, 30.0);
        let source = Source {
            world: &world,
            kernels,
            generator: RayGenerator::new(camera, size[0], size[1], Grid::Centers),
            size,
            light: LIGHT,
        };
        let progress = Progress::default();
        let sets = ray_sets(&source, &Kind::ALL, &progress).unwrap();
        let mut answers = Answers::default();
        trace(
            &world,
            &kernels,
            &sets[0],
            Ask::Closest,
            &mut answers,
            &progress,
        )
        .unwrap();
        (sets, answers.hits())
    }

    #[test]
    fn every_pixel_once_in_blocks() {
        let (sets, _) = sets_of(&ball(), [37, 21]);
        let primary = &sets[0];
        assert_eq!(primary.len(), 37 * 21);
        let mut seen: Vec<[u32; 3]> = primary.dir.iter().map(|d| d.map(f32::to_bits)).collect();
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 37 * 21);
        // The second ray is to the right of the first, the third below it.
        let [a, b, c] = [0, 1, 2].map(|i| primary.dir[i]);
        assert!(b[0] > a[0] && b[1] == a[1]);
        assert!(c[0] == a[0] && c[1] < a[1]);
        // Row 16 begins after two blocks of 16×16 and one of 5×16.
        let below = primary.dir[37 * 16];
        assert!(below[0] == a[0] && below[1] < primary.dir[37 * 16 - 1][1]);
    }

    #[test]
    fn secondary_rays_belong_to_the_hits() {
        let (sets, hits) = sets_of(&ball(), [64, 64]);
        assert!(hits > 500, "{hits}");
        let [_, shadow, from_light, diffuse, any] = &sets[..] else {
            panic!("five kinds");
        };
        assert_eq!(diffuse, any);
        let center = DVec3::new(0.0, 1.0, 0.0);
        let at = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let mut cosines = 0.0;
        for i in 0..hits {
            let org = at(shadow.org[i]);
            // Just outside the sphere, and aimed at the light.
            let height = (org - center).length() - 1.0;
            assert!(height > 0.0 && height < 1e-3, "{height}");
            assert!((org + at(shadow.dir[i]) - LIGHT).length() < 1e-5);
            assert_eq!(at(from_light.org[i]), LIGHT);
            assert!((LIGHT + at(from_light.dir[i]) - org).length() < 1e-5);
            let normal = (at(diffuse.org[i]) - center).normalize();
            let cosine = at(diffuse.dir[i]).dot(normal);
            assert!(cosine > -1e-6, "{cosine}");
            cosines += cosine;
        }
        // ∫ cos²/π over the hemisphere is 2/3; its deviation is 0.236/√n.
        let mean = cosines / hits as f64;
        assert!(
            (mean - 2.0 / 3.0).abs() < 4.0 * 0.236 / (hits as f64).sqrt(),
            "{mean}"
        );
        for set in [shadow, from_light, diffuse] {
            assert_eq!(set.len(), hits);
        }
    }

    #[test]
    fn the_light_is_the_first_point_or_beside_the_camera() {
        let scene = ball();
        let appearances = Appearances::of(&scene).unwrap();
        let world = World::build(&scene, &appearances, Structure::Bvh);
        let camera = Camera::perspective(DVec3::new(0.0, 1.0, 6.0), DVec3::Y, DVec3::Y, 30.0);
        let light = light_of(&world, &camera);
        assert!(
            (light - DVec3::new(-2.4, 4.6, 6.0)).length() < 1e-5,
            "{light}"
        );
    }
}
