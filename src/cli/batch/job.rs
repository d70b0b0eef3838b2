//! The job file: what it says, in TOML or JSON, and the messages where it says it wrongly.

use super::dataset::{CameraFile, DatasetSettings, Random};
pub use super::many::Many;
use super::ranges::Ranges;
use crate::args::TileGrid;
use crate::error::CliError;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::fmt::{Formatter, Result as FmtResult};
use std::path::Path;

/// The version of the format that is read.
const FORMAT: u32 = 1;

/// The most bytes of a job file. Long lists of scenes lie in files of their own.
const MOST_BYTES: u64 = 1 << 26;

/// A Lanecast job. Its axes multiply to tasks; `render` is what all are rendered with.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(title = "Lanecast job")]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// The version of the format, 1.
    format: u32,
    /// Paths, globs and `@lists`, relative to the folder of the job file.
    pub scene: Many<String>,
    /// Names or numbers of cameras, or files of poses.
    #[serde(default)]
    pub camera: Many<CameraChoice>,
    /// Standard views.
    #[serde(default)]
    pub view: Many<String>,
    /// Rounds of views that frame the scene.
    #[serde(default)]
    pub orbit: Many<Orbit>,
    /// Names of a glTF file's variants, or tables of options that replace those of `render`.
    #[serde(default)]
    pub variant: Many<Variant>,
    /// Numbers of frames, such as "0-47" or "1-60:2".
    #[serde(default)]
    pub frame: Many<Frame>,
    /// Columns and rows of tiles, such as "4x4", or a number of rows: each tile is a task.
    pub tile: Option<Tile>,
    /// The template of pictures' names, such as "{scene}/{camera}_{frame:04}.png".
    pub output: Option<String>,
    /// Options of `lanecast render`, by their names.
    #[serde(default)]
    pub render: Map<String, Value>,
    /// Options that are drawn by chance.
    pub random: Option<Random>,
    /// What is written about each picture for those who learn from it.
    pub dataset: Option<DatasetSettings>,
}

/// A camera of the scenes, or those of a file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected the name or number of a camera, or { file = \"transforms.json\" } with frames, size \
                 and scale, if these are needed"
)]
pub enum CameraChoice {
    Numbered(u32),
    Named(String),
    Posed(CameraFile),
}

/// Views evenly about the scene, which each frames.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Views of a round.
    pub views: u32,
    /// Degrees above the horizon, of one round or of several; 20.
    #[serde(default)]
    pub elevation: Angles,
    /// Degrees from the front to the right, of the first view.
    #[serde(default)]
    pub start: f64,
    /// Degrees; the default view's without it.
    pub fov_y: Option<f64>,
}

/// One or several angles.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected degrees, or a list of them")]
pub enum Angles {
    One(f64),
    Several(Vec<f64>),
}

impl Default for Angles {
    /// Returns about the elevation of the default view.
    fn default() -> Angles {
        Angles::One(20.0)
    }
}

impl Angles {
    pub fn list(&self) -> &[f64] {
        match self {
            Angles::One(angle) => std::slice::from_ref(angle),
            Angles::Several(angles) => angles,
        }
    }
}

/// Options that differ from `render`'s, by the name of their whole.
#[derive(Clone, Debug)]
pub struct Variant {
    pub name: String,
    pub options: Map<String, Value>,
}

/// The number of a frame, or ranges of them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected numbers of frames, such as \"0-47\" or \"1-60:2\""
)]
pub enum Frame {
    One(u32),
    Several(String),
}

/// The tiles of a picture.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected columns and rows of tiles, such as \"4x4\", or a number of rows"
)]
pub enum Tile {
    Rows(u32),
    Grid(String),
}

impl Frame {
    /// Lists the numbers of frames in the order in which they were written.
    pub fn numbers(frames: &[Frame]) -> Result<Vec<u32>, String> {
        let texts = frames.iter().map(|frame| match frame {
            Frame::One(number) => number.to_string(),
            Frame::Several(text) => text.clone(),
        });
        let ranges = Ranges::parse(&texts.collect::<Vec<_>>().join(","))?;
        Ok(ranges.numbers().collect())
    }
}

