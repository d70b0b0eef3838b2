//! What a page shows, as options of `render`: parsed as the command line is, so that this command
//! line makes the same picture.

use super::model::Model;
use crate::args::{OWN_OPTIONS, PageArgs, RenderArgs, STDIN};
use crate::error::CliError;
use crate::output::quoted;
use crate::pipeline::{lit, named};
use crate::render::{arranged, check_alpha, exposed};
use crate::{ground, memory, metadata, render_args};
use glam::DVec3;
use lanecast_io::{Development, LoadError};
use lanecast_model::scene::{Camera, Instances, Scene, Timeline};
use lanecast_picture::render::{Backdrop, RenderConfig};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of `render` that pages set; all others are as `view` was started.
const SETTABLE: [&str; 19] = [
    "size",
    "frames",
    "camera",
    "view",
    "orbit",
    "fit",
    "eye",
    "look-at",
    "up",
    "fov-y",
    "orthographic",
    "integrator",
    "precision",
    "spp",
    "exposure",
    "view-transform",
    "background",
    "shutter",
    "shutter-slices",
];

/// Integrators that show light: they take samples, and a shutter blurs them.
const LIT: [&str; 4] = ["auto", "direct", "path", "ao"];

/// Integrators that show a ground.
const GROUNDED: [&str; 3] = ["auto", "path", "ao"];

/// The one of them that takes no value.
const FLAG: &str = "fit";

/// What `view` was started with.
pub struct Base {
    pub scene: Option<PathBuf>,
    /// The arguments of `render` that pages do not set.
    tokens: Vec<String>,
    /// Those that they do, by name.
    pub options: BTreeMap<String, String>,
    pub threads: Option<u32>,
}

/// What a page asks to see.
#[derive(Clone, Debug, Deserialize)]
pub struct Look {
    /// A number of the page's own, which answers repeat.
    pub id: u64,
    pub options: BTreeMap<String, String>,
}

/// A picture that can be rendered.
pub struct Shot {
    pub config: RenderConfig,
    pub development: Development,
    pub camera: Camera,
    /// With the lights that the picture needs, at its time.
    pub scene: Scene,
    /// Of the picture's scene, if that is not the file's at its beginning.
    pub placed: Option<Instances>,
    /// Whether the scene is seen at its beginning, and at no other time.
    pub is_still: bool,
    /// The camera's row in the scene, unless it was made.
    pub row: Option<usize>,
    /// Number of slices of the shutter that is asked for.
    pub slices: Option<u32>,
    pub command: String,
}

/// What a page is told of the picture that it gets.
#[derive(Serialize)]
#[serde(tag = "kind", rename = "seen")]
pub struct Seen<'s> {
    id: u64,
    /// Of the scene.
    revision: u64,
    command: &'s str,
    width: u32,
    height: u32,
    integrator: &'static str,
    spp: u32,
    eye: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    forward: [f64; 3],
    /// Half the picture's height: at distance 1, or of parallel rays in world units.
    half_height: f64,
    is_parallel: bool,
    /// How far along the view axis the middle of the scene lies.
    depth: f64,
}

