//! The axes of a job whose rows are options of `lanecast render`: views and variants.

use super::job::{CameraChoice, Job, Orbit, nearest};
use super::options::{arguments, name_of};
use clap::Command;
use lanecast_model::scene::StandardView;
use std::path::Path;

/// A row of an axis: its name, and what it adds to the arguments.
#[derive(Clone, Debug, Default)]
pub struct Named {
    pub name: String,
    pub arguments: Vec<String>,
}

/// Lists the views of a job: cameras, standard views, rounds. A job without any has one view, of
/// each scene's first camera.
pub fn views(job: &Job, folder: &Path) -> Result<Vec<Named>, String> {
    let mut views = Vec::new();
    let one = |name: &str, argument: String| Named {
        name: name.into(),
        arguments: vec![argument],
    };
    let size = job.render.get("size").and_then(|size| size.as_str());
    let mut number = 0;
    for camera in &job.camera.0 {
        match camera {
            CameraChoice::Named(camera) => {
                views.push(one(camera, format!("--camera={camera}")));
            }
            CameraChoice::Numbered(number) => {
                views.push(one(&number.to_string(), format!("--camera={number}")));
            }
            CameraChoice::Posed(file) => {
                let posed = file.read(folder, size);
                let posed = posed.map_err(|why| format!("camera: {why}"))?;
                if posed.is_empty() {
                    return Err(format!("camera: {} has no cameras", file.file));
                }
                for posed in posed {
                    views.push(Named {
                        name: format!("pose_{number:05}"),
                        arguments: posed.arguments.into(),
                    });
                    number += 1;
                }
            }
        }
    }
    for view in &job.view.0 {
        let names = || StandardView::ALL.iter().map(|(name, _)| *name);
        if !names().any(|name| name == view) {
            let hint = nearest(view, names()).map(|near| format!("did you mean {near}? "));
            let known: Vec<&str> = names().collect();
            return Err(format!(
                "view: '{view}' is unknown; {}known are {}; cameras of scenes are named by camera",
                hint.unwrap_or_default(),
                known.join(", ")
            ));
        }
        views.push(one(view, format!("--view={view}")));
    }
    let mut number = 0;
    for orbit in &job.orbit.0 {
        for angle in orbit_angles(orbit)? {
            views.push(one(
                &format!("orbit_{number:03}"),
                format!("--orbit={angle}"),
            ));
            number += 1;
        }
    }
    if views.is_empty() {
        views.push(Named::default());
    }
    Ok(views)
}

/// Lists the values of `--orbit` of a round, or of several at their elevations.
fn orbit_angles(orbit: &Orbit) -> Result<Vec<String>, String> {
    if !(1..=100_000).contains(&orbit.views) {
        return Err("orbit: views is a number from 1 to 100000".into());
    }
    if !orbit.start.is_finite() {
        return Err("orbit: start is an angle in degrees".into());
    }
    let fov = orbit.fov_y.map_or(String::new(), |fov| format!(",{fov}"));
    let mut angles = Vec::new();
    for elevation in orbit.elevation.list() {
        for i in 0..orbit.views {
            let azimuth = orbit.start + 360.0 * f64::from(i) / f64::from(orbit.views);
            angles.push(format!("{azimuth},{elevation}{fov}"));
        }
    }
    Ok(angles)
}

/// Lists the variants of a job with all of their options; one without a name if it has none.
pub fn variants(job: &Job, render: &Command) -> Result<Vec<Named>, String> {
    let base = || job.render.clone();
    if job.variant.0.is_empty() {
        let arguments = arguments(&base(), render).map_err(|why| format!("[render]: {why}"))?;
        return Ok(vec![Named {
            name: String::new(),
            arguments,
        }]);
    }
    let each = job.variant.0.iter().map(|variant| {
        let mut options = base();
        options.retain(|key, _| {
            let mut own = variant.options.keys();
            !own.any(|own| name_of(own) == name_of(key))
        });
        options.extend(variant.options.clone());
        let of = |why| format!("variant {}: {why}", variant.name);
        Ok(Named {
            name: variant.name.clone(),
            arguments: arguments(&options, render).map_err(of)?,
        })
    });
    each.collect()
}
