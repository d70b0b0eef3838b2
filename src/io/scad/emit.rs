//! From the tree of solids to the scene: shapes, CSG solids, materials and instances.
//!
//! What stands at the top of the file is one union. Of it, objects whose boxes are apart become
//! instances of their own, and those whose boxes touch one CSG solid, so that volumes are those of
//! the union and trees cull the rest. Where most of it is turned alike, its instances are ([`Frames`]).

use super::clusters::clusters;
use super::frames::{Frames, Place, Space};
use super::placing::{affine, place};
use super::solids::{Color, Leaf, Part, SolidId, Solids};
use crate::math::Aabb;
use crate::scene::Operator;
use crate::scene::{
    Edge, Layers, Material, MaterialId, Operand, SceneBuilder, Shape, ShapeId, TransformId,
};
use crate::shared::srgb::linear_from_srgb;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::HashMap;

/// The colours of OpenSCAD's own view, in sRGB: of solids, of what is cut off, of `#` and `%`.
const YELLOW: Color = [249.0 / 255.0, 215.0 / 255.0, 44.0 / 255.0, 1.0];
const CUT: Color = [157.0 / 255.0, 203.0 / 255.0, 81.0 / 255.0, 1.0];
const MARKED: Color = [1.0, 81.0 / 255.0, 81.0 / 255.0, 0.5];
pub(super) const BACKGROUND: Color = [180.0 / 255.0, 180.0 / 255.0, 180.0 / 255.0, 0.5];

/// Faces that are no farther apart than this part of the largest coordinate are one: numbers are
/// written with six digits, so that each is off by half a unit of the sixth, and a face is the sum
/// of some two of them.
const TOLERANCE: f64 = 1e-5;

/// A solid that is shown: where it is, and the colour of what has none.
pub(super) struct Shown {
    pub solid: SolidId,
    pub map: DAffine3,
    pub color: Option<Color>,
    pub role: Role,
    /// What its instances are called, and with what the names of its shapes begin; may be empty.
    pub name: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Solid,
    /// Of the modifier `%`, or of `#` where it is cut off.
    Ghost,
}

/// The map from the file's coordinates, in which z is up, to the scene's, in which y is.
pub(super) fn scene_from_file() -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y))
}

/// What counts for a part because of what is around it.
#[derive(Clone, Copy)]
struct Context {
    place: Place,
    color: Option<Color>,
    /// Whether only the colour around counts.
    is_plain: bool,
    /// Whether it is cut off.
    is_cut: bool,
    is_marked: bool,
    /// Whether only unions are around it.
    is_top: bool,
}

/// What a part became.
#[derive(Clone, Copy)]
struct Made {
    shape: ShapeId,
    transform: TransformId,
    /// The map of `transform`.
    map: Option<DAffine3>,
    material: Option<MaterialId>,
    bounds: Option<Aabb>,
}

pub(super) struct Emitter<'s> {
    scene: &'s mut SceneBuilder,
    materials: HashMap<[u32; 4], MaterialId>,
    /// The CSG solids that instances place.
    roots: Vec<ShapeId>,
    extent: f64,
}

