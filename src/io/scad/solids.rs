//! Solids as a tree in one list: primitives, operators, placements and colours.
//!
//! Children have lower numbers than what is made of them, so the list is worked through
//! without recursion. Each solid is a part of one other at most.

use crate::geom::HalfSpace;
use crate::scene::Operator;
use glam::{DAffine3, DVec2, DVec3};

/// A row of [`Solids`].
pub(super) type SolidId = u32;

/// A colour in sRGB from 0 to 1, and its opacity.
pub(super) type Color = [f32; 4];

/// A primitive in its own coordinates.
#[derive(Clone, Debug)]
pub(super) enum Leaf {
    Cuboid {
        min: DVec3,
        max: DVec3,
    },
    Sphere {
        center: DVec3,
        radius: f64,
    },
    /// A cylinder, cone or cut cone.
    Frustum {
        base: DVec3,
        top: DVec3,
        base_radius: f64,
        top_radius: f64,
    },
    /// What rings in the plane z = 0 sweep up to the height; the inside is by the even-odd rule.
    Prism {
        rings: Vec<Vec<DVec2>>,
        height: f64,
    },
    /// About z, at the origin.
    Torus {
        major: f64,
        minor: f64,
    },
    HalfSpace {
        normal: DVec3,
        offset: f64,
    },
    Polyhedron {
        planes: Vec<HalfSpace>,
        points: Vec<DVec3>,
    },
    Mesh {
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    },
}

#[derive(Clone, Debug)]
pub(super) enum Part {
    Leaf(Leaf),
    Op(Operator, Vec<SolidId>),
    Placed(SolidId, DAffine3),
    /// In a colour, unless a colour around it counts.
    Colored(SolidId, Color),
    /// As `render()` shows it: colours inside do not count.
    Plain(SolidId),
    /// With the modifier `#`.
    Marked(SolidId),
}

/// All solids of a file, and the lines that they come from.
#[derive(Debug, Default)]
pub(super) struct Solids {
    pub parts: Vec<Part>,
    pub lines: Vec<u32>,
}

impl Solids {
    pub fn push(&mut self, line: u32, part: Part) -> SolidId {
        self.parts.push(part);
        self.lines.push(line);
        self.parts.len() as u32 - 1
    }

    pub fn leaf(&mut self, line: u32, leaf: Leaf) -> SolidId {
        self.push(line, Part::Leaf(leaf))
    }

    /// Adds an operator; of one operand it is the operand.
    pub fn op(&mut self, line: u32, operator: Operator, operands: Vec<SolidId>) -> SolidId {
        match operands[..] {
            [only] => only,
            _ => self.push(line, Part::Op(operator, operands)),
        }
    }

    pub fn placed(&mut self, line: u32, solid: SolidId, by: DAffine3) -> SolidId {
        match by == DAffine3::IDENTITY {
            true => solid,
            false => self.push(line, Part::Placed(solid, by)),
        }
    }
}

impl Solids {
    /// Copies a solid with all that it is made of.
    pub fn copy(&mut self, solid: SolidId) -> SolidId {
        let mut ids = vec![solid];
        let mut next = 0;
        while let Some(id) = ids.get(next) {
            match &self.parts[*id as usize] {
                Part::Leaf(_) => {}
                Part::Op(_, operands) => ids.extend_from_slice(&operands.clone()),
                Part::Placed(of, _) | Part::Colored(of, _) | Part::Plain(of) | Part::Marked(of) => {
                    ids.push(*of);
                }
            }
            next += 1;
        }
        // Parts have lower numbers than what is made of them.
        ids.sort_unstable();
        let mut copies = std::collections::HashMap::new();
        for id in &ids {
            let mut part = self.parts[*id as usize].clone();
            match &mut part {
                Part::Leaf(_) => {}
                Part::Op(_, operands) => operands.iter_mut().for_each(|of| *of = copies[of]),
                Part::Placed(of, _) | Part::Colored(of, _) | Part::Plain(of) | Part::Marked(of) => {
                    *of = copies[of];
                }
            }
            let line = self.lines[*id as usize];
            copies.insert(*id, self.push(line, part));
        }
        copies[&solid]
    }
}
