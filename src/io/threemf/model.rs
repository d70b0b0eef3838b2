//! A model part: its objects, property groups and build items as the file lists them.
//!
//! An extension that the part requires and that is not known is refused. What is known but not
//! imported is counted; so are elements of extensions that the part does not require.

use super::properties::{Group, Properties, Texture};
use super::xml::{Space, Step, Tag, Xml};
use crate::ImportReport;
use crate::math::Affine;
use crate::shared::messages::one_line;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::BufRead;

/// Room for how many vertices an object takes beside its name, and so does a place of one.
const OBJECT_COST: u64 = 12;
const PLACED_COST: u64 = 4;

/// What an object is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Role {
    #[default]
    Model,
    /// A mesh without an inside.
    Surface,
    /// What holds a part while it is printed.
    Support,
    /// What is not printed, such as a region of other settings.
    Other,
}

/// A property of each corner of a triangle: rows of a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Property {
    /// The id of the group; 0 for none, for ids count from 1.
    pub group: u32,
    pub rows: [u32; 3],
}

#[derive(Debug, Default)]
pub(super) struct Object {
    pub id: u32,
    pub name: String,
    pub role: Role,
    pub property: Property,
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle, or fewer if the last ones have that of the object.
    pub properties: Vec<Property>,
    pub components: Vec<Placed>,
}

/// An object as a component or a build item places it.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub id: u32,
    /// The part that has the object, if it is another one.
    pub path: Option<String>,
    pub map: Affine,
}

#[derive(Debug, Default)]
pub(super) struct Model {
    /// The part's name.
    pub name: String,
    /// The length of its unit.
    pub millimetres: f64,
    pub objects: Vec<Object>,
    pub row_of: HashMap<u32, usize>,
    pub items: Vec<Placed>,
    pub groups: HashMap<u32, Group>,
    pub textures: HashMap<u32, Texture>,
}

/// An error of a part: its line, and what is wrong; or that it needs what is not supported.
pub(super) enum Wrong {
    At(u64, String),
    Unsupported(String, String),
}

impl From<String> for Wrong {
    fn from(message: String) -> Wrong {
        Wrong::At(0, message)
    }
}

/// The elements that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Element {
    Document,
    Model,
    Resources,
    Object,
    Mesh,
    Vertices,
    Triangles,
    Components,
    Build,
    /// A group of properties, whose elements are its rows.
    Group,
    /// Nothing below counts.
    Skipped,
    /// An element without elements of its own.
    Leaf,
}

/// Reads a model part. `spend` is asked for room for each vertex, triangle and the like; what
/// comes back beside the model is how many bytes may still be read.
pub(super) fn read(
    stream: impl BufRead,
    name: &str,
    most: u64,
    spend: &mut dyn FnMut(u64) -> Result<(), String>,
    report: &mut ImportReport,
) -> Result<(Model, u64), Wrong> {
    let mut xml = Xml::new(stream, most);
    let mut reader = Reader {
        model: Model {
            name: name.into(),
            millimetres: 1.0,
            ..Model::default()
        },
        properties: Properties::default(),
        stack: vec![Element::Document],
        spend,
        report,
    };
    loop {
        let is_end = match xml.step() {
            Ok(Step::Open(tag)) => reader.open(&tag).map(|()| false),
            Ok(Step::Close) => {
                reader.close();
                Ok(false)
            }
            Ok(Step::Other) => Ok(false),
            Ok(Step::End) => Ok(true),
            Err(message) => Err(message.into()),
        };
        match is_end {
            Ok(false) => {}
            Ok(true) => break,
            Err(Wrong::At(_, message)) => return Err(Wrong::At(xml.line(), message)),
            Err(unsupported) => return Err(unsupported),
        }
    }
    let line = xml.line();
    let mut model = reader.model;
    if reader.stack.len() > 1 {
        return Err(Wrong::At(line, "it ends within an element".into()));
    }
    model.groups = reader.properties.groups;
    model.textures = reader.properties.textures;
    for (row, object) in model.objects.iter().enumerate() {
        if model.row_of.insert(object.id, row).is_some() {
            let message = format!("there are two objects {}", object.id);
            return Err(Wrong::At(line, message));
        }
    }
    Ok((model, xml.left()))
}

struct Reader<'r> {
    model: Model,
    properties: Properties,
    stack: Vec<Element>,
    spend: &'r mut dyn FnMut(u64) -> Result<(), String>,
    report: &'r mut ImportReport,
}

