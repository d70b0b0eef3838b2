//! Options of when light is taken.

use crate::error::CliError;
use crate::output::complain;
use clap::{Args, value_parser};
use lanecast_model::scene::{Scene, Shutter, ShutterShape};
use lanecast_picture::render::{Exposure, Grid, Integrator};

#[derive(Args, Clone)]
pub struct ShutterArgs {
    /// Blur what moves: take light from OPEN to CLOSE, in place of the camera's own shutter. The
    /// unit is the time from one frame to the next, about the frame's own; of a single picture
    /// the scene's whole motion. 0 takes it out
    #[arg(long, value_name = "OPEN..CLOSE", allow_hyphen_values = true, value_parser = parse_shutter)]
    pub shutter: Option<ShutterChoice>,
    /// Times of the shutter that paths are rounded to [default: 256]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=65_536))]
    pub shutter_slices: Option<u32>,
}

/// What `--shutter` asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShutterChoice {
    Off,
    Open { open: f64, close: f64 },
}

impl ShutterArgs {
    /// Says whether a shutter is asked for.
    #[cfg(feature = "view")]
    pub fn is_open(&self) -> bool {
        matches!(self.shutter, Some(ShutterChoice::Open { .. }))
    }

    /// Returns the exposure of the frame at `time`, whose next is `step` later; `None` where
    /// light is taken at an instant, or nothing moves. `row` is that of the camera.
    pub fn exposure(
        &self,
        scene: &Scene,
        row: Option<usize>,
        (grid, integrator): (Grid, Option<Integrator>),
        (time, step): (f64, f64),
    ) -> Result<Option<Exposure>, CliError> {
        let own = row.and_then(|row| scene.cameras.shutter(row));
        let shutter = match self.shutter {
            Some(ShutterChoice::Off) => None,
            Some(ShutterChoice::Open { open, close }) => Some(Shutter {
                open,
                close,
                shape: own.map_or(ShutterShape::Box, |own| own.shape),
            }),
            None => own,
        };
        let Some(shutter) = shutter else {
            return match self.shutter_slices {
                None => Ok(None),
                Some(_) => Err(CliError::Usage(
                    "there is no shutter that --shutter-slices would divide; give the camera one, \
                     or ask for --shutter 0..1"
                        .into(),
                )),
            };
        };
        let asked = self.shutter.is_some();
        if grid == Grid::Corners {
            return match asked {
                false => Ok(None),
                true => Err(CliError::Usage(
                    "--grid corners traces one ray through each corner, at one time; leave out \
                     --shutter"
                        .into(),
                )),
            };
        }
        if let (Some(_), Some(Integrator::Inspect(_))) = (self.shutter_slices, integrator) {
            return Err(CliError::Usage(
                "pictures without light are of the middle of the shutter; leave out \
                 --shutter-slices"
                    .into(),
            ));
        }
        if !scene.moves() {
            if asked {
                complain("warning: nothing in this scene moves, so --shutter changes nothing");
            }
            return Ok(None);
        }
        let slices = self.shutter_slices.unwrap_or(Exposure::SLICES);
        Ok(Some(Exposure::of_frame(&shutter, time, step, slices)))
    }
}

fn parse_shutter(text: &str) -> Result<ShutterChoice, String> {
    let number = |text: &str| {
        let number = text.trim().parse::<f64>().ok();
        number.filter(|x| x.abs() <= 1e6)
    };
    if number(text) == Some(0.0) {
        return Ok(ShutterChoice::Off);
    }
    match text.split_once("..").map(|(a, b)| (number(a), number(b))) {
        Some((Some(open), Some(close))) if open < close => Ok(ShutterChoice::Open { open, close }),
        _ => Err(
            "write when it opens and, later, closes, such as 0..0.5 or -0.25..0.25; or 0 for none"
                .into(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shutters_are_read() {
        let open = |open, close| Ok(ShutterChoice::Open { open, close });
        assert_eq!(parse_shutter("0..0.5"), open(0.0, 0.5));
        assert_eq!(parse_shutter("-.25...25"), open(-0.25, 0.25));
        assert_eq!(parse_shutter("0"), Ok(ShutterChoice::Off));
        for wrong in [
            "", "1", "..", "0..", "0.5..0.5", "1..0", "0..nan", "0..1e9", "a..b",
        ] {
            assert!(parse_shutter(wrong).is_err(), "{wrong}");
        }
    }
}
