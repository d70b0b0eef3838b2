//! Large pictures, rendered band by band into their OpenEXR file: each band is a window of the picture,
//! and goes to the disk when it is done, so that no picture is too large for the memory. The file has
//! the bytes that it would have with all of the picture in memory.

use super::error::CliError;
use super::memory;
use super::metadata::SquaredErrors;
use lanecast_io::{Bits, ExrBands, Outputs, Picture, SaveError};
use lanecast_picture::render::{Progress, RenderConfig, Rendered, Window};
use lanecast_picture::shade::RayCounts;
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes of a picture with its file from which on it is rendered in bands.
const LARGE: u64 = 2 << 30;
/// Bytes that a band with its file is meant to take.
const BAND: u64 = 256 << 20;

/// Returns how many rows the bands of a picture have, if it is rendered in bands; one that is looked at
/// as a whole is not. Refuses a picture that needs more memory than the system has free.
pub fn fitting(
    config: &RenderConfig,
    bits: Bits,
    path: &Path,
    is_looked_at: bool,
) -> Result<Option<u32>, CliError> {
    let rows = rows(config, bits, path, is_looked_at);
    let first = rows.and_then(|rows| windows(config, rows).next());
    let window = first.or(config.window);
    let first = RenderConfig {
        window,
        ..config.clone()
    };
    memory::check(&first, bits, path)?;
    Ok(rows)
}

fn rows(config: &RenderConfig, bits: Bits, path: &Path, is_looked_at: bool) -> Option<u32> {
    let is_exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    // What is sampled by what other pixels show needs all of the picture at once.
    let needs_all = config.window.is_some()
        || config.adaptive.is_some()
        || config.caching.is_some()
        || !config.integrator.shows_light()
        || is_looked_at;
    let all = memory::needed(config, bits, path);
    (is_exr && !needs_all && all > LARGE).then(|| {
        let steps = BAND * u64::from(config.height) / all / u64::from(Window::STEP);
        steps.max(1) as u32 * Window::STEP
    })
}

/// Lists the bands of a picture, from the top down: of `rows` rows, but for the last.
fn windows(config: &RenderConfig, rows: u32) -> impl Iterator<Item = Window> {
    let (width, height) = (config.width, config.height);
    let step = rows as usize;
    (0..height).step_by(step).map(move |y| Window {
        x: 0,
        y,
        width,
        height: rows.min(height - y),
    })
}

/// A picture whose bands are all rendered.
pub struct Banded {
    file: ExrBands,
    errors: Option<SquaredErrors>,
    /// Of each matte.
    manifests: Vec<BTreeMap<String, u32>>,
}

/// Renders a picture in bands of `rows` rows, by `band`, for the file `path`. Returns what was rendered
/// last, with the counts of all.
pub fn render(
    config: &RenderConfig,
    rows: u32,
    path: &Path,
    progress: &Progress,
    band: impl Fn(&RenderConfig) -> Result<Rendered, CliError>,
) -> Result<(Rendered, Banded), CliError> {
    let file = ExrBands::begin(path, (config.width, config.height))?;
    let mut banded = Banded {
        file,
        errors: None,
        manifests: Vec::new(),
    };
    let mut last = None;
    let mut counts = RayCounts::default();
    for window in windows(config, rows) {
        progress.divide(window.y..window.y + window.height, config.height);
        let rendered = band(&RenderConfig {
            window: Some(window),
            ..config.clone()
        })
        .inspect_err(|_| progress.divide(0..0, 0))?;
        banded.add(&rendered.picture)?;
        counts.add(&rendered.counts);
        last = Some(rendered);
    }
    progress.divide(0..0, 0);
    let last = last.ok_or_else(|| CliError::Usage("the picture has no pixels".into()))?;
    Ok((Rendered { counts, ..last }, banded))
}

impl Banded {
    fn add(&mut self, picture: &Picture) -> Result<(), SaveError> {
        self.file.add(picture)?;
        if picture.variance.is_some() {
            self.errors.get_or_insert_default().add(picture);
        }
        self.manifests
            .resize_with(picture.mattes.len(), Default::default);
        for (all, matte) in self.manifests.iter_mut().zip(&picture.mattes) {
            all.extend(matte.manifest.clone());
        }
        Ok(())
    }

    /// Returns the squared errors of all pixels, if the picture tells its variance.
    pub fn errors(&self) -> Option<SquaredErrors> {
        self.errors
    }

