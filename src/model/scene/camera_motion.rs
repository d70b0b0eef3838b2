//! Cameras that move: keys over the time of a sequence, from 0 to 1.
//!
//! Between two keys the eye, the point that is looked at and the direction upward go straight,
//! and the camera's frame is made from them as that of a camera at rest. Before the first key
//! comes the camera's own pose at time 0; times outside take the nearest key's.

use super::cameras::Camera;
use glam::DVec3;
use std::ops::Range;

/// The pose of a camera at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraKey {
    /// The time, 0 for the first key, at most 1.
    pub at: f64,
    pub eye: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    pub up: DVec3,
}

/// The keys of all cameras that move.
#[derive(Clone, Debug, Default)]
pub struct CameraMotions {
    /// The rows of the cameras that move, rising.
    pub of: Vec<u32>,
    /// Per row: its range of `keys`, with the first key at time 0.
    pub ranges: Vec<Range<u32>>,
    pub keys: Vec<CameraKey>,
}

impl CameraMotions {
    pub(super) fn push(&mut self, of: u32, keys: &[CameraKey]) {
        let first = self.keys.len() as u32;
        self.keys.extend_from_slice(keys);
        self.of.push(of);
        self.ranges.push(first..self.keys.len() as u32);
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Returns the keys of a row of this table.
    pub fn keys(&self, row: usize) -> &[CameraKey] {
        let range = &self.ranges[row];
        &self.keys[range.start as usize..range.end as usize]
    }

    /// Returns a camera of a row at a time.
    pub(super) fn at(&self, row: usize, camera: &Camera, time: f64) -> Camera {
        let keys = self.keys(row);
        let after = keys.partition_point(|key| key.at <= time);
        let (a, b) = (&keys[after.saturating_sub(1)], keys.get(after));
        let key = match b {
            Some(b) if time > a.at => {
                let s = (time - a.at) / (b.at - a.at);
                let mix = |a: DVec3, b: DVec3| a * (1.0 - s) + b * s;
                CameraKey {
                    at: time,
                    eye: mix(a.eye, b.eye),
                    look_at: mix(a.look_at, b.look_at),
                    up: mix(a.up, b.up),
                }
            }
            _ => *a,
        };
        camera.moved(key.eye, key.look_at, key.up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_go_straight_and_are_met_at_keys() {
        let key = |at, x: f64| CameraKey {
            at,
            eye: DVec3::new(x, 0.0, 5.0),
            look_at: DVec3::new(0.0, x, 0.0),
            up: DVec3::Y,
        };
        let mut motions = CameraMotions::default();
        motions.push(3, &[key(0.0, 1.0), key(0.5, 3.0), key(1.0, -1.0)]);
        let at = |time: f64| {
            let own = Camera::perspective(DVec3::ZERO, DVec3::X, DVec3::Y, 40.0);
            motions.at(0, &own, time)
        };
        let posed = |x: f64| {
            let CameraKey {
                eye, look_at, up, ..
            } = key(0.0, x);
            Camera::perspective(eye, look_at, up, 40.0)
        };
        for (time, x) in [
            (-1.0, 1.0),
            (0.0, 1.0),
            (0.25, 2.0),
            (0.5, 3.0),
            (0.75, 1.0),
            (1.0, -1.0),
            (9.0, -1.0),
        ] {
            assert_eq!(at(time), posed(x), "{time}");
        }
    }
}
