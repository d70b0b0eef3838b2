//! The tasks of a job: the product of its axes, numbered in a fixed order, scenes outermost.

use super::axes::{Named, variants, views};
use super::dataset::{DatasetSettings, Format, Random, bop_picture, check_dataset, check_random};
use super::job::{Frame, Job, Tile};
use super::options::parsed;
use super::ranges::MOST_NUMBERS;
use super::scenes;
use super::template::{Field, Template, Value};
use crate::args::{RenderArgs, TileChoice, TileGrid};
use crate::error::CliError;
use clap::Command;
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::path::{Component, Path, PathBuf};

/// The axes of a job. A task's number counts its tile, frame, draw, view, variant and scene, in this
/// order.
pub struct Tasks {
    /// The folder that scenes count from.
    folder: PathBuf,
    scenes: Vec<PathBuf>,
    variants: Vec<Named>,
    views: Vec<Named>,
    frames: Vec<Option<u32>>,
    random: Option<Random>,
    tiles: Option<TileGrid>,
    template: Template,
    /// By variant: the first variant that loads scenes alike.
    loads: Vec<usize>,
    /// What is written about each picture, if something is.
    pub dataset: Option<DatasetSettings>,
    /// `lanecast render`, which parses the options of tasks.
    render: Command,
}

/// One picture, or a tile of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    pub number: u32,
    /// The row of its scene, and of its variant.
    pub scene: usize,
    variant: usize,
    view: usize,
    draw: u32,
    pub frame: Option<u32>,
    pub tile: Option<TileChoice>,
    /// The picture, in the folder of the run.
    pub picture: PathBuf,
    /// That, or the file of the tile.
    pub output: PathBuf,
}

