//! Ray sets of a scene, for `bench` to time and export.
//!
//! All numbers are f32, as in the `.rays` format, so that every tracer gets the same
//! rays; secondary rays start at hits of the rounded primary rays. Secondary rays
//! follow the order of the primary hits, one per hit, on the camera's side of the
//! surface, whether or not it faces the light. Rays with numbers that f32 cannot hold,
//! or without a direction, are omitted.
//!
//! Deterministic: random directions are a hash of the hit's number, and elementary
//! functions come from the crate `libm`.

use super::queries::{Answers, Ask, trace};
use super::ray_kinds::{Kind, Order};
use glam::DVec3;
use lanecast_engine::accel::World;
use lanecast_engine::trace::{Caching, HitId};
use lanecast_io::RaySet;
use lanecast_model::plan::{Kernels, Precision};
use lanecast_model::scene::{Camera, Light, Projection};
use lanecast_picture::render::{BLOCK, Grid, Progress, RayGenerator, every_second_bit, mix, unit};
use lanecast_picture::shade::Surface;

/// The input of ray sets.
pub struct Source<'a> {
    pub world: &'a World,
    /// The best f64 kernels: the sets depend on the hits.
    pub kernels: Kernels,
    pub camera: Camera,
    pub grid: Grid,
    /// Rays across and down; at most 65,536 each.
    pub size: [u32; 2],
    pub order: Order,
    /// Position of the point light, in world space.
    pub light: DVec3,
    /// Unit direction in which parallel light travels.
    pub direction: DVec3,
}

/// t_max of rays from the light: just short of the surface they are aimed at.
const LIGHT_T_MAX: f32 = 1.0 - 1e-4;
/// Half the side of the square light, relative to its distance from the scene's centre.
pub const LIGHT_SIZE: f64 = 0.125;

/// Generates the sets of these kinds, in the same order, on the current rayon pool.
/// Returns `None` if cancelled.
pub fn ray_sets(source: &Source, kinds: &[Kind], progress: &Progress) -> Option<Vec<RaySet>> {
    let pixels = pixels(source.size, source.order);
    let (primary, numbers) = primary(source, source.camera, &pixels);
    let mut answers = Answers::default();
    if kinds.iter().any(|kind| kind.is_secondary()) {
        let (world, kernels) = (source.world, &source.kernels);
        trace(
            world,
            kernels,
            &primary,
            (Ask::Closest, Caching::On),
            &mut answers,
            progress,
        )?;
    }
    // `each` gets the surface, the ray's direction, and the pixel's number, which does
    // not depend on the order.
    let hits = |each: &dyn Fn(&Surface, DVec3, u64, &mut RaySet)| {
        let mut set = RaySet::default();
        for (i, id) in answers.id.iter().enumerate() {
            if id == HitId::NONE {
                continue;
            }
            // `fast` gives the offset of f32, in which the rays are stored.
            let surface = Surface::at(
                source.world,
                Precision::Fast,
                primary.org(i).map(f64::from),
                primary.dir(i).map(f64::from),
                f64::from(answers.t[i]),
                id,
            );
            let dir = DVec3::from_array(primary.dir(i).map(f64::from));
            each(&surface, dir, u64::from(numbers[i]), &mut set);
        }
        set
    };
    let light = source.light;
    let (across, down) = square_light(source);
    let sets = kinds.iter().map(|kind| match kind {
        Kind::Primary => primary.clone(),
        Kind::Ortho => self::primary(source, orthographic(source), &pixels).0,
        Kind::Shadow => hits(&|surface, _, _, set| {
            let from = rounded(surface.leave(surface.facing()));
            push(set, from, light - from, 1.0);
        }),
        Kind::LightShadow => hits(&|surface, _, _, set| {
            let (from, to) = (rounded(light), surface.leave(surface.facing()));
            push(set, from, to - from, LIGHT_T_MAX);
        }),
        Kind::Directional => hits(&|surface, _, _, set| {
            let from = surface.leave(surface.facing());
            push(set, from, -source.direction, f32::INFINITY);
        }),
        Kind::AreaShadow => hits(&|surface, _, number, set| {
            let from = rounded(surface.leave(surface.facing()));
            let bits = mix(number);
            let [u, v] = [unit(bits), unit(mix(bits))].map(|x| 2.0 * x - 1.0);
            push(set, from, light + across * u + down * v - from, 1.0);
        }),
        Kind::Mirror => hits(&|surface, dir, _, set| {
            let facing = surface.facing();
            let dir = dir - facing * (2.0 * dir.dot(facing));
            push(set, surface.leave(facing), dir, f32::INFINITY);
        }),
        Kind::Diffuse | Kind::DiffuseAny => hits(&|surface, _, number, set| {
            let facing = surface.facing();
            let dir = cosine_distributed(facing, number);
            push(set, surface.leave(facing), dir, f32::INFINITY);
        }),
    });
    Some(sets.collect())
}

/// A pixel, and its index in the order of tiles.
#[derive(Clone, Copy)]
struct Pixel {
    x: u16,
    y: u16,
    number: u32,
}

