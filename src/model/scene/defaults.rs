//! A default view and default lights for scenes without their own.
//!
//! The view looks from front-right-above and frames the boxes of all bounded instances, as
//! large as they fit; of a scene that moves at all times. The lights follow the camera: a headlight, and a weaker key light
//! from its upper left, which shows the shapes. Together they give a white Lambert surface
//! that faces the camera a radiance of 0.9.

use super::hull::coarse_corners;
use super::primitives::shape_bounds;
use super::{Camera, Instances, Light, Scene, Shape, Tables};
use crate::math::Aabb;
use glam::DVec3;
use std::f64::consts::PI;

/// The direction from the middle of the scene to the eye.
const TOWARDS_EYE: DVec3 = DVec3::new(0.5, 0.35, 0.8);
const FOV_Y: f64 = 35.0;
/// How much smaller than the picture the framed part is.
const MARGIN: f64 = 1.08;

/// The radiance of a white surface that faces the camera.
const FACING_RADIANCE: f64 = 0.9;
/// The headlight's share of that radiance.
const HEADLIGHT: f64 = 0.65;
/// The direction of the key light's source: to the camera's left, up, and back.
const KEY: [f64; 3] = [-0.6, 0.7, 0.75];

/// Returns a box of all bounded instances in world space, by the vertices of meshes and the
/// corners of other shapes' boxes; `None` if there are none.
pub fn framed_bounds(scene: &Tables, instances: &Instances) -> Option<Aabb> {
    let bounds = bounds_of(&Points::of(scene, instances));
    (!bounds.is_empty()).then_some(bounds)
}

fn bounds_of(points: &Points) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    points.each(|p| bounds = bounds.union(&Aabb::new(p, p)));
    bounds
}

/// Returns a view of all bounded instances; `aspect` is width over height.
pub fn default_camera(scene: &Tables, instances: &Instances, aspect: f64) -> Camera {
    framing(&Points::of(scene, instances), aspect)
}

/// Times of a motion that its default view frames, evenly from 0 to 1.
pub const FRAMED_TIMES: u32 = 17;

/// Returns a view of all bounded instances that stands still while a scene moves, and frames it at
/// some times: at each by a box along the view.
pub fn default_camera_of_motion(scene: &Scene, aspect: f64) -> Camera {
    let axes = view_axes();
    let mut corners = Vec::new();
    for i in 0..FRAMED_TIMES {
        let time = f64::from(i) / f64::from(FRAMED_TIMES - 1);
        // A time at which the scene cannot be made has an error of its own where it is drawn.
        let Ok(scene) = scene.clone().at(time) else {
            continue;
        };
        let Ok(instances) = Instances::of(&scene) else {
            continue;
        };
        let mut seen = Aabb::EMPTY;
        Points::of(&scene, &instances).each(|p| {
            let p = axes.map(|axis| p.dot(axis));
            let p = DVec3::from_array(p);
            seen = seen.union(&Aabb::new(p, p));
        });
        if !seen.is_empty() {
            let place = |p: DVec3| axes[0] * p.x + axes[1] * p.y + axes[2] * p.z;
            corners.extend(seen.corners().map(place));
        }
    }
    framing(&Points::Corners(corners), aspect)
}

/// Returns the axes of the default view: right, up, and towards the eye.
fn view_axes() -> [DVec3; 3] {
    let back = TOWARDS_EYE.normalize();
    let axes = Camera::perspective(back, DVec3::ZERO, DVec3::Y, FOV_Y);
    [axes.right, axes.up, back]
}

fn framing(points: &Points, aspect: f64) -> Camera {
    let bounds = bounds_of(points);
    let framed = !bounds.is_empty() && bounds.max_abs() < 1e150;
    let [right, up, back] = view_axes();
    // A scene of half-spaces only, or one too large for any view, is framed as a unit
    // sphere.
    let (center, radius) = if framed {
        // The middle of the projected points, not of the points in space.
        let mut seen = Aabb::EMPTY;
        points.each(|p| {
            let p = p - bounds.center();
            let p = DVec3::new(p.dot(right), p.dot(up), p.dot(back));
            seen = seen.union(&Aabb::new(p, p));
        });
        let seen = seen.center();
        let middle = right * seen.x + up * seen.y + back * seen.z;
        (bounds.center() + middle, bounds.diagonal() * 0.5)
    } else {
        (DVec3::ZERO, 1.0)
    };
    // A scene may be one point of huge coordinates, so the eye stays farther away than
    // roundings.
    let least = (center.abs().max_element() * 1e-12).max(1e-300);
    let tan_y = libm::tan(FOV_Y.to_radians() * 0.5);
    let tan_x = tan_y * aspect;
    // A point at depth z before the centre and x aside is in the picture from the distance
    // z + |x| / tan on.
    let needed = |p: DVec3| {
        let p = p - center;
        let aside = (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y);
        p.dot(back) + aside * MARGIN
    };
    let distance = if framed {
        let mut most = 0.0;
        points.each(|p| most = f64::max(most, needed(p)));
        most
    } else {
        radius * MARGIN / libm::sin(libm::atan(tan_y.min(tan_x)))
    };
    // A flat scene seen along its plane needs hardly any distance.
    let eye = center + back * distance.max(radius * 0.5).max(least);
    Camera::perspective(eye, center, DVec3::Y, FOV_Y)
}

