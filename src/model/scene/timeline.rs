//! The frames of a sequence: their numbers, and their times in a scene's motion.

/// How fast frames follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// So many frames from time 0 to time 1, both of which have one.
    Whole(u32),
    /// So many frames a second, above 0.
    PerSecond(f64),
}

/// The frames of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    pub pace: Pace,
    /// The number of the first frame, and of the one after the last.
    pub first: u32,
    pub end: u32,
    /// Of so many frames in a row one is made.
    pub stride: u32,
}

impl Timeline {
    /// Returns the sequence of so many frames that spans a whole motion.
    pub fn whole(frames: u32) -> Timeline {
        Timeline {
            pace: Pace::Whole(frames),
            first: 0,
            end: frames,
            stride: 1,
        }
    }

    /// Lists the numbers of the frames.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = u32> + use<> {
        (self.first..self.end).step_by(self.stride.max(1) as usize)
    }

    /// Returns the time of a frame, which may lie outside [0, 1]. The motion takes `seconds`.
    pub fn time(&self, frame: i64, seconds: f64) -> f64 {
        match self.pace {
            Pace::Whole(frames) => frame as f64 / f64::from(frames.saturating_sub(1).max(1)),
            // Files keep the times of keys in f32: where what steps has a key at a frame, this is
            // its time, and neither just before nor after it.
            Pace::PerSecond(rate) => f64::from((frame as f64 / rate) as f32) / seconds,
        }
    }

    /// Returns the time from one frame to the next.
    pub fn step(&self, seconds: f64) -> f64 {
        match self.pace {
            Pace::Whole(frames) => 1.0 / f64::from(frames.saturating_sub(1).max(1)),
            Pace::PerSecond(rate) => 1.0 / (rate * seconds),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_times() {
        let whole = Timeline::whole(3);
        assert_eq!([0, 1, 2].map(|i| whole.time(i, 9.0)), [0.0, 0.5, 1.0]);
        assert_eq!(whole.step(9.0), 0.5);
        assert_eq!(Timeline::whole(1).time(0, 1.0), 0.0);
        let some = Timeline {
            pace: Pace::PerSecond(24.0),
            first: 3,
            end: 9,
            stride: 4,
        };
        assert_eq!(some.frames().collect::<Vec<_>>(), [3, 7]);
        assert_eq!(some.frames().len(), 2);
        assert_eq!(some.time(12, 2.0), 0.25);
        assert_eq!(some.time(-12, 2.0), -0.25);
        assert_eq!(some.time(1, 1.0), f64::from(1.0_f32 / 24.0));
        assert_eq!(some.step(2.0), 1.0 / 48.0);
    }
}