impl Tile {
    pub fn grid(&self) -> Result<TileGrid, String> {
        match self {
            Tile::Rows(rows) => TileGrid::parse(&rows.to_string()),
            Tile::Grid(text) => TileGrid::parse(text),
        }
    }
}

impl Job {
    /// Reads a job file. Fails with the file, the place and the remedy.
    pub fn read(path: &Path) -> Result<Job, CliError> {
        let failed = |why: String| CliError::Input(format!("{}: {why}", path.display()));
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        let is_toml = match extension.as_deref().and_then(|e| e.to_str()) {
            Some("toml") => true,
            Some("json") => false,
            _ => return Err(failed("a job is a .toml or .json file".into())),
        };
        let unread = |e: std::io::Error| failed(format!("cannot be read: {e}"));
        let about = std::fs::metadata(path).map_err(unread)?;
        if !about.is_file() {
            return Err(failed("it is not a regular file; name a job file".into()));
        }
        if about.len() > MOST_BYTES {
            return Err(failed(format!(
                "it has more than {MOST_BYTES} bytes; put scenes into a list, a line each, and name \
                 it as \"@scenes.txt\""
            )));
        }
        let text = std::fs::read(path).map_err(unread)?;
        let text = String::from_utf8(text).map_err(|_| failed("it is not UTF-8".into()))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let job: Job = match is_toml {
            true => toml::from_str(text).map_err(|e: toml::de::Error| {
                let place = e.span().map(|span| line_column(text, span.start));
                wrong(path, place, e.message())
            })?,
            false => serde_json::from_str(text).map_err(|e| {
                let said = e.to_string();
                let message = said.split(" at line ").next().unwrap_or(&said);
                wrong(path, Some((e.line(), e.column())), message)
            })?,
        };
        if job.format != FORMAT {
            return Err(failed(format!(
                "format = {} is unknown; this program reads format = {FORMAT}",
                job.format
            )));
        }
        Ok(job)
    }
}

/// Makes the error of a place in the file; an unknown key gets the nearest that is known.
fn wrong(path: &Path, place: Option<(usize, usize)>, message: &str) -> CliError {
    let place = place.map_or(String::new(), |(line, column)| format!(":{line}:{column}"));
    let message = message.trim().replace('\n', " ");
    let message = message.replace(", expected u32", ", expected a whole number");
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let hint = match (message.starts_with("unknown field"), &quoted[..]) {
        (true, [unknown, known @ ..]) => nearest(unknown, known.iter().copied()),
        _ => None,
    };
    let hint = hint.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    CliError::Input(format!("{}{place}: {message}{hint}", path.display()))
}

/// Returns the known name that is most like another one, if one is.
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let like = |known: &&str| (strsim::jaro_winkler(name, known) * 1e6) as u32;
    known.max_by_key(like).filter(|near| like(near) > 800_000)
}

/// Counts line and column from 1.
fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..offset.min(text.len())];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    (line, column)
}

impl<'de> Deserialize<'de> for Variant {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Variant, D::Error> {
        from.deserialize_any(VariantVisitor)
    }
}

struct VariantVisitor;

impl<'de> Visitor<'de> for VariantVisitor {
    type Value = Variant;

