//! Exporter of scenes to POV-Ray 3.7 scene description text.
//!
//! Shapes, nodes and CSG solids become declarations that refer to each other, so shared
//! parts stay shared in the file (POV-Ray copies them on reading). In POV-Ray the material
//! of a part wins over that of the whole; here the material of an edge wins over those of
//! operands and meshes. So a declaration is written twice if both are used: with its own
//! materials, and bare.
//!
//! Coordinates are not converted: the camera's vectors are written explicitly, which gives
//! the same picture although POV-Ray's own camera is left-handed.
//!
//! Polynomial surfaces are expanded exactly, and then each coefficient is rounded. POV-Ray
//! finds their roots in f64, and misses some of high degree: a superquadric with an
//! exponent of 24 is hardly visible there.
//!
//! Differences from the picture here: materials become pigments and finishes (no
//! microfacets, no Fresnel term of dielectrics); a point light fades with 2 / (1 + (d/f)²)
//! for a small f, which is the inverse square up to a relative error of f²/d²; motion is
//! exported at time 0; tolerances are not exported.

mod level_set;
mod looks;
mod polynomial;
mod shapes;

use crate::math::Affine;
use crate::scene::{
    Camera, Edge, MaterialId, NodeId, Scene, Shape, ShapeId, Tables, Target, children_first,
    operands_first,
};
use std::fmt::Write;
use thiserror::Error;

/// The reasons why a scene cannot be exported; names are those of shapes.
#[derive(Debug, Error)]
pub enum PovError {
    #[error(
        "the xor {name} becomes {parts} parts, since POV-Ray has no xor; at most {limit} are \
         written: use fewer operands, or xors of unions"
    )]
    TooManyParts {
        name: String,
        parts: u64,
        limit: u64,
    },
    #[error(
        "the polynomial of {name}, multiplied out for POV-Ray, has a coefficient that is too large \
         or too small for a number; scale the shape by a transform"
    )]
    NoNumber { name: String },
    #[error(
        "the formula of {name}, written out for POV-Ray, is too long; use fewer steps that are \
         used more than once"
    )]
    LongFormula { name: String },
    #[error("{name} has no end, which POV-Ray's isosurfaces must have; give it a clip")]
    Endless { name: String },
    #[error(
        "the scene, as POV-Ray is to have it, has a number beyond f64: {line}; move or scale \
         what is so far away or so large"
    )]
    TooLarge { line: String },
}

/// Whether a declaration has its own materials or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Dress {
    Own,
    Bare,
}

/// Writes a scene, seen by `camera`, as text for POV-Ray. The scene must be complete: it must
/// have lights.
///
/// Fails for xors of too many parts, surfaces that POV-Ray cannot represent, and numbers
/// beyond f64.
pub fn text(scene: &Scene, camera: &Camera) -> Result<String, PovError> {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "// Written by Lanecast. Coordinates are right-handed: the camera's vectors say so.\n\
         #version 3.7;\n\
         global_settings {{ assumed_gamma 1.0 max_trace_level 8 }}"
    );
    looks::write(&mut text, scene, camera);
    let mut writer = Writer {
        scene,
        text,
        wanted: wanted(scene),
        is_clear: scene.materials.rows.iter().any(|m| m.transmission > 0.0),
    };
    writer.shapes()?;
    writer.nodes();
    writer.instances();
    // Sums and lengths of finite numbers may be infinite.
    match writer.text.lines().find(|line| has_no_number(line)) {
        Some(line) => Err(PovError::TooLarge { line: line.into() }),
        None => Ok(writer.text),
    }
}

/// Summarises what the text of a scene leaves out of its looks; `None` if there is nothing.
pub fn warning(scene: &Scene, camera: &Camera) -> Option<String> {
    let lost = looks::losses(scene, camera);
    (!lost.is_empty()).then(|| format!("not exported: {}", lost.join(", ")))
}

/// Whether a line has an infinity or NaN, as [`number`] writes them. Names cannot be mistaken
/// for them, because they stand in comments or quotes.
fn has_no_number(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or(line);
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '.' || c == '-';
    let words = code.split(|c: char| !is_part(c));
    words
        .map(|word| word.trim_start_matches('-'))
        .any(|word| word == "inf" || word == "NaN")
}

/// The state of the export.
struct Writer<'s> {
    scene: &'s Tables,
    text: String,
    wanted: Wanted,
    /// Whether any material is transparent, so that surfaces inside unions would be visible.
    is_clear: bool,
}

/// The declarations that others refer to, for each row in the order own, bare.
struct Wanted {
    shapes: Vec<[bool; 2]>,
    nodes: Vec<[bool; 2]>,
}

impl Wanted {
    fn edge(&mut self, edge: Edge, dress: Dress) {
        let dress = below(edge.material, dress);
        match edge.target {
            Target::Shape(id) => self.shapes[id.index()][dress as usize] = true,
            Target::Node(id) => self.nodes[id.index()][dress as usize] = true,
        }
    }
}

