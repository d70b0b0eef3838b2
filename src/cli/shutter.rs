//! The slices of a picture's shutter, as far as the command line is asked about them.

use super::error::CliError;
use super::output::complain;
use lanecast_io::LoadError;
use lanecast_picture::render::{Exposure, RenderConfig, SliceError, Slices, View};
use std::path::Path;

/// Makes the slices of a picture's shutter, if it has one. `row` is that of the camera, `asked`
/// the number of slices of the command line: without it there are fewer where memory would not
/// suffice, with a warning. Pictures without light need none.
pub fn slices(
    view: &View,
    row: Option<usize>,
    config: &RenderConfig,
    asked: Option<u32>,
    path: &Path,
) -> Result<Option<Slices>, CliError> {
    let Some(exposure) = config.shutter.filter(|_| config.integrator.shows_light()) else {
        return Ok(None);
    };
    let most = Slices::most(view.world);
    let exposure = match asked {
        None if most < exposure.slices => {
            complain(&format!(
                "warning: the scene has so many instances that the shutter gets {most} slices in \
                 place of {}; --shutter-slices asks for fewer",
                exposure.slices
            ));
            Exposure {
                slices: most,
                ..exposure
            }
        }
        _ => exposure,
    };
    match Slices::build(view.world, (&view.camera, row), &exposure) {
        Ok(slices) => Ok(Some(slices)),
        Err(SliceError::Scene(source)) => Err(LoadError::of_scene(path, source).into()),
        Err(error) => Err(CliError::Usage(error.to_string())),
    }
}