impl Base {
    /// Takes the arguments of the command as they were written. Refuses what a page has no use for.
    pub fn of(args: &PageArgs, tokens: Vec<String>) -> Result<Base, CliError> {
        let render = &args.render;
        let refused = [
            ("-o", render.output.is_some(), "the page saves its picture"),
            (
                "--accuracy",
                render.accuracy.is_some(),
                "choose --precision and --spp",
            ),
            (
                "--samples",
                render.light.samples.is_some(),
                "a page shows whole pictures",
            ),
            (
                "--tile",
                render.outputs.tile.is_some(),
                "a page shows whole pictures",
            ),
            (
                "--frames",
                render.sequence.frames.is_some(),
                "a page shows one picture at a time",
            ),
            (
                "--denoise",
                render.outputs.denoise,
                "a page shows pictures as they are traced",
            ),
            (
                "--display",
                render.outputs.display.is_some(),
                "the page is one",
            ),
            (
                "--aov",
                render.outputs.aov.is_some(),
                "choose what is shown with --integrator",
            ),
            (
                "--stats",
                render.common.stats.is_some(),
                "render writes them",
            ),
            ("--json", render.common.json.is_some(), "render writes it"),
        ];
        if let Some((name, _, why)) = refused.iter().find(|(_, is, _)| *is) {
            return Err(CliError::Usage(format!(
                "{name} is not for view: {why}; leave it out"
            )));
        }
        if render.scene.as_deref() == Some(Path::new(STDIN)) {
            return Err(CliError::Usage(
                "a page watches its scene, and standard input is read once; name a file".into(),
            ));
        }
        let mut base = Base {
            scene: render.scene.clone(),
            tokens: Vec::new(),
            options: BTreeMap::new(),
            threads: render.common.threads,
        };
        let mut tokens = tokens.into_iter();
        while let Some(token) = tokens.next() {
            let (name, value) = match token.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (&*token, None),
            };
            let own = OWN_OPTIONS.iter().find(|(own, _)| *own == name);
            let set = name
                .strip_prefix("--")
                .filter(|name| SETTABLE.contains(name));
            match (own, set) {
                (Some((_, takes_value)), _) => {
                    if *takes_value && value.is_none() {
                        tokens.next();
                    }
                }
                (None, Some(FLAG)) => {
                    base.options.insert(FLAG.into(), String::new());
                }
                (None, Some(set)) => {
                    let value = value.or_else(|| tokens.next()).unwrap_or_default();
                    base.options.insert(set.into(), value);
                }
                (None, None) => base.tokens.push(token),
            }
        }
        Ok(base)
    }

    /// Returns the arguments of `render` for a look of options that pages may set.
    fn arguments(&self, model: &Model, look: &Look) -> Result<Vec<String>, CliError> {
        let option = |name: &str| look.options.get(name).map(String::as_str);
        let integrator = option("integrator").unwrap_or("auto");
        // A shutter is open only where it is asked for, and where it shows; so is a ground there.
        let asked = option("shutter").is_some_and(|range| range != "0");
        let is_open = asked && model.about.blurs && LIT.contains(&integrator);
        let stands = GROUNDED.contains(&integrator)
            && option("background") != Some("transparent")
            && option("frames").is_none()
            && !is_open;
        let mut arguments = vec!["render".to_owned()];
        let tokens = self.tokens.iter();
        arguments.extend(
            tokens
                .filter(|token| stands || *token != "--ground")
                .cloned(),
        );
        if model.about.has_shutter && !is_open {
            arguments.extend(["--shutter".into(), "0".into()]);
        }
        for (name, value) in &look.options {
            let is_left_out = match &**name {
                "shutter" | "shutter-slices" => !is_open,
                "spp" => !LIT.contains(&integrator),
                _ => false,
            };
            if is_left_out {
                continue;
            }
            if !SETTABLE.contains(&&**name) {
                return Err(CliError::Usage(format!("a page cannot set --{name}")));
            }
            match name == FLAG {
                true => arguments.push(format!("--{name}")),
                // An option's value may begin with a hyphen.
                false => arguments.push(format!("--{name}={value}")),
            }
        }
        Ok(arguments)
    }

    /// Returns the command line of `probe` that tells of this ray; empty for the built-in scene,
    /// which `probe` cannot name.
    pub fn probe_command(&self, org: DVec3, dir: DVec3) -> String {
        const SHARED: [(&str, bool); 9] = [
            ("--format", true),
            ("--allow-outside", false),
            ("--point-radius", true),
            ("--scad-curves", true),
            // Its value, if it has one, stands behind `=`.
            ("--z-up", false),
            ("--clip", true),
            ("--hatch", true),
            ("--variant", true),
            ("--animation", true),
        ];
        let Some(scene) = &self.scene else {
            return String::new();
        };
        let mut arguments = vec!["probe".to_owned(), scene.display().to_string()];
        let mut tokens = self.tokens.iter();
        while let Some(token) = tokens.next() {
            let (name, value) = token
                .split_once('=')
                .map_or((&**token, None), |(a, b)| (a, Some(b)));
            if let Some((_, takes_value)) = SHARED.iter().find(|(shared, _)| *shared == name) {
                arguments.push(token.clone());
                if *takes_value && value.is_none() {
                    arguments.extend(tokens.next().cloned());
                }
            }
        }
        let vector = |[x, y, z]: [f64; 3]| format!("{x:?},{y:?},{z:?}");
        arguments.push(format!("--org={}", vector(org.to_array())));
        arguments.push(format!("--dir={}", vector(dir.to_array())));
        command(&arguments)
    }

    /// Returns the parsed arguments without those that pages set.
    pub fn plain(&self) -> Result<RenderArgs, CliError> {
        parsed([&["render".to_owned()], &*self.tokens].concat())
    }
}