impl Reader<'_> {
    fn open(&mut self, tag: &Tag) -> Result<(), Wrong> {
        let above = *self.stack.last().unwrap_or(&Element::Skipped);
        let element = match (above, tag.space, tag.name()) {
            (Element::Vertices, Space::Core, "vertex") => self.vertex(tag)?,
            (Element::Triangles, Space::Core, "triangle") => self.triangle(tag)?,
            (Element::Document, Space::Core, "model") => self.model(tag)?,
            (Element::Document, ..) => {
                let name = one_line(tag.name());
                return Err(format!("its first element is '{name}', not 'model'").into());
            }
            (Element::Model, Space::Core, "resources") => Element::Resources,
            (Element::Model, Space::Core, "build") => Element::Build,
            (Element::Build, Space::Core, "item") => {
                let placed = self.placed(tag)?;
                self.model.items.push(placed);
                Element::Leaf
            }
            (Element::Resources, Space::Core, "object") => self.object(tag)?,
            (Element::Object, Space::Core, "mesh") => Element::Mesh,
            (Element::Object, Space::Core, "components") => Element::Components,
            (Element::Mesh, Space::Core, "vertices") => Element::Vertices,
            (Element::Mesh, Space::Core, "triangles") => Element::Triangles,
            (Element::Components, Space::Core, "component") => {
                let placed = self.placed(tag)?;
                if let Some(object) = self.model.objects.last_mut() {
                    object.components.push(placed);
                }
                Element::Leaf
            }
            (Element::Resources, Space::Core | Space::Material, _) => {
                (self.spend)(tag.cost())?;
                match self.properties.begin(tag, self.report)? {
                    true => Element::Group,
                    false => Element::Skipped,
                }
            }
            (Element::Group, Space::Core | Space::Material, _) => {
                (self.spend)(tag.cost())?;
                self.properties.row(tag)?;
                Element::Leaf
            }
            (Element::Skipped | Element::Leaf, ..) => Element::Skipped,
            (_, space, name) => {
                self.unread(space, name);
                Element::Skipped
            }
        };
        self.stack.push(element);
        Ok(())
    }

    fn close(&mut self) {
        if self.stack.len() > 1 && self.stack.pop() == Some(Element::Group) {
            self.properties.end();
        }
    }

    /// Counts an element that is not read, if it would show.
    fn unread(&mut self, space: Space, name: &str) {
        match space {
            Space::TriangleSets | Space::Production => {}
            Space::Core if matches!(name, "metadata" | "metadatagroup") => {}
            _ => {
                let what = space.geometry().map_or_else(
                    || format!("element '{}' of an extension", one_line(name)),
                    String::from,
                );
                // Slices are of the object that is there as a mesh, too.
                self.report.add(&what);
            }
        }
    }

    /// Reads the unit, and checks that what the part requires is known.
    fn model(&mut self, tag: &Tag) -> Result<Element, Wrong> {
        let [unit, required] = tag.values(["unit", "requiredextensions"])?;
        self.model.millimetres = match unit.as_deref().unwrap_or("millimeter") {
            "micron" => 1e-3,
            "millimeter" => 1.0,
            "centimeter" => 10.0,
            "inch" => 25.4,
            "foot" => 304.8,
            "meter" => 1000.0,
            other => {
                let message = format!(
                    "its unit '{}' is none of micron, millimeter, centimeter, inch, foot and meter",
                    one_line(other)
                );
                return Err(message.into());
            }
        };
        for prefix in required.as_deref().unwrap_or_default().split_whitespace() {
            let Some((space, name)) = tag.prefixed(prefix) else {
                let message = format!(
                    "it requires the extension '{}', whose namespace it does not declare",
                    one_line(prefix)
                );
                return Err(message.into());
            };
            let known = [
                Space::Core,
                Space::Material,
                Space::Production,
                Space::TriangleSets,
            ];
            if !known.contains(&space) {
                let what = match space.geometry() {
                    Some(what) => format!("the required extension '{}' ({what})", one_line(&name)),
                    None => format!("the required extension '{}'", one_line(&name)),
                };
                let remedy = "export the part as plain triangles, as 3MF without it or as STL";
                return Err(Wrong::Unsupported(what, remedy.into()));
            }
        }
        Ok(Element::Model)
    }

    fn object(&mut self, tag: &Tag) -> Result<Element, Wrong> {
        (self.spend)(tag.cost() + OBJECT_COST)?;
        let [id, name, kind, pid, pindex] = tag.values(["id", "name", "type", "pid", "pindex"])?;
        let id = number(id, "object", "id")?;
        let role = match kind.as_deref().unwrap_or("model") {
            "model" => Role::Model,
            "surface" => Role::Surface,
            "support" | "solidsupport" => Role::Support,
            "other" => Role::Other,
            other => {
                let message = format!("object {id} has an unknown type '{}'", one_line(other));
                return Err(message.into());
            }
        };
        let group = optional(pid, "object", "pid")?.unwrap_or(0);
        let row = optional(pindex, "object", "pindex")?.unwrap_or(0);
        self.model.objects.push(Object {
            id,
            name: one_line(name.as_deref().unwrap_or_default()),
            role,
            property: Property {
                group,
                rows: [row; 3],
            },
            ..Object::default()
        });
        Ok(Element::Object)
    }

    fn vertex(&mut self, tag: &Tag) -> Result<Element, Wrong> {
        (self.spend)(1)?;
        let mut position = [0.0; 3];
        let words = tag.values(["x", "y", "z"])?;
        let Some(object) = self.model.objects.last_mut() else {
            return Ok(Element::Leaf);
        };
        for ((x, word), name) in position.iter_mut().zip(words).zip(["x", "y", "z"]) {
            let word = word.ok_or_else(|| format!("a vertex has no {name}"))?;
            let found = word.trim().parse::<f64>().ok().filter(|x| x.is_finite());
            *x = found.ok_or_else(|| {
                let row = object.positions.len();
                let of = object.id;
                let word = one_line(&word);
                format!("object {of}: {name} of vertex {row} is '{word}', not a finite number")
            })?;
        }
        if object.positions.len() == u32::MAX as usize {
            return Err("an object has more vertices than u32 can count"
                .to_string()
                .into());
        }
        object.positions.push(position);
        Ok(Element::Leaf)
    }

    fn triangle(&mut self, tag: &Tag) -> Result<Element, Wrong> {
        (self.spend)(1)?;
        let [v1, v2, v3, pid, p1, p2, p3] =
            tag.values(["v1", "v2", "v3", "pid", "p1", "p2", "p3"])?;
        let corner = |word, name| number(word, "triangle", name);
        let corners = [corner(v1, "v1")?, corner(v2, "v2")?, corner(v3, "v3")?];
        let row = |word, name| optional(word, "triangle", name);
        let (group, rows) = (
            row(pid, "pid")?,
            [row(p1, "p1")?, row(p2, "p2")?, row(p3, "p3")?],
        );
        if tag.has(&["paint_color", "mmu_segmentation"]) {
            self.report.add("triangle with painted colours");
        }
        let Some(object) = self.model.objects.last_mut() else {
            return Ok(Element::Leaf);
        };
        // Without a row of its own a triangle has the property of the object.
        if let (true, Some(first)) = (group.is_some() || object.property.group > 0, rows[0]) {
            let own = Property {
                group: group.unwrap_or(object.property.group),
                rows: [first, rows[1].unwrap_or(first), rows[2].unwrap_or(first)],
            };
            object
                .properties
                .resize(object.triangles.len(), object.property);
            object.properties.push(own);
        }
        object.triangles.push(corners);
        Ok(Element::Leaf)
    }

    /// Reads a component or a build item.
    fn placed(&mut self, tag: &Tag) -> Result<Placed, Wrong> {
        (self.spend)(tag.cost() + PLACED_COST)?;
        let what = tag.name();
        let [id, transform] = tag.values(["objectid", "transform"])?;
        let path = tag.value_in(Space::Production, "path")?;
        let map = match transform {
            None => Affine::IDENTITY,
            Some(text) => affine(&text).ok_or_else(|| {
                let text = one_line(&text);
                format!("the transform '{text}' is not 12 finite numbers")
            })?,
        };
        Ok(Placed {
            id: number(id, what, "objectid")?,
            path: path.map(Cow::into_owned),
            map,
        })
    }
}

/// Parses a whole number that an element must have.
pub(super) fn number(word: Option<Cow<str>>, of: &str, name: &str) -> Result<u32, String> {
    let found = optional(word, of, name)?;
    found.ok_or_else(|| format!("a {of} has no {name}"))
}

/// Parses a whole number that an element may have.
fn optional(word: Option<Cow<str>>, of: &str, name: &str) -> Result<Option<u32>, String> {
    let Some(word) = word else { return Ok(None) };
    let found = word.trim().parse::<u32>();
    found.map(Some).map_err(|_| {
        format!(
            "{name} of a {of} is '{}', not a whole number",
            one_line(&word)
        )
    })
}

/// Parses a transform: four rows of three numbers, by which points are multiplied from the left.
fn affine(text: &str) -> Option<Affine> {
    let mut numbers = [0.0; 12];
    let mut words = text.split_whitespace();
    for x in &mut numbers {
        *x = words
            .next()?
            .parse::<f64>()
            .ok()
            .filter(|x| x.is_finite())?;
    }
    if words.next().is_some() {
        return None;
    }
    let row = |r: usize| std::array::from_fn(|c| numbers[3 * r + c]);
    Some(Affine::new([row(0), row(1), row(2)], row(3)))
}
