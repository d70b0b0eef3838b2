//! What the header of an OpenEXR file tells of how a picture was made.

use super::args::{RenderArgs, Told};
use super::error::CliError;
use lanecast_io::{AovSet, Attribute, Metadata, Picture};
use lanecast_measure::Stats;
use lanecast_model::scene::{Camera, Projection};
use lanecast_picture::render::{Integrator, RenderConfig};
use std::path::Path;

/// Refuses metadata where no file can hold it.
pub fn check(args: &RenderArgs, path: &Path, aovs: AovSet) -> Result<(), CliError> {
    // A tile keeps what the file that it becomes a part of may hold.
    let is_exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("tile"));
    match args.outputs.metadata {
        Told::Fixed | Told::All if !is_exr && !aovs.any() => Err(CliError::Usage(
            "--metadata is for OpenEXR files; leave it out, or name a .exr".into(),
        )),
        _ => Ok(()),
    }
}

/// Makes a picture's metadata.
pub fn of(
    told: Told,
    (config, camera, scene): (&RenderConfig, &Camera, Option<&Path>),
    (errors, mean_samples): (Option<SquaredErrors>, Option<f64>),
    stats: &Stats,
) -> Metadata {
    let told = match told {
        Told::Auto if config.aovs.any_of_layers() => Told::All,
        told => told,
    };
    if matches!(told, Told::Auto | Told::None) {
        return Metadata::new();
    }
    let text = |text: &str| Attribute::Text(text.into());
    let version = env!("CARGO_PKG_VERSION");
    let scene = scene
        .and_then(Path::file_name)
        .map(|name| name.to_string_lossy());
    let mut all: Vec<(&str, Attribute)> = vec![
        ("software", text(&format!("lanecast {version}"))),
        ("softwareVersion", text(version)),
        (
            "commit",
            text(option_env!("LANECAST_COMMIT").unwrap_or("unknown")),
        ),
        ("scene", text(scene.as_deref().unwrap_or("built in"))),
        ("integrator", text(integrator(config.integrator))),
        ("precision", text(config.choices.precision.name())),
        // A header's whole numbers have 31 bits.
        (
            "seed",
            match i32::try_from(config.seed) {
                Ok(seed) => Attribute::Int(seed),
                Err(_) => Attribute::Text(config.seed.to_string()),
            },
        ),
        ("frame", Attribute::Int(config.frame as i32)),
        ("samplesPerPixel", Attribute::Int(config.spp as i32)),
        ("maxDepth", Attribute::Int(config.max_depth as i32)),
        ("rays", Attribute::Double(stats.rays.total() as f64)),
        ("worldToCamera", Attribute::Matrix(world_to_camera(camera))),
    ];
    if let Some(matrix) = world_to_ndc(camera, config.aspect()) {
        all.push(("worldToNDC", Attribute::Matrix(matrix)));
    }
    if let Some(mean) = mean_samples {
        all.push(("meanSamplesPerPixel", Attribute::Float(mean as f32)));
    }
    if let Some([mse, noise]) = errors.map(SquaredErrors::told) {
        all.push(("MSE", Attribute::Float(mse)));
        all.push(("noise", Attribute::Float(noise)));
    }
    if told == Told::All {
        let seconds = stats.seconds("render");
        all.push(("renderTimeSeconds", Attribute::Float(seconds as f32)));
        all.push(("threads", Attribute::Int(stats.plan.threads as i32)));
    }
    let named = all.into_iter();
    named
        .map(|(name, value)| (name.to_string(), value))
        .collect()
}

/// The squared errors of pixels as their variance tells them, in channels of colour.
#[derive(Clone, Copy, Debug, Default)]
pub struct SquaredErrors {
    sum: f64,
    count: usize,
}

impl SquaredErrors {
    /// Sums up those of a picture, if it has its variance.
    pub fn of(picture: &Picture) -> Option<SquaredErrors> {
        let mut errors = SquaredErrors::default();
        picture.variance.as_ref()?;
        errors.add(picture);
        Some(errors)
    }

    /// Adds those of pixels that follow in the picture.
    pub fn add(&mut self, picture: &Picture) {
        let variance = picture.variance.iter().flatten().flatten();
        for v in variance {
            self.sum += f64::from(*v);
            self.count += 1;
        }
    }

    /// Returns their mean, and its root.
    pub fn told(self) -> [f32; 2] {
        let mse = self.sum / self.count.max(1) as f64;
        [mse as f32, mse.sqrt() as f32]
    }
}

/// Returns the number of rays that is told of a picture.
pub fn rays(metadata: &Metadata) -> f64 {
    let rays = metadata.iter().find_map(|(name, value)| match value {
        Attribute::Double(rays) if name == "rays" => Some(*rays),
        _ => None,
    });
    rays.unwrap_or(0.0)
}

