//! What is noted of a picture: its camera and its objects, in a file of its own beside it. What a
//! data set says of many pictures is made of these.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// The version of the notes.
pub const VERSION: u32 = 1;

/// A picture of a data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Note {
    pub v: u32,
    pub task: u32,
    /// From the folder of the run.
    pub picture: String,
    pub size: [u32; 2],
    pub scene: String,
    pub camera: String,
    pub variant: String,
    pub frame: Option<u32>,
    /// fx, fy, cx and cy in pixels, the first pixel's centre at 0, 0.
    pub k: [f64; 4],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Rows of the camera's pose: x to the right, y down, z ahead.
    pub world_from_camera: [[f64; 4]; 3],
    /// Millimetres in a unit of the scene, and in a step of depth.
    pub unit: f64,
    pub depth_scale: f64,
    /// Pixels whose depth has no number of 16 bits, and has 0.
    pub too_far: u64,
    /// Those of which a pixel is met, in the picture or as far beside it as it is large, if nothing
    /// were in front of them.
    pub objects: Vec<Seen>,
}

impl Note {
    /// Returns the rotation from the world to the camera, and the eye.
    pub fn rotation_and_eye(&self) -> (DMat3, DVec3) {
        let column = |k: usize| DVec3::from_array(self.world_from_camera.map(|row| row[k]));
        let world_from_camera = DMat3::from_cols(column(0), column(1), column(2));
        (world_from_camera.transpose(), column(3))
    }

    pub fn without_masks(self) -> Note {
        let bare = |seen: Seen| Seen {
            mask: String::new(),
            mask_visible: String::new(),
            ..seen
        };
        Note {
            objects: self.objects.into_iter().map(bare).collect(),
            ..self
        }
    }
}

/// An object as one picture shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Its number in the scene, from 1, which the picture of objects has.
    pub number: u32,
    pub name: String,
    pub category: u16,
    /// Ids of its instances, as --aov instance_id has them.
    pub instances: Vec<u64>,
    pub world_from_object: [[f64; 4]; 3],
    /// Least and greatest corner of its box, in its own space; null of what is unbounded.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Pixels of its silhouette, in the picture and beside it; in the picture; of these those with a
    /// depth; and those where it is seen.
    pub all: u64,
    pub inside: u64,
    pub valid: u64,
    pub visible: u64,
    /// First and last column, first and last row: of the silhouette, and of what is seen.
    pub box_all: Extent,
    pub box_visible: Option<Extent>,
    /// Masks of the silhouette in the picture, and of what is seen, as COCO's text.
    pub mask: String,
    pub mask_visible: String,
}

/// A range of pixels, ends included; the picture begins at 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extent {
    pub x: [i32; 2],
    pub y: [i32; 2],
}

impl Extent {
    /// Returns the extent of some pixels; `None` of none.
    pub fn of(pixels: impl Iterator<Item = [i32; 2]>) -> Option<Extent> {
        pixels.fold(None, |extent, [x, y]| {
            let Some(Extent { x: xs, y: ys }) = extent else {
                return Some(Extent {
                    x: [x, x],
                    y: [y, y],
                });
            };
            Some(Extent {
                x: [xs[0].min(x), xs[1].max(x)],
                y: [ys[0].min(y), ys[1].max(y)],
            })
        })
    }

    /// Returns left, top, width and height, of which the last pixel counts.
    pub fn rectangle(&self) -> [i32; 4] {
        let [width, height] = [self.x, self.y].map(|[first, last]| last - first + 1);
        [self.x[0], self.y[0], width, height]
    }

    /// Returns them as BOP's tools compute them: the last pixel does not count.
    pub fn of_bop(&self) -> [i32; 4] {
        let [x, y, width, height] = self.rectangle();
        [x, y, width - 1, height - 1]
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A picture of one object, for tests of what is made of notes.
    pub fn note() -> Note {
        let seen = Seen {
            number: 1,
            name: "a".into(),
            category: 5,
            instances: vec![0],
            world_from_object: [
                [0.0, -2.0, 0.0, 1.0],
                [2.0, 0.0, 0.0, 2.0],
                [0.0, 0.0, 2.0, 3.0],
            ],
            bounds: Some([[-1.0; 3], [1.0; 3]]),
            all: 40,
            inside: 30,
            valid: 30,
            visible: 10,
            box_all: Extent {
                x: [-3, 6],
                y: [0, 3],
            },
            box_visible: Some(Extent {
                x: [0, 4],
                y: [1, 2],
            }),
            mask: "0".into(),
            mask_visible: "1".into(),
        };
        Note {
            v: VERSION,
            task: 1002,
            picture: "p.png".into(),
            size: [64, 48],
            scene: "s".into(),
            camera: String::new(),
            variant: String::new(),
            frame: None,
            k: [50.0, 51.0, 31.5, 23.5],
            distortion: [0.0; 5],
            // At (1, 2, 9), looking along -z with x to the right.
            world_from_camera: [
                [1.0, 0.0, 0.0, 1.0],
                [0.0, -1.0, 0.0, 2.0],
                [0.0, 0.0, -1.0, 9.0],
            ],
            unit: 1000.0,
            depth_scale: 0.1,
            too_far: 0,
            objects: vec![seen],
        }
    }

    #[test]
    fn extents_hold_their_pixels() {
        assert_eq!(Extent::of(std::iter::empty()), None);
        let extent = Extent::of([[3, 4], [-1, 9], [2, 5]].into_iter()).unwrap();
        assert_eq!(extent.rectangle(), [-1, 4, 5, 6]);
        assert_eq!(extent.of_bop(), [-1, 4, 4, 5]);
    }
}
