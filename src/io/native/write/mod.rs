//! Writer of the native scene format.
//!
//! All numbers read back to the same bits, and rows keep their order, so the written scene renders
//! as the scene does. Meshes become PLY files in a folder beside it, images PNG, and environments
//! OpenEXR. What the format or this writer has no words for is counted in one warning: images of
//! layers beside the base, meshes that deform, lights that move.

mod function;
mod images;
mod looks;
mod patterns;
mod shapes;
mod text;

use super::Syntax;
use crate::math::Affine;
use crate::scene::{
    Edge, LightId, Lit, MaterialId, Scene, Shape, ShapeId, Tables, Target, TransformId,
};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use text::{Table, Value, numbers, one};
use thiserror::Error;

/// The reasons why a scene cannot be written.
#[derive(Debug, Error)]
pub enum NativeError {
    #[error(
        "the shape '{name}' is an implicit whose equation is too long as one expression; only the \
         file that it came from has it"
    )]
    NoText { name: String },
    #[error("a scene is written as .toml or .json; give the file one of these names")]
    Extension,
}

/// A scene as files.
#[derive(Debug)]
pub struct NativeScene {
    pub text: String,
    /// The files of the folder beside it: names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// One line about what is missing; `None` if nothing is.
    pub warning: Option<String>,
}

/// The state of the writer.
struct Writer<'s> {
    scene: &'s Tables,
    /// The folder of meshes, as the text names it.
    folder: &'s str,
    /// Names of all rows, each once.
    materials: Vec<String>,
    shapes: Vec<String>,
    nodes: Vec<String>,
    /// Per mesh: the name of its file, once there is one.
    mesh_files: Vec<Option<String>>,
    /// The same per image.
    image_files: Vec<Option<String>>,
    files: Vec<(String, Vec<u8>)>,
    lost: BTreeMap<&'static str, usize>,
}

/// Writes a scene for the file `path`, which is `.toml` or `.json`; `folder` is the one beside it
/// that is to get its meshes and images.
pub fn native_scene(scene: &Scene, path: &Path, folder: &str) -> Result<NativeScene, NativeError> {
    let syntax = match &*crate::extension(path) {
        "toml" => Syntax::Toml,
        "json" => Syntax::Json,
        _ => return Err(NativeError::Extension),
    };
    let name = |names: &crate::scene::Names, kind: &str, count: usize| {
        unique(kind, (0..count as u32).map(|row| names.get(row)))
    };
    let mut writer = Writer {
        scene,
        folder,
        materials: name(&scene.materials.names, "material", scene.materials.len()),
        shapes: name(&scene.shapes.names, "shape", scene.shapes.len()),
        nodes: name(&scene.nodes.names, "node", scene.nodes.len()),
        mesh_files: vec![None; scene.meshes.len()],
        image_files: vec![None; scene.textures.images.len()],
        files: Vec::new(),
        lost: BTreeMap::new(),
    };
    let parts = writer.parts()?;
    let lost = writer.lost.iter().map(|(what, n)| format!("{n} × {what}"));
    let lost: Vec<String> = lost.collect();
    Ok(NativeScene {
        text: text::file(&parts, syntax),
        warning: (!lost.is_empty()).then(|| format!("not written: {}", lost.join(", "))),
        files: writer.files,
    })
}

/// Gives each row a name of its own: its name, or its kind and number, and a number behind it if
/// it is taken.
fn unique<'n>(kind: &str, names: impl Iterator<Item = Option<&'n str>>) -> Vec<String> {
    let names: Vec<Option<&str>> = names.collect();
    let mut taken: HashSet<String> = HashSet::with_capacity(names.len());
    let mut made = vec![String::new(); names.len()];
    // What has a name keeps it, whatever others come to be called.
    for (made, name) in made.iter_mut().zip(&names) {
        if let Some(name) = name
            && taken.insert((*name).into())
        {
            *made = (*name).into();
        }
    }
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for (row, made) in made.iter_mut().enumerate() {
        let stem = names[row].unwrap_or(kind);
        while made.is_empty() {
            let count = counts
                .entry(stem)
                .or_insert(usize::from(names[row].is_some()));
            *count += 1;
            let next = format!("{stem}_{count}");
            if taken.insert(next.clone()) {
                *made = next;
            }
        }
    }
    made
}

