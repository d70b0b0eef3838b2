//! Cameras as data sets have them: pinholes, by their focal lengths in pixels.

use super::settings::{DatasetSettings, Format};
use crate::error::CliError;
use lanecast_model::scene::{Camera, Projection};
use lanecast_picture::render::{Grid, RenderConfig};

/// A pinhole as its picture has it.
pub struct Pinhole {
    /// fx, fy, cx and cy, the first pixel's centre at 0, 0.
    pub k: [f64; 4],
    pub distortion: [f64; 5],
}

impl Pinhole {
    /// Returns a camera's pinhole. Refuses what data sets have no numbers for.
    pub fn of(
        camera: &Camera,
        config: &RenderConfig,
        settings: &DatasetSettings,
    ) -> Result<Pinhole, CliError> {
        if config.grid == Grid::Corners {
            return Err(CliError::Usage(
                "a data set has pixels, and --grid corners has their corners; leave it out".into(),
            ));
        }
        let (width, height) = (f64::from(config.width), f64::from(config.height));
        let pinhole = match camera.projection {
            Projection::Perspective { half_height } => {
                let focal = 0.5 * height / half_height;
                Pinhole {
                    k: [focal, focal, 0.5 * width - 0.5, 0.5 * height - 0.5],
                    distortion: [0.0; 5],
                }
            }
            Projection::Calibrated(k) => {
                let [x, y] = [width / f64::from(k.size[0]), height / f64::from(k.size[1])];
                Pinhole {
                    k: [
                        k.focal[0] * x,
                        k.focal[1] * y,
                        (k.center[0] + 0.5) * x - 0.5,
                        (k.center[1] + 0.5) * y - 0.5,
                    ],
                    distortion: k.distortion,
                }
            }
            Projection::Orthographic { .. } | Projection::Panorama | Projection::Fisheye { .. } => {
                return Err(CliError::Usage(
                    "data sets have numbers for pinholes alone, and this camera is none; choose another, \
                     or ask for views by orbit or a file of poses"
                        .into(),
                ));
            }
        };
        if pinhole.distortion != [0.0; 5] && settings.writes(Format::Bop) {
            return Err(CliError::Usage(
                "BOP has no numbers for a lens that distorts; leave bop out, or the distortion"
                    .into(),
            ));
        }
        Ok(pinhole)
    }
}