impl<'s> Emitter<'s> {
    pub fn new(scene: &'s mut SceneBuilder) -> Emitter<'s> {
        Emitter {
            scene,
            materials: HashMap::new(),
            roots: Vec::new(),
            extent: 0.0,
        }
    }

    /// Adds all that is shown to the scene. Parts of a solid that are marked and cut off are
    /// shown besides.
    pub fn emit(mut self, solids: &mut Solids, shown: Vec<Shown>) {
        let (solid, ghosts): (Vec<Shown>, Vec<Shown>) =
            shown.into_iter().partition(|one| one.role == Role::Solid);
        let mut marked = Vec::new();
        for one in solid {
            self.show(solids, &one, &mut marked);
        }
        // Where a ghost's surface is a solid's, the first one is met.
        for one in ghosts.into_iter().chain(marked) {
            self.show(solids, &one, &mut Vec::new());
        }
        let tolerance = self.extent * TOLERANCE;
        for shape in self.roots {
            if let Shape::Csg(id) = self.scene.tables().shapes.row(shape) {
                self.scene.set_tolerance(id, tolerance);
            }
        }
    }

    fn show(&mut self, solids: &mut Solids, shown: &Shown, marked: &mut Vec<Shown>) {
        let (visited, space) = contexts(solids, shown);
        if shown.role == Role::Solid {
            for (id, context) in &visited {
                if let Part::Marked(of) = &solids.parts[*id as usize]
                    && context.is_cut
                    && !context.is_marked
                {
                    let copy = solids.copy(*of);
                    marked.push(Shown {
                        solid: copy,
                        map: context.place.map,
                        color: Some(MARKED),
                        role: Role::Ghost,
                        name: "#",
                    });
                }
            }
        }
        let called = |what: &str| match shown.name {
            "" => what.to_string(),
            name => format!("{name} {what}"),
        };
        let mut made: HashMap<SolidId, Made> = HashMap::new();
        let mut terms: Vec<Made> = Vec::new();
        for (id, context) in visited.into_iter().rev() {
            let line = solids.lines[id as usize];
            let one = match &mut solids.parts[id as usize] {
                Part::Leaf(leaf) => {
                    let leaf = std::mem::replace(leaf, EMPTY_LEAF);
                    let name = called(&format!("line {line}"));
                    let map = match &space {
                        Some(space) => space.map(&context.place),
                        None => context.place.map,
                    };
                    let placed = place(leaf, &map, &name, self.scene);
                    let transform = placed.transform.map_or(TransformId::IDENTITY, |map| {
                        self.scene.transform(affine(&map))
                    });
                    Made {
                        shape: placed.shape,
                        transform,
                        map: placed.transform,
                        material: Some(self.material(&context)),
                        bounds: placed.bounds,
                    }
                }
                Part::Op(operator, operands) => {
                    if *operator == Operator::Union && context.is_top {
                        continue;
                    }
                    let operands: Vec<Made> = operands
                        .iter()
                        .filter_map(|of| made.get(of).copied())
                        .collect();
                    self.csg(&called(&format!("line {line}")), *operator, &operands)
                }
                Part::Placed(of, _) | Part::Colored(of, _) | Part::Plain(of) | Part::Marked(of) => {
                    match made.get(of) {
                        Some(one) => *one,
                        None => continue,
                    }
                }
            };
            let is_term =
                context.is_top && matches!(solids.parts[id as usize], Part::Leaf(_) | Part::Op(..));
            match is_term {
                true => terms.push(one),
                false => {
                    made.insert(id, one);
                }
            }
        }
        terms.reverse();
        self.place_terms(&terms, space.as_ref(), (shown.name, &called("union")));
    }

    fn csg(&mut self, name: &str, operator: Operator, operands: &[Made]) -> Made {
        let rows: Vec<Operand> = operands
            .iter()
            .map(|one| {
                let operand = Operand::shape(one.shape).transform(one.transform);
                match one.material {
                    Some(material) => operand.material(material),
                    None => operand,
                }
            })
            .collect();
        let boxes = operands.iter().map(|one| one.bounds);
        let bounds = match operator {
            Operator::Difference => boxes.into_iter().next().flatten(),
            Operator::Intersection => boxes.flatten().reduce(|a, b| Aabb {
                min: a.min.max(b.min),
                max: a.max.min(b.max),
            }),
            _ => boxes.reduce(|a, b| Some(a?.union(&b?))).flatten(),
        };
        Made {
            shape: self.scene.csg(name, operator, &rows),
            transform: TransformId::IDENTITY,
            map: None,
            material: None,
            bounds,
        }
    }

    /// Makes instances of the terms of the union at the top, whose parts that meet become one.
    fn place_terms(
        &mut self,
        terms: &[Made],
        space: Option<&Space>,
        (name, of_union): (&str, &str),
    ) {
        let boxes: Vec<Aabb> = terms
            .iter()
            .map(|one| one.bounds.unwrap_or(Aabb::new(DVec3::MIN, DVec3::MAX)))
            .collect();
        for one in boxes.iter().filter(|b| !b.is_empty()) {
            self.extent = self.extent.max(one.max_abs());
        }
        let margin = self.extent * TOLERANCE;
        for cluster in clusters(&boxes, margin) {
            let one = match cluster[..] {
                [only] => terms[only as usize],
                _ => {
                    let operands: Vec<Made> =
                        cluster.iter().map(|row| terms[*row as usize]).collect();
                    self.csg(of_union, Operator::Union, &operands)
                }
            };
            self.roots.push(one.shape);
            let transform = match space {
                Some(space) => {
                    let inner = one.map.unwrap_or(DAffine3::IDENTITY);
                    let map = affine(&(space.scene_from_space * inner));
                    self.scene.transform(map)
                }
                None => one.transform,
            };
            let edge = Edge::shape(one.shape).transform(transform);
            let edge = match one.material {
                Some(material) => edge.material(material),
                None => edge,
            };
            self.scene.instance(name, edge);
        }
    }

    fn material(&mut self, context: &Context) -> MaterialId {
        let mut color = context.color.unwrap_or(match context.is_cut {
            true => CUT,
            false => YELLOW,
        });
        if context.is_marked && !context.is_cut {
            let share = MARKED[3];
            for (own, mark) in color.iter_mut().zip(MARKED).take(3) {
                *own += (mark - *own) * share;
            }
        }
        let key = color.map(f32::to_bits);
        *self.materials.entry(key).or_insert_with(|| {
            let [r, g, b, alpha] = color;
            let linear = [r, g, b].map(|c| linear_from_srgb(f64::from(c).clamp(0.0, 1.0)) as f32);
            let layers = Layers {
                opacity: alpha.clamp(0.0, 1.0),
                ..Layers::default()
            };
            let base = Material::metallic_roughness(linear, 0.0, 0.5);
            self.scene.material("", Material { layers, ..base })
        })
    }
}

/// Stands where a primitive has been taken out.
const EMPTY_LEAF: Leaf = Leaf::Sphere {
    center: DVec3::ZERO,
    radius: 0.0,
};

/// Lists the parts of a solid, each before its own parts, with their contexts; and the space that it
/// is built in, if that is not the scene's.
fn contexts(solids: &Solids, shown: &Shown) -> (Vec<(SolidId, Context)>, Option<Space>) {
    let mut frames = Frames::default();
    let first = Context {
        place: frames.first(shown.map),
        color: shown.color,
        is_plain: shown.role == Role::Ghost,
        is_cut: false,
        is_marked: false,
        is_top: true,
    };
    let mut waiting = vec![(shown.solid, first)];
    let mut visited = Vec::new();
    while let Some((id, context)) = waiting.pop() {
        visited.push((id, context));
        match &solids.parts[id as usize] {
            // What is round needs no frame however it is turned.
            Part::Leaf(Leaf::Sphere { .. } | Leaf::Frustum { .. }) => {}
            Part::Leaf(_) => frames.count(&context.place),
            Part::Op(operator, operands) => {
                // The last one first, for they are taken from the end.
                for (i, of) in operands.iter().enumerate().rev() {
                    let is_other = *operator == Operator::Difference && i > 0;
                    let next = Context {
                        is_cut: context.is_cut != (is_other && !context.is_plain),
                        is_top: context.is_top && *operator == Operator::Union,
                        ..context
                    };
                    waiting.push((*of, next));
                }
            }
            Part::Placed(of, by) => {
                let place = frames.below(&context.place, by);
                waiting.push((*of, Context { place, ..context }));
            }
            Part::Colored(of, color) => {
                let color = match context.is_plain {
                    true => context.color,
                    false => context.color.or(Some(*color)),
                };
                waiting.push((*of, Context { color, ..context }));
            }
            Part::Plain(of) => {
                let is_plain = true;
                waiting.push((
                    *of,
                    Context {
                        is_plain,
                        ..context
                    },
                ));
            }
            Part::Marked(of) => {
                let is_marked = true;
                waiting.push((
                    *of,
                    Context {
                        is_marked,
                        ..context
                    },
                ));
            }
        }
    }
    (visited, frames.space())
}