/// Returns the default lights of a camera.
pub fn default_lights(camera: &Camera) -> Vec<Light> {
    let [left, up, back] = KEY;
    let to_key = camera.right * left + camera.up * up - camera.forward * back;
    let cosine = back / to_key.length();
    let full = FACING_RADIANCE * PI;
    let light = |direction, irradiance: f64| Light::Directional {
        direction,
        irradiance: [irradiance as f32; 3],
        angle: 0.0,
    };
    vec![
        light(camera.forward, full * HEADLIGHT),
        light(-to_key, full * (1.0 - HEADLIGHT) / cosine),
    ]
}

/// Meshes with more vertices than this, all together, are framed by their boxes.
const VERTICES: u64 = 4_000_000;

/// The points that the view has to frame, in world space: the vertices of all meshes, and
/// the corners of the boxes of all other bounded instances. If there are more instances
/// than may be laid out, the points are the corners of shared nodes' boxes.
enum Points<'a> {
    Every {
        scene: &'a Tables,
        instances: &'a Instances,
        /// Boxes by shape, so that a shared shape is measured once.
        boxes: Vec<Option<Aabb>>,
        vertices: bool,
    },
    Corners(Vec<DVec3>),
}

impl<'a> Points<'a> {
    fn of(scene: &'a Tables, instances: &'a Instances) -> Points<'a> {
        if instances.check_enumerable().is_err() {
            return Points::Corners(coarse_corners(scene));
        }
        let mut vertices = 0_u64;
        for (shape, count) in scene.shapes.rows.iter().zip(instances.of_shapes(scene)) {
            if let Shape::Mesh(id) = shape {
                vertices += count * scene.meshes.row(*id).positions.len() as u64;
            }
        }
        let shapes = (0..scene.shapes.len() as u32).map(super::ids::ShapeId);
        Points::Every {
            scene,
            instances,
            boxes: shapes.map(|id| shape_bounds(scene, id)).collect(),
            vertices: vertices <= VERTICES,
        }
    }

    fn each(&self, mut visit: impl FnMut(DVec3)) {
        let (scene, instances, boxes, vertices) = match self {
            Points::Corners(corners) => return corners.iter().copied().for_each(visit),
            Points::Every {
                scene,
                instances,
                boxes,
                vertices,
            } => (scene, instances, boxes, *vertices),
        };
        for row in instances.iter(scene) {
            let to_world = |p: DVec3| DVec3::from_array(row.world_from_object.point(p.to_array()));
            match scene.shapes.row(row.shape) {
                Shape::Mesh(id) if vertices => {
                    let mesh = scene.meshes.row(id);
                    for p in mesh.positions {
                        visit(to_world(DVec3::from_array(p.map(f64::from)) + mesh.center));
                    }
                }
                _ => {
                    let corners = boxes[row.shape.index()].map(|b| b.corners());
                    corners
                        .into_iter()
                        .flatten()
                        .for_each(|p| visit(to_world(p)));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cuboid, HalfSpace, Sphere};
    use crate::scene::{Edge, Projection, Scene, SceneBuilder};

    fn scene_of(center: DVec3, radius: f64) -> (Scene, Instances) {
        let mut scene = SceneBuilder::default();
        let ball = scene.sphere("", Sphere { center, radius });
        let ground = scene.half_space(
            "",
            HalfSpace {
                normal: DVec3::Y,
                offset: 0.0,
            },
        );
        scene.instance("", Edge::shape(ball));
        scene.instance("", Edge::shape(ground));
        let scene = scene.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        (scene, instances)
    }

    #[test]
    fn the_whole_scene_is_in_the_picture_at_any_size_and_aspect() {
        for scale in [1e-12, 1.0, 1e9] {
            for aspect in [0.25, 1.0, 3.0] {
                let (center, half) = (DVec3::new(3.0, -1.0, 7.0) * scale, 2.0 * scale);
                let mut scene = SceneBuilder::default();
                let cuboid = Cuboid {
                    min: center - half,
                    max: center + half,
                };
                let shape = scene.cuboid("", cuboid);
                scene.instance("", Edge::shape(shape));
                let scene = scene.finish().unwrap();
                let camera = default_camera(&scene, &Instances::of(&scene).unwrap(), aspect);
                let Projection::Perspective { half_height } = camera.projection else {
                    panic!("the default view is perspective");
                };
                let mut widest: f64 = 0.0;
                for p in Aabb::new(cuboid.min, cuboid.max).corners() {
                    let p = p - camera.eye;
                    let depth = p.dot(camera.forward);
                    assert!(depth > 0.0);
                    let y = p.dot(camera.up).abs() / (depth * half_height);
                    let x = p.dot(camera.right).abs() / (depth * half_height * aspect);
                    assert!(x < 1.0 && y < 1.0, "{x} {y} at aspect {aspect}");
                    widest = widest.max(x).max(y);
                }
                assert!(widest > 0.6, "only {widest} of the picture is used");
            }
        }
    }

    #[test]
    fn what_has_no_bounds_does_not_count() {
        let (scene, instances) = scene_of(DVec3::ZERO, 1.0);
        let camera = default_camera(&scene, &instances, 1.0);
        assert!(camera.eye.length() < 10.0 && camera.eye.is_finite());
    }

    #[test]
    fn a_white_surface_that_faces_the_camera_shows_0_9() {
        let camera = Camera::perspective(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y, 35.0);
        let radiance: f64 = default_lights(&camera)
            .iter()
            .map(|light| match light {
                Light::Directional {
                    direction,
                    irradiance,
                    ..
                } => f64::from(irradiance[0]) * direction.normalize().dot(camera.forward) / PI,
                _ => panic!("the default lights are far away"),
            })
            .sum();
        assert!((radiance - 0.9).abs() < 1e-6, "{radiance}");
    }
}
