//! Loads a scene and selects its camera and names, for all commands.

use super::args::{STDIN, ViewArgs};
use super::error::CliError;
use super::output;
use glam::DVec3;
use lanecast_io::LoadError;
use lanecast_io::{self as io, Curves, Given, LoadOptions};
use lanecast_model::scene::{
    Camera, Cameras, Instances, Lens, Outlook, Projection, Scene, ShapeId, UnknownCamera,
};
use lanecast_picture::render::RenderConfig;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;

/// The most bytes that are read from standard input: a stream may never end.
const MOST_BYTES: u64 = 1 << 30;

/// Loads a scene, from standard input if it is [`STDIN`]; reports on standard error what could not be
/// imported.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, CliError> {
    let loaded = match path == Path::new(STDIN) {
        true => {
            let given = options.given.clone().unwrap_or_default();
            let bytes = Some(standard_input()?);
            let options = LoadOptions {
                given: Some(Given { bytes, ..given }),
                ..options.clone()
            };
            io::load(path, &options)?
        }
        false => io::load(path, options)?,
    };
    if let Some(warning) = loaded.warning {
        output::complain(&format!("warning: {}: {warning}", path.display()));
    }
    warn_of_idle_options(path, options);
    Ok(loaded.scene)
}

/// Warns of options of reading files that no file of this format heeds.
fn warn_of_idle_options(path: &Path, options: &LoadOptions) {
    let given = options.given.as_ref().and_then(|given| given.format);
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let Some(format) = given.map(str::to_owned).or(ending) else {
        return;
    };
    // Files of the native format may place any others.
    let mut formats = vec![format];
    if ["toml", "json"].contains(&&formats[0][..]) {
        let placed = options.reads.files();
        let endings = placed.iter().filter_map(|file| file.extension());
        formats.extend(endings.map(|e| e.to_string_lossy().to_lowercase()));
    }
    let idle = |is_given: bool, heed: &[&str]| {
        is_given && !formats.iter().any(|format| heed.contains(&&format[..]))
    };
    let facets = options.scad_curves != Curves::default();
    for (name, is_idle, what) in [
        (
            "--point-radius",
            idle(
                options.point_radius.is_some(),
                &["gltf", "glb", "ply", "obj"],
            ),
            "points and lines of .gltf, .glb, .ply and .obj files",
        ),
        (
            "--scad-curves",
            idle(facets, &["scad", "csg"]),
            "curves of .scad and .csg files",
        ),
    ] {
        if is_idle {
            output::complain(&format!(
                "warning: {}: {name} is of {what}, and changes nothing here",
                path.display()
            ));
        }
    }
}

/// Reads standard input to its end.
fn standard_input() -> Result<Arc<[u8]>, LoadError> {
    let failed = |source| LoadError::Read {
        path: STDIN.into(),
        source,
    };
    let mut bytes = Vec::new();
    let mut input = std::io::stdin().lock().take(MOST_BYTES + 1);
    input.read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MOST_BYTES {
        let message = format!("it has more than {MOST_BYTES} bytes; name a file");
        return Err(failed(std::io::Error::new(
            ErrorKind::FileTooLarge,
            message,
        )));
    }
    Ok(bytes.into())
}

/// Returns the row of the camera that `--camera` names; without the option the first
/// one, or `None` if the scene has no camera. A name takes precedence over a number.
pub fn pick_camera(cameras: &Cameras, asked: Option<&str>) -> Result<Option<usize>, CliError> {
    let unknown = |e: UnknownCamera| CliError::Usage(e.to_string());
    cameras.pick(asked).map_err(unknown)
}

/// Replaces the scene's cameras by the one that `--view`, `--orbit`, `--fit`, `--eye` or `--pose` asks for, if
/// any, and returns the configuration that sees it. Errors name the file `path`.
pub fn viewed(
    scene: Scene,
    config: RenderConfig,
    args: &ViewArgs,
    path: &Path,
) -> Result<(Scene, RenderConfig), CliError> {
    let scene = viewed_at(scene, config.aspect(), args, path)?;
    let camera = match args.replaces_cameras() {
        true => None,
        false => config.camera.clone(),
    };
    Ok((scene, RenderConfig { camera, ..config }))
}

