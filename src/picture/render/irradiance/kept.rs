//! Keeps records of indirect light from picture to picture, and in files.
//!
//! A record is of the scene and not of the view, but for how far it serves, which is bounded in
//! widths of a pixel, and for two things that may lie around an eye: media, and the studio of a scene
//! without light.

use super::gather::{LEAST_WIDTHS, least_cosine};
use super::{CacheCounts, IrradianceRecord};
use crate::io::{LightRecords, LoadError, Outputs, RECORD_NUMBERS, RecordsOf, SaveError};
use crate::plan::BITS;
use crate::render::RenderConfig;
use crate::render::camera::RayGenerator;
use crate::render::part::{Key, showing_kernels};
use crate::render::paths::PathPicture;
use crate::render::picture::{RenderError, View};
use crate::scene::{Cameras, Tables};
use crate::shade::path::SECTORS;
use glam::{DMat2, DVec2, DVec3};
use std::path::Path;

/// Records serve no view whose pixels are so many times narrower where they lie than those that they
/// were made for: no record is smaller than it was worth there.
const MOST_NARROWER: f64 = 2.0;

/// Records of indirect light that outlast a picture.
#[derive(Clone, Debug, Default)]
pub struct LightCache {
    /// In the order in which they were made.
    records: Vec<IrradianceRecord>,
    /// So many of them, the first, are of a file.
    read: usize,
    /// What they are of, if a file has or gets them.
    of: Option<RecordsOf>,
    /// The key of what lies around the eyes that they were made for; none before the first picture.
    around: Option<u128>,
}

impl LightCache {
    /// Reads the records of a file, which are to be of this scene and these settings; there are none
    /// yet if it does not exist.
    ///
    /// Fails if the file cannot be read, is damaged or is of something else.
    pub fn load(path: &Path, view: &View, config: &RenderConfig) -> Result<LightCache, LoadError> {
        let of = records_of(view, config);
        if matches!(path.try_exists(), Ok(false)) {
            return Ok(LightCache {
                of: Some(of),
                ..LightCache::default()
            });
        }
        let file = LightRecords::load(path, &of)?;
        let records = file.rows.iter().map(|row| record_of(row, of.error));
        let records: Option<Vec<IrradianceRecord>> = records.collect();
        let Some(records) = records else {
            return Err(LoadError::Invalid {
                path: path.into(),
                place: "records of --cache-file".into(),
                message: "its numbers are none of records; remove the file, or name another".into(),
            });
        };
        Ok(LightCache {
            read: records.len(),
            records,
            of: Some(of),
            around: Some(file.of.around),
        })
    }

    /// Adds the file of all records to `outputs`, which the caller commits; nothing if it would be what
    /// was read.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let (Some(of), Some(around)) = (self.of, self.around) else {
            return Ok(());
        };
        if self.added() == 0 {
            return Ok(());
        }
        // What is not finite serves nothing.
        let rows = self.records.iter().map(row_of);
        let rows = rows.filter(|row| row.iter().all(|x| x.is_finite()));
        let file = LightRecords {
            of: RecordsOf { around, ..of },
            rows: rows.collect(),
        };
        file.save_into(path, outputs)
    }

    /// Returns the number of records that were read from a file.
    pub fn read(&self) -> usize {
        self.read
    }

    /// Returns the number of records that pictures have added.
    pub fn added(&self) -> usize {
        self.records.len() - self.read
    }

    /// Returns the records that serve a view, in the order in which they were made, and counts them.
    /// Those of other light are forgotten.
    ///
    /// Fails if a file has, or is to get, records of other light.
    pub(super) fn serving(
        &mut self,
        picture: &PathPicture,
        view: &View,
        generator: &RayGenerator,
    ) -> Result<(Vec<IrradianceRecord>, CacheCounts), RenderError> {
        let scene = &view.world.scene;
        let is_in_studio = scene.is_dark() && view.lights.is_empty();
        let studio = is_in_studio.then_some(view.camera);
        let around = Key::of(format_args!("{:?} {studio:?}", picture.media.eye));
        if self.around.is_some_and(|before| before != around) {
            if self.of.is_some() {
                return Err(RenderError::OtherLight);
            }
            *self = LightCache::default();
        }
        self.around = Some(around);
        let is_fine = |record: &IrradianceRecord| {
            let close = LEAST_WIDTHS * generator.pixel_width(record.point);
            record.close <= MOST_NARROWER * close
        };
        let serving = |records: &[IrradianceRecord]| -> Vec<IrradianceRecord> {
            records.iter().filter(|r| is_fine(r)).copied().collect()
        };
        let mut records = serving(&self.records[..self.read]);
        let from_file = records.len();
        records.extend(serving(&self.records[self.read..]));
        let counts = CacheCounts {
            from_file,
            kept: records.len() - from_file,
            ..CacheCounts::default()
        };
        Ok((records, counts))
    }

    /// Keeps more records.
    pub(super) fn keep(&mut self, records: &[IrradianceRecord]) {
        self.records.extend_from_slice(records);
    }
}

