//! Scenes for POV-Ray 3.7: scene description text of what is native here.
//!
//! Shapes, nodes and combinations become declarations that refer to each other, so
//! what is shared stays shared in the file (POV-Ray copies it on reading). A
//! material further down wins in POV-Ray; here that of a placement wins over those
//! of operands and meshes. So what needs it is declared twice, with its own
//! materials and bare.
//!
//! Coordinates stay as they are: the camera's vectors are written out, and with
//! them the picture is the same although POV-Ray's own camera is left-handed.
//!
//! Polynomial surfaces are multiplied out, exactly, and each coefficient is rounded.
//! POV-Ray finds their roots in f64, and of high degrees not all: a superquadric with
//! an exponent of 24 is hardly seen there.
//!
//! What differs: materials are pigments and finishes (no microfacets, no Fresnel of
//! dielectrics); a point light fades with 2 / (1 + (d/f)²) for a small f, which is
//! the inverse square but for f²/d²; motion is at time 0; tolerances are left out.

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

/// Whether a declaration brings its own materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Dress {
    Own,
    Bare,
}

/// The text of a scene that lacks neither camera nor lights.
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
    // Sums and lengths of what is finite may not be.
    match writer.text.lines().find(|line| has_no_number(line)) {
        Some(line) => Err(PovError::TooLarge { line: line.into() }),
        None => Ok(writer.text),
    }
}

/// As [`number`] writes what is infinite or no number; names are quoted or comments.
fn has_no_number(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or(line);
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '.' || c == '-';
    let words = code.split(|c: char| !is_part(c));
    words
        .map(|word| word.trim_start_matches('-'))
        .any(|word| word == "inf" || word == "NaN")
}

struct Writer<'s> {
    scene: &'s Tables,
    text: String,
    wanted: Wanted,
    /// Something is transparent: surfaces within unions would be seen.
    is_clear: bool,
}

/// Which declarations are referred to: own and bare.
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

/// What lies below a placement.
fn below(material: Option<MaterialId>, dress: Dress) -> Dress {
    match material {
        Some(_) => Dress::Bare,
        None => dress,
    }
}

/// From the roots down.
fn wanted(scene: &Tables) -> Wanted {
    let mut wanted = Wanted {
        shapes: vec![[false; 2]; scene.shapes.len()],
        nodes: vec![[false; 2]; scene.nodes.len()],
    };
    for row in 0..scene.instances.len() {
        wanted.edge(scene.instances.row(row), Dress::Own);
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
    let shape_of = shapes::of_combinations(scene);
    let order = operands_first(scene).unwrap_or_default();
    for row in order.into_iter().rev() {
        let id = crate::scene::CombinationId(row);
        for dress in [Dress::Own, Dress::Bare] {
            if wanted.shapes[shape_of[row as usize] as usize][dress as usize] {
                let dress = below(scene.combinations.material[id.index()], dress);
                for operand in scene.combinations.operands(id) {
                    let dress = below_operand(dress, scene, operand.shape);
                    wanted.shapes[operand.shape.index()][dress as usize] = true;
                }
            }
        }
    }
    wanted
}

/// Only combinations and meshes have two declarations that differ.
fn below_operand(dress: Dress, scene: &Tables, shape: ShapeId) -> Dress {
    match scene.shapes.row(shape) {
        Shape::Combination(_) | Shape::Mesh(_) => dress,
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
        for row in 0..self.scene.instances.len() {
            self.edge(self.scene.instances.row(row), Dress::Own);
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

fn name(kind: &str, row: u32, dress: Dress) -> String {
    match dress {
        Dress::Own => format!("{kind}_{row}"),
        Dress::Bare => format!("Bare_{kind}_{row}"),
    }
}

/// One line: a declaration somewhere, of a material.
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

/// After what opens a declaration.
fn comment(name: Option<&str>) -> String {
    name.map_or(String::new(), |name| {
        let shown: String = name.chars().take(60).flat_map(char::escape_debug).collect();
        format!(" // {shown}")
    })
}

/// Digits enough for the same f64.
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
