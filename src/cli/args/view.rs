//! Options that choose from where a scene is seen.

use super::values::parse_size;
use super::values::{parse_offset, parse_positive};
use clap::Args;
use glam::DVec3;
use lanecast_model::scene::{Calibration, Camera, Outlook, Projection, StandardView};

#[derive(Args, Clone, Default)]
pub struct ViewArgs {
    /// Name of a camera or of its node, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Look from the front, back, left, right, top, bottom or iso at the whole scene, by
    /// parallel rays, whatever cameras it has
    #[arg(long, value_name = "SIDE", conflicts_with = "camera", value_parser = parse_view)]
    pub view: Option<StandardView>,
    /// Look at the whole scene from AZIMUTH degrees to the right of the front and ELEVATION degrees
    /// above the horizon, in perspective, whatever cameras it has; FOV_Y is the angle of the
    /// picture's height [default: of the default view]
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,FOV_Y]", conflicts_with_all = ["camera", "view"], allow_hyphen_values = true, value_parser = parse_orbit)]
    pub orbit: Option<Outlook>,
    /// Move the camera along its direction until it frames the whole scene
    #[arg(long)]
    pub fit: bool,
    /// Place the camera here; it keeps the projection and lens of --camera, or has the default
    /// view's
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "look_at", conflicts_with_all = ["view", "orbit"], value_parser = parse_offset)]
    pub eye: Option<DVec3>,
    /// The point that the camera of --eye looks at
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "eye", value_parser = parse_offset)]
    pub look_at: Option<DVec3>,
    /// What is up for the camera of --eye [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "eye", value_parser = parse_offset)]
    pub up: Option<DVec3>,
    /// See so many degrees from bottom to top from --eye, through a pinhole
    #[arg(long, value_name = "DEGREES", requires = "eye", conflicts_with = "orthographic", value_parser = parse_angle)]
    pub fov_y: Option<f64>,
    /// See by parallel rays from --eye, in a picture of this height in world units
    #[arg(long, value_name = "HEIGHT", requires = "eye", value_parser = parse_positive)]
    pub orthographic: Option<f64>,
    /// Place the camera by world_from_camera: three rows of a rotation and the eye, 12 numbers, of
    /// axes as OpenCV's: x to the right, y down, z ahead; it keeps the projection and lens of
    /// --camera, or has that of --k
    #[arg(long, value_name = "ROWS", allow_hyphen_values = true, conflicts_with_all = ["view", "orbit", "eye", "fit"], value_parser = parse_pose)]
    pub pose: Option<[[f64; 4]; 3]>,
    /// The pinhole of --pose as OpenCV measures it: focal lengths and the pixel on the axis, the
    /// first pixel's centre at 0,0, of pictures of W by H, and perhaps distortion
    #[arg(long, value_name = "FX,FY,CX,CY,W,H[,K1,K2,P1,P2[,K3]]", allow_hyphen_values = true, requires = "pose", value_parser = parse_calibration)]
    pub k: Option<Calibration>,
}

impl ViewArgs {
    /// Returns the projection that is asked for by itself.
    pub fn projection(&self) -> Option<Projection> {
        let perspective = self.fov_y.map(|degrees| Projection::Perspective {
            half_height: libm::tan(degrees.to_radians() * 0.5),
        });
        let parallel = self.orthographic.map(|height| Projection::Orthographic {
            half_height: height * 0.5,
        });
        let measured = self.k.map(Projection::Calibrated);
        measured.or(perspective).or(parallel)
    }

    /// Says whether the scene's own cameras are replaced.
    pub fn replaces_cameras(&self) -> bool {
        let is_placed = self.eye.is_some() || self.pose.is_some();
        self.view.is_some() || self.orbit.is_some() || self.fit || is_placed
    }
}

fn parse_angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x < 180.0 => Ok(x),
        _ => Err("write an angle between 0 and 180".into()),
    }
}

/// Returns the outlook from a direction in degrees, if there is one.
fn orbit(azimuth: f64, elevation: f64, fov_y: Option<f64>) -> Option<Outlook> {
    let is_angle = azimuth.is_finite() && (-90.0..=90.0).contains(&elevation);
    let (sin, cos) = libm::sincos(azimuth.to_radians());
    let (up, out) = libm::sincos(elevation.to_radians());
    let projection = match fov_y {
        None => Outlook::default().projection,
        Some(fov) if fov > 0.0 && fov < 180.0 => Projection::Perspective {
            half_height: libm::tan(fov.to_radians() * 0.5),
        },
        Some(_) => return None,
    };
    is_angle.then_some(Outlook {
        towards_eye: DVec3::new(sin * out, up, cos * out),
        // From a pole up is where the view came from: never along the view.
        up: match elevation.abs() == 90.0 {
            true => DVec3::new(-sin, 0.0, -cos) * elevation.signum(),
            false => DVec3::Y,
        },
        projection,
    })
}

