//! Solids made of solids: declared where they stand, joined to their operands when
//! every name is known.

use super::lower::{Names, find, find_at};
use super::lower_shape::one;
use super::lower_transform::transform;
use super::schema::{self, Operand as Row};
use super::source_spans::At;
use super::tree::Source;
use crate::LoadError;
use crate::scene::{CsgId, Operand, Operator, SceneBuilder, ShapeId};

/// A CSG solid whose operands are still names.
pub(super) struct Declared {
    pub shape: ShapeId,
    id: CsgId,
    operands: Vec<At<Row>>,
    material: Option<At<String>>,
}

/// A row of a CSG solid's kind.
pub(super) fn declare(name: &str, row: schema::Shape, scene: &mut SceneBuilder) -> Declared {
    let (operator, operands) = match row {
        schema::Shape {
            union: Some(all), ..
        } => (Operator::Union, all),
        schema::Shape {
            intersection: Some(all),
            ..
        } => (Operator::Intersection, all),
        schema::Shape {
            difference: Some(all),
            ..
        } => (Operator::Difference, all),
        schema::Shape { xor: Some(all), .. } => (Operator::Xor, all),
        schema::Shape { complement, .. } => {
            (Operator::Complement, complement.into_iter().collect())
        }
    };
    let (shape, id) = scene.declare_csg(name, operator);
    if let Some(tolerance) = row.tolerance {
        scene.set_tolerance(id, tolerance.value);
    }
    Declared {
        shape,
        id,
        operands,
        material: row.material,
    }
}

/// What only CSG solids have, on a row of another kind.
pub(super) fn refuse_extras(
    source: &Source,
    kind: &str,
    row: &schema::Shape,
) -> Result<(), LoadError> {
    const ONLY: &str = "only a union, intersection, difference, xor or complement can";
    if let Some(material) = &row.material {
        let message = format!(
            "{} cannot have a material of its own; {ONLY}. Give it where the shape is \
             placed: to the instance, child or operand",
            one(kind)
        );
        return Err(source.error(material.at, message));
    }
    if let (Some(motion), None) = (&row.motion, &row.mesh) {
        let message = format!(
            "{} cannot have a motion of its own; only a mesh can. Give it where the shape is \
             placed: to the instance or child",
            one(kind)
        );
        return Err(source.error(motion.at, message));
    }
    if let (Some(parts), None) = (&row.parts, &row.mesh) {
        let message = format!(
            "{} cannot have parts; only a mesh can. Leave them out",
            one(kind)
        );
        return Err(source.error(parts.at, message));
    }
    if let Some(tolerance) = &row.tolerance {
        let message = format!("{} cannot have a tolerance; {ONLY}", one(kind));
        return Err(source.error(tolerance.at, message));
    }
    Ok(())
}

/// Operands may be defined after what they are part of.
pub(super) fn join(
    names: &Names,
    declared: &[Declared],
    scene: &mut SceneBuilder,
) -> Result<(), LoadError> {
    let mut operands = Vec::new();
    for csg in declared {
        operands.clear();
        for row in &csg.operands {
            operands.push(operand(names, row, scene)?);
        }
        scene.set_operands(csg.id, &operands);
        if let Some(name) = &csg.material {
            let material = find(names.source, "material", names.materials, name)?;
            scene.set_csg_material(csg.id, material);
        }
    }
    Ok(())
}

fn operand(names: &Names, row: &At<Row>, scene: &mut SceneBuilder) -> Result<Operand, LoadError> {
    let shape = |name: &str, at: usize| find_at(names.source, "shape", names.shapes, name, at);
    let placed = match &row.value {
        Row::Name(name) => return shape(name, row.at).map(Operand::shape),
        Row::Placed(placed) => placed,
    };
    let mut operand = Operand::shape(shape(&placed.shape.value, placed.shape.at)?);
    if let Some(steps) = &placed.transform {
        operand = operand.transform(scene.transform(transform(names.source, steps)?));
    }
    if let Some(name) = &placed.material {
        operand = operand.material(find(names.source, "material", names.materials, name)?);
    }
    Ok(operand)
}
