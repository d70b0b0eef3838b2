//! From nodes to solids: what each of OpenSCAD's nodes means, from the last node to the first, so
//! that children are known before what is made of them.

use super::arguments::{Arguments, number};
use super::budget::Budget;
use super::emit::{Role, Shown, scene_from_file};
use super::foreign::Foreign;
use super::outlines::{OutlineId, Outlines, Shape};
use super::solids::{Color, Leaf, Part, SolidId, Solids};
use super::syntax::{Tree, Value};
use crate::scene::Operator;
use crate::shared::messages::one_line;
use crate::{Curves, Folder, ImportReport, LoadError, LoadOptions};
use glam::{DAffine2, DAffine3, DMat2, DMat3, DVec3};
use std::path::Path;

/// What a node is, once its children are known.
#[derive(Clone, Copy, Debug)]
pub(super) enum Made {
    Nothing,
    Solid(SolidId),
    Outline(OutlineId),
    /// It, or a part of it, cannot be drawn: the row of `refusals`.
    Refused(u32),
}

/// A node that cannot be drawn, and why.
struct Refusal {
    row: usize,
    message: String,
}

pub(super) struct Reader<'a> {
    tree: &'a Tree<'a>,
    pub(super) folder: Folder,
    pub(super) curves: Curves,
    pub(super) report: &'a mut ImportReport,
    pub(super) lines: Vec<u32>,
    made: Vec<Made>,
    refusals: Vec<Refusal>,
    budget: Budget,
    pub(super) solids: Solids,
    pub(super) outlines: Outlines,
    pub(super) foreign: Foreign,
}

/// The operands of an operator, in order; `None` for those that are empty.
type Operands = Vec<Option<u32>>;

pub(super) type Outcome<T> = Result<T, String>;

