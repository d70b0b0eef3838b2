//! A click: all that the ray through a pixel's centre has in the solids, as `probe` tells it.

use super::look::{Look, Shot};
use super::{Shared, json};
use crate::probe::Report;
use lanecast_picture::render::RayGenerator;
use serde::{Deserialize, Serialize};

/// The pixel of a look that was clicked.
#[derive(Deserialize)]
pub struct Click {
    #[serde(flatten)]
    look: Look,
    x: u32,
    y: u32,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename = "probed")]
struct Probed {
    id: u64,
    x: u32,
    y: u32,
    /// The command line that tells the same.
    command: String,
    report: Option<Report>,
    /// Why there is no report.
    error: Option<String>,
}

/// Probes, and returns the message for the page.
pub fn probe(shared: &Shared, click: &Click) -> String {
    let (_, model) = shared.model();
    let mut probed = Probed {
        id: click.look.id,
        x: click.x,
        y: click.y,
        command: String::new(),
        report: None,
        error: None,
    };
    match Shot::of(&shared.base, &model, &click.look) {
        Err(error) => probed.error = Some(error.to_string()),
        Ok(shot) => {
            if !shot.is_still {
                let error =
                    "probe tells of the scene's beginning; go to frame 0 and close the shutter";
                probed.error = Some(error.into());
                return json(&probed);
            }
            let config = &shot.config;
            let rays = RayGenerator::new(shot.camera, config.width, config.height, config.grid);
            let (org, dir) = rays.ray(click.x, click.y, [0.5; 2]);
            if dir.is_nan() {
                probed.error = Some("the camera sees nothing there".into());
            } else {
                probed.command = shared.base.probe_command(org, dir);
                match model.probe(org, dir) {
                    Ok(report) => probed.report = Some(report),
                    Err(error) => probed.error = Some(error),
                }
            }
        }
    }
    json(&probed)
}