    fn expecting(&self, to: &mut Formatter) -> FmtResult {
        to.write_str("the name of a glTF file's variant, or a table of options with a `name`")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Variant, E> {
        let variant = ("variant".to_owned(), Value::from(name));
        Ok(Variant {
            name: name.into(),
            options: [variant].into_iter().collect(),
        })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Variant, A::Error> {
        let mut options = Map::deserialize(MapAccessDeserializer::new(map))?;
        match options.remove("name") {
            Some(Value::String(name)) => Ok(Variant { name, options }),
            _ => Err(A::Error::custom("a variant needs a `name`")),
        }
    }
}

impl JsonSchema for Variant {
    fn schema_name() -> Cow<'static, str> {
        "Variant".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({ "anyOf": [
            { "type": "string" },
            {
                "type": "object",
                "properties": { "name": { "type": "string" } },
                "required": ["name"],
            },
        ] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_file_is_that_of_the_program() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/batch.schema.json");
        let schema = serde_json::to_string_pretty(&schemars::schema_for!(Job)).unwrap() + "\n";
        if std::env::var_os("LANECAST_BLESS").is_some() {
            std::fs::write(&path, &schema).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            kept,
            schema,
            "set LANECAST_BLESS=1 to rewrite {}",
            path.display()
        );
    }

    fn read(name: &str, text: &str) -> Result<Job, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        Job::read(&path).map_err(|e| {
            assert_eq!(e.exit_code(), 3);
            e.to_string()
        })
    }

    #[test]
    fn a_job_says_the_same_in_both_languages() {
        let toml = "format = 1\nscene = \"a.glb\"\nview = [\"front\"]\nframe = \"1-3\"\n\
                    orbit = { views = 3, elevation = [0, 30.5] }\n\
                    variant = [\"red\", { name = \"cut\", clip = \"1,0,0,0\" }]\n\
                    [render]\nspp = 4\n";
        let json = r#"{"format": 1, "scene": ["a.glb"], "view": "front", "frame": "1-3",
            "orbit": [{"views": 3, "elevation": [0, 30.5]}],
            "variant": ["red", {"name": "cut", "clip": "1,0,0,0"}], "render": {"spp": 4}}"#;
        let both = [("j.toml", toml), ("j.json", json)]
            .map(|(name, text)| format!("{:?}", read(name, text).unwrap()));
        assert_eq!(both[0], both[1]);
        assert!(
            both[0].contains("\"clip\": String(\"1,0,0,0\")"),
            "{}",
            both[0]
        );
    }

    #[test]
    fn frames_and_cameras_are_numbers_texts_and_lists() {
        let numbers = |frame: &str| {
            let job = read(
                "j.toml",
                &format!("format = 1\nscene = \"a\"\nframe = {frame}"),
            );
            Frame::numbers(&job.unwrap().frame.0)
        };
        assert_eq!(numbers("7"), Ok(vec![7]));
        assert_eq!(numbers("[1, 2, 5]"), Ok(vec![1, 2, 5]));
        assert_eq!(numbers("[\"0-2\", \"5\", 9]"), Ok(vec![0, 1, 2, 5, 9]));
        assert!(numbers("[3, \"5-1\"]").unwrap_err().contains("'3,5-1'"));
        for (camera, count) in [("0", 1), ("[0]", 1), ("[0, \"side\", 2]", 3)] {
            let json = format!("{{\"format\": 1, \"scene\": \"a\", \"camera\": {camera}}}");
            let toml = format!("format = 1\nscene = \"a\"\ncamera = {camera}");
            for (name, text) in [("j.json", json), ("j.toml", toml)] {
                assert_eq!(read(name, &text).unwrap().camera.0.len(), count);
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let said = |name, text| read(name, text).unwrap_err();
        let toml = |text| said("j.toml", text);
        let unknown = toml("format = 1\nscen = \"a.glb\"\n");
        assert!(unknown.contains("j.toml:2:1"), "{unknown}");
        assert!(unknown.contains("did you mean `scene`?"), "{unknown}");
        let json = said("j.json", "{\"format\": 1,\n \"scene\": \"a\", \"veiw\": 1}");
        assert!(
            json.contains("j.json:2:") && json.contains("`view`?"),
            "{json}"
        );
        assert!(toml("format = 2\nscene = \"a\"").contains("format = 1"));
        assert!(toml("format = 1.0\nscene = \"a\"").contains("expected a whole number"));
        assert!(toml("scene = \"a\"").contains("missing field `format`"));
        assert!(toml("format = 1\nscene = 3").contains("j.toml:2:9"));
        for wrong in ["true", "-1", "1.5", "[[1]]", "[true]"] {
            for (key, says) in [("frame", "0-47"), ("camera", "name or number of a camera")] {
                let text = format!("format = 1\nscene = \"a\"\n{key} = {wrong}");
                let said = read("j.toml", &text).unwrap_err();
                assert!(said.contains(says), "{said}");
            }
        }
        assert!(toml("format = 1\nscene = \"a\"\nframe = true").contains("0-47"));
        assert!(toml("format = 1\nscene = \"a\"\nvariant = [{ x = 1 }]").contains("`name`"));
        assert!(toml("format = ").contains("j.toml:1:10"));
        assert!(said("j.yaml", "").contains(".toml or .json"));
        let missing = Job::read("no/such.toml".as_ref()).unwrap_err().to_string();
        assert!(missing.contains("cannot be read"), "{missing}");
    }
}
