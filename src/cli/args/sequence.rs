//! Options of sequences of pictures.

use super::shutter::{ShutterArgs, ShutterChoice};
use clap::Args;
use lanecast_io::Animated;
use lanecast_model::scene::{Pace, Timeline};

#[derive(Args)]
pub struct SequenceArgs {
    /// Render several pictures, name_0000.png and so on: N at even times from the beginning to the
    /// end of the scene's motion, or the frames from A to B - 1 of --fps, each or every S-th
    #[arg(long, value_name = "N|A..B[:S]", value_parser = parse_frames)]
    pub frames: Option<Frames>,
    /// Frames a second of --frames A..B [default: 24]
    #[arg(long, value_name = "F", requires = "frames", value_parser = parse_fps)]
    pub fps: Option<f64>,
}

/// What `--frames` asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frames {
    /// So many over the whole motion.
    Whole(u32),
    Range {
        first: u32,
        end: u32,
        stride: u32,
    },
}

const DEFAULT_FPS: f64 = 24.0;
const MOST_FRAMES: u32 = 100_000;

impl SequenceArgs {
    /// Returns the frames that are asked for, if several pictures are.
    pub fn timeline(&self) -> Result<Option<Timeline>, String> {
        match (self.frames, self.fps) {
            (None, _) => Ok(None),
            (Some(Frames::Whole(_)), Some(_)) => Err(
                "--fps goes with a range of frames, such as --frames 0..48; --frames N spans the \
                 whole motion, however long it is"
                    .into(),
            ),
            (Some(Frames::Whole(frames)), None) => Ok(Some(Timeline::whole(frames))),
            (Some(Frames::Range { first, end, stride }), fps) => Ok(Some(Timeline {
                pace: Pace::PerSecond(fps.unwrap_or(DEFAULT_FPS)),
                first,
                end,
                stride,
            })),
        }
    }

    /// Returns what a file's animation is read for: that of the name, or the first if frames or a
    /// shutter are asked for; else none.
    pub fn animated(&self, name: Option<&str>, shutter: &ShutterArgs) -> Option<Animated> {
        let open = match shutter.shutter {
            Some(ShutterChoice::Open { open, close }) => Some(open.abs().max(close.abs())),
            Some(ShutterChoice::Off) | None => None,
        };
        let timeline = self.timeline().ok().flatten();
        if name.is_none() && open.is_none() && timeline.is_none() {
            return None;
        }
        Some(Animated {
            name: name.map(Into::into),
            timeline: timeline.unwrap_or(Timeline::whole(1)),
            // Vectors of motion ask for the frames beside.
            margin: 1 + open.unwrap_or(0.0).min(1e6).ceil() as u32,
            blurs: open.is_some(),
        })
    }
}

fn parse_frames(text: &str) -> Result<Frames, String> {
    let wrong = || {
        format!(
            "write a number of pictures, 1 to {MOST_FRAMES}, or the first frame and the one after \
             the last, such as 0..48, or 0..48:2 for every second"
        )
    };
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let Some((first, rest)) = text.split_once("..") else {
        let count = number(text)?;
        return match (1..=MOST_FRAMES).contains(&count) {
            true => Ok(Frames::Whole(count)),
            false => Err(wrong()),
        };
    };
    let (end, stride) = rest.split_once(':').unwrap_or((rest, "1"));
    let (first, end, stride) = (number(first)?, number(end)?, number(stride)?);
    let fits = first < end && stride > 0 && (end - first).div_ceil(stride) <= MOST_FRAMES;
    match fits {
        true => Ok(Frames::Range { first, end, stride }),
        false => Err(wrong()),
    }
}

fn parse_fps(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fps) if (1e-3..=1e6).contains(&fps) => Ok(fps),
        _ => Err("write a number from 0.001 to 1000000, such as 24".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read() {
        assert_eq!(parse_frames("12"), Ok(Frames::Whole(12)));
        let range = |first, end, stride| Ok(Frames::Range { first, end, stride });
        assert_eq!(parse_frames("3..9"), range(3, 9, 1));
        assert_eq!(
            parse_frames("0..4000000000:1000000"),
            range(0, 4_000_000_000, 1_000_000)
        );
        for bad in [
            "",
            "0",
            "100001",
            "9..9",
            "9..3",
            "0..9:0",
            "a..b",
            "0..",
            "..4",
            "-1..3",
            "0..200000",
        ] {
            assert!(parse_frames(bad).is_err(), "{bad}");
        }
    }
}
