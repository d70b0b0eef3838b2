//! Lights and cameras under an affine map of the world that they are in.

use crate::math::Affine;
use crate::scene::{Camera, CameraKey, Lens, Light, Projection};
use glam::DVec3;

/// Differences of lengths, and cosines, that count as roundings of a chain of transforms.
const ROUNDED: f64 = 1e-9;

/// Returns the factor of a map that keeps shapes; `None` if it stretches or skews.
fn factor(map: &Affine) -> Option<f64> {
    let columns = map.linear().map(DVec3::from_array);
    let sizes = columns.map(DVec3::length);
    let size = sizes[0];
    let even = sizes
        .iter()
        .all(|other| (other - size).abs() <= ROUNDED * size);
    let [x, y, z] = columns;
    let square = [x.dot(y), y.dot(z), z.dot(x)];
    let square = square.iter().all(|dot| dot.abs() <= ROUNDED * size * size);
    (even && square).then_some(size)
}

/// Returns a light as a map takes it. Its intensity, irradiance or radiance stays, as glTF has it.
/// `None` if it has an extent, and the map does not keep its shape.
pub(super) fn moved_light(light: &Light, map: &Affine) -> Option<Light> {
    if map.is_identity() {
        return Some(*light);
    }
    let point = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
    let vector = |v: DVec3| DVec3::from_array(map.vector(v.to_array()));
    let length = |x: f64| match x {
        0.0 => Some(0.0),
        x => Some(x * factor(map)?),
    };
    Some(match *light {
        Light::Point {
            position,
            intensity,
            falloff,
            radius,
        } => Light::Point {
            position: point(position),
            intensity,
            falloff,
            radius: length(radius)?,
        },
        Light::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
            radius,
        } => Light::Spot {
            position: point(position),
            direction: vector(direction),
            intensity,
            inner,
            outer,
            radius: length(radius)?,
        },
        Light::Directional {
            direction,
            irradiance,
            angle,
        } => Light::Directional {
            direction: vector(direction),
            irradiance,
            angle,
        },
        Light::Rectangle {
            center,
            edges: [u, v],
            radiance,
            two_sided,
        } => {
            let [a, b] = [vector(u), vector(v)];
            if a.dot(b).abs() > ROUNDED * a.length() * b.length() {
                return None;
            }
            // A mirror image shines to the mirrored side.
            let mirrors = a.cross(b).dot(vector(u.cross(v))) < 0.0;
            Light::Rectangle {
                center: point(center),
                edges: if mirrors { [b, a] } else { [a, b] },
                radiance,
                two_sided,
            }
        }
        Light::Disc {
            center,
            normal,
            radius,
            radiance,
            two_sided,
        } => Light::Disc {
            center: point(center),
            normal: vector(normal),
            radius: length(radius)?,
            radiance,
            two_sided,
        },
    })
}

/// Returns a camera as a map takes it: it looks the same way at the same things. Where the map
/// stretches, lengths across the picture are those along its height.
pub(super) fn moved_camera(camera: &Camera, map: &Affine) -> Camera {
    if map.is_identity() {
        return *camera;
    }
    let vector = |v: DVec3| DVec3::from_array(map.vector(v.to_array()));
    let (forward, up) = (vector(camera.forward), vector(camera.up));
    let projection = match camera.projection {
        Projection::Orthographic { half_height } => Projection::Orthographic {
            half_height: half_height * up.length(),
        },
        other => other,
    };
    // The pose is made at the origin: at a far eye the point to look at would round it.
    let there = Camera::looking_at(DVec3::ZERO, forward, up, projection);
    Camera {
        eye: DVec3::from_array(map.point(camera.eye.to_array())),
        lens: camera.lens.map(|lens| Lens {
            radius: lens.radius * up.length(),
            focus: lens.focus * forward.length(),
            ..lens
        }),
        ..there
    }
}

/// Returns the pose of a camera at a time as a map takes it.
pub(super) fn moved_key(key: &CameraKey, map: &Affine) -> CameraKey {
    if map.is_identity() {
        return *key;
    }
    let point = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
    CameraKey {
        at: key.at,
        eye: point(key.eye),
        look_at: point(key.look_at),
        up: DVec3::from_array(map.vector(key.up.to_array())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DMat3};

    #[test]
    fn a_mirrored_rectangle_shines_to_the_mirrored_side() {
        let light = Light::Rectangle {
            center: DVec3::new(1.0, 2.0, 3.0),
            edges: [DVec3::X, 2.0 * DVec3::Y],
            radiance: [1.0; 3],
            two_sided: false,
        };
        for mirror in [DVec3::new(-3.0, 3.0, 3.0), DVec3::new(3.0, 3.0, -3.0)] {
            let map = DAffine3::from_scale(mirror);
            let Some(Light::Rectangle { center, edges, .. }) = moved_light(&light, &map.into())
            else {
                panic!("no rectangle");
            };
            assert_eq!(center, mirror * DVec3::new(1.0, 2.0, 3.0));
            let normal = edges[0].cross(edges[1]);
            assert_eq!(normal, DVec3::new(0.0, 0.0, 18.0 * mirror.z.signum()));
        }
        let skewed = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        assert_eq!(
            moved_light(&light, &DAffine3::from_mat3(skewed).into()),
            None
        );
    }

    #[test]
    fn lengths_of_lights_and_cameras_grow_with_their_file() {
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(2.0),
            glam::DQuat::from_rotation_y(0.5),
            DVec3::X,
        );
        let disc = |radius| Light::Disc {
            center: DVec3::Z,
            normal: DVec3::Y,
            radius,
            radiance: [1.0; 3],
            two_sided: false,
        };
        let Some(Light::Disc { radius, .. }) = moved_light(&disc(0.5), &map.into()) else {
            panic!("no disc");
        };
        assert!((radius - 1.0).abs() < 1e-15);
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0)).into();
        assert_eq!(moved_light(&disc(0.5), &stretched), None);
        let camera = Camera::orthographic(DVec3::Z, DVec3::ZERO, DVec3::Y, 3.0);
        let there = moved_camera(&camera, &map.into());
        let Projection::Orthographic { half_height } = there.projection else {
            panic!("no parallel rays");
        };
        assert!((half_height - 3.0).abs() < 1e-15);
        assert_eq!(there.eye, map.transform_point3(DVec3::Z));
        assert!((there.forward - map.transform_vector3(-DVec3::Z) / 2.0).length() < 1e-15);
    }
}
