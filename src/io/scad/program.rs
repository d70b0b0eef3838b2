//! `.scad` programs: OpenSCAD itself, where it is installed, makes the `.csg` of them.

use crate::LoadError;
use crate::shared::folder;
use crate::shared::messages::one_line;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long OpenSCAD may take; it makes no mesh for a `.csg`, so most programs take it a second.
const LIMIT: Duration = Duration::from_secs(60);

/// How often its end is looked for.
const PAUSE: Duration = Duration::from_millis(10);

/// The most of its messages that are read.
const MOST_MESSAGES: u64 = 1 << 16;

/// Returns the text of the `.csg` that OpenSCAD makes of a program.
pub(super) fn csg_of(path: &Path) -> Result<Vec<u8>, LoadError> {
    // A program that cannot be read is not OpenSCAD's to complain about.
    folder::read_file(path)?;
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    let made = tempfile::tempdir().map_err(failed)?;
    let (csg, messages) = (made.path().join("part.csg"), made.path().join("messages"));
    let said = File::create(&messages).map_err(failed)?;
    let absolute = path.canonicalize().map_err(failed)?;
    let started = Command::new("openscad")
        .arg("-o")
        .arg(&csg)
        .arg(&absolute)
        // Without a screen, too.
        .env("QT_QPA_PLATFORM", "offscreen")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said)
        .spawn();
    let mut openscad = started.map_err(|source| match source.kind() {
        ErrorKind::NotFound => LoadError::Unsupported {
            path: path.into(),
            what: "an OpenSCAD program without the command openscad on the path".into(),
            remedy: Some(
                "install it, or give the .csg that it makes: openscad -o part.csg part.scad".into(),
            ),
        },
        _ => failed(source),
    })?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = openscad.try_wait().map_err(failed)? {
            break status;
        }
        if start.elapsed() > LIMIT {
            // It may have ended by now.
            let _ = openscad.kill();
            let _ = openscad.wait();
            let seconds = LIMIT.as_secs();
            return Err(invalid(
                path,
                format!("openscad took more than {seconds} seconds"),
            ));
        }
        std::thread::sleep(PAUSE);
    };
    if !status.success() {
        let mut text = Vec::new();
        let file = File::open(&messages).map_err(failed)?;
        file.take(MOST_MESSAGES)
            .read_to_end(&mut text)
            .map_err(failed)?;
        let text = String::from_utf8_lossy(&text);
        let mut lines = text.lines().filter(|line| !line.trim().is_empty());
        let error = lines.clone().find(|line| line.starts_with("ERROR"));
        let why = error.or_else(|| lines.next()).unwrap_or("it says no more");
        return Err(invalid(path, format!("openscad failed: {}", one_line(why))));
    }
    folder::read_file(&csg)
}

fn invalid(path: &Path, message: String) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "OpenSCAD program".into(),
        message,
    }
}