fn pixels([width, height]: [u32; 2], order: Order) -> Vec<Pixel> {
    let mut pixels: Vec<Pixel> = Vec::with_capacity(width as usize * height as usize);
    for block_y in (0..height).step_by(BLOCK as usize) {
        for block_x in (0..width).step_by(BLOCK as usize) {
            for code in 0..BLOCK * BLOCK {
                let x = block_x + every_second_bit(code);
                let y = block_y + every_second_bit(code >> 1);
                if x < width && y < height {
                    pixels.push(Pixel {
                        x: x as u16,
                        y: y as u16,
                        number: pixels.len() as u32,
                    });
                }
            }
        }
    }
    match order {
        Order::Tile => {}
        Order::Scanline => pixels.sort_unstable_by_key(|p| (p.y, p.x)),
        Order::Morton => pixels.sort_unstable_by_key(|p| spread(p.x) | spread(p.y) << 1),
        // The hash is injective.
        Order::Random => pixels.sort_unstable_by_key(|p| mix(u64::from(p.number))),
    }
    pixels
}

/// Inserts a zero above each bit.
fn spread(x: u16) -> u32 {
    let x = u32::from(x);
    let x = (x | x << 8) & 0x00ff_00ff;
    let x = (x | x << 4) & 0x0f0f_0f0f;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// Generates the rays through the pixels, and the numbers of those pixels.
fn primary(source: &Source, camera: Camera, pixels: &[Pixel]) -> (RaySet, Vec<u32>) {
    let [width, height] = source.size;
    let generator = RayGenerator::new(camera, width, height, source.grid);
    let mut set = RaySet::with_capacity(pixels.len());
    let mut numbers = Vec::with_capacity(pixels.len());
    for pixel in pixels {
        let (org, dir) = generator.ray(pixel.x.into(), pixel.y.into(), [0.5, 0.5]);
        if dir.is_nan() {
            continue;
        }
        push(&mut set, org, dir, f32::INFINITY);
        if set.len() > numbers.len() {
            numbers.push(pixel.number);
        }
    }
    (set, numbers)
}

fn orthographic(source: &Source) -> Camera {
    let camera = source.camera;
    let half_height = match camera.projection {
        Projection::Orthographic { half_height } => half_height,
        other => {
            let depth = (middle(source.world) - camera.eye).dot(camera.forward);
            other.half_height() * if depth > 0.0 { depth } else { 1.0 }
        }
    };
    Camera {
        projection: Projection::Orthographic { half_height },
        ..camera
    }
}

/// Returns half the sides of the square light, which faces the scene's centre.
fn square_light(source: &Source) -> (DVec3, DVec3) {
    let to_middle = middle(source.world) - source.light;
    let distance = to_middle.length();
    let known = distance.is_finite() && distance > 0.0;
    let (facing, distance) = if known {
        (to_middle / distance, distance)
    } else {
        (DVec3::Y, 1.0)
    };
    let (across, down) = facing.any_orthonormal_pair();
    let half = LIGHT_SIZE * distance;
    (across * half, down * half)
}

/// Returns the centre of all bounded shapes, or the origin if there is none.
fn middle(world: &World) -> DVec3 {
    let bounds = world.bounds.widened();
    let center = bounds.center() + world.center;
    if bounds.is_empty() || !center.is_finite() {
        DVec3::ZERO
    } else {
        center
    }
}

fn push(set: &mut RaySet, org: DVec3, dir: DVec3, t_max: f32) {
    let [org, dir] = [org, dir].map(|v| v.to_array().map(|x| x as f32));
    let finite = org.iter().chain(&dir).all(|x| x.is_finite());
    if finite && dir != [0.0; 3] {
        set.push(org, 0.0, dir, t_max);
    }
}

/// Rounds a point to f32.
fn rounded(point: DVec3) -> DVec3 {
    point.as_vec3().as_dvec3()
}

/// Returns a cosine-distributed unit direction around the unit vector `n` (Malley's
/// method: a uniform disk, projected up to the hemisphere).
fn cosine_distributed(n: DVec3, number: u64) -> DVec3 {
    let bits = mix(number);
    let (u, v) = (unit(bits), unit(mix(bits)));
    let radius = u.sqrt();
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * v);
    let (x, y) = n.any_orthonormal_pair();
    x * (radius * cos) + y * (radius * sin) + n * (1.0 - u).sqrt()
}

/// Returns the scene's first point light. Without one, returns a point above and to the
/// left of the camera: eye + (0.6·up − 0.4·right)·d, where d is the distance from the
/// eye to the centre of all bounded shapes.
pub fn light_of(world: &World, camera: &Camera) -> DVec3 {
    let first = world.scene.lights.iter().find_map(Light::position);
    first.unwrap_or_else(|| {
        let bounds = world.bounds.widened();
        let middle = bounds.center() + world.center;
        let distance = (middle - camera.eye).length();
        let known = !bounds.is_empty() && distance.is_finite() && distance > 0.0;
        let distance = if known { distance } else { 1.0 };
        camera.eye + (camera.up * 0.6 - camera.right * 0.4) * distance
    })
}

/// Returns the unit direction in which the scene's first directional light travels;
/// without one, the direction from `light` to the centre of all bounded shapes.
pub fn direction_of(world: &World, light: DVec3) -> DVec3 {
    let first = world.scene.lights.iter().find_map(|light| match light {
        Light::Directional { direction, .. } => Some(*direction),
        _ => None,
    });
    let direction = first.unwrap_or_else(|| middle(world) - light);
    // The vector is scaled before it is squared, since any length is allowed.
    let size = direction.abs().max_element();
    if size > 0.0 && size.is_finite() {
        (direction / size).normalize()
    } else {
        DVec3::NEG_Y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_in_their_order() {
        let at = |order, i: usize| pixels([37, 21], order)[i];
        let place = |pixel: Pixel| (pixel.x, pixel.y);
        assert_eq!(place(at(Order::Scanline, 38)), (1, 1));
        assert_eq!(place(at(Order::Morton, 6)), (2, 1));
    }
}
