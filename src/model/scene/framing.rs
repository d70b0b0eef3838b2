//! Views that frame a scene: they look from a direction and show the boxes of all bounded
//! instances, as large as they fit; of a scene that moves at all times.

use super::hull::coarse_corners;
use super::primitives::shape_bounds;
use super::{Camera, Cameras, Instances, Projection, Scene, Shape, Tables};
use crate::math::Aabb;
use glam::DVec3;
use std::sync::Arc;

/// How much smaller than the picture the framed part is.
const MARGIN: f64 = 1.08;
/// Degrees from the bottom to the top of the default view.
const FOV_Y: f64 = 35.0;

/// From where a view looks, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlook {
    /// The direction from the middle of the scene to the eye, of any length but 0.
    pub towards_eye: DVec3,
    /// The direction that is up in the picture.
    pub up: DVec3,
    /// A projection with an image plane. Of parallel rays the height is made to fit.
    pub projection: Projection,
}

impl Default for Outlook {
    /// Returns that of the default view: from front-right-above.
    fn default() -> Outlook {
        Outlook {
            towards_eye: DVec3::new(0.5, 0.35, 0.8),
            up: DVec3::Y,
            projection: Projection::Perspective {
                half_height: libm::tan(FOV_Y.to_radians() * 0.5),
            },
        }
    }
}

/// The views of a technical drawing. Right is +x, up is +y and the front is at +z, as in scenes
/// and as importers turn files whose z is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
    /// From front-right-above, so that the three axes look equally long.
    Iso,
}

impl StandardView {
    pub const ALL: [(&'static str, StandardView); 7] = [
        ("front", StandardView::Front),
        ("back", StandardView::Back),
        ("left", StandardView::Left),
        ("right", StandardView::Right),
        ("top", StandardView::Top),
        ("bottom", StandardView::Bottom),
        ("iso", StandardView::Iso),
    ];

    /// Returns the outlook, of parallel rays.
    pub fn outlook(self) -> Outlook {
        let (towards_eye, up) = match self {
            StandardView::Front => (DVec3::Z, DVec3::Y),
            StandardView::Back => (DVec3::NEG_Z, DVec3::Y),
            StandardView::Left => (DVec3::NEG_X, DVec3::Y),
            StandardView::Right => (DVec3::X, DVec3::Y),
            StandardView::Top => (DVec3::Y, DVec3::NEG_Z),
            StandardView::Bottom => (DVec3::NEG_Y, DVec3::Z),
            StandardView::Iso => (DVec3::ONE, DVec3::Y),
        };
        Outlook {
            towards_eye,
            up,
            projection: Projection::Orthographic { half_height: 1.0 },
        }
    }
}

impl Camera {
    /// Returns the direction that a camera looks from, with its projection; `None` if it has no
    /// image plane that things could be fitted to, or one that was measured.
    pub fn outlook(&self) -> Option<Outlook> {
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => Some(Outlook {
                towards_eye: -self.forward,
                up: self.up,
                projection: self.projection,
            }),
            Projection::Calibrated(_) | Projection::Panorama | Projection::Fisheye { .. } => None,
        }
    }
}

impl Scene {
    /// Replaces all cameras by one that frames the scene; `aspect` is the picture's width over its
    /// height.
    pub fn framed(self, outlook: &Outlook, instances: &Instances, aspect: f64) -> Scene {
        let camera = framing_camera(&self, instances, outlook, aspect);
        self.seen_by(camera)
    }

    /// Replaces all cameras by one that stands still, whose numbers are finite.
    pub fn seen_by(mut self, camera: Camera) -> Scene {
        let mut cameras = Cameras::default();
        cameras.rows.push(camera);
        Arc::make_mut(&mut self.tables).cameras = cameras;
        self
    }
}

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

/// Returns the default view of all bounded instances; `aspect` is width over height.
pub fn default_camera(scene: &Scene, instances: &Instances, aspect: f64) -> Camera {
    framing_camera(scene, instances, &Outlook::default(), aspect)
}

/// Returns a view of all bounded instances; one of a scene that moves stands still.
pub fn framing_camera(
    scene: &Scene,
    instances: &Instances,
    outlook: &Outlook,
    aspect: f64,
) -> Camera {
    match scene.moves() {
        true => framing(
            &Points::Corners(corners_of_motion(scene, outlook)),
            outlook,
            aspect,
        ),
        false => framing(&Points::of(scene, instances), outlook, aspect),
    }
}

/// Times of a motion that a view frames, evenly from 0 to 1.
pub const FRAMED_TIMES: u32 = 17;

/// Returns the corners of boxes along a view's axes about all that is there at some times.
fn corners_of_motion(scene: &Scene, outlook: &Outlook) -> Vec<DVec3> {
    let axes = view_axes(outlook);
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
    corners
}

/// Returns the axes of a view: right, up, and towards the eye.
fn view_axes(outlook: &Outlook) -> [DVec3; 3] {
    let back = outlook.towards_eye.normalize();
    let axes = Camera::looking_at(back, DVec3::ZERO, outlook.up, outlook.projection);
    [axes.right, axes.up, back]
}

