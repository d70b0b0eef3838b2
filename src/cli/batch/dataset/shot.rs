//! One object of a picture: traced alone, and counted.

use super::note::{Extent, Seen};
use super::objects::Object;
use super::pinhole::Pinhole;
use super::{rle, rows_of};
use lanecast_engine::accel::World;
use lanecast_io::{SaveError, mask_png};
use lanecast_numerics::math::Aabb;
use lanecast_picture::render::{Progress, Rectangle, RenderConfig, View, Worker, silhouette};
use std::path::Path;

/// An object that was traced alone.
pub struct Traced {
    pub seen: Seen,
    /// PNG files of its silhouette and of what is seen of it, if these are wanted. Masks themselves
    /// are as large as the picture, and objects may be many.
    pub masks: Option<[Vec<u8>; 2]>,
}

/// What is the same for all objects of a picture.
pub struct Shot<'v> {
    pub view: &'v View<'v>,
    pub config: &'v RenderConfig,
    /// One that has worlds of some of its instances.
    pub world: &'v World,
    pub pinhole: &'v Pinhole,
    /// Whether masks are wanted as files.
    pub with_masks: bool,
}

impl Shot<'_> {
    /// Traces an object alone; `None` if none of its pixels is in the picture or as far beside it as
    /// that is large.
    pub fn seen(
        &self,
        (number, object): (u16, &Object),
        (shown, depth): (&[u16], &[u16]),
        (worker, progress): (&mut Worker, &Progress),
    ) -> Option<Result<Traced, SaveError>> {
        let (width, height) = (self.config.width, self.config.height);
        let world = self.world.of_some(&object.instances)?;
        let (rectangle, wanted) = self.reach(&world)?;
        let alone = View {
            world: &world,
            kernels: self.view.kernels,
            camera: self.view.camera,
            lights: &[],
        };
        let wanted = |dir: [f64; 3]| wanted.is_none_or(|within| within.holds(dir));
        let met = silhouette(
            &alone,
            self.config,
            &rectangle,
            &wanted,
            (worker, &progress.cancel),
        );
        let places = || {
            (0..met.len())
                .filter(|i| met[*i])
                .map(|i| rectangle.place(i))
        };
        let box_all = Extent::of(places())?;
        let mut mask = vec![false; shown.len()];
        let inside = |[x, y]: [i32; 2]| {
            let is = (0..width as i32).contains(&x) && (0..height as i32).contains(&y);
            is.then(|| y as usize * width as usize + x as usize)
        };
        places()
            .filter_map(inside)
            .for_each(|pixel| mask[pixel] = true);
        let visible: Vec<bool> = shown.iter().map(|shown| *shown == number).collect();
        let count = |mask: &[bool]| mask.iter().filter(|is| **is).count() as u64;
        let place = |pixel: usize| [pixel as i32 % width as i32, pixel as i32 / width as i32];
        let seen_places = (0..visible.len()).filter(|i| visible[*i]).map(place);
        let valid = mask
            .iter()
            .zip(depth)
            .filter(|(is, depth)| **is && **depth > 0);
        let text = |mask: &[bool]| rle::text(&rle::runs(mask, width as usize));
        let seen = Seen {
            number: number.into(),
            name: object.name.clone(),
            category: object.category,
            instances: object.instances.clone(),
            world_from_object: rows_of(&object.world_from_object),
            bounds: object
                .bounds
                .filter(Aabb::is_finite)
                .map(|b| [b.min.to_array(), b.max.to_array()]),
            all: count(&met),
            inside: count(&mask),
            valid: valid.count() as u64,
            visible: count(&visible),
            box_all,
            box_visible: Extent::of(seen_places),
            mask: text(&mask),
            mask_visible: text(&visible),
        };
        let files = || -> Result<[Vec<u8>; 2], SaveError> {
            let file = |mask: &[bool]| mask_png(width, height, mask, Path::new("mask"));
            Ok([file(&mask)?, file(&visible)?])
        };
        let masks = self.with_masks.then(files).transpose();
        Some(masks.map(|masks| Traced { seen, masks }))
    }

    /// Returns the pixels that an object may be met in, of the picture and as many beside it on each
    /// side, and the directions if these say more; `None` if there are none.
    fn reach(&self, world: &World) -> Option<(Rectangle, Option<Directions>)> {
        let size = [self.config.width, self.config.height].map(|side| side as i32);
        let all = Rectangle {
            x: -size[0],
            y: -size[1],
            width: 3 * size[0] as u32,
            height: 3 * size[1] as u32,
        };
        let camera = &self.view.camera;
        let mut within: Option<Directions> = None;
        if !world.unbounded.is_empty() {
            return Some((all, None));
        }
        for entry in &world.entries {
            let bounds = entry.bounds.widened();
            for corner in bounds.corners() {
                let away = corner + world.center - camera.eye;
                let [x, y, z] = [camera.right, camera.up, camera.forward].map(|a| a.dot(away));
                // A box that reaches behind the eye may be anywhere in the picture.
                if z <= 1e-9 * away.length() {
                    return Some((all, None));
                }
                within = Some(Directions::with(within, [x / z, y / z]));
            }
        }
        let within = within?.grown();
        if self.pinhole.distortion != [0.0; 5] {
            return Some((all, Some(within)));
        }
        let [fx, fy, cx, cy] = self.pinhole.k;
        let side = |[low, high]: [f64; 2], size: i32| {
            let (first, last) = (f64::from(-size), f64::from(2 * size - 1));
            // A pixel more on each side, for roundings.
            let low = (low.floor() - 1.0).clamp(first, last + 1.0) as i32;
            let high = (high.ceil() + 1.0).clamp(first - 1.0, last) as i32;
            (low <= high).then_some((low, (high - low + 1) as u32))
        };
        let [left, right] = within.x.map(|x| cx + fx * x);
        let [top, bottom] = [within.y[1], within.y[0]].map(|y| cy - fy * y);
        let (x, width) = side([left, right], size[0])?;
        let (y, height) = side([top, bottom], size[1])?;
        let rectangle = Rectangle {
            x,
            y,
            width,
            height,
        };
        Some((rectangle, None))
    }
}

/// A range of directions (x, y, 1), y up.
#[derive(Clone, Copy)]
struct Directions {
    x: [f64; 2],
    y: [f64; 2],
}

impl Directions {
    fn with(all: Option<Directions>, [x, y]: [f64; 2]) -> Directions {
        let Some(Directions { x: xs, y: ys }) = all else {
            return Directions {
                x: [x, x],
                y: [y, y],
            };
        };
        Directions {
            x: [xs[0].min(x), xs[1].max(x)],
            y: [ys[0].min(y), ys[1].max(y)],
        }
    }

    /// Returns a range that is wider by far more than roundings.
    fn grown(self) -> Directions {
        let grown = |[low, high]: [f64; 2]| {
            let by = 1e-9 * (1.0 + low.abs().max(high.abs()));
            [low - by, high + by]
        };
        Directions {
            x: grown(self.x),
            y: grown(self.y),
        }
    }

    fn holds(&self, [x, y, z]: [f64; 3]) -> bool {
        let within = |[low, high]: [f64; 2], c: f64| (low..=high).contains(&c);
        within(self.x, x / z) && within(self.y, y / z)
    }
}