/// Returns what the light of a picture's records depends on, but for what lies around the eye.
fn records_of(view: &View, config: &RenderConfig) -> RecordsOf {
    let scene = Tables {
        cameras: Cameras::default(),
        ..Tables::clone(&view.world.scene)
    };
    let program = Key::of(format_args!("{} {BITS}", env!("CARGO_PKG_VERSION")));
    RecordsOf {
        program: program as u64,
        scene: Key::of(format_args!("{scene:?} {:?}", view.lights)),
        error: config.caching.map_or(0.0, |caching| caching.error),
        seed: config.seed,
        max_depth: config.max_depth,
        precision: Key::of(format_args!("{:?}", showing_kernels(view, config))),
        around: 0,
    }
}

/// Returns a record's numbers. Axes and the least cosine follow from others.
fn row_of(record: &IrradianceRecord) -> [f64; RECORD_NUMBERS] {
    let mut row = [0.0; RECORD_NUMBERS];
    let metric = record.metric;
    let numbers = record.point.to_array().into_iter();
    let numbers = numbers
        .chain(record.normal.to_array())
        .chain(record.light.map(f64::from))
        .chain(record.gradient.iter().flat_map(|v| v.to_array()))
        .chain(record.turn.iter().flat_map(|v| v.to_array()))
        .chain([metric.x_axis.x, metric.x_axis.y, metric.y_axis.y])
        .chain(record.radii)
        .chain([record.close])
        .chain(record.blocked.map(f64::from));
    row.iter_mut().zip(numbers).for_each(|(to, x)| *to = x);
    row
}

/// Returns the record of some finite numbers; `None` if they are none of a record.
fn record_of(row: &[f64; RECORD_NUMBERS], error: f64) -> Option<IrradianceRecord> {
    let mut rest = row.iter().copied();
    let mut next = || rest.next().unwrap_or_default();
    let mut vector = || DVec3::new(next(), next(), next());
    let (point, normal, light) = (vector(), vector(), vector());
    let mut changes = || [0; 3].map(|_| DVec2::new(next(), next()));
    let (gradient, turn) = (changes(), changes());
    let [xx, xy, yy, short, long, close] = [0; 6].map(|_| next());
    let single = |x: f64| Some(x as f32).filter(|single| f64::from(*single) == x && x >= 0.0);
    let mut blocked = [0.0; SECTORS];
    for sector in &mut blocked {
        *sector = single(next())?;
    }
    // Far more than roundings take.
    let is_unit = (normal.length_squared() - 1.0).abs() < 1e-6;
    let is_record = is_unit && short > 0.0 && long > 0.0 && close > 0.0;
    is_record.then_some(())?;
    Some(IrradianceRecord {
        point,
        normal,
        axes: normal.any_orthonormal_pair().into(),
        light: [single(light.x)?, single(light.y)?, single(light.z)?],
        gradient,
        turn,
        metric: DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy)),
        radii: [short, long],
        least_cosine: least_cosine(error),
        close,
        blocked,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::path::Irradiance;

    fn record() -> IrradianceRecord {
        let normal = DVec3::new(1.0, 2.0, 3.0).normalize();
        let change = |x: f64| [0, 1, 2].map(|k| DVec2::new(x, f64::from(k) / 7.0));
        IrradianceRecord {
            point: DVec3::new(0.1, -0.2, 0.3),
            normal,
            axes: normal.any_orthonormal_pair().into(),
            light: [0.1, 0.2, 0.3],
            gradient: change(0.4),
            turn: change(-0.5),
            metric: DMat2::from_cols(DVec2::new(4.0, 0.5), DVec2::new(0.5, 3.0)),
            radii: [0.5, 0.7],
            least_cosine: least_cosine(0.2),
            close: 0.01,
            blocked: std::array::from_fn(|i| i as f32 / 3.0),
        }
    }

    #[test]
    fn the_numbers_of_a_record_are_all_of_it() {
        let row = row_of(&record());
        assert_eq!(record_of(&row, 0.2), Some(record()));
        // Each number counts.
        for k in 0..RECORD_NUMBERS {
            let mut other = row;
            other[k] = 1.25 * row[k] + if row[k] == 0.0 { 1.0 } else { 0.0 };
            assert_ne!(record_of(&other, 0.2), Some(record()), "number {k}");
        }
    }

    /// Whatever a file holds makes records that can be asked, or none.
    #[test]
    fn hostile_numbers_do_no_harm() {
        let row = row_of(&record());
        let extremes = [
            0.0,
            -0.0,
            -1.0,
            1.0,
            1e-300,
            1e39,
            1e300,
            f64::MAX,
            f64::MIN,
        ];
        let mut made = Vec::new();
        for (k, extreme) in (0..RECORD_NUMBERS).flat_map(|k| extremes.map(|x| (k, x))) {
            let mut other = row;
            other[k] = extreme;
            made.extend(record_of(&other, 0.2));
        }
        assert!(made.len() > 100);
        assert!(made.iter().all(|r| r.light.iter().all(|c| *c >= 0.0)));
        let cache = Irradiance::new(made.clone());
        for record in &made {
            let light = cache.at(record.point, record.normal).unwrap_or_default();
            assert!(light.iter().all(|c| *c >= 0.0), "{light:?}");
        }
        let mut unlike = row;
        unlike[3] += 0.01;
        assert_eq!(record_of(&unlike, 0.2), None);
        for (k, wrong) in [
            (6, -1.0),
            (6, 0.1),
            (24, 0.0),
            (25, -1.0),
            (26, 0.0),
            (27, -1.0),
        ] {
            let mut other = row;
            other[k] = wrong;
            assert_eq!(record_of(&other, 0.2), None, "{wrong} as number {k}");
        }
    }
}
