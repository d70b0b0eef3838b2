//! Motion vectors: where what a pixel's centre shows will be seen a step later, and was a step
//! before.
//!
//! They come from outputs that a picture has anyway: with the distance of the hit the ray through
//! the pixel's centre gives the point, which is taken along with its instance, and on meshes that
//! deform with its triangle. A rounding of the distance moves the point along the ray alone, so that
//! it hardly shows.

use super::camera::RayGenerator;
use super::config::RenderConfig;
use crate::io::Picture;
use crate::math::Affine;
use crate::scene::{Camera, Instances, MeshId, Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;

/// The scene and its camera at a time.
pub struct Moment<'s> {
    pub scene: &'s Scene,
    pub instances: &'s Instances,
    pub camera: Camera,
}

/// What a pixel shows: its ray, and the hit if there is one.
struct Shown {
    org: DVec3,
    dir: DVec3,
    /// Distance, instance and primitive.
    hit: Option<(f64, u64, u32)>,
}

/// Returns, for each pixel, the way in pixels from its centre to where what it shows is seen at
/// two other times, after and before: x to the right, y up. 0 for what has no place there, as what
/// is behind the camera then. The picture has to have distances and ids.
pub fn motion_vectors(
    picture: &Picture,
    config: &RenderConfig,
    now: &Moment,
    [after, before]: [&Moment; 2],
) -> Vec<[f32; 4]> {
    let generator = |moment: &Moment| {
        RayGenerator::new(moment.camera, config.width, config.height, config.grid)
    };
    let here = generator(now);
    let there = [after, before].map(|moment| (moment, generator(moment)));
    let window = config.window();
    let width = window.width as usize;
    let one = |pixel: usize| {
        let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
        let (x, y) = (window.x + x, window.y + y);
        let (org, dir) = here.ray(x, y, [0.5; 2]);
        let shown = Shown {
            org,
            dir,
            hit: hit_of(picture, pixel),
        };
        let from = here.center(x, y);
        let ways = there.each_ref().map(|(moment, generator)| {
            let to = match shown.hit {
                None => generator.seen_along(dir),
                Some(_) => followed(&shown, now, moment).and_then(|p| generator.seen_at(p)),
            };
            to.map_or([0.0; 2], |to| generator.way(from, to))
        });
        let [[u, v], [before_u, before_v]] = ways;
        [u, -v, before_u, -before_v].map(|x| x as f32)
    };
    let pixels = picture.color.len();
    (0..pixels).into_par_iter().map(one).collect()
}

/// Returns what the outputs of a pixel say of its hit.
fn hit_of(picture: &Picture, pixel: usize) -> Option<(f64, u64, u32)> {
    let distance = *picture.distance.as_ref()?.get(pixel)?;
    let instance = *picture.instance_id.as_ref()?.get(pixel)?;
    let primitive = *picture.primitive_id.as_ref()?.get(pixel)?;
    let is_hit = instance != Picture::NO_ID && distance.is_finite();
    is_hit.then_some((f64::from(distance), instance, primitive))
}

/// Returns where the point that is shown now lies at another time; `None` if nothing is hit.
fn followed(shown: &Shown, now: &Moment, then: &Moment) -> Option<DVec3> {
    let (distance, instance, primitive) = shown.hit?;
    let point = shown.org + shown.dir.normalize() * distance;
    let of = |moment: &Moment| moment.instances.object_from_world(moment.scene, instance);
    let (here, there) = (of(now), of(then));
    let shape = now.instances.get(now.scene, instance).shape;
    let deforming = match now.scene.shapes.row(shape) {
        Shape::Mesh(mesh) => now.scene.deformations.has(mesh).then_some(mesh),
        _ => None,
    };
    if here == there && deforming.is_none() {
        // Not even rounded.
        return Some(point);
    }
    let mut local = mapped(&here, point);
    if let Some(mesh) = deforming {
        local = carried(local, (mesh, primitive), now.scene, then.scene);
    }
    there.inverse().map(|world| mapped(&world, local))
}

fn mapped(map: &Affine, point: DVec3) -> DVec3 {
    DVec3::from_array(map.point(point.to_array()))
}

/// Returns where a point of a triangle lies when its corners are elsewhere, with the barycentric
/// coordinates that it has.
fn carried(point: DVec3, (mesh, triangle): (MeshId, u32), now: &Scene, then: &Scene) -> DVec3 {
    let corners = |scene: &Scene| {
        let mesh = scene.meshes.row(mesh);
        let corners = mesh.corners(triangle as usize);
        corners.map(|p| DVec3::from_array(p.map(f64::from)) + mesh.center)
    };
    let [a, b, c] = corners(now);
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    let to = corners(then);
    if area == 0.0 {
        return to[0];
    }
    let at = point - a;
    let v = at.cross(c - a).dot(normal) / area;
    let w = (b - a).cross(at).dot(normal) / area;
    to[0] + (to[1] - to[0]) * v + (to[2] - to[0]) * w
}
