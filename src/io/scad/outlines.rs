//! Outlines: what `square`, `circle` and `polygon` make, as a tree in one list.
//!
//! Operators and maps of the plane go on in space: what an outline sweeps is the operator of what
//! its parts sweep, so that circles stay round. Only where an operation needs the whole outline, as
//! `offset` does, is it made into rings.

use super::curves;
use super::polygons::{self, Rings};
use super::solids::{Color, Leaf, Part, SolidId, Solids};
use crate::scene::Operator;
use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};
use std::collections::HashMap;

/// A row of [`Outlines`].
pub(super) type OutlineId = u32;

#[derive(Clone, Debug)]
pub(super) enum Shape {
    Box {
        min: DVec2,
        max: DVec2,
    },
    /// A disc about the origin.
    Disc(f64),
    /// What an odd number of rings goes around. Edges do not cross.
    Rings(Rings),
    Op(Operator, Vec<OutlineId>),
    Placed(OutlineId, DAffine2),
    Colored(OutlineId, Color),
    Marked(OutlineId),
}

/// All outlines of a file, and the lines that they come from. Each is a part of one other at most,
/// of a higher number.
#[derive(Debug, Default)]
pub(super) struct Outlines {
    pub shapes: Vec<Shape>,
    lines: Vec<u32>,
}

/// A box, disc or rings, and where it is in the whole outline.
pub(super) struct PlacedShape {
    pub id: OutlineId,
    pub map: DAffine2,
}

impl Outlines {
    pub fn push(&mut self, line: u32, shape: Shape) -> OutlineId {
        self.shapes.push(shape);
        self.lines.push(line);
        self.shapes.len() as u32 - 1
    }

    pub fn op(&mut self, line: u32, operator: Operator, operands: Vec<OutlineId>) -> OutlineId {
        match operands[..] {
            [only] => only,
            _ => self.push(line, Shape::Op(operator, operands)),
        }
    }

    /// Lists the parts of an outline, each before its own parts.
    pub fn visit(&self, outline: OutlineId) -> Vec<PlacedShape> {
        let map = DAffine2::IDENTITY;
        let mut waiting = vec![PlacedShape { id: outline, map }];
        let mut visited = Vec::new();
        while let Some(PlacedShape { id, map }) = waiting.pop() {
            visited.push(PlacedShape { id, map });
            let next = |id| PlacedShape { id, map };
            match &self.shapes[id as usize] {
                Shape::Box { .. } | Shape::Disc(_) | Shape::Rings(_) => {}
                Shape::Op(_, operands) => waiting.extend(operands.iter().rev().map(|of| next(*of))),
                Shape::Placed(id, by) => waiting.push(PlacedShape {
                    id: *id,
                    map: map * *by,
                }),
                Shape::Colored(of, _) | Shape::Marked(of) => waiting.push(next(*of)),
            }
        }
        visited
    }

    /// Makes the solid that an outline sweeps from z = `from` up to the height.
    pub fn sweep(
        &self,
        outline: OutlineId,
        (from, height): (f64, f64),
        solids: &mut Solids,
    ) -> SolidId {
        let mut made: HashMap<OutlineId, SolidId> = HashMap::new();
        let visited = self.visit(outline);
        for PlacedShape { id, .. } in visited.iter().rev() {
            let line = self.lines[*id as usize];
            let solid = match &self.shapes[*id as usize] {
                Shape::Box { min, max } => solids.leaf(
                    line,
                    Leaf::Cuboid {
                        min: min.extend(from),
                        max: max.extend(from + height),
                    },
                ),
                Shape::Disc(radius) => solids.leaf(
                    line,
                    Leaf::Frustum {
                        base: DVec3::new(0.0, 0.0, from),
                        top: DVec3::new(0.0, 0.0, from + height),
                        base_radius: *radius,
                        top_radius: *radius,
                    },
                ),
                Shape::Rings(rings) => {
                    let rings = rings.clone();
                    let prism = solids.leaf(line, Leaf::Prism { rings, height });
                    let up = DAffine3::from_translation(DVec3::new(0.0, 0.0, from));
                    solids.placed(line, prism, up)
                }
                Shape::Op(operator, operands) => {
                    let operands = operands.iter().map(|of| made[of]).collect();
                    solids.op(line, *operator, operands)
                }
                Shape::Placed(of, by) => solids.placed(line, made[of], in_space(by)),
                Shape::Colored(of, color) => solids.push(line, Part::Colored(made[of], *color)),
                Shape::Marked(of) => solids.push(line, Part::Marked(made[of])),
            };
            made.insert(*id, solid);
        }
        made[&outline]
    }

    /// Makes rings of an outline; discs get `fine` sides. Fails where there are too many corners.
    pub fn rings(&self, outline: OutlineId, fine: u32) -> Result<Rings, String> {
        let visited = self.visit(outline);
        let mut made: HashMap<OutlineId, Rings> = HashMap::new();
        let mut leaves: Vec<(OutlineId, Rings)> = Vec::new();
        for PlacedShape { id, map } in &visited {
            let ring = match &self.shapes[*id as usize] {
                Shape::Box { min, max } => vec![corners(*min, *max)],
                Shape::Disc(radius) => vec![curves::circle(*radius, fine)],
                Shape::Rings(rings) => rings.clone(),
                _ => continue,
            };
            let place = |p: &DVec2| map.transform_point2(*p);
            let placed = ring.iter().map(|ring| ring.iter().map(place).collect());
            leaves.push((*id, placed.collect()));
        }
        if let [(_, only)] = &mut leaves[..] {
            return Ok(std::mem::take(only));
        }
        let grid = polygons::Grid::of(leaves.iter().flat_map(|(_, rings)| rings));
        made.extend(leaves);
        for PlacedShape { id, .. } in visited.iter().rev() {
            let rings = match &self.shapes[*id as usize] {
                Shape::Box { .. } | Shape::Disc(_) | Shape::Rings(_) => continue,
                Shape::Op(operator, operands) => {
                    let operands: Vec<Rings> =
                        operands.iter().filter_map(|of| made.remove(of)).collect();
                    polygons::combined(*operator, operands, &grid)?
                }
                Shape::Placed(of, _) | Shape::Colored(of, _) | Shape::Marked(of) => {
                    made.remove(of).unwrap_or_default()
                }
            };
            made.insert(*id, rings);
        }
        Ok(made.remove(&outline).unwrap_or_default())
    }
}

pub(super) fn corners(min: DVec2, max: DVec2) -> Vec<DVec2> {
    let (low, high) = (DVec2::new(max.x, min.y), DVec2::new(min.x, max.y));
    vec![min, low, max, high]
}

/// Returns the map of space that leaves z as it is.
fn in_space(by: &DAffine2) -> DAffine3 {
    let [x, y] = [by.matrix2.x_axis, by.matrix2.y_axis].map(|v| v.extend(0.0));
    DAffine3 {
        matrix3: DMat3::from_cols(x, y, DVec3::Z),
        translation: by.translation.extend(0.0),
    }
}
