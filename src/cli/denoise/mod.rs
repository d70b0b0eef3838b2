//! `render --denoise`: a second picture beside the first, freed of its noise by Open Image Denoise.
//!
//! The first keeps its bits; those of the second depend on the library and the machine, so its file
//! says that it is denoised. Albedo and normals guide the filter, and are filtered themselves
//! before: they are noisy, too, behind lenses, shutters and rough glass. What is seen to shine is many
//! times brighter than what it lights, and its light would be smeared over that, so it is taken out
//! before and put back after; its only noise is at its edges, and goes by the filter of albedos.

#[cfg(feature = "denoise")]
mod oidn;
#[cfg(not(feature = "denoise"))]
mod without;

#[cfg(not(feature = "denoise"))]
use without as oidn;

use super::error::CliError;
use super::output::with_name_end;
use lanecast_io::{AovSet, Attribute, Picture};
use lanecast_measure::Denoised;
use lanecast_model::scene::Rgb;
use lanecast_picture::render::{Integrator, RenderConfig};
use std::path::{Path, PathBuf};

/// What filtering needs of a picture.
const NEEDED: [&str; 3] = ["denoising_albedo", "denoising_normal", "emission"];

/// The library, loaded.
pub struct Denoiser(oidn::Library);

/// The images of a picture, row by row, for a filter.
struct Images<'p> {
    width: u32,
    height: u32,
    /// Radiance, at least 0.
    color: &'p [Rgb],
    albedo: &'p [Rgb],
    normal: &'p [Rgb],
    /// What is seen to shine, from 0 to 1.
    shine: &'p [Rgb],
}

impl Denoiser {
    /// Loads the library if a denoised picture is asked for. Fails with the remedy if the program
    /// is built without it, or it is not there.
    pub fn load(is_asked: bool) -> Result<Option<Denoiser>, CliError> {
        match is_asked {
            true => oidn::Library::load()
                .map(|library| Some(Denoiser(library)))
                .map_err(CliError::Usage),
            false => Ok(None),
        }
    }

    /// Loads the library where the program has a use for it and it is there.
    pub fn if_there() -> Option<Denoiser> {
        oidn::Library::load().ok().map(Denoiser)
    }

    /// Returns the configuration of a picture that is rendered together with what filtering needs.
    /// Refuses pictures without paths.
    pub fn rendered(&self, config: RenderConfig) -> Result<RenderConfig, CliError> {
        if config.integrator != Integrator::Path {
            return Err(CliError::Usage(
                "--denoise is for pictures of paths, and this one is not; leave it out, or ask for \
                 --integrator path"
                    .into(),
            ));
        }
        let aovs = config.aovs.with(&NEEDED);
        Ok(RenderConfig { aovs, ..config })
    }

    /// Takes what was rendered for the filter alone out of a picture that was asked for with
    /// `asked`, and returns the filtered picture: colour and alpha.
    pub fn filter(
        &self,
        picture: &mut Picture,
        asked: &AovSet,
        threads: Option<u32>,
    ) -> Result<(Picture, Denoised), CliError> {
        let [albedo, normal, emission] = NEEDED.map(|name| taken(picture, asked, name));
        let less = |(color, shines): (&Rgb, &Rgb)| -> Rgb {
            std::array::from_fn(|k| (color[k] - shines[k]).max(0.0))
        };
        let scattered: Vec<Rgb> = picture.color.iter().zip(&emission).map(less).collect();
        let brightest = emission
            .as_flattened()
            .iter()
            .fold(0.0, |a, b| f32::max(a, *b));
        let unit = match brightest > 0.0 {
            true => brightest,
            false => 1.0,
        };
        let shine: Vec<Rgb> = emission
            .iter()
            .map(|e| e.map(|c| (c / unit).max(0.0)))
            .collect();
        let images = Images {
            width: picture.width,
            height: picture.height,
            color: &scattered,
            albedo: &albedo,
            normal: &normal,
            shine: &shine,
        };
        let (filtered, version) = self.0.filter(&images, threads).map_err(|message| {
            CliError::Usage(format!(
                "Open Image Denoise: {message}; leave out --denoise, or set OIDN_DIR to another \
                 version of the library"
            ))
        })?;
        let [scattered, shine] = filtered;
        let rows = scattered.iter().zip(&shine);
        let color = rows.map(|(scattered, shine)| {
            std::array::from_fn(|k| (scattered[k] + shine[k] * unit).max(0.0))
        });
        let library = format!("Open Image Denoise {version}");
        let mut metadata = picture.metadata.clone();
        // Noise is the other picture's.
        metadata.retain(|(name, _)| name != "MSE" && name != "noise");
        let label = format!("{library}; its bits depend on the machine");
        metadata.push(("denoised".into(), Attribute::Text(label)));
        let filtered = Picture {
            width: picture.width,
            height: picture.height,
            color: color.collect(),
            alpha: picture.alpha.clone(),
            metadata,
            ..Picture::default()
        };
        Ok((
            filtered,
            Denoised {
                library,
                has_equal_bits: false,
            },
        ))
    }
}

/// Returns a layer of a picture, which keeps it if it was asked for; black if there is none.
fn taken(picture: &mut Picture, asked: &AovSet, name: &str) -> Vec<Rgb> {
    let mut with = *asked;
    with.add(name);
    let place = picture.layers.iter().position(|layer| layer.name == name);
    match place {
        Some(place) if with == *asked => picture.layers[place].color.clone(),
        Some(place) => picture.layers.remove(place).color,
        None => vec![[0.0; 3]; picture.color.len()],
    }
}

/// Returns the name of the denoised picture beside another: `name.exr` has `name.denoised.exr`.
pub fn beside(path: &Path) -> PathBuf {
    with_name_end(path, ".denoised")
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_io::Layer;

    #[test]
    fn denoised_pictures_lie_beside() {
        assert_eq!(
            beside("a/b.c.exr".as_ref()),
            Path::new("a/b.c.denoised.exr")
        );
        assert_eq!(beside("x".as_ref()), Path::new("x.denoised"));
    }

    #[test]
    fn a_picture_keeps_only_what_it_was_asked_for() {
        let layer = |name: &str| Layer {
            name: name.into(),
            color: vec![[1.0; 3]],
        };
        let mut picture = Picture {
            color: vec![[2.0; 3]],
            layers: vec![
                layer("emission"),
                layer("light_a"),
                layer("denoising_albedo"),
            ],
            ..Picture::default()
        };
        let mut asked = AovSet::NONE;
        asked.add("emission");
        asked.add("light_groups");
        for (name, value) in [
            ("emission", 1.0),
            ("denoising_albedo", 1.0),
            ("denoising_normal", 0.0),
        ] {
            assert_eq!(taken(&mut picture, &asked, name), [[value; 3]], "{name}");
        }
        assert_eq!(picture.layers, [layer("emission"), layer("light_a")]);
    }
}