    /// Adds the file to `outputs`, which the caller commits. `last` is the last band, with the metadata of
    /// the whole.
    pub fn save_into(self, mut last: Picture, outputs: &mut Outputs) -> Result<(), SaveError> {
        for (matte, manifest) in last.mattes.iter_mut().zip(self.manifests) {
            matte.manifest = manifest;
        }
        self.file.save_into(&last, outputs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interrupt;
    use crate::pipeline::complete;
    use lanecast_io::{AovSet, Development};
    use lanecast_measure::{Stats, Watch};
    use lanecast_model::scene::builtin;
    use lanecast_picture::render::{Integrator, render_showing};

    #[test]
    fn bands_make_the_file_of_the_whole_picture() {
        let folder = tempfile::tempdir().unwrap();
        let mut aovs = AovSet::default();
        let all = AovSet::NAMES.iter();
        let all = all.filter(|name| !["vector", "motion"].contains(name));
        all.for_each(|name| assert!(aovs.add(name)));
        for integrator in [Integrator::Direct, Integrator::Path] {
            let config = RenderConfig {
                width: 70,
                height: 90,
                spp: 2,
                integrator,
                aovs,
                ..RenderConfig::default()
            };
            let (mut watch, mut stats) = (Watch::start(), Stats::default());
            let of = (&mut watch, &mut stats);
            let scene = builtin().unwrap();
            let prepared = complete(scene, Path::new(""), &config, of.0, of.1).unwrap();
            let progress = interrupt::watch();
            let quiet = crate::progress::Style::None;
            let [whole, banded] = ["whole.exr", "banded.exr"].map(|name| folder.path().join(name));
            let (mut outputs, mut written) = (Outputs::default(), Vec::new());
            let traced = prepared.traced((&mut watch, &mut stats), (&progress, quiet), |view| {
                let render =
                    |config: &RenderConfig| Ok(render_showing(view, config, &progress, &|_| ())?);
                let all = render(&config)?;
                let bands = super::render(&config, 32, &banded, &progress, render)?;
                Ok::<_, CliError>((all, bands))
            });
            let (all, (last, bands)) = traced.unwrap().unwrap();
            let errors = bands.errors().map(|errors| errors.told());
            assert_eq!(all.counts, last.counts);
            assert_eq!(errors, SquaredErrors::of(&all.picture).map(|e| e.told()));
            let development = Development::default();
            (all.picture)
                .save_into(&whole, &development, &mut outputs)
                .unwrap();
            bands.save_into(last.picture, &mut outputs).unwrap();
            outputs.commit().unwrap();
            for path in [&whole, &banded] {
                written.push(std::fs::read(path).unwrap());
            }
            assert!(written[0] == written[1], "{integrator:?}");
        }
    }

    #[test]
    fn large_pictures_have_bands() {
        let of_size = |width, height| RenderConfig {
            width,
            height,
            ..RenderConfig::default()
        };
        let rows = |config: &RenderConfig, name: &str, is_looked_at| {
            rows(config, Bits::Eight, Path::new(name), is_looked_at)
        };
        // 36 bytes a pixel with the file: 12 GB here, 454 rows of which have a quarter.
        let large = of_size(16_384, 16_384);
        assert_eq!(rows(&large, "x.EXR", false), Some(448));
        assert_eq!(rows(&of_size(4096, 4096), "x.exr", false), None);
        // Bands are not lower than a tile, and the last may be.
        let wide = of_size(1 << 20, 100);
        assert_eq!(rows(&wide, "x.exr", false), Some(32));
        let heights: Vec<u32> = windows(&wide, 32).map(|w| w.height).collect();
        assert_eq!(heights, [32, 32, 32, 4]);
        let medium = of_size(8192, 8192);
        assert!(rows(&medium, "x.exr", false).is_some());
        let window = windows(&medium, 32).next();
        let cut = RenderConfig {
            window,
            ..medium.clone()
        };
        let heat = Integrator::Inspect(lanecast_picture::render::Inspection::Normals);
        let heat = RenderConfig {
            integrator: heat,
            ..medium.clone()
        };
        for (config, name, is_looked_at) in [
            (&medium, "x.png", false),
            (&medium, "x.exr", true),
            (&cut, "x.exr", false),
            (&heat, "x.exr", false),
        ] {
            assert_eq!(rows(config, name, is_looked_at), None);
        }
    }
}
