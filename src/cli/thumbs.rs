//! `lanecast thumbs`: a small picture of each scene file below some folders, and a page of all.
//!
//! It writes a job (`batch/`) into the folder of its records and does it, so that only what is new or
//! has changed is rendered.

use super::args::{BatchArgs, ThumbsArgs};
use super::batch::{self, Shown, relative};
use super::error::CliError;
use super::output::{Results, Sink, complain, printable_line};
use lanecast_io::{Outputs, SaveError};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The endings of scene files.
const ENDINGS: [&str; 11] = [
    "toml", "json", "gltf", "glb", "nff", "csg", "scad", "obj", "ply", "stl", "3mf",
];

/// The first bytes of a file of TOML or JSON that say whether it is a scene.
const LOOKED_AT: u64 = 1 << 20;

/// How deep folders may lie in each other.
const MOST_LEVELS: u32 = 64;

/// The direction of the default view, rounded: azimuth and elevation in degrees.
const VIEW: [u32; 2] = [32, 20];

/// What the pictures are called.
const OUTPUT: &str = "{folder}/{file}.png";

/// What the page says of itself.
const MARK: &str = "<meta name=\"generator\" content=\"lanecast thumbs\">";

pub fn run(args: &ThumbsArgs, render: clap::Command) -> Result<(), CliError> {
    let mut found = Found::default();
    let out = args.out.canonicalize().ok();
    for folder in &args.folders {
        let about = fs::metadata(folder).map_err(|e| unread(folder, &e))?;
        match about.is_dir() {
            true => add(folder, out.as_deref(), 0, &mut found).map_err(|e| unread(folder, &e))?,
            false => {
                found.scenes.insert(folder.clone());
            }
        }
    }
    let is_searched = |folder: &PathBuf| out.is_some() && folder.canonicalize().ok() == out;
    if found.scenes.is_empty() && args.folders.iter().any(is_searched) {
        return Err(CliError::Usage(format!(
            "--out {} is the folder that is searched, and what lies in it is not drawn; give another \
             folder",
            args.out.display()
        )));
    }
    if found.scenes.is_empty() {
        return Err(CliError::Input(format!(
            "there is no scene file below {}; known are .{}",
            args.folders[0].display(),
            ENDINGS.join(" .")
        )));
    }
    let index = args.out.join("index.html");
    check_index(&index)?;
    let job = write_job(args, &mut found)?;
    for (path, why) in &found.failed {
        let path = printable_line(&path.display().to_string());
        complain(&format!("failed: {path}: {why}"));
    }
    let mut shown = Vec::new();
    let mut ended = Ok(());
    if let Some(job) = job {
        let mut batch = BatchArgs::of_job(job, &args.out, args.threads, args.progress);
        batch.quiet = matches!(args.json, Some(Sink::Stdout));
        ended = batch::run(&batch, render.clone());
        if let Err(CliError::Stopped(_) | CliError::Save(_) | CliError::Input(_)) = &ended {
            return ended;
        }
        shown = batch::shown(&batch, render)?;
    }
    let count = found.failed.len();
    shown.extend(found.failed.into_iter().map(|(scene, why)| Shown {
        output: PathBuf::new(),
        scene,
        failure: Some(why),
    }));
    let mut results = Results::default();
    results.outputs.add(&index, page(&shown).into_bytes())?;
    results.add(&args.json, &Report::new(&index, &shown))?;
    results.commit(&format!("{}: {} scenes\n", index.display(), shown.len()))?;
    match count {
        0 => ended,
        count => ended.and(Err(CliError::Short(format!(
            "{count} of {} could not be rendered; {} says why",
            shown.len(),
            index.display()
        )))),
    }
}

/// What `--json` gets.
#[derive(Serialize)]
struct Report {
    index: String,
    scenes: Vec<Row>,
}

/// A scene that was found.
#[derive(Serialize)]
struct Row {
    scene: String,
    /// None if it could not be rendered.
    picture: Option<String>,
    /// Why it could not.
    failure: Option<String>,
}