fn parsed(arguments: Vec<String>) -> Result<RenderArgs, CliError> {
    render_args(arguments).map_err(|e| {
        let text = e.render().to_string();
        let text = text.trim().trim_start_matches("error: ");
        // The rest is about --help.
        let text = text.split("\n\n").next().unwrap_or_default();
        CliError::Usage(text.to_owned())
    })
}

impl Shot {
    /// Completes a look by the scene. Refuses what `render` would.
    pub fn of(base: &Base, model: &Model, look: &Look) -> Result<Shot, CliError> {
        let arguments = base.arguments(model, look)?;
        let command = command(&arguments);
        let args = parsed(arguments)?;
        let path = Path::new("view.png");
        let config = args.config()?;
        let development = args.development.checked(path)?;
        memory::check(&config, development.bits, path)?;
        check_alpha(config.backdrop == Backdrop::Transparent, path)?;
        let timeline = args.sequence.timeline().map_err(CliError::Usage)?;
        let seconds = model.scene.seconds.0;
        let frame = timeline.as_ref().map_or((0.0, 1.0), |timeline| {
            (
                timeline.time(timeline.first.into(), seconds),
                timeline.step(seconds),
            )
        });
        let (scene, config) = arranged(&args, model.scene.clone(), config, frame)?;
        let file = named(base.scene.as_deref());
        let (scene, config) = match timeline {
            Some(_) => (scene, config),
            None => {
                let scene = exposed(scene, &config, args.light.ground, file)?;
                match args.light.ground {
                    true => ground::stand_at(scene, file, config, &model.lowest)?,
                    false => (scene, config),
                }
            }
        };
        let is_other = config.ground.is_some() || (timeline.is_none() && config.shutter.is_some());
        let placed = match is_other {
            true => {
                Some(Instances::of(&scene).map_err(|source| LoadError::of_scene(file, source))?)
            }
            false => None,
        };
        let (development, config) = args.development.complete(development, path, config);
        let instances = placed.as_ref().unwrap_or(&model.instances);
        let (scene, camera, row) = lit(scene, &config, instances)?;
        let shot = Shot {
            is_still: timeline.is_none() && config.shutter.is_none(),
            config,
            development,
            camera,
            scene,
            placed,
            row,
            slices: args.shutter.shutter_slices,
            command,
        };
        match timeline {
            Some(timeline) => shot.at_frame(&timeline, frame.0, file),
            None => Ok(shot),
        }
    }

    /// Goes to the first frame of a timeline, which is at `time`.
    fn at_frame(self, timeline: &Timeline, time: f64, path: &Path) -> Result<Shot, CliError> {
        let of_scene = |source| LoadError::of_scene(path, source);
        let time = self
            .config
            .shutter
            .map_or(time, |exposure| exposure.middle());
        let scene = self.scene.at(time).map_err(of_scene)?;
        let instances = Instances::of(&scene).map_err(of_scene)?;
        Ok(Shot {
            config: RenderConfig {
                frame: timeline.first,
                ..self.config
            },
            camera: self.row.map_or(self.camera, |row| scene.cameras.rows[row]),
            scene,
            placed: Some(instances),
            ..self
        })
    }

    /// Describes the picture of look `id`, of the scene of this revision.
    pub fn seen<'s>(&'s self, id: u64, (revision, model): (u64, &Model)) -> Seen<'s> {
        let camera = &self.camera;
        let (center, diagonal) = model.extent;
        let depth = (center - camera.eye).dot(camera.forward);
        Seen {
            id,
            revision,
            command: &self.command,
            width: self.config.width,
            height: self.config.height,
            integrator: metadata::integrator(self.config.integrator),
            spp: self.config.samples(),
            eye: camera.eye.to_array(),
            right: camera.right.to_array(),
            up: camera.up.to_array(),
            forward: camera.forward.to_array(),
            half_height: camera.projection.half_height(),
            is_parallel: camera.projection.is_parallel(),
            // From within the scene, or with it behind, the eye turns about what is near.
            depth: depth.max(diagonal * 0.1),
        }
    }
}

/// Returns the command line of these arguments, for a shell.
fn command(arguments: &[String]) -> String {
    let words = arguments.iter().map(|word| quoted(word));
    let words: Vec<String> = std::iter::once("lanecast".to_owned())
        .chain(words)
        .collect();
    words.join(" ")
}

/// Returns what messages call the scene.
pub fn name(base: &Base) -> String {
    named(base.scene.as_deref()).display().to_string()
}