/// Replaces cameras as [`viewed`] does, for a picture of this width over height.
pub fn viewed_at(
    scene: Scene,
    aspect: f64,
    args: &ViewArgs,
    path: &Path,
) -> Result<Scene, CliError> {
    let placed = match (args.pose, args.eye, args.look_at) {
        (Some(pose), ..) => Some(posed(&scene, pose, args)?),
        (_, Some(eye), Some(look_at)) => Some(placed(&scene, (eye, look_at), args)?),
        _ => None,
    };
    let asked = args.orbit.or(args.view.map(|view| view.outlook()));
    let outlook = match (asked, placed) {
        (Some(outlook), _) => outlook,
        (None, Some(camera)) if !args.fit => return Ok(scene.seen_by(camera)),
        (None, _) if !args.fit => return Ok(scene),
        (None, Some(camera)) => fitted(&camera)?,
        (None, None) => {
            let Some(row) = pick_camera(&scene.cameras, args.camera.as_deref())? else {
                // The default view frames the scene.
                return Ok(scene);
            };
            if scene.cameras.motions.of.contains(&(row as u32)) {
                return Err(CliError::Usage(
                    "--fit places one camera for all times, and this one moves; leave it out, or \
                     name another with --camera"
                        .into(),
                ));
            }
            fitted(&scene.cameras.rows[row])?
        }
    };
    let instances = Instances::of(&scene).map_err(|e| LoadError::of_scene(path, e))?;
    Ok(scene.framed(&outlook, &instances, aspect))
}

/// Returns from where a camera looks that `--fit` moves.
fn fitted(camera: &Camera) -> Result<Outlook, CliError> {
    if camera.lens.is_some() {
        output::complain("warning: --fit leaves out the camera's lens: all is sharp");
    }
    camera.outlook().ok_or_else(|| {
        CliError::Usage(
            "--fit moves pinholes and cameras of parallel rays, and this one is a panorama, a \
             fisheye or calibrated; leave it out, or name another with --camera"
                .into(),
        )
    })
}

/// Returns the projection and the lens of a camera that is placed: those asked for, else those of
/// the scene's camera, else the default view's.
fn optics(scene: &Scene, args: &ViewArgs) -> Result<(Projection, Option<Lens>), CliError> {
    let row = pick_camera(&scene.cameras, args.camera.as_deref())?;
    let own = row.map(|row| scene.cameras.rows[row]);
    Ok(match (args.projection(), own) {
        (Some(asked), _) => (asked, None),
        (None, Some(own)) => (own.projection, own.lens),
        (None, None) => (Outlook::default().projection, None),
    })
}

/// Returns the camera of `--pose`.
fn posed(scene: &Scene, pose: [[f64; 4]; 3], args: &ViewArgs) -> Result<Camera, CliError> {
    let (projection, lens) = optics(scene, args)?;
    match Camera::at_pose(pose, projection) {
        Some(camera) => Ok(Camera { lens, ..camera }),
        None => Err(CliError::Usage("--pose is no rotation".into())),
    }
}

/// Returns the camera of `--eye`.
fn placed(
    scene: &Scene,
    (eye, look_at): (DVec3, DVec3),
    args: &ViewArgs,
) -> Result<Camera, CliError> {
    let (projection, lens) = optics(scene, args)?;
    let up = args.up.unwrap_or(DVec3::Y);
    let camera = Camera {
        lens,
        ..Camera::looking_at(eye, look_at, up, projection)
    };
    let axes = [camera.right, camera.up, camera.forward];
    match axes.iter().all(|axis| axis.is_finite()) {
        true => Ok(camera),
        false => Err(CliError::Usage(
            "--eye and --look-at are one point, or --up is 0,0,0; move one of them".into(),
        )),
    }
}

/// Returns a shape's name, or its kind.
pub fn shape_name(scene: &Scene, id: ShapeId) -> String {
    match scene.shapes.names.get(id.0) {
        Some(name) => name.into(),
        None => scene.shapes.row(id).kind_name().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_by_name_and_number() {
        let mut cameras = Cameras::default();
        assert_eq!(pick_camera(&cameras, None).unwrap(), None);
        assert!(pick_camera(&cameras, Some("0")).is_err());
        let camera = Camera::perspective(DVec3::Z, DVec3::ZERO, DVec3::Y, 40.0);
        cameras.rows = vec![camera; 3];
        cameras.names.set(1, "top");
        cameras.names.set(2, "0");
        let pick = |asked| pick_camera(&cameras, asked);
        assert_eq!(pick(None).unwrap(), Some(0));
        assert_eq!(pick(Some("top")).unwrap(), Some(1));
        assert_eq!(pick(Some("1")).unwrap(), Some(1));
        assert_eq!(pick(Some("0")).unwrap(), Some(2));
        for none in ["3", "-1", "side", ""] {
            let error = pick(Some(none)).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(
                error.to_string().contains("number 0, 'top', '0'"),
                "{error}"
            );
        }
    }
}