impl Report {
    fn new(index: &Path, shown: &[Shown]) -> Report {
        let row = |one: &Shown| Row {
            scene: one.scene.display().to_string(),
            picture: match one.failure {
                None => Some(one.output.display().to_string()),
                Some(_) => None,
            },
            failure: one.failure.clone(),
        };
        Report {
            index: index.display().to_string(),
            scenes: shown.iter().map(row).collect(),
        }
    }
}

/// The files below the folders.
#[derive(Default)]
struct Found {
    scenes: BTreeSet<PathBuf>,
    /// What cannot be rendered, and why.
    failed: Vec<(PathBuf, String)>,
}

/// Refuses to replace a page that is none of ours.
fn check_index(index: &Path) -> Result<(), CliError> {
    let text = fs::read(index).map(|text| String::from_utf8_lossy(&text).into_owned());
    match text {
        Ok(text) if !text.contains(MARK) => Err(CliError::Usage(format!(
            "{} exists and is no page of thumbnails; move it away, or give another folder with --out",
            index.display()
        ))),
        _ => Ok(()),
    }
}

/// Writes the job of some scenes, and returns its path; `None` if none of them can be in a job. Adds
/// those that cannot to what has failed.
fn write_job(args: &ThumbsArgs, found: &mut Found) -> Result<Option<PathBuf>, CliError> {
    let folder = args.out.join("records");
    let failed = |source| SaveError::Write {
        path: folder.clone(),
        source,
    };
    fs::create_dir_all(&folder).map_err(failed)?;
    let real = folder.canonicalize().map_err(failed)?;
    let mut names: Vec<String> = Vec::new();
    let mut pictures: BTreeMap<String, (String, &Path)> = BTreeMap::new();
    // Names that pictures cannot have as they are come last, so that none of them takes another's.
    let is_changed = |scene: &&PathBuf| {
        let name = scene.to_string_lossy();
        name.contains(|c: char| c.is_control() || c == ':' || c == '\\')
    };
    let (changed, plain): (Vec<_>, Vec<_>) = found.scenes.iter().partition(is_changed);
    for scene in plain.into_iter().chain(changed) {
        let name = match name_in_job(scene, &real) {
            Ok(name) => name,
            Err(why) => {
                found.failed.push((scene.clone(), why));
                continue;
            }
        };
        let picture = batch::picture_of(Path::new(&name), OUTPUT);
        if let Some((same, other)) = pictures.get(&picture) {
            if *same == name {
                continue;
            }
            let other = printable_line(&other.display().to_string());
            let why = format!("its picture would be called as that of {other}; rename it");
            found.failed.push((scene.clone(), why));
            continue;
        }
        pictures.insert(picture, (name.clone(), scene));
        names.push(name);
    }
    if names.is_empty() {
        return Ok(None);
    }
    let job = serde_json::json!({
        "format": 1,
        "scene": names,
        "orbit": { "views": 1, "start": VIEW[0], "elevation": VIEW[1] },
        "output": OUTPUT,
        "render": args.options(),
    });
    let path = folder.join("job.json");
    let mut outputs = Outputs::default();
    outputs.add(&path, format!("{job:#}\n").into_bytes())?;
    outputs.commit()?;
    Ok(Some(path))
}

/// Returns what a scene is called in the job in a folder, or why it cannot be called there. A link keeps
/// its own name, for that of the file it leads to may tell no format.
fn name_in_job(scene: &Path, job: &Path) -> Result<String, String> {
    let folder = match scene.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize();
    let folder = folder.map_err(|e| format!("its folder cannot be read: {e}"))?;
    let file = folder.join(scene.file_name().unwrap_or_default());
    let name = relative(&file, job);
    let name = name
        .to_str()
        .ok_or("its name is not UTF-8; give it another")?;
    // So that no name begins with what marks a list.
    Ok(format!("./{name}"))
}

/// Adds the scene files below a folder. Links to folders, hidden folders and that of the pictures
/// are left out. Fails if the folder itself cannot be read.
fn add(folder: &Path, out: Option<&Path>, level: u32, found: &mut Found) -> std::io::Result<()> {
    if level > MOST_LEVELS || out.is_some() && folder.canonicalize().ok().as_deref() == out {
        return Ok(());
    }
    for entry in fs::read_dir(folder)?.flatten() {
        let path = entry.path();
        let is_hidden = entry.file_name().as_encoded_bytes().first() == Some(&b'.');
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && !is_hidden => {
                if let Err(e) = add(&path, out, level + 1, found) {
                    found.failed.push((path, format!("cannot be read: {e}")));
                }
            }
            Ok(kind) if !kind.is_dir() && is_scene(&path) => {
                found.scenes.insert(path);
            }
            _ => {}
        }
    }
    Ok(())
}

