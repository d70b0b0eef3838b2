//! `.scad` programs: OpenSCAD itself, where it is installed, makes the `.csg` of them.

use super::openscad::{Failure, Source, run};
use crate::shared::text::decode;
use crate::{ImportReport, LoadError, LoadOptions};
use std::path::Path;
use std::time::Duration;

/// How long OpenSCAD may take; it makes no mesh for a `.csg`, so most programs take it a second.
const LIMIT: Duration = Duration::from_secs(60);

/// Returns the text of the `.csg` that OpenSCAD makes of a program. Fails with the first error that
/// it names; its warnings, such as of a file that is not there, are counted in the report.
pub(super) fn csg_of(
    path: &Path,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<Vec<u8>, LoadError> {
    // A program that cannot be read is not OpenSCAD's to complain about.
    let bytes = options.read(path)?;
    let run = match options.bytes(path) {
        Some(_) => {
            let text = decode(path, &bytes)?;
            run(Source::Text(&text), "csg", LIMIT, u64::MAX)
        }
        None => {
            let absolute = path.canonicalize().map_err(|source| LoadError::Read {
                path: path.into(),
                source,
            })?;
            run(Source::File(&absolute), "csg", LIMIT, u64::MAX)
        }
    };
    let run = run.map_err(|failure| match failure {
        Failure::Absent => LoadError::Unsupported {
            path: path.into(),
            what: "an OpenSCAD program without the command openscad on the path".into(),
            remedy: Some(
                "install it, or give the .csg that it makes: openscad -o part.csg part.scad".into(),
            ),
        },
        other => invalid(path, other.to_string()),
    })?;
    if let Some(why) = run.error() {
        return Err(invalid(path, format!("openscad failed: {why}")));
    }
    if let Some(first) = run.said.warning {
        let what = format!("part of the program that openscad warns of (first: {first})");
        report.add_many(&what, run.said.warnings);
    }
    run.written
        .map_err(|source| invalid(path, format!("openscad has written no .csg: {source}")))
}

fn invalid(path: &Path, message: String) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "OpenSCAD program".into(),
        message,
    }
}
