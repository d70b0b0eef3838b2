//! Options of how a picture becomes a PNG file.

use super::CliError;
use super::values::{parse_bits, parse_dither, parse_exposure, parse_view_transform};
use clap::Args;
use lanecast_io::{Bits, Development, Tone};
use lanecast_picture::render::{Backdrop, Integrator, RenderConfig};
use std::path::Path;

/// Options of PNG and JPEG files; OpenEXR and HDR files stay linear.
#[derive(Args)]
pub struct DevelopmentArgs {
    /// View transform of PNG and JPEG files, from radiance to what a screen shows: none, neutral (Khronos PBR Neutral), agx or aces
    /// [default: neutral for paths, else none]
    #[arg(long, alias = "tone", value_name = "CURVE", value_parser = parse_view_transform)]
    pub view_transform: Option<Tone>,
    /// Multiply the radiance in PNG and JPEG files by 2^STOPS
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = parse_exposure)]
    pub exposure: Option<f64>,
    /// Dither PNG and JPEG files, so that slow ramps show no bands: on or off
    /// [default: on for paths, else off]
    #[arg(long, value_name = "USE", value_parser = parse_dither)]
    pub dither: Option<bool>,
    /// Bits of a channel in PNG files: 8 or 16 [default: 8]
    #[arg(long, value_name = "N", value_parser = parse_bits)]
    pub bits: Option<Bits>,
}

impl DevelopmentArgs {
    /// Replaces what was not asked for where it is paths that the picture was traced by: its
    /// radiance has no upper end, and its gradients are slow.
    pub fn of_radiance(&self, development: Development) -> Development {
        Development {
            tone: self.view_transform.unwrap_or(Tone::Neutral),
            dither: self.dither.unwrap_or(true),
            ..development
        }
    }

    /// Completes the development of a picture whose integrator is known.
    ///
    /// A backdrop that was named is laid under the finished picture, which is traced with alpha,
    /// where a view transform or an exposure would make another colour of it.
    pub fn complete(
        &self,
        development: Development,
        path: &Path,
        config: RenderConfig,
    ) -> (Development, RenderConfig) {
        let development = match config.integrator {
            Integrator::Path => self.of_radiance(development),
            _ => development,
        };
        let shown_as_is = development.tone == Tone::None && development.exposure == 0.0;
        match config.backdrop {
            Backdrop::Color(color) if !shown_as_is && !is_linear(path) => (
                Development {
                    behind: Some(color),
                    ..development
                },
                RenderConfig {
                    backdrop: Backdrop::Transparent,
                    ..config
                },
            ),
            _ => (development, config),
        }
    }

    /// Replaces what is asked for in the development that the tiles of a picture have.
    pub fn over(&self, of_tiles: Development) -> Development {
        Development {
            tone: self.view_transform.unwrap_or(of_tiles.tone),
            exposure: self.exposure.unwrap_or(of_tiles.exposure),
            dither: self.dither.unwrap_or(of_tiles.dither),
            bits: self.bits.unwrap_or(of_tiles.bits),
            behind: None,
        }
    }

    /// Returns the development of the picture `path`; refuses options that it would not heed.
    pub fn checked(&self, path: &Path) -> Result<Development, CliError> {
        let is_linear = is_linear(path);
        if self.bits == Some(Bits::Sixteen) && ends(path, &["jpg", "jpeg"]) {
            return Err(CliError::Usage(
                "JPEG has 8 bits a channel; leave --bits out, or name a .png".into(),
            ));
        }
        let given = [
            ("--view-transform", self.view_transform.is_some()),
            ("--exposure", self.exposure.is_some()),
            ("--dither", self.dither.is_some()),
            ("--bits", self.bits.is_some()),
        ];
        if let (true, Some((name, _))) = (is_linear, given.iter().find(|(_, is)| *is)) {
            let files = if *name == "--bits" {
                "PNG"
            } else {
                "PNG and JPEG"
            };
            return Err(CliError::Usage(format!(
                "{name} is for {files} files; OpenEXR and HDR files are linear: leave it out, \
                 or name a .png"
            )));
        }
        let default = Development::default();
        Ok(Development {
            tone: self.view_transform.unwrap_or(default.tone),
            exposure: self.exposure.unwrap_or(default.exposure),
            dither: self.dither.unwrap_or(default.dither),
            bits: self.bits.unwrap_or(default.bits),
            behind: None,
        })
    }
}

/// Says whether a picture's file holds linear radiance.
fn is_linear(path: &Path) -> bool {
    ends(path, &["exr", "hdr"])
}

/// Says whether a file's name has one of some endings.
fn ends(path: &Path, known: &[&str]) -> bool {
    let is = |e: &std::ffi::OsStr| known.iter().any(|k| e.eq_ignore_ascii_case(k));
    path.extension().is_some_and(is)
}
