//! Importer of 3MF: objects, their components, and what is built of them.
//!
//! A mesh is stored once, and an object of components becomes a node, however often either is
//! placed. Build items are instances. A scene's unit is the millimetre: items in other units are
//! scaled. z is up in 3MF, and y in a scene: (x, y, z) of the file is (x, z, −y) of the scene.
//!
//! `package` opens the archive, `xml` reads its parts, `model` and `properties` make rows of them,
//! `mesh` makes meshes and materials; this file joins them. An archive of a megabyte can hold a
//! gigabyte: bytes and elements are counted while they are read. Parts of the production extension
//! are read; so are colours, mixtures and textures of the materials extension.
//!
//! Supports, and objects of type `other` (regions of other settings, in files of slicers), are
//! left out, as slicers do. 3MF Core Specification 1.3.

mod mesh;
mod model;
mod package;
mod properties;
mod xml;

use crate::math::Affine;
use crate::scene::{Edge, SceneBuilder};
use crate::shared::images::ImageStore;
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError, LoadOptions};
use mesh::{Looks, is_shown};
use model::{Model, Placed, Role, Wrong};
use package::Package;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// Vertices, triangles and other elements that a file of any size may have, and the bytes of the
/// file that justify one more: a vertex or triangle hardly ever has less than 8.
const FREE_ELEMENTS: u64 = 1 << 22;
const BYTES_AN_ELEMENT: u64 = 4;

/// Reads a 3MF file into the builder.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    images: &mut ImageStore,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = options.read(path)?;
    let elements = FREE_ELEMENTS + bytes.len() as u64 / BYTES_AN_ELEMENT;
    let mut package = Package::open(path, bytes)?;
    let root = package.root()?;
    let mut models = Models {
        path,
        all: Vec::new(),
        row_of: HashMap::new(),
        elements,
    };
    models.read_all(&mut package, root, report)?;
    let looks = Looks::new(&mut package, images, options.keeps_uvs);
    models.place(looks, scene, report)
}

/// The model parts of a package.
struct Models<'p> {
    path: &'p Path,
    /// The package's model first, then those that it names.
    all: Vec<Model>,
    /// By name, as [`package::key`] makes it.
    row_of: HashMap<String, usize>,
    /// Elements that may still be read.
    elements: u64,
}

/// An object by the rows of its model and of itself.
type ObjectRow = (usize, usize);

/// How far an object has been imported.
#[derive(Clone, Copy)]
enum State {
    Begun,
    /// `None` if it shows nothing.
    Done(Option<Edge>),
}