fn framing(points: &Points, outlook: &Outlook, aspect: f64) -> Camera {
    let bounds = bounds_of(points);
    let framed = !bounds.is_empty() && bounds.max_abs() < 1e150;
    let [right, up, back] = view_axes(outlook);
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
    if outlook.projection.is_parallel() {
        let mut half_height = if framed {
            0.0
        } else {
            radius * (1.0 / aspect).max(1.0)
        };
        if framed {
            points.each(|p| {
                let p = p - center;
                let needed = p.dot(up).abs().max(p.dot(right).abs() / aspect);
                half_height = f64::max(half_height, needed);
            });
        }
        // A scene that is a line along the view has no extent across.
        let half_height = (half_height * MARGIN).max(radius * 1e-3).max(least);
        // Rays begin in the plane of the eye, in front of everything.
        let eye = center + back * (radius * 2.0).max(least);
        let projection = Projection::Orthographic { half_height };
        // The direction as it is asked for, without roundings: many planes are parallel to it.
        return Camera::posed(eye, -outlook.towards_eye, outlook.up, projection);
    }
    let tan_y = outlook.projection.half_height();
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
    Camera::looking_at(eye, center, outlook.up, outlook.projection)
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
    use crate::scene::{Edge, SceneBuilder};

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

    /// Returns where a point is seen, from -1 to 1 across and up, and its depth.
    fn seen(camera: &Camera, aspect: f64, p: DVec3) -> [f64; 3] {
        let p = p - camera.eye;
        let depth = p.dot(camera.forward);
        let scale = camera.projection.half_height()
            * match camera.projection.is_parallel() {
                true => 1.0,
                false => depth,
            };
        [
            p.dot(camera.right) / (scale * aspect),
            p.dot(camera.up) / scale,
            depth,
        ]
    }

    #[test]
    fn standard_views_look_along_their_axes_and_fit() {
        let (center, half) = (DVec3::new(30.0, -10.0, 70.0), DVec3::new(1.0, 2.0, 3.0));
        let cuboid = Cuboid {
            min: center - half,
            max: center + half,
        };
        let mut scene = SceneBuilder::default();
        let shape = scene.cuboid("", cuboid);
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let instances = Instances::of(&scene).unwrap();
        for aspect in [0.25, 1.0, 3.0] {
            for (name, view) in StandardView::ALL {
                let framed = scene.clone().framed(&view.outlook(), &instances, aspect);
                let [camera] = framed.cameras.rows[..] else {
                    panic!("one camera");
                };
                let corners = Aabb::new(cuboid.min, cuboid.max).corners();
                let seen = corners.map(|p| seen(&camera, aspect, p));
                assert!(seen.iter().all(|[.., depth]| *depth > 0.0), "{name}");
                let widest = seen.iter().flat_map(|[x, y, _]| [x.abs(), y.abs()]);
                let widest = widest.fold(0.0, f64::max);
                assert!((widest - 1.0 / MARGIN).abs() < 1e-12, "{name}: {widest}");
            }
        }
        let axes = |view: StandardView| {
            let framed = scene.clone().framed(&view.outlook(), &instances, 1.0);
            let camera = framed.cameras.rows[0];
            [camera.right, camera.up, camera.forward]
        };
        assert_eq!(
            axes(StandardView::Front),
            [DVec3::X, DVec3::Y, DVec3::NEG_Z]
        );
        assert_eq!(
            axes(StandardView::Top),
            [DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y]
        );
        assert_eq!(
            axes(StandardView::Right),
            [DVec3::NEG_Z, DVec3::Y, DVec3::NEG_X]
        );
        let [right, up, forward] = axes(StandardView::Iso);
        // Of unit length along any axis the same is seen.
        let lengths = DVec3::AXES.map(|axis| right.dot(axis).hypot(up.dot(axis)));
        assert!(
            lengths
                .iter()
                .all(|l| (l - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15)
        );
        assert!((forward.dot(DVec3::NEG_ONE) - 3.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn fitting_keeps_direction_and_projection() {
        let (scene, instances) = scene_of(DVec3::new(5.0, 5.0, 5.0), 0.5);
        let far = Camera::perspective(DVec3::new(-9.0, 1.0, 2.0), DVec3::ZERO, DVec3::Z, 12.0);
        let fitted = scene
            .framed(&far.outlook().unwrap(), &instances, 2.0)
            .cameras
            .rows[0];
        assert_eq!(fitted.projection, far.projection);
        assert!((fitted.forward - far.forward).length() < 1e-12);
        assert!((fitted.up - far.up).length() < 1e-12);
        for p in Aabb::new(DVec3::splat(4.5), DVec3::splat(5.5)).corners() {
            let [x, y, depth] = seen(&fitted, 2.0, p);
            assert!(x.abs() < 1.0 && y.abs() < 1.0 && depth > 0.0);
        }
        let around = Camera::looking_at(DVec3::ZERO, DVec3::X, DVec3::Y, Projection::Panorama);
        assert_eq!(around.outlook(), None);
    }
}
