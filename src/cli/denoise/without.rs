//! What stands for the denoiser in programs that are built without it.

use super::Images;
use lanecast_model::scene::Rgb;

/// There is none.
pub enum Library {}

impl Library {
    /// Says how to get a program that has it.
    pub fn load() -> Result<Library, String> {
        Err(
            "this program is built without a denoiser; build it with --features denoise, or leave \
             out --denoise"
                .into(),
        )
    }

    pub fn filter(
        &self,
        images: &Images,
        _threads: Option<u32>,
    ) -> Result<([Vec<Rgb>; 2], String), String> {
        let _ = (images.width, images.height, images.color);
        let _ = (images.albedo, images.normal, images.shine);
        match *self {}
    }
}