impl<'a> Reader<'a> {
    /// Takes the tree of the file at a path, by which others are named.
    pub fn new(
        path: &Path,
        tree: &'a Tree<'a>,
        options: &LoadOptions,
        report: &'a mut ImportReport,
    ) -> Reader<'a> {
        Reader {
            tree,
            folder: Folder::new(path, options),
            curves: options.scad_curves,
            report,
            lines: tree.lines(),
            made: vec![Made::Nothing; tree.nodes.len()],
            refusals: Vec::new(),
            budget: Budget::default(),
            solids: Solids::default(),
            outlines: Outlines::default(),
            foreign: Foreign::default(),
        }
    }

    /// Reads all nodes. Fails at the first that cannot be drawn.
    pub fn read(mut self) -> Result<(Solids, Vec<Shown>), LoadError> {
        for row in (0..self.tree.nodes.len()).rev() {
            self.made[row] = self.node(row);
        }
        let mut shown = Vec::new();
        let only = self
            .tree
            .nodes
            .iter()
            .position(|node| node.modifiers.is_root);
        let top: Vec<usize> = match only {
            Some(row) => vec![row],
            None => self.tree.top().collect(),
        };
        let mut solids = Vec::new();
        for row in top {
            let is_background = self.tree.nodes[row].modifiers.is_background && only.is_none();
            match self.made[row] {
                _ if is_background => {}
                Made::Solid(solid) => solids.push(solid),
                Made::Outline(outline) => {
                    let solid = self.as_seen(outline);
                    solids.push(solid);
                }
                Made::Nothing => {}
                Made::Refused(at) => {
                    let Refusal { row, message } = &self.refusals[at as usize];
                    return Err(self.tree.error(*row, message.clone()));
                }
            }
        }
        if !solids.is_empty() {
            shown.push(Shown {
                solid: self.solids.op(1, Operator::Union, solids),
                map: scene_from_file(),
                color: None,
                role: Role::Solid,
                name: "",
            });
        }
        self.backgrounds(&mut shown);
        Ok((self.solids, shown))
    }

    /// Adds what has the modifier `%`, where the nodes around place it.
    fn backgrounds(&mut self, shown: &mut Vec<Shown>) {
        if !self
            .tree
            .nodes
            .iter()
            .any(|node| node.modifiers.is_background)
        {
            return;
        }
        // The ends of the nodes around, and their maps.
        let mut around = vec![(self.tree.nodes.len() as u32, scene_from_file())];
        let mut row = 0;
        while let Some(node) = self.tree.nodes.get(row) {
            while around.len() > 1 && around.last().is_some_and(|(end, _)| *end as usize <= row) {
                around.pop();
            }
            let map = around.last().map_or_else(scene_from_file, |(_, map)| *map);
            // OpenSCAD shows the parts of these as one.
            let is_one = node.modifiers.is_disabled || ONE_PIECE.contains(&node.name);
            if node.modifiers.is_background {
                let solid = match self.made[row] {
                    Made::Solid(solid) => Some(solid),
                    Made::Outline(outline) => Some(self.as_seen(outline)),
                    Made::Refused(at) => {
                        let Refusal { row, .. } = &self.refusals[at as usize];
                        let what = format!("% of {}()", brief(self.tree.nodes[*row].name));
                        self.report.add(&what);
                        None
                    }
                    Made::Nothing => None,
                };
                shown.extend(solid.map(|solid| Shown {
                    solid,
                    map,
                    color: Some(super::emit::BACKGROUND),
                    role: Role::Ghost,
                    name: "%",
                }));
            }
            if is_one {
                row = node.end as usize;
                continue;
            }
            let own = match node.name {
                "multmatrix" => self.matrix(row).unwrap_or(DAffine3::IDENTITY),
                _ => DAffine3::IDENTITY,
            };
            around.push((node.end, map * own));
            row += 1;
        }
    }

    /// Makes an outline a solid, as OpenSCAD's view does.
    fn as_seen(&mut self, outline: OutlineId) -> SolidId {
        self.report.shown_as("2-D object, 1 thick");
        self.outlines.sweep(outline, (-0.5, 1.0), &mut self.solids)
    }

    fn node(&mut self, row: usize) -> Made {
        let modifiers = self.tree.nodes[row].modifiers;
        if modifiers.is_disabled {
            return Made::Nothing;
        }
        let mut made = self.budget.check().and_then(|()| self.kind(row));
        if made.is_ok()
            && let Err(message) = self.budget.count(&self.solids, &self.outlines)
        {
            made = Err(message);
        }
        let made = made.unwrap_or_else(|message| {
            self.refusals.push(Refusal { row, message });
            Made::Refused(self.refusals.len() as u32 - 1)
        });
        match made {
            Made::Solid(solid) if modifiers.is_marked => {
                Made::Solid(self.solids.push(self.lines[row], Part::Marked(solid)))
            }
            Made::Outline(outline) if modifiers.is_marked => {
                Made::Outline(self.outlines.push(self.lines[row], Shape::Marked(outline)))
            }
            other => other,
        }
    }

    fn kind(&mut self, row: usize) -> Outcome<Made> {
        let line = self.lines[row];
        Ok(match self.tree.nodes[row].name {
            "group" | "union" | "echo" | "assert" | "let" | "for" => {
                self.operator(row, Operator::Union)
            }
            "difference" => self.operator(row, Operator::Difference),
            "intersection" => self.operator(row, Operator::Intersection),
            "multmatrix" => self.moved(row),
            "color" => {
                let color = self.color(row)?;
                match (self.operator(row, Operator::Union), color) {
                    (Made::Solid(solid), Some(color)) => {
                        Made::Solid(self.solids.push(line, Part::Colored(solid, color)))
                    }
                    (Made::Outline(outline), Some(color)) => {
                        Made::Outline(self.outlines.push(line, Shape::Colored(outline, color)))
                    }
                    (other, _) => other,
                }
            }
            "render" => match self.operator(row, Operator::Union) {
                Made::Solid(solid) => Made::Solid(self.solids.push(line, Part::Plain(solid))),
                other => other,
            },
            "cube" => self.leaf(line, self.cube(row)),
            "sphere" => self.leaf(line, self.sphere(row)?),
            "cylinder" => self.leaf(line, self.cylinder(row)?),
            "polyhedron" => {
                let leaf = self.polyhedron(row)?;
                self.leaf(line, leaf)
            }
            "import" => return self.import(row),
            "square" => {
                let square = self.square(row);
                self.outline(line, square)
            }
            "circle" => {
                let circle = self.circle(row);
                self.outline(line, circle)
            }
            "polygon" => {
                let polygon = self.polygon(row)?;
                self.outline(line, polygon)
            }
            "linear_extrude" => return self.linear_extrude(row),
            "rotate_extrude" => return self.rotate_extrude(row),
            "hull" => return self.hull(row),
            "offset" => return self.offset(row),
            "text" => return self.text(row),
            name => return Err(refusal(name)),
        })
    }

    pub(super) fn leaf(&mut self, line: u32, leaf: Option<Leaf>) -> Made {
        match leaf {
            Some(leaf) => Made::Solid(self.solids.leaf(line, leaf)),
            None => Made::Nothing,
        }
    }

    pub(super) fn outline(&mut self, line: u32, shape: Option<Shape>) -> Made {
        match shape {
            Some(shape) => Made::Outline(self.outlines.push(line, shape)),
            None => Made::Nothing,
        }
    }

    /// Gathers a node's operands; those that `%` or `*` take out are not among them. The first
    /// one says whether they are solids or outlines, and others are left out, as OpenSCAD does.
    fn operands(&mut self, row: usize) -> Result<(Kind, Operands), Made> {
        let (mut kind, mut operands) = (None, Vec::new());
        for child in self.tree.children(row) {
            let modifiers = self.tree.nodes[child].modifiers;
            if modifiers.is_background || modifiers.is_disabled {
                continue;
            }
            let (own, id) = match self.made[child] {
                Made::Nothing => {
                    operands.push(None);
                    continue;
                }
                Made::Solid(solid) => (Kind::Solid, solid),
                Made::Outline(outline) => (Kind::Outline, outline),
                refused @ Made::Refused(_) => return Err(refused),
            };
            if *kind.get_or_insert(own) != own {
                self.report.add(match own {
                    Kind::Solid => "3-D object among 2-D ones",
                    Kind::Outline => "2-D object among 3-D ones",
                });
                continue;
            }
            operands.push(Some(id));
        }
        Ok((kind.unwrap_or(Kind::Solid), operands))
    }

    pub(super) fn operator(&mut self, row: usize, operator: Operator) -> Made {
        let (kind, operands) = match self.operands(row) {
            Ok(operands) => operands,
            Err(refused) => return refused,
        };
        let is_nothing = match operator {
            Operator::Intersection => operands.iter().any(Option::is_none),
            Operator::Difference => operands.first().is_none_or(Option::is_none),
            _ => false,
        };
        let operands: Vec<u32> = operands.into_iter().flatten().collect();
        if is_nothing || operands.is_empty() {
            return Made::Nothing;
        }
        let line = self.lines[row];
        match kind {
            Kind::Solid => Made::Solid(self.solids.op(line, operator, operands)),
            Kind::Outline => Made::Outline(self.outlines.op(line, operator, operands)),
        }
    }

    /// Unites a node's operands, which must be outlines.
    pub(super) fn united_outline(&mut self, row: usize) -> Result<OutlineId, Made> {
        match self.operator(row, Operator::Union) {
            Made::Outline(outline) => Ok(outline),
            Made::Solid(_) => {
                let what = format!("3-D object in {}()", self.tree.nodes[row].name);
                self.report.add(&what);
                Err(Made::Nothing)
            }
            other => Err(other),
        }
    }

    fn moved(&mut self, row: usize) -> Made {
        let made = self.operator(row, Operator::Union);
        let line = self.lines[row];
        match (made, self.matrix(row)) {
            (Made::Solid(solid), Some(by)) => Made::Solid(self.solids.placed(line, solid, by)),
            (Made::Outline(outline), _) => match self.flat_matrix(row) {
                Some(by) => Made::Outline(self.outlines.push(line, Shape::Placed(outline, by))),
                None => {
                    self.report.repair("object scaled to nothing, left out", 1);
                    Made::Nothing
                }
            },
            (Made::Solid(_), None) => {
                self.report.repair("object scaled to nothing, left out", 1);
                Made::Nothing
            }
            (other, _) => other,
        }
    }

    pub(super) fn node_name(&self, row: usize) -> &'a str {
        self.tree.nodes[row].name
    }

    pub(super) fn arguments(&self, row: usize, places: &'static [&'static str]) -> Arguments<'a> {
        Arguments::of(&self.tree.nodes[row], places)
    }

    /// Returns the matrix of a `multmatrix`; `None` if it makes nothing of a solid.
    fn matrix(&self, row: usize) -> Option<DAffine3> {
        let m = self.arguments(row, &["m"]).matrix("m");
        let m = m.unwrap_or(DAffine3::IDENTITY);
        // Of directions: a matrix may scale one of them a great deal more than another.
        let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
        let axes = [x, y, z].map(DVec3::normalize_or_zero);
        let determinant = DMat3::from_cols(axes[0], axes[1], axes[2]).determinant();
        let is_invertible = m.is_finite() && determinant.abs() > 1e-12;
        is_invertible.then_some(m)
    }

    /// Returns what a `multmatrix` does to outlines.
    fn flat_matrix(&self, row: usize) -> Option<DAffine2> {
        let m = self.arguments(row, &["m"]).matrix("m");
        let m = m.unwrap_or(DAffine3::IDENTITY);
        let [x, y] = [m.matrix3.x_axis, m.matrix3.y_axis].map(DVec3::truncate);
        let matrix2 = DMat2::from_cols(x, y);
        let determinant = x.normalize_or_zero().perp_dot(y.normalize_or_zero());
        let map = DAffine2 {
            matrix2,
            translation: m.translation.truncate(),
        };
        (map.is_finite() && determinant.abs() > 1e-12).then_some(map)
    }

    fn color(&self, row: usize) -> Outcome<Option<Color>> {
        match self.arguments(row, &["c", "alpha"]).get("c").or_else(|| {
            let node = &self.tree.nodes[row];
            node.arguments.first().map(|argument| &argument.value)
        }) {
            Some(Value::List(list)) => {
                let entry = |i: usize| list.get(i).and_then(number).map(|x| x as f32);
                let rgb = [0, 1, 2].map(|i| entry(i).filter(|x| (0.0..=1.0).contains(x)));
                let alpha = entry(3).filter(|x| (0.0..=1.0).contains(x)).unwrap_or(1.0);
                Ok(match rgb {
                    [Some(r), Some(g), Some(b)] => Some([r, g, b, alpha]),
                    // OpenSCAD writes -1 where only a name it does not know was given.
                    _ => None,
                })
            }
            Some(Value::Text(name)) => Err(format!(
                "the colour '{}' is a name; a .csg file that OpenSCAD writes has its numbers",
                brief(name)
            )),
            _ => Ok(None),
        }
    }
}