/// Says whether a file is a scene by its ending; of TOML and JSON by what its beginning names.
fn is_scene(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let ending = ending.unwrap_or_default();
    if !ENDINGS.contains(&&ending[..]) || !path.is_file() {
        return false;
    }
    if ending != "toml" && ending != "json" {
        return true;
    }
    let mut text = Vec::new();
    let read = fs::File::open(path).and_then(|f| f.take(LOOKED_AT).read_to_end(&mut text));
    let text = String::from_utf8_lossy(&text);
    read.is_ok() && ["format", "instance"].iter().all(|key| text.contains(key))
}

fn unread(path: &Path, why: &std::io::Error) -> CliError {
    CliError::Input(format!("{}: cannot be read: {why}", path.display()))
}

/// Makes the page, whose links count from its own folder.
fn page(shown: &[Shown]) -> String {
    let mut page =
        format!("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">{MARK}\n");
    page.push_str(
        "<title>Scenes</title>\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<style>\n\
         body{font:14px system-ui,sans-serif;margin:24px;background:#f4f4f2;color:#222}\n\
         ul{display:flex;flex-wrap:wrap;gap:16px;list-style:none;padding:0}\n\
         figure{margin:0;width:256px}figcaption{overflow-wrap:anywhere;padding-top:4px}\n\
         img{max-width:256px;display:block;background:#fff;border-radius:4px}\n\
         dt{font-weight:600;margin-top:8px}dd{margin:0;overflow-wrap:anywhere}\n\
         @media(prefers-color-scheme:dark){body{background:#1c1c1e;color:#ddd}}\n\
         </style></head><body>\n",
    );
    let failed = shown.iter().filter(|one| one.failure.is_some()).count();
    page.push_str(&format!("<h1>{} scenes</h1>\n<ul>\n", shown.len() - failed));
    for one in shown.iter().filter(|one| one.failure.is_none()) {
        // The picture is named after the scene file.
        let name = escaped(&one.output.with_extension("").to_string_lossy());
        let link = link(&one.output);
        page.push_str(&format!(
            "<li><figure><a href=\"{link}\"><img src=\"{link}\" alt=\"{name}\" loading=\"lazy\"></a>\
             <figcaption>{name}</figcaption></figure></li>\n"
        ));
    }
    page.push_str("</ul>\n");
    if failed > 0 {
        page.push_str(&format!("<h2>{failed} without a picture</h2>\n<dl>\n"));
        for one in shown {
            if let Some(why) = &one.failure {
                let name = escaped(&one.scene.to_string_lossy());
                page.push_str(&format!("<dt>{name}</dt><dd>{}</dd>\n", escaped(why)));
            }
        }
        page.push_str("</dl>\n");
    }
    page + "</body></html>\n"
}

fn escaped(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c => safe.push(c),
        }
    }
    safe
}

/// Writes a path as a link has it.
fn link(path: &Path) -> String {
    let mut link = String::new();
    for byte in path.to_string_lossy().bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => {
                link.push(byte.into());
            }
            byte => link.push_str(&format!("%{byte:02X}")),
        }
    }
    link
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_in_the_page() {
        let one = |scene: &str, failure: Option<&str>| Shown {
            scene: scene.into(),
            output: format!("{scene}.png").into(),
            failure: failure.map(Into::into),
        };
        let page = page(&[one("a b\"<.stl", None), one("c.obj", Some("1 < 2 & 3"))]);
        assert!(
            page.contains("src=\"a%20b%22%3C.stl.png\" alt=\"a b&quot;&lt;.stl\""),
            "{page}"
        );
        assert!(
            page.contains("<dt>c.obj</dt><dd>1 &lt; 2 &amp; 3</dd>"),
            "{page}"
        );
        assert!(
            page.contains("<h1>1 scenes</h1>") && page.contains("<h2>1 without"),
            "{page}"
        );
    }
}
