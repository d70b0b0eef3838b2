//! Options of what a picture keeps beside its colour.

use super::tile::TileChoice;
use super::values::one_of;
use crate::error::CliError;
use clap::{Args, value_parser};
use lanecast_io::AovSet;
use lanecast_picture::render::{Integrator, RenderConfig};

#[derive(Args)]
pub struct OutputArgs {
    /// Additional outputs, separated by commas. Of what the pixel's centre shows: depth (along the
    /// view axis), distance, position, normal, geometric_normal, camera_normal, uv (texture
    /// coordinates, of triangles barycentric),
    /// albedo, instance_id, primitive_id; vector and motion (where it was and will be, as Blender and
    /// as Nuke have it). Of paths: variance; layers of light, diffuse_direct,
    /// diffuse_indirect, specular_direct, specular_indirect, emission, environment, light_groups;
    /// Cryptomattes, crypto_object, crypto_material, crypto_instance; a denoiser's guides,
    /// denoising_albedo, denoising_normal. And samples, their number; or all
    #[arg(long, value_name = "NAMES", value_parser = parse_aovs)]
    pub aov: Option<AovChoice>,
    /// Ids that each pixel of a Cryptomatte has room for [default: 6]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=32))]
    pub cryptomatte_levels: Option<u32>,
    /// What the header of an OpenEXR file tells of how the picture was made: none, fixed (what is
    /// the same in every run), all (times, too), or auto, which is all if --aov asks for more than
    /// depth, position, normal, albedo, ids and samples, else none
    #[arg(long, value_name = "WHAT", default_value = "auto", value_parser = parse_told)]
    pub metadata: Told,
    /// Render only the I-th tile of a grid of columns and rows, from 0, row by row, such as 5/4x4, or
    /// of a number of rows; lanecast merge joins all tiles to the bits of the whole
    #[arg(long, value_name = "I/CxR", value_parser = TileChoice::parse, conflicts_with_all = ["accuracy", "samples", "noise", "cache", "denoise", "display"])]
    pub tile: Option<TileChoice>,
    /// Write the picture without noise, too, as NAME.denoised beside it: of paths, by Open Image
    /// Denoise, with --features denoise of the program
    #[arg(long, conflicts_with = "samples")]
    pub denoise: bool,
    /// Show the picture in the viewer tev while it is rendered, such as one at 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["samples", "frames"])]
    pub display: Option<String>,
}

/// How much the header of a picture's file tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Told {
    /// All, if layers are asked for that came with metadata; else nothing.
    #[default]
    Auto,
    None,
    /// What is the same in every run, so that equal pictures are equal files.
    Fixed,
    /// Times, too.
    All,
}

/// The outputs of `--aov`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovChoice {
    pub named: AovSet,
    /// All that the picture can have.
    pub all: bool,
}

impl OutputArgs {
    /// Returns all outputs that may come of the arguments, before the scene is known.
    pub fn most(&self) -> AovSet {
        let choice = self.aov.unwrap_or_default();
        let mut aovs = choice.named;
        if choice.all {
            aovs.add_all(true);
        }
        aovs
    }

    /// Returns the number of ids that pixels of mattes have room for. Refuses it without mattes.
    pub fn matte_ranks(&self) -> Result<u32, CliError> {
        match self.cryptomatte_levels {
            Some(_) if !self.most().any_of_mattes() => Err(CliError::Usage(
                "--cryptomatte-levels is of Cryptomattes, and none is asked for; leave it out, or \
                 ask for one by --aov crypto_object"
                    .into(),
            )),
            ranks => Ok(ranks.unwrap_or(RenderConfig::default().matte_ranks)),
        }
    }

    /// Completes a configuration whose integrator is known by the outputs that it has. Refuses
    /// those that are named and that it has not.
    pub fn complete(&self, config: RenderConfig) -> Result<RenderConfig, CliError> {
        let choice = self.aov.unwrap_or_default();
        let mut aovs = choice.named;
        let paths = config.integrator == Integrator::Path;
        let of_paths = aovs.of_paths();
        if !paths && !of_paths.is_empty() {
            return Err(CliError::Usage(format!(
                "only paths have {}; add --integrator path, or leave it out",
                of_paths.join(", ")
            )));
        }
        // One sample has no halves.
        let halves = config.samples() > 1;
        if aovs.variance && !halves {
            return Err(CliError::Usage(
                "one sample has no variance; ask for --spp 2 or more, or leave it out".into(),
            ));
        }
        let is_cached = config.caching.is_some();
        if is_cached && aovs.light_groups {
            return Err(CliError::Usage(
                "a cache of light does not tell groups of lights apart; leave light_groups out, or \
                 --cache"
                    .into(),
            ));
        }
        if choice.all {
            aovs.add_all(paths);
            aovs.variance &= halves;
            aovs.light_groups &= !is_cached;
        }
        Ok(RenderConfig { aovs, ..config })
    }
}

fn parse_aovs(text: &str) -> Result<AovChoice, String> {
    let mut choice = AovChoice::default();
    for name in text.split(',').map(str::trim) {
        if name == "all" {
            choice.all = true;
        } else if !choice.named.add(name) {
            return Err(format!(
                "there is no output '{name}'; known are {}, all",
                AovSet::NAMES.join(", ")
            ));
        }
    }
    Ok(choice)
}

fn parse_told(text: &str) -> Result<Told, String> {
    one_of(
        text,
        &[
            ("auto", Told::Auto),
            ("none", Told::None),
            ("fixed", Told::Fixed),
            ("all", Told::All),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_aov_name_is_one() {
        let mut last = AovChoice::default();
        for name in AovSet::NAMES {
            let alone = parse_aovs(name).unwrap();
            assert!(alone.named.any() && !alone.all);
            assert_ne!(alone, last);
            last = alone;
        }
        let all = parse_aovs(&AovSet::NAMES.join(", ")).unwrap();
        assert!(all.named.depth && all.named.position && all.named.normal);
        assert!(all.named.albedo && all.named.instance_id && all.named.primitive_id);
        assert!(parse_aovs("depth,all").unwrap().all);
        assert!(parse_aovs("").is_err());
        assert!(parse_aovs("depth,").is_err());
        assert!(
            parse_aovs("deepth")
                .unwrap_err()
                .contains("known are depth,")
        );
    }
}