/// What operands are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Solid,
    Outline,
}

/// Nodes whose parts OpenSCAD's view does not show apart.
const ONE_PIECE: [&str; 9] = [
    "render",
    "linear_extrude",
    "rotate_extrude",
    "hull",
    "minkowski",
    "projection",
    "offset",
    "resize",
    "fill",
];

pub(super) fn is_size(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

/// Returns a radius, which may be given as a diameter.
pub(super) fn radius(of: &Arguments, radius: &str, diameter: &str, default: f64) -> f64 {
    let half = || of.number(diameter).map(|d| d * 0.5);
    half().or_else(|| of.number(radius)).unwrap_or(default)
}

/// Says why a node is not drawn, and what to do.
fn refusal(name: &str) -> String {
    let what = match name {
        "surface" | "minkowski" | "projection" | "resize" => format!("{name}() is not drawn"),
        _ => format!("{}() is no node that is known", brief(name)),
    };
    remedy(&what)
}

/// The most letters of a name that a message quotes.
const MOST_LETTERS: usize = 40;

/// Cuts a name short, and escapes what a terminal would obey.
pub(super) fn brief(name: &str) -> String {
    let head: String = name.chars().take(MOST_LETTERS).collect();
    let end = if head.len() < name.len() { "…" } else { "" };
    format!("{}{end}", one_line(&head))
}

/// Adds to a message what can be done.
pub(super) fn remedy(what: &str) -> String {
    format!("{what}; let OpenSCAD make a mesh, and draw that: openscad -o part.stl part.csg")
}