impl Tasks {
    /// Multiplies the axes of a job. Fails where options are wrong, and where two tasks would
    /// write one picture.
    pub fn new(job: &Job, path: &Path, render: Command) -> Result<Tasks, CliError> {
        let failed = |why: String| CliError::Input(format!("{}: {why}", path.display()));
        let frames: Vec<Option<u32>> = match &job.frame.0[..] {
            [] => vec![None],
            frames => {
                let numbers = Frame::numbers(frames);
                let numbers = numbers.map_err(|why| failed(format!("frame: {why}")))?;
                numbers.into_iter().map(Some).collect()
            }
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let views = views(job, folder).map_err(&failed)?;
        let variants = variants(job, &render).map_err(&failed)?;
        check_random(job, &render).map_err(|why| failed(format!("[random]: {why}")))?;
        check_dataset(job).map_err(|why| failed(format!("[dataset]: {why}")))?;
        let draws = job
            .random
            .as_ref()
            .map_or(1, |random| random.count as usize);
        let scenes = scenes::found(&job.scene.0, path)?;
        let template = template(job, [views.len(), variants.len()]).map_err(&failed)?;
        let tiles = job.tile.as_ref().map(Tile::grid).transpose();
        let tiles = tiles.map_err(|why| failed(format!("tile: {why}")))?;
        if tiles.is_some() && job.dataset.is_some() {
            let why = "tile: a data set is made of whole pictures; leave out [dataset] or tile";
            return Err(failed(why.into()));
        }
        let counts = [
            scenes.len(),
            variants.len(),
            views.len(),
            draws,
            frames.len(),
            tiles.map_or(1, |grid| grid.count() as usize),
        ];
        let count: u128 = counts.iter().map(|n| *n as u128).product();
        if count > u128::from(MOST_NUMBERS) {
            return Err(failed(format!(
                "the job has {count} tasks; at most {MOST_NUMBERS} are possible: make several jobs \
                 of it"
            )));
        }
        let mut tasks = Tasks {
            loads: Vec::new(),
            folder: folder.into(),
            scenes,
            variants,
            views,
            frames,
            random: job.random.clone(),
            tiles,
            template,
            dataset: job.dataset.clone(),
            render,
        };
        tasks.loads = tasks.check(path)?;
        Ok(tasks)
    }

    pub fn len(&self) -> usize {
        self.loadings_of_axes() * self.of_loading()
    }

    /// Returns the number of tasks of each picture.
    pub fn of_picture(&self) -> usize {
        self.tiles.map_or(1, |grid| grid.count() as usize)
    }

    /// Returns the number of tasks of a scene in one variant.
    fn of_loading(&self) -> usize {
        self.views.len() * self.draws() * self.frames.len() * self.of_picture()
    }

    fn draws(&self) -> usize {
        self.random
            .as_ref()
            .map_or(1, |random| random.count as usize)
    }

    fn loadings_of_axes(&self) -> usize {
        self.scenes.len() * self.variants.len()
    }

    /// Returns the task of a number below [`Tasks::len`].
    pub fn task(&self, number: u32) -> Task {
        let row = number as usize;
        let (row, tile) = (row / self.of_picture(), row % self.of_picture());
        let picture = row as u32;
        let tile = self.tiles.map(|grid| TileChoice {
            number: tile as u32,
            grid,
        });
        let (row, frame) = (row / self.frames.len(), row % self.frames.len());
        let (row, draw) = (row / self.draws(), row % self.draws());
        let (row, view) = (row / self.views.len(), row % self.views.len());
        let (scene, variant) = (row / self.variants.len(), row % self.variants.len());
        let frame = self.frames[frame];
        let path = &self.scenes[scene];
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let output = self.template.filled(|field| match field {
            Field::Scene => Value::Name(&stem),
            Field::File => Value::Name(&file),
            Field::Folder => Value::Path(path.parent().unwrap_or(Path::new(""))),
            Field::Camera => Value::Name(&self.views[view].name),
            Field::Variant => Value::Name(&self.variants[variant].name),
            Field::Frame => Value::Number(frame.unwrap_or(0)),
            Field::Draw => Value::Number(draw as u32),
            Field::Task => Value::Number(picture),
        });
        let name: PathBuf = match self.dataset.as_ref().is_some_and(|d| d.writes(Format::Bop)) {
            true => bop_picture(number).into(),
            false => output.into(),
        };
        Task {
            number,
            scene,
            variant,
            view,
            draw: draw as u32,
            frame,
            tile,
            output: match tile {
                Some(tile) => of_tile(&name, tile),
                None => name.clone(),
            },
            picture: name,
        }
    }

    /// Lists what the scenes are called in the job.
    pub fn scenes(&self) -> impl Iterator<Item = &Path> {
        self.scenes.iter().map(PathBuf::as_path)
    }

    /// Returns the number of tasks of each scene.
    pub fn of_one_scene(&self) -> usize {
        self.len() / self.scenes.len()
    }

    /// Returns what a task's scene is called in the job.
    pub fn scene(&self, task: &Task) -> &Path {
        &self.scenes[task.scene]
    }

    /// Returns the path of a task's scene.
    pub fn scene_path(&self, task: &Task) -> PathBuf {
        without_detours(self.folder.join(&self.scenes[task.scene]))
    }

    pub fn camera(&self, task: &Task) -> &str {
        &self.views[task.view].name
    }

    pub fn variant(&self, task: &Task) -> &str {
        &self.variants[task.variant].name
    }

    /// Returns a number that tasks share which load their scene alike.
    pub fn loading(&self, task: &Task) -> usize {
        match self.loads_each_draw() {
            true => self.sequence(task),
            false => task.scene * self.variants.len() + self.loads[task.variant],
        }
    }

    /// Counts the numbers of [`Tasks::loading`].
    pub fn loadings(&self) -> usize {
        match self.loads_each_draw() {
            true => self.sequences(),
            false => self.loadings_of_axes(),
        }
    }

    /// Returns a number that tasks share which differ in their frames and tiles alone.
    pub fn sequence(&self, task: &Task) -> usize {
        task.number as usize / (self.frames.len() * self.of_picture())
    }

    /// Counts the numbers of [`Tasks::sequence`].
    pub fn sequences(&self) -> usize {
        self.len() / (self.frames.len() * self.of_picture())
    }

    fn loads_each_draw(&self) -> bool {
        self.random.as_ref().is_some_and(Random::changes_scenes)
    }

    /// Returns the options of a task, without its scene and output.
    pub fn options(&self, task: &Task) -> Vec<String> {
        let frames = task
            .frame
            .map(|i| format!("--frames={i}..{}", u64::from(i) + 1));
        let view = self.views[task.view].arguments.iter().cloned();
        let variant = self.variants[task.variant].arguments.iter().cloned();
        let tile = task.tile.map(|tile| format!("--tile={tile}"));
        let drawn = self.random.iter();
        let drawn = drawn.flat_map(|random| random.arguments(self.sequence(task) as u32));
        let of_view = view.chain(frames).chain(drawn);
        of_view.chain(variant).chain(tile).collect()
    }

    /// Returns the arguments after `lanecast` by which the same picture is rendered alone.
    pub fn command(&self, task: &Task, out: &Path) -> Vec<OsString> {
        let mut line: Vec<OsString> = vec!["render".into(), self.scene_path(task).into()];
        line.extend(["-o".into(), out.join(&task.output).into()]);
        line.extend(self.options(task).into_iter().map(OsString::from));
        line
    }

    /// Returns `lanecast render`, of which each thread needs one.
    pub fn parser(&self) -> Command {
        self.render.clone()
    }

    /// Parses the arguments of a task.
    pub fn render_args(
        &self,
        task: &Task,
        out: &Path,
        render: &mut Command,
    ) -> Result<RenderArgs, String> {
        parsed(render, &self.command(task, out)[1..])
    }

    /// Checks all options, once for each row that brings some, and that pictures have names of
    /// their own inside of the folder. Returns, for each variant, the first that loads scenes alike.
    fn check(&self, path: &Path) -> Result<Vec<usize>, CliError> {
        let failed = |why: String| CliError::Input(format!("{}: {why}", path.display()));
        let row = |variant: usize, view: usize| {
            let of_view = self.of_loading() / self.views.len();
            (variant * self.of_loading() + view * of_view) as u32
        };
        let of_variants = (0..self.variants.len()).map(|variant| row(variant, 0));
        let of_views = (0..self.views.len()).map(|view| row(0, view));
        let mut render = self.parser();
        let mut options: Vec<String> = Vec::new();
        for number in of_variants.chain(of_views) {
            let task = self.task(number);
            let tables = match self.random {
                Some(_) => "[render] with a draw of [random]",
                None => "[render]",
            };
            let of = match self.variant(&task) {
                "" => tables.to_owned(),
                name => format!("{tables} and variant {name}"),
            };
            let wrong = |why: String| failed(format!("{of}: {why}"));
            let args = self
                .render_args(&task, Path::new(""), &mut render)
                .map_err(wrong)?;
            super::picture::check(&args, &task.picture).map_err(|e| wrong(e.to_string()))?;
            if options.len() < self.variants.len() {
                options.push(format!("{:?}", args.load_options(Vec::new())));
            }
        }
        let mut first: HashMap<PathBuf, u32> = HashMap::new();
        for number in 0..self.len() as u32 {
            let task = self.task(number);
            if task.tile.is_some_and(|tile| tile.number > 0) {
                continue;
            }
            let (beside, _) = self.beside(&task);
            let output = task.picture;
            let inside = |part: Component| matches!(part, Component::Normal(_));
            if !output.components().all(inside) || output.file_name().is_none() {
                return Err(failed(format!(
                    "output: {} is not inside of the folder of the run; write names without a / at \
                     the beginning and without ..",
                    output.display()
                )));
            }
            for file in std::iter::once(output).chain(beside) {
                if let Some(other) = first.insert(file, number) {
                    return Err(failed(self.same(other, number)));
                }
            }
        }
        let first = |own: &String| options.iter().position(|other| other == own);
        Ok(options.iter().filter_map(first).collect())
    }

    fn file_name(&self, task: &Task) -> Option<&OsStr> {
        self.scenes[task.scene].file_name()
    }

    /// Says what tells two tasks apart that would write the same picture.
    fn same(&self, a: u32, b: u32) -> String {
        let (a, b) = (self.task(a), self.task(b));
        let has = |field| self.template.has(field);
        let (field, place) = match (a.scene != b.scene, a.variant != b.variant, a.view != b.view) {
            (true, ..) if !has(Field::Scene) && !has(Field::File) => (Field::Scene, "{scene}"),
            (true, ..) if !has(Field::File) && self.file_name(&a) != self.file_name(&b) => {
                (Field::File, "{file}")
            }
            (true, ..) => (Field::Folder, "{folder}"),
            (_, true, _) => (Field::Variant, "{variant}"),
            (_, _, true) => (Field::Camera, "{camera}"),
            _ if a.draw != b.draw => (Field::Draw, "{draw:05}"),
            _ => (Field::Frame, "{frame:04}"),
        };
        let (name, other) = match field {
            Field::Variant => (self.variant(&a), self.variant(&b)),
            Field::Camera => (self.camera(&a), self.camera(&b)),
            _ => ("", "-"),
        };
        match field {
            Field::Variant if name == other => {
                return format!("variant: two are called '{name}'; give each a name of its own");
            }
            Field::Camera if name == other => {
                return format!(
                    "camera, view, orbit: two views are called '{name}'; each camera and view is \
                     listed once"
                );
            }
            Field::Frame if a.frame == b.frame => {
                let frame = a.frame.unwrap_or(0);
                return format!("frame: {frame} is listed twice; list it once");
            }
            _ => {}
        }
        // Names of different rows may be alike in a path.
        let place = if has(field) { "{task:05}" } else { place };
        format!(
            "output: tasks {} and {} would both write {}; add {place} to it",
            a.number,
            b.number,
            a.picture.display()
        )
    }
}

/// Returns the file of a picture's tile: `a/x.png` has `a/x.png.tiles/03.tile`.
fn of_tile(picture: &Path, tile: TileChoice) -> PathBuf {
    let mut folder = picture.as_os_str().to_os_string();
    folder.push(".tiles");
    Path::new(&folder).join(format!("{:02}.tile", tile.number))
}

/// Returns a path without `a/..`, where that leads to the same file.
fn without_detours(path: PathBuf) -> PathBuf {
    let mut short = PathBuf::new();
    for part in path.components() {
        let last = short.components().next_back();
        match (part, last) {
            (Component::ParentDir, Some(Component::Normal(_))) => {
                short.pop();
            }
            _ => short.push(part),
        }
    }
    let is_same = || Some(short.canonicalize().ok()? == path.canonicalize().ok()?);
    match short == path || is_same() != Some(true) {
        true => path,
        false => short,
    }
}

/// Reads the template, or makes one of the axes with several rows.
fn template(job: &Job, [views, variants]: [usize; 2]) -> Result<Template, String> {
    let text = job.output.clone().unwrap_or_else(|| {
        let mut text = String::from("{scene}");
        let axes = [
            (views > 1, "_{camera}"),
            (variants > 1, "_{variant}"),
            (job.random.is_some(), "_{draw:05}"),
            (!job.frame.0.is_empty(), "_{frame:04}"),
        ];
        axes.iter()
            .for_each(|(is, place)| text.push_str(if *is { place } else { "" }));
        text + ".png"
    });
    let template = Template::parse(&text).map_err(|why| format!("output: {why}"))?;
    let has_views = !job.camera.0.is_empty() || !job.view.0.is_empty() || !job.orbit.0.is_empty();
    let absent = [
        (
            Field::Camera,
            has_views,
            "{camera}",
            "camera, view or orbit",
        ),
        (
            Field::Variant,
            !job.variant.0.is_empty(),
            "{variant}",
            "variant",
        ),
        (Field::Frame, !job.frame.0.is_empty(), "{frame}", "frame"),
        (Field::Draw, job.random.is_some(), "{draw}", "[random]"),
    ];
    for (field, is_there, place, key) in absent {
        if template.has(field) && !is_there {
            return Err(format!(
                "output: {place} has no value, for the job has no {key}"
            ));
        }
    }
    Ok(template)
}
