//! The files of a scene: what their importers share, and files that others place.
//!
//! A placed file is read once, however often it is placed; a node of the scene stands for it. Its
//! rows are added to the scene's tables as any importer adds them, so that its ids stay as they
//! are, and its names get its own name before them: `engine/wheel`.

use super::lower_views::is_seen;
use super::places::FilePlaces;
use super::source_spans::At;
use super::tree::{Source, nearest, quoted};
use crate::scene::{Entity, Lit, MaterialId, NodeId, RowCounts, SceneBuilder, Surroundings};
use crate::shared::images::ImageStore;
use crate::shared::messages::one_line;
use crate::{Folder, ImportReport, LoadError, LoadOptions};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// How deep files may lie in each other: each level takes a part of the stack.
const MOST_LEVELS: usize = 16;

/// The most copies that the `repeat`s of all files of a scene make: a copy takes some 220 bytes.
const MOST_COPIES: u64 = 1 << 22;

/// What the importers of a scene's files share.
#[derive(Default)]
pub(crate) struct Files {
    pub images: ImageStore,
    placed: HashMap<Placing, Rc<PlacedFile>>,
    /// The files that are being read, each named by the one before, and their names there.
    open: Vec<(PathBuf, String)>,
    /// How many files have a name in the file that places them.
    names: HashMap<(PathBuf, String), usize>,
    places: Vec<FilePlaces>,
    copies: u64,
}

/// What makes a placed file another one.
#[derive(PartialEq, Eq, Hash)]
struct Placing {
    path: PathBuf,
    materials: Vec<(String, MaterialId)>,
    keeps_uvs: bool,
}

/// A file that is a node of the scene.
pub(super) struct PlacedFile {
    pub node: NodeId,
    /// The cameras and lights in its own world.
    pub views: Surroundings,
    /// The file's name without folder and ending, and a number where another file beside it, or
    /// the same with other materials, has that.
    pub name: String,
}

/// A material of a placed file by name, and the one in its place.
pub(super) type Overrides<'a> = Vec<(&'a At<String>, MaterialId)>;

impl Files {
    /// Returns what the importers of a scene share whose own file is `path`.
    pub(crate) fn of(path: &Path) -> Files {
        let name = path.file_name().unwrap_or(path.as_os_str());
        let name = name.to_string_lossy().into_owned();
        let path = path.canonicalize().unwrap_or_else(|_| path.into());
        Files {
            open: vec![(path, name)],
            ..Files::default()
        }
    }

    /// Says whether the file that is read is one that another places.
    pub(super) fn is_placing(&self) -> bool {
        self.open.len() > 1
    }

    /// Returns the file of an entity, and line and column there, as far as they are known.
    pub(crate) fn find(&self, what: &Entity) -> Option<(&Path, Option<(u32, u32)>)> {
        // A file's own rows are a range within which other files' may lie, which end sooner.
        self.places.iter().find_map(|file| file.find(what))
    }

    pub(super) fn add_places(&mut self, of: FilePlaces) {
        self.places.push(of);
    }

    /// Counts copies that are about to be made. Fails with a message if they are too many.
    pub(super) fn spend_copies(&mut self, count: u64) -> Result<(), String> {
        self.copies = self.copies.saturating_add(count);
        if self.copies <= MOST_COPIES {
            return Ok(());
        }
        Err(format!(
            "all repeats of a scene make {MOST_COPIES} copies at most, and with this one they are \
             {}; put a repeat into a node and repeat that: 1000 of 1000 are stored as 2000",
            self.copies
        ))
    }

    /// Names a file within the one that is being read.
    fn name_of(&mut self, path: &Path) -> String {
        let stem = path.file_stem().unwrap_or_default();
        let stem = one_line(&stem.to_string_lossy());
        let within = self
            .open
            .last()
            .map_or(PathBuf::new(), |(path, _)| path.clone());
        let count = self.names.entry((within, stem.clone())).or_default();
        *count += 1;
        match *count {
            1 => stem,
            n => format!("{stem}_{n}"),
        }
    }

    /// Returns the path of a scene file that another names, unless that file is being read.
    fn path(
        &self,
        (source, file): (&Source, &At<String>),
        options: &LoadOptions,
    ) -> Result<PathBuf, LoadError> {
        let name = quoted(&file.value);
        let refuse = |why: String| source.error(file.at, format!("the scene file {name} {why}"));
        let folder = Folder::new(source.path, options);
        let path = folder.resolve(&file.value).map_err(|e| match e {
            LoadError::Read { source: why, .. } => refuse(format!("cannot be read: {why}")),
            other => other,
        })?;
        if path.is_dir() {
            return Err(refuse("is a folder; name a file in it".into()));
        }
        if let Some(first) = self.open.iter().position(|(open, _)| *open == path) {
            let chain = self.open[first..].iter().map(|(_, name)| quoted(name));
            let chain = chain.chain([name.clone()]).collect::<Vec<_>>();
            let chain = chain.join(" → ");
            return Err(refuse(format!("would contain itself: {chain}")));
        }
        if self.open.len() >= MOST_LEVELS {
            let why = format!("lies in other scene files {MOST_LEVELS} deep; place it higher up");
            return Err(refuse(why));
        }
        Ok(path)
    }

