//! Which animation of a file is shown, and at which times.

use crate::scene::{FRAMED_TIMES, Timeline};

/// The animation to show.
#[derive(Clone, Debug, PartialEq)]
pub struct Animated {
    /// Its name or number; else the file's first, if it has any.
    pub name: Option<String>,
    /// The frames that will be asked for.
    pub timeline: Timeline,
    /// How many frames before and after each are needed, for shutters and motion vectors.
    pub margin: u32,
    /// Whether there is a shutter, so that times between frames are needed.
    pub blurs: bool,
}

/// Between frames, vertices are computed at least so often a second, and so often a frame.
const BLURRED_PER_SECOND: f64 = 100.0;
const BLURRED_PER_FRAME: u32 = 4;

/// The most times of one file.
const MOST: usize = 1 << 16;

impl Animated {
    /// Lists times, rising from 0 and up to 1, at which vertices of a motion of so many seconds
    /// are computed: those of all frames, with a shutter some between, and those of the default
    /// view.
    pub fn samples(&self, seconds: f64) -> Vec<f64> {
        let line = &self.timeline;
        let parts = match self.blurs {
            true => {
                let length = line.step(seconds) * seconds;
                let parts = (length * BLURRED_PER_SECOND).clamp(1.0, 1e6) as u32;
                parts.max(BLURRED_PER_FRAME).next_power_of_two()
            }
            false => 1,
        };
        let mut all = vec![0.0];
        let mut last = i64::MIN;
        for frame in line.frames() {
            let [from, to] = [-1, 1].map(|side| i64::from(frame) + side * i64::from(self.margin));
            for near in from.max(last)..=to {
                let start = line.time(near, seconds);
                let length = line.time(near + 1, seconds) - start;
                let inner = |part| start + length * (f64::from(part) / f64::from(parts));
                all.extend((0..parts).map(inner).filter(|at| *at > 0.0 && *at <= 1.0));
                if line.time(near, seconds) > 1.0 || all.len() > MOST {
                    break;
                }
            }
            last = to + 1;
        }
        // A view frames the motion at these times, whatever the frames asked for; later frames are
        // as the end is.
        let last = f64::from(FRAMED_TIMES - 1);
        all.extend((1..FRAMED_TIMES).map(|i| f64::from(i) / last));
        all.sort_unstable_by(f64::total_cmp);
        all.dedup();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Pace;

    #[test]
    fn samples_rise_and_have_all_frames() {
        let mut animated = Animated {
            name: None,
            timeline: Timeline::whole(5),
            margin: 1,
            blurs: false,
        };
        let view: Vec<f64> = (0..17).map(|i| f64::from(i) / 16.0).collect();
        assert_eq!(animated.samples(7.0), view);
        animated.blurs = true;
        let samples = animated.samples(0.1);
        assert_eq!(samples, view);
        assert!(samples.windows(2).all(|pair| pair[0] < pair[1]));
        animated.timeline = Timeline {
            pace: Pace::PerSecond(10.0),
            first: 3,
            end: 30,
            stride: 4,
        };
        animated.blurs = false;
        let samples = animated.samples(2.0);
        assert!(samples.windows(2).all(|pair| pair[0] < pair[1]));
        for frame in [2, 3, 4, 6, 7, 8, 11, 15, 19] {
            assert!(
                samples.contains(&animated.timeline.time(frame, 2.0)),
                "{frame}"
            );
        }
        assert_eq!(samples[samples.len() - 1], 1.0);
        assert!(!samples.contains(&animated.timeline.time(13, 2.0)));
    }
}