fn parse_orbit(text: &str) -> Result<Outlook, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    let outlook = match numbers.as_deref() {
        Some([azimuth, elevation]) => orbit(*azimuth, *elevation, None),
        Some([azimuth, elevation, fov]) => orbit(*azimuth, *elevation, Some(*fov)),
        _ => None,
    };
    outlook.ok_or_else(|| {
        "expected an azimuth, an elevation from -90 to 90 and perhaps an angle of view above 0 and \
         below 180, in degrees, such as 30,20 or 30,20,35"
            .to_owned()
    })
}

/// Reads numbers that are finite, separated by commas.
fn finite(text: &str) -> Option<Vec<f64>> {
    let number = |x: &str| x.trim().parse().ok().filter(|x: &f64| x.is_finite());
    text.split(',').map(number).collect()
}

fn parse_pose(text: &str) -> Result<[[f64; 4]; 3], String> {
    let numbers = finite(text).filter(|numbers| numbers.len() == 12);
    let numbers = numbers.ok_or("write 12 finite numbers, three rows of four")?;
    let rows = [0, 1, 2].map(|row| std::array::from_fn(|column| numbers[4 * row + column]));
    match Camera::at_pose(rows, Outlook::default().projection) {
        Some(_) => Ok(rows),
        None => Err(
            "the first three columns are no rotation within 0.001; write \
                     world_from_camera without a scale"
                .into(),
        ),
    }
}

fn parse_calibration(text: &str) -> Result<Calibration, String> {
    let numbers = finite(text).filter(|numbers| matches!(numbers.len(), 6 | 10 | 11));
    let numbers = numbers.ok_or(
        "write FX,FY,CX,CY,W,H, and perhaps K1,K2,P1,P2 or K1,K2,P1,P2,K3, as finite numbers",
    )?;
    let size = parse_size(&format!("{}x{}", numbers[4], numbers[5]))?;
    if numbers[0] <= 0.0 || numbers[1] <= 0.0 {
        return Err("focal lengths are above 0".into());
    }
    let distortion = std::array::from_fn(|i| numbers.get(6 + i).copied().unwrap_or(0.0));
    Ok(Calibration {
        focal: [numbers[0], numbers[1]],
        center: [numbers[2], numbers[3]],
        size: [size.width, size.height],
        distortion,
    })
}

fn parse_view(text: &str) -> Result<StandardView, String> {
    let found = StandardView::ALL.iter().find(|(name, _)| *name == text);
    found
        .map(|(_, view)| *view)
        .ok_or_else(|| "expected front, back, left, right, top, bottom or iso".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_cameras_are_read_and_wrong_ones_refused() {
        let rows = parse_pose("1,0,0,5, 0,-1,0,6, 0,0,-1,7").unwrap();
        assert_eq!(rows[2], [0.0, 0.0, -1.0, 7.0]);
        for wrong in [
            "",
            "1,0,0,5",
            "2,0,0,5,0,2,0,6,0,0,2,7",
            "1,0,0,5,0,1,0,6,0,0,-1,7",
            "1,0,0,nan,0,1,0,6,0,0,1,7",
        ] {
            assert!(parse_pose(wrong).is_err(), "{wrong}");
        }
        let k = parse_calibration("500,501,319.5,239.5,640,480,0.1,-0.2,1e-3,0").unwrap();
        assert_eq!((k.focal, k.size), ([500.0, 501.0], [640, 480]));
        assert_eq!(k.distortion, [0.1, -0.2, 1e-3, 0.0, 0.0]);
        for wrong in [
            "",
            "1,1,0,0",
            "0,1,0,0,9,9",
            "1,1,0,0,0,9",
            "1,1,0,0,9.5,9",
            "1,1,0,0,9,9,1",
        ] {
            assert!(parse_calibration(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_round_begins_at_the_front_and_goes_to_the_right() {
        let eye = |text: &str| parse_orbit(text).unwrap().towards_eye;
        assert_eq!(eye("0,0"), StandardView::Front.outlook().towards_eye);
        let right = StandardView::Right.outlook().towards_eye;
        assert!(eye("90, 0").distance(right) < 1e-15);
        assert!(eye("-90,0").distance(-right) < 1e-15);
        let top = parse_orbit("180,90").unwrap();
        assert!(top.towards_eye.distance(DVec3::Y) < 1e-15);
        // From above, the back of the scene is at the bottom, as one comes from there.
        assert!(top.up.distance(DVec3::Z) < 1e-15);
        let bottom = parse_orbit("0,-90").unwrap();
        assert!(bottom.up.distance(DVec3::Z) < 1e-15);
        let wide = parse_orbit("0,0,90").unwrap().projection;
        let Projection::Perspective { half_height } = wide else {
            panic!("{wide:?}");
        };
        assert!((half_height - 1.0).abs() < 1e-15);
        for wrong in [
            "", "1", "1,91", "1,2,0", "1,2,180", "inf,0", "a,b", "1,2,3,4",
        ] {
            assert!(parse_orbit(wrong).is_err(), "{wrong}");
        }
    }
}
