//! Coordinates within objects: where the point that a pixel shows lies in the box of its object.

use super::objects::Object;
use glam::DVec3;
use lanecast_io::Picture;
use lanecast_picture::render::{RayGenerator, RenderConfig, View};

/// Returns, for each pixel, the place of what it shows in its object's box: 0 at the least corner,
/// 65535 at the greatest, to the nearest step; 0 of what is no object or has no box. The picture has
/// to have depths; `shown` has the numbers of objects, from 1.
pub fn of(
    picture: &Picture,
    (view, config): (&View, &RenderConfig),
    objects: &[Object],
    shown: &[u16],
) -> Vec<[u16; 3]> {
    let generator = RayGenerator::new(view.camera, config.width, config.height, config.grid);
    let maps: Vec<_> = objects
        .iter()
        .map(|o| o.world_from_object.inverse())
        .collect();
    let depth = picture.depth.as_deref().unwrap_or_default();
    let one = |(pixel, number): (usize, &u16)| {
        let row = usize::from(*number).checked_sub(1)?;
        let (bounds, map) = (objects[row].bounds.filter(|b| b.is_finite())?, maps[row]?);
        let (x, y) = (pixel as u32 % picture.width, pixel as u32 / picture.width);
        let (org, dir) = generator.ray(x, y, [0.5; 2]);
        // The direction is 1 long along the axis, so that depth is the ray's t.
        let point = org + dir * f64::from(*depth.get(pixel)?);
        let within = DVec3::from_array(map.point(point.to_array())) - bounds.min;
        let share = within / bounds.extent();
        Some(
            share
                .to_array()
                .map(|x| (x * f64::from(u16::MAX)).round() as u16),
        )
    };
    let all = shown.iter().enumerate();
    all.map(|pixel| one(pixel).unwrap_or_default()).collect()
}
