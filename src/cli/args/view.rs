//! Options that choose from where a scene is seen.

use super::values::{parse_offset, parse_positive};
use crate::scene::{Projection, StandardView};
use clap::Args;
use glam::DVec3;

#[derive(Args, Clone, Default)]
pub struct ViewArgs {
    /// Name of a camera or of its node, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Look from the front, back, left, right, top, bottom or iso at the whole scene, by
    /// parallel rays, whatever cameras it has
    #[arg(long, value_name = "SIDE", conflicts_with = "camera", value_parser = parse_view)]
    pub view: Option<StandardView>,
    /// Move the camera along its direction until it frames the whole scene
    #[arg(long)]
    pub fit: bool,
    /// Place the camera here; it keeps the projection and lens of --camera, or has the default
    /// view's
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "look_at", conflicts_with = "view", value_parser = parse_offset)]
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
        perspective.or(parallel)
    }

    /// Says whether the scene's own cameras are replaced.
    pub fn replaces_cameras(&self) -> bool {
        self.view.is_some() || self.fit || self.eye.is_some()
    }
}

fn parse_angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x < 180.0 => Ok(x),
        _ => Err("write an angle between 0 and 180".into()),
    }
}

fn parse_view(text: &str) -> Result<StandardView, String> {
    let found = StandardView::ALL.iter().find(|(name, _)| *name == text);
    found
        .map(|(_, view)| *view)
        .ok_or_else(|| "expected front, back, left, right, top, bottom or iso".to_owned())
}