impl Writer<'_> {
    fn lose(&mut self, what: &'static str) {
        self.lose_many(what, 1);
    }

    fn lose_many(&mut self, what: &'static str, count: usize) {
        if count > 0 {
            *self.lost.entry(what).or_default() += count;
        }
    }

    fn parts(&mut self) -> Result<Table, NativeError> {
        let scene = self.scene;
        let mut parts: Table = vec![("format".into(), Value::Whole(1))];
        if scene.background != [0.0; 3] {
            parts.push(("background".into(), looks::color(scene.background)));
        }
        if scene.seconds.0 != 1.0 {
            parts.push(("seconds".into(), Value::Number(scene.seconds.0)));
        }
        let mut put = |key: &str, value: Value| match &value {
            Value::Table(rows) if rows.is_empty() => {}
            Value::List(rows) if rows.is_empty() => {}
            _ => parts.push((key.into(), value)),
        };
        put("camera", self.cameras());
        put("light", self.lights());
        put("material", self.named_materials());
        let mut shapes: Table = Vec::new();
        let clips = self.clips();
        for id in (0..scene.shapes.len() as u32).map(ShapeId) {
            if !clips.contains(&id) {
                let shape = self.shape(id)?;
                shapes.push((self.shapes[id.index()].clone(), Value::Table(shape)));
            }
        }
        put("shape", Value::Table(shapes));
        let nodes = (0..scene.nodes.len()).map(|row| {
            let children = scene.nodes.children[row].clone();
            let children = children.map(|row| self.edge(scene.edges.row(row as usize)));
            let children = Value::List(children.collect());
            (self.nodes[row].clone(), one("children", children))
        });
        put("node", Value::Table(nodes.collect()));
        let roots = (0..scene.roots.len()).map(|row| {
            let mut value = self.edge(scene.roots.row(row));
            if let (Value::Table(table), Some(name)) =
                (&mut value, scene.root_names.get(row as u32))
            {
                table.push(("name".into(), Value::Text(name.into())));
            }
            value
        });
        put("instance", Value::List(roots.collect()));
        Ok(parts)
    }

    /// Lists the shapes that are written as parts of a clipped implicit, and that nothing else
    /// places.
    fn clips(&self) -> HashSet<ShapeId> {
        let csg = &self.scene.csg;
        let mut clips: HashSet<ShapeId> = HashSet::new();
        let mut placed: HashSet<ShapeId> = HashSet::new();
        for shape in &self.scene.shapes.rows {
            if let Shape::Csg(id) = shape {
                match self.clipped(*id) {
                    Some(both) => clips.extend(both),
                    None => placed.extend(csg.operands(*id).iter().map(|operand| operand.shape)),
                }
            }
        }
        let edges = self.scene.edges.target.iter();
        for target in edges.chain(&self.scene.roots.target) {
            if let Target::Shape(id) = target {
                placed.insert(*id);
            }
        }
        &clips - &placed
    }

    fn cameras(&mut self) -> Value {
        let cameras = &self.scene.cameras;
        let names = (0..cameras.rows.len() as u32).map(|row| {
            let own = cameras.names.get(row);
            own.or_else(|| cameras.node_names.get(row))
        });
        let names = unique("camera", names);
        let mut rows: Table = Vec::new();
        for (i, name) in names.into_iter().enumerate() {
            let moving = cameras.motions.of.iter().position(|of| *of == i as u32);
            let keys = moving.map_or(&[][..], |row| cameras.motions.keys(row));
            let row = looks::camera(&cameras.rows[i], keys, cameras.shutter(i));
            rows.push((name, Value::Table(row)));
        }
        let is_nameless = cameras.names.get(0).or(cameras.node_names.get(0)).is_none();
        match &mut rows[..] {
            [(_, only)] if is_nameless => std::mem::replace(only, Value::Table(Vec::new())),
            _ => Value::Table(rows),
        }
    }

    fn lights(&mut self) -> Value {
        let moving = self.scene.light_motions.of.len();
        self.lose_many("motion of a light", moving);
        let named = |all: &Self, (kind, light): (&str, Table), lit| {
            let mut table: Table = vec![(kind.into(), Value::Table(light))];
            if let Some(name) = all.group(lit) {
                table.push(("name".into(), name));
            }
            Value::Table(table)
        };
        let mut rows = Vec::new();
        if let Some(map) = &self.scene.environment {
            match map.uniform_radiance() {
                Some(radiance) => {
                    let light = ("environment", looks::uniform(radiance));
                    rows.push(named(self, light, Lit::Environment));
                }
                None => match self.environment(map) {
                    Some(table) => {
                        rows.push(named(self, ("environment", table), Lit::Environment));
                    }
                    None => self.lose("environment map"),
                },
            }
        }
        let lights = self.scene.lights.iter().zip(0..);
        rows.extend(
            lights.map(|(light, row)| named(self, looks::light(light), Lit::Light(LightId(row)))),
        );
        Value::List(rows)
    }

    fn named_materials(&mut self) -> Value {
        let mut rows: Table = Vec::new();
        for (i, row) in self.scene.materials.rows.iter().enumerate() {
            let mut table = looks::material(row);
            patterns::put(&self.scene.textures, MaterialId(i as u32), &mut table);
            self.put_images(MaterialId(i as u32), &mut table);
            if let Some(group) = self.group(Lit::Material(MaterialId(i as u32))) {
                table.push(("group".into(), group));
            }
            rows.push((self.materials[i].clone(), Value::Table(table)));
        }
        Value::Table(rows)
    }

    fn group(&self, lit: Lit) -> Option<Value> {
        let groups = &self.scene.light_groups;
        let name = groups.names().nth(groups.of(lit)? as usize)?;
        Some(Value::Text(name.into()))
    }

    fn edge(&self, edge: Edge) -> Value {
        let (kind, name) = match edge.target {
            Target::Shape(id) => ("shape", &self.shapes[id.index()]),
            Target::Node(id) => ("node", &self.nodes[id.index()]),
        };
        let mut table: Table = vec![(kind.into(), Value::Text(name.clone()))];
        self.placed(&mut table, edge.transform, edge.material);
        Value::Table(table)
    }

    /// Adds the material and the transform of a placement, with its keys if it moves.
    fn placed(&self, table: &mut Table, transform: TransformId, material: Option<MaterialId>) {
        if let Some(id) = material {
            let name = self.materials[id.index()].clone();
            table.push(("material".into(), Value::Text(name)));
        }
        let transforms = &self.scene.transforms;
        let local = &transforms.local[transform.index()];
        if !local.is_identity() {
            table.push(("transform".into(), steps(local)));
        }
        if let Some(row) = transforms.motions.row_of(transform) {
            let keys = transforms.motions.keys(row).iter().skip(1).map(|key| {
                Value::Table(vec![
                    ("at".into(), Value::Number(key.at)),
                    ("transform".into(), steps(&key.local)),
                ])
            });
            table.push(("motion".into(), Value::List(keys.collect())));
            if transforms.motions.is_rigid(row) {
                table.push(("interpolation".into(), Value::Text("rigid".into())));
            }
        }
    }

    /// Returns a name for a file that no other file has, also where letters' case does not count: that of
    /// the thing in it, and a number from `row` on where that is taken.
    fn file_name(&self, of: &str, row: u32, ending: &str) -> String {
        /// Most file systems take 255 bytes.
        const LONGEST: usize = 60;
        let name = of.chars().take(LONGEST);
        let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let stem: String = name.map(|c| if fits(c) { c } else { '_' }).collect();
        let is_taken = |name: &str| {
            self.files
                .iter()
                .any(|(known, _)| known.eq_ignore_ascii_case(name))
        };
        let mut name = format!("{stem}.{ending}");
        // The row of a thing is its own, but another's name may end in it.
        for more in row.. {
            if !is_taken(&name) {
                break;
            }
            name = format!("{stem}_{more}.{ending}");
        }
        name
    }
}

/// Writes a map as one matrix.
fn steps(map: &Affine) -> Value {
    let [x, y, z] = *map.linear();
    let row = |k: usize| numbers([x[k], y[k], z[k], map.translation[k]]);
    Value::List(vec![one("matrix", Value::List((0..3).map(row).collect()))])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MeshData, SceneBuilder};

    #[test]
    fn files_of_meshes_have_names_of_their_own() {
        let mut scene = SceneBuilder::default();
        let triangle = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        };
        // The third is the first one's name in other letters, with the number of its own row.
        for name in ["a_2", "a", "A", "a_3"] {
            let shape = scene.mesh(name, &triangle);
            scene.instance("", Edge::shape(shape));
        }
        let scene = scene.finish().unwrap();
        let made = native_scene(&scene, Path::new("a.toml"), "a_meshes").unwrap();
        let names: HashSet<String> = made.files.iter().map(|(n, _)| n.to_lowercase()).collect();
        assert_eq!(names.len(), 4, "{names:?}");
    }
}