/// Completes what the first tile of a picture tells of it by what all tiles do.
pub fn complete(picture: &mut Picture, rays: f64) {
    let errors = SquaredErrors::of(picture).map(SquaredErrors::told);
    for (name, value) in &mut picture.metadata {
        match (&name[..], errors) {
            ("rays", _) => *value = Attribute::Double(rays),
            ("MSE", Some([mse, _])) => *value = Attribute::Float(mse),
            ("noise", Some([_, noise])) => *value = Attribute::Float(noise),
            _ => {}
        }
    }
}

/// Names an integrator.
pub fn integrator(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::Direct => "direct",
        Integrator::Path => "path",
        Integrator::Ao => "ao",
        Integrator::Inspect(_) => "inspection",
    }
}

/// Returns the matrix to the camera's space as OpenEXR has it: left-handed, x to the right, y up, z
/// forward.
fn world_to_camera(camera: &Camera) -> [f32; 16] {
    to_camera(camera).map(|x| x as f32)
}

fn to_camera(camera: &Camera) -> [f64; 16] {
    let axes = [camera.right, camera.up, camera.forward];
    std::array::from_fn(|i| {
        let (row, column) = (i / 4, i % 4);
        match (row, column) {
            (3, 3) => 1.0,
            (_, 3) => 0.0,
            (3, _) => -camera.eye.dot(axes[column]),
            _ => axes[column][row],
        }
    })
}

/// Returns the matrix to the picture as OpenEXR has it: (0, 0) is its left upper corner, (1, 1) the
/// right lower one; z is to be ignored. Only pinholes without distortion and parallel views have one.
fn world_to_ndc(camera: &Camera, aspect: f64) -> Option<[f32; 16]> {
    let (half_height, deep) = match camera.projection {
        Projection::Perspective { half_height } => (half_height, true),
        Projection::Orthographic { half_height } => (half_height, false),
        Projection::Calibrated(_) | Projection::Panorama | Projection::Fisheye { .. } => {
            return None;
        }
    };
    let (x, y) = (0.5 / (half_height * aspect), -0.5 / half_height);
    #[rustfmt::skip]
    let project = match deep {
        true => [
            x,   0.0,  0.0, 0.0,
            0.0, y,    0.0, 0.0,
            0.5, 0.5,  1.0, 1.0,
            0.0, 0.0, -1.0, 0.0,
        ],
        false => [
            x,   0.0, 0.0, 0.0,
            0.0, y,   0.0, 0.0,
            0.0, 0.0, 1.0, 0.0,
            0.5, 0.5, 0.0, 1.0,
        ],
    };
    let first = to_camera(camera);
    Some(std::array::from_fn(|i| {
        let (row, column) = (i / 4, i % 4);
        let sum: f64 = (0..4)
            .map(|k| first[4 * row + k] * project[4 * k + column])
            .sum();
        sum as f32
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn to(point: DVec3, m: &[f32; 16]) -> [f64; 3] {
        let row = [point.x, point.y, point.z, 1.0];
        let at =
            |column: usize| -> f64 { (0..4).map(|k| row[k] * f64::from(m[4 * k + column])).sum() };
        [0, 1, 2].map(|column| at(column) / at(3))
    }

    fn near(a: [f64; 3], b: [f64; 2]) {
        assert!(
            (a[0] - b[0]).abs() < 1e-5 && (a[1] - b[1]).abs() < 1e-5,
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn matrices_take_corners_to_corners() {
        let (eye, at) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-2.0, 0.5, -1.0));
        let aspect = 1.5;
        for camera in [
            Camera::perspective(eye, at, DVec3::Y, 40.0),
            Camera::orthographic(eye, at, DVec3::Y, 3.0),
        ] {
            let m = world_to_camera(&camera);
            assert!(to(eye, &m).iter().all(|x| x.abs() < 1e-5));
            let ahead = to(eye + camera.forward * 2.0 + camera.up, &m);
            assert!((ahead[2] - 2.0).abs() < 1e-5 && (ahead[1] - 1.0).abs() < 1e-5);
            let ndc = world_to_ndc(&camera, aspect).unwrap();
            for depth in [1.0, 7.0] {
                let (half, wide) = match camera.projection {
                    Projection::Perspective { half_height } => (half_height * depth, depth),
                    Projection::Orthographic { half_height } => (half_height, depth),
                    _ => unreachable!("only these two are made"),
                };
                let ahead = eye + camera.forward * wide;
                near(to(ahead, &ndc), [0.5, 0.5]);
                let corner = ahead - camera.right * half * aspect + camera.up * half;
                near(to(corner, &ndc), [0.0, 0.0]);
            }
        }
    }
}