impl Models<'_> {
    fn invalid(&self, place: &str, message: String) -> LoadError {
        LoadError::Invalid {
            path: self.path.into(),
            place: one_line(place),
            message,
        }
    }

    /// Reads the package's model and all parts that it and its parts name.
    fn read_all(
        &mut self,
        package: &mut Package,
        root: String,
        report: &mut ImportReport,
    ) -> Result<(), LoadError> {
        let mut waiting = vec![root];
        while let Some(name) = waiting.pop() {
            let key = package::key(&name);
            if self.row_of.contains_key(&key) {
                continue;
            }
            self.row_of.insert(key, self.all.len());
            let model = self.read(package, &name, report)?;
            // Only the package's own model is built.
            let items = model.items.iter().filter(|_| self.all.is_empty());
            let components = model.objects.iter().flat_map(|object| &object.components);
            let named = items.chain(components).filter_map(|of| of.path.clone());
            waiting.extend(named);
            self.all.push(model);
        }
        Ok(())
    }

    fn read(
        &mut self,
        package: &mut Package,
        name: &str,
        report: &mut ImportReport,
    ) -> Result<Model, LoadError> {
        let most = package.left;
        let path = self.path;
        let wrong = |place: &str, message: String| LoadError::Invalid {
            path: path.into(),
            place: one_line(place),
            message,
        };
        let elements = &mut self.elements;
        let mut spend = |count: u64| match elements.checked_sub(count) {
            Some(left) => {
                *elements = left;
                Ok(())
            }
            None => Err("it holds far more than the size of the file justifies".to_string()),
        };
        let stream = package.stream(name);
        let stream = stream.map_err(|why| wrong(name, why))?;
        match model::read(stream, name, most, &mut spend, report) {
            Ok((model, left)) => {
                package.left = left;
                Ok(model)
            }
            Err(Wrong::At(line, message)) => Err(wrong(&format!("{name}, line {line}"), message)),
            Err(Wrong::Unsupported(what, remedy)) => Err(LoadError::Unsupported {
                path: path.into(),
                what,
                remedy: Some(remedy),
            }),
        }
    }

    /// Finds the object that a component or an item of a model places.
    fn target(&self, from: usize, placed: &Placed) -> Result<ObjectRow, LoadError> {
        let part = match &placed.path {
            None => from,
            Some(path) => self.row_of[&package::key(path)],
        };
        let model = &self.all[part];
        match model.row_of.get(&placed.id) {
            Some(row) => Ok((part, *row)),
            None => {
                let message = format!("there is no object {}, which is placed", placed.id);
                Err(self.invalid(&model.name, message))
            }
        }
    }

    /// Adds what is built to the scene.
    fn place(
        &mut self,
        mut looks: Looks,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<(), LoadError> {
        let mut states: HashMap<ObjectRow, State> = HashMap::new();
        let millimetres = self.all[0].millimetres;
        let scene_from_file = Affine::new(
            [
                [millimetres, 0.0, 0.0],
                [0.0, 0.0, -millimetres],
                [0.0, millimetres, 0.0],
            ],
            [0.0; 3],
        );
        for item in std::mem::take(&mut self.all[0].items) {
            let target = self.target(0, &item)?;
            self.import(target, &mut states, &mut looks, scene, report)?;
            let Some(State::Done(Some(edge))) = states.get(&target) else {
                continue;
            };
            let map = self.parent_from_object(0, target, &item);
            let map = scene.transform(scene_from_file.then_after(&map));
            let (part, row) = target;
            let name = &self.all[part].objects[row].name;
            scene.instance(name, edge.transform(map));
        }
        let objects = self.all.iter().flat_map(|model| &model.objects);
        let left = objects.filter(|object| is_shown(object)).count();
        report.add_many("object that is not built", left);
        Ok(())
    }

    /// Returns the map from an object to what places it in the model `from`.
    fn parent_from_object(&self, from: usize, (part, _): ObjectRow, placed: &Placed) -> Affine {
        let ratio = self.all[part].millimetres / self.all[from].millimetres;
        if ratio == 1.0 {
            return placed.map;
        }
        let scale = [[ratio, 0.0, 0.0], [0.0, ratio, 0.0], [0.0, 0.0, ratio]];
        placed.map.then_after(&Affine::new(scale, [0.0; 3]))
    }

    /// Imports an object and all that it is made of, unless it is already. Fails if it is a part
    /// of itself.
    fn import(
        &mut self,
        object: ObjectRow,
        states: &mut HashMap<ObjectRow, State>,
        looks: &mut Looks,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<(), LoadError> {
        // Objects that are begun, and how many of their components are done.
        let mut open: Vec<(ObjectRow, usize)> = Vec::new();
        if let Entry::Vacant(unseen) = states.entry(object) {
            unseen.insert(State::Begun);
            open.push((object, 0));
        }
        while let Some((top, next)) = open.last_mut() {
            let (part, row) = *top;
            let object = &self.all[part].objects[row];
            if let Some(placed) = object.components.get(*next) {
                *next += 1;
                let target = self.target(part, placed)?;
                match states.get(&target) {
                    Some(State::Done(_)) => {}
                    Some(State::Begun) => {
                        let message = format!("object {} is a part of itself", placed.id);
                        return Err(self.invalid(&self.all[target.0].name, message));
                    }
                    None => {
                        states.insert(target, State::Begun);
                        open.push((target, 0));
                    }
                }
                continue;
            }
            let edge = self.edge((part, row), states, looks, scene, report)?;
            states.insert((part, row), State::Done(edge));
            open.pop();
        }
        Ok(())
    }

    /// Makes the shape or the node of an object whose components are done.
    fn edge(
        &mut self,
        (part, row): ObjectRow,
        states: &HashMap<ObjectRow, State>,
        looks: &mut Looks,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<Option<Edge>, LoadError> {
        let object = &self.all[part].objects[row];
        let mut edges = Vec::new();
        if is_shown(object) {
            let name = object.name.clone();
            let mesh = looks.mesh((part, &mut self.all[part]), row, scene, report);
            let mesh = mesh.map_err(|why| self.invalid(&self.all[part].name, why))?;
            edges.push(Edge::shape(scene.mesh(&name, &mesh)));
        } else if !object.triangles.is_empty() {
            report.add(match object.role {
                Role::Support => "support",
                _ => "object of type 'other'",
            });
        }
        let object = &self.all[part].objects[row];
        if object.components.is_empty() {
            return Ok(edges.pop());
        }
        for placed in &object.components {
            let target = self.target(part, placed)?;
            let Some(State::Done(Some(edge))) = states.get(&target) else {
                continue;
            };
            let map = self.parent_from_object(part, target, placed);
            edges.push(match map.is_identity() {
                true => *edge,
                false => edge.transform(scene.transform(map)),
            });
        }
        Ok((!edges.is_empty()).then(|| Edge::node(scene.node(&object.name, &edges))))
    }
}
