//! `lanecast merge`: adds parts of a picture up, which `render --samples` wrote, or joins its tiles.

use super::args::MergeArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use super::render::check_alpha;
use super::tile;
use lanecast_io::{LoadError, Part, PartHeader, picture_files};
use lanecast_picture::render::Merge;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `--json` gets.
#[derive(Serialize)]
struct Report {
    files: Vec<String>,
    width: u32,
    height: u32,
    parts: usize,
    /// Samples per pixel of parts by samples; none of tiles.
    samples: Option<u64>,
}

impl Report {
    fn new(
        files: &[PathBuf],
        [width, height]: [u32; 2],
        (parts, samples): (usize, Option<u64>),
    ) -> Report {
        Report {
            files: files
                .iter()
                .map(|file| file.display().to_string())
                .collect(),
            width,
            height,
            parts,
            samples,
        }
    }
}

pub fn run(args: &MergeArgs) -> Result<(), CliError> {
    let development = args.development.checked(&args.output)?;
    let files: Vec<PathBuf> = picture_files(&args.output, false)
        .map_err(|e| CliError::Usage(e.to_string()))?
        .into_iter()
        .map(|(path, _)| path)
        .collect();
    let inputs: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    check_destinations(&inputs, &files, args.json.iter())?;
    let progress = interrupt::watch();
    if inputs.iter().all(|path| tile::is_tile(path)) {
        let over = |of_tiles| args.development.over(of_tiles);
        let (picture, development) = tile::joined(&inputs, over, &progress)?;
        check_alpha(picture.alpha.is_some(), &args.output)?;
        let files = picture_files(&args.output, picture.has_aovs());
        let files = files.map_err(|e| CliError::Usage(e.to_string()))?;
        let files: Vec<PathBuf> = files.into_iter().map(|(path, _)| path).collect();
        check_destinations(&inputs, &files, args.json.iter())?;
        let mut results = Results::default();
        picture.save_into(&args.output, &development, &mut results.outputs)?;
        let report = Report::new(
            &files,
            [picture.width, picture.height],
            (inputs.len(), None),
        );
        results.add(&args.json, &report)?;
        interrupt::check(&progress)?;
        let names = files
            .iter()
            .map(|file| printable_line(&file.display().to_string()));
        return results.commit(&format!(
            "{}: {}x{} of {} tiles\n",
            names.collect::<Vec<_>>().join(", "),
            picture.width,
            picture.height,
            inputs.len()
        ));
    }
    let mut parts = Vec::new();
    for path in inputs {
        parts.push((PartHeader::load(path)?, path));
    }
    // The samples of a longer part begin where those of a shorter one may, too.
    parts.sort_by_key(|(header, _)| (header.samples.start, header.samples.end));
    check(&parts)?;
    let mut merge = Merge::default();
    for (header, path) in &parts {
        interrupt::check(&progress)?;
        let part = Part::load(path)?;
        if part.header != *header {
            return Err(wrong(path, "it changed while it was read; merge again").into());
        }
        merge.add(part);
    }
    let (header, _) = &parts[0];
    check_alpha(header.has_alpha, &args.output)?;
    let development = match header.is_radiance {
        true => args.development.of_radiance(development),
        false => development,
    };
    let samples = merge.samples();
    let picture = merge.picture(header)?;
    let mut results = Results::default();
    picture.save_into(&args.output, &development, &mut results.outputs)?;
    let size = [header.width, header.height];
    let report = Report::new(&files, size, (parts.len(), Some(samples.into())));
    results.add(&args.json, &report)?;
    interrupt::check(&progress)?;
    results.commit(&format!(
        "{}: {}x{}, {samples} spp of {} parts\n",
        printable_line(&args.output.display().to_string()),
        header.width,
        header.height,
        parts.len(),
    ))
}

/// Checks that parts, sorted by their samples, are all those of one picture from sample 0 on.
fn check(parts: &[(PartHeader, &Path)]) -> Result<(), CliError> {
    let Some((first, named)) = parts.first() else {
        return Err(CliError::Usage("there are no parts to merge".into()));
    };
    let mut end = 0;
    for (number, (header, path)) in parts.iter().enumerate() {
        let samples = &header.samples;
        let size = (header.width, header.height);
        if size != (first.width, first.height) {
            return Err(wrong(
                path,
                &format!(
                    "it has {}x{} pixels, and {} has {}x{}; merge parts of one picture",
                    size.0,
                    size.1,
                    named.display(),
                    first.width,
                    first.height
                ),
            )
            .into());
        }
        if header.key != first.key {
            return Err(wrong(
                path,
                &format!(
                    "it is of another scene, camera or setting, or of another version of the \
                     program, than {}; merge parts of one picture",
                    named.display()
                ),
            )
            .into());
        }
        if !lanecast_picture::render::is_part(samples) {
            return Err(wrong(path, "its samples are no part; render it again").into());
        }
        if samples.start < end {
            let (_, before) = &parts[number - 1];
            return Err(wrong(
                path,
                &format!(
                    "its samples {}..{} are in {} already; leave one of them out",
                    samples.start,
                    samples.end,
                    before.display()
                ),
            )
            .into());
        }
        if samples.start > end {
            return Err(CliError::Usage(format!(
                "samples {end}..{} are missing before {}; render them with --samples, and merge \
                 all parts at once",
                samples.start,
                path.display()
            )));
        }
        end = samples.end;
    }
    Ok(())
}

fn wrong(path: &Path, message: &str) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "part".into(),
        message: message.into(),
    }
}