    /// Returns a file as a node of the scene; reads it if it is new. Fails if it cannot be read, has
    /// nothing to place, contains itself, or has no material of a name of `overrides`.
    pub(super) fn place(
        &mut self,
        (source, file): (&Source, &At<String>),
        overrides: &Overrides,
        options: &LoadOptions,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<Rc<PlacedFile>, LoadError> {
        let path = self.path((source, file), options)?;
        let mut materials: Vec<(String, MaterialId)> = Vec::with_capacity(overrides.len());
        materials.extend(overrides.iter().map(|(name, id)| (name.value.clone(), *id)));
        materials.sort_unstable();
        let placing = Placing {
            path,
            materials,
            keeps_uvs: options.keeps_uvs,
        };
        if let Some(known) = self.placed.get(&placing) {
            return Ok(known.clone());
        }
        let name = self.name_of(&placing.path);
        // Where materials are replaced, so are those of the files within.
        let shared = match overrides.is_empty() {
            true => HashMap::new(),
            false => std::mem::take(&mut self.placed),
        };
        let since = scene.row_counts();
        let first_places = self.places.len();
        let mut views = Surroundings::default();
        scene.swap_surroundings(&mut views);
        let own_options = LoadOptions {
            variant: None,
            animation: None,
            ..options.clone()
        };
        self.open.push((placing.path.clone(), file.value.clone()));
        let left_out = report.summary();
        crate::import(&placing.path, &own_options, self, scene, report)?;
        self.open.pop();
        let replaced = replaced((source, file), overrides, &since, scene)?;
        scene.replace_materials(&since, &replaced);
        scene.swap_surroundings(&mut views);
        if views.roots.is_empty() {
            let why = report
                .summary()
                .filter(|all| left_out.as_ref() != Some(all));
            let why = why.map_or(String::new(), |why| format!("; {why}"));
            let message = format!(
                "the scene file {} has nothing to see{why}",
                quoted(&file.value)
            );
            return Err(source.error(file.at, message));
        }
        scene.prefix_names(&since, &format!("{name}/"));
        let first_edge = scene.tables().edges.len();
        let node = scene.node_of_roots(&name, &views.roots);
        for file in &mut self.places[first_places..] {
            if let FilePlaces::Text { at, .. } = file {
                at.become_placed(first_edge);
            }
        }
        self.places.push(FilePlaces::Rows {
            path: placing.path.clone(),
            rows: Box::new([since, scene.row_counts()]),
        });
        keep_groups(&views, &since, scene);
        count_left_out(&views, scene, report);
        if !overrides.is_empty() {
            self.placed = shared;
        }
        let made = Rc::new(PlacedFile { node, views, name });
        self.placed.insert(placing, made.clone());
        Ok(made)
    }
}

/// Finds the materials of a placed file that others take the place of.
fn replaced(
    (source, file): (&Source, &At<String>),
    overrides: &Overrides,
    since: &RowCounts,
    scene: &SceneBuilder,
) -> Result<HashMap<MaterialId, MaterialId>, LoadError> {
    let materials = &scene.tables().materials;
    let rows = since.materials as u32..materials.len() as u32;
    let named = || {
        rows.clone()
            .filter_map(|row| Some((row, materials.names.get(row)?)))
    };
    let mut replaced = HashMap::new();
    for (name, by) in overrides {
        let before = replaced.len();
        let found = named().filter(|(_, known)| *known == name.value);
        replaced.extend(found.map(|(row, _)| (MaterialId(row), *by)));
        if replaced.len() > before {
            continue;
        }
        let (file, shown) = (quoted(&file.value), quoted(&name.value));
        let hint = match nearest(&name.value, named().map(|(_, known)| known)) {
            Some(like) => format!("did you mean {}?", quoted(like)),
            None if named().next().is_none() => "its materials have no names".into(),
            None => {
                let mut known: Vec<String> = named().map(|(_, known)| quoted(known)).collect();
                known.dedup();
                known.truncate(10);
                format!("it has {}", known.join(", "))
            }
        };
        let message = format!("the scene file {file} has no material {shown}; {hint}");
        return Err(source.error(name.at, message));
    }
    Ok(replaced)
}

/// Puts the materials of a placed file into the groups of lights that it has them in.
fn keep_groups(views: &Surroundings, since: &RowCounts, scene: &mut SceneBuilder) {
    let groups = &views.light_groups;
    let names: Vec<&str> = groups.names().collect();
    if names.is_empty() {
        return;
    }
    for row in since.materials as u32..scene.tables().materials.len() as u32 {
        let lit = Lit::Material(MaterialId(row));
        if let Some(group) = groups.of(lit) {
            scene.light_group(names[group as usize], lit);
        }
    }
}

/// Counts what a placed file has for its own picture alone.
fn count_left_out(views: &Surroundings, scene: &SceneBuilder, report: &mut ImportReport) {
    let background = usize::from(is_seen(views.background));
    report.add_many("background of a placed file", background);
    let environment = usize::from(views.environment.is_some());
    report.add_many("environment of a placed file", environment);
    let own = &scene.tables().seconds;
    let other_pace = views.seconds != *own && views.seconds != Default::default();
    report.add_many("seconds of a placed file", usize::from(other_pace));
}
