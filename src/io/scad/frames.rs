//! The space of a solid: that in which most of its primitives lie along the axes.
//!
//! Boxes of primitives that are turned reach far beyond them, and faces of several frames are not known
//! to coincide (docs/SPEC.md, S40). So where one node turns most of a solid, the solid is built as if it
//! did not, and its instances are turned.

use super::placing::{is_along_axes, is_turn};
use glam::DAffine3;

/// A place in the scene: by a map, and by a turn and what is along the axes within it.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// The scene's coordinates from those of the part.
    pub map: DAffine3,
    /// The row of [`Frames`], and the map from the part to it.
    frame: u32,
    within: DAffine3,
}

/// The turns of a solid. The first row is the scene's own space.
pub(super) struct Frames {
    maps: Vec<DAffine3>,
    /// How many primitives are along the axes of each.
    counts: Vec<usize>,
}

/// The most turns that are looked through for one that is known.
const MOST: usize = 64;

impl Default for Frames {
    fn default() -> Frames {
        Frames {
            maps: vec![DAffine3::IDENTITY],
            counts: vec![0],
        }
    }
}

impl Frames {
    /// Returns the place of a part that a map places in the scene.
    pub fn first(&mut self, map: DAffine3) -> Place {
        let scene = Place {
            map: DAffine3::IDENTITY,
            frame: 0,
            within: DAffine3::IDENTITY,
        };
        self.below(&scene, &map)
    }

    /// Returns the place of a part that a map places within another.
    pub fn below(&mut self, place: &Place, by: &DAffine3) -> Place {
        let map = place.map * *by;
        if is_along_axes(&by.matrix3) {
            return Place {
                map,
                within: place.within * *by,
                ..*place
            };
        }
        let same = |known: &DAffine3| known.matrix3 == map.matrix3;
        match self.maps.iter().take(MOST).position(same) {
            Some(row) => {
                let known = &self.maps[row];
                let shift = known.matrix3.inverse() * (map.translation - known.translation);
                Place {
                    map,
                    frame: row as u32,
                    within: DAffine3::from_translation(shift),
                }
            }
            None => {
                self.maps.push(map);
                self.counts.push(0);
                Place {
                    map,
                    frame: self.maps.len() as u32 - 1,
                    within: DAffine3::IDENTITY,
                }
            }
        }
    }

    /// Counts a primitive that turns change.
    pub fn count(&mut self, place: &Place) {
        self.counts[place.frame as usize] += 1;
    }

    /// Returns the frame of more than half of all primitives, if they are several and it is not the
    /// scene's own.
    pub fn space(&self) -> Option<Space> {
        let all: usize = self.counts.iter().sum();
        let row = self.counts.iter().position(|count| count * 2 > all)?;
        let map = self.maps[row];
        let is_space = row > 0 && all > 1 && map.is_finite() && is_turn(&map.matrix3);
        is_space.then(|| Space {
            frame: row as u32,
            scene_from_space: map,
            space_from_scene: DAffine3 {
                matrix3: map.matrix3.inverse(),
                translation: map.matrix3.inverse() * -map.translation,
            },
        })
    }
}

/// A space of a solid that is not the scene's.
pub(super) struct Space {
    frame: u32,
    pub scene_from_space: DAffine3,
    space_from_scene: DAffine3,
}

impl Space {
    /// Returns the map from a part to this space.
    pub fn map(&self, place: &Place) -> DAffine3 {
        match place.frame == self.frame {
            true => place.within,
            false => self.space_from_scene * place.map,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat, DVec3};

    fn turn(degrees: f64) -> DAffine3 {
        DAffine3::from_quat(DQuat::from_rotation_z(degrees.to_radians()))
    }

    fn shift(x: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, 0.0, 0.0))
    }

    #[test]
    fn the_space_is_that_of_most() {
        let mut frames = Frames::default();
        let scene = frames.first(DAffine3::IDENTITY);
        let turned = frames.below(&scene, &turn(30.0));
        let moved = frames.below(&turned, &shift(2.0));
        // The same turn elsewhere.
        let beside = frames.below(&scene, &shift(5.0));
        let beside = frames.below(&beside, &turn(30.0));
        frames.count(&scene);
        frames.count(&moved);
        assert!(frames.space().is_none());
        frames.count(&beside);
        let space = frames.space().unwrap();
        assert_eq!(space.map(&moved), shift(2.0));
        assert!(space.map(&beside).matrix3 == DMat3::IDENTITY);
        for place in [scene, moved, beside] {
            let map = space.scene_from_space * space.map(&place);
            for p in [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)] {
                let off = map.transform_point3(p) - place.map.transform_point3(p);
                assert!(off.length() < 1e-14, "{off}");
            }
        }
    }

    #[test]
    fn what_stretches_is_no_space() {
        let mut frames = Frames::default();
        let scene = frames.first(DAffine3::IDENTITY);
        let wide = DAffine3::from_scale(DVec3::new(1.0, 1.1, 1.0)) * turn(30.0);
        let place = frames.below(&scene, &wide);
        frames.count(&place);
        assert!(frames.space().is_none());
    }
}