/// Chooses the declaration of what an edge places: bare if the edge has a material.
fn below(material: Option<MaterialId>, dress: Dress) -> Dress {
    match material {
        Some(_) => Dress::Bare,
        None => dress,
    }
}

/// Finds the declarations that are needed, from the roots down.
fn wanted(scene: &Tables) -> Wanted {
    let mut wanted = Wanted {
        shapes: vec![[false; 2]; scene.shapes.len()],
        nodes: vec![[false; 2]; scene.nodes.len()],
    };
    for row in 0..scene.roots.len() {
        wanted.edge(scene.roots.row(row), Dress::Own);
    }
    for node in children_first(scene).unwrap_or_default().into_iter().rev() {
        for dress in [Dress::Own, Dress::Bare] {
            if wanted.nodes[node as usize][dress as usize] {
                for row in scene.nodes.children[node as usize].clone() {
                    wanted.edge(scene.edges.row(row as usize), dress);
                }
            }
        }
    }
    let shape_of = shapes::of_csg(scene);
    let order = operands_first(scene).unwrap_or_default();
    for row in order.into_iter().rev() {
        let id = crate::scene::CsgId(row);
        for dress in [Dress::Own, Dress::Bare] {
            if wanted.shapes[shape_of[row as usize] as usize][dress as usize] {
                let dress = below(scene.csg.material[id.index()], dress);
                for operand in scene.csg.operands(id) {
                    let dress = below_operand(dress, scene, operand.shape);
                    wanted.shapes[operand.shape.index()][dress as usize] = true;
                }
            }
        }
    }
    wanted
}

/// Chooses the declaration of an operand. Only CSG solids and meshes have two that differ.
fn below_operand(dress: Dress, scene: &Tables, shape: ShapeId) -> Dress {
    match scene.shapes.row(shape) {
        Shape::Csg(_) | Shape::Mesh(_) => dress,
        _ => Dress::Own,
    }
}

impl Writer<'_> {
    fn nodes(&mut self) {
        for node in children_first(self.scene).unwrap_or_default() {
            for dress in [Dress::Own, Dress::Bare] {
                if self.wanted.nodes[node as usize][dress as usize] {
                    self.node(NodeId(node), dress);
                }
            }
        }
    }

    fn node(&mut self, id: NodeId, dress: Dress) {
        let children = self.scene.nodes.children[id.index()].clone();
        let comment = comment(self.scene.nodes.names.get(id.0));
        let _ = writeln!(
            self.text,
            "#declare {} = union {{{comment}",
            name("Node", id.0, dress)
        );
        for row in children {
            self.edge(self.scene.edges.row(row as usize), dress);
        }
        self.text.push_str("}\n");
    }

    fn instances(&mut self) {
        self.text.push('\n');
        for row in 0..self.scene.roots.len() {
            self.edge(self.scene.roots.row(row), Dress::Own);
        }
    }

    fn edge(&mut self, edge: Edge, dress: Dress) {
        let dress = below(edge.material, dress);
        let name = match edge.target {
            Target::Shape(id) => self.shape_name(id, dress),
            Target::Node(id) => name("Node", id.0, dress),
        };
        let placed = placed(
            &name,
            &self.scene.transforms.local[edge.transform.index()],
            edge.material,
        );
        let _ = writeln!(self.text, "{placed}");
    }

    fn shape_name(&self, id: ShapeId, dress: Dress) -> String {
        name("Shape", id.0, below_operand(dress, self.scene, id))
    }
}

/// The name of a declaration.
fn name(kind: &str, row: u32, dress: Dress) -> String {
    match dress {
        Dress::Own => format!("{kind}_{row}"),
        Dress::Bare => format!("Bare_{kind}_{row}"),
    }
}

/// Writes an object: a declaration with a material and a transform, in one line.
fn placed(name: &str, map: &Affine, material: Option<MaterialId>) -> String {
    let mut text = format!("object {{ {name}");
    if let Some(id) = material {
        let _ = write!(text, " material {{ Material_{} }}", id.0);
    }
    if !map.is_identity() {
        let [x, y, z] = *map.linear();
        let entries = [x, y, z, map.translation].map(|c| c.map(number).join(", "));
        let _ = write!(text, " matrix <{}>", entries.join(", "));
    }
    text.push_str(" }");
    text
}

/// Writes the name of a row as a comment, to follow the opening line of its declaration.
fn comment(name: Option<&str>) -> String {
    name.map_or(String::new(), |name| {
        let shown: String = name.chars().take(60).flat_map(char::escape_debug).collect();
        format!(" // {shown}")
    })
}

/// Writes a number with as many digits as identify the f64.
fn number(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if (1e-5..1e15).contains(&x.abs()) {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

fn vector(v: impl Into<[f64; 3]>) -> String {
    format!("<{}>", v.into().map(number).join(", "))
}
